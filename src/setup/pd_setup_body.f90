!> From checked input to the body: its points, their volumes, and the boundaries they belong to.
module pd_setup_body
  use pd_cloud, only: read_cloud
  use pd_errors, only: error_list_t
  use pd_geometry, only: body_t, lattice_body, lattice_t, layer_t, nearest_count
  use pd_input, only: resolved_path
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  use pd_random_field, only: longest_way
  implicit none
  private

  public :: set_up_body

contains

  !> Points, volumes and boundary sets.
  !>
  !> Errors: a cloud file that is wrong; a body without points, a boundary without points.
  subroutine set_up_body(input, body, warnings, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(error_list_t), intent(inout) :: warnings
    type(error_list_t), intent(inout) :: input_errors   !! of a cloud file
    type(error_list_t), intent(inout) :: errors         !! of the model

    if (input%bodies(1)%shape == 'file') then
      call cloud_body(input, body, input_errors, errors)
    else
      call rectangle_body(input, body, warnings, errors)
    end if
    if (is_set(input%random_field%correlation_length) .and. allocated(body%position)) &
      call look_at_scales(input%random_field%correlation_length, input%discretisation%spacing, &
      maxval(abs(body%position)), warnings, errors)
  end subroutine set_up_body

  !> Check that the points can resolve a random field, and that it can be computed.
  subroutine look_at_scales(correlation_length, spacing, farthest, warnings, errors)
    real(wp),           intent(in)    :: correlation_length, spacing   !! [m]
    real(wp),           intent(in)    :: farthest                      !! largest coordinate [m]
    type(error_list_t), intent(inout) :: warnings, errors
    character(*), parameter :: where = '&random_field correlation_length'

    if (farthest > longest_way * correlation_length) then
      call errors%add('the coordinates are more than 1e8 correlation lengths', where)
    else if (correlation_length < 2.0_wp * spacing) then
      call warnings%add('less than 2 spacings: the points cannot show how the soil varies', where)
    end if
  end subroutine look_at_scales

  !> Body from a point cloud. An extent given in the input takes precedence over that of the points.
  subroutine cloud_body(input, body, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(error_list_t), intent(inout) :: input_errors, errors
    character(64) :: names(size(input%boundaries))
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
    do k = 1, size(names)
      if (.not. any(body%boundary == k)) &
        call errors%add('a boundary holds no point', '&boundary name = '//trim(names(k)))
    end do
  end subroutine cloud_body

  !> Body from rectangles on one lattice.
  subroutine rectangle_body(input, body, warnings, errors)
    type(input_t),      intent(in)    :: input
    type(body_t),       intent(out)   :: body
    type(error_list_t), intent(inout) :: warnings, errors
    real(wp) :: lower(2, size(input%bodies)), upper(2, size(input%bodies))
    real(wp) :: asked(4 * size(input%bodies)), found(4 * size(input%bodies))
    type(layer_t)   :: layers(size(input%boundaries))
    type(lattice_t) :: lattice
    character(120)  :: text
    integer :: k

    do k = 1, size(input%bodies)
      lower(:, k) = [input%bodies(k)%x_min, input%bodies(k)%y_min]
      upper(:, k) = [input%bodies(k)%x_max, input%bodies(k)%y_max]
    end do
    associate (d => input%discretisation)
      lattice%spacing = d%spacing
      lattice%cells = d%layout == 'cells'
      lattice%tributary = d%volumes == 'tributary'
      lattice%rows = ceiling(d%horizon / d%spacing - 1.0e-6_wp)
    end associate
    do k = 1, size(layers)
      layers(k)%side = input%boundaries(k)%side
      layers(k)%boundary = k
      if (size(input%boundaries(k)%span) == 2) layers(k)%span = input%boundaries(k)%span
    end do
    call lattice_body(lower, upper, lattice, layers, body, errors)
    asked = [(lower(:, k), upper(:, k), k=1, size(lower, 2))]
    do k = 1, size(asked), 2
      found(k:k + 1) = lower(:, 1) + lattice%spacing &
        * real(nearest_count(asked(k:k + 1) - lower(:, 1), lattice%spacing), wp)
    end do
    if (any(abs(found - asked) > 1.0e-6_wp * lattice%spacing) .and. errors%count() == 0) then
      write (text, '(a,4(g0.8,a))') 'the body is adjusted to the spacing: x from ', body%lower(1), &
        ' to ', body%upper(1), ' m, y from ', body%lower(2), ' to ', body%upper(2), ' m'
      call warnings%add(trim(text), '&body')
    end if
  end subroutine rectangle_body

end module pd_setup_body
