!> Layers beyond a smooth plane are the mirror image of the body before it.
!>
!>   u_a = 2 U - u_a'        u_t = u_t'          a: along the normal of the plane, t: along it
!>   f_a' <- f_a' - f_a      f_t' <- f_t' + f_t
!>
!> The prime is the point of the body whose image a point of a layer is, and U the displacement of
!> the plane along its normal. Images have no gradient and so no stress: the energy is that of the
!> body alone, and the second line makes forces its derivative.
!> Source: doc/theory.md, section 7.
module pd_mirror
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  use pd_shared_rows, only: new_shared_rows, shared_rows_t
  use pd_tables, only: table_t
  implicit none
  private

  public :: mirror_t, new_mirror

  !> Rows of images, of what they are images of, and the planes between them. Each plane moves with
  !> a support.
  type :: mirror_t
    integer :: n = 0                                !! images
    integer, allocatable, private :: row(:)         !! of every image
    integer, allocatable, private :: origin(:)      !! row of the body
    integer, allocatable, private :: plane(:)       !! between the two
    integer, allocatable :: support(:)              !! of every plane
    integer, allocatable :: normal(:)               !! axis of every plane; 1: x, 2: y
    type(table_t), allocatable, private :: velocity(:)   !! dU/dt of every plane [m/s]
    real(wp), allocatable :: place(:)               !! U of every plane [m]
    real(wp), allocatable :: rate(:)                !! dU/dt of every plane [m/s]
    type(shared_rows_t), private :: origins         !! known to all ranks: what has images
    type(shared_rows_t), private :: both            !! that and the images
  contains
    procedure :: moves_with
    procedure :: rows
    procedure :: divide
    procedure :: known_rows
    procedure :: move
    procedure :: reflect_motion
    procedure :: hand_back
    procedure :: carry
  end type mirror_t

contains

  !> Images in planes that do not move yet.
  !>
  !> Where two planes meet, or face each other before a thin body, there are images of images: they
  !> come after those.
  pure type(mirror_t) function new_mirror(row, origin, plane, support, normal, velocity) &
    result(mirror)
    integer, intent(in) :: row(:), origin(:)        !! of images, and of what they are images of
    integer, intent(in) :: plane(:)                 !! between the two
    integer, intent(in) :: support(:), normal(:)    !! of every plane; axis 1: x, 2: y
    type(table_t), intent(in) :: velocity(:)        !! of every plane along its normal [m/s]
    integer :: i
    integer, allocatable :: order(:), next(:)
    logical, allocatable :: waits(:)

    allocate (waits(max(maxval(row), maxval(origin))), source=.false.)
    waits(row) = .true.
    allocate (order(0))
    do while (size(order) < size(row))
      next = pack([(i, i=1, size(row))], waits(row) .and. .not. waits(origin))
      if (size(next) == 0) exit   ! cannot be: what a plane shows lies nearer to the body
      order = [order, next]
      waits(row(next)) = .false.
    end do
    mirror%n = size(order)
    mirror%row = row(order)
    mirror%origin = origin(order)
    mirror%plane = plane(order)
    mirror%support = support
    mirror%normal = normal
    mirror%velocity = velocity
    allocate (mirror%place(size(support)), mirror%rate(size(support)), source=0.0_wp)
  end function new_mirror

  !> The plane that moves with a support; 0: none.
  pure integer function moves_with(self, support) result(plane)
    class(mirror_t), intent(in) :: self
    integer,         intent(in) :: support

    plane = 0
    if (self%n > 0) plane = findloc(self%support, support, dim=1)
  end function moves_with

  !> Rows of all images.
  pure function rows(self)
    class(mirror_t), intent(in) :: self
    integer :: rows(self%n)

    if (self%n > 0) rows = self%row
  end function rows

  !> From now on this rank has its own blocks only. Every rank reflects all images, from rows that
  !> are made known to it.
  pure subroutine divide(self, blocks)
    class(mirror_t), intent(inout) :: self
    type(blocks_t),  intent(in)    :: blocks
    logical, allocatable :: marked(:)

    if (self%n == 0) return
    allocate (marked(blocks%ends(2)), source=.false.)
    marked(self%origin) = .true.
    self%origins = new_shared_rows(marked, blocks)
    marked(self%row) = .true.
    self%both = new_shared_rows(marked, blocks)
  end subroutine divide

  !> Rows that are made known to all ranks: before the exchange of a field, and for the forces.
  pure function known_rows(self) result(sets)
    class(mirror_t), intent(in) :: self
    type(shared_rows_t) :: sets(2)

    sets = [self%origins, self%both]
  end function known_rows

  !> The planes go to where they are at time t.
  pure subroutine move(self, t)
    class(mirror_t), intent(inout) :: self
    real(wp),        intent(in)    :: t   !! [s]
    integer :: k

    if (self%n == 0) return
    do k = 1, size(self%velocity)
      self%place(k) = self%velocity(k)%integral(t)
      self%rate(k) = self%velocity(k)%rate(t)
    end do
  end subroutine move

  !> A vector field, such as a displacement, at the images; `moved` is what the planes do of the
  !> same kind, absent: nothing.
  subroutine reflect_motion(self, field, moved)
    class(mirror_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: field(:, :)   !! (rows,2)
    real(wp), intent(in), optional :: moved(:)           !! along the normals (planes)
    integer :: k

    call self%origins%bring(field)
    do k = 1, self%n
      associate (i => self%row(k), from => self%origin(k), a => self%normal(self%plane(k)))
        field(i, :) = field(from, :)
        field(i, a) = -field(i, a)
        if (present(moved)) field(i, a) = field(i, a) + 2.0_wp * moved(self%plane(k))
      end associate
    end do
  end subroutine reflect_motion

  !> Images move with their planes while the body stands still: for the work of the planes.
  pure subroutine carry(self, moved, u)
    class(mirror_t), intent(in) :: self
    real(wp), intent(in)    :: moved(:)              !! by the planes (planes) [m]
    real(wp), intent(inout), contiguous :: u(:, :)   !! (rows,2) [m]
    integer :: k

    do k = 1, self%n
      associate (i => self%row(k), a => self%normal(self%plane(k)))
        u(i, a) = u(i, a) + 2.0_wp * moved(self%plane(k))
      end associate
    end do
  end subroutine carry

  !> What bonds pull at images pulls at what they are images of. The force at the images stays: the
  !> planes take it twice.
  subroutine hand_back(self, force)
    class(mirror_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: force(:, :)   !! density (rows,2) [N/m^3]
    integer :: k

    call self%both%bring(force)
    do k = self%n, 1, -1   ! images of images come last
      associate (i => self%row(k), to => self%origin(k), a => self%normal(self%plane(k)))
        force(to, a) = force(to, a) - force(i, a)
        force(to, 3 - a) = force(to, 3 - a) + force(i, 3 - a)
      end associate
    end do
  end subroutine hand_back

end module pd_mirror
