!> Operators of a body whose blocks are divided among ranks.
module pd_operator_parts
  use pd_operators, only: operators_t
  use pd_pages, only: forget_rows
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: divide_operators

contains

  !> From now on this rank has its own blocks only, and reads a halo around them. What is kept of
  !> other rows is zero, but for bonds and moments.
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
    call operators%mirror%divide(operators%domain%blocks)
    ends = operators%domain%kept(operators%n)
    call forget_rows(operators%k_inverse, ends)
    call forget_rows(operators%weight_sum, ends)
    if (allocated(operators%control)) call forget_rows(operators%control, ends)
    if (allocated(operators%share_of)) call forget_rows(operators%share_of, ends)
    if (allocated(operators%pull)) call forget_rows(operators%pull, ends)
    if (allocated(operators%relaxing)) then
      associate (relaxing => operators%relaxing)
        call forget_rows(relaxing%volume, ends)
        call forget_rows(relaxing%stiffness, ends)
        call forget_rows(relaxing%clock, ends)
        call forget_rows(relaxing%moment, ends)
        call forget_rows(relaxing%pull, ends)
      end associate
    end if
  end subroutine divide_operators

end module pd_operator_parts
