!> Checkpoints of a run, and how it goes on from one.
module pd_record_checkpoint
  use pd_agreement, only: any_rank
  use pd_changes, only: changes_of, n_change
  use pd_checkpoint, only: checkpoint_t, read_checkpoint, write_checkpoint
  use pd_clock, only: clock_t
  use pd_errors, only: error_list_t
  use pd_input, only: compare_used, used_values
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  use pd_ledger, only: ledger_t
  use pd_model, only: model_t
  use pd_record, only: points_of, record_t
  use pd_result, only: write_rows
  use pd_state, only: state_t
  use pd_step_limit, only: step_limit_t
  implicit none
  private

  public :: save_checkpoint, save_last_checkpoint, load_checkpoint

  character(*), parameter :: ledger_names(4) = [character(24) :: 'initial_kinetic_energy', &
    'initial_strain_energy', 'largest_work', 'outer_work']

contains

  !> Write a checkpoint of the state after a step, but first the rows of the history before it.
  subroutine save_checkpoint(model, state, ledger, clock, limit, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(inout) :: state   !! visited, not changed
    type(ledger_t),     intent(in)    :: ledger
    type(clock_t),      intent(in)    :: clock
    type(step_limit_t), intent(in)    :: limit
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    integer :: before

    before = errors%count()
    if (.not. record%elsewhere) call write_rows(record%result, errors)
    if (any_rank(model%blocks%ranks, errors%count() > before)) return
    call put_checkpoint(model, state, ledger, clock, limit, record, errors)
  end subroutine save_checkpoint

  !> Write a last checkpoint where a file cannot be written: a restart writes what is owed. It takes
  !> the rows that the result file lacks from the CSV file. Nothing is written where another run
  !> has taken the place of this one.
  subroutine save_last_checkpoint(model, state, ledger, clock, limit, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(inout) :: state   !! visited, not changed
    type(ledger_t),     intent(in)    :: ledger
    type(clock_t),      intent(in)    :: clock
    type(step_limit_t), intent(in)    :: limit
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(error_list_t) :: known

    if (.not. (record%result%is_lost .or. record%elsewhere)) call write_rows(record%result, known)
    if (any_rank(model%blocks%ranks, record%result%is_foreign)) then
      call errors%add('no checkpoint is written: another run writes these files')
    else
      call put_checkpoint(model, state, ledger, clock, limit, record, errors)
    end if
  end subroutine save_last_checkpoint

  subroutine put_checkpoint(model, state, ledger, clock, limit, record, errors)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(inout) :: state   !! visited, not changed
    type(ledger_t),     intent(in)    :: ledger
    type(clock_t),      intent(in)    :: clock
    type(step_limit_t), intent(in)    :: limit
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    type(checkpoint_t) :: checkpoint
    type(ledger_t) :: whole

    whole = ledger%gathered(model%blocks)
    checkpoint%clock = clock
    checkpoint%limit = limit
    checkpoint%history_rows = record%history%rows
    checkpoint%frames_written = record%frames
    checkpoint%rows_owed = record%rows_owed
    checkpoint%frames_owed = record%frames_owed
    checkpoint%ledger_names = ledger_names
    checkpoint%ledger = [ledger%initial_kinetic_energy, ledger%initial_strain_energy, &
      ledger%largest_work, ledger%outer_work]
    allocate (checkpoint%ledger_blocks(size(whole%plastic), 4))
    checkpoint%ledger_blocks(:, 1) = whole%plastic
    checkpoint%ledger_blocks(:, 2) = whole%damping
    checkpoint%ledger_blocks(:, 3) = whole%work_at_points
    checkpoint%ledger_blocks(:, 4) = whole%control
    checkpoint%input = record%values
    allocate (checkpoint%changes(n_change, max(1, size(model%supports%items))), source=-1.0_wp)
    checkpoint%changes(:, :size(model%supports%items)) = changes_of(model%supports)
    if (model%blocks%ranks%count > 1 .and. model%whole%n == 0) then
      call write_checkpoint(record%stem, checkpoint, state, model%shown, errors, model%blocks, &
        model%points, model%body)
    else
      call points_of(model, checkpoint%position, checkpoint%volume, checkpoint%boundary)
      call write_checkpoint(record%stem, checkpoint, state, model%shown, errors, model%blocks)
    end if
  end subroutine put_checkpoint

  !> Read the newest checkpoint and compare its input with the present one. The state has one row
  !> per point.
  !>
  !> Errors, `file_errors`: no checkpoint that can be read; `input_errors`: values that differ.
  subroutine load_checkpoint(input, checkpoint, state, ledger, warning, file_errors, input_errors)
    type(input_t),      intent(in)    :: input
    type(checkpoint_t), intent(out)   :: checkpoint
    type(state_t),      intent(out)   :: state
    type(ledger_t),     intent(out)   :: ledger
    character(:), allocatable, intent(out) :: warning
    type(error_list_t), intent(inout) :: file_errors, input_errors

    state%in_stages = size(input%stages) > 0
    state%has_initial_strain = is_set(input%initial_stress%k0) .or. state%in_stages
    call read_checkpoint(input%run%output_dir//'/'//input%run%name, checkpoint, state, warning, &
      file_errors)
    if (file_errors%count() > 0) return
    if (size(checkpoint%ledger) /= size(ledger_names) &
      .or. size(checkpoint%ledger_blocks, 2) /= 4) then
      call file_errors%add('the checkpoint was written by another version of perigeo')
      return
    end if
    ledger%initial_kinetic_energy = checkpoint%ledger(1)
    ledger%initial_strain_energy = checkpoint%ledger(2)
    ledger%largest_work = checkpoint%ledger(3)
    ledger%outer_work = checkpoint%ledger(4)
    ledger%plastic = checkpoint%ledger_blocks(:, 1)
    ledger%damping = checkpoint%ledger_blocks(:, 2)
    ledger%work_at_points = checkpoint%ledger_blocks(:, 3)
    ledger%control = checkpoint%ledger_blocks(:, 4)
    call compare_used(checkpoint%input, used_values(input), input_errors)
  end subroutine load_checkpoint

end module pd_record_checkpoint
