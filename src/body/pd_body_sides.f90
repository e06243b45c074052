!> The sides of a body on a lattice: the points of its outermost lines.
!>
!> Source: doc/theory.md, section 7.
module pd_body_sides
  use pd_body, only: body_t, grid_t
  use pd_kinds, only: wp
  use pd_places, only: places_t
  use pd_point_sets, only: side_t
  use pd_region, only: length_within
  use pd_sides, only: normal_axis, outward, side_count, side_names
  implicit none
  private

  public :: find_sides

contains

  !> Points on the outermost line of the body at each side. Parts of the body that are set back from
  !> that line do not belong to the side.
  subroutine find_sides(places, rows, shift, body)
    type(places_t), intent(in)    :: places
    integer,        intent(in)    :: rows(2)   !! of the strip: its points are added
    integer,        intent(in)    :: shift     !! from numbers of points in the places to those
                                                !! in the body
    type(body_t),   intent(inout) :: body
    integer :: first, k, last

    do k = 1, side_count
      associate (side => body%sides(k), along => 3 - normal_axis(side_names(k)), &
        line => places%line(k), low => lbound(places%number), high => ubound(places%number))
        side%name = trim(side_names(k))
        side%axis = 3 - along
        side%outward = outward(side%name)
        side%lower = body%lower(along)
        side%upper = body%upper(along)
        if (.not. allocated(side%points)) allocate (side%points(0), side%from(0), side%to(0))
        if (along == 1) then   ! the outermost places hold no point
          if (line < rows(1) .or. line > rows(2)) cycle
          call add_to_side(places, low(1), places%number(:, line), k, shift, body%grid, side)
        else
          first = max(rows(1) - 1, low(2))
          last = min(rows(2) + 1, high(2))
          call add_to_side(places, first, places%number(line, first:last), k, shift, body%grid, &
            side)
        end if
      end associate
    end do
  end subroutine find_sides

  !> The points of one line of places but for the first and the last place, and the part of the side
  !> that each has.
  pure subroutine add_to_side(places, first, number, k, shift, grid, side)
    type(places_t), intent(in)    :: places
    integer,        intent(in)    :: first             !! index of the first place
    integer,        intent(in)    :: number(first:)    !! of their points in these places; 0: none
    integer,        intent(in)    :: k                 !! number of the side
    integer,        intent(in)    :: shift             !! to their numbers in the body
    type(grid_t),   intent(in)    :: grid
    type(side_t),   intent(inout) :: side
    real(wp), allocatable :: ends(:, :)
    integer,  allocatable :: points(:)
    integer :: i, n

    associate (last => ubound(number, 1))
      allocate (points, source=pack(number(first + 1:last - 1), number(first + 1:last - 1) > 0))
      allocate (ends(size(points), 2))
      n = 0
      do i = first + 1, last - 1
        if (number(i) == 0) cycle
        n = n + 1
        ends(n, :) = [0.0_wp, 1.0_wp]
        if (.not. grid%offset > 0.0_wp) ends(n, :) = [-part_of_side(places, k, i, -1, &
          number(i - 1) > 0), part_of_side(places, k, i, 1, number(i + 1) > 0)]
        ends(n, :) = grid%origin(3 - side%axis) + (real(i, wp) + ends(n, :)) * grid%spacing
      end do
    end associate
    side%points = [side%points, points + shift]
    side%from = [side%from, ends(:, 1)]
    side%to = [side%to, ends(:, 2)]
  end subroutine add_to_side

  !> How far the part of side k that belongs to the point at place i goes in a direction [spacings]:
  !> halfway to the next point, or to the end of the side.
  pure real(wp) function part_of_side(places, k, i, direction, has_next) result(part)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: k, i, direction
    logical,        intent(in) :: has_next    !! there is a point at the next place
    real(wp), parameter :: just_inside = 1.0e-4_wp
    real(wp) :: ends(2)
    integer  :: along, square(2)

    along = 3 - normal_axis(side_names(k))
    square(along) = i + min(direction, 0)
    square(3 - along) = places%line(k) - merge(1, 0, outward(side_names(k)) > 0)
    part = 0.0_wp
    if (.not. places%filled(square(1), square(2))) return
    part = 0.5_wp
    if (places%whole(square(1), square(2))) return
    ends = real(i, wp) + merge(0.5_wp, 1.0_wp, has_next) * [min(direction, 0), max(direction, 0)]
    part = length_within(places%shapes, along, places%box(3 - along, merge(2, 1, &
      outward(side_names(k)) > 0)) - just_inside * real(outward(side_names(k)), wp), ends)
  end function part_of_side

end module pd_body_sides
