!> Long waves of a field over scattered points, for iterations that see them too slowly.
!>
!> They are spanned by quadratic B-splines on a coarse square grid, set to zero at masked points:
!>
!>   x_i = sum_l B_l(X_i) c_l             r_l = sum_i V_i B_l(X_i) f_i
!>
!> `correct` adds to a field the long wave whose image under a symmetric operator A has the same
!> sums r_l as a given force: B (B^T V A B)^-1 B^T V f. A must not reach further than one width of
!> the grid, so that two functions whose centres are four widths apart do not meet, and the matrix
!> is a band.
!> Source: doc/theory.md, section 4; Nicolaides (1987).
module pd_long_waves
  use pd_kinds, only: wp
  implicit none
  private

  public :: long_waves_t, new_long_waves

  !> Functions on one side of another that meet it; all of them, and that in both directions.
  integer, parameter :: reach = 3, period = 2 * reach + 1
  integer, parameter, public :: probes = (period**2 + 1) / 2   !! fields that find the matrix

  type :: long_waves_t
    integer :: n = 0                                  !! functions
    integer,  private :: columns = 0                  !! of the grid
    integer,  private :: band = 0                     !! side diagonals of the matrix
    integer,  allocatable, private :: home(:)         !! function nearest to each point (n)
    real(wp), allocatable, private :: value(:, :, :)  !! B along x and y, 3 each; masked: 0 (3,2,n)
    real(wp), allocatable, private :: volume(:)       !! V (n) [m^2]
    real(wp), allocatable, private :: matrix(:, :)    !! lower half, then its Cholesky factor
  contains
    procedure :: probe
    procedure :: take_image
    procedure :: factorise
    procedure :: correct
    procedure, private :: sums
  end type long_waves_t

contains

  !> The grid over some points, without its matrix.
  pure type(long_waves_t) function new_long_waves(position, volume, mask, width) result(waves)
    real(wp), intent(in) :: position(:, :)   !! X (n,2) [m]
    real(wp), intent(in) :: volume(:)        !! V (n) [m^2]
    logical,  intent(in) :: mask(:)          !! points that may move (n)
    real(wp), intent(in) :: width            !! of the grid [m]
    real(wp) :: lower(2), t(2), s
    integer  :: c, i, nearest(2)

    lower = minval(position, dim=1)
    nearest = nint((maxval(position, dim=1) - lower) / width) + 3
    waves%columns = nearest(1)
    waves%n = product(nearest)
    waves%band = reach * (waves%columns + 1)
    allocate (waves%home(size(mask)), waves%value(3, 2, size(mask)))
    allocate (waves%volume, source=volume)
    allocate (waves%matrix(0:waves%band, waves%n), source=0.0_wp)
    do i = 1, size(mask)
      t = (position(i, :) - lower) / width
      nearest = nint(t)
      waves%home(i) = nearest(1) + 2 + waves%columns * (nearest(2) + 1)
      do c = 1, 2
        s = t(c) - real(nearest(c), wp)
        waves%value(:, c, i) = [0.5_wp * (0.5_wp - s)**2, 0.75_wp - s**2, 0.5_wp * (0.5_wp + s)**2]
      end do
      if (.not. mask(i)) waves%value(:, :, i) = 0.0_wp
    end do
  end function new_long_waves

  !> Two fields out of the `probes` that find the matrix: functions that do not meet, added up.
  pure subroutine probe(self, k, field)
    class(long_waves_t), intent(in)  :: self
    integer,             intent(in)  :: k             !! 1 to probes
    real(wp),            intent(out) :: field(:, :)   !! (n,2)
    integer :: a, b, c, i, l

    field = 0.0_wp
    do i = 1, size(self%home)
      do b = 1, 3
        do a = 1, 3
          l = self%home(i) + a - 2 + self%columns * (b - 2)
          c = colour(self, l) - 2 * (k - 1)
          if (c == 1 .or. c == 2) &
            field(i, c) = field(i, c) + self%value(a, 1, i) * self%value(b, 2, i)
        end do
      end do
    end do
  end subroutine probe

  !> Functions of one colour do not meet, nor does a third one meet two of them.
  pure integer function colour(self, l)
    type(long_waves_t), intent(in) :: self
    integer,            intent(in) :: l

    colour = 1 + modulo(modulo(l - 1, self%columns), period) &
      + period * modulo((l - 1) / self%columns, period)
  end function colour

  !> Put the images A x of the two fields of probe k into the matrix.
  pure subroutine take_image(self, k, image)
    class(long_waves_t), intent(inout) :: self
    integer,             intent(in)    :: k
    real(wp),            intent(in)    :: image(:, :)   !! (n,2)
    real(wp), allocatable :: r(:, :)
    integer :: c, column, row, l, m

    allocate (r(self%n, 2))
    call self%sums(image, r)
    do l = 1, self%n
      ! of the functions of a colour l meets one at most
      do row = max(0, (l - 1) / self%columns - reach), (l - 1) / self%columns   ! m <= l
        do column = max(0, modulo(l - 1, self%columns) - reach), &
          min(self%columns - 1, modulo(l - 1, self%columns) + reach)
          m = 1 + column + self%columns * row
          c = colour(self, m) - 2 * (k - 1)
          if (m <= l .and. (c == 1 .or. c == 2)) self%matrix(l - m, m) = r(l, c)
        end do
      end do
    end do
  end subroutine take_image

  !> Sums r_l.
  pure subroutine sums(self, f, r)
    class(long_waves_t), intent(in)  :: self
    real(wp),            intent(in)  :: f(:, :)   !! (n,2)
    real(wp),            intent(out) :: r(:, :)   !! (functions,2)
    integer :: a, b, i, l

    r = 0.0_wp
    do i = 1, size(self%home)
      do b = 1, 3
        do a = 1, 3
          l = self%home(i) + a - 2 + self%columns * (b - 2)
          r(l, :) = r(l, :) + self%volume(i) * self%value(a, 1, i) * self%value(b, 2, i) * f(i, :)
        end do
      end do
    end do
  end subroutine sums

  !> Cholesky factor of the matrix. Waves that A does not see (affine ones in a free body) get a
  !> little stiffness; functions that hold no point, or depend on others, are left out.
  pure subroutine factorise(self)
    class(long_waves_t), intent(inout) :: self
    real(wp), parameter :: little = 1.0e-10_wp, least = 1.0e-12_wp, stiff = 1.0e100_wp
    real(wp) :: stiffness(self%n)
    integer  :: j, k, last

    stiffness = self%matrix(0, :)
    self%matrix(0, :) = (1.0_wp + little) * stiffness
    do k = 1, self%n
      if (self%matrix(0, k) <= least * stiffness(k)) then
        self%matrix(0, k) = stiff   ! whatever stands below it has no weight then
        cycle
      end if
      self%matrix(0, k) = sqrt(self%matrix(0, k))
      self%matrix(1:, k) = self%matrix(1:, k) / self%matrix(0, k)
      last = min(self%n, k + self%band)
      do j = k + 1, last
        self%matrix(0:last - j, j) = self%matrix(0:last - j, j) &
          - self%matrix(j - k, k) * self%matrix(j - k:last - k, k)
      end do
    end do
  end subroutine factorise

  !> Add the long wave that answers a force.
  pure subroutine correct(self, f, x)
    class(long_waves_t), intent(in)    :: self
    real(wp),            intent(in)    :: f(:, :)   !! (n,2)
    real(wp),            intent(inout) :: x(:, :)   !! (n,2)
    real(wp), allocatable :: c(:, :)
    integer :: a, b, i, k, last, l

    allocate (c(self%n, 2))
    call self%sums(f, c)
    do k = 1, self%n
      c(k, :) = c(k, :) / self%matrix(0, k)
      last = min(self%n, k + self%band)
      c(k + 1:last, 1) = c(k + 1:last, 1) - c(k, 1) * self%matrix(1:last - k, k)
      c(k + 1:last, 2) = c(k + 1:last, 2) - c(k, 2) * self%matrix(1:last - k, k)
    end do
    do k = self%n, 1, -1
      last = min(self%n, k + self%band)
      c(k, :) = (c(k, :) - matmul(self%matrix(1:last - k, k), c(k + 1:last, :))) &
        / self%matrix(0, k)
    end do
    do i = 1, size(self%home)
      do b = 1, 3
        do a = 1, 3
          l = self%home(i) + a - 2 + self%columns * (b - 2)
          x(i, :) = x(i, :) + self%value(a, 1, i) * self%value(b, 2, i) * c(l, :)
        end do
      end do
    end do
  end subroutine correct

end module pd_long_waves
