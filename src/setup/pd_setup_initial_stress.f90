!> From checked input to a body that is under stress, and in equilibrium, before it moves.
!>
!>   sigma_yy = -(q + gamma (y_0 - y)),   sigma_xx = sigma_zz = K_0 sigma_yy
!>
!> The stress is that of an initial strain E_0 = C^-1 : sigma, which is added to that of the motion.
!> A last load holds what the internal forces and the other loads leave: near a free surface
!> families are cut, and forces there differ from those inside.
!> Source: doc/theory.md, section 7.
module pd_setup_initial_stress
  use pd_body_force, only: new_body_force
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t
  use pd_forces, only: internal_forces
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  use pd_model, only: model_t
  use pd_relaxing, only: whole_family, whole_family_t
  use pd_state, only: block_work_t, state_t
  use pd_tensors, only: deviator, von_mises
  use pd_text, only: number_text, short_number
  use pd_timing, only: timing_t
  implicit none
  private

  public :: set_up_initial_stress

contains

  !> Initial strain, stress and force, and the load that holds them.
  !>
  !> Errors: a stress beyond the yield stress.
  subroutine set_up_initial_stress(input, horizon, model, errors)
    type(input_t),      intent(in)    :: input
    type(horizon_t),    intent(in)    :: horizon
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: stress(:, :), strain(:, :)
    type(state_t) :: state
    integer :: before

    if (.not. is_set(input%initial_stress%k0)) return
    before = errors%count()
    allocate (stress(model%body%n, 4), strain(model%body%n, 4))
    call stress_at_points(input, model, stress)
    call check_strength(model, stress, errors)
    if (errors%count() > before) return
    if (allocated(model%body%place)) call lower_in_layers(horizon, model, stress)
    call elastic_strain(model, stress, strain)
    allocate (model%initial)
    model%initial%strain = model%operators%storage%spread(strain)
    call find_forces(model, state)
    model%initial%stress = state%stress
    model%initial%force = state%force
    call hold(input, state%force, model)
  end subroutine set_up_initial_stress

  !> Stress at the points; layers continue it.
  subroutine stress_at_points(input, model, stress)
    type(input_t), intent(in)  :: input
    type(model_t), intent(in)  :: model
    real(wp),      intent(out) :: stress(:, :)   !! (n,4) xx yy zz xy [Pa]
    real(wp) :: surface

    associate (given => input%initial_stress)
      surface = model%body%upper(2)
      if (is_set(given%surface_y)) surface = given%surface_y
      stress(:, 2) = -(given%surcharge + given%unit_weight &
        * (surface - model%body%position(:, 2)))
      stress(:, 1) = given%k0 * stress(:, 2)
      stress(:, 3) = stress(:, 1)
      stress(:, 4) = 0.0_wp
    end associate
  end subroutine stress_at_points

  !> Report the point of the body that is farthest beyond its yield stress.
  subroutine check_strength(model, stress, errors)
    type(model_t),      intent(in)    :: model
    real(wp),           intent(in)    :: stress(:, :)   !! (n,4) [Pa]
    type(error_list_t), intent(inout) :: errors
    real(wp) :: part, largest
    integer  :: i, worst

    largest = 1.0_wp
    worst = 0
    do i = 1, model%body%n
      if (model%body%boundary(i) > 0 .or. .not. yields(model, i)) cycle
      part = von_mises(stress(i, :)) / strength_of(model, i)
      if (part <= largest) cycle
      largest = part
      worst = i
    end do
    if (worst == 0) return
    associate (x => model%body%position(worst, :))
      call errors%add('the initial stress is beyond the yield stress at ('//number_text(x(1))// &
        ', '//number_text(x(2))//') m', '&initial_stress', 'an equivalent stress of '// &
        short_number(von_mises(stress(worst, :)))//' Pa', 'at most '// &
        short_number(strength_of(model, worst))//' Pa: k0 nearer to 1, or more strength')
    end associate
  end subroutine check_strength

  !> Whether the law of a point flows.
  pure logical function yields(model, point)
    type(model_t), intent(in) :: model
    integer,       intent(in) :: point
    integer :: k

    k = model%materials%material_of(model%operators%storage%row(point))
    yields = model%materials%list(k)%law%plastic_strain > 0
  end function yields

  pure real(wp) function strength_of(model, point) result(strength)
    type(model_t), intent(in) :: model
    integer,       intent(in) :: point

    strength = model%strength(model%operators%storage%row(point))
  end function strength_of

  !> Stress in the layers that hands over the force tensor of whole families, sigma K_i / K, so that
  !> the body does not feel where they end: P K_i^-1 = sigma / K. Symmetric part; where its deviator
  !> is beyond yield it is cut.
  subroutine lower_in_layers(horizon, model, stress)
    type(horizon_t), intent(in)    :: horizon
    type(model_t),   intent(in)    :: model
    real(wp),        intent(inout) :: stress(:, :)   !! (n,4) [Pa]
    type(whole_family_t)  :: whole
    real(wp), allocatable :: shape(:, :)
    real(wp) :: k(3), excess
    integer  :: i

    whole = whole_family(horizon, model%spacing)
    allocate (shape(model%operators%n, 3))
    call model%operators%shape_tensor(shape)
    do i = 1, model%body%n
      if (model%body%boundary(i) == 0) cycle
      k = shape(model%operators%storage%row(i), :) / whole%shape
      stress(i, :) = [stress(i, 1) * k(1), stress(i, 2) * k(2), &
        0.5_wp * stress(i, 3) * (k(1) + k(2)), 0.5_wp * (stress(i, 1) + stress(i, 2)) * k(3)]
      if (.not. yields(model, i)) cycle
      excess = von_mises(stress(i, :)) / strength_of(model, i)
      if (excess > 1.0_wp) stress(i, :) = stress(i, :) &
        - (1.0_wp - 1.0_wp / excess) * deviator(stress(i, :))
    end do
  end subroutine lower_in_layers

  !> E = (sigma - lambda tr(sigma) / (3 lambda + 2 G) I) / 2 G of every point.
  subroutine elastic_strain(model, stress, strain)
    type(model_t), intent(in)  :: model
    real(wp),      intent(in)  :: stress(:, :)   !! (n,4) xx yy zz xy [Pa]
    real(wp),      intent(out) :: strain(:, :)   !! likewise
    real(wp) :: lambda, shear_modulus, factor
    integer  :: i, k, row

    factor = 1.0_wp
    do i = 1, size(stress, 1)
      row = model%operators%storage%row(i)
      k = model%materials%material_of(row)
      call model%materials%list(k)%law%lame_constants(lambda, shear_modulus)
      if (allocated(model%materials%stiffness)) factor = model%materials%stiffness(row)
      strain(i, :) = stress(i, :)
      strain(i, 1:3) = strain(i, 1:3) - lambda / (3.0_wp * lambda + 2.0_wp * shear_modulus) &
        * sum(stress(i, 1:3))
      strain(i, :) = strain(i, :) / (2.0_wp * factor * shear_modulus)
    end do
  end subroutine elastic_strain

  !> Stress and internal forces of the body before it moves, by the kernels of a step: as they have
  !> the same bits there, it stays at rest.
  subroutine find_forces(model, state)
    type(model_t), intent(inout) :: model
    type(state_t), intent(inout) :: state
    type(block_work_t) :: work
    type(timing_t) :: timing
    integer :: failed_row

    state%has_initial_strain = .true.
    call state%allocate(model%operators%n, model%materials%remembered())
    state%strength = model%strength
    state%initial_strain = model%initial%strain
    call internal_forces(model%operators, model%materials, model%points%volume, state, work, &
      timing, failed_row)
  end subroutine find_forces

  !> A load that takes up what is left on points that are free to move.
  subroutine hold(input, force, model)
    type(input_t), intent(in)    :: input
    real(wp),      intent(in)    :: force(:, :)   !! internal (n,2) [N/m^3]
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: left(:, :)
    character(:), allocatable :: text

    allocate (left, source=force)
    call model%loads%add_forces(model%points%volume, 0.0_wp, left)
    call model%supports%share_forces(model%points%volume, 0.0_wp, left)
    left = -model%points%free * left
    text = 'weight'
    if (size(input%gravity%acceleration) > 0) text = 'what weight lacks near free surfaces'
    if (input%initial_stress%surcharge > 0.0_wp .and. &
      .not. any(input%pressures%ramp_time <= 0.0_wp)) text = text//', and the surcharge, for good'
    call model%loads%append(new_body_force('initial stress', left, model%points%volume, 0.0_wp, &
      [0.0_wp, 0.0_wp], text))
  end subroutine hold

end module pd_setup_initial_stress
