!> How much memory a run may have.
module pd_room
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_long, c_ptr, c_size_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: has_room, machine_memory, stack_limit

  interface
    type(c_ptr) function c_aligned_alloc(alignment, bytes) bind(c, name='aligned_alloc')
      import :: c_ptr, c_size_t
      integer(c_size_t), value :: alignment, bytes
    end function c_aligned_alloc
    subroutine c_free(address) bind(c, name='free')
      import :: c_ptr
      type(c_ptr), value :: address
    end subroutine c_free
    integer(c_int) function c_getrlimit(resource, limits) bind(c, name='getrlimit')
      import :: c_int, c_long
      integer(c_int), value :: resource
      integer(c_long), intent(out) :: limits(2)   !! of now, and the highest that may be asked for
    end function c_getrlimit
  end interface

contains

  !> Whether so much memory can be had now: the machine has it, and no limit of the user (ulimit)
  !> stands against it. It is tried, and given back.
  logical function has_room(bytes) result(has)
    real(wp), intent(in) :: bytes
    integer(c_size_t), parameter :: page = 4096_c_size_t
    real(wp), parameter :: beyond_count = 1.0e18_wp
    real(wp), parameter :: of_libraries = 3.0e7_wp   !! what they take at times, [bytes]
    type(c_ptr) :: piece

    has = bytes <= machine_memory() .and. bytes < beyond_count
    if (.not. has) return
    piece = c_aligned_alloc(page, page * (int(bytes + of_libraries, c_size_t) / page &
      + 1_c_size_t))
    has = c_associated(piece)
    if (has) call c_free(piece)
  end function has_room

  !> Memory and swap space of this machine, or of the container that the program runs in [bytes];
  !> huge where the system does not say it.
  real(wp) function machine_memory() result(bytes)
    bytes = kilobytes_of('MemTotal:') + kilobytes_of('SwapTotal:')
    if (.not. bytes > 0.0_wp) bytes = huge(1.0_wp)
    bytes = min(bytes, number_in('/sys/fs/cgroup/memory.max'), &
      number_in('/sys/fs/cgroup/memory/memory.limit_in_bytes'))
  end function machine_memory

  !> How large the stack may become (ulimit -s) [bytes]; huge where nothing limits it.
  real(wp) function stack_limit() result(bytes)
    integer(c_int), parameter :: of_the_stack = 3_c_int   ! RLIMIT_STACK of Linux, macOS and BSD
    integer(c_long) :: limits(2)

    bytes = huge(1.0_wp)
    if (c_getrlimit(of_the_stack, limits) /= 0) return
    if (limits(1) >= 0) bytes = real(limits(1), wp)   ! beyond all integers: without a limit
  end function stack_limit

  !> An entry of /proc/meminfo [bytes]; 0 where there is none.
  real(wp) function kilobytes_of(name) result(bytes)
    character(*), intent(in) :: name
    character(128) :: line
    integer :: unit, status

    bytes = 0.0_wp
    open (newunit=unit, file='/proc/meminfo', status='old', action='read', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (index(line, name) /= 1) cycle
      read (line(len(name) + 1:), *, iostat=status) bytes
      if (status /= 0) bytes = 0.0_wp
      bytes = 1024.0_wp * bytes
      exit
    end do
    close (unit)
  end function kilobytes_of

  !> The number that a file holds; huge where there is none.
  real(wp) function number_in(path) result(value)
    character(*), intent(in) :: path
    character(64) :: text
    real(wp) :: found
    integer  :: unit, status

    value = huge(1.0_wp)
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) return
    read (unit, '(a)', iostat=status) text
    if (status == 0 .and. text /= 'max') read (text, *, iostat=status) found
    if (status == 0 .and. text /= 'max') value = found
    close (unit)
  end function number_in

end module pd_room
