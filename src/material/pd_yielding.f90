!> What a point of J2 plasticity remembers, and the points of a block that yield.
!>
!> Source: doc/theory.md, section 3.
module pd_yielding
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t
  implicit none
  private

  public :: yielding_t, remembers, gather_points, scatter_points, alpha

  !> Columns of the history: E^p, beta (xx yy zz xy each) and alpha.
  integer, parameter :: plastic_strain = 0, back_stress = 4, alpha = 9

  !> Rows that follow each other.
  type :: runs_t
    integer :: n = 0            !! runs; 0: too many
    integer :: last(n_block)    !! place of the last row of a run among the rows (n)
  end type runs_t

  integer, parameter :: least_run = 8   !! rows of a run, on average, that are worth it

  !> Points that yield, gathered from a block: the loops over them run with unit stride.
  type :: yielding_t
    real(wp) :: yield_stress(n_block)         !! sigma_y0 [Pa]
    real(wp) :: stress(n_block, 4)            !! S* -> S [Pa]
    real(wp) :: plastic_strain(n_block, 4)    !! E^p
    real(wp) :: back_stress(n_block, 4)       !! beta [Pa]
    real(wp) :: alpha(n_block)                !! equivalent plastic strain
    type(runs_t), private :: runs             !! of their rows
  end type yielding_t

contains

  !> What a point remembers.
  pure function remembers() result(columns)
    type(label_t), allocatable :: columns(:)
    character(2), parameter :: ends(4) = ['xx', 'yy', 'zz', 'xy']
    integer :: c

    allocate (columns(alpha))
    do c = 1, 4
      columns(plastic_strain + c) = label_t('plastic_strain_'//ends(c), '1', &
        'plastic strain '//ends(c))
      columns(back_stress + c) = label_t('back_stress_'//ends(c), 'Pa', &
        'back stress '//ends(c))
    end do
    columns(alpha) = label_t('equivalent_plastic_strain', '1', &
      'equivalent plastic strain, accumulated')
  end function remembers

  !> Gather the yielding points from their rows.
  pure subroutine gather_points(n, first, rows, trial, points, yielding)
    integer,            intent(in)  :: n, first, rows(n_block)
    real(wp),           intent(in)  :: trial(n_block, 4)
    type(law_points_t), intent(in)  :: points
    type(yielding_t),   intent(out) :: yielding
    integer :: c

    yielding%runs = runs_of(n, rows)
    associate (history => points%history, runs => yielding%runs)
      call take(n, rows, 0, runs, points%strength, yielding%yield_stress)
      call take(n, rows, 0, runs, history(:, alpha), yielding%alpha)
      do c = 1, 4
        call take(n, rows, 1 - first, runs, trial(:, c), yielding%stress(:, c))
        call take(n, rows, 0, runs, history(:, plastic_strain + c), yielding%plastic_strain(:, c))
        call take(n, rows, 0, runs, history(:, back_stress + c), yielding%back_stress(:, c))
      end do
    end associate
  end subroutine gather_points

  !> Put the returned points back into their rows, and tell how they flowed: what they dissipated,
  !> how far they flowed, and sqrt(3/2)|dev S| at the end.
  pure subroutine scatter_points(n, first, yielding, trial, points, flow)
    integer,            intent(in)    :: n, first
    type(yielding_t),   intent(in)    :: yielding
    real(wp),           intent(inout) :: trial(n_block, 4)
    type(law_points_t), intent(inout) :: points
    type(flow_t),       intent(inout) :: flow   !! its rows are given
    real(wp), parameter :: half(4) = [0.5_wp, 0.5_wp, 0.5_wp, 1.0_wp]   ! xy counts twice
    real(wp) :: stress(n_block), strain(n_block)   ! before the step
    integer :: k, c

    flow%dissipated(:n) = 0.0_wp
    associate (history => points%history, rows => flow%rows, runs => yielding%runs)
      do c = 1, 4
        call take(n, rows, 0, runs, points%stress(:, c), stress)
        call take(n, rows, 0, runs, history(:, plastic_strain + c), strain)
        !$omp simd simdlen(8)
        do k = 1, n
          flow%dissipated(k) = flow%dissipated(k) + half(c) * (stress(k) + yielding%stress(k, c)) &
            * (yielding%plastic_strain(k, c) - strain(k))
        end do
        call put(n, rows, 1 - first, runs, yielding%stress(:, c), trial(:, c))
        call put(n, rows, 0, runs, yielding%plastic_strain(:, c), history(:, plastic_strain + c))
        call put(n, rows, 0, runs, yielding%back_stress(:, c), history(:, back_stress + c))
      end do
      call take(n, rows, 0, runs, history(:, alpha), strain)
      flow%increment(:n) = yielding%alpha(:n) - strain(:n)
      call put(n, rows, 0, runs, yielding%alpha, history(:, alpha))
    end associate
    call equivalent_stresses(n, yielding%stress, flow%strength)
  end subroutine scatter_points

  !> `von_mises` of n stresses.
  pure subroutine equivalent_stresses(n, stress, equivalent)
    integer,  intent(in)  :: n
    real(wp), intent(in)  :: stress(n_block, 4)     !! xx yy zz xy [Pa]
    real(wp), intent(inout) :: equivalent(n_block)  !! out [Pa]
    real(wp), parameter :: root_3_2 = sqrt(1.5_wp)
    real(wp) :: mean
    integer  :: k

    !$omp simd simdlen(8) private(mean)
    do k = 1, n
      mean = (stress(k, 1) + stress(k, 2) + stress(k, 3)) / 3.0_wp
      equivalent(k) = root_3_2 * sqrt((stress(k, 1) - mean)**2 + (stress(k, 2) - mean)**2 &
        + (stress(k, 3) - mean)**2 + 2.0_wp * stress(k, 4) * stress(k, 4))
    end do
  end subroutine equivalent_stresses

  !> The runs of rows that follow each other. None where most are short: rows are then taken one by
  !> one.
  pure type(runs_t) function runs_of(n, rows) result(runs)
    integer, intent(in) :: n, rows(n_block)   !! ascending
    integer :: k

    do k = 1, n
      if (k < n) then
        if (rows(k + 1) == rows(k) + 1) cycle
      end if
      if (runs%n == n / least_run) then
        runs%n = 0
        return
      end if
      runs%n = runs%n + 1
      runs%last(runs%n) = k
    end do
  end function runs_of

  !> Values of some rows. Where points flow most of their neighbours do, so copy run by run.
  pure subroutine take(n, rows, shift, runs, from, values)
    integer,      intent(in)    :: n, rows(n_block), shift   !! added to the rows
    type(runs_t), intent(in)    :: runs                      !! of the rows
    real(wp),     intent(in),    contiguous :: from(:)
    real(wp),     intent(inout) :: values(n_block)           !! out: (n)
    integer :: k, r, lo

    if (runs%n == 0) then
      do k = 1, n
        values(k) = from(rows(k) + shift)
      end do
    end if
    k = 1
    do r = 1, runs%n
      lo = rows(k) + shift
      values(k:runs%last(r)) = from(lo:lo + runs%last(r) - k)
      k = runs%last(r) + 1
    end do
  end subroutine take

  !> The opposite: values go to their rows.
  pure subroutine put(n, rows, shift, runs, values, to)
    integer,      intent(in)    :: n, rows(n_block), shift   !! added to the rows
    type(runs_t), intent(in)    :: runs                      !! of the rows
    real(wp),     intent(in)    :: values(n_block)
    real(wp),     intent(inout), contiguous :: to(:)
    integer :: k, r, lo

    if (runs%n == 0) then
      do k = 1, n
        to(rows(k) + shift) = values(k)
      end do
    end if
    k = 1
    do r = 1, runs%n
      lo = rows(k) + shift
      to(lo:lo + runs%last(r) - k) = values(k:runs%last(r))
      k = runs%last(r) + 1
    end do
  end subroutine put

end module pd_yielding
