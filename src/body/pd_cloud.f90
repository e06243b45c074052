!> A point cloud from a text file: x, y [m], volume [m^2], and optionally the name of the boundary
!> that the point belongs to, one point per line; `#` starts a comment.
!>
!> Source: doc/input.md, point clouds.
module pd_cloud
  use, intrinsic :: iso_fortran_env, only: iostat_end, iostat_eor
  use pd_errors, only: error_list_t
  use pd_geometry, only: body_t
  use pd_kinds, only: wp
  use pd_text, only: read_number
  implicit none
  private

  public :: read_cloud

  integer, parameter :: longest_line = 512, most_reported = 20

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
    character(longest_line) :: line
    integer :: unit, status, n_lines, i, pass, wrong

    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) then
      call errors%add('the point cloud cannot be opened', path)
      return
    end if
    wrong = 0
    do pass = 1, 2
      rewind (unit)
      i = 0
      n_lines = 0
      do
        read (unit, '(a)', advance='no', iostat=status) line
        if (status > 0 .or. status == iostat_end) exit
        n_lines = n_lines + 1
        if (status /= iostat_eor) call skip_the_rest()
        call strip(line)
        if (len_trim(line) == 0) cycle
        i = i + 1
        if (pass == 2) call read_point(line, n_lines, path, names, i, body, wrong, errors)
      end do
      if (status > 0) then
        call errors%add('the point cloud cannot be read', path)
        exit
      end if
      if (pass == 1) then
        body%n = i
        allocate (body%position(i, 2), body%volume(i), source=0.0_wp)
        allocate (body%boundary(i), source=0)
        allocate (body%part(i), source=1)
        status = iostat_end
      end if
    end do
    close (unit)
    if (wrong == 0 .and. errors%count() == 0) call measure(path, body, errors)

  contains

    !> The end of a line that is too long; only a comment may be lost with it.
    subroutine skip_the_rest()
      integer :: rest

      read (unit, '(a)', iostat=rest)
      if (rest > 0 .or. index(line, '#') == 0) line = 'the line is too long'
    end subroutine skip_the_rest

  end subroutine read_cloud

  !> Remove a comment, tabs, commas and carriage returns.
  pure subroutine strip(line)
    character(longest_line), intent(inout) :: line
    integer :: k

    k = index(line, '#')
    if (k > 0) line(k:) = ''
    do k = 1, len_trim(line)
      if (line(k:k) == ',' .or. iachar(line(k:k)) < 32) line(k:k) = ' '
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
    character(32) :: where
    character(:), allocatable :: problem
    real(wp)      :: values(3)
    integer       :: k, status, n_words

    write (where, '(a,i0)') ', line ', n_lines
    words = ''
    ! a correct line ends before its fifth word: status < 0
    read (line, *, iostat=status) words
    n_words = count(words /= '')
    values = 0.0_wp
    status = merge(0, 1, status < 0 .and. (n_words == 3 .or. n_words == 4))
    if (scan(line, '/*;''"') > 0) status = 1   ! they mean something to a list-directed read
    do k = 1, 3
      call read_number(trim(words(k)), values(k), problem)
      if (problem /= '') status = 1
    end do
    if (status /= 0) then
      call complain('a point cannot be read', trim(line), 'x y volume [boundary]')
      return
    end if
    body%position(i, :) = values(1:2)
    body%volume(i) = values(3)
    if (.not. values(3) > 0.0_wp) call complain('a volume is not positive', words(3), '> 0')
    if (n_words < 4) return
    do k = 1, size(names)
      if (trim(names(k)) == trim(words(4))) body%boundary(i) = k
    end do
    if (body%boundary(i) == 0) call complain('a boundary is unknown', words(4), &
      'the name of a &boundary of the input file')

  contains

    subroutine complain(what, found, allowed)
      character(*), intent(in) :: what, found, allowed

      wrong = wrong + 1
      if (wrong <= most_reported) call errors%add(what, path//trim(where), found, allowed)
      if (wrong == most_reported + 1) call errors%add('more lines are wrong', path)
    end subroutine complain

  end subroutine read_point

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
