!> perigeo: peridynamics for geomaterials.
!>
!> The algorithm and nothing else; doc/theory.md, section 6:
!> u gives F, F gives S and A, A gives f, f gives v.
program perigeo
  use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use pd_boundary, only: boundary_forces, boundary_t, motion_work, move
  use pd_checkpoint, only: checkpoint_t
  use pd_command_line, only: options_t, print_help, read_command_line
  use pd_errors, only: error_list_t, exit_calculation, exit_command_line, exit_file, exit_input, &
    exit_interrupted, exit_model, exit_ok, exit_terminated, stop_if_any
  use pd_force, only: force_state
  use pd_input, only: read_input
  use pd_input_types, only: input_t
  use pd_input_reference, only: write_input_reference
  use pd_kinds, only: wp
  use pd_kinematics, only: deformation_gradient
  use pd_observe, only: kinetic_energy, ledger_t, running_away
  use pd_progress, only: progress_due
  use pd_record, only: close_record, load_checkpoint, open_record, record_failure, &
    record_frame, record_line, record_progress, record_row, record_t, results_in_the_way, &
    same_points, save_checkpoint
  use pd_schedule, only: row_due, schedule_t
  use pd_setup, only: damping_frame, model_t, set_up_body, set_up_model, set_up_schedule, start
  use pd_state, only: state_t
  use pd_summary, only: estimated_seconds, summarise, summary_t
  use pd_system, only: catch_signals, exit_program, pending_signal, sigint
  use pd_verlet, only: kick, kick_and_drift
  use pd_version, only: code_version, git_hash
  implicit none

  type(options_t)    :: options
  type(input_t)      :: input
  type(model_t)      :: model
  type(schedule_t)   :: schedule
  type(state_t)      :: state
  type(ledger_t)     :: ledger
  type(record_t)     :: record
  type(checkpoint_t) :: checkpoint
  type(error_list_t) :: errors, warnings
  real(wp), allocatable :: a(:, :)   ! A = P K^-1 (n,4)
  integer :: step, failed_point
  integer(int64) :: last_checkpoint

  call read_command_line(options, errors)
  call stop_if_any(errors, exit_command_line)
  call answer_questions()
  call set_up()
  call catch_signals()
  call open_outputs()
  call system_clock(last_checkpoint)

  do step = checkpoint%step + 1, schedule%steps
    call take_step()
    if (failed_point > 0) call fail('det F is not positive')
    call write_what_is_due()
    if (pending_signal() /= 0) call interrupt()
  end do
  call finish()

contains

  !> One step of velocity Verlet: kick, drift; u gives F, F gives S and A, A gives f; kick.
  subroutine take_step()
    type(boundary_t), allocatable :: before(:)
    real(wp) :: t, t_next, first_work(2), second_work(2), dissipated

    t = real(step - 1, wp) * schedule%time_step
    t_next = real(step, wp) * schedule%time_step
    associate (x => model%body%position, volume => model%body%volume, free => model%free, &
      u => state%displacement, v => state%velocity, f => state%force, &
      f_grad => state%deformation_gradient)
      call kick_and_drift(model%motion, damping_frame(model, t), x, volume, free, f, v, u, &
        first_work)
      call move(model%boundaries, x, t_next, u, v)
      call model%operators%gradient(u, f_grad)
      call deformation_gradient(model%solid%k_inverse, f_grad)
      call force_state(model%solid, volume, state, a, dissipated, failed_point)
      call model%operators%divergence(a, f)
      if (allocated(model%solid%control)) &
        call model%operators%add_control(model%solid%control, u, f)
      call kick(model%motion, damping_frame(model, t_next), x, volume, free, f, v, second_work)

      allocate (before(size(model%boundaries)), source=model%boundaries)
      call boundary_forces(x, volume, f, model%boundaries)
    end associate
    ledger%plastic_dissipation = ledger%plastic_dissipation + dissipated
    ledger%damping_dissipation = ledger%damping_dissipation + first_work(1) + second_work(1)
    ledger%external_work = ledger%external_work + first_work(2) + second_work(2) &
      + motion_work(before, model%boundaries, t, t_next)
    ledger%largest_work = max(ledger%largest_work, abs(ledger%external_work))
  end subroutine take_step

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

    call set_up_body(input, model%body, warnings, errors)
    call stop_if_any(errors, merge(exit_input, exit_model, input%bodies(1)%shape == 'file'))
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
      summary = summarise(input, model, schedule)
      write (output_unit, '(a)') options%input_path//': the input is right'
      do i = 1, size(summary%lines)
        write (output_unit, '(a)') trim(summary%lines(i))
      end do
      call print_estimate(estimated_seconds(model, schedule))
      call warnings%print(output_unit, 'warning')
      call exit_program(exit_ok)
    end if

    allocate (a(model%body%n, 4))
    if (checkpoint%history_rows > 0) then
      call boundary_forces(model%body%position, model%body%volume, state%force, model%boundaries)
    else
      call start(model, state)
      ledger%initial_kinetic_energy = &
        kinetic_energy(model%body, model%motion%density, state%velocity)
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
    character(16) :: text

    write (text, '(i0)') omp_get_max_threads()
    text = trim(text)//' thread'//merge('s', ' ', omp_get_max_threads() > 1)
    if (seconds < 100.0_wp) then
      write (output_unit, '(a,f0.1,a)') '  run time            about ', max(0.1_wp, seconds), &
        ' s with '//trim(text)
    else if (seconds < 6000.0_wp) then
      write (output_unit, '(a,f0.1,a)') '  run time            about ', seconds / 60.0_wp, &
        ' min with '//trim(text)
    else
      write (output_unit, '(a,f0.1,a)') '  run time            about ', seconds / 3600.0_wp, &
        ' h with '//trim(text)
    end if
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
    if (checkpoint%history_rows == 0) then
      call record_row(model, state, ledger, 0, record, errors)
      if (errors%count() == 0) call record_frame(model, state, 0, record, errors)
    else
      call record_line(record, 'going on from a checkpoint', errors)
    end if
    call record_progress(model, schedule, checkpoint%step, record, errors)
    call stop_if_any(errors, exit_file)
  end subroutine open_outputs

  !> Row, frames, checkpoint and progress after a step; a run that gains energy has failed.
  subroutine write_what_is_due()
    integer(int64) :: now, rate
    integer :: k

    if (row_due(schedule, step)) then
      call record_row(model, state, ledger, step, record, errors)
      call stop_if_any(errors, exit_file)
      if (running_away(record%seen, ledger)) then
        failed_point = fastest_point()
        call fail('the energy runs away')
      end if
    end if
    do k = 1, size(schedule%frame_steps)
      if (schedule%frame_steps(k) == step) call record_frame(model, state, step, record, errors)
    end do
    if (input%output%checkpoint_every > 0.0_wp) then
      call system_clock(now, rate)
      if (real(now - last_checkpoint, wp) >= input%output%checkpoint_every * real(rate, wp) &
        .or. step == schedule%steps) then
        call save_checkpoint(model, state, ledger, step, record, errors)
        last_checkpoint = now
      end if
    end if
    if (progress_due(record%progress, step, schedule%steps)) &
      call record_progress(model, schedule, step, record, errors)
    call stop_if_any(errors, exit_file)
  end subroutine write_what_is_due

  !> Where a run that runs away moves fastest.
  integer function fastest_point()
    fastest_point = maxloc(sum(state%velocity**2, dim=2), dim=1)
  end function fastest_point

  !> The calculation has failed: keep the failing state apart from the good frames, and say where.
  subroutine fail(reason)
    character(*), intent(in) :: reason
    type(error_list_t) :: file_errors
    character(160) :: where

    associate (p => failed_point, x => model%body%position)
      write (where, '(a,i0,a,es12.5,a,i0,a,g0.7,a,g0.7,a)') 'step ', step, ', time ', &
        real(step, wp) * schedule%time_step, ' s, point ', p, ' at (', x(p, 1), ', ', x(p, 2), ') m'
    end associate
    call record_failure(model, state, step, record, file_errors)
    call record_line(record, 'the calculation failed: '//reason//'; '//trim(where), file_errors)
    call errors%add('the calculation failed: '//reason, trim(where), allowed='a smaller safety '// &
      'or time step may help; the frames and rows before this step are good')
    call file_errors%print(error_unit)
    call stop_if_any(errors, exit_calculation)
  end subroutine fail

  !> A signal: write a checkpoint and leave.
  subroutine interrupt()
    integer :: status

    status = merge(exit_interrupted, exit_terminated, pending_signal() == sigint)
    call save_checkpoint(model, state, ledger, step, record, errors)
    call record_line(record, 'stopped by a signal; --restart goes on from the checkpoint', errors)
    call stop_if_any(errors, exit_file)
    call exit_program(status)
  end subroutine interrupt

  !> The end of a run that has reached its end.
  subroutine finish()
    call close_record(record, errors)
    call stop_if_any(errors, exit_file)
    call exit_program(exit_ok)
  end subroutine finish

end program perigeo
