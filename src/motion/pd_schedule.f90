!> When a run ends and when its output is due.
!>
!> What was asked for are times; the plan says at which steps they are met, as long as the time step
!> stays what it is. Whoever changes it fits the plan to the clock. Output requests never change the
!> time step: a request is met at the first step at or past it.
!> Source: doc/input.md, output.
module pd_schedule
  use pd_clock, only: clock_t
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: schedule_t, new_schedule, step_at

  real(wp), parameter :: round_off = 1.0e-9_wp
  real(wp), parameter :: most_steps = 0.9_wp * real(huge(1), wp)

  type :: schedule_t
    ! what was asked for
    real(wp) :: end_time = 0.0_wp            !! [s]
    real(wp), allocatable :: frame_times(:)  !! ascending, without the unloaded state [s]
    integer  :: rows = 1                     !! of the history, evenly in time, the last at the end
    ! the plan
    integer  :: steps = 0                    !! of the whole run
    integer, allocatable :: frame_steps(:)   !! of the frame times
    integer,  private :: start_step = 0      !! step from which the rows are counted
    real(wp), private :: rows_before = 0.0_wp   !! intervals of rows until then
    real(wp), private :: rows_per_step = 1.0_wp
  contains
    procedure :: fit
    procedure :: is_over
    procedure :: row_due
    procedure :: rows_left
    procedure :: frames_due
    procedure :: frames_left
    procedure, private :: rows_until
  end type schedule_t

contains

  !> First step at or past a time; within 1e-9 of a step counts as at. A time before the last change
  !> of the time step lies at that step or before.
  pure integer function step_at(time, clock)
    real(wp),      intent(in) :: time   !! [s]
    type(clock_t), intent(in) :: clock
    real(wp) :: steps

    ! the first part is a step in 1e14 short: so many digits of a time are good
    steps = time / clock%time_step * (1.0_wp - 1.0e-14_wp) - clock%start_time / clock%time_step
    steps = max(-most_steps, min(most_steps - real(clock%start_step, wp), steps))
    step_at = clock%start_step + ceiling(steps - round_off)
  end function step_at

  !> Schedule of a run that begins, or goes on, at the step of a clock.
  !>
  !> Errors: more steps than can be counted.
  subroutine new_schedule(clock, end_time, rows, frame_times, schedule, errors)
    type(clock_t),      intent(in)    :: clock
    real(wp),           intent(in)    :: end_time         !! [s]
    integer,            intent(in)    :: rows             !! of the history, evenly in time
    real(wp),           intent(in)    :: frame_times(:)   !! ascending [s]
    type(schedule_t),   intent(out)   :: schedule
    type(error_list_t), intent(inout) :: errors
    character(24) :: text

    schedule%end_time = end_time
    schedule%rows = rows
    allocate (schedule%frame_times, source=frame_times)
    allocate (schedule%frame_steps(size(frame_times)), source=0)
    if (end_time / clock%time_step > most_steps) then
      write (text, '(es11.3e3)') end_time / clock%time_step
      call errors%add('the run has too many steps', '&integration', trim(adjustl(text)), &
        'up to 1.9e9')
      return
    end if
    call schedule%fit(clock)
  end subroutine new_schedule

  !> Plan with the time step that a clock has now. Frames that were due until its step stay as they
  !> are, so that none is taken twice or left out by round-off.
  pure subroutine fit(self, clock)
    class(schedule_t), intent(inout) :: self
    type(clock_t),     intent(in)    :: clock
    integer :: earliest, k

    self%start_step = clock%start_step
    self%rows_before = real(self%rows, wp) * clock%start_time / self%end_time
    self%rows_per_step = real(self%rows, wp) * clock%time_step / self%end_time
    self%steps = max(1, clock%step, step_at(self%end_time, clock))
    do k = 1, size(self%frame_times)
      earliest = 1
      if (self%frame_steps(k) > 0) earliest = clock%step + 1   ! it has been planned before
      if (earliest > 1 .and. self%frame_steps(k) <= clock%step) cycle
      self%frame_steps(k) = max(earliest, min(self%steps, step_at(self%frame_times(k), clock)))
    end do
  end subroutine fit

  !> Whether the end is reached.
  pure logical function is_over(self, clock)
    class(schedule_t), intent(in) :: self
    type(clock_t),     intent(in) :: clock

    is_over = clock%step >= self%steps
  end function is_over

  !> Whether a row of the history is due after a step that is to come: at most one, however many of
  !> their times lie in it.
  pure logical function row_due(self, step)
    class(schedule_t), intent(in) :: self
    integer,           intent(in) :: step

    row_due = step == self%steps .or. self%rows_until(step) > self%rows_until(step - 1)
  end function row_due

  !> Times of rows at or before a step; the last one is that of the end.
  pure integer function rows_until(self, step) result(rows)
    class(schedule_t), intent(in) :: self
    integer,           intent(in) :: step

    rows = floor(min(real(self%rows, wp), &
      self%rows_before + real(step - self%start_step, wp) * self%rows_per_step) + round_off)
    rows = min(rows, self%rows - 1)
  end function rows_until

  !> How many rows are due after a step that is done: one in each of their intervals, or in each
  !> step where these are longer.
  pure integer function rows_left(self, step) result(rows)
    class(schedule_t), intent(in) :: self
    integer,           intent(in) :: step

    rows = min(self%rows - self%rows_until(step), self%steps - step)
  end function rows_left

  !> How many frames are due after a step.
  pure integer function frames_due(self, step) result(frames)
    class(schedule_t), intent(in) :: self
    integer,           intent(in) :: step

    frames = count(self%frame_steps == step)
  end function frames_due

  !> How many frames are due after a step that is done.
  pure integer function frames_left(self, step) result(frames)
    class(schedule_t), intent(in) :: self
    integer,           intent(in) :: step

    frames = count(self%frame_steps > step)
  end function frames_left

end module pd_schedule
