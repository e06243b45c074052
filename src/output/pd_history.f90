!> The history `<stem>_history.csv`: rows of numbers, written during a run.
!>
!> Numbers have 17 significant digits, so a row read back is exact. Every row is handed to the
!> operating system at once: a kill loses at most the row being written. A restart cuts the file
!> back to the rows before the checkpoint and goes on from there, with the same bytes.
module pd_history
  use, intrinsic :: iso_fortran_env, only: iostat_end
  use pd_errors, only: error_list_t
  use pd_files, only: check_in_place, close_output, flush_output, open_output, output_file_t, &
    replace_file, write_line
  use pd_kinds, only: i8, wp
  use pd_observe, only: column_t
  use pd_system, only: remove_file
  use pd_text, only: integer_text
  implicit none
  private

  public :: history_t, create_history, read_history, resume_history, write_row, close_history

  !> A history that is being written.
  type :: history_t
    integer :: rows = 0   !! rows written so far, those before a restart among them
    logical, allocatable, private :: whole(:)   !! of the columns: whole numbers
    type(output_file_t), private :: file
  end type history_t

  character(*), parameter :: missing = &
    'the history of the run that is to go on is missing or cannot be read'

contains

  !> Start a history, replacing one of that name.
  !>
  !> Errors: the file cannot be written.
  subroutine create_history(history, stem, columns, errors)
    type(history_t),    intent(out)   :: history
    character(*),       intent(in)    :: stem   !! output folder and name of the run
    type(column_t),     intent(in)    :: columns(:)
    type(error_list_t), intent(inout) :: errors

    history%whole = columns%whole_number
    call open_output(history%file, stem//'_history.csv', .false., errors)
    call write_line(history%file, header(columns), errors)
    call flush_output(history%file, errors)
  end subroutine create_history

  !> Go on with the history of a run that was cut off, behind its first `rows` rows.
  !>
  !> Errors: the file is missing, has other columns or too few rows, or cannot be written; it is
  !> then as it was.
  subroutine resume_history(history, stem, columns, rows, errors)
    type(history_t),    intent(out)   :: history
    character(*),       intent(in)    :: stem
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: rows   !! written up to the checkpoint
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: path
    integer :: before

    path = stem//'_history.csv'
    before = errors%count()
    call cut_back(path, header(columns), rows, errors)
    if (errors%count() > before) return
    history%whole = columns%whole_number
    history%rows = rows
    call open_output(history%file, path, .true., errors)
  end subroutine resume_history

  !> Append a row and hand it to the operating system.
  !>
  !> Errors: the file cannot be written to; reported once.
  subroutine write_row(history, values, errors)
    type(history_t),    intent(inout) :: history
    real(wp),           intent(in)    :: values(:)   !! in the order of the columns
    type(error_list_t), intent(inout) :: errors

    call write_line(history%file, comma_separated(values, history%whole), errors)
    call flush_output(history%file, errors)
    call check_in_place(history%file, errors)
    if (history%file%is_open()) history%rows = history%rows + 1
  end subroutine write_row

  !> The first rows of the history of a run that was cut off.
  !>
  !> Errors: the file is missing, has other columns or too few rows, or a row is not as it was
  !> written.
  subroutine read_history(stem, columns, rows, values, errors)
    character(*),          intent(in)    :: stem
    type(column_t),        intent(in)    :: columns(:)
    integer,               intent(in)    :: rows          !! written up to the checkpoint
    real(wp), allocatable, intent(out)   :: values(:, :)  !! (columns,rows)
    type(error_list_t),    intent(inout) :: errors
    character(:), allocatable :: line, path
    integer :: unit, status, i, before

    before = errors%count()
    path = stem//'_history.csv'
    allocate (values(size(columns), rows), source=0.0_wp)
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) then
      call errors%add(missing, where=path)
      return
    end if
    do i = 0, rows
      call read_line(unit, line, status)
      if (status /= 0) then
        call report_rows(path, max(i - 1, 0), rows, errors)
      else if (i == 0) then
        call check_header(path, line, header(columns), errors)
      else
        read (line, *, iostat=status) values(:, i)
        if (status == 0 .and. line == comma_separated(values(:, i), columns%whole_number)) cycle
        call errors%add('row '//integer_text(i)//' is not as it was written', where=path, &
          found=line)
      end if
      if (errors%count() > before) exit
    end do
    close (unit)
  end subroutine read_history

  !> Close the history; harmless where it is not open.
  subroutine close_history(history, errors)
    type(history_t),    intent(inout) :: history
    type(error_list_t), intent(inout) :: errors

    call check_in_place(history%file, errors)
    call close_output(history%file, errors)
  end subroutine close_history

  !> Cut a history back to its header and its first `rows` rows, in one step.
  subroutine cut_back(path, header_wanted, rows, errors)
    character(*),       intent(in)    :: path, header_wanted
    integer,            intent(in)    :: rows
    type(error_list_t), intent(inout) :: errors
    type(output_file_t) :: short
    character(:), allocatable :: line
    integer :: unit, status, i, before
    logical :: ignored

    before = errors%count()
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) then
      call errors%add(missing, where=path)
      return
    end if
    call open_output(short, path//'.tmp', .false., errors)
    do i = 0, rows
      call read_line(unit, line, status)
      if (status /= 0) then
        call report_rows(path, max(i - 1, 0), rows, errors)
      else if (i == 0) then
        call check_header(path, line, header_wanted, errors)
      end if
      if (errors%count() > before) exit
      call write_line(short, line, errors)
    end do
    close (unit)
    call close_output(short, errors)
    if (errors%count() == before) call replace_file(path//'.tmp', path, errors)
    if (errors%count() > before) ignored = remove_file(path//'.tmp')
  end subroutine cut_back

  subroutine report_rows(path, found, rows, errors)
    character(*),       intent(in)    :: path
    integer,            intent(in)    :: found, rows
    type(error_list_t), intent(inout) :: errors

    call errors%add('has fewer rows than the checkpoint knows of', where=path, &
      found=integer_text(found), allowed='at least '//integer_text(rows))
  end subroutine report_rows

  subroutine check_header(path, found, wanted, errors)
    character(*),       intent(in)    :: path, found, wanted
    type(error_list_t), intent(inout) :: errors

    if (found /= wanted) call errors%add('has other columns than this run writes', where=path, &
      found=found, allowed=wanted)
  end subroutine check_header

  !> Read a line of any length. A last line that is not ended counts as missing.
  subroutine read_line(unit, line, status)
    integer,                   intent(in)  :: unit
    character(:), allocatable, intent(out) :: line
    integer,                   intent(out) :: status   !! 0: a line
    character(1024) :: part
    integer :: length

    line = ''
    do
      read (unit, '(a)', advance='no', iostat=status, size=length) part
      line = line//part(:length)
      if (is_iostat_eor(status)) then
        status = 0
        return
      end if
      if (status == 0) cycle
      status = iostat_end
      return
    end do
  end subroutine read_line

  pure function header(columns) result(text)
    type(column_t), intent(in) :: columns(:)
    character(:), allocatable :: text
    integer :: k

    text = ''
    do k = 1, size(columns)
      text = text//','//trim(columns(k)%name)
    end do
    text = text(2:)
  end function header

  !> Whole numbers as such, others with 17 significant digits, commas between.
  pure function comma_separated(numbers, whole) result(text)
    real(wp), intent(in) :: numbers(:)
    logical,  intent(in) :: whole(:)
    character(:), allocatable :: text
    integer, parameter :: width = 24   !! of a number with its sign
    character((width + 1) * size(numbers)) :: line
    character(width) :: cells(size(numbers))
    integer :: k, length, more

    write (cells, '(es24.16e3)') numbers
    length = 0
    do k = 1, size(numbers)
      if (whole(k)) write (cells(k), '(i0)') int(numbers(k), i8)
      cells(k) = adjustl(cells(k))
      more = len_trim(cells(k)) + 1
      line(length + 1:length + more) = cells(k)(:more - 1)//','
      length = length + more
    end do
    text = line(:length - 1)
  end function comma_separated

end module pd_history
