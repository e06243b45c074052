!> Loads: they add to the force density, and do work on the motion.
!>
!> The time loop knows only this interface. A new kind is a module with an extension of `load_t`
!> and a line in `pd_setup_loads`. Loads are added to the force density after the internal forces,
!> and do their work on v^{n+1/2}.
!> Source: doc/theory.md, section 7.
module pd_loads
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: load_t, load_item_t, loads_t

  type, abstract :: load_t
    character(:), allocatable :: name
    character(:), allocatable :: kind              !! in a word
    character(:), allocatable :: doubt             !! what to warn of; not allocated: nothing
    real(wp) :: doubted = 0.0_wp                   !! the number that it is about
  contains
    procedure(add_forces),  deferred :: add_forces
    procedure(description), deferred :: description
    procedure :: acceleration => no_acceleration
    procedure :: mark_read => mark_nothing
    procedure :: divide => nothing_to_divide
    procedure :: work => no_work
    procedure :: add_block_work => no_block_work
  end type load_t

  abstract interface

    !> Add the load of time t to the force density.
    subroutine add_forces(self, volume, t, f)
      import :: load_t, wp
      class(load_t), intent(in)    :: self
      real(wp),      intent(in)    :: volume(:)    !! V (n) [m^2]
      real(wp),      intent(in)    :: t            !! [s]
      real(wp),      intent(inout) :: f(:, :)      !! force density (n,2) [N/m^3]
    end subroutine add_forces

    !> What `--check` says about it.
    pure function description(self) result(text)
      import :: load_t
      class(load_t), intent(in) :: self
      character(:), allocatable :: text
    end function description

  end interface

  !> Holds a load of any kind.
  type :: load_item_t
    class(load_t), allocatable :: load
  end type load_item_t

  !> The loads of a model.
  type :: loads_t
    type(load_item_t), allocatable :: items(:)
  contains
    procedure :: add_forces => add_all_forces
    procedure :: work => work_of_all
    procedure :: add_block_work => block_work_of_all
    procedure :: acceleration => acceleration_of_all
    procedure :: append
    procedure :: count => number_of_loads
  end type loads_t

contains

  !> Acceleration that makes the load, as of gravity, at time t [m/s^2]: here there is none.
  pure function no_acceleration(self, t) result(acceleration)
    class(load_t), intent(in) :: self
    real(wp),      intent(in) :: t                 !! [s]
    real(wp) :: acceleration(2)

    associate (unused => self, unused_t => t)
    end associate
    acceleration = 0.0_wp
  end function no_acceleration

  !> Mark the points whose velocity the load looks at, where these are a few: here there are none.
  pure subroutine mark_nothing(self, pushed)
    class(load_t), intent(in)    :: self
    logical,       intent(inout) :: pushed(:)      !! (n)

    associate (unused => self, unchanged => pushed)
    end associate
  end subroutine mark_nothing

  !> From now on this rank has its own blocks only: a load on a few points takes no notice.
  pure subroutine nothing_to_divide(self, blocks)
    class(load_t),  intent(inout) :: self
    type(blocks_t), intent(in)    :: blocks

    associate (unchanged => self, unused => blocks)
    end associate
  end subroutine nothing_to_divide

  !> Work from t to t_next, by the trapezoidal rule over the displacement of the step, which all
  !> ranks know: here there is none.
  real(wp) function no_work(self, v, t, t_next) result(work)
    class(load_t), intent(in) :: self
    real(wp),      intent(in) :: v(:, :)           !! v^{n+1/2} (n,2) [m/s]
    real(wp),      intent(in) :: t, t_next         !! [s]

    associate (unused => self, unused_v => v, unused_t => [t, t_next])
    end associate
    work = 0.0_wp
  end function no_work

  !> Add the work at points of all blocks, block by block: here there is none.
  subroutine no_block_work(self, blocks, v, t, t_next, work)
    class(load_t),  intent(in)    :: self
    type(blocks_t), intent(in)    :: blocks
    real(wp),       intent(in)    :: v(:, :)       !! v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(in)    :: t, t_next     !! [s]
    real(wp),       intent(inout) :: work(:)       !! (blocks) [J/m]

    associate (unused => self, unused_blocks => blocks, unused_v => v, unused_t => [t, t_next], &
      unchanged => work)
    end associate
  end subroutine no_block_work

  !> Number of loads.
  pure integer function number_of_loads(self) result(number)
    class(loads_t), intent(in) :: self

    number = 0
    if (allocated(self%items)) number = size(self%items)
  end function number_of_loads

  !> Add a load behind the others.
  subroutine append(self, load)
    class(loads_t), intent(inout) :: self
    class(load_t),  intent(in)    :: load
    type(load_item_t), allocatable :: items(:)
    integer :: k

    allocate (items(size(self%items) + 1))
    do k = 1, size(self%items)
      call move_alloc(self%items(k)%load, items(k)%load)
    end do
    allocate (items(size(items))%load, source=load)
    call move_alloc(items, self%items)
  end subroutine append

  !> Add the loads of time t to the force density, in their order.
  subroutine add_all_forces(self, volume, t, f)
    class(loads_t), intent(in)    :: self
    real(wp),       intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp),       intent(in)    :: t             !! [s]
    real(wp),       intent(inout) :: f(:, :)       !! force density (n,2) [N/m^3]
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%load%add_forces(volume, t, f)
    end do
  end subroutine add_all_forces

  !> Work of the loads from t to t_next.
  real(wp) function work_of_all(self, v, t, t_next) result(work)
    class(loads_t), intent(in) :: self
    real(wp),       intent(in) :: v(:, :)          !! v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(in) :: t, t_next        !! [s]
    integer :: k

    work = 0.0_wp
    do k = 1, size(self%items)
      work = work + self%items(k)%load%work(v, t, t_next)
    end do
  end function work_of_all

  !> Add the work of loads on all points from t to t_next, block by block: no rank waits for it.
  subroutine block_work_of_all(self, blocks, v, t, t_next, work)
    class(loads_t), intent(in)    :: self
    type(blocks_t), intent(in)    :: blocks
    real(wp),       intent(in)    :: v(:, :)       !! v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(in)    :: t, t_next     !! [s]
    real(wp),       intent(inout) :: work(:)       !! (blocks) [J/m]
    integer :: k

    do k = 1, size(self%items)
      call self%items(k)%load%add_block_work(blocks, v, t, t_next, work)
    end do
  end subroutine block_work_of_all

  !> Acceleration of all loads at time t [m/s^2].
  pure function acceleration_of_all(self, t) result(acceleration)
    class(loads_t), intent(in) :: self
    real(wp),       intent(in) :: t                !! [s]
    real(wp) :: acceleration(2)
    integer  :: k

    acceleration = 0.0_wp
    do k = 1, size(self%items)
      acceleration = acceleration + self%items(k)%load%acceleration(t)
    end do
  end function acceleration_of_all

end module pd_loads
