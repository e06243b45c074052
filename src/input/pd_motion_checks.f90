!> Conditions on several keys together: boundaries, platens, end of the run, frames.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_motion_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: add_missing, add_useless, is_cloud
  use pd_input_types, only: boundary_input_t, input_t
  use pd_input_values, only: any_damaged, group_named, is_damaged, is_given
  use pd_kinds, only: is_set, unset, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_platen_checks, only: platen_approach, platen_extent, platen_under_load
  use pd_tables, only: table_t
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: check_motion, check_increasing

  character(*), parameter :: needs_platens = 'two boundaries alone, on opposite sides, not affine'

contains

  !> All checks of this module.
  subroutine check_motion(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    integer :: k

    do k = 1, size(input%boundaries)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'boundary', k, input%path)
      call check_name(input%boundaries, k, group, errors)
      if (.not. any_damaged(groups, 'boundary')) call check_side(input, k, group, errors)
      call check_movement(input%boundaries(k), group, errors)
    end do
    call check_integration(input, group_named(groups, 'integration', 1, input%path), errors)
    call check_platens(input, groups, errors)
    call check_frames(input, groups, errors)
  end subroutine check_motion

  subroutine check_name(boundaries, k, group, errors)
    type(boundary_input_t), intent(in)    :: boundaries(:)
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    if (boundaries(k)%name == '') return
    do j = 1, k - 1
      if (boundaries(j)%name /= boundaries(k)%name) cycle
      call errors%add('two boundaries have the same name', where=place_of(group, 'name'), &
                      found=''''//boundaries(k)%name//'''', allowed='each name once')
      return
    end do
  end subroutine check_name

  !> The side of boundary k. On a cloud several boundaries may stand for one side.
  subroutine check_side(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    associate (b => input%boundaries(k))
      if (is_cloud(input)) then
        if (b%side == 'all') call errors%add('a cloud has no layers all round', &
          where=place_of(group, 'side'), found='''all''', &
          allowed='''bottom'', ''top'', ''left'', ''right'', or leave it out')
        return
      end if
      if (.not. (is_given(group, 'side') .or. is_given(group, 'body'))) &
        call add_missing(group, 'side', 'for bodies on a lattice, or body', errors)
      if (b%side == '') return
      do j = 1, k - 1
        if (apart(input%boundaries(j)%span, b%span)) cycle
        if (input%boundaries(j)%side == b%side) then
          call errors%add('two boundaries lie on the same side', where=place_of(group, 'side'), &
            found=''''//b%side//'''', allowed='each side once, or spans that do not overlap')
          return
        else if (input%boundaries(j)%side /= '' &
                 .and. (b%side == 'all' .or. input%boundaries(j)%side == 'all')) then
          call errors%add('side = ''all'' beside another boundary', &
                          where=place_of(group, 'side'), found=''''//b%side//'''', &
                          allowed='''all'' alone, or single sides')
          return
        end if
      end do
    end associate
  end subroutine check_side

  !> Whether two boundaries stand on parts of a side that do not overlap.
  pure logical function apart(one, other)
    real(wp), intent(in) :: one(:), other(:)   !! from, to [m]; size 0: the whole side

    apart = .false.
    if (size(one) == 2 .and. size(other) == 2) apart = one(2) <= other(1) .or. other(2) <= one(1)
  end function apart

  !> How one boundary moves.
  subroutine check_movement(b, group, errors)
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: tables(3) = [character(12) :: 'velocities_x', 'velocities_y', &
                                            'factors']
    integer :: i

    call check_increasing(b%times, 'times', group, errors)
    call check_length(b%velocities_x, trim(tables(1)))
    call check_length(b%velocities_y, trim(tables(2)))
    call check_length(b%factors, trim(tables(3)))
    do i = 1, size(tables)
      if (is_given(group, trim(tables(i))) .and. .not. is_given(group, 'times')) &
        call errors%add('a table without its times', where=place_of(group, trim(tables(i))), &
                        allowed='as many values as times')
    end do
    if (b%contact == 'affine') then
      if (.not. is_given(group, 'velocity_gradient')) &
        call add_missing(group, 'velocity_gradient', 'for contact = ''affine''', errors)
      if (is_given(group, 'times') .and. .not. is_given(group, 'factors')) &
        call add_missing(group, 'factors', 'where times are given', errors)
      call add_useless(group, 'velocity', 'with contact = ''affine''', errors)
      call add_useless(group, 'velocities_x', 'with contact = ''affine''', errors)
      call add_useless(group, 'velocities_y', 'with contact = ''affine''', errors)
    else if (b%contact /= '') then
      if (is_given(group, 'times')) then
        call add_useless(group, 'velocity', 'beside times', errors)
        if (.not. (is_given(group, 'velocities_x') .or. is_given(group, 'velocities_y'))) &
          call add_missing(group, 'velocities_x', 'or velocities_y, where times are given', errors)
      end if
      call add_useless(group, 'velocity_gradient', 'without contact = ''affine''', errors)
      call add_useless(group, 'factors', 'without contact = ''affine''', errors)
      if (b%contact == 'smooth') call check_smooth(b, group, errors)
    end if

  contains

    subroutine check_length(table, key)
      real(wp),     intent(in) :: table(:)
      character(*), intent(in) :: key

      if (size(table) == 0 .or. size(b%times) == 0) return
      if (size(table) /= size(b%times)) call errors%add( &
        'the table is not as long as times', where=place_of(group, key), &
        found=integer_text(size(table))//' values', allowed=integer_text(size(b%times)))
    end subroutine check_length

  end subroutine check_movement

  !> Report the first value of a list that is not above the one before it.
  subroutine check_increasing(list, key, group, errors)
    real(wp),               intent(in)    :: list(:)
    character(*),           intent(in)    :: key
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: i

    do i = 2, size(list)
      if (list(i) > list(i - 1)) cycle
      call errors%add('the values do not increase', where=place_of(group, key), &
                      found=number_text(list(i))//' after '//number_text(list(i - 1)), &
                      allowed='each value above the one before it')
      return
    end do
  end subroutine check_increasing

  !> A smooth boundary prescribes nothing along its side, so nothing may be asked for there.
  subroutine check_smooth(b, group, errors)
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(12), parameter :: tables(2) = [character(12) :: 'velocities_x', 'velocities_y']
    integer :: along

    if (b%axis == 0) then
      if (.not. (is_damaged(group, 'side') .or. is_given(group, 'body'))) call errors%add( &
        'a smooth boundary without one side', where=place_of(group, 'side'), &
        found=''''//b%side//'''', allowed='''bottom'', ''top'', ''left'', ''right''')
      return
    end if
    along = 3 - b%axis
    if (abs(b%velocity(along)) > 0.0_wp) call errors%add( &
      'a smooth boundary does not prescribe the motion along its side', &
      where=place_of(group, 'velocity'), found=number_text(b%velocity(along)), &
      allowed='0 as component '//integer_text(along)//', or contact = ''rough''')
    if (along == 1) call check_zero(b%velocities_x)
    if (along == 2) call check_zero(b%velocities_y)

  contains

    subroutine check_zero(values)
      real(wp), intent(in) :: values(:)

      if (any(abs(values) > 0.0_wp)) call errors%add( &
        'a smooth boundary does not prescribe the motion along its side', &
        where=place_of(group, tables(along)), found='values other than 0', &
        allowed='0, or contact = ''rough''')
    end subroutine check_zero

  end subroutine check_smooth

  !> End of the run and time step.
  subroutine check_integration(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp), parameter :: max_steps = 2.0e9_wp
    character(*), parameter :: without = 'without method = ''equilibrium'''

    if (group%line == 0) return   ! the group is missing, and that has been reported
    associate (t => input%integration)
      if (is_given(group, 'end_time') .and. is_given(group, 'final_strain')) then
        call errors%add('the end of the run is given twice', &
                        where=place_of(group, 'final_strain'), &
                        found='end_time and final_strain', allowed='one of them')
      else if (.not. (is_given(group, 'end_time') .or. is_given(group, 'final_strain')) &
               .and. size(input%stages) == 0) then
        call errors%add('the end of the run is missing', where=place_of(group), &
                        allowed='end_time [s] or final_strain')
      end if
      if (t%method == 'equilibrium') then
        call check_equilibrium(group, errors)
        return
      end if
      call add_useless(group, 'residual', without, errors)
      call add_useless(group, 'increments', without, errors)
      call add_useless(group, 'relaxation', without, errors)
      if (t%time_step_rule == 'fixed') then
        if (.not. is_given(group, 'time_step')) &
          call add_missing(group, 'time_step', 'for time_step_rule = ''fixed''', errors)
        call add_useless(group, 'safety', 'with time_step_rule = ''fixed''', errors)
        if (.not. (is_set(t%time_step) .and. is_set(t%end_time))) return
        if (t%time_step > t%end_time) then
          call errors%add('the time step is longer than the run', &
                          where=place_of(group, 'time_step'), found=number_text(t%time_step), &
                          allowed='at most '//number_text(t%end_time)//' [s]')
        else if (t%end_time > max_steps*t%time_step) then
          call errors%add('the run would have too many steps', &
                          where=place_of(group, 'time_step'), found=number_text(t%time_step), &
                          allowed='at least '//number_text(t%end_time/max_steps)//' [s]')
        end if
      else if (t%time_step_rule /= '') then
        call add_useless(group, 'time_step', 'without time_step_rule = ''fixed''', errors)
        if (t%time_step_rule == 'spectral' .and. t%safety >= 1.0_wp) &
          call errors%add('the time step would not be stable', where=place_of(group, 'safety'), &
                          found=number_text(t%safety), &
                          allowed='> 0 and < 1 for time_step_rule = ''spectral''')
      end if
    end associate
  end subroutine check_integration

  !> What equilibrium has no use for.
  subroutine check_equilibrium(group, errors)
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: keys(5) = [character(14) :: 'time_step_rule', 'time_step', &
                                          'safety', 'damping', 'damping_frame']
    integer :: k

    do k = 1, size(keys)
      call add_useless(group, trim(keys(k)), 'with method = ''equilibrium''', errors)
    end do
  end subroutine check_equilibrium

  !> Everything that needs platens, and whether they approach each other: told of the first key that
  !> needs it, for one mistake makes one message.
  subroutine check_platens(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: integration, output
    type(table_t) :: approach
    real(wp) :: extent
    integer :: before

    before = errors%count()
    if (any_damaged(groups, 'boundary')) return   ! what could not be read may be a platen's motion
    integration = group_named(groups, 'integration', 1, input%path)
    output = group_named(groups, 'output', 1, input%path)
    if (input%platens(1) == 0) then
      if (is_given(integration, 'final_strain')) then
        call refuse(integration, 'final_strain')
      else if (is_given(output, 'frame_strains')) then
        call refuse(output, 'frame_strains')
      else if (input%integration%damping_frame == 'platens') then
        call refuse(integration, 'damping_frame')
      end if
      return
    end if
    if (approach_unknown(input)) return
    approach = platen_approach(input)
    extent = platen_extent(input)
    if (is_set(input%integration%final_strain)) &
      call check_reached(input%integration%final_strain, integration, 'final_strain')
    if (size(input%output%frame_strains) > 0 .and. errors%count() == before) &
      call check_reached(maxval(input%output%frame_strains), output, 'frame_strains')

  contains

    subroutine refuse(group, key)
      type(namelist_group_t), intent(in) :: group
      character(*),           intent(in) :: key

      call errors%add('the key needs platens, and there are none', where=place_of(group, key), &
                      found=integer_text(size(input%boundaries))//' boundaries', &
                      allowed=needs_platens)
    end subroutine refuse

    !> Whether the platens ever come so close: their approach grows without end, or far enough
    !> within the tables.
    subroutine check_reached(strain, group, key)
      real(wp),               intent(in) :: strain
      type(namelist_group_t), intent(in) :: group
      character(*),           intent(in) :: key

      if (approach%final_rate() > 0.0_wp) return
      if (size(approach%times) == 1) then
        call errors%add('the platens do not approach each other', where=place_of(group, key), &
                        found='rate of approach '//number_text(approach%final_rate()), &
                        allowed='> 0 [m/s]')
      else if (is_set(extent)) then
        if (approach%largest_integral(maxval(approach%times)) &
            < strain*extent*(1.0_wp - 1.0e-9_wp)) &
          call errors%add('the platens never come that near', where=place_of(group, key), &
                          found=number_text(strain), allowed='at most ' &
                          //number_text(approach%largest_integral(maxval(approach%times))/extent))
      end if
    end subroutine check_reached

  end subroutine check_platens

  !> Whether there is no motion of the platens to look at: one of them moves under a load, or has a
  !> table of another length than its times, which has been reported.
  pure logical function approach_unknown(input) result(unknown)
    type(input_t), intent(in) :: input
    integer :: i

    unknown = platen_under_load(input)
    do i = 1, 2
      associate (b => input%boundaries(input%platens(i)))
        if (size(b%velocities_x) > 0) &
          unknown = unknown .or. size(b%velocities_x) /= size(b%times)
        if (size(b%velocities_y) > 0) &
          unknown = unknown .or. size(b%velocities_y) /= size(b%times)
      end associate
    end do
  end function approach_unknown

  !> Which frames are asked for, and whether they lie within the run.
  subroutine check_frames(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: keys(3) = [character(13) :: 'frame_strains', 'frame_times', &
                                          'frame_count']
    real(wp), parameter :: round_off = 1.0e-9_wp
    type(namelist_group_t) :: group
    real(wp) :: last_strain, last_time
    integer  :: i, n

    group = group_named(groups, 'output', 1, input%path)
    call check_increasing(input%output%frame_strains, 'frame_strains', group, errors)
    call check_increasing(input%output%frame_times, 'frame_times', group, errors)
    n = 0
    do i = 1, size(keys)
      if (.not. is_given(group, trim(keys(i)))) cycle
      n = n + 1
      if (n == 2) call errors%add('frames are asked for in two ways', &
                                  where=place_of(group, trim(keys(i))), &
                                  allowed='one of frame_strains, frame_times, frame_count')
    end do

    last_time = end_of_run(input, .false.)
    last_strain = end_of_run(input, .true.)
    if (is_set(last_strain)) &
      call check_last(input%output%frame_strains, last_strain, 'frame_strains')
    if (is_set(last_time)) call check_last(input%output%frame_times, last_time, 'frame_times')

  contains

    subroutine check_last(list, last, key)
      real(wp),     intent(in) :: list(:), last
      character(*), intent(in) :: key

      if (size(list) == 0) return
      if (maxval(list) > last*(1.0_wp + round_off)) &
        call errors%add('a frame beyond the end of the run', where=place_of(group, key), &
                        found=number_text(maxval(list)), allowed='at most '//number_text(last))
    end subroutine check_last

  end subroutine check_frames

  !> The end of the run as a time or, where `as_strain`, as the largest nominal strain; `unset`
  !> where it cannot be known before the set-up.
  function end_of_run(input, as_strain) result(last)
    type(input_t), intent(in) :: input
    logical,       intent(in) :: as_strain
    real(wp) :: last
    type(table_t) :: approach
    real(wp) :: extent

    associate (t => input%integration)
      if (is_set(t%end_time) .and. is_set(t%final_strain)) then
        last = unset
        return
      end if
      last = merge(t%final_strain, t%end_time, as_strain)
      if (is_set(last) .or. input%platens(1) == 0) return
      if (approach_unknown(input)) return
      extent = platen_extent(input)
      if (.not. is_set(extent)) return
      approach = platen_approach(input)
      if (as_strain .and. is_set(t%end_time)) then
        last = approach%largest_integral(t%end_time)/extent
      else if (is_set(t%final_strain) .and. size(approach%times) == 1 &
               .and. approach%final_rate() > 0.0_wp) then
        last = t%final_strain*extent/approach%final_rate()
      end if
    end associate
  end function end_of_run

end module pd_motion_checks
