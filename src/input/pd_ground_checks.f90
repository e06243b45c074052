!> Conditions on several keys together: gravity, initial stress, probes.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_ground_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: is_cloud
  use pd_input_types, only: input_t
  use pd_input_values, only: count_groups, group_named
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_stages, only: first_stage, stage_t, there_at_first
  use pd_text, only: number_text
  implicit none
  private

  public :: check_ground

  !> Numbers that the user has computed from others may be rounded.
  real(wp), parameter :: rounding = 1.0e-3_wp

contains

  !> All checks of this module.
  subroutine check_ground(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    integer :: k

    if (size(input%gravity%acceleration) == 2) then
      if (.not. any(abs(input%gravity%acceleration) > 0.0_wp)) call errors%add( &
        'gravity without an acceleration', allowed='not 0, 0, or leave the group out', &
        where=place_of(group_named(groups, 'gravity', 1, input%path), 'acceleration'), &
        found='0.0, 0.0')
    end if
    if (count_groups(groups, 'initial_stress') > 0) call check_initial_stress(input, groups, errors)
    do k = 1, size(input%probes)
      if (errors%count() >= max_problems) return
      call check_name(input, k, group_named(groups, 'probe', k, input%path), errors)
    end do
  end subroutine check_ground

  !> Names of columns must not meet: a probe shares them with boundaries, and with mean_stress_xx
  !> and max_plastic_strain.
  subroutine check_name(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(:), allocatable :: problem
    integer :: j

    associate (name => input%probes(k)%name)
      if (name == '') return
      problem = ''
      if (name == 'mean' .or. name == 'max') problem = 'a probe has the name of other columns'
      do j = 1, k - 1
        if (input%probes(j)%name == name) problem = 'two probes have the same name'
      end do
      do j = 1, size(input%boundaries)
        if (input%boundaries(j)%name == name) problem = 'a probe has the name of a boundary'
      end do
      if (problem /= '') call errors%add(problem, where=place_of(group, 'name'), &
        found=''''//name//'''', allowed='each name once, not mean or max')
    end associate
  end subroutine check_name

  !> An initial stress, and what acts on the body from the start: they must be in equilibrium.
  subroutine check_initial_stress(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    real(wp) :: surcharge

    group = group_named(groups, 'initial_stress', 1, input%path)
    associate (s => input%initial_stress)
      if (.not. (is_set(s%unit_weight) .and. is_set(s%surcharge) .and. is_set(s%k0))) return
      if (.not. max(s%unit_weight, s%surcharge) > 0.0_wp) call errors%add( &
        'an initial stress without weight and surcharge', where=place_of(group), found='0', &
        allowed='unit_weight or surcharge above 0, or leave the group out')
    end associate
    if (size(input%gravity%acceleration) == 2) call check_weight(input, groups, errors)
    if (size(input%bodies) == 0) return
    call check_surface(input, group, surcharge, errors)
    call check_loads_at_start(input, groups, surcharge, errors)
  end subroutine check_initial_stress

  !> The surface of the ground, and the vertical pressure of the initial stress on the body.
  subroutine check_surface(input, group, surcharge, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    real(wp),               intent(out)   :: surcharge   !! at the top of the body [Pa]
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: top, slack

    surcharge = input%initial_stress%surcharge
    top = maxval(input%bodies%y_max, mask=there_at_first(input))   ! unset: a cloud, polygons
    associate (surface => input%initial_stress%surface_y)
      if (.not. (is_set(surface) .and. is_set(top) .and. &
                 is_set(input%discretisation%spacing))) return
      slack = merge(1.0_wp, 1.0e-6_wp, input%discretisation%fit == 'nearest') &
        * input%discretisation%spacing
      if (surface < top - slack) call errors%add( &
        'the body reaches above the surface of the ground', where=place_of(group, 'surface_y'), &
        found=number_text(surface), allowed='at least the top of the body, '// &
        number_text(top)//' [m]')
      surcharge = surcharge + input%initial_stress%unit_weight * max(0.0_wp, surface - top)
    end associate
  end subroutine check_surface

  !> Loads that act at t = 0 must be those of the initial stress: the rest would come as a blow, or
  !> be taken for a part of the equilibrium.
  subroutine check_loads_at_start(input, groups, surcharge, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    real(wp),               intent(in)    :: surcharge   !! [Pa]
    type(error_list_t),     intent(inout) :: errors
    type(stage_t) :: first
    integer :: k

    first = first_stage(input)
    do k = 1, size(input%pressures)
      associate (p => input%pressures(k))
        if (p%ramp_time > 0.0_wp .or. .not. is_set(p%value)) cycle
        if (p%side == '' .and. p%body == '' .or. .not. first%has_pressure(k)) cycle
        if (.not. fits(p%side, p%value)) call report('pressure', 'value', number_text(p%value))
      end associate
    end do
    if (is_cloud(input)) return
    do k = 1, size(input%boundaries)
      associate (b => input%boundaries(k))
        if (size(b%traction) /= 2 .or. b%ramp_time > 0.0_wp) cycle
        if (.not. first%has_boundary(k)) cycle
        if (.not. (fits(b%side, -b%traction(2)) .and. abs(b%traction(1)) <= 0.0_wp)) &
          call report('boundary', 'traction', &
          number_text(b%traction(1))//', '//number_text(b%traction(2)))
      end associate
    end do

  contains

    pure logical function fits(side, pressure)
      character(*), intent(in) :: side
      real(wp),     intent(in) :: pressure   !! [Pa]

      fits = side == 'top' .and. abs(pressure - surcharge) <= rounding * surcharge
    end function fits

    subroutine report(name, key, found)
      character(*), intent(in) :: name, key, found

      call errors%add('a load that acts from the start is not that of the initial stress', &
        where=place_of(group_named(groups, name, k, input%path), key), found=found, &
        allowed='a pressure of '//number_text(surcharge)//' [Pa] on the top, others with a &
        &ramp_time')
    end subroutine report

  end subroutine check_loads_at_start

  !> Gravity beside an initial stress.
  subroutine check_weight(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: gravity
    real(wp) :: weight
    integer  :: j, k

    gravity = group_named(groups, 'gravity', 1, input%path)
    if (input%gravity%ramp_time > 0.0_wp) call errors%add( &
      'gravity that rises beside an initial stress that it makes', &
      where=place_of(gravity, 'ramp_time'), found=number_text(input%gravity%ramp_time), &
      allowed='0: the initial stress is in equilibrium with it from the start')
    associate (g => input%gravity%acceleration)
      if (abs(g(1)) > 0.0_wp .or. g(2) > 0.0_wp) then
        call errors%add('an initial stress needs gravity that points downwards', &
          where=place_of(gravity, 'acceleration'), &
          found=number_text(g(1))//', '//number_text(g(2)), allowed='0 and a number below 0')
        return
      end if
      do k = 1, size(input%materials)
        if (.not. is_set(input%materials(k)%density)) cycle
        if (.not. any([(input%bodies(j)%material == input%materials(k)%name, &
          j=1, size(input%bodies))])) cycle
        weight = -g(2) * input%materials(k)%density
        if (abs(weight - input%initial_stress%unit_weight) <= rounding * weight) cycle
        call errors%add('the unit weight is not that of gravity', &
          where=place_of(group_named(groups, 'initial_stress', 1, input%path), 'unit_weight'), &
          found=number_text(input%initial_stress%unit_weight), allowed=number_text(weight)// &
          ' [N/m^3], the density of '''//input%materials(k)%name//''' times the acceleration')
      end do
    end associate
  end subroutine check_weight

end module pd_ground_checks
