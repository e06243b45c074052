!> Rigid support: its points translate as one, rough in both components, smooth in one.
!>
!>   u_c(t) = a_c(t) in the prescribed components c; the rate of a_c is a table
!>
!> Where it takes over from a load, a_c begins with the displacement that is there.
!> Source: doc/theory.md, section 7.
module pd_rigid_support
  use pd_kinds, only: wp
  use pd_point_sets, only: point_set_t
  use pd_supports, only: n_sums, support_t
  use pd_tables, only: table_t
  implicit none
  private

  public :: rigid_support_t, new_rigid_support

  type, extends(support_t) :: rigid_support_t
    logical :: prescribed(2) = .false.                   !! x, y
    type(table_t) :: velocity(2)                         !! x, y [m/s]
    real(wp) :: since = -1.0_wp                          !! it took over from a load [s]; < 0: none
    real(wp) :: place(2) = 0.0_wp                        !! displacement at that time [m]
    real(wp), private :: mass(2) = 0.0_wp                !! that moves with it [kg/m]
    real(wp), private :: force_before(2) = 0.0_wp        !! `force` in the step before [N/m]
  contains
    procedure :: mark_prescribed
    procedure :: prescribe
    procedure :: take_reactions
    procedure :: work
    procedure :: common_velocity
    procedure :: take_over
    procedure :: gain
  end type rigid_support_t

contains

  !> Support that moves its points with a velocity in the prescribed components.
  pure type(rigid_support_t) function new_rigid_support(set, prescribed, velocity, mass) &
    result(support)
    type(point_set_t), intent(in) :: set
    logical,           intent(in) :: prescribed(2)
    type(table_t),     intent(in) :: velocity(2)         !! x, y [m/s]
    real(wp),          intent(in) :: mass(:)             !! rho V of all points (n) [kg/m]
    integer :: k

    call support%hold(set)
    support%prescribed = prescribed
    support%velocity = velocity
    do k = 1, size(set%points)
      where (prescribed) support%mass = support%mass + mass(set%points(k))
    end do
  end function new_rigid_support

  pure subroutine mark_prescribed(self, free)
    class(rigid_support_t), intent(in)    :: self
    real(wp),               intent(inout) :: free(:, :)
    integer :: c

    do c = 1, 2
      if (self%prescribed(c)) free(self%points, c) = 0.0_wp
    end do
  end subroutine mark_prescribed

  pure subroutine prescribe(self, t, u, v)
    class(rigid_support_t), intent(in)    :: self
    real(wp),               intent(in)    :: t
    real(wp),               intent(inout) :: u(:, :), v(:, :)
    integer :: c

    if (size(self%points) == 0) return
    associate (points => self%points(self%near(1):self%near(2)), first => self%points(1))
      do c = 1, 2
        if (.not. self%prescribed(c)) cycle
        u(first, c) = self%place(c) + self%velocity(c)%integral(t)
        v(first, c) = self%velocity(c)%rate(t)
        u(points, c) = u(first, c)
        v(points, c) = v(first, c)
      end do
    end associate
  end subroutine prescribe

  !> - sum V f over the prescribed components.
  pure subroutine take_reactions(self, sums, t, f)
    class(rigid_support_t), intent(inout) :: self
    real(wp),               intent(in)    :: sums(n_sums), t, f(:, :)

    associate (unused => t, unused_f => f)
    end associate
    self%force_before = self%force
    self%force = merge(-sums(:2), 0.0_wp, self%prescribed)
  end subroutine take_reactions

  pure real(wp) function work(self, v, t, t_next)
    class(rigid_support_t), intent(in) :: self
    real(wp),               intent(in) :: v(:, :), t, t_next
    integer :: c

    associate (unused => v)
    end associate
    work = 0.0_wp
    do c = 1, 2
      associate (velocity => self%velocity(c))
        work = work + 0.5_wp * (self%force_before(c) + self%force(c)) &
          * (velocity%integral(t_next) - velocity%integral(t)) &
          + 0.5_wp * self%mass(c) * (velocity%rate(t_next)**2 - velocity%rate(t)**2)
      end associate
    end do
  end function work

  pure type(table_t) function common_velocity(self, c) result(velocity)
    class(rigid_support_t), intent(in) :: self
    integer,                intent(in) :: c

    if (self%prescribed(c)) velocity = self%velocity(c)
  end function common_velocity

  !> Go on from where a load has brought the points: displacements count from there and then.
  pure subroutine take_over(self, place, t)
    class(rigid_support_t), intent(inout) :: self
    real(wp),               intent(in)    :: place(2)   !! displacement of the points [m]
    real(wp),               intent(in)    :: t          !! [s]

    self%since = t
    self%place = place
    self%velocity%since = t
  end subroutine take_over

  !> Kinetic energy that its points gain where they take its velocity [J/m].
  pure real(wp) function gain(self, v, t)
    class(rigid_support_t), intent(in) :: self
    real(wp),               intent(in) :: v(2)   !! that they have now [m/s]
    real(wp),               intent(in) :: t      !! [s]
    integer :: c

    gain = 0.0_wp
    do c = 1, 2
      gain = gain + 0.5_wp * self%mass(c) * (self%velocity(c)%rate(t)**2 - v(c)**2)
    end do
  end function gain

end module pd_rigid_support
