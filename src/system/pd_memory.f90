!> Arrays that begin at a line of the cache.
!>
!> Vector instructions on 64 bytes that lie in two lines take up to twice as long, and what ALLOCATE
!> returns begins anywhere in a line. Fortran cannot ask for more; where the linker can redirect
!> the calls of malloc, realloc and calloc in these sources (`--wrap=malloc`, GNU C library; the
!> Makefile tries it), they come here. Nothing else depends on it: without it the program is the
!> same, only slower. Where there is no memory left the program ends here, with a sentence and the
!> exit status of a model that cannot be set up: not every array in it can be asked for with a look
!> at the answer, temporary ones least of all.
module pd_memory
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_ptr, c_size_t
  implicit none
  private

  public :: aligned_memory, other_memory, empty_memory

  ! `exit_model` of pd_errors: this source stands alone, for the Makefile tries it by itself
  integer(c_int), parameter :: exit_status = 3_c_int
  integer(c_size_t), parameter :: line = 64_c_size_t         !! [bytes]
  integer(c_size_t), parameter :: small = 16_c_size_t        !! what malloc keeps to [bytes]
  integer(c_size_t), parameter :: least = 1024_c_size_t      !! smaller ones: as they come [bytes]
  integer(c_size_t), parameter :: large = 2_c_size_t**20     !! [bytes]
  integer(c_int),    parameter :: mmap_threshold = -3_c_int  !! M_MMAP_THRESHOLD of malloc.h

  interface
    type(c_ptr) function c_aligned_alloc(alignment, bytes) bind(c, name='aligned_alloc')
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: alignment, bytes
    end function c_aligned_alloc
    type(c_ptr) function c_reallocarray(address, count, bytes) bind(c, name='reallocarray')
      import :: c_ptr, c_size_t
      type(c_ptr), value :: address
      integer(c_size_t), value :: count, bytes
    end function c_reallocarray
    type(c_ptr) function c_calloc(count, bytes) bind(c, name='__libc_calloc')
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: count, bytes
    end function c_calloc
    integer(c_size_t) function c_write(descriptor, text, count) bind(c, name='write')
      import :: c_char, c_int, c_size_t
      integer(c_int), value :: descriptor
      character(kind=c_char), intent(in) :: text(*)
      integer(c_size_t), value :: count
    end function c_write
    subroutine c_exit_at_once(status) bind(c, name='_exit')
      import :: c_int
      integer(c_int), value :: status
    end subroutine c_exit_at_once
    integer(c_int) function c_mallopt(parameter_number, value) bind(c, name='mallopt')
      import :: c_int
      integer(c_int), value :: parameter_number, value
    end function c_mallopt
  end interface

contains

  !> What malloc returns, at the start of a line where it is not small; `free` takes it back.
  type(c_ptr) function aligned_memory(bytes) result(address) bind(c, name='__wrap_malloc')
    integer(c_size_t), value :: bytes
    integer(c_int) :: done

    if (bytes < least) then
      ! malloc by another name; strict libraries want a multiple of the alignment
      address = c_aligned_alloc(small, small * ((max(bytes, 1_c_size_t) + small - 1) / small))
      if (.not. c_associated(address)) call end_without_memory(bytes)
      return
    end if
    ! Large pieces have pages of their own. In the heap an aligned one does not fit into the hole
    ! that another of its size has left: a million points would need a sixth more memory.
    if (bytes >= large) done = c_mallopt(mmap_threshold, int(large, c_int))
    address = c_aligned_alloc(line, line * ((bytes + line - 1) / line))
    if (.not. c_associated(address)) call end_without_memory(bytes)
  end function aligned_memory

  !> What realloc returns.
  type(c_ptr) function other_memory(before, bytes) result(address) bind(c, name='__wrap_realloc')
    type(c_ptr), value :: before
    integer(c_size_t), value :: bytes

    address = c_reallocarray(before, 1_c_size_t, bytes)   ! realloc by another name
    if (bytes > 0 .and. .not. c_associated(address)) call end_without_memory(bytes)
  end function other_memory

  !> What calloc returns.
  type(c_ptr) function empty_memory(count, bytes) result(address) bind(c, name='__wrap_calloc')
    integer(c_size_t), value :: count, bytes

    address = c_calloc(count, bytes)
    if (count > 0 .and. bytes > 0 .and. .not. c_associated(address)) &
      call end_without_memory(count * bytes)
  end function empty_memory

  !> Say how much was asked for, and end at once. Nothing here asks for memory, and nothing of the
  !> run-time library is called: it may be in the middle of something.
  subroutine end_without_memory(bytes)
    integer(c_size_t), intent(in) :: bytes
    character(*), parameter :: before = 'perigeo: error: the memory is used up: '
    character(*), parameter :: after = ' MB more were asked for; --check says what a run '// &
      'needs, and a larger spacing needs less'//achar(10)
    integer(c_size_t), parameter :: megabyte = 1000000_c_size_t
    integer(c_size_t) :: left, ignored
    character(20) :: digits
    integer :: k

    left = bytes / megabyte + 1_c_size_t
    do k = 20, 1, -1
      digits(k:k) = achar(iachar('0') + int(modulo(left, 10_c_size_t)))
      left = left / 10_c_size_t
      if (left == 0) exit
    end do
    ignored = c_write(2_c_int, before, len(before, c_size_t))
    ignored = c_write(2_c_int, digits(k:), int(21 - k, c_size_t))
    ignored = c_write(2_c_int, after, len(after, c_size_t))
    call c_exit_at_once(exit_status)
  end subroutine end_without_memory

end module pd_memory
