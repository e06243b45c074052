!> From a namelist file to checked values: every mistake of the file is listed in one go.
module pd_input
  use pd_errors, only: error_list_t
  use pd_input_checks, only: check_model, resolved_path
  use pd_input_types, only: boundary_input_t, input_t, pressure_input_t
  use pd_input_values, only: check_groups, count_groups, group_named, is_given, take_integer, &
    take_list, take_real, take_text, take_vector
  use pd_kinds, only: wp
  use pd_load_checks, only: check_loads
  use pd_motion_checks, only: check_motion
  use pd_namelist, only: namelist_group_t, read_text_file, scan_namelist
  use pd_platen_checks, only: platens_of
  use pd_used_values, only: compare_used, used_values
  implicit none
  private

  public :: read_input, used_values, compare_used, resolved_path

  integer, parameter :: frames_by_default = 10

contains

  !> Read and check an input file.
  !>
  !> Without errors `input` holds the values as used: defaults filled, every allocatable allocated,
  !> lists and tables of size 0 where absent, numbers without default `unset` where not given.
  !> Errors: every mistake of the file, or why it cannot be read; `input` is then of no use.
  subroutine read_input(path, input, errors)
    character(*),       intent(in)    :: path
    type(input_t),      intent(out)   :: input
    type(error_list_t), intent(inout) :: errors
    type(namelist_group_t), allocatable :: groups(:)
    integer :: before
    logical :: complete

    input%path = trim(path)
    before = errors%count()
    call read_text_file(input%path, input%text, errors)
    if (errors%count() > before) return
    call scan_namelist(input%path, input%text, groups, errors, complete)
    if (.not. complete) return
    call check_groups(groups, errors, input%path)
    call fill(groups, input)
    call check_model(input, groups, errors)
    call check_motion(input, groups, errors)
    call check_loads(input, groups, errors)
  end subroutine read_input

  !> All values of the file and the defaults of the rest.
  subroutine fill(groups, input)
    type(namelist_group_t), intent(in)    :: groups(:)
    type(input_t),          intent(inout) :: input
    integer :: k

    call fill_run(group_named(groups, 'run', 1, input%path), input)
    call fill_discretisation(group_named(groups, 'discretisation', 1, input%path), input)
    allocate (input%bodies(count_groups(groups, 'body')))
    do k = 1, size(input%bodies)
      call fill_body(group_named(groups, 'body', k, input%path), input, k)
    end do
    call fill_material(group_named(groups, 'material', 1, input%path), input)
    allocate (input%boundaries(count_groups(groups, 'boundary')))
    do k = 1, size(input%boundaries)
      call fill_boundary(group_named(groups, 'boundary', k, input%path), input%boundaries(k))
    end do
    input%platens = platens_of(input%boundaries)
    allocate (input%pressures(count_groups(groups, 'pressure')))
    do k = 1, size(input%pressures)
      call fill_pressure(group_named(groups, 'pressure', k, input%path), input%pressures(k))
    end do
    call fill_stabilisation(group_named(groups, 'stabilisation', 1, input%path), input)
    call fill_integration(group_named(groups, 'integration', 1, input%path), input)
    call fill_imperfection(group_named(groups, 'imperfection', 1, input%path), input)
    call fill_random_field(group_named(groups, 'random_field', 1, input%path), input)
    call fill_output(group_named(groups, 'output', 1, input%path), input)
  end subroutine fill

  subroutine fill_run(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_text(group, 'name', input%run%name)
    call take_text(group, 'title', input%run%title)
    call take_text(group, 'output_dir', input%run%output_dir)
    call take_text(group, 'operators', input%run%operators)
    if (.not. is_given(group, 'title')) input%run%title = input%run%name
    if (.not. is_given(group, 'output_dir')) input%run%output_dir = 'results/'//input%run%name
  end subroutine fill_run

  subroutine fill_discretisation(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_real(group, 'spacing', input%discretisation%spacing)
    call take_real(group, 'horizon', input%discretisation%horizon)
    call take_text(group, 'layout', input%discretisation%layout)
    call take_text(group, 'volumes', input%discretisation%volumes)
    call take_text(group, 'influence', input%discretisation%influence)
    call take_text(group, 'fit', input%discretisation%fit)
  end subroutine fill_discretisation

  subroutine fill_body(group, input, k)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input
    integer,                intent(in)    :: k

    call take_text(group, 'shape', input%bodies(k)%shape)
    call take_text(group, 'file', input%bodies(k)%file)
    call take_real(group, 'x_min', input%bodies(k)%x_min)
    call take_real(group, 'x_max', input%bodies(k)%x_max)
    call take_real(group, 'y_min', input%bodies(k)%y_min)
    call take_real(group, 'y_max', input%bodies(k)%y_max)
  end subroutine fill_body

  subroutine fill_material(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_text(group, 'model', input%material%model)
    call take_text(group, 'strain_measure', input%material%strain_measure)
    call take_real(group, 'density', input%material%density)
    call take_real(group, 'youngs_modulus', input%material%youngs_modulus)
    call take_real(group, 'poissons_ratio', input%material%poissons_ratio)
    call take_real(group, 'yield_stress', input%material%yield_stress)
    call take_real(group, 'kinematic_modulus', input%material%kinematic_modulus)
    call take_real(group, 'isotropic_modulus', input%material%isotropic_modulus)
    call take_real(group, 'residual_strength', input%material%residual_strength)
  end subroutine fill_material

  subroutine fill_boundary(group, boundary)
    type(namelist_group_t), intent(in)    :: group
    type(boundary_input_t), intent(inout) :: boundary

    call take_text(group, 'name', boundary%name)
    call take_text(group, 'side', boundary%side)
    call take_text(group, 'contact', boundary%contact)
    call take_vector(group, 'velocity', boundary%velocity)
    call take_list(group, 'times', boundary%times)
    call take_list(group, 'velocities_x', boundary%velocities_x)
    call take_list(group, 'velocities_y', boundary%velocities_y)
    call take_vector(group, 'velocity_gradient', boundary%velocity_gradient)
    call take_list(group, 'factors', boundary%factors)
    call take_list(group, 'traction', boundary%traction)
    call take_real(group, 'ramp_time', boundary%ramp_time)
  end subroutine fill_boundary

  subroutine fill_pressure(group, pressure)
    type(namelist_group_t), intent(in)    :: group
    type(pressure_input_t), intent(inout) :: pressure

    call take_text(group, 'name', pressure%name)
    call take_text(group, 'side', pressure%side)
    call take_list(group, 'span', pressure%span)
    call take_real(group, 'value', pressure%value)
    call take_real(group, 'ramp_time', pressure%ramp_time)
  end subroutine fill_pressure

  subroutine fill_stabilisation(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_text(group, 'method', input%stabilisation%method)
    call take_real(group, 'factor', input%stabilisation%factor)
  end subroutine fill_stabilisation

  subroutine fill_integration(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_real(group, 'end_time', input%integration%end_time)
    call take_real(group, 'final_strain', input%integration%final_strain)
    call take_text(group, 'time_step_rule', input%integration%time_step_rule)
    call take_real(group, 'time_step', input%integration%time_step)
    call take_real(group, 'safety', input%integration%safety)
    call take_real(group, 'damping', input%integration%damping)
    call take_text(group, 'damping_frame', input%integration%damping_frame)
  end subroutine fill_integration

  !> Without a weak patch its centre and radius need not be given; they are 0 then.
  subroutine fill_imperfection(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_real(group, 'amplitude', input%imperfection%amplitude)
    call take_real(group, 'x', input%imperfection%x)
    call take_real(group, 'y', input%imperfection%y)
    call take_real(group, 'radius', input%imperfection%radius)
    if (.not. is_given(group, 'x')) input%imperfection%x = 0.0_wp
    if (.not. is_given(group, 'y')) input%imperfection%y = 0.0_wp
    if (.not. is_given(group, 'radius')) input%imperfection%radius = 0.0_wp
  end subroutine fill_imperfection

  subroutine fill_random_field(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    associate (f => input%random_field)
      call take_real(group, 'coefficient_of_variation', f%coefficient_of_variation)
      call take_real(group, 'correlation_length', f%correlation_length)
      call take_integer(group, 'seed', f%seed)
    end associate
  end subroutine fill_random_field

  subroutine fill_output(group, input)
    type(namelist_group_t), intent(in)    :: group
    type(input_t),          intent(inout) :: input

    call take_list(group, 'frame_strains', input%output%frame_strains)
    call take_list(group, 'frame_times', input%output%frame_times)
    call take_integer(group, 'frame_count', input%output%frame_count)
    call take_integer(group, 'history_count', input%output%history_count)
    call take_real(group, 'checkpoint_every', input%output%checkpoint_every)
    if (.not. (is_given(group, 'frame_strains') .or. is_given(group, 'frame_times') &
               .or. is_given(group, 'frame_count'))) input%output%frame_count = frames_by_default
  end subroutine fill_output

end module pd_input
