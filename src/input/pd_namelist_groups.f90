!> Groups of a namelist file: keys with their values, as written, and where they stand.
module pd_namelist_groups
  use pd_text, only: integer_text, shortened
  implicit none
  private

  public :: namelist_value_t, namelist_entry_t, namelist_group_t
  public :: place_of, lengthen

  !> One value as written; for a text, what stands between the quotes.
  type :: namelist_value_t
    character(:), allocatable :: text
    logical :: quoted = .false.
  end type namelist_value_t

  !> key = values. `damaged`: already reported; its values must not be used.
  type :: namelist_entry_t
    character(:), allocatable :: key                   !! in lower case
    integer :: line = 0
    character(:), allocatable :: place                 !! where it was given, if not in the file
    logical :: damaged = .false.
    character(:), allocatable :: comma                 !! its first number like 0,006, or empty
    type(namelist_value_t), allocatable :: values(:)
  end type namelist_entry_t

  type :: namelist_group_t
    character(:), allocatable :: file, name            !! name: in lower case
    integer :: line = 0                                !! of the &; 0: the file has no such group
    type(namelist_entry_t), allocatable :: entries(:)
  contains
    procedure :: find
  end type namelist_group_t

  !> Double the length of a list.
  interface lengthen
    module procedure lengthen_groups, lengthen_entries, lengthen_values
  end interface lengthen

contains

  !> Index of a key among the entries of a group: the first of several, 0 if it is missing.
  pure integer function find(self, key) result(i)
    class(namelist_group_t), intent(in) :: self
    character(*),            intent(in) :: key

    do i = 1, size(self%entries)
      if (self%entries(i)%key == key) return
    end do
    i = 0
  end function find

  !> The place of a key, for messages: file, line, group and key. Without the key: the group.
  pure function place_of(group, key) result(place)
    type(namelist_group_t), intent(in) :: group
    character(*), intent(in), optional :: key
    character(:), allocatable :: place
    integer :: i, line

    line = group%line
    i = 0
    if (present(key)) i = group%find(key)
    if (i > 0) then
      line = group%entries(i)%line
      if (allocated(group%entries(i)%place)) then
        place = group%entries(i)%place
        return
      end if
    end if
    place = group%file
    if (line > 0) place = place//', line '//integer_text(line)
    place = place//', &'//shortened(group%name)
    if (present(key)) place = place//' '//shortened(key)
  end function place_of

  subroutine lengthen_groups(list)
    type(namelist_group_t), allocatable, intent(inout) :: list(:)
    type(namelist_group_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(2*size(list)))
    do i = 1, size(list)
      longer(i) = list(i)
    end do
    call move_alloc(longer, list)
  end subroutine lengthen_groups

  subroutine lengthen_entries(list)
    type(namelist_entry_t), allocatable, intent(inout) :: list(:)
    type(namelist_entry_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(2*size(list)))
    do i = 1, size(list)
      longer(i) = list(i)
    end do
    call move_alloc(longer, list)
  end subroutine lengthen_entries

  subroutine lengthen_values(list)
    type(namelist_value_t), allocatable, intent(inout) :: list(:)
    type(namelist_value_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(2*size(list)))
    do i = 1, size(list)
      longer(i) = list(i)
    end do
    call move_alloc(longer, list)
  end subroutine lengthen_values

end module pd_namelist_groups
