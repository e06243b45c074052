!> The history in a result file: /history/<column>, one dataset per column.
!>
!> Space for the rows as planned is allocated with the file; it changes only where the time step has
!> changed their number. They are filled in bunches: first the data, which are handed to the
!> operating system, then `written`, the number of valid rows. A kill at any moment loses at most
!> the rows of the last bunch.
module pd_rows
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use pd_errors, only: error_list_t
  use pd_frames, only: write_label
  use pd_hdf5, only: create_group, flush_file, hdf5_file_t, overwrite_part, read_attribute, &
    read_dataset, remove_object, reserve_dataset, reserve_whole_numbers, write_attribute
  use pd_kinds, only: wp
  use pd_observe, only: column_t
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: reserve_rows, put_rows, check_rows, compare_rows, copy_rows, resize_rows, rows_in

  character(*), parameter :: group = '/history'

contains

  !> Create the history without rows, and allocate the space of n rows on the disk.
  subroutine reserve_rows(file, columns, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors
    integer :: k

    call create_group(file, group, errors)
    call write_attribute(file, group, 'rows', n, errors)
    call write_attribute(file, group, 'written', 0, errors)
    call write_attribute(file, group, 'columns', names_of(columns), errors)
    do k = 1, size(columns)
      call reserve_column(file, columns(k), n, errors)
    end do
  end subroutine reserve_rows

  subroutine reserve_column(file, column, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: column
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors

    if (column%whole_number) then
      call reserve_whole_numbers(file, place_of(column), [n], errors)
    else
      call reserve_dataset(file, place_of(column), [n], errors)
    end if
    call write_label(file, place_of(column), column%label_t, errors)
  end subroutine reserve_column

  !> Write rows after the first `written` ones, and count them as written.
  subroutine put_rows(file, columns, written, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: written
    real(wp),           intent(in)    :: values(:, :)   !! (columns,rows)
    type(error_list_t), intent(inout) :: errors
    integer :: k

    do k = 1, size(columns)
      call overwrite_part(file, place_of(columns(k)), written + 1, values(k, :), errors)
    end do
    call flush_file(file, errors)
    call write_attribute(file, group, 'written', written + size(values, 2), errors)
  end subroutine put_rows

  !> Report an error unless a file has these columns and at least n rows.
  subroutine check_rows(file, columns, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: found
    integer :: written

    call read_attribute(file, group, 'columns', found, errors)
    call read_attribute(file, group, 'written', written, errors)
    if (.not. file%is_good()) return
    if (found /= names_of(columns)) then
      call errors%add('the history has other columns than this run writes', where=file%path, &
        found=found, allowed=names_of(columns))
    else if (written < n) then
      call errors%add('the history has fewer rows than the checkpoint knows of', &
        where=file%path, found=integer_text(written), allowed='at least '//integer_text(n))
    end if
  end subroutine check_rows

  !> Rows that are in a file.
  integer function rows_in(file, errors) result(rows)
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors

    rows = 0
    call read_attribute(file, group, 'written', rows, errors)
  end function rows_in

  !> Report an error unless the rows of a file are the given ones, as far as it has them: the same
  !> numbers stand in the CSV file, and damage shows.
  subroutine compare_rows(file, columns, rows, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: columns(:)
    real(wp),           intent(in)    :: rows(:, :)   !! (columns,rows)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:)
    integer :: n, i, k, before

    before = errors%count()
    call check_rows(file, columns, 0, errors)
    if (errors%count() > before) return
    n = min(rows_in(file, errors), size(rows, 2))
    do k = 1, size(columns)
      call read_dataset(file, place_of(columns(k)), values, errors)
      if (.not. file%is_good()) return
      do i = 1, n
        if (same_number(values(i), rows(k, i))) cycle
        call errors%add('row '//integer_text(i)//' of '//trim(columns(k)%name)//' is not that '// &
          'of the CSV file: one of the two is damaged', where=file%path, &
          found=number_text(values(i)), allowed=number_text(rows(k, i)))
        return
      end do
    end do
  end subroutine compare_rows

  pure logical function same_number(a, b) result(same)
    real(wp), intent(in) :: a, b

    same = abs(a - b) <= 0.0_wp .or. (ieee_is_nan(a) .and. ieee_is_nan(b))
  end function same_number

  !> Copy the first n rows from one result file into another.
  subroutine copy_rows(old, new, columns, n, errors)
    type(hdf5_file_t),  intent(inout) :: old, new
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:), rows(:, :)
    integer :: k

    allocate (rows(size(columns), n))
    do k = 1, size(columns)
      call read_dataset(old, place_of(columns(k)), values, errors)
      if (.not. old%is_good()) return
      rows(k, :) = values(:n)
    end do
    call put_rows(new, columns, 0, rows, errors)
  end subroutine copy_rows

  !> Change the space to that of n rows, at least those that are written.
  subroutine resize_rows(file, columns, written, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(column_t),     intent(in)    :: columns(:)
    integer,            intent(in)    :: written, n
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:)
    integer :: k

    do k = 1, size(columns)
      call read_dataset(file, place_of(columns(k)), values, errors)
      if (.not. file%is_good()) return
      call remove_object(file, place_of(columns(k)), errors)
      call reserve_column(file, columns(k), n, errors)
      call overwrite_part(file, place_of(columns(k)), 1, values(:written), errors)
    end do
    call write_attribute(file, group, 'rows', n, errors)
  end subroutine resize_rows

  pure function place_of(column) result(place)
    type(column_t), intent(in) :: column
    character(:), allocatable :: place

    place = group//'/'//trim(column%name)
  end function place_of

  !> The names of the columns in their order, blank between.
  pure function names_of(columns) result(names)
    type(column_t), intent(in) :: columns(:)
    character(:), allocatable :: names
    integer :: k

    names = ''
    do k = 1, size(columns)
      names = names//' '//trim(columns(k)%name)
    end do
    names = trim(adjustl(names))
  end function names_of

end module pd_rows
