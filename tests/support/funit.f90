!> The part of pFUnit's module `funit` that the suites in tests/unit use.
!>
!> It lets `make test` run the same .pf files where pFUnit is not installed. The asserts take their
!> arguments in pFUnit's order and give pFUnit's verdicts; pf_to_f90.py translates the suites and
!> run_tests.py reads the record that `run_test` writes.
module funit
  use, intrinsic :: iso_fortran_env, only: int32, int64, real64
  implicit none
  private

  public :: assertEqual, assertTrue, assertFalse, assertLessThan, assertLessThanOrEqual
  public :: assertGreaterThan, assertGreaterThanOrEqual
  public :: SourceLocation, anyExceptions, run_test, end_tests

  !> Where an assert stands.
  type :: SourceLocation
    character(80) :: file_name = ''
    integer       :: line_number = 0
  end type SourceLocation

  interface assertEqual
    module procedure :: equal_real_00, equal_real_01, equal_real_11, equal_real_02, equal_real_22
    module procedure :: equal_int_00, equal_int_01, equal_int_11, equal_int_02, equal_int_22
    module procedure :: equal_long_00, equal_long_01, equal_long_11, equal_int_long
    module procedure :: equal_int_real, equal_logical, equal_text_00, equal_text_11
  end interface assertEqual

  interface assertTrue
    module procedure :: true_0, true_1
  end interface assertTrue

  interface assertFalse
    module procedure :: false_0, false_1
  end interface assertFalse

  interface assertLessThan
    module procedure :: less_real, less_int, less_long
  end interface assertLessThan

  interface assertLessThanOrEqual
    module procedure :: less_equal_real, less_equal_int, less_equal_long
  end interface assertLessThanOrEqual

  interface assertGreaterThan
    module procedure :: greater_real, greater_int, greater_long
  end interface assertGreaterThan

  interface assertGreaterThanOrEqual
    module procedure :: greater_equal_real, greater_equal_int, greater_equal_long
  end interface assertGreaterThanOrEqual

  abstract interface
    subroutine test_procedure()
    end subroutine test_procedure
  end interface

  !> Names that pFUnit's `funit` exports: they are taken here too, so that a suite that gives one of
  !> them to something of its own fails to compile with both.
  integer, parameter, public :: array_with_size = 0, all_of = 0, any_of = 0, catch = 0, &
    contains_string = 0, disable = 0, empty_array = 0, ends_with = 0, equal_to = 0, every = 0, &
    every_item = 0, expectation = 0, false = 0, finalize = 0, generic_run = 0, initialize = 0, &
    is = 0, matchable = 0, near = 0, predicate = 0, relatively_near = 0, run = 0, &
    starts_with = 0, stub = 0, subject = 0, test = 0, throw = 0, true = 0

  !> What the running test has found so far, and how many tests have been asked for.
  logical, save :: failed = .false.
  integer, save :: test_number = 0

contains

  !> Run one test and write what came of it to the record, the file named by the first argument of
  !> the command. Tests before the one whose number is the second argument are passed over: so a
  !> suite goes on behind a test that crashed.
  subroutine run_test(name, test_body)
    character(*), intent(in) :: name
    procedure(test_procedure) :: test_body

    test_number = test_number + 1
    if (test_number < first_test()) return
    failed = .false.
    call record('start '//name)
    call test_body()
    if (.not. failed) call record('pass '//name)
  end subroutine run_test

  !> Write to the record that no test is left.
  subroutine end_tests()
    call record('end')
  end subroutine end_tests

  !> Whether the running test has failed; its translation then returns.
  logical function anyExceptions()
    anyExceptions = failed
  end function anyExceptions

  integer function first_test() result(first)
    character(20) :: argument
    integer :: status

    call get_command_argument(2, argument)
    read (argument, *, iostat=status) first
    if (status /= 0) first = 1
  end function first_test

  !> Add a line to the record and close it, so that a crash later on loses nothing.
  subroutine record(line)
    character(*), intent(in) :: line
    character(4096) :: path
    integer :: unit

    call get_command_argument(1, path)
    if (path == '') then
      write (*, '(a)') line
      return
    end if
    open (newunit=unit, file=trim(path), position='append', action='write')
    write (unit, '(a)') line
    close (unit)
  end subroutine record

  !> The running test has failed: only its first failure is recorded.
  subroutine fail(what, message, location)
    character(*), intent(in) :: what
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    character(12) :: number

    if (failed) return
    failed = .true.
    call record('fail')
    if (present(location)) then
      write (number, '(i0)') location%line_number
      call record('at '//trim(location%file_name)//':'//trim(number))
    end if
    if (present(message)) call record('note '//message)
    call record('note '//what)
  end subroutine fail

  ! --- texts for the messages

  function real_text(value) result(text)
    real(real64), intent(in) :: value
    character(:), allocatable :: text
    character(45) :: buffer

    write (buffer, '(g0)') value
    text = trim(adjustl(buffer))
  end function real_text

  function int_text(value) result(text)
    integer(int64), intent(in) :: value
    character(:), allocatable :: text
    character(20) :: buffer

    write (buffer, '(i0)') value
    text = trim(buffer)
  end function int_text

  !> ' at element (2, 3)' for the k-th element, in memory order, of an array of this shape.
  function element_text(k, extents) result(text)
    integer, intent(in) :: k, extents(:)
    character(:), allocatable :: text
    integer :: d, rest

    text = ''
    if (size(extents) == 0) return
    rest = k - 1
    do d = 1, size(extents)
      if (d > 1) text = text//', '
      text = text//int_text(int(modulo(rest, max(extents(d), 1)) + 1, int64))
      rest = rest/max(extents(d), 1)
    end do
    text = ' at element ('//text//')'
  end function element_text

  function shape_text(extents) result(text)
    integer, intent(in) :: extents(:)
    character(:), allocatable :: text
    integer :: d

    text = ''
    do d = 1, size(extents)
      if (d > 1) text = text//', '
      text = text//int_text(int(extents(d), int64))
    end do
    text = '('//text//')'
  end function shape_text

  ! --- equality

  !> Both arrays in memory order; `expected` of size 1 with extents () stands for all elements.
  subroutine check_real(expected, found, extents_e, extents_f, tolerance, message, location)
    real(real64), intent(in) :: expected(:), found(:)
    integer, intent(in) :: extents_e(:), extents_f(:)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    real(real64) :: e, allowed
    integer :: k

    if (.not. conform(extents_e, extents_f, message, location)) return
    allowed = 0.0_real64
    if (present(tolerance)) allowed = tolerance
    do k = 1, size(found)
      e = expected(1)
      if (size(extents_e) > 0) e = expected(k)
      if (found(k) >= e .and. found(k) <= e) cycle
      if (abs(found(k) - e) <= allowed) cycle
      call fail('expected <'//real_text(e)//'> but found <'//real_text(found(k))//'>'// &
        element_text(k, extents_f)//'; difference <'//real_text(found(k) - e)// &
        '>, tolerance <'//real_text(allowed)//'>', message, location)
      return
    end do
  end subroutine check_real

  subroutine check_int(expected, found, extents_e, extents_f, message, location)
    integer(int64), intent(in) :: expected(:), found(:)
    integer, intent(in) :: extents_e(:), extents_f(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer(int64) :: e
    integer :: k

    if (.not. conform(extents_e, extents_f, message, location)) return
    do k = 1, size(found)
      e = expected(1)
      if (size(extents_e) > 0) e = expected(k)
      if (found(k) == e) cycle
      call fail('expected <'//int_text(e)//'> but found <'//int_text(found(k))//'>'// &
        element_text(k, extents_f), message, location)
      return
    end do
  end subroutine check_int

  !> A scalar conforms with everything, an array with one of its own shape.
  logical function conform(extents_e, extents_f, message, location)
    integer, intent(in) :: extents_e(:), extents_f(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    conform = size(extents_e) == 0
    if (.not. conform) conform = all(extents_e == extents_f)
    if (.not. conform) call fail('expected shape <'//shape_text(extents_e)// &
      '> but found shape <'//shape_text(extents_f)//'>', message, location)
  end function conform

  subroutine equal_real_00(expected, found, tolerance, message, location)
    real(real64), intent(in) :: expected, found
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_real([expected], [found], shape(expected), shape(found), tolerance, message, &
      location)
  end subroutine equal_real_00

  subroutine equal_real_01(expected, found, tolerance, message, location)
    real(real64), intent(in) :: expected, found(:)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_real([expected], found, shape(expected), shape(found), tolerance, message, &
      location)
  end subroutine equal_real_01

  subroutine equal_real_11(expected, found, tolerance, message, location)
    real(real64), intent(in) :: expected(:), found(:)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_real(expected, found, shape(expected), shape(found), tolerance, message, &
      location)
  end subroutine equal_real_11

  subroutine equal_real_02(expected, found, tolerance, message, location)
    real(real64), intent(in) :: expected, found(:, :)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_real([expected], reshape(found, [size(found)]), shape(expected), shape(found), &
      tolerance, message, location)
  end subroutine equal_real_02

  subroutine equal_real_22(expected, found, tolerance, message, location)
    real(real64), intent(in) :: expected(:, :), found(:, :)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_real(reshape(expected, [size(expected)]), reshape(found, [size(found)]), &
      shape(expected), shape(found), tolerance, message, location)
  end subroutine equal_real_22

  subroutine equal_int_00(expected, found, message, location)
    integer(int32), intent(in) :: expected, found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(int([expected], int64), int([found], int64), shape(expected), shape(found), &
      message, location)
  end subroutine equal_int_00

  subroutine equal_int_01(expected, found, message, location)
    integer(int32), intent(in) :: expected, found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(int([expected], int64), int(found, int64), shape(expected), shape(found), &
      message, location)
  end subroutine equal_int_01

  subroutine equal_int_11(expected, found, message, location)
    integer(int32), intent(in) :: expected(:), found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(int(expected, int64), int(found, int64), shape(expected), shape(found), &
      message, location)
  end subroutine equal_int_11

  subroutine equal_int_02(expected, found, message, location)
    integer(int32), intent(in) :: expected, found(:, :)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(int([expected], int64), int(reshape(found, [size(found)]), int64), &
      shape(expected), shape(found), message, location)
  end subroutine equal_int_02

  subroutine equal_int_22(expected, found, message, location)
    integer(int32), intent(in) :: expected(:, :), found(:, :)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(int(reshape(expected, [size(expected)]), int64), &
      int(reshape(found, [size(found)]), int64), shape(expected), shape(found), message, &
      location)
  end subroutine equal_int_22

  subroutine equal_long_00(expected, found, message, location)
    integer(int64), intent(in) :: expected, found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int([expected], [found], shape(expected), shape(found), message, location)
  end subroutine equal_long_00

  subroutine equal_long_01(expected, found, message, location)
    integer(int64), intent(in) :: expected, found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int([expected], found, shape(expected), shape(found), message, location)
  end subroutine equal_long_01

  subroutine equal_long_11(expected, found, message, location)
    integer(int64), intent(in) :: expected(:), found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call check_int(expected, found, shape(expected), shape(found), message, location)
  end subroutine equal_long_11

  subroutine equal_int_long(expected, found, message, location)
    integer(int32), intent(in) :: expected
    integer(int64), intent(in) :: found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call equal_long_00(int(expected, int64), found, message, location)
  end subroutine equal_int_long

  subroutine equal_int_real(expected, found, tolerance, message, location)
    integer(int32), intent(in) :: expected
    real(real64), intent(in) :: found
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call equal_real_00(real(expected, real64), found, tolerance, message, location)
  end subroutine equal_int_real

  subroutine equal_logical(expected, found, message, location)
    logical, intent(in) :: expected, found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (expected .neqv. found) then
      call fail('expected <'//trim(merge('true ', 'false', expected))//'> but found <'// &
        trim(merge('true ', 'false', found))//'>', message, location)
    end if
  end subroutine equal_logical

  !> Blanks at both ends do not count, as in pFUnit.
  subroutine equal_text_00(expected, found, message, location)
    character(*), intent(in) :: expected, found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (trim(adjustl(expected)) /= trim(adjustl(found))) then
      call fail('expected <"'//trim(adjustl(expected))//'"> but found <"'// &
        trim(adjustl(found))//'">', message, location)
    end if
  end subroutine equal_text_00

  subroutine equal_text_11(expected, found, message, location)
    character(*), intent(in) :: expected(:), found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer :: k

    if (.not. conform(shape(expected), shape(found), message, location)) return
    do k = 1, size(found)
      call equal_text_00(expected(k), found(k), message, location)
    end do
  end subroutine equal_text_11

  ! --- truth

  subroutine true_0(condition, message, location)
    logical, intent(in) :: condition
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. condition) call fail('expected <true> but found <false>', message, location)
  end subroutine true_0

  subroutine true_1(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call true_0(all(conditions), message, location)
  end subroutine true_1

  subroutine false_0(condition, message, location)
    logical, intent(in) :: condition
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (condition) call fail('expected <false> but found <true>', message, location)
  end subroutine false_0

  subroutine false_1(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call false_0(any(conditions), message, location)
  end subroutine false_1

  ! --- order

  subroutine less_real(left, right, message, location)
    real(real64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left < right) call fail('expected <'//real_text(left)//'> less than <'// &
      real_text(right)//'>', message, location)
  end subroutine less_real

  subroutine less_int(left, right, message, location)
    integer(int32), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left < right) call fail('expected <'//int_text(int(left, int64))//'> less than <'// &
      int_text(int(right, int64))//'>', message, location)
  end subroutine less_int

  subroutine less_long(left, right, message, location)
    integer(int64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left < right) call fail('expected <'//int_text(left)//'> less than <'// &
      int_text(right)//'>', message, location)
  end subroutine less_long

  subroutine less_equal_real(left, right, message, location)
    real(real64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left <= right) call fail('expected <'//real_text(left)//'> at most <'// &
      real_text(right)//'>', message, location)
  end subroutine less_equal_real

  subroutine less_equal_int(left, right, message, location)
    integer(int32), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left <= right) call fail('expected <'//int_text(int(left, int64))//'> at most <'// &
      int_text(int(right, int64))//'>', message, location)
  end subroutine less_equal_int

  subroutine less_equal_long(left, right, message, location)
    integer(int64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left <= right) call fail('expected <'//int_text(left)//'> at most <'// &
      int_text(right)//'>', message, location)
  end subroutine less_equal_long

  subroutine greater_real(left, right, message, location)
    real(real64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left > right) call fail('expected <'//real_text(left)//'> greater than <'// &
      real_text(right)//'>', message, location)
  end subroutine greater_real

  subroutine greater_int(left, right, message, location)
    integer(int32), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left > right) call fail('expected <'//int_text(int(left, int64))// &
      '> greater than <'//int_text(int(right, int64))//'>', message, location)
  end subroutine greater_int

  subroutine greater_long(left, right, message, location)
    integer(int64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left > right) call fail('expected <'//int_text(left)//'> greater than <'// &
      int_text(right)//'>', message, location)
  end subroutine greater_long

  subroutine greater_equal_real(left, right, message, location)
    real(real64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left >= right) call fail('expected <'//real_text(left)//'> at least <'// &
      real_text(right)//'>', message, location)
  end subroutine greater_equal_real

  subroutine greater_equal_int(left, right, message, location)
    integer(int32), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left >= right) call fail('expected <'//int_text(int(left, int64))//'> at least <'// &
      int_text(int(right, int64))//'>', message, location)
  end subroutine greater_equal_int

  subroutine greater_equal_long(left, right, message, location)
    integer(int64), intent(in) :: left, right
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. left >= right) call fail('expected <'//int_text(left)//'> at least <'// &
      int_text(right)//'>', message, location)
  end subroutine greater_equal_long

end module funit
