!> The part of a body that this rank works on: its blocks of rows, and the halo around them.
!>
!> Serial form: the only rank owns all rows.
module pd_domain
  use pd_blocks, only: blocks_t, new_blocks
  use pd_halo, only: halo_t
  implicit none
  private

  public :: domain_t, new_domain

  type :: domain_t
    type(blocks_t) :: blocks
    type(halo_t)   :: halo
  end type domain_t

contains

  !> Share of this rank in the rows between which all points lie.
  pure type(domain_t) function new_domain(first, last) result(domain)
    integer, intent(in) :: first, last

    domain%blocks = new_blocks(first, last)
    allocate (domain%halo%from(0), domain%halo%to(0))
  end function new_domain

end module pd_domain
