!> The ranks that share a run: one.
!>
!> Serial form. Everything that a sum, an extremum or a decision needs from other ranks goes through
!> this module. The form with messages is mpi/pd_ranks.f90; the Makefile chooses one of them.
module pd_ranks
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
    procedure, nopass :: total
    procedure, nopass :: largest
    procedure, nopass :: smallest
    procedure, nopass :: lowest_number
    procedure, nopass :: gathered
    procedure, nopass :: largest_numbers
    procedure, nopass :: begin_largest
    procedure, nopass :: fill_in
    procedure, nopass :: begin_swap
    procedure, nopass :: spread_out
    procedure, nopass :: hand_over
    procedure, nopass :: gathered_rows
  end type ranks_t

  !> Messages on their way. What is sent and received must stay where it is until they have arrived.
  type :: messages_t
  contains
    procedure, nopass :: help
    procedure, nopass, private :: await_values, await_numbers
    generic :: await => await_values, await_numbers
  end type messages_t

contains

  !> Begin: who takes part.
  subroutine begin_ranks(ranks)
    type(ranks_t), intent(out) :: ranks

    ranks%mine = 0
  end subroutine begin_ranks

  !> End, all ranks together.
  subroutine end_ranks()
  end subroutine end_ranks

  !> End all ranks from one of them, with an exit status.
  subroutine abort_ranks(status)
    integer, intent(in) :: status

    associate (unused => status)
    end associate
  end subroutine abort_ranks

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

  !> The numbers of the blocks of all ranks, in the order of the blocks.
  pure function gathered(parts) result(all_parts)
    real(wp), intent(in) :: parts(:)   !! one number per block of this rank
    real(wp), allocatable :: all_parts(:)

    all_parts = parts
  end function gathered

  !> The same of several numbers per block.
  pure function gathered_rows(parts) result(all_parts)
    real(wp), intent(in) :: parts(:, :)   !! (numbers, blocks of this rank)
    real(wp), allocatable :: all_parts(:, :)

    all_parts = parts
  end function gathered_rows

  !> The largest of every number on any rank.
  pure subroutine largest_numbers(numbers)
    integer, intent(inout) :: numbers(:)

    associate (unchanged => numbers)
    end associate
  end subroutine largest_numbers

  !> Begin to find them.
  pure subroutine begin_largest(numbers, messages)
    integer,          intent(inout), contiguous :: numbers(:)
    type(messages_t), intent(inout) :: messages

    associate (unchanged => numbers, no_messages => messages)
    end associate
  end subroutine begin_largest

  !> Numbers of which each is known to one rank, made known to all, bit by bit.
  pure subroutine fill_in(numbers)
    real(wp), intent(inout), contiguous :: numbers(:)   !! in: 0 but for those that are known here

    associate (unchanged => numbers)
    end associate
  end subroutine fill_in

  !> Begin to send numbers to some ranks and to receive others from them.
  pure subroutine begin_swap(partners, sent_ends, sent, received_ends, received, messages)
    integer,  intent(in)    :: partners(:)               !! ranks
    integer,  intent(in)    :: sent_ends(0:)             !! last number for each; 0 before the first
    integer,  intent(in)    :: received_ends(0:)         !! likewise
    real(wp), intent(in),    contiguous :: sent(:)
    real(wp), intent(inout), contiguous :: received(:)
    type(messages_t), intent(inout)     :: messages

    associate (unused => partners, unused_ends => sent_ends, unused_others => received_ends, &
      unused_numbers => sent, unchanged => received, no_messages => messages)
    end associate
  end subroutine begin_swap

  !> Help messages on.
  pure subroutine help()
  end subroutine help

  !> Wait until messages have arrived.
  pure subroutine await_values(received)
    real(wp), intent(inout), contiguous :: received(:)

    associate (unchanged => received)
    end associate
  end subroutine await_values

  !> The same for whole numbers.
  pure subroutine await_numbers(received)
    integer, intent(inout), contiguous :: received(:)

    associate (unchanged => received)
    end associate
  end subroutine await_numbers

  !> What one rank has, made known to rank 0.
  pure subroutine hand_over(from, values)
    integer,  intent(in) :: from   !! the rank
    real(wp), intent(inout), contiguous :: values(:, :)

    associate (unused => from, unchanged => values)
    end associate
  end subroutine hand_over

  !> Columns of an array of which each is known to one rank, made known to all.
  pure subroutine spread_out(values, ends)
    real(wp), intent(inout), contiguous :: values(:, :)
    integer,  intent(in) :: ends(0:)

    associate (unused => ends, unchanged => values)
    end associate
  end subroutine spread_out

end module pd_ranks
