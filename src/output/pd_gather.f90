!> Which points are of which rank.
module pd_gather
  use pd_blocks, only: blocks_t
  use pd_storage, only: storage_t
  implicit none
  private

  public :: own_points, points_of_rank

contains

  !> First and last of the points whose rows are of this rank; the last one is before the first
  !> where there are none.
  pure function own_points(blocks, storage) result(ends)
    type(blocks_t),  intent(in) :: blocks
    type(storage_t), intent(in) :: storage   !! rows of the points
    integer :: ends(2)

    ends = [storage%first_point(blocks%first), storage%point_at(blocks%last)]
  end function own_points

  !> The same of any rank.
  pure function points_of_rank(blocks, storage, rank) result(ends)
    type(blocks_t),  intent(in) :: blocks
    type(storage_t), intent(in) :: storage   !! rows of the points
    integer,         intent(in) :: rank
    integer :: ends(2)

    ends = own_points(blocks, storage)
    if (allocated(blocks%ranks%before)) ends = [storage%first_point( &
      blocks%last_row_of(rank - 1) + 1), storage%point_at(blocks%last_row_of(rank))]
  end function points_of_rank

end module pd_gather
