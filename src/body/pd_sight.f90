!> Which points of a body see each other: bonds cross neither air nor cuts.
!>
!> On a lattice the line between two points has to stay in squares that are material. All is whole
!> numbers there, so round-off decides about no bond:
!>
!> - a line along the edge between two squares is inside if one of them is material;
!> - a line through a corner is inside if it is so before and after it, so material that touches
!>   at a corner holds together;
!> - squares of layers count as material.
!>
!> Of a cloud nobody knows where its air is; only cuts count there. A cut is a straight line between
!> two ends, which belong to it. A point on a cut lies at its left side, seen from the first end to
!> the second. A bond is cut where its points lie at different sides and its line meets the cut.
!> Source: doc/theory.md, section 1.
module pd_sight
  use pd_body, only: body_t
  use pd_kinds, only: l1, wp
  implicit none
  private

  public :: sight_t, new_sight, sees_all

  !> Needed at set-up only.
  type :: sight_t
    logical  :: cells = .false.                       !! points stand in the middle of squares
    integer  :: reach = 0                             !! squares that a family is away, at most
    real(wp) :: delta = 0.0_wp                        !! horizon [m]
    integer,  allocatable, private :: place(:, :)     !! of every point (n,2); not for a cloud
    real(wp), allocatable, private :: position(:, :)  !! X (n,2) [m]
    logical(l1), allocatable, private :: filled(:, :) !! as in body_t
    integer,  allocatable, private :: holes(:, :)     !! empty squares up to this column and row
    real(wp), allocatable :: cuts(:, :)               !! x, y, x, y of their ends (4,cuts) [m]
  contains
    procedure :: all_clear
    procedure :: sees
    procedure :: leave_out_hidden
    procedure :: crosses
    procedure :: through_material
    procedure, private :: empty_squares
  end type sight_t

contains

  !> Sight in a body.
  type(sight_t) function new_sight(body, cells, spacing, delta, cuts) result(sight)
    type(body_t), intent(in) :: body
    logical,      intent(in) :: cells        !! points stand in the middle of squares
    real(wp),     intent(in) :: spacing      !! dx [m]
    real(wp),     intent(in) :: delta        !! horizon [m]
    real(wp),     intent(in) :: cuts(:, :)   !! x, y, x, y of their ends (4,cuts) [m]
    integer :: x, y, column

    sight%cells = cells
    sight%delta = delta
    allocate (sight%cuts, source=cuts)
    allocate (sight%position, source=body%position)
    if (.not. allocated(body%place) .or. .not. allocated(body%filled)) return
    sight%reach = int(delta / spacing * (1.0_wp + 1.0e-5_wp)) + 1
    allocate (sight%place, source=body%place)
    associate (low => lbound(body%filled), high => ubound(body%filled))
      allocate (sight%filled(low(1):high(1), low(2):high(2)), source=body%filled)
      allocate (sight%holes(low(1) - 1:high(1), low(2) - 1:high(2)), source=0)
      do y = low(2), high(2)
        column = 0
        do x = low(1), high(1)
          if (.not. sight%filled(x, y)) column = column + 1
          sight%holes(x, y) = sight%holes(x, y - 1) + column
        end do
      end do
    end associate
  end function new_sight

  !> Whether all points of a strip see what is as near to them as the horizon, and not in a row
  !> before them. Whether places exactly at the horizon are among them is not looked at closely.
  logical function sees_all(body, number, rows, cells, reach)
    type(body_t), intent(in) :: body             !! points of the strip, and around it
    integer,      intent(in) :: number(:, :)     !! of the points, at places as in body%filled
    integer,      intent(in) :: rows(2)          !! of the strip
    logical,      intent(in) :: cells            !! points stand in the middle of squares
    real(wp),     intent(in) :: reach            !! horizon [spacings]
    real(wp), parameter :: a_little_wider = 1.0_wp + 1.0e-4_wp
    type(sight_t) :: sight
    real(wp) :: cuts(4, 0)
    integer :: i, j, x, y, here(2), last(2)

    sees_all = .true.
    sight = new_sight(body, cells, body%grid%spacing, reach * body%grid%spacing, &
      cuts)
    last = shape(number)
    do i = 1, body%n
      if (body%place(i, 2) < rows(1) .or. body%place(i, 2) > rows(2)) cycle
      if (sight%all_clear(i)) cycle
      here = body%place(i, :) - lbound(body%filled) + 1
      do y = 0, min(sight%reach, last(2) - here(2))
        do x = max(1 - here(1), merge(1, -sight%reach, y == 0)), min(sight%reach, last(1) - here(1))
          if (norm2(real([x, y], wp)) > reach * a_little_wider) cycle
          j = number(here(1) + x, here(2) + y)
          if (j > 0) sees_all = sees_all .and. sight%through_material(i, j)
        end do
      end do
      if (.not. sees_all) return
    end do
  end function sees_all

  !> Empty squares in a box of columns and rows; one at least where the box goes beyond the lattice.
  pure integer function empty_squares(self, low, high) result(found)
    class(sight_t), intent(in) :: self
    integer,        intent(in) :: low(2), high(2)

    found = 1
    if (any(low <= lbound(self%holes)) .or. any(high > ubound(self%holes))) return
    found = self%holes(high(1), high(2)) - self%holes(low(1) - 1, high(2)) &
      - self%holes(high(1), low(2) - 1) + self%holes(low(1) - 1, low(2) - 1)
  end function empty_squares

  !> Whether nothing but material is as near to a point as its family, and no cut.
  pure logical function all_clear(self, i)
    class(sight_t), intent(in) :: self
    integer,        intent(in) :: i
    real(wp) :: x(2), far   ! gfortran 12 passes an associated section of an array unpacked
    integer  :: k

    x = self%position(i, :)
    far = 1.001_wp * self%delta
    all_clear = .true.
    if (allocated(self%place)) &
      all_clear = self%empty_squares(self%place(i, :) - self%reach, &
      self%place(i, :) + self%reach) == 0
    do k = 1, size(self%cuts, 2)
      associate (cut => self%cuts(:, k))
        all_clear = all_clear .and. (any(x < min(cut(1:2), cut(3:4)) - far) &
          .or. any(x > max(cut(1:2), cut(3:4)) + far) .or. abs(left_of(cut, x)) > far)
      end associate
    end do
  end function all_clear

  !> Whether the bond between two points stays in material and crosses no cut.
  pure logical function sees(self, i, j)
    class(sight_t), intent(in) :: self
    integer,        intent(in) :: i, j
    integer :: k

    sees = self%through_material(i, j)
    do k = 1, size(self%cuts, 2)
      if (sees) sees = .not. self%crosses(k, i, j)
    end do
  end function sees

  !> Take those out of the family of point i that it does not see.
  pure subroutine leave_out_hidden(self, i, members, n_members)
    class(sight_t), intent(in)    :: self
    integer,        intent(in)    :: i
    integer,        intent(inout) :: members(:)
    integer,        intent(inout) :: n_members
    integer :: k, n

    if (self%all_clear(i)) return
    n = n_members
    n_members = 0
    do k = 1, n
      if (.not. self%sees(i, members(k))) cycle
      n_members = n_members + 1
      members(n_members) = members(k)
    end do
  end subroutine leave_out_hidden

  !> Whether the line between two points of a lattice stays in squares that are material. Places
  !> count twice, so that the middle of a square is a whole number.
  pure logical function through_material(self, i, j) result(inside)
    class(sight_t), intent(in) :: self
    integer,        intent(in) :: i, j
    integer :: a(2), d(2), low(2), high(2), x, y, corner, least, most

    inside = .true.
    if (.not. allocated(self%place)) return
    a = 2 * self%place(i, :) + merge(1, 0, self%cells)
    d = 2 * (self%place(j, :) - self%place(i, :))
    low = halves(min(a, a + d))
    high = halves(max(a, a + d) - 1)
    where (high < low) low = high   ! along an edge: the squares of both sides
    where (d == 0 .and. modulo(a, 2) == 0) high = low + 1
    if (self%empty_squares(low, high) == 0) return
    if (any(d == 0 .and. modulo(a, 2) == 0)) then
      if (d(1) == 0) inside = all(self%filled(low(1), low(2):high(2)) &
        .or. self%filled(high(1), low(2):high(2)))
      if (d(2) == 0) inside = all(self%filled(low(1):high(1), low(2)) &
        .or. self%filled(low(1):high(1), high(2)))
    else
      do y = low(2), high(2)
        do x = low(1), high(1)
          ! a square is crossed where its corners lie on both sides of the line
          corner = d(1) * (2 * y - a(2)) - d(2) * (2 * x - a(1))
          least = corner + min(0, 2 * d(1)) + min(0, -2 * d(2))
          most = corner + max(0, 2 * d(1)) + max(0, -2 * d(2))
          if (least < 0 .and. most > 0) inside = inside .and. self%filled(x, y)
        end do
      end do
    end if
  end function through_material

  !> Half of a whole number, rounded down.
  elemental integer function halves(i)
    integer, intent(in) :: i

    halves = (i - modulo(i, 2)) / 2
  end function halves

  !> Distance of a place to the left of the line through a cut, seen from its first end.
  pure real(wp) function left_of(cut, x)
    real(wp), intent(in) :: cut(4), x(2)   !! [m]

    left_of = ((cut(3) - cut(1)) * (x(2) - cut(2)) - (cut(4) - cut(2)) * (x(1) - cut(1))) &
      / norm2(cut(3:4) - cut(1:2))
  end function left_of

  !> Whether the bond between two points crosses cut k. What is nearer than 1e-6 horizons to the cut
  !> is on it, so that round-off decides about no bond.
  pure logical function crosses(self, k, i, j)
    class(sight_t), intent(in) :: self
    integer,        intent(in) :: k, i, j
    real(wp) :: along(2), length, from, to, at(2), part, margin, x(2), y(2)

    x = self%position(min(i, j), :)
    y = self%position(max(i, j), :)
    margin = 1.0e-6_wp * self%delta
    associate (a => self%cuts(1:2, k), b => self%cuts(3:4, k))
      length = norm2(b - a)
      along = (b - a) / length
      from = left_of(self%cuts(:, k), x)
      to = left_of(self%cuts(:, k), y)
      crosses = (from >= -margin) .neqv. (to >= -margin)
      if (.not. crosses) return
      part = min(1.0_wp, max(0.0_wp, from / (from - to)))
      at = x + part * (y - x)
      crosses = abs(dot_product(along, at - a) - 0.5_wp * length) <= 0.5_wp * length + margin
    end associate
  end function crosses

end module pd_sight
