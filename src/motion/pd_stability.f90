!> Stable time step.
!>
!> Source: doc/theory.md, section 6; Golub & Van Loan, Matrix Computations, chapter 10 (Lanczos).
module pd_stability
  use pd_blocks, only: blocks_t
  use pd_forces, only: linear_forces, next_step_t, prepare_next_step
  use pd_kinds, only: block_sum, n_block, wp
  use pd_model, only: model_t
  use pd_pages, only: clear_rows
  use pd_state, only: state_t
  implicit none
  private

  public :: find_highest_frequency, frequency_of_state, stiffening

contains

  !> Highest frequency of the unloaded model, unless it is known already.
  subroutine find_highest_frequency(model)
    type(model_t), intent(inout) :: model
    integer :: iterations

    if (model%highest_frequency <= 0.0_wp) &
      call highest_frequency(model, model%highest_frequency, iterations)
  end subroutine find_highest_frequency

  !> Highest frequency in a state that is whole, with the flow of its next step: points that flow
  !> answer a small motion like points that flow, and are softer than elastic ones.
  real(wp) function frequency_of_state(model, state, time_step) result(frequency)
    type(model_t), intent(inout) :: model
    type(state_t), intent(inout) :: state       !! its halo is brought up to date
    real(wp),      intent(in)    :: time_step   !! dt [s]
    type(next_step_t) :: next
    integer :: iterations

    call prepare_next_step(model%operators, model%materials, time_step, state, next)
    call highest_frequency(model, frequency, iterations, state, next)
    call model%operators%take_in(state%displacement, model%operators%mirror%place)
  end function frequency_of_state

  !> How much the highest frequency of an elastic body may have risen by its deformation: the square
  !> root of what the modulus of its stiffest point has grown by.
  real(wp) function stiffening(model, state)
    type(model_t), intent(in) :: model
    type(state_t), intent(in) :: state
    real(wp), allocatable :: parts(:)
    integer :: block

    allocate (parts(model%blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) shared(model, state, parts)
    do block = 1, model%blocks%count
      parts(block) = model%materials%stiffening(block, state%displacement_gradient, state%stress)
    end do
    !$omp end parallel do
    stiffening = sqrt(max(1.0_wp, model%blocks%largest(parts)))
  end function stiffening

  !> Largest angular frequency of the unloaded elastic body [1/s], or of the body in a state: the
  !> square root of the largest eigenvalue of M^-1 K by Lanczos iteration. Free components only,
  !> control included.
  !>
  !> The operator is self-adjoint in the inner product weighted with V rho. The Ritz value rises to
  !> the eigenvalue from below; the iteration ends when it has risen by less than 3e-3 of itself in
  !> ten iterations, and twice as much is added. In a state the time step has a margin, and a rise
  !> of 1e-2 in five iterations is near enough. The start vector is the same for every run.
  subroutine highest_frequency(model, frequency, iterations, state, next)
    type(model_t), intent(inout) :: model
    real(wp),      intent(out)   :: frequency     !! [1/s]
    integer,       intent(out)   :: iterations
    type(state_t), intent(in), optional :: state
    type(next_step_t), intent(in), optional :: next
    integer,  parameter :: most_iterations = 400
    real(wp), parameter :: still_to_rise = 2.0_wp
    real(wp), allocatable :: q(:, :), q_old(:, :), r(:, :), h(:, :), spare(:, :)
    real(wp), allocatable :: volume(:), mass(:), density(:)
    real(wp) :: diagonal(most_iterations), off_diagonal(0:most_iterations)
    real(wp) :: ritz(0:most_iterations)
    real(wp) :: tolerance
    integer  :: k, n, look_back, kept(2)

    look_back = merge(5, 10, present(state))
    tolerance = merge(1.0e-2_wp, 3.0e-3_wp, present(state))
    n = size(model%points%volume)
    kept = model%operators%domain%kept(n)
    call model%operators%domain%make_room(n, 4, h)
    call model%operators%domain%make_room(n, 2, q)
    call model%operators%domain%make_room(n, 2, r)
    call model%operators%domain%make_room(n, 2, q_old)
    call weigh_rows(model, kept, density, volume, mass)
    associate (free => model%points%free, blocks => model%blocks, &
      reference => model%materials%list(1)%density)
      call scatter(model%points%volume, free, &
        model%operators%storage%first_point(kept(1)) - 1, kept, q)
      off_diagonal(0) = 0.0_wp
      ritz = 0.0_wp
      call scale_to(1.0_wp / sqrt(product_of(blocks, mass, q, q, free)), blocks, q)
      do k = 1, most_iterations
        iterations = k
        call linear_forces(model%operators, model%materials, q, h, r, state, next)
        diagonal(k) = -product_of(blocks, volume, q, r, free) / reference
        call combine(blocks, density, free, r, -diagonal(k), q, -off_diagonal(k - 1), q_old)
        off_diagonal(k) = sqrt(product_of(blocks, mass, r, r, free))
        ritz(k) = largest_eigenvalue(diagonal(:k), off_diagonal(1:k - 1))
        if (ritz(k) - ritz(max(0, k - look_back)) <= tolerance * ritz(k)) exit
        if (off_diagonal(k) <= 1.0e-13_wp * ritz(k)) exit
        call move_alloc(q_old, spare)
        call move_alloc(q, q_old)
        call move_alloc(r, q)
        call move_alloc(spare, r)
        call scale_to(1.0_wp / off_diagonal(k), blocks, q)
      end do
    end associate
    frequency = sqrt(max(0.0_wp, ritz(iterations) &
      + still_to_rise * (ritz(iterations) - ritz(max(0, iterations - look_back)))))
    if (iterations <= look_back) frequency = sqrt(max(0.0_wp, ritz(iterations)))
  end subroutine highest_frequency

  !> Density of the rows, and the weights of the inner products, with V rho and with V alone: of
  !> such a size that q has the size of a spacing, and its gradient that of 1.
  subroutine weigh_rows(model, kept, density, volume, mass)
    type(model_t), intent(in) :: model
    integer,       intent(in) :: kept(2)   !! first and last row that is needed
    real(wp), allocatable, intent(out) :: density(:), volume(:), mass(:)   !! (n)
    integer :: k, n

    n = size(model%points%volume)
    allocate (density(n), volume(n), mass(n))
    call clear_rows(density, kept)
    call clear_rows(volume, kept)
    call clear_rows(mass, kept)
    associate (a => kept(1), b => kept(2), materials => model%materials, points => model%points)
      density(a:b) = materials%list(1)%density
      do k = 1, size(materials%runs)
        associate (run => materials%runs(k))
          if (run%hi < a .or. run%lo > b) cycle
          density(max(a, run%lo):min(b, run%hi)) = materials%list(run%material)%density
        end associate
      end do
      volume(a:b) = points%volume(a:b) / (points%all_volume * points%largest_volume)
      mass(a:b) = volume(a:b) * (density(a:b) / materials%list(1)%density)
    end associate
  end subroutine weigh_rows

  !> A vector with every frequency in it: the same pseudo-random numbers in every run,
  !> whether or not there are rows without a point (volume 0).
  subroutine scatter(volume, free, before, kept, q)
    real(wp), intent(in)    :: volume(:), free(:, :)
    integer,  intent(in)    :: before    !! points before the first of these rows
    integer,  intent(in)    :: kept(2)   !! first and last row that is needed
    real(wp), intent(inout) :: q(:, :)
    real(wp), parameter :: golden = 0.6180339887498949_wp, silver = 0.4142135623730951_wp
    real(wp) :: x(2)
    integer  :: i, number

    number = before
    do i = kept(1), kept(2)
      if (volume(i) > 0.0_wp) number = number + 1
      x = real(number, wp)**2 * [golden, silver]
      q(i, :) = free(i, :) * (x - aint(x) - 0.5_wp)
    end do
  end subroutine scatter

  !> q <- factor q.
  subroutine scale_to(factor, blocks, q)
    real(wp),       intent(in) :: factor
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(inout), contiguous :: q(:, :)
    integer :: i

    !$omp parallel do schedule(static) default(none) shared(factor, blocks, q) private(i)
    do i = blocks%first, blocks%last
      q(i, 1) = factor * q(i, 1)
      q(i, 2) = factor * q(i, 2)
    end do
    !$omp end parallel do
  end subroutine scale_to

  !> r <- -free r / rho + b q + c p.
  subroutine combine(blocks, density, free, r, b, q, c, p)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: b, c
    real(wp), intent(in),    contiguous :: density(:)                     !! rho (n) [kg/m^3]
    real(wp), intent(in),    contiguous :: free(:, :), q(:, :), p(:, :)   !! (n,2)
    real(wp), intent(inout), contiguous :: r(:, :)
    real(wp) :: a
    integer  :: i

    !$omp parallel do schedule(static) default(none) private(i, a) &
    !$omp shared(blocks, density, b, c, free, r, q, p)
    do i = blocks%first, blocks%last
      a = -1.0_wp / density(i)
      r(i, 1) = a * free(i, 1) * r(i, 1) + b * q(i, 1) + c * p(i, 1)
      r(i, 2) = a * free(i, 2) * r(i, 2) + b * q(i, 2) + c * p(i, 2)
    end do
    !$omp end parallel do
  end subroutine combine

  !> sum_i w_i a_i . b_i over the free components, block by block: the same bits for any number of
  !> threads.
  real(wp) function product_of(blocks, weight, a, b, free) result(product)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in), contiguous :: weight(:), a(:, :), b(:, :), free(:, :)
    real(wp), allocatable :: parts(:)
    integer :: block

    allocate (parts(blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(blocks, weight, a, b, free, parts)
    do block = 1, blocks%count
      parts(block) = product_of_block(blocks%lo(block), blocks%hi(block), weight, a, b, free)
    end do
    !$omp end parallel do
    product = blocks%total(parts)
  end function product_of

  !> The same of rows lo to hi.
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
