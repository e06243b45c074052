!> One step of the motion, and where its time goes.
!>
!> u gives F, F gives S and A, A gives f, f gives v.
!> Source: doc/theory.md, section 6.
module pd_step
  use pd_force, only: force_state, internal_force
  use pd_kinds, only: wp
  use pd_observe, only: ledger_t
  use pd_model, only: damping_frame, model_t
  use pd_state, only: block_work_t, state_t
  use pd_timing, only: timing_t
  use pd_verlet, only: kick, kick_and_drift, kick_twice_and_drift
  implicit none
  private

  public :: step_work_t, take_step

  !> Work space of the steps, and what one of them leaves to the next.
  type :: step_work_t
    real(wp), allocatable :: a(:, :)           !! A (n,4) [N/m^6]; voids: 0
    type(block_work_t)    :: blocks
    !> v is v^{n+1/2}: the second half kick of the last step comes together with the first one of
    !> the next, which saves a way through the memory. These are entered into the ledger then.
    logical,  private :: open = .false.
    real(wp), private :: dissipated = 0.0_wp   !! by plastic flow [J/m]
    real(wp), private :: first_work(2) = 0.0_wp   !! of the damping in the first half kick [J/m]
    real(wp), private :: outer_work = 0.0_wp   !! of supports and loads [J/m]
  end type step_work_t

contains

  !> One step of velocity Verlet, to step number `step`: the loads join f, and work on v^{n+1/2}.
  !>
  !> `whole`: the state will be looked at; else v and the ledger may be half a kick behind until
  !> the next step. That changes no bit of what is seen.
  !> `failed_point`: 0, or the first point whose det F is not positive (NaN included).
  subroutine take_step(step, whole, model, state, work, ledger, timing, failed_point)
    integer,        intent(in)    :: step
    logical,        intent(in)    :: whole
    type(model_t),  intent(inout) :: model          !! its supports get their new forces
    type(state_t),  intent(inout) :: state
    type(step_work_t), intent(inout) :: work
    type(ledger_t), intent(inout) :: ledger
    type(timing_t), intent(inout) :: timing
    integer,        intent(out)   :: failed_point
    real(wp) :: t, t_next, second_work(2), first_work(2)

    t = real(step - 1, wp) * model%motion%time_step
    t_next = real(step, wp) * model%motion%time_step
    call timing%begin(step)
    associate (x => model%body%position, volume => model%body%volume, free => model%free, &
      u => state%displacement, v => state%velocity, f => state%force, blocks => work%blocks)
      if (work%open) then
        call kick_twice_and_drift(model%motion, damping_frame(model, t), x, volume, free, f, v, &
          u, blocks, second_work, first_work)
        call close_step(second_work, work, ledger)
      else
        call kick_and_drift(model%motion, damping_frame(model, t), x, volume, free, f, v, u, &
          blocks, first_work)
      end if
      work%first_work = first_work
      call timing%lap(1)
      call model%supports%prescribe(t_next, u, v)
      call timing%lap(6)
      call force_state(model%operators, model%solid, volume, state, work%a, blocks, timing, &
        failed_point)
      work%dissipated = sum(blocks%dissipated)
      call internal_force(model%operators, u, work%a, f, blocks, timing)
      call model%loads%add_forces(volume, t_next, f)
      call model%supports%share_forces(volume, t_next, f)
      call model%supports%take_reactions(volume, t_next, f)
      work%outer_work = model%supports%work(v, t, t_next) + model%loads%work(v, t, t_next)
      work%open = .true.
      call timing%lap(6)
      if (.not. whole) return
      call kick(model%motion, damping_frame(model, t_next), x, volume, free, f, v, u, blocks, &
        second_work)
      call close_step(second_work, work, ledger)
      call timing%lap(1)
    end associate
  end subroutine take_step

  !> The second half kick is done: enter the step into the ledger.
  pure subroutine close_step(second_work, work, ledger)
    real(wp),          intent(in)    :: second_work(2)   !! of the damping in it [J/m]
    type(step_work_t), intent(inout) :: work
    type(ledger_t),    intent(inout) :: ledger

    call ledger%enter(work%dissipated, work%first_work(1) + second_work(1), &
      work%first_work(2) + second_work(2) + work%outer_work)
    work%open = .false.
  end subroutine close_step

end module pd_step
