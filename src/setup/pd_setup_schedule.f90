!> From checked input to the time step, the end of the run, and when something is written.
module pd_setup_schedule
  use pd_clock, only: clock_t
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t, integration_input_t
  use pd_kinds, only: is_set, wp
  use pd_model, only: model_t
  use pd_platens, only: times_of_strains
  use pd_schedule, only: new_schedule, schedule_t
  use pd_stability, only: find_highest_frequency
  use pd_text, only: number_text
  implicit none
  private

  public :: set_up_schedule

contains

  !> Time step by the rule of the input, and the steps of the run, of its frames and rows.
  !>
  !> `clock`: in: that of a checkpoint; with a time step of 0 the rule decides.
  !> Errors: a run with too many steps, a strain that is never reached.
  subroutine set_up_schedule(input, clock, model, schedule, errors)
    type(input_t),      intent(in)    :: input
    type(clock_t),      intent(inout) :: clock
    type(model_t),      intent(inout) :: model
    type(schedule_t),   intent(out)   :: schedule
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: frame_times(:)
    real(wp) :: end_time
    integer  :: k

    end_time = input%integration%end_time
    if (is_set(input%integration%final_strain)) &
      end_time = sum(strain_times([input%integration%final_strain]))
    if (errors%count() > 0) return
    call choose_time_step(input%integration, end_time, model, clock%time_step)

    associate (given => input%output)
      if (size(given%frame_strains) > 0) then
        frame_times = strain_times(given%frame_strains)
      else if (size(given%frame_times) > 0) then
        allocate (frame_times(size(given%frame_times)), source=given%frame_times)
      else
        allocate (frame_times(given%frame_count))
        frame_times = [(end_time * real(k, wp) / real(size(frame_times), wp), &
          k=1, size(frame_times))]
      end if
    end associate
    call add_ends_of_stages(input, frame_times)
    call add_changes(input, end_time, frame_times)
    if (errors%count() > 0) return
    if (any(frame_times > end_time * (1.0_wp + 1.0e-9_wp))) then
      call errors%add('a frame is asked for after the end of the run', '&output')
      return
    end if
    call new_schedule(clock, end_time, input%output%history_count, frame_times, &
      schedule, errors)

  contains

    !> Times at which the nominal strain reaches values.
    function strain_times(strains) result(times)
      real(wp), intent(in) :: strains(:)
      real(wp) :: times(size(strains))
      integer :: i

      times = times_of_strains(model%platens, strains)
      do i = 1, size(strains)
        if (times(i) > 0.0_wp) cycle
        call errors%add('the motion of the platens never reaches a nominal strain', &
          '&integration final_strain or &output frame_strains', number_text(strains(i)))
      end do
    end function strain_times

  end subroutine set_up_schedule

  !> A frame at the end of every stage, too.
  pure subroutine add_ends_of_stages(input, times)
    type(input_t),         intent(in)    :: input
    real(wp), allocatable, intent(inout) :: times(:)   !! ascending [s]
    integer :: k

    do k = 1, size(input%stages)
      call add_time(input%stages(k)%end_time, times)
    end do
  end subroutine add_ends_of_stages

  !> A frame where a load gives way to motion.
  pure subroutine add_changes(input, end_time, times)
    type(input_t),         intent(in)    :: input
    real(wp),              intent(in)    :: end_time   !! [s]
    real(wp), allocatable, intent(inout) :: times(:)   !! ascending [s]
    integer :: k

    do k = 1, size(input%boundaries)
      associate (t => input%boundaries(k)%traction_until)
        if (.not. is_set(t)) cycle
        if (t < end_time) call add_time(t, times)
      end associate
    end do
  end subroutine add_changes

  !> One more time, unless it is there.
  pure subroutine add_time(t, times)
    real(wp),              intent(in)    :: t          !! [s]
    real(wp), allocatable, intent(inout) :: times(:)   !! ascending [s]
    real(wp), parameter :: same = 1.0e-9_wp

    if (any(abs(times - t) <= same * t)) return
    times = [pack(times, times < t), t, pack(times, times > t)]
  end subroutine add_time

  !> Time step by the rule of the input, or the longest increment on the way of equilibrium, unless
  !> it is known.
  subroutine choose_time_step(given, end_time, model, dt)
    type(integration_input_t), intent(in)    :: given
    real(wp),                  intent(in)    :: end_time   !! [s]
    type(model_t),             intent(inout) :: model
    real(wp),                  intent(inout) :: dt         !! in: 0, or that of a checkpoint [s]

    if (given%method == 'equilibrium') call find_highest_frequency(model)
    if (dt > 0.0_wp) return
    if (given%method == 'equilibrium') then
      dt = end_time / real(given%increments, wp)
    else if (given%time_step_rule == 'fixed') then
      dt = given%time_step
    else if (given%time_step_rule == 'courant') then
      dt = given%safety * model%spacing / model%materials%wave_speed()
    else if (given%time_step_rule == 'spectral') then
      call find_highest_frequency(model)
      dt = given%safety * 2.0_wp / model%highest_frequency
    end if
  end subroutine choose_time_step

end module pd_setup_schedule
