!> Fictitious layers: the places beyond a side of the body, or beyond an edge of a shape.
!>
!> Source: doc/theory.md, section 7.
module pd_layers
  use pd_kinds, only: wp
  use pd_places, only: empty, lattice_t, places_t
  use pd_polygons, only: distance_to_edge, edge_axis, next_vertex, outward_normal
  use pd_region, only: part_at, part_on
  use pd_sides, only: bottom, covers, left, normal_axis, outward, right, side_count, side_names, &
    top
  implicit none
  private

  public :: layer_t, fill_layer, fill_edges, go_on_over_layers

  !> Fictitious points beyond one side, or beyond edges.
  type :: layer_t
    character(:), allocatable :: side           !! 'bottom' | 'top' | 'left' | 'right' | 'all'; '':
                                                !! beyond edges
    integer :: boundary                         !! index of the boundary they belong to
    real(wp), allocatable :: span(:)            !! part of the side: from, to [m]; not allocated:
                                                !! all of it
    integer :: shape = 0                        !! shape whose edges these are
    integer :: edge = 0                         !! number of the edge; 0: all of them
    logical :: mirror = .false.                 !! its points are images of the body
  end type layer_t

  integer,  parameter :: outside = -huge(1)   ! owner of what is no place of the box
  real(wp), parameter :: round_off = 1.0e-6_wp

contains

  !> Mark the fictitious points beyond a side: under (above, beside) every point of the outermost
  !> row, or those strictly inside a span. Where layers of two whole sides meet, the corner block
  !> belongs to the bottom or top side.
  !>
  !> Squares go one row beyond the points, as if the body went on: these have whole cells across it.
  subroutine fill_layer(layer, layers, origin, lattice, places)
    type(layer_t),   intent(in)    :: layer
    type(layer_t),   intent(in)    :: layers(:)
    real(wp),        intent(in)    :: origin(2)   !! of lattice line 0, 0 [m]
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: on_line(2), squares(2), p, inner, low, high   ! rows of places from low to high

    p = lattice%rows
    low = lbound(places%owner, 2)
    high = ubound(places%owner, 2)
    inner = merge(0, 1, lattice%cells)   ! from the square of a line to the one next inside
    call find_range(layer, origin(2), places%line([bottom, top]), places%squares(:, 2), lattice, &
      on_line, squares)
    if (on(left)) call fill_column(places%line(left), -1)
    if (on(right)) call fill_column(places%line(right), 1)
    call find_range(layer, origin(1), places%line([left, right]), places%squares(:, 1), lattice, &
      on_line, squares)
    if (on(bottom)) call fill_row(places%line(bottom), -1)
    if (on(top)) call fill_row(places%line(top), 1)

  contains

    !> Whether this layer lies on a side.
    logical function on(side)
      integer, intent(in) :: side

      on = covers(layer%side, side)
    end function on

    !> Layers beyond the points of column x, in direction step.
    subroutine fill_column(x, step)
      integer, intent(in) :: x, step
      integer :: k, square

      square = x - merge(inner, 0, step > 0)
      associate (owner => places%owner, a => max(on_line(1), low), b => min(on_line(2), high), &
        c => max(squares(1), low), d => min(squares(2), high))
        do k = 1, p + 1
          if (k <= p) where (owner(x, a:b) == 0) owner(x + step * k, a:b) = layer%boundary
          where (places%filled(square, c:d))
            places%filled(square + step * k, c:d) = .true.
            places%whole(square + step * k, c:d) = .true.
          end where
        end do
      end associate
    end subroutine fill_column

    !> Layers beyond the points of row y, in direction step; on a whole side corner blocks included.
    subroutine fill_row(y, step)
      integer, intent(in) :: y, step
      integer :: k, row, square_row, columns(2), edge

      square_row = y - merge(inner, 0, step > 0)
      edge = merge(high, low, step > 0)   ! the last row, in this direction
      associate (owner => places%owner, a => on_line(1), b => on_line(2), c => squares(1), &
        d => squares(2), first => places%line(left), last => places%line(right))
        columns = [first, last]
        if (.not. allocated(layer%span) .and. y >= low .and. y <= high) then
          if (any_on(layers, left) .and. owner(first, y) == 0) columns(1) = first - p
          if (any_on(layers, right) .and. owner(last, y) == 0) columns(2) = last + p
        end if
        do k = 1, min(p + 1, step * (edge - square_row))
          if (k <= min(p, step * (edge - y))) then
            where (owner(a:b, y) == 0) owner(a:b, y + step * k) = layer%boundary
            owner(columns(1):first - 1, y + step * k) = layer%boundary
            owner(last + 1:columns(2), y + step * k) = layer%boundary
          end if
          row = square_row + step * k
          where (places%filled(c:d, square_row)) places%whole(c:d, row) = .true.
          if (columns(1) < first) places%whole(c - p - 1:c - 1, row) = .true.
          if (columns(2) > last) places%whole(d + 1:d + p + 1, row) = .true.
          where (places%whole(:, row)) places%filled(:, row) = .true.
        end do
      end associate
    end subroutine fill_row

  end subroutine fill_layer

  !> Where a layer of images reaches the end of its side it goes on over the layers of the next
  !> side: what they hold before it has images too.
  subroutine go_on_over_layers(layer, origin, lattice, places)
    type(layer_t),   intent(in)    :: layer
    real(wp),        intent(in)    :: origin(2)   !! of lattice line 0, 0 [m]
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: side, axis, along, step, square, on_line(2), squares(2), ends(2), p, k

    if (.not. layer%mirror .or. layer%shape > 0) return
    p = lattice%rows
    do side = 1, side_count
      if (.not. covers(layer%side, side)) cycle
      axis = normal_axis(side_names(side))
      along = 3 - axis
      step = outward(side_names(side))
      ends = merge(places%line([left, right]), places%line([bottom, top]), axis == 2)
      call find_range(layer, origin(along), ends, places%squares(:, along), lattice, on_line, &
        squares)
      square = places%line(side) - merge(1, 0, step > 0 .and. .not. lattice%cells)
      do k = 1, p + 1
        if (on_line(1) == ends(1)) then
          if (k <= p) call own(k, ends(1) - p, ends(1) - 1)
          call fill(k, squares(1) - p - 1, squares(1) - 1)
        end if
        if (on_line(2) == ends(2)) then
          if (k <= p) call own(k, ends(2) + 1, ends(2) + p)
          call fill(k, squares(2) + 1, squares(2) + p + 1)
        end if
      end do
    end do

  contains

    !> Places a to b of line k of the layer, where there is a layer before them.
    subroutine own(k, a, b)
      integer, intent(in) :: k, a, b

      associate (line => places%line(side), owner => places%owner)
        if (axis == 1) then
          where (owner(line, a:b) > 0 .and. owner(line + step * k, a:b) == empty) &
            owner(line + step * k, a:b) = layer%boundary
        else
          where (owner(a:b, line) > 0 .and. owner(a:b, line + step * k) == empty) &
            owner(a:b, line + step * k) = layer%boundary
        end if
      end associate
    end subroutine own

    !> Squares a to b of line k.
    subroutine fill(k, a, b)
      integer, intent(in) :: k, a, b

      associate (filled => places%filled, whole => places%whole)
        if (axis == 1) then
          where (filled(square, a:b)) whole(square + step * k, a:b) = .true.
          where (filled(square, a:b)) filled(square + step * k, a:b) = .true.
        else
          where (filled(a:b, square)) whole(a:b, square + step * k) = .true.
          where (filled(a:b, square)) filled(a:b, square + step * k) = .true.
        end if
      end associate
    end subroutine fill

  end subroutine go_on_over_layers

  !> Whether a layer lies on a whole side.
  pure logical function any_on(layers, side)
    type(layer_t), intent(in) :: layers(:)
    integer,       intent(in) :: side
    integer :: k

    any_on = .false.
    do k = 1, size(layers)
      any_on = any_on .or. covers(layers(k)%side, side) .and. .not. allocated(layers(k)%span)
    end do
  end function any_on

  !> The places along a side that are strictly inside the span of a layer, and the squares that it
  !> covers.
  pure subroutine find_range(layer, origin, lines, all_squares, lattice, on_line, squares)
    type(layer_t),   intent(in)  :: layer
    real(wp),        intent(in)  :: origin           !! coordinate of lattice line 0 [m]
    integer,         intent(in)  :: lines(2)         !! first and last place along the side
    integer,         intent(in)  :: all_squares(2)   !! first and last square along the side
    type(lattice_t), intent(in)  :: lattice
    integer,         intent(out) :: on_line(2)       !! first and last place
    integer,         intent(out) :: squares(2)       !! first and last square
    real(wp) :: ends(2), offset

    squares = all_squares
    on_line = lines
    if (.not. allocated(layer%span)) return
    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    ends = min(real(squares(2), wp) + 2.0_wp, max(real(squares(1), wp) - 1.0_wp, &
      (layer%span - origin) / lattice%spacing))
    on_line(1) = max(on_line(1), floor(ends(1) - offset + round_off) + 1)
    on_line(2) = min(on_line(2), ceiling(ends(2) - offset - round_off) - 1)
    if (lattice%cells) then
      squares = on_line
    else
      squares(1) = max(squares(1), floor(ends(1) + round_off))
      squares(2) = min(squares(2), ceiling(ends(2) - round_off) - 1)
    end if
  end subroutine find_range

  !> Mark the fictitious points beyond edges: beyond an edge along an axis whole rows as beyond a
  !> side; beyond an inclined one, or one shorter than a spacing, the empty places whose foot lies
  !> on it, no further away than the horizon. Where two edges with layers meet, the corner outside
  !> of both is filled too. A hole may reach into the air: where no material is, no layer follows.
  subroutine fill_edges(layer, layers, lattice, places)
    type(layer_t),   intent(in)    :: layer
    type(layer_t),   intent(in)    :: layers(:)
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    real(wp) :: normal(2)
    integer  :: k

    associate (shape => places%shapes(layer%shape))
      do k = 1, size(shape%vertices, 2)
        if (layer%edge /= 0 .and. layer%edge /= k) cycle
        normal = outward_normal(shape%vertices, k)
        if (.not. shape%solid) normal = -normal
        if (edge_axis(shape%vertices, k) == 0 .or. norm2(shape%vertices(:, k) &
          - shape%vertices(:, next_vertex(shape%vertices, k))) < 1.0_wp) then
          call fill_inclined(layer, k, normal, lattice, places)
        else
          call fill_rows(layer, k, normal, lattice, places)
        end if
      end do
      do k = 1, size(shape%vertices, 2)
        if (layer%edge /= 0 .and. layer%edge /= k) cycle
        if (has_layer(layers, layer%shape, before(k), places)) &
          call fill_corner(layer, before(k), k, k, lattice, places)
        associate (after => next_vertex(shape%vertices, k))
          if (layer%edge /= 0 .and. has_layer(layers, layer%shape, after, places)) &
            call fill_corner(layer, k, after, after, lattice, places)
        end associate
      end do
    end associate

  contains

    pure integer function before(edge)
      integer, intent(in) :: edge

      before = modulo(edge - 2, size(places%shapes(layer%shape)%vertices, 2)) + 1
    end function before

  end subroutine fill_edges

  !> Whether there is a layer beyond an edge: its own, or that of a whole side which it lies on.
  pure logical function has_layer(layers, shape, edge, places)
    type(layer_t),  intent(in) :: layers(:)
    integer,        intent(in) :: shape, edge
    type(places_t), intent(in) :: places
    integer :: k, side

    has_layer = .false.
    side = side_of_edge(places, shape, edge)
    do k = 1, size(layers)
      if (layers(k)%shape == 0) then
        if (side == 0 .or. allocated(layers(k)%span)) cycle
        has_layer = has_layer .or. covers(layers(k)%side, side)
      else
        has_layer = has_layer .or. layers(k)%shape == shape .and. any(layers(k)%edge == [0, edge])
      end if
    end do
  end function has_layer

  !> The side of the body that an edge lies on; 0: none.
  pure integer function side_of_edge(places, shape, edge) result(side)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: shape, edge
    integer :: axis, end, s

    side = 0
    associate (v => places%shapes(shape)%vertices)
      axis = edge_axis(v, edge)
      if (axis == 0) return
      do s = 1, side_count
        end = merge(1, 2, outward(side_names(s)) < 0)
        if (normal_axis(side_names(s)) == axis .and. abs(v(axis, edge) - places%box(axis, end)) &
          <= round_off) side = s
      end do
    end associate
  end function side_of_edge

  !> Rows beyond edge k, which is parallel to an axis: beyond each point of the row next to it.
  subroutine fill_rows(layer, k, normal, lattice, places)
    type(layer_t),   intent(in)    :: layer
    integer,         intent(in)    :: k
    real(wp),        intent(in)    :: normal(2)   !! out of the material
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer  :: across, along, first(2), here(2), i, j, line, step(2)
    real(wp) :: ends(2), height, offset

    associate (v => places%shapes(layer%shape)%vertices)
      across = edge_axis(v, k)
      along = 3 - across
      ends = [v(along, k), v(along, next_vertex(v, k))]
      ends = [minval(ends), maxval(ends)]
      height = v(across, k)
    end associate
    step = nint(normal)
    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    line = floor(height - offset + round_off)
    if (step(across) < 0) line = ceiling(height - offset - round_off)
    first(across) = line
    do i = ceiling(ends(1) - offset - round_off), floor(ends(2) - offset + round_off)
      first(along) = i
      if (at(places%owner, first) /= 0) cycle
      do j = 1, lattice%rows
        here = first + j * step
        if (at(places%owner, here) /= empty) exit
        places%owner(here(1), here(2)) = layer%boundary
        places%part(here(1), here(2)) = places%part(first(1), first(2))
      end do
    end do
    ! the squares: one row further, and from the square next inside
    first(across) = line - merge(0, 1, lattice%cells .or. step(across) < 0)
    do i = floor(ends(1) + round_off), ceiling(ends(2) - round_off) - 1
      first(along) = i
      if (at(places%owner, first) == outside) cycle   ! an edge of a hole, far from the solids
      if (.not. places%filled(first(1), first(2))) cycle
      do j = 1, lattice%rows + 1
        here = first + j * step
        if (at(places%owner, here) == outside) exit
        if (places%filled(here(1), here(2)) .and. j > 1) exit
        places%filled(here(1), here(2)) = .true.
        places%whole(here(1), here(2)) = .true.
      end do
    end do
  end subroutine fill_rows

  !> The value at a place, or `outside`.
  pure integer function at(values, place)
    integer, allocatable, intent(in) :: values(:, :)
    integer, intent(in) :: place(2)

    at = outside
    if (any(place < lbound(values)) .or. any(place > ubound(values))) return
    at = values(place(1), place(2))
  end function at

  !> Places beyond edge k, which is inclined.
  subroutine fill_inclined(layer, k, normal, lattice, places)
    type(layer_t),   intent(in)    :: layer
    integer,         intent(in)    :: k
    real(wp),        intent(in)    :: normal(2)   !! out of the material
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    real(wp) :: a(2), b(2), distance, foot, offset, x(2)
    integer  :: i, j, low(2), high(2)

    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    associate (v => places%shapes(layer%shape)%vertices)
      a = v(:, k)
      b = v(:, next_vertex(v, k))
    end associate
    low = max(lbound(places%owner), floor(min(a, b) - offset - lattice%reach))
    high = min(ubound(places%owner), ceiling(max(a, b) - offset + lattice%reach))
    do j = low(2), high(2)
      do i = low(1), high(1)
        if (places%owner(i, j) /= empty) cycle
        x = real([i, j], wp) + offset
        call distance_to_edge(a, b, x, distance, foot)
        if (abs(foot - 0.5_wp) > 0.5_wp + round_off) cycle
        if (distance > lattice%reach + round_off .or. dot_product(x - a, normal) <= 0.0_wp) cycle
        x = a + min(1.0_wp, max(0.0_wp, foot)) * (b - a)
        if (part_on(places%shapes, x) > 0) call take(layer, x, i, j, offset, places)
      end do
    end do
  end subroutine fill_inclined

  !> Places outside of both edges that meet at a vertex, nearest to it; none where the material goes
  !> round the vertex by more than half a turn, as it does at the corners of most holes.
  subroutine fill_corner(layer, first, second, vertex, lattice, places)
    type(layer_t),   intent(in)    :: layer
    integer,         intent(in)    :: first, second   !! edges, in their order
    integer,         intent(in)    :: vertex
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    real(wp) :: ahead(2), apart(2), back(2), corner(2), normal(2), offset
    integer  :: i, j, low(2), high(2)
    logical  :: block

    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    associate (v => places%shapes(layer%shape)%vertices)
      corner = v(:, vertex)
      back = v(:, first) - corner
      ahead = v(:, next_vertex(v, second)) - corner
      block = edge_axis(v, first) > 0 .and. edge_axis(v, second) > 0
      normal = outward_normal(v, first)
    end associate
    if (.not. places%shapes(layer%shape)%solid) normal = -normal
    if (dot_product(ahead, normal) > 0.0_wp .or. part_on(places%shapes, corner) == 0) return
    low = max(lbound(places%owner), floor(corner - offset) - lattice%rows - 1)
    high = min(ubound(places%owner), ceiling(corner - offset) + lattice%rows + 1)
    do j = low(2), high(2)
      do i = low(1), high(1)
        if (places%owner(i, j) /= empty) cycle
        apart = real([i, j], wp) + offset - corner
        if (dot_product(apart, back) > 0.0_wp .or. dot_product(apart, ahead) > 0.0_wp) cycle
        if (block .and. any(abs(apart) > real(lattice%rows, wp) + round_off)) cycle
        if (.not. block .and. norm2(apart) > lattice%reach + round_off) cycle
        call take(layer, corner, i, j, offset, places)
      end do
    end do
  end subroutine fill_corner

  !> A place joins a layer, unless there is material between it and its foot.
  subroutine take(layer, foot, i, j, offset, places)
    type(layer_t),  intent(in)    :: layer
    real(wp),       intent(in)    :: foot(2), offset
    integer,        intent(in)    :: i, j
    type(places_t), intent(inout) :: places
    real(wp), parameter :: width = 0.25_wp, beside = 1.0e-3_wp
    real(wp) :: apart(2), distance
    integer  :: k

    apart = real([i, j], wp) + offset - foot
    distance = norm2(apart)
    if (distance <= 0.0_wp) return
    do k = 1, floor(distance / width)
      if (part_at(places%shapes, foot + real(k, wp) * width / distance * apart) > 0) return
    end do
    places%owner(i, j) = layer%boundary
    places%part(i, j) = max(1, part_on(places%shapes, foot - beside / distance * apart))
    places%whole_cell(i, j) = .true.
  end subroutine take

end module pd_layers
