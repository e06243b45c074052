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
  public :: green_lagrange_block, small_strain_block, force_state_block
  public :: first_piola_block

contains

  !> E = (F^T F - I) / 2, E_zz = 0 in plane strain.
  pure function green_lagrange(f) result(e)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy
    real(wp) :: e(4)               !! xx yy zz xy

    e(3) = 0.0_wp
    call green_lagrange_in_plane(f(1), f(2), f(3), f(4), e(1), e(2), e(4))
  end function green_lagrange

  !> The same by components, for loops over points.
  !>
  !> Written in H = F - I, E = (H + H^T + H^T H) / 2, so that small strains keep their digits.
  elemental subroutine green_lagrange_in_plane(fxx, fxy, fyx, fyy, exx, eyy, exy)
    real(wp), intent(in)  :: fxx, fxy, fyx, fyy
    real(wp), intent(out) :: exx, eyy, exy
    real(wp) :: hxx, hyy

    hxx = fxx - 1.0_wp
    hyy = fyy - 1.0_wp
    exx = hxx + 0.5_wp * (hxx**2 + fyx**2)
    eyy = hyy + 0.5_wp * (hyy**2 + fxy**2)
    exy = 0.5_wp * (fxy + fyx + hxx * fxy + fyx * hyy)
  end subroutine green_lagrange_in_plane

  !> Strain of points lo to hi.
  pure subroutine green_lagrange_block(lo, hi, f, e)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! E xx yy zz xy; row 1 is point lo
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      e(b, 3) = 0.0_wp
      call green_lagrange_in_plane(f(i, 1), f(i, 2), f(i, 3), f(i, 4), e(b, 1), e(b, 2), e(b, 4))
    end do
  end subroutine green_lagrange_block

  !> E = sym F - I of points lo to hi: what the Green-Lagrange strain is for small displacements.
  pure subroutine small_strain_block(lo, hi, f, e)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: e(:, :)   !! E xx yy zz xy; row 1 is point lo
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      e(b, 1) = f(i, 1) - 1.0_wp
      e(b, 2) = f(i, 4) - 1.0_wp
      e(b, 3) = 0.0_wp
      e(b, 4) = 0.5_wp * (f(i, 2) + f(i, 3))
    end do
  end subroutine small_strain_block

  !> P = F S.
  pure function first_piola(f, s) result(p)
    real(wp), intent(in) :: f(4)   !! F xx xy yx yy
    real(wp), intent(in) :: s(4)   !! S xx yy zz xy [Pa]
    real(wp) :: p(4)               !! xx xy yx yy [Pa]

    call first_piola_in_plane(f(1), f(2), f(3), f(4), s(1), s(2), s(4), p(1), p(2), p(3), p(4))
  end function first_piola

  !> The same by components, for loops over points.
  elemental subroutine first_piola_in_plane(fxx, fxy, fyx, fyy, sxx, syy, sxy, pxx, pxy, pyx, pyy)
    real(wp), intent(in)  :: fxx, fxy, fyx, fyy, sxx, syy, sxy
    real(wp), intent(out) :: pxx, pxy, pyx, pyy

    pxx = fxx * sxx + fxy * sxy
    pxy = fxx * sxy + fxy * syy
    pyx = fyx * sxx + fyy * sxy
    pyy = fyx * sxy + fyy * syy
  end subroutine first_piola_in_plane

  !> P = F S of points lo to hi.
  pure subroutine first_piola_block(lo, hi, f, s, p)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp), intent(in),    contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
    real(wp), intent(inout), contiguous :: p(:, :)   !! P xx xy yx yy [Pa]; row 1 is point lo
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      call first_piola_in_plane(f(i, 1), f(i, 2), f(i, 3), f(i, 4), s(i, 1), s(i, 2), s(i, 4), &
        p(b, 1), p(b, 2), p(b, 3), p(b, 4))
    end do
  end subroutine first_piola_block

  !> A = P K^-1 of points lo to hi, P = F S.
  pure subroutine force_state_block(lo, hi, f, s, k, a)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp), intent(in),    contiguous :: s(:, :)   !! S (n,4) xx yy zz xy [Pa]
    real(wp), intent(in),    contiguous :: k(:, :)   !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), intent(inout), contiguous :: a(:, :)   !! A (n,4) xx xy yx yy [N/m^6]
    real(wp) :: pxx, pxy, pyx, pyy
    integer  :: i

    !$omp simd simdlen(8) private(pxx, pxy, pyx, pyy)
    do i = lo, hi
      call first_piola_in_plane(f(i, 1), f(i, 2), f(i, 3), f(i, 4), s(i, 1), s(i, 2), s(i, 4), &
        pxx, pxy, pyx, pyy)
      a(i, 1) = pxx * k(i, 1) + pxy * k(i, 3)
      a(i, 2) = pxx * k(i, 3) + pxy * k(i, 2)
      a(i, 3) = pyx * k(i, 1) + pyy * k(i, 3)
      a(i, 4) = pyx * k(i, 3) + pyy * k(i, 2)
    end do
  end subroutine force_state_block

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
