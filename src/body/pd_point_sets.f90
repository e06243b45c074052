!> Sets of points: what boundaries hold and what loads act on.
!>
!> A set is a name and the numbers of its points. Where it comes from (a layer of a lattice, a name
!> in a cloud, a side) no longer matters to supports and loads.
!> Source: doc/theory.md, section 7.
module pd_point_sets
  use pd_kinds, only: wp
  implicit none
  private

  public :: point_set_t, side_t, boundary_set, columns_of

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

  !> The columns of the layer of boundary k across its side, each with the point of the body next to
  !> it first; 0: no point (most in a column, columns). Points without a neighbour are left out.
  pure function columns_of(owner, place, k, axis, rows) result(columns)
    integer, intent(in) :: owner(:)             !! boundary of every point
    integer, intent(in) :: place(:, :)          !! column and row on the lattice (n,2)
    integer, intent(in) :: k
    integer, intent(in) :: axis                 !! of the normal; 1: x, 2: y
    integer, intent(in) :: rows                 !! of points in the layer
    integer, allocatable :: columns(:, :), number(:, :)
    integer, dimension(2) :: here, high, low
    integer :: column_at(size(owner)), c, i, j, side

    low = minval(place, 1) - rows
    high = maxval(place, 1) + rows
    allocate (number(low(1):high(1), low(2):high(2)), source=0)
    do i = 1, size(owner)
      number(place(i, 1), place(i, 2)) = i
    end do
    column_at = 0
    c = 0
    allocate (columns(rows + 1, count(owner == k)), source=0)
    do i = 1, size(owner)
      if (owner(i) /= k) cycle
      search: do j = 1, rows
        do side = -1, 1, 2
          here = place(i, :)
          here(axis) = here(axis) + side * j
          associate (n => number(here(1), here(2)))
            if (n == 0) cycle
            if (owner(n) /= 0) cycle
            if (column_at(n) == 0) then
              c = c + 1
              column_at(n) = c
              columns(1, c) = n
            end if
            columns(j + 1, column_at(n)) = i
          end associate
          exit search
        end do
      end do search
    end do
    columns = columns(:, :c)
  end function columns_of

end module pd_point_sets
