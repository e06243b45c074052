!> Soil that varies: a random field of the yield stress as a function of position.
!>
!> The field is a sum of waves, fixed by the seed and the correlation length alone. So one seed
!> gives one soil, whatever the spacing, the horizon, the layout or the body.
!> Source: doc/theory.md, section 12; Shinozuka & Deodatis (1991), Appl. Mech. Rev. 44, 191-204.
module pd_random_field
  use pd_kinds, only: n_block, pi, wp
  use pd_random, only: new_random, random_t
  implicit none
  private

  public :: random_field_t, new_random_field, standard_normal, lognormal, spread_t, spread_of
  public :: longest_way

  integer, parameter :: n_waves = 1024

  !> How far from the origin a point may lie, in correlation lengths: whole turns of the shortest
  !> wave, sqrt(30) / pi in a length, must be numbers that an integer can hold.
  real(wp), parameter :: longest_way = 1.0e8_wp

  !> z(X) = sqrt(2 / N) sum of cos(2 pi (wave . X + phase)).
  type :: random_field_t
    real(wp) :: wave(n_waves, 2)   !! wave vectors over 2 pi [1/m]
    real(wp) :: phase(n_waves)     !! over 2 pi, 0 to 1
  end type random_field_t

  !> The statistics of a field over a body.
  type :: spread_t
    real(wp) :: mean, variation    !! variation: standard deviation over mean
    real(wp) :: smallest, largest
  end type spread_t

contains

  !> Waves of a field of mean 0 and variance 1 with the correlation exp(-(r / length)^2).
  !>
  !> Its spectral density is a normal one: |k| = (2 / length) sqrt(-ln(1 - p)) for a share p of all
  !> wave vectors. The shares are taken from N equal parts of (0, 1), one from each; the directions
  !> turn by the golden part of half a turn from one to the next. Both are random, so the
  !> correlation over many seeds is exact; of one seed it errs far less than with independent
  !> wave vectors.
  pure type(random_field_t) function new_random_field(correlation_length, seed) result(field)
    real(wp), intent(in) :: correlation_length   !! [m]
    integer,  intent(in) :: seed
    real(wp), parameter :: golden = 0.5_wp * (sqrt(5.0_wp) - 1.0_wp)
    type(random_t) :: random
    real(wp) :: start, share, length, angle
    integer  :: k

    random = new_random(seed)
    call random%draw(start)
    do k = 1, n_waves
      call random%draw(share)
      call random%draw(field%phase(k))
      share = (real(k - 1, wp) + share) / real(n_waves, wp)
      length = sqrt(-log(1.0_wp - share)) / (pi * correlation_length)
      angle = pi * modulo(start + golden * real(k, wp), 1.0_wp)
      field%wave(k, :) = length * [cos(angle), sin(angle)]
    end do
  end function new_random_field

  !> z of points.
  subroutine standard_normal(field, position, z)
    type(random_field_t), intent(in) :: field
    real(wp), intent(in),  contiguous :: position(:, :)   !! X (n,2) [m]
    real(wp), intent(out), contiguous :: z(:)             !! (n)
    real(wp) :: x(n_block), y(n_block), sums(n_block)
    integer  :: lo, m

    !$omp parallel do schedule(static) default(none) shared(field, position, z) &
    !$omp private(lo, m, x, y, sums)
    do lo = 1, size(z), n_block
      m = min(n_block, size(z) - lo + 1)
      x = 0.0_wp
      y = 0.0_wp
      x(:m) = position(lo:lo + m - 1, 1)
      y(:m) = position(lo:lo + m - 1, 2)
      call add_waves(field, x, y, sums)
      z(lo:lo + m - 1) = sqrt(2.0_wp / real(n_waves, wp)) * sums(:m)
    end do
    !$omp end parallel do
  end subroutine standard_normal

  !> Sum of the waves for a block of points.
  !>
  !> The cosine is a polynomial, because that runs on whole vectors of points (`aint` would not):
  !> with t in turns, cos(2 pi t) = sin(2 pi s) for s = ||t - int(t)| - 1/2| - 1/4, |s| <= 1/4, and
  !> ten terms of its series leave an error of 3e-16.
  pure subroutine add_waves(field, x, y, sums)
    type(random_field_t), intent(in)  :: field
    real(wp),             intent(in)  :: x(n_block), y(n_block)   !! [m]
    real(wp),             intent(out) :: sums(n_block)
    real(wp), parameter :: c1 = 2.0_wp * pi, square = c1**2
    real(wp), parameter :: c3 = -c1 * square / 6.0_wp, c5 = -c3 * square / 20.0_wp, &
      c7 = -c5 * square / 42.0_wp, c9 = -c7 * square / 72.0_wp, c11 = -c9 * square / 110.0_wp, &
      c13 = -c11 * square / 156.0_wp, c15 = -c13 * square / 210.0_wp, &
      c17 = -c15 * square / 272.0_wp, c19 = -c17 * square / 342.0_wp
    real(wp) :: t, s, q
    integer  :: i, k

    sums = 0.0_wp
    do k = 1, n_waves
      !$omp simd private(t, s, q)
      do i = 1, n_block
        t = field%wave(k, 1) * x(i) + field%wave(k, 2) * y(i) + field%phase(k)
        s = abs(abs(t - real(int(t), wp)) - 0.5_wp) - 0.25_wp
        q = s * s
        sums(i) = sums(i) + s * (c1 + q * (c3 + q * (c5 + q * (c7 + q * (c9 + q * (c11 &
          + q * (c13 + q * (c15 + q * (c17 + q * c19)))))))))
      end do
    end do
  end subroutine add_waves

  !> Lognormal value with this mean and coefficient of variation for a standard normal z.
  elemental real(wp) function lognormal(mean, variation, z) result(value)
    real(wp), intent(in) :: mean, variation, z
    real(wp) :: variance   !! of the logarithm, ln(1 + variation^2)

    if (variation < 1.0_wp) then   ! in a form that keeps the digits of a small one
      variance = 2.0_wp * atanh(variation**2 / (2.0_wp + variation**2))
    else
      variance = log(1.0_wp + variation**2)
    end if
    value = mean * exp(sqrt(variance) * z - 0.5_wp * variance)
  end function lognormal

  !> Mean and standard deviation weighted with V, and the ends of the range, of chosen points.
  pure type(spread_t) function spread_of(values, volume, chosen) result(spread)
    real(wp), intent(in) :: values(:)   !! (n)
    real(wp), intent(in) :: volume(:)   !! V (n) [m^2]
    logical,  intent(in) :: chosen(:)   !! (n), one at least
    real(wp) :: whole

    whole = sum(volume, mask=chosen)
    spread%mean = sum(volume * values, mask=chosen) / whole
    spread%variation = sqrt(sum(volume * (values - spread%mean)**2, mask=chosen) / whole) &
      / spread%mean
    spread%smallest = minval(values, mask=chosen)
    spread%largest = maxval(values, mask=chosen)
  end function spread_of

end module pd_random_field
