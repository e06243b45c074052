!> A frame in a result file: its fields, with their units, and how it gets there.
module pd_frames
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_errors, only: error_list_t
  use pd_hdf5, only: create_group, flush_file, hdf5_file_t, overwrite_rows, read_attribute, &
    read_dataset, reserve_dataset, write_attribute
  use pd_kinds, only: wp
  use pd_xdmf, only: field_t
  implicit none
  private

  public :: frame_source_t, frame_fields_t, fields_of_a_frame, frame_name
  public :: reserve_frame, put_frame, mark_frame, copy_frame, label

  !> Where the fields of a frame come from, one after the other: a large body has no room for all
  !> of them at once.
  type, abstract :: frame_source_t
  contains
    procedure(number_of), deferred :: points
    procedure(field_of), deferred :: field
  end type frame_source_t

  abstract interface
    !> Number of points.
    pure integer function number_of(self)
      import :: frame_source_t
      class(frame_source_t), intent(in) :: self
    end function number_of
    !> One of `fields_of_a_frame`, point by point as it goes to the file.
    subroutine field_of(self, name, values)
      import :: frame_source_t, wp
      class(frame_source_t), intent(in) :: self
      character(*), intent(in)  :: name
      real(wp),     intent(out), contiguous :: values(:, :)   !! (components,points)
    end subroutine field_of
  end interface

  !> The fields of one frame over the n points.
  type, extends(frame_source_t) :: frame_fields_t
    real(wp), allocatable :: displacement(:, :)   !! (n,2) [m]
    real(wp), allocatable :: velocity(:, :)       !! (n,2) [m/s]
    real(wp), allocatable :: stress(:, :)         !! (n,4) xx yy zz xy [Pa]
    real(wp), allocatable :: strain(:, :)         !! (n,4) xx yy zz xy
    real(wp), allocatable :: plastic_strain(:)    !! (n)
    real(wp), allocatable :: von_mises(:)         !! (n) [Pa]
    real(wp), allocatable :: zero_energy(:)       !! (n)
  contains
    procedure :: points => points_of_fields
    procedure :: field => one_of_fields
  end type frame_fields_t

  type(field_t), parameter :: fields_of_a_frame(7) = [ &
    field_t('displacement', 'm', 2, 'x y', 'displacement from the reference position'), &
    field_t('velocity', 'm/s', 2, 'x y', 'velocity'), &
    field_t('stress', 'Pa', 4, 'xx yy zz xy', 'Cauchy stress, tension positive'), &
    field_t('strain', '1', 4, 'xx yy zz xy', 'strain in the measure of the material '// &
    '(xy: tensor component)'), &
    field_t('plastic_strain', '1', 1, '', 'equivalent plastic strain alpha'), &
    field_t('von_mises', 'Pa', 1, '', 'equivalent stress sqrt(3/2) |deviator of the Cauchy '// &
    'stress|'), &
    field_t('zero_energy', '1', 1, '', 'root mean square over the family of the part of the '// &
    'deformation that F does not describe, divided by the horizon')]

contains

  pure function frame_name(index) result(name)
    integer, intent(in) :: index
    character(14) :: name

    write (name, '("/frames/", i6.6)') index
  end function frame_name

  !> Create a frame that is not written yet, and take its space on the disk.
  subroutine reserve_frame(file, group, n, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: group
    integer,            intent(in)    :: n
    type(error_list_t), intent(inout) :: errors
    real(wp) :: nan
    integer  :: i

    nan = ieee_value(1.0_wp, ieee_quiet_nan)
    call create_group(file, group, errors)
    call write_attribute(file, group, 'step', -1, errors)
    call write_attribute(file, group, 'time', nan, errors)
    call write_attribute(file, group, 'strain', nan, errors)
    call write_attribute(file, group, 'valid', 0, errors)
    call write_attribute(file, group, 'written', 0, errors)
    do i = 1, size(fields_of_a_frame)
      call reserve_field(file, group//'/'//trim(fields_of_a_frame(i)%name), n, &
        fields_of_a_frame(i), errors)
    end do
  end subroutine reserve_frame

  subroutine reserve_field(file, name, n, field, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name
    integer,            intent(in)    :: n
    type(field_t),      intent(in)    :: field
    type(error_list_t), intent(inout) :: errors

    if (field%width == 1) then
      call reserve_dataset(file, name, [n], errors)
    else
      call reserve_dataset(file, name, [n, field%width], errors)
      call write_attribute(file, name, 'components', trim(field%components), errors)
    end if
    call label(file, name, trim(field%unit), trim(field%description), errors)
  end subroutine reserve_field

  !> Give a dataset its unit and its description.
  subroutine label(file, name, unit, description, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: name, unit, description
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, name, 'unit', unit, errors)
    call write_attribute(file, name, 'description', description, errors)
  end subroutine label

  pure integer function points_of_fields(self) result(n)
    class(frame_fields_t), intent(in) :: self

    n = size(self%plastic_strain)
  end function points_of_fields

  subroutine one_of_fields(self, name, values)
    class(frame_fields_t), intent(in)  :: self
    character(*),          intent(in)  :: name
    real(wp),              intent(out), contiguous :: values(:, :)

    select case (name)
    case ('displacement')
      values = transpose(self%displacement)
    case ('velocity')
      values = transpose(self%velocity)
    case ('stress')
      values = transpose(self%stress)
    case ('strain')
      values = transpose(self%strain)
    case ('plastic_strain')
      values(1, :) = self%plastic_strain
    case ('von_mises')
      values(1, :) = self%von_mises
    case default
      values(1, :) = self%zero_energy
    end select
  end subroutine one_of_fields

  !> Write the data of a frame and hand them to the operating system.
  subroutine put_frame(file, group, source, errors)
    type(hdf5_file_t),     intent(inout) :: file
    character(*),          intent(in)    :: group
    class(frame_source_t), intent(in)    :: source
    type(error_list_t),    intent(inout) :: errors
    real(wp), allocatable :: values(:, :)
    integer :: i

    do i = 1, size(fields_of_a_frame)
      allocate (values(fields_of_a_frame(i)%width, source%points()))
      call source%field(trim(fields_of_a_frame(i)%name), values)
      call overwrite_rows(file, group//'/'//trim(fields_of_a_frame(i)%name), values, errors)
      deallocate (values)
    end do
    call flush_file(file, errors)
  end subroutine put_frame

  !> Say that a frame is there. Its data must have been flushed before.
  subroutine mark_frame(file, group, step, time, strain, valid, errors)
    type(hdf5_file_t),  intent(inout) :: file
    character(*),       intent(in)    :: group
    integer,            intent(in)    :: step
    real(wp),           intent(in)    :: time, strain
    logical,            intent(in)    :: valid
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, group, 'step', step, errors)
    call write_attribute(file, group, 'time', time, errors)
    call write_attribute(file, group, 'strain', strain, errors)
    call write_attribute(file, group, 'valid', merge(1, 0, valid), errors)
    call write_attribute(file, group, 'written', 1, errors)
  end subroutine mark_frame

  !> Copy a frame from one result file into its place in another.
  subroutine copy_frame(old, new, group, time, errors)
    type(hdf5_file_t),  intent(inout) :: old, new
    character(*),       intent(in)    :: group
    real(wp),           intent(out)   :: time   !! of the frame [s]
    type(error_list_t), intent(inout) :: errors
    type(frame_fields_t) :: fields
    real(wp) :: strain
    integer  :: step, valid

    call read_attribute(old, group, 'step', step, errors)
    call read_attribute(old, group, 'time', time, errors)
    call read_attribute(old, group, 'strain', strain, errors)
    call read_attribute(old, group, 'valid', valid, errors)
    call read_dataset(old, group//'/displacement', fields%displacement, errors)
    call read_dataset(old, group//'/velocity', fields%velocity, errors)
    call read_dataset(old, group//'/stress', fields%stress, errors)
    call read_dataset(old, group//'/strain', fields%strain, errors)
    call read_dataset(old, group//'/plastic_strain', fields%plastic_strain, errors)
    call read_dataset(old, group//'/von_mises', fields%von_mises, errors)
    call read_dataset(old, group//'/zero_energy', fields%zero_energy, errors)
    if (.not. old%is_good()) return
    call put_frame(new, group, fields, errors)
    call mark_frame(new, group, step, time, strain, valid == 1, errors)
  end subroutine copy_frame

end module pd_frames
