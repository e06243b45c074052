!> What a point of J2 plasticity remembers, and the points of a block that yield.
!>
!> Source: doc/theory.md, section 3.
module pd_yielding
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t
  use pd_tensors, only: von_mises
  implicit none
  private

  public :: yielding_t, remembers, gather_points, scatter_points, alpha

  !> Columns of the history: E^p, beta (xx yy zz xy each) and alpha.
  integer, parameter :: plastic_strain = 0, back_stress = 4, alpha = 9

  !> Points that yield, gathered from a block: the loops over them run with unit stride.
  type :: yielding_t
    real(wp) :: yield_stress(n_block)         !! sigma_y0 [Pa]
    real(wp) :: stress(n_block, 4)            !! S* -> S [Pa]
    real(wp) :: plastic_strain(n_block, 4)    !! E^p
    real(wp) :: back_stress(n_block, 4)       !! beta [Pa]
    real(wp) :: alpha(n_block)                !! equivalent plastic strain
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
    integer :: k, c

    associate (history => points%history)
      do k = 1, n
        yielding%yield_stress(k) = points%strength(rows(k))
        yielding%alpha(k) = history(rows(k), alpha)
      end do
      do c = 1, 4
        do k = 1, n
          yielding%stress(k, c) = trial(rows(k) - first + 1, c)
          yielding%plastic_strain(k, c) = history(rows(k), plastic_strain + c)
          yielding%back_stress(k, c) = history(rows(k), back_stress + c)
        end do
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
    real(wp), parameter :: twice(4) = [1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp]
    integer :: i, k, c

    flow%dissipated(:n) = 0.0_wp
    associate (history => points%history, rows => flow%rows)
      do c = 1, 4
        do k = 1, n
          i = rows(k)
          flow%dissipated(k) = flow%dissipated(k) + 0.5_wp * twice(c) &
            * (points%stress(i, c) + yielding%stress(k, c)) &
            * (yielding%plastic_strain(k, c) - history(i, plastic_strain + c))
          trial(i - first + 1, c) = yielding%stress(k, c)
          history(i, plastic_strain + c) = yielding%plastic_strain(k, c)
          history(i, back_stress + c) = yielding%back_stress(k, c)
        end do
      end do
      do k = 1, n
        flow%increment(k) = yielding%alpha(k) - history(rows(k), alpha)
        flow%strength(k) = von_mises(yielding%stress(k, :))
        history(rows(k), alpha) = yielding%alpha(k)
      end do
    end associate
  end subroutine scatter_points

end module pd_yielding
