!> The reference of the input file: all groups and keys, as tables or as JSON.
!>
!> The prose around the tables is in doc/input.md.
module pd_input_reference
  use pd_key_list, only: key_list_t
  use pd_keys, only: allowed_values, group_key_t, key_t, kind_integer, kind_text, words_of
  use pd_kinds, only: is_set, wp
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: write_input_reference, write_input_reference_json

contains

  !> Write a section with a table for each group, as Markdown, on a unit that is open for
  !> formatted writing.
  subroutine write_input_reference(list, unit)
    type(key_list_t), intent(in) :: list
    integer,          intent(in) :: unit
    integer :: g, k

    do g = 1, size(list%groups)
      if (g > 1) call put(unit, '')
      call put(unit, '## &'//trim(list%groups(g)%name)//': '//trim(list%groups(g)%meaning))
      call put(unit, '')
      call put(unit, standing(list%groups(g)))
      call put(unit, '')
      call put(unit, '| key | meaning | unit | default | allowed |')
      call put(unit, '|---|---|---|---|---|')
      do k = 1, size(list%keys)
        if (list%keys(k)%group == list%groups(g)%name) call put(unit, row(list%keys(k)))
      end do
    end do
  end subroutine write_input_reference

  subroutine put(unit, line)
    integer,      intent(in) :: unit
    character(*), intent(in) :: line

    write (unit, '(a)') trim(line)
  end subroutine put

  pure function standing(group) result(text)
    type(group_key_t), intent(in) :: group
    character(:), allocatable :: text

    if (group%required .and. group%repeats) then
      text = 'Required, one or more.'
    else if (group%required) then
      text = 'Required, once.'
    else if (group%repeats) then
      text = 'Optional, may stand several times.'
    else
      text = 'Optional, once.'
    end if
  end function standing

  !> One key as a row of the table of its group.
  pure function row(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text, allowed, default, unit

    unit = trim(key%unit)
    if (unit == '' .and. key%kind == kind_text) unit = '-'
    default = trim(key%stands_for)
    if (default == '' .and. key%default /= '') then
      default = '`'//trim(key%default)//'`'
      if (key%kind == kind_text) default = '`'''//trim(key%default)//'''`'
    end if
    if (key%required) default = '**must be given**'
    if (default == '') default = 'none'
    allowed = allowed_values(key)
    if (key%also /= '') allowed = allowed//'; '//trim(key%also)
    text = '| `'//trim(key%name)//'` | '//trim(key%meaning)//' | '//unit//' | ' &
      //default//' | '//allowed//' |'
  end function row

  !> Write the same as JSON: {"groups": [{..., "keys": [...]}]}.
  subroutine write_input_reference_json(list, unit)
    type(key_list_t), intent(in) :: list
    integer,          intent(in) :: unit
    integer :: g, k, last

    call put(unit, '{"groups": [')
    do g = 1, size(list%groups)
      associate (group => list%groups(g))
        call put(unit, '  {"name": '//quoted(group%name)//', "required": ' &
                 //truth(group%required)//', "repeats": '//truth(group%repeats) &
                 //', "sentence": '//quoted(group%meaning)//', "keys": [')
        last = 0
        do k = 1, size(list%keys)
          if (list%keys(k)%group == group%name) last = k
        end do
        do k = 1, size(list%keys)
          if (list%keys(k)%group /= group%name) cycle
          call put(unit, '    '//object(list%keys(k))//comma(k < last))
        end do
        call put(unit, '  ]}'//comma(g < size(list%groups)))
      end associate
    end do
    call put(unit, ']}')
  end subroutine write_input_reference_json

  pure function comma(more) result(text)
    logical, intent(in) :: more
    character(:), allocatable :: text

    text = ''
    if (more) text = ','
  end function comma

  !> One key as a JSON object. What does not exist is null; `count` null: one or more values.
  pure function object(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text, kind, count, default

    kind = 'real'
    if (key%kind == kind_integer) kind = 'integer'
    if (key%kind == kind_text) kind = 'text'
    count = 'null'
    if (key%count > 0) count = integer_text(key%count)
    default = quoted_or_null(key%default)
    if (key%stands_for /= '') default = 'null'
    text = '{"name": '//quoted(key%name)//', "type": "'//kind//'", "count": '//count &
      //', "unit": '//quoted_or_null(key%unit)//', "default": '//default &
      //', "default_means": '//quoted_or_null(key%stands_for)//', "range": '//range_of(key) &
      //', "choices": '//choices_of(key)//', "required": '//truth(key%required) &
      //', "sentence": '//quoted(key%meaning)//', "also": '//quoted_or_null(key%also)//'}'
  end function object

  !> Bounds of a number, with whether they are allowed themselves.
  pure function range_of(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text

    text = 'null'
    if (.not. (is_set(key%range%lower) .or. is_set(key%range%upper))) return
    text = '{"lower": '//bound(key%range%lower)//', "lower_allowed": ' &
      //truth(.not. key%range%above)//', "upper": '//bound(key%range%upper) &
      //', "upper_allowed": '//truth(.not. key%range%below)//'}'
  end function range_of

  pure function bound(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text

    text = 'null'
    if (is_set(x)) text = number_text(x)
  end function bound

  pure function choices_of(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text
    integer :: i

    text = 'null'
    if (key%choices == '') return
    associate (words => words_of(key%choices))
      text = '['
      do i = 1, size(words)
        text = text//quoted(words(i))//comma(i < size(words))
      end do
    end associate
    text = text//']'
  end function choices_of

  pure function truth(value) result(text)
    logical, intent(in) :: value
    character(:), allocatable :: text

    text = 'false'
    if (value) text = 'true'
  end function truth

  pure function quoted_or_null(words) result(text)
    character(*), intent(in) :: words
    character(:), allocatable :: text

    text = 'null'
    if (words /= '') text = quoted(words)
  end function quoted_or_null

  !> A JSON string; the table holds no control characters.
  pure function quoted(words) result(text)
    character(*), intent(in) :: words
    character(:), allocatable :: text
    integer :: i

    text = '"'
    do i = 1, len_trim(words)
      if (scan(words(i:i), '"\') > 0) text = text//'\'
      text = text//words(i:i)
    end do
    text = text//'"'
  end function quoted

end module pd_input_reference
