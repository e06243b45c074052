!> The outlines of the bodies of an input: vertices, extents, edges.
!>
!> What the input lacks, or has wrong, makes an outline without vertices: it has been reported.
module pd_input_shapes
  use pd_input_types, only: body_input_t, boundary_input_t, input_t
  use pd_kinds, only: is_set, wp
  use pd_polygons, only: edge_axis, polygon_of_circle
  use pd_sides, only: normal_axis, outward
  implicit none
  private

  public :: outline, find_extents, body_number, axis_of, reaches_side, is_bearing, circle_error

  !> How far the polygon of a circle is from it at most [spacings].
  real(wp), parameter :: circle_error = 1.0e-4_wp

contains

  !> Vertices of a body (2,n) [m]. Rectangles begin at the lower left and go round
  !> counter-clockwise; a circle becomes a polygon of the same area.
  pure function outline(body, spacing) result(vertices)
    type(body_input_t), intent(in) :: body
    real(wp),           intent(in) :: spacing
    real(wp), allocatable :: vertices(:, :)

    if (body%shape == 'rectangle') then
      if (is_set(body%x_min) .and. is_set(body%x_max) .and. is_set(body%y_min) &
          .and. is_set(body%y_max)) then
        vertices = reshape([body%x_min, body%y_min, body%x_max, body%y_min, body%x_max, &
          body%y_max, body%x_min, body%y_max], [2, 4])
      end if
    else if (body%shape == 'polygon') then
      vertices = reshape(body%vertices, [2, size(body%vertices) / 2])
    else if (body%shape == 'circle') then
      if (is_set(body%x) .and. is_set(body%y) .and. is_set(body%radius) &
          .and. is_set(spacing)) then
        vertices = polygon_of_circle([body%x, body%y], body%radius, &
          circle_vertices(body%radius / spacing))
      end if
    end if
    if (.not. allocated(vertices)) allocate (vertices(2, 0))
  end function outline

  !> Number of vertices with which a polygon is as near to a circle as `circle_error`; a multiple
  !> of 8, so that it has the symmetries of the lattice.
  pure integer function circle_vertices(radius) result(n)
    real(wp), intent(in) :: radius   !! [spacings]
    real(wp), parameter  :: pi = 4.0_wp * atan(1.0_wp), most = 1.0e4_wp

    n = 8 * max(8, ceiling(min(most, pi * sqrt(0.5_wp * radius / circle_error) / 8.0_wp)))
  end function circle_vertices

  !> Corners of the box around all solid bodies, or around one.
  pure subroutine find_extents(bodies, spacing, lower, upper, known)
    type(body_input_t), intent(in)  :: bodies(:)
    real(wp),           intent(in)  :: spacing
    real(wp),           intent(out) :: lower(2), upper(2)   !! [m]
    logical,            intent(out) :: known                !! of all of them
    real(wp), allocatable :: vertices(:, :)
    integer :: k

    lower = huge(1.0_wp)
    upper = -huge(1.0_wp)
    known = size(bodies) > 0
    do k = 1, size(bodies)
      if (bodies(k)%role == 'hole') cycle
      if (bodies(k)%shape == 'circle') then   ! exactly
        known = known .and. is_set(bodies(k)%x) .and. is_set(bodies(k)%y) &
          .and. is_set(bodies(k)%radius)
        if (.not. known) return
        vertices = reshape([bodies(k)%x - bodies(k)%radius, bodies(k)%y - bodies(k)%radius, &
          bodies(k)%x + bodies(k)%radius, bodies(k)%y + bodies(k)%radius], [2, 2])
      else if (bodies(k)%shape == 'file') then
        vertices = reshape([bodies(k)%x_min, bodies(k)%y_min, bodies(k)%x_max, bodies(k)%y_max], &
          [2, 2])
        known = known .and. all(is_set(vertices))
      else
        vertices = outline(bodies(k), spacing)
      end if
      known = known .and. size(vertices) > 0
      if (.not. known) return
      lower = min(lower, minval(vertices, 2))
      upper = max(upper, maxval(vertices, 2))
    end do
    known = known .and. all(upper > lower)
  end subroutine find_extents

  !> Number of the body of a name, 0: there is none.
  pure integer function body_number(input, name) result(k)
    type(input_t), intent(in) :: input
    character(*),  intent(in) :: name

    do k = size(input%bodies), 1, -1
      if (name /= '' .and. input%bodies(k)%name == name) return
    end do
    k = 0
  end function body_number

  !> Axis of the normal to what a boundary lies on, 1: x, 2: y; 0 where it has no single one.
  pure integer function axis_of(input, boundary) result(axis)
    type(input_t),          intent(in) :: input
    type(boundary_input_t), intent(in) :: boundary
    integer :: k

    axis = normal_axis(boundary%side)
    k = body_number(input, boundary%body)
    if (k == 0 .or. boundary%edge == 0) return
    associate (body => input%bodies(k))
      if (body%shape == 'circle') return
      if (boundary%edge > size(outline(body, input%discretisation%spacing), 2)) return
      axis = edge_axis(outline(body, input%discretisation%spacing), boundary%edge)
    end associate
  end function axis_of

  !> Whether a boundary on edges of a body has one that lies on a side of the box around all bodies.
  pure logical function reaches_side(input, boundary, side)
    type(input_t),          intent(in) :: input
    type(boundary_input_t), intent(in) :: boundary
    character(*),           intent(in) :: side
    real(wp), allocatable :: v(:, :)
    real(wp) :: lower(2), upper(2), line
    integer  :: axis, e, k
    logical  :: known

    reaches_side = .false.
    k = body_number(input, boundary%body)
    axis = normal_axis(side)
    if (k == 0 .or. axis == 0) return
    call find_extents(input%bodies, input%discretisation%spacing, lower, upper, known)
    if (.not. known) return
    line = merge(upper(axis), lower(axis), outward(side) > 0)
    v = outline(input%bodies(k), input%discretisation%spacing)
    do e = 1, size(v, 2)
      if (boundary%edge > 0 .and. boundary%edge /= e) cycle
      if (edge_axis(v, e) /= axis) cycle
      if (abs(v(axis, e) - line) <= 1.0e-6_wp * maxval(upper - lower)) reaches_side = .true.
    end do
  end function reaches_side

  !> Whether the layers of a boundary are a smooth bearing, the mirror image of the body: they do
  !> not continue it.
  pure logical function is_bearing(boundary)
    type(boundary_input_t), intent(in) :: boundary

    is_bearing = boundary%contact == 'smooth' .and. (size(boundary%span) > 0 &
      .or. boundary%edge > 0)
  end function is_bearing

end module pd_input_shapes
