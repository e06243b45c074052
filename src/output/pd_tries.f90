!> Tries of a search for the factor of safety.
module pd_tries
  use pd_kinds, only: wp
  implicit none
  private

  public :: tries_t

  type :: tries_t
    integer :: n = 0
    real(wp), allocatable :: factor(:)         !! by which the strength was divided
    logical,  allocatable :: held(:)           !! an equilibrium was found
    real(wp), allocatable :: displacement(:)   !! largest, from the start of the try [m]
    real(wp), allocatable :: unbalanced(:)     !! force at its end over that from outside
  contains
    procedure :: add
    procedure :: least
    procedure :: most
  end type tries_t

contains

  !> One more.
  pure subroutine add(self, factor, held, displacement, unbalanced)
    class(tries_t), intent(inout) :: self
    real(wp),       intent(in)    :: factor, displacement, unbalanced
    logical,        intent(in)    :: held

    if (self%n == 0) allocate (self%factor(0), self%held(0), self%displacement(0), &
      self%unbalanced(0))
    self%n = self%n + 1
    self%factor = [self%factor, factor]
    self%held = [self%held, held]
    self%displacement = [self%displacement, displacement]
    self%unbalanced = [self%unbalanced, unbalanced]
  end subroutine add

  !> The largest factor with an equilibrium; 0: none.
  pure real(wp) function least(self)
    class(tries_t), intent(in) :: self

    least = max(0.0_wp, maxval(self%factor, mask=self%held))
  end function least

  !> The smallest factor without; huge: none.
  pure real(wp) function most(self)
    class(tries_t), intent(in) :: self

    most = minval(self%factor, mask=.not. self%held)
  end function most

end module pd_tries
