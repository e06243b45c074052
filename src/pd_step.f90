!> One step of the motion, and where its time goes.
!>
!> u gives F, F gives S and A, A gives f, f gives v.
!> Source: doc/theory.md, section 6.
module pd_step
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_boundary, only: boundary_forces, boundary_t, motion_work, move
  use pd_force, only: force_state
  use pd_kinds, only: wp
  use pd_kinematics, only: deformation_gradient
  use pd_loads, only: apply_loads, load_work
  use pd_observe, only: ledger_t
  use pd_setup, only: damping_frame, model_t
  use pd_state, only: state_t
  use pd_verlet, only: kick, kick_and_drift
  implicit none
  private

  public :: timing_t, take_step, kernel_names

  !> Names of the kernels in the order of `timing_t%seconds`.
  character(10), parameter :: kernel_names(6) = [character(10) :: 'motion', 'gradient', 'stress', &
    'divergence', 'control', 'boundaries']

  !> Wall clock time spent in each kernel [s].
  type :: timing_t
    real(wp) :: seconds(size(kernel_names)) = 0.0_wp
    integer(int64), private :: last = 0
  contains
    procedure, private :: begin
    procedure, private :: lap
  end type timing_t

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
    type(boundary_t), allocatable :: before(:)
    real(wp) :: t, t_next, first_work(2), second_work(2), dissipated, loads_work

    t = real(step - 1, wp) * model%motion%time_step
    t_next = real(step, wp) * model%motion%time_step
    call timing%begin()
    associate (x => model%body%position, volume => model%body%volume, free => model%free, &
      u => state%displacement, v => state%velocity, f => state%force, &
      f_grad => state%deformation_gradient)
      call kick_and_drift(model%motion, damping_frame(model, t), x, volume, free, f, v, u, &
        first_work)
      call timing%lap(1)
      call move(model%boundaries, x, t_next, u, v)
      loads_work = load_work(model%pressures, model%boundaries, v, t, t_next)
      call timing%lap(6)
      call model%operators%gradient(u, f_grad)
      call timing%lap(2)
      call deformation_gradient(model%solid%k_inverse, f_grad)
      call force_state(model%solid, volume, state, a, dissipated, failed_point)
      call timing%lap(3)
      call model%operators%divergence(a, f)
      call timing%lap(4)
      if (allocated(model%solid%control)) &
        call model%operators%add_control(model%solid%control, u, f)
      call timing%lap(5)
      call apply_loads(model%pressures, model%boundaries, volume, t_next, f)
      call timing%lap(6)
      call kick(model%motion, damping_frame(model, t_next), x, volume, free, f, v, second_work)
      call timing%lap(1)

      allocate (before(size(model%boundaries)), source=model%boundaries)
      call boundary_forces(x, volume, t_next, f, model%boundaries)
    end associate
    ledger%plastic_dissipation = ledger%plastic_dissipation + dissipated
    ledger%damping_dissipation = ledger%damping_dissipation + first_work(1) + second_work(1)
    ledger%external_work = ledger%external_work + first_work(2) + second_work(2) &
      + motion_work(before, model%boundaries, t, t_next) + loads_work
    ledger%largest_work = max(ledger%largest_work, abs(ledger%external_work))
    call timing%lap(6)
  end subroutine take_step

  !> Start the clock.
  subroutine begin(self)
    class(timing_t), intent(inout) :: self

    call system_clock(self%last)
  end subroutine begin

  !> Give the time since the last call to a kernel.
  subroutine lap(self, kernel)
    class(timing_t), intent(inout) :: self
    integer,         intent(in)    :: kernel
    integer(int64) :: now, rate

    call system_clock(now, rate)
    self%seconds(kernel) = self%seconds(kernel) + real(now - self%last, wp) / real(rate, wp)
    self%last = now
  end subroutine lap

end module pd_step
