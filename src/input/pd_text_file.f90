!> Text files, read whole.
module pd_text_file
  use pd_errors, only: error_list_t
  implicit none
  private

  public :: read_text_file

  integer, parameter :: max_bytes = 1048576   !! of a file

contains

  !> Read a whole file byte for byte; an error where it cannot be read or is too large.
  subroutine read_text_file(path, text, errors)
    character(*),              intent(in)    :: path
    character(:), allocatable, intent(out)   :: text
    type(error_list_t),        intent(inout) :: errors
    character(:), allocatable :: buffer
    character(256) :: reason
    integer :: n, status, unit

    text = ''
    reason = ''
    open (newunit=unit, file=path, access='stream', form='unformatted', action='read', &
          status='old', iostat=status, iomsg=reason)
    if (status /= 0) then
      call errors%add('the input file cannot be read', where=path, found=reason)
      return
    end if
    allocate (character(max_bytes + 1) :: buffer)
    n = 0
    do while (n <= max_bytes)
      read (unit, iostat=status, iomsg=reason) buffer(n + 1:n + 1)
      if (status /= 0) exit
      n = n + 1
    end do
    close (unit)
    if (n > max_bytes) then
      call errors%add('the input file is too large', where=path, allowed='at most 1 MiB')
    else if (.not. is_iostat_end(status)) then
      call errors%add('the input file cannot be read', where=path, found=reason)
    else
      text = buffer(:n)
    end if
  end subroutine read_text_file

end module pd_text_file
