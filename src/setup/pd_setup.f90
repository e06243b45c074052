!> From checked input and a body to the model: operators, materials, supports, loads.
module pd_setup
  use pd_agreement, only: any_rank
  use pd_balance, only: balance_list, balance_t, look_for_balance
  use pd_balanced_list, only: balanced_list_t
  use pd_bond_list, only: bond_list_t, new_bond_list
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, new_horizon
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_lattice, only: lattice_operators_t, new_lattice_operators
  use pd_model, only: model_t
  use pd_ranks, only: ranks_t
  use pd_setup_gradients, only: check_gradients
  use pd_setup_gravity, only: set_up_gravity
  use pd_setup_initial_stress, only: set_up_initial_stress
  use pd_setup_loads, only: set_up_loads, set_up_platens, set_up_supports
  use pd_setup_materials, only: set_up_materials, set_up_points, set_up_relaxing_control
  use pd_setup_mirror, only: set_up_mirror
  use pd_setup_probes, only: set_up_probes
  use pd_setup_sight, only: look_around
  use pd_shape_tensor, only: invert_shape_tensors
  use pd_sight, only: sight_t
  use pd_stages, only: first_stage, stage_t
  use pd_storage, only: lattice_storage
  implicit none
  private

  public :: set_up_model

contains

  !> Operators, materials, supports, loads, damping.
  !>
  !> Errors: a cut that crosses no bond, points that coincide, families that are too small, no free
  !> point, a pressure that acts on no point, a platen under a traction with points of different
  !> density, a relaxing control of families whose bonds are all equally long, a gradient that
  !> leaves nothing of a material, a probe far from the body, an initial stress beyond the yield
  !> stress.
  !>
  !> `ranks`: each has its own part of a lattice from the start if the points are in runs. Errors
  !> may be those of one rank only.
  subroutine set_up_model(input, model, errors, stage, ranks)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(inout) :: model    !! in: with its body
    type(error_list_t), intent(inout) :: errors
    type(stage_t), optional, intent(in) :: stage  !! absent: the first
    type(ranks_t), optional, intent(in) :: ranks  !! absent: the model is whole
    type(stage_t) :: present_stage
    type(horizon_t) :: horizon
    type(sight_t), allocatable :: sight
    type(ranks_t) :: parts   ! the ranks that have a part each
    integer :: rows          ! of points in a layer

    present_stage = first_stage(input)
    if (present(stage)) present_stage = stage
    model%at_equilibrium = input%integration%method == 'equilibrium'
    model%spacing = input%discretisation%spacing
    model%delta = input%discretisation%horizon
    horizon = new_horizon(model%delta, input%discretisation%influence)
    call look_around(input, horizon, model%body, sight, errors)
    if (errors%count() > 0) return
    rows = ceiling(model%delta / model%spacing - 1.0e-6_wp)
    if (present(ranks)) then
      if (model%body%runs%n > 0) parts = ranks
    end if
    call choose_operators(horizon, input%run%operators, sight, parts, model, errors)
    if (errors%count() > 0) return
    if (allocated(sight)) deallocate (sight)
    model%blocks = model%operators%domain%blocks
    model%shown = model%operators%storage
    if (model%whole%n > 0) model%shown = lattice_storage(horizon, model%spacing, model%whole%place)
    call set_up_points(model)
    call invert_shape_tensors(model%operators, model%points%position, model%points%volume, errors)
    if (any_rank(model%blocks%ranks, errors%count() > 0)) return
    if (.not. model%body%on_lattice()) call balance_cloud(input, model)
    call set_up_materials(input, present_stage, model)
    call check_gradients(input, model, errors)
    if (input%stabilisation%method == 'relaxing') &
      call set_up_relaxing_control(input%stabilisation, horizon, model, errors)
    call set_up_supports(input, present_stage, model, errors)
    call set_up_mirror(input, rows, model)
    call set_up_platens(input, model)
    call set_up_loads(input, present_stage, model, errors)
    call set_up_gravity(input, model)
    call set_up_damping(input, model)
    call set_up_probes(input, model, errors)
    if (.not. any_rank(model%blocks%ranks, any(model%points%free > 0.0_wp))) &
      call errors%add('no point is free to move')
    if (errors%count() == 0 .and. .not. present_stage%start_time > 0.0_wp) &
      call set_up_initial_stress(input, horizon, model, errors)
  end subroutine set_up_model

  !> Lattice operators for a body on a lattice, unless a list is asked for; otherwise the bond list.
  subroutine choose_operators(horizon, form, sight, ranks, model, errors)
    type(horizon_t),    intent(in)    :: horizon
    character(*),       intent(in)    :: form   !! auto, lattice or list
    type(sight_t), allocatable, intent(in) :: sight   !! not allocated: bonds cross air
    type(ranks_t),      intent(in)    :: ranks  !! that have a part each of a lattice
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(lattice_operators_t), allocatable :: lattice
    type(bond_list_t),         allocatable :: list

    if (model%body%on_lattice() .and. form /= 'list') then
      allocate (lattice)
      call new_lattice_operators(horizon, model%spacing, model%body%in_runs(), &
        lattice, sight, model%body%box, ranks)
      call move_alloc(lattice, model%operators)
    else
      allocate (list)
      call new_bond_list(horizon, model%body%position, model%body%volume, list, errors, &
        sight)
      call move_alloc(list, model%operators)
    end if
  end subroutine choose_operators

  !> Weights of a cloud with which a homogeneous stress is in balance, unless plain ones are asked
  !> for, are in balance themselves, or leave less than what could be found.
  subroutine balance_cloud(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model
    type(balanced_list_t), allocatable :: balanced
    type(balance_t) :: balance

    select type (list => model%operators)
    class is (bond_list_t)
      associate (points => model%points)
        call look_for_balance(list, points%volume, model%delta, model%body%boundary == 0, balance)
        model%unbalanced(1) = balance%before
        if (input%discretisation%cloud_weights == 'plain' .or. .not. balance%needed()) return
        allocate (balanced)
        call balance_list(list, points%volume, model%delta, balance, balanced)
        model%unbalanced(2) = balance%after
      end associate
    end select
    if (balance%after < balance%before) call move_alloc(balanced, model%operators)
  end subroutine balance_cloud

  !> Damping, and the frame in which it acts.
  subroutine set_up_damping(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model

    model%damping = input%integration%damping
    if (model%platens%axis == 0) return
    associate (p => model%platens, kept => model%operators%storage%kept)
      model%points%place(kept(1):kept(2)) = min(1.0_wp, max(0.0_wp, &
        (model%points%position(kept(1):kept(2), p%axis) - p%start) / p%length))
    end associate
    model%damped_in_frame = model%at_equilibrium &   ! the first guess moves with the platens
      .or. input%integration%damping_frame == 'platens'
  end subroutine set_up_damping

end module pd_setup
