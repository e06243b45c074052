!> Which rows of the fields belong to the points of a body.
!>
!> Everywhere else points are numbered 1 to n. Fields have rows: one per point where bonds are
!> listed; on a lattice also one for every place of the box that holds no point, so that the bond to
!> a neighbour is a shift, the same for all. Kernels loop over rows; numbers of points are
!> translated here.
module pd_storage
  use pd_families, only: horizon_t
  use pd_kinds, only: n_line, wp
  use pd_pages, only: clear_rows
  use pd_runs, only: runs_t, runs_of
  implicit none
  private

  public :: storage_t, listed_storage, lattice_storage, line_start

  type :: storage_t
    integer :: n = 0                       !! points
    integer :: rows = 0                    !! of every field
    integer :: reach = 0                   !! lines of the lattice that a family reaches
    integer :: stride = 0                  !! rows from a line of the lattice to the next; 0: a list
    integer :: ends(2) = 0                 !! first and last row that may hold a point
    integer, allocatable, private :: first(:)   !! first point of each of the pieces of rows that
                                                !! follow each other; n + 1 last (pieces + 1)
    integer, allocatable, private :: start(:)   !! row of this point (pieces)
    !> Rows that this rank keeps, and the points that give them values: all of them until the
    !> body is divided.
    integer :: kept(2) = [1, 0]
    integer :: points(2) = [1, 0]
  contains
    procedure, private :: spread_values
    procedure, private :: spread_tensors
    procedure, private :: spread_numbers
    generic :: spread => spread_values, spread_tensors, spread_numbers
    procedure, private :: new_field_of_values
    procedure, private :: new_field_of_tensors
    generic :: new_field => new_field_of_values, new_field_of_tensors
    procedure, private :: row_of_point
    procedure, private :: all_rows
    generic :: row => row_of_point, all_rows
    procedure :: rows_of
    procedure :: keep
    procedure :: take_shares
    procedure :: point_at
    procedure :: first_point
    procedure :: around, reached
  end type storage_t

  interface lattice_storage
    procedure :: storage_of_runs
    procedure :: storage_of_places
  end interface lattice_storage

contains

  !> A row for every point.
  pure type(storage_t) function listed_storage(n) result(storage)
    integer, intent(in) :: n

    storage%n = n
    storage%rows = n
    storage%ends = [1, n]
    storage%first = [1, n + 1]
    storage%start = [1]
    call storage%keep([1, n])
  end function listed_storage

  !> Rows for the box of places around the points of a lattice, line by line, with a margin, so that
  !> a shift by a horizon never leaves the fields.
  pure type(storage_t) function storage_of_runs(horizon, spacing, runs, box) result(storage)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing       !! dx [m]
    type(runs_t),    intent(in) :: runs          !! of the points
    integer, optional, intent(in) :: box(:, :)   !! lowest and highest column and row of those that
                                                 !! have room (2,2); absent: of the points
    integer :: low(2), high(2), margin, reach

    reach = ceiling(horizon%delta / spacing - 1.0e-6_wp)
    low = runs%lowest()
    high = runs%highest()
    if (present(box)) then
      low = box(:, 1)
      high = box(:, 2)
    end if
    margin = whole_lines(reach)
    storage%reach = reach
    storage%n = runs%n
    storage%stride = whole_lines(high(1) - low(1) + 1 + reach)
    storage%rows = storage%stride * (high(2) - low(2) + 1 + 2 * reach) + 2 * margin
    call join_runs(runs, margin + 1 - low(1) + storage%stride * (reach - low(2)), storage)
    storage%ends = [storage%row(1), storage%row(storage%n)]
    if (present(box)) storage%ends = margin + 1 + [storage%stride * reach, &
      high(1) - low(1) + storage%stride * (high(2) - low(2) + reach)]
    call storage%keep([1, storage%rows])
  end function storage_of_runs

  !> The same for points that are given one by one, line by line.
  pure type(storage_t) function storage_of_places(horizon, spacing, place, box) result(storage)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing       !! dx [m]
    integer,         intent(in) :: place(:, :)   !! column and row of every point (n,2)
    integer, optional, intent(in) :: box(:, :)
    real(wp) :: alike(size(place, 1))

    alike = 1.0_wp
    storage = storage_of_runs(horizon, spacing, runs_of(place, alike), box)
  end function storage_of_places

  !> The pieces of rows that the points take up.
  pure subroutine join_runs(runs, row_of_place_0, storage)
    type(runs_t),    intent(in)    :: runs
    integer,         intent(in)    :: row_of_place_0
    type(storage_t), intent(inout) :: storage   !! in: with the stride
    integer :: k, pieces, row

    allocate (storage%first(runs%count + 1), storage%start(runs%count))
    pieces = 0
    do k = 1, runs%count
      row = row_of_place_0 + runs%place(1, k) + storage%stride * runs%place(2, k)
      if (pieces > 0) then
        if (row == storage%start(pieces) + runs%first(k) - storage%first(pieces)) cycle
      end if
      pieces = pieces + 1
      storage%first(pieces) = runs%first(k)
      storage%start(pieces) = row
    end do
    storage%first(pieces + 1) = runs%n + 1
    storage%first = storage%first(:pieces + 1)
    storage%start = storage%start(:pieces)
  end subroutine join_runs

  !> The row of a point.
  elemental integer function row_of_point(self, point) result(row)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: point
    integer :: piece

    piece = last_until(self%first(:size(self%start)), point)
    row = self%start(piece) + point - self%first(piece)
  end function row_of_point

  !> The rows of all points.
  pure function all_rows(self) result(rows)
    class(storage_t), intent(in) :: self
    integer :: rows(self%n)

    rows = self%rows_of([1, self%n])
  end function all_rows

  !> The rows of the points between two.
  pure function rows_of(self, ends) result(rows)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: ends(2)   !! first and last point; none: the last one is before
    integer, allocatable :: rows(:)
    integer :: i, piece

    allocate (rows(max(0, ends(2) - ends(1) + 1)))
    if (ends(2) < ends(1)) return
    piece = last_until(self%first(:size(self%start)), ends(1))
    do i = ends(1), ends(2)
      if (i == self%first(piece + 1)) piece = piece + 1
      rows(i - ends(1) + 1) = self%start(piece) + i - self%first(piece)
    end do
  end function rows_of

  !> Position of the last of some ascending numbers that is not beyond a limit; 0: all are.
  pure integer function last_until(numbers, limit) result(last)
    integer, intent(in) :: numbers(:), limit
    integer :: behind, middle

    last = 0
    behind = size(numbers) + 1
    do while (behind - last > 1)
      middle = (last + behind) / 2
      if (numbers(middle) <= limit) then
        last = middle
      else
        behind = middle
      end if
    end do
  end function last_until

  !> From now on this rank keeps these rows only.
  pure subroutine keep(self, kept)
    class(storage_t), intent(inout) :: self
    integer,          intent(in)    :: kept(2)   !! first and last

    self%kept = kept
    ! rows without a point look at the one before them
    self%points = [max(1, self%first_point(kept(1)) - 1), self%first_point(kept(2) + 1) - 1]
  end subroutine keep

  !> First row in the cache line of a row: blocks begin there.
  pure integer function line_start(row)
    integer, intent(in) :: row

    line_start = n_line * ((row - 1) / n_line) + 1
  end function line_start

  !> Rows in as many whole cache lines as hold a number of them.
  pure integer function whole_lines(count) result(rows)
    integer, intent(in) :: count

    rows = n_line * ((count + n_line - 1) / n_line)
  end function whole_lines

  !> What the points have of a whole cell, as far around the rows that are kept as families reach.
  subroutine take_shares(self, runs, cell, weighs, field)
    class(storage_t), intent(in)  :: self
    type(runs_t),     intent(in)  :: runs     !! of the points
    real(wp),         intent(in)  :: cell     !! volume of a whole cell [m^2]
    logical,          intent(out) :: weighs   !! some have less or more than a whole cell
    real(wp), allocatable, intent(out) :: field(:)   !! (rows)
    real(wp), parameter :: round_off = 1.0e-12_wp
    integer  :: around(2), points(2), i, k, row
    real(wp) :: share

    associate (shares => runs%volume(:runs%count) / cell)
      weighs = any(shares > 0.0_wp .and. abs(shares - 1.0_wp) > round_off)
    end associate
    around = self%kept + self%reach * (self%stride + 1) * [-1, 1]
    allocate (field(self%rows))
    call clear_rows(field, around)
    points = [self%first_point(around(1)), self%first_point(around(2) + 1) - 1]
    do k = runs%run_of(points(1)), runs%run_of(points(2))
      share = runs%volume(k) / cell
      row = self%row(runs%first(k))
      do i = max(points(1), runs%first(k)), min(points(2), runs%first(k + 1) - 1)
        field(row + i - runs%first(k)) = merge(share, anint(share), weighs)
      end do
    end do
  end subroutine take_shares

  !> A field of the points, in the rows that are kept; 0 in the others.
  function spread_values(self, values) result(field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:)   !! of all points, or of self%points
    real(wp), allocatable :: field(:)           !! (rows)

    call self%new_field(values, field)
  end function spread_values

  !> A field with components.
  function spread_tensors(self, values) result(field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:, :)   !! (points, components)
    real(wp), allocatable :: field(:, :)           !! (rows, components)

    call self%new_field(values, field)
  end function spread_tensors

  !> The same without a copy: an assignment would take memory for the rows of all ranks.
  subroutine new_field_of_values(self, values, field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:)   !! of all points, or of self%points
    real(wp), allocatable, intent(out) :: field(:)   !! (rows)
    integer :: i, shift

    allocate (field(self%rows))
    call clear_rows(field, self%kept)
    shift = merge(0, self%points(1) - 1, size(values) == self%n)
    associate (a => self%points(1), b => self%points(2), rows => self%rows_of(self%points))
      do i = a, b
        field(rows(i - a + 1)) = values(i - shift)
      end do
    end associate
  end subroutine new_field_of_values

  !> The same of a field with components.
  subroutine new_field_of_tensors(self, values, field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:, :)   !! (points, components)
    real(wp), allocatable, intent(out) :: field(:, :)   !! (rows, components)
    integer :: c, i, shift

    allocate (field(self%rows, size(values, 2)))
    call clear_rows(field, self%kept)
    shift = merge(0, self%points(1) - 1, size(values, 1) == self%n)
    associate (a => self%points(1), b => self%points(2), rows => self%rows_of(self%points))
      do c = 1, size(values, 2)
        do i = a, b
          field(rows(i - a + 1), c) = values(i - shift, c)
        end do
      end do
    end associate
  end subroutine new_field_of_tensors

  !> A field of whole numbers; rows without a point have the number of the last point before them,
  !> or of the first one.
  pure function spread_numbers(self, values) result(field)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: values(:)   !! of all points, or of self%points
    integer, allocatable :: field(:)            !! (rows); of those that are not kept: anything
    integer :: k, shift

    allocate (field(self%rows))
    associate (a => self%points(1), b => self%points(2))
      if (b < a) return
      shift = merge(0, a - 1, size(values) == self%n)
      field(self%kept(1):self%row(a) - 1) = values(a - shift)
      do k = a, b - 1
        field(self%row(k):self%row(k + 1) - 1) = values(k - shift)
      end do
      field(self%row(b):self%kept(2)) = values(b - shift)
    end associate
  end function spread_numbers

  !> The point of a row; the one before it where the row holds none.
  pure integer function point_at(self, row) result(point)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: row

    point = self%first_point(row + 1) - 1
  end function point_at

  !> The first point whose row is not before a row; n + 1 where there is none.
  pure integer function first_point(self, row) result(point)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: row
    integer :: piece

    point = 1
    piece = last_until(self%start, row)
    if (piece > 0) point = min(self%first(piece) + row - self%start(piece), self%first(piece + 1))
  end function first_point

  !> Rows of a lattice as far from some rows as a family reaches, those between among them; none for
  !> no rows.
  pure function around(self, first, last, ends) result(rows)
    class(storage_t), intent(in) :: self
    integer, intent(in)  :: first, last
    integer, intent(in)  :: ends(2)   !! first and last row that there is
    integer, allocatable :: rows(:)
    integer :: reached(2), i

    allocate (rows(0))
    if (last < first) return
    reached = self%reached(first, last, ends)
    rows = [(i, i=reached(1), reached(2))]
  end function around

  !> The first and the last of them.
  pure function reached(self, first, last, ends) result(rows)
    class(storage_t), intent(in) :: self
    integer, intent(in) :: first, last
    integer, intent(in) :: ends(2)   !! first and last row that there is
    integer :: rows(2)

    associate (far => self%reach * (self%stride + 1))
      rows = [max(ends(1), first - far), min(ends(2), last + far)]
    end associate
  end function reached

end module pd_storage
