!> From an inner point of a lattice to its neighbours: offsets and weights, and the columns that
!> they form.
!>
!> Source: doc/theory.md, section 1.
module pd_offsets
  use pd_columns, only: columns_t, new_columns
  use pd_families, only: horizon_t, influence, within_horizon
  use pd_kinds, only: wp
  implicit none
  private

  public :: half_of_offsets, columns_of, residual_weights

contains

  !> Half of the offsets; the others are their opposites.
  pure subroutine half_of_offsets(horizon, spacing, stride, most, shift, xi, weight)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing        !! dx [m]
    integer,         intent(in) :: stride, most   !! rows per line; columns to look at
    integer,  allocatable, intent(out) :: shift(:)    !! in rows (pairs)
    real(wp), allocatable, intent(out) :: xi(:, :)    !! (pairs,2) [m]
    real(wp), allocatable, intent(out) :: weight(:)   !! omega V_0 (pairs) [m^2]
    integer  :: k, kx, ky
    real(wp) :: offset(2), length_squared

    allocate (shift((2 * most + 1)**2), source=0)
    allocate (xi(size(shift), 2), weight(size(shift)), source=0.0_wp)
    k = 0
    do ky = 0, most
      do kx = -most, most
        if (ky == 0 .and. kx <= 0) cycle
        offset = spacing * real([kx, ky], wp)
        length_squared = offset(1)**2 + offset(2)**2
        if (.not. within_horizon(horizon, length_squared)) cycle
        k = k + 1
        shift(k) = kx + ky * stride
        xi(k, :) = offset
        weight(k) = influence(horizon, length_squared) * spacing**2
      end do
    end do
    shift = shift(:k)
    xi = xi(:k, :)
    weight = weight(:k)
  end subroutine half_of_offsets

  !> The columns of the family of an inner point.
  pure type(columns_t) function columns_of(horizon, spacing, stride, most) result(columns)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing
    integer,         intent(in) :: stride, most   !! columns to look at
    real(wp) :: weight(0:most, 0:most), length_squared
    integer  :: k, r, reach

    weight = 0.0_wp
    reach = 0
    do r = 0, most
      do k = 0, most
        length_squared = real(k**2 + r**2, wp) * spacing**2
        if (.not. within_horizon(horizon, length_squared)) cycle
        weight(k, r) = influence(horizon, length_squared) * spacing**2
        reach = max(reach, k)
      end do
    end do
    columns = new_columns(weight(:reach, :reach), spacing, stride)
  end function columns_of

  !> omega V_0 (1 - a |xi|^2) of columns and rows away; 0 for the point itself, which S leaves out.
  pure function residual_weights(xi, weight, falloff) result(residual)
    real(wp), intent(in) :: xi(:, :)         !! half of the offsets (pairs,2) [m]
    real(wp), intent(in) :: weight(:)        !! omega V_0 (pairs) [m^2]
    real(wp), intent(in) :: falloff          !! a [1/m^2]
    real(wp), allocatable :: residual(:, :)  !! (0:reach,0:reach)
    integer  :: reach, p, place(2)
    real(wp) :: spacing

    spacing = minval(xi(:, 2), mask=xi(:, 2) > 0.0_wp)
    reach = nint(maxval(xi) / spacing)
    allocate (residual(0:reach, 0:reach), source=0.0_wp)
    do p = 1, size(weight)
      place = abs(nint(xi(p, :) / spacing))
      residual(place(1), place(2)) = weight(p) * (1.0_wp - falloff * sum(xi(p, :)**2))
    end do
  end function residual_weights

end module pd_offsets
