!> Datasets of HDF5 files, and everything else that a writer or reader of such files needs.
!>
!> Arrays are (n,k) in memory and (n,k) to every reader that counts like C (h5py, ParaView): HDF5
!> hands dimensions over reversed, so arrays of rank 2 are transposed on the way.
module pd_hdf5
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_ptr
  use hdf5, only: h5d_alloc_time_early_f, h5d_contiguous_f, h5d_fill_time_alloc_f, h5dclose_f, &
    h5dcreate_f, h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, h5dwrite_f, &
    h5p_dataset_create_f, h5pclose_f, h5pcreate_f, h5pset_alloc_time_f, h5pset_fill_time_f, &
    h5pset_layout_f, h5s_select_set_f, h5sclose_f, h5screate_simple_f, &
    h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f, &
    h5t_ieee_f64le, h5t_native_double, h5t_native_integer, h5t_std_i32le, h5tclose_f, &
    h5tget_size_f, hid_t, hsize_t, size_t
  use pd_errors, only: error_list_t
  use pd_hdf5_attributes, only: read_attribute, write_attribute
  use pd_hdf5_file, only: characters, check, close_file, create_file, create_group, flush_file, &
    hdf5_file_t, make_space, make_text_type, object_exists, open_file, remove_object, text_of
  use pd_kinds, only: wp
  implicit none
  private

  public :: hdf5_file_t, create_file, open_file, flush_file, close_file
  public :: create_group, object_exists, remove_object
  public :: reserve_dataset, reserve_whole_numbers
  public :: write_dataset, overwrite_dataset, overwrite_rows, overwrite_part, overwrite_some_rows
  public :: read_dataset, read_rows, write_attribute, read_attribute

  !> Write an array into the file as a new dataset.
  interface write_dataset
    module procedure write_real_1, write_real_2, write_integer_1, write_text, write_texts
  end interface write_dataset

  !> Overwrite the values of an existing dataset of this shape; nothing else of it changes.
  interface overwrite_dataset
    module procedure overwrite_real_1, overwrite_real_2
  end interface overwrite_dataset

  !> Read a dataset; the array is allocated in its shape.
  interface read_dataset
    module procedure read_real_1, read_real_2, read_integer_1, read_texts
  end interface read_dataset

contains

  !> Create a real dataset of this shape and fill it with zeros, so that its space on the disk is
  !> allocated now: later writes only change bytes in place.
  subroutine reserve_dataset(file, name, shape_seen, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: shape_seen(:)   !! as a reader sees it: (n) or (n,k)
    type(error_list_t), intent(inout) :: errors

    call create_dataset(file, name, h5t_ieee_f64le, shape_seen, errors)
  end subroutine reserve_dataset

  !> The same for whole numbers.
  subroutine reserve_whole_numbers(file, name, shape_seen, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: shape_seen(:)
    type(error_list_t), intent(inout) :: errors

    call create_dataset(file, name, h5t_std_i32le, shape_seen, errors)
  end subroutine reserve_whole_numbers

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

  !> Write into an existing dataset, from an array with the layout of the file: all components of a
  !> point together.
  !>
  !> Errors: another shape, a file that cannot be written.
  subroutine overwrite_rows(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp), target,   intent(in), contiguous :: values(:, :)   !! (components,points)
    type(error_list_t), intent(inout) :: errors

    call expect_rows(file, name, values, errors)
    if (size(values) > 0) &
      call put_data(file, name, h5t_native_double, c_loc(values), errors)
  end subroutine overwrite_rows

  !> Report an error unless a dataset has the shape of these rows.
  subroutine expect_rows(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: values(:, :)   !! (components,points)
    type(error_list_t), intent(inout) :: errors

    if (size(values, 1) == 1) then
      call expect_shape(file, name, [size(values, 2)], errors)
    else
      call expect_shape(file, name, [size(values, 2), size(values, 1)], errors)
    end if
  end subroutine expect_rows

  !> Write some of the values of a dataset of rank 1, the first of them at place `first` (from 1).
  !> Whole numbers are stored as such where the dataset has them.
  !>
  !> Errors: a dataset that ends before, a file that cannot be written.
  subroutine overwrite_part(file, name, first, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: first
    real(wp),           intent(in)    :: values(:)
    type(error_list_t), intent(inout) :: errors

    call overwrite_some_rows(file, name, first, reshape(values, [1, size(values)]), errors)
  end subroutine overwrite_part

  !> The same with all components of a point together, or one in a dataset of rank 1.
  subroutine overwrite_some_rows(file, name, first, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: first
    real(wp), target,   intent(in), contiguous :: values(:, :)   !! (components,points)
    type(error_list_t), intent(inout) :: errors
    integer(hid_t)   :: dataset, space, part
    integer(hsize_t) :: start(2), length(2)
    integer :: rank, status, ignored

    if (.not. file%is_good() .or. size(values) == 0) return
    start = int([0, first - 1], hsize_t)
    length = shape(values, kind=hsize_t)
    call h5dopen_f(file%id, name, dataset, status)
    call check(file, status, name//' cannot be opened', errors)
    if (file%failed) return
    call h5dget_space_f(dataset, space, status)
    if (status >= 0) then
      call h5sget_simple_extent_ndims_f(space, rank, status)
      if (status >= 0) call h5sselect_hyperslab_f(space, h5s_select_set_f, start(3 - rank:), &
        length(3 - rank:), status)
      if (status >= 0) call h5screate_simple_f(rank, length(3 - rank:), part, status)
      if (status >= 0) then
        call h5dwrite_f(dataset, h5t_native_double, c_loc(values), status, part, space)
        call h5sclose_f(part, ignored)
      end if
      call h5sclose_f(space, ignored)
    end if
    call check(file, status, name//' cannot be written', errors)
    call h5dclose_f(dataset, status)
    if (.not. file%failed) call check(file, status, name//' cannot be written', errors)
  end subroutine overwrite_some_rows

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

  !> Report an error unless a dataset has this shape.
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

  !> Read a dataset of a known shape into an array with the layout of the file: the reverse of
  !> `overwrite_rows`.
  !>
  !> Errors: another shape, a file that cannot be read.
  subroutine read_rows(file, name, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    real(wp), target,   intent(out), contiguous :: values(:, :)   !! (components,points)
    type(error_list_t), intent(inout) :: errors

    values = 0.0_wp
    call expect_rows(file, name, values, errors)
    if (size(values) > 0) call take_data(file, name, h5t_native_double, c_loc(values), errors)
  end subroutine read_rows

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

end module pd_hdf5
