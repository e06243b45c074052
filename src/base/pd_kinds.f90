!> Working precision and the constants that everything shares.
module pd_kinds
  use, intrinsic :: iso_c_binding, only: c_bool
  use, intrinsic :: iso_fortran_env, only: int64, int8, real64
  implicit none
  private

  public :: wp, i8, i1, l1, pi, unset, is_set, n_block, n_line, block_sum, block_dot
  public :: ordered_sum

  integer, parameter :: wp = real64
  integer, parameter :: i8 = int64

  !> For what there is one of per place, and large bodies have many: numbers and flags of one byte.
  integer, parameter :: i1 = int8
  integer, parameter :: l1 = c_bool

  real(wp), parameter :: pi = acos(-1.0_wp)

  !> Stands for a number that the user has not given. Not a NaN: it would trap in the debug build.
  real(wp), parameter :: unset = -huge(1.0_wp)

  !> Kernels work on blocks of this many rows, whatever the number of threads: every sum is taken
  !> over a block and then over the blocks in order, so its bits do not depend on threads.
  integer, parameter :: n_block = 256

  !> Numbers in a line of the cache, 64 bytes. Arrays begin at one (`pd_memory`), and on a lattice
  !> rows and blocks do, so that vector instructions seldom meet two lines.
  integer, parameter :: n_line = 8

contains

  !> Whether a number was given.
  elemental logical function is_set(x)
    real(wp), intent(in) :: x

    is_set = x > 0.5_wp * unset
  end function is_set

  !> Sum of a block in eight partial sums: the same order of additions with any compiler.
  pure real(wp) function block_sum(x)
    real(wp), intent(in) :: x(n_block)
    integer, parameter :: lanes = 8
    real(wp) :: partial(lanes)
    integer  :: i

    partial = 0.0_wp
    do i = 1, n_block, lanes
      partial = partial + x(i:i + lanes - 1)
    end do
    block_sum = ((partial(1) + partial(5)) + (partial(2) + partial(6))) &
      + ((partial(3) + partial(7)) + (partial(4) + partial(8)))
  end function block_sum

  !> Sum of products, in the same order.
  pure real(wp) function block_dot(x, y)
    real(wp), intent(in) :: x(n_block), y(n_block)
    integer, parameter :: lanes = 8
    real(wp) :: partial(lanes)
    integer  :: i

    partial = 0.0_wp
    do i = 1, n_block, lanes
      partial = partial + x(i:i + lanes - 1) * y(i:i + lanes - 1)
    end do
    block_dot = ((partial(1) + partial(5)) + (partial(2) + partial(6))) &
      + ((partial(3) + partial(7)) + (partial(4) + partial(8)))
  end function block_dot

  !> Sum of numbers in their order, whatever made them: products that the caller has rounded already
  !> are not rounded together with the sum.
  pure real(wp) function ordered_sum(x)
    real(wp), intent(in) :: x(:)

    ordered_sum = sum(x)
  end function ordered_sum

end module pd_kinds
