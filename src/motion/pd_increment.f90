!> Increments of load or motion, each brought to equilibrium.
!>
!> Time tells how far loads and supports have gone, and nothing else: there is no inertia and no
!> damping. An increment begins with a guess, the motion of the last one going on, and relaxes.
!> Where the body does not come to rest, the increment is halved; where it does so slowly, the next
!> one is shorter, where quickly, longer. Increments end at the times of frames.
!>
!> Velocity is the displacement of the increment over its time. Where no equilibrium is near, as
!> when a band breaks through, the relaxation follows the jump to the next one. Energy that the way
!> to equilibrium takes out of the body is entered as work of a damping.
!> Source: doc/theory.md, section 6.
module pd_increment
  use pd_clock, only: clock_t
  use pd_forces, only: find_gradient, forces
  use pd_kinds, only: wp
  use pd_ledger, only: ledger_t
  use pd_model, only: model_t
  use pd_relaxation, only: copy_rows, keep_start, relax, relaxation_t, relaxed_t, &
    new_relaxation, return_to_start
  use pd_schedule, only: schedule_t
  use pd_state, only: state_t
  use pd_timing, only: timing_t
  use pd_unbalanced, only: find_loads, loads_at
  implicit none
  private

  public :: increments_t, new_increments, begin_increments, take_increment, take_back
  public :: next_length

  !> A number of an increment that stands out.
  type :: moment_t
    integer  :: step = 0               !! 0: none
    real(wp) :: number = 0.0_wp
  contains
    procedure :: see
  end type moment_t

  !> How increments follow each other.
  type :: increments_t
    real(wp) :: longest = 0.0_wp       !! [s]
    real(wp) :: shortest = 0.0_wp      !! [s]
    type(relaxation_t) :: relaxation
    type(relaxed_t)    :: last         !! what came of the last one
    type(moment_t) :: unfinished       !! residual of the worst one that was taken without rest
    type(moment_t) :: jump             !! energy of the one that has set free most [J/m]
    logical :: lost = .false.          !! the last one did not come to rest, and was not taken
    logical :: under_load = .false.    !! loads grow in the last one
  end type increments_t

  !> Up to this residual an increment of the shortest length is taken although it is not at rest.
  real(wp), parameter :: most_residual = 1.0e-2_wp
  !> An increment with fewer moves than the first is easy, with more than the second hard.
  integer,  parameter :: easy = 400, hard = 4000

contains

  !> Increments of a run, or of a stage of it: up to a length. What stood out before stays known.
  subroutine new_increments(model, longest, rule, residual, increments)
    type(model_t),      intent(in)    :: model
    real(wp),           intent(in)    :: longest    !! where none is hard [s]
    character(*),       intent(in)    :: rule       !! of the relaxation
    real(wp),           intent(in)    :: residual   !! unbalanced force over that from outside
    type(increments_t), intent(inout) :: increments
    real(wp), parameter :: shortest = 1.0_wp / 64.0_wp   ! of the longest
    integer :: moves

    increments%longest = longest
    increments%shortest = shortest * longest
    moves = increments%relaxation%moves
    call new_relaxation(model, rule, residual, increments%relaxation)
    increments%relaxation%moves = moves
  end subroutine new_increments

  !> Begin with the longest increment.
  subroutine begin_increments(increments, schedule, clock)
    type(increments_t), intent(in)    :: increments
    type(schedule_t),   intent(inout) :: schedule
    type(clock_t),      intent(inout) :: clock

    if (abs(clock%time_step - increments%longest) > 0.0_wp) &
      call set_increment(increments%longest, clock, schedule)
    call choose_next(schedule, increments%longest, clock)
  end subroutine begin_increments

  !> One increment, from the time of the clock to the next; the clock may be set to a shorter one.
  !>
  !> Where none is found with the shortest increment it is `lost`, and the state is that of the last
  !> try. A residual that is small all the same will do, but not while loads grow: beyond their
  !> limit the body gives way ever more slowly, the shorter the increments are.
  !>
  !> Where a signal comes on the way it is `stopped`: state, clock and schedule are those before it.
  subroutine take_increment(clock, schedule, model, state, increments, ledger, timing)
    type(clock_t),      intent(inout) :: clock
    type(schedule_t),   intent(inout) :: schedule
    type(model_t),      intent(inout) :: model          !! its supports get their new forces
    type(state_t),      intent(inout) :: state
    type(increments_t), intent(inout) :: increments
    type(ledger_t),     intent(inout) :: ledger
    type(timing_t),     intent(inout) :: timing
    type(clock_t) :: clock_before
    type(schedule_t) :: schedule_before
    real(wp) :: t

    clock_before = clock
    schedule_before = schedule
    associate (relaxation => increments%relaxation, last => increments%last)
      t = clock%time()
      call timing%begin(clock%step + 1)
      call keep_start(relaxation, state)
      do
        call guess(model, t, clock%time_step, relaxation, state)
        call relax(model, t + clock%time_step, state, relaxation, timing, last)
        if (last%at_rest .or. last%stopped .or. clock%time_step <= increments%shortest) exit
        call return_to_start(relaxation, state)
        call set_increment(0.5_wp * clock%time_step, clock, schedule)
      end do
      if (last%stopped) then
        clock = clock_before
        schedule = schedule_before
        call take_back(t, model, state, increments)
        return
      end if
      increments%under_load = loads_at(model, t + clock%time_step) > loads_at(model, t)
      if (model%releases) increments%under_load = .true.
      increments%lost = .not. last%at_rest .and. (increments%under_load &
        .or. last%failed_row > 0 .or. last%residual > most_residual)
      if (increments%lost) return
      call clock%advance()
      if (.not. last%at_rest) call increments%unfinished%see(clock%step, last%residual)
      call settle(model, t, clock%time_step, relaxation, state, timing)
    end associate
    call enter_work(t, clock, model, state, increments, ledger)
    call choose_next(schedule, next_length(increments, clock%time_step), clock)
  end subroutine take_increment

  !> The state before the increment, all of it.
  subroutine take_back(t, model, state, increments)
    real(wp),           intent(in)    :: t            !! at its start [s]
    type(model_t),      intent(inout) :: model        !! its planes of mirrors move
    type(state_t),      intent(inout) :: state
    type(increments_t), intent(in)    :: increments

    associate (relaxation => increments%relaxation)
      call return_to_start(relaxation, state)
      call copy_rows(relaxation%displacement, relaxation%ends, relaxation%shared, &
        state%displacement)
    end associate
    call find_gradient(model, t, state)
  end subroutine take_back

  !> First guess of the next equilibrium: the motion goes on. The velocity of the state stays that
  !> of the last increment.
  subroutine guess(model, t, duration, relaxation, state)
    type(model_t),      intent(inout) :: model         !! its planes of mirrors move
    real(wp),           intent(in)    :: t, duration   !! [s]
    type(relaxation_t), intent(in)    :: relaxation
    type(state_t),      intent(inout) :: state
    real(wp), allocatable :: place(:), prescribed(:, :)

    associate (a => relaxation%ends(1), b => relaxation%ends(2), rows => relaxation%shared, &
      start => relaxation%displacement, free => model%points%free, v => state%velocity)
      state%displacement(a:b, :) = start(a:b, :) + duration * free(a:b, :) * v(a:b, :)
      state%displacement(rows, :) = start(rows, :) + duration * free(rows, :) * v(rows, :)
    end associate
    allocate (prescribed(size(state%velocity, 1), 2))   ! is written where supports are, not read
    call model%supports%prescribe(t + duration, state%displacement, prescribed)
    associate (mirror => model%operators%mirror)
      if (mirror%n == 0) return
      call mirror%move(t)   ! a try before may have left the planes elsewhere
      allocate (place, source=mirror%place)
      call mirror%move(t + duration)
      call mirror%carry(mirror%place - place, state%displacement)
    end associate
  end subroutine guess

  !> The increment is over: stress and history go on from its start, once; so do the supports.
  subroutine settle(model, t, duration, relaxation, state, timing)
    type(model_t),      intent(inout) :: model
    real(wp),           intent(in)    :: t, duration   !! [s]
    type(relaxation_t), intent(inout) :: relaxation
    type(state_t),      intent(inout) :: state
    type(timing_t),     intent(inout) :: timing
    integer :: failed_row

    call return_to_start(relaxation, state)
    if (allocated(model%operators%relaxing)) call model%operators%relaxing%follow(0.0_wp)
    call forces(model, t + duration, state, relaxation%blocks, timing, failed_row)
    associate (a => relaxation%ends(1), b => relaxation%ends(2), rows => relaxation%shared, &
      start => relaxation%displacement, u => state%displacement)
      state%velocity(a:b, :) = (u(a:b, :) - start(a:b, :)) / duration
      state%velocity(rows, :) = (u(rows, :) - start(rows, :)) / duration
    end associate
    call model%pushed%bring(state%velocity)
  end subroutine settle

  !> Work of the increment. That of supports and loads follows from the forces at both ends; what
  !> the forces have done on the way beyond that has left the body. On the way loads are those of
  !> the end, from the guess on, while those that grow do less.
  subroutine enter_work(t, clock, model, state, increments, ledger)
    real(wp),           intent(in)    :: t             !! its start [s]
    type(clock_t),      intent(in)    :: clock         !! at its end
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(increments_t), intent(inout) :: increments
    type(ledger_t),     intent(inout) :: ledger
    real(wp) :: work, beyond
    integer  :: k

    beyond = -ahead_of_loads(t, clock%time_step, model, state, increments%relaxation)
    do k = 1, size(model%supports%items)
      associate (support => model%supports%items(k)%support)
        work = support%work(state%velocity, t, t + clock%time_step)
        ledger%outer_work = ledger%outer_work + work
        ! loads are in the net forces already
        if (.not. allocated(support%load_kind)) beyond = beyond + work
      end associate
    end do
    ledger%outer_work = ledger%outer_work + model%loads%work(state%velocity, t, t + clock%time_step)
    call model%loads%add_block_work(model%blocks, state%velocity, t, t + clock%time_step, &
      ledger%work_at_points)
    ledger%damping = ledger%damping + increments%last%work
    if (model%blocks%has_first()) ledger%damping(1) = ledger%damping(1) + beyond
    call increments%jump%see(clock%step, model%blocks%total(increments%last%work) + beyond)
    ledger%plastic = ledger%plastic + increments%relaxation%blocks%dissipated
    ledger%control = ledger%control + increments%relaxation%blocks%relaxed
  end subroutine enter_work

  !> Work of the loads of the end on the way from the guess, beyond that of loads that grow evenly:
  !> half of what they have grown by, on this way [J/m].
  real(wp) function ahead_of_loads(t, duration, model, state, relaxation) result(work)
    real(wp),           intent(in) :: t, duration   !! [s]
    type(model_t),      intent(in) :: model
    type(state_t),      intent(in) :: state
    type(relaxation_t), intent(in) :: relaxation
    real(wp), allocatable :: before(:, :), load(:, :)
    real(wp) :: parts(model%blocks%count)
    integer  :: block

    call find_loads(model, t, before)
    call find_loads(model, t + duration, load)
    do block = 1, model%blocks%count
      associate (lo => model%blocks%lo(block), hi => model%blocks%hi(block))
        load(lo:hi, :) = 0.5_wp * (load(lo:hi, :) - before(lo:hi, :)) &
          * (state%displacement(lo:hi, :) - relaxation%guess(lo:hi, :))
        parts(block) = sum(model%points%volume(lo:hi) * (load(lo:hi, 1) + load(lo:hi, 2)))
      end associate
    end do
    work = model%blocks%total(parts)
  end function ahead_of_loads

  !> Remember the largest number so far.
  pure subroutine see(self, step, number)
    class(moment_t), intent(inout) :: self
    integer,         intent(in)    :: step
    real(wp),        intent(in)    :: number

    if (number <= self%number) return
    self%step = step
    self%number = number
  end subroutine see

  !> Length of an increment after one of some length, which was hard or easy [s].
  pure real(wp) function next_length(increments, before) result(wish)
    type(increments_t), intent(in) :: increments
    real(wp),           intent(in) :: before   !! [s]

    wish = before
    if (increments%last%moves > hard) wish = max(increments%shortest, 0.5_wp * wish)
    if (increments%last%moves < easy) wish = min(increments%longest, 2.0_wp * wish)
  end function next_length

  !> The next increment is a part of the time to the next frame, or to the end.
  subroutine choose_next(schedule, longest, clock)
    type(schedule_t), intent(inout) :: schedule
    real(wp),         intent(in)    :: longest   !! that the increment may be [s]
    type(clock_t),    intent(inout) :: clock
    real(wp), parameter :: round_off = 1.0e-6_wp
    real(wp) :: wish, left
    integer  :: k

    if (schedule%is_over(clock)) return
    wish = longest
    left = schedule%end_time - clock%time()
    do k = size(schedule%frame_times), 1, -1
      if (schedule%frame_steps(k) > clock%step) left = schedule%frame_times(k) - clock%time()
    end do
    wish = left / real(max(1, ceiling(left / wish - round_off)), wp)
    if (abs(wish - clock%time_step) > round_off * wish) call set_increment(wish, clock, schedule)
  end subroutine choose_next

  !> Increments of another length from the present step on.
  subroutine set_increment(duration, clock, schedule)
    real(wp),         intent(in)    :: duration   !! [s]
    type(clock_t),    intent(inout) :: clock
    type(schedule_t), intent(inout) :: schedule

    call clock%change_step(duration)
    call schedule%fit(clock)
  end subroutine set_increment

end module pd_increment
