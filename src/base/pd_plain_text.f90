!> Text from editors and word processors of all kinds: marks, blanks, quotes and minus signs that
!> look like those of the keyboard.
!>
!> Text is UTF-8 where it can be that, else Latin-1 or Windows-1252. Nothing changes its length, so
!> that places stay what they are.
module pd_plain_text
  implicit none
  private

  public :: make_plain, letter_length, meant_by

  character(*), parameter :: utf8_mark = char(239)//char(187)//char(191)

  character(*), parameter :: no_break = char(194)//char(160)       ! U+00A0
  character(*), parameter :: general = char(226)//char(128)        ! U+2000 to U+203F
  character(*), parameter :: minus_sign = char(226)//char(136)//char(146)   ! U+2212

contains

  !> Put one blank in the place of the mark that some editors put before UTF-8 text, and of every
  !> other kind of blank: no-break, narrow, without width.
  pure subroutine make_plain(text)
    character(:), allocatable, intent(inout) :: text
    integer :: i, last, n

    i = 1
    last = 0
    do while (i <= len(text))
      n = letter_length(text, i)
      if (is_blank(text(i:i + n - 1))) then
        last = last + 1
        text(last:last) = ''
      else
        text(last + 1:last + n) = text(i:i + n - 1)
        last = last + n
      end if
      i = i + n
    end do
    text = text(:last)
  end subroutine make_plain

  pure logical function is_blank(letter)
    character(*), intent(in) :: letter
    integer :: code

    is_blank = letter == no_break .or. letter == utf8_mark
    if (len(letter) == 1) is_blank = ichar(letter) == 160
    if (len(letter) < 3 .or. is_blank) return
    if (letter(:2) /= general) return
    code = ichar(letter(3:3))
    is_blank = (code >= 128 .and. code <= 139) .or. code == 175   ! U+2000 to U+200B, U+202F
  end function is_blank

  !> Bytes of the letter that begins at a place: those of UTF-8, or one where it is none.
  pure integer function letter_length(text, at) result(n)
    character(*), intent(in) :: text
    integer,      intent(in) :: at
    integer :: code, i

    code = ichar(text(at:at))
    n = 1
    if (code >= 194 .and. code <= 223) n = 2
    if (code >= 224 .and. code <= 239) n = 3
    if (code >= 240 .and. code <= 244) n = 4
    if (at + n - 1 > len(text)) n = 1
    do i = at + 1, at + n - 1
      if (ichar(text(i:i)) >= 128 .and. ichar(text(i:i)) <= 191) cycle
      n = 1
      return
    end do
  end function letter_length

  !> The character of the keyboard that a quote or dash of a word processor stands for, or a blank.
  pure function meant_by(letter) result(meant)
    character(*), intent(in) :: letter   !! one letter
    character(1) :: meant
    integer :: code

    meant = ''
    if (letter == minus_sign) meant = '-'
    code = 0
    if (len(letter) == 3) then
      if (letter(:2) == general) code = ichar(letter(3:3))
      if (code >= 144 .and. code <= 149) meant = '-'    ! U+2010 to U+2015
      if (code >= 152 .and. code <= 155) meant = ''''   ! U+2018 to U+201B
      if (code >= 156 .and. code <= 159) meant = '"'    ! U+201C to U+201F
    else if (len(letter) == 1) then
      code = ichar(letter)                              ! Windows-1252
      if (code == 145 .or. code == 146) meant = ''''
      if (code == 147 .or. code == 148) meant = '"'
      if (code == 150 .or. code == 151) meant = '-'
    end if
  end function meant_by

end module pd_plain_text
