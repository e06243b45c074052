!> Loads in the motion: pressure on free sides, and forces on platens that stay plane.
!>
!> Both are dead loads: they keep their direction, and act on the reference lengths. They enter the
!> force density after the internal forces, and do their work on v^{n+1/2}.
!> Source: doc/theory.md, section 7.
module pd_loads
  use pd_boundary, only: boundary_t, table_t
  use pd_kinds, only: wp
  use pd_pressure, only: pressure_t
  implicit none
  private

  public :: apply_loads, load_work

contains

  !> Add the loads of time t to the force density.
  !>
  !> Pressure: f <- f + force / V. A platen under a force F: its points all get the mean
  !>
  !>   f <- (sum V f + F) / sum V
  !>
  !> so that, having the same velocity, they keep it, and the platen moves as one.
  pure subroutine apply_loads(pressures, boundaries, volume, t, f)
    type(pressure_t), intent(in)    :: pressures(:)
    type(boundary_t), intent(in)    :: boundaries(:)
    real(wp),         intent(in)    :: volume(:)   !! V (n) [m^2]
    real(wp),         intent(in)    :: t           !! [s]
    real(wp),         intent(inout) :: f(:, :)     !! force density (n,2) [N/m^3]
    integer :: c, k

    do k = 1, size(pressures)
      call add_forces(pressures(k)%points, pressures(k)%factor%rate(t), pressures(k)%force, &
        volume, f(:, pressures(k)%axis))
    end do
    do k = 1, size(boundaries)
      do c = 1, 2
        if (boundaries(k)%held(c)) call share_force(boundaries(k)%points, &
          boundaries(k)%factor%rate(t) * boundaries(k)%applied(c), volume, f(:, c))
      end do
    end do
  end subroutine apply_loads

  !> f <- f + factor force / V at some points.
  pure subroutine add_forces(points, factor, force, volume, f)
    integer,  intent(in)    :: points(:)
    real(wp), intent(in)    :: factor, force(:)   !! force on each of the points [N/m]
    real(wp), intent(in)    :: volume(:)          !! V (n) [m^2]
    real(wp), intent(inout) :: f(:)               !! one component (n) [N/m^3]
    integer :: k

    do k = 1, size(points)
      f(points(k)) = f(points(k)) + factor * force(k) / volume(points(k))
    end do
  end subroutine add_forces

  !> f <- (sum V f + force) / sum V at some points.
  pure subroutine share_force(points, force, volume, f)
    integer,  intent(in)    :: points(:)
    real(wp), intent(in)    :: force       !! on all of the points [N/m]
    real(wp), intent(in)    :: volume(:)   !! V (n) [m^2]
    real(wp), intent(inout) :: f(:)        !! one component (n) [N/m^3]
    real(wp) :: total, area
    integer  :: k

    total = force
    area = 0.0_wp
    do k = 1, size(points)
      total = total + volume(points(k)) * f(points(k))
      area = area + volume(points(k))
    end do
    do k = 1, size(points)
      f(points(k)) = total / area
    end do
  end subroutine share_force

  !> Work of the loads from t to t_next, by the trapezoidal rule over the displacement of the step.
  pure real(wp) function load_work(pressures, boundaries, v, t, t_next) result(work)
    type(pressure_t), intent(in) :: pressures(:)
    type(boundary_t), intent(in) :: boundaries(:)
    real(wp),         intent(in) :: v(:, :)     !! v^{n+1/2} (n,2) [m/s]
    real(wp),         intent(in) :: t, t_next   !! [s]
    real(wp) :: power
    integer  :: c, k, p

    work = 0.0_wp
    do k = 1, size(pressures)
      associate (load => pressures(k))
        power = 0.0_wp
        do p = 1, size(load%points)
          power = power + load%force(p) * v(load%points(p), load%axis)
        end do
        work = work + (t_next - t) * mean_factor(load%factor) * power
      end associate
    end do
    do k = 1, size(boundaries)
      do c = 1, 2
        if (boundaries(k)%held(c)) work = work + (t_next - t) &
          * mean_factor(boundaries(k)%factor) * boundaries(k)%applied(c) &
          * v(boundaries(k)%points(1), c)
      end do
    end do

  contains

    pure real(wp) function mean_factor(factor)
      type(table_t), intent(in) :: factor

      mean_factor = 0.5_wp * (factor%rate(t) + factor%rate(t_next))
    end function mean_factor

  end function load_work

end module pd_loads
