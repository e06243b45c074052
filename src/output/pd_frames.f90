!> A frame in a result file, and how it gets there.
module pd_frames
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_errors, only: error_list_t
  use pd_frame_fields, only: fill_field, frame_field_t
  use pd_hdf5, only: create_group, flush_file, hdf5_file_t, overwrite_rows, read_attribute, &
    read_rows, reserve_dataset, write_attribute
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_model, only: model_t
  use pd_observe, only: moment_t
  use pd_parts, only: put_parts
  use pd_state, only: state_t
  implicit none
  private

  public :: frame_name, reserve_frame, put_frame, mark_frame, copy_frame, write_label

contains

  pure function frame_name(index) result(name)
    integer, intent(in) :: index
    character(14) :: name

    write (name, '("/frames/", i6.6)') index
  end function frame_name

  !> Create a frame without data, and allocate its space on the disk.
  subroutine reserve_frame(file, group, n, fields, errors)
    type(hdf5_file_t),   intent(inout) :: file
    character(*),        intent(in)    :: group
    integer,             intent(in)    :: n   !! points
    type(frame_field_t), intent(in)    :: fields(:)
    type(error_list_t),  intent(inout) :: errors
    real(wp) :: nan
    integer  :: i

    nan = ieee_value(1.0_wp, ieee_quiet_nan)
    call create_group(file, group, errors)
    call write_attribute(file, group, 'step', -1, errors)
    call write_attribute(file, group, 'time', nan, errors)
    call write_attribute(file, group, 'strain', nan, errors)
    call write_attribute(file, group, 'valid', 0, errors)
    call write_attribute(file, group, 'written', 0, errors)
    do i = 1, size(fields)
      call reserve_field(file, place_of(group, fields(i)), n, fields(i), errors)
    end do
  end subroutine reserve_frame

  subroutine reserve_field(file, name, n, field, errors)
    type(hdf5_file_t),   intent(inout) :: file
    character(*),        intent(in)    :: name
    integer,             intent(in)    :: n
    type(frame_field_t), intent(in)    :: field
    type(error_list_t),  intent(inout) :: errors

    if (field%width() == 1) then
      call reserve_dataset(file, name, [n], errors)
    else
      call reserve_dataset(file, name, [n, field%width()], errors)
      call write_attribute(file, name, 'components', trim(field%components), errors)
    end if
    call write_label(file, name, field%label_t, errors)
  end subroutine reserve_field

  pure function place_of(group, field) result(place)
    character(*),        intent(in) :: group
    type(frame_field_t), intent(in) :: field
    character(:), allocatable :: place

    place = group//'/'//trim(field%name)
  end function place_of

  !> Give a dataset its unit and its description.
  subroutine write_label(file, name, label, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name   !! with its groups
    type(label_t),      intent(in)    :: label
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, name, 'unit', trim(label%unit), errors)
    call write_attribute(file, name, 'description', trim(label%description), errors)
  end subroutine write_label

  !> Write the data of a frame and hand them to the operating system. One field after the other:
  !> all of them at once would take too much memory with a large body. Rank 0 writes what all ranks
  !> hand in.
  subroutine put_frame(file, group, fields, model, state, errors)
    type(hdf5_file_t),   intent(inout) :: file
    character(*),        intent(in)    :: group
    type(frame_field_t), intent(in)    :: fields(:)
    type(model_t),       intent(in)    :: model
    type(state_t),       intent(in)    :: state
    type(error_list_t),  intent(inout) :: errors
    real(wp), allocatable :: values(:, :)
    integer :: i

    do i = 1, size(fields)
      allocate (values(fields(i)%width(), model%shown%n))
      call fill_field(fields(i), model, state, values)
      if (model%blocks%ranks%count > 1) then
        call put_parts(file, place_of(group, fields(i)), model%blocks, model%shown, values, &
          errors)
      else
        call overwrite_rows(file, place_of(group, fields(i)), values, errors)
      end if
      deallocate (values)
    end do
    if (model%blocks%ranks%mine == 0) call flush_file(file, errors)
  end subroutine put_frame

  !> Mark a frame as written. Its data must have been flushed before.
  subroutine mark_frame(file, group, moment, valid, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: group
    type(moment_t),     intent(in)    :: moment
    logical,            intent(in)    :: valid
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, group, 'step', moment%step, errors)
    call write_attribute(file, group, 'time', moment%time, errors)
    call write_attribute(file, group, 'strain', moment%strain, errors)
    call write_attribute(file, group, 'valid', merge(1, 0, valid), errors)
    call write_attribute(file, group, 'written', 1, errors)
  end subroutine mark_frame

  !> Copy a frame of n points from one result file into its place in another.
  subroutine copy_frame(old, new, group, n, fields, moment, errors)
    type(hdf5_file_t),   intent(inout) :: old, new
    character(*),        intent(in)    :: group
    integer,             intent(in)    :: n
    type(frame_field_t), intent(in)    :: fields(:)
    type(moment_t),      intent(out)   :: moment   !! of the frame
    type(error_list_t),  intent(inout) :: errors
    real(wp), allocatable :: values(:, :)
    integer :: valid, i

    call read_attribute(old, group, 'step', moment%step, errors)
    call read_attribute(old, group, 'time', moment%time, errors)
    call read_attribute(old, group, 'strain', moment%strain, errors)
    call read_attribute(old, group, 'valid', valid, errors)
    do i = 1, size(fields)
      allocate (values(fields(i)%width(), n))
      call read_rows(old, place_of(group, fields(i)), values, errors)
      if (.not. old%is_good()) return
      call overwrite_rows(new, place_of(group, fields(i)), values, errors)
      deallocate (values)
    end do
    call flush_file(new, errors)
    call mark_frame(new, group, moment, valid == 1, errors)
  end subroutine copy_frame

end module pd_frames
