!> Motion in time: velocity Verlet, the damping implicit in the second half kick.
!>
!>   v^{n+1/2} = v^n + dt/2 (f^n - C (v^n - v_ref)) / rho,   u^{n+1} = u^n + dt v^{n+1/2}
!>   v^{n+1}   = (v^{n+1/2} + dt/2 (f^{n+1} + C v_ref) / rho) / (1 + dt C / (2 rho))
!>
!> Prescribed components are left to the supports.
!> Source: doc/theory.md, section 6.
module pd_verlet
  use pd_kinds, only: block_sum, n_block, wp
  use pd_model, only: damping_frame_t, model_t
  use pd_state, only: block_work_t, state_t
  implicit none
  private

  public :: kicks_t, move_points

  !> Half kicks of a pass over the points: the second one ends a step, the first one, with the
  !> drift, begins the next.
  type :: kicks_t
    logical :: second = .false., first = .false.
  end type kicks_t

  !> The rows of a half kick, and numbers that loops keep in registers.
  type :: kick_t
    integer  :: lo, hi
    real(wp) :: dt, half, c           !! [s], dt / (2 rho), C
    real(wp) :: lower(2), slope(2)    !! v_ref at the lower end, and from there to the upper [m/s]
  end type kick_t

contains

  !> Second half kick of a step, first half kick and drift of the next, or both: together they take
  !> one pass through memory, and give the same bits.
  !>
  !> `work%damping`, per block, half a step's work of the damping force C (v - v_ref) in the second
  !> half kick: on v - v_ref: dissipated (1), and of the force -C (v - v_ref) on v_ref: done by
  !> whoever moves the frame (2); in the first half kick likewise (3, 4) [J/m].
  subroutine move_points(kicks, model, frame, time_step, state, work)
    type(kicks_t),         intent(in)    :: kicks
    type(model_t),         intent(in)    :: model
    type(damping_frame_t), intent(in)    :: frame       !! at the time between the two steps
    real(wp),              intent(in)    :: time_step   !! dt [s]
    type(state_t),         intent(inout) :: state       !! reads force; moves velocity, displacement
    type(block_work_t),    intent(inout) :: work
    integer :: block

    call work%fit(model%blocks)
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(kicks, model, frame, time_step, state, work)
    do block = 1, model%blocks%count
      call move_block(block, kicks, model, frame, time_step, state, work%damping(:, block))
    end do
    !$omp end parallel do
  end subroutine move_points

  !> The same for one block.
  pure subroutine move_block(block, kicks, model, frame, time_step, state, work)
    integer,               intent(in)    :: block
    type(kicks_t),         intent(in)    :: kicks
    type(model_t),         intent(in)    :: model
    type(damping_frame_t), intent(in)    :: frame
    real(wp),              intent(in)    :: time_step
    type(state_t),         intent(inout) :: state
    real(wp),              intent(out)   :: work(4)
    type(kick_t) :: kick
    real(wp)     :: part(2)
    integer      :: k

    work = 0.0_wp
    do k = model%materials%first_run(block), model%materials%first_run(block + 1) - 1
      associate (run => model%materials%runs(k), points => model%points, &
        u => state%displacement, v => state%velocity, f => state%force)
        kick = kick_t(run%lo, run%hi, time_step, &
          0.5_wp * time_step / model%materials%list(run%material)%density, model%damping, &
          frame%lower, frame%upper - frame%lower)
        if (kicks%second) then
          call kick_rows(kick, points%free, points%volume, points%place, f, v, part)
          work(1:2) = work(1:2) + part
        end if
        if (kicks%first) then
          call kick_and_drift_rows(kick, points%free, points%volume, points%place, f, v, u, part)
          work(3:4) = work(3:4) + part
        end if
      end associate
    end do
  end subroutine move_block

  !> First half kick and drift of the rows of a kick.
  pure subroutine kick_and_drift_rows(kick, free, volume, place, f, v, u, work)
    type(kick_t),   intent(in)    :: kick
    real(wp),       intent(in),    contiguous :: free(:, :), volume(:), place(:)   !! see points_t
    real(wp),       intent(in),    contiguous :: f(:, :)            !! f^n (n,2) [N/m^3]
    real(wp),       intent(inout), contiguous :: v(:, :), u(:, :)   !! v^n -> v^{n+1/2}, u
    real(wp),       intent(out)   :: work(2)                        !! [J/m]
    real(wp) :: drag_work(n_block), frame_work(n_block)
    real(wp) :: ref1, ref2, drag1, drag2, lower1, lower2, slope1, slope2
    integer  :: i, b

    lower1 = kick%lower(1)
    lower2 = kick%lower(2)
    slope1 = kick%slope(1)
    slope2 = kick%slope(2)
    if (kick%hi - kick%lo + 1 < n_block) then   ! sums go over whole blocks
      drag_work = 0.0_wp
      frame_work = 0.0_wp
    end if
    associate (lo => kick%lo, half => kick%half, c => kick%c, dt => kick%dt)
      !$omp simd simdlen(8) private(b, ref1, ref2, drag1, drag2)
      do i = lo, kick%hi
        b = i - lo + 1
        ref1 = lower1 + slope1 * place(i)
        ref2 = lower2 + slope2 * place(i)
        drag1 = free(i, 1) * c * (v(i, 1) - ref1)
        drag2 = free(i, 2) * c * (v(i, 2) - ref2)
        v(i, 1) = v(i, 1) + half * (free(i, 1) * f(i, 1) - drag1)
        v(i, 2) = v(i, 2) + half * (free(i, 2) * f(i, 2) - drag2)
        u(i, 1) = u(i, 1) + dt * v(i, 1)
        u(i, 2) = u(i, 2) + dt * v(i, 2)
        drag_work(b) = volume(i) * (drag1 * (v(i, 1) - ref1) + drag2 * (v(i, 2) - ref2))
        frame_work(b) = -volume(i) * (drag1 * ref1 + drag2 * ref2)
      end do
    end associate
    work(1) = 0.5_wp * kick%dt * block_sum(drag_work)
    work(2) = 0.5_wp * kick%dt * block_sum(frame_work)
  end subroutine kick_and_drift_rows

  !> Second half kick of the rows of a kick.
  pure subroutine kick_rows(kick, free, volume, place, f, v, work)
    type(kick_t),   intent(in)    :: kick
    real(wp),       intent(in),    contiguous :: free(:, :), volume(:), place(:)   !! see points_t
    real(wp),       intent(in),    contiguous :: f(:, :)   !! f^{n+1} (n,2) [N/m^3]
    real(wp),       intent(inout), contiguous :: v(:, :)   !! v^{n+1/2} -> v^{n+1} (n,2) [m/s]
    real(wp),       intent(out)   :: work(2)               !! [J/m]
    real(wp) :: drag_work(n_block), frame_work(n_block)
    real(wp) :: slow_down, lower1, lower2, slope1, slope2
    real(wp) :: ref1, ref2, drag1, drag2, half1, half2
    integer  :: i, b

    slow_down = 1.0_wp / (1.0_wp + kick%half * kick%c)
    lower1 = kick%lower(1)
    lower2 = kick%lower(2)
    slope1 = kick%slope(1)
    slope2 = kick%slope(2)
    if (kick%hi - kick%lo + 1 < n_block) then   ! sums go over whole blocks
      drag_work = 0.0_wp
      frame_work = 0.0_wp
    end if
    associate (lo => kick%lo, half => kick%half, c => kick%c)
      !$omp simd simdlen(8) private(b, ref1, ref2, drag1, drag2, half1, half2)
      do i = lo, kick%hi
        b = i - lo + 1
        ref1 = lower1 + slope1 * place(i)
        ref2 = lower2 + slope2 * place(i)
        half1 = v(i, 1)
        half2 = v(i, 2)
        v(i, 1) = half1 + free(i, 1) * ((half1 + half * (f(i, 1) + c * ref1)) * slow_down - half1)
        v(i, 2) = half2 + free(i, 2) * ((half2 + half * (f(i, 2) + c * ref2)) * slow_down - half2)
        drag1 = free(i, 1) * c * (v(i, 1) - ref1)
        drag2 = free(i, 2) * c * (v(i, 2) - ref2)
        drag_work(b) = volume(i) * (drag1 * (half1 - ref1) + drag2 * (half2 - ref2))
        frame_work(b) = -volume(i) * (drag1 * ref1 + drag2 * ref2)
      end do
    end associate
    work(1) = 0.5_wp * kick%dt * block_sum(drag_work)
    work(2) = 0.5_wp * kick%dt * block_sum(frame_work)
  end subroutine kick_rows

end module pd_verlet
