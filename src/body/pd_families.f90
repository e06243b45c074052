!> Families: the one horizon test, and the weight of a bond.
!>
!> Source: doc/theory.md, section 1.
module pd_families
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_cells, only: cells_t, neighbourhood
  use pd_kinds, only: wp
  implicit none
  private

  public :: horizon_t, new_horizon, within_horizon, influence, family

  integer, parameter :: unknown = 0, gaussian = 1, constant = 2, conical = 3

  !> Radius and influence function.
  type :: horizon_t
    real(wp) :: delta                    !! [m]
    integer, private :: shape = unknown
  end type horizon_t

contains

  !> Horizon with one of the influence functions 'gaussian', 'constant', 'conical'.
  pure type(horizon_t) function new_horizon(delta, influence_function) result(horizon)
    real(wp),     intent(in) :: delta    !! [m]
    character(*), intent(in) :: influence_function

    horizon%delta = delta
    select case (influence_function)
    case ('gaussian')
      horizon%shape = gaussian
    case ('constant')
      horizon%shape = constant
    case ('conical')
      horizon%shape = conical
    case default
      horizon%shape = unknown
    end select
  end function new_horizon

  !> Whether a bond belongs to the family: |xi| <= delta (1 + 1e-6). On a lattice many bonds are
  !> exactly delta long; without the tolerance round-off would decide about each of them.
  elemental logical function within_horizon(horizon, length_squared)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: length_squared   !! |xi|^2 [m^2]
    real(wp), parameter :: tolerance = 1.0e-6_wp

    within_horizon = length_squared <= (horizon%delta * (1.0_wp + tolerance))**2
  end function within_horizon

  !> Influence function omega(|xi|); not a number where the horizon has none.
  elemental real(wp) function influence(horizon, length_squared) result(omega)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: length_squared   !! |xi|^2 [m^2]

    select case (horizon%shape)
    case (gaussian)
      omega = exp(-length_squared / horizon%delta**2)
    case (constant)
      omega = 1.0_wp
    case (conical)
      omega = max(0.0_wp, 1.0_wp - sqrt(length_squared) / horizon%delta)
    case default
      omega = ieee_value(1.0_wp, ieee_quiet_nan)
    end select
  end function influence

  !> Family of point i in ascending order, so that sums over it do not depend on the search.
  pure subroutine family(horizon, cells, position, i, members, n_members)
    type(horizon_t), intent(in)    :: horizon
    type(cells_t),   intent(in)    :: cells
    real(wp),        intent(in)    :: position(:, :)   !! (n,2) [m]
    integer,         intent(in)    :: i
    integer,         intent(inout) :: members(:)       !! at least largest_neighbourhood long
    integer,         intent(out)   :: n_members
    integer :: b, j, k, n_near

    call neighbourhood(cells, position(i, :), members, n_near)
    n_members = 0
    do b = 1, n_near
      j = members(b)
      if (j == i) cycle
      if (.not. within_horizon(horizon, (position(j, 1) - position(i, 1))**2 &
        + (position(j, 2) - position(i, 2))**2)) cycle
      k = n_members
      do while (k > 0)
        if (members(k) < j) exit
        members(k + 1) = members(k)
        k = k - 1
      end do
      members(k + 1) = j
      n_members = n_members + 1
    end do
  end subroutine family

end module pd_families
