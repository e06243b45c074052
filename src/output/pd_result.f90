!> The result file `<stem>.h5` and its `<stem>.xdmf`: points, frames, and where they come from.
!>
!> All frames are created, and their space on the disk is taken, before the file gets its name.
!> From then on its structure never changes: a frame is data written in place and handed to the
!> operating system, then its attributes in one write, `written` among them. A kill at any moment
!> loses at most the frame being written.
module pd_result
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_errors, only: error_list_t
  use pd_files, only: file_exists, replace_file
  use pd_frames, only: copy_frame, fields_of_a_frame, frame_fields_t, frame_name, frame_source_t, &
    label, mark_frame, put_frame, reserve_frame
  use pd_hdf5, only: close_file, create_file, create_group, flush_file, hdf5_file_t, open_file, &
    read_attribute, write_attribute, write_dataset
  use pd_kinds, only: wp
  use pd_system, only: host_name, remove_file
  use pd_xdmf, only: write_xdmf, xdmf_grid
  implicit none
  private

  public :: provenance_t, run_description_t, frame_source_t, frame_fields_t, result_t
  public :: create_result, resume_result, write_frame, write_failed_frame, finish_result
  public :: result_exists, utc_time

  integer, parameter :: schema_version = 1
  character(*), parameter :: schema = 'perigeo result'

  !> Where a result comes from.
  type :: provenance_t
    character(:), allocatable :: code_version, git_hash, compiler, flags, command_line
    integer :: threads = 1
  end type provenance_t

  !> Everything that a result file says beside its frames.
  type :: run_description_t
    type(provenance_t) :: provenance
    character(:), allocatable :: title, name
    character(:), allocatable :: namelist      !! the input file, byte for byte
    character(:), allocatable :: values(:)     !! 'group.key = value', as used
    character(:), allocatable :: strain_axis   !! 'x', 'y'; 'none' where there are no platens
    real(wp) :: spacing = 0.0_wp, horizon = 0.0_wp                 !! [m]
    real(wp) :: lower(2) = 0.0_wp, upper(2) = 0.0_wp               !! extents of the body [m]
    real(wp) :: time_step = 0.0_wp                                 !! [s]
    integer  :: steps = 0                                          !! of the whole run
    real(wp), allocatable :: position(:, :)    !! (n,2) [m]
    real(wp), allocatable :: volume(:)         !! (n) [m^2]
    integer,  allocatable :: boundary(:)       !! (n) 0: body, k: boundary k
    real(wp), allocatable :: yield_stress(:)   !! (n) [Pa]; not allocated: a material without one
    character(:), allocatable :: boundary_names(:)
  end type run_description_t

  !> A result file of a run that is going on; the file itself is closed between calls.
  type :: result_t
    character(:), allocatable :: path, xdmf_path
    integer :: n = 0                   !! points
    integer :: n_frames = 0            !! frames with a place in the file, 000000 among them
    logical :: has_strain = .false.    !! whether there are platens
    logical :: yields = .false.        !! whether the points have a yield stress
    integer :: written = 0             !! frames written so far
    character(:), allocatable :: grids !! of these frames, for the XDMF file
  end type result_t

contains

  !> Whether an earlier run left a result, a history or a checkpoint of this name.
  logical function result_exists(stem)
    character(*), intent(in) :: stem   !! output folder and name of the run

    result_exists = any([file_exists(stem//'.h5'), file_exists(stem//'_history.csv'), &
      file_exists(stem//'_checkpoint.h5'), file_exists(stem//'_checkpoint_previous.h5')])
  end function result_exists

  !> Create the result file with places for `n_frames` frames (000000 among them), replacing one of
  !> that name.
  !>
  !> Errors: the files cannot be written; an older result file is then as it was.
  subroutine create_result(result, stem, description, n_frames, errors)
    type(result_t),          intent(out)   :: result
    character(*),            intent(in)    :: stem   !! output folder and name of the run
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_frames
    type(error_list_t),      intent(inout) :: errors
    type(hdf5_file_t) :: file

    call describe_result(result, stem, description, n_frames)
    call create_structure(result, file, description, errors)
    call publish(result, file, errors)
  end subroutine create_result

  !> Go on with the result file of a run that was cut off: a new file with the first `n_kept` frames
  !> of the old one and places for `n_new` more takes its place.
  !>
  !> Errors: no such file, another set of points, fewer frames than the checkpoint knows of, or the
  !> files cannot be written. The old file is then as it was.
  subroutine resume_result(result, stem, description, n_kept, n_new, step, errors)
    type(result_t),          intent(out)   :: result
    character(*),            intent(in)    :: stem
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_kept   !! frames written up to the checkpoint
    integer,                 intent(in)    :: n_new
    integer,                 intent(in)    :: step     !! of the checkpoint
    type(error_list_t),      intent(inout) :: errors
    type(hdf5_file_t) :: old, new
    real(wp) :: time
    integer  :: i, before

    before = errors%count()
    call describe_result(result, stem, description, n_kept + n_new)
    call open_file(old, result%path, .false., errors)
    call check_old_frames(old, result%path, n_kept, step, errors)
    if (errors%count() == before) then
      call create_structure(result, new, description, errors)
      do i = 0, n_kept - 1
        call copy_frame(old, new, frame_name(i), time, errors)
        call note_frame(result, i, time)
      end do
    end if
    call close_file(old, errors)
    if (errors%count() == before) then
      call publish(result, new, errors)
    else
      call discard(result, new)
    end if
  end subroutine resume_result

  !> Write frame `index` (0: the unloaded state) and renew the XDMF file.
  !>
  !> Errors: a file cannot be written; the frames before this one stay readable.
  subroutine write_frame(result, index, step, time, strain, source, errors)
    type(result_t),       intent(inout) :: result
    integer,              intent(in)    :: index, step
    real(wp),             intent(in)    :: time     !! [s]
    real(wp),             intent(in)    :: strain   !! nominal; without platens any number
    class(frame_source_t), intent(in)   :: source
    type(error_list_t),   intent(inout) :: errors
    type(hdf5_file_t) :: file
    integer :: before

    before = errors%count()
    if (index < 0 .or. index >= result%n_frames) then
      call errors%add('there is no place for frame '//frame_name(index), where=result%path)
      return
    end if
    call open_file(file, result%path, .true., errors)
    call put_frame(file, frame_name(index), source, errors)
    call mark_frame(file, frame_name(index), step, time, frame_strain(result, strain), .true., &
      errors)
    call close_file(file, errors)
    if (errors%count() > before) return
    call note_frame(result, index, time)
    call renew_xdmf(result, errors)
  end subroutine write_frame

  !> Write the state in which a run failed, marked as not valid, beside the frames.
  !>
  !> Errors: the file cannot be written.
  subroutine write_failed_frame(result, step, time, strain, source, errors)
    type(result_t),       intent(in)    :: result
    integer,              intent(in)    :: step
    real(wp),             intent(in)    :: time, strain   !! [s], nominal
    class(frame_source_t), intent(in)   :: source
    type(error_list_t),   intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_file(file, result%path, .true., errors)
    call put_frame(file, '/failed_frame', source, errors)
    call mark_frame(file, '/failed_frame', step, time, frame_strain(result, strain), .false., &
      errors)
    call close_file(file, errors)
  end subroutine write_failed_frame

  !> Mark the result as complete: the run has come to its end.
  subroutine finish_result(result, errors)
    type(result_t),     intent(in)    :: result
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_file(file, result%path, .true., errors)
    call write_attribute(file, '/', 'complete', 1, errors)
    call close_file(file, errors)
    call renew_xdmf(result, errors)
  end subroutine finish_result

  !> The time now as ISO 8601 in UTC, '2024-05-31T09:30:00Z'.
  function utc_time() result(text)
    character(20) :: text
    integer :: now(8), minutes, days, y, m, d

    call date_and_time(values=now)
    minutes = 60 * now(5) + now(6) - now(4)
    days = julian_day(now(1), now(2), now(3)) + floor(real(minutes, wp) / 1440.0_wp)
    minutes = modulo(minutes, 1440)
    ! Richards' algorithm: the date of a Julian day number
    m = days + 1401 + (4 * days + 274277) / 146097 * 3 / 4 - 38
    y = 4 * m + 3
    d = 5 * (modulo(y, 1461) / 4) + 2
    m = modulo(d / 153 + 2, 12) + 1
    y = y / 1461 - 4716 + (14 - m) / 12
    d = modulo(d, 153) / 5 + 1
    write (text, '(i4.4, 2("-", i2.2), "T", i2.2, 2(":", i2.2), "Z")') y, m, d, minutes / 60, &
      modulo(minutes, 60), now(7)
  end function utc_time

  pure integer function julian_day(y, m, d)
    integer, intent(in) :: y, m, d

    julian_day = (1461 * (y + 4800 + (m - 14) / 12)) / 4 + (367 * (m - 2 - 12 * ((m - 14) / 12))) &
      / 12 - (3 * ((y + 4900 + (m - 14) / 12) / 100)) / 4 + d - 32075
  end function julian_day

  subroutine describe_result(result, stem, description, n_frames)
    type(result_t),          intent(inout) :: result
    character(*),            intent(in)    :: stem
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_frames

    result%path = stem//'.h5'
    result%xdmf_path = stem//'.xdmf'
    result%n = size(description%volume)
    result%n_frames = n_frames
    result%has_strain = description%strain_axis /= 'none'
    result%yields = allocated(description%yield_stress)
    result%grids = ''
  end subroutine describe_result

  !> Write everything but the frames' contents, under the name of a temporary file.
  subroutine create_structure(result, file, description, errors)
    type(result_t),          intent(in)    :: result
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    type(error_list_t),      intent(inout) :: errors
    integer :: i

    call create_file(file, result%path//'.tmp', 0, errors)
    call write_provenance(file, description%provenance, errors)
    call write_description(file, description, result%n_frames, errors)
    call write_points(file, description, errors)
    call create_group(file, '/frames', errors)
    do i = 0, result%n_frames - 1
      call reserve_frame(file, frame_name(i), result%n, errors)
    end do
    call reserve_frame(file, '/failed_frame', result%n, errors)
    call flush_file(file, errors)
  end subroutine create_structure

  subroutine write_provenance(file, provenance, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(provenance_t), intent(in)    :: provenance
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, '/', 'schema', schema, errors)
    call write_attribute(file, '/', 'schema_version', schema_version, errors)
    call write_attribute(file, '/', 'code_version', provenance%code_version, errors)
    call write_attribute(file, '/', 'git_hash', provenance%git_hash, errors)
    call write_attribute(file, '/', 'compiler', provenance%compiler, errors)
    call write_attribute(file, '/', 'flags', provenance%flags, errors)
    call write_attribute(file, '/', 'command_line', provenance%command_line, errors)
    call write_attribute(file, '/', 'host', host_name(), errors)
    call write_attribute(file, '/', 'threads', provenance%threads, errors)
    call write_attribute(file, '/', 'created', utc_time(), errors)
    call write_attribute(file, '/', 'complete', 0, errors)
  end subroutine write_provenance

  subroutine write_description(file, description, n_frames, errors)
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_frames
    type(error_list_t),      intent(inout) :: errors

    call write_attribute(file, '/', 'title', description%title, errors)
    call write_attribute(file, '/', 'name', description%name, errors)
    call write_attribute(file, '/', 'spacing', description%spacing, errors)
    call write_attribute(file, '/', 'horizon', description%horizon, errors)
    call write_attribute(file, '/', 'lower', description%lower, errors)
    call write_attribute(file, '/', 'upper', description%upper, errors)
    call write_attribute(file, '/', 'strain_axis', description%strain_axis, errors)
    call write_attribute(file, '/', 'time_step', description%time_step, errors)
    call write_attribute(file, '/', 'steps', description%steps, errors)
    call write_attribute(file, '/', 'n_frames', n_frames, errors)
    call create_group(file, '/input', errors)
    call write_dataset(file, '/input/namelist', description%namelist, errors)
    call label(file, '/input/namelist', '1', 'the input file, byte for byte', errors)
    if (size(description%values) == 0) return
    call write_dataset(file, '/input/values', description%values, errors)
    call label(file, '/input/values', '1', 'the values of the input as used', errors)
  end subroutine write_description

  subroutine write_points(file, description, errors)
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    type(error_list_t),      intent(inout) :: errors

    call create_group(file, '/points', errors)
    call write_dataset(file, '/points/position', description%position, errors)
    call label(file, '/points/position', 'm', 'reference position', errors)
    call write_attribute(file, '/points/position', 'components', 'x y', errors)
    call write_dataset(file, '/points/volume', description%volume, errors)
    call label(file, '/points/volume', 'm^2', 'volume of a point per unit of thickness', errors)
    call write_dataset(file, '/points/boundary', description%boundary, errors)
    call label(file, '/points/boundary', '1', 'boundary that a fictitious point belongs to, ' &
      //'counted from 1; 0: a point of the body', errors)
    if (allocated(description%yield_stress)) then
      call write_dataset(file, '/points/yield_stress', description%yield_stress, errors)
      call label(file, '/points/yield_stress', 'Pa', 'initial yield stress', errors)
    end if
    if (size(description%boundary_names) == 0) return
    call write_dataset(file, '/points/boundary_names', description%boundary_names, errors)
    call label(file, '/points/boundary_names', '1', 'names of the boundaries', errors)
  end subroutine write_points

  !> Close the finished file, give it its name, and write the XDMF file that belongs to it.
  subroutine publish(result, file, errors)
    type(result_t),     intent(in)    :: result
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: before
    logical :: good

    before = errors%count()
    good = file%is_good()
    call close_file(file, errors)
    if (good .and. errors%count() == before) then
      call replace_file(result%path//'.tmp', result%path, errors)
      if (errors%count() == before) call renew_xdmf(result, errors)
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

  !> See to it that the old file holds these points and the frames that are to be kept.
  subroutine check_old_frames(old, path, n_kept, step, errors)
    type(hdf5_file_t),  intent(inout) :: old
    character(*),       intent(in)    :: path
    integer,            intent(in)    :: n_kept, step
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found
    integer :: i, before, frame_step, written, version, n_frames

    before = errors%count()
    call read_attribute(old, '/', 'schema', found, errors)
    call read_attribute(old, '/', 'schema_version', version, errors)
    call read_attribute(old, '/', 'n_frames', n_frames, errors)
    if (.not. old%is_good()) return
    if (found /= schema .or. version /= schema_version) then
      call errors%add('is not a result file of this version of the program', where=path)
      return
    end if
    do i = 0, n_kept - 1
      written = 0
      if (i < n_frames) then
        call read_attribute(old, frame_name(i), 'written', written, errors)
        call read_attribute(old, frame_name(i), 'step', frame_step, errors)
        if (errors%count() > before) return
      end if
      if (written == 1 .and. frame_step <= step) cycle
      call errors%add('frame '//frame_name(i)//' was written before the checkpoint and is ' &
        //'missing: this is not the result file that the checkpoint belongs to', where=path)
      return
    end do
  end subroutine check_old_frames

  subroutine note_frame(result, index_of_frame, time)
    type(result_t), intent(inout) :: result
    integer,        intent(in)    :: index_of_frame
    real(wp),       intent(in)    :: time

    result%written = result%written + 1
    result%grids = result%grids//xdmf_grid(result%path(index(result%path, '/', back=.true.) + 1:), &
      result%n, fields_of_a_frame, index_of_frame, time, result%yields)
  end subroutine note_frame

  subroutine renew_xdmf(result, errors)
    type(result_t),     intent(in)    :: result
    type(error_list_t), intent(inout) :: errors

    call write_xdmf(result%xdmf_path, result%grids, errors)
  end subroutine renew_xdmf

  !> The nominal strain to be written: NaN where there are no platens.
  function frame_strain(result, strain)
    type(result_t), intent(in) :: result
    real(wp),       intent(in) :: strain
    real(wp) :: frame_strain

    frame_strain = ieee_value(1.0_wp, ieee_quiet_nan)
    if (result%has_strain) frame_strain = strain
  end function frame_strain

end module pd_result
