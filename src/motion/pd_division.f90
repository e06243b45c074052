!> Division of a model among the ranks: each goes on with its own blocks.
!>
!> A model is set up whole by every rank. From here on a rank works on contiguous blocks of rows.
!> What it keeps of other rows is not up to date, but for the halo (`pd_halo`) and the rows that
!> supports, loads and probes look at (`pd_shared_rows`).
module pd_division
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_operator_parts, only: divide_operators
  use pd_pages, only: forget_rows
  use pd_ranks, only: ranks_t
  use pd_shared_rows, only: new_shared_rows
  use pd_state, only: state_t
  implicit none
  private

  public :: divide_model, bring_looked_at, cuts, share_t, shares

  !> What a rank has of a model.
  type :: share_t
    integer :: points = 0   !! that results show
    integer :: rows = 0
    integer :: halo = 0     !! rows of other ranks that its families read
  end type share_t

contains

  !> What each of some ranks would have of a model that is whole.
  function shares(model, ranks)
    type(model_t), intent(in) :: model
    integer,       intent(in) :: ranks
    type(share_t) :: shares(ranks)
    integer, allocatable :: points(:), rows(:)
    integer :: last(0:ranks), k, ends(2)

    points = points_in_blocks(model)
    last = cuts(points, ranks)
    do k = 1, ranks
      if (last(k) == last(k - 1)) cycle
      ends = [model%blocks%lo(last(k - 1) + 1), model%blocks%hi(last(k))]
      rows = model%operators%needed_rows(ends(1), ends(2))
      shares(k) = share_t(sum(points(last(k - 1) + 1:last(k))), ends(2) - ends(1) + 1, &
        count(rows < ends(1) .or. rows > ends(2)))
    end do
  end function shares

  !> Divide a model that is whole.
  subroutine divide_model(ranks, model)
    type(ranks_t), intent(in)    :: ranks   !! that take part
    type(model_t), intent(inout) :: model
    type(ranks_t) :: parts
    integer :: k, kept(2)

    if (ranks%count == 1) return
    parts = ranks
    allocate (parts%before(0:ranks%count))
    parts%before = cuts(points_in_blocks(model), ranks%count)
    call divide_operators(model%operators, parts)
    model%blocks = model%operators%domain%blocks
    associate (offset => model%blocks%offset, n => model%blocks%count)
      model%materials%first_run = model%materials%first_run(offset + 1:offset + n + 1)
    end associate
    kept = model%operators%domain%kept(model%operators%n)
    call forget_rows(model%points%free, kept)
    call forget_rows(model%points%place, kept)
    do k = 1, size(model%loads%items)
      call model%loads%items(k)%load%divide(model%blocks)
    end do
    call share_rows(model)
  end subroutine divide_model

  !> Which rows are known to all ranks.
  subroutine share_rows(model)
    type(model_t), intent(inout) :: model
    logical, dimension(:), allocatable :: held, pushed, probed   ! on the heap: one per row
    integer :: k

    allocate (held(model%operators%n), pushed(model%operators%n), probed(model%operators%n), &
      source=.false.)
    do k = 1, size(model%supports%items)
      call model%supports%items(k)%support%mark_read(held, pushed)
    end do
    do k = 1, size(model%loads%items)
      call model%loads%items(k)%load%mark_read(pushed)
    end do
    do k = 1, size(model%probes)
      probed(model%probes(k)%row) = .true.
    end do
    model%shared = new_shared_rows(held, model%blocks)
    model%pushed = new_shared_rows(pushed, model%blocks)
    model%probed = new_shared_rows(probed, model%blocks)
  end subroutine share_rows

  !> Points in each block that results show: the same in all stages.
  pure function points_in_blocks(model) result(points)
    type(model_t), intent(in) :: model
    integer :: points(model%blocks%count)
    integer :: block

    do block = 1, size(points)
      points(block) = model%shown%first_point(model%blocks%hi(block) + 1) &
        - model%shown%first_point(model%blocks%lo(block))
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

  !> Make known to all ranks what the columns of the history look at beside blocks.
  subroutine bring_looked_at(model, state)
    type(model_t), intent(inout) :: model
    type(state_t), intent(inout) :: state

    call model%shared%bring(state%displacement)
    call model%probed%bring(state%displacement)
    call model%probed%bring(state%displacement_gradient)
    call model%probed%bring(state%stress)
    call model%probed%bring(state%history)
  end subroutine bring_looked_at

end module pd_division
