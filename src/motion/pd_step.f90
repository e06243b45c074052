!> One step of velocity Verlet, and where its time goes.
!>
!> Source: doc/theory.md, section 6.
module pd_step
  use pd_clock, only: clock_t
  use pd_forces, only: forces
  use pd_kinds, only: wp
  use pd_ledger, only: ledger_t
  use pd_model, only: damping_frame, model_t
  use pd_state, only: block_work_t, n_news, state_t
  use pd_timing, only: kernel_boundaries, kernel_motion, timing_t
  use pd_verlet, only: kicks_t, move_points
  implicit none
  private

  public :: step_work_t, take_step

  !> Work space of the steps, and what one step passes on to the next.
  type :: step_work_t
    type(block_work_t), private :: blocks
    integer :: news(n_news) = 0   !! before a step: of this rank; after it: the largest of any
    !> v is v^{n+1/2}: the second half kick of the last step comes together with the first one of
    !> the next, which saves a pass through memory.
    logical, private :: open = .false.
  end type step_work_t

contains

  !> One step, from the time of the clock to the next: loads are added to f, and do work on
  !> v^{n+1/2}.
  !>
  !> `whole`: the state will be looked at; otherwise v and the ledger may be half a kick behind
  !> until the next step. No bit of the output depends on it.
  !> `failed_row`: 0, or the first row whose det F is not positive (NaN included).
  subroutine take_step(clock, whole, model, state, work, ledger, timing, failed_row)
    type(clock_t),     intent(inout) :: clock
    logical,           intent(in)    :: whole
    type(model_t),     intent(inout) :: model          !! its supports get their new forces
    type(state_t),     intent(inout) :: state
    type(step_work_t), intent(inout) :: work
    type(ledger_t),    intent(inout) :: ledger
    type(timing_t),    intent(inout) :: timing
    integer,           intent(out)   :: failed_row
    real(wp) :: t, t_next

    t = clock%time()
    call clock%advance()
    t_next = clock%time()
    call timing%begin(clock%step)
    associate (dt => clock%time_step, blocks => work%blocks)
      call move_points(kicks_t(second=work%open, first=.true.), model, damping_frame(model, t), &
        dt, state, blocks)
      if (work%open) call enter_damping(blocks%damping(1:2, :), ledger)
      call enter_damping(blocks%damping(3:4, :), ledger)
      call timing%lap(kernel_motion)
      call model%supports%prescribe(t_next, state%displacement, state%velocity)
      call timing%lap(kernel_boundaries)
      blocks%news = work%news
      call forces(model, t_next, state, blocks, timing, failed_row)
      work%news = blocks%news
      ledger%plastic = ledger%plastic + blocks%dissipated
      ledger%control = ledger%control + blocks%relaxed
      ledger%outer_work = ledger%outer_work + (model%supports%work(state%velocity, t, t_next) &
        + model%loads%work(state%velocity, t, t_next))
      call model%loads%add_block_work(model%blocks, state%velocity, t, t_next, &
        ledger%work_at_points)
      work%open = .not. whole
      if (work%open) return
      call move_points(kicks_t(second=.true.), model, damping_frame(model, t_next), dt, state, &
        blocks)
      call enter_damping(blocks%damping(1:2, :), ledger)
    end associate
    call timing%lap(kernel_motion)
  end subroutine take_step

  !> Add the work of the damping in half a step to the ledger.
  pure subroutine enter_damping(work, ledger)
    real(wp),       intent(in)    :: work(:, :)   !! dissipated, done by the frame (2,blocks) [J/m]
    type(ledger_t), intent(inout) :: ledger

    ledger%damping = ledger%damping + work(1, :)
    ledger%work_at_points = ledger%work_at_points + work(2, :)
  end subroutine enter_damping

end module pd_step
