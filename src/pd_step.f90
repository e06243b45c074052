!> One step of the motion, and where its time goes.
!>
!> u gives F, F gives S and A, A gives f, f gives v.
!> Source: doc/theory.md, section 6.
module pd_step
  use pd_boundary, only: boundary_forces, mode_forces, motion_work, move
  use pd_force, only: force_state, internal_force
  use pd_kinds, only: wp
  use pd_loads, only: apply_loads, load_work
  use pd_observe, only: ledger_t
  use pd_setup, only: damping_frame, model_t
  use pd_state, only: state_t
  use pd_timing, only: timing_t
  use pd_verlet, only: kick, kick_and_drift
  implicit none
  private

  public :: take_step

contains

  !> One step of velocity Verlet, to step number `step`: the loads join f, and work on v^{n+1/2}.
  !>
  !> `failed_point`: 0, or the first point whose det F is not positive (NaN included).
  subroutine take_step(step, model, state, a, ledger, timing, failed_point)
    integer,        intent(in)    :: step
    type(model_t),  intent(inout) :: model          !! its boundaries get their new forces
    type(state_t),  intent(inout) :: state
    real(wp),       intent(inout), contiguous :: a(:, :)   !! work space: A (n,4) [N/m^6]
    type(ledger_t), intent(inout) :: ledger
    type(timing_t), intent(inout) :: timing
    integer,        intent(out)   :: failed_point
    real(wp) :: before(2, size(model%boundaries))
    real(wp) :: t, t_next, first_work(2), second_work(2), dissipated, loads_work

    t = real(step - 1, wp) * model%motion%time_step
    t_next = real(step, wp) * model%motion%time_step
    call timing%begin(step)
    associate (x => model%body%position, volume => model%body%volume, free => model%free, &
      u => state%displacement, v => state%velocity, f => state%force)
      call kick_and_drift(model%motion, damping_frame(model, t), x, volume, free, f, v, u, &
        first_work)
      call timing%lap(1)
      call move(model%boundaries, x, t_next, u, v)
      loads_work = load_work(model%pressures, model%boundaries, v, t, t_next)
      call timing%lap(6)
      call force_state(model%operators, model%solid, volume, state, a, timing, dissipated, &
        failed_point)
      call internal_force(model%operators, model%solid, u, a, f, timing)
      call apply_loads(model%pressures, model%boundaries, volume, t_next, f)
      call timing%lap(6)
      call kick(model%motion, damping_frame(model, t_next), x, volume, free, f, v, second_work)
      call timing%lap(1)

      before = mode_forces(model%boundaries)
      call boundary_forces(x, volume, t_next, f, model%boundaries)
    end associate
    ledger%plastic_dissipation = ledger%plastic_dissipation + dissipated
    ledger%damping_dissipation = ledger%damping_dissipation + first_work(1) + second_work(1)
    ledger%external_work = ledger%external_work + first_work(2) + second_work(2) &
      + motion_work(before, model%boundaries, t, t_next) + loads_work
    ledger%largest_work = max(ledger%largest_work, abs(ledger%external_work))
    call timing%lap(6)
  end subroutine take_step

end module pd_step
