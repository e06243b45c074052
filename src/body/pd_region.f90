!> The region of material: polygons in an order, each solid or a hole. The last one that holds a
!> place decides.
!>
!> Lengths are in spacings of the lattice, from its origin: what lies on lattice lines is exact.
!> Source: doc/theory.md, section 1.
module pd_region
  use pd_kinds, only: l1, wp
  use pd_polygons, only: distance_to_edge, inside, next_vertex
  implicit none
  private

  public :: shape_t, part_at, part_on, parts_on_grid, mark_edges, on_edges
  public :: area_within, length_within, box_of

  !> A polygon that adds material or takes it away.
  type :: shape_t
    real(wp), allocatable :: vertices(:, :)   !! (2,n) [spacings]
    character(:), allocatable :: name         !! for messages
    logical  :: solid = .true.                !! else a hole
    real(wp) :: near = 1.0e-6_wp              !! a point so near to an edge is on it [spacings]
  end type shape_t

contains

  !> The last shape that holds a point: its number, 0 for none and for a hole. For points on edges
  !> see `part_on`.
  pure integer function part_at(shapes, x) result(part)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: x(2)
    integer :: k

    do k = size(shapes), 1, -1
      if (.not. inside(shapes(k)%vertices, x)) cycle
      part = merge(k, 0, shapes(k)%solid)
      return
    end do
    part = 0
  end function part_at

  !> The same for a point on edges: the last solid that has material beside it, 0 where there is
  !> none. So a point on the edge of a solid belongs to it, and one on the rim of a hole stays.
  pure integer function part_on(shapes, x) result(part)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: x(2)
    real(wp), parameter   :: beside = 1.0e-3_wp, whole = 8.0_wp * atan(1.0_wp)
    real(wp), allocatable :: angles(:)
    real(wp) :: middle
    integer  :: k, next

    allocate (angles, source=directions(shapes, x, beside))
    part = 0
    do k = 1, size(angles)
      next = merge(1, k + 1, k == size(angles))
      middle = 0.5_wp * (angles(k) + angles(next) + merge(whole, 0.0_wp, next == 1))
      part = max(part, part_at(shapes, x + beside * [cos(middle), sin(middle)]))
    end do
    if (size(angles) == 0) part = part_at(shapes, x)
  end function part_on

  !> Directions in which edges leave a point, ascending.
  pure function directions(shapes, x, beside) result(angles)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: x(2)
    real(wp),      intent(in) :: beside       !! edges are looked at so far from the point
    real(wp), allocatable :: angles(:)
    real(wp) :: distance, foot
    integer  :: i, k

    allocate (angles(0))
    do i = 1, size(shapes)
      associate (v => shapes(i)%vertices)
        do k = 1, size(v, 2)
          associate (a => v(:, k), b => v(:, next_vertex(v, k)))
            if (x(1) < min(a(1), b(1)) - beside .or. x(1) > max(a(1), b(1)) + beside) cycle
            call distance_to_edge(a, b, x, distance, foot)
            if (distance > shapes(i)%near) cycle
            if (foot * norm2(b - a) > 0.5_wp * beside) angles = [angles, atan2(a(2) - b(2), &
              a(1) - b(1))]
            if ((1.0_wp - foot) * norm2(b - a) > 0.5_wp * beside) angles = [angles, &
              atan2(b(2) - a(2), b(1) - a(1))]
          end associate
        end do
      end associate
    end do
    call sort(angles)
  end function directions

  pure subroutine sort(x)
    real(wp), intent(inout) :: x(:)
    real(wp) :: moved
    integer  :: i, j

    do i = 2, size(x)
      moved = x(i)
      j = i - 1
      do while (j > 0)
        if (x(j) <= moved) exit
        x(j + 1) = x(j)
        j = j - 1
      end do
      x(j + 1) = moved
    end do
  end subroutine sort

  !> Corners of the box around the solids. What is as near to a lattice line, or to the middle
  !> between two, as a point on an edge is to the edge, lies there.
  pure function box_of(shapes) result(box)
    type(shape_t), intent(in) :: shapes(:)
    real(wp) :: box(2, 2)                     !! lower, upper corner
    integer  :: k

    box(:, 1) = huge(1.0_wp)
    box(:, 2) = -huge(1.0_wp)
    do k = 1, size(shapes)
      if (.not. shapes(k)%solid) cycle
      box(:, 1) = min(box(:, 1), even(minval(shapes(k)%vertices, 2), shapes(k)%near))
      box(:, 2) = max(box(:, 2), even(maxval(shapes(k)%vertices, 2), shapes(k)%near))
    end do
  end function box_of

  !> The next multiple of one half where it is near.
  elemental real(wp) function even(x, near)
    real(wp), intent(in) :: x, near

    even = 0.5_wp * anint(2.0_wp * x)
    if (abs(x - even) > near) even = x
  end function even

  !> The part of all places of a grid: the place of element (i, j) is first + width (i - 1, j - 1).
  pure subroutine parts_on_grid(shapes, first, width, part)
    type(shape_t), intent(in)  :: shapes(:)
    real(wp),      intent(in)  :: first(2), width
    integer,       intent(out) :: part(:, :)
    logical :: turns(size(part, 1) + 1), within
    integer :: i, j, k

    part = 0
    do k = 1, size(shapes)
      do j = 1, size(part, 2)
        call find_turns(shapes(k)%vertices, first(1), first(2) + width * real(j - 1, wp), width, &
          turns)
        if (.not. any(turns)) cycle
        within = .false.
        do i = 1, size(part, 1)
          within = within .neqv. turns(i)
          if (within) part(i, j) = merge(k, 0, shapes(k)%solid)
        end do
      end do
    end do
  end subroutine parts_on_grid

  !> Before which places of a row a polygon begins or ends.
  pure subroutine find_turns(v, first, y, width, turns)
    real(wp), intent(in)  :: v(:, :), first, y, width
    logical,  intent(out) :: turns(:)
    integer  :: i, k, last
    real(wp) :: x

    turns = .false.
    last = size(v, 2)
    do k = 1, size(v, 2)
      if ((v(2, last) <= y) .neqv. (v(2, k) <= y)) then
        x = v(1, last) + (y - v(2, last)) * (v(1, k) - v(1, last)) / (v(2, k) - v(2, last))
        i = min(size(turns), max(1, ceiling((x - first) / width) + 1))
        turns(i) = .not. turns(i)
      end if
      last = k
    end do
  end subroutine find_turns

  !> Mark the boxes of a grid that an edge passes through or touches: box (i, j) has its lower
  !> corner at first + width (i - 1, j - 1).
  pure subroutine mark_edges(shapes, first, width, marked)
    type(shape_t), intent(in)    :: shapes(:)
    real(wp),      intent(in)    :: first(2), width
    logical(l1),   intent(inout) :: marked(:, :)
    real(wp), parameter :: margin = 1.0e-6_wp
    real(wp) :: ends(2)
    integer  :: i, j, k, from, to

    do i = 1, size(shapes)
      associate (v => shapes(i)%vertices)
        do k = 1, size(v, 2)
          associate (a => v(:, k), b => v(:, next_vertex(v, k)))
            from = floor((min(a(2), b(2)) - margin - first(2)) / width) + 1
            to = floor((max(a(2), b(2)) + margin - first(2)) / width) + 1
            do j = max(1, from), min(size(marked, 2), to)
              ends = first(2) + width * real([j - 1, j], wp) + [-margin, margin]
              call clip(a, b, ends)
              ends = (ends + [-margin, margin] - first(1)) / width
              marked(max(1, floor(ends(1)) + 1):min(size(marked, 1), floor(ends(2)) + 1), j) &
                = .true._l1
            end do
          end associate
        end do
      end associate
    end do
  end subroutine mark_edges

  !> Range along x of the part of an edge between two heights, which it reaches.
  pure subroutine clip(a, b, ends)
    real(wp), intent(in)    :: a(2), b(2)
    real(wp), intent(inout) :: ends(2)        !! in: heights, out: range
    real(wp) :: x(2)

    x = [a(1), b(1)]
    if (abs(b(2) - a(2)) > 0.0_wp) then
      ends = min(max(ends, min(a(2), b(2))), max(a(2), b(2)))
      x = a(1) + (b(1) - a(1)) * (ends - a(2)) / (b(2) - a(2))
    end if
    ends = [minval(x), maxval(x)]
  end subroutine clip

  !> Mark the places of a grid that are on an edge.
  pure subroutine on_edges(shapes, first, marked)
    type(shape_t), intent(in)    :: shapes(:)
    real(wp),      intent(in)    :: first(2)       !! of place (1, 1); the others a spacing apart
    logical(l1),   intent(inout) :: marked(:, :)
    real(wp) :: distance, ends(2), foot
    integer  :: c, i, j, k

    do i = 1, size(shapes)
      associate (v => shapes(i)%vertices, near => shapes(i)%near)
        do k = 1, size(v, 2)
          associate (a => v(:, k), b => v(:, next_vertex(v, k)))
            do j = max(1, ceiling(min(a(2), b(2)) - near - first(2)) + 1), &
              min(size(marked, 2), floor(max(a(2), b(2)) + near - first(2)) + 1)
              ends = first(2) + real(j - 1, wp) + [-near, near]
              call clip(a, b, ends)
              ends = ends + [-2.0_wp, 2.0_wp] * near - first(1)
              do c = max(1, ceiling(ends(1)) + 1), min(size(marked, 1), floor(ends(2)) + 1)
                call distance_to_edge(a, b, first + real([c - 1, j - 1], wp), distance, foot)
                if (distance <= near) marked(c, j) = .true._l1
              end do
            end do
          end associate
        end do
      end associate
    end do
  end subroutine on_edges

  !> Area of the region within a box, exact: between the heights at which an edge begins, ends,
  !> meets another or crosses a side of the box, the region is made of trapezoids.
  pure real(wp) function area_within(shapes, low, high) result(area)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: low(2), high(2)   !! corners of the box
    real(wp), allocatable :: edges(:, :), heights(:)
    integer :: k

    allocate (edges, source=edges_near(shapes, low, high))
    allocate (heights, source=heights_of(edges, low, high))
    area = 0.0_wp
    do k = 2, size(heights)
      if (heights(k) > heights(k - 1)) area = area + area_of_slab(shapes, edges, low(1), high(1), &
        heights(k - 1:k))
    end do
  end function area_within

  !> Length of the region on a piece of a line along an axis.
  pure real(wp) function length_within(shapes, along, across, ends) result(length)
    type(shape_t), intent(in) :: shapes(:)
    integer,       intent(in) :: along      !! 1: x, 2: y
    real(wp),      intent(in) :: across     !! coordinate of the line
    real(wp),      intent(in) :: ends(2)    !! of the piece, ascending
    real(wp), allocatable :: cuts(:)
    real(wp) :: x(2), y
    integer  :: i, k

    allocate (cuts, source=ends)
    do i = 1, size(shapes)
      associate (v => shapes(i)%vertices, other => 3 - along)
        do k = 1, size(v, 2)
          associate (a => v(:, k), b => v(:, next_vertex(v, k)))
            if ((a(other) <= across) .eqv. (b(other) <= across)) cycle
            y = a(along) + (across - a(other)) * (b(along) - a(along)) / (b(other) - a(other))
            if (y > ends(1) .and. y < ends(2)) cuts = [cuts, y]
          end associate
        end do
      end associate
    end do
    call sort(cuts)
    length = 0.0_wp
    x(3 - along) = across
    do k = 2, size(cuts)
      x(along) = 0.5_wp * (cuts(k - 1) + cuts(k))
      if (part_at(shapes, x) > 0) length = length + (cuts(k) - cuts(k - 1))
    end do
  end function length_within

  !> Edges that reach into a box: x and y of the lower end, x and y of the upper end (4, edges).
  pure function edges_near(shapes, low, high) result(edges)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: low(2), high(2)
    real(wp), allocatable :: edges(:, :)
    integer :: i, k, n, pass

    do pass = 1, 2   ! count, then fill
      n = 0
      do i = 1, size(shapes)
        associate (v => shapes(i)%vertices)
          do k = 1, size(v, 2)
            associate (a => v(:, k), b => v(:, next_vertex(v, k)))
              if (any(max(a, b) < low) .or. any(min(a, b) > high)) cycle
              n = n + 1
              if (pass == 1) cycle
              edges(:, n) = [a, b]
              if (a(2) > b(2)) edges(:, n) = [b, a]
            end associate
          end do
        end associate
      end do
      if (pass == 1) allocate (edges(4, n))
    end do
  end function edges_near

  !> Heights between which edges neither begin, end, meet nor cross the sides of a box, ascending.
  pure function heights_of(edges, low, high) result(heights)
    real(wp), intent(in) :: edges(:, :), low(2), high(2)
    real(wp), allocatable :: heights(:)
    real(wp) :: sides(2), slopes(size(edges, 2)), y
    integer  :: i, j

    sides = [low(1), high(1)]
    heights = [low(2), high(2)]
    do i = 1, size(edges, 2)
      call add_between(low(2), high(2), edges(2, i), heights)
      call add_between(low(2), high(2), edges(4, i), heights)
      if (.not. edges(4, i) > edges(2, i)) cycle
      slopes(i) = (edges(3, i) - edges(1, i)) / (edges(4, i) - edges(2, i))
      if (abs(slopes(i)) > 0.0_wp) then
        do j = 1, 2
          y = edges(2, i) + (sides(j) - edges(1, i)) / slopes(i)
          call add_between(low(2), high(2), y, heights)
        end do
      end if
      do j = 1, i - 1
        if (.not. edges(4, j) > edges(2, j)) cycle
        if (edges(2, j) > edges(4, i) .or. edges(4, j) < edges(2, i)) cycle
        if (.not. abs(slopes(i) - slopes(j)) > 0.0_wp) cycle
        y = edges(2, i) + (edges(1, j) - edges(1, i) + slopes(j) * (edges(2, i) - edges(2, j))) &
          / (slopes(i) - slopes(j))
        if (y > max(edges(2, i), edges(2, j)) .and. y < min(edges(4, i), edges(4, j))) &
          call add_between(low(2), high(2), y, heights)
      end do
    end do
    call sort(heights)
  end function heights_of

  !> Add a height to a list where it is between two others.
  pure subroutine add_between(low, high, height, heights)
    real(wp), intent(in) :: low, high, height
    real(wp), allocatable, intent(inout) :: heights(:)

    if (height > low .and. height < high) heights = [heights, height]
  end subroutine add_between

  !> Area of the region between two heights that no edge begins, ends or crosses another between.
  pure real(wp) function area_of_slab(shapes, edges, left, right, heights) result(area)
    type(shape_t), intent(in) :: shapes(:)
    real(wp),      intent(in) :: edges(:, :), left, right, heights(2)
    real(wp) :: bounds(3, size(edges, 2) + 2)   ! x in the middle, at the lower and upper height
    real(wp) :: middle, y(3)
    integer  :: j, k, n

    middle = 0.5_wp * sum(heights)
    y = [middle, heights]
    bounds(:, 1) = left
    n = 1
    do k = 1, size(edges, 2)
      associate (e => edges(:, k))
        if (.not. (e(2) < middle .and. e(4) > middle)) cycle
        n = n + 1
        j = n
        bounds(:, n) = e(1) + (y - e(2)) * (e(3) - e(1)) / (e(4) - e(2))
      end associate
      bounds(:, n) = min(right, max(left, bounds(:, n)))
      do while (bounds(1, j) < bounds(1, j - 1))
        bounds(:, [j - 1, j]) = bounds(:, [j, j - 1])
        j = j - 1
      end do
    end do
    n = n + 1
    bounds(:, n) = right
    area = 0.0_wp
    do k = 2, n
      if (.not. bounds(1, k) > bounds(1, k - 1)) cycle
      if (part_at(shapes, [0.5_wp * (bounds(1, k - 1) + bounds(1, k)), middle]) == 0) cycle
      area = area + 0.5_wp * (heights(2) - heights(1)) &
        * (bounds(2, k) - bounds(2, k - 1) + (bounds(3, k) - bounds(3, k - 1)))
    end do
  end function area_of_slab

end module pd_region
