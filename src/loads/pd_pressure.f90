!> Pressure on a side of the body: which points carry how much of it.
!>
!> Families are cut off at a surface, so a homogeneous stress P is in equilibrium only with forces
!> P N_i on the points near it. A pressure applies just these: N_i is its weight at a point. Loads
!> on the outermost points alone would leave them with several times the stress.
!> Source: doc/theory.md, section 7.
module pd_pressure
  use pd_boundary, only: boundary_t, table_t
  use pd_geometry, only: body_t, side_number, side_t
  use pd_kinds, only: n_block, wp
  use pd_operators, only: operators_t
  implicit none
  private

  public :: pressure_t, surface_vectors, spread_pressure

  !> A pressure on a side of the body.
  type :: pressure_t
    character(:), allocatable :: name, side
    real(wp) :: span(2) = [-huge(1.0_wp), huge(1.0_wp)]   !! along the side [m]
    real(wp) :: value = 0.0_wp                !! at full load [Pa]
    type(table_t) :: factor                   !! on the value
    integer :: axis = 0                       !! along which it pushes; 1: x, 2: y
    integer,  allocatable :: points(:)
    real(wp), allocatable :: force(:)         !! on each point at full load, along the axis [N/m]
    real(wp) :: length = 0.0_wp               !! of the side of the body that it acts on [m]
  end type pressure_t

contains

  !> N_i = V_i sum_j omega V_j (K_i^-1 + K_j^-1) xi: a homogeneous stress P leaves the force P N_i
  !> on point i. Zero inside; the sum over a surface is its length, directed into the body. It is
  !> what the operators make of a stress of 1.
  subroutine surface_vectors(operators, volume, vectors)
    class(operators_t), intent(inout) :: operators
    real(wp),           intent(in),  contiguous :: volume(:)       !! V (n) [m^2]
    real(wp),           intent(inout), contiguous :: vectors(:, :) !! out: N (n,2) [m]
    real(wp), allocatable :: u(:, :), h(:, :)
    real(wp) :: p(n_block, 4)
    integer  :: block, lo, hi

    allocate (u(size(volume), 2), h(size(volume), 4), source=0.0_wp)
    p(:, [1, 4]) = 1.0_wp
    p(:, [2, 3]) = 0.0_wp
    call operators%take_in(u)
    do block = 1, operators%domain%blocks%count
      lo = operators%domain%blocks%lo(block)
      call operators%hand_over_block(lo, operators%domain%blocks%hi(block), h, p)
    end do
    call operators%share()
    do block = 1, operators%domain%blocks%count
      lo = operators%domain%blocks%lo(block)
      hi = operators%domain%blocks%hi(block)
      call operators%force_block(lo, hi, u, vectors)
      vectors(lo:hi, 1) = volume(lo:hi) * vectors(lo:hi, 1)
      vectors(lo:hi, 2) = volume(lo:hi) * vectors(lo:hi, 2)
    end do
  end subroutine surface_vectors

  !> Give each point its part of a pressure. Every line of points across the side carries the
  !> pressure on the part of the side that it owns within the span, by the weights N_i; a common
  !> factor makes the whole the pressure times the length. No points: nothing to act on.
  subroutine spread_pressure(body, boundaries, vectors, spacing, depth, pressure)
    type(body_t),     intent(in)    :: body
    type(boundary_t), intent(in)    :: boundaries(:)
    real(wp),         intent(in)    :: vectors(:, :)   !! N (n,2) [m]
    real(wp),         intent(in)    :: spacing         !! dx [m]
    integer,          intent(in)    :: depth           !! rows of points below a surface with N_i
    type(pressure_t), intent(inout) :: pressure        !! in: all but axis, points, force, length
    real(wp), allocatable :: part(:), weight(:)
    integer,  allocatable :: at(:, :), points(:)
    real(wp) :: inwards
    integer  :: j, k, n

    pressure%axis = merge(2, 1, pressure%side == 'bottom' .or. pressure%side == 'top')
    inwards = merge(1.0_wp, -1.0_wp, pressure%side == 'bottom' .or. pressure%side == 'left')
    associate (side => body%sides(side_number(pressure%side)), axis => pressure%axis)
      allocate (part(size(side%points)))
      call find_parts(body, boundaries, side, spacing, pressure, part)
      call find_lines(body, side, axis, inwards * spacing, 2 * depth + 2, at)
      allocate (points((depth + 1) * size(part)), weight((depth + 1) * size(part)))
      n = 0
      do k = 1, size(part)
        if (part(k) <= 0.0_wp) cycle
        do j = 1, min(depth + 1, max(1, length_of(at(:, k)) / 2))   ! the rest is the other side's
          if (.not. slides(body, boundaries, at(j, k), axis)) cycle
          n = n + 1
          points(n) = at(j, k)
          weight(n) = vectors(at(j, k), axis) * part(k) / (side%to(k) - side%from(k))
        end do
      end do
    end associate
    if (inwards * sum(weight(:n)) <= 0.0_wp) n = 0
    allocate (pressure%points(n), source=points(:n))
    allocate (pressure%force(n), source=weight(:n))
    if (n > 0) pressure%force = inwards * pressure%value * sum(part) / sum(weight(:n)) * weight(:n)
  end subroutine spread_pressure

  !> The length of the side that each of its points stands for within the span, 0 where it does not
  !> slide along the pressure.
  !>
  !> Where the span reaches an end of the side, and a layer stands there whose points slide, the
  !> layer is the body going on: it carries the pressure too.
  subroutine find_parts(body, boundaries, side, spacing, pressure, part)
    type(body_t),     intent(in)    :: body
    type(boundary_t), intent(in)    :: boundaries(:)
    type(side_t),     intent(in)    :: side
    real(wp),         intent(in)    :: spacing
    type(pressure_t), intent(inout) :: pressure
    real(wp),         intent(out)   :: part(:)   !! [m]
    logical  :: carries(size(part))
    real(wp) :: ends(2), near
    integer  :: k

    near = 1.0e-6_wp * spacing
    do k = 1, size(part)
      carries(k) = slides(body, boundaries, side%points(k), pressure%axis)
    end do
    associate (lower => body%lower(3 - pressure%axis), upper => body%upper(3 - pressure%axis))
      ends = [max(pressure%span(1), lower), min(pressure%span(2), upper)]
      pressure%length = sum(max(0.0_wp, min(side%to, ends(2)) - max(side%from, ends(1))), &
        mask=body%boundary(side%points) == 0)
      if (ends(1) <= lower + near .and. any(carries .and. side%to < lower + near)) &
        ends(1) = minval(side%from)
      if (ends(2) >= upper - near .and. any(carries .and. side%from > upper - near)) &
        ends(2) = maxval(side%to)
    end associate
    part = merge(min(side%to, ends(2)) - max(side%from, ends(1)), 0.0_wp, carries)
    where (part <= near) part = 0.0_wp
  end subroutine find_parts

  !> Numbers of the points below each point of a side, it included, 0: none.
  subroutine find_lines(body, side, axis, step, count, at)
    type(body_t), intent(in) :: body
    type(side_t), intent(in) :: side
    integer,      intent(in) :: axis                  !! across the side
    real(wp),     intent(in) :: step                  !! to the next point inwards [m]
    integer,      intent(in) :: count
    integer, allocatable, intent(out) :: at(:, :)     !! (count, points of the side)
    integer, allocatable :: line(:)
    integer :: i, j, k

    allocate (at(count, size(side%points)), source=0)
    associate (x => body%position, first => side%points(1), last => side%points(size(side%points)))
      allocate (line(0:nint((x(last, 3 - axis) - x(first, 3 - axis)) / abs(step))), source=0)
      do k = 1, size(side%points)
        line(nint((x(side%points(k), 3 - axis) - x(first, 3 - axis)) / abs(step))) = k
      end do
      do i = 1, body%n
        j = nint((x(i, axis) - x(first, axis)) / step) + 1
        k = nint((x(i, 3 - axis) - x(first, 3 - axis)) / abs(step))
        if (j < 1 .or. j > count .or. k < 0 .or. k > ubound(line, 1)) cycle
        if (line(k) > 0) at(j, line(k)) = i
      end do
    end associate
  end subroutine find_lines

  !> How many points follow each other without a gap.
  pure integer function length_of(line) result(n)
    integer, intent(in) :: line(:)

    do n = 0, size(line) - 1
      if (line(n + 1) == 0) return
    end do
    n = size(line)
  end function length_of

  !> Whether a point is free along an axis: all of the body, and layers that slide.
  pure logical function slides(body, boundaries, point, axis)
    type(body_t),     intent(in) :: body
    type(boundary_t), intent(in) :: boundaries(:)
    integer,          intent(in) :: point, axis

    slides = .true.
    if (body%boundary(point) == 0) return
    associate (boundary => boundaries(body%boundary(point)))
      slides = .not. (boundary%prescribed(axis) .or. boundary%held(axis))
    end associate
  end function slides

end module pd_pressure
