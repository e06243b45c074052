!> What one core and all cores of this machine can do: STREAM triad, and a chain of vector
!> multiply-adds that stay in registers. Prints `triad_1 triad_all` [GB/s] and `flops_1` [Gflop/s].
!>
!> Source: McCalpin, STREAM (three arrays of 8 bytes count, a write counts once).
program machine
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use pd_kinds, only: wp
  implicit none

  integer, parameter :: n = 20000000, repetitions = 8
  real(wp), allocatable :: a(:), b(:), c(:)
  real(wp) :: one, all
  integer  :: i, cores

  cores = omp_get_max_threads()
  allocate (a(n), b(n), c(n))
  !$omp parallel do schedule(static) default(none) shared(a, b, c) private(i)
  do i = 1, n
    a(i) = 0.0_wp
    b(i) = 1.0_wp
    c(i) = 2.0_wp
  end do
  !$omp end parallel do
  call omp_set_num_threads(1)
  one = triad()
  call omp_set_num_threads(cores)
  all = triad()
  write (output_unit, '(3(a,1x,f0.3,1x),a,1x,i0)') 'triad_1', one, 'triad_all', all, 'flops_1', &
    multiply_adds(), 'cores', cores

contains

  !> Bandwidth of a = b + s c, the best of several [GB/s].
  real(wp) function triad() result(rate)
    integer(int64) :: start, finish, ticks
    integer :: k, j

    rate = 0.0_wp
    do k = 1, repetitions
      call system_clock(start, ticks)
      !$omp parallel do simd schedule(static) default(none) shared(a, b, c) private(j)
      do j = 1, n
        a(j) = b(j) + 3.0_wp * c(j)
      end do
      !$omp end parallel do simd
      call system_clock(finish)
      rate = max(rate, 24.0e-9_wp * real(n, wp) * real(ticks, wp) / real(finish - start, wp))
    end do
  end function triad

  !> Multiply-adds in registers, the best of several [Gflop/s].
  real(wp) function multiply_adds() result(rate)
    integer, parameter :: lanes = 64, rounds = 2000000
    real(wp) :: x(lanes), y
    integer(int64) :: start, finish, ticks
    integer :: k, j, r

    rate = 0.0_wp
    y = 1.0_wp
    do k = 1, repetitions
      x = real(k, wp)
      call system_clock(start, ticks)
      do r = 1, rounds
        !$omp simd
        do j = 1, lanes
          x(j) = x(j) * 0.999999_wp + 1.0e-6_wp
        end do
      end do
      call system_clock(finish)
      y = y + sum(x)
      rate = max(rate, 2.0e-9_wp * real(lanes, wp) * real(rounds, wp) * real(ticks, wp) &
        / real(finish - start, wp))
    end do
    if (y < 0.0_wp) rate = 0.0_wp   ! so that the sum is needed
  end function multiply_adds

end program machine
