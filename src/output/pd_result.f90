!> The result file `<stem>.h5` and its `<stem>.xdmf`: points, frames, history, and their provenance.
!>
!> All frames and rows are created, and their space on the disk is allocated, before the file gets
!> its name. From then on its structure never changes: a frame is data written in place and handed
!> to the operating system, then its attributes in one write, `written` among them; rows of the
!> history likewise. A kill at any moment loses at most what is being written. Space for rows that
!> were not due in the end is given back when the run is complete.
module pd_result
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_errors, only: error_list_t
  use pd_files, only: file_exists, replace_file
  use pd_frame_fields, only: frame_field_t
  use pd_frames, only: copy_frame, frame_name, mark_frame, put_frame, reserve_frame, write_label
  use pd_hdf5, only: close_file, create_file, create_group, flush_file, hdf5_file_t, open_file, &
    read_attribute, read_dataset, write_attribute, write_dataset
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_model, only: model_t
  use pd_observe, only: column_t, moment_t
  use pd_old_frames, only: check_old_frames
  use pd_result_tries, only: put_tries
  use pd_rows, only: check_rows, compare_rows, copy_rows, put_rows, reserve_rows, resize_rows, &
    rows_in
  use pd_run_description, only: run_description_t, write_description, writer_of
  use pd_state, only: state_t
  use pd_system, only: remove_file
  use pd_text, only: integer_text
  use pd_timing, only: now
  use pd_tries, only: tries_t
  use pd_xdmf, only: new_xdmf, xdmf_t
  implicit none
  private

  public :: places_t, result_t, bunch
  public :: create_result, resume_result, attend_result, add_row, write_rows, write_frame
  public :: write_failed_frame
  public :: write_tries, finish_result, result_exists, read_end

  !> Numbers of frames and rows for which a result file has space.
  type :: places_t
    integer :: frames = 0   !! 000000 among them
    integer :: rows = 0     !! of the history, that of the unloaded state among them
  end type places_t

  !> Rows that are written together.
  integer, parameter :: bunch = 500
  real(wp), parameter :: patience = 1.0_wp   !! how long they wait at most [s]

  !> A result file of a run that is going on; the file itself is closed between calls.
  type :: result_t
    character(:), allocatable :: path
    integer :: n = 0                   !! points
    type(places_t) :: places           !! in the file
    type(frame_field_t), allocatable :: fields(:)
    type(column_t),      allocatable :: columns(:)
    logical :: has_strain = .false.    !! whether there are platens
    type(xdmf_t) :: xdmf               !! the file for ParaView
    character(:), allocatable :: writer   !! which run wrote the file: this one
    logical :: is_foreign = .false.    !! another one has been found in its place
    logical :: is_lost = .false.       !! it could not be opened
    logical, private :: elsewhere = .false.   !! another rank writes it
    integer :: rows_written = 0
    integer,  private :: waiting = 0                   !! rows not written yet
    real(wp), private :: waiting_since = 0.0_wp        !! clock at the first of these rows [s]
    real(wp), allocatable, private :: bunch_of(:, :)   !! these rows (columns,rows)
  end type result_t

contains

  !> Whether an earlier run left a result, a history or a checkpoint of this name.
  logical function result_exists(stem)
    character(*), intent(in) :: stem   !! output folder and name of the run

    result_exists = any([file_exists(stem//'.h5'), file_exists(stem//'_history.csv'), &
      file_exists(stem//'_checkpoint.h5'), file_exists(stem//'_checkpoint_previous.h5')])
  end function result_exists

  !> Whether a result file is that of a run that came to its end, and the values of its input as
  !> used; a file that is not there, or cannot be read, is none.
  subroutine read_end(path, complete, values)
    character(*),              intent(in)  :: path
    logical,                   intent(out) :: complete
    character(:), allocatable, intent(out) :: values(:)
    type(hdf5_file_t)  :: file
    type(error_list_t) :: unheard
    integer :: number

    complete = .false.
    if (.not. file_exists(path)) return
    call open_file(file, path, .false., unheard)
    call read_attribute(file, '/', 'complete', number, unheard)
    call read_dataset(file, '/input/values', values, unheard)
    call close_file(file, unheard)
    complete = number == 1 .and. unheard%count() == 0
  end subroutine read_end

  !> Create the result file with space for frames and rows, replacing one of that name.
  !>
  !> Errors: the files cannot be written; an older result file is then as it was.
  subroutine create_result(result, stem, description, places, errors)
    type(result_t),          intent(out)   :: result
    character(*),            intent(in)    :: stem   !! output folder and name of the run
    type(run_description_t), intent(in)    :: description
    type(places_t),          intent(in)    :: places
    type(error_list_t),      intent(inout) :: errors
    type(hdf5_file_t) :: file

    call describe_result(result, stem, description, places)
    call create_structure(result, file, description, errors)
    call publish(result, file, errors)
  end subroutine create_result

  !> Take part in a result file that another rank writes: hand in the fields of the frames.
  subroutine attend_result(result, stem, description, places)
    type(result_t),          intent(out) :: result
    character(*),            intent(in)  :: stem
    type(run_description_t), intent(in)  :: description
    type(places_t),          intent(in)  :: places

    call describe_result(result, stem, description, places)
    result%elsewhere = .true.
  end subroutine attend_result

  !> Go on with the result file of a run that was cut off: a new file with the first frames and rows
  !> of the old one and space for more replaces it.
  !>
  !> `rows`: those of the CSV file, which may have some that the old result file has not; absent:
  !> those of the old file.
  !> Errors: no such file, another set of points, other columns, fewer frames or rows than the
  !> checkpoint knows of, rows that differ, or the files cannot be written. The old file is then as
  !> it was.
  subroutine resume_result(result, stem, description, kept, more, step, errors, rows)
    type(result_t),          intent(out)   :: result
    character(*),            intent(in)    :: stem
    type(run_description_t), intent(in)    :: description
    type(places_t),          intent(in)    :: kept   !! written up to the checkpoint
    type(places_t),          intent(in)    :: more
    integer,                 intent(in)    :: step   !! of the checkpoint
    type(error_list_t),      intent(inout) :: errors
    real(wp),                intent(in), optional :: rows(:, :)   !! (columns,rows)
    type(hdf5_file_t) :: old, new
    type(moment_t) :: moment
    integer :: i, before

    before = errors%count()
    call describe_result(result, stem, description, places_t(kept%frames + more%frames, &
      kept%rows + more%rows))
    call open_file(old, result%path, .false., errors)
    call check_old_frames(old, result%path, kept%frames, step, errors)
    if (present(rows)) then
      if (errors%count() == before) call compare_rows(old, result%columns, rows, errors)
    else
      if (errors%count() == before) call check_rows(old, result%columns, kept%rows, errors)
    end if
    if (errors%count() == before) then
      call create_structure(result, new, description, errors)
      do i = 0, kept%frames - 1
        call copy_frame(old, new, frame_name(i), result%n, result%fields, moment, errors)
        call result%xdmf%note(moment%time)
      end do
      if (present(rows)) then
        call put_rows(new, result%columns, 0, rows, errors)
      else
        call copy_rows(old, new, result%columns, kept%rows, errors)
      end if
      result%rows_written = kept%rows
    end if
    call close_file(old, errors)
    if (errors%count() == before) then
      call publish(result, new, errors)
    else
      call discard(result, new)
    end if
  end subroutine resume_result

  !> Take in a row of the history. It waits for others, and is written with the next frame at the
  !> latest.
  !>
  !> Errors: the file cannot be written.
  subroutine add_row(result, values, errors)
    type(result_t),     intent(inout) :: result
    real(wp),           intent(in)    :: values(:)   !! in the order of the columns
    type(error_list_t), intent(inout) :: errors
    real(wp) :: time

    if (result%rows_written + result%waiting >= result%places%rows) call make_room(result, errors)
    result%waiting = result%waiting + 1
    result%bunch_of(:, result%waiting) = values
    time = now()
    if (result%waiting == 1) result%waiting_since = time
    if (result%waiting == bunch .or. time - result%waiting_since > patience) &
      call write_rows(result, errors)
  end subroutine add_row

  !> Make room for more rows than were planned, the time step having changed: for about as many more
  !> as there are, so that it is rarely done.
  subroutine make_room(result, errors)
    type(result_t),     intent(inout) :: result
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_own(result, file, errors)
    call put_waiting_rows(result, file, errors)
    result%places%rows = 2 * result%places%rows + bunch
    call resize_rows(file, result%columns, result%rows_written, result%places%rows, errors)
    call close_file(file, errors)
  end subroutine make_room

  !> Open the file for writing, and look whether it is the one that this run has made.
  !>
  !> Errors: it is gone, or another one is in its place.
  subroutine open_own(result, file, errors)
    type(result_t),     intent(inout) :: result
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found
    integer :: rows

    call open_file(file, result%path, .true., errors)
    found = writer_of(file, errors)
    rows = rows_in(file, errors)
    result%is_lost = .not. file%is_good()
    if (result%is_lost) return
    if (found == result%writer .and. rows == result%rows_written) return
    result%is_foreign = found /= result%writer
    if (result%is_foreign) then
      call errors%add('another file has taken the place of the result of this run', &
        where=result%path, found=found, allowed=result%writer)
    else
      call errors%add('the result has lost rows of its history', where=result%path, &
        found=integer_text(rows), allowed=integer_text(result%rows_written))
    end if
    file%failed = .true.
  end subroutine open_own

  !> Write the rows that wait.
  !>
  !> Errors: the file cannot be written; the rows before these stay readable.
  subroutine write_rows(result, errors)
    type(result_t),     intent(inout) :: result
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    if (result%waiting == 0) return
    call open_own(result, file, errors)
    call put_waiting_rows(result, file, errors)
    call close_file(file, errors)
  end subroutine write_rows

  subroutine put_waiting_rows(result, file, errors)
    type(result_t),     intent(inout) :: result
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors

    if (result%waiting == 0) return
    call put_rows(file, result%columns, result%rows_written, &
      result%bunch_of(:, :result%waiting), errors)
    if (.not. file%is_good()) return
    result%rows_written = result%rows_written + result%waiting
    result%waiting = 0
  end subroutine put_waiting_rows

  !> Write frame `index` (0: the unloaded state) and the rows that wait, and add the frame to the
  !> XDMF file.
  !>
  !> Errors: a file cannot be written; the frames before this one stay readable.
  subroutine write_frame(result, index, moment, model, state, errors)
    type(result_t),     intent(inout) :: result
    integer,            intent(in)    :: index
    type(moment_t),     intent(in)    :: moment
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file
    integer :: before

    before = errors%count()
    if (result%elsewhere) then
      call put_frame(file, frame_name(index), result%fields, model, state, errors)
      return
    end if
    if (index < 0 .or. index >= result%places%frames) then
      call errors%add('there is no place for frame '//frame_name(index), where=result%path)
      file%failed = .true.   ! other ranks hand in what they have
    else
      call open_own(result, file, errors)
    end if
    call put_waiting_rows(result, file, errors)
    call put_frame(file, frame_name(index), result%fields, model, state, errors)
    call mark_frame(file, frame_name(index), with_strain(result, moment), .true., errors)
    call close_file(file, errors)
    if (errors%count() > before) return
    call result%xdmf%add_frame(moment%time, errors)
  end subroutine write_frame

  !> Write the state in which a run failed, marked as not valid, beside the frames, and the rows
  !> that wait: these are good.
  !>
  !> Errors: the file cannot be written.
  subroutine write_failed_frame(result, moment, model, state, errors)
    type(result_t),     intent(inout) :: result
    type(moment_t),     intent(in)    :: moment
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    if (result%elsewhere) then
      call put_frame(file, '/failed_frame', result%fields, model, state, errors)
      return
    end if
    call open_own(result, file, errors)
    call put_waiting_rows(result, file, errors)
    call put_frame(file, '/failed_frame', result%fields, model, state, errors)
    call mark_frame(file, '/failed_frame', with_strain(result, moment), .false., errors)
    call close_file(file, errors)
  end subroutine write_failed_frame

  !> Write the tries of a search for the factor of safety.
  subroutine write_tries(result, tries, errors)
    type(result_t),     intent(inout) :: result
    type(tries_t),      intent(in)    :: tries
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_own(result, file, errors)
    call put_tries(file, tries, errors)
    call close_file(file, errors)
  end subroutine write_tries

  !> Write the rows that wait, and mark the result as complete: the run has come to its end. Only
  !> now are the number of steps and of rows known for sure, for the time step may have changed.
  !>
  !> Errors: a file cannot be written; the result is not complete then.
  subroutine finish_result(result, moment, errors)
    type(result_t),     intent(inout) :: result
    type(moment_t),     intent(in)    :: moment   !! the end
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file
    integer :: before

    before = errors%count()
    call open_own(result, file, errors)
    call put_waiting_rows(result, file, errors)
    if (result%rows_written < result%places%rows) &
      call resize_rows(file, result%columns, result%rows_written, result%rows_written, errors)
    call write_attribute(file, '/', 'steps', moment%step, errors)
    call write_attribute(file, '/', 'time_step', moment%time_step, errors)
    call close_file(file, errors)
    call result%xdmf%finish(errors)
    if (errors%count() > before) return
    call open_own(result, file, errors)
    call write_attribute(file, '/', 'complete', 1, errors)
    call close_file(file, errors)
  end subroutine finish_result

  subroutine describe_result(result, stem, description, places)
    type(result_t),          intent(inout) :: result
    character(*),            intent(in)    :: stem
    type(run_description_t), intent(in)    :: description
    type(places_t),          intent(in)    :: places

    result%path = stem//'.h5'
    result%n = description%n
    result%places = places
    result%fields = description%fields
    result%columns = description%columns
    allocate (result%bunch_of(size(result%columns), bunch))
    result%has_strain = description%strain_axis /= 'none'
    result%xdmf = new_xdmf(stem//'.xdmf', result%path, result%n, result%fields%field_label_t, &
      places%frames, allocated(description%yield_stress))
  end subroutine describe_result

  !> Write everything but the contents of frames and rows, under the name of a temporary file.
  subroutine create_structure(result, file, description, errors)
    type(result_t),          intent(inout) :: result
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    type(error_list_t),      intent(inout) :: errors
    integer :: i

    call create_file(file, result%path//'.tmp', 0, errors)
    call write_description(file, description, result%places%frames, errors)
    result%writer = writer_of(file, errors)
    call reserve_rows(file, result%columns, result%places%rows, errors)
    call create_group(file, '/frames', errors)
    do i = 0, result%places%frames - 1
      call reserve_frame(file, frame_name(i), result%n, result%fields, errors)
    end do
    call reserve_frame(file, '/failed_frame', result%n, result%fields, errors)
    call flush_file(file, errors)
  end subroutine create_structure

  !> Close the finished file, give it its name, and write the XDMF file that belongs to it.
  subroutine publish(result, file, errors)
    type(result_t),     intent(inout) :: result
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: before
    logical :: good

    before = errors%count()
    good = file%is_good()
    call close_file(file, errors)
    if (good .and. errors%count() == before) then
      call replace_file(result%path//'.tmp', result%path, errors)
      if (errors%count() == before) call result%xdmf%write(errors)
    else
      call discard(result, file)
    end if
  end subroutine publish

  subroutine discard(result, file)
    type(result_t),    intent(in)    :: result
    type(hdf5_file_t), intent(inout) :: file
    type(error_list_t) :: not_of_interest
    logical :: ignored

    call close_file(file, not_of_interest)
    ignored = remove_file(result%path//'.tmp')
  end subroutine discard

  !> The moment with the nominal strain to be written: NaN where there are no platens.
  function with_strain(result, moment) result(written)
    type(result_t), intent(in) :: result
    type(moment_t), intent(in) :: moment
    type(moment_t) :: written

    written = moment
    if (.not. result%has_strain) written%strain = ieee_value(1.0_wp, ieee_quiet_nan)
  end function with_strain

end module pd_result
