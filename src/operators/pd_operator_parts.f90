!> Operators of a body whose blocks are divided among ranks.
!>
!> A lattice is divided before anything is known of its rows (`divide_domain`), so that no rank ever
!> has those of the others; a list when it is set up (`divide_operators`).
module pd_operator_parts
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  use pd_operators, only: operators_t
  use pd_pages, only: forget_rows
  use pd_ranks, only: ranks_t
  use pd_storage, only: storage_t
  implicit none
  private

  public :: divide_domain, divide_operators, points_in_blocks, cuts

contains

  !> From now on this rank has its own blocks only, and reads a halo around them.
  subroutine divide_domain(operators, ranks, points)
    class(operators_t), intent(inout) :: operators   !! with the blocks of all ranks
    type(ranks_t),      intent(in)    :: ranks       !! that take part
    integer,            intent(in)    :: points(:)   !! in each block
    type(ranks_t) :: parts
    integer, allocatable :: mine(:)
    integer :: ends(2), k

    if (ranks%count == 1) return
    parts = ranks
    allocate (parts%before(0:ranks%count))
    parts%before = cuts(points, ranks%count)
    call operators%domain%take_part(parts)
    ends = operators%domain%rows_of(ranks%mine)
    mine = operators%needed_rows(ends(1), ends(2))
    do k = 0, ranks%count - 1
      if (k == ranks%mine) cycle
      ends = operators%domain%rows_of(k)
      call operators%domain%meet(k, operators%needed_rows(ends(1), ends(2)), mine)
    end do
    call tell_inner_from_outer(operators)
    call operators%storage%keep(operators%domain%kept(operators%n))
  end subroutine divide_domain

  !> Which blocks need rows of other ranks.
  pure subroutine tell_inner_from_outer(operators)
    class(operators_t), intent(inout) :: operators
    logical, allocatable :: needs_others(:)
    integer :: block, k

    associate (blocks => operators%domain%blocks)
      allocate (needs_others(blocks%count))
      do block = 1, blocks%count
        associate (rows => operators%reached_rows(blocks%lo(block), blocks%hi(block)))
          needs_others(block) = rows(1) < blocks%first .or. rows(2) > blocks%last
        end associate
      end do
    end associate
    operators%domain%inner = pack([(k, k=1, size(needs_others))], .not. needs_others)
    operators%domain%outer = pack([(k, k=1, size(needs_others))], needs_others)
  end subroutine tell_inner_from_outer

  !> The same of operators that are set up: what is kept of other rows is zero, but for bonds and
  !> moments.
  subroutine divide_operators(operators, ranks, points)
    class(operators_t), intent(inout) :: operators   !! with the blocks of all ranks
    type(ranks_t),      intent(in)    :: ranks       !! that take part
    integer,            intent(in)    :: points(:)   !! in each block
    integer :: ends(2)

    call divide_domain(operators, ranks, points)
    call operators%mirror%divide(operators%domain%blocks)
    ends = operators%domain%kept(operators%n)
    call forget_rows(operators%k_inverse, ends)
    call forget_rows(operators%weight_sum, ends)
    if (allocated(operators%control)) call forget_rows(operators%control, ends)
    if (allocated(operators%share_of)) call forget_rows(operators%share_of, ends)
    if (allocated(operators%pull)) call forget_rows(operators%pull, ends)
    if (allocated(operators%relaxing)) then
      associate (relaxing => operators%relaxing)
        call forget_rows(relaxing%volume, ends)
        call forget_rows(relaxing%stiffness, ends)
        call forget_rows(relaxing%clock, ends)
        call forget_rows(relaxing%moment, ends)
        call forget_rows(relaxing%pull, ends)
      end associate
    end if
  end subroutine divide_operators

  !> Points in each block.
  pure function points_in_blocks(storage, blocks) result(points)
    type(storage_t), intent(in) :: storage
    type(blocks_t),  intent(in) :: blocks
    integer :: points(blocks%count)
    integer :: block

    do block = 1, size(points)
      points(block) = storage%first_point(blocks%hi(block) + 1) &
        - storage%first_point(blocks%lo(block))
    end do
  end function points_in_blocks

  !> Cut a row of blocks into parts of about equal weight: the last block of each, 0 before the
  !> first. Where there are fewer blocks than parts, the last parts have none.
  pure function cuts(weight, parts) result(last)
    integer, intent(in) :: weight(:), parts
    integer :: last(0:parts)
    real(wp) :: so_far, all
    integer  :: block, k

    last = 0
    all = sum(real(weight, wp))
    so_far = 0.0_wp
    k = 1
    do block = 1, size(weight)
      ! a block goes where its middle is, but no part is left out as long as there are blocks
      if (k < parts .and. block > last(k - 1) + 1) then
        if (so_far + 0.5_wp * real(weight(block), wp) > all * real(k, wp) / real(parts, wp) &
          .or. size(weight) - block < parts - k) k = k + 1
      end if
      last(k:) = block
      so_far = so_far + real(weight(block), wp)
    end do
  end function cuts

end module pd_operator_parts
