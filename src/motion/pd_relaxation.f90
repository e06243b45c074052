!> The way to equilibrium: the body moves in a time without meaning until its forces balance.
!>
!> One evaluation of the forces f a move, from the state at the start of the increment; s is the
!> square of the stable step over the density, m what the motion keeps of the moves before:
!>
!>   m <- a m + b s f,   w = c s f + d m,   u <- u + w
!>
!> 'adaptive': dynamic relaxation (Underwood 1983): a = (2 - q) / (2 + q), b = 2 / (2 + q), d = 1,
!>   with the critical damping q of the frequency that the last move shows, its Rayleigh quotient
!>   q^2 = 4 (w . -df) / (w . w / s), from the change df of the forces along it.
!> 'kinetic': kinetic damping (Cundall 1976): a = d = 1; where the kinetic energy falls, the body
!>   goes back to where it was largest, and stops.
!> 'local': local damping (Cundall 1987; FLAC): of every force 0.8 of its size acts against m.
!> 'accelerated': accelerated gradient (Nesterov 1983), begun anew where it goes uphill
!>   (O'Donoghue and Candes 2015).
!>
!> All moves are of the same kind because plastic strain is counted from the start of the increment:
!> the forces have a potential, and no move leaves a trace. That of the relaxing control have one as
!> long as the part of the springs that is let go stays the same. It follows the flow with a lag,
!> ever more slowly, so that it cannot swing with it.
!> Source: doc/theory.md, section 6.
module pd_relaxation
  use pd_agreement, only: signal_of
  use pd_forces, only: internal_forces
  use pd_kinds, only: block_sum, n_block, wp
  use pd_model, only: model_t
  use pd_pages, only: clear_rows
  use pd_points, only: points_t
  use pd_state, only: block_work_t, state_t
  use pd_timing, only: kernel_boundaries, kernel_motion, timing_t
  use pd_unbalanced, only: loads_at, over
  implicit none
  private

  public :: relaxation_t, new_relaxation, relaxed_t, keep_start, return_to_start, relax
  public :: numbers_per_row, copy_rows

  !> How to come to equilibrium, and work space.
  type :: relaxation_t
    character(:), allocatable :: rule
    real(wp) :: residual = 1.0e-4_wp    !! unbalanced force over that from outside
    integer  :: most_moves = 20000      !! of one increment
    type(block_work_t) :: blocks
    integer  :: moves = 0               !! evaluations of the forces so far
    integer  :: ends(2) = 0             !! first and last row that this rank knows, and rows that
    integer, allocatable :: shared(:)   !! all ranks know: others take no memory
    real(wp), allocatable, private :: step(:)               !! s (n) [m^3/kg s^2]
    real(wp), allocatable, private :: kept(:, :)            !! m (n,2) [m]
    real(wp), allocatable, private :: move(:, :)            !! w (n,2) [m]
    real(wp), allocatable, private :: force_before(:, :)    !! (n,2) [N/m^3]
    real(wp), allocatable, private :: sums(:, :)            !! of the blocks
    ! state at the start of the increment
    real(wp), allocatable :: displacement(:, :)             !! (n,2) [m]
    real(wp), allocatable :: guess(:, :)                    !! displacement to begin with (n,2) [m]
    real(wp), allocatable, private :: stress(:, :), history(:, :)
    real(wp), allocatable, private :: control_memory(:, :), start_force(:, :)
  end type relaxation_t

  !> What came of it.
  type :: relaxed_t
    logical  :: at_rest = .false.       !! the residual is reached
    logical  :: stopped = .false.       !! a signal came on the way
    real(wp) :: residual = 0.0_wp       !! unbalanced force over that from outside
    integer  :: moves = 0
    integer  :: failed_row = 0          !! 0, or the first row whose det F is not positive
    !> Work of all net forces on all moves, reactions included, per block [J/m].
    real(wp), allocatable :: work(:)
  end type relaxed_t

  ! the sums of a block, in their order
  integer, parameter :: free_force = 1, held_force = 2, stiffness = 3, inertia = 4, power = 5
  integer, parameter :: work_done = 6, n_sums = 6

  !> Numbers of a move.
  type :: move_t
    real(wp) :: a = 0.0_wp, b = 1.0_wp, c = 0.0_wp, d = 1.0_wp
    real(wp) :: against = 0.0_wp        !! part of |f| that acts against m
    real(wp) :: back = 0.0_wp           !! half of b: back to where the body was fastest
  end type move_t

  !> What the rules remember from move to move.
  type :: pace_t
    real(wp) :: theta = 1.0_wp          !! of the accelerated gradient
    real(wp) :: momentum = 0.0_wp       !! its factor
    real(wp) :: kinetic = 0.0_wp        !! kinetic energy before
    logical  :: resting = .true.        !! the body has been stopped
  end type pace_t

contains

  !> Work space for a model whose highest frequency is known.
  subroutine new_relaxation(model, rule, residual, relaxation)
    type(model_t),      intent(in)  :: model
    character(*),       intent(in)  :: rule
    real(wp),           intent(in)  :: residual
    type(relaxation_t), intent(out) :: relaxation
    integer :: k, n

    n = size(model%points%volume)
    relaxation%ends = model%operators%domain%kept(n)
    if (model%operators%mirror%n > 0) relaxation%ends = [1, n]   ! images are made of any rows
    allocate (relaxation%shared(0))
    if (allocated(model%shared%rows)) relaxation%shared = [model%shared%rows, model%pushed%rows]
    relaxation%rule = rule
    relaxation%residual = residual
    allocate (relaxation%kept(n, 2), relaxation%move(n, 2), relaxation%force_before(n, 2))
    call clear_rows(relaxation%kept, relaxation%ends)
    call clear_rows(relaxation%move, relaxation%ends)
    call clear_rows(relaxation%force_before, relaxation%ends)
    allocate (relaxation%sums(n_sums, model%blocks%count), source=0.0_wp)
    allocate (relaxation%step(n))
    call clear_rows(relaxation%step, relaxation%ends)
    associate (a => relaxation%ends(1), b => relaxation%ends(2), materials => model%materials)
      relaxation%step(a:b) = 4.0_wp / (model%highest_frequency**2 * materials%list(1)%density)
      do k = 1, size(materials%runs)
        associate (run => materials%runs(k))
          relaxation%step(run%lo:run%hi) = 4.0_wp &
            / (model%highest_frequency**2 * materials%list(run%material)%density)
        end associate
      end do
    end associate
  end subroutine new_relaxation

  !> Numbers that the work space has in a row.
  pure integer function numbers_per_row(state) result(numbers)
    type(state_t), intent(in) :: state   !! whose columns of the history are known

    numbers = 1 + 3 * 2 + 2 + 2 + 4 + size(state%remembered) + 4 + 2
  end function numbers_per_row

  !> Remember the state at the start of an increment.
  subroutine keep_start(relaxation, state)
    type(relaxation_t), intent(inout) :: relaxation
    type(state_t),      intent(in)    :: state

    associate (ends => relaxation%ends, shared => relaxation%shared)
      call copy_rows(state%displacement, ends, shared, relaxation%displacement)
      call copy_rows(state%stress, ends, shared, relaxation%stress)
      call copy_rows(state%history, ends, shared, relaxation%history)
      call copy_rows(state%control_memory, ends, shared, relaxation%control_memory)
      call copy_rows(state%force, ends, shared, relaxation%start_force)
    end associate
  end subroutine keep_start

  !> Rows of a field that this rank knows, and those that all know, go into another field.
  subroutine copy_rows(from, ends, shared, to)
    real(wp), intent(in) :: from(:, :)
    integer,  intent(in) :: ends(2)     !! first and last row
    integer,  intent(in) :: shared(:)   !! further rows
    real(wp), allocatable, intent(inout) :: to(:, :)   !! not allocated: a new one

    if (.not. allocated(to)) then
      allocate (to(size(from, 1), size(from, 2)))
      call clear_rows(to, ends)
    end if
    to(ends(1):ends(2), :) = from(ends(1):ends(2), :)
    to(shared, :) = from(shared, :)
  end subroutine copy_rows

  !> The state at the start of the increment, but for the displacement.
  subroutine return_to_start(relaxation, state)
    type(relaxation_t), intent(in)    :: relaxation
    type(state_t),      intent(inout) :: state

    associate (ends => relaxation%ends, shared => relaxation%shared)
      call copy_rows(relaxation%stress, ends, shared, state%stress)
      call copy_rows(relaxation%history, ends, shared, state%history)
      call copy_rows(relaxation%control_memory, ends, shared, state%control_memory)
      call copy_rows(relaxation%start_force, ends, shared, state%force)
    end associate
  end subroutine return_to_start

  !> Move the body from a first guess until it is at rest, or a signal comes; prescribed components
  !> stay where they are.
  subroutine relax(model, t, state, relaxation, timing, relaxed)
    type(model_t),      intent(inout) :: model
    real(wp),           intent(in)    :: t            !! [s]
    type(state_t),      intent(inout) :: state        !! in: the guess
    type(relaxation_t), intent(inout) :: relaxation
    type(timing_t),     intent(inout) :: timing
    type(relaxed_t),    intent(out)   :: relaxed
    type(pace_t) :: pace
    integer, parameter :: look_every = 8   ! moves: ranks ask each other
    real(wp) :: sums(n_sums), loads
    integer  :: k

    loads = loads_at(model, t)
    associate (a => relaxation%ends(1), b => relaxation%ends(2))
      relaxation%kept(a:b, :) = 0.0_wp
      call copy_rows(state%displacement, relaxation%ends, relaxation%shared, relaxation%guess)
      relaxation%move(a:b, :) = state%displacement(a:b, :) - relaxation%displacement(a:b, :)
      relaxation%force_before(a:b, :) = relaxation%start_force(a:b, :)
    end associate
    allocate (relaxed%work(model%blocks%count), source=0.0_wp)
    do k = 1, relaxation%most_moves
      call follow_flow(k, model)
      call internal_forces(model%operators, model%materials, model%points%volume, state, &
        relaxation%blocks, timing, relaxed%failed_row)
      relaxation%moves = relaxation%moves + 1
      relaxed%moves = k
      if (relaxed%failed_row > 0) exit
      call model%loads%add_forces(model%points%volume, t, state%force)
      call model%supports%share_forces(model%points%volume, t, state%force)
      call timing%lap(kernel_boundaries)
      call add_up(model, state, relaxation)
      sums = model%blocks%totals(relaxation%sums)
      relaxed%work = relaxed%work + relaxation%sums(work_done, :)
      relaxed%residual = over(sums(free_force), sums(held_force) + loads)
      relaxed%at_rest = relaxed%residual <= relaxation%residual
      if (relaxed%at_rest) exit
      if (modulo(k, look_every) == 0) relaxed%stopped = signal_of(model%blocks%ranks) /= 0
      if (relaxed%stopped) exit
      call move_on(next_move(relaxation%rule, k, sums, pace), model, state, relaxation)
      call timing%lap(kernel_motion)
    end do
  end subroutine relax

  !> How fast the relaxing control follows the flow at a move: at once at the first one, and then
  !> with a weight that falls like that of a mean over all moves.
  subroutine follow_flow(k, model)
    integer,       intent(in)    :: k
    type(model_t), intent(inout) :: model
    real(wp), parameter :: first = 1.0e-3_wp

    if (.not. allocated(model%operators%relaxing)) return
    call model%operators%relaxing%follow( &
      merge(1.0_wp, first / (1.0_wp + 0.5_wp * first * real(k, wp)), k == 1))
  end subroutine follow_flow

  !> The numbers of the next move.
  function next_move(rule, k, sums, pace) result(move)
    character(*), intent(in)    :: rule
    integer,      intent(in)    :: k              !! moves before, the guess included
    real(wp),     intent(in)    :: sums(n_sums)
    type(pace_t), intent(inout) :: pace
    type(move_t) :: move
    ! of the square of the stable step; without damping near it the fastest motion hides the others
    real(wp), parameter :: safe = 0.81_wp, slow = 0.36_wp
    real(wp), parameter :: most_damping = 1.8_wp, local_part = 0.8_wp
    real(wp) :: q, theta

    select case (rule)
    case ('kinetic')
      if (pace%resting) then
        move = move_t(a=0.0_wp, b=0.5_wp * slow)
        pace = pace_t(resting=.false.)
      else if (sums(inertia) < pace%kinetic) then
        move = move_t(a=0.0_wp, b=0.0_wp, back=0.5_wp * slow)
        pace = pace_t()
      else
        move = move_t(a=1.0_wp, b=slow)
        pace%kinetic = sums(inertia)
      end if
    case ('local')
      move = move_t(a=1.0_wp, b=0.25_wp, against=local_part)
    case ('accelerated')
      if (sums(power) < 0.0_wp) pace = pace_t()
      move = move_t(a=pace%momentum, b=0.25_wp, c=0.25_wp)
      theta = 0.5_wp * (1.0_wp + sqrt(1.0_wp + 4.0_wp * pace%theta**2))
      pace%momentum = (pace%theta - 1.0_wp) / theta
      pace%theta = theta
      move%d = pace%momentum
    case default   ! adaptive
      q = 0.0_wp
      if (k > 1 .and. sums(stiffness) > 0.0_wp .and. sums(inertia) > 0.0_wp) &
        q = min(most_damping, 2.0_wp * sqrt(sums(stiffness) / sums(inertia)))
      move%a = (2.0_wp - q) / (2.0_wp + q)
      move%b = 2.0_wp * safe / (2.0_wp + q)
    end select
  end function next_move

  !> Sums of all blocks after an evaluation of the forces.
  subroutine add_up(model, state, relaxation)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(relaxation_t), intent(inout) :: relaxation
    integer :: block

    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(model, state, relaxation)
    do block = 1, model%blocks%count
      call sums_of_block(model%blocks%lo(block), model%blocks%hi(block), model%points, &
        state%force, relaxation, relaxation%sums(:, block))
    end do
    !$omp end parallel do
  end subroutine add_up

  !> Sums of rows lo to hi.
  pure subroutine sums_of_block(lo, hi, points, f, relaxation, sums)
    integer,            intent(in)  :: lo, hi
    type(points_t),     intent(in)  :: points
    real(wp), intent(in), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    type(relaxation_t), intent(in)  :: relaxation
    real(wp),           intent(out) :: sums(n_sums)
    real(wp) :: terms(n_block, n_sums), free1, free2
    integer  :: i, b, k

    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    associate (volume => points%volume, free => points%free, w => relaxation%move, &
      m => relaxation%kept, before => relaxation%force_before, s => relaxation%step)
      !$omp simd simdlen(8) private(b, free1, free2)
      do i = lo, hi
        b = i - lo + 1
        free1 = free(i, 1) * volume(i)
        free2 = free(i, 2) * volume(i)
        terms(b, free_force) = free1 * abs(f(i, 1)) + free2 * abs(f(i, 2))
        terms(b, held_force) = volume(i) * (abs(f(i, 1)) + abs(f(i, 2))) - terms(b, free_force)
        terms(b, stiffness) = free1 * w(i, 1) * (before(i, 1) - f(i, 1)) &
          + free2 * w(i, 2) * (before(i, 2) - f(i, 2))
        terms(b, inertia) = (free1 * w(i, 1)**2 + free2 * w(i, 2)**2) / s(i)
        terms(b, power) = free1 * f(i, 1) * m(i, 1) + free2 * f(i, 2) * m(i, 2)
        terms(b, work_done) = 0.5_wp * volume(i) * (w(i, 1) * (before(i, 1) + f(i, 1)) &
          + w(i, 2) * (before(i, 2) + f(i, 2)))
      end do
    end associate
    do k = 1, n_sums
      sums(k) = block_sum(terms(:, k))
    end do
  end subroutine sums_of_block

  !> One move of all points; what they remember is again that of the start of the increment.
  subroutine move_on(move, model, state, relaxation)
    type(move_t),       intent(in)    :: move
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(inout) :: state
    type(relaxation_t), intent(inout) :: relaxation
    integer :: block

    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(move, model, state, relaxation)
    do block = 1, model%blocks%count
      associate (lo => model%blocks%lo(block), hi => model%blocks%hi(block))
        call move_rows(lo, hi, move, model%points%free, state, relaxation)
        if (relaxation%blocks%flowed(block) > 0) &
          state%history(lo:hi, :) = relaxation%history(lo:hi, :)
        if (allocated(model%operators%relaxing)) &
          state%control_memory(lo:hi, :) = relaxation%control_memory(lo:hi, :)
      end associate
    end do
    !$omp end parallel do
  end subroutine move_on

  !> The same for rows lo to hi.
  pure subroutine move_rows(lo, hi, move, free, state, relaxation)
    integer,            intent(in)    :: lo, hi
    type(move_t),       intent(in)    :: move
    real(wp), intent(in), contiguous  :: free(:, :)
    type(state_t),      intent(inout) :: state
    type(relaxation_t), intent(inout) :: relaxation
    real(wp) :: push
    integer  :: i, c

    if (move%c <= 0.0_wp .and. move%against <= 0.0_wp .and. move%back <= 0.0_wp) then
      call glide_rows(lo, hi, move%a, move%b, free, state, relaxation)
      return
    end if
    associate (u => state%displacement, f => state%force, w => relaxation%move, &
      m => relaxation%kept, before => relaxation%force_before, s => relaxation%step)
      do c = 1, 2
        !$omp simd simdlen(8) private(push)
        do i = lo, hi
          push = f(i, c) - merge(sign(move%against * f(i, c), m(i, c)), 0.0_wp, &
            abs(m(i, c)) > 0.0_wp)
          push = free(i, c) * s(i) * push
          w(i, c) = merge(move%back * free(i, c) * s(i) * before(i, c) - 1.5_wp * m(i, c), 0.0_wp, &
            move%back > 0.0_wp)
          m(i, c) = move%a * m(i, c) + move%b * push
          w(i, c) = w(i, c) + move%c * push + move%d * m(i, c)
          u(i, c) = u(i, c) + w(i, c)
          before(i, c) = f(i, c)
        end do
      end do
    end associate
  end subroutine move_rows

  !> The same where m is the move.
  pure subroutine glide_rows(lo, hi, a, b, free, state, relaxation)
    integer,            intent(in)    :: lo, hi
    real(wp),           intent(in)    :: a, b
    real(wp), intent(in), contiguous  :: free(:, :)
    type(state_t),      intent(inout) :: state
    type(relaxation_t), intent(inout) :: relaxation
    integer :: i, c

    associate (u => state%displacement, f => state%force, w => relaxation%move, &
      m => relaxation%kept, before => relaxation%force_before, s => relaxation%step)
      do c = 1, 2
        !$omp simd simdlen(8)
        do i = lo, hi
          m(i, c) = a * m(i, c) + b * s(i) * free(i, c) * f(i, c)
          w(i, c) = m(i, c)
          u(i, c) = u(i, c) + m(i, c)
          before(i, c) = f(i, c)
        end do
      end do
    end associate
  end subroutine glide_rows

end module pd_relaxation
