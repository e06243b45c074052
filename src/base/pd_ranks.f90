!> The ranks that share a run: one.
!>
!> Serial form. Everything that a sum, an extremum or a decision needs from other ranks goes through
!> this module, so that a form with messages can take its place without a change elsewhere.
module pd_ranks
  use pd_kinds, only: wp
  implicit none
  private

  public :: ranks_t

  !> The ranks of a run, numbered from 0.
  type :: ranks_t
    integer :: count = 1
    integer :: mine = 0
  contains
    procedure, nopass :: total
    procedure, nopass :: largest
    procedure, nopass :: smallest
    procedure, nopass :: lowest_number
  end type ranks_t

contains

  !> Sum over the blocks of all ranks, in the order of the blocks of the whole body: the
  !> same bits for any number of ranks.
  pure real(wp) function total(parts)
    real(wp), intent(in) :: parts(:)   !! one number per block of this rank

    total = sum(parts)
  end function total

  !> Largest number of the blocks of all ranks; -huge if there are no blocks.
  pure real(wp) function largest(parts)
    real(wp), intent(in) :: parts(:)   !! one number per block of this rank

    largest = maxval(parts)
  end function largest

  !> Smallest number of the blocks of all ranks; huge if there are no blocks.
  pure real(wp) function smallest(parts)
    real(wp), intent(in) :: parts(:)   !! one number per block of this rank

    smallest = minval(parts)
  end function smallest

  !> Lowest positive number of the blocks of all ranks; 0: there is none.
  pure integer function lowest_number(parts) result(lowest)
    integer, intent(in) :: parts(:)   !! one number per block of this rank

    lowest = 0
    if (any(parts > 0)) lowest = minval(parts, mask=parts > 0)
  end function lowest_number

end module pd_ranks
