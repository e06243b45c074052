!> Strain measures and the stresses conjugate to them.
!>
!> One measure so far: Green-Lagrange strain and second Piola-Kirchhoff stress. Another measure is
!> a pair of procedures of the same form and a branch in `pd_force`.
!> Tensors in the plane: xx yy zz xy (symmetric) or xx xy yx yy (not symmetric).
!> Source: doc/theory.md, section 2.
module pd_strain
  use pd_kinds, only: wp
  implicit none
  private

  public :: green_lagrange, first_piola, determinant, cauchy

contains

  !> E = (F^T F - I) / 2, E_zz = 0 in plane strain.
  !>
  !> Written in H = F - I, E = (H + H^T + H^T H) / 2, so that small strains keep their digits.
  pure function green_lagrange(f) result(e)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy
    real(wp) :: e(4)               !! xx yy zz xy
    real(wp) :: hxx, hyy

    hxx = f(1) - 1.0_wp
    hyy = f(4) - 1.0_wp
    e(1) = hxx + 0.5_wp * (hxx**2 + f(3)**2)
    e(2) = hyy + 0.5_wp * (hyy**2 + f(2)**2)
    e(3) = 0.0_wp
    e(4) = 0.5_wp * (f(2) + f(3) + hxx * f(2) + f(3) * hyy)
  end function green_lagrange

  !> P = F S.
  pure function first_piola(f, s) result(p)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: p(4)               !! xx xy yx yy [Pa]

    p(1) = f(1) * s(1) + f(2) * s(4)
    p(2) = f(1) * s(4) + f(2) * s(2)
    p(3) = f(3) * s(1) + f(4) * s(4)
    p(4) = f(3) * s(4) + f(4) * s(2)
  end function first_piola

  !> det F.
  pure real(wp) function determinant(f)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy

    determinant = f(1) * f(4) - f(2) * f(3)
  end function determinant

  !> Cauchy stress P F^T / det F of the stress S conjugate to the Green-Lagrange strain.
  pure function cauchy(f, s) result(sigma)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: sigma(4)           !! xx yy zz xy [Pa]
    real(wp) :: p(4), j

    p = first_piola(f, s)
    j = determinant(f)
    sigma(1) = (p(1) * f(1) + p(2) * f(2)) / j
    sigma(2) = (p(3) * f(3) + p(4) * f(4)) / j
    sigma(3) = s(3) / j
    sigma(4) = (p(1) * f(3) + p(2) * f(4)) / j
  end function cauchy

end module pd_strain
