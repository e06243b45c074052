!> perigeo: peridynamics for geomaterials.
!>
!> The algorithm and nothing else; doc/theory.md, section 6:
!> u gives F, F gives S and A, A gives f, f gives v.
program perigeo
  use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use pd_checkpoint, only: checkpoint_t
  use pd_command_line, only: options_t, print_help, read_command_line
  use pd_errors, only: error_list_t, exit_calculation, exit_command_line, exit_file, exit_input, &
    exit_interrupted, exit_model, exit_ok, exit_terminated, stop_if_any
  use pd_input, only: read_input
  use pd_input_reference, only: write_input_reference
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_observe, only: ledger_t, observation_t, observe, running_away
  use pd_progress, only: progress_due
  use pd_record, only: close_record, load_checkpoint, observe_state, open_record, record_failure, &
    record_frame, record_line, record_progress, record_row, record_t, results_in_the_way, &
    same_points, save_checkpoint
  use pd_schedule, only: row_due, schedule_t
  use pd_model, only: find_highest_frequency, model_t, start
  use pd_setup, only: set_up_body, set_up_model, set_up_schedule
  use pd_state, only: state_t
  use pd_step, only: step_work_t, take_step
  use pd_summary, only: estimated_seconds, summarise, summary_t
  use pd_system, only: catch_signals, exit_program, pending_signal, sigint
  use pd_timing, only: kernel_names, timing_t
  use pd_version, only: code_version, git_hash
  implicit none

  !> What is written after a step. Known before it: only then has its state to be whole.
  type :: due_t
    logical :: row = .false., frame = .false., checkpoint = .false.
    logical :: stop = .false.   ! a signal came
  end type due_t

  type(options_t)    :: options
  type(input_t)      :: input
  type(model_t)      :: model
  type(schedule_t)   :: schedule
  type(state_t)      :: state
  type(ledger_t)     :: ledger
  type(record_t)     :: record
  type(timing_t)     :: timing
  type(checkpoint_t) :: checkpoint
  type(error_list_t) :: errors, warnings
  type(step_work_t)  :: work
  integer :: step, failed_point
  type(due_t) :: due
  integer(int64) :: last_checkpoint, loop_start

  call read_command_line(options, errors)
  call stop_if_any(errors, exit_command_line)
  call answer_questions()
  call set_up()
  call catch_signals()
  call open_outputs()
  call system_clock(last_checkpoint)
  loop_start = last_checkpoint

  do step = checkpoint%step + 1, schedule%steps
    due = due_after(step)
    call take_step(step, due%row .or. due%frame .or. due%checkpoint, model, state, work, ledger, &
      timing, failed_point)
    if (failed_point > 0) call fail('det F is not positive, or not a number')
    call write_what_is_due()
    if (due%stop) call interrupt()
  end do
  call finish()

contains

  !> --help, --version, --input-reference.
  subroutine answer_questions()
    if (options%help) call print_help()
    if (options%version) write (output_unit, '(a)') 'perigeo '//code_version//' ('//git_hash//')'
    if (options%input_reference) call write_input_reference(output_unit)
    if (options%help .or. options%version .or. options%input_reference) &
      call exit_program(exit_ok)
    if (options%threads > 0) call omp_set_num_threads(options%threads)
  end subroutine answer_questions

  !> Input, body, model, time step, and the state to begin with: unloaded, or of a checkpoint.
  subroutine set_up()
    character(:), allocatable :: warning
    type(error_list_t) :: input_errors
    type(summary_t)    :: summary
    type(observation_t) :: seen
    integer :: i

    call read_input(options%input_path, input, errors)
    call stop_if_any(errors, exit_input)
    if (options%output_dir /= '') input%run%output_dir = options%output_dir
    if (.not. options%check) call look_for_results()
    if (options%restart .and. .not. options%check) then
      call load_checkpoint(input, checkpoint, state, ledger, warning, errors, input_errors)
      call stop_if_any(errors, exit_file)
      call stop_if_any(input_errors, exit_input)
      if (warning /= '') call warnings%add(warning)
    end if

    call set_up_body(input, model%body, warnings, input_errors, errors)
    call stop_if_any(input_errors, exit_input)
    call stop_if_any(errors, exit_model)
    if (checkpoint%history_rows > 0) then
      if (.not. same_points(checkpoint, model%body)) then
        call errors%add('the points are not those of the checkpoint', input%path)
        call stop_if_any(errors, exit_input)
      end if
    end if
    call set_up_model(input, model, errors)
    call stop_if_any(errors, exit_model)
    call set_up_schedule(input, checkpoint%time_step, model, schedule, errors)
    call stop_if_any(errors, exit_input)
    if (options%check) then
      call find_highest_frequency(model)
      if (schedule%time_step * model%highest_frequency > 2.0_wp) call warnings%add('the time '// &
        'step is larger than the stable one: the run will not last', '&integration')
      summary = summarise(input, model, schedule)
      write (output_unit, '(a)') options%input_path//': the input is right'
      do i = 1, size(summary%lines)
        write (output_unit, '(a)') trim(summary%lines(i))
      end do
      call print_estimate(estimated_seconds(model, schedule))
      call warnings%print(output_unit, 'warning')
      call exit_program(exit_ok)
    end if

    allocate (work%a(model%body%n, 4), source=0.0_wp)   ! voids stay zero
    if (checkpoint%history_rows > 0) then
      state = state%scattered(model%body%points, model%body%n)
      call model%supports%take_reactions(model%body%volume, checkpoint%time, state%force)
    else
      call start(model, state)
      call observe(model%body, model%solid, model%operators, state, ledger, seen)
      ledger%initial_kinetic_energy = seen%kinetic_energy
    end if
  end subroutine set_up

  !> Results of an earlier run are overwritten or continued only on request.
  subroutine look_for_results()
    if (options%force .or. options%restart) return
    if (.not. results_in_the_way(input%run%output_dir//'/'//input%run%name)) return
    call errors%add('there are results of an earlier run; --force overwrites them, --restart '// &
      'goes on from a checkpoint, --output DIR writes elsewhere', &
      input%run%output_dir//'/'//input%run%name)
    call stop_if_any(errors, exit_file)
  end subroutine look_for_results

  !> Last line of --check.
  subroutine print_estimate(seconds)
    real(wp), intent(in) :: seconds
    character(16) :: text, threads

    write (threads, '(i0)') omp_get_max_threads()
    if (seconds < 100.0_wp) then
      write (text, '(f12.1,a)') max(0.1_wp, seconds), ' s'
    else if (seconds < 6000.0_wp) then
      write (text, '(f12.1,a)') seconds / 60.0_wp, ' min'
    else
      write (text, '(f12.1,a)') seconds / 3600.0_wp, ' h'
    end if
    write (output_unit, '(a)') '  run time            about '//trim(adjustl(text))// &
      ', threads: '//trim(threads)
  end subroutine print_estimate

  !> Open all files; the unloaded state is the first row and the first frame.
  subroutine open_outputs()
    type(summary_t) :: summary
    character(:), allocatable :: command
    integer :: length, i

    call get_command(length=length)
    allocate (character(length) :: command)
    call get_command(command)
    call open_record(input, command, omp_get_max_threads(), model, schedule, checkpoint, &
      options%quiet, record, errors)
    call stop_if_any(errors, exit_file)
    call record_line(record, 'perigeo '//code_version//' ('//git_hash//'), '//options%input_path, &
      errors)
    summary = summarise(input, model, schedule)
    do i = 1, size(summary%lines)
      call record_line(record, trim(summary%lines(i)), errors)
    end do
    do i = 1, warnings%count()
      call record_line(record, 'warning: '//warnings%message(i), errors)
    end do
    call observe_state(model, state, ledger, record)
    if (checkpoint%history_rows == 0) then
      call record_row(model, state, 0, record, errors)
      if (errors%count() == 0) call record_frame(model, state, 0, record, errors)
    else
      call record_line(record, 'going on from a checkpoint', errors)
    end if
    call record_progress(model, state, schedule, checkpoint%step, record, errors)
    call stop_if_any(errors, exit_file)
  end subroutine open_outputs

  !> What is due after a step. A signal that comes during the step is met after the next one.
  type(due_t) function due_after(step) result(due)
    integer, intent(in) :: step
    integer(int64) :: now, rate

    due%row = row_due(schedule, step)
    due%frame = any(schedule%frame_steps == step)
    due%stop = pending_signal() /= 0
    due%checkpoint = due%stop
    if (input%output%checkpoint_every > 0.0_wp) then
      call system_clock(now, rate)
      due%checkpoint = due%checkpoint .or. step == schedule%steps .or. &
        real(now - last_checkpoint, wp) >= input%output%checkpoint_every * real(rate, wp)
    end if
  end function due_after

  !> Write what is due. Before anything of a state is kept it is looked at: a run that gains energy
  !> has failed.
  subroutine write_what_is_due()
    integer :: k

    if (due%row .or. due%frame .or. due%checkpoint) then
      call observe_state(model, state, ledger, record)
      ! After the first step from rest loads have given half a kick, and no work has been done yet.
      if (step > 1 .and. running_away(record%seen, ledger)) then
        failed_point = fastest_point()
        call fail('the energy runs away')
      end if
    end if
    if (due%row) call record_row(model, state, step, record, errors)
    if (progress_due(record%progress, step, schedule%steps)) &
      call record_progress(model, state, schedule, step, record, errors)
    call timing%lap(7)

    if (due%frame) then
      do k = 1, size(schedule%frame_steps)
        if (schedule%frame_steps(k) == step) call record_frame(model, state, step, record, errors)
      end do
    end if
    if (due%checkpoint) then
      call save_checkpoint(model, state, ledger, step, record, errors)
      call system_clock(last_checkpoint)
    end if
    call stop_if_any(errors, exit_file)
  end subroutine write_what_is_due

  !> Where a run that runs away moves fastest, of the points that move freely.
  integer function fastest_point()
    fastest_point = maxloc(sum((model%free * state%velocity)**2, dim=2), dim=1)
  end function fastest_point

  !> The calculation has failed: keep the failing state apart from the good frames, and say where.
  subroutine fail(reason)
    character(*), intent(in) :: reason
    type(error_list_t) :: file_errors
    character(160) :: where

    associate (p => failed_point, x => model%body%position)
      write (where, '(a,i0,a,es12.5,a,i0,a,g0.7,a,g0.7,a)') 'step ', step, ', time ', &
        real(step, wp) * schedule%time_step, ' s, point ', &
        count(model%body%points <= p), ' at (', x(p, 1), ', ', x(p, 2), ') m'
    end associate
    call record_failure(model, state, step, record, file_errors)
    call record_line(record, 'the calculation failed: '//reason//'; '//trim(where), file_errors)
    call errors%add('the calculation failed: '//reason//'; the frames and rows before this '// &
      'step are good; a smaller safety or time step may help', trim(where))
    call file_errors%print(error_unit)
    call stop_if_any(errors, exit_calculation)
  end subroutine fail

  !> A signal came and its checkpoint is written: leave.
  subroutine interrupt()
    integer :: status

    status = merge(exit_interrupted, exit_terminated, pending_signal() == sigint)
    call record_line(record, 'stopped by a signal; --restart goes on from the checkpoint', errors)
    call stop_if_any(errors, exit_file)
    call exit_program(status)
  end subroutine interrupt

  !> Last lines of the log: seconds of the time loop and of its kernels; the rest is frames and
  !> checkpoints.
  subroutine tell_where_time_went()
    integer(int64) :: now, rate
    character(256) :: line
    real(wp) :: whole
    integer  :: k

    call system_clock(now, rate)
    whole = real(now - loop_start, wp) / real(rate, wp)
    write (line, '(a,f10.3,a,i0)') 'time loop ', whole, ' s, steps ', &
      schedule%steps - checkpoint%step
    call record_line(record, trim(line), errors)
    write (line, '(a,8(2x,a,f9.3))') 'kernels [s] ', &
      (trim(kernel_names(k)), timing%seconds(k), k=1, size(kernel_names)), 'frames', &
      max(0.0_wp, whole - sum(timing%seconds))
    call record_line(record, trim(line), errors)
  end subroutine tell_where_time_went

  !> The end of a run that has reached its end.
  subroutine finish()
    call tell_where_time_went()
    call record_line(record, 'results in '//record%stem//'.h5, .xdmf, _history.csv', errors)
    call close_record(record, errors)
    call stop_if_any(errors, exit_file)
    call exit_program(exit_ok)
  end subroutine finish

end program perigeo
