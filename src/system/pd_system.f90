!> What Fortran 2008 cannot ask of the operating system, through the C library.
!>
!> The one module variable of the program lives here: a signal handler can reach nothing else.
module pd_system
  use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_funptr, c_int, c_intptr_t, &
    c_null_char, c_size_t
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none
  private

  public :: exit_program, rename_file, remove_file, make_directories, is_terminal, host_name
  public :: set_environment, catch_signals, pending_signal, sigint, sigterm

  integer, parameter :: sigint = 2, sigpipe = 13, sigterm = 15, sigxfsz = 25

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

  !> From now on SIGINT, SIGTERM and SIGUSR1 are only noted, for `pending_signal`; mpirun passes on
  !> the last one and leaves the ranks alone with it. A file that exceeds a limit (SIGXFSZ) or a
  !> closed pipe behind the screen (SIGPIPE) must not kill a run: the write that fails reports it.
  subroutine catch_signals()
    type(c_funptr) :: previous, ignore
    logical :: linux

    inquire (file='/proc/version', exist=linux)   ! elsewhere SIGUSR1 has another number
    ignore = transfer(1_c_intptr_t, ignore)   ! SIG_IGN of the C library
    previous = c_signal(int(sigxfsz, c_int), ignore)
    previous = c_signal(int(sigpipe, c_int), ignore)
    previous = c_signal(int(sigint, c_int), c_funloc(note_signal))
    previous = c_signal(int(sigterm, c_int), c_funloc(note_signal))
    previous = c_signal(int(merge(10, 30, linux), c_int), c_funloc(note_signal))
  end subroutine catch_signals

  !> The signal that arrived since `catch_signals`, 0: none.
  integer function pending_signal()
    pending_signal = int(last_signal)
  end function pending_signal

  subroutine note_signal(number) bind(c)
    integer(c_int), value :: number

    last_signal = number
  end subroutine note_signal

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
