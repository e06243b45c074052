!> What an earlier run has left: whether it is in the way, or finished, and what it has told.
module pd_earlier_run
  use pd_checkpoint, only: checkpoint_exists, checkpoint_t
  use pd_doubt_list, only: doubts_t
  use pd_errors, only: error_list_t
  use pd_input, only: compare_used, same_end, used_values
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_record, only: record_t
  use pd_result, only: read_end, result_exists
  use pd_run_description, only: run_description_t
  use pd_trust, only: largest_of_column, read_doubts
  implicit none
  private

  public :: results_in_the_way, look_for_end, load_doubts, largest_reaction_before

contains

  !> Whether an earlier run left results or checkpoints under this stem.
  logical function results_in_the_way(stem)
    character(*), intent(in) :: stem   !! output folder and name of the run

    results_in_the_way = result_exists(stem)
    if (.not. results_in_the_way) results_in_the_way = checkpoint_exists(stem)
  end function results_in_the_way

  !> Whether the result of a run is complete, and whether that is all that the input asks for: the
  !> same run to the same end.
  subroutine look_for_end(input, complete, same)
    type(input_t), intent(in)  :: input
    logical,       intent(out) :: complete, same
    type(error_list_t) :: different
    type(run_description_t) :: old, new

    call read_end(input%run%output_dir//'/'//input%run%name//'.h5', complete, old%values)
    same = .false.
    if (.not. complete) return
    new%values = used_values(input)
    call compare_used(old%values, new%values, different)
    same = different%count() == 0 .and. same_end(old%values, new%values)
  end subroutine look_for_end

  !> The doubts that were told during the run before a checkpoint.
  subroutine load_doubts(stem, checkpoint, doubts)
    character(*),       intent(in)    :: stem
    type(checkpoint_t), intent(in)    :: checkpoint
    type(doubts_t),     intent(inout) :: doubts

    call read_doubts(stem//'.h5', checkpoint%clock%step, doubts)
  end subroutine load_doubts

  !> Largest normal force of a platen in the first rows of the history [N/m]; 0 without platens.
  subroutine largest_reaction_before(record, model, rows, largest)
    type(record_t), intent(in)  :: record
    type(model_t),  intent(in)  :: model
    integer,        intent(in)  :: rows
    real(wp),       intent(out) :: largest
    character(1), parameter :: axes(2) = ['x', 'y']
    real(wp) :: found(1)

    found = 0.0_wp
    associate (p => model%platens, items => model%supports%items)
      if (p%axis > 0 .and. .not. record%elsewhere) found = max( &
        largest_of_column(record%result%path, rows, items(p%first)%support%name//'_force_'// &
        axes(p%axis)), &
        largest_of_column(record%result%path, rows, items(p%second)%support%name//'_force_'// &
        axes(p%axis)))
    end associate
    call model%blocks%ranks%fill_in(found)
    largest = found(1)
  end subroutine largest_reaction_before

end module pd_earlier_run
