!> A lock that a run holds on its results, so that no second one writes there.
!>
!> The lock is the operating system's, on an open file: it goes with the process, however that ends,
!> so a file that is left behind is no lock. What the file says is for the one who is refused.
!> Two runs on two machines see each other's locks where the file system passes them on (NFS does).
module pd_lock
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_long, c_null_char, c_null_ptr, &
    c_ptr, c_size_t
  use pd_c_files, only: c_fclose, c_fflush, c_fileno, c_flock, c_fopen, c_ftruncate, c_fwrite
  use pd_errors, only: error_list_t
  use pd_system, only: host_name, process_number, remove_file, wait_a_while
  use pd_text, only: integer_text
  implicit none
  private

  public :: lock_t, take_lock, release_lock, lock_holder

  type :: lock_t
    private
    type(c_ptr) :: stream = c_null_ptr
    character(:), allocatable :: path, words
  end type lock_t

  character(*), parameter :: mark = 'process '
  integer(c_int), parameter :: exclusive = 2, at_once = 4, unlock = 8   ! of sys/file.h

contains

  !> Take the lock. Where the disk knows no locks nothing is protected, and nothing is refused.
  !>
  !> Errors: another process holds it; the file cannot be written.
  subroutine take_lock(lock, path, errors)
    type(lock_t),       intent(inout) :: lock
    character(*),       intent(in)    :: path
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: tries = 100, pause = 10   ! [ms]
    integer(c_int) :: ignored
    integer :: k
    character(:), allocatable :: line

    lock%path = path
    lock%words = mark//integer_text(process_number())//' on '//host_name()
    do k = 1, tries
      lock%stream = c_fopen(path//c_null_char, 'ab'//c_null_char)
      if (.not. c_associated(lock%stream)) then
        call errors%add('cannot be opened for writing: is writing permitted?', where=path)
        return
      end if
      if (is_held(lock%stream)) then
        ignored = c_fclose(lock%stream)
        lock%stream = c_null_ptr
        call errors%add(refusal(path), where=path)
        return
      end if
      line = first_line(path)
      if (line /= '' .and. index(line, mark) /= 1) then
        call errors%add('is the name of a lock, but the file is none: it is left alone', where=path)
        exit
      end if
      if (.not. wrote_words(lock)) return   ! a full disk: it is a lock, without words
      ! the run before may have removed the file after it was opened here: then it is no one's
      if (first_line(path) == lock%words) return
      ignored = c_fclose(lock%stream)
      call wait_a_while(pause)
    end do
    if (k > tries) call errors%add('is removed again and again: the lock cannot be taken', &
      where=path)
    lock%stream = c_null_ptr
  end subroutine take_lock

  !> Give the lock back, and remove its file. Harmless where it was not taken.
  subroutine release_lock(lock)
    type(lock_t), intent(inout) :: lock
    integer(c_int) :: ignored
    logical :: done

    if (.not. c_associated(lock%stream)) return
    if (first_line(lock%path) == lock%words) done = remove_file(lock%path)
    ignored = c_fclose(lock%stream)
    lock%stream = c_null_ptr
  end subroutine release_lock

  !> Why a run is refused whose results a living one holds; '' where no one does.
  function lock_holder(path) result(text)
    character(*), intent(in) :: path
    character(:), allocatable :: text
    type(c_ptr)    :: stream
    integer(c_int) :: ignored
    logical :: there

    text = ''
    inquire (file=path, exist=there)
    if (.not. there) return
    stream = c_fopen(path//c_null_char, 'ab'//c_null_char)
    if (.not. c_associated(stream)) return
    if (is_held(stream)) text = refusal(path)
    ignored = c_fclose(stream)
  end function lock_holder

  !> Whether another process holds a lock on an open file; if not, this one does from now on, where
  !> the disk knows locks.
  logical function is_held(stream)
    type(c_ptr), intent(in) :: stream

    is_held = c_flock(c_fileno(stream), exclusive + at_once) /= 0
    ! without locks giving back fails as well
    if (is_held) is_held = c_flock(c_fileno(stream), unlock) == 0
  end function is_held

  !> Write who holds the lock into its file, in place of what it says.
  logical function wrote_words(lock) result(done)
    type(lock_t), intent(in) :: lock
    integer(c_size_t) :: length

    length = len(lock%words, c_size_t) + 1_c_size_t
    done = c_ftruncate(c_fileno(lock%stream), 0_c_long) == 0
    done = c_fwrite(lock%words//new_line('a'), 1_c_size_t, length, lock%stream) == length &
      .and. done
    done = c_fflush(lock%stream) == 0 .and. done
  end function wrote_words

  !> First line of a file, '' where it cannot be read.
  function first_line(path) result(line)
    character(*), intent(in) :: path
    character(:), allocatable :: line
    character(512) :: text
    integer :: unit, status

    line = ''
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) return
    read (unit, '(a)', iostat=status) text
    if (status == 0) line = trim(text)
    close (unit)
  end function first_line

  function refusal(path) result(text)
    character(*), intent(in) :: path
    character(:), allocatable :: text

    text = 'another run writes these results ('//first_line(path)//'): wait for its end or '// &
      'stop it; --output DIR writes elsewhere'
  end function refusal

end module pd_lock
