!> What a run writes: rows, frames, checkpoints and progress, from the model and its state.
!>
!> The only module that knows both the physics and the output.
module pd_record
  use, intrinsic :: iso_fortran_env, only: compiler_version
  use pd_checkpoint, only: checkpoint_exists, checkpoint_t, read_checkpoint, remove_checkpoints, &
    write_checkpoint
  use pd_errors, only: error_list_t
  use pd_files, only: prepare_folder
  use pd_geometry, only: body_t
  use pd_history, only: close_history, create_history, history_row_t, history_t, resume_history, &
    write_row
  use pd_input, only: compare_used, used_values
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_observe, only: ledger_t, observation_t, observe, point_field
  use pd_platens, only: nominal_strain
  use pd_progress, only: close_progress, open_progress, progress_t, say, show_progress, status_t
  use pd_result, only: create_result, finish_result, frame_source_t, provenance_t, &
    result_exists, result_t, resume_result, run_description_t, write_failed_frame, write_frame
  use pd_schedule, only: schedule_t
  use pd_model, only: model_t
  use pd_state, only: state_t
  use pd_version, only: build_flags, code_version, git_hash
  implicit none
  private

  public :: record_t, results_in_the_way, open_record, close_record, record_row, record_frame
  public :: record_failure, record_progress, record_line, observe_state
  public :: save_checkpoint, load_checkpoint, same_points

  !> The open outputs of a run.
  type :: record_t
    character(:), allocatable :: stem            !! output folder and name of the run
    character(:), allocatable :: values(:)       !! 'group.key = value' of the input as used
    type(result_t)      :: result
    type(history_t)     :: history
    type(progress_t)    :: progress
    type(observation_t) :: seen                  !! of the last row
    integer :: frames = 0                        !! written so far, 000000 among them
  end type record_t

  !> The present state as the source of a frame.
  type, extends(frame_source_t) :: state_frame_t
    type(model_t), pointer :: model => null()
    type(state_t), pointer :: state => null()
  contains
    procedure :: points => points_of_state
    procedure :: field => field_of_state
  end type state_frame_t

  character(*), parameter :: ledger_names(5) = [character(24) :: 'initial_kinetic_energy', &
    'plastic_dissipation', 'damping_dissipation', 'external_work', 'largest_work']

contains

  !> Whether an earlier run left results or checkpoints under this stem.
  logical function results_in_the_way(stem)
    character(*), intent(in) :: stem   !! output folder and name of the run

    results_in_the_way = result_exists(stem)
    if (.not. results_in_the_way) results_in_the_way = checkpoint_exists(stem)
  end function results_in_the_way

  !> Open all outputs: anew, or behind a checkpoint (`step` > 0 or rows in the history).
  !>
  !> Errors: a file cannot be written; on a restart, results that do not fit the checkpoint.
  subroutine open_record(input, command, threads, model, schedule, checkpoint, quiet, record, &
    errors)
    type(input_t),      intent(in)    :: input
    character(*),       intent(in)    :: command      !! the command line
    integer,            intent(in)    :: threads
    type(model_t),      intent(in)    :: model
    type(schedule_t),   intent(in)    :: schedule
    type(checkpoint_t), intent(in)    :: checkpoint   !! history_rows 0: a new run
    logical,            intent(in)    :: quiet
    type(record_t),     intent(out)   :: record
    type(error_list_t), intent(inout) :: errors
    type(run_description_t) :: description
    logical :: platens, restart
    integer :: n_new

    record%stem = input%run%output_dir//'/'//input%run%name
    record%values = used_values(input)
    restart = checkpoint%history_rows > 0
    platens = model%platens%axis > 0
    call describe_run(input, command, threads, model, schedule, description)
    description%values = record%values
    call prepare_folder(input%run%output_dir, errors)
    if (errors%count() > 0) return
    if (restart) then
      n_new = count(schedule%frame_steps > checkpoint%step)
      call resume_result(record%result, record%stem, description, checkpoint%frames_written, &
        n_new, checkpoint%step, errors)
      if (errors%count() == 0) call resume_history(record%history, record%stem, &
        description%boundary_names, platens, checkpoint%history_rows, errors)
      record%frames = checkpoint%frames_written
    else
      ! the old checkpoints go last: until the new result is there a full disk must cost nothing
      call create_result(record%result, record%stem, description, &
        size(schedule%frame_steps) + 1, errors)
      if (errors%count() == 0) call remove_checkpoints(record%stem, errors)
      if (errors%count() == 0) call create_history(record%history, record%stem, &
        description%boundary_names, platens, errors)
    end if
    if (errors%count() == 0) &
      call open_progress(record%progress, record%stem, restart, quiet, errors)
  end subroutine open_record

  !> Everything that the result file says beside its frames.
  subroutine describe_run(input, command, threads, model, schedule, description)
    type(input_t),    intent(in) :: input
    character(*),     intent(in) :: command
    integer,          intent(in) :: threads
    type(model_t),    intent(in) :: model
    type(schedule_t), intent(in) :: schedule
    type(run_description_t), intent(out) :: description
    character(1), parameter :: axes(2) = ['x', 'y']
    integer :: k

    description%provenance = provenance_t(code_version, git_hash, compiler_version(), &
      build_flags, command, threads)
    description%title = input%run%title
    description%name = input%run%name
    description%namelist = input%text
    description%strain_axis = 'none'
    if (model%platens%axis > 0) description%strain_axis = axes(model%platens%axis)
    description%spacing = model%spacing
    description%horizon = model%delta
    description%lower = model%body%lower
    description%upper = model%body%upper
    description%time_step = schedule%time_step
    description%steps = schedule%steps
    associate (body => model%body, places => model%body%points)
      description%position = body%position(places, :)
      description%volume = body%volume(places)
      description%boundary = body%boundary(places)
      if (model%solid%material%plastic) &
        description%yield_stress = model%solid%yield_stress(places)
    end associate
    allocate (character(64) :: description%boundary_names(size(model%supports%items)))
    do k = 1, size(model%supports%items)
      description%boundary_names(k) = model%supports%items(k)%support%name
    end do
  end subroutine describe_run

  !> Close all outputs of a run that has come to its end.
  subroutine close_record(record, errors)
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors

    call close_history(record%history, errors)
    if (errors%count() == 0) call finish_result(record%result, errors)
    call close_progress(record%progress, errors)
  end subroutine close_record

  !> Observe the state; what is seen stays in the record.
  subroutine observe_state(model, state, ledger, record)
    type(model_t),  intent(inout) :: model      !! work space of its operators
    type(state_t),  intent(in)    :: state
    type(ledger_t), intent(in)    :: ledger
    type(record_t), intent(inout) :: record

    call observe(model%body, model%solid, model%operators, state, ledger, record%seen)
  end subroutine observe_state

  !> Write a row of the history with what was seen of the state.
  subroutine record_row(model, state, step, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    integer,            intent(in)    :: step
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(history_row_t) :: row
    integer :: k

    row%step = step
    row%time = real(step, wp) * model%motion%time_step
    row%strain = nominal_strain(model%platens, state%displacement)
    allocate (row%force(size(model%supports%items), 2))
    do k = 1, size(model%supports%items)
      row%force(k, :) = model%supports%items(k)%support%force
    end do
    associate (seen => record%seen)
      row%mean_stress_xx = seen%mean_stress_xx
      row%mean_stress_yy = seen%mean_stress_yy
      row%mean_strain_yy = seen%mean_strain_yy
      row%max_plastic_strain = seen%max_plastic_strain
      row%kinetic_energy = seen%kinetic_energy
      row%strain_energy = seen%strain_energy
      row%plastic_dissipation = seen%plastic_dissipation
      row%damping_dissipation = seen%damping_dissipation
      row%stabilisation_energy = seen%stabilisation_energy
      row%external_work = seen%external_work
      row%energy_error = seen%energy_error
    end associate
    call write_row(record%history, row, errors)
  end subroutine record_row

  !> Write the next frame.
  subroutine record_frame(model, state, step, record, errors)
    type(model_t), target, intent(in) :: model
    type(state_t), target, intent(in) :: state
    integer,            intent(in)    :: step
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(state_frame_t) :: source
    real(wp) :: time

    time = real(step, wp) * model%motion%time_step
    source%model => model
    source%state => state
    call write_frame(record%result, record%frames, step, time, &
      nominal_strain(model%platens, state%displacement), source, errors)
    record%frames = record%frames + 1
  end subroutine record_frame

  !> Write the state of a run that has failed, marked as not valid.
  subroutine record_failure(model, state, step, record, errors)
    type(model_t), target, intent(in) :: model
    type(state_t), target, intent(in) :: state
    integer,            intent(in)    :: step
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(state_frame_t) :: source
    real(wp) :: time

    time = real(step, wp) * model%motion%time_step
    source%model => model
    source%state => state
    call write_failed_frame(record%result, step, time, &
      nominal_strain(model%platens, state%displacement), source, errors)
  end subroutine record_failure

  !> Points of a frame.
  pure integer function points_of_state(self) result(n)
    class(state_frame_t), intent(in) :: self

    n = size(self%model%body%points)
  end function points_of_state

  !> A field of a frame.
  subroutine field_of_state(self, name, values)
    class(state_frame_t), intent(in) :: self
    character(*), intent(in)  :: name
    real(wp),     intent(out), contiguous :: values(:, :)   !! (components,points)

    call point_field(name, self%model%body, self%model%operators, self%state, self%model%delta, &
      values)
  end subroutine field_of_state

  !> Show where the run stands; axial stress and largest alpha are those of the last row.
  subroutine record_progress(model, state, schedule, step, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(schedule_t),   intent(in)    :: schedule
    integer,            intent(in)    :: step
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(status_t) :: status

    status%step = step
    status%steps = schedule%steps
    status%time = real(step, wp) * schedule%time_step
    status%largest_alpha = record%seen%max_plastic_strain
    if (model%platens%axis > 0) then
      status%has_strain = .true.
      status%strain = nominal_strain(model%platens, state%displacement)
      associate (first => model%supports%items(model%platens%first)%support)
        status%axial_stress = first%force(model%platens%axis) / model%platens%width
      end associate
    end if
    call show_progress(record%progress, status, errors)
  end subroutine record_progress

  !> A line on the screen and in the log.
  subroutine record_line(record, text, errors)
    type(record_t),     intent(inout) :: record
    character(*),       intent(in)    :: text
    type(error_list_t), intent(inout) :: errors

    call say(record%progress, text, errors)
  end subroutine record_line

  !> Write a checkpoint of the state after a step and its outputs.
  subroutine save_checkpoint(model, state, ledger, step, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(ledger_t),     intent(in)    :: ledger
    integer,            intent(in)    :: step
    type(record_t),     intent(in)    :: record
    type(error_list_t), intent(inout) :: errors
    type(checkpoint_t) :: checkpoint

    checkpoint%step = step
    checkpoint%time_step = model%motion%time_step
    checkpoint%time = real(step, wp) * checkpoint%time_step
    checkpoint%history_rows = record%history%rows
    checkpoint%frames_written = record%frames
    checkpoint%ledger_names = ledger_names
    checkpoint%ledger = [ledger%initial_kinetic_energy, ledger%plastic_dissipation, &
      ledger%damping_dissipation, ledger%external_work, ledger%largest_work]
    checkpoint%input = record%values
    associate (body => model%body, places => model%body%points)
      checkpoint%position = body%position(places, :)
      checkpoint%volume = body%volume(places)
      checkpoint%boundary = body%boundary(places)
      call write_checkpoint(record%stem, checkpoint, state%gathered(places), errors)
    end associate
  end subroutine save_checkpoint

  !> Read the newest checkpoint and compare its input with the present one. The state has the points
  !> of the body, without voids.
  !>
  !> Errors, `file_errors`: no checkpoint that can be read; `input_errors`: values that differ.
  subroutine load_checkpoint(input, checkpoint, state, ledger, warning, file_errors, input_errors)
    type(input_t),      intent(in)    :: input
    type(checkpoint_t), intent(out)   :: checkpoint
    type(state_t),      intent(out)   :: state
    type(ledger_t),     intent(out)   :: ledger
    character(:), allocatable, intent(out) :: warning
    type(error_list_t), intent(inout) :: file_errors, input_errors

    call read_checkpoint(input%run%output_dir//'/'//input%run%name, checkpoint, state, warning, &
      file_errors)
    if (file_errors%count() > 0) return
    if (size(checkpoint%ledger) /= size(ledger_names)) then
      call file_errors%add('the checkpoint was written by another version of perigeo')
      return
    end if
    ledger%initial_kinetic_energy = checkpoint%ledger(1)
    ledger%plastic_dissipation = checkpoint%ledger(2)
    ledger%damping_dissipation = checkpoint%ledger(3)
    ledger%external_work = checkpoint%ledger(4)
    ledger%largest_work = checkpoint%ledger(5)
    call compare_used(checkpoint%input, used_values(input), input_errors)
  end subroutine load_checkpoint

  !> Whether the points of a checkpoint are those of the body, boundaries included (a point cloud
  !> may have changed).
  pure logical function same_points(checkpoint, body) result(same)
    type(checkpoint_t), intent(in) :: checkpoint
    type(body_t),       intent(in) :: body

    same = size(checkpoint%volume) == size(body%points)
    if (same) same = all(abs(checkpoint%position - body%position(body%points, :)) <= 0.0_wp) &
      .and. all(abs(checkpoint%volume - body%volume(body%points)) <= 0.0_wp) &
      .and. all(checkpoint%boundary == body%boundary(body%points))
  end function same_points

end module pd_record
