!> Platens go over from load to motion during a run.
!>
!> Source: doc/theory.md, section 7.
module pd_run_changes
  use pd_changes, only: kinetic_gain, time_of_change
  use pd_errors, only: error_list_t, exit_file, outcome_t
  use pd_increment, only: begin_increments
  use pd_kinds, only: ordered_sum, wp
  use pd_record, only: record_line
  use pd_run, only: run_t, start_increments
  use pd_schedule, only: step_at
  use pd_setup_changes, only: change_support
  use pd_stability, only: find_highest_frequency
  use pd_text, only: short_number
  implicit none
  private

  public :: begin_motion_if_due

contains

  !> Platens whose load has come to its end are moved from now on. A frame is due at this step, so
  !> the state is whole.
  !>
  !> Errors: a file.
  subroutine begin_motion_if_due(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    real(wp) :: t
    logical  :: changed
    integer  :: k

    changed = .false.
    do k = 1, size(run%model%supports%items)
      t = time_of_change(run%model%supports%items(k)%support)
      if (t >= huge(t)) cycle
      if (step_at(t, run%clock) > run%clock%step) cycle
      call begin_motion(k, run)
      call record_line(run%record, run%model%supports%items(k)%support%name// &
        ': motion in place of the traction from '//short_number(run%clock%time())//' s on', errors)
      changed = .true.
    end do
    if (.not. changed) return
    if (run%model%at_equilibrium) then
      run%model%highest_frequency = 0.0_wp   ! less is free now
      call find_highest_frequency(run%model)
      call start_increments(run)
      call begin_increments(run%increments, run%schedule, run%clock)
    end if
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine begin_motion_if_due

  !> Support number k prescribes motion; what its points gain by a jump of their velocity is work.
  subroutine begin_motion(k, run)
    integer,     intent(in)    :: k
    type(run_t), intent(inout) :: run
    real(wp) :: t, u(2), v(2)
    integer  :: first, c

    t = run%clock%time()
    associate (model => run%model, state => run%state)
      call model%shared%bring(state%displacement)
      call model%shared%bring(state%velocity)
      first = model%supports%items(k)%support%points(1)
      u = state%displacement(first, :)
      v = state%velocity(first, :)
      call change_support(k, u, t, model)
      associate (support => model%supports%items(k)%support)
        run%ledger%outer_work = run%ledger%outer_work + kinetic_gain(support, v, t)
        call support%prescribe(t, state%displacement, state%velocity)
        do c = 1, 2   ! what the body pulls at it, in place of the sum with the load
          if (model%points%free(first, c) <= 0.0_wp) state%force(support%points, c) = &
            -support%force(c) / ordered_sum(model%points%volume(support%points))
        end do
      end associate
    end associate
  end subroutine begin_motion

end module pd_run_changes
