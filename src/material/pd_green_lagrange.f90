!> Green-Lagrange strain and second Piola-Kirchhoff stress.
!>
!>   E = (F^T F - I) / 2 = (H + H^T + H^T H) / 2,   P = F S
!>
!> Source: doc/theory.md, section 2.
module pd_green_lagrange
  use pd_kinds, only: n_block, wp
  use pd_measure, only: cauchy_stress, measure_t, n_kept
  implicit none
  private

  public :: green_lagrange_t

  type, extends(measure_t) :: green_lagrange_t
  contains
    procedure, nopass :: strain_block
    procedure, nopass :: first_piola_block
    procedure, nopass :: cauchy
    procedure, nopass :: stiffening
  end type green_lagrange_t

contains

  !> E of rows lo to hi.
  pure subroutine strain_block(first, lo, hi, h, e, kept)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    real(wp), intent(inout) :: kept(n_block, n_kept) !! nothing
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - first + 1
      e(b, 1) = h(i, 1) + 0.5_wp * (h(i, 1)**2 + h(i, 3)**2)
      e(b, 2) = h(i, 4) + 0.5_wp * (h(i, 4)**2 + h(i, 2)**2)
      e(b, 3) = 0.0_wp
      e(b, 4) = 0.5_wp * (h(i, 2) + h(i, 3) + h(i, 1) * h(i, 2) + h(i, 3) * h(i, 4))
    end do
    associate (unused => kept)
    end associate
  end subroutine strain_block

  !> P = S + H S of rows lo to hi.
  pure subroutine first_piola_block(first, lo, hi, h, s, kept, p)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in),    contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
    real(wp), intent(in)    :: kept(n_block, n_kept) !! nothing
    real(wp), intent(inout), contiguous :: p(:, :)   !! out: P xx xy yx yy; row 1 is row `first`
    real(wp) :: fxx, fyy
    integer  :: i, b

    !$omp simd simdlen(8) private(b, fxx, fyy)
    do i = lo, hi
      b = i - first + 1
      fxx = 1.0_wp + h(i, 1)
      fyy = 1.0_wp + h(i, 4)
      p(b, 1) = fxx * s(i, 1) + h(i, 2) * s(i, 4)
      p(b, 2) = fxx * s(i, 4) + h(i, 2) * s(i, 2)
      p(b, 3) = h(i, 3) * s(i, 1) + fyy * s(i, 4)
      p(b, 4) = h(i, 3) * s(i, 4) + fyy * s(i, 2)
    end do
    associate (unused => kept)
    end associate
  end subroutine first_piola_block

  !> Largest l^2 + S / (lambda + 2 G) of rows lo to hi, with the largest principal stretch l and
  !> stress S: dP = F C : (F^T dF) + dF S along the principal axes.
  pure function stiffening(lo, hi, h, s, modulus) result(largest)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
    real(wp), intent(in) :: modulus               !! lambda + 2 G [Pa]
    real(wp) :: largest, mean, difference, shear, stress
    integer  :: i

    largest = 0.0_wp
    !$omp simd simdlen(8) private(mean, difference, shear, stress) reduction(max:largest)
    do i = lo, hi
      mean = 1.0_wp + (h(i, 1) + h(i, 4)) &
        + 0.5_wp * (h(i, 1)**2 + h(i, 2)**2 + h(i, 3)**2 + h(i, 4)**2)
      difference = (h(i, 1) - h(i, 4)) &
        + 0.5_wp * (h(i, 1)**2 + h(i, 3)**2 - h(i, 2)**2 - h(i, 4)**2)
      shear = h(i, 2) + h(i, 3) + h(i, 1) * h(i, 2) + h(i, 3) * h(i, 4)
      stress = 0.5_wp * (s(i, 1) + s(i, 2)) + sqrt(0.25_wp * (s(i, 1) - s(i, 2))**2 + s(i, 4)**2)
      largest = max(largest, mean + sqrt(difference**2 + shear**2) + stress / modulus)
    end do
  end function stiffening

  !> Cauchy stress P F^T / det F.
  pure function cauchy(h, s) result(sigma)
    real(wp), intent(in) :: h(4)   !! H xx xy yx yy
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    real(wp) :: p(1, 4), kept(n_block, n_kept)

    call first_piola_block(1, 1, 1, reshape(h, [1, 4]), reshape(s, [1, 4]), kept, p)
    sigma = cauchy_stress(h, p(1, :), s(3))
  end function cauchy

end module pd_green_lagrange
