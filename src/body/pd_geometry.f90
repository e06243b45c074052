!> The body: reference points, their volumes, and the sets of fictitious points.
!>
!> Points come from shapes on one lattice or from a cloud; both are fixed after set-up.
!> Source: doc/theory.md, sections 1 and 7.
module pd_geometry
  use pd_errors, only: error_list_t
  use pd_kinds, only: l1, wp
  use pd_layers, only: fill_edges, fill_layer, go_on_over_layers, layer_t
  use pd_places, only: empty, give_slivers, lattice_t, new_places, places_t, volume_at
  use pd_point_sets, only: side_t
  use pd_region, only: area_within, box_of, length_within, shape_t
  use pd_sides, only: bottom, left, normal_axis, outward, right, side_count, side_names, top
  use pd_text, only: integer_text
  implicit none
  private

  public :: body_t, lattice_t, layer_t, shape_t, lattice_body, region_body, nearest_count

  !> Reference points in the order of the rows of the lattice (y slow, x fast), or of the file.
  type :: body_t
    integer :: n = 0                            !! points, fictitious ones included
    real(wp), allocatable :: position(:, :)     !! X (n,2) [m]
    real(wp), allocatable :: volume(:)          !! V (n) per unit thickness [m^2]
    integer,  allocatable :: boundary(:)        !! 0: body, k: fictitious point of boundary k (n)
    integer,  allocatable :: part(:)            !! number of the shape that a point lies in, or
                                                !! that its layer continues (n)
    integer,  allocatable :: place(:, :)        !! column and row on the lattice (n,2); not
                                                !! allocated: no lattice
    integer,  allocatable :: box(:, :)          !! lowest and highest column and row of the points
                                                !! of all stages (2,2); not allocated: no stages
    real(wp) :: lower(2) = 0.0_wp               !! corners of the extent of the body without
    real(wp) :: upper(2) = 0.0_wp               !! fictitious points, as used [m]
    logical(l1), allocatable :: filled(:, :)    !! square above and right of the lattice line at a
                                                !! place is material, layers included (columns,
                                                !! rows of places, with a margin); not for a cloud
    type(side_t) :: sides(side_count)           !! by number (`pd_sides`); not for a cloud
  end type body_t

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
    type(shape_t)  :: moved(size(shapes))
    type(places_t) :: places
    real(wp) :: box(2, 2), corner(2), start(2)
    integer  :: k

    box = box_of(shapes)
    start = real(floor(box(:, 1) + 1.0e-6_wp), wp)
    moved = shapes
    do k = 1, size(shapes)
      moved(k)%vertices = shapes(k)%vertices - spread(start, 2, size(shapes(k)%vertices, 2))
    end do
    corner = origin + start * lattice%spacing
    body%lower = corner + (box(:, 1) - start) * lattice%spacing
    body%upper = corner + (box(:, 2) - start) * lattice%spacing

    call new_places(moved, lattice, places)
    call look_at_shapes(places, errors)
    if (errors%count() > 0) return
    do k = 1, size(layers)
      if (layers(k)%shape > 0) then
        call fill_edges(layers(k), layers, lattice, places)
      else
        call fill_layer(layers(k), layers, corner, lattice, places)
      end if
    end do
    do k = 1, size(layers)
      call go_on_over_layers(layers(k), corner, lattice, places)
    end do
    do k = 1, size(layers)
      if (.not. any(places%owner == layers(k)%boundary)) &
        call errors%add('a boundary holds no point', place_of_layer(shapes, layers(k)))
    end do
    call join_layers(lattice, places)
    call number_points(places, corner, lattice, body)
    call find_parts(places, body)
    call find_sides(places, corner, lattice, body)
    call move_alloc(places%filled, body%filled)
  end subroutine region_body

  !> Check that every solid has points of its own, and that every hole takes something away.
  subroutine look_at_shapes(places, errors)
    type(places_t),     intent(in)    :: places
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: hardly = 1.0e-6_wp
    real(wp) :: box(2, 2)
    integer  :: k

    do k = 1, size(places%shapes)
      if (places%shapes(k)%solid) then
        if (.not. any(places%part == k)) call errors%add('a body leaves no point', &
          place_of_body(places%shapes, k), 'later bodies cover it, or it lies between '// &
          'the places of the lattice', 'at least one point of its own')
      else
        box(:, 1) = minval(places%shapes(k)%vertices, 2)
        box(:, 2) = maxval(places%shapes(k)%vertices, 2)
        if (area_within(places%shapes(:k - 1), box(:, 1), box(:, 2)) &
          - area_within(places%shapes(:k), box(:, 1), box(:, 2)) <= hardly) call errors%add( &
          'a hole takes nothing away', place_of_body(places%shapes, k), &
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

  !> Number the occupied places row by row, and give them positions and volumes.
  subroutine number_points(places, origin, lattice, body)
    type(places_t),  intent(inout) :: places
    real(wp),        intent(in)    :: origin(2)
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body
    integer  :: ix, iy, k, low(2), high(2)
    real(wp) :: offset

    call occupied_box(places, low, high)
    body%n = count(places%owner /= empty)
    allocate (body%position(body%n, 2), body%volume(body%n), source=0.0_wp)
    allocate (body%boundary(body%n), body%place(body%n, 2), source=0)
    allocate (places%number, mold=places%owner)
    places%number = 0
    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    k = 0
    do iy = low(2), high(2)
      do ix = low(1), high(1)
        if (places%owner(ix, iy) == empty) cycle
        k = k + 1
        places%number(ix, iy) = k
        body%place(k, :) = [ix, iy]
        body%position(k, :) = origin + (real([ix, iy], wp) + offset) * lattice%spacing
        body%boundary(k) = places%owner(ix, iy)
        body%volume(k) = 1.0_wp
        if (lattice%tributary) body%volume(k) = volume_at(places, lattice, ix, iy)
      end do
    end do
    if (lattice%tributary) call give_slivers(places, lattice, body%volume)
    body%volume = body%volume * lattice%spacing**2
  end subroutine number_points

  !> Points on the outermost line of the body at each side. Parts of the body that are set back from
  !> that line do not belong to the side.
  subroutine find_sides(places, origin, lattice, body)
    type(places_t),  intent(in)    :: places
    real(wp),        intent(in)    :: origin(2)
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body
    integer :: k

    do k = 1, side_count
      associate (side => body%sides(k), along => 3 - normal_axis(side_names(k)), &
        line => places%line(k))
        if (along == 1) then
          call find_side(places, lbound(places%number, 1), places%number(:, line), k, origin(1), &
            lattice, side)
        else
          call find_side(places, lbound(places%number, 2), places%number(line, :), k, origin(2), &
            lattice, side)
        end if
        side%name = trim(side_names(k))
        side%axis = 3 - along
        side%outward = outward(side%name)
        side%lower = body%lower(along)
        side%upper = body%upper(along)
      end associate
    end do
  end subroutine find_sides

  !> The points of one line of places, and the part of the side that each has.
  pure subroutine find_side(places, first, number, k, origin, lattice, side)
    type(places_t),  intent(in)    :: places
    integer,         intent(in)    :: first             !! index of the first place
    integer,         intent(in)    :: number(first:)
    integer,         intent(in)    :: k                 !! number of the side
    real(wp),        intent(in)    :: origin            !! coordinate of place 0 [m]
    type(lattice_t), intent(in)    :: lattice
    type(side_t),    intent(inout) :: side
    real(wp) :: ends(2)
    integer  :: i, n

    allocate (side%points(count(number > 0)))
    allocate (side%from(size(side%points)), side%to(size(side%points)))
    n = 0
    do i = first, ubound(number, 1)
      if (number(i) == 0) cycle
      n = n + 1
      ends = [0.0_wp, 1.0_wp]
      if (.not. lattice%cells) ends = [-part_of_side(places, k, i, -1, number(i - 1) > 0), &
        part_of_side(places, k, i, 1, number(i + 1) > 0)]
      side%points(n) = number(i)
      side%from(n) = origin + (real(i, wp) + ends(1)) * lattice%spacing
      side%to(n) = origin + (real(i, wp) + ends(2)) * lattice%spacing
    end do
  end subroutine find_side

  !> How far the part of side k that belongs to the point at place i goes in a direction [spacings]:
  !> halfway to the next point, or to the end of the side.
  pure real(wp) function part_of_side(places, k, i, direction, has_next) result(part)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: k, i, direction
    logical,        intent(in) :: has_next    !! there is a point at the next place
    real(wp), parameter :: just_inside = 1.0e-4_wp
    real(wp) :: ends(2)
    integer  :: along, square(2)

    along = 3 - normal_axis(side_names(k))
    square(along) = i + min(direction, 0)
    square(3 - along) = places%line(k) - merge(1, 0, outward(side_names(k)) > 0)
    part = 0.0_wp
    if (.not. places%filled(square(1), square(2))) return
    part = 0.5_wp
    if (places%whole(square(1), square(2))) return
    ends = real(i, wp) + merge(0.5_wp, 1.0_wp, has_next) * [min(direction, 0), max(direction, 0)]
    part = length_within(places%shapes, along, places%box(3 - along, merge(2, 1, &
      outward(side_names(k)) > 0)) - just_inside * real(outward(side_names(k)), wp), ends)
  end function part_of_side

  !> Lowest and highest column and row that hold a point.
  pure subroutine occupied_box(places, low, high)
    type(places_t), intent(in)  :: places
    integer,        intent(out) :: low(2), high(2)
    integer :: k, line(2)

    do k = 1, 2
      line = [lbound(places%owner, k), ubound(places%owner, k)]
      low(k) = line(1)
      do while (low(k) < line(2))
        if (holds_points(places, k, low(k))) exit
        low(k) = low(k) + 1
      end do
      high(k) = line(2)
      do while (high(k) > low(k))
        if (holds_points(places, k, high(k))) exit
        high(k) = high(k) - 1
      end do
    end do
  end subroutine occupied_box

  !> Whether a column (axis 1) or row (axis 2) holds a point.
  pure logical function holds_points(places, axis, line)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: axis, line

    if (axis == 1) then
      holds_points = any(places%owner(line, :) /= empty)
    else
      holds_points = any(places%owner(:, line) /= empty)
    end if
  end function holds_points

end module pd_geometry
