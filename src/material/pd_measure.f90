!> A strain measure: the strain of a deformation, and P and Cauchy stress from its conjugate stress.
!>
!> A measure is a type that extends `measure_t`, in a module of its own. All are written in
!> H = F - I, so that small strains keep their digits.
!> Source: doc/theory.md, section 2.
module pd_measure
  use pd_kinds, only: wp
  implicit none
  private

  public :: measure_t, small_strain_block

  type, abstract :: measure_t
  contains
    procedure(strain_of), deferred, nopass :: strain_block
    procedure(first_piola_of), deferred, nopass :: first_piola_block
    procedure(cauchy_of), deferred, nopass :: cauchy
  end type measure_t

  abstract interface
    !> Strain of rows lo to hi, E_zz = 0 (plane strain).
    pure subroutine strain_of(first, lo, hi, h, e)
      import :: wp
      integer,  intent(in) :: first, lo, hi
      real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    end subroutine strain_of
    !> First Piola stress of rows lo to hi.
    pure subroutine first_piola_of(first, lo, hi, h, s, p)
      import :: wp
      integer,  intent(in) :: first, lo, hi
      real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(in),    contiguous :: s(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
      real(wp), intent(inout), contiguous :: p(:, :)   !! out: P xx xy yx yy; row 1 is row `first`
    end subroutine first_piola_of
    !> Cauchy stress of one point with det F > 0.
    pure function cauchy_of(h, s) result(sigma)
      import :: wp
      real(wp), intent(in) :: h(4)   !! H xx xy yx yy
      real(wp), intent(in) :: s(4)   !! conjugate stress xx yy zz xy [Pa]
      real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    end function cauchy_of
  end interface

contains

  !> sym H of rows lo to hi: what every measure is for small displacements.
  pure subroutine small_strain_block(first, lo, hi, h, e)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - first + 1
      e(b, 1) = h(i, 1)
      e(b, 2) = h(i, 4)
      e(b, 3) = 0.0_wp
      e(b, 4) = 0.5_wp * (h(i, 2) + h(i, 3))
    end do
  end subroutine small_strain_block

end module pd_measure
