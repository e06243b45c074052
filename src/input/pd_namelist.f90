!> Scanner of namelist files: text -> groups of keys with their values, as written.
!>
!> Fortran's own namelist read is not used: it stops at the first mistake, cannot tell a missing
!> `/` from a missing group, leaves values set after an error and ignores a group that is given
!> twice. This scanner reports all mistakes at once, each with its line.
!>
!> Accepted: &group key = values ... /, names without regard to case, values and keys separated by
!> blanks, tabs, commas or line ends of any kind, `!` comments, texts in '...' or "..." with the
!> quote doubled inside, repeat counts (3*0.0). Not accepted: null values (a = ,,), indexed keys
!> (a(2) = 1), `&end`, texts that continue on the next line.
module pd_namelist
  use pd_cursor, only: blanks, cursor_t, line_ends, quotes
  use pd_errors, only: error_list_t
  use pd_foreign_letters, only: foreign_search_t
  use pd_namelist_groups, only: lengthen, namelist_entry_t, namelist_group_t, namelist_value_t
  use pd_plain_text, only: make_plain
  use pd_text, only: integer_text, is_name, lower_case, read_integer, shortened
  implicit none
  private

  public :: scan_namelist, max_problems

  !> No more problems than this are listed: a file that is no namelist at all has thousands.
  integer, parameter :: max_problems = 200

  integer, parameter :: max_values = 10000    !! of one key
  integer, parameter :: max_keys = 1000       !! of one group
  integer, parameter :: max_groups = 1000
  integer, parameter :: max_total = 200000    !! values of a file

  !> The text with a cursor, and what has been found so far.
  type, extends(cursor_t) :: scanner_t
    character(:), allocatable :: file
    integer :: n_values = 0
    logical :: stopped = .false.
  end type scanner_t

contains

  !> Split the text of a namelist file into groups, in their order.
  !>
  !> Errors: every breach of the syntax, with file and line; after `max_problems` of them the rest
  !> of the file is ignored.
  subroutine scan_namelist(path, text, groups, errors, complete)
    character(*),                        intent(in)    :: path, text
    type(namelist_group_t), allocatable, intent(out)   :: groups(:)
    type(error_list_t),                  intent(inout) :: errors
    logical,                  optional,  intent(out)   :: complete   !! the whole file was read
    type(scanner_t) :: scanner
    type(namelist_group_t), allocatable :: list(:)
    integer :: i, n

    scanner%file = path
    scanner%text = text
    call make_plain(scanner%text)
    call check_characters(scanner, errors)
    call check_letters(scanner, errors)
    allocate (list(16))
    n = 0
    do while (.not. scanner%stopped)
      call scanner%skip_blank()
      if (scanner%next() == '') exit
      if (scanner%next() /= '&') then
        call skip_outside(scanner, errors)
      else if (n == max_groups) then
        call complain(scanner, errors, 'more than 1000 groups', scanner%line)
        scanner%stopped = .true.
      else
        if (n == size(list)) call lengthen(list)
        n = n + 1
        call scan_group(scanner, list(n), errors)
      end if
    end do
    allocate (groups(n))
    do i = 1, n
      groups(i) = list(i)
    end do
    if (present(complete)) complete = .not. scanner%stopped
  end subroutine scan_namelist

  !> Report control characters; a byte of zero means that this is no text file, and ends the scan.
  subroutine check_characters(scanner, errors)
    type(scanner_t),    intent(inout) :: scanner
    type(error_list_t), intent(inout) :: errors
    integer :: code, first, i, line, n

    if (index(scanner%text, achar(0)) > 0) then
      call errors%add('the input file is not a text file', where=scanner%file, &
                      found='a byte of value 0')
      scanner%stopped = .true.
      return
    end if
    n = 0
    line = 1
    first = 0
    do i = 1, len(scanner%text)
      code = ichar(scanner%text(i:i))
      if (code == 10) line = line + 1
      if (code >= 32 .and. code /= 127) cycle
      if (index(blanks, scanner%text(i:i)) > 0) cycle
      if (n == 0) then
        call complain(scanner, errors, 'control character', line, 'code '//integer_text(code), &
                      'text, tabs and line ends')
      end if
      n = n + 1
      scanner%text(i:i) = ' '
    end do
  end subroutine check_characters

  !> Report quotes and minus signs of word processors, once for each line, and put them right.
  subroutine check_letters(scanner, errors)
    type(scanner_t),    intent(inout) :: scanner
    type(error_list_t), intent(inout) :: errors
    type(foreign_search_t) :: search
    character(1) :: meant
    integer :: line

    line = 0
    do
      call search%next(scanner%text, meant)
      if (meant == '') exit
      if (search%line == line) cycle
      line = search%line
      if (meant == '-') then
        call complain(scanner, errors, 'a minus sign that is not that of the keyboard', line, &
                      'a dash or long minus sign', '-')
      else
        call complain(scanner, errors, 'a quotation mark that is not that of the keyboard', line, &
                      'a curly quotation mark', "' or """)
      end if
    end do
  end subroutine check_letters

  !> Text that belongs to no group: report it once, and go on at the next line that starts with `&`.
  subroutine skip_outside(scanner, errors)
    type(scanner_t),    intent(inout) :: scanner
    type(error_list_t), intent(inout) :: errors

    call complain(scanner, errors, 'text outside of a group', scanner%line, &
                  scanner%rest_of_line(), &
                  'only comments (!) and blank lines between the / of a group and the next &; ' &
                  //'a / outside quotes ends a group')
    do
      call scanner%skip_line()
      call scanner%skip_blank()
      if (scanner%next() == '' .or. scanner%next() == '&') return
    end do
  end subroutine skip_outside

  !> One group, from its & to its /.
  subroutine scan_group(scanner, group, errors)
    type(scanner_t),        intent(inout) :: scanner
    type(namelist_group_t), intent(out)   :: group
    type(error_list_t),     intent(inout) :: errors
    type(namelist_entry_t), allocatable :: list(:)
    integer :: i, n

    group%file = scanner%file
    group%line = scanner%line
    scanner%at = scanner%at + 1
    group%name = lower_case(scanner%token())
    if (group%name == '') call complain(scanner, errors, 'a group without a name', group%line, &
                                        '&'//scanner%rest_of_line(), 'the name follows & directly')
    allocate (list(16))
    n = 0
    do while (.not. scanner%stopped)
      call scanner%skip_blank(commas=.true.)
      if (scanner%next() == '/') then
        scanner%at = scanner%at + 1
        exit
      else if (ends_old_style(scanner)) then
        call complain(scanner, errors, 'group &'//shortened(group%name)//' ends with &end', &
                      scanner%line, allowed='/')
        exit
      else if (scanner%next() == '&' .or. scanner%next() == '') then
        call complain(scanner, errors, 'group &'//shortened(group%name)//' is not ended by /', &
                      group%line)
        exit
      else if (n == max_keys) then
        call complain(scanner, errors, 'more than 1000 keys in one group', scanner%line)
        scanner%stopped = .true.
      else
        if (n == size(list)) call lengthen(list)
        call scan_entry(scanner, group%name, list, n, errors)
      end if
    end do
    allocate (group%entries(n))
    do i = 1, n
      group%entries(i) = list(i)
    end do
  end subroutine scan_group

  !> Whether `&end` comes next; if so it is skipped.
  logical function ends_old_style(scanner) result(ends)
    type(scanner_t), intent(inout) :: scanner
    integer :: start

    ends = .false.
    if (scanner%next() /= '&') return
    start = scanner%at
    scanner%at = start + 1
    ends = lower_case(scanner%token()) == 'end'
    if (.not. ends) scanner%at = start
  end function ends_old_style

  !> One `key = values`, appended to the n entries of the group so far.
  subroutine scan_entry(scanner, group, list, n, errors)
    type(scanner_t),        intent(inout) :: scanner
    character(*),           intent(in)    :: group
    type(namelist_entry_t), intent(inout) :: list(:)
    integer,                intent(inout) :: n
    type(error_list_t),     intent(inout) :: errors
    type(namelist_entry_t) :: entry
    type(error_list_t)     :: ignored
    character(:), allocatable :: found, what
    integer :: i, start
    logical :: has_equals

    entry%line = scanner%line
    start = scanner%at
    found = scanner%rest_of_line()
    entry%key = lower_case(scanner%token())
    has_equals = scanner%is_before_equals()
    if (entry%key == '' .or. .not. has_equals) then
      what = 'a value without a key in &'
      if (is_key(entry%key)) what = 'a key without = in &'
      call complain(scanner, errors, what//shortened(group), entry%line, found, 'key = value')
      scanner%at = start
      if (scanner%next() == '=') scanner%at = start + 1
      call scan_values(scanner, group, entry, ignored)
      return
    end if
    call scanner%skip_blank()
    scanner%at = scanner%at + 1
    if (.not. is_key(entry%key)) then
      if (scan(entry%key, '(%') > 0) then
        call complain(scanner, errors, 'a key with an index in &'//shortened(group), entry%line, &
                      shortened(entry%key), 'all values of a key in one list: key = v1, v2')
      else
        call complain(scanner, errors, 'not a key in &'//shortened(group), entry%line, &
                      shortened(entry%key), 'letters, digits and _')
      end if
      call scan_values(scanner, group, entry, ignored)
      return
    end if
    call scan_values(scanner, group, entry, errors)
    do i = 1, n
      if (list(i)%key /= entry%key) cycle
      call complain(scanner, errors, '&'//shortened(group)//' '//shortened(entry%key) &
                    //' is given twice', entry%line, found, &
                    'once (first in line '//integer_text(list(i)%line)//')')
      return
    end do
    n = n + 1
    list(n) = entry
  end subroutine scan_entry

  !> Whether a word can be a key: letters, digits and _, not beginning with a digit.
  pure logical function is_key(word)
    character(*), intent(in) :: word

    is_key = is_name(word)
    if (is_key) is_key = verify(word(1:1), '0123456789') == 1
  end function is_key

  !> The values after the `=` of a key, up to the next key or the end of the group.
  subroutine scan_values(scanner, group, entry, errors)
    type(scanner_t),        intent(inout) :: scanner
    character(*),           intent(in)    :: group
    type(namelist_entry_t), intent(inout) :: entry
    type(error_list_t),     intent(inout) :: errors
    type(namelist_value_t), allocatable :: list(:)
    character(:), allocatable :: what, word
    integer :: i, n, start, start_line
    logical :: comma_before, starts_key

    allocate (list(4))
    n = 0
    comma_before = .true.
    what = '&'//shortened(group)//' '//shortened(entry%key)
    do while (.not. scanner%stopped)
      call scanner%skip_blank()
      start = scanner%at
      start_line = scanner%line
      if (scanner%next() == '' .or. scanner%next() == '/' .or. scanner%next() == '&') exit
      if (scanner%next() == ',') then
        if (comma_before) call damage('has an empty value', allowed='a value between commas')
        if (.not. allocated(entry%comma)) entry%comma = scanner%number_with_comma()
        comma_before = .true.
        scanner%at = scanner%at + 1
        cycle
      end if
      if (scanner%next() == '=') then
        call damage('has one = too many')
        scanner%at = scanner%at + 1
        cycle
      end if
      if (index(quotes, scanner%next()) == 0) then
        word = scanner%token()
        starts_key = scanner%is_before_equals()
        if (word /= '' .and. starts_key) then
          scanner%at = start
          scanner%line = start_line
          exit
        end if
        scanner%at = start
      end if
      call scan_value(scanner, entry, list, n, errors)
      comma_before = .false.
    end do
    if (n == 0 .and. .not. entry%damaged) call damage('has no value')
    allocate (entry%values(n))
    do i = 1, n
      entry%values(i) = list(i)
    end do

  contains

    subroutine damage(problem, allowed)
      character(*), intent(in)           :: problem
      character(*), intent(in), optional :: allowed

      if (.not. entry%damaged) call complain(scanner, errors, what//' '//problem, entry%line, &
                                             allowed=allowed)
      entry%damaged = .true.
    end subroutine damage

  end subroutine scan_values

  !> One value, with its repeat count: appended to the n values of the entry so far.
  subroutine scan_value(scanner, entry, list, n, errors)
    type(scanner_t),                     intent(inout) :: scanner
    type(namelist_entry_t),              intent(inout) :: entry
    type(namelist_value_t), allocatable, intent(inout) :: list(:)
    integer,                             intent(inout) :: n
    type(error_list_t),                  intent(inout) :: errors
    type(namelist_value_t) :: value
    character(:), allocatable :: problem, word
    integer :: i, repeats, star

    repeats = 1
    word = scanner%token()
    star = index(word, '*')
    if (star > 1) then
      if (verify(word(:star - 1), '0123456789') == 0) then
        call read_integer(word(:star - 1), repeats, problem)
        if (problem /= '' .or. repeats < 1 .or. repeats > max_values) then
          call complain(scanner, errors, shortened(entry%key)//': repeat count', scanner%line, &
                        shortened(word), '1 to 10000')
          entry%damaged = .true.
          repeats = 1
        end if
        word = word(star + 1:)
      end if
    end if
    value%text = word
    if (word == '' .and. len_trim(scanner%next()) > 0 &
        .and. index(quotes, scanner%next()) > 0) then
      call scan_text(scanner, value, entry, errors)
    else if (word == '') then
      call complain(scanner, errors, shortened(entry%key)//' has an empty value', scanner%line)
      entry%damaged = .true.
    end if

    if (n + repeats > max_values .or. scanner%n_values + repeats > max_total) then
      call complain(scanner, errors, shortened(entry%key)//' has too many values', scanner%line, &
                    allowed='at most 10000 values a key and 200000 in the file')
      entry%damaged = .true.
      scanner%stopped = .true.
      return
    end if
    scanner%n_values = scanner%n_values + repeats
    do i = 1, repeats
      if (n == size(list)) call lengthen(list)
      n = n + 1
      list(n) = value
    end do
  end subroutine scan_value

  !> A text in quotes; a doubled quote inside stands for one.
  subroutine scan_text(scanner, value, entry, errors)
    type(scanner_t),        intent(inout) :: scanner
    type(namelist_value_t), intent(inout) :: value
    type(namelist_entry_t), intent(inout) :: entry
    type(error_list_t),     intent(inout) :: errors
    character :: quote
    character(:), allocatable :: found, text
    integer   :: first, i, length
    logical   :: is_closed

    quote = scanner%text(scanner%at:scanner%at)
    found = scanner%rest_of_line()
    is_closed = .false.
    first = scanner%at + 1
    length = 0
    i = first
    do while (i <= len(scanner%text))
      if (index(line_ends, scanner%text(i:i)) > 0) exit
      if (scanner%text(i:i) == quote) then
        is_closed = i == len(scanner%text)
        if (.not. is_closed) is_closed = scanner%text(i + 1:i + 1) /= quote
        if (is_closed) exit
        i = i + 1
      end if
      length = length + 1
      i = i + 1
    end do

    allocate (character(length) :: text)
    scanner%at = i
    i = first
    do length = 1, len(text)
      text(length:length) = scanner%text(i:i)
      if (scanner%text(i:i) == quote) i = i + 1
      i = i + 1
    end do
    value%text = text
    value%quoted = .true.
    if (is_closed) then
      scanner%at = scanner%at + 1
    else
      call complain(scanner, errors, shortened(entry%key)//': a text without its closing quote', &
                    scanner%line, found, "'...' or ""..."" within one line")
      entry%damaged = .true.
    end if
  end subroutine scan_text

  !> Report a problem with its line; the last one allowed says that there are more.
  subroutine complain(scanner, errors, what, line, found, allowed)
    type(scanner_t),    intent(inout)        :: scanner
    type(error_list_t), intent(inout)        :: errors
    character(*),       intent(in)           :: what
    integer,            intent(in)           :: line
    character(*),       intent(in), optional :: found, allowed

    if (errors%count() >= max_problems) then
      if (.not. scanner%stopped) &
        call errors%add('too many mistakes; the rest of the file is not looked at', &
                        where=scanner%file)
      scanner%stopped = .true.
      return
    end if
    call errors%add(what, where=scanner%file//', line '//integer_text(line), found=found, &
                    allowed=allowed)
  end subroutine complain

end module pd_namelist
