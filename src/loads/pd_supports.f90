!> Supports: they fix or move points of the model, and take their reactions.
!>
!> The time loop knows only this interface. A new kind is a module with an extension of `support_t`
!> and a line in `pd_setup_loads`.
!> Source: doc/theory.md, section 7.
module pd_supports
  use pd_kinds, only: ordered_sum, wp
  use pd_tables, only: table_t
  implicit none
  private

  public :: support_t, support_item_t, supports_t, reaction

  !> A set of points with its motion, and the force of the present step.
  type, abstract :: support_t
    character(:), allocatable :: name
    character(:), allocatable :: load_kind   !! in a word; allocated if it includes a load
    integer, allocatable :: points(:)
    real(wp) :: force(2) = 0.0_wp            !! that the support applies to the body [N/m]
  contains
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
    pure subroutine take_reactions(self, volume, t, f)
      import :: support_t, wp
      class(support_t), intent(inout) :: self
      real(wp),         intent(in)    :: volume(:)    !! V (n) [m^2]
      real(wp),         intent(in)    :: t            !! [s]
      real(wp),         intent(in)    :: f(:, :)      !! force density, with loads (n,2) [N/m^3]
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
  contains
    procedure :: mark_prescribed => mark_all_prescribed
    procedure :: prescribe => prescribe_all
    procedure :: share_forces => share_all_forces
    procedure :: take_reactions => take_all_reactions
    procedure :: work => work_of_all
  end type supports_t

contains

  !> Force on the body that balances a force density at some points: - sum V f.
  pure function reaction(points, volume, f) result(force)
    integer,  intent(in) :: points(:)
    real(wp), intent(in) :: volume(:)                 !! V (n) [m^2]
    real(wp), intent(in) :: f(:, :)                   !! (n,2) [N/m^3]
    real(wp) :: force(2)

    force(1) = -ordered_sum(volume(points) * f(points, 1))
    force(2) = -ordered_sum(volume(points) * f(points, 2))
  end function reaction

  ! --- defaults, right for most supports

  !> Change the force density so that points which move as one keep doing so: here there are none.
  pure subroutine share_nothing(self, volume, t, f)
    class(support_t), intent(in)    :: self
    real(wp),         intent(in)    :: volume(:)      !! V (n) [m^2]
    real(wp),         intent(in)    :: t              !! [s]
    real(wp),         intent(inout) :: f(:, :)        !! force density, with loads (n,2) [N/m^3]

    associate (unused => self, unused_volume => volume, unused_t => t, unchanged => f)
    end associate
  end subroutine share_nothing

  !> Mark the points whose force and displacement the support looks at: its own; and those whose
  !> velocity it looks at: none.
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
  pure subroutine share_all_forces(self, volume, t, f)
    class(supports_t), intent(in)    :: self
    real(wp),          intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(inout) :: f(:, :)       !! force density, with loads (n,2) [N/m^3]
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%support%share_forces(volume, t, f)
    end do
  end subroutine share_all_forces

  !> Find the forces that the supports apply to the body at time t.
  pure subroutine take_all_reactions(self, volume, t, f)
    class(supports_t), intent(inout) :: self
    real(wp),          intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),          intent(in)    :: t             !! [s]
    real(wp),          intent(in)    :: f(:, :)       !! after `share_forces` (n,2) [N/m^3]
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%support%take_reactions(volume, t, f)
    end do
  end subroutine take_all_reactions

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
