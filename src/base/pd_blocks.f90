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

  !> Division of the rows `first` to `last` into blocks.
  type :: blocks_t
    integer :: first = 1     !! row where the first block begins
    integer :: last = 0      !! last row of the last block
    integer :: count = 0     !! blocks
    type(ranks_t), private :: ranks
  contains
    procedure :: lo
    procedure :: hi
    procedure :: total
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
  end function new_blocks

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
  pure real(wp) function total(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    total = self%ranks%total(parts)
  end function total

  !> Largest number of any block.
  pure real(wp) function largest(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    largest = self%ranks%largest(parts)
  end function largest

  !> Smallest number of any block.
  pure real(wp) function smallest(self, parts)
    class(blocks_t), intent(in) :: self
    real(wp),        intent(in) :: parts(:)   !! one number per block

    smallest = self%ranks%smallest(parts)
  end function smallest

  !> Lowest positive number of any block, such as a row where something failed; 0: none.
  pure integer function lowest_number(self, parts) result(lowest)
    class(blocks_t), intent(in) :: self
    integer,         intent(in) :: parts(:)   !! one number per block

    lowest = self%ranks%lowest_number(parts)
  end function lowest_number

end module pd_blocks
