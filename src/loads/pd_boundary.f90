!> Motion of the fictitious points, and the forces that the boundaries apply.
!>
!> A boundary moves in one or two modes, u_i(t) = sum_k a_k(t) m_k(X_i): rigid along x and y
!> (m = e_x, e_y), or affine (m = L X). The rates of a_k are piecewise linear tables.
!> Source: doc/theory.md, section 7.
module pd_boundary
  use pd_kinds, only: wp
  implicit none
  private

  public :: table_t, boundary_t, platens_t, new_rigid_boundary, new_affine_boundary
  public :: new_ramp, control_by_force
  public :: move, boundary_forces, motion_work, mark_free
  public :: nominal_strain, time_of_strain
  public :: reference_ends

  !> Rate that is linear between its times and constant before the first and after the last.
  type :: table_t
    real(wp), allocatable :: times(:)    !! ascending [s]
    real(wp), allocatable :: rates(:)
  contains
    procedure :: rate
    procedure :: integral
  end type table_t

  !> A set of fictitious points with its motion and the forces of the present step.
  type :: boundary_t
    character(:), allocatable :: name
    integer, allocatable :: points(:)
    logical :: affine = .false.
    logical :: prescribed(2) = .false.       !! components whose motion is prescribed
    logical :: held(2) = .false.             !! components in which all points move as one
    real(wp) :: applied(2) = 0.0_wp          !! force on these from outside, at full load [N/m]
    type(table_t) :: factor                  !! on `applied`; allocated where any is held
    real(wp) :: gradient(4) = 0.0_wp         !! L xx xy yx yy [1/s]; affine only
    type(table_t) :: tables(2)               !! rigid: velocity x, y [m/s]; affine: factor, -
    real(wp) :: force(2) = 0.0_wp            !! that the boundary applies to the body [N/m]
    real(wp) :: mode_force(2) = 0.0_wp       !! work-conjugate to a_k
    real(wp) :: mode_force_before(2) = 0.0_wp   !! in the step before
    real(wp) :: mode_mass(2) = 0.0_wp        !! rho sum V |m_k|^2
  end type boundary_t

  !> Two boundaries that approach each other along an axis.
  type :: platens_t
    integer  :: axis = 0                     !! 1: x, 2: y, 0: there are no platens
    integer  :: first = 0, second = 0        !! boundaries at the lower and the upper end
    real(wp) :: start = 0.0_wp               !! coordinate of the lower end of the body [m]
    real(wp) :: length = 1.0_wp              !! extent of the body between them [m]
    real(wp) :: width = 1.0_wp               !! extent of the body across the axis [m]
  end type platens_t

contains

  !> Rate at time t.
  pure real(wp) function rate(self, t)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]
    integer :: k, n

    n = size(self%times)
    rate = self%rates(n)
    if (t >= self%times(n)) return
    rate = self%rates(1)
    do k = 1, n - 1
      if (t < self%times(k) .or. t >= self%times(k + 1)) cycle
      rate = self%rates(k) + (self%rates(k + 1) - self%rates(k)) &
        * (t - self%times(k)) / (self%times(k + 1) - self%times(k))
    end do
  end function rate

  !> Integral of the rate from 0 to t: exact, the trapezoidal rule piece by piece.
  pure real(wp) function integral(self, t)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]
    real(wp) :: a, b, rate_a
    integer  :: k

    integral = 0.0_wp
    a = 0.0_wp
    rate_a = self%rate(a)
    do k = 1, size(self%times)
      if (self%times(k) <= a) cycle
      b = min(t, self%times(k))
      integral = integral + 0.5_wp * (b - a) * (rate_a + piece_end(self, k, b))
      a = b
      rate_a = self%rates(k)
      if (a >= t) return
    end do
    integral = integral + (t - a) * self%rates(size(self%rates))
  end function integral

  !> Rate at b, reached from below within the piece that ends at times(k).
  pure real(wp) function piece_end(table, k, b)
    type(table_t), intent(in) :: table
    integer,       intent(in) :: k
    real(wp),      intent(in) :: b

    if (b < table%times(k)) then
      piece_end = table%rate(b)
    else
      piece_end = table%rates(k)
    end if
  end function piece_end

  !> Boundary that moves as a rigid body along x and y.
  pure function new_rigid_boundary(name, points, prescribed, table_x, table_y) result(boundary)
    character(*),  intent(in) :: name
    integer,       intent(in) :: points(:)
    logical,       intent(in) :: prescribed(2)
    type(table_t), intent(in) :: table_x, table_y   !! velocities [m/s]
    type(boundary_t) :: boundary

    boundary%name = name
    allocate (boundary%points(size(points)), source=points)
    boundary%prescribed = prescribed
    boundary%tables(1) = table_x
    boundary%tables(2) = table_y
  end function new_rigid_boundary

  !> Boundary whose points follow v = factor(t) L X about the origin of the coordinates.
  pure function new_affine_boundary(name, points, gradient, factor) result(boundary)
    character(*),  intent(in) :: name
    integer,       intent(in) :: points(:)
    real(wp),      intent(in) :: gradient(4)        !! L xx xy yx yy [1/s]
    type(table_t), intent(in) :: factor
    type(boundary_t) :: boundary

    boundary%name = name
    allocate (boundary%points(size(points)), source=points)
    boundary%affine = .true.
    boundary%prescribed = .true.
    boundary%gradient = gradient
    boundary%tables(1) = factor
    boundary%tables(2) = factor
  end function new_affine_boundary

  !> A factor that rises linearly from 0 to 1 in a time, and is 1 at once where that is 0.
  pure function new_ramp(duration) result(factor)
    real(wp), intent(in) :: duration   !! [s]
    type(table_t) :: factor

    if (duration > 0.0_wp) then
      allocate (factor%times(2), factor%rates(2))
      factor%times = [0.0_wp, duration]
      factor%rates = [0.0_wp, 1.0_wp]
    else
      allocate (factor%times(1), source=0.0_wp)
      allocate (factor%rates(1), source=1.0_wp)
    end if
  end function new_ramp

  !> Let a given force move a rigid boundary in the components that were prescribed. The boundary
  !> translates and does not rotate; its mass is that of its points.
  pure subroutine control_by_force(force, factor, boundary)
    real(wp),         intent(in)    :: force(2)   !! from outside, at full load [N/m]
    type(table_t),    intent(in)    :: factor
    type(boundary_t), intent(inout) :: boundary

    boundary%held = boundary%prescribed
    boundary%prescribed = .false.
    boundary%applied = merge(force, 0.0_wp, boundary%held)
    boundary%factor = factor
  end subroutine control_by_force

  !> Vector L X.
  pure function affine_mode(gradient, x) result(m)
    real(wp), intent(in) :: gradient(4), x(2)
    real(wp) :: m(2)

    m = [gradient(1) * x(1) + gradient(2) * x(2), gradient(3) * x(1) + gradient(4) * x(2)]
  end function affine_mode

  !> Mark the components that move freely with 1, the prescribed ones with 0, and weigh the modes.
  pure subroutine mark_free(position, volume, density, boundaries, free)
    real(wp),         intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),         intent(in)    :: volume(:)        !! V (n) [m^2]
    real(wp),         intent(in)    :: density          !! rho [kg/m^3]
    type(boundary_t), intent(inout) :: boundaries(:)
    real(wp),         intent(inout) :: free(:, :)       !! (n,2); in: 1 where there is a point
    integer :: b, k, p

    do b = 1, size(boundaries)
      associate (boundary => boundaries(b))
        boundary%mode_mass = 0.0_wp
        do k = 1, size(boundary%points)
          p = boundary%points(k)
          where (boundary%prescribed) free(p, :) = 0.0_wp
          if (boundary%affine) then
            boundary%mode_mass(1) = boundary%mode_mass(1) + density * volume(p) &
              * sum(affine_mode(boundary%gradient, position(p, :))**2)
          else
            where (boundary%prescribed) &
              boundary%mode_mass = boundary%mode_mass + density * volume(p)
          end if
        end do
      end associate
    end do
  end subroutine mark_free

  !> Put the prescribed components where they are at time t.
  pure subroutine move(boundaries, position, t, u, v)
    type(boundary_t), intent(in)    :: boundaries(:)
    real(wp),         intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),         intent(in)    :: t                !! [s]
    real(wp),         intent(inout) :: u(:, :)          !! (n,2) [m]
    real(wp),         intent(inout) :: v(:, :)          !! (n,2) [m/s]
    real(wp) :: a(2), rate(2), mode(2)
    integer  :: b, k, p

    do b = 1, size(boundaries)
      associate (boundary => boundaries(b))
        do k = 1, 2
          a(k) = boundary%tables(k)%integral(t)
          rate(k) = boundary%tables(k)%rate(t)
        end do
        mode = 1.0_wp
        do k = 1, size(boundary%points)
          p = boundary%points(k)
          if (boundary%affine) mode = affine_mode(boundary%gradient, position(p, :))
          if (boundary%prescribed(1)) u(p, 1) = a(1) * mode(1)
          if (boundary%prescribed(2)) u(p, 2) = a(2) * mode(2)
          if (boundary%prescribed(1)) v(p, 1) = rate(1) * mode(1)
          if (boundary%prescribed(2)) v(p, 2) = rate(2) * mode(2)
        end do
      end associate
    end do
  end subroutine move

  !> Force that each boundary applies to the body, - sum V f of the internal forces over its
  !> prescribed components, and the forces conjugate to its modes.
  !>
  !> Where a boundary is held, f contains the force applied to it; the rest is internal.
  pure subroutine boundary_forces(position, volume, t, f, boundaries)
    real(wp),         intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),         intent(in)    :: volume(:)        !! V (n) [m^2]
    real(wp),         intent(in)    :: t                !! [s]
    real(wp),         intent(in)    :: f(:, :)          !! force density, with loads (n,2) [N/m^3]
    type(boundary_t), intent(inout) :: boundaries(:)
    integer :: b, k, p

    do b = 1, size(boundaries)
      associate (boundary => boundaries(b))
        boundary%force = 0.0_wp
        boundary%mode_force_before = boundary%mode_force
        boundary%mode_force = 0.0_wp
        do k = 1, size(boundary%points)
          p = boundary%points(k)
          where (boundary%prescribed .or. boundary%held) &
            boundary%force = boundary%force - volume(p) * f(p, :)
          if (boundary%affine) boundary%mode_force(1) = boundary%mode_force(1) &
            - volume(p) * sum(f(p, :) * affine_mode(boundary%gradient, position(p, :)))
        end do
        if (any(boundary%held)) &
          boundary%force = boundary%force + boundary%factor%rate(t) * boundary%applied
        if (.not. boundary%affine) boundary%mode_force = boundary%force
      end associate
    end do
  end subroutine boundary_forces

  !> Work of the prescribed motion from t to t_next on everything that moves with it: the
  !> reactions, by the trapezoidal rule, and the kinetic energy of the prescribed components.
  pure real(wp) function motion_work(boundaries, t, t_next) result(work)
    type(boundary_t), intent(in) :: boundaries(:)   !! with the forces at t and t_next
    real(wp),         intent(in) :: t, t_next       !! [s]
    integer :: b, k

    work = 0.0_wp
    do b = 1, size(boundaries)
      associate (boundary => boundaries(b))
        do k = 1, merge(1, 2, boundary%affine)
          associate (table => boundary%tables(k))
            work = work + 0.5_wp * (boundary%mode_force_before(k) + boundary%mode_force(k)) &
              * (table%integral(t_next) - table%integral(t)) &
              + 0.5_wp * boundary%mode_mass(k) * (table%rate(t_next)**2 - table%rate(t)**2)
          end associate
        end do
      end associate
    end do
  end function motion_work

  !> Nominal strain at time t: relative approach of the platens over the extent of the body
  !> between them, compression positive. Without displacements all motion must be prescribed.
  pure real(wp) function nominal_strain(platens, boundaries, t, u) result(strain)
    type(platens_t),  intent(in) :: platens
    type(boundary_t), intent(in) :: boundaries(:)
    real(wp),         intent(in) :: t            !! [s]
    real(wp),         intent(in), optional :: u(:, :)   !! at time t (n,2) [m]

    strain = (displacement(boundaries(platens%first)) &
      - displacement(boundaries(platens%second))) / platens%length

  contains

    !> Displacement of a platen along the axis: by its tables, or that of its points.
    pure real(wp) function displacement(boundary)
      type(boundary_t), intent(in) :: boundary

      if (boundary%held(platens%axis) .and. present(u)) then
        displacement = u(boundary%points(1), platens%axis)
      else
        displacement = boundary%tables(platens%axis)%integral(t)
      end if
    end function displacement

  end function nominal_strain

  !> The first time at which the nominal strain reaches a value; -1 where it never does.
  !>
  !> Between two entries of the tables the strain is a quadratic in time.
  pure real(wp) function time_of_strain(platens, boundaries, strain) result(time)
    type(platens_t),  intent(in) :: platens
    type(boundary_t), intent(in) :: boundaries(:)
    real(wp),         intent(in) :: strain
    real(wp) :: a, b, missing, slope, curvature
    logical  :: last

    time = -1.0_wp
    a = 0.0_wp
    do
      b = min(next_time(platens%first), next_time(platens%second))
      last = b >= 0.5_wp * huge(1.0_wp)
      missing = strain - nominal_strain(platens, boundaries, a)
      slope = approach(a)
      if (missing <= 1.0e-12_wp * strain) then
        time = a
      else if (last) then
        if (slope > 0.0_wp) time = a + missing / slope
      else
        curvature = (approach(b) - slope) / (b - a)
        time = a + first_root(0.5_wp * curvature, slope, -missing)
        if (time < a .or. time > b + 1.0e-6_wp * (b - a)) time = -1.0_wp
        time = min(time, b)
      end if
      if (time >= 0.0_wp .or. last) return
      a = b
    end do

  contains

    !> Rate of the nominal strain (tables are continuous).
    pure real(wp) function approach(t)
      real(wp), intent(in) :: t

      approach = (boundaries(platens%first)%tables(platens%axis)%rate(t) &
        - boundaries(platens%second)%tables(platens%axis)%rate(t)) / platens%length
    end function approach

    !> First entry of the table of a platen after a; huge where there is none.
    pure real(wp) function next_time(boundary)
      integer, intent(in) :: boundary

      next_time = minval(boundaries(boundary)%tables(platens%axis)%times, &
        mask=boundaries(boundary)%tables(platens%axis)%times > a)
    end function next_time

  end function time_of_strain

  !> Smallest non-negative root of p x^2 + q x + r with r < 0; -1 where there is none.
  pure real(wp) function first_root(p, q, r) result(x)
    real(wp), intent(in) :: p, q, r
    real(wp) :: discriminant

    x = -1.0_wp
    discriminant = q**2 - 4.0_wp * p * r
    if (discriminant < -1.0e-9_wp * q**2) return   ! at the peak of a table round-off decides
    discriminant = max(0.0_wp, discriminant)
    if (q + sqrt(discriminant) > 0.0_wp) x = -2.0_wp * r / (q + sqrt(discriminant))
  end function first_root

  !> Velocity of the affine frame of the platens at both ends: the damping acts against it. Along
  !> the axis it is that of the platens; across it, what the rough platens prescribe.
  pure subroutine reference_ends(platens, boundaries, t, lower, upper)
    type(platens_t),  intent(in)  :: platens
    type(boundary_t), intent(in)  :: boundaries(:)
    real(wp),         intent(in)  :: t                    !! [s]
    real(wp),         intent(out) :: lower(2), upper(2)   !! [m/s]
    integer :: k

    lower = 0.0_wp
    upper = 0.0_wp
    if (platens%axis == 0) return
    do k = 1, 2
      associate (one => boundaries(platens%first), two => boundaries(platens%second))
        if (one%prescribed(k)) lower(k) = one%tables(k)%rate(t)
        if (two%prescribed(k)) upper(k) = two%tables(k)%rate(t)
        if (.not. one%prescribed(k)) lower(k) = upper(k)
        if (.not. two%prescribed(k)) upper(k) = lower(k)
      end associate
    end do
  end subroutine reference_ends

end module pd_boundary
