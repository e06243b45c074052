!> Pressure on a side of the body: a dead load, and which points carry how much of it.
!>
!> Families are cut off at a surface, so a homogeneous stress P is in equilibrium only with forces
!> P N_i on the points near it. A pressure applies exactly these: N_i is its weight at a point.
!> Loads on the outermost points alone would put several times the stress there.
!> Source: doc/theory.md, section 7.
module pd_pressure
  use pd_balance, only: left_by_unit_stress
  use pd_kinds, only: wp
  use pd_loads, only: load_t
  use pd_operators, only: operators_t
  use pd_point_sets, only: side_t
  use pd_ranks, only: ranks_t
  use pd_tables, only: new_ramp, table_t
  use pd_text, only: integer_text, short_number
  implicit none
  private

  public :: pressure_t, new_pressure, spread_pressure, surface_vectors, surface_t

  !> A pressure on a side of the body.
  type, extends(load_t) :: pressure_t
    character(:), allocatable :: side
    integer :: axis = 0                       !! along which it pushes; 1: x, 2: y
    integer,  allocatable :: points(:)
    real(wp), allocatable :: force(:)         !! on each point at full load, along the axis [N/m]
    real(wp) :: length = 0.0_wp               !! of the side of the body that it acts on [m]
    type(table_t) :: factor                   !! on the forces
    real(wp), private :: value = 0.0_wp       !! at full load [Pa]
    real(wp), private :: span(2) = [-huge(1.0_wp), huge(1.0_wp)]   !! along the side [m]
    real(wp), private :: ramp_time = 0.0_wp   !! full load from then on [s]
    logical,  private :: on_layers = .false.  !! also on layers that continue the body
  contains
    procedure :: add_forces
    procedure :: work
    procedure :: description
  end type pressure_t

  !> What a pressure has to know about a side: its points and those below them.
  type :: surface_t
    type(side_t) :: side
    integer, allocatable :: lines(:, :)       !! the points below each of the side, it included, 0:
                                              !! none (2 depth + 2, points of the side)
    integer  :: depth = 0                     !! rows below a surface with N_i
    real(wp) :: spacing = 0.0_wp              !! dx [m]
    real(wp), allocatable :: weights(:)       !! N_i along the normal, of all points (n) [m]
    logical,  allocatable :: slides(:)        !! free along the normal: the body, layers that slide
    logical,  allocatable :: in_body(:)       !! no layers (n)
  end type surface_t

contains

  !> N_i = V_i sum_j omega V_j (K_i^-1 + K_j^-1) xi: a homogeneous stress P leaves the force P N_i
  !> on point i. Zero inside; the sum over a surface is its length, directed into the body. It is
  !> the force of the operators for a stress of 1.
  subroutine surface_vectors(operators, volume, vectors)
    class(operators_t), intent(inout) :: operators
    real(wp),           intent(in),  contiguous :: volume(:)       !! V (n) [m^2]
    real(wp),           intent(inout), contiguous :: vectors(:, :) !! out: N (n,2) [m]

    call left_by_unit_stress(operators, vectors)
    vectors(:, 1) = volume * vectors(:, 1)
    vectors(:, 2) = volume * vectors(:, 2)
  end subroutine surface_vectors

  !> Pressure on a part of a side, not yet divided among the points.
  pure type(pressure_t) function new_pressure(name, side, value, span, ramp_time) result(pressure)
    character(*), intent(in) :: name, side
    real(wp),     intent(in) :: value         !! at full load [Pa]
    real(wp),     intent(in) :: span(:)       !! from, to, along the side [m]; size 0: whole side
    real(wp),     intent(in) :: ramp_time     !! full load from then on [s]

    pressure%name = name
    pressure%kind = 'pressure'
    pressure%side = side
    pressure%value = value
    if (size(span) > 0) pressure%span = span
    pressure%ramp_time = ramp_time
    pressure%factor = new_ramp(ramp_time)
  end function new_pressure

  !> Give each point its part of a pressure. Every line of points across the side carries the
  !> pressure on its part of the side within the span, by the weights N_i; a common factor makes
  !> the sum equal to the pressure times the length. No points: nothing to act on.
  pure subroutine spread_pressure(surface, pressure)
    type(surface_t),  intent(in)    :: surface
    type(pressure_t), intent(inout) :: pressure
    real(wp), allocatable :: part(:), weight(:)
    integer,  allocatable :: points(:)
    real(wp) :: inwards
    integer  :: j, k, n

    associate (side => surface%side, lines => surface%lines, depth => surface%depth)
      pressure%axis = side%axis
      inwards = -real(side%outward, wp)
      allocate (part(size(side%points)))
      call find_parts(surface, pressure, part)
      allocate (points((depth + 1) * size(part)), weight((depth + 1) * size(part)))
      n = 0
      do k = 1, size(part)
        if (part(k) <= 0.0_wp) cycle
        ! the other half of a line belongs to the other side
        do j = 1, min(depth + 1, max(1, length_of(lines(:, k)) / 2))
          if (.not. surface%slides(lines(j, k))) cycle
          n = n + 1
          points(n) = lines(j, k)
          weight(n) = surface%weights(lines(j, k)) * part(k) / (side%to(k) - side%from(k))
        end do
      end do
    end associate
    if (inwards * sum(weight(:n)) <= 0.0_wp) n = 0
    allocate (pressure%points(n), source=points(:n))
    allocate (pressure%force(n), source=weight(:n))
    if (n > 0) pressure%force = inwards * pressure%value * sum(part) / sum(weight(:n)) * weight(:n)
    pressure%on_layers = .not. all(surface%in_body(pressure%points))
  end subroutine spread_pressure

  !> The length of the side that each of its points stands for within the span, 0 where it does not
  !> slide along the pressure.
  !>
  !> If the span reaches an end of the side where a layer has points that slide, the layer stands
  !> for the body going on: it carries the pressure too.
  pure subroutine find_parts(surface, pressure, part)
    type(surface_t),  intent(in)    :: surface
    type(pressure_t), intent(inout) :: pressure
    real(wp),         intent(out)   :: part(:)   !! [m]
    logical  :: carries(size(part))
    real(wp) :: ends(2), near

    near = 1.0e-6_wp * surface%spacing
    associate (side => surface%side, lower => surface%side%lower, upper => surface%side%upper)
      carries = surface%slides(side%points)
      ends = [max(pressure%span(1), lower), min(pressure%span(2), upper)]
      pressure%length = sum(max(0.0_wp, min(side%to, ends(2)) - max(side%from, ends(1))), &
        mask=surface%in_body(side%points))
      if (ends(1) <= lower + near .and. any(carries .and. side%to < lower + near)) &
        ends(1) = minval(side%from)
      if (ends(2) >= upper - near .and. any(carries .and. side%from > upper - near)) &
        ends(2) = maxval(side%to)
      part = merge(min(side%to, ends(2)) - max(side%from, ends(1)), 0.0_wp, carries)
    end associate
    where (part <= near) part = 0.0_wp
  end subroutine find_parts

  !> How many points follow each other without a gap.
  pure integer function length_of(line) result(n)
    integer, intent(in) :: line(:)

    do n = 0, size(line) - 1
      if (line(n + 1) == 0) return
    end do
    n = size(line)
  end function length_of

  !> f <- f + factor force / V at the points.
  pure subroutine add_forces(self, volume, t, f)
    class(pressure_t), intent(in)    :: self
    real(wp),          intent(in)    :: volume(:), t
    real(wp),          intent(inout) :: f(:, :)
    real(wp) :: factor
    integer  :: k

    factor = self%factor%rate(t)
    associate (points => self%points, axis => self%axis)
      do k = 1, size(points)
        f(points(k), axis) = f(points(k), axis) + factor * self%force(k) / volume(points(k))
      end do
    end associate
  end subroutine add_forces

  pure real(wp) function work(self, v, t, t_next)
    class(pressure_t), intent(in) :: self
    real(wp),          intent(in) :: v(:, :), t, t_next
    real(wp) :: power
    type(ranks_t) :: ranks

    power = ranks%total(self%force * v(self%points, self%axis))
    work = (t_next - t) * (0.5_wp * (self%factor%rate(t) + self%factor%rate(t_next))) * power
  end function work

  pure function description(self) result(text)
    class(pressure_t), intent(in) :: self
    character(:), allocatable :: text

    text = self%name//': '//short_number(self%value)//' Pa on '//self%side//', '// &
      short_number(self%length)//' m of the body'
    if (self%on_layers) text = text//' and layers that continue it'
    text = text//', '//integer_text(size(self%points))//' points: '// &
      short_number(abs(sum(self%force)))//' N/m in all'
    if (self%ramp_time > 0.0_wp) text = text//', whole from '//short_number(self%ramp_time)//' s'
  end function description

end module pd_pressure
