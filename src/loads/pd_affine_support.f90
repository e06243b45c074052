!> Affine support: its points follow a homogeneous deformation about the origin.
!>
!>   u_i(t) = a(t) L X_i; the rate of a is a table
!>
!> Source: doc/theory.md, section 7.
module pd_affine_support
  use pd_kinds, only: ordered_sum, wp
  use pd_point_sets, only: point_set_t
  use pd_supports, only: n_sums, sum_of_forces, support_t
  use pd_tables, only: table_t
  implicit none
  private

  public :: affine_support_t, new_affine_support

  type, extends(support_t) :: affine_support_t
    type(table_t), private :: factor                     !! rate of a
    real(wp), private :: gradient(4) = 0.0_wp            !! L xx xy yx yy [1/s]
    real(wp), allocatable, private :: mode(:, :)         !! L X (2, its points) [m/s]
    real(wp), private :: mass = 0.0_wp                   !! rho sum V |L X|^2 [J/m]
    real(wp), private :: mode_force = 0.0_wp             !! conjugate to a [W/m]
    real(wp), private :: mode_force_before = 0.0_wp      !! in the step before
  contains
    procedure :: mark_prescribed
    procedure :: prescribe
    procedure :: add_up
    procedure :: take_reactions
    procedure :: work
    procedure :: turns
    procedure :: rotation
  end type affine_support_t

contains

  !> Support whose points follow v = factor(t) L X.
  pure type(affine_support_t) function new_affine_support(set, gradient, factor, position, mass) &
    result(support)
    type(point_set_t), intent(in) :: set
    real(wp),          intent(in) :: gradient(4)         !! L xx xy yx yy [1/s]
    type(table_t),     intent(in) :: factor
    real(wp),          intent(in) :: position(:, :)      !! X (n,2) [m]
    real(wp),          intent(in) :: mass(:)             !! rho V of all points (n) [kg/m]
    integer :: k

    call support%hold(set)
    support%factor = factor
    support%gradient = gradient
    allocate (support%mode(2, size(set%points)))
    do k = 1, size(set%points)
      associate (x => position(set%points(k), :), m => support%mode(:, k))
        m(1) = gradient(1) * x(1) + gradient(2) * x(2)
        m(2) = gradient(3) * x(1) + gradient(4) * x(2)
        support%mass = support%mass + mass(set%points(k)) * sum(m**2)
      end associate
    end do
  end function new_affine_support

  pure subroutine mark_prescribed(self, free)
    class(affine_support_t), intent(in)    :: self
    real(wp),                intent(inout) :: free(:, :)

    free(self%points, :) = 0.0_wp
  end subroutine mark_prescribed

  pure subroutine prescribe(self, t, u, v)
    class(affine_support_t), intent(in)    :: self
    real(wp),                intent(in)    :: t
    real(wp),                intent(inout) :: u(:, :), v(:, :)
    real(wp) :: a, rate
    integer  :: k

    a = self%factor%integral(t)
    rate = self%factor%rate(t)
    if (size(self%points) == 0) return
    u(self%points(1), :) = a * self%mode(:, 1)
    v(self%points(1), :) = rate * self%mode(:, 1)
    do k = self%near(1), self%near(2)
      u(self%points(k), :) = a * self%mode(:, k)
      v(self%points(k), :) = rate * self%mode(:, k)
    end do
  end subroutine prescribe

  !> V f, and V f . L X.
  pure function add_up(self, first, last, volume, f) result(sums)
    class(affine_support_t), intent(in) :: self
    integer,                 intent(in) :: first, last
    real(wp),                intent(in) :: volume(:), f(:, :)
    real(wp) :: sums(n_sums)   !! x, y [N/m], with the mode [W/m]

    associate (p => self%points(first:last), m => self%mode(:, first:last))
      sums = [sum_of_forces(p, volume, f), &
        ordered_sum(volume(p) * (f(p, 1) * m(1, :) + f(p, 2) * m(2, :)))]
    end associate
  end function add_up

  !> - sum V f, and - sum V f . L X.
  pure subroutine take_reactions(self, sums, t, f)
    class(affine_support_t), intent(inout) :: self
    real(wp),                intent(in)    :: sums(n_sums), t, f(:, :)

    associate (unused => t, unused_f => f)
    end associate
    self%mode_force_before = self%mode_force
    self%force = -sums(:2)
    self%mode_force = -sums(3)
  end subroutine take_reactions

  pure real(wp) function work(self, v, t, t_next)
    class(affine_support_t), intent(in) :: self
    real(wp),                intent(in) :: v(:, :), t, t_next

    associate (unused => v)
    end associate
    work = 0.5_wp * (self%mode_force_before + self%mode_force) &
      * (self%factor%integral(t_next) - self%factor%integral(t)) &
      + 0.5_wp * self%mass * (self%factor%rate(t_next)**2 - self%factor%rate(t)**2)
  end function work

  !> A gradient that is symmetric stretches without turning.
  pure logical function turns(self)
    class(affine_support_t), intent(in) :: self

    turns = abs(self%gradient(3) - self%gradient(2)) > 0.0_wp
  end function turns

  !> The angle of R in F = R U with F = I + a L.
  pure real(wp) function rotation(self, t)
    class(affine_support_t), intent(in) :: self
    real(wp),                intent(in) :: t
    real(wp) :: a

    a = self%factor%integral(t)
    associate (l => self%gradient)
      rotation = atan2(a * (l(3) - l(2)), 2.0_wp + a * (l(1) + l(4)))
    end associate
  end function rotation

end module pd_affine_support
