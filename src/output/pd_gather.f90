!> Which points are of which rank.
module pd_gather
  use pd_blocks, only: blocks_t
  implicit none
  private

  public :: own_points, points_of_rank

contains

  !> First and last of the points whose rows are of this rank; the last one is before the first
  !> where there are none.
  pure function own_points(blocks, row) result(ends)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)   !! of every point, ascending
    integer :: ends(2)

    ends = [points_until(row, blocks%first - 1) + 1, points_until(row, blocks%last)]
  end function own_points

  !> The same of any rank.
  pure function points_of_rank(blocks, row, rank) result(ends)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: row(:)   !! of every point, ascending
    integer,        intent(in) :: rank
    integer :: ends(2)

    ends = own_points(blocks, row)
    if (allocated(blocks%ranks%before)) ends = [points_until(row, &
      blocks%last_row_of(rank - 1)) + 1, points_until(row, blocks%last_row_of(rank))]
  end function points_of_rank

  !> Points whose row is not behind a row.
  pure integer function points_until(row, last) result(points)
    integer, intent(in) :: row(:), last
    integer :: behind, middle

    points = 0
    behind = size(row) + 1
    do while (behind - points > 1)
      middle = (points + behind) / 2
      if (row(middle) <= last) then
        points = middle
      else
        behind = middle
      end if
    end do
  end function points_until

end module pd_gather
