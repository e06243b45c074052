!> Step, time and time step of a run.
module pd_clock
  use pd_kinds, only: wp
  implicit none
  private

  public :: clock_t

  type :: clock_t
    integer  :: step = 0             !! steps done
    real(wp) :: time_step = 0.0_wp   !! dt [s]
  contains
    procedure :: time
    procedure :: advance
  end type clock_t

contains

  !> Time of the present step [s].
  pure real(wp) function time(self)
    class(clock_t), intent(in) :: self

    time = real(self%step, wp) * self%time_step
  end function time

  !> Advance by one step.
  pure subroutine advance(self)
    class(clock_t), intent(inout) :: self

    self%step = self%step + 1
  end subroutine advance

end module pd_clock
