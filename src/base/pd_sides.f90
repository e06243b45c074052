!> The four sides of a body by their names: the only place that compares them.
module pd_sides
  implicit none
  private

  public :: bottom, top, left, right, side_count, side_names
  public :: side_number, normal_axis, outward, covers

  integer, parameter :: bottom = 1, top = 2, left = 3, right = 4, side_count = 4

  character(6), parameter :: side_names(side_count) = &
    [character(6) :: 'bottom', 'top', 'left', 'right']
  integer, parameter :: axes(0:side_count) = [0, 2, 2, 1, 1]          ! the first: no single side
  integer, parameter :: directions(0:side_count) = [0, -1, 1, -1, 1]

contains

  !> Number of a side, 0 where there is none of that name ('all', '').
  pure integer function side_number(name) result(k)
    character(*), intent(in) :: name

    do k = side_count, 1, -1
      if (side_names(k) == name) return
    end do
  end function side_number

  !> Axis of the normal to a side, 1: x, 2: y; 0 where the name is not that of one side.
  pure integer function normal_axis(name)
    character(*), intent(in) :: name

    normal_axis = axes(side_number(name))
  end function normal_axis

  !> Direction of the outward normal along its axis, 1 or -1; 0 as above.
  pure integer function outward(name)
    character(*), intent(in) :: name

    outward = directions(side_number(name))
  end function outward

  !> Whether what lies on the side of a name, or on 'all', lies on side k.
  pure logical function covers(name, k)
    character(*), intent(in) :: name
    integer,      intent(in) :: k

    covers = name == side_names(k) .or. name == 'all'
  end function covers

end module pd_sides
