!> Stable time step.
!>
!> Source: doc/theory.md, section 6; Golub & Van Loan, Matrix Computations, chapter 10 (Lanczos).
module pd_stability
  use pd_force, only: linear_force, solid_t
  use pd_kinds, only: n_block, wp
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
  !> the eigenvalue from below; the iteration ends when it has risen by less than 1e-5 of itself in
  !> ten iterations. The start vector is the same for every run and number of threads.
  subroutine highest_frequency(operators, solid, volume, free, frequency, iterations)
    type(operators_t), intent(in)  :: operators
    type(solid_t),     intent(in)  :: solid
    real(wp),          intent(in)  :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)  :: free(:, :)    !! 1: free, 0: prescribed (n,2)
    real(wp),          intent(out) :: frequency     !! [1/s]
    integer,           intent(out) :: iterations
    integer,  parameter :: most_iterations = 400, look_back = 10
    real(wp), parameter :: tolerance = 1.0e-5_wp
    real(wp), allocatable :: q(:, :), q_old(:, :), r(:, :), h(:, :), a(:, :)
    real(wp) :: diagonal(most_iterations), off_diagonal(0:most_iterations)
    real(wp) :: ritz(0:most_iterations)
    integer  :: k, n

    n = operators%n
    allocate (q(n, 2), r(n, 2), h(n, 4), a(n, 4))
    allocate (q_old(n, 2), source=0.0_wp)
    call scatter(free, q)
    q = q / sqrt(weighted_product(volume, q, q))
    off_diagonal(0) = 0.0_wp
    ritz = 0.0_wp
    do k = 1, most_iterations
      iterations = k
      call linear_force(operators, solid, q, h, a, r)
      r = -free * r / solid%density
      diagonal(k) = weighted_product(volume, q, r)
      r = r - diagonal(k) * q - off_diagonal(k - 1) * q_old
      off_diagonal(k) = sqrt(weighted_product(volume, r, r))
      ritz(k) = largest_eigenvalue(diagonal(:k), off_diagonal(1:k - 1))
      if (ritz(k) - ritz(max(0, k - look_back)) <= tolerance * ritz(k)) exit
      if (off_diagonal(k) <= 1.0e-13_wp * ritz(k)) exit
      q_old = q
      q = r / off_diagonal(k)
    end do
    frequency = sqrt(max(0.0_wp, ritz(iterations)))
  end subroutine highest_frequency

  !> A vector with every frequency in it: the same pseudo-random numbers in every run.
  pure subroutine scatter(free, q)
    real(wp), intent(in)  :: free(:, :)
    real(wp), intent(out) :: q(:, :)
    real(wp), parameter :: golden = 0.6180339887498949_wp, silver = 0.4142135623730951_wp
    integer :: i

    do i = 1, size(q, 1)
      q(i, 1) = modulo(real(i, wp)**2 * golden, 1.0_wp) - 0.5_wp
      q(i, 2) = modulo(real(i, wp)**2 * silver, 1.0_wp) - 0.5_wp
    end do
    q = q * free
  end subroutine scatter

  !> sum_i V_i a_i . b_i, block by block: the same bits for any number of threads.
  pure real(wp) function weighted_product(volume, a, b) result(product)
    real(wp), intent(in) :: volume(:), a(:, :), b(:, :)
    real(wp) :: part
    integer  :: i, lo

    product = 0.0_wp
    do lo = 1, size(volume), n_block
      part = 0.0_wp
      do i = lo, min(lo + n_block - 1, size(volume))
        part = part + volume(i) * (a(i, 1) * b(i, 1) + a(i, 2) * b(i, 2))
      end do
      product = product + part
    end do
  end function weighted_product

  !> Largest eigenvalue of a symmetric tridiagonal matrix by bisection on Sturm sequences.
  pure real(wp) function largest_eigenvalue(diagonal, off_diagonal) result(eigenvalue)
    real(wp), intent(in) :: diagonal(:)       !! (k)
    real(wp), intent(in) :: off_diagonal(:)   !! (k-1)
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
