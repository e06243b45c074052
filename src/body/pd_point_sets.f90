!> Sets of points: what boundaries hold and what loads act on.
!>
!> A set is a name and the numbers of its points. Where it comes from (a layer of a lattice, a name
!> in a cloud, a side) no longer matters to supports and loads.
!> Source: doc/theory.md, section 7.
module pd_point_sets
  use pd_kinds, only: wp
  implicit none
  private

  public :: point_set_t, side_t, boundary_set

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

end module pd_point_sets
