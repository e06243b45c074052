!> Logarithmic strain and the stress conjugate to it.
!>
!>   E = (1/2) ln(F^T F),   P = F (T : dE/dE_G),   E_G = (F^T F - I) / 2
!>
!> In the plane, with J = det F, b = 1 + tr E_G, D the deviator of E_G in the plane, d^2 = 2 D : D
!> (the principal values of F^T F are b +- d, and J^2 = b^2 - d^2):
!>
!>   E = (1/2) ln J I + k D,   k = artanh(d/b) / d
!>   P = t F^-T + F (k T' + (T' : D) (2 (b/J^2 - k)/d^2 D - I/J^2))
!>
!> t is the mean of T in the plane, T' its deviator there. Both logarithms are artanh(z) of a number
!> that is small where the strain is, ln J = 2 artanh((J - 1)/(J + 1)): small strains keep their
!> digits, equal principal values are no special case, and there is no eigenframe.
!> Source: doc/theory.md, section 2; Miehe, Apel and Lambrecht (2002).
module pd_logarithmic
  use pd_kinds, only: n_block, wp
  use pd_measure, only: cauchy_stress, measure_t, n_kept
  implicit none
  private

  public :: logarithmic_t

  type, extends(measure_t) :: logarithmic_t
  contains
    procedure, nopass :: strain_block
    procedure, nopass :: first_piola_block
    procedure, nopass :: cauchy
    procedure, nopass :: stiffening
  end type logarithmic_t

  !> Up to this z^2 a quotient of polynomials is artanh(z)/z to round-off. Rows beyond them, with
  !> principal stretches in a ratio above 1.7 or a J outside of 0.82 to 1.22, call the logarithm.
  real(wp), parameter :: near = 0.25_wp, near_volume = 0.01_wp
  !> Their coefficients: Pade approximants, [7/7] and [3/3].
  real(wp), parameter :: upper(7) = [&
    -286.0_wp / 87.0_wp, 1837.0_wp / 435.0_wp, -1628.0_wp / 609.0_wp, &
    15527.0_wp / 18009.0_wp, -43322.0_wp / 330165.0_wp, 1811401.0_wp / 244652265.0_wp, &
    -4194304.0_wp / 62386327575.0_wp]
  real(wp), parameter :: lower(7) = [&
    -105.0_wp / 29.0_wp, 455.0_wp / 87.0_wp, -1001.0_wp / 261.0_wp, &
    1001.0_wp / 667.0_wp, -1001.0_wp / 3335.0_wp, 1001.0_wp / 38019.0_wp, &
    -143.0_wp / 215441.0_wp]
  real(wp), parameter :: upper_volume(3) = [-50.0_wp / 39.0_wp, 283.0_wp / 715.0_wp, &
    -256.0_wp / 15015.0_wp]
  real(wp), parameter :: lower_volume(3) = [&
    -21.0_wp / 13.0_wp, 105.0_wp / 143.0_wp, -35.0_wp / 429.0_wp]
  !> These keep quotients finite where d = 0, and at points that have failed.
  real(wp), parameter :: smallest = 1.0e-200_wp, smallest_j = 1.0e-20_wp, smallest_b = 1.0e-10_wp

contains

  !> E of rows lo to hi; 0 where det F is not positive.
  pure subroutine strain_block(first, lo, hi, h, e, kept)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    real(wp), intent(inout) :: kept(n_block, n_kept) !! out: 1/J, k, (b/J^2 - k)/d^2, 2 D_xx,
                                                     !! 2 D_xy; row 1 is row `first`
    real(wp) :: growth, b, difference, shear, d2, j, y, z, common, half_log, slope, n_far
    integer  :: i, shift

    shift = 1 - first
    n_far = 0.0_wp
    !$omp simd simdlen(8) private(growth, b, difference, shear, d2, j, y, z, common) &
    !$omp private(half_log, slope) reduction(+:n_far)
    do i = lo, hi
      call invariants(h(i, 1), h(i, 2), h(i, 3), h(i, 4), growth, b, difference, shear)
      d2 = max(smallest, difference**2 + shear**2)
      j = max(smallest_j, 1.0_wp + growth)
      z = max(1.0_wp, 2.0_wp + growth)
      common = 1.0_wp / ((b**2 * z) * (j * d2))   ! divisions cost most here
      kept(i + shift, 1) = (b**2 * z) * d2 * common
      kept(i + shift, 3) = (b**2 * z) * j * common
      kept(i + shift, 4) = difference
      kept(i + shift, 5) = shear
      y = d2 * (z * (j * d2) * common)
      z = growth * (b**2 * (j * d2) * common)
      n_far = n_far + merge(1.0_wp, 0.0_wp, max(y, z**2 * (near / near_volume)) > near)
      y = min(y, near)
      d2 = min(z**2, near_volume)
      common = 1.0_wp / (polynomial_volume(lower_volume, d2) * (polynomial(lower, y) * b))
      half_log = z * polynomial_volume(upper_volume, d2) * (polynomial(lower, y) * b) * common
      slope = polynomial(upper, y) * polynomial_volume(lower_volume, d2) * common
      kept(i + shift, 2) = slope
      kept(i + shift, 3) = kept(i + shift, 3) * (b * kept(i + shift, 1)**2 - slope)
      e(i + shift, 1) = half_log + 0.5_wp * slope * difference
      e(i + shift, 2) = half_log - 0.5_wp * slope * difference
      e(i + shift, 3) = 0.0_wp
      e(i + shift, 4) = 0.5_wp * slope * shear
    end do
    if (n_far > 0.5_wp) call strain_of_far_rows(first, lo, hi, h, e, kept)
  end subroutine strain_block

  !> The same for those rows whose logarithms are beyond the polynomials.
  pure subroutine strain_of_far_rows(first, lo, hi, h, e, kept)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! E xx yy zz xy; row 1 is row `first`
    real(wp), intent(inout) :: kept(n_block, n_kept)
    real(wp), parameter :: nearly = 1.0_wp - 1.0e-12_wp   ! no row is left out
    real(wp) :: growth, b, difference, shear, d, half_log, slope
    integer  :: i, r

    do i = lo, hi
      r = i - first + 1
      call invariants(h(i, 1), h(i, 2), h(i, 3), h(i, 4), growth, b, difference, shear)
      d = sqrt(max(smallest, difference**2 + shear**2))
      if (d**2 <= nearly * near * b**2 .and. &
        growth**2 <= nearly * near_volume * max(1.0_wp, 2.0_wp + growth)**2) cycle
      half_log = 0.0_wp
      slope = 0.0_wp
      if (1.0_wp + growth > 0.0_wp) then
        half_log = 0.5_wp * log(1.0_wp + growth)
        slope = kept(r, 2)
        if (d**2 > nearly * near * b**2) slope = (log(b + d) - 2.0_wp * half_log) / d
        kept(r, 3) = (b * kept(r, 1)**2 - slope) / d**2
      end if
      kept(r, 2) = slope
      e(r, :) = [half_log + 0.5_wp * slope * difference, half_log - 0.5_wp * slope * difference, &
        0.0_wp, 0.5_wp * slope * shear]
    end do
  end subroutine strain_of_far_rows

  !> P of rows lo to hi, with det F > 0.
  pure subroutine first_piola_block(first, lo, hi, h, s, kept, p)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in),    contiguous :: s(:, :)   !! T (n,4) xx yy zz xy [Pa]
    real(wp), intent(in)    :: kept(n_block, n_kept) !! of `strain_block`
    real(wp), intent(inout), contiguous :: p(:, :)   !! out: P xx xy yx yy; row 1 is row `first`
    real(wp) :: fxx, fyy, slope, work, along, t, sxx, syy, sxy
    integer  :: i, shift

    shift = 1 - first
    !$omp simd simdlen(8) private(fxx, fyy, slope, work, along, t, sxx, syy, sxy)
    do i = lo, hi
      fxx = 1.0_wp + h(i, 1)
      fyy = 1.0_wp + h(i, 4)
      work = 0.5_wp * (s(i, 1) - s(i, 2)) * kept(i + shift, 4) + s(i, 4) * kept(i + shift, 5)
      along = kept(i + shift, 3) * work
      work = work * kept(i + shift, 1)**2
      t = 0.5_wp * (s(i, 1) + s(i, 2)) * kept(i + shift, 1)
      slope = kept(i + shift, 2)
      sxx = 0.5_wp * slope * (s(i, 1) - s(i, 2)) + along * kept(i + shift, 4)
      syy = -sxx - work
      sxx = sxx - work
      sxy = slope * s(i, 4) + along * kept(i + shift, 5)
      p(i + shift, 1) = t * fyy + (fxx * sxx + h(i, 2) * sxy)
      p(i + shift, 2) = -t * h(i, 3) + (fxx * sxy + h(i, 2) * syy)
      p(i + shift, 3) = -t * h(i, 2) + (h(i, 3) * sxx + fyy * sxy)
      p(i + shift, 4) = t * fxx + (h(i, 3) * sxy + fyy * syy)
    end do
  end subroutine first_piola_block

  !> Largest (1 - T / (lambda + 2 G)) / l^2 of rows lo to hi, with the smallest principal stretch l
  !> and stress T: P = T / l along the principal axes. A J that is not positive counts as small.
  pure function stiffening(lo, hi, h, s, modulus) result(largest)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: s(:, :)   !! T (n,4) xx yy zz xy [Pa]
    real(wp), intent(in) :: modulus               !! lambda + 2 G [Pa]
    real(wp) :: largest, growth, b, difference, shear, stress
    integer  :: i

    largest = 0.0_wp
    !$omp simd simdlen(8) private(growth, b, difference, shear, stress) reduction(max:largest)
    do i = lo, hi
      call invariants(h(i, 1), h(i, 2), h(i, 3), h(i, 4), growth, b, difference, shear)
      stress = 0.5_wp * (s(i, 1) + s(i, 2)) - sqrt(0.25_wp * (s(i, 1) - s(i, 2))**2 + s(i, 4)**2)
      ! the squares of the principal stretches are b +- d, their product is J^2
      largest = max(largest, (1.0_wp - stress / modulus) * (b + sqrt(difference**2 + shear**2)) &
        / max(smallest_j, 1.0_wp + growth)**2)
    end do
  end function stiffening

  !> What F^T F consists of; in H, so that small strains keep their digits.
  pure subroutine invariants(hxx, hxy, hyx, hyy, growth, b, difference, shear)
    real(wp), intent(in)  :: hxx, hxy, hyx, hyy
    real(wp), intent(out) :: growth       !! J - 1
    real(wp), intent(out) :: b            !! half its trace; above 0, as F = 0 would not be
    real(wp), intent(out) :: difference   !! half that of its components xx and yy: 2 D_xx
    real(wp), intent(out) :: shear        !! its component xy: 2 D_xy

    growth = hxx + hyy + (hxx * hyy - hxy * hyx)
    b = max(smallest_b, &
      1.0_wp + (hxx + hyy) + 0.5_wp * (hxx**2 + hxy**2 + hyx**2 + hyy**2))
    difference = hxx - hyy + 0.5_wp * ((hxx - hxy) * (hxx + hxy) + (hyx - hyy) * (hyx + hyy))
    shear = hxy + hyx + hxx * hxy + hyx * hyy
  end subroutine invariants

  !> 1 + c_1 y + ... + c_7 y^7.
  pure real(wp) function polynomial(c, y)
    real(wp), intent(in) :: c(7), y

    polynomial = 1.0_wp + y * (c(1) + y * (c(2) + y * (c(3) + y * (c(4) &
      + y * (c(5) + y * (c(6) + y * c(7)))))))
  end function polynomial

  !> 1 + c_1 y + ... + c_3 y^3.
  pure real(wp) function polynomial_volume(c, y) result(polynomial)
    real(wp), intent(in) :: c(3), y

    polynomial = 1.0_wp + y * (c(1) + y * (c(2) + y * c(3)))
  end function polynomial_volume

  !> Cauchy stress P F^T / det F.
  pure function cauchy(h, s) result(sigma)
    real(wp), intent(in) :: h(4)   !! H xx xy yx yy
    real(wp), intent(in) :: s(4)   !! T xx yy zz xy [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    real(wp) :: e(1, 4), p(1, 4), kept(n_block, n_kept)

    call strain_block(1, 1, 1, reshape(h, [1, 4]), e, kept)
    call first_piola_block(1, 1, 1, reshape(h, [1, 4]), reshape(s, [1, 4]), kept, p)
    sigma = cauchy_stress(h, p(1, :), s(3))
  end function cauchy

end module pd_logarithmic
