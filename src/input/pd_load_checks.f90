!> Conditions on several keys together: pressures, and platens that move under a load.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_load_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: add_missing, add_useless, is_cloud
  use pd_input_shapes, only: find_extents, reaches_side
  use pd_input_types, only: boundary_input_t, input_t
  use pd_input_values, only: group_named, is_given
  use pd_kinds, only: is_set, wp
  use pd_motion_checks, only: check_increasing
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_platen_checks, only: all_moved_later, platen_under_load
  use pd_sides, only: normal_axis
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: check_loads

contains

  !> All checks of this module.
  subroutine check_loads(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    integer :: k

    do k = 1, size(input%boundaries)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'boundary', k, input%path)
      if (is_given(group, 'traction')) then
        call check_traction(input, input%boundaries(k), group, errors)
      else
        call add_useless(group, 'ramp_time', 'without traction', errors)
        call add_useless(group, 'traction_until', 'without traction', errors)
      end if
      call check_part(input, input%boundaries(k), group, errors)
    end do
    if (platen_under_load(input)) call check_strains(input, groups, errors)
    do k = 1, size(input%pressures)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'pressure', k, input%path)
      call check_name(input, k, group, errors)
      call check_side(input, k, group, errors)
      call check_span(input, input%pressures(k)%side, input%pressures(k)%span, group, errors)
    end do
  end subroutine check_loads

  !> A boundary that moves under a load.
  subroutine check_traction(input, b, group, errors)
    type(input_t),          intent(in)    :: input
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: motions(4) = [character(12) :: 'velocity', 'times', &
                                             'velocities_x', 'velocities_y']
    integer :: along, i

    if (is_cloud(input)) call errors%add('a traction on a boundary of a point cloud', &
      where=place_of(group, 'traction'), found='shape = ''file''', allowed='only on a lattice')
    if (b%contact == 'affine') call errors%add('an affine boundary under a traction', &
      where=place_of(group, 'contact'), found='''affine''', allowed='''rough'', ''smooth''')
    if (b%side == 'all') call errors%add('a traction on all sides', &
      where=place_of(group, 'side'), found='''all''', &
      allowed='''bottom'', ''top'', ''left'', ''right''')
    do i = 1, size(motions)
      if (is_given(group, 'traction_until')) exit
      if (.not. is_given(group, trim(motions(i)))) cycle
      call errors%add('a motion beside a traction', where=place_of(group, trim(motions(i))), &
        found='both', allowed='a motion or a traction, or traction_until, the time between them')
      exit
    end do
    call check_until(input, b, group, errors)
    if (b%contact /= 'smooth' .or. size(b%traction) == 0) return
    along = merge(2, 1, b%axis == 1)
    if (abs(b%traction(along)) > 0.0_wp) call errors%add( &
      'a smooth boundary carries no traction along its side', &
      where=place_of(group, 'traction'), found=number_text(b%traction(along)), &
      allowed='0 as component '//integer_text(along)//', or contact = ''rough''')
  end subroutine check_traction

  !> The time at which a traction gives way to motion.
  subroutine check_until(input, b, group, errors)
    type(input_t),          intent(in)    :: input
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (.not. is_set(b%traction_until)) return
    if (b%ramp_time > b%traction_until) call errors%add( &
      'the traction ends before it is whole', where=place_of(group, 'traction_until'), &
      found=number_text(b%traction_until), allowed='at least the ramp_time, '// &
      number_text(b%ramp_time)//' [s]')
    if (.not. is_set(input%integration%end_time)) return
    if (b%traction_until >= input%integration%end_time) call errors%add( &
      'the motion after the traction begins when the run is over', &
      where=place_of(group, 'traction_until'), found=number_text(b%traction_until), &
      allowed='< '//number_text(input%integration%end_time)//' [s]')
  end subroutine check_until

  !> Keys that need the motion of the platens before the run.
  subroutine check_strains(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: unknown = 'a platen moves under a traction: when it reaches a ' &
      //'strain is not known beforehand'
    type(namelist_group_t) :: integration, output

    integration = group_named(groups, 'integration', 1, input%path)
    output = group_named(groups, 'output', 1, input%path)
    if (is_given(integration, 'final_strain')) call errors%add(unknown, &
      where=place_of(integration, 'final_strain'), allowed='end_time in its place')
    if (is_given(output, 'frame_strains')) call errors%add(unknown, &
      where=place_of(output, 'frame_strains'), allowed='frame_times or frame_count in its place')
    if (input%integration%damping_frame == 'platens' .and. .not. all_moved_later(input)) &
      call errors%add('a platen moves under a traction: its own motion would not be damped', &
      where=place_of(integration, 'damping_frame'), found='''platens''', &
      allowed='''rest'', or traction_until')
  end subroutine check_strains

  subroutine check_name(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    if (input%pressures(k)%name == '') return
    do j = 1, k - 1
      if (input%pressures(j)%name /= input%pressures(k)%name) cycle
      call errors%add('two pressures have the same name', where=place_of(group, 'name'), &
                      found=''''//input%pressures(k)%name//'''', allowed='each name once')
      return
    end do
  end subroutine check_name

  subroutine check_side(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    if (is_cloud(input)) then
      call errors%add('a pressure on a point cloud', where=place_of(group, 'side'), &
                      found='shape = ''file''', allowed='only on a lattice')
      return
    end if
    if (.not. (is_given(group, 'side') .or. is_given(group, 'body'))) &
      call add_missing(group, 'side', 'or body', errors)
    if (input%pressures(k)%side == '') return
    do j = 1, size(input%boundaries)
      associate (b => input%boundaries(j))
        if (b%side /= input%pressures(k)%side .and. b%side /= 'all' &
            .and. .not. reaches_side(input, b, input%pressures(k)%side)) cycle
        call errors%add('a pressure on a side with a boundary', where=place_of(group, 'side'), &
          found=''''//input%pressures(k)%side//''', where '''//b%name//''' lies', &
          allowed='a side without a boundary')
        return
      end associate
    end do
  end subroutine check_side

  !> A span within its side. Extents that will be adjusted may differ by a spacing.
  subroutine check_span(input, side, span, group, errors)
    type(input_t),          intent(in)    :: input
    character(*),           intent(in)    :: side
    real(wp),               intent(in)    :: span(:)   !! from, to [m]; size 0: none
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: high(2), low(2), lower, upper, slack
    logical  :: known

    if (size(span) == 0) return
    call check_increasing(span, 'span', group, errors)
    if (span(2) <= span(1) .or. normal_axis(side) == 0 .or. is_cloud(input)) return
    if (size(input%bodies) == 0 .or. .not. is_set(input%discretisation%spacing)) return
    call find_extents(input%bodies, input%discretisation%spacing, low, high, known)
    if (.not. known) return
    lower = low(3 - normal_axis(side))
    upper = high(3 - normal_axis(side))
    slack = merge(1.0_wp, 1.0e-6_wp, input%discretisation%fit == 'nearest') &
      * input%discretisation%spacing
    if (span(1) < lower - slack .or. span(2) > upper + slack) call errors%add( &
      'the span goes beyond the side', where=place_of(group, 'span'), &
      found=number_text(span(1))//', '//number_text(span(2)), &
      allowed='within '//number_text(lower)//' to '//number_text(upper)//' [m]')
  end subroutine check_span

  !> What a boundary on a part of a side cannot be.
  subroutine check_part(input, b, group, errors)
    type(input_t),          intent(in)    :: input
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (.not. is_given(group, 'span')) return
    if (is_cloud(input)) call errors%add('a span on a point cloud', &
      where=place_of(group, 'span'), found='shape = ''file''', allowed='only on a lattice')
    if (b%side == 'all') call errors%add('a span on all sides', &
      where=place_of(group, 'side'), found='''all''', &
      allowed='''bottom'', ''top'', ''left'', ''right''')
    if (is_given(group, 'traction')) call errors%add('a traction on a part of a side', &
      where=place_of(group, 'span'), found='both', allowed='a span or a traction')
    call check_span(input, b%side, b%span, group, errors)
  end subroutine check_part

end module pd_load_checks
