!> The only end of the program.
module pd_exit
  use, intrinsic :: iso_fortran_env, only: error_unit
  use pd_errors, only: outcome_t
  use pd_system, only: exit_program
  implicit none
  private

  public :: leave

contains

  !> Print what went wrong on standard error, and end with the status of the outcome.
  subroutine leave(outcome)
    type(outcome_t), intent(in) :: outcome

    call outcome%errors%print(error_unit)
    call exit_program(outcome%status)
  end subroutine leave

end module pd_exit
