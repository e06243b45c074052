!> Checkpoints `<stem>_checkpoint.h5`: everything that a run needs to go on.
!>
!> A checkpoint is written under another name, synced to the disk, read back, and only then renamed;
!> the one before it becomes `<stem>_checkpoint_previous.h5`. One of them is whole at any moment.
!> The checksum of all bytes is checked before HDF5 opens the file (`pd_checkpoint_seal`).
module pd_checkpoint
  use pd_blocks, only: blocks_t
  use pd_body, only: body_t
  use pd_checkpoint_seal, only: found_head, head, head_length, is_whole, schema
  use pd_clock, only: clock_t
  use pd_errors, only: error_list_t
  use pd_fields, only: field_visitor_t, state_field_t
  use pd_files, only: file_exists, patch_file, replace_file, sync_file
  use pd_hdf5, only: close_file, create_file, create_group, hdf5_file_t, open_file, &
    read_attribute, read_dataset, write_attribute, write_dataset
  use pd_kinds, only: i8, wp
  use pd_parts, only: as_column, write_boundaries, write_in_parts
  use pd_points, only: points_t
  use pd_state, only: state_t
  use pd_step_limit, only: step_limit_t
  use pd_storage, only: storage_t
  use pd_system, only: remove_file, rename_file
  implicit none
  private

  public :: checkpoint_t, write_checkpoint, read_checkpoint, checkpoint_exists, remove_checkpoints
  public :: checkpoint_mark

  !> What a run needs apart from its state.
  type :: checkpoint_t
    type(clock_t) :: clock
    type(step_limit_t) :: limit
    integer  :: history_rows = 0        !! written so far
    integer  :: frames_written = 0      !! written so far, 000000 among them
    integer  :: rows_owed = 0, frames_owed = 0   !! due at this step, but could not be written
    character(:), allocatable :: ledger_names(:)
    real(wp),     allocatable :: ledger(:)          !! any numbers, by these names
    real(wp),     allocatable :: ledger_blocks(:, :)   !! the same, per block (blocks, numbers)
    character(:), allocatable :: input(:)           !! the values of the input as used
    real(wp),     allocatable :: position(:, :)     !! (n,2) [m]
    real(wp),     allocatable :: volume(:)          !! (n) [m^2]
    integer,      allocatable :: boundary(:)        !! (n)
    real(wp),     allocatable :: changes(:, :)      !! of supports, from load to motion (3,supports)
  end type checkpoint_t

  !> Write the fields of a state into an open file, and read them.
  type, extends(field_visitor_t) :: writing_t
    type(hdf5_file_t)  :: file
    type(error_list_t) :: errors
    type(storage_t) :: storage          !! rows of the points
    type(blocks_t) :: blocks            !! of this rank
  contains
    procedure :: one_number => write_1
    procedure :: several_numbers => write_2
  end type writing_t

  type, extends(field_visitor_t) :: reading_t
    type(hdf5_file_t)  :: file
    type(error_list_t) :: errors
    integer :: n = 0                    !! points of the checkpoint
    logical :: fits = .true.            !! all fields so far are of these points
  contains
    procedure :: one_number => read_1
    procedure :: several_numbers => read_2
  end type reading_t

  integer, parameter :: schema_version = 6

contains

  logical function checkpoint_exists(stem)
    character(*), intent(in) :: stem   !! output folder and name of the run

    checkpoint_exists = any([file_exists(newest(stem)), file_exists(previous(stem))])
  end function checkpoint_exists

  !> What tells the present checkpoints from others: their heads.
  function checkpoint_mark(stem) result(mark)
    character(*), intent(in) :: stem
    character(2 * head_length) :: mark

    mark = found_head(newest(stem))//found_head(previous(stem))
  end function checkpoint_mark

  !> Remove the checkpoints of an earlier run.
  !>
  !> Errors: one of them cannot be removed.
  subroutine remove_checkpoints(stem, errors)
    character(*),       intent(in)    :: stem
    type(error_list_t), intent(inout) :: errors
    logical :: ignored

    ignored = remove_file(newest(stem)//'.tmp')
    ignored = remove_file(newest(stem))
    ignored = remove_file(previous(stem))
    if (.not. checkpoint_exists(stem)) return
    call errors%add('the checkpoint of an earlier run cannot be removed', where=newest(stem))
  end subroutine remove_checkpoints

  !> Write a checkpoint; the newest so far becomes the previous one. Rank 0 writes what all ranks
  !> hand in.
  !>
  !> Errors: it cannot be written; the checkpoints so far are then as they were.
  subroutine write_checkpoint(stem, checkpoint, state, storage, errors, blocks, points, body)
    character(*),       intent(in)    :: stem   !! output folder and name of the run
    type(checkpoint_t), intent(in)    :: checkpoint
    class(state_t),     intent(inout) :: state   !! visited, not changed
    type(storage_t),    intent(in)    :: storage !! rows of the state that belong to points
    type(error_list_t), intent(inout) :: errors
    type(blocks_t), optional, intent(in) :: blocks   !! of this rank; absent: all
    type(points_t), optional, intent(in) :: points   !! absent: they are in the checkpoint
    type(body_t),   optional, intent(in) :: body     !! likewise
    character(:), allocatable :: temporary
    type(writing_t) :: writer
    integer :: before
    logical :: ignored

    before = errors%count()
    temporary = newest(stem)//'.tmp'
    writer%storage = storage
    if (present(blocks)) writer%blocks = blocks
    if (writer%blocks%ranks%mine == 0) then
      call create_file(writer%file, temporary, head_length, errors)
      call write_numbers(writer%file, checkpoint, errors)
      call create_group(writer%file, '/state', errors)
    end if
    writer%errors = errors
    if (present(points) .and. present(body)) call write_points(writer, points, body)
    call state%visit(writer)
    if (writer%blocks%ranks%mine > 0) return
    errors = writer%errors
    call close_file(writer%file, errors)
    if (errors%count() == before) call patch_file(temporary, 0_i8, head(temporary), errors)
    if (errors%count() == before) call sync_file(temporary, errors)
    if (errors%count() == before) then
      if (.not. is_whole(temporary)) call errors%add( &
        'the checkpoint was written but reads back differently', where=temporary)
    end if
    if (errors%count() > before) then
      ignored = remove_file(temporary)
      return
    end if
    ! a damaged one must not replace the whole one before it
    if (is_whole(newest(stem))) ignored = rename_file(newest(stem), previous(stem))
    call replace_file(temporary, newest(stem), errors)
  end subroutine write_checkpoint

  !> Read the newest checkpoint that is whole.
  !>
  !> `warning`: that it is the previous one; otherwise ''.
  !> Errors: there is none, or none is whole.
  subroutine read_checkpoint(stem, checkpoint, state, warning, errors)
    character(*),              intent(in)    :: stem
    type(checkpoint_t),        intent(out)   :: checkpoint
    class(state_t),            intent(inout) :: state   !! fields that are not in a checkpoint stay
    character(:), allocatable, intent(out)   :: warning
    type(error_list_t),        intent(inout) :: errors

    warning = ''
    if (.not. checkpoint_exists(stem)) then
      call errors%add('there is no checkpoint to go on from', where=newest(stem))
    else if (is_whole(newest(stem))) then
      call read_whole(newest(stem), checkpoint, state, errors)
    else if (is_whole(previous(stem))) then
      warning = newest(stem)//' is missing or damaged; going on from '//previous(stem)
      call read_whole(previous(stem), checkpoint, state, errors)
    else
      call errors%add('the checkpoint is damaged, and there is no whole one before it', &
        where=newest(stem))
    end if
  end subroutine read_checkpoint

  subroutine write_numbers(file, checkpoint, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(checkpoint_t), intent(in)    :: checkpoint
    type(error_list_t), intent(inout) :: errors

    call write_attribute(file, '/', 'schema', schema, errors)
    call write_attribute(file, '/', 'schema_version', schema_version, errors)
    call write_attribute(file, '/', 'step', checkpoint%clock%step, errors)
    call write_attribute(file, '/', 'time', checkpoint%clock%time(), errors)
    call write_attribute(file, '/', 'time_step', checkpoint%clock%time_step, errors)
    call write_attribute(file, '/', 'start_step', checkpoint%clock%start_step, errors)
    call write_attribute(file, '/', 'start_time', checkpoint%clock%start_time, errors)
    call write_attribute(file, '/', 'stage', checkpoint%clock%stage, errors)
    call write_attribute(file, '/', 'limit_frequency', checkpoint%limit%frequency, errors)
    call write_attribute(file, '/', 'limit_stiffening', checkpoint%limit%stiffening, errors)
    call write_attribute(file, '/', 'limit_step', checkpoint%limit%step, errors)
    call write_attribute(file, '/', 'limit_flow', checkpoint%limit%flow, errors)
    call write_attribute(file, '/', 'limit_dissipated', checkpoint%limit%dissipated, errors)
    call write_attribute(file, '/', 'limit_shortest', checkpoint%limit%shortest, errors)
    call write_attribute(file, '/', 'history_rows', checkpoint%history_rows, errors)
    call write_attribute(file, '/', 'frames_written', checkpoint%frames_written, errors)
    call write_attribute(file, '/', 'rows_owed', checkpoint%rows_owed, errors)
    call write_attribute(file, '/', 'frames_owed', checkpoint%frames_owed, errors)
    call write_dataset(file, '/ledger_names', checkpoint%ledger_names, errors)
    call write_dataset(file, '/ledger', checkpoint%ledger, errors)
    call write_dataset(file, '/ledger_blocks', checkpoint%ledger_blocks, errors)
    call write_dataset(file, '/input', checkpoint%input, errors)
    if (allocated(checkpoint%position)) then
      call write_dataset(file, '/position', checkpoint%position, errors)
      call write_dataset(file, '/volume', checkpoint%volume, errors)
      call write_dataset(file, '/boundary', checkpoint%boundary, errors)
    end if
    call write_dataset(file, '/changes', checkpoint%changes, errors)
  end subroutine write_numbers

  !> Positions and volumes of points of which each rank knows its own, and their boundaries.
  subroutine write_points(self, points, body)
    class(writing_t), intent(inout) :: self
    type(points_t),   intent(in)    :: points
    type(body_t),     intent(in)    :: body

    call write_in_parts(self%file, '/position', self%blocks, self%storage, points%position, &
      self%errors)
    call write_in_parts(self%file, '/volume', self%blocks, self%storage, as_column(points%volume), &
      self%errors)
    if (self%blocks%ranks%mine == 0) &
      call write_boundaries(self%file, '/boundary', body, self%errors)
  end subroutine write_points

  subroutine write_1(self, about, values)
    class(writing_t),      intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    if (.not. about%kept) return
    if (self%blocks%ranks%count > 1) then
      call write_in_parts(self%file, place_of(about), self%blocks, self%storage, &
        as_column(values), self%errors)
    else
      call write_dataset(self%file, place_of(about), values(self%storage%row()), self%errors)
    end if
    if (self%blocks%ranks%mine == 0) call describe(self%file, about, self%errors)
  end subroutine write_1

  subroutine write_2(self, about, values)
    class(writing_t),      intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)

    if (.not. about%kept) return
    if (self%blocks%ranks%count > 1) then
      call write_in_parts(self%file, place_of(about), self%blocks, self%storage, values, &
        self%errors)
    else
      call write_dataset(self%file, place_of(about), values(self%storage%row(), :), self%errors)
    end if
    if (self%blocks%ranks%mine == 0) call describe(self%file, about, self%errors)
  end subroutine write_2

  pure function place_of(about) result(place)
    type(state_field_t), intent(in) :: about
    character(:), allocatable :: place

    place = '/state/'//trim(about%name)
  end function place_of

  !> Unit and sentence of a field, and the names of its components or columns.
  subroutine describe(file, about, errors)
    type(hdf5_file_t),   intent(inout) :: file
    type(state_field_t), intent(in)    :: about
    type(error_list_t),  intent(inout) :: errors
    character(:), allocatable :: names, units
    integer :: k

    names = trim(about%components)
    units = trim(about%unit)
    if (allocated(about%columns)) then
      names = ''
      units = ''
      do k = 1, size(about%columns)
        names = names//' '//trim(about%columns(k)%name)
        units = units//' '//trim(about%columns(k)%unit)
      end do
      names = adjustl(names)
      units = adjustl(units)
    end if
    call write_attribute(file, place_of(about), 'unit', units, errors)
    call write_attribute(file, place_of(about), 'description', trim(about%description), errors)
    if (names /= '') call write_attribute(file, place_of(about), 'components', names, errors)
  end subroutine describe

  subroutine read_1(self, about, values)
    class(reading_t),      intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    if (.not. about%kept) return
    call read_dataset(self%file, place_of(about), values, self%errors)
    self%fits = self%fits .and. size(values) == self%n
  end subroutine read_1

  subroutine read_2(self, about, values)
    class(reading_t),      intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)

    if (.not. about%kept) return
    call read_dataset(self%file, place_of(about), values, self%errors)
    self%fits = self%fits .and. size(values, 1) == self%n
    ! what the laws remember is not known yet
    if (about%components /= '') self%fits = self%fits .and. size(values, 2) == about%width()
  end subroutine read_2

  subroutine read_whole(path, checkpoint, state, errors)
    character(*),       intent(in)    :: path
    type(checkpoint_t), intent(inout) :: checkpoint
    class(state_t),     intent(inout) :: state
    type(error_list_t), intent(inout) :: errors
    type(reading_t) :: reader
    character(:), allocatable :: found
    integer :: version

    call open_file(reader%file, path, .false., errors)
    call read_attribute(reader%file, '/', 'schema', found, errors)
    call read_attribute(reader%file, '/', 'schema_version', version, errors)
    if (reader%file%is_good() .and. (found /= schema .or. version /= schema_version)) then
      call errors%add('is not a checkpoint of this version of the program', where=path)
    else
      call read_numbers(reader%file, checkpoint, errors)
      reader%errors = errors
      reader%n = size(checkpoint%volume)
      call state%visit(reader)
      errors = reader%errors
      associate (position => checkpoint%position)
        reader%fits = reader%fits .and. size(position, 1) == reader%n &
          .and. size(position, 2) == 2 .and. size(checkpoint%boundary) == reader%n
      end associate
      if (reader%file%is_good() .and. .not. reader%fits) &
        call errors%add('the fields are not those of its points', where=path)
    end if
    call close_file(reader%file, errors)
  end subroutine read_whole

  subroutine read_numbers(file, checkpoint, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(checkpoint_t), intent(inout) :: checkpoint
    type(error_list_t), intent(inout) :: errors

    call read_attribute(file, '/', 'step', checkpoint%clock%step, errors)
    call read_attribute(file, '/', 'time_step', checkpoint%clock%time_step, errors)
    call read_attribute(file, '/', 'start_step', checkpoint%clock%start_step, errors)
    call read_attribute(file, '/', 'start_time', checkpoint%clock%start_time, errors)
    call read_attribute(file, '/', 'stage', checkpoint%clock%stage, errors)
    call read_attribute(file, '/', 'limit_frequency', checkpoint%limit%frequency, errors)
    call read_attribute(file, '/', 'limit_stiffening', checkpoint%limit%stiffening, errors)
    call read_attribute(file, '/', 'limit_step', checkpoint%limit%step, errors)
    call read_attribute(file, '/', 'limit_flow', checkpoint%limit%flow, errors)
    call read_attribute(file, '/', 'limit_dissipated', checkpoint%limit%dissipated, errors)
    call read_attribute(file, '/', 'limit_shortest', checkpoint%limit%shortest, errors)
    call read_attribute(file, '/', 'history_rows', checkpoint%history_rows, errors)
    call read_attribute(file, '/', 'frames_written', checkpoint%frames_written, errors)
    call read_attribute(file, '/', 'rows_owed', checkpoint%rows_owed, errors)
    call read_attribute(file, '/', 'frames_owed', checkpoint%frames_owed, errors)
    call read_dataset(file, '/ledger_names', checkpoint%ledger_names, errors)
    call read_dataset(file, '/ledger', checkpoint%ledger, errors)
    call read_dataset(file, '/ledger_blocks', checkpoint%ledger_blocks, errors)
    call read_dataset(file, '/input', checkpoint%input, errors)
    call read_dataset(file, '/position', checkpoint%position, errors)
    call read_dataset(file, '/volume', checkpoint%volume, errors)
    call read_dataset(file, '/boundary', checkpoint%boundary, errors)
    call read_dataset(file, '/changes', checkpoint%changes, errors)
  end subroutine read_numbers

  pure function newest(stem) result(path)
    character(*), intent(in) :: stem
    character(:), allocatable :: path

    path = stem//'_checkpoint.h5'
  end function newest

  pure function previous(stem) result(path)
    character(*), intent(in) :: stem
    character(:), allocatable :: path

    path = stem//'_checkpoint_previous.h5'
  end function previous

end module pd_checkpoint
