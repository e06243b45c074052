!> Smooth support on a part of a side, or on an edge: its layers are the mirror image of the body.
!>
!> The plane between the two moves along its normal. The layers follow (`pd_mirror`), twice as far:
!> the reaction of the plane is twice theirs. None of their components is free.
!> Source: doc/theory.md, section 7.
module pd_sliding_support
  use pd_kinds, only: wp
  use pd_point_sets, only: point_set_t
  use pd_rigid_support, only: new_rigid_support, rigid_support_t
  use pd_supports, only: n_sums
  use pd_tables, only: table_t
  implicit none
  private

  public :: sliding_support_t, new_sliding_support

  type, extends(rigid_support_t) :: sliding_support_t
  contains
    procedure :: mark_prescribed
    procedure :: prescribe
    procedure :: take_reactions
  end type sliding_support_t

contains

  !> Support that moves the plane of its points along its normal.
  pure type(sliding_support_t) function new_sliding_support(set, axis, velocity, mass) &
    result(support)
    type(point_set_t), intent(in) :: set
    integer,           intent(in) :: axis              !! of the normal; 1: x, 2: y
    type(table_t),     intent(in) :: velocity(2)       !! x, y [m/s]
    real(wp),          intent(in) :: mass(:)           !! rho V of all points (n) [kg/m]

    support%rigid_support_t = new_rigid_support(set, [1, 2] == axis, velocity, mass)
  end function new_sliding_support

  pure subroutine mark_prescribed(self, free)
    class(sliding_support_t), intent(in)    :: self
    real(wp),                 intent(inout) :: free(:, :)

    free(self%points, :) = 0.0_wp
  end subroutine mark_prescribed

  !> The velocity of the plane; where the images are follows from the body.
  pure subroutine prescribe(self, t, u, v)
    class(sliding_support_t), intent(in)    :: self
    real(wp),                 intent(in)    :: t
    real(wp),                 intent(inout) :: u(:, :), v(:, :)
    integer :: c

    associate (not_moved => u)
    end associate
    if (size(self%points) == 0) return
    associate (points => self%points(self%near(1):self%near(2)), first => self%points(1))
      do c = 1, 2
        if (.not. self%prescribed(c)) cycle
        v(first, c) = self%velocity(c)%rate(t)
        v(points, c) = v(first, c)
      end do
    end associate
  end subroutine prescribe

  !> - 2 sum V f along the normal.
  pure subroutine take_reactions(self, sums, t, f)
    class(sliding_support_t), intent(inout) :: self
    real(wp),                 intent(in)    :: sums(n_sums), t, f(:, :)

    call self%rigid_support_t%take_reactions(sums, t, f)
    self%force = 2.0_wp * self%force
  end subroutine take_reactions

end module pd_sliding_support
