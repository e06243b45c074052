!> Rows of a field that families read and that another rank owns.
!>
!> Serial form: what would be a message is a copy from row to row, and a rank that owns all rows
!> makes none. The operators bring every field up to date once it is whole, and before a family
!> reads it, so that a form with messages can replace this one.
module pd_halo
  use pd_kinds, only: wp
  implicit none
  private

  public :: halo_t

  !> Rows that are copied, and where to; size 0: this rank owns every row.
  type :: halo_t
    integer, allocatable :: from(:), to(:)
  contains
    procedure :: exchange
  end type halo_t

contains

  !> Bring the rows of the halo up to date.
  pure subroutine exchange(self, field)
    class(halo_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: field(:, :)   !! (rows, components)
    integer :: k

    do k = 1, size(self%from)
      field(self%to(k), :) = field(self%from(k), :)
    end do
  end subroutine exchange

end module pd_halo
