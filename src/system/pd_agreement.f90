!> What ranks agree on before they act on it: signals, clocks and files differ from one to another.
!>
!> Every rank must come to these calls.
module pd_agreement
  use pd_ranks, only: ranks_t
  use pd_system, only: pending_signal
  implicit none
  private

  public :: any_rank, signal_of

contains

  !> Whether something is so on any rank.
  logical function any_rank(ranks, here)
    type(ranks_t), intent(in) :: ranks
    logical,       intent(in) :: here
    integer :: found(1)

    found = merge(1, 0, here)
    call ranks%largest_numbers(found)
    any_rank = found(1) > 0
  end function any_rank

  !> The signal that any rank has received, 0: none.
  integer function signal_of(ranks) result(signal)
    type(ranks_t), intent(in) :: ranks
    integer :: found(1)

    found = pending_signal()
    call ranks%largest_numbers(found)
    signal = found(1)
  end function signal_of

end module pd_agreement
