!> Attributes of HDF5 files: numbers and strings at the file itself, a group or a dataset.
module pd_hdf5_attributes
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_ptr
  use hdf5, only: h5aclose_f, h5acreate_f, h5aexists_by_name_f, h5aget_space_f, h5aget_type_f, &
    h5aopen_f, h5aread_f, h5awrite_f, h5oclose_f, h5oopen_f, h5sclose_f, &
    h5sget_simple_extent_ndims_f, h5t_ieee_f64le, h5t_native_double, h5t_native_integer, &
    h5t_std_i32le, h5tclose_f, h5tget_size_f, hid_t, size_t
  use pd_errors, only: error_list_t
  use pd_hdf5_file, only: characters, check, hdf5_file_t, make_space, make_text_type, text_of
  use pd_kinds, only: wp
  implicit none
  private

  public :: write_attribute, read_attribute

  !> Set an attribute of an object, in place if it exists already.
  interface write_attribute
    module procedure write_attribute_integer, write_attribute_real, write_attribute_reals, &
      write_attribute_text
  end interface write_attribute

  interface read_attribute
    module procedure read_attribute_integer, read_attribute_real, read_attribute_text
  end interface read_attribute

contains

  subroutine write_attribute_integer(file, object, name, value, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name   !! object '/': the file itself
    integer,            intent(in)    :: value
    type(error_list_t), intent(inout) :: errors
    integer, target :: buffer
    integer :: no_shape(0)

    buffer = value
    call put_attribute(file, object, name, [h5t_std_i32le, h5t_native_integer], no_shape, &
      c_loc(buffer), errors)
  end subroutine write_attribute_integer

  subroutine write_attribute_real(file, object, name, value, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    real(wp),           intent(in)    :: value
    type(error_list_t), intent(inout) :: errors
    real(wp), target :: buffer
    integer :: no_shape(0)

    buffer = value
    call put_attribute(file, object, name, [h5t_ieee_f64le, h5t_native_double], no_shape, &
      c_loc(buffer), errors)
  end subroutine write_attribute_real

  subroutine write_attribute_reals(file, object, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    real(wp),           intent(in)    :: values(:)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable, target :: buffer(:)

    allocate (buffer, source=values)
    call put_attribute(file, object, name, [h5t_ieee_f64le, h5t_native_double], shape(values), &
      c_loc(buffer), errors)
  end subroutine write_attribute_reals

  !> Set a string attribute; it must not exist, as its length is its type.
  subroutine write_attribute_text(file, object, name, text, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name, text
    type(error_list_t), intent(inout) :: errors
    character(kind=c_char), allocatable, target :: buffer(:, :)
    integer(hid_t) :: text_type
    integer :: status, no_shape(0)

    if (.not. file%is_good()) return
    allocate (buffer, source=characters([text], .true.))
    call make_text_type(size(buffer, 1), text_type, status)
    call put_attribute(file, object, name, [text_type, text_type], no_shape, c_loc(buffer), errors)
    call h5tclose_f(text_type, status)
  end subroutine write_attribute_text

  subroutine put_attribute(file, object, name, types, shape_seen, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    integer(hid_t),     intent(in)    :: types(2)        !! in the file, in memory
    integer,            intent(in)    :: shape_seen(:)   !! size 0: a scalar
    type(c_ptr),        intent(in)    :: values
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: holder, attribute, space
    integer :: status, ignored
    logical :: there

    if (.not. file%is_good()) return
    call h5oopen_f(file%id, object, holder, status)
    call check(file, status, object//' cannot be opened', errors)
    if (file%failed) return
    call h5aexists_by_name_f(file%id, object, name, there, status)
    if (status >= 0 .and. there) then
      call h5aopen_f(holder, name, attribute, status)
    else if (status >= 0) then
      call make_space(shape_seen, space, status)
      if (status >= 0) call h5acreate_f(holder, name, types(1), space, attribute, status)
      call h5sclose_f(space, ignored)
    end if
    if (status >= 0) then
      call h5awrite_f(attribute, types(2), values, status)
      call check(file, status, 'attribute '//name//' of '//object//' cannot be written', errors)
      call h5aclose_f(attribute, ignored)
    else
      call check(file, status, 'attribute '//name//' of '//object//' cannot be written', errors)
    end if
    call h5oclose_f(holder, ignored)
  end subroutine put_attribute

  subroutine read_attribute_integer(file, object, name, value, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    integer,            intent(out)   :: value   !! 0 after a failure
    type(error_list_t), intent(inout) :: errors
    integer, target :: buffer

    buffer = 0
    call fetch_attribute(file, object, name, h5t_native_integer, c_loc(buffer), errors)
    value = buffer
  end subroutine read_attribute_integer

  subroutine read_attribute_real(file, object, name, value, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    real(wp),           intent(out)   :: value   !! 0 after a failure
    type(error_list_t), intent(inout) :: errors
    real(wp), target :: buffer

    buffer = 0.0_wp
    call fetch_attribute(file, object, name, h5t_native_double, c_loc(buffer), errors)
    value = buffer
  end subroutine read_attribute_real

  subroutine fetch_attribute(file, object, name, memory_type, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    integer(hid_t),     intent(in)    :: memory_type
    type(c_ptr),        intent(in)    :: values   !! room for one value
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: attribute
    type(c_ptr) :: address
    integer :: status, ignored

    call open_attribute(file, object, name, attribute, errors)
    if (.not. file%is_good()) return
    address = values
    call h5aread_f(attribute, memory_type, address, status)
    call check(file, status, 'attribute '//name//' of '//object//' cannot be read', errors)
    call h5aclose_f(attribute, ignored)
  end subroutine fetch_attribute

  !> Open an attribute that holds a scalar.
  subroutine open_attribute(file, object, name, attribute, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: object, name
    integer(hid_t),     intent(out)   :: attribute
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: holder, space
    integer :: status, ignored, found_rank

    attribute = -1
    if (.not. file%is_good()) return
    call h5oopen_f(file%id, object, holder, status)
    call check(file, status, object//' cannot be opened', errors)
    if (file%failed) return
    call h5aopen_f(holder, name, attribute, status)
    if (status >= 0) then
      call h5aget_space_f(attribute, space, status)
      if (status >= 0) call h5sget_simple_extent_ndims_f(space, found_rank, status)
      if (status >= 0 .and. found_rank /= 0) status = -1
      call h5sclose_f(space, ignored)
      if (status < 0) call h5aclose_f(attribute, ignored)
    end if
    call check(file, status, object//' has no readable attribute '//name, errors)
    call h5oclose_f(holder, ignored)
  end subroutine open_attribute

  subroutine read_attribute_text(file, object, name, text, errors)
    type(hdf5_file_t),         intent(inout) :: file
    character(*),              intent(in)    :: object, name
    character(:), allocatable, intent(out)   :: text   !! '' after a failure
    type(error_list_t),        intent(inout) :: errors
    character(kind=c_char), allocatable, target :: buffer(:)
    integer(hid_t)  :: attribute, text_type
    integer(size_t) :: length
    type(c_ptr) :: address
    integer :: status, ignored

    text = ''
    call open_attribute(file, object, name, attribute, errors)
    if (.not. file%is_good()) return
    call h5aget_type_f(attribute, text_type, status)
    if (status >= 0) call h5tget_size_f(text_type, length, status)
    if (status < 0) length = 1
    allocate (buffer(length))
    address = c_loc(buffer)
    if (status >= 0) call h5aread_f(attribute, text_type, address, status)
    call check(file, status, 'attribute '//name//' of '//object//' cannot be read', errors)
    if (.not. file%failed) text = trim(text_of(buffer))
    call h5tclose_f(text_type, ignored)
    call h5aclose_f(attribute, ignored)
  end subroutine read_attribute_text

end module pd_hdf5_attributes
