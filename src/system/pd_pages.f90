!> Memory of rows that a rank does not need.
!>
!> Fields have room for the rows of all ranks, so that a row has one number everywhere. Pages of a
!> field that hold none of the rows of this rank are given back to the system; they read as zeros,
!> and the system has memory for them again only if they are written. Linux can do that; elsewhere
!> the memory stays.
module pd_pages
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_loc, c_ptr, c_size_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: forget_rows, clear_rows

  interface forget_rows
    procedure :: forget_numbers
    procedure :: forget_columns
  end interface forget_rows

  interface clear_rows
    procedure :: clear_numbers
    procedure :: clear_columns
  end interface clear_rows

  interface
    integer(c_int) function c_madvise(address, length, advice) bind(c, name='madvise')
      import :: c_int, c_intptr_t, c_size_t
      integer(c_intptr_t), value :: address
      integer(c_size_t),   value :: length
      integer(c_int),      value :: advice
    end function c_madvise
    integer(c_int) function c_getpagesize() bind(c, name='getpagesize')
      import :: c_int
    end function c_getpagesize
  end interface

contains

  !> Forget what a field has outside of some rows: it is zero there, or what it was.
  subroutine forget_numbers(field, kept)
    real(wp), intent(inout), contiguous, target :: field(:)   !! (rows)
    integer,  intent(in) :: kept(2)                           !! first and last row

    if (kept(1) > 1) call forget(field(:kept(1) - 1))
    if (kept(2) < size(field)) call forget(field(max(1, kept(2) + 1):))
  end subroutine forget_numbers

  !> The same of a field with components.
  subroutine forget_columns(field, kept)
    real(wp), intent(inout), contiguous, target :: field(:, :)   !! (rows,components)
    integer,  intent(in) :: kept(2)
    integer :: c

    do c = 1, size(field, 2)
      call forget_numbers(field(:, c), kept)
    end do
  end subroutine forget_columns

  !> Make a new field zero: it takes memory for some rows only.
  subroutine clear_numbers(field, kept)
    real(wp), intent(out), contiguous, target :: field(:)   !! (rows)
    integer,  intent(in) :: kept(2)                         !! first and last row

    if (kept(1) > 1) call clear(field(:min(size(field), kept(1) - 1)))
    field(max(1, kept(1)):min(size(field), kept(2))) = 0.0_wp
    if (kept(2) < size(field)) call clear(field(max(1, kept(1), kept(2) + 1):))
  end subroutine clear_numbers

  !> The same of a field with components.
  subroutine clear_columns(field, kept)
    real(wp), intent(out), contiguous, target :: field(:, :)   !! (rows,components)
    integer,  intent(in) :: kept(2)
    integer :: c

    do c = 1, size(field, 2)
      call clear_numbers(field(:, c), kept)
    end do
  end subroutine clear_columns

  !> Make numbers zero, those that fill pages by giving these back.
  subroutine clear(numbers)
    real(wp), intent(inout), contiguous, target :: numbers(:)
    integer :: whole(2)

    call forget(numbers, whole)
    numbers(:whole(1) - 1) = 0.0_wp
    numbers(whole(2) + 1:) = 0.0_wp
  end subroutine clear

  !> Give back the pages that hold nothing but these numbers.
  subroutine forget(numbers, given_back)
    real(wp), intent(in), contiguous, target :: numbers(:)
    integer,  intent(out), optional :: given_back(2)   !! first and last of these numbers
    integer(c_int), parameter :: dont_need = 4_c_int         ! MADV_DONTNEED of Linux
    integer(c_int), parameter :: no_huge_pages = 15_c_int    ! MADV_NOHUGEPAGE
    integer(c_intptr_t) :: start, finish, page
    type(c_ptr)    :: address
    integer(c_int) :: failed
    integer(c_intptr_t) :: before
    logical :: linux

    if (present(given_back)) given_back = [size(numbers) + 1, size(numbers)]
    if (size(numbers) == 0) return
    page = int(c_getpagesize(), c_intptr_t)
    address = c_loc(numbers)
    start = transfer(address, start)
    finish = start + 8_c_intptr_t * size(numbers, kind=c_intptr_t)
    before = start
    start = page * ((start + page - 1) / page)
    finish = page * (finish / page)
    if (finish <= start) return
    inquire (file='/proc/version', exist=linux)
    if (.not. linux) return
    ! a huge page would take 2 MiB where one row is written
    failed = c_madvise(start, int(finish - start, c_size_t), no_huge_pages)
    failed = c_madvise(start, int(finish - start, c_size_t), dont_need)
    if (present(given_back) .and. failed == 0) &
      given_back = int([start - before, finish - before] / 8_c_intptr_t) + [1, 0]
  end subroutine forget

end module pd_pages
