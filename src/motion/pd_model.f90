!> The model: everything about a run that does not change while it runs.
module pd_model
  use pd_force, only: solid_t
  use pd_geometry, only: body_t
  use pd_kinds, only: wp
  use pd_loads, only: loads_t
  use pd_operators, only: operators_t
  use pd_platens, only: platens_t, reference_ends
  use pd_stability, only: highest_frequency
  use pd_state, only: state_t
  use pd_supports, only: supports_t
  use pd_verlet, only: frame_t, motion_t, reference_velocity
  implicit none
  private

  public :: model_t, start, damping_frame, find_highest_frequency

  !> Everything about a run that does not change while it runs, and the supports with the forces of
  !> the present step.
  type :: model_t
    type(body_t)      :: body
    class(operators_t), allocatable :: operators
    type(solid_t)     :: solid
    type(motion_t)    :: motion
    type(platens_t)   :: platens
    type(supports_t)  :: supports
    type(loads_t)     :: loads
    real(wp), allocatable :: free(:, :)      !! 1: free, 0: prescribed component (n,2)
    real(wp) :: spacing = 0.0_wp             !! dx [m]
    real(wp) :: delta = 0.0_wp               !! horizon [m]
    logical  :: damped_in_frame = .false.    !! damping acts in the frame of the platens
    real(wp) :: highest_frequency = 0.0_wp   !! of the linearised operator [1/s]; 0: not asked for
  end type model_t

contains

  !> Highest frequency of the model, unless it is known already.
  subroutine find_highest_frequency(model)
    type(model_t), intent(inout) :: model
    integer :: iterations

    if (model%highest_frequency <= 0.0_wp) call highest_frequency(model%operators, model%solid, &
      model%body%volume, model%free, model%highest_frequency, iterations)
  end subroutine find_highest_frequency

  !> Velocity at both ends of the frame in which the damping acts, at time t.
  pure type(frame_t) function damping_frame(model, t) result(frame)
    type(model_t), intent(in) :: model
    real(wp),      intent(in) :: t   !! [s]

    if (model%damped_in_frame) &
      call reference_ends(model%platens, t, frame%lower, frame%upper)
  end function damping_frame

  !> State at t = 0: undeformed, moving with the frame of the damping, supports with theirs; loads
  !> without a ramp act already.
  subroutine start(model, state)
    type(model_t), intent(in)  :: model
    type(state_t), intent(out) :: state
    type(frame_t) :: frame
    integer :: k

    call state%allocate(model%body%n)
    frame = damping_frame(model, 0.0_wp)
    do k = 1, 2
      state%velocity(:, k) = reference_velocity(model%motion, frame, k, &
        model%body%position(:, model%motion%axis))
    end do
    do k = 1, 2
      where (model%body%boundary < 0) state%velocity(:, k) = 0.0_wp
    end do
    call model%supports%prescribe(0.0_wp, state%displacement, state%velocity)
    call model%loads%add_forces(model%body%volume, 0.0_wp, state%force)
    call model%supports%share_forces(model%body%volume, 0.0_wp, state%force)
  end subroutine start

end module pd_model
