!> The groups of a file, checked against the known keys.
!>
!> `check_groups` reports everything that is wrong with a key by itself, and marks it as damaged;
!> the reader (`pd_key_reader`) then only fetches values.
module pd_input_values
  use pd_errors, only: error_list_t
  use pd_key_list, only: key_list_t
  use pd_keys, only: allowed_values, find_group, find_key, group_key_t, key_t, keys_of, &
    kind_integer, kind_text, words_of
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_entry_t, namelist_group_t, namelist_value_t, place_of
  use pd_text, only: integer_text, is_name, nearest_name, quoted_list, read_integer, &
    read_number, shortened
  implicit none
  private

  public :: check_groups, group_named, count_groups, is_given, is_damaged, any_damaged
  public :: did_you_mean, problem_of_range

contains

  !> Check every group and key of a file by itself: unknown, missing and repeated ones, and
  !> values of the wrong kind, number or range. What is wrong is marked as damaged.
  subroutine check_groups(groups, list, errors, path)
    type(namelist_group_t), intent(inout) :: groups(:)
    type(key_list_t),       intent(in)    :: list          !! of all groups and keys
    type(error_list_t),     intent(inout) :: errors
    character(*),           intent(in)    :: path
    integer :: i, k

    do i = 1, size(groups)
      if (errors%count() >= max_problems) return
      k = find_group(list%groups, groups(i)%name)
      if (k == 0) then
        call report_unknown_group(groups(i), list%groups, errors)
      else
        if (.not. list%groups(k)%repeats) call report_repeated(groups, i, errors)
        call check_keys(groups(i), list%keys, errors)
      end if
    end do
    do k = 1, size(list%groups)
      associate (known => list%groups(k))
        if (known%required .and. count_groups(groups, trim(known%name)) == 0) &
          call errors%add('group &'//trim(known%name)//' is missing', where=path, &
                          allowed='it must be there: '//trim(known%meaning))
      end associate
    end do
  end subroutine check_groups

  subroutine report_unknown_group(group, known, errors)
    type(namelist_group_t), intent(in)    :: group
    type(group_key_t),      intent(in)    :: known(:)
    type(error_list_t),     intent(inout) :: errors
    character(len(known%name)) :: names(size(known))

    if (group%name == '') return   ! the scanner has reported it
    names = known%name
    call errors%add('unknown group'//did_you_mean(group%name, names), where=place_of(group), &
                    found='&'//shortened(group%name), allowed=quoted_list(names, bare=.true.))
  end subroutine report_unknown_group

  !> Group i is given a second time.
  subroutine report_repeated(groups, i, errors)
    type(namelist_group_t), intent(in)    :: groups(:)
    integer,                intent(in)    :: i
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    do j = 1, i - 1
      if (groups(j)%name /= groups(i)%name) cycle
      call errors%add('the group is given twice', where=place_of(groups(i)), &
                      allowed='once (first in line '//integer_text(groups(j)%line)//')')
      return
    end do
  end subroutine report_repeated

  !> Check all entries of one group, and that no required key is missing.
  subroutine check_keys(group, keys, errors)
    type(namelist_group_t), intent(inout) :: group
    type(key_t),            intent(in)    :: keys(:)
    type(error_list_t),     intent(inout) :: errors
    integer :: i, k

    do i = 1, size(group%entries)
      if (errors%count() >= max_problems) return
      k = find_key(keys, group%name, group%entries(i)%key)
      if (k == 0) then
        call report_unknown_key(group, group%entries(i)%key, keys, errors)
      else if (.not. group%entries(i)%damaged) then
        call check_entry(group, i, keys(k), errors)
      end if
    end do
    do k = 1, size(keys)
      if (keys(k)%group /= group%name .or. .not. keys(k)%required) cycle
      if (is_given(group, trim(keys(k)%name))) cycle
      call errors%add('the key is missing', where=place_of(group, trim(keys(k)%name)), &
                      allowed=with_unit(allowed_values(keys(k)), keys(k)))
    end do
  end subroutine check_keys

  subroutine report_unknown_key(group, name, keys, errors)
    type(namelist_group_t), intent(in)    :: group
    character(*),           intent(in)    :: name
    type(key_t),            intent(in)    :: keys(:)
    type(error_list_t),     intent(inout) :: errors
    character(:), allocatable :: hint
    integer :: i

    hint = did_you_mean(name, keys_of(keys, group%name))
    do i = 1, size(keys)
      if (keys(i)%name /= name) cycle
      hint = ', it belongs to &'//trim(keys(i)%group)
      exit
    end do
    call errors%add('unknown key'//hint, where=place_of(group, name), found=shortened(name), &
                    allowed=quoted_list(keys_of(keys, group%name), bare=.true.))
  end subroutine report_unknown_key

  !> Check the values of entry i of a group: their number, kind and range.
  subroutine check_entry(group, i, key, errors)
    type(namelist_group_t), intent(inout) :: group
    integer,                intent(in)    :: i
    type(key_t),            intent(in)    :: key
    type(error_list_t),     intent(inout) :: errors
    character(:), allocatable :: allowed, found, place, problem
    integer :: n, v

    place = place_of(group, trim(key%name))
    allowed = with_unit(allowed_values(key), key)
    problem = ''
    found = ''
    n = size(group%entries(i)%values)
    do v = 1, n
      problem = problem_of(group%entries(i)%values(v), key)
      if (problem == '') cycle
      found = as_written(group%entries(i)%values(v))
      exit
    end do
    if (problem == '' .and. key%count > 0 .and. n /= key%count) then
      problem = merge('too many values', 'too few values ', n > key%count)
      found = integer_text(n)//merge(' value ', ' values', n == 1)
      if (key%count == 1) allowed = 'one value: '//allowed
    end if
    if (is_decimal_comma(group%entries(i), key)) then
      problem = 'a comma stands between values, the decimal sign is a point'
      found = group%entries(i)%comma
    end if
    if (problem == '') return
    call errors%add(problem, where=place, found=found, allowed=allowed)
    group%entries(i)%damaged = .true.
  end subroutine check_entry

  !> Whether numbers are written with a comma: there are twice as many as the key takes, or what
  !> follows a comma begins with a zero, as in 0,006.
  pure logical function is_decimal_comma(entry, key)
    type(namelist_entry_t), intent(in) :: entry
    type(key_t),            intent(in) :: key
    integer :: k

    is_decimal_comma = .false.
    if (.not. allocated(entry%comma) .or. key%kind == kind_text) return
    k = index(entry%comma, ',')
    if (k == 0) return
    is_decimal_comma = size(entry%values) == 2 * key%count
    if (len(entry%comma) > k + 1) is_decimal_comma = is_decimal_comma &
      .or. entry%comma(k + 1:k + 1) == '0'
  end function is_decimal_comma

  !> What is wrong with one value of a key; empty if nothing is.
  pure function problem_of(value, key) result(problem)
    type(namelist_value_t), intent(in) :: value
    type(key_t),            intent(in) :: key
    character(:), allocatable :: problem
    real(wp) :: x
    integer  :: i

    if (key%kind == kind_text) then
      problem = problem_of_text(value, key)
    else if (value%quoted) then
      problem = 'text where a number is due'
    else if (key%kind == kind_integer) then
      call read_integer(value%text, i, problem)
      if (problem == '') problem = problem_of_range(real(i, wp), key)
    else
      call read_number(value%text, x, problem)
      if (problem == 'not a number') problem = 'text where a number is due'
      if (problem == '') problem = problem_of_range(x, key)
    end if
  end function problem_of

  pure function problem_of_text(value, key) result(problem)
    type(namelist_value_t), intent(in) :: value
    type(key_t),            intent(in) :: key
    character(:), allocatable :: problem
    integer, parameter :: longest_name = 48, longest_text = 500

    problem = ''
    if (.not. value%quoted) then
      problem = 'text must stand in quotes'
    else if (key%choices /= '') then
      if (all(words_of(key%choices) /= value%text)) &
        problem = 'unknown choice'//did_you_mean(value%text, words_of(key%choices))
    else if (value%text == '') then
      problem = 'empty text'
    else if (key%is_name) then
      if (.not. is_name(value%text)) problem = 'not a name'
      if (len(value%text) > longest_name) problem = 'a name of more than 48 letters'
    else if (len(value%text) > longest_text) then
      problem = 'a text of more than 500 letters'
    end if
  end function problem_of_text

  pure function problem_of_range(x, key) result(problem)
    real(wp),    intent(in) :: x
    type(key_t), intent(in) :: key
    character(:), allocatable :: problem
    logical :: outside

    outside = x < key%range%lower .or. (key%range%above .and. x <= key%range%lower)
    if (is_set(key%range%upper)) outside = outside .or. x > key%range%upper &
      .or. (key%range%below .and. x >= key%range%upper)
    problem = ''
    if (outside) problem = 'out of range'
  end function problem_of_range

  !> The end of a message: the name that was probably meant, if there is a similar one.
  pure function did_you_mean(word, candidates) result(text)
    character(*), intent(in) :: word, candidates(:)
    character(:), allocatable :: text

    text = nearest_name(word, candidates)
    if (text /= '') text = ', did you mean '''//text//'''?'
  end function did_you_mean

  pure function with_unit(allowed, key) result(text)
    character(*), intent(in) :: allowed
    type(key_t),  intent(in) :: key
    character(:), allocatable :: text

    text = allowed
    if (key%unit /= '' .and. key%unit /= '1') text = text//' ['//trim(key%unit)//']'
  end function with_unit

  pure function as_written(value) result(text)
    type(namelist_value_t), intent(in) :: value
    character(:), allocatable :: text

    text = shortened(value%text)
    if (value%quoted) text = ''''//text//''''
  end function as_written

  !> How often a group is given in the file.
  pure integer function count_groups(groups, name) result(n)
    type(namelist_group_t), intent(in) :: groups(:)
    character(*),           intent(in) :: name
    integer :: i

    n = 0
    do i = 1, size(groups)
      if (groups(i)%name == name) n = n + 1
    end do
  end function count_groups

  !> The k-th group of a name; one without entries and with line 0 if there is none.
  pure function group_named(groups, name, k, path) result(group)
    type(namelist_group_t), intent(in) :: groups(:)
    character(*),           intent(in) :: name, path
    integer,                intent(in) :: k
    type(namelist_group_t) :: group
    integer :: i, n

    n = 0
    do i = 1, size(groups)
      if (groups(i)%name /= name) cycle
      n = n + 1
      if (n < k) cycle
      group = groups(i)
      return
    end do
    group%file = path
    group%name = name
    allocate (group%entries(0))
  end function group_named

  !> Whether a group has a key, damaged or not.
  pure logical function is_given(group, name)
    type(namelist_group_t), intent(in) :: group
    character(*),           intent(in) :: name

    is_given = group%find(name) > 0
  end function is_given

  !> Whether a key that the group has was found wrong.
  pure logical function is_damaged(group, name)
    type(namelist_group_t), intent(in) :: group
    character(*),           intent(in) :: name
    integer :: i

    is_damaged = .false.
    i = group%find(name)
    if (i > 0) is_damaged = group%entries(i)%damaged
  end function is_damaged

  !> Whether any key of the groups of a name was found wrong.
  pure logical function any_damaged(groups, name)
    type(namelist_group_t), intent(in) :: groups(:)
    character(*),           intent(in) :: name
    integer :: i

    any_damaged = .false.
    do i = 1, size(groups)
      if (groups(i)%name == name) any_damaged = any_damaged .or. any(groups(i)%entries%damaged)
    end do
  end function any_damaged

end module pd_input_values
