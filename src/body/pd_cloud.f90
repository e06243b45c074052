!> A point cloud from a text file: x, y [m], volume [m^2], and optionally the name of the boundary
!> that the point belongs to, one point per line; `#` starts a comment.
!>
!> Source: doc/input.md, point clouds.
module pd_cloud
  use pd_body, only: body_t
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_plain_text, only: letter_length, make_plain, meant_by
  use pd_text, only: integer_text, read_number
  use pd_text_file, only: read_bytes
  implicit none
  private

  public :: read_cloud

  integer, parameter :: longest_line = 512, most_reported = 20
  integer, parameter :: most_bytes = 2000000000
  character(1), parameter :: line_feed = achar(10), carriage_return = achar(13)
  character(*), parameter :: too_long = 'the line is too long'

contains

  !> Body from a file.
  !>
  !> Errors: a file that cannot be read, a line of another form, numbers that are not finite, a
  !> volume that is not positive, an unknown boundary, no point of the body; with line numbers.
  subroutine read_cloud(path, names, body, errors)
    character(*),       intent(in)    :: path
    character(*),       intent(in)    :: names(:)   !! of the boundaries, in their order
    type(body_t),       intent(out)   :: body
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: text
    character(longest_line) :: line
    integer :: at, i, last, n_lines, pass, wrong

    call read_bytes(path, 'the point cloud', most_bytes, text, errors)
    if (errors%count() > 0) return
    if (len(text) > most_bytes) call errors%add('the point cloud is too large', path)
    if (index(text, achar(0)) > 0) call errors%add('the point cloud is not a text file', path, &
      'a byte of value 0')
    if (errors%count() > 0) return
    call make_plain(text)
    wrong = 0
    do pass = 1, 2
      at = 1
      i = 0
      n_lines = 0
      do while (at <= len(text))
        n_lines = n_lines + 1
        last = end_of_line(text, at)
        line = text(at:last)
        ! only a comment may be lost with the end of a line that is too long
        if (last - at + 1 > longest_line .and. index(line, '#') == 0) line = too_long
        at = last + 2
        if (at <= len(text)) at = merge(at + 1, at, text(at - 1:at) == carriage_return//line_feed)
        call strip(line)
        if (len_trim(line) == 0) cycle
        i = i + 1
        if (pass == 2) call read_point(line, n_lines, path, names, i, body, wrong, errors)
      end do
      if (pass == 2) exit
      body%n = i
      allocate (body%position(i, 2), body%volume(i), source=0.0_wp)
      allocate (body%boundary(i), source=0)
      allocate (body%part(i), source=1)
    end do
    if (wrong == 0 .and. errors%count() == 0) call measure(path, body, errors)
  end subroutine read_cloud

  !> Place of the last character of the line that begins at a place.
  pure integer function end_of_line(text, at) result(last)
    character(*), intent(in) :: text
    integer,      intent(in) :: at

    do last = at, len(text)
      if (text(last:last) == line_feed .or. text(last:last) == carriage_return) exit
    end do
    last = last - 1
  end function end_of_line

  !> Remove a comment, tabs and other control characters.
  pure subroutine strip(line)
    character(longest_line), intent(inout) :: line
    integer :: k

    k = index(line, '#')
    if (k > 0) line(k:) = ''
    do k = 1, len_trim(line)
      if (iachar(line(k:k)) < 32) line(k:k) = ' '
    end do
    line = adjustl(line)
  end subroutine strip

  !> Read point i from a line.
  subroutine read_point(line, n_lines, path, names, i, body, wrong, errors)
    character(*),       intent(in)    :: line, path, names(:)
    integer,            intent(in)    :: n_lines, i
    type(body_t),       intent(inout) :: body
    integer,            intent(inout) :: wrong
    type(error_list_t), intent(inout) :: errors
    character(64) :: words(5)
    character(:), allocatable :: problem, what
    real(wp)      :: values(3)
    integer       :: k, n_words

    call split(line, words, n_words)
    if (n_words < 3 .or. n_words > 4 .or. scan(line, '/*;''"') > 0) then
      what = 'a point cannot be read'
      if (n_words == 2) what = 'a point has no volume in column 3'
      call complain(doubt(line, i, what), trim(line), 'x y volume [boundary]')
      return
    end if
    do k = 1, 3
      call read_number(trim(words(k)), values(k), problem)
      if (problem == '') cycle
      what = doubt(line, i, problem)
      call complain(what, words(k), 'x y volume [boundary]', k)
      return
    end do
    body%position(i, :) = values(1:2)
    body%volume(i) = values(3)
    if (.not. values(3) > 0.0_wp) call complain('a volume is not positive', words(3), '> 0', 3)
    if (n_words < 4) return
    do k = 1, size(names)
      if (trim(names(k)) == trim(words(4))) body%boundary(i) = k
    end do
    if (body%boundary(i) == 0) call complain('a boundary is unknown', words(4), &
      'the name of a &boundary of the input file', 4)

  contains

    subroutine complain(what, found, allowed, column)
      character(*),      intent(in) :: what, found, allowed
      integer, optional, intent(in) :: column
      character(:), allocatable :: where

      wrong = wrong + 1
      where = path//', line '//integer_text(n_lines)
      if (present(column)) where = where//', column '//integer_text(column)
      if (wrong <= most_reported) call errors%add(what, where, found, allowed)
      if (wrong == most_reported + 1) call errors%add('more lines are wrong', path)
    end subroutine complain

  end subroutine read_point

  !> The words of a line, separated by blanks or commas, and how many there are: at most one more
  !> than a point can have.
  pure subroutine split(line, words, n_words)
    character(*),  intent(in)  :: line
    character(64), intent(out) :: words(5)
    integer,       intent(out) :: n_words
    integer :: first, last

    words = ''
    n_words = 0
    last = 0
    do while (n_words < size(words))
      first = verify(line(last + 1:), ' ,') + last
      if (first == last) return
      last = scan(line(first:), ' ,') + first - 2
      if (last < first) last = len_trim(line)
      n_words = n_words + 1
      words(n_words) = line(first:last)
    end do
  end subroutine split

  !> What is probably meant by a line that cannot be read, else what is wrong.
  pure function doubt(line, i, otherwise) result(what)
    character(*), intent(in) :: line, otherwise
    integer,      intent(in) :: i   !! number of the point
    character(:), allocatable :: what
    integer :: at, n

    what = otherwise
    at = 1
    do while (at <= len_trim(line))
      n = letter_length(line, at)
      if (meant_by(line(at:at + n - 1)) == '-') &
        what = 'a minus sign that is not that of the keyboard'
      at = at + n
    end do
    if (what /= otherwise) return
    if (index(line, ';') > 0) then
      what = 'blanks or commas separate the values, not semicolons'
    else if (index(line, '.') == 0 .and. index(line, ',') > 0 .and. verify(line, '0123456789,-+ ') &
             == 0 .or. has_decimal_comma(line)) then
      what = 'the decimal sign is a point, a comma separates values'
    else if (i == 1 .and. verify(line(1:1), '+-.0123456789') > 0) then
      what = 'a heading is no point, it begins with #'
    end if
  end function doubt

  !> Whether there is a comma between two digits in a line that separates values by blanks.
  pure logical function has_decimal_comma(line) result(found)
    character(*), intent(in) :: line
    character(*), parameter :: digits = '0123456789'
    integer :: k

    found = .false.
    if (index(trim(line), ' ') == 0) return
    do k = 2, len_trim(line) - 1
      found = found .or. (line(k:k) == ',' .and. index(digits, line(k - 1:k - 1)) > 0 &
        .and. index(digits, line(k + 1:k + 1)) > 0)
    end do
  end function has_decimal_comma

  !> Extent of the points of the body.
  subroutine measure(path, body, errors)
    character(*),       intent(in)    :: path
    type(body_t),       intent(inout) :: body
    type(error_list_t), intent(inout) :: errors
    integer :: k

    if (count(body%boundary == 0) < 3) then
      call errors%add('the point cloud holds fewer than three points of the body', path)
      return
    end if
    do k = 1, 2
      body%lower(k) = minval(body%position(:, k), mask=body%boundary == 0)
      body%upper(k) = maxval(body%position(:, k), mask=body%boundary == 0)
    end do
  end subroutine measure

end module pd_cloud
