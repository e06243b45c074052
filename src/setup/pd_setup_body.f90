!> From checked input to the body: its points, their volumes, and the boundaries they belong to.
module pd_setup_body
  use pd_cloud, only: read_cloud
  use pd_doubt_list, only: doubts_t, is_doubtful
  use pd_errors, only: error_list_t
  use pd_geometry, only: body_t, lattice_t, layer_t, nearest_count, region_body, shape_t
  use pd_input, only: resolved_path
  use pd_input_shapes, only: body_number, circle_error, find_extents, is_bearing, outline
  use pd_input_types, only: body_input_t, input_t
  use pd_kinds, only: is_set, wp
  use pd_random_field, only: longest_way
  use pd_setup_mirror, only: give_images_their_volume
  use pd_setup_reach, only: looks_near
  use pd_text, only: coordinate_text, number_text, short_number
  implicit none
  private

  public :: set_up_body

contains

  !> Points, volumes and boundary sets.
  !>
  !> Errors: a cloud file that is wrong; a body or a boundary without points, a hole without
  !> effect; a smooth boundary before a body thinner than its layer; a weak patch without a point.
  subroutine set_up_body(input, body, doubts, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(doubts_t),     intent(inout) :: doubts
    type(error_list_t), intent(inout) :: input_errors   !! of a cloud file
    type(error_list_t), intent(inout) :: errors         !! of the model

    if (input%bodies(1)%shape == 'file') then
      call cloud_body(input, body, input_errors, errors)
    else
      call shaped_body(input, body, doubts, errors)
    end if
    if (errors%count() + input_errors%count() == 0) call look_at_patch(input, body, errors)
    if (is_set(input%random_field%correlation_length) .and. allocated(body%position)) &
      call look_at_scales(input%random_field%correlation_length, input%discretisation%spacing, &
      maxval(abs(body%position)), doubts, errors)
  end subroutine set_up_body

  !> Check that the points can resolve a random field, and that it can be computed.
  subroutine look_at_scales(correlation_length, spacing, farthest, doubts, errors)
    real(wp),           intent(in)    :: correlation_length, spacing   !! [m]
    real(wp),           intent(in)    :: farthest                      !! largest coordinate [m]
    type(doubts_t),     intent(inout) :: doubts
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: where = '&random_field correlation_length'
    real(wp),     parameter :: round_off = 1.0e-9_wp

    if (farthest > longest_way * correlation_length) then
      call errors%add('the coordinates are more than 1e8 correlation lengths', where)
    else if (is_doubtful('field_resolution', correlation_length / spacing * (1.0_wp + round_off))) &
      then
      call doubts%add('field_resolution', correlation_length / spacing, &
        'less than 2 spacings: the points cannot show how the soil varies', where)
    end if
  end subroutine look_at_scales

  !> Body from a point cloud. An extent given in the input takes precedence over that of the points.
  subroutine cloud_body(input, body, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(error_list_t), intent(inout) :: input_errors, errors
    character(64) :: names(size(input%boundaries))
    character(:), allocatable :: found
    integer :: k

    do k = 1, size(names)
      names(k) = input%boundaries(k)%name
    end do
    associate (cloud => input%bodies(1))
      call read_cloud(resolved_path(input, cloud%file), names, body, input_errors)
      if (is_set(cloud%x_min)) then
        body%lower = [cloud%x_min, cloud%y_min]
        body%upper = [cloud%x_max, cloud%y_max]
      end if
    end associate
    if (input_errors%count() > 0) return
    found = 'no such name in column 4 of '
    if (all(body%boundary == 0)) found = 'no column 4 with names of boundaries in '
    do k = 1, size(names)
      if (.not. any(body%boundary == k)) &
        call errors%add('a boundary holds no point', '&boundary name = '//trim(names(k)), &
                        found//trim(input%bodies(1)%file))
    end do
  end subroutine cloud_body

  !> Check that the weak patch and the random field touch points of the body. Where a material can
  !> yield, one of these points must.
  subroutine look_at_patch(input, body, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(in)    :: body
    type(error_list_t), intent(inout) :: errors
    logical :: counts(0:size(input%bodies)), found
    integer :: i

    counts(0) = .false.   ! layers
    do i = 1, size(input%bodies)
      counts(i) = .not. any_yields(input) .or. yields(input, input%bodies(i)%material)
    end do
    found = .false.
    if (is_set(input%random_field%coefficient_of_variation)) then
      do i = 1, body%n
        found = found .or. counts(merge(body%part_of(i), 0, body%boundary_of(i) == 0))
      end do
      if (.not. found) &
        call errors%add('the random field touches no point that can yield', '&random_field')
    end if
    associate (flaw => input%imperfection)
      if (.not. flaw%amplitude > 0.0_wp) return
      found = .false.
      do i = 1, body%n
        if (norm2(body%position_of(i) - [flaw%x, flaw%y]) > flaw%radius * (1.0_wp + 1.0e-6_wp)) &
          cycle
        found = found .or. counts(merge(body%part_of(i), 0, body%boundary_of(i) == 0))
      end do
      if (.not. found) call errors%add( &
        'the weak patch holds no point of the body that can yield', '&imperfection', &
        short_number(flaw%radius)//' m about '//number_text(flaw%x)//', '//number_text(flaw%y), &
        'a patch in the body, wider than the spacing')
    end associate
  end subroutine look_at_patch

  !> Whether one of the materials can yield.
  pure logical function any_yields(input)
    type(input_t), intent(in) :: input
    integer :: k

    any_yields = .false.
    do k = 1, size(input%materials)
      any_yields = any_yields .or. input%materials(k)%model == 'j2'
    end do
  end function any_yields

  !> Whether the material of a name can yield.
  pure logical function yields(input, name)
    type(input_t), intent(in) :: input
    character(*),  intent(in) :: name
    integer :: k

    yields = .false.
    do k = 1, size(input%materials)
      if (input%materials(k)%name == name) yields = input%materials(k)%model == 'j2'
    end do
  end function yields

  !> Body from rectangles, polygons and circles on one lattice, which starts at the lower left
  !> corner of the first one, or of the box around it.
  subroutine shaped_body(input, body, doubts, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(doubts_t),     intent(inout) :: doubts
    type(error_list_t), intent(inout) :: errors
    type(shape_t)   :: shapes(size(input%bodies))
    type(layer_t)   :: layers(size(input%boundaries))
    type(lattice_t) :: lattice
    real(wp) :: origin(2), upper(2)
    logical  :: adjusted, known
    integer :: k

    associate (d => input%discretisation)
      lattice%spacing = d%spacing
      lattice%cells = d%layout == 'cells'
      lattice%tributary = d%volumes == 'tributary'
      lattice%reach = d%horizon / d%spacing
      lattice%rows = ceiling(lattice%reach - 1.0e-6_wp)
      lattice%in_runs = looks_near(input)
      lattice%through_air = d%families == 'distance'
    end associate
    call find_extents(input%bodies(:1), lattice%spacing, origin, upper, known)
    adjusted = .false.
    do k = 1, size(shapes)
      call new_shape(input%bodies(k), origin, lattice%spacing, shapes(k), adjusted, errors)
    end do
    if (errors%count() > 0) return
    do k = 1, size(layers)
      layers(k)%side = input%boundaries(k)%side
      layers(k)%boundary = k
      layers(k)%shape = body_number(input, input%boundaries(k)%body)
      layers(k)%edge = input%boundaries(k)%edge
      if (size(input%boundaries(k)%span) == 2) layers(k)%span = input%boundaries(k)%span
      layers(k)%mirror = is_bearing(input%boundaries(k))
    end do
    call region_body(shapes, origin, lattice, layers, body, errors)
    if (errors%count() == 0) call give_images_their_volume(input, lattice%rows, body, errors)
    if (adjusted .and. errors%count() == 0) then
      associate (dx => lattice%spacing)
        call doubts%add('body_adjusted', 0.0_wp, 'the body is adjusted to the spacing: x from '// &
          coordinate_text(body%lower(1), dx)//' to '//coordinate_text(body%upper(1), dx)// &
          ' m, y from '//coordinate_text(body%lower(2), dx)//' to '// &
          coordinate_text(body%upper(2), dx)//' m', '&body')
      end associate
    end if
  end subroutine shaped_body

  !> The outline of a body in spacings from the origin. Rectangles move to lattice lines; what is
  !> on a lattice line or in the middle between two but for round-off is so exactly.
  !>
  !> Errors: a rectangle thinner than one spacing.
  subroutine new_shape(given, origin, spacing, shape, adjusted, errors)
    type(body_input_t), intent(in)    :: given
    real(wp),           intent(in)    :: origin(2), spacing   !! [m]
    type(shape_t),      intent(out)   :: shape
    logical,            intent(inout) :: adjusted             !! a rectangle has been moved
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter   :: near = 1.0e-6_wp
    real(wp), allocatable :: v(:, :), even(:, :)

    allocate (v, source=outline(given, spacing))
    allocate (even, mold=v)
    v = v - spread(origin, 2, size(v, 2))
    if (given%shape == 'rectangle') then
      even = real(nearest_count(v, spacing), wp)
      adjusted = adjusted .or. any(abs(v - even * spacing) > near * spacing)
      v = even
      if (any(v(:, 3) <= v(:, 1))) call errors%add('a body is thinner than one spacing', '&body')
    else
      v = v / spacing
      even = 0.5_wp * anint(2.0_wp * v)
      where (abs(v - even) <= near) v = even
    end if
    shape%vertices = v
    shape%solid = given%role /= 'hole'
    if (given%shape == 'circle') shape%near = 2.0_wp * circle_error
    if (allocated(given%name)) shape%name = given%name
  end subroutine new_shape

end module pd_setup_body
