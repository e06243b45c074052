!> Tables in time: a rate that is linear between its times, and its integral from 0.
!>
!> Velocities of supports, factors on loads, the approach of two platens.
!> Source: doc/theory.md, section 7.
module pd_tables
  use pd_kinds, only: wp
  implicit none
  private

  public :: table_t, new_table, constant_table, new_ramp, difference

  !> Rate that is linear between its times and constant before the first and after the last.
  type :: table_t
    real(wp), allocatable :: times(:)    !! ascending, at least one [s]
    real(wp), allocatable :: rates(:)    !! as many
    real(wp) :: since = 0.0_wp           !! time from which the integral counts [s]
  contains
    procedure :: rate
    procedure :: final_rate
    procedure :: integral
    procedure :: largest_integral
    procedure :: first_time
    procedure :: first_times
  end type table_t

contains

  !> Table of given times and rates; without them, a constant.
  pure type(table_t) function new_table(times, rates, constant) result(table)
    real(wp), intent(in) :: times(:), rates(:), constant

    if (size(times) > 0 .and. size(rates) > 0) then
      allocate (table%times(size(times)), source=times)
      allocate (table%rates(size(times)), source=rates)
    else
      table = constant_table(constant)
    end if
  end function new_table

  !> A rate that never changes.
  pure type(table_t) function constant_table(rate) result(table)
    real(wp), intent(in) :: rate

    allocate (table%times(1), source=0.0_wp)
    allocate (table%rates(1), source=rate)
  end function constant_table

  !> A factor that rises linearly from 0 to 1 in a time, and is 1 at once where that is 0.
  pure type(table_t) function new_ramp(duration, start) result(factor)
    real(wp), intent(in) :: duration          !! [s]
    real(wp), intent(in), optional :: start   !! of the ramp; absent: 0 [s]
    real(wp) :: from

    from = 0.0_wp
    if (present(start)) from = start
    if (duration > 0.0_wp) then
      factor = new_table([from, from + duration], [0.0_wp, 1.0_wp], 1.0_wp)
    else
      factor = constant_table(1.0_wp)
    end if
  end function new_ramp

  !> The rate of a minus that of b, at the times of both. Constants add no times.
  pure type(table_t) function difference(a, b) result(table)
    type(table_t), intent(in) :: a, b
    real(wp) :: times(size(a%times) + size(b%times)), time
    integer  :: k, n

    n = 0
    time = -huge(1.0_wp)
    do
      time = min(next_time(a, time), next_time(b, time))
      if (time >= huge(1.0_wp)) exit
      n = n + 1
      times(n) = time
    end do
    if (n == 0) then
      table = constant_table(a%rates(1) - b%rates(1))
      return
    end if
    allocate (table%times(n), source=times(:n))
    allocate (table%rates(n))
    do k = 1, n
      table%rates(k) = a%rate(times(k)) - b%rate(times(k))
    end do
  end function difference

  !> First time of a table after t at which its rate may bend; huge where there is none.
  pure real(wp) function next_time(table, t)
    type(table_t), intent(in) :: table
    real(wp),      intent(in) :: t

    next_time = huge(1.0_wp)
    if (size(table%times) > 1) next_time = minval(table%times, mask=table%times > t)
  end function next_time

  !> Rate at time t.
  pure real(wp) function rate(self, t)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]
    integer :: k, n

    n = size(self%times)
    rate = self%rates(n)
    if (t >= self%times(n)) return
    rate = self%rates(1)
    do k = 1, n - 1
      if (t < self%times(k) .or. t >= self%times(k + 1)) cycle
      rate = self%rates(k) + (self%rates(k + 1) - self%rates(k)) &
        * (t - self%times(k)) / (self%times(k + 1) - self%times(k))
    end do
  end function rate

  !> Rate after the last of the times.
  pure real(wp) function final_rate(self)
    class(table_t), intent(in) :: self

    final_rate = self%rates(size(self%rates))
  end function final_rate

  !> Integral of the rate from 0, or from the time since which it counts, to t.
  pure real(wp) function integral(self, t)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]

    integral = integral_from_zero(self, t)
    if (self%since > 0.0_wp) integral = integral - integral_from_zero(self, self%since)
  end function integral

  !> Integral of the rate from 0 to t: exact, the trapezoidal rule piece by piece.
  pure real(wp) function integral_from_zero(self, t) result(integral)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]
    real(wp) :: a, b, rate_a
    integer  :: k

    integral = 0.0_wp
    a = 0.0_wp
    rate_a = self%rate(a)
    do k = 1, size(self%times)
      if (self%times(k) <= a) cycle
      b = min(t, self%times(k))
      integral = integral + 0.5_wp * (b - a) * (rate_a + piece_end(self, k, b))
      a = b
      rate_a = self%rates(k)
      if (a >= t) return
    end do
    integral = integral + (t - a) * self%rates(size(self%rates))
  end function integral_from_zero

  !> Rate at b, reached from below within the piece that ends at times(k).
  pure real(wp) function piece_end(table, k, b)
    type(table_t), intent(in) :: table
    integer,       intent(in) :: k
    real(wp),      intent(in) :: b

    if (b < table%times(k)) then
      piece_end = table%rate(b)
    else
      piece_end = table%rates(k)
    end if
  end function piece_end

  !> Largest integral at any time from 0 to t, at least 0: at an end of a piece, or within one
  !> where the rate changes its sign.
  pure real(wp) function largest_integral(self, t) result(largest)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: t          !! [s]
    real(wp) :: a, b, rate_a, rate_b
    integer  :: k

    largest = 0.0_wp
    a = 0.0_wp
    do k = 1, size(self%times) + 1
      b = t
      if (k <= size(self%times)) b = min(t, self%times(k))
      if (b <= a) cycle
      rate_a = self%rate(a)
      rate_b = self%rate(b)
      if (rate_a > 0.0_wp .and. rate_b < 0.0_wp) largest = &
        max(largest, self%integral(a + (b - a) * (rate_a / (rate_a - rate_b))))
      largest = max(largest, self%integral(b))
      a = b
    end do
  end function largest_integral

  !> The first time at which the integral reaches a positive value; -1 where it never does.
  pure real(wp) function first_time(self, value) result(time)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: value
    real(wp) :: times(1)

    times = self%first_times([value])
    time = times(1)
  end function first_time

  !> The first times at which the integral reaches positive values; -1 where it never does.
  !>
  !> Between two times of the table the integral is a quadratic in time.
  pure function first_times(self, values) result(times)
    class(table_t), intent(in) :: self
    real(wp),       intent(in) :: values(:)
    real(wp) :: times(size(values))
    real(wp), allocatable :: nodes(:), reached(:), slopes(:)
    integer :: k

    allocate (nodes, source=[0.0_wp, pack(self%times, self%times > 0.0_wp)])
    allocate (reached(size(nodes)), slopes(size(nodes)))
    do k = 1, size(nodes)
      reached(k) = self%integral(nodes(k))
      slopes(k) = self%rate(nodes(k))
    end do
    do k = 1, size(values)
      times(k) = time_reached(nodes, reached, slopes, values(k))
    end do
  end function first_times

  !> One of them, from integrals and rates at the nodes.
  pure real(wp) function time_reached(nodes, reached, slopes, value) result(time)
    real(wp), intent(in) :: nodes(:), reached(:), slopes(:), value
    real(wp) :: missing, width
    integer  :: k

    time = -1.0_wp
    do k = 1, size(nodes)
      missing = value - reached(k)
      if (missing <= 1.0e-12_wp * value) then
        time = nodes(k)
      else if (k == size(nodes)) then
        if (slopes(k) > 0.0_wp) time = nodes(k) + missing / slopes(k)
      else
        width = nodes(k + 1) - nodes(k)
        time = nodes(k) + first_root(0.5_wp * ((slopes(k + 1) - slopes(k)) / width), slopes(k), &
          -missing)
        if (time < nodes(k) .or. time > nodes(k + 1) + 1.0e-6_wp * width) time = -1.0_wp
        time = min(time, nodes(k + 1))
      end if
      if (time >= 0.0_wp) return
    end do
  end function time_reached

  !> Smallest non-negative root of p x^2 + q x + r with r < 0; -1 where there is none.
  pure real(wp) function first_root(p, q, r) result(x)
    real(wp), intent(in) :: p, q, r
    real(wp) :: discriminant

    x = -1.0_wp
    discriminant = q**2 - 4.0_wp * p * r
    if (discriminant < -1.0e-9_wp * q**2) return   ! at the peak of a table round-off decides
    discriminant = max(0.0_wp, discriminant)
    if (q + sqrt(discriminant) > 0.0_wp) x = -2.0_wp * r / (q + sqrt(discriminant))
  end function first_root

end module pd_tables
