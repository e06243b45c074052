!> A position in the text of a namelist file, and how a scanner moves on from it.
module pd_cursor
  use pd_text, only: lower_case, shortened
  implicit none
  private

  public :: cursor_t, blanks, line_ends, quotes

  character, parameter :: line_feed = achar(10), carriage_return = achar(13), tab = achar(9)
  character(*), parameter :: line_ends = line_feed//carriage_return
  character(*), parameter :: blanks = ' '//tab//line_ends
  character(*), parameter :: quotes = '''"'

  type :: cursor_t
    character(:), allocatable :: text
    integer :: at = 1        !! index of the present character
    integer :: line = 1      !! number of its line
  contains
    procedure :: token
    procedure :: is_before_equals
    procedure :: skip_blank
    procedure :: skip_line
    procedure :: ends_line
    procedure :: length_of_line
    procedure :: rest_of_line
    procedure :: next
    procedure :: number_with_comma
  end type cursor_t

contains

  !> A word: everything up to a blank, comma, slash, equals sign, comment, quote or &. An index in
  !> brackets belongs to it, and so does the slash of a path that should have had quotes.
  function token(self) result(word)
    class(cursor_t), intent(inout) :: self
    character(:), allocatable :: word
    character(*), parameter :: path_letters = 'abcdefghijklmnopqrstuvwxyz0123456789_.'
    character(*), parameter :: stops = blanks//',/=!&'//quotes
    character :: c
    integer   :: i, start
    logical   :: in_brackets, is_word

    start = self%at
    in_brackets = .false.
    is_word = .false.
    i = start
    do while (i <= len(self%text))
      c = lower_case(self%text(i:i))
      if (i == start) is_word = index(path_letters(:26), c) > 0
      if (c == '(') in_brackets = .true.
      if (c == ')') in_brackets = .false.
      if (in_brackets .and. (c == ' ' .or. c == ',')) then
        i = i + 1
        cycle
      end if
      if (c == '/' .and. is_word .and. i < len(self%text)) then
        if (index(path_letters, lower_case(self%text(i + 1:i + 1))) == 0) exit
      else if (index(stops, c) > 0) then
        exit
      end if
      i = i + 1
    end do
    word = self%text(start:i - 1)
    self%at = i
  end function token

  !> Whether `=` comes next, apart from blanks, line ends and comments; the cursor does not move.
  logical function is_before_equals(self) result(is_next)
    class(cursor_t), intent(inout) :: self
    integer :: at, line

    at = self%at
    line = self%line
    call self%skip_blank()
    is_next = self%next() == '='
    self%at = at
    self%line = line
  end function is_before_equals

  !> Skip blanks, line ends and comments, and commas if asked to.
  subroutine skip_blank(self, commas)
    class(cursor_t),   intent(inout) :: self
    logical, optional, intent(in)    :: commas
    character :: c
    logical   :: skip_commas

    skip_commas = .false.
    if (present(commas)) skip_commas = commas
    do while (self%at <= len(self%text))
      c = self%text(self%at:self%at)
      if (c == '!') then
        self%at = self%at + self%length_of_line()
      else if (index(blanks, c) > 0) then
        if (self%ends_line()) self%line = self%line + 1
        self%at = self%at + 1
      else if (c == ',' .and. skip_commas) then
        self%at = self%at + 1
      else
        exit
      end if
    end do
  end subroutine skip_blank

  !> Whether the line ends with the present character: LF, or a CR without LF behind it.
  pure logical function ends_line(self)
    class(cursor_t), intent(in) :: self
    integer :: i

    i = self%at
    ends_line = self%text(i:i) == line_feed
    if (self%text(i:i) /= carriage_return) return
    ends_line = .true.
    if (i < len(self%text)) ends_line = self%text(i + 1:i + 1) /= line_feed
  end function ends_line

  !> Move to the end of the present line.
  pure subroutine skip_line(self)
    class(cursor_t), intent(inout) :: self

    self%at = self%at + self%length_of_line()
  end subroutine skip_line

  !> Characters from the present one to the end of the line.
  pure integer function length_of_line(self) result(n)
    class(cursor_t), intent(in) :: self

    n = scan(self%text(self%at:), line_ends) - 1
    if (n < 0) n = len(self%text) - self%at + 1
  end function length_of_line

  !> The rest of the present line, cut for a message.
  pure function rest_of_line(self) result(text)
    class(cursor_t), intent(in) :: self
    character(:), allocatable :: text
    integer, parameter :: enough = 100   ! lines can be long, messages are not
    integer :: last, n

    last = min(len(self%text), self%at + enough)
    n = scan(self%text(self%at:last), line_ends)
    if (n > 0) last = self%at + n - 2
    text = shortened(self%text(self%at:last))
  end function rest_of_line

  !> The present character; empty at the end of the text.
  pure function next(self) result(c)
    class(cursor_t), intent(in) :: self
    character(:), allocatable :: c

    c = ''
    if (self%at <= len(self%text)) c = self%text(self%at:self%at)
  end function next

  !> The digits on both sides of the comma at the cursor, as in 0,006; empty where a blank or a
  !> point stands there.
  pure function number_with_comma(self) result(word)
    class(cursor_t), intent(in) :: self
    character(:), allocatable :: word
    character(*), parameter :: digits = '0123456789'
    integer :: first, last

    first = verify(self%text(:self%at - 1), digits, back=.true.) + 1
    last = verify(self%text(self%at + 1:), digits)
    last = merge(self%at + last - 1, len(self%text), last > 0)
    word = ''
    if (first == self%at .or. last == self%at) return
    if (first > 1) then
      if (self%text(first - 1:first - 1) == '.') return
    end if
    if (last < len(self%text)) then
      if (self%text(last + 1:last + 1) == '.') return
    end if
    word = self%text(first:last)
  end function number_with_comma

end module pd_cursor
