!> The ranks that share a run: those that mpirun has started.
!>
!> Form with messages, in the place of src/base/pd_ranks.f90. This is the only module that calls
!> MPI. Sums gather one number per block and add them in the order of the blocks, as the serial form
!> does: no sum is left to MPI, whose order of additions depends on the number of ranks. An error of
!> MPI ends all ranks (MPI_ERRORS_ARE_FATAL).
module pd_ranks
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use mpi_f08, only: mpi_abort, mpi_allgatherv, mpi_allreduce, mpi_bcast, mpi_bor, mpi_comm, &
    mpi_comm_free, mpi_comm_rank, mpi_comm_size, mpi_comm_split_type, mpi_comm_type_shared, &
    mpi_comm_world, mpi_double_precision, mpi_finalize, mpi_iallreduce, mpi_in_place, &
    mpi_info_null, mpi_init_thread, mpi_integer, mpi_integer8, mpi_irecv, mpi_isend, mpi_max, &
    mpi_min, mpi_recv, mpi_request, mpi_send, mpi_status_ignore, mpi_statuses_ignore, &
    mpi_testall, mpi_thread_funneled, mpi_waitall
  use pd_kinds, only: wp
  implicit none
  private

  public :: ranks_t, messages_t, begin_ranks, end_ranks, abort_ranks

  !> The ranks of a run, numbered from 0. The blocks of a body are divided among them where `before`
  !> is allocated; until then every rank has all of them.
  type :: ranks_t
    integer :: count = 1
    integer :: mine = 0
    integer :: on_machine = 1           !! ranks that share the memory of this one's machine
    integer, allocatable :: before(:)   !! blocks before those of each rank, and all (0:count)
  contains
    procedure :: total
    procedure :: largest
    procedure :: smallest
    procedure :: lowest_number
    procedure :: gathered
    procedure :: gathered_rows
    procedure :: largest_numbers
    procedure :: begin_largest
    procedure :: fill_in
    procedure :: begin_swap
    procedure :: spread_out
    procedure :: hand_over
  end type ranks_t

  !> Messages on their way. What is sent and received must stay where it is until they have arrived.
  type :: messages_t
    type(mpi_request), allocatable, private :: requests(:)
  contains
    procedure :: help
    procedure, private :: await_values, await_numbers
    generic   :: await => await_values, await_numbers
  end type messages_t

  integer, parameter :: any_tag = 0

contains

  !> Begin: who takes part.
  subroutine begin_ranks(ranks)
    type(ranks_t), intent(out) :: ranks
    type(mpi_comm) :: beside
    integer :: provided

    call mpi_init_thread(mpi_thread_funneled, provided)
    call mpi_comm_size(mpi_comm_world, ranks%count)
    call mpi_comm_rank(mpi_comm_world, ranks%mine)
    call mpi_comm_split_type(mpi_comm_world, mpi_comm_type_shared, 0, mpi_info_null, beside)
    call mpi_comm_size(beside, ranks%on_machine)
    call mpi_comm_free(beside)
  end subroutine begin_ranks

  !> End, all ranks together.
  subroutine end_ranks()
    call mpi_finalize()
  end subroutine end_ranks

  !> End all ranks from one of them, with an exit status.
  subroutine abort_ranks(status)
    integer, intent(in) :: status

    flush (output_unit)
    flush (error_unit)
    call mpi_abort(mpi_comm_world, status)
  end subroutine abort_ranks

  !> Sum over the blocks of all ranks, in the order of the blocks of the whole body: the
  !> same bits for any number of ranks.
  real(wp) function total(self, parts)
    class(ranks_t), intent(in) :: self
    real(wp),       intent(in) :: parts(:)   !! one number per block of this rank

    total = sum(self%gathered(parts))
  end function total

  !> Largest number of the blocks of all ranks; -huge if there are no blocks.
  real(wp) function largest(self, parts)
    class(ranks_t), intent(in) :: self
    real(wp),       intent(in) :: parts(:)   !! one number per block of this rank

    largest = maxval(self%gathered(parts))
  end function largest

  !> Smallest number of the blocks of all ranks; huge if there are no blocks.
  real(wp) function smallest(self, parts)
    class(ranks_t), intent(in) :: self
    real(wp),       intent(in) :: parts(:)   !! one number per block of this rank

    smallest = minval(self%gathered(parts))
  end function smallest

  !> Lowest positive number of the blocks of all ranks; 0: there is none.
  integer function lowest_number(self, parts) result(lowest)
    class(ranks_t), intent(in) :: self
    integer,        intent(in) :: parts(:)   !! one number per block of this rank

    lowest = minval(parts, mask=parts > 0)   ! huge where there is none
    if (allocated(self%before)) &
      call mpi_allreduce(mpi_in_place, lowest, 1, mpi_integer, mpi_min, mpi_comm_world)
    if (lowest == huge(lowest)) lowest = 0
  end function lowest_number

  !> The numbers of the blocks of all ranks, in the order of the blocks.
  function gathered(self, parts) result(all_parts)
    class(ranks_t), intent(in) :: self
    real(wp),       intent(in) :: parts(:)   !! one number per block of this rank
    real(wp), allocatable :: all_parts(:), own(:)

    if (.not. allocated(self%before)) then
      all_parts = parts
      return
    end if
    associate (ends => self%before)
      own = parts
      allocate (all_parts(ends(self%count)))
      call mpi_allgatherv(own, size(own), mpi_double_precision, all_parts, &
        ends(1:) - ends(:self%count - 1), ends(:self%count - 1), mpi_double_precision, &
        mpi_comm_world)
    end associate
  end function gathered

  !> The same of several numbers per block.
  function gathered_rows(self, parts) result(all_parts)
    class(ranks_t), intent(in) :: self
    real(wp),       intent(in) :: parts(:, :)   !! (numbers, blocks of this rank)
    real(wp), allocatable :: all_parts(:, :), own(:, :)

    if (.not. allocated(self%before)) then
      all_parts = parts
      return
    end if
    associate (ends => size(parts, 1) * self%before)
      own = parts
      allocate (all_parts(size(parts, 1), self%before(self%count)))
      call mpi_allgatherv(own, size(own), mpi_double_precision, all_parts, &
        ends(2:) - ends(:self%count), ends(:self%count), mpi_double_precision, mpi_comm_world)
    end associate
  end function gathered_rows

  !> The largest of every number on any rank.
  subroutine largest_numbers(self, numbers)
    class(ranks_t), intent(in)    :: self
    integer,        intent(inout) :: numbers(:)

    if (self%count > 1) call mpi_allreduce(mpi_in_place, numbers, size(numbers), mpi_integer, &
      mpi_max, mpi_comm_world)
  end subroutine largest_numbers

  !> Begin to find them.
  subroutine begin_largest(self, numbers, messages)
    class(ranks_t),   intent(in)    :: self
    integer,          intent(inout), contiguous, asynchronous :: numbers(:)
    type(messages_t), intent(out)   :: messages
    type(mpi_request) :: request

    if (self%count == 1) return
    call mpi_iallreduce(mpi_in_place, numbers, size(numbers), mpi_integer, mpi_max, &
      mpi_comm_world, request)
    messages%requests = [request]
  end subroutine begin_largest

  !> Numbers of which each is known to one rank, made known to all, bit by bit.
  subroutine fill_in(self, numbers)
    class(ranks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: numbers(:)   !! in: 0 but for those that are known here

    if (allocated(self%before)) call mpi_allreduce(mpi_in_place, numbers, size(numbers), &
      mpi_integer8, mpi_bor, mpi_comm_world)
  end subroutine fill_in

  !> Begin to send numbers to some ranks and to receive others from them.
  subroutine begin_swap(self, partners, sent_ends, sent, received_ends, received, messages)
    class(ranks_t), intent(in) :: self
    integer,  intent(in) :: partners(:)                  !! ranks
    integer,  intent(in) :: sent_ends(0:)                !! last number for each; 0 before the first
    integer,  intent(in) :: received_ends(0:)            !! likewise
    real(wp), intent(in),    contiguous, asynchronous :: sent(:)
    real(wp), intent(inout), contiguous, asynchronous :: received(:)
    type(messages_t), intent(out) :: messages
    type(mpi_request) :: requests(2 * size(partners))
    integer :: k, n

    n = 0
    if (self%count == 1) return
    do k = 1, size(partners)
      if (received_ends(k) > received_ends(k - 1)) then
        n = n + 1
        call mpi_irecv(received(received_ends(k - 1) + 1:received_ends(k)), &
          received_ends(k) - received_ends(k - 1), mpi_double_precision, partners(k), any_tag, &
          mpi_comm_world, requests(n))
      end if
    end do
    do k = 1, size(partners)
      if (sent_ends(k) > sent_ends(k - 1)) then
        n = n + 1
        call mpi_isend(sent(sent_ends(k - 1) + 1:sent_ends(k)), sent_ends(k) - sent_ends(k - 1), &
          mpi_double_precision, partners(k), any_tag, mpi_comm_world, requests(n))
      end if
    end do
    messages%requests = requests(:n)
  end subroutine begin_swap

  !> Help messages on: large ones travel only while their ranks look at them.
  subroutine help(self)
    class(messages_t), intent(inout) :: self
    logical :: arrived

    if (.not. allocated(self%requests)) return
    call mpi_testall(size(self%requests), self%requests, arrived, mpi_statuses_ignore)
  end subroutine help

  !> Wait until messages have arrived.
  subroutine await_values(self, received)
    class(messages_t), intent(inout) :: self
    real(wp), intent(inout), contiguous, asynchronous :: received(:)   !! as they began

    associate (unchanged => received)
    end associate
    call wait_for(self)
  end subroutine await_values

  !> The same for whole numbers.
  subroutine await_numbers(self, received)
    class(messages_t), intent(inout) :: self
    integer, intent(inout), contiguous, asynchronous :: received(:)   !! as they began

    associate (unchanged => received)
    end associate
    call wait_for(self)
  end subroutine await_numbers

  subroutine wait_for(self)
    class(messages_t), intent(inout) :: self

    if (.not. allocated(self%requests)) return
    call mpi_waitall(size(self%requests), self%requests, mpi_statuses_ignore)
  end subroutine wait_for

  !> What one rank has, made known to rank 0.
  subroutine hand_over(self, from, values)
    class(ranks_t), intent(in) :: self
    integer,        intent(in) :: from   !! the rank
    real(wp), intent(inout), contiguous :: values(:, :)

    if (from == 0 .or. size(values) == 0) return
    if (self%mine == from) call mpi_send(values, size(values), mpi_double_precision, 0, any_tag, &
      mpi_comm_world)
    if (self%mine == 0) call mpi_recv(values, size(values), mpi_double_precision, from, any_tag, &
      mpi_comm_world, mpi_status_ignore)
  end subroutine hand_over

  !> Columns of an array of which each is known to one rank, made known to all.
  subroutine spread_out(self, values, ends)
    class(ranks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: values(:, :)
    integer,  intent(in) :: ends(0:)

    if (self%count > 1) call mpi_allgatherv(mpi_in_place, 0, mpi_double_precision, values, &
      size(values, 1) * (ends(1:) - ends(:self%count - 1)), &
      size(values, 1) * ends(:self%count - 1), mpi_double_precision, mpi_comm_world)
  end subroutine spread_out

end module pd_ranks
