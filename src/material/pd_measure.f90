!> A strain measure: the strain of a deformation, and P and Cauchy stress from its conjugate stress.
!>
!> A measure is a type that extends `measure_t`, in a module of its own. All are written in
!> H = F - I, so that small strains keep their digits.
!> Source: doc/theory.md, section 2.
module pd_measure
  use pd_kinds, only: n_block, wp
  use pd_tensors, only: determinant
  implicit none
  private

  public :: measure_t, n_kept, small_strain_block, cauchy_stress

  integer, parameter :: n_kept = 5   !! numbers per row that a strain leaves for its stress

  type, abstract :: measure_t
  contains
    procedure(strain_of), deferred, nopass :: strain_block
    procedure(first_piola_of), deferred, nopass :: first_piola_block
    procedure(cauchy_of), deferred, nopass :: cauchy
    procedure(stiffening_of), deferred, nopass :: stiffening
  end type measure_t

  abstract interface
    !> Strain of rows lo to hi, E_zz = 0 (plane strain).
    pure subroutine strain_of(first, lo, hi, h, e, kept)
      import :: n_block, n_kept, wp
      integer,  intent(in) :: first, lo, hi
      real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
      real(wp), intent(inout) :: kept(n_block, n_kept) !! out: for `first_piola_block`
    end subroutine strain_of
    !> First Piola stress of rows lo to hi.
    pure subroutine first_piola_of(first, lo, hi, h, s, kept, p)
      import :: n_block, n_kept, wp
      integer,  intent(in) :: first, lo, hi
      real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(in),    contiguous :: s(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
      real(wp), intent(in)    :: kept(n_block, n_kept) !! of `strain_block`
      real(wp), intent(inout), contiguous :: p(:, :)   !! out: P xx xy yx yy; row 1 is row `first`
    end subroutine first_piola_of
    !> Cauchy stress of one point with det F > 0.
    pure function cauchy_of(h, s) result(sigma)
      import :: wp
      real(wp), intent(in) :: h(4)   !! H xx xy yx yy
      real(wp), intent(in) :: s(4)   !! conjugate stress xx yy zz xy [Pa]
      real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    end function cauchy_of
    !> Largest modulus of a longitudinal wave in rows lo to hi, in terms of the reference positions,
    !> over that of the unloaded body: how much the squares of the highest frequencies may have
    !> risen. Of an elastic law; flow makes points softer.
    pure function stiffening_of(lo, hi, h, s, modulus) result(largest)
      import :: wp
      integer,  intent(in) :: lo, hi
      real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(in), contiguous :: s(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
      real(wp), intent(in) :: modulus               !! lambda + 2 G [Pa]
      real(wp) :: largest
    end function stiffening_of
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

  !> Cauchy stress P F^T / det F of one point.
  pure function cauchy_stress(h, p, zz) result(sigma)
    real(wp), intent(in) :: h(4)   !! H xx xy yx yy, det F > 0
    real(wp), intent(in) :: p(4)   !! P xx xy yx yy [Pa]
    real(wp), intent(in) :: zz     !! P_zz [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    real(wp) :: j

    j = determinant(h)
    sigma(1) = (p(1) * (1.0_wp + h(1)) + p(2) * h(2)) / j
    sigma(2) = (p(3) * h(3) + p(4) * (1.0_wp + h(4))) / j
    sigma(3) = zz / j
    sigma(4) = (p(1) * h(3) + p(2) * (1.0_wp + h(4))) / j
  end function cauchy_stress

end module pd_measure
