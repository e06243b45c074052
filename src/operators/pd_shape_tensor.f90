!> Shape tensors: K of every family, and its inverse, which the operators keep.
!>
!> Source: doc/theory.md, section 2.
module pd_shape_tensor
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_operators, only: operators_t
  use pd_pages, only: clear_rows
  use pd_text, only: coordinate_text, integer_text
  implicit none
  private

  public :: invert_shape_tensors

contains

  !> K^-1 of every point, kept in the operators; zero in rows without a point (volume 0).
  !>
  !> Errors: a family with too few bonds or (nearly) on one line: condition number of K, a
  !> scale-free number, over 1e6. The first few such points are named with their positions.
  subroutine invert_shape_tensors(operators, position, volume, errors)
    class(operators_t), intent(inout) :: operators
    real(wp),           intent(in), contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp),           intent(in), contiguous :: volume(:)        !! V (n) [m^2]
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: largest_condition = 1.0e6_wp
    integer,  parameter :: most_reported = 10
    real(wp), allocatable :: k(:, :)
    real(wp) :: mean, radius, determinant
    integer  :: i, n_singular, singular(operators%domain%blocks%count)

    allocate (k(operators%n, 3), operators%k_inverse(operators%n, 3))
    call clear_rows(k, operators%storage%kept)
    call clear_rows(operators%k_inverse, operators%storage%kept)
    call operators%shape_tensor(k)
    n_singular = 0
    do i = operators%domain%blocks%first, operators%domain%blocks%last
      if (volume(i) <= 0.0_wp) cycle
      mean = 0.5_wp * (k(i, 1) + k(i, 2))
      radius = sqrt((0.5_wp * (k(i, 1) - k(i, 2)))**2 + k(i, 3)**2)
      determinant = k(i, 1) * k(i, 2) - k(i, 3)**2
      if (determinant > 0.0_wp .and. mean + radius < largest_condition * (mean - radius)) then
        operators%k_inverse(i, 1) = k(i, 2) / determinant
        operators%k_inverse(i, 2) = k(i, 1) / determinant
        operators%k_inverse(i, 3) = -k(i, 3) / determinant
      else
        n_singular = n_singular + 1
        if (n_singular > most_reported) cycle
        call errors%add('the shape tensor is singular: the family is too small or lies on '// &
          'one line', 'point '//integer_text(operators%storage%point_at(i))//' at ('// &
          coordinate_text(position(i, 1), sqrt(volume(i)))//', '// &
          coordinate_text(position(i, 2), sqrt(volume(i)))//') m', &
          allowed='condition number below 1e6; a larger horizon helps, or a smaller spacing '// &
          'where the body is a single row of points')
      end if
    end do
    ! what other ranks have found is counted: the first that has found something tells
    singular = 0
    if (size(singular) > 0) singular(1) = n_singular
    i = nint(operators%domain%blocks%total(real(singular, wp))) - min(n_singular, most_reported)
    if (n_singular > 0 .and. i > 0) then
      call errors%add(integer_text(i)//' more points have a singular shape tensor')
    end if
  end subroutine invert_shape_tensors

end module pd_shape_tensor
