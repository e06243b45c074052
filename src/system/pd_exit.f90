!> The only end of the program.
module pd_exit
  use, intrinsic :: iso_fortran_env, only: error_unit
  use pd_errors, only: exit_file, outcome_t
  use pd_ranks, only: abort_ranks, end_ranks, ranks_t
  use pd_system, only: exit_program
  implicit none
  private

  public :: leave

contains

  !> Print what went wrong on standard error, and end with the status of the outcome.
  !>
  !> All ranks end for the same reason, but for a file that cannot be written: that only the rank
  !> knows that writes it, while others wait for it.
  subroutine leave(outcome, ranks)
    type(outcome_t), intent(in) :: outcome
    type(ranks_t),   intent(in) :: ranks

    if (ranks%mine == outcome%teller) call outcome%errors%print(error_unit)
    if (outcome%status == exit_file .and. .not. outcome%agreed) call abort_ranks(outcome%status)
    call end_ranks()
    call exit_program(outcome%status)
  end subroutine leave

end module pd_exit
