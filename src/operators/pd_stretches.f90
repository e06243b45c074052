!> Stretches of rows that hold points, within each block: what the sums and the laws work on.
!>
!> A body that leaves a part of its box empty, or a hole, has places without a point between its
!> rows. Where there are many of them one after the other, the kernels pass over them: fields are
!> zero there, and the sums of a block do not change. A short gap is worked through, for a stretch
!> begins with as many rows beside it as the family reaches, and with calls.
module pd_stretches
  use pd_blocks, only: blocks_t
  use pd_kinds, only: n_block, n_line, wp
  implicit none
  private

  public :: stretches_t, new_stretches

  integer, parameter :: shortest_gap = 3 * n_line   !! that is passed over [rows]

  type :: stretches_t
    integer, allocatable :: lo(:), hi(:)      !! first and last row, ascending
    integer, allocatable, private :: first(:) !! stretch of each block, one past the last (blocks+1)
    integer, private :: first_row = 1         !! of the first block
    logical :: has_gaps = .false.
  contains
    procedure :: from
    procedure :: to
    procedure :: rows
    procedure :: clear_gaps
  end type stretches_t

contains

  !> Stretches of the rows that hold a point; they begin at lines of the cache, as blocks do.
  pure type(stretches_t) function new_stretches(blocks, share) result(stretches)
    type(blocks_t), intent(in) :: blocks
    real(wp),       intent(in) :: share(:)   !! of a cell; 0: a row without a point (n)
    integer :: block, i, n, pass, line   ! line: last row of the stretch so far

    stretches%first_row = blocks%first
    allocate (stretches%first(blocks%count + 1))
    do pass = 1, 2   ! count, then fill
      n = 0
      do block = 1, blocks%count
        stretches%first(block) = n + 1
        line = blocks%lo(block) - 1
        do i = blocks%lo(block), blocks%hi(block), n_line
          if (.not. any(share(i:min(i + n_line - 1, blocks%hi(block))) > 0.0_wp)) cycle
          if (n < stretches%first(block) .or. i - line > shortest_gap) then
            n = n + 1
            if (pass == 2) stretches%lo(n) = merge(i, line + 1, i - line > shortest_gap)
          end if
          line = min(i + n_line - 1, blocks%hi(block))
          if (blocks%hi(block) - line < shortest_gap) line = blocks%hi(block)
          if (pass == 2) stretches%hi(n) = line
        end do
      end do
      stretches%first(blocks%count + 1) = n + 1
      if (pass == 1) allocate (stretches%lo(n), stretches%hi(n))
    end do
    stretches%has_gaps = sum(stretches%hi - stretches%lo + 1) < blocks%last - blocks%first + 1
  end function new_stretches

  !> The first stretch of the block of a row that ends there or behind it.
  pure integer function from(self, row)
    class(stretches_t), intent(in) :: self
    integer,            intent(in) :: row
    integer :: block

    block = (row - self%first_row) / n_block + 1
    from = self%first(block) + count(self%hi(self%first(block):self%first(block + 1) - 1) < row)
  end function from

  !> The last stretch of the block of a row that begins there or before it.
  pure integer function to(self, row)
    class(stretches_t), intent(in) :: self
    integer,            intent(in) :: row
    integer :: block

    block = (row - self%first_row) / n_block + 1
    to = self%first(block + 1) - 1 &
      - count(self%lo(self%first(block):self%first(block + 1) - 1) > row)
  end function to

  !> First and last of the rows lo to hi that a stretch has.
  pure function rows(self, k, lo, hi)
    class(stretches_t), intent(in) :: self
    integer,            intent(in) :: k, lo, hi
    integer :: rows(2)

    rows = [max(lo, self%lo(k)), min(hi, self%hi(k))]
  end function rows

  !> Zero in those of the rows lo to hi that no stretch has.
  pure subroutine clear_gaps(self, lo, hi, field)
    class(stretches_t), intent(in) :: self
    integer,            intent(in) :: lo, hi
    real(wp), intent(inout), contiguous :: field(:, :)   !! (n, components)
    integer :: c, k, next

    if (.not. self%has_gaps) return
    do c = 1, size(field, 2)
      next = lo
      do k = self%from(lo), self%to(hi)
        field(next:min(self%lo(k) - 1, hi), c) = 0.0_wp
        next = max(next, self%hi(k) + 1)
      end do
      field(next:hi, c) = 0.0_wp
    end do
  end subroutine clear_gaps

end module pd_stretches
