!> Rows of a field that families read and that other ranks own: the halo of the rows of this rank.
!>
!> The operators bring every field up to date once it is whole, and before a family reads it.
!> Families that need nothing of the halo can work while it is on its way.
module pd_halo
  use pd_kinds, only: wp
  use pd_ranks, only: messages_t, ranks_t
  implicit none
  private

  public :: halo_t

  !> For each of some other ranks, which rows it needs of this one and which this one needs of it;
  !> no partners: this rank owns every row that it reads.
  type :: halo_t
    type(ranks_t), private :: ranks
    integer, allocatable :: partners(:)
    integer, allocatable :: sent(:), received(:)             !! rows, partner by partner
    integer, allocatable :: sent_ends(:), received_ends(:)   !! last of each; 0: before them (0:)
    !> What is on its way: looked at by messages and by tests that carry it themselves.
    real(wp), allocatable :: outbox(:), inbox(:)
    type(messages_t), private :: messages
  contains
    procedure :: meet
    procedure :: exchange
    procedure :: begin
    procedure :: help
    procedure :: piece
    procedure :: finish
  end type halo_t

contains

  !> Exchange rows with one more rank from now on.
  pure subroutine meet(self, ranks, partner, sent, received)
    class(halo_t), intent(inout) :: self
    type(ranks_t), intent(in)    :: ranks
    integer,       intent(in)    :: partner
    integer,       intent(in)    :: sent(:), received(:)   !! rows, in the order that it expects

    self%ranks = ranks
    if (.not. allocated(self%partners)) then
      allocate (self%partners(0), self%sent(0), self%received(0))
      allocate (self%sent_ends(0:0), self%received_ends(0:0), source=0)
    end if
    if (size(sent) + size(received) == 0) return
    self%partners = [self%partners, partner]
    self%sent = [self%sent, sent]
    self%received = [self%received, received]
    call append_end(self%sent_ends, size(self%sent))
    call append_end(self%received_ends, size(self%received))
  end subroutine meet

  pure subroutine append_end(ends, last)
    integer, allocatable, intent(inout) :: ends(:)   !! from 0
    integer,              intent(in)    :: last
    integer, allocatable :: longer(:)

    allocate (longer(0:size(ends)))
    longer(:size(ends) - 1) = ends
    longer(size(ends)) = last
    call move_alloc(longer, ends)
  end subroutine append_end

  !> Bring the rows of the halo up to date.
  subroutine exchange(self, field)
    class(halo_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: field(:, :)   !! (rows, components)

    call self%begin(field)
    call self%finish(field)
  end subroutine exchange

  !> Begin to bring the rows of the halo up to date; those of a second field go with them. Until it
  !> is finished nothing else is exchanged, and the halo is that of before.
  subroutine begin(self, field, second)
    class(halo_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: field(:, :)             !! (rows, components)
    real(wp), intent(in), contiguous, optional :: second(:, :)  !! likewise
    integer :: k, n, width

    if (.not. allocated(self%partners)) return
    width = size(field, 2)
    if (present(second)) width = width + size(second, 2)
    call make_room(self%outbox, width * size(self%sent))
    call make_room(self%inbox, width * size(self%received))
    n = 0
    do k = 1, size(self%partners)
      associate (rows => self%sent(self%sent_ends(k - 1) + 1:self%sent_ends(k)))
        call pack_rows(rows, field, self%outbox, n)
        if (present(second)) call pack_rows(rows, second, self%outbox, n)
      end associate
    end do
    call self%ranks%begin_swap(self%partners, width * self%sent_ends, self%outbox, &
      width * self%received_ends, self%inbox, self%messages)
  end subroutine begin

  !> Help the messages on, from time to time.
  subroutine help(self)
    class(halo_t), intent(inout) :: self

    if (allocated(self%partners)) call self%messages%help()
  end subroutine help

  !> Of a number of blocks, how many are worked on between two calls of `help`.
  pure integer function piece(self, blocks) result(length)
    class(halo_t), intent(in) :: self
    integer,       intent(in) :: blocks
    integer, parameter :: pieces = 4

    length = max(1, blocks)
    if (allocated(self%partners)) length = max(1, (blocks + pieces - 1) / pieces)
  end function piece

  !> Wait for the rows of the halo, and take them.
  subroutine finish(self, field, second)
    class(halo_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: field(:, :)             !! as it began
    real(wp), intent(inout), contiguous, optional :: second(:, :)  !! likewise
    integer :: k, n

    if (.not. allocated(self%partners)) return
    call self%messages%await(self%inbox)
    n = 0
    do k = 1, size(self%partners)
      associate (rows => self%received(self%received_ends(k - 1) + 1:self%received_ends(k)))
        call unpack_rows(rows, self%inbox, n, field)
        if (present(second)) call unpack_rows(rows, self%inbox, n, second)
      end associate
    end do
  end subroutine finish

  pure subroutine pack_rows(rows, field, box, n)
    integer,  intent(in)    :: rows(:)
    real(wp), intent(in)    :: field(:, :)
    real(wp), intent(inout) :: box(:)
    integer,  intent(inout) :: n             !! numbers in the box
    integer :: c

    do c = 1, size(field, 2)
      box(n + 1:n + size(rows)) = field(rows, c)
      n = n + size(rows)
    end do
  end subroutine pack_rows

  pure subroutine unpack_rows(rows, box, n, field)
    integer,  intent(in)    :: rows(:)
    real(wp), intent(in)    :: box(:)
    integer,  intent(inout) :: n             !! numbers that have been taken from the box
    real(wp), intent(inout) :: field(:, :)
    integer :: c

    do c = 1, size(field, 2)
      field(rows, c) = box(n + 1:n + size(rows))
      n = n + size(rows)
    end do
  end subroutine unpack_rows

  !> Make room for n numbers; it stays for the next time.
  subroutine make_room(box, n)
    real(wp), allocatable, intent(inout) :: box(:)
    integer,               intent(in)    :: n

    if (allocated(box)) then
      if (size(box) >= n) return
      deallocate (box)
    end if
    allocate (box(n), source=0.0_wp)
  end subroutine make_room

end module pd_halo
