!> Datasets and attributes of HDF5 files; with `pd_hdf5_file` the one place where return codes of
!> HDF5 are checked.
!>
!> Arrays are (n,k) in memory and (n,k) to every reader that counts like C (h5py, ParaView): HDF5
!> hands dimensions over reversed, so arrays of rank 2 are transposed on the way.
module pd_hdf5
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_ptr
  use hdf5, only: h5aclose_f, h5acreate_f, h5aexists_by_name_f, h5aget_space_f, h5aget_type_f, &
    h5aopen_f, h5aread_f, h5awrite_f, h5d_alloc_time_early_f, h5d_contiguous_f, &
    h5d_fill_time_alloc_f, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_type_f, h5dopen_f, &
    h5dread_f, h5dwrite_f, h5oclose_f, h5oopen_f, h5p_dataset_create_f, h5pclose_f, h5pcreate_f, &
    h5pset_alloc_time_f, h5pset_fill_time_f, h5pset_layout_f, h5sclose_f, &
    h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5t_ieee_f64le, &
    h5t_native_double, h5t_native_integer, h5t_std_i32le, h5tclose_f, h5tget_size_f, hid_t, &
    hsize_t, size_t
  use pd_errors, only: error_list_t
  use pd_hdf5_file, only: check, close_file, create_file, create_group, flush_file, hdf5_file_t, &
    make_space, make_text_type, object_exists, open_file
  use pd_kinds, only: wp
  implicit none
  private

  public :: hdf5_file_t, create_file, open_file, flush_file, close_file
  public :: create_group, object_exists
  public :: reserve_dataset, write_dataset, overwrite_dataset, overwrite_rows, read_dataset
  public :: write_attribute, read_attribute

  !> Put an array into the file as a new dataset.
  interface write_dataset
    module procedure write_real_1, write_real_2, write_integer_1, write_text, write_texts
  end interface write_dataset

  !> Write the values of a dataset that is there with this shape; nothing else of it changes.
  interface overwrite_dataset
    module procedure overwrite_real_1, overwrite_real_2
  end interface overwrite_dataset

  !> Read a dataset; the array is allocated in its shape.
  interface read_dataset
    module procedure read_real_1, read_real_2, read_integer_1, read_texts
  end interface read_dataset

  !> Set an attribute of an object: in place where it is there already.
  interface write_attribute
    module procedure write_attribute_integer, write_attribute_real, write_attribute_reals, &
      write_attribute_text
  end interface write_attribute

  interface read_attribute
    module procedure read_attribute_integer, read_attribute_real, read_attribute_text
  end interface read_attribute

contains

  ! ---- datasets -----------------------------------------------------------------------------

  !> Create a real dataset of this shape and fill it with zeros, so that its space on the disk is
  !> taken now: later writes change bytes in place and nothing else.
  subroutine reserve_dataset(file, name, shape_seen, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: shape_seen(:)   !! as a reader sees it: (n) or (n,k)
    type(error_list_t), intent(inout) :: errors

    call create_dataset(file, name, h5t_ieee_f64le, shape_seen, errors)
  end subroutine reserve_dataset

  subroutine create_dataset(file, name, data_type, shape_seen, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer(hid_t),     intent(in)    :: data_type
    integer,            intent(in)    :: shape_seen(:)   !! size 0: a scalar
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: dataset, space, properties
    integer :: status, ignored

    if (.not. file%is_good()) return
    call make_space(shape_seen, space, status)
    call check(file, status, name//' cannot be created', errors)
    if (file%failed) return
    call h5pcreate_f(h5p_dataset_create_f, properties, status)
    if (status >= 0) call h5pset_layout_f(properties, h5d_contiguous_f, status)
    if (status >= 0) call h5pset_alloc_time_f(properties, h5d_alloc_time_early_f, status)
    if (status >= 0) call h5pset_fill_time_f(properties, h5d_fill_time_alloc_f, status)
    if (status >= 0) call h5dcreate_f(file%id, name, data_type, space, dataset, status, properties)
    call check(file, status, name//' cannot be created', errors)
    if (.not. file%failed) call h5dclose_f(dataset, ignored)
    call h5pclose_f(properties, ignored)
    call h5sclose_f(space, ignored)
  end subroutine create_dataset

  !> Write all values of a dataset from memory of the same shape.
  subroutine put_data(file, name, memory_type, address, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer(hid_t),     intent(in)    :: memory_type
    type(c_ptr),        intent(in)    :: address
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: dataset
    integer :: status

    if (.not. file%is_good()) return
    call h5dopen_f(file%id, name, dataset, status)
    call check(file, status, name//' cannot be opened', errors)
    if (file%failed) return
    call h5dwrite_f(dataset, memory_type, address, status)
    call check(file, status, name//' cannot be written', errors)
    call h5dclose_f(dataset, status)
    if (.not. file%failed) call check(file, status, name//' cannot be written', errors)
  end subroutine put_data

  !> Read all values of a dataset into memory of the same shape.
  subroutine take_data(file, name, memory_type, address, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer(hid_t),     intent(in)    :: memory_type
    type(c_ptr),        intent(in)    :: address
    type(error_list_t), intent(inout) :: errors
    type(c_ptr)    :: destination
    integer(hid_t) :: dataset
    integer :: status

    if (.not. file%is_good()) return
    call h5dopen_f(file%id, name, dataset, status)
    call check(file, status, name//' cannot be opened', errors)
    if (file%failed) return
    destination = address
    call h5dread_f(dataset, memory_type, destination, status)
    call check(file, status, name//' cannot be read', errors)
    call h5dclose_f(dataset, status)
  end subroutine take_data

  subroutine write_real_1(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: values(:)
    type(error_list_t), intent(inout) :: errors

    call reserve_dataset(file, name, shape(values), errors)
    call overwrite_dataset(file, name, values, errors)
  end subroutine write_real_1

  subroutine write_real_2(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: values(:, :)
    type(error_list_t), intent(inout) :: errors

    call reserve_dataset(file, name, shape(values), errors)
    call overwrite_dataset(file, name, values, errors)
  end subroutine write_real_2

  subroutine overwrite_real_1(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: values(:)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable, target :: buffer(:)

    call expect_shape(file, name, shape(values), errors)
    allocate (buffer, source=values)
    call put_data(file, name, h5t_native_double, c_loc(buffer), errors)
  end subroutine overwrite_real_1

  subroutine overwrite_real_2(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: values(:, :)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable, target :: buffer(:, :)

    call expect_shape(file, name, shape(values), errors)
    allocate (buffer, source=transpose(values))
    call put_data(file, name, h5t_native_double, c_loc(buffer), errors)
  end subroutine overwrite_real_2

  !> Write into a dataset that is there, from an array that lies in memory as in the file: all
  !> components of a point together.
  !>
  !> Errors: another shape, a file that cannot be written.
  subroutine overwrite_rows(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp), target,   intent(in), contiguous :: values(:, :)   !! (components,points)
    type(error_list_t), intent(inout) :: errors

    if (size(values, 1) == 1) then
      call expect_shape(file, name, [size(values, 2)], errors)
    else
      call expect_shape(file, name, [size(values, 2), size(values, 1)], errors)
    end if
    if (size(values) > 0) &
      call put_data(file, name, h5t_native_double, c_loc(values), errors)
  end subroutine overwrite_rows

  subroutine write_integer_1(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: values(:)
    type(error_list_t), intent(inout) :: errors
    integer, allocatable, target :: buffer(:)

    call create_dataset(file, name, h5t_std_i32le, shape(values), errors)
    allocate (buffer, source=values)
    call put_data(file, name, h5t_native_integer, c_loc(buffer), errors)
  end subroutine write_integer_1

  !> Write one string as a scalar, byte for byte.
  subroutine write_text(file, name, text, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name, text
    type(error_list_t), intent(inout) :: errors
    integer :: no_shape(0)

    call write_characters(file, name, no_shape, characters([text], .false.), errors)
  end subroutine write_text

  !> Write strings, without the blanks that follow each of them.
  subroutine write_texts(file, name, texts, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name, texts(:)
    type(error_list_t), intent(inout) :: errors

    call write_characters(file, name, shape(texts), characters(texts, .true.), errors)
  end subroutine write_texts

  subroutine write_characters(file, name, shape_seen, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: shape_seen(:)
    character(kind=c_char), intent(in), target :: values(:, :)   !! (length, strings)
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: text_type
    integer :: status

    if (.not. file%is_good()) return
    call make_text_type(size(values, 1), text_type, status)
    call check(file, status, name//' cannot be created', errors)
    call create_dataset(file, name, text_type, shape_seen, errors)
    call put_data(file, name, text_type, c_loc(values), errors)
    call h5tclose_f(text_type, status)
  end subroutine write_characters

  !> Strings as an array of single characters, null characters behind each. With `trimmed` the
  !> blanks at the end of each string do not count. HDF5 knows no strings of length 0.
  pure function characters(texts, trimmed) result(values)
    character(*), intent(in) :: texts(:)
    logical,      intent(in) :: trimmed
    character(kind=c_char), allocatable :: values(:, :)
    integer :: i, j, length

    length = len(texts)
    if (trimmed .and. size(texts) > 0) length = maxval(len_trim(texts))
    allocate (values(max(length, 1), size(texts)))
    values = c_null_char
    do j = 1, size(texts)
      if (trimmed) length = len_trim(texts(j))
      do i = 1, length
        values(i, j) = texts(j)(i:i)
      end do
    end do
  end function characters

  !> See to it that a dataset has this shape.
  subroutine expect_shape(file, name, shape_wanted, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: shape_wanted(:)
    type(error_list_t), intent(inout) :: errors
    integer :: shape_seen(size(shape_wanted))

    call find_shape(file, name, shape_seen, errors)
    if (.not. file%is_good() .or. all(shape_seen == shape_wanted)) return
    call check(file, -1, name//' has another shape than expected', errors)
  end subroutine expect_shape

  !> The shape of a dataset as a reader sees it; zeros after a failure or for another rank.
  subroutine find_shape(file, name, shape_seen, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(out)   :: shape_seen(:)   !! its size: the rank expected
    type(error_list_t), intent(inout) :: errors
    integer(hsize_t) :: dimensions(size(shape_seen)), largest(size(shape_seen))
    integer(hid_t)   :: dataset, space
    integer :: status, found_rank, ignored

    shape_seen = 0
    if (.not. file%is_good()) return
    call h5dopen_f(file%id, name, dataset, status)
    call check(file, status, name//' cannot be opened', errors)
    if (file%failed) return
    dimensions = 0
    call h5dget_space_f(dataset, space, status)
    if (status >= 0) then
      call h5sget_simple_extent_ndims_f(space, found_rank, status)
      if (found_rank /= size(shape_seen)) status = -1
      if (status >= 0) call h5sget_simple_extent_dims_f(space, dimensions, largest, status)
      if (any(dimensions > huge(1))) status = -1
      call h5sclose_f(space, ignored)
    end if
    call check(file, status, name//' has another shape than expected', errors)
    call h5dclose_f(dataset, ignored)
    if (.not. file%failed) shape_seen = int(dimensions(size(shape_seen):1:-1))
  end subroutine find_shape

  subroutine read_real_1(file, name, values, errors)
    type(hdf5_file_t),     intent(inout) :: file
    character(*),          intent(in)    :: name
    real(wp), allocatable, intent(out)   :: values(:)
    type(error_list_t),    intent(inout) :: errors
    real(wp), allocatable, target :: buffer(:)
    integer :: shape_seen(1)

    call find_shape(file, name, shape_seen, errors)
    allocate (buffer(shape_seen(1)), source=0.0_wp)
    call take_data(file, name, h5t_native_double, c_loc(buffer), errors)
    call move_alloc(buffer, values)
  end subroutine read_real_1

  subroutine read_real_2(file, name, values, errors)
    type(hdf5_file_t),     intent(inout) :: file
    character(*),          intent(in)    :: name
    real(wp), allocatable, intent(out)   :: values(:, :)
    type(error_list_t),    intent(inout) :: errors
    real(wp), allocatable, target :: buffer(:, :)
    integer :: shape_seen(2)

    call find_shape(file, name, shape_seen, errors)
    allocate (buffer(shape_seen(2), shape_seen(1)), source=0.0_wp)
    call take_data(file, name, h5t_native_double, c_loc(buffer), errors)
    allocate (values, source=transpose(buffer))
  end subroutine read_real_2

  subroutine read_integer_1(file, name, values, errors)
    type(hdf5_file_t),    intent(inout) :: file
    character(*),         intent(in)    :: name
    integer, allocatable, intent(out)   :: values(:)
    type(error_list_t),   intent(inout) :: errors
    integer, allocatable, target :: buffer(:)
    integer :: shape_seen(1)

    call find_shape(file, name, shape_seen, errors)
    allocate (buffer(shape_seen(1)), source=0)
    call take_data(file, name, h5t_native_integer, c_loc(buffer), errors)
    call move_alloc(buffer, values)
  end subroutine read_integer_1

  !> Read strings, padded with blanks to the longest.
  subroutine read_texts(file, name, texts, errors)
    type(hdf5_file_t),         intent(inout) :: file
    character(*),              intent(in)    :: name
    character(:), allocatable, intent(out)   :: texts(:)
    type(error_list_t),        intent(inout) :: errors
    character(kind=c_char), allocatable, target :: buffer(:, :)
    integer(hid_t) :: text_type
    integer :: shape_seen(1), length, status, i

    call find_shape(file, name, shape_seen, errors)
    call find_length(file, name, length, errors)
    allocate (buffer(length, shape_seen(1)))
    allocate (character(length) :: texts(shape_seen(1)))
    buffer = c_null_char
    if (file%is_good()) then
      call make_text_type(length, text_type, status)
      call check(file, status, name//' cannot be read', errors)
      call take_data(file, name, text_type, c_loc(buffer), errors)
      call h5tclose_f(text_type, status)
    end if
    do i = 1, shape_seen(1)
      texts(i) = text_of(buffer(:, i))
    end do
  end subroutine read_texts

  !> Length of the strings of a dataset; 1 after a failure.
  subroutine find_length(file, name, length, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(out)   :: length
    type(error_list_t), intent(inout) :: errors
    integer(hid_t)  :: dataset, text_type
    integer(size_t) :: found
    integer :: status, ignored

    length = 1
    if (.not. file%is_good()) return
    call h5dopen_f(file%id, name, dataset, status)
    if (status >= 0) then
      call h5dget_type_f(dataset, text_type, status)
      if (status >= 0) then
        call h5tget_size_f(text_type, found, status)
        if (status >= 0) length = int(found)
        call h5tclose_f(text_type, ignored)
      end if
      call h5dclose_f(dataset, ignored)
    end if
    call check(file, status, name//' cannot be read', errors)
  end subroutine find_length

  !> The characters up to the first null character.
  pure function text_of(values) result(text)
    character(kind=c_char), intent(in) :: values(:)
    character(size(values)) :: text
    integer :: i

    text = ''
    do i = 1, size(values)
      if (values(i) == c_null_char) exit
      text(i:i) = values(i)
    end do
  end function text_of

  ! ---- attributes ---------------------------------------------------------------------------

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

end module pd_hdf5
