!> Arrays that begin at a line of the cache.
!>
!> Vector instructions on 64 bytes that lie in two lines take up to twice as long, and what ALLOCATE
!> returns begins anywhere in a line. Fortran has no way to ask for more; where the linker can give
!> the calls of malloc in these sources another target (`--wrap=malloc`, see the Makefile), they
!> come here. Nothing else depends on it: without it the program is the same, only slower.
module pd_memory
  use, intrinsic :: iso_c_binding, only: c_ptr, c_size_t
  implicit none
  private

  public :: aligned_memory

  integer(c_size_t), parameter :: line = 64_c_size_t       !! [bytes]
  integer(c_size_t), parameter :: least = 1024_c_size_t    !! smaller ones are not worth it [bytes]

  interface
    type(c_ptr) function c_aligned_alloc(alignment, bytes) bind(c, name='aligned_alloc')
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: alignment, bytes
    end function c_aligned_alloc
  end interface

contains

  !> What malloc returns, at the start of a line where it is large; `free` takes it back.
  type(c_ptr) function aligned_memory(bytes) result(address) bind(c, name='__wrap_malloc')
    integer(c_size_t), value :: bytes

    if (bytes < least) then
      address = c_aligned_alloc(16_c_size_t, max(bytes, 1_c_size_t))   ! malloc by another name
    else
      address = c_aligned_alloc(line, line * ((bytes + line - 1) / line))
    end if
  end function aligned_memory

end module pd_memory
