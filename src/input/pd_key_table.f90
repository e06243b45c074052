!> All groups and keys as tables, collected from what the input shows to a visitor.
module pd_key_table
  use pd_input_types, only: input_t
  use pd_keys, only: group_key_t, key_t, key_visitor_t, kind_integer, kind_real, kind_text
  use pd_kinds, only: wp
  implicit none
  private

  public :: key_table, group_table

  type, extends(key_visitor_t) :: collector_t
    type(group_key_t), allocatable :: groups(:)
    type(key_t),       allocatable :: keys(:)
  contains
    procedure :: group => collect_group
    procedure :: text => collect_text
    procedure :: number => collect_number
    procedure :: whole => collect_whole
    procedure :: numbers => collect_numbers
    procedure :: list => collect_list
    procedure, private :: collect
  end type collector_t

contains

  !> All groups, in the order of the reference.
  function group_table() result(groups)
    type(group_key_t), allocatable :: groups(:)
    type(collector_t) :: collector

    call collect_all(collector)
    call move_alloc(collector%groups, groups)
  end function group_table

  !> All keys, group by group.
  function key_table() result(keys)
    type(key_t), allocatable :: keys(:)
    type(collector_t) :: collector

    call collect_all(collector)
    call move_alloc(collector%keys, keys)
  end function key_table

  !> What an input shows in which every group stands once.
  subroutine collect_all(collector)
    type(collector_t), intent(inout) :: collector
    type(input_t) :: input

    allocate (collector%groups(0), collector%keys(0))
    allocate (input%bodies(1), input%materials(1), input%boundaries(1), input%pressures(1))
    call input%visit(collector)
  end subroutine collect_all

  subroutine collect_group(self, about)
    class(collector_t), intent(inout) :: self
    type(group_key_t),  intent(in)    :: about

    self%groups = [self%groups, about]
  end subroutine collect_group

  subroutine collect(self, key, kind)
    class(collector_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    integer,            intent(in)    :: kind
    type(key_t) :: whole

    whole = key
    whole%kind = kind
    whole%group = self%groups(size(self%groups))%name
    self%keys = [self%keys, whole]
  end subroutine collect

  subroutine collect_text(self, key, value)
    class(collector_t),        intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: value

    if (.not. allocated(value)) value = ''
    call self%collect(key, kind_text)
  end subroutine collect_text

  subroutine collect_number(self, key, value)
    class(collector_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    real(wp),           intent(inout) :: value

    value = 0.0_wp
    call self%collect(key, kind_real)
  end subroutine collect_number

  subroutine collect_whole(self, key, value)
    class(collector_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    integer,            intent(inout) :: value

    value = 0
    call self%collect(key, kind_integer)
  end subroutine collect_whole

  subroutine collect_numbers(self, key, values)
    class(collector_t), intent(inout) :: self
    type(key_t),        intent(in)    :: key
    real(wp),           intent(inout) :: values(:)

    values = 0.0_wp
    call self%collect(key, kind_real)
  end subroutine collect_numbers

  subroutine collect_list(self, key, values)
    class(collector_t),    intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: values(:)

    if (.not. allocated(values)) allocate (values(0))
    call self%collect(key, kind_real)
  end subroutine collect_list

end module pd_key_table
