!> Motion in time: velocity Verlet, the damping implicit in the second half kick.
!>
!>   v^{n+1/2} = v^n + dt/2 (f^n - C (v^n - v_ref)) / rho,   u^{n+1} = u^n + dt v^{n+1/2}
!>   v^{n+1}   = (v^{n+1/2} + dt/2 (f^{n+1} + C v_ref) / rho) / (1 + dt C / (2 rho))
!>
!> Prescribed components are left to `pd_supports`.
!> Source: doc/theory.md, section 6.
module pd_verlet
  use pd_kinds, only: block_sum, n_block, wp
  use pd_state, only: block_work_t
  implicit none
  private

  public :: motion_t, frame_t, kick_and_drift, kick, kick_twice_and_drift, reference_velocity

  !> Constants of the motion.
  type :: motion_t
    real(wp) :: time_step = 0.0_wp      !! dt [s]
    real(wp) :: density = 0.0_wp        !! rho [kg/m^3]
    real(wp) :: damping = 0.0_wp        !! C [kg/(m^3 s)]
    integer  :: axis = 2                !! along which v_ref varies
    real(wp) :: start = 0.0_wp          !! coordinate where v_ref is that of the lower end [m]
    real(wp) :: length = 1.0_wp         !! from there to the upper end [m]
    integer  :: first = 1               !! between this point
    integer  :: last = huge(1)          !! and this one all points lie that are no voids
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
      * place_between(motion%start, motion%length, x)
  end function reference_velocity

  !> Place of a point between the ends of the frame: 0 at and below the lower, 1 at and above the
  !> upper one.
  elemental real(wp) function place_between(start, length, x) result(place)
    real(wp), intent(in) :: start, length, x   !! [m]

    place = min(1.0_wp, max(0.0_wp, (x - start) / length))
  end function place_between

  !> First half kick and drift.
  !>
  !> `work`: half a step's work of the damping force C (v - v_ref): (1) on v - v_ref: dissipated,
  !> (2) of the force -C (v - v_ref) on v_ref: done by whoever moves the frame.
  subroutine kick_and_drift(motion, frame, position, volume, free, f, v, u, blocks, work)
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame            !! at step n
    real(wp),       intent(in), contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp),       intent(in), contiguous :: volume(:)        !! V (n) [m^2]
    real(wp),       intent(in), contiguous :: free(:, :)       !! 1: free, 0: prescribed (n,2)
    real(wp),       intent(in), contiguous :: f(:, :)          !! f^n (n,2) [N/m^3]
    real(wp),       intent(inout), contiguous :: v(:, :)          !! v^n -> v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(inout), contiguous :: u(:, :)          !! u^n -> u^{n+1} (n,2) [m]
    type(block_work_t), intent(inout) :: blocks
    real(wp),       intent(out)   :: work(2)          !! [J/m]

    call move_points(motion, [.false., .true.], frame, position, volume, free, f, v, u, blocks)
    work = sum(blocks%damping(3:4, :), dim=2)
  end subroutine kick_and_drift

  !> Second half kick; `work` as in `kick_and_drift`.
  subroutine kick(motion, frame, position, volume, free, f, v, u, blocks, work)
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame            !! at step n+1
    real(wp),       intent(in), contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp),       intent(in), contiguous :: volume(:)        !! V (n) [m^2]
    real(wp),       intent(in), contiguous :: free(:, :)       !! 1: free, 0: prescribed (n,2)
    real(wp),       intent(in), contiguous :: f(:, :)          !! f^{n+1} (n,2) [N/m^3]
    real(wp),       intent(inout), contiguous :: v(:, :)          !! v^{n+1/2} -> v^{n+1} [m/s]
    real(wp),       intent(inout), contiguous :: u(:, :)          !! stays
    type(block_work_t), intent(inout) :: blocks
    real(wp),       intent(out)   :: work(2)          !! [J/m]

    call move_points(motion, [.true., .false.], frame, position, volume, free, f, v, u, blocks)
    work = sum(blocks%damping(1:2, :), dim=2)
  end subroutine kick

  !> Second half kick of a step, first half kick and drift of the next: the same as `kick` and
  !> `kick_and_drift`, bit by bit, with one way through the memory. `work` is that of both.
  subroutine kick_twice_and_drift(motion, frame, position, volume, free, f, v, u, blocks, &
    second_work, first_work)
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame            !! where one ends and the next begins
    real(wp),       intent(in), contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp),       intent(in), contiguous :: volume(:)        !! V (n) [m^2]
    real(wp),       intent(in), contiguous :: free(:, :)       !! 1: free, 0: prescribed (n,2)
    real(wp),       intent(in), contiguous :: f(:, :)          !! f^n (n,2) [N/m^3]
    real(wp),       intent(inout), contiguous :: v(:, :)          !! v^{n-1/2} -> v^{n+1/2} [m/s]
    real(wp),       intent(inout), contiguous :: u(:, :)          !! u^n -> u^{n+1} (n,2) [m]
    type(block_work_t), intent(inout) :: blocks
    real(wp),       intent(out)   :: second_work(2), first_work(2)   !! [J/m]

    call move_points(motion, [.true., .true.], frame, position, volume, free, f, v, u, blocks)
    second_work = sum(blocks%damping(1:2, :), dim=2)
    first_work = sum(blocks%damping(3:4, :), dim=2)
  end subroutine kick_twice_and_drift

  !> The second half kick of a step, the first half kick and the drift of the next, or both.
  subroutine move_points(motion, which, frame, position, volume, free, f, v, u, blocks)
    type(motion_t), intent(in)    :: motion
    logical,        intent(in)    :: which(2)         !! what ends a step, what begins the next
    type(frame_t),  intent(in)    :: frame
    real(wp),       intent(in), contiguous :: position(:, :), volume(:), free(:, :), f(:, :)
    real(wp),       intent(inout), contiguous :: v(:, :), u(:, :)
    type(block_work_t), intent(inout) :: blocks       !! damping: of the one and of the other
    integer :: block, lo, hi, last

    last = min(motion%last, size(volume))
    call blocks%fit(motion%first, last)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi) &
    !$omp shared(last, motion, which, frame, position, volume, free, f, v, u, blocks)
    do block = 1, size(blocks%failed)
      lo = motion%first + (block - 1) * n_block
      hi = min(lo + n_block - 1, last)
      if (which(1)) call kick_block(lo, hi, motion, frame, position(:, motion%axis), volume, &
        free, f, v, blocks%damping(1:2, block))
      if (which(2)) call kick_and_drift_block(lo, hi, motion, frame, position(:, motion%axis), &
        volume, free, f, v, u, blocks%damping(3:4, block))
    end do
    !$omp end parallel do
  end subroutine move_points

  !> First half kick and drift of points lo to hi.
  pure subroutine kick_and_drift_block(lo, hi, motion, frame, x, volume, free, f, v, u, work)
    integer,        intent(in)    :: lo, hi
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame
    real(wp),       intent(in),    contiguous :: x(:)       !! coordinate along motion%axis (n) [m]
    real(wp),       intent(in),    contiguous :: volume(:), free(:, :), f(:, :)
    real(wp),       intent(inout), contiguous :: v(:, :), u(:, :)
    real(wp),       intent(out)   :: work(2)
    real(wp) :: drag_work(n_block), frame_work(n_block)
    real(wp) :: half, dt, c, lower1, lower2, slope1, slope2, start, length
    real(wp) :: place, ref1, ref2, drag1, drag2
    integer  :: i, b

    dt = motion%time_step
    c = motion%damping
    half = 0.5_wp * dt / motion%density
    call frame_constants(motion, frame, lower1, lower2, slope1, slope2, start, length)
    if (hi - lo + 1 < n_block) then   ! sums go over whole blocks
      drag_work = 0.0_wp
      frame_work = 0.0_wp
    end if
    !$omp simd simdlen(8) private(b, place, ref1, ref2, drag1, drag2)
    do i = lo, hi
      b = i - lo + 1
      place = place_between(start, length, x(i))
      ref1 = lower1 + slope1 * place
      ref2 = lower2 + slope2 * place
      drag1 = free(i, 1) * c * (v(i, 1) - ref1)
      drag2 = free(i, 2) * c * (v(i, 2) - ref2)
      v(i, 1) = v(i, 1) + half * (free(i, 1) * f(i, 1) - drag1)
      v(i, 2) = v(i, 2) + half * (free(i, 2) * f(i, 2) - drag2)
      u(i, 1) = u(i, 1) + dt * v(i, 1)
      u(i, 2) = u(i, 2) + dt * v(i, 2)
      drag_work(b) = volume(i) * (drag1 * (v(i, 1) - ref1) + drag2 * (v(i, 2) - ref2))
      frame_work(b) = -volume(i) * (drag1 * ref1 + drag2 * ref2)
    end do
    work(1) = 0.5_wp * dt * block_sum(drag_work)
    work(2) = 0.5_wp * dt * block_sum(frame_work)
  end subroutine kick_and_drift_block

  !> Second half kick of points lo to hi.
  pure subroutine kick_block(lo, hi, motion, frame, x, volume, free, f, v, work)
    integer,        intent(in)    :: lo, hi
    type(motion_t), intent(in)    :: motion
    type(frame_t),  intent(in)    :: frame
    real(wp),       intent(in),    contiguous :: x(:)       !! coordinate along motion%axis (n) [m]
    real(wp),       intent(in),    contiguous :: volume(:), free(:, :), f(:, :)
    real(wp),       intent(inout), contiguous :: v(:, :)
    real(wp),       intent(out)   :: work(2)
    real(wp) :: drag_work(n_block), frame_work(n_block)
    real(wp) :: half, c, slow_down, lower1, lower2, slope1, slope2, start, length
    real(wp) :: place, ref1, ref2, drag1, drag2, half1, half2
    integer  :: i, b

    c = motion%damping
    half = 0.5_wp * motion%time_step / motion%density
    slow_down = 1.0_wp / (1.0_wp + half * c)
    call frame_constants(motion, frame, lower1, lower2, slope1, slope2, start, length)
    if (hi - lo + 1 < n_block) then   ! sums go over whole blocks
      drag_work = 0.0_wp
      frame_work = 0.0_wp
    end if
    !$omp simd simdlen(8) private(b, place, ref1, ref2, drag1, drag2, half1, half2)
    do i = lo, hi
      b = i - lo + 1
      place = place_between(start, length, x(i))
      ref1 = lower1 + slope1 * place
      ref2 = lower2 + slope2 * place
      half1 = v(i, 1)
      half2 = v(i, 2)
      v(i, 1) = half1 + free(i, 1) * ((half1 + half * (f(i, 1) + c * ref1)) * slow_down - half1)
      v(i, 2) = half2 + free(i, 2) * ((half2 + half * (f(i, 2) + c * ref2)) * slow_down - half2)
      drag1 = free(i, 1) * c * (v(i, 1) - ref1)
      drag2 = free(i, 2) * c * (v(i, 2) - ref2)
      drag_work(b) = volume(i) * (drag1 * (half1 - ref1) + drag2 * (half2 - ref2))
      frame_work(b) = -volume(i) * (drag1 * ref1 + drag2 * ref2)
    end do
    work(1) = 0.5_wp * motion%time_step * block_sum(drag_work)
    work(2) = 0.5_wp * motion%time_step * block_sum(frame_work)
  end subroutine kick_block

  !> The frame by numbers, which loops keep in registers.
  pure subroutine frame_constants(motion, frame, lower1, lower2, slope1, slope2, start, length)
    type(motion_t), intent(in)  :: motion
    type(frame_t),  intent(in)  :: frame
    real(wp),       intent(out) :: lower1, lower2, slope1, slope2   !! [m/s]
    real(wp),       intent(out) :: start, length                    !! [m]

    lower1 = frame%lower(1)
    lower2 = frame%lower(2)
    slope1 = frame%upper(1) - lower1
    slope2 = frame%upper(2) - lower2
    start = motion%start
    length = motion%length
  end subroutine frame_constants

end module pd_verlet
