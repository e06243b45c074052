!> Values of all points on their way to the disk, one rank after the other: rank 0 writes, and has
!> room for those of one rank at a time.
!>
!> Every rank must come to these calls, also where the file is not good.
module pd_parts
  use pd_blocks, only: blocks_t
  use pd_errors, only: error_list_t
  use pd_gather, only: points_of_rank
  use pd_hdf5, only: hdf5_file_t, overwrite_some_rows, reserve_dataset
  use pd_kinds, only: wp
  implicit none
  private

  public :: put_parts, put_field, write_in_parts, reserve_values, as_column

contains

  !> Write what each rank has of its points into an existing dataset.
  subroutine put_parts(file, name, blocks, row, values, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    integer,            intent(in)    :: row(:)          !! of every point, ascending
    real(wp),           intent(in)    :: values(:, :)    !! (components,points)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: part(:, :)
    integer :: ends(2), k

    do k = 0, blocks%ranks%count - 1
      if (k /= blocks%ranks%mine .and. blocks%ranks%mine > 0) cycle
      ends = points_of_rank(blocks, row, k)
      allocate (part(size(values, 1), max(0, ends(2) - ends(1) + 1)))
      if (k == blocks%ranks%mine) part = values(:, ends(1):ends(2))
      call blocks%ranks%hand_over(k, part)
      if (blocks%ranks%mine == 0) call overwrite_some_rows(file, name, ends(1), part, errors)
      deallocate (part)
    end do
  end subroutine put_parts

  !> The same of a field.
  subroutine put_field(file, name, blocks, row, field, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    integer,            intent(in)    :: row(:)        !! of every point, ascending
    real(wp),           intent(in)    :: field(:, :)   !! (rows,components)
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: values(:, :)
    integer :: ends(2), i

    allocate (values(size(field, 2), size(row)))   ! takes memory where it is written
    ends = points_of_rank(blocks, row, blocks%ranks%mine)
    do i = ends(1), ends(2)
      values(:, i) = field(row(i), :)
    end do
    call put_parts(file, name, blocks, row, values, errors)
  end subroutine put_field

  !> Write a field at the points into a new dataset.
  subroutine write_in_parts(file, name, blocks, row, field, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    type(blocks_t),     intent(in)    :: blocks
    integer,            intent(in)    :: row(:)        !! of every point, ascending
    real(wp),           intent(in)    :: field(:, :)   !! (rows,components)
    type(error_list_t), intent(inout) :: errors

    if (blocks%ranks%mine == 0) &
      call reserve_values(file, name, [size(row), size(field, 2)], errors)
    call put_field(file, name, blocks, row, field, errors)
  end subroutine write_in_parts

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
