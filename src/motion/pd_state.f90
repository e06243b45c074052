!> The state of a run: everything that changes from step to step at the points.
!>
!> `visit` is the table of its fields: whatever is done with all of them is a visitor.
module pd_state
  use pd_fields, only: allocating_t, counting_t, field_visitor_t, gathering_t, scattering_t, &
    state_field_t
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
    procedure :: visit
    procedure :: allocate => allocate_state
    procedure :: gather
    procedure :: scatter
    procedure :: numbers_per_point
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

  !> Show all fields to a visitor.
  subroutine visit(self, visitor)
    class(state_t),         intent(inout) :: self
    class(field_visitor_t), intent(inout) :: visitor
    character(*), parameter :: tensor = 'xx yy zz xy'

    call visitor%field(state_field_t('displacement', 'm', 'displacement u', 'x y', &
      by_neighbours=.true.), self%displacement)
    call visitor%field(state_field_t('velocity', 'm/s', 'velocity v', 'x y'), self%velocity)
    call visitor%field(state_field_t('force', 'N/m^3', 'force density f, loads and control '// &
      'included', 'x y'), self%force)
    call visitor%field(state_field_t('deformation_gradient', '1', 'deformation gradient F', &
      'xx xy yx yy', rest=[1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp]), self%deformation_gradient)
    call visitor%field(state_field_t('stress', 'Pa', 'second Piola-Kirchhoff stress S', tensor), &
      self%stress)
    call visitor%field(state_field_t('plastic_strain', '1', 'plastic strain E^p', tensor), &
      self%plastic_strain)
    call visitor%field(state_field_t('back_stress', 'Pa', 'back stress beta', tensor), &
      self%back_stress)
    call visitor%field(state_field_t('alpha', '1', 'equivalent plastic strain alpha'), self%alpha)
  end subroutine visit

  !> The unloaded state of n points.
  subroutine allocate_state(self, n)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: n
    type(allocating_t) :: room

    room%n = n
    call self%visit(room)
  end subroutine allocate_state

  !> Reduce the fields that a restart needs to some places, in their order, and give up the others.
  subroutine gather(self, places)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: places(:)
    type(gathering_t) :: choice

    allocate (choice%places, source=places)
    call self%visit(choice)
  end subroutine gather

  !> The state of n places from that of some of them; the others are unloaded and at rest.
  subroutine scatter(self, places, n)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: places(:), n
    type(scattering_t) :: spread_out

    allocate (spread_out%places, source=places)
    spread_out%n = n
    call self%visit(spread_out)
  end subroutine scatter

  !> Numbers per point in all fields.
  integer function numbers_per_point(self) result(numbers)
    class(state_t), intent(inout) :: self   !! visited, not changed
    type(counting_t) :: count

    call self%visit(count)
    numbers = count%numbers
  end function numbers_per_point

end module pd_state
