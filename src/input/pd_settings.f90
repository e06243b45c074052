!> Values given on the command line, `--set group.key=value`, in place of those in the file.
!>
!> A group that may stand several times is named by its name or its number: boundary.top.velocity,
!> body.2.x_max. Texts need no quotes.
module pd_settings
  use pd_errors, only: error_list_t
  use pd_input_values, only: count_groups
  use pd_key_table, only: group_table, key_table
  use pd_keys, only: find_group, find_key, group_key_t, key_t, kind_text
  use pd_namelist, only: namelist_entry_t, namelist_group_t, scan_namelist
  use pd_text, only: integer_text, quoted_list
  implicit none
  private

  public :: setting_t, apply_settings

  !> One setting as it was typed.
  type :: setting_t
    character(:), allocatable :: text
  end type setting_t

  !> The parts of a setting.
  type :: parts_t
    character(:), allocatable :: group, label, key, value
  end type parts_t

contains

  !> Put the settings into the groups of a file, one after the other.
  !>
  !> Errors: a setting that is no group.key=value, a group that is not there or not the only one.
  !> Unknown keys and wrong values are left to the checks of the groups.
  subroutine apply_settings(path, settings, groups, errors)
    character(*),           intent(in)    :: path        !! of the file
    type(setting_t),        intent(in)    :: settings(:)
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(parts_t) :: parts
    integer :: i, before, place

    do i = 1, size(settings)
      before = errors%count()
      call split(settings(i)%text, parts, errors)
      if (errors%count() > before) cycle
      call find_place(settings(i)%text, path, parts, groups, place, errors)
      if (errors%count() == before) call put_value(settings(i)%text, parts, groups(place), errors)
    end do
  end subroutine apply_settings

  !> group.key=value or group.label.key=value.
  subroutine split(text, parts, errors)
    character(*),       intent(in)    :: text
    type(parts_t),      intent(out)   :: parts
    type(error_list_t), intent(inout) :: errors
    integer :: equals, first, last

    equals = index(text, '=')
    first = index(text(:max(0, equals - 1)), '.')
    last = index(text(:max(0, equals - 1)), '.', back=.true.)
    if (first <= 1 .or. last >= equals - 1 .or. equals == len(text)) then
      call errors%add('a setting is not understood', where='--set', found='"'//text//'"', &
        allowed='group.key=value, or group.name.key=value where a group stands several times')
      return
    end if
    parts%group = text(:first - 1)
    parts%label = text(first + 1:last - 1)
    parts%key = text(last + 1:equals - 1)
    parts%value = text(equals + 1:)
  end subroutine split

  !> The group that is meant; a group that may stand once and is not there is added.
  subroutine find_place(text, path, parts, groups, place, errors)
    character(*),           intent(in)    :: text, path
    type(parts_t),          intent(in)    :: parts
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    integer,                intent(out)   :: place
    type(error_list_t),     intent(inout) :: errors
    type(group_key_t), allocatable :: known(:)
    type(namelist_group_t) :: new
    integer :: i, k, n

    place = 0
    allocate (known, source=group_table())
    k = find_group(known, parts%group)
    if (k == 0) then
      call errors%add('unknown group', where='--set '//text, found=parts%group, &
        allowed=quoted_list(known%name, bare=.true.))
      return
    end if
    n = 0
    do i = 1, size(groups)
      if (groups(i)%name /= parts%group) cycle
      n = n + 1
      if (parts%label == '' .or. parts%label == name_of(groups(i)) .or. &
        parts%label == integer_text(n)) place = i
    end do
    if (place > 0 .and. (parts%label /= '' .or. n == 1)) return
    if (n == 0 .and. .not. known(k)%repeats) then
      new%file = path
      new%name = parts%group
      allocate (new%entries(0))
      groups = [groups, new]
      place = size(groups)
    else
      call errors%add('which group is meant is not clear', where='--set '//text, &
        found=integer_text(count_groups(groups, parts%group))//' groups &'//parts%group, &
        allowed='the name or the number of one: '//parts%group//'.NAME.'//parts%key)
    end if
  end subroutine find_place

  !> Name that a group gives itself; '' where it has none.
  pure function name_of(group) result(name)
    type(namelist_group_t), intent(in) :: group
    character(:), allocatable :: name
    integer :: i

    name = ''
    i = group%find('name')
    if (i == 0) return
    if (size(group%entries(i)%values) > 0) name = group%entries(i)%values(1)%text
  end function name_of

  !> Enter a value, as if it stood in the file.
  subroutine put_value(text, parts, group, errors)
    character(*),           intent(in)    :: text
    type(parts_t),          intent(in)    :: parts
    type(namelist_group_t), intent(inout) :: group
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t), allocatable :: scanned(:)
    type(key_t), allocatable :: keys(:)
    character(:), allocatable :: value
    integer :: i, k

    allocate (keys, source=key_table())
    k = find_key(keys, parts%group, parts%key)
    value = parts%value
    if (k > 0) then
      if (keys(k)%kind == kind_text .and. scan(value(1:1), '''"') == 0) value = quoted(value)
    end if
    call scan_namelist('--set '//text, '&'//parts%group//new_line('a')//parts%key//' = '//value// &
      new_line('a')//'/', scanned, errors)
    if (size(scanned) /= 1) return
    if (size(scanned(1)%entries) /= 1) return
    scanned(1)%entries(1)%line = 0
    scanned(1)%entries(1)%source = '--set'
    i = group%find(parts%key)
    if (i > 0) then
      group%entries(i) = scanned(1)%entries(1)
    else
      group%entries = [group%entries, scanned(1)%entries(1)]
    end if
  end subroutine put_value

  !> A text between quotes, with its own doubled.
  pure function quoted(text)
    character(*), intent(in) :: text
    character(:), allocatable :: quoted
    integer :: i

    quoted = ''''
    do i = 1, len(text)
      quoted = quoted//text(i:i)
      if (text(i:i) == '''') quoted = quoted//''''
    end do
    quoted = quoted//''''
  end function quoted

end module pd_settings
