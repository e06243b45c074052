!> What Fortran 2008 cannot ask of the operating system, through the C library.
!>
!> The one module variable of the program lives here: a signal handler can reach nothing else.
module pd_system
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funloc, c_funptr, &
    c_int, c_intptr_t, c_long, c_null_char, c_null_ptr, c_ptr, c_size_t
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none
  private

  public :: exit_program, rename_file, remove_file, make_directories, is_terminal, host_name
  public :: same_file, process_number, wait_a_while
  public :: set_environment, catch_signals, pending_signal, signal_name, sigint

  integer, parameter :: sighup = 1, sigint = 2, sigpipe = 13, sigterm = 15, sigxcpu = 24, &
    sigxfsz = 25
  !> Numbers that SIGUSR1 and SIGUSR2 have on some system; on others they mean something else.
  integer, parameter :: of_the_user(4) = [10, 12, 30, 31]

  !> The last signal that arrived, 0: none.
  integer(c_int), volatile, save :: last_signal = 0

  interface
    subroutine c_exit(status) bind(c, name='exit')
      import :: c_int
      integer(c_int), value :: status
    end subroutine c_exit
    integer(c_int) function c_rename(old, new) bind(c, name='rename')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: old(*), new(*)
    end function c_rename
    integer(c_int) function c_remove(path) bind(c, name='remove')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
    end function c_remove
    integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir
    integer(c_int) function c_access(path, mode) bind(c, name='access')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_access
    integer(c_int) function c_isatty(descriptor) bind(c, name='isatty')
      import :: c_int
      integer(c_int), value :: descriptor
    end function c_isatty
    integer(c_int) function c_gethostname(name, length) bind(c, name='gethostname')
      import :: c_char, c_int, c_size_t
      character(kind=c_char), intent(out) :: name(*)
      integer(c_size_t), value :: length
    end function c_gethostname
    integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
      import :: c_char, c_int
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrite
    end function c_setenv
    type(c_ptr) function c_strsignal(number) bind(c, name='strsignal')
      import :: c_int, c_ptr
      integer(c_int), value :: number
    end function c_strsignal
    type(c_ptr) function c_realpath(path, room) bind(c, name='realpath')
      import :: c_char, c_ptr
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), value :: room
    end function c_realpath
    integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      type(c_ptr), value :: text
    end function c_strlen
    subroutine c_free(address) bind(c, name='free')
      import :: c_ptr
      type(c_ptr), value :: address
    end subroutine c_free
    integer(c_int) function c_getpid() bind(c, name='getpid')
      import :: c_int
    end function c_getpid
    integer(c_int) function c_poll(descriptors, count, milliseconds) bind(c, name='poll')
      import :: c_int, c_long, c_ptr
      type(c_ptr), value :: descriptors
      integer(c_long), value :: count
      integer(c_int), value :: milliseconds
    end function c_poll
    type(c_funptr) function c_signal(number, handler) bind(c, name='signal')
      import :: c_funptr, c_int
      integer(c_int), value :: number
      type(c_funptr), value :: handler
    end function c_signal
  end interface

contains

  !> Leave with an exit status between 0 and 255, without the noise of STOP.
  subroutine exit_program(status)
    integer, intent(in) :: status

    flush (output_unit)
    flush (error_unit)
    call c_exit(int(status, c_int))
  end subroutine exit_program

  !> Rename `old` to `new`, replacing that, in one step (POSIX rename is atomic).
  logical function rename_file(old, new) result(done)
    character(*), intent(in) :: old, new

    done = c_rename(c_string(old), c_string(new)) == 0
  end function rename_file

  !> Remove a file; .false. where there was none or it could not be removed.
  logical function remove_file(path) result(done)
    character(*), intent(in) :: path

    done = c_remove(c_string(path)) == 0
  end function remove_file

  !> Create a folder and the folders above it; .false. where that is not possible or the folder
  !> cannot be written to.
  logical function make_directories(path) result(done)
    character(*), intent(in) :: path
    integer, parameter :: mode = 511, write_and_search = 3   ! 0777 less the umask; W_OK + X_OK
    integer        :: i
    integer(c_int) :: ignored

    do i = 2, len_trim(path)
      if (path(i:i) == '/') ignored = c_mkdir(c_string(path(:i - 1)), int(mode, c_int))
    end do
    ignored = c_mkdir(c_string(trim(path)), int(mode, c_int))
    done = c_access(c_string(trim(path)//'/.'), int(write_and_search, c_int)) == 0
  end function make_directories

  !> Whether standard output is a terminal.
  logical function is_terminal()
    is_terminal = c_isatty(1_c_int) == 1
  end function is_terminal

  !> Name of this machine, 'unknown' where it has none.
  function host_name() result(name)
    character(:), allocatable :: name
    character(kind=c_char) :: buffer(256)
    integer :: i

    name = ''
    buffer = c_null_char
    if (c_gethostname(buffer, 255_c_size_t) == 0) then
      do i = 1, 255
        if (buffer(i) == c_null_char) exit
        name = name//buffer(i)
      end do
    end if
    if (len(name) == 0) name = 'unknown'
  end function host_name

  !> Set an environment variable of this process unless the user has set it.
  subroutine set_environment(name, value)
    character(*), intent(in) :: name, value
    integer(c_int) :: ignored

    ignored = c_setenv(c_string(name), c_string(value), 0_c_int)
  end subroutine set_environment

  !> Whether two names are those of one file, through links and folders too.
  logical function same_file(one, other) result(same)
    character(*), intent(in) :: one, other
    character(:), allocatable :: place

    place = real_path(one)
    same = .false.
    if (place /= '') same = place == real_path(other)
  end function same_file

  !> The one full name of a file, '' where there is none.
  function real_path(path) result(text)
    character(*), intent(in) :: path
    character(:), allocatable :: text
    type(c_ptr) :: found

    text = ''
    found = c_realpath(c_string(path), c_null_ptr)
    if (.not. c_associated(found)) return
    text = fortran_text(found)
    call c_free(found)
  end function real_path

  !> Number of this process.
  integer function process_number()
    process_number = int(c_getpid())
  end function process_number

  !> Do nothing for a while.
  subroutine wait_a_while(milliseconds)
    integer, intent(in) :: milliseconds
    integer(c_int) :: ignored

    ignored = c_poll(c_null_ptr, 0_c_long, int(milliseconds, c_int))
  end subroutine wait_a_while

  !> From now on the signals that ask a run to stop are only noted, for `pending_signal`: SIGINT,
  !> SIGTERM, SIGHUP (the terminal is gone), SIGXCPU, SIGUSR1 and SIGUSR2 (a batch system says that
  !> time is nearly up). A file that exceeds a limit (SIGXFSZ) or a closed pipe behind the screen
  !> (SIGPIPE) must not kill a run: the write that fails reports it.
  subroutine catch_signals()
    type(c_funptr) :: previous, ignore
    character(:), allocatable :: name
    integer :: k

    ignore = transfer(1_c_intptr_t, ignore)   ! SIG_IGN of the C library
    previous = c_signal(int(sigxfsz, c_int), ignore)
    previous = c_signal(int(sigpipe, c_int), ignore)
    call note_from_now_on(sigint)
    call note_from_now_on(sigterm)
    call note_from_now_on(sighup)
    call note_from_now_on(sigxcpu)
    do k = 1, size(of_the_user)
      name = signal_name(of_the_user(k))
      if (index(name, 'User defined signal') == 1) call note_from_now_on(of_the_user(k))
    end do
  end subroutine catch_signals

  !> Note a signal when it comes, unless whoever started the program wants it ignored (nohup).
  subroutine note_from_now_on(number)
    integer, intent(in) :: number
    type(c_funptr) :: previous, ignore

    ignore = transfer(1_c_intptr_t, ignore)
    previous = c_signal(int(number, c_int), ignore)
    if (c_associated(previous, ignore)) return
    previous = c_signal(int(number, c_int), c_funloc(note_signal))
  end subroutine note_from_now_on

  !> What the system calls a signal: 'Hangup', 'User defined signal 1'.
  function signal_name(number) result(name)
    integer, intent(in) :: number
    character(:), allocatable :: name
    type(c_ptr) :: text

    name = 'unknown'
    text = c_strsignal(int(number, c_int))
    if (c_associated(text)) name = fortran_text(text)
  end function signal_name

  !> The signal that arrived since `catch_signals`, 0: none.
  integer function pending_signal()
    pending_signal = int(last_signal)
  end function pending_signal

  subroutine note_signal(number) bind(c)
    integer(c_int), value :: number

    last_signal = number
  end subroutine note_signal

  function fortran_text(address) result(text)
    type(c_ptr), intent(in) :: address   !! of a text of C
    character(:), allocatable :: text
    character(kind=c_char), pointer :: letters(:)
    integer :: i

    call c_f_pointer(address, letters, [c_strlen(address)])
    allocate (character(size(letters)) :: text)
    do i = 1, size(letters)
      text(i:i) = letters(i)
    end do
  end function fortran_text

  pure function c_string(text)
    character(*), intent(in) :: text
    character(kind=c_char) :: c_string(len_trim(text) + 1)
    integer :: i

    do i = 1, len_trim(text)
      c_string(i) = text(i:i)
    end do
    c_string(len_trim(text) + 1) = c_null_char
  end function c_string

end module pd_system
