!> The state of a run: everything that changes from step to step at the points.
module pd_state
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  use pd_law, only: law_points_t
  implicit none
  private

  public :: state_t, block_work_t

  !> Fields over all rows, fictitious points included; stress, history and strength belong to the
  !> laws.
  type, extends(law_points_t) :: state_t
    real(wp), allocatable :: displacement(:, :)            !! u (n,2) [m]
    real(wp), allocatable :: velocity(:, :)                !! v (n,2) [m/s]
    real(wp), allocatable :: force(:, :)                   !! force density f (n,2) [N/m^3]
    real(wp), allocatable :: displacement_gradient(:, :)   !! H = F - I (n,4) xx xy yx yy
  contains
    procedure :: allocate => allocate_state
    procedure :: gathered
    procedure :: scattered
  end type state_t

  !> What the blocks of points hand back in a step. Added up in the order of the blocks, it has the
  !> same bits for any number of threads. Made once: nothing is allocated from step to step.
  type :: block_work_t
    real(wp), allocatable :: damping(:, :)    !! work of the damping, see `pd_verlet` (4,blocks)
    real(wp), allocatable :: dissipated(:)    !! work of S on dE^p (blocks) [J/m]
    integer,  allocatable :: failed(:)        !! first point with det F <= 0, 0: none (blocks)
    real(wp), allocatable :: times(:, :)      !! clock at the ends of kernels (3,blocks) [s]
  contains
    procedure :: fit
  end type block_work_t

contains

  !> Make room for some blocks.
  subroutine fit(self, blocks)
    class(block_work_t), intent(inout) :: self
    type(blocks_t),      intent(in)    :: blocks

    if (allocated(self%failed)) then
      if (size(self%failed) == blocks%count) return
      deallocate (self%damping, self%dissipated, self%failed, self%times)
    end if
    allocate (self%damping(4, blocks%count), self%dissipated(blocks%count), &
      self%times(3, blocks%count), source=0.0_wp)
    allocate (self%failed(blocks%count), source=0)
  end subroutine fit

  !> The unloaded state of n rows, whose points remember `columns` numbers.
  subroutine allocate_state(self, n, columns)
    class(state_t), intent(out) :: self
    integer,        intent(in)  :: n, columns

    allocate (self%displacement(n, 2), self%velocity(n, 2), self%force(n, 2), source=0.0_wp)
    allocate (self%displacement_gradient(n, 4), self%stress(n, 4), source=0.0_wp)
    allocate (self%history(n, columns), self%strength(n), source=0.0_wp)
  end subroutine allocate_state

  !> The state of some rows only, in their order.
  function gathered(self, rows) result(state)
    class(state_t), intent(in) :: self
    integer,        intent(in) :: rows(:)
    type(state_t) :: state
    integer :: n

    n = size(rows)
    allocate (state%displacement(n, 2), source=self%displacement(rows, :))
    allocate (state%velocity(n, 2), source=self%velocity(rows, :))
    allocate (state%force(n, 2), source=self%force(rows, :))
    allocate (state%displacement_gradient(n, 4), source=self%displacement_gradient(rows, :))
    allocate (state%stress(n, 4), source=self%stress(rows, :))
    allocate (state%history(n, size(self%history, 2)), source=self%history(rows, :))
    allocate (state%strength(n), source=self%strength(rows))
  end function gathered

  !> The state of n rows from that of some of them; the others are unloaded and at rest.
  function scattered(self, rows, n) result(state)
    class(state_t), intent(in) :: self
    integer,        intent(in) :: rows(:), n
    type(state_t) :: state

    call state%allocate(n, size(self%history, 2))
    state%displacement(rows, :) = self%displacement
    state%velocity(rows, :) = self%velocity
    state%force(rows, :) = self%force
    state%displacement_gradient(rows, :) = self%displacement_gradient
    state%stress(rows, :) = self%stress
    state%history(rows, :) = self%history
    state%strength(rows) = self%strength
  end function scattered

end module pd_state
