!> Operators of a body whose blocks are divided among ranks.
module pd_operator_parts
  use pd_operators, only: operators_t
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: divide_operators

contains

  !> From now on this rank has its own blocks only, and reads a halo around them. Weights, K^-1 and
  !> bonds of all rows stay.
  subroutine divide_operators(operators, ranks)
    class(operators_t), intent(inout) :: operators   !! with the blocks of all ranks
    type(ranks_t),      intent(in)    :: ranks       !! with the numbers of their blocks
    integer, allocatable :: mine(:)
    integer :: ends(2), k

    call operators%domain%take_part(ranks)
    ends = operators%domain%rows_of(ranks%mine)
    mine = operators%needed_rows(ends(1), ends(2))
    do k = 0, ranks%count - 1
      if (k == ranks%mine) cycle
      ends = operators%domain%rows_of(k)
      call operators%domain%meet(k, operators%needed_rows(ends(1), ends(2)), mine)
    end do
  end subroutine divide_operators

end module pd_operator_parts
