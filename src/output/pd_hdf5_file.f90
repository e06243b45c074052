!> HDF5 files: opening, closing, groups, and what happens when a call of the library fails.
!>
!> Together with `pd_hdf5` and `pd_hdf5_attributes` the one place where return codes of
!> HDF5 are checked. After the first failure a file does nothing more and reports nothing more: a
!> sequence of calls needs no check in between. The library is never closed, and told not to close
!> itself at the end of the program: after a failed write (a full disk) it would try again then.
module pd_hdf5_file
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funloc, c_funptr, &
    c_int, c_int64_t, c_loc, c_null_char, c_ptr
  use hdf5, only: h5eset_auto_f, h5f_acc_rdonly_f, h5f_acc_rdwr_f, h5f_acc_trunc_f, &
    h5f_scope_global_f, h5fclose_f, h5fcreate_f, h5fflush_f, h5fopen_f, h5gclose_f, h5gcreate_f, &
    h5iis_valid_f, h5ldelete_f, h5lexists_f, h5open_f, h5p_file_create_f, h5pclose_f, h5pcreate_f, &
    h5pset_userblock_f, h5s_scalar_f, h5screate_f, h5screate_simple_f, h5t_c_s1, &
    h5t_native_double, h5t_str_nullpad_f, h5tcopy_f, h5tset_cset_f, h5tset_size_f, &
    h5tset_strpad_f, hid_t, hsize_t, size_t
  use pd_errors, only: error_list_t
  use pd_system, only: set_environment, wait_a_while
  implicit none
  private

  public :: hdf5_file_t, create_file, open_file, flush_file, close_file
  public :: create_group, object_exists, remove_object
  public :: check, make_space, make_text_type, characters, text_of

  !> A file that is open. It does nothing more once something has failed.
  type :: hdf5_file_t
    integer(hid_t) :: id = -1          !! the library's, for datasets and attributes
    logical :: failed = .false.
    character(:), allocatable :: path
  contains
    procedure :: is_good
  end type hdf5_file_t

  !> H5E_error2_t of the C library: one entry of its error stack.
  type, bind(c) :: stack_entry_t
    integer(c_int64_t) :: class_id, major_number, minor_number
    integer(c_int)     :: line
    type(c_ptr)        :: function_name, file_name, description
  end type stack_entry_t

  integer, parameter :: reason_length = 400

  type :: reason_t
    character(reason_length) :: text = ''
    logical :: from_system = .false.
  end type reason_t

  interface
    integer(c_int) function h5dont_atexit() bind(c, name='H5dont_atexit')
      import :: c_int
    end function h5dont_atexit
    integer(c_int) function h5ewalk(stack, direction, visit, data) bind(c, name='H5Ewalk2')
      import :: c_funptr, c_int, c_int64_t, c_ptr
      integer(c_int64_t), value :: stack
      integer(c_int),     value :: direction
      type(c_funptr),     value :: visit
      type(c_ptr),        value :: data
    end function h5ewalk
  end interface

contains

  !> Whether the file is open and nothing has failed.
  pure logical function is_good(self)
    class(hdf5_file_t), intent(in) :: self

    is_good = self%id >= 0 .and. .not. self%failed
  end function is_good

  !> Start the library unless it is running. It has a global state of its own, so it is asked.
  subroutine start_library(status)
    integer, intent(out) :: status
    logical        :: running
    integer(c_int) :: ignored

    call set_environment('HDF5_USE_FILE_LOCKING', 'FALSE')
    ignored = h5dont_atexit()
    call h5iis_valid_f(h5t_native_double, running, status)
    if (status == 0 .and. running) return
    call h5open_f(status)
    if (status >= 0) call h5eset_auto_f(0, status)
  end subroutine start_library

  !> Create a file, replacing one of that name. `user_block`: bytes kept free at its beginning
  !> (0, or a power of two from 512).
  subroutine create_file(file, path, user_block, errors)
    type(hdf5_file_t),  intent(out)   :: file
    character(*),       intent(in)    :: path
    integer,            intent(in)    :: user_block
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: properties
    integer :: status, ignored

    file%path = path
    call start_library(status)
    if (status >= 0) call h5pcreate_f(h5p_file_create_f, properties, status)
    call check(file, status, 'the HDF5 library cannot be started', errors)
    if (file%failed) return
    call h5pset_userblock_f(properties, int(user_block, hsize_t), status)
    if (status >= 0) call h5fcreate_f(path, h5f_acc_trunc_f, file%id, status, properties)
    call check(file, status, 'the file cannot be created', errors)
    call h5pclose_f(properties, ignored)
  end subroutine create_file

  !> Open a file that exists. For writing it is tried again for some seconds where the operating
  !> system refuses it: a reader may hold a lock on it for a moment.
  subroutine open_file(file, path, writable, errors)
    type(hdf5_file_t),  intent(out)   :: file
    character(*),       intent(in)    :: path
    logical,            intent(in)    :: writable
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: tries = 50, pause = 100   ! [ms]
    integer :: status, k
    logical :: there

    file%path = path
    call start_library(status)
    call check(file, status, 'the HDF5 library cannot be started', errors)
    if (file%failed) return
    if (writable) then
      do k = 1, tries
        call h5fopen_f(path, h5f_acc_rdwr_f, file%id, status)
        if (status >= 0) exit
        inquire (file=path, exist=there)
        if (.not. there) exit
        if (.not. refused_by_system()) exit
        call wait_a_while(pause)
      end do
      call check(file, status, 'the file cannot be opened for writing', errors)
    else
      call h5fopen_f(path, h5f_acc_rdonly_f, file%id, status)
      call check(file, status, 'the file cannot be opened as HDF5', errors)
    end if
  end subroutine open_file

  !> Hand everything written so far to the operating system.
  subroutine flush_file(file, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: status

    if (.not. file%is_good()) return
    call h5fflush_f(file%id, h5f_scope_global_f, status)
    call check(file, status, 'the file cannot be written to', errors)
  end subroutine flush_file

  !> Close the file; harmless where it is not open.
  subroutine close_file(file, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    integer :: status

    if (file%id < 0) return
    if (file%failed) then
      call h5fclose_f(file%id, status)
    else
      call flush_file(file, errors)
      call h5fclose_f(file%id, status)
      if (.not. file%failed) call check(file, status, 'the file cannot be closed', errors)
    end if
    file%id = -1
  end subroutine close_file

  subroutine create_group(file, name, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(error_list_t), intent(inout) :: errors
    integer(hid_t) :: group
    integer :: status

    if (.not. file%is_good()) return
    call h5gcreate_f(file%id, name, group, status)
    call check(file, status, name//' cannot be created', errors)
    if (.not. file%failed) call h5gclose_f(group, status)
  end subroutine create_group

  !> Whether there is a group or dataset of this name, such as 'frames/000001'.
  logical function object_exists(file, name)
    type(hdf5_file_t), intent(in) :: file
    character(*),      intent(in) :: name
    integer :: i, status

    object_exists = file%is_good()
    do i = 1, len(name)
      if (.not. object_exists) return
      if (i < len(name)) then
        if (name(i + 1:i + 1) /= '/') cycle
      end if
      call h5lexists_f(file%id, name(:i), object_exists, status)
      object_exists = object_exists .and. status >= 0
    end do
  end function object_exists

  !> Remove a group or dataset.
  subroutine remove_object(file, name, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(error_list_t), intent(inout) :: errors
    integer :: status

    if (.not. file%is_good()) return
    call h5ldelete_f(file%id, name, status)
    call check(file, status, name//' cannot be removed', errors)
  end subroutine remove_object

  !> A data space; the dimensions of Fortran are those that C sees, reversed.
  subroutine make_space(shape_seen, space, status)
    integer,        intent(in)  :: shape_seen(:)
    integer(hid_t), intent(out) :: space
    integer,        intent(out) :: status

    if (size(shape_seen) == 0) then
      call h5screate_f(h5s_scalar_f, space, status)
    else
      call h5screate_simple_f(size(shape_seen), &
        int(shape_seen(size(shape_seen):1:-1), hsize_t), space, status)
    end if
  end subroutine make_space

  ! ---- strings ------------------------------------------------------------------------------

  !> A string type of fixed length, UTF-8, padded with null characters.
  subroutine make_text_type(length, text_type, status)
    integer,        intent(in)  :: length
    integer(hid_t), intent(out) :: text_type
    integer,        intent(out) :: status
    integer, parameter :: utf_8 = 1   ! H5T_CSET_UTF8, which the Fortran library does not name

    call h5tcopy_f(h5t_c_s1, text_type, status)
    if (status >= 0) call h5tset_size_f(text_type, int(length, size_t), status)
    if (status >= 0) call h5tset_strpad_f(text_type, h5t_str_nullpad_f, status)
    if (status >= 0) call h5tset_cset_f(text_type, utf_8, status)
  end subroutine make_text_type

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

  ! ---- failures -----------------------------------------------------------------------------

  !> Note a negative return code: what could not be done, to which file, and the library's reason.
  subroutine check(file, status, what, errors)
    type(hdf5_file_t),  intent(inout) :: file
    integer,            intent(in)    :: status
    character(*),       intent(in)    :: what
    type(error_list_t), intent(inout) :: errors
    type(reason_t) :: reason

    if (status >= 0) return
    file%failed = .true.
    reason = last_reason()
    if (len_trim(reason%text) == 0) then
      call errors%add(what, where=file%path)
    else
      call errors%add(what//' ('//trim(reason%text)//')', where=file%path)
    end if
  end subroutine check

  !> Whether the operating system has refused the last call of the library.
  logical function refused_by_system()
    type(reason_t) :: reason

    reason = last_reason()
    refused_by_system = reason%from_system
  end function refused_by_system

  !> Why the last call of the library has failed.
  type(reason_t) function last_reason()
    type(reason_t), target :: reason
    integer(c_int) :: ignored
    integer(c_int),     parameter :: innermost_first = 0
    integer(c_int64_t), parameter :: current_stack = 0

    ignored = h5ewalk(current_stack, innermost_first, c_funloc(note_reason), c_loc(reason))
    last_reason = reason
  end function last_reason

  !> Keep the message of the operating system where the stack holds one, otherwise the innermost.
  integer(c_int) function note_reason(level, entry, data) bind(c)
    integer(c_int),      value      :: level
    type(stack_entry_t), intent(in) :: entry
    type(c_ptr),         value      :: data
    character(*), parameter :: mark = "error message = '"
    character(kind=c_char), pointer :: description(:)
    type(reason_t), pointer :: reason
    character(reason_length) :: text
    integer :: i, first, length

    note_reason = 0
    call c_f_pointer(data, reason)
    if (reason%from_system .or. .not. c_associated(entry%description)) return
    call c_f_pointer(entry%description, description, [reason_length])
    text = ''
    do i = 1, reason_length
      if (description(i) == c_null_char) exit
      text(i:i) = description(i)
    end do
    first = index(text, mark)
    if (first > 0) then
      first = first + len(mark)
      length = index(text(first:), "'") - 1
      if (length < 0) length = len_trim(text(first:))
      reason%text = text(first:first + length - 1)
      reason%from_system = .true.
    else if (level == 0) then
      reason%text = text
    end if
  end function note_reason

end module pd_hdf5_file
