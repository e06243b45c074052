!> Arrays that begin at a line of the cache.
!>
!> Vector instructions on 64 bytes that lie in two lines take up to twice as long, and what ALLOCATE
!> returns begins anywhere in a line. Fortran cannot ask for more; where the linker can redirect
!> the calls of malloc in these sources (`--wrap=malloc`, GNU C library; the Makefile
!> tries it), they come here. Nothing else depends on it: without it the program is the same, only
!> slower.
module pd_memory
  use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_size_t
  implicit none
  private

  public :: aligned_memory

  integer(c_size_t), parameter :: line = 64_c_size_t         !! [bytes]
  integer(c_size_t), parameter :: least = 1024_c_size_t      !! smaller ones: as they come [bytes]
  integer(c_size_t), parameter :: large = 2_c_size_t**20     !! [bytes]
  integer(c_int),    parameter :: mmap_threshold = -3_c_int  !! M_MMAP_THRESHOLD of malloc.h

  interface
    type(c_ptr) function c_aligned_alloc(alignment, bytes) bind(c, name='aligned_alloc')
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: alignment, bytes
    end function c_aligned_alloc
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
      address = c_aligned_alloc(16_c_size_t, max(bytes, 1_c_size_t))   ! malloc by another name
      return
    end if
    ! Large pieces have pages of their own. In the heap an aligned one does not fit into the hole
    ! that another of its size has left: a million points would need a sixth more memory.
    if (bytes >= large) done = c_mallopt(mmap_threshold, int(large, c_int))
    address = c_aligned_alloc(line, line * ((bytes + line - 1) / line))
  end function aligned_memory

end module pd_memory
