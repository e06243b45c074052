!> The values of a run as lines "group.key = value": for the provenance of results, and to report
!> what differs from the run that a checkpoint belongs to.
module pd_used_values
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: wp
  use pd_text, only: integer_text, number_text, read_number, shortened
  implicit none
  private

  public :: used_values, compare_used, same_end, used_list_t, numbers_text

  type :: line_t
    character(:), allocatable :: text
  end type line_t

  !> Visitor that collects a line for each key.
  type, extends(key_visitor_t) :: used_list_t
    type(line_t), allocatable :: list(:)
    integer :: n = 0
    type(group_key_t) :: about                    !! the present group
    integer :: k = 0                              !! it is the k-th of its name
    character(:), allocatable :: label            !! 'run', 'body(1)', 'boundary(top)'
  contains
    procedure :: group => begin_group
    procedure :: take_real => list_real
    procedure :: take_integer => list_integer
    procedure :: take_text => list_text
    procedure :: take_list => list_numbers
    procedure :: take_vector => list_vector
    procedure, private :: add
    procedure :: lines
  end type used_list_t

  character(*), parameter :: equals = ' = '

contains

  !> All values as used, defaults included, in the order of the reference; numbers with as
  !> many digits as read back to the same bits, 'none' if there is no value. Bodies without a
  !> name are labelled with their number, what has one with it: body(1).x_min,
  !> boundary(top).velocity, material(clay).density.
  function used_values(input) result(values)
    type(input_t), intent(in) :: input
    character(:), allocatable :: values(:)
    type(input_t)     :: visited
    type(used_list_t) :: used

    visited = input
    call visited%visit(used)
    allocate (values, source=used%lines())
  end function used_values

  !> What has been collected.
  function lines(self) result(values)
    class(used_list_t), intent(in) :: self
    character(:), allocatable :: values(:)
    integer :: i, longest

    longest = 1
    do i = 1, self%n
      longest = max(longest, len(self%list(i)%text))
    end do
    allocate (character(longest) :: values(self%n))
    do i = 1, self%n
      values(i) = self%list(i)%text
    end do
  end function lines

  !> A group that may be given several times is labelled with its number until its name is known.
  subroutine begin_group(self, about)
    class(used_list_t), intent(inout) :: self
    type(group_key_t),  intent(in)    :: about

    if (self%about%name /= about%name) self%k = 0
    self%k = self%k + 1
    self%about = about
    self%label = trim(about%name)
    if (about%repeats) self%label = self%label//'('//integer_text(self%k)//')'
  end subroutine begin_group

  subroutine add(self, key, value)
    class(used_list_t), intent(inout) :: self
    character(*),       intent(in)    :: key, value
    type(line_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%list)) allocate (self%list(64))
    if (self%n == size(self%list)) then
      allocate (longer(2*self%n))
      do i = 1, self%n
        call move_alloc(self%list(i)%text, longer(i)%text)
      end do
      call move_alloc(longer, self%list)
    end if
    self%n = self%n + 1
    self%list(self%n)%text = self%label//'.'//key//equals//value
  end subroutine add

  !> The name of a group that may be given several times is its label, without a line of its own.
  !> The default name is no label: 'material.density' if there is only one material.
  subroutine list_text(self, key, text)
    class(used_list_t),        intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: text

    if (key%name == 'name' .and. self%about%repeats) then
      if (text == '') return   ! without a name it keeps its number
      self%label = trim(self%about%name)
      if (text /= key%default) self%label = self%label//'('//text//')'
    else if (text == '') then
      call self%add(trim(key%name), 'none')
    else
      call self%add(trim(key%name), text)
    end if
  end subroutine list_text

  subroutine list_real(self, key, x)
    class(used_list_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    real(wp),           intent(inout) :: x

    call self%add(trim(key%name), number_text(x))
  end subroutine list_real

  subroutine list_integer(self, key, i)
    class(used_list_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    integer,            intent(inout) :: i

    call self%add(trim(key%name), integer_text(i))
  end subroutine list_integer

  subroutine list_numbers(self, key, x)
    class(used_list_t),    intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: x(:)

    call self%add(trim(key%name), numbers_text(x))
  end subroutine list_numbers

  subroutine list_vector(self, key, x)
    class(used_list_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    real(wp),           intent(inout) :: x(:)

    call self%add(trim(key%name), numbers_text(x))
  end subroutine list_vector

  !> Numbers with commas between them; 'none' where there are none.
  pure function numbers_text(x) result(text)
    real(wp), intent(in) :: x(:)
    character(:), allocatable :: text, number
    character(26*size(x)) :: buffer
    integer :: i, n

    n = 0
    do i = 1, size(x)
      number = number_text(x(i))
      if (i < size(x)) number = number//', '
      buffer(n + 1:n + len(number)) = number
      n = n + len(number)
    end do
    text = buffer(:n)
    if (n == 0) text = 'none'
  end function numbers_text

  !> Report every value in which a run that is to continue differs from the run so far.
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

  !> Whether two runs end alike.
  pure logical function same_end(old, new) result(same)
    character(*), intent(in) :: old(:), new(:)   !! values as used
    integer :: i, j

    same = .true.
    do i = 1, size(new)
      if (.not. is_end(key_in(new(i)))) cycle
      j = place_in(old, key_in(new(i)))
      if (j == 0) then
        same = .false.
      else
        same = same .and. value_in(old(j)) == value_in(new(i))
      end if
    end do
  end function same_end

  pure logical function may_differ(key)
    character(*), intent(in) :: key

    may_differ = index(key, 'output.') == 1 .or. key == 'run.title' .or. key == 'run.output_dir' &
      .or. key == 'run.operators'
  end function may_differ

  pure logical function is_end(key)
    character(*), intent(in) :: key

    is_end = key == 'integration.end_time' .or. key == 'integration.final_strain'
  end function is_end

  !> Whether both lines give the end of the run in the same way, and the new one a later end.
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
