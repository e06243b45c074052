!> Values of the command line that replace those of the file: --set group.key=value.
!>
!> A group that is given several times is chosen by its own name or its number:
!> boundary.top.velocity, body.2.x_max. A value that is set joins those of the file, and goes
!> through the same checks. Nothing behind the = takes a key out, `group.key=`, or a group,
!> `group=` and `group.name=`; a name that no group of this kind has adds one.
module pd_input_settings
  use pd_errors, only: error_list_t
  use pd_input_values, only: count_groups, did_you_mean
  use pd_key_list, only: key_list_t
  use pd_keys, only: allowed_values, find_group, find_key, kind_text
  use pd_namelist, only: scan_namelist
  use pd_namelist_groups, only: namelist_entry_t, namelist_group_t
  use pd_text, only: integer_text, is_name, lower_case, quoted_list, read_integer, shortened
  implicit none
  private

  public :: setting_t, apply_settings

  !> One 'group.key=value'.
  type :: setting_t
    character(:), allocatable :: text
  end type setting_t

  !> The parts of one setting. `which`: empty, a name or a number; `key`: empty where a group is
  !> taken out; `place` names it in messages.
  type :: parts_t
    character(:), allocatable :: place, group, which, key, value
  end type parts_t

contains

  !> Put the settings into the groups of the file, in their order: the last one counts.
  !>
  !> Errors: not of the form group.key=value; an unknown group or key; a group that the file lacks,
  !> or has several times where the setting does not say which; a value that cannot be read.
  subroutine apply_settings(settings, list, path, groups, errors)
    type(setting_t),                     intent(in)    :: settings(:)
    type(key_list_t),                    intent(in)    :: list         !! of all groups and keys
    character(*),                        intent(in)    :: path         !! of the input file
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    type(error_list_t),                  intent(inout) :: errors
    type(namelist_entry_t) :: entry
    type(parts_t) :: parts
    integer :: before, i, s

    do s = 1, size(settings)
      before = errors%count()
      call split(settings(s)%text, list, parts, errors)
      if (errors%count() == before) call find_place(parts, list, path, groups, i, errors)
      if (errors%count() > before) cycle
      if (parts%value == '') then
        call take_out(parts, groups, i, errors)
      else
        call read_value(parts, list, entry, errors)
        if (errors%count() == before) call replace(groups(i), entry)
      end if
    end do
  end subroutine apply_settings

  !> group.key=value or group.which.key=value; without a value group= and group.which= too.
  subroutine split(text, list, parts, errors)
    character(*),       intent(in)    :: text
    type(key_list_t),   intent(in)    :: list
    type(parts_t),      intent(out)   :: parts
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name
    integer :: equals, first, last

    parts%place = '--set '//shortened(text)
    equals = index(text, '=')
    name = ''
    if (equals > 0) name = lower_case(trim(adjustl(text(:equals - 1))))
    parts%value = ''
    if (equals > 0) parts%value = trim(adjustl(text(equals + 1:)))
    first = index(name, '.')
    last = index(name, '.', back=.true.)
    if (index(name//'.', '..') > 0) then
      first = 1   ! nothing beside a dot was to be something: it does not stand for the whole group
    else if (equals > 0 .and. parts%value == '' .and. is_group(name, list)) then
      name = name//'.'
      first = index(name, '.')
      last = len(name)
    end if
    if (first < 2) then
      call errors%add('no key with a value', where=parts%place, &
                      allowed='group.key=value or group.name.key=value')
      return
    end if
    parts%group = name(:first - 1)
    parts%which = name(first + 1:last - 1)
    parts%key = name(last + 1:)
  end subroutine split

  !> Whether a name without a key is meant: of a group, known or not, or of one among several of its
  !> kind, by its number or by its own name, which is no key of it.
  pure logical function is_group(name, list)
    character(*),     intent(in) :: name
    type(key_list_t), intent(in) :: list
    integer :: dot, known

    dot = index(name//'.', '.')
    is_group = dot > len(name)
    if (is_group) return
    known = find_group(list%groups, name(:dot - 1))
    if (known == 0 .or. index(name(dot + 1:), '.') > 0) return
    if (.not. list%groups(known)%repeats) return
    is_group = (find_key(list%keys, name(:dot - 1), 'name') > 0 .and. &
                find_key(list%keys, name(:dot - 1), name(dot + 1:)) == 0) .or. &
      verify(name(dot + 1:), '0123456789') == 0
  end function is_group

  !> The index of the group; a group that may be given only once is added if the file lacks it.
  subroutine find_place(parts, list, path, groups, i, errors)
    type(parts_t),                       intent(in)    :: parts
    type(key_list_t),                    intent(in)    :: list
    character(*),                        intent(in)    :: path
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    integer,                             intent(out)   :: i
    type(error_list_t),                  intent(inout) :: errors
    character(:), allocatable :: key
    integer :: known, n

    i = 0
    key = parts%key
    if (find_key(list%keys, parts%group, key) == 0) key = 'key'   ! boundary.top=5 lacks one
    known = find_group(list%groups, parts%group)
    if (known == 0) then
      call errors%add('unknown group'//did_you_mean(parts%group, list%groups%name), &
                      where=parts%place, found=shortened(parts%group), &
                      allowed=quoted_list(list%groups%name, bare=.true.))
      return
    end if
    n = count_groups(groups, parts%group)
    if (parts%which /= '') then
      i = group_of(groups, parts%group, parts%which)
      ! a new group needs a name that is no number: that of a group that is missing
      if (i == 0 .and. parts%value /= '' .and. is_name(parts%which) .and. &
        verify(parts%which, '0123456789') > 0 .and. &
        find_key(list%keys, parts%group, 'name') > 0) then
        call append(groups, parts%group, parts%place)
        i = size(groups)
        call replace(groups(i), text_entry('name', parts%which, parts%place))
      end if
      if (i == 0) call errors%add('the file has no such group', where=parts%place, &
        found=shortened(parts%which), allowed='a name of &'//parts%group//' or 1 to '// &
        integer_text(n))
    else if (n == 1 .or. (n > 1 .and. parts%key == '')) then
      i = group_of(groups, parts%group, '1')
    else if (n > 1) then
      call errors%add('the file has several groups of this name', where=parts%place, &
        found=integer_text(n)//' groups &'//parts%group, &
        allowed=parts%group//'.name.'//key//' or '//parts%group//'.number.'//key)
    else if (list%groups(known)%repeats .or. parts%key == '') then
      call errors%add('the file has no group &'//parts%group, where=parts%place)
    else
      call append(groups, parts%group, path)
      i = size(groups)
    end if
  end subroutine find_place

  !> The group that has this name, else the one of this number; 0 where there is none.
  pure integer function group_of(groups, name, which) result(i)
    type(namelist_group_t), intent(in) :: groups(:)
    character(*),           intent(in) :: name, which
    character(:), allocatable :: problem
    integer :: e, k, n

    do i = 1, size(groups)
      if (groups(i)%name /= name) cycle
      e = groups(i)%find('name')
      if (e == 0) cycle
      if (size(groups(i)%entries(e)%values) == 0) cycle
      if (groups(i)%entries(e)%values(1)%text == which) return
    end do
    call read_integer(which, k, problem)
    if (problem /= '') k = 0
    n = 0
    do i = 1, size(groups)
      if (groups(i)%name == name) n = n + 1
      if (groups(i)%name == name .and. n == k) return
    end do
    i = 0
  end function group_of

  !> Take a key out of its group, or the group out of the file, all of its kind where none is named.
  subroutine take_out(parts, groups, i, errors)
    type(parts_t),                       intent(in)    :: parts
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    integer,                             intent(in)    :: i   !! of the group
    type(error_list_t),                  intent(inout) :: errors
    integer, allocatable :: others(:)
    integer :: k, e

    if (parts%key == '' .and. parts%which == '') then
      others = pack([(k, k=1, size(groups))], [(groups(k)%name /= parts%group, k=1, size(groups))])
      groups = [(groups(others(k)), k=1, size(others))]
      return
    else if (parts%key == '') then
      groups = [(groups(k), k=1, i - 1), (groups(k), k=i + 1, size(groups))]
      return
    end if
    e = groups(i)%find(parts%key)
    if (e == 0) then
      call errors%add('there is no such key to take out', where=parts%place)
    else
      groups(i)%entries = [(groups(i)%entries(k), k=1, e - 1), &
        (groups(i)%entries(k), k=e + 1, size(groups(i)%entries))]
    end if
  end subroutine take_out

  !> key = 'text', given at a place.
  pure type(namelist_entry_t) function text_entry(key, text, place) result(entry)
    character(*), intent(in) :: key, text, place

    entry%key = key
    entry%place = place
    allocate (entry%values(1))
    entry%values(1)%text = text
    entry%values(1)%quoted = .true.
  end function text_entry

  subroutine append(groups, name, path)
    type(namelist_group_t), allocatable, intent(inout) :: groups(:)
    character(*),                        intent(in)    :: name, path
    type(namelist_group_t), allocatable :: more(:)
    integer :: i, n

    n = size(groups)
    allocate (more(n + 1))
    do i = 1, n
      more(i) = groups(i)
    end do
    more(n + 1)%file = path
    more(n + 1)%name = name
    allocate (more(n + 1)%entries(0))
    call move_alloc(more, groups)
  end subroutine append

  !> The values as they would be written in the file; the shell has removed the quotes of a text.
  subroutine read_value(parts, list, entry, errors)
    type(parts_t),          intent(in)    :: parts
    type(key_list_t),       intent(in)    :: list
    type(namelist_entry_t), intent(out)   :: entry
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t), allocatable :: scanned(:)
    type(error_list_t) :: problems
    integer :: k

    entry = text_entry(parts%key, parts%value, parts%place)
    k = find_key(list%keys, parts%group, parts%key)
    if (k == 0) return   ! check_groups reports it
    if (scan(parts%value, new_line('a')//achar(13)) > 0) then
      call errors%add('a value of several lines', where=parts%place, allowed='one line')
      return
    end if
    if (list%keys(k)%kind == kind_text .and. verify(parts%value(1:1), '''"') > 0) return
    call scan_namelist(parts%place, '&a b = '//parts%value//' /', scanned, problems)
    if (problems%count() == 0 .and. size(scanned) == 1) then
      if (size(scanned(1)%entries) == 1) then
        entry%values = scanned(1)%entries(1)%values
        return
      end if
    end if
    call errors%add('the value cannot be read', where=parts%place, found=shortened(parts%value), &
                    allowed=allowed_values(list%keys(k)))
  end subroutine read_value

  !> Replace the entry of this key, or add it to the others.
  subroutine replace(group, entry)
    type(namelist_group_t), intent(inout) :: group
    type(namelist_entry_t), intent(in)    :: entry
    type(namelist_entry_t), allocatable :: more(:)
    integer :: i, n

    i = group%find(entry%key)
    if (i > 0) then
      group%entries(i) = entry
      return
    end if
    n = size(group%entries)
    allocate (more(n + 1))
    do i = 1, n
      more(i) = group%entries(i)
    end do
    more(n + 1) = entry
    call move_alloc(more, group%entries)
  end subroutine replace

end module pd_input_settings
