!> The longest stable time step as the body deforms.
!>
!> Every so many steps a look at the points tells by how much the highest frequency may have risen.
!> Where that could make the time step too long, the frequency is found anew, with the flow of the
!> points, which keeps it low in shear bands; and again when the flow has become less. Decisions
!> depend on steps and state alone.
!> Source: doc/theory.md, section 6.
module pd_step_limit
  use pd_clock, only: clock_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_stability, only: frequency_of_state, stiffening
  use pd_state, only: state_t
  implicit none
  private

  public :: step_limit_t, new_step_limit

  integer,  parameter :: look_every = 50         !! steps
  integer,  parameter :: flow_may_move = 4000    !! steps after which other points may flow
  real(wp), parameter :: nothing_yet = 1.02_wp   !! a stiffening below is not looked into
  real(wp), parameter :: used_up = 0.99_wp       !! a time step beyond this part of the limit

  !> What is known of the highest frequency.
  type :: step_limit_t
    real(wp) :: frequency = 0.0_wp    !! when it was looked for last [1/s]; 0: never
    real(wp) :: stiffening = 1.0_wp   !! of the stiffest point then
    integer  :: step = 0              !! then
    real(wp) :: flow = 0.0_wp         !! dissipated in the steps between two looks then [J/m]
    real(wp) :: dissipated = 0.0_wp   !! by flow until the last look [J/m]
    real(wp) :: shortest = 0.0_wp     !! time step below which the run has failed [s]
  contains
    procedure, nopass :: look_due
    procedure :: look
  end type step_limit_t

contains

  !> What is known at the start of a run.
  pure type(step_limit_t) function new_step_limit(frequency, time_step) result(limit)
    real(wp), intent(in) :: frequency   !! of the unloaded body [1/s]; 0: not known
    real(wp), intent(in) :: time_step   !! dt [s]

    limit%frequency = frequency
    limit%shortest = 1.0e-3_wp * time_step
  end function new_step_limit

  !> Whether to look at a state before the step after it; the state must be whole.
  pure logical function look_due(step)
    integer, intent(in) :: step

    look_due = modulo(step, look_every) == 0
  end function look_due

  !> Find the highest frequency anew, if it may have risen enough to matter.
  subroutine look(self, model, state, clock, dissipated, found)
    class(step_limit_t), intent(inout) :: self
    type(model_t), intent(inout) :: model
    type(state_t), intent(inout) :: state
    type(clock_t), intent(in)    :: clock
    real(wp),      intent(in)    :: dissipated   !! by flow so far [J/m]
    logical,       intent(out)   :: found
    real(wp) :: now, limit, flow

    flow = dissipated - self%dissipated
    self%dissipated = dissipated
    now = stiffening(model, state)
    found = now > nothing_yet
    if (found .and. self%frequency > 0.0_wp) then
      limit = used_up * 2.0_wp / (clock%time_step * self%frequency)
      found = now > limit * self%stiffening .or. (now > limit .and. &
        (flow < 0.5_wp * self%flow .or. clock%step - self%step >= flow_may_move))
    end if
    if (.not. found) return
    self%frequency = frequency_of_state(model, state, clock%time_step)
    self%stiffening = now
    self%step = clock%step
    self%flow = flow
  end subroutine look

end module pd_step_limit
