!> Blocks of rows, and everything that is taken over all of them: sums, extrema, counts.
!>
!> Kernels work on one block of `n_block` rows of the fields after the other, whatever the number of
!> threads. Each block returns one number; these are added in the order of the blocks, so that
!> a sum has the same bits for any number of threads and ranks.
module pd_blocks
  use pd_kinds, only: n_block, wp
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: blocks_t, new_blocks

  !> Division of the rows `first` to `last` into blocks: those of this rank. Rows have the numbers
  !> that they have in the whole body.
  type :: blocks_t
    integer :: first = 1     !! row where the first block begins
    integer :: last = 0      !! last row of the last block
    integer :: count = 0     !! blocks
    integer :: offset = 0    !! blocks of the ranks before this one
    integer :: ends(2) = [1, 0]   !! first and last row of the blocks of all ranks
    type(ranks_t) :: ranks   !! among which the blocks are divided
  contains
    procedure :: lo
    procedure :: hi
    procedure :: part
    procedure :: last_row_of
    procedure :: count_of_all
    procedure :: has_first
    procedure :: spread_rows
    procedure :: total
    procedure :: totals
    procedure :: total_of_rows
    procedure :: largest
    procedure :: smallest
    procedure :: lowest_number
  end type blocks_t

contains

  !> Blocks of some rows.
  pure type(blocks_t) function new_blocks(first, last) result(blocks)
    integer, intent(in) :: first, last

    blocks%first = first
    blocks%last = last
    blocks%count = (last - first + n_block) / n_block
    blocks%ends = [first, last]
  end function new_blocks

  !> Those of the blocks, which are those of all ranks, that belong to this rank.
  pure type(blocks_t) function part(self, ranks)
    class(blocks_t), intent(in) :: self
    type(ranks_t),   intent(in) :: ranks   !! with the numbers of their blocks

    part%ranks = ranks
    part%ends = self%ends
    part%offset = ranks%before(ranks%mine)
    part%count = ranks%before(ranks%mine + 1) - part%offset
    part%first = part%last_row_of(ranks%mine - 1) + 1
    part%last = part%last_row_of(ranks%mine)
  end function part

  !> Last row of the blocks of a rank; -1: the row before those of all ranks.
  elemental integer function last_row_of(self, rank) result(row)
    class(blocks_t), intent(in) :: self    !! divided among the ranks
    integer,         intent(in) :: rank

    row = min(self%ends(1) + self%ranks%before(rank + 1) * n_block - 1, self%ends(2))
  end function last_row_of

  !> Number of blocks of all ranks.
  pure integer function count_of_all(self) result(number)
    class(blocks_t), intent(in) :: self

    number = (self%ends(2) - self%ends(1) + n_block) / n_block
  end function count_of_all

  !> Whether the first block of all is one of this rank.
  pure logical function has_first(self)
    class(blocks_t), intent(in) :: self

    has_first = self%offset == 0 .and. self%count > 0
  end function has_first

  !> Make the rows of a field, of which each rank knows its own, known to all ranks.
  subroutine spread_rows(self, field)
    class(blocks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: field(:, :)   !! (rows, components)
    integer, allocatable :: last_rows(:)
    integer :: k

    if (.not. allocated(self%ranks%before)) return
    last_rows = [(self%last_row_of(k), k=-1, self%ranks%count - 1)]
    do k = 1, size(field, 2)
      call spread_column(self%ranks, last_rows, field(:, k))
    end do
  end subroutine spread_rows

  subroutine spread_column(ranks, last_rows, column)
    type(ranks_t), intent(in) :: ranks
    integer,       intent(in) :: last_rows(0:)
    real(wp),      intent(inout), contiguous, target :: column(:)
    real(wp), pointer :: values(:, :)

    values(1:1, 1:size(column)) => column
    call ranks%spread_out(values, last_rows)
  end subroutine spread_column

  !> First row of a block.
  pure integer function lo(self, block)
    class(blocks_t), intent(in) :: self
    integer,         intent(in) :: block

    lo = self%first + (block - 1) * n_block
  end function lo

  !> Last row of a block.
  pure integer function hi(self, block)
    class(blocks_t), intent(in) :: self
    integer,         intent(in) :: block

    hi = min(self%first + block * n_block - 1, self%last)
  end function hi

  !> Sum over all blocks, in their order.
  real(wp) function total(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    total = self%ranks%total(parts)
  end function total

  !> Sums of several numbers over all blocks, in their order: one message for all of them.
  function totals(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:, :)   !! (numbers, blocks)
    real(wp) :: totals(size(parts, 1))
    real(wp), allocatable :: all_parts(:, :)
    integer :: k

    allocate (all_parts, source=self%ranks%gathered_rows(parts))
    do k = 1, size(totals)
      totals(k) = sum(all_parts(k, :))
    end do
  end function totals

  !> Sum over all rows of all blocks, block by block.
  real(wp) function total_of_rows(self, terms) result(total)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: terms(:)   !! one number per row of this rank
    real(wp) :: parts(self%count)
    integer  :: block

    do block = 1, self%count
      associate (lo => self%lo(block) - self%first + 1, hi => self%hi(block) - self%first + 1)
        parts(block) = sum(terms(lo:hi))
      end associate
    end do
    total = self%total(parts)
  end function total_of_rows

  !> Largest number of any block.
  real(wp) function largest(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    largest = self%ranks%largest(parts)
  end function largest

  !> Smallest number of any block.
  real(wp) function smallest(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    smallest = self%ranks%smallest(parts)
  end function smallest

  !> Lowest positive number of any block, such as a row where something failed; 0: none.
  integer function lowest_number(self, parts) result(lowest)
    class(blocks_t), intent(in) :: self
    integer,         intent(in) :: parts(:)   !! one number per block

    lowest = self%ranks%lowest_number(parts)
  end function lowest_number

end module pd_blocks
