!> Motion in time: velocity Verlet, the damping implicit in the second half kick.
!>
!>   v^{n+1/2} = v^n + dt/2 (f^n - C (v^n - v_ref)) / rho,   u^{n+1} = u^n + dt v^{n+1/2}
!>   v^{n+1}   = (v^{n+1/2} + dt/2 (f^{n+1} + C v_ref) / rho) / (1 + dt C / (2 rho))
!>
!> Prescribed components are left to `pd_boundary`.
!> Source: doc/theory.md, section 6.
module pd_verlet
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: motion_t, frame_t, kick_and_drift, kick, reference_velocity

  !> Constants of the motion.
  type :: motion_t
    real(wp) :: time_step = 0.0_wp      !! dt [s]
    real(wp) :: density = 0.0_wp        !! rho [kg/m^3]
    real(wp) :: damping = 0.0_wp        !! C [kg/(m^3 s)]
    integer  :: axis = 2                !! along which v_ref varies
    real(wp) :: start = 0.0_wp          !! coordinate where v_ref is that of the lower end [m]
    real(wp) :: length = 1.0_wp         !! from there to the upper end [m]
  end type motion_t

  !> Velocity against which the damping acts: linear between two ends, constant beyond them.
  type :: frame_t
    real(wp) :: lower(2) = 0.0_wp, upper(2) = 0.0_wp   !! [m/s]
  end type frame_t

contains

  !> Component k of v_ref at a point.
  elemental real(wp) function reference_velocity(motion, frame, k, x) result(v)
    type(motion_t), intent(in) :: motion
    type(frame_t),  intent(in) :: frame
    integer,        intent(in) :: k
    real(wp),       intent(in) :: x      !! coordinate of the point along motion%axis [m]

    v = frame%lower(k) + (frame%upper(k) - frame%lower(k)) &
      * min(1.0_wp, max(0.0_wp, (x - motion%start) / motion%length))
  end function reference_velocity

  !> First half kick and drift.
  !>
  !> `work`: half a step's work of the damping force C (v - v_ref): (1) on v - v_ref: dissipated,
  !> (2) of the force -C (v - v_ref) on v_ref: done by whoever moves the frame.
  subroutine kick_and_drift(motion, frame, position, volume, free, f, v, u, work)
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame            !! at step n
    real(wp),       intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),       intent(in)    :: volume(:)        !! V (n) [m^2]
    real(wp),       intent(in)    :: free(:, :)       !! 1: free, 0: prescribed (n,2)
    real(wp),       intent(in)    :: f(:, :)          !! f^n (n,2) [N/m^3]
    real(wp),       intent(inout) :: v(:, :)          !! v^n -> v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(inout) :: u(:, :)          !! u^n -> u^{n+1} (n,2) [m]
    real(wp),       intent(out)   :: work(2)          !! [J/m]
    real(wp), allocatable :: work_in(:, :)
    real(wp) :: half, dt, c, ref, drag
    integer  :: i, k, block, n, n_blocks

    n = size(volume)
    n_blocks = (n + n_block - 1) / n_block
    allocate (work_in(2, n_blocks))
    dt = motion%time_step
    c = motion%damping
    half = 0.5_wp * dt / motion%density
    !$omp parallel do schedule(static) default(none) private(i, k, block, ref, drag) &
    !$omp shared(n, n_blocks, motion, frame, position, volume, free, f, v, u, work_in, half, dt, c)
    do block = 1, n_blocks
      work_in(:, block) = 0.0_wp
      do k = 1, 2
        do i = (block - 1) * n_block + 1, min(block * n_block, n)
          ref = reference_velocity(motion, frame, k, position(i, motion%axis))
          drag = free(i, k) * c * (v(i, k) - ref)
          v(i, k) = v(i, k) + half * (free(i, k) * f(i, k) - drag)
          u(i, k) = u(i, k) + dt * v(i, k)
          work_in(1, block) = work_in(1, block) + volume(i) * drag * (v(i, k) - ref)
          work_in(2, block) = work_in(2, block) - volume(i) * drag * ref
        end do
      end do
    end do
    !$omp end parallel do
    work = 0.5_wp * dt * sum(work_in, dim=2)
  end subroutine kick_and_drift

  !> Second half kick; `work` as in `kick_and_drift`.
  subroutine kick(motion, frame, position, volume, free, f, v, work)
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame            !! at step n+1
    real(wp),       intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),       intent(in)    :: volume(:)        !! V (n) [m^2]
    real(wp),       intent(in)    :: free(:, :)       !! 1: free, 0: prescribed (n,2)
    real(wp),       intent(in)    :: f(:, :)          !! f^{n+1} (n,2) [N/m^3]
    real(wp),       intent(inout) :: v(:, :)          !! v^{n+1/2} -> v^{n+1} (n,2) [m/s]
    real(wp),       intent(out)   :: work(2)          !! [J/m]
    real(wp), allocatable :: work_in(:, :)
    real(wp) :: half, c, slow_down, ref, drag, v_half
    integer  :: i, k, block, n, n_blocks

    n = size(volume)
    n_blocks = (n + n_block - 1) / n_block
    allocate (work_in(2, n_blocks))
    c = motion%damping
    half = 0.5_wp * motion%time_step / motion%density
    slow_down = 1.0_wp / (1.0_wp + half * c)
    !$omp parallel do schedule(static) default(none) private(i, k, block, ref, drag, v_half) &
    !$omp shared(n, n_blocks, motion, frame, position, volume, free, f, v, work_in, half, c) &
    !$omp shared(slow_down)
    do block = 1, n_blocks
      work_in(:, block) = 0.0_wp
      do k = 1, 2
        do i = (block - 1) * n_block + 1, min(block * n_block, n)
          ref = reference_velocity(motion, frame, k, position(i, motion%axis))
          v_half = v(i, k)
          v(i, k) = v_half + free(i, k) &
            * ((v_half + half * (f(i, k) + c * ref)) * slow_down - v_half)
          drag = free(i, k) * c * (v(i, k) - ref)
          work_in(1, block) = work_in(1, block) + volume(i) * drag * (v_half - ref)
          work_in(2, block) = work_in(2, block) - volume(i) * drag * ref
        end do
      end do
    end do
    !$omp end parallel do
    work = 0.5_wp * motion%time_step * sum(work_in, dim=2)
  end subroutine kick

end module pd_verlet
