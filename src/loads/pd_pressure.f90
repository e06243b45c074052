!> Pressure on edges of the body: a dead load, and which points carry how much of it.
!>
!> Families are cut off at a surface, so a homogeneous stress P is in equilibrium only with forces
!> P N_i on the points near it. A pressure applies exactly these: N_i is its weight at a point, and
!> `pd_edge_weights` says which part of it belongs to which edge. Loads on the outermost points
!> alone would put several times the stress there.
!> Source: doc/theory.md, section 7.
module pd_pressure
  use pd_balance, only: left_by_unit_stress
  use pd_doubt_list, only: doubt_kinds, kind_number
  use pd_edge_weights, only: edge_weights_t
  use pd_edges, only: edge_t
  use pd_kinds, only: ordered_sum, wp
  use pd_loads, only: load_t
  use pd_operators, only: operators_t
  use pd_point_sets, only: side_t
  use pd_tables, only: new_ramp, table_t
  use pd_text, only: integer_text, short_number
  implicit none
  private

  public :: pressure_t, new_pressure, spread_on_side, spread_on_edges, surface_vectors, surface_t

  !> A pressure on a side or on edges of the body.
  type, extends(load_t) :: pressure_t
    character(:), allocatable :: place        !! what it acts on, in words
    integer,  allocatable :: points(:)
    real(wp), allocatable :: force(:, :)      !! on each point at full load, x and y (n,2) [N/m]
    real(wp) :: length = 0.0_wp               !! of the edges of the body that it acts on [m]
    type(table_t) :: factor                   !! on the forces
    real(wp), private :: value = 0.0_wp       !! at full load [Pa]
    real(wp), private :: span(2) = [-huge(1.0_wp), huge(1.0_wp)]   !! along the side [m]
    real(wp), private :: ramp_time = 0.0_wp   !! full load from then on [s]
    logical,  private :: on_layers = .false.  !! also on layers that continue the body
  contains
    procedure :: add_forces
    procedure :: work
    procedure :: description
    procedure :: mark_read
  end type pressure_t

  !> The surface of the body, for pressures.
  type :: surface_t
    type(edge_weights_t)  :: weights          !! of all edges
    real(wp), allocatable :: position(:, :)   !! X (n,2) [m]
    logical,  allocatable :: free(:, :)       !! components that no boundary takes (n,2)
    logical,  allocatable :: in_body(:)       !! no layers (n)
    real(wp) :: spacing = 0.0_wp              !! dx [m]
    real(wp) :: delta = 0.0_wp                !! horizon [m]
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

  !> Pressure on a side or on edges, or on a part, not yet divided among the points.
  pure type(pressure_t) function new_pressure(name, place, value, span, ramp_time) result(pressure)
    character(*), intent(in) :: name
    character(*), intent(in) :: place         !! name of the side, or edges in words
    real(wp),     intent(in) :: value         !! at full load [Pa]
    real(wp),     intent(in) :: span(:)       !! from, to, along the side or edge [m]; size 0: all
    real(wp),     intent(in) :: ramp_time     !! full load from then on [s]

    pressure%name = name
    pressure%kind = 'pressure'
    pressure%place = place
    pressure%value = value
    if (size(span) > 0) pressure%span = span
    pressure%ramp_time = ramp_time
    pressure%factor = new_ramp(ramp_time)
  end function new_pressure

  !> Give each point its part of a pressure on a side: on the edges of the outline that lie on it.
  !> Every line of points across the side carries what acts on its part of the side. No points:
  !> nothing to act on.
  pure subroutine spread_on_side(surface, side, pressure)
    type(surface_t),  intent(in)    :: surface
    type(side_t),     intent(in)    :: side
    type(pressure_t), intent(inout) :: pressure
    real(wp) :: part(size(side%points)), share(size(surface%weights%point)), total(2), ends(2)
    real(wp) :: along(2), reach(2)            ! on an edge
    real(wp) :: depth                         ! of what holds the body [m]
    integer  :: e, k, line

    call find_parts(surface, side, pressure, part)
    depth = huge(1.0_wp)
    ends = [max(pressure%span(1), side%lower), min(pressure%span(2), side%upper)]
    share = 0.0_wp
    associate (w => surface%weights, x => surface%position, axis => side%axis)
      do e = 1, size(w%edges)
        if (.not. on_side(surface, side, w%edges(e)%start, w%edges(e)%normal)) cycle
        along = w%edges(e)%direction()
        reach = along(3 - axis) * (ends - w%edges(e)%start(3 - axis))
        depth = min(depth, held_depth(surface, w%edges(e), [minval(reach), maxval(reach)]))
        do k = w%first(e), w%first(e + 1) - 1
          line = minloc(abs(x(side%points, 3 - axis) - x(w%point(k), 3 - axis)), dim=1)
          share(k) = part(line) / (side%to(line) - side%from(line))
        end do
      end do
      total = 0.0_wp
      total(axis) = -real(side%outward, wp) * pressure%value * sum(part)
    end associate
    call apply(surface, share, total, pressure)
    call doubt_depth(surface, depth, pressure)
  end subroutine spread_on_side

  !> Whether an edge of the outline lies on a side.
  pure logical function on_side(surface, side, start, normal)
    type(surface_t), intent(in) :: surface
    type(side_t),    intent(in) :: side
    real(wp),        intent(in) :: start(2), normal(2)   !! of the edge

    on_side = .false.
    if (size(side%points) == 0) return
    if (normal(side%axis) * real(side%outward, wp) < 1.0_wp - 1.0e-6_wp) return
    ! points stand on the outline or half a spacing below
    on_side = abs(start(side%axis) - surface%position(side%points(1), side%axis)) &
      < 0.75_wp * surface%spacing
  end function on_side

  !> The length of the side that each of its points stands for within the span, 0 where it does not
  !> slide along the pressure.
  !>
  !> If the span reaches an end of the side where a layer has points that slide, the layer stands
  !> for the body going on: it carries the pressure too.
  pure subroutine find_parts(surface, side, pressure, part)
    type(surface_t),  intent(in)    :: surface
    type(side_t),     intent(in)    :: side
    type(pressure_t), intent(inout) :: pressure
    real(wp),         intent(out)   :: part(:)   !! [m]
    logical  :: carries(size(part))
    real(wp) :: ends(2), near

    near = 1.0e-6_wp * surface%spacing
    associate (lower => side%lower, upper => side%upper)
      carries = surface%free(side%points, side%axis)
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

  !> Give each point its part of a pressure on edges, one or all of a rim, each within the span: a
  !> length from its start. A point carries what acts on the part of the edge that lies across from
  !> its own square, points beyond an end what acts on the end.
  pure subroutine spread_on_edges(surface, chosen, pressure)
    type(surface_t),  intent(in)    :: surface
    logical,          intent(in)    :: chosen(:)   !! edges
    type(pressure_t), intent(inout) :: pressure
    real(wp) :: share(size(surface%weights%point)), total(2), span(2), along(2), half, t
    real(wp) :: depth                              ! of what holds the body [m]
    integer  :: e, k

    depth = huge(1.0_wp)
    share = 0.0_wp
    total = 0.0_wp
    associate (w => surface%weights)
      do e = 1, size(w%edges)
        if (.not. chosen(e)) cycle
        span = pressure%span - w%edges(e)%from
        span = [max(0.0_wp, span(1)), min(w%edges(e)%length(), span(2))]
        if (span(2) <= span(1)) cycle
        depth = min(depth, held_depth(surface, w%edges(e), span))
        along = w%edges(e)%direction()
        half = 0.5_wp * surface%spacing * sum(abs(along))
        do k = w%first(e), w%first(e + 1) - 1
          t = dot_product(surface%position(w%point(k), :) - w%edges(e)%start, along)
          share(k) = covered(t - half, t + half, w%edges(e)%length(), span)
        end do
        pressure%length = pressure%length + (span(2) - span(1))
        total = total - pressure%value * (span(2) - span(1)) * w%edges(e)%normal
      end do
    end associate
    call apply(surface, share, total, pressure)
    call doubt_depth(surface, depth, pressure)
  end subroutine spread_on_edges

  !> How far below a span of an edge the first point is that is held along its normal [m].
  pure real(wp) function held_depth(surface, edge, span) result(depth)
    type(surface_t), intent(in) :: surface
    type(edge_t),    intent(in) :: edge
    real(wp),        intent(in) :: span(2)    !! from its start [m]
    real(wp) :: x(2), t
    integer  :: i

    depth = huge(1.0_wp)
    do i = 1, size(surface%in_body)
      if (surface%in_body(i)) cycle
      if (all(surface%free(i, :) .or. abs(edge%normal) < 1.0e-6_wp)) cycle
      x = surface%position(i, :) - edge%start
      t = dot_product(x, edge%direction())
      if (t < span(1) .or. t > span(2) .or. dot_product(x, edge%normal) >= 0.0_wp) cycle
      depth = min(depth, -dot_product(x, edge%normal))
    end do
  end function held_depth

  !> Warn of a body that is thin between a pressure and what holds it.
  pure subroutine doubt_depth(surface, depth, pressure)
    type(surface_t),  intent(in)    :: surface
    real(wp),         intent(in)    :: depth   !! of the first point that is held [m]
    type(pressure_t), intent(inout) :: pressure
    real(wp) :: least   ! horizons, below which the stress is more than 3 % too small

    least = doubt_kinds(kind_number('thin_body'))%lower
    ! half a spacing, with the layout nodes one, is between the body and this point
    if (depth - 0.5_wp * surface%spacing >= (least - 1.0e-6_wp) * surface%delta) return
    pressure%doubted = (depth - 0.5_wp * surface%spacing) / surface%delta
    pressure%doubt = 'the body is less than '//short_number(least)//' horizons thick '// &
      'between the pressure and the boundary that holds it: the stress under the pressure '// &
      'comes out up to 11 % too small at one horizon, 18 % at two thirds; a smaller horizon helps'
  end subroutine doubt_depth

  !> The part of an interval on an edge that is within a span; beyond an end, that of the end.
  pure real(wp) function covered(from, to, length, span)
    real(wp), intent(in) :: from, to, length, span(2)
    real(wp) :: a, b

    a = max(from, 0.0_wp)
    b = min(to, length)
    if (b > a) then
      covered = max(0.0_wp, min(b, span(2)) - max(a, span(1))) / (b - a)
    else if (to <= 0.0_wp) then
      covered = merge(1.0_wp, 0.0_wp, span(1) <= 0.0_wp)
    else
      covered = merge(1.0_wp, 0.0_wp, span(2) >= length)
    end if
  end function covered

  !> Forces on the points from the share of each pair of edge and point: -p (w n + r). What is
  !> missing to the whole (where the outline is longer than the body, and round-off) goes by w.
  pure subroutine apply(surface, share, total, pressure)
    type(surface_t),  intent(in)    :: surface
    real(wp),         intent(in)    :: share(:)   !! 0 to 1 (pairs)
    real(wp),         intent(in)    :: total(2)   !! force [N/m]
    type(pressure_t), intent(inout) :: pressure
    real(wp), allocatable :: force(:, :), weight(:)
    logical,  allocatable :: loaded(:)
    integer :: c, e, i, k

    allocate (force(size(surface%in_body), 2), weight(size(surface%in_body)), source=0.0_wp)
    allocate (loaded(size(weight)), source=.false.)
    associate (w => surface%weights)
      do e = 1, size(w%edges)
        do k = w%first(e), w%first(e + 1) - 1
          i = w%point(k)
          if (share(k) <= 0.0_wp) cycle
          loaded(i) = .true.
          weight(i) = weight(i) + share(k) * w%weight(k)
          force(i, :) = force(i, :) &
            - pressure%value * share(k) * (w%weight(k) * w%edges(e)%normal + w%rest(k, :))
        end do
      end do
    end associate
    if (sum(weight) <= 0.0_wp) loaded = .false.
    pressure%points = pack([(i, i=1, size(loaded))], loaded)
    allocate (pressure%force(size(pressure%points), 2))
    associate (points => pressure%points)
      do c = 1, merge(2, 0, size(points) > 0)
        pressure%force(:, c) = force(points, c) &
          + (total(c) - sum(force(points, c))) / sum(weight(points)) * weight(points)
      end do
      pressure%on_layers = .not. all(surface%in_body(points))
    end associate
  end subroutine apply

  !> f <- f + factor force / V at the points.
  pure subroutine add_forces(self, volume, t, f)
    class(pressure_t), intent(in)    :: self
    real(wp),          intent(in)    :: volume(:), t
    real(wp),          intent(inout) :: f(:, :)
    real(wp) :: factor
    integer  :: c, k

    factor = self%factor%rate(t)
    associate (points => self%points)
      do c = 1, 2
        do k = 1, size(points)
          f(points(k), c) = f(points(k), c) + factor * self%force(k, c) / volume(points(k))
        end do
      end do
    end associate
  end subroutine add_forces

  pure real(wp) function work(self, v, t, t_next)
    class(pressure_t), intent(in) :: self
    real(wp),          intent(in) :: v(:, :), t, t_next
    real(wp) :: power

    power = ordered_sum(self%force(:, 1) * v(self%points, 1) &
      + self%force(:, 2) * v(self%points, 2))
    work = (t_next - t) * (0.5_wp * (self%factor%rate(t) + self%factor%rate(t_next))) * power
  end function work

  pure function description(self) result(text)
    class(pressure_t), intent(in) :: self
    character(:), allocatable :: text

    text = self%name//': '//short_number(self%value)//' Pa on '//self%place//', '// &
      short_number(self%length)//' m of the body'
    if (self%on_layers) text = text//' and layers that continue it'
    text = text//', '//integer_text(size(self%points))//' points: '// &
      short_number(norm2(sum(self%force, dim=1)))//' N/m in all'
    if (self%ramp_time > 0.0_wp) text = text//', whole from '//short_number(self%ramp_time)//' s'
  end function description

  pure subroutine mark_read(self, pushed)
    class(pressure_t), intent(in)    :: self
    logical,           intent(inout) :: pushed(:)

    pushed(self%points) = .true.
  end subroutine mark_read

end module pd_pressure
