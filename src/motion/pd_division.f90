!> Division of a model among the ranks: each goes on with its own blocks.
!>
!> A lattice is divided while it is set up, where nothing looks at rows far away (`pd_setup`). Any
!> other model is set up whole by every rank. From here on a rank works on contiguous blocks of
!> rows.
!> What it keeps of other rows is not up to date, but for the halo (`pd_halo`) and the rows that
!> supports, loads and probes look at (`pd_shared_rows`).
module pd_division
  use pd_model, only: model_t
  use pd_operator_parts, only: cuts, divide_operators, points_in_blocks
  use pd_pages, only: clear_marks, forget_rows
  use pd_ranks, only: ranks_t
  use pd_shared_rows, only: new_shared_rows, shared_rows_t
  use pd_state, only: state_t
  implicit none
  private

  public :: divide_model, bring_looked_at, cuts, share_t, shares, traffic_t, traffic

  !> What a rank has of a model.
  type :: share_t
    integer :: points = 0   !! that results show
    integer :: rows = 0
    integer :: halo = 0     !! rows of other ranks that its families read
    integer :: others = 0   !! ranks that own these
    integer :: inner = 0    !! rows in blocks that need none of them
  end type share_t

  !> What a rank sends in every step of a motion.
  type :: traffic_t
    !> Per row of the halo, before the gradient and before the divergence.
    integer :: numbers(2) = [2, 4]
    integer :: reductions = 1       !! over all ranks that are waited for: sums of the supports
    integer :: reduced = 0          !! bytes that go through these
  end type traffic_t

contains

  !> What each of some ranks would have of a model that is whole.
  function shares(model, ranks)
    type(model_t), intent(in) :: model
    integer,       intent(in) :: ranks
    type(share_t) :: shares(ranks)
    integer, allocatable :: points(:), rows(:)
    integer :: reached(2)
    integer :: last(0:ranks), block, k, other, ends(2)

    points = points_in_blocks(model%shown, model%blocks)
    last = cuts(points, ranks)
    do k = 1, ranks
      if (last(k) == last(k - 1)) cycle
      ends = [model%blocks%lo(last(k - 1) + 1), model%blocks%hi(last(k))]
      rows = model%operators%needed_rows(ends(1), ends(2))
      shares(k) = share_t(sum(points(last(k - 1) + 1:last(k))), ends(2) - ends(1) + 1, &
        count(rows < ends(1) .or. rows > ends(2)))
      do block = last(k - 1) + 1, last(k)
        associate (lo => model%blocks%lo(block), hi => model%blocks%hi(block))
          reached = model%operators%reached_rows(lo, hi)
          if (reached(1) >= ends(1) .and. reached(2) <= ends(2)) &
            shares(k)%inner = shares(k)%inner + hi - lo + 1
        end associate
      end do
      do other = 1, ranks
        if (other == k .or. last(other) == last(other - 1)) cycle
        if (any(rows >= model%blocks%lo(last(other - 1) + 1) .and. &
          rows <= model%blocks%hi(last(other)))) shares(k)%others = shares(k)%others + 1
      end do
    end do
  end function shares

  !> What goes between ranks in every step: the displacement, the force tensor and the vector of the
  !> relaxing control in the halo; sums of supports, what loads look at, and images in smooth
  !> bearings. Whether the state failed, signals and clocks are not waited for.
  type(traffic_t) function traffic(model)
    type(model_t), intent(inout) :: model
    type(shared_rows_t) :: sets(3)
    integer :: k

    if (allocated(model%operators%relaxing)) traffic%numbers(2) = 6
    traffic%reduced = model%supports%bytes()
    call share_rows(model)
    sets(1) = model%pushed
    call model%operators%mirror%divide(model%blocks)
    sets(2:) = model%operators%mirror%known_rows()
    do k = 1, size(sets)
      if (.not. allocated(sets(k)%rows)) cycle
      if (size(sets(k)%rows) == 0) cycle
      traffic%reductions = traffic%reductions + 1
      traffic%reduced = traffic%reduced + 16 * size(sets(k)%rows)
    end do
  end function traffic

  !> Divide a model that is set up, unless that is done.
  subroutine divide_model(ranks, model)
    type(ranks_t), intent(in)    :: ranks   !! that take part
    type(model_t), intent(inout) :: model
    integer :: k, kept(2)

    if (ranks%count == 1) return
    if (.not. allocated(model%blocks%ranks%before)) then
      ! results show the same points in all stages: blocks stay where they are
      call divide_operators(model%operators, ranks, points_in_blocks(model%shown, model%blocks))
      model%blocks = model%operators%domain%blocks
      associate (offset => model%blocks%offset, n => model%blocks%count)
        model%materials%first_run = model%materials%first_run(offset + 1:offset + n + 1)
      end associate
      kept = model%operators%domain%kept(model%operators%n)
      call forget_rows(model%points%free, kept)
      call forget_rows(model%points%place, kept)
    end if
    do k = 1, size(model%loads%items)
      call model%loads%items(k)%load%divide(model%blocks)
    end do
    call model%supports%divide(model%blocks, model%operators%domain%kept(model%operators%n))
    call share_rows(model)
  end subroutine divide_model

  !> Which rows are known to all ranks.
  subroutine share_rows(model)
    type(model_t), intent(inout) :: model
    logical, dimension(:), allocatable :: held, pushed   ! on the heap: one per row
    integer :: k

    allocate (held(model%operators%n), pushed(model%operators%n))
    call clear_marks(held)
    call clear_marks(pushed)
    do k = 1, size(model%supports%items)
      call model%supports%items(k)%support%mark_read(held, pushed)
    end do
    do k = 1, size(model%loads%items)
      call model%loads%items(k)%load%mark_read(pushed)
    end do
    model%shared = new_shared_rows(held, model%blocks)
    model%pushed = new_shared_rows(pushed, model%blocks)
    call clear_marks(held)
    do k = 1, size(model%probes)
      held(model%probes(k)%row) = .true.
    end do
    model%probed = new_shared_rows(held, model%blocks)
  end subroutine share_rows

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
