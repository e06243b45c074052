!> Where the time of a step goes.
!>
!> Kernels that follow one another on each block of rows run in one loop. In some steps the blocks
!> are timed, and the time of the loop is divided among its kernels in proportion.
module pd_timing
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_kinds, only: wp
  implicit none
  private

  public :: timing_t, kernel_names, now
  public :: kernel_motion, kernel_gradient, kernel_force, kernel_boundaries, kernel_history

  !> Names of the kernels in the order of `timing_t%seconds`.
  character(10), parameter :: kernel_names(6) = [character(10) :: 'motion', 'gradient', 'stress', &
    'force', 'boundaries', 'history']
  !> Their numbers; gradient and stress run block by block in one loop, see `lap_blocks`.
  integer, parameter :: kernel_motion = 1, kernel_gradient = 2, kernel_force = 4, &
    kernel_boundaries = 5, kernel_history = 6
  integer, parameter :: timed_step = 20   !! the blocks are timed once in so many steps

  !> Wall clock time spent in each kernel [s].
  type :: timing_t
    real(wp) :: seconds(size(kernel_names)) = 0.0_wp
    logical  :: blocks = .true.                        !! blocks are timed in this step
    real(wp), private :: last = 0.0_wp
    !> Part of the time of two kernels that the first one took when blocks were last timed.
    real(wp), private :: share(size(kernel_names)) = 0.5_wp
  contains
    procedure :: begin
    procedure :: lap
    procedure :: lap_blocks
  end type timing_t

contains

  !> Wall clock time [s].
  real(wp) function now()
    integer(int64) :: count, rate

    call system_clock(count, rate)
    now = real(count, wp) / real(rate, wp)
  end function now

  !> Start the clock of a step.
  subroutine begin(self, step)
    class(timing_t), intent(inout) :: self
    integer,         intent(in)    :: step

    self%blocks = modulo(step, timed_step) == 1
    self%last = now()
  end subroutine begin

  !> Add the time since the last call to that of a kernel.
  subroutine lap(self, kernel)
    class(timing_t), intent(inout) :: self
    integer,         intent(in)    :: kernel
    real(wp) :: time

    time = now()
    self%seconds(kernel) = self%seconds(kernel) + (time - self%last)
    self%last = time
  end subroutine lap

  !> Divide the time since the last call between a kernel and the one after it, which ran block by
  !> block. If blocks are timed, `times` holds the clock before, between and after the two.
  subroutine lap_blocks(self, kernel, times)
    class(timing_t), intent(inout) :: self
    integer,         intent(in)    :: kernel        !! the first of the two
    real(wp),        intent(in)    :: times(:, :)   !! (3,blocks) [s]
    real(wp) :: time, share

    if (self%blocks) self%share(kernel) = sum(times(2, :) - times(1, :)) &
      / max(sum(times(3, :) - times(1, :)), tiny(1.0_wp))
    share = min(1.0_wp, max(0.0_wp, self%share(kernel)))
    time = now()
    self%seconds(kernel) = self%seconds(kernel) + share * (time - self%last)
    self%seconds(kernel + 1) = self%seconds(kernel + 1) + (1.0_wp - share) * (time - self%last)
    self%last = time
  end subroutine lap_blocks

end module pd_timing
