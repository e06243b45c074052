!> Text files and folders, through the C library.
!>
!> Not through Fortran's own units: the run-time library of gfortran keeps the errors of FLUSH and
!> CLOSE to itself, so that a full disk goes unnoticed. Every return code is checked here.
module pd_files
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_long, c_null_char, c_null_ptr, &
    c_ptr, c_size_t
  use pd_c_files, only: c_fclose, c_fflush, c_fileno, c_fopen, c_fsync, c_fwrite, c_pwrite, &
    c_truncate
  use pd_errors, only: error_list_t
  use pd_kinds, only: i8
  use pd_system, only: make_directories, remove_file, rename_file
  implicit none
  private

  public :: output_file_t, open_output, write_line, flush_output, check_in_place
  public :: close_output
  public :: replace_file, sync_file, patch_file, cut_file, size_of_file, publish_output
  public :: prepare_folder, file_exists, meant_path

  !> A text file that is being written. After the first failure nothing more is written to it and
  !> nothing more is reported.
  type :: output_file_t
    private
    type(c_ptr) :: stream = c_null_ptr
    character(:), allocatable :: path
    integer(i8) :: bytes = 0        !! written so far, those before an opening among them
    logical :: failed = .false.
  contains
    procedure :: is_open
  end type output_file_t

contains

  !> Whether the file is open and everything so far has been written.
  pure logical function is_open(self)
    class(output_file_t), intent(in) :: self

    is_open = c_associated(self%stream) .and. .not. self%failed
  end function is_open

  !> Open a text file: anew, or with `append` behind what it holds.
  !>
  !> Errors: the file cannot be created or opened.
  subroutine open_output(file, path, append, errors)
    type(output_file_t), intent(out)   :: file
    character(*),        intent(in)    :: path
    logical,             intent(in)    :: append
    type(error_list_t),  intent(inout) :: errors
    integer(c_int) :: ignored

    file%path = path
    if (append) file%bytes = max(0_i8, size_of_file(path))
    if (.not. append) then
      file%stream = c_fopen(path//c_null_char, 'wb'//c_null_char)
      if (c_associated(file%stream)) ignored = c_fclose(file%stream)
    end if
    ! always behind what is there: a file that someone cuts off gets no hole
    file%stream = c_fopen(path//c_null_char, 'ab'//c_null_char)
    if (c_associated(file%stream)) return
    file%failed = .true.
    call errors%add('cannot be opened for writing: is the folder there, is writing permitted, ' &
      //'is the disk full?', where=path)
  end subroutine open_output

  !> Write one line. It reaches the operating system with `flush_output` at the latest.
  subroutine write_line(file, text, errors)
    type(output_file_t), intent(inout) :: file
    character(*),        intent(in)    :: text
    type(error_list_t),  intent(inout) :: errors
    integer(c_size_t) :: length

    if (.not. file%is_open()) return
    length = len(text, c_size_t) + 1_c_size_t
    if (c_fwrite(text//new_line('a'), 1_c_size_t, length, file%stream) /= length) then
      call report_write(file, errors)
    end if
    file%bytes = file%bytes + int(length, i8)
  end subroutine write_line

  !> Hand everything written so far to the operating system.
  subroutine flush_output(file, errors)
    type(output_file_t), intent(inout) :: file
    type(error_list_t),  intent(inout) :: errors

    if (.not. file%is_open()) return
    if (c_fflush(file%stream) /= 0) call report_write(file, errors)
  end subroutine flush_output

  !> Report an error where the file is no longer under its name: it was removed, replaced or changed
  !> by someone else while it was being written. Everything must have been handed over before.
  subroutine check_in_place(file, errors)
    type(output_file_t), intent(inout) :: file
    type(error_list_t),  intent(inout) :: errors

    if (.not. file%is_open()) return
    if (size_of_file(file%path) == file%bytes) return
    file%failed = .true.
    call errors%add('was removed, replaced or changed by someone else during the run', &
      where=file%path)
  end subroutine check_in_place

  !> Close the file; harmless where it is not open.
  subroutine close_output(file, errors)
    type(output_file_t), intent(inout) :: file
    type(error_list_t),  intent(inout) :: errors
    integer(c_int) :: status

    if (.not. c_associated(file%stream)) return
    status = c_fclose(file%stream)
    file%stream = c_null_ptr
    if (status /= 0 .and. .not. file%failed) call report_write(file, errors)
  end subroutine close_output

  subroutine report_write(file, errors)
    type(output_file_t), intent(inout) :: file
    type(error_list_t),  intent(inout) :: errors

    file%failed = .true.
    call errors%add('cannot be written to: is the disk full?', where=file%path)
  end subroutine report_write

  !> Rename `temporary` to `path` in one step: a reader sees the old file or the new one.
  !> Where that fails, `temporary` is removed.
  subroutine replace_file(temporary, path, errors)
    character(*),       intent(in)    :: temporary, path
    type(error_list_t), intent(inout) :: errors
    logical :: ignored

    if (rename_file(temporary, path)) return
    call errors%add('cannot be replaced: is it a folder, is writing permitted?', where=path)
    ignored = remove_file(temporary)
  end subroutine replace_file

  !> Wait until the contents of a closed file are on the disk.
  subroutine sync_file(path, errors)
    character(*),       intent(in)    :: path
    type(error_list_t), intent(inout) :: errors
    type(c_ptr)    :: stream
    integer(c_int) :: status, ignored

    status = -1
    stream = c_fopen(path//c_null_char, 'rb'//c_null_char)
    if (c_associated(stream)) then
      status = c_fsync(c_fileno(stream))
      ignored = c_fclose(stream)
    end if
    if (status /= 0) call errors%add('did not reach the disk: is it full?', where=path)
  end subroutine sync_file

  !> Overwrite bytes of a file that exists, in one call of the operating system.
  subroutine patch_file(path, offset, text, errors)
    character(*),       intent(in)    :: path
    integer(i8),        intent(in)    :: offset   !! bytes before them
    character(*),       intent(in)    :: text
    type(error_list_t), intent(inout) :: errors
    type(c_ptr) :: stream
    logical     :: done
    integer(c_size_t) :: length

    done = .false.
    length = len(text, c_size_t)
    stream = c_fopen(path//c_null_char, 'r+b'//c_null_char)
    if (c_associated(stream)) then
      done = c_pwrite(c_fileno(stream), text, length, int(offset, c_long)) == length
      done = c_fclose(stream) == 0 .and. done
    end if
    if (.not. done) call errors%add('cannot be written to: is the disk full?', where=path)
  end subroutine patch_file

  !> Cut a file off behind its first bytes.
  subroutine cut_file(path, length, errors)
    character(*),       intent(in)    :: path
    integer(i8),        intent(in)    :: length   !! [bytes]
    type(error_list_t), intent(inout) :: errors

    if (c_truncate(path//c_null_char, int(length, c_long)) == 0) return
    call errors%add('cannot be cut off: is writing permitted?', where=path)
  end subroutine cut_file

  !> Bytes of a file, -1 where there is none.
  integer(i8) function size_of_file(path) result(bytes)
    character(*), intent(in) :: path
    logical :: there

    inquire (file=path, exist=there, size=bytes)
    if (.not. there) bytes = -1
  end function size_of_file

  !> Close a file that was written beside its final name, and put it in place in one step; where
  !> something failed it is removed.
  subroutine publish_output(file, path, errors)
    type(output_file_t), intent(inout) :: file
    character(*),        intent(in)    :: path
    type(error_list_t),  intent(inout) :: errors
    logical :: whole, ignored

    call flush_output(file, errors)
    whole = file%is_open()
    call close_output(file, errors)
    if (whole .and. .not. file%failed) then
      call replace_file(file%path, path, errors)
    else
      ignored = remove_file(file%path)
    end if
  end subroutine publish_output

  !> Create a folder unless it is there, and check that it can be written to.
  subroutine prepare_folder(path, errors)
    character(*),       intent(in)    :: path
    type(error_list_t), intent(inout) :: errors

    if (index(path, '~') == 1) then
      call errors%add('the home folder is not known', where=path, &
        allowed='~/... where HOME is set, ./~... for a folder of this name')
      return
    end if
    if (make_directories(path)) return
    call errors%add('the output folder cannot be created or cannot be written to: is writing ' &
      //'permitted, is a file of that name in the way?', where=path)
  end subroutine prepare_folder

  logical function file_exists(path)
    character(*), intent(in) :: path

    inquire (file=path, exist=file_exists)
  end function file_exists

  !> The path that a user means: without blanks at its ends, and ~ is the home folder.
  function meant_path(text) result(path)
    character(*), intent(in) :: text
    character(:), allocatable :: path, home
    integer :: length

    path = trim(adjustl(text))
    if (path /= '~' .and. index(path, '~/') /= 1) return
    call get_environment_variable('HOME', length=length)
    if (length == 0) return
    allocate (character(length) :: home)
    call get_environment_variable('HOME', home)
    path = home//path(2:)
  end function meant_path

end module pd_files
