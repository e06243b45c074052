!> Files of the C library, as far as `pd_files` and `pd_lock` need them.
module pd_c_files
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_ptr, c_size_t
  implicit none
  private

  public :: c_fopen, c_fwrite, c_fflush, c_fclose, c_fileno, c_fsync, c_pwrite, c_truncate
  public :: c_ftruncate, c_flock

  interface
    type(c_ptr) function c_fopen(path, mode) bind(c, name='fopen')
      import :: c_char, c_ptr
      character(kind=c_char), intent(in) :: path(*), mode(*)
    end function c_fopen
    integer(c_size_t) function c_fwrite(text, item, count, stream) bind(c, name='fwrite')
      import :: c_char, c_ptr, c_size_t
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value :: item, count
      type(c_ptr), value :: stream
    end function c_fwrite
    integer(c_int) function c_fflush(stream) bind(c, name='fflush')
      import :: c_int, c_ptr
      type(c_ptr), value :: stream
    end function c_fflush
    integer(c_int) function c_fclose(stream) bind(c, name='fclose')
      import :: c_int, c_ptr
      type(c_ptr), value :: stream
    end function c_fclose
    integer(c_int) function c_fileno(stream) bind(c, name='fileno')
      import :: c_int, c_ptr
      type(c_ptr), value :: stream
    end function c_fileno
    integer(c_int) function c_fsync(descriptor) bind(c, name='fsync')
      import :: c_int
      integer(c_int), value :: descriptor
    end function c_fsync
    integer(c_size_t) function c_pwrite(descriptor, text, count, offset) bind(c, name='pwrite')
      import :: c_char, c_int, c_long, c_size_t
      integer(c_int), value :: descriptor
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value :: count
      integer(c_long), value :: offset
    end function c_pwrite
    integer(c_int) function c_truncate(path, length) bind(c, name='truncate')
      import :: c_char, c_int, c_long
      character(kind=c_char), intent(in) :: path(*)
      integer(c_long), value :: length
    end function c_truncate
    integer(c_int) function c_ftruncate(descriptor, length) bind(c, name='ftruncate')
      import :: c_int, c_long
      integer(c_int), value :: descriptor
      integer(c_long), value :: length
    end function c_ftruncate
    integer(c_int) function c_flock(descriptor, operation) bind(c, name='flock')
      import :: c_int
      integer(c_int), value :: descriptor, operation
    end function c_flock
  end interface

end module pd_c_files
