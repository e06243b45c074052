!> Rows of a field that all ranks know: those that supports, loads or probes look at.
!>
!> Every rank does the same with them, so that what happens at a few points needs no division.
module pd_shared_rows
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: shared_rows_t, new_shared_rows

  type :: shared_rows_t
    type(ranks_t), private :: ranks
    integer, allocatable :: rows(:)
    logical, allocatable, private :: mine(:)          !! of these, whether they are of this rank
    real(wp), allocatable, private :: numbers(:)      !! work space
  contains
    procedure :: bring
  end type shared_rows_t

contains

  !> Rows that are marked, of blocks that are divided among the ranks.
  pure type(shared_rows_t) function new_shared_rows(marked, blocks) result(shared)
    logical,        intent(in) :: marked(:)   !! (n)
    type(blocks_t), intent(in) :: blocks
    integer :: i, n

    shared%ranks = blocks%ranks
    allocate (shared%rows(count(marked)))
    n = 0
    do i = 1, size(marked)
      if (.not. marked(i)) cycle
      n = n + 1
      shared%rows(n) = i
    end do
    shared%mine = shared%rows >= blocks%first .and. shared%rows <= blocks%last
  end function new_shared_rows

  !> Make the rows of a field known to all ranks.
  subroutine bring(self, field)
    class(shared_rows_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: field(:, :)   !! (n, components)

    if (.not. allocated(self%rows)) return
    if (size(self%rows) == 0) return
    call make_room(self, size(field, 2))
    call put(self, field)
    call self%ranks%fill_in(self%numbers(:size(self%rows) * size(field, 2)))
    call take(self, field)
  end subroutine bring

  !> Make room for a number of columns; it stays for the next time.
  subroutine make_room(self, columns)
    class(shared_rows_t), intent(inout) :: self
    integer,              intent(in)    :: columns

    if (allocated(self%numbers)) then
      if (size(self%numbers) >= columns * size(self%rows)) return
      deallocate (self%numbers)
    end if
    allocate (self%numbers(columns * size(self%rows)), source=0.0_wp)
  end subroutine make_room

  !> Put what is known here, and 0 where another rank knows it.
  subroutine put(self, field)
    class(shared_rows_t), intent(inout) :: self
    real(wp), intent(in) :: field(:, :)
    integer :: c, k, n

    n = 0
    do c = 1, size(field, 2)
      do k = 1, size(self%rows)
        n = n + 1
        self%numbers(n) = 0.0_wp
        if (self%mine(k)) self%numbers(n) = field(self%rows(k), c)
      end do
    end do
  end subroutine put

  subroutine take(self, field)
    class(shared_rows_t), intent(in) :: self
    real(wp), intent(inout) :: field(:, :)
    integer :: c, k, n

    n = 0
    do c = 1, size(field, 2)
      do k = 1, size(self%rows)
        n = n + 1
        field(self%rows(k), c) = self%numbers(n)
      end do
    end do
  end subroutine take

end module pd_shared_rows
