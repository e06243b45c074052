!> perigeo: peridynamics for geomaterials.
!>
!> The algorithm and nothing else; doc/theory.md, section 6: u gives H, H gives the stress and A,
!> A gives f, f gives v.
program perigeo
  use pd_check, only: begin_program, print_check
  use pd_command_line, only: options_t
  use pd_doubts, only: look_at_end, look_at_time_step
  use pd_errors, only: outcome_t
  use pd_exit, only: leave
  use pd_increment, only: take_increment
  use pd_run, only: open_outputs, run_t, set_up_run
  use pd_run_changes, only: begin_motion_if_due
  use pd_run_end, only: close_run, end_without_equilibrium, finish_run
  use pd_run_stages, only: begin_stage_if_due
  use pd_run_steps, only: due_after_step, due_t, write_what_is_due
  use pd_step, only: take_step
  use pd_strength_reduction, only: find_factor_of_safety
  use pd_system, only: catch_signals
  implicit none

  type(options_t) :: options
  type(run_t)     :: run
  type(outcome_t) :: outcome
  type(due_t)     :: due
  integer         :: failed_row

  call begin_program(options, run%ranks, outcome)
  if (.not. outcome%done) call set_up_run(options, run, outcome)
  call outcome%agree(run%ranks)
  if (options%check .and. .not. outcome%done) &
    call print_check(options%input_path, options%points_path, options%threads, run, outcome)
  call catch_signals()
  if (.not. outcome%done) call open_outputs(options, run, outcome)
  do while (.not. outcome%done .and. .not. run%schedule%is_over(run%clock))
    call begin_motion_if_due(run, outcome)
    call begin_stage_if_due(run, outcome)   ! a checkpoint is of the state before it
    if (outcome%done) exit
    if (run%model%at_equilibrium) then
      call take_increment(run%clock, run%schedule, run%model, run%state, run%increments, &
        run%ledger, run%timing)
      if (run%increments%lost .or. run%increments%last%stopped) then
        call end_without_equilibrium(run, outcome)
        exit
      end if
      due = due_after_step(run%clock%step, run)
      failed_row = 0
    else
      call look_at_time_step(run, outcome)
      if (outcome%done) exit
      due = due_after_step(run%clock%step + 1, run)
      call take_step(run%clock, due%whole, run%model, run%state, run%work, run%ledger, &
        run%timing, failed_row)
    end if
    call write_what_is_due(due, failed_row, run, outcome)
  end do
  if (.not. outcome%done) call look_at_end(run, outcome)
  if (.not. (outcome%done .or. run%increments%lost)) call find_factor_of_safety(run, outcome)
  if (.not. outcome%done) call finish_run(run, outcome)
  call close_run(run, outcome)
  call leave(outcome, run%ranks)
end program perigeo
