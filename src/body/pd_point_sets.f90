!> Sets of points: what boundaries hold and what loads act on.
!>
!> A set is a name and the numbers of its points. Where it comes from (a layer of a lattice, a name
!> in a cloud, a side) no longer matters to supports and loads.
!> Source: doc/theory.md, section 7.
module pd_point_sets
  use pd_kinds, only: wp
  implicit none
  private

  public :: point_set_t, side_t, boundary_set, images_of

  type :: point_set_t
    character(:), allocatable :: name
    integer, allocatable :: points(:)           !! ascending
  end type point_set_t

  !> The points of a lattice on the outermost line of its body at one side, layers that continue it
  !> included, and the part of the side that each has: half a spacing to either side with the
  !> layout nodes, less at an end, the width of its cell with the layout cells.
  type, extends(point_set_t) :: side_t
    integer  :: axis = 0                        !! of the normal; 1: x, 2: y
    integer  :: outward = 0                     !! direction of the outward normal, 1 or -1
    real(wp) :: lower = 0.0_wp, upper = 0.0_wp  !! extent along the side without layers [m]
    real(wp), allocatable :: from(:), to(:)     !! coordinate along the side, ascending [m]
  end type side_t

contains

  !> The points of boundary k, in the order of their numbers.
  pure type(point_set_t) function boundary_set(name, owner, k) result(set)
    character(*), intent(in) :: name
    integer,      intent(in) :: owner(:)        !! boundary of every point
    integer,      intent(in) :: k
    integer :: i

    set%name = name
    allocate (set%points(count(owner == k)))
    set%points = pack([(i, i=1, size(owner))], owner == k)
  end function boundary_set

  !> What the points of a layer are images of, in a plane halfway between the layer and the body:
  !> for each of them the number of a point of the body, or of another layer beside it; 0: there is
  !> none.
  pure function images_of(points, owner, place, axis, rows) result(origin)
    integer, intent(in) :: points(:)            !! of the layer
    integer, intent(in) :: owner(:)             !! boundary of every point
    integer, intent(in) :: place(:, :)          !! column and row on the lattice (n,2)
    integer, intent(in) :: axis                 !! of the normal; 1: x, 2: y
    integer, intent(in) :: rows                 !! of points in the layer
    integer :: origin(size(points))
    integer, allocatable :: number(:, :)
    integer, dimension(2) :: here, high, low
    integer :: i, j, side

    low = minval(place, 1) - 2 * rows
    high = maxval(place, 1) + 2 * rows
    allocate (number(low(1):high(1), low(2):high(2)), source=0)
    do i = 1, size(owner)
      if (owner(i) /= owner(points(1))) number(place(i, 1), place(i, 2)) = i
    end do
    origin = 0
    do i = 1, size(points)
      search: do j = 1, rows
        do side = -1, 1, 2
          here = place(points(i), :)
          here(axis) = here(axis) + side * j
          if (number(here(1), here(2)) == 0) cycle
          here(axis) = here(axis) + side * (j - 1)
          origin(i) = number(here(1), here(2))
          exit search
        end do
      end do search
    end do
  end function images_of

end module pd_point_sets
