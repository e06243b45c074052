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

  public :: forget_rows, clear_rows, clear_marks

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

    integer :: ignored(2)

    if (kept(1) > 1) call forget(c_loc(field), min(size(field), kept(1) - 1), 8, ignored)
    if (kept(2) < size(field)) call forget(c_loc(field(max(1, kept(2) + 1))), &
      size(field) - max(0, kept(2)), 8, ignored)
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

    if (size(numbers) == 0) return
    call forget(c_loc(numbers), size(numbers), 8, whole)
    numbers(:whole(1) - 1) = 0.0_wp
    numbers(whole(2) + 1:) = 0.0_wp
  end subroutine clear

  !> Make no row a marked one: marks take memory where they are set.
  subroutine clear_marks(marks)
    logical, intent(out), contiguous, target :: marks(:)   !! (rows)
    integer :: whole(2)

    whole = [size(marks) + 1, size(marks)]
    if (size(marks) > 0) call forget(c_loc(marks), size(marks), storage_size(marks) / 8, whole)
    if (whole(1) <= size(marks)) then
      ! what a page of zeros says is for the compiler to know
      if (marks(whole(1))) whole = [size(marks) + 1, size(marks)]
    end if
    marks(:whole(1) - 1) = .false.
    marks(whole(2) + 1:) = .false.
  end subroutine clear_marks

  !> Give back the pages that hold nothing but some numbers.
  subroutine forget(address, count, bytes, given_back)
    type(c_ptr), intent(in)  :: address         !! of the first number
    integer,     intent(in)  :: count, bytes    !! numbers, and bytes of each
    integer,     intent(out) :: given_back(2)   !! first and last of these numbers
    integer(c_int), parameter :: dont_need = 4_c_int         ! MADV_DONTNEED of Linux
    integer(c_int), parameter :: no_huge_pages = 15_c_int    ! MADV_NOHUGEPAGE
    integer(c_intptr_t) :: before, start, finish, page, width
    integer(c_int) :: failed
    logical :: linux

    given_back = [count + 1, count]
    page = int(c_getpagesize(), c_intptr_t)
    width = int(bytes, c_intptr_t)
    before = transfer(address, before)
    start = page * ((before + page - 1) / page)
    finish = page * ((before + width * int(count, c_intptr_t)) / page)
    if (finish <= start) return
    inquire (file='/proc/version', exist=linux)
    if (.not. linux) return
    ! a huge page would take 2 MiB where one row is written
    failed = c_madvise(start, int(finish - start, c_size_t), no_huge_pages)
    failed = c_madvise(start, int(finish - start, c_size_t), dont_need)
    if (failed == 0) given_back = int([start - before, finish - before] / width) + [1, 0]
  end subroutine forget

end module pd_pages
