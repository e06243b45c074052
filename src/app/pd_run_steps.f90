!> What happens around the steps of a run: output that is due is written, and the run ends, fails,
!> or is stopped by a signal.
module pd_run_steps
  use, intrinsic :: iso_fortran_env, only: error_unit, int64
  use pd_errors, only: error_list_t, exit_calculation, exit_file, exit_interrupted, exit_ok, &
    exit_terminated, outcome_t
  use pd_kinds, only: wp
  use pd_observe, only: imbalance, over_work
  use pd_progress, only: progress_due
  use pd_record, only: close_record, observe_state, record_failure, record_frame, record_line, &
    record_progress, record_row, save_checkpoint
  use pd_run, only: run_t
  use pd_system, only: pending_signal, sigint
  use pd_text, only: integer_text, short_number
  use pd_timing, only: kernel_history, kernel_names
  use pd_unbalanced, only: loads_at
  implicit none
  private

  public :: due_t, look_at_time_step, due_after_step, write_what_is_due, end_without_equilibrium
  public :: finish_run

  !> What is written after a step. This is known before the step: only then must its state be whole.
  type :: due_t
    logical :: row = .false., frame = .false., checkpoint = .false.
    logical :: stop = .false.      !! a signal came
    logical :: anything = .false.  !! something is written: the state will be observed
    logical :: whole = .false.     !! the state will be looked at
  end type due_t

contains

  !> Before a step: make it shorter if the body has strained so much that it is too long by now. A
  !> step that the user has fixed is only doubted, once.
  subroutine look_at_time_step(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    real(wp), parameter :: courant_safety = 0.9_wp   ! that of the input is of another limit
    type(error_list_t) :: errors
    logical :: found

    if (.not. run%limit%look_due(run%clock%step)) return
    call look_at_flow(run, errors)
    call run%limit%look(run%model, run%state, run%clock, &
      run%ledger%plastic_dissipation(run%model%blocks), found)
    if (found) then
      associate (given => run%input%integration)
        if (given%time_step_rule == 'fixed') then
          call doubt_time_step(run, errors)
        else if (given%time_step_rule == 'courant') then
          call shorten_time_step(courant_safety, run, outcome, errors)
        else
          call shorten_time_step(given%safety, run, outcome, errors)
        end if
      end associate
      call run%timing%lap(kernel_history)
    end if
    if (.not. outcome%done) call outcome%end_if_any(errors, exit_file)
  end subroutine look_at_time_step

  !> Go back to a part of the stable step where half of the margin is used up.
  !> A body that goes on to collapse would have ever shorter steps: it has failed.
  subroutine shorten_time_step(safety, run, outcome, errors)
    real(wp),           intent(in)    :: safety
    type(run_t),        intent(inout) :: run
    type(outcome_t),    intent(inout) :: outcome
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: most = 0.95_wp   ! or one would have to look all the time
    real(wp) :: part, stable

    part = min(safety, most)
    stable = 2.0_wp / run%limit%frequency
    if (run%clock%time_step <= 0.5_wp * (1.0_wp + part) * stable) return
    if (part * stable < run%limit%shortest) then
      call fail('the stable time step has fallen below a thousandth of the first one', &
        fastest_row(run), run, outcome)
      return
    end if
    call run%clock%change_step(part * stable)
    call run%schedule%fit(run%clock)
    call record_line(run%record, 'time step shortened to '//short_number(run%clock%time_step)// &
      ' s at step '//integer_text(run%clock%step)//', time '//short_number(run%clock%time())// &
      ' s: 2/omega_max of the deformed body is now '//short_number(stable)//' s', errors)
  end subroutine shorten_time_step

  !> Warn of a time step beyond the stable one.
  subroutine doubt_time_step(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    if (run%step_doubted .or. run%clock%time_step * run%limit%frequency <= 2.0_wp) return
    run%step_doubted = .true.
    call record_line(run%record, 'warning: the time step is too long for the deformed body at '// &
      'step '//integer_text(run%clock%step)//': 2/omega_max is now '// &
      short_number(2.0_wp / run%limit%frequency)//' s; the rule spectral would shorten it', errors)
  end subroutine doubt_time_step

  !> Flow that turns back meets a strength that kinematic softening has raised: told once, when it
  !> has made more than a twentieth of the heat.
  subroutine look_at_flow(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: sizeable = 0.05_wp

    if (run%flow_doubted .or. .not. run%reversal%is_possible()) return
    call run%reversal%look(run%model%materials, run%model%blocks, run%model%points%volume, &
      run%state, run%ledger%plastic)
    if (run%reversal%part() <= sizeable) return
    run%flow_doubted = .true.
    call record_line(run%record, 'warning: the flow turns back: at step '// &
      integer_text(run%clock%step)//', '//short_number(100.0_wp * run%reversal%part())// &
      ' % of the plastic heat is of flow against the back stress; kinematic softening makes '// &
      'the material stronger backwards, up to 2 sigma_y - sigma_r; isotropic_modulus '// &
      'does not', errors)
  end subroutine look_at_flow

  !> What is due after a step. A signal that comes during a step takes effect after the next one.
  type(due_t) function due_after_step(step, run) result(due)
    integer,     intent(in) :: step
    type(run_t), intent(in) :: run
    integer(int64) :: now, rate

    due%row = run%schedule%row_due(step)
    due%frame = run%schedule%frames_due(step) > 0
    due%stop = pending_signal() /= 0
    due%checkpoint = due%stop
    associate (every => run%input%output%checkpoint_every)
      if (every > 0.0_wp) then
        call system_clock(now, rate)
        due%checkpoint = due%checkpoint .or. step == run%schedule%steps .or. &
          real(now - run%last_checkpoint, wp) >= every * real(rate, wp)
      end if
    end associate
    due%anything = due%row .or. due%frame .or. due%checkpoint
    due%whole = due%anything .or. run%limit%look_due(step)
  end function due_after_step

  !> Write what is due, but check the state first: a run that gains energy has failed.
  !>
  !> `failed_row`: of the step, see `take_step`.
  subroutine write_what_is_due(due, failed_row, run, outcome)
    type(due_t),     intent(in)    :: due
    integer,         intent(in)    :: failed_row
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors

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
    if (progress_due(run%record%progress, run%clock%step, run%schedule%steps)) &
      call record_progress(run%model, run%state, run%schedule, run%clock, run%record, errors)
    call run%timing%lap(kernel_history)
    call write_frames_and_checkpoint(due, run, errors)
    if (due%stop .and. errors%count() == 0) call record_line(run%record, &
      'stopped by a signal; --restart goes on from the checkpoint', errors)
    call outcome%end_if_any(errors, exit_file)
    if (due%stop .and. .not. outcome%done) &
      call outcome%end_with(merge(exit_interrupted, exit_terminated, pending_signal() == sigint))
  end subroutine write_what_is_due

  !> A balance of energies that lacks more than 1 % is a doubt, told once; more than a tenth is a
  !> failure: the row is not called good, whether energy came or went.
  !>
  !> Loads and platens that set in at once excite motions at the frequency of the steps, whose
  !> energy the scheme does not see rightly. That error stays while the work grows: the first steps
  !> fail only where they have gained as much energy as was put in, and the very first one, after
  !> which loads have given half a kick and no work has been done, not at all.
  subroutine look_at_balance(run, outcome, errors)
    type(run_t),        intent(inout) :: run
    type(outcome_t),    intent(inout) :: outcome
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: doubtful = 1.0e-2_wp, failed = 0.1_wp
    integer,  parameter :: first_steps = 20
    real(wp) :: lacking
    logical  :: first

    first = run%clock%step <= first_steps .and. .not. run%schedule%is_over(run%clock)
    if (first .and. run%clock%step == 1) return
    lacking = imbalance(run%record%seen, run%ledger)
    if (first .and. lacking <= 1.0_wp) return
    if (.not. abs(lacking) <= failed .and. .not. run%model%at_equilibrium) then
      call fail('the energy balance is off by '//short_number(100.0_wp * lacking)// &
        ' % of the work, at most 10 %', fastest_row(run), run, outcome)
    else if (abs(lacking) > doubtful .and. .not. run%doubted) then
      run%doubted = .true.
      call record_line(run%record, 'warning: the energy balance is off by '// &
        short_number(100.0_wp * lacking)//' % of the work at step '// &
        integer_text(run%clock%step)//'; above 1 % '//remedy(run)//' is due', errors)
    end if
    if (outcome%done) return
    call look_at_control(run, errors)
    call look_at_equilibrium(run, errors)
  end subroutine look_at_balance

  !> What mends a balance.
  pure function remedy(run) result(text)
    type(run_t), intent(in) :: run
    character(:), allocatable :: text

    text = 'a smaller safety or time step'
    if (run%model%at_equilibrium) text = 'a larger number of increments'
  end function remedy

  !> A control of zero-energy modes with more than 1 % of the work carries load that the material
  !> may not be able to: told once.
  subroutine look_at_control(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: most = 1.0e-2_wp
    real(wp) :: part

    if (run%control_doubted) return
    part = over_work(run%record%seen%value('stabilisation_energy'), run%ledger)
    if (part <= most) return
    run%control_doubted = .true.
    call record_line(run%record, 'warning: the control of zero-energy modes has '// &
      short_number(100.0_wp * part)//' % of the work at step '//integer_text(run%clock%step)// &
      '; above 1 % it carries load that the material may not: a weaker control is due', errors)
  end subroutine look_at_control

  !> Forces that are not in balance where they are meant to be: told once.
  !>
  !> On the way of equilibrium increments that did not come to rest. In a damped motion, which is
  !> meant to follow equilibrium, a damping that carries a sizeable part of the load.
  subroutine look_at_equilibrium(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    !> The start of a motion is none of equilibrium.
    real(wp), parameter :: most = 5.0e-2_wp, at_first = 0.1_wp
    real(wp) :: part

    if (run%model%at_equilibrium) then
      call look_at_flow(run, errors)
      call tell_of_jump(run, errors)
    end if
    if (run%balance_doubted) return
    if (run%model%at_equilibrium) then
      if (run%increments%unfinished == 0) return
      call record_line(run%record, 'warning: an increment was taken that is not at rest: the '// &
        'unbalanced force at step '//integer_text(run%clock%step)//' is '// &
        short_number(run%increments%last%residual)//' of the reactions and loads', errors)
    else
      part = run%record%seen%value('damping_share')
      if (.not. part > most .or. run%clock%time() < at_first * run%schedule%end_time) return
      call record_line(run%record, 'warning: forces of the damping are '// &
        short_number(100.0_wp * part)//' % of the reactions and loads at step '// &
        integer_text(run%clock%step)//'; stresses then depend on rate and damping: slower '// &
        'loading, less damping, or method = ''equilibrium''', errors)
    end if
    run%balance_doubted = .true.
  end subroutine look_at_equilibrium

  !> Where no equilibrium is near, the next one may be far: told once.
  subroutine tell_of_jump(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: sizeable = 1.0e-2_wp   ! of all work

    if (run%jump_told) return
    if (over_work(run%increments%released, run%ledger) <= sizeable) return
    run%jump_told = .true.
    call record_line(run%record, 'a jump at step '//integer_text(run%clock%step)// &
      ': no equilibrium was near, and '//short_number(run%increments%released)// &
      ' J/m were set free on the way to the next one (damping_dissipation)', errors)
  end subroutine tell_of_jump

  !> No equilibrium was found. Under loads that is their limit: the last equilibrium is written, and
  !> the run is finished. Without loads it is a failure.
  subroutine end_without_equilibrium(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    character(:), allocatable :: tried
    integer :: row

    associate (last => run%increments%last, t => run%clock%time())
      tried = short_number(t + run%clock%time_step)//' s, where the unbalanced force is '// &
        short_number(last%residual)//' of reactions and loads after '// &
        integer_text(last%moves)//' moves'
      if (.not. run%increments%under_load) then
        row = last%failed_row
        if (row == 0) row = fastest_row(run)
        call fail('no equilibrium was found at '//tried, row, run, outcome)
        return
      end if
      if (run%record%moment%step /= run%clock%step) then
        call run%ledger%note_work(run%model%blocks)
        call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
        call record_row(run%record, errors)
      end if
      call record_frame(run%model, run%state, run%record, errors)
      call record_line(run%record, 'limit load: the last equilibrium is at '//short_number(t)// &
        ' s, under loads of '//short_number(loads_at(run%model, t))//' N/m in all; there is '// &
        'none at '//tried, errors)
    end associate
    call outcome%end_if_any(errors, exit_file)
    if (.not. outcome%done) call finish_run(run, outcome)
    if (.not. outcome%done) call outcome%end_with(exit_ok)
  end subroutine end_without_equilibrium

  !> Write the frames that are due at this step, and a checkpoint.
  subroutine write_frames_and_checkpoint(due, run, errors)
    type(due_t),        intent(in)    :: due
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    integer :: k

    do k = 1, merge(run%schedule%frames_due(run%clock%step), 0, due%frame)
      call record_frame(run%model, run%state, run%record, errors)
    end do
    if (.not. due%checkpoint) return
    call save_checkpoint(run%model, run%state, run%ledger, run%clock, run%limit, &
      run%record, errors)
    call system_clock(run%last_checkpoint)
  end subroutine write_frames_and_checkpoint

  !> The row that moves fastest among those that are free: where a run fails that gains energy.
  pure integer function fastest_row(run)
    type(run_t), intent(in) :: run

    fastest_row = maxloc(sum((run%model%points%free * run%state%velocity)**2, dim=2), dim=1)
  end function fastest_row

  !> The calculation has failed: write the state apart from the valid frames, and report where.
  subroutine fail(reason, row, run, outcome)
    character(*),    intent(in)    :: reason
    integer,         intent(in)    :: row
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, file_errors
    character(160) :: where

    associate (x => run%model%points%position)
      write (where, '(a,i0,a,es12.5,a,i0,a,g0.7,a,g0.7,a)') 'step ', run%clock%step, ', time ', &
        run%clock%time(), ' s, point ', run%model%operators%storage%point_at(row), ' at (', &
        x(row, 1), ', ', x(row, 2), ') m'
    end associate
    call record_failure(run%model, run%state, run%clock, run%record, file_errors)
    call record_line(run%record, 'the calculation failed: '//reason//'; '//trim(where), file_errors)
    call file_errors%print(error_unit)
    call errors%add('the calculation failed: '//reason//'; the frames and rows before this '// &
      'step are good; '//remedy(run)//' may help', trim(where))
    call outcome%end_if_any(errors, exit_calculation)
  end subroutine fail

  !> End a run that is complete.
  subroutine finish_run(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors

    call tell_where_time_went(run, errors)
    call record_line(run%record, 'results in '//run%record%stem//'.h5, .xdmf, _history.csv', errors)
    call close_record(run%record, errors)
    call outcome%end_if_any(errors, exit_file)
  end subroutine finish_run

  !> Last lines of the log: seconds of the time loop and of its kernels; the rest is frames and
  !> checkpoints.
  subroutine tell_where_time_went(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    integer(int64) :: now, rate
    character(256) :: line
    real(wp) :: whole
    integer  :: k

    call system_clock(now, rate)
    whole = real(now - run%loop_start, wp) / real(rate, wp)
    write (line, '(a,f10.3,a,i0)') 'time loop ', whole, ' s, steps ', &
      run%clock%step - run%checkpoint%clock%step
    if (run%model%at_equilibrium) line = trim(line)//', evaluations of the forces '// &
      integer_text(run%increments%relaxation%moves + run%clock%step - run%checkpoint%clock%step)
    call record_line(run%record, trim(line), errors)
    write (line, '(a,9(2x,a,f9.3))') 'kernels [s] ', &
      (trim(kernel_names(k)), run%timing%seconds(k), k=1, size(kernel_names)), 'frames', &
      max(0.0_wp, whole - sum(run%timing%seconds))
    call record_line(run%record, trim(line), errors)
  end subroutine tell_where_time_went

end module pd_run_steps
