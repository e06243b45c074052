!> Whether a checkpoint fits the model that is to go on from it.
module pd_checkpoint_fit
  use pd_body, only: body_t
  use pd_checkpoint, only: checkpoint_t
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_state, only: state_t
  implicit none
  private

  public :: compare_points, compare_history

contains

  !> Report an error where the points are not those of the checkpoint, if there is one.
  subroutine compare_points(checkpoint, model, path, errors)
    type(checkpoint_t), intent(in)    :: checkpoint   !! history_rows 0: there is none
    type(model_t),      intent(in)    :: model        !! with its body
    character(*),       intent(in)    :: path         !! of the input
    type(error_list_t), intent(inout) :: errors

    if (checkpoint%history_rows == 0) return
    if (.not. same_points(checkpoint, model)) call errors%add( &
      'the points are not those of the checkpoint', path, &
      allowed='the same body and file of points, or --force for a new run')
  end subroutine compare_points

  !> Report an error where the laws remember something else than in the checkpoint.
  subroutine compare_history(checkpoint, state, model, path, errors)
    type(checkpoint_t), intent(in)    :: checkpoint   !! history_rows 0: there is none
    type(state_t),      intent(in)    :: state        !! from it
    type(model_t),      intent(in)    :: model
    character(*),       intent(in)    :: path         !! of the input
    type(error_list_t), intent(inout) :: errors

    if (checkpoint%history_rows == 0) return
    if (.not. same_history(state, model)) call errors%add( &
      'the laws remember something else than in the checkpoint', path, &
      allowed='the version of perigeo that wrote it, or --force for a new run')
  end subroutine compare_history

  !> Whether the points of a checkpoint are those of the body, boundaries included (a point cloud
  !> may have changed).
  pure logical function same_points(checkpoint, model) result(same)
    type(checkpoint_t), intent(in) :: checkpoint
    type(model_t),      intent(in) :: model   !! with its body

    if (model%whole%n > 0) then
      same = are_those_of(model%whole)
    else
      same = are_those_of(model%body)
    end if

  contains

    pure logical function are_those_of(body)
      type(body_t), intent(in) :: body

      are_those_of = size(checkpoint%volume) == body%n
      if (.not. are_those_of) return
      associate (ends => [1, body%n])
        are_those_of = all(abs(checkpoint%position - body%positions(ends)) <= 0.0_wp) &
          .and. all(abs(checkpoint%volume - body%volumes(ends)) <= 0.0_wp) &
          .and. all(checkpoint%boundary == body%boundaries(ends))
      end associate
    end function are_those_of

  end function same_points

  !> Whether the points of a state from a checkpoint remember as much as the laws of the model.
  pure logical function same_history(state, model) result(same)
    type(state_t), intent(in) :: state
    type(model_t), intent(in) :: model

    same = size(state%history, 2) == size(model%materials%remembered())
  end function same_history

end module pd_checkpoint_fit
