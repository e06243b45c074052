!> Platen under a force: it stays plane and does not rotate, and moves as the force tells it.
!>
!> Its points all get the same force density, in the components in which they move as one,
!>
!>   f <- (sum V f + r(t) F) / sum V
!>
!> so that, having the same velocity, they keep it. F is a dead load; the mass of the platen is that
!> of its points.
!> Source: doc/theory.md, section 7.
module pd_loaded_platen
  use pd_kinds, only: ordered_sum, wp
  use pd_point_sets, only: point_set_t
  use pd_rigid_support, only: rigid_support_t
  use pd_supports, only: n_sums, sum_of_forces, support_t
  use pd_tables, only: new_ramp, table_t
  use pd_text, only: short_number
  implicit none
  private

  public :: loaded_platen_t, new_loaded_platen

  type, extends(support_t) :: loaded_platen_t
    logical,  private :: as_one(2) = .false.             !! components in which it is rigid
    real(wp), private :: traction(2) = 0.0_wp            !! from outside, at full load [Pa]
    real(wp), private :: full(2) = 0.0_wp                !! F, the same over its length [N/m]
    type(table_t), private :: factor                     !! r
    real(wp), private :: ramp_time = 0.0_wp              !! [s]
    type(rigid_support_t), allocatable :: next           !! that takes over from it, if one does
    real(wp) :: until = huge(1.0_wp)                     !! time at which it does [s]
  contains
    procedure :: mark_prescribed
    procedure :: prescribe
    procedure :: add_up
    procedure :: share_forces
    procedure :: mark_read
    procedure :: take_reactions
    procedure :: work
    procedure :: applied => applied_at
    procedure :: description
  end type loaded_platen_t

contains

  !> Platen under a traction over a length in each component; it has no effect in components in
  !> which the points can move apart.
  pure type(loaded_platen_t) function new_loaded_platen(set, as_one, traction, length, ramp_time, &
    start) result(platen)
    type(point_set_t), intent(in) :: set
    logical,           intent(in) :: as_one(2)
    real(wp),          intent(in) :: traction(2)         !! at full load [Pa]
    real(wp),          intent(in) :: length(2)           !! that carries x and y of it [m]
    real(wp),          intent(in) :: ramp_time           !! full load from then on [s]
    real(wp), optional, intent(in) :: start              !! of the ramp; absent: 0 [s]

    call platen%hold(set)
    platen%load_kind = 'traction'
    platen%as_one = as_one
    platen%traction = traction
    platen%full = merge(traction * length, 0.0_wp, as_one)
    platen%ramp_time = ramp_time
    platen%factor = new_ramp(ramp_time, start)
  end function new_loaded_platen

  !> Nothing is prescribed.
  pure subroutine mark_prescribed(self, free)
    class(loaded_platen_t), intent(in)    :: self
    real(wp),               intent(inout) :: free(:, :)

    associate (unused => self, unchanged => free)
    end associate
  end subroutine mark_prescribed

  !> Nothing is prescribed.
  pure subroutine prescribe(self, t, u, v)
    class(loaded_platen_t), intent(in)    :: self
    real(wp),               intent(in)    :: t
    real(wp),               intent(inout) :: u(:, :), v(:, :)

    associate (unused => self, unused_t => t, unchanged_u => u, unchanged_v => v)
    end associate
  end subroutine prescribe

  !> V f, and V.
  pure function add_up(self, first, last, volume, f) result(sums)
    class(loaded_platen_t), intent(in) :: self
    integer,                intent(in) :: first, last
    real(wp),               intent(in) :: volume(:), f(:, :)
    real(wp) :: sums(n_sums)   !! x, y [N/m], V [m^2]

    associate (points => self%points(first:last))
      sums = [sum_of_forces(points, volume, f), ordered_sum(volume(points))]
    end associate
  end function add_up

  !> f <- (sum V f + r F) / sum V at its points.
  pure subroutine share_forces(self, sums, t, f)
    class(loaded_platen_t), intent(in)    :: self
    real(wp),               intent(in)    :: sums(n_sums), t
    real(wp),               intent(inout) :: f(:, :)
    integer :: c

    associate (points => self%points(self%near(1):self%near(2)), first => self%points(1))
      do c = 1, 2
        if (.not. self%as_one(c)) cycle
        f(first, c) = (self%factor%rate(t) * self%full(c) + sums(c)) / sums(3)
        f(points, c) = f(first, c)
      end do
    end associate
  end subroutine share_forces

  !> - sum V f of the internal forces: f, the same at all points, contains the applied force as
  !> well. Not the sum from before: after a restart there is only f.
  pure subroutine take_reactions(self, sums, t, f)
    class(loaded_platen_t), intent(inout) :: self
    real(wp),               intent(in)    :: sums(n_sums), t, f(:, :)

    self%force = self%factor%rate(t) * self%full &
      - merge(sums(3) * f(self%points(1), :), 0.0_wp, self%as_one)
  end subroutine take_reactions

  !> Work of the applied force on the motion of the platen.
  pure real(wp) function work(self, v, t, t_next)
    class(loaded_platen_t), intent(in) :: self
    real(wp),               intent(in) :: v(:, :), t, t_next
    integer :: c

    work = 0.0_wp
    do c = 1, 2
      if (self%as_one(c)) work = work + (t_next - t) * 0.5_wp * (self%factor%rate(t) &
        + self%factor%rate(t_next)) * self%full(c) * v(self%points(1), c)
    end do
  end function work

  !> Its work is that on the velocity of one of its points.
  pure subroutine mark_read(self, held, pushed)
    class(loaded_platen_t), intent(in)    :: self
    logical,                intent(inout) :: held(:), pushed(:)

    held(self%points) = .true.
    pushed(self%points(1)) = .true.
  end subroutine mark_read

  pure function applied_at(self, t) result(force)
    class(loaded_platen_t), intent(in) :: self
    real(wp),               intent(in) :: t
    real(wp) :: force(2)

    force = self%factor%rate(t) * self%full
  end function applied_at

  pure function description(self) result(text)
    class(loaded_platen_t), intent(in) :: self
    character(:), allocatable :: text

    text = short_number(self%traction(1))//', '//short_number(self%traction(2))//' Pa on '// &
      self%name//': '//short_number(self%full(1))//', '//short_number(self%full(2))// &
      ' N/m in all'
    if (self%ramp_time > 0.0_wp) text = text//', whole from '//short_number(self%ramp_time)//' s'
    if (allocated(self%next)) text = text//', motion from '//short_number(self%until)//' s on'
  end function description

end module pd_loaded_platen
