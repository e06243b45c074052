!> Conditions on several keys together: materials, weak patch, random field.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_material_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: add_missing, add_useless
  use pd_input_types, only: input_t, material_input_t
  use pd_input_values, only: count_groups, did_you_mean, group_named, is_given
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_text, only: number_text, quoted_list
  implicit none
  private

  public :: check_materials

  integer, parameter :: name_length = 48   !! of a name; check_groups checks it

contains

  !> All checks of this module.
  subroutine check_materials(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    integer :: k

    do k = 1, size(input%materials)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'material', k, input%path)
      call check_name(input%materials, k, group, errors)
      call check_material(input%materials(k), group, errors)
    end do
    do k = 1, size(input%bodies)
      call check_choice(input, k, group_named(groups, 'body', k, input%path), errors)
    end do
    call check_imperfection(input, group_named(groups, 'imperfection', 1, input%path), errors)
    if (count_groups(groups, 'random_field') > 0) &
      call check_random_field(input, group_named(groups, 'random_field', 1, input%path), errors)
  end subroutine check_materials

  !> Several materials are told apart by their names.
  subroutine check_name(materials, k, group, errors)
    type(material_input_t), intent(in)    :: materials(:)
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    if (size(materials) == 1 .or. materials(k)%name == '') return
    if (.not. is_given(group, 'name')) then
      call add_missing(group, 'name', 'where there are several materials', errors)
      return
    end if
    do j = 1, k - 1
      if (materials(j)%name /= materials(k)%name) cycle
      call errors%add('two materials have the same name', where=place_of(group, 'name'), &
                      found=''''//materials(k)%name//'''', allowed='each name once')
      return
    end do
  end subroutine check_name

  !> The material that body k asks for.
  subroutine check_choice(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(name_length) :: names(size(input%materials))
    integer :: j

    do j = 1, size(names)
      names(j) = input%materials(j)%name
    end do
    if (size(names) == 0 .or. any(names == '')) return   ! that has been reported
    associate (name => input%bodies(k)%material)
      if (name == '' .or. any(names == name)) return
      call errors%add('unknown material'//did_you_mean(name, names), &
                      where=place_of(group, 'material'), found=''''//name//'''', &
                      allowed=quoted_list(names))
    end associate
  end subroutine check_choice

  subroutine check_material(m, group, errors)
    type(material_input_t), intent(in)    :: m
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: h_i, h_k, three_g

    if (.not. (abs(m%youngs_modulus_gradient) > 0.0_wp .or. &
               abs(m%yield_stress_gradient) > 0.0_wp)) &
      call add_useless(group, 'reference_y', 'without a gradient', errors)
    ! With 'elastic' plasticity keys are allowed, so that one word switches the model.
    if (m%model /= 'j2') return
    if (.not. is_given(group, 'yield_stress')) &
      call add_missing(group, 'yield_stress', 'for model = ''j2''', errors)
    if (is_set(m%residual_strength) .and. is_set(m%yield_stress)) then
      if (m%residual_strength > m%yield_stress) call errors%add( &
        'the residual strength is above the yield stress', &
        where=place_of(group, 'residual_strength'), found=number_text(m%residual_strength), &
        allowed='0 to yield_stress = '//number_text(m%yield_stress)//' [Pa]')
    end if
    h_k = m%kinematic_modulus
    h_i = m%isotropic_modulus
    if (.not. (is_set(h_k) .and. is_set(h_i))) return
    if (min(h_k, h_i) < 0.0_wp .and. .not. is_given(group, 'residual_strength')) &
      call add_missing(group, 'residual_strength', 'where a modulus is negative', errors)
    if (.not. (is_set(m%youngs_modulus) .and. is_set(m%poissons_ratio))) return
    three_g = 1.5_wp*m%youngs_modulus/(1.0_wp + m%poissons_ratio)
    if (three_g + h_k + h_i <= 0.0_wp) then
      call errors%add('the material softens more steeply than it can unload', &
        where=place_of(group, steeper_key(h_k, h_i)), found='H_k + H_i = ' &
        //number_text(h_k + h_i), allowed='above -3 G = '//number_text(-three_g)//' [Pa]')
    else if (max(h_k, h_i) < 0.0_wp .and. three_g + h_i + min(h_k, h_i) <= 0.0_wp) then
      call errors%add('the material softens more steeply than it can unload', &
        where=place_of(group, steeper_key(h_k, h_i)), found='H_i + min(H_k, H_i) = ' &
        //number_text(h_i + min(h_k, h_i)), &
        allowed='above -3 G = '//number_text(-three_g)//' [Pa]')
    end if
  end subroutine check_material

  pure function steeper_key(h_k, h_i) result(key)
    real(wp), intent(in) :: h_k, h_i
    character(:), allocatable :: key

    key = 'kinematic_modulus'
    if (h_i < h_k) key = 'isotropic_modulus'
  end function steeper_key

  subroutine check_imperfection(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: k

    associate (p => input%imperfection)
      if (.not. is_set(p%amplitude)) return
      if (p%amplitude <= 0.0_wp) return
      if (.not. is_given(group, 'x')) call add_missing(group, 'x', 'for a weak patch', errors)
      if (.not. is_given(group, 'y')) call add_missing(group, 'y', 'for a weak patch', errors)
      if (.not. is_given(group, 'radius')) then
        call add_missing(group, 'radius', 'for a weak patch', errors)
      else if (is_set(p%radius) .and. p%radius <= 0.0_wp) then
        call errors%add('the weak patch has no extent', where=place_of(group, 'radius'), &
                        found=number_text(p%radius), allowed='> 0 where amplitude is above 0 [m]')
      end if
      do k = 1, size(input%materials)
        call check_weakest(p%amplitude, input%materials(k), group, errors)
      end do
    end associate
  end subroutine check_imperfection

  !> What the weak patch leaves of one material.
  subroutine check_weakest(amplitude, m, group, errors)
    real(wp),               intent(in)    :: amplitude
    type(material_input_t), intent(in)    :: m
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(:), allocatable :: of_which
    real(wp) :: weakest

    if (m%model /= 'j2') return
    if (.not. (is_set(m%yield_stress) .and. is_set(m%residual_strength))) return
    of_which = ''
    if (m%name /= 'material') of_which = ' of '''//m%name//''''
    weakest = (1.0_wp - amplitude)*m%yield_stress
    if (m%residual_strength <= m%yield_stress .and. weakest < m%residual_strength) &
      call errors%add('the weak patch is weaker than residual_strength'//of_which, &
        where=place_of(group, 'amplitude'), found=number_text(amplitude), &
        allowed='(1 - amplitude) yield_stress at least '//number_text(m%residual_strength) &
        //' [Pa]')
  end subroutine check_weakest

  !> A run that asks for soil that varies must not go on without it: not even with 'elastic'.
  subroutine check_random_field(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: k

    if (size(input%materials) == 0) return
    do k = 1, size(input%materials)
      if (input%materials(k)%model /= 'elastic') return
    end do
    call errors%add('a random field of the yield stress for a material that does not yield', &
      where=place_of(group), found='model = ''elastic''', &
      allowed='model = ''j2'', or leave the group out')
  end subroutine check_random_field

end module pd_material_checks
