!> Body force: a dead load per volume on all points, as gravity is.
!>
!>   f <- f + r(t) b
!>
!> Source: doc/theory.md, section 7.
module pd_body_force
  use pd_blocks, only: blocks_t, new_blocks
  use pd_kinds, only: ordered_sum, wp
  use pd_loads, only: load_t
  use pd_pages, only: clear_rows
  use pd_tables, only: new_ramp, table_t
  use pd_text, only: short_number
  implicit none
  private

  public :: body_force_t, new_body_force

  type, extends(load_t) :: body_force_t
    real(wp), allocatable :: density(:, :)        !! b at full load (n,2) [N/m^3]
    type(table_t) :: factor                       !! r
    real(wp) :: full_acceleration(2) = 0.0_wp     !! that makes b; 0: none does [m/s^2]
    logical,  private :: acts(2) = .false.        !! components in which b is not 0 everywhere
    real(wp), allocatable, private :: volume(:)   !! V (n) [m^2]
    real(wp), private :: ramp_time = 0.0_wp       !! full load from then on [s]
    character(:), allocatable, private :: text    !! what it is
    type(blocks_t), private :: blocks             !! of this rank
    real(wp), allocatable, private :: in_all(:)   !! force of all ranks at full load [N/m]; not
                                                  !! allocated: this rank has all of b
  contains
    procedure :: add_forces
    procedure :: add_block_work
    procedure :: description
    procedure :: acceleration
    procedure :: divide
    procedure :: leave
    procedure :: total
  end type body_force_t

contains

  !> Body force on rows with these volumes; of divided blocks every rank knows its own, and must
  !> come here.
  type(body_force_t) function new_body_force(kind, density, volume, ramp_time, acceleration, &
    text, blocks) result(load)
    character(*), intent(in) :: kind              !! in a word
    real(wp),     intent(in) :: density(:, :)     !! b at full load (n,2) [N/m^3]
    real(wp),     intent(in) :: volume(:)         !! V (n) [m^2]
    real(wp),     intent(in) :: ramp_time         !! full load from then on [s]
    real(wp),     intent(in) :: acceleration(2)   !! that makes b; 0: none does [m/s^2]
    character(*), intent(in) :: text              !! what it is
    type(blocks_t), optional, intent(in) :: blocks   !! of this rank; absent: all rows are known
    integer :: acts(2), c

    load%name = kind
    load%kind = kind
    load%text = text
    load%blocks = new_blocks(1, size(volume))
    if (present(blocks)) load%blocks = blocks
    allocate (load%density(size(density, 1), 2), load%volume(size(volume)))
    associate (a => load%blocks%first, b => load%blocks%last)
      call clear_rows(load%density, [a, b])
      call clear_rows(load%volume, [a, b])
      load%density(a:b, :) = density(a:b, :)
      load%volume(a:b) = volume(a:b)
    end associate
    acts = [(merge(1, 0, any(abs(load%density(:, c)) > 0.0_wp)), c=1, 2)]
    call load%blocks%ranks%largest_numbers(acts)
    load%acts = acts > 0
    if (allocated(load%blocks%ranks%before)) &
      load%in_all = [(load%blocks%total(sums_of_blocks(load, c)), c=1, 2)]
    load%ramp_time = ramp_time
    load%factor = new_ramp(ramp_time)
    load%full_acceleration = acceleration
  end function new_body_force

  !> f <- f + r b.
  subroutine add_forces(self, volume, t, f)
    class(body_force_t), intent(in)    :: self
    real(wp),            intent(in)    :: volume(:), t
    real(wp),            intent(inout) :: f(:, :)
    real(wp) :: factor
    integer  :: c, i

    associate (unused => volume)
    end associate
    factor = self%factor%rate(t)
    do c = 1, 2
      if (.not. self%acts(c)) cycle
      !$omp parallel do simd schedule(static) default(none) private(i) shared(self, f, factor, c)
      do i = self%blocks%first, self%blocks%last
        f(i, c) = f(i, c) + factor * self%density(i, c)
      end do
      !$omp end parallel do simd
    end do
  end subroutine add_forces

  subroutine add_block_work(self, blocks, v, t, t_next, work)
    class(body_force_t), intent(in)    :: self
    type(blocks_t),      intent(in)    :: blocks
    real(wp),            intent(in)    :: v(:, :), t, t_next
    real(wp),            intent(inout) :: work(:)
    real(wp) :: factor
    integer  :: block, c

    factor = (t_next - t) * (0.5_wp * (self%factor%rate(t) + self%factor%rate(t_next)))
    !$omp parallel do schedule(static) default(none) private(block, c) &
    !$omp shared(self, blocks, v, factor, work)
    do block = 1, blocks%count
      associate (lo => blocks%lo(block), hi => blocks%hi(block))
        do c = 1, 2
          if (self%acts(c)) work(block) = work(block) + factor * ordered_sum( &
            self%volume(lo:hi) * self%density(lo:hi, c) * v(lo:hi, c))
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine add_block_work

  !> Force in all at full load [N/m].
  pure function total(self) result(force)
    class(body_force_t), intent(in) :: self
    real(wp) :: force(2)

    if (allocated(self%in_all)) then
      force = self%in_all
    else
      force = [sum(sums_of_blocks(self, 1)), sum(sums_of_blocks(self, 2))]
    end if
  end function total

  !> Force at full load on the rows of each block of this rank [N/m].
  pure function sums_of_blocks(self, c) result(sums)
    class(body_force_t), intent(in) :: self
    integer,             intent(in) :: c   !! component; 1: x, 2: y
    real(wp) :: sums(self%blocks%count)
    integer  :: block

    do block = 1, self%blocks%count
      associate (lo => self%blocks%lo(block), hi => self%blocks%hi(block))
        sums(block) = ordered_sum(self%volume(lo:hi) * self%density(lo:hi, c))
      end associate
    end do
  end function sums_of_blocks

  !> From now on this rank has its own blocks only.
  pure subroutine divide(self, blocks)
    class(body_force_t), intent(inout) :: self
    type(blocks_t),      intent(in)    :: blocks

    self%blocks = blocks
  end subroutine divide

  !> Act no longer on some rows, in some components.
  pure subroutine leave(self, rows, components, t, force)
    class(body_force_t), intent(inout) :: self
    integer,             intent(in)    :: rows(:)
    logical,             intent(in)    :: components(2)   !! x, y
    real(wp),            intent(in)    :: t               !! [s]
    real(wp),            intent(inout) :: force(2)        !! grows by what acted on them [N/m]
    integer :: c

    do c = 1, 2
      if (.not. components(c)) cycle
      force(c) = force(c) + self%factor%rate(t) &
        * ordered_sum(self%volume(rows) * self%density(rows, c))
      self%density(rows, c) = 0.0_wp
    end do
  end subroutine leave

  pure function acceleration(self, t)
    class(body_force_t), intent(in) :: self
    real(wp),            intent(in) :: t
    real(wp) :: acceleration(2)

    acceleration = self%factor%rate(t) * self%full_acceleration
  end function acceleration

  pure function description(self) result(text)
    class(body_force_t), intent(in) :: self
    character(:), allocatable :: text
    real(wp) :: force(2)

    force = self%total()
    text = self%text//': '//short_number(force(1))//', '//short_number(force(2))//' N/m in all'
    if (self%ramp_time > 0.0_wp) text = text//', whole from '//short_number(self%ramp_time)//' s'
  end function description

end module pd_body_force
