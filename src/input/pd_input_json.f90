!> The reference of the input file for programs: `perigeo --input-reference --json`.
module pd_input_json
  use pd_key_table, only: group_table, key_table
  use pd_keys, only: any_count, group_key_t, key_t, kind_integer, kind_real, kind_text, words_of
  use pd_kinds, only: is_set, wp
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: write_input_json

contains

  !> Write all groups with their keys as one JSON object.
  subroutine write_input_json(unit)
    integer, intent(in) :: unit
    type(group_key_t), allocatable :: groups(:)
    type(key_t),       allocatable :: keys(:)
    integer :: g, k, left

    allocate (groups, source=group_table())
    allocate (keys, source=key_table())
    write (unit, '(a)') '{"groups": ['
    do g = 1, size(groups)
      write (unit, '(a)') ' {"name": '//text(groups(g)%name)//', "required": '// &
        yes_no(groups(g)%required)//', "repeats": '//yes_no(groups(g)%repeats)//', "meaning": '// &
        text(groups(g)%meaning)//', "keys": ['
      left = count(keys%group == groups(g)%name)
      do k = 1, size(keys)
        if (keys(k)%group /= groups(g)%name) cycle
        left = left - 1
        write (unit, '(a)') '  '//key_object(keys(k))//trim(merge(', ', '  ', left > 0))
      end do
      write (unit, '(a)') ' ]}'//trim(merge(', ', '  ', g < size(groups)))
    end do
    write (unit, '(a)') ']}'
  end subroutine write_input_json

  !> One key; what it does not have is null.
  pure function key_object(key) result(object)
    type(key_t), intent(in) :: key
    character(:), allocatable :: object

    object = '{"name": '//text(key%name)//', "type": "'//kind_name(key%kind)//'", "count": '
    if (key%count == any_count) then
      object = object//'"one or more"'
    else
      object = object//integer_text(key%count)
    end if
    object = object//', "unit": '//text_or_null(key%unit)//', "required": '// &
      yes_no(key%required)//', "default": '//text_or_null(key%default)//', "stands_for": '// &
      text_or_null(key%stands_for)//', "range": '//range_object(key)//', "choices": '// &
      choices_of(key)//', "also": '//text_or_null(key%also)//', "meaning": '//text(key%meaning)//'}'
  end function key_object

  pure function kind_name(kind) result(name)
    integer, intent(in) :: kind
    character(:), allocatable :: name

    select case (kind)
    case (kind_text)
      name = 'text'
    case (kind_integer)
      name = 'integer'
    case (kind_real)
      name = 'real'
    case default
      name = 'unknown'
    end select
  end function kind_name

  pure function range_object(key) result(object)
    type(key_t), intent(in) :: key
    character(:), allocatable :: object

    object = 'null'
    if (.not. (is_set(key%range%lower) .or. is_set(key%range%upper))) return
    object = '{"lower": '//number_or_null(key%range%lower)//', "upper": '// &
      number_or_null(key%range%upper)//', "lower_excluded": '//yes_no(key%range%above)// &
      ', "upper_excluded": '//yes_no(key%range%below)//'}'
  end function range_object

  pure function choices_of(key) result(list)
    type(key_t), intent(in) :: key
    character(:), allocatable :: list
    character(len(key%name)), allocatable :: words(:)
    integer :: i

    list = 'null'
    if (key%choices == '') return
    words = words_of(key%choices)
    list = '['
    do i = 1, size(words)
      list = list//text(words(i))
      if (i < size(words)) list = list//', '
    end do
    list = list//']'
  end function choices_of

  pure function number_or_null(x) result(word)
    real(wp), intent(in) :: x
    character(:), allocatable :: word

    word = 'null'
    if (is_set(x)) word = number_text(x)
  end function number_or_null

  pure function text_or_null(value) result(word)
    character(*), intent(in) :: value
    character(:), allocatable :: word

    word = 'null'
    if (value /= '') word = text(value)
  end function text_or_null

  pure function yes_no(x) result(word)
    logical, intent(in) :: x
    character(:), allocatable :: word

    word = trim(merge('true ', 'false', x))
  end function yes_no

  !> A text between quotes; what JSON gives a meaning is escaped.
  pure function text(value) result(word)
    character(*), intent(in) :: value
    character(:), allocatable :: word
    integer :: i

    word = '"'
    do i = 1, len_trim(value)
      if (value(i:i) == '"' .or. value(i:i) == '\') word = word//'\'
      word = word//value(i:i)
    end do
    word = word//'"'
  end function text

end module pd_input_json
