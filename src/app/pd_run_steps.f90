!> What happens after the steps of a run: output that is due is written, unless the state fails or a
!> signal stops the run.
module pd_run_steps
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_agreement, only: any_rank
  use pd_doubts, only: look_at_balance, look_at_frame
  use pd_errors, only: error_list_t, exit_file, exit_interrupted, exit_terminated, outcome_t
  use pd_kinds, only: wp
  use pd_progress, only: progress_due
  use pd_record, only: observe_state, record_frame, record_progress, record_row
  use pd_record_checkpoint, only: save_checkpoint
  use pd_run, only: run_t
  use pd_run_end, only: fail, tell_signal
  use pd_state, only: n_news
  use pd_system, only: pending_signal, sigint
  use pd_timing, only: kernel_history
  implicit none
  private

  public :: due_t, due_after_step, write_what_is_due

  !> What is written after a step. This is known before the step: only then must its state be whole.
  type :: due_t
    logical :: row = .false., frame = .false., checkpoint = .false.
    logical :: stop = .false.      !! a signal came, or there was trouble with a file
    integer :: signal = 0          !! its number
    logical :: progress = .false.  !! is shown
    logical :: anything = .false.  !! something is written: the state will be observed
    logical :: whole = .false.     !! the state will be looked at
  end type due_t

contains

  !> What is due after a step. Clocks, signals and trouble with files differ from rank to rank: what
  !> one of them finds due is due. In a motion they tell each other what they find before a step
  !> while that goes on, and it takes effect after the next one; at once in the first and the last
  !> step, and at equilibrium, where steps are long and look for signals themselves.
  type(due_t) function due_after_step(step, run) result(due)
    integer,     intent(in)    :: step
    type(run_t), intent(inout) :: run
    integer :: found(n_news)

    due%row = run%schedule%row_due(step)
    due%frame = run%schedule%frames_due(step) > 0
    found = run%work%news
    if (run%model%at_equilibrium .or. .not. run%heard .or. step == run%schedule%steps) then
      found = found_before(step, run)
      call run%ranks%largest_numbers(found)
    end if
    due%signal = found(1)
    due%stop = due%signal /= 0 .or. found(4) > 0
    due%checkpoint = due%stop .or. found(2) > 0
    due%progress = found(3) > 0
    run%heard = .true.
    run%work%news = found_before(step + 1, run)
    if (due%checkpoint) run%work%news(2) = 0   ! not written yet, and not due again
    if (due%progress) run%work%news(3) = 0
    due%anything = due%row .or. due%frame .or. due%checkpoint
    due%whole = due%anything .or. run%limit%look_due(step) .or. run%model%at_equilibrium
  end function due_after_step

  !> What this rank finds: a signal, a checkpoint and a line of progress that are due after a step,
  !> and trouble with files.
  function found_before(step, run) result(found)
    integer,     intent(in) :: step
    type(run_t), intent(in) :: run
    integer :: found(n_news)
    integer(int64) :: now, rate

    call system_clock(now, rate)
    found = [pending_signal(), merge(1, 0, run%input%output%checkpoint_due( &
      real(now - run%last_checkpoint, wp) / real(rate, wp), last=step == run%schedule%steps, &
      cost=run%checkpoint_seconds)), 0, merge(1, 0, run%trouble%count() > 0)]
    if (.not. run%record%elsewhere) &
      found(3) = merge(1, 0, progress_due(run%record%progress, step, run%schedule%steps))
  end function found_before

  !> Write what is due, but check the state first: a run that gains energy has failed.
  !>
  !> `failed_row`: of the step, see `take_step`.
  subroutine write_what_is_due(due, failed_row, run, outcome)
    type(due_t),     intent(in)    :: due
    integer,         intent(in)    :: failed_row
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    logical :: in_trouble

    run%whole = due%whole
    if (failed_row > 0) &
      call fail('det F is not positive, or not a number', failed_row, run, outcome)
    if (outcome%done) return
    if (due%anything) then
      call run%ledger%note_work(run%model%blocks)
      call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
      call look_at_balance(run, outcome, errors)
      if (outcome%done) return
    end if
    if (due%row) call record_row(run%record, errors)
    if (due%progress) &
      call record_progress(run%model, run%state, run%schedule, run%clock, run%record, errors)
    call run%timing%lap(kernel_history)
    call write_frames_and_checkpoint(due, run, errors)
    if (due%stop .and. run%trouble%count() > 0) errors = run%trouble
    in_trouble = errors%count() > 0
    if (due%anything .or. due%progress) in_trouble = any_rank(run%ranks, in_trouble)
    if (due%stop .and. .not. in_trouble) &
      call tell_signal(due%signal, 'goes on from the checkpoint', run, errors)
    if (in_trouble .and. .not. due%whole) then
      run%trouble = errors   ! one step more, whose state can be kept
      return
    end if
    call outcome%end_if_any(errors, exit_file)
    if (in_trouble .or. due%stop) call outcome%agree(run%ranks)
    if (due%stop .and. .not. outcome%done) &
      call outcome%end_with(merge(exit_interrupted, exit_terminated, due%signal == sigint))
  end subroutine write_what_is_due

  !> Write the frames that are due at this step, and a checkpoint.
  subroutine write_frames_and_checkpoint(due, run, errors)
    type(due_t),        intent(in)    :: due
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    integer(int64) :: begun, rate
    integer :: k

    if (due%frame) call look_at_frame(run, errors)
    do k = 1, merge(run%schedule%frames_due(run%clock%step), 0, due%frame)
      call record_frame(run%model, run%state, run%record, errors)
    end do
    if (.not. due%checkpoint) return
    call system_clock(begun, rate)
    call save_checkpoint(run%model, run%state, run%ledger, run%clock, run%limit, &
      run%record, errors)
    call system_clock(run%last_checkpoint)
    run%checkpoint_seconds = real(run%last_checkpoint - begun, wp) / real(rate, wp)
  end subroutine write_frames_and_checkpoint

end module pd_run_steps
