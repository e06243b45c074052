!> Straight edges of a body with their outward normals: what a pressure acts on.
!>
!> The outline of a lattice is that of the areas of its points, fictitious ones included. Edges of
!> polygons are given by their vertices.
!> Source: doc/theory.md, section 7.
module pd_edges
  use pd_body, only: body_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: edge_t, material_t, outline_edges, rim_edges, bare_edges

  type :: edge_t
    real(wp) :: start(2) = 0.0_wp, finish(2) = 0.0_wp   !! [m]
    real(wp) :: normal(2) = 0.0_wp                      !! out of the body
    integer  :: number = 0       !! of the edge given that it is, or is a piece of; 0: none
    real(wp) :: from = 0.0_wp    !! way along this edge to its start [m]
  contains
    procedure :: length => length_of_edge
    procedure :: direction
  end type edge_t

  !> Where there is material, without layers.
  type, abstract :: material_t
  contains
    procedure(holds), deferred :: holds
  end type material_t

  abstract interface
    !> Whether x [m] is in the material of the body.
    pure logical function holds(self, x)
      import :: material_t, wp
      class(material_t), intent(in) :: self
      real(wp),          intent(in) :: x(2)
    end function holds
  end interface

contains

  pure real(wp) function length_of_edge(self) result(length)
    class(edge_t), intent(in) :: self

    length = norm2(self%finish - self%start)
  end function length_of_edge

  !> Unit vector from start to finish.
  pure function direction(self)
    class(edge_t), intent(in) :: self
    real(wp) :: direction(2)

    direction = (self%finish - self%start) / self%length()
  end function direction

  !> The edges from vertex k to k + 1 of a polygon, the last one back to the first vertex.
  pure function rim_edges(vertices, hole) result(edges)
    real(wp), intent(in) :: vertices(:, :)   !! x, y, in either order round (2, vertices) [m]
    logical,  intent(in) :: hole             !! the body is outside of it
    type(edge_t) :: edges(size(vertices, 2))
    real(wp) :: twice_area, turn
    integer  :: k, n

    n = size(vertices, 2)
    twice_area = 0.0_wp
    do k = 1, n
      edges(k)%start = vertices(:, k)
      edges(k)%finish = vertices(:, 1 + modulo(k, n))
      associate (a => vertices(:, k) - vertices(:, 1), b => edges(k)%finish - vertices(:, 1))
        twice_area = twice_area + a(1) * b(2) - a(2) * b(1)
      end associate
    end do
    turn = sign(1.0_wp, twice_area)
    if (hole) turn = -turn
    do k = 1, n
      associate (along => edges(k)%direction())
        edges(k)%normal = turn * [along(2), -along(1)]
      end associate
    end do
  end function rim_edges

  !> Edges of the area that the points of a lattice own, as long as they are straight. They point
  !> along x or y. With the layout nodes and uniform volumes this is half a spacing beyond the body.
  subroutine outline_edges(body, spacing, edges)
    type(body_t), intent(in) :: body
    real(wp),     intent(in) :: spacing   !! dx [m]
    type(edge_t), allocatable, intent(out) :: edges(:)
    logical, allocatable :: owned(:, :)   ! quarters of the squares around points
    real(wp) :: origin(2)
    integer  :: pass, n

    call find_quarters(body, spacing, owned)
    origin = body%position(1, :) - spacing * (real(body%place(1, :), wp) + 0.5_wp)
    do pass = 1, 2   ! count, then fill
      n = 0
      call follow_lines(2, lbound(owned), owned)
      call follow_lines(1, [lbound(owned, 2), lbound(owned, 1)], transpose(owned))
      if (pass == 1) allocate (edges(n))
    end do

  contains

    !> Runs of faces on the lines across `axis`, the second index of `held`.
    subroutine follow_lines(axis, low, held)
      integer, intent(in) :: axis, low(2)
      logical, intent(in) :: held(low(1):, low(2):)
      integer :: line, i, from, side
      logical :: face

      do line = lbound(held, 2) + 1, ubound(held, 2)
        do side = -1, 1, 2
          from = lbound(held, 1)
          do i = lbound(held, 1), ubound(held, 1)
            face = (held(i, line - 1) .neqv. held(i, line)) .and. (held(i, line) .eqv. side < 0)
            if (face) cycle
            if (i > from) call add(axis, line, from, i, side)
            from = i + 1
          end do
        end do
      end do
    end subroutine follow_lines

    subroutine add(axis, line, from, to, side)
      integer, intent(in) :: axis, line, from, to, side

      n = n + 1
      if (pass == 1) return
      edges(n)%start(axis) = origin(axis) + 0.5_wp * spacing * real(line, wp)
      edges(n)%finish(axis) = edges(n)%start(axis)
      edges(n)%start(3 - axis) = origin(3 - axis) + 0.5_wp * spacing * real(from, wp)
      edges(n)%finish(3 - axis) = origin(3 - axis) + 0.5_wp * spacing * real(to, wp)
      edges(n)%normal(axis) = real(side, wp)
    end subroutine add

  end subroutine outline_edges

  !> Which quarters of the square around each place belong to a point; a margin of one all round.
  pure subroutine find_quarters(body, spacing, owned)
    type(body_t), intent(in) :: body
    real(wp),     intent(in) :: spacing   !! dx [m]
    logical, allocatable, intent(out) :: owned(:, :)
    integer :: low(2), high(2), i

    low = 2 * minval(body%place, dim=1) - 1
    high = 2 * maxval(body%place, dim=1) + 2
    allocate (owned(low(1):high(1), low(2):high(2)), source=.false.)
    do i = 1, body%n
      associate (x => body%place(i, 1), y => body%place(i, 2))
        if (body%volume(i) > (1.0_wp - 1.0e-6_wp) * spacing**2) then
          owned(2 * x:2 * x + 1, 2 * y:2 * y + 1) = .true.
        else
          owned(2 * x:2 * x + 1, 2 * y:2 * y + 1) = body%filled(x - 1:x, y - 1:y)
        end if
      end associate
    end do
  end subroutine find_quarters

  !> What of the edges of shapes is surface: not what lies in material of another shape, outside of
  !> any or under a layer. The outer edges of the layers follow. Edges are numbered as they are
  !> given.
  subroutine bare_edges(given, material, body, spacing, edges)
    type(edge_t), intent(in) :: given(:)      !! of all shapes
    class(material_t), intent(in) :: material
    type(body_t), intent(in) :: body
    real(wp),     intent(in) :: spacing       !! dx [m]
    type(edge_t), allocatable, intent(out) :: edges(:)
    type(edge_t), allocatable :: outline(:)
    integer, allocatable :: owner(:, :)       ! boundary at a place, -1: no point
    integer :: i, k

    associate (place => body%place)
      allocate (owner(minval(place(:, 1)) - 2:maxval(place(:, 1)) + 2, &
        minval(place(:, 2)) - 2:maxval(place(:, 2)) + 2), source=-1)
      do i = 1, body%n
        owner(place(i, 1), place(i, 2)) = body%boundary(i)
      end do
    end associate
    allocate (edges(0))
    do k = 1, size(given)
      call add_pieces(given(k), k, spacing)
    end do
    call outline_edges(body, spacing, outline)
    do k = 1, size(outline)
      call add_pieces(outline(k), 0, spacing)
    end do

  contains

    !> The pieces of an edge that are kept.
    subroutine add_pieces(edge, number, spacing)
      type(edge_t), intent(in) :: edge
      integer,      intent(in) :: number
      real(wp),     intent(in) :: spacing
      type(edge_t) :: piece
      real(wp) :: way(2)
      integer  :: i, from, pieces
      logical  :: keep

      piece = edge
      piece%number = number
      way = edge%finish - edge%start
      pieces = max(1, nint(4.0_wp * edge%length() / spacing))
      from = 0
      do i = 0, pieces
        keep = .false.
        if (i < pieces) keep = kept(edge%start + (real(i, wp) + 0.5_wp) / real(pieces, wp) * way, &
          spacing * edge%normal, number == 0)
        if (keep) cycle
        if (i > from) then
          piece%from = real(from, wp) / real(pieces, wp) * edge%length()
          piece%start = edge%start + real(from, wp) / real(pieces, wp) * way
          piece%finish = edge%finish
          if (i < pieces) piece%finish = edge%start + real(i, wp) / real(pieces, wp) * way
          edges = [edges, piece]
        end if
        from = i + 1
      end do
    end subroutine add_pieces

    !> Whether there is a surface at x. Layers begin half a spacing or one beyond an edge.
    logical function kept(x, out, of_layer)
      real(wp), intent(in) :: x(2)
      real(wp), intent(in) :: out(2)     !! one spacing outwards
      logical,  intent(in) :: of_layer   !! of the outline
      integer :: place(2)

      if (of_layer) then
        place = place_of(x - 0.1_wp * out)
        kept = any(owner(place(1) - 1:place(1) + 1, place(2) - 1:place(2) + 1) > 0)
        if (kept) kept = .not. material%holds(x - 0.1_wp * out)
      else
        kept = .not. (is_layer(x + 0.6_wp * out) .or. is_layer(x + 1.2_wp * out))
        if (kept) kept = material%holds(x - 0.1_wp * out) .and. &
          .not. material%holds(x + 0.1_wp * out)
      end if
    end function kept

    !> Whether the place that x is nearest to holds a point of a layer.
    logical function is_layer(x)
      real(wp), intent(in) :: x(2)
      integer :: place(2)

      place = place_of(x)
      is_layer = owner(place(1), place(2)) > 0
    end function is_layer

    !> The place nearest to x; beyond the box of places one of its margin.
    function place_of(x) result(place)
      real(wp), intent(in) :: x(2)
      integer :: place(2)

      place = body%place(1, :) + nint((x - body%position(1, :)) / spacing)
      place = max(lbound(owner) + 1, min(ubound(owner) - 1, place))
    end function place_of

  end subroutine bare_edges

end module pd_edges
