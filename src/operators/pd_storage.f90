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
  implicit none
  private

  public :: storage_t, listed_storage, lattice_storage, line_start

  type :: storage_t
    integer :: n = 0                       !! points
    integer :: rows = 0                    !! of every field
    integer :: reach = 0                   !! lines of the lattice that a family reaches
    integer :: stride = 0                  !! rows from a line of the lattice to the next; 0: a list
    integer :: ends(2) = 0                 !! first and last row that may hold a point
    integer, allocatable :: row(:)         !! of every point, ascending (n)
    !> Rows that this rank keeps, and the points that give them values: all of them until the
    !> body is divided.
    integer :: kept(2) = [1, 0]
    integer :: points(2) = [1, 0]
  contains
    procedure, private :: spread_values
    procedure, private :: spread_tensors
    procedure, private :: spread_numbers
    generic :: spread => spread_values, spread_tensors, spread_numbers
    procedure :: keep
    procedure :: take_shares
    procedure :: point_at
    procedure :: first_point
    procedure :: around, reached
  end type storage_t

contains

  !> A row for every point.
  pure type(storage_t) function listed_storage(n) result(storage)
    integer, intent(in) :: n
    integer :: i

    storage%n = n
    storage%rows = n
    storage%ends = [1, n]
    allocate (storage%row(n))
    storage%row = [(i, i=1, n)]
    call storage%keep([1, n])
  end function listed_storage

  !> Rows for the box of places around the points of a lattice, line by line, with a margin, so that
  !> a shift by a horizon never leaves the fields.
  pure type(storage_t) function lattice_storage(horizon, spacing, place, box) result(storage)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing       !! dx [m]
    integer,         intent(in) :: place(:, :)   !! column and row of every point (n,2)
    integer, optional, intent(in) :: box(:, :)   !! lowest and highest column and row of those that
                                                 !! have room (2,2); absent: of the points
    integer :: low(2), high(2), margin, reach

    reach = ceiling(horizon%delta / spacing - 1.0e-6_wp)
    low = minval(place, dim=1)
    high = maxval(place, dim=1)
    if (present(box)) then
      low = box(:, 1)
      high = box(:, 2)
    end if
    margin = whole_lines(reach)
    storage%reach = reach
    storage%n = size(place, 1)
    storage%stride = whole_lines(high(1) - low(1) + 1 + reach)
    storage%rows = storage%stride * (high(2) - low(2) + 1 + 2 * reach) + 2 * margin
    allocate (storage%row(storage%n))
    storage%row = margin + 1 + place(:, 1) - low(1) &
      + storage%stride * (place(:, 2) - low(2) + reach)
    storage%ends = [storage%row(1), storage%row(storage%n)]
    if (present(box)) storage%ends = margin + 1 + [storage%stride * reach, &
      high(1) - low(1) + storage%stride * (high(2) - low(2) + reach)]
    call storage%keep([1, storage%rows])
  end function lattice_storage

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
  subroutine take_shares(self, share, weighs, field)
    class(storage_t), intent(in)  :: self
    real(wp),         intent(in)  :: share(:)   !! of every point (n)
    logical,          intent(out) :: weighs     !! some have less or more than a whole cell
    real(wp), allocatable, intent(out) :: field(:)   !! (rows)
    real(wp), parameter :: round_off = 1.0e-12_wp
    integer :: around(2), i

    weighs = any(share > 0.0_wp .and. abs(share - 1.0_wp) > round_off)
    around = self%kept + self%reach * (self%stride + 1) * [-1, 1]
    allocate (field(self%rows))
    call clear_rows(field, around)
    do i = self%first_point(around(1)), self%first_point(around(2) + 1) - 1
      field(self%row(i)) = merge(share(i), anint(share(i)), weighs)
    end do
  end subroutine take_shares

  !> A field of the points, in the rows that are kept; 0 in the others.
  function spread_values(self, values) result(field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:)   !! of all points, or of self%points
    real(wp), allocatable :: field(:)           !! (rows)
    integer :: i, shift

    allocate (field(self%rows))
    call clear_rows(field, self%kept)
    shift = merge(0, self%points(1) - 1, size(values) == self%n)
    do i = self%points(1), self%points(2)
      field(self%row(i)) = values(i - shift)
    end do
  end function spread_values

  !> A field with components.
  function spread_tensors(self, values) result(field)
    class(storage_t), intent(in) :: self
    real(wp),         intent(in) :: values(:, :)   !! (points, components)
    real(wp), allocatable :: field(:, :)           !! (rows, components)
    integer :: c, i, shift

    allocate (field(self%rows, size(values, 2)))
    call clear_rows(field, self%kept)
    shift = merge(0, self%points(1) - 1, size(values, 1) == self%n)
    do c = 1, size(values, 2)
      do i = self%points(1), self%points(2)
        field(self%row(i), c) = values(i - shift, c)
      end do
    end do
  end function spread_tensors

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

    point = count(self%row <= row)
  end function point_at

  !> The first point whose row is not before a row; n + 1 where there is none.
  pure integer function first_point(self, row) result(point)
    class(storage_t), intent(in) :: self
    integer,          intent(in) :: row
    integer :: before, middle

    before = 0
    point = self%n + 1
    do while (point - before > 1)
      middle = (before + point) / 2
      if (self%row(middle) < row) then
        before = middle
      else
        point = middle
      end if
    end do
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
