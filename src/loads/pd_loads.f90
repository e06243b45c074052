!> Loads: they add to the force density, and do work on the motion.
!>
!> The time loop knows only this interface. A new kind is a module with an extension of `load_t`
!> and a line in `pd_setup_loads`. Loads are added to the force density after the internal forces,
!> and do their work on v^{n+1/2}.
!> Source: doc/theory.md, section 7.
module pd_loads
  use pd_kinds, only: wp
  implicit none
  private

  public :: load_t, load_item_t, loads_t

  type, abstract :: load_t
    character(:), allocatable :: name
    character(:), allocatable :: kind              !! in a word
    character(:), allocatable :: doubt             !! what to warn of; not allocated: nothing
  contains
    procedure(add_forces),  deferred :: add_forces
    procedure(work),        deferred :: work
    procedure(description), deferred :: description
  end type load_t

  abstract interface

    !> Add the load of time t to the force density.
    pure subroutine add_forces(self, volume, t, f)
      import :: load_t, wp
      class(load_t), intent(in)    :: self
      real(wp),      intent(in)    :: volume(:)    !! V (n) [m^2]
      real(wp),      intent(in)    :: t            !! [s]
      real(wp),      intent(inout) :: f(:, :)      !! force density (n,2) [N/m^3]
    end subroutine add_forces

    !> Work from t to t_next, by the trapezoidal rule over the displacement of the step.
    pure real(wp) function work(self, v, t, t_next)
      import :: load_t, wp
      class(load_t), intent(in) :: self
      real(wp),      intent(in) :: v(:, :)         !! v^{n+1/2} (n,2) [m/s]
      real(wp),      intent(in) :: t, t_next       !! [s]
    end function work

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
  end type loads_t

contains

  !> Add the loads of time t to the force density, in their order.
  pure subroutine add_all_forces(self, volume, t, f)
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
  pure real(wp) function work_of_all(self, v, t, t_next) result(work)
    class(loads_t), intent(in) :: self
    real(wp),       intent(in) :: v(:, :)          !! v^{n+1/2} (n,2) [m/s]
    real(wp),       intent(in) :: t, t_next        !! [s]
    integer :: k

    work = 0.0_wp
    do k = 1, size(self%items)
      work = work + self%items(k)%load%work(v, t, t_next)
    end do
  end function work_of_all

end module pd_loads
