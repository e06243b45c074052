!> Visitor that writes an input file with all values as used.
!>
!> A key that is refused where it has no effect, and that the file did not give, is written as a
!> comment: the file can be read again, and gives the same values as used.
module pd_input_printer
  use pd_input_types, only: input_t
  use pd_input_values, only: group_named, is_given, problem_of_range
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: is_set, wp
  use pd_namelist_groups, only: namelist_group_t
  use pd_text, only: integer_text, number_text
  use pd_used_values, only: numbers_text
  implicit none
  private

  public :: write_input

  character(*), parameter :: line_end = new_line('a')

  type, extends(key_visitor_t) :: printer_t
    private
    integer :: unit = 0
    type(namelist_group_t), allocatable :: groups(:)   !! as the file gives them
    type(namelist_group_t) :: given                    !! the present one
    integer :: k = 0                                   !! it is the k-th of its name
    character(:), allocatable :: text                  !! of the present group
    logical :: lacks = .false.                         !! a required key has no value
  contains
    procedure :: group => begin_group
    procedure :: take_real => print_real
    procedure :: take_integer => print_integer
    procedure :: take_text => print_words
    procedure :: take_list => print_list
    procedure :: take_vector => print_vector
    procedure, private :: end_group
    procedure, private :: put
  end type printer_t

contains

  !> Write the values of `input`, which was read from `groups`.
  subroutine write_input(input, groups, unit)
    type(input_t),          intent(in) :: input
    type(namelist_group_t), intent(in) :: groups(:)
    integer,                intent(in) :: unit
    type(printer_t) :: printer
    type(input_t)   :: visited

    printer%unit = unit
    printer%groups = groups
    printer%given%name = ''
    printer%given%file = input%path
    printer%text = ''
    visited = input
    call visited%visit(printer)
    call printer%end_group()
  end subroutine write_input

  subroutine begin_group(self, about)
    class(printer_t),  intent(inout) :: self
    type(group_key_t), intent(in)    :: about

    call self%end_group()
    if (self%given%name /= about%name) self%k = 0
    self%k = self%k + 1
    self%given = group_named(self%groups, trim(about%name), self%k, self%given%file)
    self%text = '&'//trim(about%name)//line_end
    self%lacks = .false.
  end subroutine begin_group

  !> A group that the file does not have, and that would lack required values, is left out.
  subroutine end_group(self)
    class(printer_t), intent(inout) :: self

    if (self%text /= '' .and. .not. self%lacks) write (self%unit, '(a)') self%text//'/'
    self%text = ''
  end subroutine end_group

  !> One key; an empty value means that there is none.
  subroutine put(self, key, value)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    character(*),     intent(in)    :: value
    character(:), allocatable :: margin

    if (value == '') then
      self%lacks = self%lacks .or. key%required
      return
    end if
    margin = '  '
    if (key%needs_effect .and. .not. is_given(self%given, trim(key%name))) margin = '  ! '
    self%text = self%text//margin//trim(key%name)//' = '//value//line_end
  end subroutine put

  subroutine print_real(self, key, x)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    real(wp),         intent(inout) :: x

    if (is_set(x)) then
      call self%put(key, number_text(x))
    else
      call self%put(key, '')
    end if
  end subroutine print_real

  !> A number out of the range of the key means that there is none.
  subroutine print_integer(self, key, i)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    integer,          intent(inout) :: i

    if (problem_of_range(real(i, wp), key) == '') then
      call self%put(key, integer_text(i))
    else
      call self%put(key, '')
    end if
  end subroutine print_integer

  subroutine print_words(self, key, text)
    class(printer_t),          intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: text
    character(:), allocatable :: quoted
    integer :: i

    quoted = ''
    do i = 1, len(text)
      quoted = quoted//text(i:i)
      if (text(i:i) == '''') quoted = quoted//''''
    end do
    if (text /= '') quoted = ''''//quoted//''''
    call self%put(key, quoted)
  end subroutine print_words

  subroutine print_list(self, key, x)
    class(printer_t),      intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: x(:)

    if (size(x) > 0) then
      call self%put(key, numbers_text(x))
    else
      call self%put(key, '')
    end if
  end subroutine print_list

  subroutine print_vector(self, key, x)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    real(wp),         intent(inout) :: x(:)

    call self%put(key, numbers_text(x))
  end subroutine print_vector

end module pd_input_printer
