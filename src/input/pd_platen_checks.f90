!> Platens as the input describes them: which boundaries they are, and how they come together.
module pd_platens
  use pd_input_types, only: boundary_input_t, input_t
  use pd_kinds, only: is_set, unset, wp
  implicit none
  private

  public :: approach_t, platens_of, platen_approach, platen_extent, final_rate, largest_approach
  public :: platen_under_load

  !> Rate at which the platens approach each other: linear between the times, constant beyond.
  type :: approach_t
    real(wp), allocatable :: times(:)   !! [s], increasing, at least one
    real(wp), allocatable :: rates(:)   !! [m/s], positive: the distance shrinks
  end type approach_t

contains

  !> Indices of the platens, 'bottom' or 'left' first: exactly two boundaries, on opposite sides,
  !> neither affine; 0, 0 where there are none.
  pure function platens_of(boundaries) result(platens)
    type(boundary_input_t), intent(in) :: boundaries(:)
    integer :: platens(2), i

    platens = 0
    if (size(boundaries) /= 2) return
    do i = 1, 2
      if (boundaries(1)%contact == 'affine' .or. boundaries(2)%contact == 'affine') return
      if ((boundaries(i)%side == 'bottom' .and. boundaries(3 - i)%side == 'top') &
          .or. (boundaries(i)%side == 'left' .and. boundaries(3 - i)%side == 'right')) &
        platens = [i, 3 - i]
    end do
  end function platens_of

  !> Whether there are platens, and one of them moves under a load: how, only the run will tell.
  pure logical function platen_under_load(input) result(found)
    type(input_t), intent(in) :: input
    integer :: i

    found = .false.
    if (input%platens(1) == 0) return
    do i = 1, 2
      found = found .or. size(input%boundaries(input%platens(i))%traction) > 0
    end do
  end function platen_under_load

  !> How the platens of the input approach each other. Needs platens, and tables as long as times.
  pure function platen_approach(input) result(approach)
    type(input_t), intent(in) :: input
    type(approach_t) :: approach
    integer :: across, i

    associate (first => input%boundaries(input%platens(1)), &
               second => input%boundaries(input%platens(2)))
      across = merge(2, 1, first%side == 'bottom')
      allocate (approach%times, source=merged(first%times, second%times))
      allocate (approach%rates(size(approach%times)))
      do i = 1, size(approach%times)
        approach%rates(i) = velocity_at(first, across, approach%times(i)) &
          - velocity_at(second, across, approach%times(i))
      end do
    end associate
  end function platen_approach

  !> Two increasing lists as one; a single 0 where both are empty.
  pure function merged(a, b) result(c)
    real(wp), intent(in)  :: a(:), b(:)
    real(wp), allocatable :: c(:)
    integer :: i, j, n

    allocate (c(max(1, size(a) + size(b))))
    c(1) = 0.0_wp
    i = 1
    j = 1
    do n = 1, size(a) + size(b)
      if (j > size(b)) then
        c(n) = a(i)
        i = i + 1
      else if (i > size(a)) then
        c(n) = b(j)
        j = j + 1
      else if (a(i) <= b(j)) then
        c(n) = a(i)
        i = i + 1
      else
        c(n) = b(j)
        j = j + 1
      end if
    end do
  end function merged

  !> Component c of the velocity of a boundary at a time [m/s].
  pure real(wp) function velocity_at(boundary, c, time) result(velocity)
    type(boundary_input_t), intent(in) :: boundary
    integer,                intent(in) :: c
    real(wp),               intent(in) :: time

    if (size(boundary%times) == 0) then
      velocity = boundary%velocity(c)
    else if (c == 1) then
      velocity = table_at(boundary%times, boundary%velocities_x, time)
    else
      velocity = table_at(boundary%times, boundary%velocities_y, time)
    end if
  end function velocity_at

  !> A table at a time: linear between its times, constant beyond; 0 where it is empty.
  pure real(wp) function table_at(times, values, time) result(value)
    real(wp), intent(in) :: times(:), values(:), time
    integer :: k, n

    value = 0.0_wp
    n = size(values)
    if (n == 0) return
    value = values(n)
    if (time <= times(1)) value = values(1)
    do k = 2, n
      if (time >= times(k)) cycle
      if (time >= times(k - 1)) value = values(k - 1) &
        + (values(k) - values(k - 1))*((time - times(k - 1))/(times(k) - times(k - 1)))
      return
    end do
  end function table_at

  !> Extent of the body between the platens as the set-up will make it [m]; `unset` where it is
  !> not in the input.
  pure real(wp) function platen_extent(input) result(extent)
    type(input_t), intent(in) :: input
    real(wp) :: lower, upper
    integer  :: k
    logical  :: upright

    extent = unset
    upright = input%boundaries(input%platens(1))%side == 'bottom'
    lower = huge(1.0_wp)
    upper = -huge(1.0_wp)
    if (size(input%bodies) == 0) return
    do k = 1, size(input%bodies)
      associate (b => input%bodies(k))
        if (.not. (is_set(b%x_min) .and. is_set(b%x_max) .and. is_set(b%y_min) &
                   .and. is_set(b%y_max))) return
        lower = min(lower, merge(b%y_min, b%x_min, upright))
        upper = max(upper, merge(b%y_max, b%x_max, upright))
      end associate
    end do
    if (upper <= lower) return
    extent = upper - lower
    if (input%bodies(1)%shape == 'rectangle' .and. is_set(input%discretisation%spacing)) &
      extent = floor(extent/input%discretisation%spacing + 0.5_wp + 1.0e-6_wp) &
               *input%discretisation%spacing
    if (extent <= 0.0_wp) extent = unset
  end function platen_extent

  !> Rate of approach after the last time of the tables [m/s].
  pure real(wp) function final_rate(approach)
    type(approach_t), intent(in) :: approach

    final_rate = approach%rates(size(approach%rates))
  end function final_rate

  !> Largest approach of the platens between time 0 and a given time [m], at least 0.
  pure real(wp) function largest_approach(approach, time) result(largest)
    type(approach_t), intent(in) :: approach
    real(wp),         intent(in) :: time
    real(wp) :: now, rate, rate_before, t, t_before
    integer  :: k

    largest = 0.0_wp
    now = 0.0_wp
    t_before = 0.0_wp
    rate_before = table_at(approach%times, approach%rates, 0.0_wp)
    do k = 1, size(approach%times) + 1
      t = time
      if (k <= size(approach%times)) t = min(time, approach%times(k))
      rate = table_at(approach%times, approach%rates, t)
      ! The rate changes its sign between the two times: the approach has a peak there.
      if (rate_before > 0.0_wp .and. rate < 0.0_wp) largest = max(largest, now &
        + 0.5_wp*rate_before*(t - t_before)*(rate_before/(rate_before - rate)))
      now = now + 0.5_wp*(rate_before + rate)*(t - t_before)
      largest = max(largest, now)
      t_before = t
      rate_before = rate
    end do
  end function largest_approach

end module pd_platens
