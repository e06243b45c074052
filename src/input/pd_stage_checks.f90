!> Conditions on several keys together: stages, and the search for a factor of safety.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_stage_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: is_cloud
  use pd_input_types, only: input_t
  use pd_input_values, only: group_named
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_stages, only: named, names_of_bodies, names_of_boundaries, names_of_pressures, &
    stage_names, there_at_first
  use pd_text, only: number_text, quoted_list, read_number
  implicit none
  private

  public :: check_stages

contains

  !> All checks of this module.
  subroutine check_stages(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    integer :: k

    do k = 1, size(input%stages)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'stage', k, input%path)
      call check_order(input, k, group, errors)
      associate (stage => input%stages(k))
        call check_names(stage_names(stage%excavate), names_of_bodies(input), 'excavate', &
          'body', group, errors)
        call check_names(stage_names(stage%fill), names_of_bodies(input), 'fill', 'body', group, &
          errors)
        call check_names(stage_names(stage%boundaries), names_of_boundaries(input), &
          'boundaries', 'boundary', group, errors)
        call check_names(stage_names(stage%pressures), names_of_pressures(input), 'pressures', &
          'pressure', group, errors)
        call check_change(input, stage_names(stage%materials), group, errors)
      end associate
    end do
    call check_presence(input, groups, errors)
    call check_run(input, groups, errors)
    if (size(input%strength_reduction) == 1) &
      call check_reduction(input, group_named(groups, 'strength_reduction', 1, input%path), errors)
  end subroutine check_stages

  !> Whether what is dug away is there, and what is filled in is not.
  subroutine check_presence(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    logical :: there(size(input%bodies))
    integer :: k

    there = there_at_first(input)
    do k = 1, size(input%stages)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'stage', k, input%path)
      call check_bodies(input%stages(k)%excavate, 'excavate', .true., 'is not there')
      call check_bodies(input%stages(k)%fill, 'fill', .false., 'is there already')
    end do

  contains

    subroutine check_bodies(text, key, must_be, problem)
      character(*), intent(in) :: text, key, problem
      logical,      intent(in) :: must_be
      integer :: i

      associate (chosen => named(text, names_of_bodies(input)))
        do i = 1, size(there)
          if (chosen(i) .and. (there(i) .neqv. must_be)) call errors%add( &
            'the body '//problem, where=place_of(group, key), &
            found=''''//input%bodies(i)%name//'''', allowed='each body in its turn')
        end do
        where (chosen) there = .not. must_be
      end associate
    end subroutine check_bodies

  end subroutine check_presence

  !> What a run with stages needs.
  subroutine check_run(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: integration
    character(:), allocatable :: problem
    real(wp) :: end_time, given
    integer  :: i

    if (size(input%stages) == 0) return
    if (is_cloud(input)) call errors%add('stages of a point cloud', &
      where=place_of(group_named(groups, 'stage', 1, input%path)), found='shape = ''file''', &
      allowed='only for bodies on a lattice')
    if (input%run%operators == 'list') call errors%add('stages need the operators of a lattice', &
      where='&run operators', found='''list''', allowed='''auto'', ''lattice''')
    if (all(input%integration%method /= ['equilibrium', '           '])) call errors%add( &
      'stages go from equilibrium to equilibrium', &
      where=place_of(group_named(groups, 'stage', 1, input%path)), &
      found='method = '''//input%integration%method//'''', &
      allowed='&integration method = ''equilibrium''')
    integration = group_named(groups, 'integration', 1, input%path)
    end_time = input%stages(size(input%stages))%end_time
    i = integration%find('end_time')
    if (i == 0 .or. .not. is_set(end_time)) return
    call read_number(integration%entries(i)%values(1)%text, given, problem)
    if (problem /= '') return   ! that has been reported
    if (abs(given - end_time) > 0.0_wp) call errors%add( &
      'the end of the run is not that of the last stage', &
      where=place_of(integration, 'end_time'), found=number_text(given), &
      allowed=number_text(end_time)//' [s], or leave it out')
  end subroutine check_run

  !> Name and end of stage k.
  subroutine check_order(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    associate (stage => input%stages(k))
      do j = 1, k - 1
        if (input%stages(j)%name /= stage%name .or. stage%name == '') cycle
        call errors%add('two stages have the same name', where=place_of(group, 'name'), &
                        found=''''//stage%name//'''', allowed='each name once')
        exit
      end do
      if (k == 1 .or. .not. is_set(stage%end_time)) return
      if (.not. is_set(input%stages(k - 1)%end_time)) return
      if (stage%end_time <= input%stages(k - 1)%end_time) call errors%add( &
        'a stage ends before the one before it', where=place_of(group, 'end_time'), &
        found=number_text(stage%end_time), &
        allowed='above '//number_text(input%stages(k - 1)%end_time)//' [s]')
    end associate
  end subroutine check_order

  !> Whether all names are those of groups of the file.
  subroutine check_names(words, names, key, kind, group, errors)
    character(*),           intent(in)    :: words(:), names(:)
    character(*),           intent(in)    :: key, kind
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: i

    do i = 1, size(words)
      if (any(names == words(i))) cycle
      call errors%add('there is no '//kind//' of this name', where=place_of(group, key), &
        found=''''//trim(words(i))//'''', allowed=allowed_names(names, kind))
    end do
  end subroutine check_names

  !> The names that a stage can use.
  pure function allowed_names(names, kind) result(text)
    character(*), intent(in) :: names(:), kind
    character(:), allocatable :: text

    text = 'none: no '//kind//' has a name'
    if (any(names /= '')) text = quoted_list(pack(names, names /= ''))
  end function allowed_names

  !> Pairs of a body and a material.
  subroutine check_change(input, words, group, errors)
    type(input_t),          intent(in)    :: input
    character(*),           intent(in)    :: words(:)
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(len(words)) :: materials(size(input%materials))
    integer :: k

    do k = 1, size(materials)
      materials(k) = input%materials(k)%name
    end do
    if (mod(size(words), 2) == 1) call errors%add('a body without a material', &
      where=place_of(group, 'materials'), found=''''//trim(words(size(words)))//'''', &
      allowed='body=material, separated by blanks')
    call check_names(words(1::2), names_of_bodies(input), 'materials', 'body', group, errors)
    call check_names(words(2::2), materials, 'materials', 'material', group, errors)
  end subroutine check_change

  !> The factors between which a factor of safety is looked for.
  subroutine check_reduction(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: k

    if (all(input%integration%method /= ['equilibrium', '           '])) call errors%add( &
      'a factor of safety is looked for at equilibrium', where=place_of(group), &
      found='method = '''//input%integration%method//'''', &
      allowed='&integration method = ''equilibrium''')
    if (all([(input%materials(k)%model == 'elastic', k=1, size(input%materials))])) &
      call errors%add('no material has a strength to be reduced', where=place_of(group), &
      found='model = ''elastic''', allowed='&material model = ''j2''')
    associate (s => input%strength_reduction(1))
      if (.not. (is_set(s%first) .and. is_set(s%last))) return
      if (s%last <= s%first) call errors%add('the last factor is not above the first', &
        where=place_of(group, 'last'), found=number_text(s%last), &
        allowed='above '//number_text(s%first))
    end associate
  end subroutine check_reduction

end module pd_stage_checks
