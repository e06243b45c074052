!> What a run writes: rows, frames and progress, from the model and its state.
!>
!> The only module that knows both the physics and the output.
module pd_record
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use pd_agreement, only: any_rank
  use pd_checkpoint, only: checkpoint_t, remove_checkpoints
  use pd_clock, only: clock_t
  use pd_division, only: bring_looked_at
  use pd_doubt_list, only: doubts_t
  use pd_errors, only: error_list_t
  use pd_files, only: prepare_folder
  use pd_frame_fields, only: frame_fields
  use pd_history, only: close_history, create_history, history_t, read_history, resume_history, &
    write_row
  use pd_history_columns, only: history_columns
  use pd_input, only: used_values
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  use pd_ledger, only: ledger_t
  use pd_model, only: model_t
  use pd_observe, only: column_t, moment_at, moment_t, observation_t, observe
  use pd_parts_of_points, only: hand_in_points
  use pd_progress, only: close_progress, open_progress, progress_t, say, show_progress, status_t
  use pd_result, only: add_row, attend_result, create_result, finish_result, places_t, &
    result_t, resume_result, write_failed_frame, write_frame, write_tries
  use pd_run_description, only: provenance_t, run_description_t
  use pd_schedule, only: schedule_t
  use pd_state, only: state_t
  use pd_step_limit, only: step_limit_t
  use pd_tries, only: tries_t
  use pd_trust, only: quality_t, write_doubts, write_quality
  implicit none
  private

  public :: record_t
  public :: open_record, close_record, record_row, record_frame
  public :: record_failure, record_progress, record_line, observe_state
  public :: record_doubts, record_quality
  public :: record_tries, points_of

  character(1), parameter :: axes(2) = ['x', 'y']

  !> The open outputs of a run.
  type :: record_t
    character(:), allocatable :: stem            !! output folder and name of the run
    character(:), allocatable :: values(:)       !! 'group.key = value' of the input as used
    type(result_t)      :: result
    type(history_t)     :: history
    type(progress_t)    :: progress
    type(column_t), allocatable :: columns(:)    !! of the history
    type(moment_t)      :: moment                !! of the last look at the state
    type(observation_t) :: seen                  !! at this moment
    integer :: frames = 0                        !! written so far, 000000 among them
    integer :: rows_owed = 0, frames_owed = 0    !! due at this step, but could not be written
    logical :: elsewhere = .false.               !! another rank writes
  end type record_t

contains

  !> Open all outputs: new ones, or those of a checkpoint (with rows in the history).
  !>
  !> Errors: a file cannot be written; on a restart, results that do not fit the checkpoint.
  subroutine open_record(input, provenance, model, schedule, checkpoint, quiet, record, errors)
    type(input_t),      intent(in)    :: input
    type(provenance_t), intent(in)    :: provenance
    type(model_t),      intent(in)    :: model
    type(schedule_t),   intent(in)    :: schedule
    type(checkpoint_t), intent(in)    :: checkpoint   !! history_rows 0: a new run, but its clock
    logical,            intent(in)    :: quiet
    type(record_t),     intent(out)   :: record
    type(error_list_t), intent(inout) :: errors
    type(run_description_t) :: description

    record%stem = input%run%output_dir//'/'//input%run%name
    record%values = used_values(input)
    call describe_run(input, provenance, model, schedule, description)
    description%values = record%values
    description%time_step = checkpoint%clock%time_step
    record%columns = description%columns
    record%elsewhere = model%blocks%ranks%mine > 0
    if (record%elsewhere) then
      call attend_result(record%result, record%stem, description, places_t())
      record%frames = checkpoint%frames_written
    else
      call open_files(input, checkpoint, schedule, description, record, errors)
    end if
    if (description%in_parts) then
      if (any_rank(model%blocks%ranks, errors%count() > 0)) return
      call hand_in_points(record%stem//'.h5', allocated(description%yield_stress), model, errors)
    end if
    ! what mpirun passes on looks like a terminal
    if (errors%count() == 0 .and. .not. record%elsewhere) call open_progress(record%progress, &
      record%stem, checkpoint%history_rows > 0, quiet, errors, &
      plain=model%blocks%ranks%count > 1)
  end subroutine open_record

  !> Open the result file and the history.
  subroutine open_files(input, checkpoint, schedule, description, record, errors)
    type(input_t),      intent(in)    :: input
    type(checkpoint_t), intent(in)    :: checkpoint   !! history_rows 0: a new run
    type(schedule_t),   intent(in)    :: schedule
    type(run_description_t), intent(in) :: description
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: rows(:, :)
    integer :: of_safety   ! frames of the search for the factor of safety

    of_safety = 2 * size(input%strength_reduction)
    call prepare_folder(input%run%output_dir, errors)
    if (errors%count() > 0) return
    if (checkpoint%history_rows > 0) then
      call read_history(record%stem, record%columns, checkpoint%history_rows, rows, errors)
      if (errors%count() > 0) return
      call resume_result(record%result, record%stem, description, &
        places_t(checkpoint%frames_written, checkpoint%history_rows), &
        places_t(schedule%frames_left(checkpoint%clock%step) + of_safety &
        + checkpoint%frames_owed, schedule%rows_left(checkpoint%clock%step) &
        + checkpoint%rows_owed), checkpoint%clock%step, errors, rows)
      if (errors%count() == 0) call resume_history(record%history, record%stem, record%columns, &
        checkpoint%history_rows, errors)
      record%frames = checkpoint%frames_written
    else
      ! the old checkpoints go last: until the new result is there a full disk must cost nothing
      call create_result(record%result, record%stem, description, &
        places_t(schedule%frames_left(0) + 1 + of_safety, schedule%rows_left(0) + 1), errors)
      if (errors%count() == 0) call remove_checkpoints(record%stem, errors)
      if (errors%count() == 0) &
        call create_history(record%history, record%stem, record%columns, errors)
    end if
  end subroutine open_files

  !> Everything in the result file except frames and rows.
  subroutine describe_run(input, provenance, model, schedule, description)
    type(input_t),      intent(in) :: input
    type(provenance_t), intent(in) :: provenance
    type(model_t),      intent(in) :: model
    type(schedule_t),   intent(in) :: schedule
    type(run_description_t), intent(out) :: description
    character(1), parameter :: axes(2) = ['x', 'y']
    integer :: k

    description%provenance = provenance
    description%title = input%run%title
    description%name = input%run%name
    description%namelist = input%text
    description%strain_axis = 'none'
    if (model%platens%axis > 0) description%strain_axis = axes(model%platens%axis)
    description%spacing = model%spacing
    description%horizon = model%delta
    description%lower = model%body%lower
    description%upper = model%body%upper
    if (model%whole%n > 0) then
      description%lower = model%whole%lower
      description%upper = model%whole%upper
    end if
    description%steps = schedule%steps
    description%n = model%shown%n
    description%in_parts = model%blocks%ranks%count > 1 .and. model%whole%n == 0
    if (description%in_parts) then
      description%body = model%body
    else
      call points_of(model, description%position, description%volume, description%boundary)
    end if
    if (size(model%materials%remembered()) > 0) then
      if (description%in_parts) then
        allocate (description%yield_stress(0))
      else
        description%yield_stress = model%strength(model%shown%row())
      end if
      if (model%whole%n > 0) description%yield_stress = model%shown_strength
    end if
    if (allocated(model%materials%stiffness)) description%youngs_modulus = &
      model%materials%youngs_modulus_of(model%shown%row())
    allocate (character(64) :: description%boundary_names(size(model%supports%items)))
    do k = 1, size(model%supports%items)
      description%boundary_names(k) = model%supports%items(k)%support%name
    end do
    call frame_fields(description%fields, model%whole%n > 0)
    call history_columns(model, description%columns)
  end subroutine describe_run

  !> The points that results show: those of all stages, with the volumes that they have when they
  !> are there.
  pure subroutine points_of(model, position, volume, boundary)
    type(model_t),         intent(in)  :: model
    real(wp), allocatable, intent(out) :: position(:, :)   !! (n,2) [m]
    real(wp), allocatable, intent(out) :: volume(:)        !! (n) [m^2]
    integer,  allocatable, intent(out) :: boundary(:)      !! (n)

    if (model%whole%n > 0) then
      position = model%whole%position
      volume = model%whole%volume
      boundary = model%whole%boundary
    else
      position = model%points%position(model%shown%row(), :)
      volume = model%points%volume(model%shown%row())
      boundary = model%body%boundaries([1, model%body%n])
    end if
  end subroutine points_of

  !> Close all outputs of a run that has come to its end.
  subroutine close_record(record, errors)
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors

    if (record%elsewhere) return
    call close_history(record%history, errors)
    call close_progress(record%progress, errors)
    if (errors%count() == 0) call finish_result(record%result, record%moment, errors)
  end subroutine close_record

  !> Observe the state after a step; what is seen stays in the record.
  subroutine observe_state(model, state, ledger, clock, record)
    type(model_t),  intent(inout) :: model
    type(state_t),  intent(inout) :: state
    type(ledger_t), intent(in)    :: ledger
    type(clock_t),  intent(in)    :: clock
    type(record_t), intent(inout) :: record

    call bring_looked_at(model, state)
    record%moment = moment_at(clock, model, state, ledger)
    call observe(record%columns, model, state, record%moment, record%seen)
  end subroutine observe_state

  !> Write a row of the history with what was seen last.
  subroutine record_row(record, errors)
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    integer :: before

    if (record%elsewhere) return
    before = record%history%rows
    call write_row(record%history, record%seen%values, errors)
    if (record%history%rows == before) record%rows_owed = record%rows_owed + 1
    call add_row(record%result, record%seen%values, errors)
  end subroutine record_row

  !> Write the next frame, of the moment seen last.
  subroutine record_frame(model, state, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    integer :: before

    before = errors%count()
    call write_frame(record%result, record%frames, record%moment, model, state, errors)
    if (errors%count() == before) then
      record%frames = record%frames + 1
    else
      record%frames_owed = record%frames_owed + 1
    end if
  end subroutine record_frame

  !> Write the tries of a search for the factor of safety.
  subroutine record_tries(tries, record, errors)
    type(tries_t),      intent(in)    :: tries
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors

    if (record%elsewhere) return
    call write_tries(record%result, tries, errors)
  end subroutine record_tries

  !> Write the state of a run that has failed, marked as not valid.
  subroutine record_failure(model, state, clock, record, errors)
    type(model_t),      intent(inout) :: model
    type(state_t),      intent(inout) :: state
    type(clock_t),      intent(in)    :: clock
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors

    call bring_looked_at(model, state)
    call write_failed_frame(record%result, moment_at(clock, model, state, ledger_t()), model, &
      state, errors)
  end subroutine record_failure

  !> Show the progress of the run; axial stress and largest alpha are those of the last row.
  subroutine record_progress(model, state, schedule, clock, record, errors)
    type(model_t),      intent(inout) :: model
    type(state_t),      intent(inout) :: state
    type(schedule_t),   intent(in)    :: schedule
    type(clock_t),      intent(in)    :: clock
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(status_t) :: status
    type(moment_t) :: moment

    call bring_looked_at(model, state)
    if (record%elsewhere) return
    status%step = clock%step
    status%steps = schedule%steps
    status%time = clock%time()
    status%largest_alpha = record%seen%value('max_plastic_strain')
    if (model%platens%axis > 0) then
      status%has_strain = .true.
      moment = moment_at(clock, model, state, record%moment%ledger)
      status%strain = moment%strain
      associate (first => model%supports%items(model%platens%first)%support)
        status%axial_stress = first%force(model%platens%axis) / model%platens%width
      end associate
    else
      call find_moved(model, record%seen, status)
    end if
    call show_progress(record%progress, status, errors)
  end subroutine record_progress

  !> The boundary that has moved most at the last row, and the axis along which it has.
  pure subroutine find_moved(model, seen, status)
    type(model_t),       intent(in)    :: model
    type(observation_t), intent(in)    :: seen
    type(status_t),      intent(inout) :: status
    real(wp) :: way
    integer  :: c, k

    do k = 1, size(model%supports%items)
      associate (name => model%supports%items(k)%support%name)
        do c = 1, 2
          way = seen%value(name//'_displacement_'//axes(c))
          if (ieee_is_nan(way)) cycle   ! it has no such column
          if (abs(way) <= abs(status%displacement)) cycle
          status%moved = name(:min(len(name), len(status%moved) - 2))//' '//axes(c)
          status%displacement = way
          status%force = seen%value(name//'_force_'//axes(c))
        end do
      end associate
    end do
  end subroutine find_moved

  !> A line on the screen and in the log.
  subroutine record_line(record, text, errors)
    type(record_t),     intent(inout) :: record
    character(*),       intent(in)    :: text
    type(error_list_t), intent(inout) :: errors

    if (record%elsewhere) return
    call say(record%progress, text, errors)
  end subroutine record_line

  !> Write the doubts of the run into the result file.
  subroutine record_doubts(record, doubts, errors)
    type(record_t),     intent(in)    :: record
    type(doubts_t),     intent(in)    :: doubts
    type(error_list_t), intent(inout) :: errors

    if (.not. record%elsewhere) call write_doubts(record%result%path, doubts, errors)
  end subroutine record_doubts

  !> Write the quality at the end of the run into the result file.
  subroutine record_quality(record, quality, errors)
    type(record_t),     intent(in)    :: record
    type(quality_t),    intent(in)    :: quality
    type(error_list_t), intent(inout) :: errors

    if (.not. record%elsewhere) call write_quality(record%result%path, quality, errors)
  end subroutine record_quality

end module pd_record
