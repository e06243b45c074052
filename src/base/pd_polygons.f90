!> Plane geometry of polygons: area, box, edges that cross, where a point lies.
!>
!> A polygon is the list of its vertices, (2, n); edge k goes from vertex k to vertex k + 1, the
!> last one back to vertex 1. Either sense of rotation will do.
module pd_polygons
  use pd_kinds, only: wp
  implicit none
  private

  public :: signed_area, inside, next_vertex, same_vertices, crossing_edges, polygon_of_circle
  public :: distance_to_edge, edge_axis, outward_normal

contains

  !> The vertex after vertex k.
  pure integer function next_vertex(vertices, k)
    real(wp), intent(in) :: vertices(:, :)
    integer,  intent(in) :: k

    next_vertex = merge(1, k + 1, k == size(vertices, 2))
  end function next_vertex

  !> Area, positive where the vertices go round counter-clockwise.
  pure real(wp) function signed_area(vertices) result(area)
    real(wp), intent(in) :: vertices(:, :)
    integer :: k, next

    area = 0.0_wp
    do k = 1, size(vertices, 2)   ! from vertex 1: no digits are lost far from the origin
      next = next_vertex(vertices, k)
      area = area + 0.5_wp * cross(vertices(:, k) - vertices(:, 1), &
        vertices(:, next) - vertices(:, 1))
    end do
  end function signed_area

  pure real(wp) function cross(a, b)
    real(wp), intent(in) :: a(2), b(2)

    cross = a(1) * b(2) - a(2) * b(1)
  end function cross

  !> Whether a point lies inside, by the number of edges to its left: of points on an edge some do.
  pure logical function inside(vertices, x)
    real(wp), intent(in) :: vertices(:, :)
    real(wp), intent(in) :: x(2)
    integer :: k, last

    inside = .false.
    last = size(vertices, 2)
    do k = 1, size(vertices, 2)
      associate (a => vertices(:, last), b => vertices(:, k))
        if ((a(2) <= x(2)) .neqv. (b(2) <= x(2))) then
          if (a(1) + (x(2) - a(2)) * (b(1) - a(1)) / (b(2) - a(2)) < x(1)) inside = .not. inside
        end if
      end associate
      last = k
    end do
  end function inside

  !> Distance of a point from the edge between a and b, and where its foot lies: 0 at a, 1 at b.
  pure subroutine distance_to_edge(a, b, x, distance, foot)
    real(wp), intent(in)  :: a(2), b(2), x(2)
    real(wp), intent(out) :: distance, foot
    real(wp) :: along(2)

    along = b - a
    foot = dot_product(x - a, along) / max(tiny(1.0_wp), dot_product(along, along))
    distance = norm2(x - a - min(1.0_wp, max(0.0_wp, foot)) * along)
  end subroutine distance_to_edge

  !> Axis of the normal to edge k, 1: x, 2: y; 0 where it is inclined.
  pure integer function edge_axis(vertices, k) result(axis)
    real(wp), intent(in) :: vertices(:, :)
    integer,  intent(in) :: k
    real(wp), parameter  :: straight = 1.0e-9_wp
    real(wp) :: along(2)

    along = abs(vertices(:, next_vertex(vertices, k)) - vertices(:, k))
    axis = 0
    if (along(1) <= straight * along(2)) axis = 1
    if (along(2) <= straight * along(1)) axis = 2
  end function edge_axis

  !> Unit normal to edge k that points out of the polygon.
  pure function outward_normal(vertices, k) result(normal)
    real(wp), intent(in) :: vertices(:, :)
    integer,  intent(in) :: k
    real(wp) :: normal(2), along(2)

    along = vertices(:, next_vertex(vertices, k)) - vertices(:, k)
    normal = sign(1.0_wp, signed_area(vertices)) * [along(2), -along(1)] / norm2(along)
  end function outward_normal

  !> The first two vertices that coincide; 0, 0 where none do.
  pure function same_vertices(vertices) result(pair)
    real(wp), intent(in) :: vertices(:, :)
    integer  :: pair(2), j, k
    real(wp) :: near

    near = 1.0e-9_wp * maxval(maxval(vertices, 2) - minval(vertices, 2))
    do k = 2, size(vertices, 2)
      do j = 1, k - 1
        pair = [j, k]
        if (norm2(vertices(:, j) - vertices(:, k)) <= near) return
      end do
    end do
    pair = 0
  end function same_vertices

  !> The first two edges that cross, touch or lie on each other, neighbours at their common vertex
  !> apart; 0, 0 where there are none.
  pure function crossing_edges(vertices) result(pair)
    real(wp), intent(in) :: vertices(:, :)
    integer :: pair(2), j, k, n

    n = size(vertices, 2)
    do k = 2, n
      do j = 1, k - 1
        pair = [j, k]
        if (k == j + 1) then
          if (folds_back(j, k)) return
        else if (j == 1 .and. k == n) then
          if (folds_back(k, j)) return
        else if (meet(vertices(:, j), vertices(:, j + 1), vertices(:, k), &
          vertices(:, next_vertex(vertices, k)))) then
          return
        end if
      end do
    end do
    pair = 0

  contains

    !> Whether an edge goes back along the one before it.
    pure logical function folds_back(first, second)
      integer, intent(in) :: first, second
      real(wp), parameter :: nothing = 1.0e-12_wp
      real(wp) :: a(2), b(2)

      a = vertices(:, first) - vertices(:, second)
      b = vertices(:, next_vertex(vertices, second)) - vertices(:, second)
      folds_back = abs(cross(a, b)) <= nothing * norm2(a) * norm2(b) &
        .and. dot_product(a, b) > 0.0_wp
    end function folds_back

  end function crossing_edges

  !> Whether two pieces of straight lines have a point in common.
  pure logical function meet(a, b, c, d)
    real(wp), intent(in) :: a(2), b(2), c(2), d(2)
    real(wp), parameter  :: nothing = 1.0e-12_wp
    real(wp) :: sides(4), scale

    scale = nothing * (norm2(b - a) + norm2(d - c))**2
    sides = [cross(b - a, c - a), cross(b - a, d - a), cross(d - c, a - c), cross(d - c, b - c)]
    where (abs(sides) <= scale) sides = 0.0_wp
    meet = sides(1) * sides(2) < 0.0_wp .and. sides(3) * sides(4) < 0.0_wp
    if (meet) return
    meet = touches(sides(1), a, b, c) .or. touches(sides(2), a, b, d) &
      .or. touches(sides(3), c, d, a) .or. touches(sides(4), c, d, b)

  contains

    !> Whether x, on the line through p and q where `side` is 0, lies between them.
    pure logical function touches(side, p, q, x)
      real(wp), intent(in) :: side, p(2), q(2), x(2)

      touches = .not. abs(side) > 0.0_wp .and. dot_product(x - p, x - q) <= 0.0_wp
    end function touches

  end function meet

  !> Polygon of n vertices that has the area of a circle. For n a multiple of 4 edges, not vertices,
  !> lie towards the axes: the polygon stays within the box around the circle.
  pure function polygon_of_circle(centre, radius, n) result(vertices)
    real(wp), intent(in) :: centre(2), radius
    integer,  intent(in) :: n
    real(wp) :: vertices(2, n), angle, r
    real(wp), parameter :: whole = 8.0_wp * atan(1.0_wp)
    integer :: k

    angle = whole / real(n, wp)
    r = radius * sqrt(angle / sin(angle))
    do k = 1, n
      vertices(:, k) = centre + r * [cos((real(k, wp) - 0.5_wp) * angle), &
        sin((real(k, wp) - 0.5_wp) * angle)]
    end do
  end function polygon_of_circle

end module pd_polygons
