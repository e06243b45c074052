!> What the operators do at every row for itself, without a look at its family, and means over them.
!>
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_operator_rows
  use pd_blocks, only: blocks_t
  use pd_kinds, only: block_sum, n_block, pi, wp
  implicit none
  private

  public :: times_k_inverse, stress_times_k_inverse, subtract_affine_control, mean_displacement
  public :: own_part_of_force, weigh_rows, control_stiffness

contains

  !> Stiffness of the control after Silling, c_i = g C_0 / W_i with C_0 = 48 E / (5 pi delta^2).
  elemental real(wp) function control_stiffness(factor, youngs_modulus, delta, weight_sum) result(c)
    real(wp), intent(in) :: factor            !! g
    real(wp), intent(in) :: youngs_modulus    !! E [Pa]
    real(wp), intent(in) :: delta             !! horizon [m]
    real(wp), intent(in) :: weight_sum        !! W [m^2]

    c = factor * 48.0_wp * youngs_modulus / (5.0_wp * pi * delta**2) / weight_sum
  end function control_stiffness

  !> H = G K^-1 of rows lo to hi, in the place of G.
  pure subroutine times_k_inverse(lo, hi, k, h)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: k(:, :)   !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), intent(inout), contiguous :: h(:, :)   !! G [m^4] -> H (n,4) xx xy yx yy
    integer  :: i
    real(wp) :: gxx, gxy, gyx, gyy

    !$omp simd simdlen(8) private(gxx, gxy, gyx, gyy)
    do i = lo, hi
      gxx = h(i, 1)
      gxy = h(i, 2)
      gyx = h(i, 3)
      gyy = h(i, 4)
      h(i, 1) = gxx * k(i, 1) + gxy * k(i, 3)
      h(i, 2) = gxx * k(i, 3) + gxy * k(i, 2)
      h(i, 3) = gyx * k(i, 1) + gyy * k(i, 3)
      h(i, 4) = gyx * k(i, 3) + gyy * k(i, 2)
    end do
  end subroutine times_k_inverse

  !> u times the share of the points and, where it is given, a factor.
  subroutine weigh_rows(rows, share, u, weighed, factor)
    integer,  intent(in) :: rows(2)                      !! first and last
    real(wp), intent(in), contiguous :: share(:)         !! (n)
    real(wp), intent(in), contiguous :: u(:, :)          !! (n,2)
    real(wp), intent(inout), contiguous :: weighed(:, :) !! out: (n,2)
    real(wp), intent(in), contiguous, optional :: factor(:)   !! (n)
    integer :: i

    if (present(factor)) then
      !$omp parallel do simd schedule(static) default(none) private(i) &
      !$omp shared(rows, share, u, weighed, factor)
      do i = rows(1), rows(2)
        weighed(i, 1) = share(i) * factor(i) * u(i, 1)
        weighed(i, 2) = share(i) * factor(i) * u(i, 2)
      end do
      !$omp end parallel do simd
    else
      !$omp parallel do simd schedule(static) default(none) private(i) &
      !$omp shared(rows, share, u, weighed)
      do i = rows(1), rows(2)
        weighed(i, 1) = share(i) * u(i, 1)
        weighed(i, 2) = share(i) * u(i, 2)
      end do
      !$omp end parallel do simd
    end if
  end subroutine weigh_rows

  !> A = P K^-1 of some rows.
  pure subroutine stress_times_k_inverse(rows, k, p, a)
    integer,  intent(in) :: rows(3)                  !! that of row 1 of p; first and last
    real(wp), intent(in),    contiguous :: k(:, :)   !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), intent(in),    contiguous :: p(:, :)   !! P xx xy yx yy [Pa]
    real(wp), intent(inout), contiguous :: a(:, :)   !! out: A (n,4) xx xy yx yy [N/m^6]
    integer :: i, b, shift

    shift = 1 - rows(1)
    !$omp simd simdlen(8) private(b)
    do i = rows(2), rows(3)
      b = i + shift
      a(i, 1) = p(b, 1) * k(i, 1) + p(b, 2) * k(i, 3)
      a(i, 2) = p(b, 1) * k(i, 3) + p(b, 2) * k(i, 2)
      a(i, 3) = p(b, 3) * k(i, 1) + p(b, 4) * k(i, 3)
      a(i, 4) = p(b, 3) * k(i, 3) + p(b, 4) * k(i, 2)
    end do
  end subroutine stress_times_k_inverse

  !> A <- A - c H for rows lo to hi.
  pure subroutine subtract_affine_control(lo, hi, c, h, a)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: c(:)      !! (n) [N/m^6]
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: a(:, :)   !! A (n,4) xx xy yx yy [N/m^6]
    integer :: i

    !$omp simd simdlen(8)
    do i = lo, hi
      a(i, 1) = a(i, 1) - c(i) * h(i, 1)
      a(i, 2) = a(i, 2) - c(i) * h(i, 2)
      a(i, 3) = a(i, 3) - c(i) * h(i, 3)
      a(i, 4) = a(i, 4) - c(i) * h(i, 4)
    end do
  end subroutine subtract_affine_control

  !> f = A s for rows lo to hi.
  pure subroutine own_part_of_force(lo, hi, moment, a, f)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: moment(:, :)   !! (n,2)
    real(wp), intent(in),    contiguous :: a(:, :)        !! (n,4)
    real(wp), intent(inout), contiguous :: f(:, :)        !! out: (n,2)
    integer :: i

    !$omp simd simdlen(8)
    do i = lo, hi
      f(i, 1) = a(i, 1) * moment(i, 1) + a(i, 2) * moment(i, 2)
      f(i, 2) = a(i, 3) * moment(i, 1) + a(i, 4) * moment(i, 2)
    end do
  end subroutine own_part_of_force

  !> Mean of u over the volume.
  function mean_displacement(blocks, volume, u) result(mean)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp), intent(in), contiguous :: u(:, :)     !! (n,2) [m]
    real(wp) :: mean(2)
    real(wp), allocatable :: parts(:, :)
    integer :: block

    allocate (parts(blocks%count, 3))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(blocks, volume, u, parts)
    do block = 1, blocks%count
      parts(block, :) = moments_of_block(blocks%lo(block), blocks%hi(block), volume, u)
    end do
    !$omp end parallel do
    mean = [blocks%total(parts(:, 2)), blocks%total(parts(:, 3))] / blocks%total(parts(:, 1))
  end function mean_displacement

  !> Sums of V and V u over rows lo to hi.
  pure function moments_of_block(lo, hi, volume, u) result(moments)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: volume(:), u(:, :)
    real(wp) :: moments(3), terms(n_block, 3)
    integer  :: n

    n = hi - lo + 1
    terms(n + 1:, :) = 0.0_wp   ! sums go over whole blocks
    terms(:n, 1) = volume(lo:hi)
    terms(:n, 2) = volume(lo:hi) * u(lo:hi, 1)
    terms(:n, 3) = volume(lo:hi) * u(lo:hi, 2)
    moments = [block_sum(terms(:, 1)), block_sum(terms(:, 2)), block_sum(terms(:, 3))]
  end function moments_of_block

end module pd_operator_rows
