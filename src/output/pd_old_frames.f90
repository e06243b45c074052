!> Frames of a result file that a run is to go on with.
module pd_old_frames
  use pd_errors, only: error_list_t
  use pd_frames, only: frame_name
  use pd_hdf5, only: hdf5_file_t, read_attribute
  use pd_run_description, only: schema, schema_version
  implicit none
  private

  public :: check_old_frames

contains

  !> Report an error unless the old file holds the frames that are to be kept.
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

end module pd_old_frames
