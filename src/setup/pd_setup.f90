!> From checked input to the model: body, operators, material, boundaries, motion, schedule.
!>
!> The only module that knows both the input and the physics.
module pd_setup
  use pd_bond_list, only: bond_list_t, new_bond_list
  use pd_boundary, only: boundary_t, control_by_force, mark_free, new_affine_boundary, new_ramp, &
    new_rigid_boundary, table_t, time_of_strain
  use pd_clock, only: clock_t
  use pd_cloud, only: read_cloud
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, new_horizon
  use pd_elastic, only: new_elastic
  use pd_geometry, only: body_t, lattice_body, lattice_t, layer_t, nearest_count, side_number
  use pd_input, only: resolved_path
  use pd_green_lagrange, only: green_lagrange_t
  use pd_input_types, only: boundary_input_t, input_t, material_input_t
  use pd_j2, only: new_j2
  use pd_kinds, only: is_set, wp
  use pd_law, only: law_t
  use pd_materials, only: divide_into_runs
  use pd_measure, only: measure_t
  use pd_shape_tensor, only: invert_shape_tensors
  use pd_lattice, only: lattice_operators_t, new_lattice_operators
  use pd_model, only: model_t
  use pd_operators, only: control_stiffness
  use pd_pressure, only: spread_pressure, surface_vectors
  use pd_random_field, only: lognormal, longest_way, new_random_field, &
    standard_normal
  use pd_schedule, only: new_schedule, schedule_t
  use pd_stability, only: find_highest_frequency
  implicit none
  private

  public :: set_up_body, set_up_model, set_up_schedule

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

  !> Whether a random field can be shown by the points, and whether it can be computed.
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

  !> Body from a point cloud. Where the input gives its real extent, that counts.
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

  !> What does not change at the points.
  subroutine set_up_points(model)
    type(model_t), intent(inout) :: model

    associate (points => model%points, body => model%body, storage => model%operators%storage)
      points%position = storage%spread(body%position)
      points%volume = storage%spread(body%volume)
      points%in_body = storage%spread(merge(1.0_wp, 0.0_wp, body%boundary == 0))
      points%free = spread(storage%spread(spread(1.0_wp, 1, body%n)), 2, 2)
      allocate (points%place(storage%rows), source=0.0_wp)
    end associate
  end subroutine set_up_points

  !> Materials, initial strength, zero-energy control.
  subroutine set_up_materials(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: strength(:)

    allocate (model%materials%list(1))
    associate (m => input%material, material => model%materials%list(1))
      material%name = 'material'
      material%density = m%density
      material%youngs_modulus = m%youngs_modulus
      allocate (material%measure, source=new_measure(m%strain_measure))
      allocate (material%law, source=new_law(m))
      call divide_into_runs(model%blocks, &
        model%operators%storage%spread(spread(1, 1, model%body%n)), model%materials)
      allocate (strength(model%body%n))
      call set_up_strength(input, model%body%position, strength)
      model%strength = model%operators%storage%spread(strength)
      if (input%stabilisation%method == 'silling') call set_up_control( &
        input%stabilisation%factor, m%youngs_modulus, model)
    end associate
  end subroutine set_up_materials

  !> The law of a material.
  pure function new_law(given) result(law)
    type(material_input_t), intent(in) :: given
    class(law_t), allocatable :: law

    select case (given%model)
    case ('elastic')
      allocate (law, source=new_elastic(given%youngs_modulus, given%poissons_ratio))
    case ('j2')
      allocate (law, source=new_j2(given%youngs_modulus, given%poissons_ratio, &
        given%kinematic_modulus, given%isotropic_modulus, max(0.0_wp, given%residual_strength)))
    end select
  end function new_law

  !> The strain measure of a material.
  pure function new_measure(name) result(measure)
    character(*), intent(in) :: name
    class(measure_t), allocatable :: measure

    select case (name)
    case ('green_lagrange')
      allocate (green_lagrange_t :: measure)
    end select
  end function new_measure

  !> Control of zero-energy modes after Silling: c_i = g C_0 / W_i with C_0 = 48 E / (5 pi delta^2).
  subroutine set_up_control(factor, youngs_modulus, model)
    real(wp),      intent(in)    :: factor           !! g
    real(wp),      intent(in)    :: youngs_modulus   !! E [Pa]
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: c(:)

    allocate (c(model%operators%n), source=control_stiffness(factor, youngs_modulus, model%delta, &
      model%operators%weight_sum))
    where (model%points%volume <= 0.0_wp) c = 0.0_wp
    call model%operators%set_control(c)
  end subroutine set_up_control

  !> sigma_y0 of every point: the same everywhere or a random field, reduced in the weak patch.
  subroutine set_up_strength(input, position, yield_stress)
    type(input_t), intent(in)  :: input
    real(wp),      intent(in),  contiguous :: position(:, :)    !! X (n,2) [m]
    real(wp),      intent(out), contiguous :: yield_stress(:)   !! (n) [Pa]
    integer :: i

    associate (mean => max(0.0_wp, input%material%yield_stress), field => input%random_field, &
      flaw => input%imperfection)
      yield_stress = mean
      if (is_set(field%coefficient_of_variation)) then
        call standard_normal(new_random_field(field%correlation_length, field%seed), position, &
          yield_stress)
        yield_stress = lognormal(mean, field%coefficient_of_variation, yield_stress)
      end if
      if (flaw%amplitude <= 0.0_wp) return
      do i = 1, size(yield_stress)
        if (norm2(position(i, :) - [flaw%x, flaw%y]) <= flaw%radius * (1.0_wp + 1.0e-6_wp)) &
          yield_stress(i) = (1.0_wp - flaw%amplitude) * yield_stress(i)
      end do
    end associate
  end subroutine set_up_strength

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

  !> Time step by the rule asked for, and the steps of the run, its frames and rows.
  !>
  !> `clock`: in: that of a checkpoint; with a time step of 0 the rule decides.
  !> Errors: a run with too many steps, a strain that is never reached.
  subroutine set_up_schedule(input, clock, model, schedule, errors)
    type(input_t),      intent(in)    :: input
    type(clock_t),      intent(inout) :: clock
    type(model_t),      intent(inout) :: model
    type(schedule_t),   intent(out)   :: schedule
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: frame_times(:)
    real(wp) :: end_time
    integer  :: k

    associate (given => input%integration, dt => clock%time_step)
      if (dt <= 0.0_wp) then
        select case (given%time_step_rule)
        case ('fixed')
          dt = given%time_step
        case ('courant')
          dt = given%safety * model%spacing / model%materials%wave_speed()
        case ('spectral')
          call find_highest_frequency(model)
          dt = given%safety * 2.0_wp / model%highest_frequency
        end select
      end if
      end_time = given%end_time
      if (is_set(given%final_strain)) end_time = strain_time(given%final_strain)
    end associate

    associate (given => input%output)
      if (size(given%frame_strains) > 0) then
        allocate (frame_times(size(given%frame_strains)))
        do k = 1, size(frame_times)
          frame_times(k) = strain_time(given%frame_strains(k))
        end do
      else if (size(given%frame_times) > 0) then
        allocate (frame_times(size(given%frame_times)), source=given%frame_times)
      else
        allocate (frame_times(given%frame_count))
        frame_times = [(end_time * real(k, wp) / real(size(frame_times), wp), &
          k=1, size(frame_times))]
      end if
    end associate
    if (errors%count() > 0) return
    if (any(frame_times > end_time * (1.0_wp + 1.0e-9_wp))) then
      call errors%add('a frame is asked for after the end of the run', '&output')
      return
    end if
    call new_schedule(clock%time_step, end_time, input%output%history_count, frame_times, &
      schedule, errors)

  contains

    !> Time at which the nominal strain reaches a value.
    real(wp) function strain_time(strain) result(time)
      real(wp), intent(in) :: strain
      character(24) :: text

      time = time_of_strain(model%platens, model%boundaries, strain)
      if (time > 0.0_wp) return
      write (text, '(g0.6)') strain
      call errors%add('the motion of the platens never reaches a nominal strain', &
        '&integration final_strain or &output frame_strains', trim(text))
    end function strain_time

  end subroutine set_up_schedule

end module pd_setup
