!> Conditions on several keys together: points, bodies, control.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_input_checks
  use pd_errors, only: error_list_t
  use pd_files, only: meant_path
  use pd_input_shapes, only: find_extents, outline
  use pd_input_types, only: body_input_t, input_t
  use pd_input_values, only: group_named, is_damaged, is_given
  use pd_kinds, only: is_set, wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: check_model, resolved_path, is_cloud, add_missing, add_useless

  real(wp), parameter :: lattice_tolerance = 1.0e-6_wp   !! of spacing
  real(wp), parameter :: max_points = 1.0e8_wp
  real(wp), parameter :: max_horizon = 100.0_wp          !! in units of spacing

contains

  !> All checks of this module.
  subroutine check_model(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    integer :: k

    call check_discretisation(input, group_named(groups, 'discretisation', 1, input%path), errors)
    do k = 1, size(input%bodies)
      if (errors%count() >= max_problems) return
      call check_body(input, k, group_named(groups, 'body', k, input%path), errors)
    end do
    do k = 1, size(input%cuts)
      if (errors%count() >= max_problems) return
      call check_cut(input, k, group_named(groups, 'cut', k, input%path), errors)
    end do
    call check_number_of_points(input, groups, errors)
    call check_stabilisation(input, group_named(groups, 'stabilisation', 1, input%path), errors)
  end subroutine check_model

  !> Whether the body is a point cloud.
  pure logical function is_cloud(input)
    type(input_t), intent(in) :: input
    integer :: k

    is_cloud = .false.
    do k = 1, size(input%bodies)
      if (input%bodies(k)%shape == 'file') is_cloud = .true.
    end do
  end function is_cloud

  !> Whether one of the bodies is a rectangle, or has no shape because it is wrong.
  pure logical function any_rectangle(input)
    type(input_t), intent(in) :: input
    integer :: k

    any_rectangle = .false.
    do k = 1, size(input%bodies)
      if (input%bodies(k)%shape == 'rectangle' .or. input%bodies(k)%shape == '') &
        any_rectangle = .true.
    end do
  end function any_rectangle

  !> Path of a file that the input names: as it is if absolute, else in the folder of the input
  !> file, or, if it is not there, in the working directory.
  function resolved_path(input, file) result(path)
    type(input_t), intent(in) :: input
    character(*),  intent(in) :: file
    character(:), allocatable :: path
    logical :: exists
    integer :: slash

    path = meant_path(file)
    if (index(path, '/') == 1) return
    slash = index(input%path, '/', back=.true.)
    if (slash == 0) return
    inquire (file=input%path(:slash)//path, exist=exists)
    if (exists) path = input%path(:slash)//path
  end function resolved_path

  subroutine add_missing(group, key, why, errors)
    type(namelist_group_t), intent(in)    :: group
    character(*),           intent(in)    :: key, why
    type(error_list_t),     intent(inout) :: errors

    call errors%add('the key is missing, it is needed '//why, where=place_of(group, key))
  end subroutine add_missing

  !> Report a key that is given although it would have no effect.
  subroutine add_useless(group, key, why, errors)
    type(namelist_group_t), intent(in)    :: group
    character(*),           intent(in)    :: key, why
    type(error_list_t),     intent(inout) :: errors

    character(*), parameter :: choosing(6) = [character(14) :: 'method', 'contact', 'shape', &
                                              'role', 'time_step_rule', 'traction']
    integer :: k

    do k = 1, size(choosing)   ! what was meant there may give the key its effect
      if (is_damaged(group, trim(choosing(k)))) return
    end do
    if (is_given(group, key)) call errors%add('the key has no effect '//why, &
                                              where=place_of(group, key), allowed='leave it out')
  end subroutine add_useless

  subroutine check_discretisation(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp), parameter :: least_conical = 1.5_wp

    if (is_cloud(input)) then
      call add_useless(group, 'layout', 'on a point cloud', errors)
      call add_useless(group, 'volumes', 'on a point cloud', errors)
      call add_useless(group, 'fit', 'on a point cloud', errors)
      if (input%discretisation%families == 'line_of_sight' .and. size(input%cuts) == 0) &
        call add_useless(group, 'families', 'on a point cloud without a &cut: nothing says ' &
        //'where its air is', errors)
      return
    end if
    call add_useless(group, 'cloud_weights', 'on a lattice', errors)
    if (size(input%bodies) > 0 .and. .not. any_rectangle(input)) &
      call add_useless(group, 'fit', 'without a rectangle', errors)
    associate (d => input%discretisation)
      if (.not. (is_set(d%spacing) .and. is_set(d%horizon))) return
      if (d%horizon < d%spacing*(1.0_wp - lattice_tolerance)) then
        call errors%add('the horizon is less than the spacing', &
                        where=place_of(group, 'horizon'), found=number_text(d%horizon), &
                        allowed='at least '//number_text(d%spacing)//' [m]')
      else if (d%influence == 'conical' .and. &
               d%horizon < least_conical*d%spacing*(1.0_wp - lattice_tolerance)) then
        call errors%add('no bond carries weight: influence = ''conical'' needs a larger horizon', &
                        where=place_of(group, 'horizon'), found=number_text(d%horizon), &
                        allowed='at least '//number_text(least_conical*d%spacing)//' [m]')
      else if (d%horizon > max_horizon*d%spacing) then
        call errors%add('the horizon is more than 100 spacings', &
                        where=place_of(group, 'horizon'), found=number_text(d%horizon), &
                        allowed='at most '//number_text(max_horizon*d%spacing)//' [m]')
      end if
    end associate
  end subroutine check_discretisation

  !> Body k, whose group is `group`.
  subroutine check_body(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: extents(4) = ['x_min', 'x_max', 'y_min', 'y_max']
    integer :: i, n

    n = 0
    do i = 1, size(extents)
      if (is_given(group, extents(i))) n = n + 1
    end do
    associate (b => input%bodies(k))
      if (b%shape == 'rectangle') then
        do i = 1, size(extents)
          if (.not. is_given(group, extents(i))) call add_missing(group, extents(i), &
                                                                  'for a rectangle', errors)
        end do
        call add_useless(group, 'file', 'on a rectangle', errors)
      else if (b%shape == 'file') then
        if (input%run%operators == 'lattice') call errors%add( &
          'a point cloud has no lattice', &
          where='&run operators', &
          found='lattice', allowed='auto or list')
        if (size(input%bodies) > 1) call errors%add('a point cloud beside another body', &
          where=place_of(group, 'shape'), found=integer_text(size(input%bodies))//' bodies', &
          allowed='shapes on a lattice only, or one point cloud alone')
        if (n > 0 .and. n < size(extents)) call errors%add( &
          'only some of the extents of a point cloud are given', where=place_of(group), &
          found=integer_text(n), allowed='all of x_min, x_max, y_min, y_max, or none')
        call check_file(input, b%file, group, errors)
      end if
      call check_extent('x', b%x_min, b%x_max)
      call check_extent('y', b%y_min, b%y_max)
    end associate

  contains

    subroutine check_extent(axis, lower, upper)
      character, intent(in) :: axis
      real(wp),  intent(in) :: lower, upper

      if (.not. (is_set(lower) .and. is_set(upper))) return
      if (lower >= upper) then
        call errors%add('the body has no extent along '//axis, &
                        where=place_of(group, axis//'_max'), found=number_text(upper), &
                        allowed='above '//axis//'_min = '//number_text(lower)//' [m]')
      else if (input%bodies(k)%shape == 'rectangle') then
        call check_fit(input, k, axis, group, errors)
      end if
    end subroutine check_extent

  end subroutine check_body

  !> Cut k: its two ends differ, and families look for it.
  subroutine check_cut(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (input%discretisation%families == 'distance') call errors%add( &
      'a cut has no effect where families go by distance alone', where=place_of(group), &
      found='families = ''distance''', allowed='families = ''line_of_sight''')
    associate (x => input%cuts(k)%x, y => input%cuts(k)%y, d => input%discretisation)
      if (.not. (all(is_set(x)) .and. all(is_set(y)) .and. is_set(d%spacing))) return
      if (hypot(x(2) - x(1), y(2) - y(1)) > lattice_tolerance * d%spacing) return
      call errors%add('the cut has no length', where=place_of(group), &
        found='both ends at ('//number_text(x(1))//', '//number_text(y(1))//')', &
        allowed='two ends that differ')
    end associate
  end subroutine check_cut

  subroutine check_file(input, file, group, errors)
    type(input_t),          intent(in)    :: input
    character(*),           intent(in)    :: file
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    logical :: exists, is_folder

    if (.not. is_given(group, 'file')) then
      call add_missing(group, 'file', 'for shape = ''file''', errors)
    else if (file /= '') then
      inquire (file=resolved_path(input, file), exist=exists)
      inquire (file=resolved_path(input, file)//'/.', exist=is_folder)
      if (.not. exists .or. is_folder) call errors%add('the file does not exist', &
        where=place_of(group, 'file'), found=''''//file//'''', &
        allowed='a file in the folder of the input file or in the working directory')
    end if
  end subroutine check_file

  !> Whether body k fits on the lattice along an axis: its extent, and its offset from the first
  !> body, are whole multiples of spacing. With fit = 'nearest' the set-up adjusts them.
  subroutine check_fit(input, k, axis, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    character,              intent(in)    :: axis
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: extent, first, fits, high(2), low(2), lower, spacing, steps
    logical  :: known

    spacing = input%discretisation%spacing
    if (.not. is_set(spacing)) return
    lower = merge(input%bodies(k)%x_min, input%bodies(k)%y_min, axis == 'x')
    extent = merge(input%bodies(k)%x_max, input%bodies(k)%y_max, axis == 'x') - lower
    steps = extent/spacing
    if (steps < 0.5_wp) then
      call errors%add('the extent along '//axis//' is less than half a spacing', &
                      where=place_of(group, axis//'_max'), found=number_text(extent), &
                      allowed='at least spacing = '//number_text(spacing)//' [m]')
      return
    end if
    if (input%discretisation%fit /= 'exact') return
    fits = max(1.0_wp, anint(steps))
    if (abs(steps - fits) > lattice_tolerance) then
      call errors%add('the extent along '//axis//' is not a multiple of spacing', &
                      where=place_of(group, axis//'_max'), found=number_text(rounded(extent)), &
                      allowed=neighbours(steps, spacing)//', or fit = ''nearest''')
    end if
    call find_extents(input%bodies(:1), spacing, low, high, known)
    first = merge(low(1), low(2), axis == 'x')
    if (k == 1 .or. .not. known) return
    steps = (lower - first)/spacing
    if (abs(steps - anint(steps)) > lattice_tolerance) call errors%add( &
      'the body is not on the lattice of the first body along '//axis, &
      where=place_of(group, axis//'_min'), found=number_text(lower), &
      allowed=number_text(rounded(first + anint(steps)*spacing))//', or fit = ''nearest''')
  end subroutine check_fit

  !> The multiples of the spacing below and above an extent, given in spacings, for a message.
  pure function neighbours(steps, spacing) result(text)
    real(wp), intent(in) :: steps, spacing
    character(:), allocatable :: text
    real(wp) :: below

    below = aint(steps)
    text = number_text(rounded((below + 1.0_wp)*spacing))//' [m]'
    if (below > 0.0_wp) text = number_text(rounded(below*spacing))//' or '//text
    text = 'nearest '//text
  end function neighbours

  !> The number to ten digits, without the round-off of differences and products.
  pure real(wp) function rounded(x)
    real(wp), intent(in) :: x
    character(20) :: buffer

    write (buffer, '(es20.9e3)') x
    read (buffer, '(f20.0)') rounded
  end function rounded

  subroutine check_number_of_points(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: points
    integer  :: k

    if (.not. is_set(input%discretisation%spacing) .or. is_cloud(input)) return
    points = points_of(input%bodies, input%discretisation%spacing)
    do k = 1, size(input%bodies)
      points = max(points, points_of(input%bodies(k:k), input%discretisation%spacing))
    end do
    if (points > max_points) call errors%add( &
      'the bodies, or the box around them, would have too many points', &
      where=place_of(group_named(groups, 'discretisation', 1, input%path), 'spacing'), &
      found='about '//number_text(rounded(points)), allowed='at most 1e8')
    call check_holes_are_near(input, groups, errors)
  end subroutine check_number_of_points

  !> Report holes so far from the solids that no place of the lattice can be counted there.
  subroutine check_holes_are_near(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    real(wp) :: farthest, lower(2), upper(2)
    real(wp), allocatable :: v(:, :)
    logical :: known
    integer :: k

    associate (spacing => input%discretisation%spacing)
      call find_extents(input%bodies, spacing, lower, upper, known)
      if (.not. known) return
      do k = 1, size(input%bodies)
        if (input%bodies(k)%role /= 'hole') cycle
        v = outline(input%bodies(k), spacing)
        if (size(v) == 0) cycle
        farthest = max(maxval(upper - minval(v, 2)), maxval(maxval(v, 2) - lower))
        if (farthest/spacing > max_points) call errors%add('the hole reaches too far away from '// &
          'the solid bodies', where=place_of(group_named(groups, 'body', k, input%path)), &
          found='about '//number_text(rounded(farthest))//' m', allowed='at most 1e8 spacings')
      end do
    end associate
  end subroutine check_holes_are_near

  !> About how many points there are in the box around bodies; 0 where it is not known.
  pure real(wp) function points_of(bodies, spacing)
    type(body_input_t), intent(in) :: bodies(:)
    real(wp),           intent(in) :: spacing
    real(wp) :: lower(2), upper(2)
    logical  :: known

    points_of = 0.0_wp
    call find_extents(bodies, spacing, lower, upper, known)
    ! Bounded first: the plain product can overflow.
    if (known) points_of = product(min(1.0e20_wp, (upper - lower)/spacing + 1.0_wp))
  end function points_of

  subroutine check_stabilisation(input, group, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (is_damaged(group, 'factor') .or. is_damaged(group, 'method')) return
    associate (s => input%stabilisation)
      if (s%method /= 'relaxing') then
        call add_useless(group, 'relaxing_stiffness', 'without method = ''relaxing''', errors)
        call add_useless(group, 'relaxing_strain', 'without method = ''relaxing''', errors)
      end if
      if (s%method == 'silling' .and. s%factor <= 0.0_wp) then
        call errors%add('the control has no strength', where=place_of(group, 'factor'), &
                        found=number_text(s%factor), allowed='> 0 for method = ''silling''')
      else if (s%method /= 'silling' .and. s%factor > 0.0_wp) then
        call errors%add('a strength without control', where=place_of(group, 'factor'), &
                        found=number_text(s%factor), &
                        allowed='0 for method = '''//s%method//'''')
      end if
    end associate
  end subroutine check_stabilisation

end module pd_input_checks
