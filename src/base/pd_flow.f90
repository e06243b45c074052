!> What flows in a block of rows in one step: laws tell it, and who follows the flow reads it.
module pd_flow
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: flow_t

  !> The plastic flow in a block in one step.
  type :: flow_t
    integer  :: n = 0                      !! rows that flow
    integer  :: rows(n_block)              !! (n) ascending
    real(wp) :: dissipated(n_block)        !! work of the stress on the plastic strain (n) [J/m^3]
    real(wp) :: increment(n_block)         !! of the equivalent plastic strain (n)
    real(wp) :: strength(n_block)          !! equivalent stress at which the row flows (n) [Pa]
  contains
    procedure :: append
    procedure :: work
  end type flow_t

contains

  !> Add the rows of another flow behind those of this one.
  pure subroutine append(self, more)
    class(flow_t), intent(inout) :: self
    type(flow_t),  intent(in)    :: more
    integer :: from, to

    from = self%n + 1
    to = self%n + more%n
    self%rows(from:to) = more%rows(:more%n)
    self%dissipated(from:to) = more%dissipated(:more%n)
    self%increment(from:to) = more%increment(:more%n)
    self%strength(from:to) = more%strength(:more%n)
    self%n = to
  end subroutine append

  !> Work of the stress on the plastic strain [J/m].
  pure real(wp) function work(self, volume)
    class(flow_t), intent(in) :: self
    real(wp),      intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    integer :: i

    work = 0.0_wp
    do i = 1, self%n
      work = work + volume(self%rows(i)) * self%dissipated(i)
    end do
  end function work

end module pd_flow
