!> From checked input and a body to the model: operators, materials, boundaries, loads.
module pd_setup
  use pd_bond_list, only: bond_list_t, new_bond_list
  use pd_boundary, only: boundary_t, control_by_force, mark_free, new_affine_boundary, new_ramp, &
    new_rigid_boundary, table_t
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, new_horizon
  use pd_geometry, only: body_t, side_number
  use pd_input_types, only: boundary_input_t, input_t
  use pd_kinds, only: wp
  use pd_lattice, only: lattice_operators_t, new_lattice_operators
  use pd_model, only: model_t
  use pd_pressure, only: spread_pressure, surface_vectors
  use pd_setup_materials, only: set_up_materials, set_up_points
  use pd_shape_tensor, only: invert_shape_tensors
  implicit none
  private

  public :: set_up_model

contains

  !> Operators, material, boundaries, motion.
  !>
  !> Errors: points that coincide, families that are too small, no free point, a pressure that acts
  !> on none.
  subroutine set_up_model(input, model, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(inout) :: model    !! in: with its body
    type(error_list_t), intent(inout) :: errors
    type(horizon_t) :: horizon

    model%spacing = input%discretisation%spacing
    model%delta = input%discretisation%horizon
    horizon = new_horizon(model%delta, input%discretisation%influence)
    call choose_operators(horizon, input%run%operators, model, errors)
    if (errors%count() > 0) return
    model%blocks = model%operators%domain%blocks
    call set_up_points(model)
    call invert_shape_tensors(model%operators, model%points%position, model%points%volume, errors)
    if (errors%count() > 0) return
    call set_up_materials(input, model)
    call set_up_boundaries(input, model)
    call set_up_pressures(input, model, errors)
    if (.not. any(model%points%free > 0.0_wp)) call errors%add('no point is free to move')
  end subroutine set_up_model

  !> Lattice operators for a body on a lattice, unless a list is asked for; the bond list for any
  !> other.
  subroutine choose_operators(horizon, form, model, errors)
    type(horizon_t),    intent(in)    :: horizon
    character(*),       intent(in)    :: form   !! auto, lattice or list
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(lattice_operators_t), allocatable :: lattice
    type(bond_list_t),         allocatable :: list

    if (allocated(model%body%place) .and. form /= 'list') then
      allocate (lattice)
      call new_lattice_operators(horizon, model%spacing, model%body%place, model%body%volume, &
        lattice)
      call move_alloc(lattice, model%operators)
    else
      allocate (list)
      call new_bond_list(horizon, model%body%position, model%body%volume, list, errors)
      call move_alloc(list, model%operators)
    end if
  end subroutine choose_operators

  !> Boundaries with their motions, platens, damping.
  subroutine set_up_boundaries(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model
    integer :: k

    allocate (model%boundaries(size(input%boundaries)))
    do k = 1, size(input%boundaries)
      model%boundaries(k) = new_boundary(input%boundaries, k, model%body)
    end do
    do k = 1, size(model%boundaries)
      model%boundaries(k)%points = model%operators%storage%row(model%boundaries(k)%points)
    end do
    call mark_free(model%points%position, model%points%volume, input%material%density, &
      model%boundaries, model%points%free)

    model%damping = input%integration%damping
    if (input%platens(1) == 0) return
    associate (p => model%platens, body => model%body)
      p%first = input%platens(1)
      p%second = input%platens(2)
      p%axis = merge(1, 2, input%boundaries(p%first)%side == 'left')
      p%start = body%lower(p%axis)
      p%length = body%upper(p%axis) - body%lower(p%axis)
      p%width = body%upper(3 - p%axis) - body%lower(3 - p%axis)
      model%points%place = min(1.0_wp, max(0.0_wp, (model%points%position(:, p%axis) - p%start) &
        / p%length))
    end associate
    model%damped_in_frame = input%integration%damping_frame == 'platens'
  end subroutine set_up_boundaries

  !> Pressures on sides of the body.
  subroutine set_up_pressures(input, model, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: vectors(:, :)
    integer :: depth, k

    allocate (model%pressures(size(input%pressures)))
    if (size(input%pressures) == 0) return
    allocate (vectors(model%operators%n, 2), source=0.0_wp)
    call surface_vectors(model%operators, model%points%volume, vectors)
    vectors = vectors(model%operators%storage%row, :)
    depth = 2 * ceiling(model%delta / model%spacing - 1.0e-6_wp)   ! families that touch cut ones
    do k = 1, size(input%pressures)
      associate (given => input%pressures(k), pressure => model%pressures(k))
        pressure%name = given%name
        pressure%side = given%side
        pressure%value = given%value
        if (size(given%span) > 0) pressure%span = given%span
        pressure%factor = new_ramp(given%ramp_time)
        call spread_pressure(model%body, model%boundaries, vectors, model%spacing, depth, pressure)
        pressure%points = model%operators%storage%row(pressure%points)
        if (size(pressure%points) == 0) &
          call errors%add('a pressure acts on no point', '&pressure name = '//given%name)
      end associate
    end do
  end subroutine set_up_pressures

  !> Boundary k of the body.
  type(boundary_t) function new_boundary(all_given, k, body) result(boundary)
    type(boundary_input_t), intent(in) :: all_given(:)
    integer,                intent(in) :: k
    type(body_t),           intent(in) :: body
    type(table_t) :: tables(2)
    integer, allocatable :: points(:)
    logical  :: prescribed(2)
    real(wp) :: length(2)
    integer  :: i

    associate (given => all_given(k))
      allocate (points(count(body%boundary == k)))
      points = pack([(i, i=1, body%n)], body%boundary == k)
      if (given%contact == 'affine') then
        tables(1) = new_table(given%times, given%factors, 1.0_wp)
        boundary = new_affine_boundary(given%name, points, given%velocity_gradient, tables(1))
        return
      end if
      prescribed = .true.
      if (given%contact == 'smooth') then
        prescribed = [given%side == 'left' .or. given%side == 'right', &
          given%side == 'bottom' .or. given%side == 'top']
      end if
      tables(1) = new_table(given%times, given%velocities_x, given%velocity(1))
      tables(2) = new_table(given%times, given%velocities_y, given%velocity(2))
      boundary = new_rigid_boundary(given%name, points, prescribed, tables(1), tables(2))
      if (size(given%traction) == 0) return
      length = [(loaded_length(all_given, given%side, i, body), i=1, 2)]
      call control_by_force(given%traction * length, new_ramp(given%ramp_time), boundary)
    end associate
  end function new_boundary

  !> Length of a side that carries component c of a traction [m]: of the body, and of the layers
  !> at its ends where they slide along c and so stand for a body that goes on.
  pure real(wp) function loaded_length(given, side_name, c, body) result(length)
    type(boundary_input_t), intent(in) :: given(:)
    character(*),           intent(in) :: side_name
    integer,                intent(in) :: c
    type(body_t),           intent(in) :: body
    real(wp) :: ends(2)
    integer  :: along, last

    along = merge(1, 2, side_name == 'bottom' .or. side_name == 'top')
    ends = [body%lower(along), body%upper(along)]
    associate (side => body%sides(side_number(side_name)))
      last = size(side%points)
      if (slides(body%boundary(side%points(1)))) ends(1) = side%from(1)
      if (slides(body%boundary(side%points(last)))) ends(2) = side%to(last)
      length = sum(max(0.0_wp, min(side%to, ends(2)) - max(side%from, ends(1))))
    end associate

  contains

    !> Whether a boundary is a layer that slides along c.
    pure logical function slides(b)
      integer, intent(in) :: b

      slides = .false.
      if (b > 0) slides = given(b)%contact == 'smooth' .and. (c == 2 .eqv. &
        (given(b)%side == 'left' .or. given(b)%side == 'right'))
    end function slides

  end function loaded_length

  !> Table from the input; without one, a constant.
  pure type(table_t) function new_table(times, rates, constant) result(table)
    real(wp), intent(in) :: times(:), rates(:), constant

    if (size(times) > 0 .and. size(rates) > 0) then
      allocate (table%times(size(times)), source=times)
      allocate (table%rates(size(times)), source=rates)
    else
      allocate (table%times(1), source=0.0_wp)
      allocate (table%rates(1), source=constant)
    end if
  end function new_table

end module pd_setup
