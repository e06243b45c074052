!> Small strain: the linear part of every measure, whatever the displacement.
!>
!>   E = sym H,   P = S
!>
!> Equilibrium is that of the undeformed body: what limit theorems assume. A rotation makes strain.
!> Source: doc/theory.md, section 2.
module pd_small_strain
  use pd_kinds, only: n_block, wp
  use pd_measure, only: measure_t, n_kept, small_strain_block
  implicit none
  private

  public :: small_strain_t

  type, extends(measure_t) :: small_strain_t
  contains
    procedure, nopass :: strain_block
    procedure, nopass :: first_piola_block
    procedure, nopass :: cauchy
    procedure, nopass :: stiffening
  end type small_strain_t

contains

  !> sym H of rows lo to hi.
  pure subroutine strain_block(first, lo, hi, h, e, kept)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! out: E xx yy zz xy; row 1 is row `first`
    real(wp), intent(inout) :: kept(n_block, n_kept) !! nothing

    call small_strain_block(first, lo, hi, h, e)
    associate (unused => kept)
    end associate
  end subroutine strain_block

  !> P = S of rows lo to hi.
  pure subroutine first_piola_block(first, lo, hi, h, s, kept, p)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4): without influence
    real(wp), intent(in),    contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
    real(wp), intent(in)    :: kept(n_block, n_kept) !! nothing
    real(wp), intent(inout), contiguous :: p(:, :)   !! out: P xx xy yx yy; row 1 is row `first`
    integer :: from, to

    from = lo - first + 1
    to = hi - first + 1
    p(from:to, 1) = s(lo:hi, 1)
    p(from:to, 2) = s(lo:hi, 4)
    p(from:to, 3) = s(lo:hi, 4)
    p(from:to, 4) = s(lo:hi, 2)
    associate (unused => h, unused_too => kept)
    end associate
  end subroutine first_piola_block

  !> 1: P is linear in H.
  pure function stiffening(lo, hi, h, s, modulus) result(largest)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4): without influence
    real(wp), intent(in), contiguous :: s(:, :)   !! S (n,4): without influence
    real(wp), intent(in) :: modulus               !! without influence
    real(wp) :: largest

    largest = 1.0_wp
    associate (unused => h, unused_too => s, others => lo + hi + modulus)
    end associate
  end function stiffening

  !> S: the deformed body is not told from the undeformed one.
  pure function cauchy(h, s) result(sigma)
    real(wp), intent(in) :: h(4)   !! H: without influence
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]

    sigma = s
    associate (unused => h)
    end associate
  end function cauchy

end module pd_small_strain
