!> The state of a run: everything that changes from step to step at the points.
module pd_state
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: state_t, block_work_t

  !> Fields over all n points, fictitious ones included.
  type :: state_t
    real(wp), allocatable :: displacement(:, :)          !! u (n,2) [m]
    real(wp), allocatable :: velocity(:, :)              !! v (n,2) [m/s]
    real(wp), allocatable :: force(:, :)                 !! internal force density f (n,2) [N/m^3]
    real(wp), allocatable :: deformation_gradient(:, :)  !! F (n,4) xx xy yx yy
    real(wp), allocatable :: stress(:, :)                !! S (n,4) xx yy zz xy [Pa]
    real(wp), allocatable :: plastic_strain(:, :)        !! E^p (n,4) xx yy zz xy
    real(wp), allocatable :: back_stress(:, :)           !! beta (n,4) xx yy zz xy [Pa]
    real(wp), allocatable :: alpha(:)                    !! equivalent plastic strain (n)
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

  !> Make room for the blocks of points first to last.
  subroutine fit(self, first, last)
    class(block_work_t), intent(inout) :: self
    integer,             intent(in)    :: first, last
    integer :: n_blocks

    n_blocks = (last - first) / n_block + 1
    if (allocated(self%failed)) then
      if (size(self%failed) == n_blocks) return
      deallocate (self%damping, self%dissipated, self%failed, self%times)
    end if
    allocate (self%damping(4, n_blocks), self%dissipated(n_blocks), self%times(3, n_blocks), &
      source=0.0_wp)
    allocate (self%failed(n_blocks), source=0)
  end subroutine fit

  !> The unloaded state of n points.
  subroutine allocate_state(self, n)
    class(state_t), intent(out) :: self
    integer,        intent(in)  :: n

    allocate (self%displacement(n, 2), self%velocity(n, 2), self%force(n, 2), source=0.0_wp)
    allocate (self%deformation_gradient(n, 4), source=0.0_wp)
    self%deformation_gradient(:, [1, 4]) = 1.0_wp
    allocate (self%stress(n, 4), self%plastic_strain(n, 4), self%back_stress(n, 4), source=0.0_wp)
    allocate (self%alpha(n), source=0.0_wp)
  end subroutine allocate_state

  !> The state of some places only, in their order.
  function gathered(self, places) result(state)
    class(state_t), intent(in) :: self
    integer,        intent(in) :: places(:)
    type(state_t) :: state

    allocate (state%displacement(size(places), 2), source=self%displacement(places, :))
    allocate (state%velocity(size(places), 2), source=self%velocity(places, :))
    allocate (state%force(size(places), 2), source=self%force(places, :))
    allocate (state%deformation_gradient(size(places), 4), &
      source=self%deformation_gradient(places, :))
    allocate (state%stress(size(places), 4), source=self%stress(places, :))
    allocate (state%plastic_strain(size(places), 4), source=self%plastic_strain(places, :))
    allocate (state%back_stress(size(places), 4), source=self%back_stress(places, :))
    allocate (state%alpha(size(places)), source=self%alpha(places))
  end function gathered

  !> The state of n places from that of some of them; the others are unloaded and at rest.
  function scattered(self, places, n) result(state)
    class(state_t), intent(in) :: self
    integer,        intent(in) :: places(:), n
    type(state_t) :: state

    call state%allocate(n)
    state%displacement(places, :) = self%displacement
    state%velocity(places, :) = self%velocity
    state%force(places, :) = self%force
    state%deformation_gradient(places, :) = self%deformation_gradient
    state%stress(places, :) = self%stress
    state%plastic_strain(places, :) = self%plastic_strain
    state%back_stress(places, :) = self%back_stress
    state%alpha(places) = self%alpha
  end function scattered

end module pd_state
