!> Words and numbers as text, for reading an input file and naming its mistakes.
module pd_text
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_kinds, only: is_set, wp
  implicit none
  private

  public :: lower_case, is_name, nearest_name, quoted_list, shortened
  public :: number_text, numbers_text, short_number, coordinate_text, integer_text
  public :: read_number, read_integer

  character(*), parameter :: digits = '0123456789'
  character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyz'
  character(*), parameter :: capitals = 'ABCDEFGHIJKLMNOPQRSTUVWXYZ'

contains

  !> The text with A-Z in lower case; every other byte stays.
  pure function lower_case(text) result(small)
    character(*), intent(in) :: text
    character(len(text)) :: small
    integer :: i, k

    small = text
    do i = 1, len(text)
      k = index(capitals, text(i:i))
      if (k > 0) small(i:i) = letters(k:k)
    end do
  end function lower_case

  !> Whether the text is a name: one or more of a-z, 0-9 and _.
  pure logical function is_name(text)
    character(*), intent(in) :: text

    is_name = len(text) > 0 .and. verify(text, letters//digits//'_') == 0
  end function is_name

  !> The candidate that a misspelt word most likely means; empty where none is near.
  pure function nearest_name(word, candidates) result(name)
    character(*), intent(in) :: word, candidates(:)
    character(:), allocatable :: name
    integer, parameter :: longest = 64
    integer :: distance, i, least

    name = ''
    if (len_trim(word) == 0 .or. len_trim(word) > longest) return
    least = max(2, len_trim(word)/2) + 1
    do i = 1, size(candidates)
      distance = edit_distance(lower_case(trim(word)), trim(candidates(i)))
      if (distance >= least) cycle
      least = distance
      name = trim(candidates(i))
    end do
  end function nearest_name

  !> Least number of letters to insert, delete, replace or swap with their neighbour that turns
  !> one word into the other.
  pure integer function edit_distance(a, b) result(distance)
    character(*), intent(in) :: a, b
    integer :: d(-1:len(a), -1:len(b)), cost, i, j

    d = len(a) + len(b)
    d(0:, 0) = [(i, i=0, len(a))]
    d(0, 0:) = [(j, j=0, len(b))]
    do j = 1, len(b)
      do i = 1, len(a)
        cost = merge(0, 1, a(i:i) == b(j:j))
        d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + cost)
        if (i == 1 .or. j == 1) cycle
        if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) &
          d(i, j) = min(d(i, j), d(i - 2, j - 2) + 1)
      end do
    end do
    distance = d(len(a), len(b))
  end function edit_distance

  !> The words as a list: 'a', 'b', 'c'; without the quotes where `bare`.
  pure function quoted_list(words, bare) result(text)
    character(*), intent(in)      :: words(:)
    logical, intent(in), optional :: bare
    character(:), allocatable :: text, quote
    integer :: i

    quote = "'"
    if (present(bare)) then
      if (bare) quote = ''
    end if
    text = ''
    do i = 1, size(words)
      if (i > 1) text = text//', '
      text = text//quote//trim(words(i))//quote
    end do
  end function quoted_list

  !> The text for a message: cut where it is too long, with ? for every byte outside of ASCII.
  pure function shortened(text) result(short)
    character(*), intent(in) :: text
    character(:), allocatable :: short
    integer, parameter :: longest = 60
    integer :: i

    short = trim(text(:min(len(text), longest)))
    do i = 1, len(short)
      if (ichar(short(i:i)) < 32 .or. ichar(short(i:i)) > 126) short(i:i) = '?'
    end do
    if (len_trim(text) > longest) short = short//'...'
  end function shortened

  !> An integer without blanks.
  pure function integer_text(i) result(text)
    integer, intent(in) :: i
    character(:), allocatable :: text
    character(12) :: buffer

    write (buffer, '(i0)') i
    text = trim(buffer)
  end function integer_text

  !> A finite number with the fewest digits that read back to the same bits; 'none' where unset.
  pure function number_text(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text, mantissa
    real(wp), parameter :: rounds_to_infinity = 1.0e300_wp   ! with few digits
    character(25) :: buffer
    character(12) :: form
    real(wp) :: back
    integer  :: e, exponent, n

    if (.not. is_set(x)) then
      text = 'none'
      return
    end if
    do n = merge(16, 0, abs(x) > rounds_to_infinity), 16
      write (form, '(a,i0,a)') '(es25.', n, 'e3)'
      write (buffer, form) x
      if (n == 16) exit
      read (buffer, '(f25.0)') back
      if (transfer(back, 0_int64) == transfer(x, 0_int64)) exit
    end do
    e = index(buffer, 'E')
    read (buffer(e + 1:), '(i5)') exponent
    mantissa = adjustl(buffer(:e - 1))
    text = ''
    if (mantissa(1:1) == '-') then
      text = '-'
      mantissa = mantissa(2:)
    end if
    mantissa = mantissa(1:1)//mantissa(3:)
    text = text//placed_point(mantissa, exponent)
  end function number_text

  !> The digits d1 d2 d3 ... as d1.d2d3... x 10^exponent, without exponent where that reads well.
  pure function placed_point(figures, exponent) result(text)
    character(*), intent(in) :: figures
    integer,      intent(in) :: exponent
    character(:), allocatable :: text, shown
    integer :: n

    shown = trim(figures)
    n = len(shown)
    if (exponent >= 0 .and. exponent <= 6) then
      if (n < exponent + 2) shown = shown//repeat('0', exponent + 2 - n)
      text = shown(:exponent + 1)//'.'//shown(exponent + 2:)
    else if (exponent < 0 .and. exponent >= -4) then
      text = '0.'//repeat('0', -exponent - 1)//shown
    else
      if (n == 1) shown = shown//'0'
      text = shown(1:1)//'.'//shown(2:)//'e'//integer_text(exponent)
    end if
  end function placed_point

  !> A number with up to five significant digits.
  pure function short_number(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text
    character(24) :: buffer
    character(8)  :: form
    integer :: decimals

    if (abs(x) >= 1.0e7_wp .or. (abs(x) < 1.0e-3_wp .and. abs(x) > 0.0_wp)) then
      write (buffer, '(es14.4e3)') x
      text = shortest_exponent(adjustl(buffer))
      return
    else if (abs(x - anint(x)) <= 1.0e-9_wp * abs(x)) then
      write (buffer, '(i0)') nint(x)
    else
      decimals = max(0, 4 - floor(log10(abs(x))))
      write (form, '(a,i0,a)') '(f24.', decimals, ')'
      write (buffer, form) x
      if (decimals > 0) buffer = buffer(:verify(trim(buffer), '0', back=.true.))
      if (buffer(len_trim(buffer):) == '.') buffer = buffer(:len_trim(buffer) - 1)
    end if
    text = trim(adjustl(buffer))
  end function short_number

  !> A number with exponent without its zeros: 5.0000E+007 as 5e7.
  pure function shortest_exponent(number) result(text)
    character(*), intent(in) :: number
    character(:), allocatable :: text, mantissa
    integer :: e, exponent

    e = scan(number, 'E')
    read (number(e + 1:), '(i5)') exponent
    mantissa = number(:verify(number(:e - 1), '0', back=.true.))
    if (mantissa(len(mantissa):) == '.') mantissa = mantissa(:len(mantissa) - 1)
    text = mantissa//'e'//integer_text(exponent)
  end function shortest_exponent

  !> A coordinate to a thousandth of a length, however far it is from the origin.
  pure function coordinate_text(x, length) result(text)
    real(wp), intent(in) :: x, length   !! length > 0
    character(:), allocatable :: text
    real(wp), parameter :: farthest = 1.0e15_wp   ! no more digits are good
    character(40) :: buffer
    character(8)  :: form
    integer :: decimals

    decimals = min(20, max(0, 3 - floor(log10(length))))
    if (.not. abs(x) < farthest) then
      text = short_number(x)
      return
    end if
    write (form, '(a,i0,a)') '(f40.', decimals, ')'
    write (buffer, form) x
    if (decimals > 0) buffer = buffer(:verify(trim(buffer), '0', back=.true.))
    if (buffer(len_trim(buffer):) == '.') buffer = buffer(:len_trim(buffer) - 1)
    text = trim(adjustl(buffer))
    if (text == '-0') text = '0'
  end function coordinate_text

  !> Read a real number: [+-]digits[.digits][e|d[+-]digits]. `problem` says what is wrong with it,
  !> and is empty if nothing is.
  !>
  !> Magnitudes outside 1e-100 ... 1e100 are refused here, before the run-time library sees them:
  !> it would raise a floating-point exception, and so would products of a few such numbers.
  pure subroutine read_number(text, x, problem)
    character(*),              intent(in)  :: text
    real(wp),                  intent(out) :: x
    character(:), allocatable, intent(out) :: problem
    integer, parameter :: longest = 100, largest_exponent = 100
    character(longest) :: buffer
    integer :: exponent, first, n_before, point, split, status
    logical :: is_zero

    x = 0.0_wp
    problem = ''
    if (len(text) > longest) then
      problem = 'a number of more than 100 characters'
      return
    end if
    buffer = lower_case(text)
    split = scan(buffer, 'ed')
    if (split == 0) split = len(text) + 1
    first = 1
    if (scan(buffer(1:1), '+-') == 1) first = 2
    if (.not. (is_mantissa(buffer(first:split - 1)) &
               .and. is_exponent(buffer(split:len(text))))) then
      problem = 'not a number'
      return
    end if

    exponent = 0
    if (split < len(text)) then
      if (len(text) - split > 6) then
        exponent = 9999
        if (buffer(split + 1:split + 1) == '-') exponent = -9999
      else
        read (buffer(split + 1:len(text)), '(i6)', iostat=status) exponent
      end if
    end if
    point = index(buffer(first:split - 1), '.')
    if (point == 0) point = split - first + 1
    n_before = scan(buffer(first:split - 1), '123456789')
    is_zero = n_before == 0
    if (.not. is_zero) then
      exponent = exponent + point - n_before - merge(1, 0, n_before < point)
      if (abs(exponent) >= largest_exponent) then
        problem = 'a number outside 1e-100 to 1e100 in magnitude'
        return
      end if
      if (split <= len(text)) buffer(split:split) = 'e'
      read (buffer(:len(text)), '(f100.0)', iostat=status) x
      if (status /= 0) problem = 'not a number'
    end if
  end subroutine read_number

  !> Digits with at most one point among them, at least one digit.
  pure logical function is_mantissa(text)
    character(*), intent(in) :: text

    is_mantissa = scan(text, digits) > 0 .and. verify(text, digits//'.') == 0 &
      .and. index(text, '.') == index(text, '.', back=.true.)
  end function is_mantissa

  !> Nothing, or e or d, perhaps a sign, and at least one digit.
  pure logical function is_exponent(text)
    character(*), intent(in) :: text
    integer :: first

    is_exponent = len(text) == 0
    if (len(text) < 2) return
    first = 2
    if (scan(text(2:2), '+-') == 1) first = 3
    is_exponent = len(text) >= first .and. verify(text(first:), digits) == 0
  end function is_exponent

  !> Read a whole number of at most nine digits; `problem` says what is wrong with it.
  pure subroutine read_integer(text, i, problem)
    character(*),              intent(in)  :: text
    integer,                   intent(out) :: i
    character(:), allocatable, intent(out) :: problem
    integer :: first, status

    i = 0
    problem = ''
    first = 1
    if (len(text) > 0) then
      if (scan(text(1:1), '+-') == 1) first = 2
    end if
    if (len(text) < first .or. verify(text(first:), digits) /= 0) then
      problem = 'not a whole number'
    else if (len(text) - first + 1 > 9) then
      problem = 'a whole number of more than nine digits'
    else
      read (text, '(i10)', iostat=status) i
      if (status /= 0) problem = 'not a whole number'
    end if
  end subroutine read_integer

  !> Numbers separated by commas, each as `number_text` writes it.
  pure function numbers_text(numbers) result(text)
    real(wp), intent(in) :: numbers(:)
    character(:), allocatable :: text
    character(26 * max(1, size(numbers))) :: buffer
    character(:), allocatable :: number
    integer :: i, n

    n = 0
    do i = 1, size(numbers)
      number = number_text(numbers(i))
      if (i < size(numbers)) number = number//', '
      buffer(n + 1:n + len(number)) = number
      n = n + len(number)
    end do
    text = buffer(:n)
  end function numbers_text

end module pd_text
