!> Cell list: who may be within a radius of whom, in O(n).
module pd_cells
  use pd_kinds, only: wp
  implicit none
  private

  public :: cells_t, sort_into_cells, largest_neighbourhood, neighbourhood

  !> Points sorted into square cells at least `radius` wide.
  type :: cells_t
    real(wp) :: origin(2), width
    integer  :: counts(2)
    integer, allocatable :: first(:)     !! first entry of cell c in points (cells + 1)
    integer, allocatable :: points(:)    !! point numbers, ascending within a cell (n)
  end type cells_t

contains

  !> Counting sort of the points into cells. Widths grow beyond the radius where points are so
  !> thinly spread that there would be more cells than points.
  subroutine sort_into_cells(position, radius, cells)
    real(wp),      intent(in)  :: position(:, :)   !! (n,2) [m]
    real(wp),      intent(in)  :: radius           !! [m]
    type(cells_t), intent(out) :: cells
    real(wp), parameter :: a_little_wider = 1.0_wp + 1.0e-5_wp
    real(wp) :: extent(2)
    integer, allocatable :: next(:)
    integer :: i, c, n

    n = size(position, 1)
    cells%origin = minval(position, dim=1)
    extent = maxval(position, dim=1) - cells%origin
    cells%width = radius * a_little_wider
    do while (product(extent / cells%width + 1.0_wp) > real(n, wp) + 16.0_wp)
      cells%width = 1.5_wp * cells%width
    end do
    cells%counts = int(extent / cells%width) + 1

    allocate (cells%first(product(cells%counts) + 1), source=0)
    do i = 1, n
      c = cell_of(cells, position(i, :))
      cells%first(c + 1) = cells%first(c + 1) + 1
    end do
    cells%first(1) = 1
    do c = 2, size(cells%first)
      cells%first(c) = cells%first(c) + cells%first(c - 1)
    end do
    allocate (next(size(cells%first)), source=cells%first)
    allocate (cells%points(n))
    do i = 1, n
      c = cell_of(cells, position(i, :))
      cells%points(next(c)) = i
      next(c) = next(c) + 1
    end do
  end subroutine sort_into_cells

  !> Number of the cell that holds x.
  pure integer function cell_of(cells, x)
    type(cells_t), intent(in) :: cells
    real(wp),      intent(in) :: x(2)
    integer :: c(2)

    c = min(int((x - cells%origin) / cells%width), cells%counts - 1)
    cell_of = 1 + c(1) + c(2) * cells%counts(1)
  end function cell_of

  !> Most points that `neighbourhood` can return.
  pure integer function largest_neighbourhood(cells) result(largest)
    type(cells_t), intent(in) :: cells

    largest = 9 * maxval(cells%first(2:) - cells%first(:size(cells%first) - 1))
  end function largest_neighbourhood

  !> All points of the cell of x and of the eight around it: every point within the radius of x
  !> is among them.
  pure subroutine neighbourhood(cells, x, found, n_found)
    type(cells_t), intent(in)    :: cells
    real(wp),      intent(in)    :: x(2)        !! one of the points sorted [m]
    integer,       intent(inout) :: found(:)    !! at least largest_neighbourhood long
    integer,       intent(out)   :: n_found
    integer :: c, column, row, b, home(2)

    home = min(int((x - cells%origin) / cells%width), cells%counts - 1)
    n_found = 0
    do row = max(home(2) - 1, 0), min(home(2) + 1, cells%counts(2) - 1)
      do column = max(home(1) - 1, 0), min(home(1) + 1, cells%counts(1) - 1)
        c = 1 + column + row * cells%counts(1)
        do b = cells%first(c), cells%first(c + 1) - 1
          n_found = n_found + 1
          found(n_found) = cells%points(b)
        end do
      end do
    end do
  end subroutine neighbourhood

end module pd_cells
