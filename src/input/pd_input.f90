!> From a namelist file to checked values: every mistake of the file is listed in one go.
module pd_input
  use pd_errors, only: error_list_t
  use pd_input_checks, only: check_model, resolved_path
  use pd_input_types, only: input_t
  use pd_input_values, only: check_groups, count_groups, group_named, take_integer, take_list, &
    take_real, take_text, take_vector
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: is_set, wp
  use pd_load_checks, only: check_loads
  use pd_motion_checks, only: check_motion
  use pd_namelist, only: namelist_group_t, read_text_file, scan_namelist
  use pd_platen_checks, only: platens_of
  use pd_settings, only: apply_settings, setting_t
  use pd_used_values, only: compare_used, used_values
  implicit none
  private

  public :: read_input, used_values, compare_used, resolved_path

  integer, parameter :: frames_by_default = 10

  !> Fetches the value of every key.
  type, extends(key_visitor_t) :: reader_t
    character(:), allocatable :: path
    type(namelist_group_t), allocatable :: groups(:)
    type(namelist_group_t) :: here          !! the group that the keys belong to
  contains
    procedure :: group => read_group
    procedure :: text => read_text
    procedure :: number => read_number
    procedure :: whole => read_whole
    procedure :: numbers => read_numbers
    procedure :: list => read_list
  end type reader_t

contains

  !> Read and check an input file, with values of the command line in place of those in the file.
  !>
  !> Without errors `input` holds the values as used: defaults filled, every allocatable allocated,
  !> lists and tables of size 0 where absent, numbers without default `unset` where not given.
  !> Errors: every mistake of the file, or why it cannot be read; `input` is then of no use.
  subroutine read_input(path, settings, input, errors)
    character(*),       intent(in)    :: path
    type(setting_t),    intent(in)    :: settings(:)   !! group.key=value
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
    call apply_settings(input%path, settings, groups, errors)
    call check_groups(groups, errors, input%path)
    input%groups = groups
    call fill(groups, input)
    call check_model(input, groups, errors)
    call check_motion(input, groups, errors)
    call check_loads(input, groups, errors)
  end subroutine read_input

  !> All values of the file and the defaults of the rest.
  subroutine fill(groups, input)
    type(namelist_group_t), intent(in)    :: groups(:)
    type(input_t),          intent(inout) :: input
    type(reader_t) :: reader
    integer :: k

    allocate (input%bodies(count_groups(groups, 'body')))
    allocate (input%materials(max(1, count_groups(groups, 'material'))))
    allocate (input%boundaries(count_groups(groups, 'boundary')))
    allocate (input%pressures(count_groups(groups, 'pressure')))
    reader%path = input%path
    reader%groups = groups
    call input%visit(reader)
    input%platens = platens_of(input%boundaries)
    do k = 1, size(input%bodies)
      if (input%bodies(k)%material == '') input%bodies(k)%material = input%materials(1)%name
    end do
    associate (r => input%run, o => input%output, p => input%imperfection)
      if (r%title == '') r%title = r%name
      if (r%output_dir == '') r%output_dir = 'results/'//r%name
      if (size(o%frame_strains) == 0 .and. size(o%frame_times) == 0 .and. o%frame_count == 0) &
        o%frame_count = frames_by_default
      ! without a weak patch its centre and radius need not be given
      if (.not. is_set(p%x)) p%x = 0.0_wp
      if (.not. is_set(p%y)) p%y = 0.0_wp
      if (.not. is_set(p%radius)) p%radius = 0.0_wp
    end associate
  end subroutine fill

  subroutine read_group(self, about)
    class(reader_t),   intent(inout) :: self
    type(group_key_t), intent(in)    :: about

    self%here = group_named(self%groups, trim(about%name), about%number, self%path)
  end subroutine read_group

  subroutine read_text(self, key, value)
    class(reader_t),           intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: value

    call take_text(self%here, key, value)
  end subroutine read_text

  subroutine read_number(self, key, value)
    class(reader_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    real(wp),        intent(inout) :: value

    call take_real(self%here, key, value)
  end subroutine read_number

  subroutine read_whole(self, key, value)
    class(reader_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    integer,         intent(inout) :: value

    call take_integer(self%here, key, value)
  end subroutine read_whole

  subroutine read_numbers(self, key, values)
    class(reader_t), intent(inout) :: self
    type(key_t),     intent(in)    :: key
    real(wp),        intent(inout) :: values(:)

    call take_vector(self%here, key, values)
  end subroutine read_numbers

  subroutine read_list(self, key, values)
    class(reader_t),       intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: values(:)

    call take_list(self%here, key, values)
  end subroutine read_list

end module pd_input
