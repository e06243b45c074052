!> How many threads a run takes where the user says nothing.
!>
!> Threads that wait for each other at every loop of a small body spin; on a machine whose cores are
!> busy that costs up to a hundred times the work. Results do not depend on their number.
!> Source: doc/performance.md, how many threads.
module pd_threads
  use, intrinsic :: iso_fortran_env, only: int64
  use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_set_num_threads
  use pd_forces, only: linear_forces
  use pd_input_shapes, only: find_extents
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_text, only: integer_text
  implicit none
  private

  public :: choose_threads, spare_threads, words_on_cores

  integer, parameter :: few = 1000       !! points, for which one thread is best on any machine
  integer, parameter :: many = 100000    !! points, for which all cores are

contains

  !> Take one thread for a small body before it is set up, and for each of several ranks: they share
  !> the cores.
  subroutine spare_threads(asked_for, ranks, input)
    integer,       intent(in) :: asked_for   !! with --threads, 0: not
    integer,       intent(in) :: ranks
    type(input_t), intent(in) :: input
    real(wp) :: lower(2), upper(2)
    integer  :: status
    logical  :: known

    call get_environment_variable('OMP_NUM_THREADS', status=status)
    if (asked_for > 0 .or. status == 0) return
    if (ranks > 1) call omp_set_num_threads(1)
    call find_extents(input%bodies, input%discretisation%spacing, lower, upper, known)
    if (.not. known .or. input%bodies(1)%shape == 'file') return
    if (product((upper - lower) / input%discretisation%spacing + 1.0_wp) < real(few, wp)) &
      call omp_set_num_threads(1)
  end subroutine spare_threads

  !> Take one thread for few points, all for many; try both in between. The user decides with
  !> --threads or OMP_NUM_THREADS.
  subroutine choose_threads(asked_for, model)
    integer,       intent(in)    :: asked_for   !! with --threads, 0: not
    type(model_t), intent(inout) :: model       !! its operators are used, and not changed
    integer  :: status, all_cores
    real(wp) :: with_all, with_one

    call get_environment_variable('OMP_NUM_THREADS', status=status)
    all_cores = omp_get_max_threads()
    if (asked_for > 0 .or. status == 0 .or. all_cores == 1 .or. model%body%n >= many) return
    with_all = 0.0_wp
    with_one = -1.0_wp
    if (model%body%n >= few) with_all = seconds_of_passes(model)
    call omp_set_num_threads(1)
    if (model%body%n >= few) with_one = seconds_of_passes(model)
    if (with_all < with_one) call omp_set_num_threads(all_cores)
  end subroutine choose_threads

  !> Time of some applications of the linear operator. The sum, not the fastest: what a busy core
  !> costs comes now and then.
  real(wp) function seconds_of_passes(model) result(seconds)
    type(model_t), intent(inout) :: model
    integer, parameter :: passes = 20
    real(wp), allocatable :: u(:, :), h(:, :), f(:, :)
    integer(int64) :: start, finish, rate
    integer :: k

    allocate (h(model%operators%n, 4), f(model%operators%n, 2), source=0.0_wp)
    allocate (u(model%operators%n, 2), source=0.0_wp)
    call linear_forces(model%operators, model%materials, u, h, f)
    call system_clock(start, rate)
    do k = 1, passes
      call linear_forces(model%operators, model%materials, u, h, f)
    end do
    call system_clock(finish)
    seconds = real(finish - start, wp) / real(rate, wp)
  end function seconds_of_passes

  !> What is to be said of threads that share the cores that mpirun has given a rank; '': nothing.
  function words_on_cores(ranks) result(text)
    integer, intent(in) :: ranks
    character(:), allocatable :: text
    integer :: threads, cores

    text = ''
    threads = omp_get_max_threads()
    cores = omp_get_num_procs()
    if (ranks > 1 .and. threads > cores) text = integer_text(threads)// &
      ' threads of a rank share '//integer_text(cores)//' of the cores; mpirun --map-by '// &
      'slot:PE=N gives each rank N of them'
  end function words_on_cores

end module pd_threads
