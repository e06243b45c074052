!> From a namelist file to checked values: all mistakes of the file are listed at once.
module pd_input
  use pd_errors, only: error_list_t
  use pd_ground_checks, only: check_ground
  use pd_input_checks, only: check_model, resolved_path
  use pd_input_printer, only: write_input
  use pd_input_settings, only: apply_settings, setting_t
  use pd_input_shapes, only: axis_of
  use pd_input_types, only: all_keys, input_t
  use pd_input_values, only: check_groups, count_groups
  use pd_key_list, only: key_list_t
  use pd_key_reader, only: key_reader_t
  use pd_load_checks, only: check_loads
  use pd_material_checks, only: check_materials
  use pd_motion_checks, only: check_motion
  use pd_namelist, only: scan_namelist
  use pd_namelist_groups, only: namelist_group_t
  use pd_platen_checks, only: platens_of
  use pd_shape_checks, only: check_shapes
  use pd_stage_checks, only: check_stages
  use pd_text_file, only: read_text_file
  use pd_used_values, only: compare_used, same_end, used_values
  implicit none
  private

  public :: read_input, print_input, used_values, compare_used, same_end, resolved_path
  public :: setting_t

contains

  !> Read and check an input file. `settings`, each 'group.key=value' as `--set` takes it, replace
  !> values of the file.
  !>
  !> Without errors `input` holds the values as used: defaults filled, every allocatable allocated,
  !> lists and tables of size 0 where absent, numbers without default `unset` where not given.
  !> Errors: every mistake of the file, or why it cannot be read; `input` is then of no use.
  subroutine read_input(path, input, errors, settings)
    character(*),       intent(in)    :: path
    type(input_t),      intent(out)   :: input
    type(error_list_t), intent(inout) :: errors
    type(setting_t), optional, intent(in) :: settings(:)
    type(namelist_group_t), allocatable :: groups(:)

    call read_groups(path, input, groups, errors, settings)
  end subroutine read_input

  !> Write the input file that gives the same values as used, on a unit that is open for
  !> formatted writing; nothing where there are errors.
  subroutine print_input(path, unit, errors, settings)
    character(*),       intent(in)    :: path
    integer,            intent(in)    :: unit
    type(error_list_t), intent(inout) :: errors
    type(setting_t), optional, intent(in) :: settings(:)
    type(namelist_group_t), allocatable :: groups(:)
    type(input_t) :: input

    call read_groups(path, input, groups, errors, settings)
    if (errors%count() == 0) call write_input(input, groups, unit)
  end subroutine print_input

  !> The values, and the groups that they come from.
  subroutine read_groups(path, input, groups, errors, settings)
    character(*),       intent(in)    :: path
    type(input_t),      intent(out)   :: input
    type(namelist_group_t), allocatable, intent(out) :: groups(:)
    type(error_list_t), intent(inout) :: errors
    type(setting_t), optional, intent(in) :: settings(:)
    type(key_list_t) :: list
    integer :: before
    logical :: complete

    input%path = trim(path)
    before = errors%count()
    call read_text_file(input%path, input%text, errors)
    if (errors%count() > before) return
    call scan_namelist(input%path, input%text, groups, errors, complete)
    if (.not. complete) return
    list = all_keys()
    if (present(settings)) call apply_settings(settings, list, input%path, groups, errors)
    call check_groups(groups, list, errors, input%path)
    call fill(groups, input)
    call check_model(input, groups, errors)
    call check_shapes(input, groups, errors)
    call check_materials(input, groups, errors)
    call check_motion(input, groups, errors)
    call check_loads(input, groups, errors)
    call check_ground(input, groups, errors)
    call check_stages(input, groups, errors)
  end subroutine read_groups

  !> All values of the file, and defaults for the rest.
  subroutine fill(groups, input)
    type(namelist_group_t), intent(in)    :: groups(:)
    type(input_t),          intent(inout) :: input
    type(key_reader_t) :: reader
    integer :: k

    allocate (input%bodies(count_groups(groups, 'body')))
    allocate (input%cuts(count_groups(groups, 'cut')))
    allocate (input%materials(count_groups(groups, 'material')))
    allocate (input%boundaries(count_groups(groups, 'boundary')))
    allocate (input%pressures(count_groups(groups, 'pressure')))
    allocate (input%probes(count_groups(groups, 'probe')))
    allocate (input%stages(count_groups(groups, 'stage')))
    allocate (input%strength_reduction(min(1, count_groups(groups, 'strength_reduction'))))
    call reader%open(groups, input%path)
    call input%visit(reader)
    call input%run%complete()
    call input%output%complete()
    do k = 1, size(input%bodies)
      if (input%bodies(k)%role == 'hole') cycle
      if (input%bodies(k)%material == '' .and. size(input%materials) > 0) &
        input%bodies(k)%material = input%materials(1)%name
    end do
    do k = 1, size(input%boundaries)
      input%boundaries(k)%axis = axis_of(input, input%boundaries(k))
    end do
    input%platens = platens_of(input%boundaries)
    if (size(input%stages) == 0) return
    input%platens = 0   ! which are there changes
    input%integration%end_time = input%stages(size(input%stages))%end_time
  end subroutine fill

end module pd_input
