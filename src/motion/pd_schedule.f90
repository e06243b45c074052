!> When a run ends and when its output is due, in steps of constant length.
!>
!> Output requests never change the time step: a request is met at the first step at or past it.
!> Source: doc/input.md, output.
module pd_schedule
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: schedule_t, new_schedule, row_due, rows_due, step_at

  type :: schedule_t
    real(wp) :: end_time = 0.0_wp            !! asked for [s]
    integer  :: steps = 0                    !! of the whole run
    integer  :: rows = 1                     !! of the history
    real(wp) :: rows_per_step = 1.0_wp
    integer, allocatable :: frame_steps(:)   !! ascending, without the unloaded state
  end type schedule_t

contains

  !> First step at or past a time; within 1e-9 of a step counts as at.
  pure integer function step_at(time, time_step)
    real(wp), intent(in) :: time, time_step   !! [s]
    real(wp), parameter  :: round_off = 1.0e-9_wp

    step_at = ceiling(time / time_step * (1.0_wp - 1.0e-14_wp) - round_off)
  end function step_at

  !> Steps of a run.
  !>
  !> Errors: more steps than can be counted.
  subroutine new_schedule(time_step, end_time, rows, frame_times, schedule, errors)
    real(wp),           intent(in)    :: time_step        !! dt [s]
    real(wp),           intent(in)    :: end_time         !! [s]
    integer,            intent(in)    :: rows             !! of the history, evenly in time
    real(wp),           intent(in)    :: frame_times(:)   !! ascending [s]
    type(schedule_t),   intent(out)   :: schedule
    type(error_list_t), intent(inout) :: errors
    character(24) :: text
    integer :: k

    allocate (schedule%frame_steps(size(frame_times)), source=0)
    schedule%end_time = end_time
    schedule%rows = rows
    schedule%rows_per_step = real(rows, wp) * time_step / end_time
    if (end_time / time_step > 0.9_wp * real(huge(1), wp)) then
      write (text, '(es10.3)') end_time / time_step
      call errors%add('the run has too many steps', '&integration', trim(adjustl(text)), &
        'up to 1.9e9')
      return
    end if
    schedule%steps = max(1, step_at(end_time, time_step))
    do k = 1, size(frame_times)
      schedule%frame_steps(k) = max(1, min(schedule%steps, step_at(frame_times(k), time_step)))
    end do
  end subroutine new_schedule

  !> Whether a row of the history is due after a step.
  pure logical function row_due(schedule, step)
    type(schedule_t), intent(in) :: schedule
    integer,          intent(in) :: step
    real(wp), parameter :: round_off = 1.0e-9_wp

    row_due = step == schedule%steps .or. &
      floor(real(step, wp) * schedule%rows_per_step + round_off) &
      > floor(real(step - 1, wp) * schedule%rows_per_step + round_off)
  end function row_due

  !> How many rows of the history are due after a step that is done.
  pure integer function rows_due(schedule, done) result(rows)
    type(schedule_t), intent(in) :: schedule
    integer,          intent(in) :: done
    integer :: step

    rows = 0
    do step = done + 1, schedule%steps
      if (row_due(schedule, step)) rows = rows + 1
    end do
  end function rows_due

end module pd_schedule
