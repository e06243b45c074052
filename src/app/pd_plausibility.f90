!> What can be set up and is hardly meant: doubts that `--check` tells, and a run at its start.
!>
!> Most mistakes of this kind are units (kPa for Pa, mm beside MPa, per cent for a strain), and
!> speeds or steps that are out of proportion to the body.
module pd_plausibility
  use pd_clock, only: clock_t
  use pd_doubt_list, only: doubt_kinds, doubts_t, is_doubtful, kind_number
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, influence, new_horizon
  use pd_input_types, only: boundary_input_t, input_t, material_input_t
  use pd_kinds, only: is_set, pi, wp
  use pd_model, only: model_t
  use pd_schedule, only: schedule_t
  use pd_stability, only: find_highest_frequency
  use pd_stages, only: stage_t
  use pd_text, only: integer_text, short_number
  implicit none
  private

  public :: look_at_model, look_at_motion

contains

  !> Warn of what a model is and is hardly meant to be.
  subroutine look_at_model(input, model, doubts)
    type(input_t),  intent(in)    :: input
    type(model_t),  intent(in)    :: model
    type(doubts_t), intent(inout) :: doubts
    integer :: k, n

    do k = 1, size(model%materials%list)
      if (.not. model%materials%is_used(k)) call doubts%add('unused_material', 0.0_wp, &
        'no point has the material '''//model%materials%list(k)%name// &
        '''; &body material chooses one', input%path)
    end do
    n = model%body%n - size(model%body%points_beside())
    if (is_doubtful('few_points', real(n, wp))) call doubts%add('few_points', real(n, wp), &
      'the body has only '//integer_text(n)//' points: too few to show a field of stress', &
      '&discretisation spacing')
    associate (m => model%delta / model%spacing)
      if (is_doubtful('horizon_ratio', m * (1.0_wp + 1.0e-6_wp))) &
        call doubts%add('horizon_ratio', m, &
        'the horizon is '//short_number(m)//' spacings: below 2 a family sees its nearest '// &
        'neighbours alone, and results depend on the lattice', '&discretisation horizon')
    end associate
    call look_at_scales(input, model, doubts)
    if (is_set(input%initial_stress%k0)) call look_at_ground(input, doubts)
    if (.not. model%body%on_lattice()) call look_at_cloud(input, model, doubts)
    do k = 1, model%loads%count()
      associate (load => model%loads%items(k)%load)
        if (allocated(load%doubt)) call doubts%add('thin_body', load%doubted, load%doubt, &
          '&'//load%kind//' name = '//load%name)
      end associate
    end do
  end subroutine look_at_model

  !> Warn of moduli, densities and strengths that are out of proportion, and of random fields.
  subroutine look_at_scales(input, model, doubts)
    type(input_t),  intent(in)    :: input
    type(model_t),  intent(in)    :: model
    type(doubts_t), intent(inout) :: doubts
    integer :: k

    associate (speed => model%materials%wave_speed())
      if (is_doubtful('wave_speed', speed)) call doubts%add('wave_speed', speed, 'waves run at '// &
        short_number(speed)//' m/s, and in soil and rock at 10 to 10000: are youngs_modulus in '// &
        'Pa (not kPa or MPa), density in kg/m^3 and lengths in m?', '&material')
    end associate
    do k = 1, size(input%materials)
      if (model%materials%is_used(k)) call look_at_material(input%materials(k), doubts)
    end do
    associate (variation => input%random_field%coefficient_of_variation)
      if (.not. is_set(variation)) return
      if (is_doubtful('variation', variation)) &
        call doubts%add('variation', variation, 'the yield '// &
        'stress varies by '//short_number(100.0_wp * variation)//' % of its mean; soils by 10 '// &
        'to 60: a coefficient of variation is no per cent', &
        '&random_field coefficient_of_variation')
    end associate
  end subroutine look_at_scales

  !> Warn of a density that no soil has, of a yield stress that is no part of the stiffness that
  !> soil could have, and of what Green-Lagrange strain makes of perfect plasticity.
  subroutine look_at_material(material, doubts)
    type(material_input_t), intent(in)    :: material
    type(doubts_t),         intent(inout) :: doubts
    real(wp) :: strain, modulus

    associate (density => material%density)
      if (is_doubtful('density', density)) call doubts%add('density', density, 'the density is '// &
        short_number(density)//' kg/m^3, and that of soil and rock 500 to 5000: is it in '// &
        'kg/m^3, not g/cm^3?', '&material name = '//material%name)
    end associate
    if (material%model /= 'j2') return
    strain = material%yield_stress / material%youngs_modulus
    if (is_doubtful('yield_strain', strain)) call doubts%add('yield_strain', strain, &
      'the material yields at a strain of '//short_number(strain)//', and soil at 1e-5 to 0.1: '// &
      'are yield_stress and youngs_modulus both in Pa?', '&material name = '//material%name)
    if (material%strain_measure /= 'green_lagrange') return
    modulus = max(abs(material%kinematic_modulus), abs(material%isotropic_modulus)) &
      / material%yield_stress
    if (is_doubtful('perfect_plasticity', modulus)) call doubts%add('perfect_plasticity', modulus, &
      'nearly perfect plasticity with Green-Lagrange strain: the load falls below the limit '// &
      'load with strain alone, by 3 to 6 % at 0.8 %, and localises; strain_measure = '// &
      '''logarithmic'' stays on it', '&material name = '//material%name)
  end subroutine look_at_material

  !> Warn of ground under horizontal stress that nothing bears but the load that holds it.
  subroutine look_at_ground(input, doubts)
    type(input_t),  intent(in)    :: input
    type(doubts_t), intent(inout) :: doubts
    character(5), parameter :: walls(2) = [character(5) :: 'left', 'right']
    logical :: borne
    integer :: j, k

    if (.not. input%initial_stress%k0 > 0.0_wp) return
    do k = 1, size(walls)
      borne = .false.
      do j = 1, size(input%boundaries)
        borne = borne .or. input%boundaries(j)%side == walls(k) &
          .or. input%boundaries(j)%side == 'all'
      end do
      if (.not. borne) call doubts%add('free_wall', 0.0_wp, 'the '//trim(walls(k))//' side has '// &
        'no boundary: its initial stress is held for good as if the ground went on there', &
        '&initial_stress k0')
    end do
  end subroutine look_at_ground

  !> Warn of a cloud of points whose weights or zero-energy modes make stresses too small, and of
  !> one that does not fill its body.
  subroutine look_at_cloud(input, model, doubts)
    type(input_t),  intent(in)    :: input
    type(model_t),  intent(in)    :: model
    type(doubts_t), intent(inout) :: doubts
    logical :: uneven(2)

    uneven = model%unbalanced > doubt_kinds(kind_number('cloud_weights'))%upper
    if (uneven(2)) then
      call doubts%add('cloud_weights', model%unbalanced(2), 'no weights were found with which '// &
        'a homogeneous stress is in equilibrium inside the cloud: stresses near points of '// &
        'uneven families come out wrong', '&body file')
    else if (uneven(1) .and. model%unbalanced(2) < 0.0_wp) then
      call doubts%add('cloud_weights', model%unbalanced(1), 'with plain weights a homogeneous '// &
        'stress is not in equilibrium inside the cloud: stresses near points of uneven '// &
        'families come out wrong', '&discretisation cloud_weights')
    end if
    call look_at_volumes(input, model, doubts)
    if (input%stabilisation%method /= 'none') return
    if (uneven(1) .and. (model%unbalanced(2) < 0.0_wp .or. uneven(2))) then
      call doubts%add('cloud_control', 0.0_wp, 'points off a lattice without control: a '// &
        'homogeneous stress is not in equilibrium inside them, and stresses come out much too '// &
        'small; balanced weights and a control of zero-energy modes help', '&stabilisation method')
    else
      call doubts%add('cloud_control', 0.0_wp, 'points off a lattice without control: where '// &
        'they flow, zero-energy modes carry a part of the displacement, and loads come out '// &
        'some per cent too small; a control helps', '&stabilisation method')
    end if
  end subroutine look_at_cloud

  !> Warn of volumes that do not fill the families, and of extents that are not those of the points.
  subroutine look_at_volumes(input, model, doubts)
    type(input_t),  intent(in)    :: input
    type(model_t),  intent(in)    :: model
    type(doubts_t), intent(inout) :: doubts
    real(wp) :: fullest, gap
    integer  :: c

    fullest = maxval(model%operators%weight_sum) &
      / weight_of_disc(new_horizon(model%delta, input%discretisation%influence))
    if (is_doubtful('cloud_volume', fullest)) &
      call doubts%add('cloud_volume', fullest, 'the volumes '// &
      'of the points do not fill the body: the fullest family has '//short_number(fullest)// &
      ' of the disc within the horizon; are they areas in m^2, what each point stands for?', &
      '&body file')
    gap = 0.0_wp
    do c = 1, 2
      associate (x => model%body%position(:, c), own => model%body%boundary == 0)
        gap = max(gap, abs(minval(x, mask=own) - model%body%lower(c)), &
          abs(maxval(x, mask=own) - model%body%upper(c)))
      end associate
    end do
    gap = gap / model%spacing
    if (is_doubtful('cloud_extents', gap)) &
      call doubts%add('cloud_extents', gap, 'the extents are not '// &
      'those of the points: '//short_number(gap)//' spacings apart; strains and widths refer '// &
      'to the extents', '&body x_min, x_max, y_min, y_max')
  end subroutine look_at_volumes

  !> Integral of the influence function over the disc within the horizon [m^2].
  pure real(wp) function weight_of_disc(horizon) result(weight)
    type(horizon_t), intent(in) :: horizon
    integer, parameter :: rings = 200
    real(wp) :: r
    integer  :: k

    weight = 0.0_wp
    do k = 1, rings
      r = horizon%delta * (real(k, wp) - 0.5_wp) / real(rings, wp)
      weight = weight + 2.0_wp * pi * r * influence(horizon, r**2) * horizon%delta / real(rings, wp)
    end do
  end function weight_of_disc

  !> Warn of an end, of steps and of velocities that are out of proportion, and of a time step
  !> that is not stable.
  !>
  !> Errors: a boundary that passes the whole body in one step; a damping without end.
  subroutine look_at_motion(input, stages, clock, schedule, model, doubts, errors)
    type(input_t),    intent(in)    :: input
    type(stage_t),    intent(in)    :: stages(:)
    type(clock_t),    intent(in)    :: clock
    type(schedule_t), intent(in)    :: schedule
    type(model_t),    intent(inout) :: model    !! its highest frequency is found where needed
    type(doubts_t),   intent(inout) :: doubts
    type(error_list_t), intent(inout) :: errors

    associate (strain => input%integration%final_strain)
      if (is_set(strain)) then
        if (is_doubtful('final_strain', strain)) &
          call doubts%add('final_strain', strain, 'the body '// &
          'is shortened by '//short_number(100.0_wp * strain)//' %: a strain is no per cent', &
          '&integration final_strain')
      end if
    end associate
    call look_at_ramps(input, stages, schedule%end_time, doubts)
    if (model%at_equilibrium) return
    if (is_doubtful('few_steps', real(schedule%steps, wp))) call doubts%add('few_steps', &
      real(schedule%steps, wp), 'the whole run has only '//integer_text(schedule%steps)// &
      ' steps: waves have hardly passed the body, and the end is passed by up to a step; '// &
      'slower motion, or method = ''equilibrium''', '&integration')
    call look_at_speed(input, clock%time_step, model, doubts, errors)
    call look_at_damping(input, clock%time_step, errors)
    if (errors%count() > 0) return
    call look_at_stability(input, clock%time_step, model, doubts)
  end subroutine look_at_motion

  !> Warn of a ramp or table of which the run does not see the end.
  subroutine look_at_ramps(input, stages, end_time, doubts)
    type(input_t),  intent(in)    :: input
    type(stage_t),  intent(in)    :: stages(:)
    real(wp),       intent(in)    :: end_time   !! [s]
    type(doubts_t), intent(inout) :: doubts
    integer :: k, s

    do k = 1, size(input%boundaries)
      associate (b => input%boundaries(k))
        if (size(b%times) > 0) call look(b%times(size(b%times)), 'the table of the motion', &
          '&boundary name = '//b%name)
        if (size(b%traction) > 0) call look(b%ramp_time + maxval([(stages(s)%boundary_since(k), &
          s=1, size(stages))]), 'the ramp of the traction', '&boundary name = '//b%name)
      end associate
    end do
    do k = 1, size(input%pressures)
      associate (p => input%pressures(k))
        call look(p%ramp_time + maxval([(stages(s)%pressure_since(k), s=1, size(stages))]), &
          'the ramp of the pressure', '&pressure name = '//p%name)
      end associate
    end do
    if (size(input%gravity%acceleration) > 0) &
      call look(input%gravity%ramp_time, 'the ramp of gravity', '&gravity')

  contains

    subroutine look(time, what, where)
      real(wp),     intent(in) :: time   !! at which it ends [s]
      character(*), intent(in) :: what, where
      real(wp), parameter :: round_off = 1.0e-9_wp

      if (.not. is_doubtful('unfinished_ramp', time / end_time * (1.0_wp - round_off))) return
      call doubts%add('unfinished_ramp', time / end_time, what//' goes on until '// &
        short_number(time)//' s, and the run ends at '//short_number(end_time)//' s', where)
    end subroutine look

  end subroutine look_at_ramps

  !> Refuse a damping beside whose forces no digit of the others is left: the run would fail by
  !> round-off alone.
  subroutine look_at_damping(input, time_step, errors)
    type(input_t),      intent(in)    :: input
    real(wp),           intent(in)    :: time_step   !! [s]
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: most = 1.0e12_wp
    real(wp) :: rate

    rate = input%integration%damping / minval(input%materials%density)
    if (rate * time_step < most) return
    call errors%add('the damping stops every motion within one step of '// &
      short_number(time_step)//' s', '&integration damping', short_number(rate * time_step)// &
      ' = damping * time step / density', 'below 1e12')
  end subroutine look_at_damping

  !> Warn of a boundary that moves so fast that the body cannot follow; refuse one that passes all
  !> of it in a step, which nothing can survive.
  subroutine look_at_speed(input, time_step, model, doubts, errors)
    type(input_t),  intent(in)    :: input
    real(wp),       intent(in)    :: time_step   !! [s]
    type(model_t),  intent(in)    :: model
    type(doubts_t), intent(inout) :: doubts
    type(error_list_t), intent(inout) :: errors
    real(wp) :: extent, way
    integer  :: k

    extent = minval(model%body%upper - model%body%lower)
    do k = 1, size(input%boundaries)
      way = time_step / extent * fastest(input%boundaries(k), &
        maxval(model%body%upper - model%body%lower))
      if (way >= 1.0_wp) then
        call errors%add('the boundary passes the whole body in one step of '// &
          short_number(time_step)//' s', '&boundary name = '//input%boundaries(k)%name, &
          allowed='a velocity [m/s], density and stiffness that fit together')
      else if (is_doubtful('fast_boundary', way)) then
        call doubts%add('fast_boundary', way, 'it moves by '//short_number(100.0_wp * way)// &
          ' % of the body in every step: it passes the body before stresses can spread; '// &
          'velocities are in m/s', '&boundary name = '//input%boundaries(k)%name)
      end if
    end do
  end subroutine look_at_speed

  !> Largest velocity that a boundary prescribes [m/s].
  pure real(wp) function fastest(boundary, extent)
    type(boundary_input_t), intent(in) :: boundary
    real(wp),               intent(in) :: extent   !! of the body, for an affine motion [m]

    if (boundary%contact == 'affine') then
      fastest = maxval(abs(boundary%velocity_gradient)) * extent
      if (size(boundary%factors) > 0) fastest = fastest * maxval(abs(boundary%factors))
    else if (size(boundary%times) > 0) then
      fastest = max(0.0_wp, maxval(abs(boundary%velocities_x)), maxval(abs(boundary%velocities_y)))
    else
      fastest = maxval(abs(boundary%velocity))
    end if
  end function fastest

  !> Warn of a time step beyond the stable one, which the rules fixed and courant do not know.
  subroutine look_at_stability(input, time_step, model, doubts)
    type(input_t),  intent(in)    :: input
    real(wp),       intent(in)    :: time_step   !! [s]
    type(model_t),  intent(inout) :: model
    type(doubts_t), intent(inout) :: doubts
    real(wp) :: part

    if (input%integration%time_step_rule == 'spectral') return
    call find_highest_frequency(model)
    part = 0.5_wp * time_step * model%highest_frequency
    if (is_doubtful('unstable_step', part)) &
      call doubts%add('unstable_step', part, 'the time step is '// &
      short_number(part)//' times the stable one, '//short_number(time_step / part)// &
      ' s: the run will not last', '&integration')
  end subroutine look_at_stability

end module pd_plausibility
