!> Smooth support on a part of a side: rigid across it; along it, its layers follow the body.
!>
!> A column of the layer and the point of the body next to it move as one along the side:
!>
!>   f <- sum V f / sum V          over the points of the column, along the side
!>
!> This projection does no work. A layer that were free along the side would shear.
!> Source: doc/theory.md, section 7.
module pd_sliding_support
  use pd_kinds, only: wp
  use pd_point_sets, only: point_set_t
  use pd_rigid_support, only: new_rigid_support, rigid_support_t
  use pd_tables, only: table_t
  implicit none
  private

  public :: sliding_support_t, new_sliding_support

  type, extends(rigid_support_t) :: sliding_support_t
    integer, private :: along = 0                      !! axis along the side; 1: x, 2: y
    integer, allocatable, private :: columns(:, :)     !! points that move as one, 0: none
                                                       !! (most in a column, columns)
  contains
    procedure :: share_forces
    procedure :: mark_read
  end type sliding_support_t

contains

  !> Support that moves its points across a side, whose columns follow the body along it.
  pure type(sliding_support_t) function new_sliding_support(set, axis, velocity, mass, columns) &
    result(support)
    type(point_set_t), intent(in) :: set
    integer,           intent(in) :: axis              !! of the normal; 1: x, 2: y
    type(table_t),     intent(in) :: velocity(2)       !! x, y [m/s]
    real(wp),          intent(in) :: mass(:)           !! rho V of all points (n) [kg/m]
    integer,           intent(in) :: columns(:, :)     !! of points, 0: none

    support%rigid_support_t = new_rigid_support(set, [1, 2] == axis, velocity, mass)
    support%along = 3 - axis
    allocate (support%columns(size(columns, 1), size(columns, 2)), source=columns)
  end function new_sliding_support

  pure subroutine share_forces(self, volume, t, f)
    class(sliding_support_t), intent(in)    :: self
    real(wp),                 intent(in)    :: volume(:), t
    real(wp),                 intent(inout) :: f(:, :)
    real(wp) :: force, whole
    integer  :: k

    associate (unused => t)
    end associate
    do k = 1, size(self%columns, 2)
      associate (points => pack(self%columns(:, k), self%columns(:, k) > 0))
        force = sum(volume(points) * f(points, self%along))
        whole = sum(volume(points))
        f(points, self%along) = force / whole
      end associate
    end do
  end subroutine share_forces

  !> Points of the body belong to the columns, too.
  pure subroutine mark_read(self, held, pushed)
    class(sliding_support_t), intent(in)    :: self
    logical,                  intent(inout) :: held(:), pushed(:)

    associate (unchanged => pushed)
    end associate
    held(self%points) = .true.
    held(pack(self%columns, self%columns > 0)) = .true.
  end subroutine mark_read

end module pd_sliding_support
