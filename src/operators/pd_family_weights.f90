!> Sums of the weights over the families of a lattice, bond by bond.
!>
!> Source: doc/theory.md, sections 2 and 4.
module pd_family_weights
  use pd_kinds, only: i8, n_block, wp
  implicit none
  private

  public :: bond_count_t, weigh_families, count_bonds, add_zero_energy

  !> Bonds of some rows.
  type :: bond_count_t
    integer :: fewest = huge(1)      !! of any point
    integer :: poorest = 0           !! row of the first point that has so few; 0: there is no point
    integer(i8) :: bonds = 0_i8      !! of all, directed
  end type bond_count_t

contains

  !> W_i = sum_j omega V_0 share_j, s_i = sum_j omega V_0 share_j xi and the bonds of some rows.
  pure subroutine weigh_families(shift, xi, weight, share, rows, total, moment, bonds)
    integer,  intent(in)  :: shift(:)                 !! half of the offsets (pairs)
    real(wp), intent(in)  :: xi(:, :), weight(:)      !! (pairs,2) [m], omega V_0 (pairs) [m^2]
    real(wp), intent(in), contiguous :: share(:)      !! (n)
    integer,  intent(in)  :: rows(2)                  !! first and last
    real(wp), intent(out) :: total(n_block), moment(n_block, 2)   !! row 1 is the first of them
    integer,  intent(out) :: bonds(n_block)
    real(wp) :: plus, minus
    integer  :: i, k, s

    total = 0.0_wp
    moment = 0.0_wp
    bonds = 0
    do k = 1, size(shift)
      s = shift(k)
      do i = 1, rows(2) - rows(1) + 1
        plus = weight(k) * share(rows(1) - 1 + i + s)
        minus = weight(k) * share(rows(1) - 1 + i - s)
        total(i) = total(i) + plus + minus
        moment(i, 1) = moment(i, 1) + (plus - minus) * xi(k, 1)
        moment(i, 2) = moment(i, 2) + (plus - minus) * xi(k, 2)
        bonds(i) = bonds(i) + merge(1, 0, plus > 0.0_wp) + merge(1, 0, minus > 0.0_wp)
      end do
    end do
  end subroutine weigh_families

  !> How many bonds there are.
  pure type(bond_count_t) function count_bonds(first, bonds, share) result(count)
    integer,  intent(in) :: first       !! row
    integer,  intent(in) :: bonds(:)    !! of the rows from there on
    real(wp), intent(in) :: share(:)    !! of these rows
    integer :: i

    do i = 1, size(bonds)
      if (share(i) <= 0.0_wp) cycle
      count%bonds = count%bonds + int(bonds(i), i8)
      if (bonds(i) >= count%fewest) cycle
      count%fewest = bonds(i)
      count%poorest = first - 1 + i
    end do
  end function count_bonds

  !> z2 <- z2 + sum_j omega V_0 share_j |u_j - u_i - H_i xi|^2 of some rows; voids: 0.
  pure subroutine add_zero_energy(shift, xi, weight, share, rows, u, h, z2)
    integer,  intent(in) :: shift(:)                 !! half of the offsets (pairs)
    real(wp), intent(in) :: xi(:, :), weight(:)      !! (pairs,2) [m], omega V_0 (pairs) [m^2]
    real(wp), intent(in),    contiguous :: share(:)  !! (n)
    integer,  intent(in) :: rows(2)                  !! first and last
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)     !! (n) [m^4]
    real(wp) :: x, y, w, ax, ay, plus, minus
    integer  :: i, k, s

    do k = 1, size(shift)
      s = shift(k)
      x = xi(k, 1)
      y = xi(k, 2)
      w = weight(k)
      !$omp simd simdlen(8) private(ax, ay, plus, minus)
      do i = rows(1), rows(2)
        ax = h(i, 1) * x + h(i, 2) * y
        ay = h(i, 3) * x + h(i, 4) * y
        plus = (u(i + s, 1) - u(i, 1) - ax)**2 + (u(i + s, 2) - u(i, 2) - ay)**2
        minus = (u(i - s, 1) - u(i, 1) + ax)**2 + (u(i - s, 2) - u(i, 2) + ay)**2
        z2(i) = z2(i) + w * (share(i + s) * plus + share(i - s) * minus)
      end do
    end do
    do i = rows(1), rows(2)
      if (share(i) <= 0.0_wp) z2(i) = 0.0_wp
    end do
  end subroutine add_zero_energy

end module pd_family_weights
