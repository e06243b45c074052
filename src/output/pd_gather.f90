!> Values of all points where rank 0 writes them: each rank has those of its own blocks.
module pd_gather
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: own_points, gather_points, gather_values, gather_fields

contains

  !> First and last of the points whose rows are of this rank; the last one is before the first
  !> where there are none.
  pure function own_points(blocks, row) result(ends)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)   !! of every point, ascending
    integer :: ends(2)

    ends = [points_until(row, blocks%first - 1) + 1, points_until(row, blocks%last)]
  end function own_points

  !> Points whose row is not behind a row.
  pure integer function points_until(row, last) result(points)
    integer, intent(in) :: row(:), last
    integer :: behind, middle

    points = 0
    behind = size(row) + 1
    do while (behind - points > 1)
      middle = (points + behind) / 2
      if (row(middle) <= last) then
        points = middle
      else
        behind = middle
      end if
    end do
  end function points_until

  !> Make the values of all points known to rank 0.
  subroutine gather_points(blocks, row, values)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)                  !! of every point, ascending
    real(wp), intent(inout), contiguous :: values(:, :)   !! (components,points)
    integer, allocatable :: last_points(:)
    integer :: k

    associate (ranks => blocks%ranks)
      if (.not. allocated(ranks%before)) return
      last_points = [(points_until(row, blocks%last_row_of(k)), k=-1, ranks%count - 1)]
      call ranks%collect(values, last_points)
    end associate
  end subroutine gather_points

  !> The values of a field at the points; other ranks than 0 get none.
  subroutine gather_values(blocks, row, field, values)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)              !! of every point, ascending
    real(wp),       intent(in) :: field(:)            !! (rows)
    real(wp), allocatable, intent(out) :: values(:)   !! (points)
    real(wp), allocatable :: gathered(:, :)
    integer :: ends(2)

    if (.not. allocated(blocks%ranks%before)) then
      values = field(row)
      return
    end if
    ends = own_points(blocks, row)
    allocate (gathered(1, size(row)))
    gathered(1, ends(1):ends(2)) = field(row(ends(1):ends(2)))
    call gather_points(blocks, row, gathered)
    allocate (values(0))
    if (blocks%ranks%mine == 0) values = gathered(1, :)
  end subroutine gather_values

  !> The same of a field with components.
  subroutine gather_fields(blocks, row, field, values)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)
    real(wp),       intent(in) :: field(:, :)            !! (rows,components)
    real(wp), allocatable, intent(out) :: values(:, :)   !! (points,components)
    real(wp), allocatable :: gathered(:, :)
    integer :: ends(2)

    if (.not. allocated(blocks%ranks%before)) then
      values = field(row, :)
      return
    end if
    ends = own_points(blocks, row)
    allocate (gathered(size(field, 2), size(row)))
    gathered(:, ends(1):ends(2)) = transpose(field(row(ends(1):ends(2)), :))
    call gather_points(blocks, row, gathered)
    allocate (values(0, size(field, 2)))
    if (blocks%ranks%mine == 0) values = transpose(gathered)
  end subroutine gather_fields

end module pd_gather
