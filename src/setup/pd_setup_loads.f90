!> From checked input to supports, platens and loads.
!>
!> Sides, layers and names become sets of points here; supports and loads know nothing else about
!> the body.
module pd_setup_loads
  use pd_affine_support, only: new_affine_support
  use pd_body, only: body_t
  use pd_errors, only: error_list_t
  use pd_input_shapes, only: body_number, is_bearing
  use pd_input_types, only: boundary_input_t, input_t, pressure_input_t
  use pd_kinds, only: is_set, wp
  use pd_loaded_platen, only: loaded_platen_t, new_loaded_platen
  use pd_loads, only: load_t
  use pd_model, only: model_t
  use pd_pages, only: clear_rows
  use pd_platens, only: new_platens
  use pd_point_sets, only: point_set_t, side_t
  use pd_pressure, only: new_pressure, pressure_t, spread_on_edges, spread_on_side, surface_t
  use pd_rigid_support, only: new_rigid_support
  use pd_setup_surface, only: edges_of, find_surface, taken
  use pd_sides, only: normal_axis, side_number
  use pd_sliding_support, only: new_sliding_support
  use pd_stages, only: stage_t
  use pd_supports, only: support_t
  use pd_tables, only: new_ramp, new_table, table_t
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: set_up_supports, set_up_platens, set_up_loads, taken

contains

  !> Supports, and the components that they leave free.
  !>
  !> Errors: a platen under a traction with points of different density.
  subroutine set_up_supports(input, stage, model, errors)
    type(input_t),      intent(in)    :: input
    type(stage_t),      intent(in)    :: stage
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: density(:), mass(:)
    integer,  allocatable :: beside(:)
    integer :: i, k, n

    n = size(model%points%volume)
    allocate (density(n), mass(n))
    call clear_rows(density, [1, 0])
    call clear_rows(mass, [1, 0])
    allocate (beside, source=model%body%points_beside())   ! on every rank
    do i = 1, size(beside)
      associate (row => model%operators%storage%row(beside(i)), &
        part => model%body%part_of(beside(i)))
        density(row) = model%materials%list(stage%material_of(part))%density
        if (model%at_equilibrium) cycle   ! nothing has kinetic energy
        mass(row) = density(row) * model%points%volume(row)
      end associate
    end do
    allocate (model%supports%items(size(input%boundaries)))
    do k = 1, size(input%boundaries)
      call new_support(input%boundaries, k, stage%boundary_since(k), mass, model, &
        model%supports%items(k)%support)
      if (size(input%boundaries(k)%traction) > 0) call check_density(input%boundaries(k)%name, &
        density(model%supports%items(k)%support%points), errors)
    end do
    call model%supports%divide(model%blocks, model%operators%domain%kept(n))
    call model%supports%mark_prescribed(model%points%free)
  end subroutine set_up_supports

  !> Points under a traction move as one because they all get the same force and damping per volume:
  !> with different densities they would not.
  subroutine check_density(name, density, errors)
    character(*),       intent(in)    :: name
    real(wp),           intent(in)    :: density(:)   !! of the points of a platen [kg/m^3]
    type(error_list_t), intent(inout) :: errors

    if (maxval(density) > minval(density)) call errors%add('a platen under a traction holds '// &
      'points of different density', '&boundary name = '//name, number_text(minval(density))// &
      ' to '//number_text(maxval(density)), 'one density [kg/m^3], or a prescribed velocity')
  end subroutine check_density

  !> Support number k, of the kind that its boundary describes.
  !> Without points where it is not there in this stage.
  subroutine new_support(given, k, since, mass, model, support)
    type(boundary_input_t), intent(in) :: given(:)
    integer,       intent(in) :: k
    real(wp),      intent(in) :: since            !! time from which it moves [s]
    real(wp),      intent(in) :: mass(:)          !! rho V (n) [kg/m]
    type(model_t), intent(in) :: model
    class(support_t), allocatable, intent(out) :: support
    type(point_set_t) :: set
    type(table_t) :: motion(3)
    type(loaded_platen_t) :: platen

    associate (b => given(k), body => model%body)
      set%name = b%name
      set%points = model%operators%storage%row(body%points_of(k))
      motion(1) = new_table(b%times, b%velocities_x, b%velocity(1))
      motion(2) = new_table(b%times, b%velocities_y, b%velocity(2))
      motion(3) = new_table(b%times, b%factors, 1.0_wp)
      motion%since = since
      if (b%contact == 'affine') then
        allocate (support, source=new_affine_support(set, b%velocity_gradient, motion(3), &
          model%points%position, mass))
      else if (size(b%traction) > 0 .and. size(set%points) > 0) then
        platen = new_loaded_platen(set, taken(b), b%traction, &
          loaded_lengths(given, body%sides(side_number(b%side)), body), b%ramp_time, &
          since)
        if (is_set(b%traction_until)) then
          platen%next = new_rigid_support(set, taken(b), motion(:2), mass)
          platen%until = b%traction_until
        end if
        allocate (support, source=platen)
      else if (is_bearing(b)) then
        allocate (support, source=new_sliding_support(set, b%axis, motion(:2), mass))
      else
        allocate (support, source=new_rigid_support(set, taken(b), motion(:2), mass))
      end if
    end associate
  end subroutine new_support

  !> Length of a side that carries x and y of a traction [m]: of the body, and of the layers at its
  !> ends where they slide along it and so stand for a body that goes on.
  pure function loaded_lengths(given, side, body) result(length)
    type(boundary_input_t), intent(in) :: given(:)
    type(side_t),           intent(in) :: side
    type(body_t),           intent(in) :: body
    real(wp) :: length(2), ends(2)
    integer  :: c, last

    last = size(side%points)
    do c = 1, 2
      ends = [side%lower, side%upper]
      if (slides(body%boundary_of(side%points(1)))) ends(1) = side%from(1)
      if (slides(body%boundary_of(side%points(last)))) ends(2) = side%to(last)
      length(c) = sum(max(0.0_wp, min(side%to, ends(2)) - max(side%from, ends(1))))
    end do

  contains

    !> Whether a boundary is a layer that slides along c.
    pure logical function slides(b)
      integer, intent(in) :: b
      logical :: components(2)

      slides = .false.
      if (b <= 0) return
      components = taken(given(b))
      slides = .not. components(c)
    end function slides

  end function loaded_lengths

  !> The two supports that approach each other, if there are such.
  subroutine set_up_platens(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model

    if (input%platens(1) == 0) return
    associate (first => input%platens(1), second => input%platens(2))
      model%platens = new_platens(normal_axis(input%boundaries(first)%side), input%platens, &
        model%supports%items(first)%support, model%supports%items(second)%support, &
        model%body%lower, model%body%upper)
    end associate
  end subroutine set_up_platens

  !> Loads, in the order in which they are added to the forces.
  !>
  !> Errors: a pressure that acts on no point.
  subroutine set_up_loads(input, stage, model, errors)
    type(input_t),      intent(in)    :: input
    type(stage_t),      intent(in)    :: stage
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    type(surface_t) :: surface
    integer :: k, n

    allocate (model%loads%items(count(stage%has_pressure)))
    if (size(model%loads%items) == 0) return
    call find_surface(input, stage, model, surface)
    n = 0
    do k = 1, size(input%pressures)
      if (.not. stage%has_pressure(k)) cycle
      n = n + 1
      call new_pressure_load(input, k, stage%pressure_since(k), surface, model, &
        model%loads%items(n)%load, errors)
    end do
  end subroutine set_up_loads

  !> Pressure number k, on a side or on edges of a body.
  subroutine new_pressure_load(input, k, since, surface, model, load, errors)
    type(input_t),          intent(in)    :: input
    integer,                intent(in)    :: k
    real(wp),               intent(in)    :: since    !! time at which it sets in [s]
    type(surface_t),        intent(in)    :: surface
    type(model_t),          intent(in)    :: model
    class(load_t), allocatable, intent(out) :: load
    type(error_list_t),     intent(inout) :: errors
    type(pressure_t) :: pressure

    associate (given => input%pressures(k))
      pressure = new_pressure(given%name, place_in_words(given), given%value, given%span, &
        given%ramp_time)
      pressure%factor = new_ramp(given%ramp_time, since)
      if (given%body == '') then
        call spread_on_side(surface, model%body%sides(side_number(given%side)), pressure)
      else
        call spread_on_edges(surface, edges_of(input, model%spacing, body_number(input, &
          given%body), given%edge, surface%weights%edges%number), pressure)
      end if
      pressure%points = model%operators%storage%row(pressure%points)
      if (size(pressure%points) == 0) &
        call errors%add('a pressure acts on no point', '&pressure name = '//given%name)
    end associate
    allocate (load, source=pressure)
  end subroutine new_pressure_load

  !> What a pressure acts on, for its description.
  pure function place_in_words(given) result(text)
    type(pressure_input_t), intent(in) :: given
    character(:), allocatable :: text

    if (given%body == '') then
      text = given%side
    else if (given%edge > 0) then
      text = 'edge '//integer_text(given%edge)//' of '//given%body
    else
      text = 'the rim of '//given%body
    end if
  end function place_in_words

end module pd_setup_loads
