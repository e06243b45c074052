!> The body: reference points, their volumes, and the sets of fictitious points.
!>
!> Points come from rectangles on one lattice or from a cloud; both are fixed after set-up.
!> Source: doc/theory.md, sections 1 and 7.
module pd_geometry
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_point_sets, only: side_t
  use pd_sides, only: bottom, covers, left, normal_axis, outward, right, side_count, side_names, top
  implicit none
  private

  public :: body_t, lattice_t, layer_t, lattice_body, nearest_count

  !> Reference points in the order of the rows of the lattice (y slow, x fast), or of the file.
  type :: body_t
    integer :: n = 0                            !! points, fictitious ones included
    real(wp), allocatable :: position(:, :)     !! X (n,2) [m]
    real(wp), allocatable :: volume(:)          !! V (n) per unit thickness [m^2]
    integer,  allocatable :: boundary(:)        !! 0: body, k: fictitious point of boundary k (n)
    integer,  allocatable :: part(:)            !! number of the rectangle that a point lies in, or
                                                !! that its layer continues (n)
    integer,  allocatable :: place(:, :)        !! column and row on the lattice (n,2); not
                                                !! allocated: no lattice
    integer,  allocatable :: box(:, :)          !! lowest and highest column and row of the points
                                                !! of all stages (2,2); not allocated: no stages
    real(wp) :: lower(2) = 0.0_wp               !! corners of the extent of the body without
    real(wp) :: upper(2) = 0.0_wp               !! fictitious points, as used [m]
    logical,  allocatable :: filled(:, :)       !! square above and right of the lattice line at a
                                                !! place is material, layers included (columns,
                                                !! rows of places, with a margin); not for a cloud
    type(side_t) :: sides(side_count)           !! by number (`pd_sides`); not for a cloud
  end type body_t

  !> How rectangles become points.
  type :: lattice_t
    real(wp) :: spacing                         !! dx [m]
    logical  :: cells                           !! points at cell centres, else on the boundary
    logical  :: tributary                       !! each point has its own part of the area
    integer  :: rows                            !! thickness of fictitious layers in points
  end type lattice_t

  !> Fictitious points beyond one side.
  type :: layer_t
    character(:), allocatable :: side           !! 'bottom' | 'top' | 'left' | 'right' | 'all'
    integer :: boundary                         !! index of the boundary they belong to
    real(wp), allocatable :: span(:)            !! part of the side: from, to [m]; not allocated:
                                                !! all of it
  end type layer_t

  !> Occupied places of a lattice in a box of columns and rows; index 0 is the lower left place
  !> of the body.
  type :: places_t
    integer, allocatable :: owner(:, :)         !! `empty`, or as body_t%boundary
    integer, allocatable :: part(:, :)          !! number of the rectangle; 0: none
    logical, allocatable :: filled(:, :)        !! the square above and right of a node is material
    integer, allocatable :: number(:, :)        !! of the point at a place, 0: none
  end type places_t

  integer, parameter :: empty = -1

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
    type(places_t) :: places
    integer  :: first(2, size(lower, 2)), last(2, size(lower, 2)), start(2), counts(2), k
    real(wp) :: origin(2)

    do k = 1, size(lower, 2)
      first(:, k) = nearest_count(lower(:, k) - lower(:, 1), lattice%spacing)
      last(:, k) = nearest_count(upper(:, k) - lower(:, 1), lattice%spacing)
      if (any(last(:, k) <= first(:, k))) then
        call errors%add('a body is thinner than one spacing', '&body')
        return
      end if
    end do
    start = minval(first, dim=2)
    counts = maxval(last, dim=2) - start
    origin = lower(:, 1) + real(start, wp) * lattice%spacing
    body%lower = origin
    body%upper = origin + real(counts, wp) * lattice%spacing

    call fill_rectangles(first, last, start, counts, lattice, places)
    do k = 1, size(layers)
      call fill_layer(layers(k), layers, origin, counts, lattice, places)
      if (.not. any(places%owner == layers(k)%boundary)) then
        call errors%add('a boundary holds no point', '&boundary side = '//layers(k)%side)
      end if
    end do
    call number_points(places, origin, lattice, body)
    call find_parts(places, counts, lattice, body)
    call find_sides(places, origin, counts, lattice, body)
    call move_alloc(places%filled, body%filled)
  end subroutine lattice_body

  !> Mark the points and the squares of the rectangles.
  subroutine fill_rectangles(first, last, start, counts, lattice, places)
    integer,         intent(in)  :: first(:, :), last(:, :)  !! lattice lines (2, rectangles)
    integer,         intent(in)  :: start(2), counts(2)
    type(lattice_t), intent(in)  :: lattice
    type(places_t),  intent(out) :: places
    integer :: margin, a(2), b(2), k

    margin = lattice%rows + 1
    allocate (places%owner(-margin:counts(1) + margin, -margin:counts(2) + margin), source=empty)
    allocate (places%part, mold=places%owner)
    places%part = 0
    allocate (places%filled(-margin:counts(1) + margin, -margin:counts(2) + margin), &
      source=.false.)
    do k = 1, size(first, 2)
      a = first(:, k) - start
      b = last(:, k) - start - 1
      places%filled(a(1):b(1), a(2):b(2)) = .true.
      if (.not. lattice%cells) b = b + 1
      places%owner(a(1):b(1), a(2):b(2)) = 0
      places%part(a(1):b(1), a(2):b(2)) = k
    end do
  end subroutine fill_rectangles

  !> Mark the fictitious points beyond a side: under (above, beside) every point of the outermost
  !> row, or those strictly inside a span. Where layers of two whole sides meet, the corner block
  !> belongs to the bottom or top side.
  !>
  !> The squares extend one row beyond the points: the outermost row stands for a body that goes
  !> on, so that its points have whole cells across the layer.
  subroutine fill_layer(layer, layers, origin, counts, lattice, places)
    type(layer_t),   intent(in)    :: layer
    type(layer_t),   intent(in)    :: layers(:)
    real(wp),        intent(in)    :: origin(2)   !! of place 0, 0 [m]
    integer,         intent(in)    :: counts(2)
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: outer(2), on_line(2), squares(2), p

    p = lattice%rows
    outer = merge(counts - 1, counts, lattice%cells)
    call find_range(layer, origin(2), counts(2), lattice, on_line, squares)
    if (on(left)) call fill_column(0, -1)
    if (on(right)) call fill_column(outer(1), 1)
    call find_range(layer, origin(1), counts(1), lattice, on_line, squares)
    if (on(bottom)) call fill_row(0, -1)
    if (on(top)) call fill_row(outer(2), 1)

  contains

    !> Whether this layer lies on a side.
    logical function on(side)
      integer, intent(in) :: side

      on = covers(layer%side, side)
    end function on

    !> Whether a layer lies on a whole side.
    logical function any_on(side)
      integer, intent(in) :: side
      integer :: k

      any_on = .false.
      do k = 1, size(layers)
        any_on = any_on .or. covers(layers(k)%side, side) .and. .not. allocated(layers(k)%span)
      end do
    end function any_on

    !> Layers beyond the points of column x, in direction step.
    subroutine fill_column(x, step)
      integer, intent(in) :: x, step
      integer :: k, square

      square = merge(0, counts(1) - 1, step < 0)
      associate (owner => places%owner, filled => places%filled, a => on_line(1), &
        b => on_line(2), c => squares(1), d => squares(2))
        do k = 1, p + 1
          if (k <= p) where (owner(x, a:b) == 0) owner(x + step * k, a:b) = layer%boundary
          filled(square + step * k, c:d) = filled(square, c:d)
        end do
      end associate
    end subroutine fill_column

    !> Layers beyond the points of row y, in direction step; on a whole side corner blocks included.
    subroutine fill_row(y, step)
      integer, intent(in) :: y, step
      integer :: from, to, square_row, k, columns(2)

      square_row = merge(0, counts(2) - 1, step < 0)
      columns = [0, outer(1)]
      if (.not. allocated(layer%span)) then
        if (any_on(left) .and. places%owner(0, y) == 0) columns(1) = -p
        if (any_on(right) .and. places%owner(outer(1), y) == 0) columns(2) = outer(1) + p
      end if
      from = columns(1)
      to = columns(2)
      associate (owner => places%owner, filled => places%filled, a => on_line(1), &
        b => on_line(2), c => squares(1), d => squares(2))
        do k = 1, p + 1
          if (k <= p) then
            where (owner(a:b, y) == 0) owner(a:b, y + step * k) = layer%boundary
            owner(from:-1, y + step * k) = layer%boundary
            owner(outer(1) + 1:to, y + step * k) = layer%boundary
          end if
          filled(c:d, square_row + step * k) = filled(c:d, square_row)
          if (from < 0) filled(-p - 1:-1, square_row + step * k) = .true.
          if (to > outer(1)) filled(counts(1):counts(1) + p, square_row + step * k) = .true.
        end do
      end associate
    end subroutine fill_row

  end subroutine fill_layer

  !> The places along a side that are strictly inside the span of a layer, and the squares that it
  !> covers.
  pure subroutine find_range(layer, origin, n, lattice, on_line, squares)
    type(layer_t),   intent(in)  :: layer
    real(wp),        intent(in)  :: origin       !! coordinate of place 0 [m]
    integer,         intent(in)  :: n            !! squares along the side
    type(lattice_t), intent(in)  :: lattice
    integer,         intent(out) :: on_line(2)   !! first and last place
    integer,         intent(out) :: squares(2)   !! first and last square
    real(wp), parameter :: round_off = 1.0e-6_wp
    real(wp) :: ends(2), offset

    squares = [0, n - 1]
    on_line = [0, merge(n - 1, n, lattice%cells)]
    if (.not. allocated(layer%span)) return
    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    ends = min(real(n, wp) + 1.0_wp, max(-1.0_wp, (layer%span - origin) / lattice%spacing))
    on_line(1) = max(on_line(1), floor(ends(1) - offset + round_off) + 1)
    on_line(2) = min(on_line(2), ceiling(ends(2) - offset - round_off) - 1)
    if (lattice%cells) then
      squares = on_line
    else
      squares(1) = max(squares(1), floor(ends(1) + round_off))
      squares(2) = min(squares(2), ceiling(ends(2) - round_off) - 1)
    end if
  end subroutine find_range

  !> The rectangle of every point: the last one that holds it. A layer continues what is beside it.
  pure subroutine find_parts(places, counts, lattice, body)
    type(places_t),  intent(in)    :: places
    integer,         intent(in)    :: counts(2)
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body
    integer :: i, outer(2), beside(2)

    outer = merge(counts - 1, counts, lattice%cells)
    allocate (body%part(body%n))
    do i = 1, body%n
      beside = min(outer, max(0, body%place(i, :)))
      body%part(i) = max(1, places%part(beside(1), beside(2)))
    end do
  end subroutine find_parts

  !> Number the occupied places row by row, and give them positions and volumes.
  subroutine number_points(places, origin, lattice, body)
    type(places_t),  intent(inout) :: places
    real(wp),        intent(in)    :: origin(2)
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body
    integer  :: ix, iy, k, quarters, low(2), high(2)
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
        quarters = 4
        if (lattice%tributary .and. .not. lattice%cells) &
          quarters = count(places%filled(ix - 1:ix, iy - 1:iy))
        body%volume(k) = 0.25_wp * real(quarters, wp) * lattice%spacing**2
      end do
    end do
  end subroutine number_points

  !> Points on the outermost line of the body at each side. Parts of the body that are set back from
  !> that line do not belong to the side.
  subroutine find_sides(places, origin, counts, lattice, body)
    type(places_t),  intent(in)    :: places
    real(wp),        intent(in)    :: origin(2)
    integer,         intent(in)    :: counts(2)
    type(lattice_t), intent(in)    :: lattice
    type(body_t),    intent(inout) :: body
    integer :: line(side_count), squares(side_count), k

    squares([bottom, left]) = 0
    squares(top) = counts(2) - 1
    squares(right) = counts(1) - 1
    line = squares
    if (.not. lattice%cells) line([top, right]) = squares([top, right]) + 1
    do k = 1, side_count
      associate (side => body%sides(k), along => 3 - normal_axis(side_names(k)))
        if (along == 1) then
          call find_side(lbound(places%number, 1), places%number(:, line(k)), &
            places%filled(:, squares(k)), origin(1), lattice, side)
        else
          call find_side(lbound(places%number, 2), places%number(line(k), :), &
            places%filled(squares(k), :), origin(2), lattice, side)
        end if
        side%name = trim(side_names(k))
        side%axis = 3 - along
        side%outward = outward(side%name)
        side%lower = body%lower(along)
        side%upper = body%upper(along)
      end associate
    end do
  end subroutine find_sides

  !> The points of one line of places, and the part of the squares along it that each has.
  pure subroutine find_side(first, number, filled, origin, lattice, side)
    integer,         intent(in)  :: first             !! index of the first place
    integer,         intent(in)  :: number(first:)
    logical,         intent(in)  :: filled(first:)
    real(wp),        intent(in)  :: origin            !! coordinate of place 0 [m]
    type(lattice_t), intent(in)  :: lattice
    type(side_t),    intent(out) :: side
    real(wp) :: ends(2)
    integer  :: i, k

    allocate (side%points(count(number > 0)))
    allocate (side%from(size(side%points)), side%to(size(side%points)))
    k = 0
    do i = first, ubound(number, 1)
      if (number(i) == 0) cycle
      k = k + 1
      ends = [0.0_wp, 1.0_wp]
      if (.not. lattice%cells) &
        ends = merge([-0.5_wp, 0.5_wp], [0.0_wp, 0.0_wp], filled(i - 1:i))
      side%points(k) = number(i)
      side%from(k) = origin + (real(i, wp) + ends(1)) * lattice%spacing
      side%to(k) = origin + (real(i, wp) + ends(2)) * lattice%spacing
    end do
  end subroutine find_side

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
