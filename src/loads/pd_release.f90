!> What a stage of construction has changed, let in evenly over the stage.
!>
!> At its start the body, the supports or the loads are others than before, and the forces on the
!> points too, by r. The load -r keeps the state as it is; it falls linearly to 0 at the end of the
!> stage: so the soil that is dug away lets go of what is left, and new soil gets its weight.
!> Source: doc/theory.md, section 7.
module pd_release
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  use pd_loads, only: load_t
  use pd_tables, only: new_table, table_t
  implicit none
  private

  public :: release_t, new_release

  type, extends(load_t) :: release_t
    real(wp), allocatable, private :: force(:, :)   !! -r V (n,2) [N/m]
    type(table_t),  private :: part                 !! of it that still acts
    type(blocks_t), private :: blocks
  contains
    procedure :: add_forces
    procedure :: work
    procedure :: description
  end type release_t

contains

  !> The load that holds a change of forces, from the start of a stage to its end.
  pure type(release_t) function new_release(change, volume, blocks, start_time, end_time) &
    result(release)
    real(wp),       intent(in) :: change(:, :)           !! r (n,2) [N/m^3]
    real(wp),       intent(in) :: volume(:)              !! V (n) [m^2]
    type(blocks_t), intent(in) :: blocks
    real(wp),       intent(in) :: start_time, end_time   !! [s]

    release%name = 'release'
    release%kind = 'release'
    allocate (release%force, source=-change * spread(volume, 2, 2))
    release%part = new_table([start_time, end_time], [1.0_wp, 0.0_wp], 0.0_wp)
    release%blocks = blocks
  end function new_release

  pure subroutine add_forces(self, volume, t, f)
    class(release_t), intent(in)    :: self
    real(wp),         intent(in)    :: volume(:), t
    real(wp),         intent(inout) :: f(:, :)
    real(wp) :: part
    integer  :: i

    part = self%part%rate(t)
    do i = 1, size(volume)
      if (volume(i) > 0.0_wp) f(i, :) = f(i, :) + part * self%force(i, :) / volume(i)
    end do
  end subroutine add_forces

  pure real(wp) function work(self, v, t, t_next)
    class(release_t), intent(in) :: self
    real(wp),         intent(in) :: v(:, :), t, t_next
    real(wp) :: parts(self%blocks%count)
    integer  :: block

    do block = 1, self%blocks%count
      associate (lo => self%blocks%lo(block), hi => self%blocks%hi(block))
        parts(block) = sum(self%force(lo:hi, :) * v(lo:hi, :))
      end associate
    end do
    work = (t_next - t) * 0.5_wp * (self%part%rate(t) + self%part%rate(t_next)) &
      * self%blocks%total(parts)
  end function work

  pure function description(self) result(text)
    class(release_t), intent(in) :: self
    character(:), allocatable :: text

    associate (unused => self)
    end associate
    text = 'what the stage has changed, let in evenly over it'
  end function description

end module pd_release
