!> Shape tensor and deformation gradient.
!>
!> Source: doc/theory.md, section 2.
module pd_kinematics
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_operators, only: operators_t
  implicit none
  private

  public :: inverse_shape_tensor, deformation_gradient_block

contains

  !> K^-1 of every point; zero for voids (volume 0).
  !>
  !> Errors: a family with too few bonds or (nearly) on one line: condition number of K, a
  !> scale-free number, over 1e6. The first few such points are named with their positions.
  subroutine inverse_shape_tensor(operators, position, volume, k_inverse, errors)
    class(operators_t), intent(in)    :: operators
    real(wp),           intent(in), contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp),           intent(in), contiguous :: volume(:)        !! V (n) [m^2]; voids: 0
    real(wp),           intent(out), contiguous :: k_inverse(:, :)  !! (n,3) xx yy xy [1/m^4]
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: largest_condition = 1.0e6_wp
    integer,  parameter :: most_reported = 10
    real(wp), allocatable :: k(:, :)
    real(wp) :: mean, radius, determinant
    character(160) :: text
    integer  :: i, n_singular

    allocate (k(operators%n, 3))
    call operators%shape_tensor(k)
    n_singular = 0
    do i = 1, operators%n
      k_inverse(i, :) = 0.0_wp
      if (volume(i) <= 0.0_wp) cycle
      mean = 0.5_wp * (k(i, 1) + k(i, 2))
      radius = sqrt((0.5_wp * (k(i, 1) - k(i, 2)))**2 + k(i, 3)**2)
      determinant = k(i, 1) * k(i, 2) - k(i, 3)**2
      if (determinant > 0.0_wp .and. mean + radius < largest_condition * (mean - radius)) then
        k_inverse(i, 1) = k(i, 2) / determinant
        k_inverse(i, 2) = k(i, 1) / determinant
        k_inverse(i, 3) = -k(i, 3) / determinant
      else
        n_singular = n_singular + 1
        if (n_singular > most_reported) cycle
        write (text, '(a,i0,a,g0.7,a,g0.7,a)') 'point ', count(volume(:i) > 0.0_wp), ' at (', &
          position(i, 1), ', ', position(i, 2), ') m'
        call errors%add('the shape tensor is singular: the family is too small or lies on '// &
          'one line', trim(text), allowed='condition number below 1e6; a larger horizon helps')
      end if
    end do
    if (n_singular > most_reported) then
      write (text, '(i0,a)') n_singular - most_reported, ' more points have a singular shape tensor'
      call errors%add(trim(text))
    end if
  end subroutine inverse_shape_tensor

  !> F = I + G[u] K^-1 of points lo to hi, in the place of G[u].
  pure subroutine deformation_gradient_block(lo, hi, k_inverse, gradient)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: k_inverse(:, :)  !! (n,3) xx yy xy [1/m^4]
    real(wp), intent(inout), contiguous :: gradient(:, :)   !! (n,4) xx xy yx yy; G[u] [m^4] -> F
    integer  :: i
    real(wp) :: gxx, gxy, gyx, gyy

    !$omp simd simdlen(8) private(gxx, gxy, gyx, gyy)
    do i = lo, hi
      gxx = gradient(i, 1)
      gxy = gradient(i, 2)
      gyx = gradient(i, 3)
      gyy = gradient(i, 4)
      gradient(i, 1) = 1.0_wp + gxx * k_inverse(i, 1) + gxy * k_inverse(i, 3)
      gradient(i, 2) = gxx * k_inverse(i, 3) + gxy * k_inverse(i, 2)
      gradient(i, 3) = gyx * k_inverse(i, 1) + gyy * k_inverse(i, 3)
      gradient(i, 4) = 1.0_wp + gyx * k_inverse(i, 3) + gyy * k_inverse(i, 2)
    end do
  end subroutine deformation_gradient_block

end module pd_kinematics
