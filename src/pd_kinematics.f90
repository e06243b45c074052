!> Shape tensor and deformation gradient.
!>
!> Source: doc/theory.md, section 2.
module pd_kinematics
  use pd_errors, only: error_list_t
  use pd_kinds, only: n_block, wp
  use pd_operators, only: operators_t
  implicit none
  private

  public :: inverse_shape_tensor, deformation_gradient

contains

  !> K^-1 of every point. K = sum omega V_j xi (x) xi is the gradient operator applied to X, which
  !> makes an affine map exact whatever the round-off of the sums.
  !>
  !> Errors: a family with too few bonds or (nearly) on one line: condition number of K, a
  !> scale-free number, over 1e6. The first few such points are named with their positions.
  subroutine inverse_shape_tensor(operators, position, k_inverse, errors)
    type(operators_t),  intent(in)    :: operators
    real(wp),           intent(in)    :: position(:, :)   !! X (n,2) [m]
    real(wp),           intent(out)   :: k_inverse(:, :)  !! (n,3) xx yy xy [1/m^4]
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: largest_condition = 1.0e6_wp
    integer,  parameter :: most_reported = 10
    real(wp), allocatable :: k(:, :)
    real(wp) :: mean, radius, determinant
    character(160) :: text
    integer  :: i, n_singular

    allocate (k(operators%n, 4))
    call operators%gradient(position, k)
    n_singular = 0
    do i = 1, operators%n
      mean = 0.5_wp * (k(i, 1) + k(i, 4))
      radius = sqrt((0.5_wp * (k(i, 1) - k(i, 4)))**2 + k(i, 2)**2)
      determinant = k(i, 1) * k(i, 4) - k(i, 2)**2
      if (determinant > 0.0_wp .and. mean + radius < largest_condition * (mean - radius)) then
        k_inverse(i, 1) = k(i, 4) / determinant
        k_inverse(i, 2) = k(i, 1) / determinant
        k_inverse(i, 3) = -k(i, 2) / determinant
      else
        k_inverse(i, :) = 0.0_wp
        n_singular = n_singular + 1
        if (n_singular > most_reported) cycle
        write (text, '(a,i0,a,g0.7,a,g0.7,a)') 'point ', i, ' at (', position(i, 1), ', ', &
          position(i, 2), ') m'
        call errors%add('the shape tensor is singular: the family is too small or lies on '// &
          'one line', trim(text), allowed='condition number below 1e6; a larger horizon helps')
      end if
    end do
    if (n_singular > most_reported) then
      write (text, '(i0,a)') n_singular - most_reported, ' more points have a singular shape tensor'
      call errors%add(trim(text))
    end if
  end subroutine inverse_shape_tensor

  !> F = I + G[u] K^-1.
  !>
  !> `gradient` may be the array that receives F.
  subroutine deformation_gradient(k_inverse, gradient)
    real(wp), intent(in)    :: k_inverse(:, :)  !! (n,3) xx yy xy [1/m^4]
    real(wp), intent(inout) :: gradient(:, :)   !! (n,4) xx xy yx yy; in: G[u] [m^4], out: F
    integer  :: i, lo, n
    real(wp) :: gx, gy

    n = size(gradient, 1)
    !$omp parallel do schedule(static) default(none) shared(n, k_inverse, gradient) &
    !$omp private(i, lo, gx, gy)
    do lo = 1, n, n_block
      do i = lo, min(lo + n_block - 1, n)
        gx = gradient(i, 1)
        gy = gradient(i, 2)
        gradient(i, 1) = 1.0_wp + gx * k_inverse(i, 1) + gy * k_inverse(i, 3)
        gradient(i, 2) = gx * k_inverse(i, 3) + gy * k_inverse(i, 2)
        gx = gradient(i, 3)
        gy = gradient(i, 4)
        gradient(i, 3) = gx * k_inverse(i, 1) + gy * k_inverse(i, 3)
        gradient(i, 4) = 1.0_wp + gx * k_inverse(i, 3) + gy * k_inverse(i, 2)
      end do
    end do
    !$omp end parallel do
  end subroutine deformation_gradient

end module pd_kinematics
