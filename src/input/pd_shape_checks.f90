!> Conditions on several keys together: shapes of bodies, their roles and names, and boundaries on
!> their edges.
!>
!> A key that is missing or damaged holds `unset` or an empty text here; its checks are skipped,
!> because the problem has been reported already.
module pd_shape_checks
  use pd_errors, only: error_list_t
  use pd_input_checks, only: add_missing, add_useless, is_cloud
  use pd_input_shapes, only: body_number, outline
  use pd_input_types, only: body_input_t, boundary_input_t, input_t
  use pd_input_values, only: any_damaged, did_you_mean, group_named, is_damaged, is_given
  use pd_kinds, only: wp
  use pd_namelist, only: max_problems
  use pd_namelist_groups, only: namelist_group_t, place_of
  use pd_polygons, only: crossing_edges, same_vertices, signed_area
  use pd_text, only: integer_text, number_text, quoted_list
  implicit none
  private

  public :: check_shapes

  integer, parameter :: name_length = 48   !! of a name; check_groups checks it

contains

  !> All checks of this module.
  subroutine check_shapes(input, groups, errors)
    type(input_t),          intent(in)    :: input
    type(namelist_group_t), intent(in)    :: groups(:)
    type(error_list_t),     intent(inout) :: errors
    type(namelist_group_t) :: group
    integer :: k

    do k = 1, size(input%bodies)
      if (errors%count() >= max_problems) return
      group = group_named(groups, 'body', k, input%path)
      call check_name(input%bodies, k, group, errors)
      call check_keys(input%bodies(k), group, errors)
      call check_role(input%bodies(k), k, group, errors)
      if (input%bodies(k)%shape == 'polygon') &
        call check_polygon(input%bodies(k), place_of_vertices(input%bodies(k), group), group, &
        errors)
    end do
    do k = 1, size(input%boundaries)
      if (errors%count() >= max_problems) return
      if (any_damaged(groups, 'body')) exit   ! its name may be the one that is asked for
      call check_edges(input, k, group_named(groups, 'boundary', k, input%path), errors)
    end do
    do k = 1, size(input%pressures)
      if (errors%count() >= max_problems) return
      if (any_damaged(groups, 'body')) exit
      call check_pressed_edges(input, k, group_named(groups, 'pressure', k, input%path), errors)
    end do
  end subroutine check_shapes

  subroutine check_name(bodies, k, group, errors)
    type(body_input_t),     intent(in)    :: bodies(:)
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    if (bodies(k)%name == '') return
    do j = 1, k - 1
      if (bodies(j)%name /= bodies(k)%name) cycle
      call errors%add('two bodies have the same name', where=place_of(group, 'name'), &
                      found=''''//bodies(k)%name//'''', allowed='each name once')
      return
    end do
  end subroutine check_name

  !> Keys that a shape needs, and those that belong to other shapes.
  subroutine check_keys(body, group, errors)
    type(body_input_t),     intent(in)    :: body
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: circle(3) = [character(6) :: 'x', 'y', 'radius']
    character(*), parameter :: extents(4) = ['x_min', 'x_max', 'y_min', 'y_max']
    character(:), allocatable :: on
    integer :: i

    on = 'on shape = '''//body%shape//''''
    if (body%shape == '') return
    do i = 1, size(circle)
      if (body%shape /= 'circle') then
        call add_useless(group, trim(circle(i)), on, errors)
      else if (.not. is_given(group, trim(circle(i)))) then
        call add_missing(group, trim(circle(i)), 'for a circle', errors)
      end if
    end do
    if (body%shape /= 'polygon') then
      call add_useless(group, 'vertices', on, errors)
    else if (.not. is_given(group, 'vertices')) then
      call add_missing(group, 'vertices', 'for a polygon', errors)
    end if
    if (body%shape /= 'circle' .and. body%shape /= 'polygon') return
    call add_useless(group, 'file', on, errors)
    do i = 1, size(extents)
      call add_useless(group, extents(i), on, errors)
    end do
  end subroutine check_keys

  subroutine check_role(body, k, group, errors)
    type(body_input_t),     intent(in)    :: body
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (body%shape == 'file') call add_useless(group, 'role', 'on a point cloud', errors)
    if (body%role /= 'hole' .or. body%shape == 'file') return
    call add_useless(group, 'material', 'on a hole', errors)
    if (k == 1) call errors%add('the first body is a hole', where=place_of(group, 'role'), &
      found='''hole''', allowed='a solid first: a hole takes away from bodies before it')
  end subroutine check_role

  !> Group, line and name of a polygon, for a message.
  function place_of_vertices(body, group) result(place)
    type(body_input_t),     intent(in) :: body
    type(namelist_group_t), intent(in) :: group
    character(:), allocatable :: place

    place = place_of(group, 'vertices')
    if (body%name /= '') place = place//', '''//body%name//''''
  end function place_of_vertices

  !> A polygon with an area, whose edges do not cross.
  subroutine check_polygon(body, place, group, errors)
    type(body_input_t),     intent(in)    :: body
    character(*),           intent(in)    :: place
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    real(wp), allocatable :: v(:, :)
    integer :: n, pair(2)

    if (.not. is_given(group, 'vertices') .or. is_damaged(group, 'vertices')) return
    n = size(body%vertices)
    if (modulo(n, 2) == 1) then
      call errors%add('a vertex without its y', where=place, found=integer_text(n)//' numbers', &
                      allowed='pairs x, y [m]')
      return
    else if (n < 6) then
      call errors%add('too few vertices', where=place, found=integer_text(n / 2), &
                      allowed='three or more pairs x, y')
      return
    end if
    v = outline(body, 1.0_wp)
    pair = same_vertices(v)
    if (pair(1) > 0) then
      call errors%add('two vertices coincide', where=place, found='vertices '// &
        both(pair)//': '//number_text(v(1, pair(1)))//', '//number_text(v(2, pair(1))), &
        allowed='each vertex once; the last edge goes back to the first vertex by itself')
      return
    end if
    if (abs(signed_area(v)) <= 1.0e-12_wp * maxval(maxval(v, 2) - minval(v, 2))**2) then
      call errors%add('the polygon has no area', where=place, found=number_text(signed_area(v))// &
        ' m^2', allowed='vertices that go round an area')
      return
    end if
    pair = crossing_edges(v)
    if (pair(1) > 0) call errors%add('the polygon crosses or touches itself', where=place, &
      found='edges '//both(pair)//' meet; edge k begins at vertex k', &
      allowed='edges that meet at their common vertex only')
  end subroutine check_polygon

  pure function both(pair) result(text)
    integer, intent(in) :: pair(2)
    character(:), allocatable :: text

    text = integer_text(pair(1))//' and '//integer_text(pair(2))
  end function both

  !> What boundary k lies on, where it names a body.
  subroutine check_edges(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: number

    associate (b => input%boundaries(k))
      if (.not. is_given(group, 'body')) then
        call add_useless(group, 'edge', 'without body', errors)
        return
      end if
      if (b%body == '') return
      if (is_cloud(input)) then
        call errors%add('a cloud has no edges', where=place_of(group, 'body'), &
          found='shape = ''file''', allowed='the name of a boundary in the file of the cloud')
        return
      end if
      call check_company(group, errors)
      number = body_number(input, b%body)
      if (number == 0) then
        call report_unknown(input, b%body, group, errors)
        return
      end if
      call check_edge(input, number, b, group, errors)
      call check_twice(input%boundaries, k, group, errors)
    end associate
  end subroutine check_edges

  !> Keys that do not go with `body`.
  subroutine check_company(group, errors)
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors

    if (is_given(group, 'side')) call errors%add('a boundary on a side and on a body', &
      where=place_of(group, 'body'), found='both', allowed='side, or body with or without edge')
    if (is_given(group, 'span')) call errors%add('a span on a body', &
      where=place_of(group, 'span'), found='both', allowed='side with span, or body with edge')
    if (is_given(group, 'traction')) call errors%add('a traction on edges of a body', &
      where=place_of(group, 'traction'), found='both', allowed='a traction on a whole side')
  end subroutine check_company

  subroutine report_unknown(input, name, group, errors)
    type(input_t),          intent(in)    :: input
    character(*),           intent(in)    :: name
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(name_length) :: names(size(input%bodies))
    integer :: j

    do j = 1, size(names)
      names(j) = input%bodies(j)%name
    end do
    if (all(names == '')) then
      call errors%add('no body has a name', where=place_of(group, 'body'), &
                      found=''''//name//'''', allowed='the name of a body')
    else
      call errors%add('unknown body'//did_you_mean(name, names), where=place_of(group, 'body'), &
                      found=''''//name//'''', allowed=quoted_list(pack(names, names /= '')))
    end if
  end subroutine report_unknown

  !> The edge of a body, and a smooth contact there.
  subroutine check_edge(input, number, b, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: number   !! of the body
    type(boundary_input_t), intent(in)    :: b
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    character(*), parameter :: smooth = 'an edge along an axis, or contact = ''rough'', ''affine'''
    integer :: before

    before = errors%count()
    call check_number(input, number, b%edge, group, errors)
    if (errors%count() > before .or. b%contact /= 'smooth' .or. is_damaged(group, 'edge')) return
    if (.not. is_given(group, 'edge')) then
      call errors%add('a smooth boundary all round a body', where=place_of(group, 'contact'), &
                      found='no edge', allowed=smooth)
    else if (b%axis == 0) then
      call errors%add('a smooth boundary on an inclined edge', where=place_of(group, 'edge'), &
        found='edge '//integer_text(b%edge)//' of '''//b%body//'''', allowed=smooth)
    end if
  end subroutine check_edge

  !> Whether a body has an edge of this number; 0: none is given.
  subroutine check_number(input, number, edge, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: number   !! of the body
    integer,                intent(in)    :: edge
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: n

    associate (body => input%bodies(number))
      n = size(outline(body, input%discretisation%spacing), 2)
      if (n == 0) return   ! that has been reported
      if (body%shape == 'circle') then
        if (is_given(group, 'edge')) call errors%add('a circle has no edges', &
          where=place_of(group, 'edge'), found=integer_text(edge), allowed='body alone: all round')
      else if (edge > n) then
        call errors%add('the body '''//body%name//''' has no such edge', &
          where=place_of(group, 'edge'), found=integer_text(edge), &
          allowed='1 to '//integer_text(n))
      end if
    end associate
  end subroutine check_number

  !> What pressure k acts on, where it names a body.
  subroutine check_pressed_edges(input, k, group, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: number

    associate (p => input%pressures(k))
      if (.not. is_given(group, 'body')) then
        call add_useless(group, 'edge', 'without body', errors)
        return
      end if
      if (p%body == '') return
      if (is_given(group, 'side')) call errors%add('a pressure on a side and on a body', &
        where=place_of(group, 'body'), found='both', allowed='side, or body with or without edge')
      if (is_given(group, 'span') .and. .not. is_given(group, 'edge')) call errors%add( &
        'a span on all edges of a body', where=place_of(group, 'span'), found='no edge', &
        allowed='a span along one edge')
      number = body_number(input, p%body)
      if (number == 0) then
        call report_unknown(input, p%body, group, errors)
      else
        call check_number(input, number, p%edge, group, errors)
      end if
    end associate
  end subroutine check_pressed_edges

  !> An edge with two boundaries.
  subroutine check_twice(boundaries, k, group, errors)
    type(boundary_input_t), intent(in)    :: boundaries(:)
    integer,                intent(in)    :: k
    type(namelist_group_t), intent(in)    :: group
    type(error_list_t),     intent(inout) :: errors
    integer :: j

    do j = 1, k - 1
      if (boundaries(j)%body /= boundaries(k)%body) cycle
      if (boundaries(j)%edge /= boundaries(k)%edge .and. boundaries(j)%edge /= 0 &
          .and. boundaries(k)%edge /= 0) cycle
      call errors%add('two boundaries lie on the same edge', where=place_of(group, 'body'), &
        found=''''//boundaries(k)%body//''', where '''//boundaries(j)%name//''' lies', &
        allowed='each edge once')
      return
    end do
  end subroutine check_twice

end module pd_shape_checks
