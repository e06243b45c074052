!> Platens of a model change from load to motion, at their time or as they had done before.
module pd_setup_changes
  use pd_body_force, only: body_force_t
  use pd_changes, only: change_to_motion
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_platens, only: move_frame
  implicit none
  private

  public :: change_support, repeat_changes

contains

  !> Support number k of a model prescribes motion from now on; the frame of the platens with it.
  !> Body forces leave its points: as with any support that prescribes motion, its force is what
  !> the body gives.
  subroutine change_support(k, place, t, model)
    integer,       intent(in)    :: k
    real(wp),      intent(in)    :: place(2)   !! displacement of its points [m]
    real(wp),      intent(in)    :: t          !! [s]
    type(model_t), intent(inout) :: model
    logical :: held(2)
    integer :: i

    call change_to_motion(model%supports, k, place, t, model%points%free)
    associate (support => model%supports%items(k)%support)
      held = model%points%free(support%points(1), :) <= 0.0_wp
      do i = 1, size(model%loads%items)
        select type (load => model%loads%items(i)%load)
        class is (body_force_t)
          call load%leave(support%points, held, t, support%force)
        end select
      end do
    end associate
    associate (platens => model%platens, items => model%supports%items)
      if (platens%axis > 0) &
        call move_frame(platens, items(platens%first)%support, items(platens%second)%support)
    end associate
  end subroutine change_support

  !> What had changed in a model before, or in a checkpoint, changes in a new one.
  subroutine repeat_changes(changes, model)
    real(wp),      intent(in)    :: changes(:, :)   !! see `changes_of`
    type(model_t), intent(inout) :: model
    integer :: k

    do k = 1, min(size(changes, 2), size(model%supports%items))
      if (changes(1, k) >= 0.0_wp) call change_support(k, changes(2:3, k), changes(1, k), model)
    end do
  end subroutine repeat_changes

end module pd_setup_changes
