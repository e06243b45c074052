!> Quotes and minus signs of word processors in a namelist: found, and put right.
module pd_foreign_letters
  use pd_cursor, only: line_ends, quotes
  use pd_plain_text, only: letter_length, meant_by
  implicit none
  private

  public :: foreign_search_t

  !> How far a text has been looked through.
  type :: foreign_search_t
    integer :: at = 1
    integer :: line = 1                 !! number of the line there
    character(1), private :: quote = '' !! of the text in quotes there, blank outside of one
    logical, private :: foreign = .false.   !! that text began with a quote of a word processor
  contains
    procedure :: next
  end type foreign_search_t

contains

  !> Put right the next quote or minus sign outside of comments and texts in quotes, and tell what
  !> was meant; a blank when there are no more.
  !>
  !> A letter is as long as before, so that places stay: blanks stand outside of a text in quotes,
  !> and before a minus sign.
  pure subroutine next(self, text, meant)
    class(foreign_search_t),   intent(inout) :: self
    character(:), allocatable, intent(inout) :: text
    character(1),              intent(out)   :: meant
    character(1) :: c, closing
    integer :: n

    meant = ''
    do while (self%at <= len(text))
      c = text(self%at:self%at)
      n = letter_length(text, self%at)
      if (index(line_ends, c) > 0) then
        if (ends_line(text, self%at)) self%line = self%line + 1
        self%quote = ''
      else if (self%quote /= '') then
        closing = meant_by(text(self%at:self%at + n - 1))
        if (self%foreign .and. closing /= '' .and. closing /= '-') then
          text(self%at:self%at + n - 1) = self%quote   ! blanks behind it
        end if
        if (text(self%at:self%at) == self%quote) self%quote = ''
      else if (c == '!') then
        n = scan(text(self%at:), line_ends) - 1
        if (n < 0) n = len(text) - self%at + 1
      else if (index(quotes, c) > 0) then
        self%quote = c
        self%foreign = .false.
      else
        meant = meant_by(text(self%at:self%at + n - 1))
      end if
      if (meant /= '') then
        call put_right(text, self%at, n, meant)
        self%foreign = index(quotes, meant) > 0
        if (self%foreign) self%quote = meant
      end if
      self%at = self%at + n
      if (meant /= '') return
    end do
  end subroutine next

  pure subroutine put_right(text, at, n, meant)
    character(:), allocatable, intent(inout) :: text
    integer,      intent(in) :: at, n
    character(1), intent(in) :: meant

    text(at:at + n - 1) = ''
    text(at + n - 1:at + n - 1) = meant
  end subroutine put_right

  !> Whether a line end ends a line: LF, or a CR without LF behind it.
  pure logical function ends_line(text, at)
    character(*), intent(in) :: text
    integer,      intent(in) :: at

    ends_line = text(at:at) == achar(10)
    if (ends_line) return
    ends_line = .true.
    if (at < len(text)) ends_line = text(at + 1:at + 1) /= achar(10)
  end function ends_line

end module pd_foreign_letters
