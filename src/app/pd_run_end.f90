!> How a run ends: complete, at the limit of its loads, by a signal, or with a failure.
module pd_run_end
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: error_unit, int64
  use pd_agreement, only: any_rank, signal_of
  use pd_errors, only: error_list_t, exit_calculation, exit_file, exit_interrupted, &
    exit_terminated, outcome_t
  use pd_increment, only: take_back
  use pd_kinds, only: wp
  use pd_lock, only: release_lock
  use pd_quality, only: tell_quality
  use pd_record, only: close_record, observe_state, record_failure, record_frame, record_line, &
    record_row
  use pd_record_checkpoint, only: save_checkpoint, save_last_checkpoint
  use pd_run, only: run_t
  use pd_system, only: sigint, signal_name
  use pd_text, only: coordinate_text, integer_text, short_number
  use pd_timing, only: kernel_names
  use pd_unbalanced, only: loads_at
  implicit none
  private

  public :: finish_run, end_without_equilibrium, stop_by_signal, tell_signal
  public :: fail, fastest_row, remedy, close_run

contains

  !> No equilibrium was found, because of a signal, or none is there. Under loads that is their
  !> limit: the last equilibrium is written, and the run is to be finished. Without loads, or from
  !> the start, it is a failure.
  subroutine end_without_equilibrium(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    character(:), allocatable :: tried, loads
    integer :: row

    if (run%increments%last%stopped) then
      call stop_by_signal('goes on from the checkpoint', run, outcome)
      return
    end if
    associate (last => run%increments%last, t => run%clock%time())
      tried = short_number(t + run%clock%time_step)//' s, where '
      if (last%failed_row > 0) then
        tried = tried//'det F is no longer positive at a point after '
      else
        tried = tried//'the unbalanced force is '//short_number(last%residual)// &
          ' of reactions and loads after '
      end if
      tried = tried//integer_text(last%moves)//' moves'
      if (run%clock%step == 0) tried = tried//'; is the body held, and the first load below '// &
        'its limit?'
      if (.not. run%increments%under_load .or. run%clock%step == 0) then
        row = last%failed_row
        if (row == 0) row = fastest_row(run)
        call fail('no equilibrium was found at '//tried, row, run, outcome)
        return
      end if
      call take_back(t, run%model, run%state, run%increments)
      if (run%record%moment%step /= run%clock%step) then
        call run%ledger%note_work(run%model%blocks)
        call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
        call record_row(run%record, errors)
      end if
      call record_frame(run%model, run%state, run%record, errors)
      loads = short_number(loads_at(run%model, t))//' N/m in all'
      associate (gravity => norm2(run%model%loads%acceleration(t)))
        if (gravity > 0.0_wp) loads = loads//', with gravity of '//short_number(gravity)//' m/s^2'
      end associate
      call record_line(run%record, 'limit load: the last equilibrium is at '//short_number(t)// &
        ' s'//stage_in_words(run)//', under loads of '//loads//'; there is none at '//tried, errors)
    end associate
    if (size(run%input%strength_reduction) > 0) call record_line(run%record, &
      'no factor of safety: the body does not bear the loads of the end of the run', errors)
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine end_without_equilibrium

  !> A signal has come while a state was looked for that is none to go on from: keep the one before
  !> it, which is that of the run again.
  subroutine stop_by_signal(next, run, outcome)
    character(*),    intent(in)    :: next      !! what --restart does
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    integer :: signal

    signal = signal_of(run%ranks)
    call save_checkpoint(run%model, run%state, run%ledger, run%clock, run%limit, run%record, errors)
    if (.not. any_rank(run%ranks, errors%count() > 0)) then
      call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
      call tell_signal(signal, next, run, errors)
    end if
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
    if (.not. outcome%done) &
      call outcome%end_with(merge(exit_interrupted, exit_terminated, signal == sigint))
  end subroutine stop_by_signal

  !> Last lines of the log of a run that is stopped; a checkpoint has been written.
  subroutine tell_signal(signal, next, run, errors)
    integer,            intent(in)    :: signal
    character(*),       intent(in)    :: next     !! what --restart does
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    call tell_quality(run, 'so far', .false., errors)
    call record_line(run%record, 'stopped by a signal ('//signal_name(signal)//'); --restart '// &
      next, errors)
  end subroutine tell_signal

  !> How far the present stage has come; '' without stages.
  pure function stage_in_words(run) result(text)
    type(run_t), intent(in) :: run
    character(:), allocatable :: text

    text = ''
    associate (stage => run%stages(run%clock%stage))
      if (stage%name /= '') text = ', '//short_number(100.0_wp * (run%clock%time() &
        - stage%start_time) / (stage%end_time - stage%start_time))//' % of the way through '// &
        'stage '''//stage%name//''''
    end associate
  end function stage_in_words

  !> The row that moves fastest among those that are free: where a run fails that gains energy.
  integer function fastest_row(run)
    type(run_t), intent(in) :: run
    real(wp), allocatable :: velocity(:, :)

    allocate (velocity, source=run%model%points%free * run%state%velocity)
    call run%model%blocks%spread_rows(velocity)
    fastest_row = maxloc(sum(velocity**2, dim=2), dim=1)
  end function fastest_row

  !> What mends a balance. Without a control of zero-energy modes these grow until the state fails:
  !> shorter steps then fail at the same strain.
  pure function remedy(run) result(text)
    type(run_t), intent(in) :: run
    character(:), allocatable :: text

    text = 'a smaller safety or time step'
    if (run%model%at_equilibrium) text = 'a larger number of increments'
    if (run%input%stabilisation%method == 'none') text = 'a control of zero-energy modes '// &
      '(&stabilisation method = ''relaxing''), else '//text//','
  end function remedy

  !> Strain, det F and zero-energy part of the deformation at a row, in words.
  function state_at(row, run) result(text)
    integer,     intent(in) :: row
    type(run_t), intent(in) :: run
    character(:), allocatable :: text
    real(wp) :: z2(run%model%operators%n), h(4), part(1)
    logical  :: mine

    text = 'not a number there'
    associate (blocks => run%model%blocks)
      mine = row >= blocks%first .and. row <= blocks%last
      h = 0.0_wp
      if (mine) h = run%state%displacement_gradient(row, :)
      call blocks%ranks%fill_in(h)
      if (.not. all(ieee_is_finite(h)) .or. maxval(abs(h)) > 1.0e100_wp) return
      call run%model%operators%zero_energy_squared(run%state%displacement, &
        run%state%displacement_gradient, z2)
      part = 0.0_wp
      if (mine) part = sqrt(z2(row) / run%model%operators%weight_sum(row)) / run%model%delta
      call blocks%ranks%fill_in(part)
    end associate
    text = 'there strain is '//short_number(h(1))//', '//short_number(h(4))//', '// &
      short_number(0.5_wp * (h(2) + h(3)))//' (xx, yy, xy), det F '// &
      short_number((1.0_wp + h(1)) * (1.0_wp + h(4)) - h(2) * h(3))//', zero_energy '// &
      short_number(part(1))
  end function state_at

  !> The calculation has failed: write the state apart from the valid frames, and report where.
  subroutine fail(reason, row, run, outcome)
    character(*),    intent(in)    :: reason
    integer,         intent(in)    :: row
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, file_errors
    character(:), allocatable :: where
    real(wp) :: x(2)

    associate (blocks => run%model%blocks)
      x = 0.0_wp
      if (row >= blocks%first .and. row <= blocks%last) x = run%model%points%position(row, :)
      call blocks%ranks%fill_in(x)
      where = 'step '//integer_text(run%clock%step)//', time '//short_number(run%clock%time())// &
        ' s, point '//integer_text(run%model%operators%storage%point_at(row))//' at ('// &
        coordinate_text(x(1), run%model%spacing)//', '// &
        coordinate_text(x(2), run%model%spacing)//') m'
    end associate
    call record_failure(run%model, run%state, run%clock, run%record, file_errors)
    call record_line(run%record, 'the calculation failed: '//reason//'; '//where//'; '// &
      state_at(row, run), file_errors)
    call tell_quality(run, 'when it was looked at last', .true., file_errors)
    call file_errors%print(error_unit)
    call errors%add('the calculation failed: '//reason//'; '//state_at(row, run)//'; the '// &
      'frames and rows before this step are good; '//remedy(run)//' may help', where)
    call outcome%end_if_any(errors, exit_calculation)
  end subroutine fail

  !> End a run that is complete.
  subroutine finish_run(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors

    call tell_quality(run, 'at the end', .false., errors)
    call tell_where_time_went(run, errors)
    call record_line(run%record, 'results in '//run%record%stem//'.h5, .xdmf, _history.csv', errors)
    call close_record(run%record, errors)
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine finish_run

  !> Whatever the outcome: keep the state of a run that ends because of a file, and let others have
  !> its results.
  subroutine close_run(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome

    call keep_state(run, outcome)
    call release_lock(run%lock)
  end subroutine close_run

  !> A run that ends because of a file: keep its state, if that can be written.
  subroutine keep_state(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, unheard
    character(:), allocatable :: text

    if (outcome%status /= exit_file .or. .not. run%whole) return
    if (run%ranks%count > 1 .and. .not. outcome%agreed) return   ! the others are not here
    call save_last_checkpoint(run%model, run%state, run%ledger, run%clock, run%limit, &
      run%record, errors)
    text = 'the state of step '//integer_text(run%clock%step)//' could not be kept'
    if (errors%count() == 0) text = 'a checkpoint of step '//integer_text(run%clock%step)// &
      ' was written: --restart goes on from it once that is mended'
    call outcome%errors%add(text)
    call record_line(run%record, text, unheard)
  end subroutine keep_state

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

end module pd_run_end
