!> Step, time and time step of a run.
!>
!> The time step may change between two steps. Times are counted from the step at which it changed
!> last: products, not sums of steps, so that they do not drift.
module pd_clock
  use pd_kinds, only: wp
  implicit none
  private

  public :: clock_t

  type :: clock_t
    integer  :: step = 0              !! steps done
    real(wp) :: time_step = 0.0_wp    !! dt [s]
    integer  :: start_step = 0        !! step since which dt is what it is
    real(wp) :: start_time = 0.0_wp   !! its time [s]
    integer  :: stage = 1             !! of construction
  contains
    procedure :: time
    procedure :: advance
    procedure :: change_step
  end type clock_t

contains

  !> Time of the present step [s].
  pure real(wp) function time(self)
    class(clock_t), intent(in) :: self

    time = self%start_time + real(self%step - self%start_step, wp) * self%time_step
  end function time

  !> Advance by one step.
  pure subroutine advance(self)
    class(clock_t), intent(inout) :: self

    self%step = self%step + 1
  end subroutine advance

  !> Change the time step from the present step on.
  pure subroutine change_step(self, time_step)
    class(clock_t), intent(inout) :: self
    real(wp),       intent(in)    :: time_step   !! dt [s]

    self%start_time = self%time()
    self%start_step = self%step
    self%time_step = time_step
  end subroutine change_step

end module pd_clock
