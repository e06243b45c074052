!> The seal of a checkpoint: the checksum of all bytes, in the first 512 bytes of the file, which
!> HDF5 leaves to the user.
module pd_checkpoint_seal
  use, intrinsic :: iso_fortran_env, only: int8, int32
  use pd_kinds, only: i8
  implicit none
  private

  public :: found_head, head, head_length, is_whole, schema

  integer, parameter :: head_length = 512   !! [bytes]
  character(*), parameter :: schema = 'perigeo checkpoint'

contains

  !> Whether a file begins with the head that belongs to the rest of it.
  logical function is_whole(path)
    character(*), intent(in) :: path
    character(head_length) :: found

    found = found_head(path)
    is_whole = found /= ''
    if (is_whole) is_whole = found == head(path)
  end function is_whole

  !> The first bytes of a file, '' where it cannot be read or is shorter.
  function found_head(path) result(found)
    character(*), intent(in) :: path
    character(head_length) :: found
    integer :: unit, status

    found = ''
    open (newunit=unit, file=path, status='old', action='read', access='stream', iostat=status)
    if (status /= 0) return
    read (unit, iostat=status) found
    close (unit)
    if (status /= 0) found = ''
  end function found_head

  !> What the first bytes of a checkpoint should be, by the bytes that follow.
  function head(path)
    character(*), intent(in) :: path
    character(head_length) :: head
    integer(i8) :: size_found, total

    call sum_bytes(path, size_found, total)
    write (head, '(a, i20, z20.16)') schema, size_found, total
    head(head_length:) = new_line('a')
  end function head

  !> Fletcher's sum of the 32-bit words behind the head; size -1 where the file cannot be read.
  subroutine sum_bytes(path, size_found, total)
    character(*), intent(in)  :: path
    integer(i8),  intent(out) :: size_found, total
    integer, parameter :: block_length = 65536
    integer(i8), parameter :: modulus = 2_i8**31 - 1, low_bits = 2_i8**32 - 1
    integer(int32), allocatable :: words(:)
    integer(int8) :: rest(4)
    integer(i8)   :: left, simple, weighted
    integer :: unit, status, n, i

    size_found = -1
    total = 0
    open (newunit=unit, file=path, status='old', action='read', access='stream', iostat=status)
    if (status /= 0) return
    inquire (unit, size=size_found)
    left = size_found - head_length
    simple = 1
    weighted = 0
    allocate (words(block_length))
    do while (left > 0 .and. status == 0)
      n = int(min(left / 4, int(block_length, i8)))
      if (n > 0) then
        read (unit, pos=size_found - left + 1, iostat=status) words(:n)
      else
        n = 1
        rest = 0_int8
        read (unit, pos=size_found - left + 1, iostat=status) rest(:left)
        words(1) = transfer(rest, words(1))
      end if
      do i = 1, n
        simple = modulo(simple + iand(int(words(i), i8), low_bits), modulus)
        weighted = modulo(weighted + simple, modulus)
      end do
      left = left - 4_i8 * n
    end do
    close (unit)
    total = ior(ishft(weighted, 32), simple)
    if (status /= 0) size_found = -1
  end subroutine sum_bytes

end module pd_checkpoint_seal
