!> Supports: they fix or move points of the model, and take their reactions.
!>
!> The time loop knows only this interface. A new kind is a module with an extension of `support_t`
!> and a line in `pd_setup_loads`. What a support needs of the forces at its points are sums: each
!> rank adds up its own points, block by block, and the sums of all blocks are added in their order.
!> Source: doc/theory.md, section 7.
module pd_supports
  use pd_blocks, only: blocks_t
  use pd_kinds, only: n_block, ordered_sum, wp
  use pd_point_sets, only: point_set_t
  use pd_ranks, only: ranks_t
  use pd_tables, only: table_t
  implicit none
  private

  public :: support_t, support_item_t, supports_t, n_sums, sum_of_forces

  integer, parameter :: n_sums = 3   !! numbers that a support adds up over its points

  !> A set of points with its motion, and the force of the present step.
  type, abstract :: support_t
    character(:), allocatable :: name
    character(:), allocatable :: load_kind   !! in a word; allocated if it includes a load
    integer, allocatable :: points(:)        !! ascending
    integer  :: near(2) = [1, 0]             !! first and last of them that this rank moves
    real(wp) :: force(2) = 0.0_wp            !! that the support applies to the body [N/m]
  contains
    procedure :: hold
    procedure :: add_up => add_up_forces
    procedure(mark_prescribed), deferred :: mark_prescribed
    procedure(prescribe),       deferred :: prescribe
    procedure(take_reactions),  deferred :: take_reactions
    procedure(work),            deferred :: work
    procedure :: share_forces => share_nothing
    procedure :: mark_read => mark_points
    procedure :: common_velocity => no_common_velocity
    procedure :: applied => nothing_applied
    procedure :: turns => never
    procedure :: rotation => no_rotation
    procedure :: description => nothing_to_say
  end type support_t

  abstract interface

    !> Set `free` to 0 in the prescribed components of the points.
    pure subroutine mark_prescribed(self, free)
      import :: support_t, wp
      class(support_t), intent(in)    :: self
      real(wp),         intent(inout) :: free(:, :)   !! 1: free (n,2)
    end subroutine mark_prescribed

    !> Set the prescribed components of u and v at time t.
    pure subroutine prescribe(self, t, u, v)
      import :: support_t, wp
      class(support_t), intent(in)    :: self
      real(wp),         intent(in)    :: t            !! [s]
      real(wp),         intent(inout) :: u(:, :)      !! (n,2) [m]
      real(wp),         intent(inout) :: v(:, :)      !! (n,2) [m/s]
    end subroutine prescribe

    !> Find the force that the support applies to the body, and those conjugate to its motion.
    pure subroutine take_reactions(self, sums, t, f)
      import :: n_sums, support_t, wp
      class(support_t), intent(inout) :: self
      real(wp),         intent(in)    :: sums(n_sums) !! over its points: before they are shared
      real(wp),         intent(in)    :: t            !! [s]
      real(wp),         intent(in)    :: f(:, :)      !! force density, with loads, shared (n,2)
                                                      !! [N/m^3]
    end subroutine take_reactions

    !> Work that the support does from t to t_next on the body and on its own points: by the
    !> trapezoidal rule from the reactions at both times. The kinetic energy of prescribed
    !> components is part of it.
    pure real(wp) function work(self, v, t, t_next)
      import :: support_t, wp
      class(support_t), intent(in) :: self
      real(wp),         intent(in) :: v(:, :)         !! v^{n+1/2} (n,2) [m/s]
      real(wp),         intent(in) :: t, t_next       !! [s]
    end function work

  end interface

  !> Holds a support of any kind.
  type :: support_item_t
    class(support_t), allocatable :: support
  end type support_item_t

  !> The supports of a model.
  type :: supports_t
    type(support_item_t), allocatable :: items(:)
    integer, allocatable, private :: runs(:, :)     !! support, first and last of its points in a
                                                    !! block, block by block (3, runs)
    integer, allocatable, private :: run_ends(:)    !! last run of every rank; 0 (0:ranks)
    integer, private :: first_run = 1, last_run = 0 !! of this rank
    type(ranks_t), private :: ranks
  contains
    procedure :: divide
    procedure :: bytes
    procedure :: balance
    procedure :: mark_prescribed => mark_all_prescribed
    procedure :: prescribe => prescribe_all
    procedure :: share_forces => share_all_forces
    procedure :: take_reactions => take_all_reactions
    procedure :: work => work_of_all
  end type supports_t

contains

  !> Hold the points of a set, all of them on this rank.
  pure subroutine hold(self, set)
    class(support_t),  intent(inout) :: self
    type(point_set_t), intent(in)    :: set

    self%name = set%name
    allocate (self%points(size(set%points)), source=set%points)
    self%near = [1, size(set%points)]
  end subroutine hold

  ! --- defaults, right for most supports

  !> What some of its points add to the sums: V f; a third number is for kinds that need one.
  pure function add_up_forces(self, first, last, volume, f) result(sums)
    class(support_t), intent(in) :: self
    integer,          intent(in) :: first, last       !! of its points
    real(wp),         intent(in) :: volume(:)         !! V (n) [m^2]
    real(wp),         intent(in) :: f(:, :)           !! (n,2) [N/m^3]
    real(wp) :: sums(n_sums)                          !! x, y [N/m], 0

    sums = [sum_of_forces(self%points(first:last), volume, f), 0.0_wp]
  end function add_up_forces

  !> sum V f over some points [N/m].
  pure function sum_of_forces(points, volume, f) result(force)
    integer,  intent(in) :: points(:)
    real(wp), intent(in) :: volume(:)                 !! V (n) [m^2]
    real(wp), intent(in) :: f(:, :)                   !! (n,2) [N/m^3]
    real(wp) :: force(2)

    force = [ordered_sum(volume(points) * f(points, 1)), ordered_sum(volume(points) * f(points, 2))]
  end function sum_of_forces

  !> Change the force density so that points which move as one keep doing so: here there are none.
  pure subroutine share_nothing(self, sums, t, f)
    class(support_t), intent(in)    :: self
    real(wp),         intent(in)    :: sums(n_sums)   !! over its points
    real(wp),         intent(in)    :: t              !! [s]
    real(wp),         intent(inout) :: f(:, :)        !! force density, with loads (n,2) [N/m^3]

    associate (unused => self, unused_sums => sums, unused_t => t, unchanged => f)
    end associate
  end subroutine share_nothing

  !> Mark the points whose displacement the history tells: its own; and those whose velocity the
  !> support looks at: none.
  pure subroutine mark_points(self, held, pushed)
    class(support_t), intent(in)    :: self
    logical,          intent(inout) :: held(:), pushed(:)   !! (n)

    associate (unchanged => pushed)
    end associate
    held(self%points) = .true.
  end subroutine mark_points

  !> Velocity that the support prescribes for component c of all its points; a table without times
  !> if there is no such velocity.
  pure type(table_t) function no_common_velocity(self, c) result(velocity)
    class(support_t), intent(in) :: self
    integer,          intent(in) :: c

    associate (unused => self, unused_c => c)
    end associate
    if (allocated(velocity%times)) deallocate (velocity%times)
  end function no_common_velocity

  !> Force from outside on the points of the support at time t, where it includes a load [N/m].
  pure function nothing_applied(self, t) result(force)
    class(support_t), intent(in) :: self
    real(wp),         intent(in) :: t                 !! [s]
    real(wp) :: force(2)

    associate (unused => self, unused_t => t)
    end associate
    force = 0.0_wp
  end function nothing_applied

  !> Whether the support turns its points as its motion goes on.
  pure logical function never(self) result(turns)
    class(support_t), intent(in) :: self

    associate (unused => self)
    end associate
    turns = .false.
  end function never

  !> Rotation of the points of the support at time t, positive from x to y [rad].
  pure real(wp) function no_rotation(self, t) result(rotation)
    class(support_t), intent(in) :: self
    real(wp),         intent(in) :: t                 !! [s]

    associate (unused => self, unused_t => t)
    end associate
    rotation = 0.0_wp
  end function no_rotation

  !> What `--check` says about the load on a support; '' if there is none.
  pure function nothing_to_say(self) result(text)
    class(support_t), intent(in) :: self
    character(:), allocatable :: text

    associate (unused => self)
    end associate
    text = ''
  end function nothing_to_say

  ! --- all supports, in their order

  !> Set `free` to 0 in all prescribed components.
  pure subroutine mark_all_prescribed(self, free)
    class(supports_t), intent(in)    :: self
    real(wp),          intent(inout) :: free(:, :)    !! 1: free (n,2)
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%support%mark_prescribed(free)
    end do
  end subroutine mark_all_prescribed

  !> Set the prescribed components of u and v at time t.
  pure subroutine prescribe_all(self, t, u, v)
    class(supports_t), intent(in)    :: self
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(inout) :: u(:, :)       !! (n,2) [m]
    real(wp),          intent(inout) :: v(:, :)       !! (n,2) [m/s]
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%support%prescribe(t, u, v)
    end do
  end subroutine prescribe_all

  !> Share forces among points that move as one; after all loads have been added.
  subroutine share_all_forces(self, volume, t, f)
    class(supports_t), intent(in)    :: self
    real(wp),          intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(inout) :: f(:, :)       !! force density, with loads (n,2) [N/m^3]
    real(wp) :: sums(n_sums, size(self%items))
    integer  :: k

    if (.not. any([(allocated(self%items(k)%support%load_kind), k=1, size(self%items))])) return
    sums = sums_of_all(self, volume, f)
    do k = 1, size(self%items)
      call self%items(k)%support%share_forces(sums(:, k), t, f)
    end do
  end subroutine share_all_forces

  !> Find the forces that the supports apply to the body at time t.
  subroutine take_all_reactions(self, volume, t, f)
    class(supports_t), intent(inout) :: self
    real(wp),          intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(in)    :: f(:, :)       !! after `share_forces` (n,2) [N/m^3]
    real(wp) :: sums(n_sums, size(self%items))
    integer  :: k

    sums = sums_of_all(self, volume, f)
    do k = 1, size(self%items)
      call self%items(k)%support%take_reactions(sums(:, k), t, f)
    end do
  end subroutine take_all_reactions

  !> Both, with the same sums: one message.
  subroutine balance(self, volume, t, f)
    class(supports_t), intent(inout) :: self
    real(wp),          intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(inout) :: f(:, :)       !! force density, with loads (n,2) [N/m^3]
    real(wp) :: sums(n_sums, size(self%items))
    integer  :: k

    sums = sums_of_all(self, volume, f)
    do k = 1, size(self%items)
      call self%items(k)%support%share_forces(sums(:, k), t, f)
      call self%items(k)%support%take_reactions(sums(:, k), t, f)
    end do
  end subroutine balance

  !> Sums over the points of every support: the same bits for any number of ranks.
  function sums_of_all(self, volume, f) result(sums)
    class(supports_t), intent(in) :: self
    real(wp),          intent(in) :: volume(:)        !! V (n) [m^2]
    real(wp),          intent(in) :: f(:, :)          !! (n,2) [N/m^3]
    real(wp) :: sums(n_sums, size(self%items))
    real(wp), allocatable :: parts(:, :)
    integer :: k

    sums = 0.0_wp
    if (.not. allocated(self%runs)) then
      do k = 1, size(self%items)
        sums(:, k) = self%items(k)%support%add_up(1, size(self%items(k)%support%points), volume, f)
      end do
      return
    end if
    allocate (parts(n_sums, size(self%runs, 2)), source=0.0_wp)   ! the others come from their ranks
    do k = self%first_run, self%last_run
      associate (run => self%runs(:, k))
        parts(:, k) = self%items(run(1))%support%add_up(run(2), run(3), volume, f)
      end associate
    end do
    call self%ranks%spread_out(parts, self%run_ends)
    do k = 1, size(parts, 2)
      associate (support => self%runs(1, k))
        sums(:, support) = sums(:, support) + parts(:, k)
      end associate
    end do
  end function sums_of_all

  !> From now on this rank adds up the points in its own blocks, and moves those in the rows that it
  !> keeps and the first one of every support.
  pure subroutine divide(self, blocks, kept)
    class(supports_t), intent(inout) :: self
    type(blocks_t),    intent(in)    :: blocks
    integer,           intent(in)    :: kept(2)       !! first and last row
    integer, allocatable :: runs(:, :), block_of(:)
    integer :: block, k, n, next(size(self%items))

    n = 0
    do k = 1, size(self%items)
      n = n + size(self%items(k)%support%points)
    end do
    allocate (runs(3, n), block_of(n))
    n = 0
    next = 1
    do block = 1, blocks%count_of_all()
      do k = 1, size(self%items)
        associate (points => self%items(k)%support%points)
          if (.not. is_in(points, next(k), block, blocks)) cycle
          n = n + 1
          block_of(n) = block
          runs(:2, n) = [k, next(k)]
          do while (is_in(points, next(k), block, blocks))
            next(k) = next(k) + 1
          end do
          runs(3, n) = next(k) - 1
        end associate
      end do
    end do
    do k = 1, size(self%items)
      associate (support => self%items(k)%support)
        support%near = [count(support%points < kept(1)) + 1, count(support%points <= kept(2))]
      end associate
    end do
    self%ranks = blocks%ranks
    self%runs = runs(:, :n)
    if (allocated(self%run_ends)) deallocate (self%run_ends)
    allocate (self%run_ends(0:blocks%ranks%count), source=n)
    self%run_ends(0) = 0
    do k = 1, merge(blocks%ranks%count, 0, allocated(blocks%ranks%before))
      self%run_ends(k) = count(block_of(:n) <= blocks%ranks%before(k))
    end do
    self%first_run = self%run_ends(blocks%ranks%mine) + 1
    self%last_run = self%run_ends(blocks%ranks%mine + 1)
  end subroutine divide

  !> What ranks tell each other in every step.
  pure integer function bytes(self)
    class(supports_t), intent(in) :: self   !! divided

    bytes = 8 * n_sums * size(self%runs, 2)
  end function bytes

  !> Whether a point of some is there and in a block.
  pure logical function is_in(points, number, block, blocks)
    integer,        intent(in) :: points(:), number, block
    type(blocks_t), intent(in) :: blocks

    is_in = number <= size(points)
    if (is_in) is_in = (points(number) - blocks%ends(1)) / n_block + 1 == block
  end function is_in

  !> Work that the supports do from t to t_next.
  pure real(wp) function work_of_all(self, v, t, t_next) result(work)
    class(supports_t), intent(in) :: self             !! with the forces at t and t_next
    real(wp),          intent(in) :: v(:, :)          !! v^{n+1/2} (n,2) [m/s]
    real(wp),          intent(in) :: t, t_next        !! [s]
    integer :: k

    work = 0.0_wp
    do k = 1, size(self%items)
      work = work + self%items(k)%support%work(v, t, t_next)
    end do
  end function work_of_all

end module pd_supports
