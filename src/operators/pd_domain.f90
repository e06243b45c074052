!> The part of a body that this rank works on: its blocks of rows, and the halo around them.
module pd_domain
  use pd_blocks, only: blocks_t, new_blocks
  use pd_halo, only: halo_t
  use pd_kinds, only: wp
  use pd_pages, only: clear_rows
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: domain_t, new_domain

  type :: domain_t
    type(blocks_t) :: blocks
    type(halo_t)   :: halo
    !> Rows between which this rank knows fields: its own and the halo.
    integer :: known(2) = [1, 0]
    !> Blocks whose families read no row of another rank, and the others.
    integer, allocatable :: inner(:), outer(:)
  contains
    procedure :: take_part
    procedure :: meet
    procedure :: rows_of
    procedure :: kept
    procedure :: make_room
  end type domain_t

contains

  !> The rows between which all points lie: all of them belong to this rank.
  pure type(domain_t) function new_domain(first, last) result(domain)
    integer, intent(in) :: first, last
    integer :: k

    domain%blocks = new_blocks(first, last)
    domain%known = [first, last]
    domain%inner = [(k, k=1, domain%blocks%count)]
    allocate (domain%outer(0))
  end function new_domain

  !> From now on this rank has its own blocks only.
  pure subroutine take_part(self, ranks)
    class(domain_t), intent(inout) :: self
    type(ranks_t),   intent(in)    :: ranks   !! with the numbers of their blocks

    self%blocks = self%blocks%part(ranks)
    self%known = [self%blocks%first, self%blocks%last]
  end subroutine take_part

  !> First and last row of a rank; the last one is before the first where it has none.
  pure function rows_of(self, rank) result(ends)
    class(domain_t), intent(in) :: self
    integer,         intent(in) :: rank
    integer :: ends(2)

    ends = self%blocks%last_row_of([rank - 1, rank]) + [1, 0]
  end function rows_of

  !> Exchange the halo with another rank, too.
  pure subroutine meet(self, rank, theirs, mine)
    class(domain_t), intent(inout) :: self
    integer,         intent(in)    :: rank
    integer,         intent(in)    :: theirs(:)   !! rows that its families read, ascending
    integer,         intent(in)    :: mine(:)     !! rows that families of this rank read, ascending

    call self%halo%meet(self%blocks%ranks, rank, &
      within(theirs, [self%blocks%first, self%blocks%last]), within(mine, self%rows_of(rank)))
    if (size(mine) > 0) self%known = [min(self%known(1), mine(1)), &
      max(self%known(2), mine(size(mine)))]
  end subroutine meet

  !> The rows of n whose values are needed here. Sums by columns read some more, without weight.
  pure function kept(self, n) result(ends)
    class(domain_t), intent(in) :: self
    integer,         intent(in) :: n   !! rows of the fields
    integer :: ends(2)

    ends = [1, n]
    ! beyond the first and the last row of all there is a margin
    if (self%known(1) > self%blocks%ends(1)) ends(1) = self%known(1)
    if (self%known(2) < self%blocks%ends(2)) ends(2) = self%known(2)
  end function kept

  !> Make room for a field of zeros, unless that is done.
  subroutine make_room(self, n, components, field)
    class(domain_t), intent(in) :: self
    integer,         intent(in) :: n, components
    real(wp), allocatable, intent(inout) :: field(:, :)   !! (n,components)

    if (allocated(field)) return
    allocate (field(n, components))
    call clear_rows(field, self%kept(n))
  end subroutine make_room

  !> Those of some rows that are between two.
  pure function within(rows, ends)
    integer, intent(in)  :: rows(:), ends(2)
    integer, allocatable :: within(:)

    within = pack(rows, rows >= ends(1) .and. rows <= ends(2))
  end function within

end module pd_domain
