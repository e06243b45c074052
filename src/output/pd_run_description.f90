!> What a result file says about a run apart from frames and rows: provenance, input, points.
module pd_run_description
  use pd_body, only: body_t
  use pd_errors, only: error_list_t
  use pd_frame_fields, only: frame_field_t
  use pd_frames, only: write_label
  use pd_hdf5, only: create_group, hdf5_file_t, read_attribute, write_attribute, write_dataset
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_observe, only: column_t
  use pd_parts, only: reserve_values, write_boundaries, write_numbers
  use pd_system, only: host_name, process_number
  use pd_text, only: integer_text
  use pd_trust, only: reserve_trust
  implicit none
  private

  public :: provenance_t, run_description_t, write_description, writer_of, utc_time
  public :: schema, schema_version

  integer, parameter :: schema_version = 2
  character(*), parameter :: schema = 'perigeo result'

  !> Where a result comes from.
  type :: provenance_t
    character(:), allocatable :: code_version, git_hash, compiler, flags, command_line
    integer :: threads = 1
  end type provenance_t

  !> Everything in a result file except frames and rows, and what these hold.
  type :: run_description_t
    type(provenance_t) :: provenance
    character(:), allocatable :: title, name
    character(:), allocatable :: namelist      !! the input file, byte for byte
    character(:), allocatable :: values(:)     !! 'group.key = value', as used
    character(:), allocatable :: strain_axis   !! 'x', 'y'; 'none' where there are no platens
    real(wp) :: spacing = 0.0_wp, horizon = 0.0_wp                 !! [m]
    real(wp) :: lower(2) = 0.0_wp, upper(2) = 0.0_wp               !! extents of the body [m]
    real(wp) :: time_step = 0.0_wp                                 !! [s]
    integer  :: steps = 0                                          !! of the whole run
    integer :: n = 0                           !! points
    type(body_t) :: body                       !! where each rank has a part of the points: what
                                               !! all know of them; positions, volumes and yield
                                               !! stresses come later (`hand_in_points`)
    logical :: in_parts = .false.              !! it is so
    real(wp), allocatable :: position(:, :)    !! (n,2) [m]
    real(wp), allocatable :: volume(:)         !! (n) [m^2]
    integer,  allocatable :: boundary(:)       !! (n) 0: body, k: boundary k
    real(wp), allocatable :: yield_stress(:)   !! (n) [Pa]; not allocated: a material without one
    real(wp), allocatable :: youngs_modulus(:) !! (n) [Pa]; not allocated: that of the materials
    character(:), allocatable :: boundary_names(:)
    type(frame_field_t), allocatable :: fields(:)   !! of every frame
    type(column_t),      allocatable :: columns(:)  !! of the history
  end type run_description_t

contains

  !> Write all of it into a new file.
  subroutine write_description(file, description, n_frames, errors)
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_frames
    type(error_list_t),      intent(inout) :: errors

    call write_provenance(file, description%provenance, errors)
    call write_attributes(file, description, n_frames, errors)
    call write_points(file, description, errors)
    call reserve_trust(file, errors)
  end subroutine write_description

  subroutine write_provenance(file, provenance, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(provenance_t), intent(in)    :: provenance
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, '/', 'schema', schema, errors)
    call write_attribute(file, '/', 'schema_version', schema_version, errors)
    call write_attribute(file, '/', 'code_version', provenance%code_version, errors)
    call write_attribute(file, '/', 'git_hash', provenance%git_hash, errors)
    call write_attribute(file, '/', 'compiler', provenance%compiler, errors)
    call write_attribute(file, '/', 'flags', provenance%flags, errors)
    call write_attribute(file, '/', 'command_line', provenance%command_line, errors)
    call write_attribute(file, '/', 'host', host_name(), errors)
    call write_attribute(file, '/', 'process', process_number(), errors)
    call write_attribute(file, '/', 'threads', provenance%threads, errors)
    call write_attribute(file, '/', 'created', utc_time(), errors)
    call write_attribute(file, '/', 'complete', 0, errors)
  end subroutine write_provenance

  !> Which run wrote a file: host, process, and when.
  function writer_of(file, errors) result(writer)
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: writer, host, created
    integer :: process

    writer = ''
    call read_attribute(file, '/', 'host', host, errors)
    call read_attribute(file, '/', 'process', process, errors)
    call read_attribute(file, '/', 'created', created, errors)
    if (file%is_good()) writer = 'process '//integer_text(process)//' on '//host//', '//created
  end function writer_of

  subroutine write_attributes(file, description, n_frames, errors)
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    integer,                 intent(in)    :: n_frames
    type(error_list_t),      intent(inout) :: errors

    call write_attribute(file, '/', 'title', description%title, errors)
    call write_attribute(file, '/', 'name', description%name, errors)
    call write_attribute(file, '/', 'spacing', description%spacing, errors)
    call write_attribute(file, '/', 'horizon', description%horizon, errors)
    call write_attribute(file, '/', 'lower', description%lower, errors)
    call write_attribute(file, '/', 'upper', description%upper, errors)
    call write_attribute(file, '/', 'strain_axis', description%strain_axis, errors)
    call write_attribute(file, '/', 'time_step', description%time_step, errors)
    call write_attribute(file, '/', 'steps', description%steps, errors)
    call write_attribute(file, '/', 'n_frames', n_frames, errors)
    call create_group(file, '/input', errors)
    call write_dataset(file, '/input/namelist', description%namelist, errors)
    call write_label(file, '/input/namelist', label_t('', '1', &
      'the input file, byte for byte'), errors)
    if (size(description%values) == 0) return
    call write_dataset(file, '/input/values', description%values, errors)
    call write_label(file, '/input/values', label_t('', '1', &
      'the values of the input as used'), errors)
  end subroutine write_attributes

  subroutine write_points(file, description, errors)
    type(hdf5_file_t),       intent(inout) :: file
    type(run_description_t), intent(in)    :: description
    type(error_list_t),      intent(inout) :: errors

    call create_group(file, '/points', errors)
    if (description%in_parts) then
      call reserve_values(file, '/points/position', [description%n, 2], errors)
      call reserve_values(file, '/points/volume', [description%n, 1], errors)
    else
      call write_dataset(file, '/points/position', description%position, errors)
      call write_dataset(file, '/points/volume', description%volume, errors)
    end if
    call write_label(file, '/points/position', label_t('', 'm', 'reference position'), errors)
    call write_attribute(file, '/points/position', 'components', 'x y', errors)
    call write_label(file, '/points/volume', label_t('', 'm^2', &
      'volume of a point per unit of thickness'), errors)
    if (description%in_parts) then
      call write_boundaries(file, '/points/boundary', description%body, errors)
    else
      call write_dataset(file, '/points/boundary', description%boundary, errors)
    end if
    call write_label(file, '/points/boundary', label_t('', '1', &
      'boundary that a fictitious point belongs to, counted from 1; 0: a point of the body'), &
      errors)
    call write_numbers(file, '/points/number', description%n, errors)
    call write_label(file, '/points/number', label_t('', '1', 'number of the point, from 0'), &
      errors)
    if (allocated(description%yield_stress)) then
      if (description%in_parts) then
        call reserve_values(file, '/points/yield_stress', [description%n, 1], errors)
      else
        call write_dataset(file, '/points/yield_stress', description%yield_stress, errors)
      end if
      call write_label(file, '/points/yield_stress', label_t('', 'Pa', &
      'initial yield stress'), errors)
    end if
    if (allocated(description%youngs_modulus)) then
      call write_dataset(file, '/points/youngs_modulus', description%youngs_modulus, errors)
      call write_label(file, '/points/youngs_modulus', label_t('', 'Pa', &
        'Young''s modulus, where it grows with depth'), errors)
    end if
    if (size(description%boundary_names) == 0) return
    call write_dataset(file, '/points/boundary_names', description%boundary_names, errors)
    call write_label(file, '/points/boundary_names', label_t('', '1', &
      'names of the boundaries'), errors)
  end subroutine write_points

  !> The time now as ISO 8601 in UTC, '2024-05-31T09:30:00Z'.
  function utc_time() result(text)
    character(20) :: text
    integer :: now(8), minutes, days, y, m, d

    call date_and_time(values=now)
    minutes = 60 * now(5) + now(6) - now(4)
    days = julian_day(now(1), now(2), now(3)) + floor(real(minutes, wp) / 1440.0_wp)
    minutes = modulo(minutes, 1440)
    ! Richards' algorithm: the date of a Julian day number
    m = days + 1401 + (4 * days + 274277) / 146097 * 3 / 4 - 38
    y = 4 * m + 3
    d = 5 * (modulo(y, 1461) / 4) + 2
    m = modulo(d / 153 + 2, 12) + 1
    y = y / 1461 - 4716 + (14 - m) / 12
    d = modulo(d, 153) / 5 + 1
    write (text, '(i4.4, 2("-", i2.2), "T", i2.2, 2(":", i2.2), "Z")') y, m, d, minutes / 60, &
      modulo(minutes, 60), now(7)
  end function utc_time

  pure integer function julian_day(y, m, d)
    integer, intent(in) :: y, m, d

    julian_day = (1461 * (y + 4800 + (m - 14) / 12)) / 4 + (367 * (m - 2 - 12 * ((m - 14) / 12))) &
      / 12 - (3 * ((y + 4900 + (m - 14) / 12) / 100)) / 4 + d - 32075
  end function julian_day

end module pd_run_description
