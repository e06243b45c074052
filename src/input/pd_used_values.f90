!> The values of a run as lines "group.key = value": for the provenance of results, and to name
!> what differs from the run that a checkpoint belongs to.
module pd_used_values
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: wp
  use pd_text, only: integer_text, number_text, numbers_text, read_number, shortened
  implicit none
  private

  public :: used_values, compare_used

  type :: line_t
    character(:), allocatable :: text
  end type line_t

  !> Collects a line per key. Groups that may stand several times carry their name, or their number
  !> where they have none: boundary(top).velocity, body(1).x_min; a material that stands alone has
  !> no need of it.
  type, extends(key_visitor_t) :: lister_t
    type(line_t), allocatable :: lines(:)
    integer :: n = 0
    type(group_key_t) :: here
    character(:), allocatable :: stem
  contains
    procedure :: group => list_group
    procedure :: text => list_text
    procedure :: number => list_number
    procedure :: whole => list_whole
    procedure :: numbers => list_numbers
    procedure :: list => list_list
    procedure, private :: add
  end type lister_t

  character(*), parameter :: equals = ' = '

contains

  !> All values as used, defaults included, in the order of the reference; numbers with as many
  !> digits as read back to the same bits, 'none' where there is no value.
  function used_values(input) result(values)
    type(input_t), intent(in) :: input
    character(:), allocatable :: values(:)
    type(input_t)  :: shown
    type(lister_t) :: lister
    integer :: i, longest

    shown = input   ! a visitor may change what it sees; this one does not
    allocate (lister%lines(64))
    call shown%visit(lister)
    longest = 1
    do i = 1, lister%n
      longest = max(longest, len(lister%lines(i)%text))
    end do
    allocate (character(longest) :: values(lister%n))
    do i = 1, lister%n
      values(i) = lister%lines(i)%text
    end do
  end function used_values

  subroutine list_group(self, about)
    class(lister_t),   intent(inout) :: self
    type(group_key_t), intent(in)    :: about

    self%here = about
    self%stem = trim(about%name)//'.'
    if (about%repeats) self%stem = trim(about%name)//'('//integer_text(about%number)//').'
    if (about%name == 'material' .and. about%of == 1) self%stem = 'material.'
  end subroutine list_group

  !> A name becomes part of the keys that follow.
  subroutine list_text(self, key, value)
    class(lister_t),           intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: value

    if (key%name == 'name' .and. self%here%repeats) then
      if (index(self%stem, '(') > 0) self%stem = trim(self%here%name)//'('//value//').'
    else if (value == '') then
      call self%add(key, 'none')
    else
      call self%add(key, value)
    end if
  end subroutine list_text

  subroutine list_number(self, key, value)
    class(lister_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    real(wp),        intent(inout) :: value

    call self%add(key, number_text(value))
  end subroutine list_number

  subroutine list_whole(self, key, value)
    class(lister_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    integer,         intent(inout) :: value

    call self%add(key, integer_text(value))
  end subroutine list_whole

  subroutine list_numbers(self, key, values)
    class(lister_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    real(wp),        intent(inout) :: values(:)

    call self%add(key, numbers_text(values))
  end subroutine list_numbers

  subroutine list_list(self, key, values)
    class(lister_t),       intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: values(:)

    if (size(values) == 0) then
      call self%add(key, 'none')
    else
      call self%add(key, numbers_text(values))
    end if
  end subroutine list_list

  subroutine add(self, key, value)
    class(lister_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    character(*),    intent(in)    :: value
    type(line_t), allocatable :: longer(:)
    integer :: i

    if (self%n == size(self%lines)) then
      allocate (longer(2 * self%n))
      do i = 1, self%n
        call move_alloc(self%lines(i)%text, longer(i)%text)
      end do
      call move_alloc(longer, self%lines)
    end if
    self%n = self%n + 1
    self%lines(self%n)%text = self%stem//trim(key%name)//equals//value
  end subroutine add

  !> Name every value in which a run that is to go on differs from the run so far.
  !>
  !> May differ: everything of output, run.title, run.output_dir, run.operators, and a later end.
  subroutine compare_used(old, new, errors)
    character(*),       intent(in)    :: old(:), new(:)
    type(error_list_t), intent(inout) :: errors
    integer :: i, j

    do i = 1, size(new)
      if (may_differ(key_in(new(i)))) cycle
      j = place_in(old, key_in(new(i)))
      if (j == 0) then
        call report(key_in(new(i)), value_in(new(i)), 'nothing')
      else if (value_in(old(j)) /= value_in(new(i))) then
        if (.not. is_later_end(old(j), new(i))) &
          call report(key_in(new(i)), value_in(new(i)), value_in(old(j)))
      end if
    end do
    do j = 1, size(old)
      if (may_differ(key_in(old(j)))) cycle
      if (place_in(new, key_in(old(j))) == 0) &
        call report(key_in(old(j)), 'nothing', value_in(old(j)))
    end do

  contains

    subroutine report(key, found, allowed)
      character(*), intent(in) :: key, found, allowed
      character(:), allocatable :: or_later

      or_later = ''
      if (is_end(key) .and. allowed /= 'none' .and. found /= 'none') or_later = ' or more'
      call errors%add('differs from the run that is to go on', where=key, &
                      found=shortened(found), allowed=shortened(allowed)//or_later)
    end subroutine report

  end subroutine compare_used

  pure logical function may_differ(key)
    character(*), intent(in) :: key

    may_differ = index(key, 'output.') == 1 .or. key == 'run.title' .or. key == 'run.output_dir' &
      .or. key == 'run.operators'
  end function may_differ

  pure logical function is_end(key)
    character(*), intent(in) :: key

    is_end = key == 'integration.end_time' .or. key == 'integration.final_strain'
  end function is_end

  !> Whether both lines give the end of the run in the same manner, and the new one a later end.
  pure logical function is_later_end(old, new)
    character(*), intent(in) :: old, new
    character(:), allocatable :: problem_old, problem_new
    real(wp) :: x_old, x_new

    is_later_end = .false.
    if (.not. is_end(key_in(new))) return
    call read_number(value_in(old), x_old, problem_old)
    call read_number(value_in(new), x_new, problem_new)
    if (problem_old == '' .and. problem_new == '') is_later_end = x_new >= x_old
  end function is_later_end

  pure integer function place_in(lines, key) result(i)
    character(*), intent(in) :: lines(:), key

    do i = 1, size(lines)
      if (index(lines(i), key//equals) == 1) return
    end do
    i = 0
  end function place_in

  pure function key_in(line) result(key)
    character(*), intent(in) :: line
    character(:), allocatable :: key

    key = line(:max(0, index(line, equals) - 1))
  end function key_in

  pure function value_in(line) result(value)
    character(*), intent(in) :: line
    character(:), allocatable :: value

    value = trim(line(index(line, equals) + len(equals):))
  end function value_in

end module pd_used_values
