!> Platens that move under a load until a time, and are moved from then on.
!>
!> At the change the support that prescribes motion takes the place of the platen: its points go on
!> from where the load has brought them, with the velocity of the table.
!> Source: doc/theory.md, section 7.
module pd_changes
  use pd_kinds, only: wp
  use pd_loaded_platen, only: loaded_platen_t
  use pd_rigid_support, only: rigid_support_t
  use pd_supports, only: support_t, supports_t
  implicit none
  private

  public :: changes_of, change_to_motion, kinetic_gain, n_change, time_of_change

  integer, parameter :: n_change = 3   !! numbers that tell of a change: time, displacement x, y

contains

  !> Time at which a support changes from load to motion; huge where it does not, or has done so.
  pure real(wp) function time_of_change(support) result(t)
    class(support_t), intent(in) :: support

    t = huge(1.0_wp)
    select type (support)
    class is (loaded_platen_t)
      if (allocated(support%next)) t = support%until
    end select
  end function time_of_change

  !> Support number k prescribes motion from now on; in its components nothing is free any more.
  !>
  !> The force of the platen stays: it is what the body gives at this moment.
  subroutine change_to_motion(supports, k, place, t, free)
    type(supports_t), intent(inout) :: supports
    integer,          intent(in)    :: k
    real(wp),         intent(in)    :: place(2)     !! displacement of the platen [m]
    real(wp),         intent(in)    :: t            !! [s]
    real(wp),         intent(inout) :: free(:, :)   !! 1: free (n,2)
    type(rigid_support_t) :: moved

    select type (platen => supports%items(k)%support)
    class is (loaded_platen_t)
      if (.not. allocated(platen%next)) return
      moved = platen%next
      moved%force = platen%force
      moved%near = platen%near
    class default
      return
    end select
    call moved%take_over(place, t)
    deallocate (supports%items(k)%support)
    allocate (supports%items(k)%support, source=moved)
    call moved%mark_prescribed(free)
  end subroutine change_to_motion

  !> Kinetic energy that a support gives to its points where it begins to prescribe motion [J/m].
  pure real(wp) function kinetic_gain(support, v, t) result(gain)
    class(support_t), intent(in) :: support
    real(wp),         intent(in) :: v(2)            !! velocity of its points before [m/s]
    real(wp),         intent(in) :: t               !! [s]

    gain = 0.0_wp
    select type (support)
    class is (rigid_support_t)
      gain = support%gain(v, t)
    end select
  end function kinetic_gain

  !> What has changed so far: per support the time, below 0 where it has not, and the displacement.
  pure function changes_of(supports) result(changes)
    type(supports_t), intent(in) :: supports
    real(wp) :: changes(n_change, size(supports%items))
    integer  :: k

    changes = -1.0_wp
    do k = 1, size(supports%items)
      select type (support => supports%items(k)%support)
      class is (rigid_support_t)
        changes(:, k) = [support%since, support%place]
      end select
    end do
  end function changes_of

end module pd_changes
