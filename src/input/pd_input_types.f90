!> The values of an input file, as checked: what `pd_input` fills and `pd_setup` translates.
!>
!> Every component carries the name of its key. Numbers without a default hold `unset` until the
!> file gives them; `doc/input.md` says what each means.
module pd_input_types
  use pd_body_keys, only: body_input_t, cut_input_t, discretisation_input_t
  use pd_ground_keys, only: gravity_input_t, initial_stress_input_t, probe_input_t
  use pd_key_list, only: key_list_t
  use pd_keys, only: key_visitor_t
  use pd_load_keys, only: boundary_input_t, pressure_input_t
  use pd_material_keys, only: imperfection_input_t, material_input_t, random_field_input_t
  use pd_motion_keys, only: integration_input_t, stabilisation_input_t
  use pd_run_keys, only: output_input_t, run_input_t
  use pd_stage_keys, only: stage_input_t, strength_reduction_input_t
  implicit none
  private

  public :: input_t, all_keys
  public :: run_input_t, discretisation_input_t, body_input_t, material_input_t
  public :: boundary_input_t, stabilisation_input_t, integration_input_t, imperfection_input_t
  public :: random_field_input_t, output_input_t, pressure_input_t, cut_input_t
  public :: gravity_input_t, initial_stress_input_t, probe_input_t
  public :: stage_input_t, strength_reduction_input_t

  type :: input_t
    character(:), allocatable    :: path               !! of the input file
    character(:), allocatable    :: text               !! the input file, byte for byte
    type(run_input_t)            :: run
    type(discretisation_input_t) :: discretisation
    type(body_input_t),     allocatable :: bodies(:)
    type(cut_input_t),      allocatable :: cuts(:)
    type(material_input_t), allocatable :: materials(:)
    type(boundary_input_t), allocatable :: boundaries(:)
    type(pressure_input_t), allocatable :: pressures(:)
    type(gravity_input_t)        :: gravity
    type(initial_stress_input_t) :: initial_stress
    type(stage_input_t),    allocatable :: stages(:)
    type(strength_reduction_input_t), allocatable :: strength_reduction(:)   !! one or none
    type(stabilisation_input_t)  :: stabilisation
    type(integration_input_t)    :: integration
    type(imperfection_input_t)   :: imperfection
    type(random_field_input_t)   :: random_field
    type(probe_input_t), allocatable :: probes(:)
    type(output_input_t)         :: output
    !> Index into `boundaries` of the platens: two boundaries that cover opposite sides whole, with
    !> none on the other two sides; 0, 0 where there are none. The first is 'bottom' or 'left'.
    integer :: platens(2) = 0
  contains
    procedure :: visit => visit_input
  end type input_t

contains

  !> All groups, in the order of the reference.
  subroutine visit_input(self, visitor)
    class(input_t),       intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    integer :: k

    call self%run%visit(visitor)
    call self%discretisation%visit(visitor)
    do k = 1, size(self%bodies)
      call self%bodies(k)%visit(visitor)
    end do
    do k = 1, size(self%cuts)
      call self%cuts(k)%visit(visitor)
    end do
    do k = 1, size(self%materials)
      call self%materials(k)%visit(visitor)
    end do
    do k = 1, size(self%boundaries)
      call self%boundaries(k)%visit(visitor)
    end do
    do k = 1, size(self%pressures)
      call self%pressures(k)%visit(visitor)
    end do
    call self%gravity%visit(visitor)
    call self%initial_stress%visit(visitor)
    do k = 1, size(self%stages)
      call self%stages(k)%visit(visitor)
    end do
    do k = 1, size(self%strength_reduction)
      call self%strength_reduction(k)%visit(visitor)
    end do
    call self%stabilisation%visit(visitor)
    call self%integration%visit(visitor)
    call self%imperfection%visit(visitor)
    call self%random_field%visit(visitor)
    do k = 1, size(self%probes)
      call self%probes(k)%visit(visitor)
    end do
    call self%output%visit(visitor)
  end subroutine visit_input

  !> Every group and key that an input file may hold.
  function all_keys() result(list)
    type(key_list_t) :: list
    type(input_t)    :: one_of_each

    allocate (one_of_each%bodies(1), one_of_each%materials(1), one_of_each%boundaries(1), &
              one_of_each%pressures(1), one_of_each%cuts(1), one_of_each%probes(1), &
              one_of_each%stages(1), one_of_each%strength_reduction(1))
    call one_of_each%visit(list)
  end function all_keys


end module pd_input_types
