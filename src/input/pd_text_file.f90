!> Text files, read whole.
module pd_text_file
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_errors, only: error_list_t
  implicit none
  private

  public :: read_text_file, read_bytes

contains

  !> Read a whole input file byte for byte; an error where it cannot be read or is too large.
  subroutine read_text_file(path, text, errors)
    character(*),              intent(in)    :: path
    character(:), allocatable, intent(out)   :: text
    type(error_list_t),        intent(inout) :: errors
    integer, parameter :: max_bytes = 1048576   ! of a file

    call read_bytes(path, 'the input file', max_bytes, text, errors)
    if (len(text) <= max_bytes) return
    call errors%add('the input file is too large', where=path, allowed='at most 1 MiB')
    text = ''
  end subroutine read_text_file

  !> Read a file byte for byte, a regular one, a pipe or a device; of more than `enough` bytes
  !> some more than that.
  !>
  !> Errors: it cannot be read; `name` says what it is.
  subroutine read_bytes(path, name, enough, text, errors)
    character(*),              intent(in)    :: path, name
    integer,                   intent(in)    :: enough
    character(:), allocatable, intent(out)   :: text
    type(error_list_t),        intent(inout) :: errors
    integer, parameter :: piece = 1048576
    character(:), allocatable :: longer
    character(256) :: reason
    integer :: n, status, unit
    integer(int64) :: size_of_file

    text = ''
    reason = ''
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
          status='old', iostat=status, iomsg=reason)
    if (status /= 0) then
      call errors%add(name//' cannot be read', where=path, found=reason)
      return
    end if
    inquire (unit=unit, size=size_of_file)
    n = int(max(0_int64, min(size_of_file, int(enough, int64))))
    deallocate (text)
    allocate (character(n) :: text)
    read (unit, iostat=status, iomsg=reason) text
    do while (status == 0 .and. n <= enough)   ! a pipe has no size, and a file may grow
      if (n == len(text)) then
        allocate (character(len(text) + piece) :: longer)
        longer(:n) = text
        call move_alloc(longer, text)
      end if
      read (unit, iostat=status, iomsg=reason) text(n + 1:n + 1)
      if (status == 0) n = n + 1
    end do
    close (unit)
    if (status /= 0 .and. .not. is_iostat_end(status)) &
      call errors%add(name//' cannot be read', where=path, found=reason)
    text = text(:n)
  end subroutine read_bytes

end module pd_text_file
