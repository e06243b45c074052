!> Points from shapes on a lattice.
!>
!> A lattice whose points are kept in runs is looked at strip by strip, so that no rank ever has
!> memory for all of its places.
!> Source: doc/theory.md, sections 1 and 7.
module pd_geometry
  use pd_body, only: body_t, grid_t
  use pd_body_sides, only: find_sides
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_layers, only: fill_edges, fill_layer, go_on_over_layers, layer_t
  use pd_places, only: empty, give_slivers, lattice_t, new_places, outer_lines, places_t, volume_at
  use pd_point_sets, only: side_t
  use pd_polygons, only: edge_axis
  use pd_region, only: area_within, box_of, shape_t
  use pd_runs, only: runs_t
  use pd_sides, only: bottom, left, right, top
  use pd_sight, only: sees_all
  use pd_text, only: integer_text
  implicit none
  private

  public :: body_t, lattice_t, layer_t, shape_t, lattice_body, region_body, nearest_count

  !> What the strips of a lattice hold.
  type :: found_t
    logical, allocatable :: shape(:)   !! there is a place of the shape
    logical, allocatable :: layer(:)   !! there is a point of the layer
    logical :: near = .true.           !! no bond crosses what is no material
  end type found_t

contains

  !> Number of spacings in a length, halves rounded up.
  elemental integer function nearest_count(length, spacing)
    real(wp), intent(in) :: length, spacing
    real(wp), parameter  :: round_off = 1.0e-6_wp

    nearest_count = floor(length / spacing + 0.5_wp + round_off)
  end function nearest_count

  !> Points of the union of rectangles on one lattice, with fictitious layers beyond its sides.
  !>
  !> The lattice starts at the lower left corner of the first rectangle; every corner moves to its
  !> nearest line. Errors: a rectangle thinner than one spacing, a layer that holds no point.
  subroutine lattice_body(lower, upper, lattice, layers, body, errors)
    real(wp),        intent(in)    :: lower(:, :), upper(:, :)  !! corners (2, rectangles) [m]
    type(lattice_t), intent(in)    :: lattice
    type(layer_t),   intent(in)    :: layers(:)
    type(body_t),    intent(out)   :: body
    type(error_list_t), intent(inout) :: errors
    type(shape_t) :: shapes(size(lower, 2))
    integer :: first(2), last(2), k

    do k = 1, size(lower, 2)
      first = nearest_count(lower(:, k) - lower(:, 1), lattice%spacing)
      last = nearest_count(upper(:, k) - lower(:, 1), lattice%spacing)
      if (any(last <= first)) then
        call errors%add('a body is thinner than one spacing', '&body')
        return
      end if
      shapes(k)%vertices = reshape(real([first(1), first(2), last(1), first(2), last(1), last(2), &
        first(1), last(2)], wp), [2, 4])
    end do
    call region_body(shapes, lower(:, 1), lattice, layers, body, errors)
  end subroutine lattice_body

  !> Points of the region that shapes make, on one lattice, with fictitious layers beyond its sides
  !> and edges. Vertices are in spacings from the origin.
  !>
  !> Errors: a shape without effect, a layer that holds no point.
  subroutine region_body(shapes, origin, lattice, layers, body, errors)
    type(shape_t),   intent(in)    :: shapes(:)
    real(wp),        intent(in)    :: origin(2)   !! of the lattice [m]
    type(lattice_t), intent(in)    :: lattice
    type(layer_t),   intent(in)    :: layers(:)
    type(body_t),    intent(out)   :: body
    type(error_list_t), intent(inout) :: errors
    type(shape_t)   :: moved(size(shapes))
    type(lattice_t) :: apart
    real(wp) :: box(2, 2), start(2)
    logical  :: near
    integer  :: before, k

    box = box_of(shapes)
    start = real(floor(box(:, 1) + 1.0e-6_wp), wp)
    moved = shapes
    do k = 1, size(shapes)
      moved(k)%vertices = shapes(k)%vertices - spread(start, 2, size(shapes(k)%vertices, 2))
    end do
    body%grid = grid_t(origin + start * lattice%spacing, merge(0.5_wp, 0.0_wp, lattice%cells), &
      lattice%spacing)
    body%lower = body%grid%origin + (box(:, 1) - start) * lattice%spacing
    body%upper = body%grid%origin + (box(:, 2) - start) * lattice%spacing

    before = errors%count()
    apart = lattice
    apart%in_runs = lattice%in_runs .and. may_be_in_strips(moved, lattice, layers)
    call fill_body(moved, apart, layers, body, near, errors)
    if (errors%count() > before .or. near .or. .not. apart%in_runs) return
    apart%in_runs = .false.   ! to know which bonds are not there takes the whole lattice
    call fill_body(moved, apart, layers, body, near, errors)
  end subroutine region_body

  !> Whether a strip of the lattice tells what its points are: no layer follows an edge or mirrors
  !> the body, and no cell without a point holds a sliver for a point elsewhere.
  pure logical function may_be_in_strips(shapes, lattice, layers) result(may)
    type(shape_t),   intent(in) :: shapes(:)
    type(lattice_t), intent(in) :: lattice
    type(layer_t),   intent(in) :: layers(:)
    integer :: i, k

    may = all(layers%shape == 0) .and. .not. any(layers%mirror)
    if (.not. lattice%tributary) return
    do k = 1, size(shapes)
      associate (v => shapes(k)%vertices)
        may = may .and. all(abs(v - anint(v)) <= 0.0_wp)
        do i = 1, size(v, 2)
          may = may .and. edge_axis(v, i) > 0
        end do
      end associate
    end do
  end function may_be_in_strips

  !> The points, strip by strip where they are kept in runs, all at once otherwise.
  subroutine fill_body(shapes, lattice, layers, body, near, errors)
    type(shape_t),   intent(in)    :: shapes(:)   !! from lattice line 0, 0
    type(lattice_t), intent(in)    :: lattice
    type(layer_t),   intent(in)    :: layers(:)
    type(body_t),    intent(inout) :: body        !! in: with its grid
    logical,         intent(out)   :: near        !! in runs: no bond crosses what is no material
    type(error_list_t), intent(inout) :: errors
    type(found_t) :: found
    integer :: ends(2), first, k, lines

    allocate (found%shape(size(shapes)), found%layer(size(layers)), source=.false.)
    body%n = 0
    body%runs = runs_t()
    body%sides = side_t()
    ends = outer_lines(shapes, lattice)
    lines = ends(2) - ends(1) + 1
    if (lattice%in_runs) &
      lines = max(4 * lines_beside(lattice), lattice%strip / lines_across(shapes))
    do first = ends(1), ends(2), lines
      call add_strip(shapes, lattice, layers, [first, min(ends(2), first + lines - 1)], body, &
        found, errors)
      if (errors%count() > 0) return
    end do
    near = found%near
    do k = 1, size(layers)
      if (.not. found%layer(k)) &
        call errors%add('a boundary holds no point', place_of_layer(shapes, layers(k)))
    end do
  end subroutine fill_body

  !> Points between two rows.
  subroutine add_strip(shapes, lattice, layers, rows, body, found, errors)
    type(shape_t),   intent(in)    :: shapes(:)
    type(lattice_t), intent(in)    :: lattice
    type(layer_t),   intent(in)    :: layers(:)
    integer,         intent(in)    :: rows(2)     !! first and last
    type(body_t),    intent(inout) :: body        !! in: with the points of all rows before
    type(found_t),   intent(inout) :: found
    type(error_list_t), intent(inout) :: errors
    type(places_t) :: places
    type(body_t)   :: strip
    integer :: ends(2), k

    ends = outer_lines(shapes, lattice)
    associate (beside => lines_beside(lattice))
      call new_places(shapes, lattice, [max(ends(1), rows(1) - beside), &
        min(ends(2), rows(2) + beside)], places)
    end associate
    do k = 1, size(shapes)
      found%shape(k) = found%shape(k) .or. any(places%part == k)
    end do
    if (rows(2) == ends(2)) call look_at_shapes(shapes, found%shape, errors)
    if (errors%count() > 0) return
    call fill_layers(layers, body%grid%origin, lattice, places)
    do k = 1, size(layers)
      found%layer(k) = found%layer(k) .or. any(places%owner(:, rows(1):rows(2)) &
        == layers(k)%boundary)
    end do
    call join_layers(lattice, places)
    strip%grid = body%grid
    call number_points(places, lattice, strip)
    call find_parts(places, strip)
    call find_sides(places, rows, body%n - count(strip%place(:, 2) < rows(1)), body)
    call move_alloc(places%filled, strip%filled)
    if (.not. lattice%in_runs) then
      call move_points(strip, body)
      return
    end if
    if (found%near .and. .not. lattice%through_air) &
      found%near = sees_all(strip, places%number, rows, lattice%cells, lattice%reach)
    call append(strip, rows, body%runs)
    body%n = body%runs%n
  end subroutine add_strip

  !> Rows of places beside a strip from which it is known what its points are, and which of their
  !> bonds stay in material.
  pure integer function lines_beside(lattice) result(lines)
    type(lattice_t), intent(in) :: lattice

    lines = 2 * lattice%rows + ceiling(lattice%reach) + 4
  end function lines_beside

  !> Columns that the solids touch.
  pure integer function lines_across(shapes)
    type(shape_t), intent(in) :: shapes(:)
    real(wp) :: box(2, 2)

    box = box_of(shapes)
    lines_across = max(1, ceiling(box(1, 2) - box(1, 1)))
  end function lines_across

  !> All fictitious layers.
  subroutine fill_layers(layers, origin, lattice, places)
    type(layer_t),   intent(in)    :: layers(:)
    real(wp),        intent(in)    :: origin(2)   !! of lattice line 0, 0 [m]
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: k

    do k = 1, size(layers)
      if (layers(k)%shape > 0) then
        call fill_edges(layers(k), layers, lattice, places)
      else
        call fill_layer(layers(k), layers, origin, lattice, places)
      end if
    end do
    do k = 1, size(layers)
      call go_on_over_layers(layers(k), origin, lattice, places)
    end do
  end subroutine fill_layers

  !> The points of a strip between two rows go behind those that are in runs.
  pure subroutine append(strip, rows, runs)
    type(body_t), intent(in)    :: strip
    integer,      intent(in)    :: rows(2)
    type(runs_t), intent(inout) :: runs
    integer :: i

    do i = 1, strip%n
      if (strip%place(i, 2) < rows(1) .or. strip%place(i, 2) > rows(2)) cycle
      call runs%append(strip%place(i, :), strip%volume(i), strip%boundary(i), strip%part(i))
    end do
  end subroutine append

  !> The points of all strips, which is one.
  subroutine move_points(strip, body)
    type(body_t), intent(inout) :: strip
    type(body_t), intent(inout) :: body

    body%n = strip%n
    call move_alloc(strip%position, body%position)
    call move_alloc(strip%volume, body%volume)
    call move_alloc(strip%boundary, body%boundary)
    call move_alloc(strip%part, body%part)
    call move_alloc(strip%place, body%place)
    call move_alloc(strip%filled, body%filled)
  end subroutine move_points

  !> Check that every solid has points of its own, and that every hole takes something away.
  subroutine look_at_shapes(shapes, seen, errors)
    type(shape_t),      intent(in)    :: shapes(:)
    logical,            intent(in)    :: seen(:)    !! there are points of it
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: hardly = 1.0e-6_wp
    real(wp) :: box(2, 2)
    integer  :: k

    do k = 1, size(shapes)
      if (shapes(k)%solid) then
        if (.not. seen(k)) call errors%add('a body leaves no point', &
          place_of_body(shapes, k), 'later bodies cover it, or it lies between '// &
          'the places of the lattice', 'at least one point of its own')
      else
        box(:, 1) = minval(shapes(k)%vertices, 2)
        box(:, 2) = maxval(shapes(k)%vertices, 2)
        if (area_within(shapes(:k - 1), box(:, 1), box(:, 2)) &
          - area_within(shapes(:k), box(:, 1), box(:, 2)) <= hardly) call errors%add( &
          'a hole takes nothing away', place_of_body(shapes, k), &
          'no solid before it lies there', 'a hole in one of the bodies before it')
      end if
    end do
  end subroutine look_at_shapes

  function place_of_body(shapes, k) result(place)
    type(shape_t), intent(in) :: shapes(:)
    integer,       intent(in) :: k
    character(:), allocatable :: place

    place = '&body number '//integer_text(k)
    if (.not. allocated(shapes(k)%name)) return
    if (shapes(k)%name /= '') place = place//', '''//shapes(k)%name//''''
  end function place_of_body

  function place_of_layer(shapes, layer) result(place)
    type(shape_t), intent(in) :: shapes(:)
    type(layer_t), intent(in) :: layer
    character(:), allocatable :: place

    if (layer%shape == 0) then
      place = '&boundary side = '//layer%side
    else
      place = '&boundary number '//integer_text(layer%boundary)//', '// &
        place_of_body(shapes, layer%shape)
      if (layer%edge > 0) place = place//', edge '//integer_text(layer%edge)
    end if
  end function place_of_layer

  !> Squares between points of the body and of layers beyond edges are material.
  subroutine join_layers(lattice, places)
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: i, j

    if (.not. any(places%whole_cell)) return
    associate (low => lbound(places%owner), high => ubound(places%owner))
      do j = low(2), high(2) - 1
        do i = low(1), high(1) - 1
          if (lattice%cells) then
            if (places%whole_cell(i, j)) places%filled(i, j) = .true.
          else if (any(places%whole_cell(i:i + 1, j:j + 1)) .and. &
                   all(places%owner(i:i + 1, j:j + 1) /= empty)) then
            places%filled(i, j) = .true.
            places%whole(i, j) = .true.
          end if
        end do
      end do
    end associate
  end subroutine join_layers

  !> The shape of every point. A layer continues what is beside it.
  pure subroutine find_parts(places, body)
    type(places_t), intent(in)    :: places
    type(body_t),   intent(inout) :: body
    integer :: i, beside(2)

    allocate (body%part(body%n))
    do i = 1, body%n
      associate (place => body%place(i, :))
        body%part(i) = places%part(place(1), place(2))
        if (body%part(i) > 0) cycle
        beside = min(places%line([right, top]), max(places%line([left, bottom]), place))
        body%part(i) = max(1, places%part(beside(1), beside(2)))
      end associate
    end do
  end subroutine find_parts

  !> Number the occupied places row by row, and give them positions and volumes. The outermost rows
  !> of places are left out: they hold no point, or it is not all known.
  subroutine number_points(places, lattice, body)
    type(places_t),  intent(inout) :: places
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body    !! in: with its grid
    integer :: ix, iy, k, low, high

    low = lbound(places%owner, 2) + 1
    high = ubound(places%owner, 2) - 1
    body%n = count(places%owner(:, low:high) /= empty)
    allocate (body%position(body%n, 2), body%volume(body%n), source=0.0_wp)
    allocate (body%boundary(body%n), body%place(body%n, 2), source=0)
    allocate (places%number, mold=places%owner)
    places%number = 0
    k = 0
    do iy = low, high
      do ix = lbound(places%owner, 1), ubound(places%owner, 1)
        if (places%owner(ix, iy) == empty) cycle
        k = k + 1
        places%number(ix, iy) = k
        body%place(k, :) = [ix, iy]
        body%position(k, :) = body%grid%position([ix, iy])
        body%boundary(k) = places%owner(ix, iy)
        body%volume(k) = 1.0_wp
        if (lattice%tributary) body%volume(k) = volume_at(places, lattice, ix, iy)
      end do
    end do
    if (lattice%tributary) call give_slivers(places, lattice, body%volume)
    body%volume = body%volume * lattice%spacing**2
  end subroutine number_points

end module pd_geometry
