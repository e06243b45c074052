!> The values of a run as a namelist file, as used: `perigeo --print-input RUN.nml`.
!>
!> What was given stands there as it is used; what was not stands behind a `!` with the value that
!> takes its place. The file thus says everything, and read again it gives the same run.
module pd_print_input
  use pd_input_types, only: input_t
  use pd_input_values, only: count_groups, group_named, is_given
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: namelist_group_t
  use pd_text, only: integer_text, number_text, numbers_text
  implicit none
  private

  public :: print_input

  type, extends(key_visitor_t) :: printer_t
    integer :: unit = 0
    type(namelist_group_t), allocatable :: groups(:)   !! as given
    type(namelist_group_t) :: here
    logical :: there = .false.    !! the group is given
    logical :: open = .false.     !! a group has to be closed
  contains
    procedure :: group => print_group
    procedure :: text => print_text
    procedure :: number => print_number
    procedure :: whole => print_whole
    procedure :: numbers => print_numbers
    procedure :: list => print_list
    procedure, private :: close => close_group
    procedure, private :: put
  end type printer_t

contains

  !> Print all values of an input on a unit that is open for formatted writing.
  subroutine print_input(unit, input)
    integer,       intent(in) :: unit
    type(input_t), intent(in) :: input
    type(input_t)   :: shown
    type(printer_t) :: printer

    shown = input   ! a visitor may change what it sees; this one does not
    printer%unit = unit
    printer%groups = input%groups
    call shown%visit(printer)
    call printer%close()
  end subroutine print_input

  subroutine print_group(self, about)
    class(printer_t),  intent(inout) :: self
    type(group_key_t), intent(in)    :: about

    call self%close()
    self%here = group_named(self%groups, trim(about%name), about%number, '')
    self%there = count_groups(self%groups, trim(about%name)) >= about%number
    if (self%there) then
      write (self%unit, '(a)') '&'//trim(about%name)
    else
      write (self%unit, '(a)') '! &'//trim(about%name)
    end if
    self%open = .true.
  end subroutine print_group

  subroutine close_group(self)
    class(printer_t), intent(inout) :: self

    if (.not. self%open) return
    write (self%unit, '(a)') trim(merge('/  ', '! /', self%there))
    self%open = .false.
  end subroutine close_group

  subroutine put(self, key, value)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    character(*),     intent(in)    :: value   !! '': there is none
    character(:), allocatable :: unit

    if (value == '') return
    unit = ''
    if (key%unit /= '' .and. key%unit /= '1') unit = '   ! ['//trim(key%unit)//']'
    if (is_given(self%here, trim(key%name))) then
      write (self%unit, '(a)') '  '//trim(key%name)//' = '//value//unit
    else
      write (self%unit, '(a)') '  ! '//trim(key%name)//' = '//value//unit
    end if
  end subroutine put

  subroutine print_text(self, key, value)
    class(printer_t),          intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: value
    character(:), allocatable :: quoted
    integer :: i

    if (value == '') return
    quoted = ''
    do i = 1, len(value)
      quoted = quoted//value(i:i)
      if (value(i:i) == '''') quoted = quoted//''''
    end do
    call self%put(key, ''''//quoted//'''')
  end subroutine print_text

  subroutine print_number(self, key, value)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    real(wp),         intent(inout) :: value

    if (is_set(value)) call self%put(key, number_text(value))
  end subroutine print_number

  subroutine print_whole(self, key, value)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    integer,          intent(inout) :: value

    call self%put(key, integer_text(value))
  end subroutine print_whole

  subroutine print_numbers(self, key, values)
    class(printer_t), intent(inout) :: self
    type(key_t),      intent(in)    :: key
    real(wp),         intent(inout) :: values(:)

    call self%put(key, numbers_text(values))
  end subroutine print_numbers

  subroutine print_list(self, key, values)
    class(printer_t),      intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: values(:)

    call self%put(key, numbers_text(values))
  end subroutine print_list

end module pd_print_input
