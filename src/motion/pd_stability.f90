!> Stable time step.
!>
!> Source: doc/theory.md, section 6; Golub & Van Loan, Matrix Computations, chapter 10 (Lanczos).
module pd_stability
  use pd_force, only: linear_force, solid_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_operators, only: operators_t
  implicit none
  private

  public :: wave_speed, highest_frequency

contains

  !> c_p = sqrt((lambda + 2 G) / rho).
  pure real(wp) function wave_speed(solid)
    type(solid_t), intent(in) :: solid

    wave_speed = sqrt((solid%material%lambda + 2.0_wp * solid%material%shear_modulus) &
      / solid%density)
  end function wave_speed

  !> Largest angular frequency of the unloaded elastic body [1/s], free components only, control
  !> included: the square root of the largest eigenvalue of M^-1 K by Lanczos iteration.
  !>
  !> The operator is self-adjoint in the inner product weighted with V. The Ritz value rises to
  !> the eigenvalue from below; the iteration ends when it has risen by less than 3e-3 of itself in
  !> ten iterations, and twice as much is added. The start vector is the same for every run.
  subroutine highest_frequency(operators, solid, volume, free, frequency, iterations)
    class(operators_t), intent(inout) :: operators
    type(solid_t),     intent(in)  :: solid
    real(wp),          intent(in), contiguous :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in), contiguous :: free(:, :)    !! 1: free, 0: prescribed (n,2)
    real(wp),          intent(out) :: frequency     !! [1/s]
    integer,           intent(out) :: iterations
    integer,  parameter :: most_iterations = 400, look_back = 10
    real(wp), parameter :: tolerance = 3.0e-3_wp, still_to_rise = 2.0_wp
    real(wp), allocatable :: q(:, :), q_old(:, :), r(:, :), h(:, :), a(:, :), spare(:, :)
    real(wp), allocatable :: weight(:)
    real(wp) :: diagonal(most_iterations), off_diagonal(0:most_iterations)
    real(wp) :: ritz(0:most_iterations)
    integer  :: k, n

    n = operators%n
    allocate (q(n, 2), r(n, 2), q_old(n, 2), h(n, 4), a(n, 4), source=0.0_wp)
    ! with weights of this size q has the size of a spacing, and its gradient that of 1
    allocate (weight(n), source=volume / (sum(volume) * maxval(volume)))
    call scatter(volume, free, q)
    off_diagonal(0) = 0.0_wp
    ritz = 0.0_wp
    call scale_to(1.0_wp / sqrt(product_of(weight, q, q, free)), q)
    do k = 1, most_iterations
      iterations = k
      call linear_force(operators, solid, q, h, a, r)
      diagonal(k) = -product_of(weight, q, r, free) / solid%density
      call combine(-1.0_wp / solid%density, free, r, -diagonal(k), q, -off_diagonal(k - 1), q_old)
      off_diagonal(k) = sqrt(product_of(weight, r, r, free))
      ritz(k) = largest_eigenvalue(diagonal(:k), off_diagonal(1:k - 1))
      if (ritz(k) - ritz(max(0, k - look_back)) <= tolerance * ritz(k)) exit
      if (off_diagonal(k) <= 1.0e-13_wp * ritz(k)) exit
      call move_alloc(q_old, spare)
      call move_alloc(q, q_old)
      call move_alloc(r, q)
      call move_alloc(spare, r)
      call scale_to(1.0_wp / off_diagonal(k), q)
    end do
    frequency = sqrt(max(0.0_wp, ritz(iterations) &
      + still_to_rise * (ritz(iterations) - ritz(max(0, iterations - look_back)))))
    if (iterations <= look_back) frequency = sqrt(max(0.0_wp, ritz(iterations)))
  end subroutine highest_frequency

  !> A vector with every frequency in it: the same pseudo-random numbers in every run, with voids
  !> (volume 0) or without.
  subroutine scatter(volume, free, q)
    real(wp), intent(in)  :: volume(:), free(:, :)
    real(wp), intent(out) :: q(:, :)
    real(wp), parameter :: golden = 0.6180339887498949_wp, silver = 0.4142135623730951_wp
    real(wp) :: x(2)
    integer  :: i, number

    number = 0
    do i = 1, size(q, 1)
      if (volume(i) > 0.0_wp) number = number + 1
      x = real(number, wp)**2 * [golden, silver]
      q(i, :) = free(i, :) * (x - aint(x) - 0.5_wp)
    end do
  end subroutine scatter

  !> q <- factor q.
  subroutine scale_to(factor, q)
    real(wp), intent(in) :: factor
    real(wp), intent(inout), contiguous :: q(:, :)
    integer :: i

    !$omp parallel do schedule(static) default(none) shared(factor, q) private(i)
    do i = 1, size(q, 1)
      q(i, 1) = factor * q(i, 1)
      q(i, 2) = factor * q(i, 2)
    end do
    !$omp end parallel do
  end subroutine scale_to

  !> r <- free a r + b q + c p.
  subroutine combine(a, free, r, b, q, c, p)
    real(wp), intent(in) :: a, b, c
    real(wp), intent(in),    contiguous :: free(:, :), q(:, :), p(:, :)   !! (n,2)
    real(wp), intent(inout), contiguous :: r(:, :)
    integer :: i

    !$omp parallel do schedule(static) default(none) shared(a, b, c, free, r, q, p) private(i)
    do i = 1, size(q, 1)
      r(i, 1) = a * free(i, 1) * r(i, 1) + b * q(i, 1) + c * p(i, 1)
      r(i, 2) = a * free(i, 2) * r(i, 2) + b * q(i, 2) + c * p(i, 2)
    end do
    !$omp end parallel do
  end subroutine combine

  !> sum_i w_i a_i . b_i over the free components, block by block: the same bits for any number of
  !> threads.
  real(wp) function product_of(weight, a, b, free) result(product)
    real(wp), intent(in), contiguous :: weight(:), a(:, :), b(:, :), free(:, :)
    real(wp), allocatable :: parts(:)
    integer :: block, n_blocks, lo

    n_blocks = (size(weight) + n_block - 1) / n_block
    allocate (parts(n_blocks))
    !$omp parallel do schedule(static) default(none) private(block, lo) &
    !$omp shared(weight, a, b, free, parts, n_blocks)
    do block = 1, n_blocks
      lo = (block - 1) * n_block + 1
      parts(block) = product_of_block(lo, min(lo + n_block - 1, size(weight)), weight, a, b, free)
    end do
    !$omp end parallel do
    product = sum(parts)
  end function product_of

  !> The same of points lo to hi.
  pure real(wp) function product_of_block(lo, hi, weight, a, b, free) result(product)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: weight(:), a(:, :), b(:, :), free(:, :)
    real(wp) :: terms(n_block)
    integer  :: i

    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    !$omp simd simdlen(8)
    do i = lo, hi
      terms(i - lo + 1) = weight(i) * (free(i, 1) * a(i, 1) * b(i, 1) &
        + free(i, 2) * a(i, 2) * b(i, 2))
    end do
    product = block_sum(terms)
  end function product_of_block

  !> Largest eigenvalue of a symmetric tridiagonal matrix by bisection on Sturm sequences.
  pure real(wp) function largest_eigenvalue(diagonal, off_diagonal) result(eigenvalue)
    real(wp), intent(in), contiguous :: diagonal(:)       !! (k)
    real(wp), intent(in), contiguous :: off_diagonal(:)   !! (k-1)
    real(wp) :: low, high, middle, pivot, reach
    integer  :: i, k, iteration
    logical  :: all_below

    k = size(diagonal)
    low = maxval(diagonal)
    high = low
    do i = 1, k
      reach = sum(abs(off_diagonal(max(1, i - 1):min(i, k - 1))))
      high = max(high, diagonal(i) + reach)
    end do
    do iteration = 1, 100
      middle = 0.5_wp * (low + high)
      if (high - low <= 1.0e-14_wp * abs(high)) exit
      ! every pivot of diagonal - middle negative: all eigenvalues lie below the middle
      all_below = .true.
      pivot = diagonal(1) - middle
      do i = 2, k
        if (pivot >= 0.0_wp) exit
        pivot = diagonal(i) - middle - off_diagonal(i - 1)**2 / pivot
      end do
      if (pivot >= 0.0_wp) all_below = .false.
      if (all_below) then
        high = middle
      else
        low = middle
      end if
    end do
    eigenvalue = high
  end function largest_eigenvalue

end module pd_stability
