!> Values of all points on their way to the disk, one rank after the other: rank 0 writes, and has
!> room for a part of those of one rank at a time.
!>
!> Every rank must come to these calls, also where the file is not good.
module pd_parts
  use pd_blocks, only: blocks_t
  use pd_body, only: body_t
  use pd_errors, only: error_list_t
  use pd_gather, only: points_of_rank
  use pd_hdf5, only: hdf5_file_t, overwrite_part, overwrite_some_rows, reserve_dataset, &
    reserve_whole_numbers
  use pd_kinds, only: wp
  use pd_storage, only: storage_t
  implicit none
  private

  public :: put_parts, put_field, write_in_parts, write_boundaries, write_numbers, &
    reserve_values, as_column

  integer, parameter :: most = 2**15   ! points at a time

contains

  !> Write what each rank has of its points into an existing dataset.
  subroutine put_parts(file, name, blocks, storage, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    type(storage_t),    intent(in)    :: storage         !! rows of the points
    real(wp),           intent(in)    :: values(:, :)    !! (components,points)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: part(:, :)
    integer :: ends(2), first, k, last

    do k = 0, blocks%ranks%count - 1
      if (k /= blocks%ranks%mine .and. blocks%ranks%mine > 0) cycle
      ends = points_of_rank(blocks, storage, k)
      do first = ends(1), ends(2), most
        last = min(ends(2), first + most - 1)
        part = values(:, first:last)   ! those of another rank: anything, until it hands them over
        call blocks%ranks%hand_over(k, part)
        if (blocks%ranks%mine == 0) call overwrite_some_rows(file, name, first, part, errors)
      end do
    end do
  end subroutine put_parts

  !> The same of a field.
  subroutine put_field(file, name, blocks, storage, field, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    type(storage_t),    intent(in)    :: storage       !! rows of the points
    real(wp),           intent(in)    :: field(:, :)   !! (rows,components)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:, :)
    integer :: ends(2), i

    allocate (values(size(field, 2), storage%n))   ! takes memory where it is written
    ends = points_of_rank(blocks, storage, blocks%ranks%mine)
    associate (rows => storage%rows_of(ends))
      do i = ends(1), ends(2)
        values(:, i) = field(rows(i - ends(1) + 1), :)
      end do
    end associate
    call put_parts(file, name, blocks, storage, values, errors)
  end subroutine put_field

  !> Write a field at the points into a new dataset.
  subroutine write_in_parts(file, name, blocks, storage, field, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    type(storage_t),    intent(in)    :: storage       !! rows of the points
    real(wp),           intent(in)    :: field(:, :)   !! (rows,components)
    type(error_list_t), intent(inout) :: errors

    if (blocks%ranks%mine == 0) &
      call reserve_values(file, name, [storage%n, size(field, 2)], errors)
    call put_field(file, name, blocks, storage, field, errors)
  end subroutine write_in_parts

  !> Write the boundaries of all points, which every rank knows, into a new dataset.
  subroutine write_boundaries(file, name, body, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(body_t),       intent(in)    :: body
    type(error_list_t), intent(inout) :: errors
    integer :: first, last

    call reserve_whole_numbers(file, name, [body%n], errors)
    do first = 1, body%n, most
      last = min(body%n, first + most - 1)
      call overwrite_part(file, name, first, real(body%boundaries([first, last]), wp), errors)
    end do
  end subroutine write_boundaries

  !> Write the numbers of n points, from 0, into a new dataset: they are the cells of the XDMF file.
  subroutine write_numbers(file, name, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: part(:, :)   ! on the heap
    integer :: first, k, last

    allocate (part(1, most))
    call reserve_whole_numbers(file, name, [n, 1], errors)
    do first = 1, n, most
      last = min(n, first + most - 1)
      do k = first, last
        part(1, k - first + 1) = real(k - 1, wp)
      end do
      call overwrite_some_rows(file, name, first, part(:, :last - first + 1), errors)
    end do
  end subroutine write_numbers

  !> A dataset for the values of points; with one component of rank 1.
  subroutine reserve_values(file, name, numbers, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: numbers(2)   !! points, components
    type(error_list_t), intent(inout) :: errors

    call reserve_dataset(file, name, numbers(:merge(1, 2, numbers(2) == 1)), errors)
  end subroutine reserve_values

  !> A field of numbers as one with a single component, in the same place.
  function as_column(numbers) result(column)
    real(wp), intent(in), contiguous, target :: numbers(:)
    real(wp), pointer :: column(:, :)

    column(1:size(numbers), 1:1) => numbers
  end function as_column

end module pd_parts
