!> Green-Lagrange strain and second Piola-Kirchhoff stress.
!>
!>   E = (F^T F - I) / 2 = (H + H^T + H^T H) / 2,   P = F S
!>
!> Source: doc/theory.md, section 2.
module pd_green_lagrange
  use pd_kinds, only: wp
  use pd_measure, only: measure_t
  use pd_tensors, only: determinant
  implicit none
  private

  public :: green_lagrange_t

  type, extends(measure_t) :: green_lagrange_t
  contains
    procedure, nopass :: strain_block
    procedure, nopass :: first_piola_block
    procedure, nopass :: cauchy
  end type green_lagrange_t

contains

  !> E of rows lo to hi.
  pure subroutine strain_block(first, lo, hi, h, e)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - first + 1
      e(b, 1) = h(i, 1) + 0.5_wp * (h(i, 1)**2 + h(i, 3)**2)
      e(b, 2) = h(i, 4) + 0.5_wp * (h(i, 4)**2 + h(i, 2)**2)
      e(b, 3) = 0.0_wp
      e(b, 4) = 0.5_wp * (h(i, 2) + h(i, 3) + h(i, 1) * h(i, 2) + h(i, 3) * h(i, 4))
    end do
  end subroutine strain_block

  !> P = S + H S of rows lo to hi.
  pure subroutine first_piola_block(first, lo, hi, h, s, p)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in),    contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
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
  end subroutine first_piola_block

  !> Cauchy stress P F^T / det F.
  pure function cauchy(h, s) result(sigma)
    real(wp), intent(in) :: h(4)   !! H xx xy yx yy
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    real(wp) :: p(1, 4), j

    call first_piola_block(1, 1, 1, reshape(h, [1, 4]), reshape(s, [1, 4]), p)
    j = determinant(h)
    sigma(1) = (p(1, 1) * (1.0_wp + h(1)) + p(1, 2) * h(2)) / j
    sigma(2) = (p(1, 3) * h(3) + p(1, 4) * (1.0_wp + h(4))) / j
    sigma(3) = s(3) / j
    sigma(4) = (p(1, 1) * h(3) + p(1, 2) * (1.0_wp + h(4))) / j
  end function cauchy

end module pd_green_lagrange
