!> The places of a lattice in a box around the region of material: who owns them, and how much of
!> the region lies around each.
!>
!> Lengths are in spacings from the lower left lattice line of the body. Squares lie between lattice
!> lines; place and square (0, 0) are the lower left ones of the body.
!> Source: doc/theory.md, section 1.
module pd_places
  use pd_kinds, only: i1, i8, l1, wp
  use pd_region, only: area_within, box_of, mark_edges, on_edges, part_on, parts_on_grid, shape_t
  use pd_sides, only: bottom, left, right, side_count, top
  implicit none
  private

  public :: lattice_t, places_t, empty, new_places, outer_lines, volume_at, give_slivers

  !> How shapes become points.
  type :: lattice_t
    real(wp) :: spacing                         !! dx [m]
    logical  :: cells                           !! points at cell centres, else on the boundary
    logical  :: tributary                       !! each point has its own part of the area
    integer  :: rows                            !! thickness of fictitious layers in points
    real(wp) :: reach = 0.0_wp                  !! the horizon [spacings]
    logical  :: in_runs = .false.               !! keep points in runs, if that is possible
    logical  :: through_air = .true.            !! bonds cross what is not material
    integer  :: strip = 2**18                   !! places that are looked at together, then
  end type lattice_t

  !> Places in a box of columns and rows: those of the whole region, or of a window of rows.
  type :: places_t
    type(shape_t), allocatable :: shapes(:)     !! the region
    integer, allocatable :: owner(:, :)         !! `empty`, or as body_t%boundary
    integer, allocatable :: part(:, :)          !! number of the shape; 0: none
    logical(l1), allocatable :: filled(:, :)    !! the square above and right of a lattice line
                                                !! holds material, layers included
    logical(l1), allocatable :: whole(:, :)     !! a layer makes all of it material
    logical(l1), allocatable :: whole_cell(:, :)!! the point at a place owns a whole cell
    integer, allocatable :: number(:, :)        !! of the point at a place, 0: none
    integer  :: line(side_count) = 0            !! outermost column or row of places at each side
    integer  :: squares(2, 2) = 0               !! first and last column, first and last row that
                                                !! the box around the solids touches
    real(wp) :: box(2, 2) = 0.0_wp              !! lower and upper corner of that box [spacings]
    integer(i1), allocatable, private :: half(:, :) !! quarters of squares, halves of a spacing wide
  end type places_t

  integer, parameter :: empty = -1
  ! a quarter; cut: an edge goes through it
  integer(i1), parameter :: air = 0_i1, material = 1_i1, cut = 2_i1
  real(wp), parameter :: round_off = 1.0e-6_wp
  real(wp), parameter :: hardly = 1.0e-6_wp   ! of a square: no material

contains

  !> First and last row of places around the region that shapes make, and of its layers: these two
  !> hold no point.
  pure function outer_lines(shapes, lattice) result(lines)
    type(shape_t),   intent(in) :: shapes(:)
    type(lattice_t), intent(in) :: lattice
    integer :: lines(2), squares(2, 2)

    squares = squares_in(box_of(shapes))
    lines = [squares(1, 2) - lattice%rows - 1, squares(2, 2) + lattice%rows + 2]
  end function outer_lines

  !> First and last column, first and last row of the squares that a box touches.
  pure function squares_in(box) result(squares)
    real(wp), intent(in) :: box(2, 2)
    integer :: squares(2, 2)

    squares(1, :) = floor(box(:, 1) + round_off)
    squares(2, :) = ceiling(box(:, 2) - round_off) - 1
  end function squares_in

  !> The places of the region that shapes make, between two rows. What lies in squares at the edge
  !> of such a window is not all known.
  subroutine new_places(shapes, lattice, window, places)
    type(shape_t),   intent(in)  :: shapes(:)
    type(lattice_t), intent(in)  :: lattice
    integer,         intent(in)  :: window(2)   !! first and last row, among `outer_lines`
    type(places_t),  intent(out) :: places
    integer  :: low(2), high(2)
    real(wp) :: offset

    places%shapes = shapes
    places%box = box_of(shapes)
    places%squares = squares_in(places%box)
    offset = merge(0.5_wp, 0.0_wp, lattice%cells)
    places%line([left, bottom]) = ceiling(places%box(:, 1) - offset - round_off)
    places%line([right, top]) = floor(places%box(:, 2) - offset + round_off)
    low = [places%squares(1, 1) - lattice%rows - 1, window(1)]
    high = [places%squares(2, 1) + lattice%rows + 2, window(2)]
    allocate (places%owner(low(1):high(1), low(2):high(2)), source=empty)
    allocate (places%part, mold=places%owner)
    allocate (places%filled(low(1):high(1), low(2):high(2)), source=.false._l1)
    allocate (places%whole, places%whole_cell, source=places%filled)
    call find_parts(places, real(low, wp) + offset)
    call find_halves(places)
    call find_filled(lattice, places)
  end subroutine new_places

  !> The part of every place, those on edges by the material beside them.
  subroutine find_parts(places, first)
    type(places_t), intent(inout) :: places
    real(wp),       intent(in)    :: first(2)   !! the first place [spacings]
    logical(l1), allocatable :: marked(:, :)
    integer :: i, j

    allocate (marked(size(places%part, 1), size(places%part, 2)), source=.false._l1)
    call parts_on_grid(places%shapes, first, 1.0_wp, places%part)
    call on_edges(places%shapes, first, marked)
    associate (low => lbound(places%part))
      do j = 1, size(marked, 2)
        do i = 1, size(marked, 1)
          if (marked(i, j)) places%part(low(1) + i - 1, low(2) + j - 1) &
            = part_on(places%shapes, first + real([i - 1, j - 1], wp))
        end do
      end do
    end associate
    where (places%part > 0) places%owner = 0
  end subroutine find_parts

  !> What lies in the quarters of the squares.
  subroutine find_halves(places)
    type(places_t), intent(inout) :: places
    logical(l1), allocatable :: marked(:, :)
    integer,     allocatable :: line(:, :)
    real(wp), parameter  :: width = 0.5_wp
    real(wp) :: corner(2)
    integer  :: j, low(2), high(2)

    low = 2 * [places%squares(1, 1), max(places%squares(1, 2), lbound(places%owner, 2))]
    high = 2 * [places%squares(2, 1), min(places%squares(2, 2), ubound(places%owner, 2))] + 1
    corner = 0.5_wp * real(low, wp)
    allocate (places%half(low(1):high(1), low(2):high(2)))
    allocate (marked(high(1) - low(1) + 1, high(2) - low(2) + 1), source=.false._l1)
    allocate (line(size(marked, 1), 1))
    do j = 1, size(marked, 2)   ! line by line: all at once would take four bytes for each
      call parts_on_grid(places%shapes, [corner(1) + 0.5_wp * width, corner(2) + 0.5_wp * width &
        + width * real(j - 1, wp)], width, line)
      places%half(:, low(2) + j - 1) = merge(material, air, line(:, 1) > 0)
    end do
    call mark_edges(places%shapes, corner, width, marked)
    where (marked) places%half = cut
  end subroutine find_halves

  !> The squares that hold material; with points at the centres of cells, those around a point.
  subroutine find_filled(lattice, places)
    type(lattice_t), intent(in)    :: lattice
    type(places_t),  intent(inout) :: places
    integer :: i, j

    do j = max(places%squares(1, 2), lbound(places%owner, 2)), &
      min(places%squares(2, 2), ubound(places%owner, 2))
      do i = places%squares(1, 1), places%squares(2, 1)
        if (lattice%cells) then
          places%filled(i, j) = places%owner(i, j) == 0
        else
          places%filled(i, j) = area_of_square(places, i, j) > hardly
        end if
      end do
    end do
  end subroutine find_filled

  !> Area of the region in a square.
  pure real(wp) function area_of_square(places, i, j) result(area)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: i, j

    area = area_of_half(places, 2 * i, 2 * j) + area_of_half(places, 2 * i + 1, 2 * j) &
      + area_of_half(places, 2 * i, 2 * j + 1) + area_of_half(places, 2 * i + 1, 2 * j + 1)
  end function area_of_square

  !> Area of the region in a quarter of a square.
  pure real(wp) function area_of_half(places, i, j) result(area)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: i, j
    real(wp) :: corner(2)

    area = 0.0_wp
    if (any([i, j] < lbound(places%half)) .or. any([i, j] > ubound(places%half))) return
    if (places%half(i, j) == material) area = 0.25_wp
    if (places%half(i, j) /= cut) return
    corner = 0.5_wp * real([i, j], wp)
    area = area_within(places%shapes, corner, corner + 0.5_wp)
  end function area_of_half

  !> Area of the region, layers included, in the cell around a place that holds a point [spacing^2].
  pure real(wp) function volume_at(places, lattice, i, j) result(volume)
    type(places_t),  intent(in) :: places
    type(lattice_t), intent(in) :: lattice
    integer,         intent(in) :: i, j
    integer :: a, b

    volume = 1.0_wp
    if (places%whole_cell(i, j)) return
    if (lattice%cells) then
      if (.not. places%whole(i, j)) volume = area_of_square(places, i, j)
      return
    end if
    volume = 0.0_wp
    do b = -1, 0
      do a = -1, 0
        if (places%whole(i + a, j + b)) then
          volume = volume + 0.25_wp
        else
          volume = volume + area_of_half(places, 2 * i + a, 2 * j + b)
        end if
      end do
    end do
  end function volume_at

  !> Give what lies in cells without a point to the nearest point of the body, of several the one
  !> with the lowest number. The places must be those of the whole region, or of one without such
  !> cells.
  subroutine give_slivers(places, lattice, volume)
    type(places_t),  intent(in)    :: places
    type(lattice_t), intent(in)    :: lattice
    real(wp),        intent(inout) :: volume(:)   !! of the points [spacing^2]
    real(wp) :: sliver
    integer  :: i, j, k
    integer  :: ends(2, lbound(places%owner, 2):ubound(places%owner, 2))

    ends = rows_of_points(places)
    do j = max(places%squares(1, 2), lbound(places%owner, 2)), &
      min(places%squares(2, 2) + 1, ubound(places%owner, 2))
      do i = places%squares(1, 1), places%squares(2, 1) + 1
        if (places%owner(i, j) /= empty) cycle
        if (lattice%cells) then
          sliver = area_of_square(places, i, j)
        else
          sliver = area_of_half(places, 2 * i - 1, 2 * j - 1) + area_of_half(places, 2 * i, &
            2 * j - 1) + area_of_half(places, 2 * i - 1, 2 * j) + area_of_half(places, 2 * i, 2 * j)
        end if
        if (sliver <= 0.0_wp) cycle
        k = nearest_point(places, ends, i, j)
        if (k > 0) volume(k) = volume(k) + sliver
      end do
    end do
  end subroutine give_slivers

  !> Between which places of each row the points of the body lie; an empty range where none does.
  pure function rows_of_points(places) result(ends)
    type(places_t), intent(in) :: places
    integer :: ends(2, lbound(places%owner, 2):ubound(places%owner, 2))
    integer :: i, j

    do j = lbound(places%owner, 2), ubound(places%owner, 2)
      ends(:, j) = [ubound(places%owner, 1) + 1, lbound(places%owner, 1) - 1]
      do i = lbound(places%owner, 1), ubound(places%owner, 1)
        if (places%owner(i, j) == 0) ends(:, j) = [min(ends(1, j), i), i]
      end do
    end do
  end function rows_of_points

  !> The point of the body nearest to a place, looked for in squares around it, each twice as wide
  !> as the one before. What rows have is known: in a needle points are far from most places.
  pure integer function nearest_point(places, ends, i, j) result(k)
    type(places_t), intent(in) :: places
    integer,        intent(in) :: ends(:, lbound(places%owner, 2):)   !! see rows_of_points
    integer,        intent(in) :: i, j
    integer     :: a, b, reach
    integer(i8) :: least, square

    least = huge(1_i8)
    k = 0
    reach = 1
    do while (int(reach, i8)**2 < least .and. reach <= 2 * sum(shape(places%owner)))
      reach = 2 * reach
      do b = max(lbound(places%owner, 2), j - reach), min(ubound(places%owner, 2), j + reach)
        do a = max(ends(1, b), i - reach), min(ends(2, b), i + reach)
          if (places%owner(a, b) /= 0) cycle
          square = int(a - i, i8)**2 + int(b - j, i8)**2
          if (square > least) cycle
          if (square == least .and. places%number(a, b) > k) cycle
          least = square
          k = places%number(a, b)
        end do
      end do
    end do
  end function nearest_point

end module pd_places
