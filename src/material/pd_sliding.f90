!> The rest of a return to the yield surface when the back stress has met its bound: it slides.
!>
!> Everything here lies in the plane of two tensors, so that one scalar equation is left. It is
!> solved for all points of a block at a time: loops without a branch hold the arithmetic, and a
!> point that has its answer stays as it is while others go on.
!> Source: doc/theory.md, section 3.
module pd_sliding
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: sliding_t, slide

  !> Points of a block whose back stress has met its bound. Stresses are counted in a unit near G,
  !> so that `least` is small beside them.
  type :: sliding_t
    integer  :: n = 0                 !! points
    real(wp) :: g3, h, hi             !! 3 G, |H_k| with H_k < 0, H_i [unit]
    real(wp) :: strength(n_block)     !! sigma_y1 [unit]
    real(wp) :: radius(n_block)       !! R1; where H_i < 0 it falls with sigma_y [unit]
    real(wp) :: q(n_block)            !! sqrt(3/2)|eta| before the rest [unit]
    real(wp) :: flow(n_block, 4)      !! flow direction n, |n| = 1; xx yy zz xy
    real(wp) :: beta(n_block, 4)      !! back stress [unit]
    real(wp) :: da(n_block)           !! plastic increment of the rest; in: that of a straight path
  end type sliding_t

  !> a = sqrt(3/2) dev S and b = sqrt(3/2) beta before the rest, and their products.
  type :: planes_t
    real(wp) :: a(n_block, 4), b(n_block, 4)                    !! [unit]
    real(wp) :: aa(n_block), ab(n_block), bb(n_block)           !! a . a, a . b, b . b [unit^2]
    logical  :: solved(n_block)                                 !! the answer needs no search
  end type planes_t

  !> Trial values t of R / |b - h da n|, and what follows from them.
  type :: trials_t
    real(wp) :: t(n_block)
    real(wp) :: da(n_block)           !! plastic increment
    real(wp) :: length(n_block)       !! |a - t b| [unit]
    real(wp) :: distance(n_block)     !! |b - h da n| [unit]
    real(wp) :: radius(n_block)       !! R at the end [unit]
    real(wp) :: excess(n_block)       !! t |b - h da n| - R: zero at the answer [unit]
    real(wp) :: slope(n_block)        !! of the excess with t [unit]
  end type trials_t

  !> |b - (b : n) n| / |b| below which the path counts as straight: the answer is then known.
  real(wp), parameter :: straight = 1.0e-12_wp
  real(wp), parameter :: root_3_2 = sqrt(1.5_wp), root_2_3 = sqrt(2.0_wp / 3.0_wp)
  real(wp), parameter :: close = 1.0e-9_wp       !! the error after such a step is of its square
  integer,  parameter :: most_trials = 100   !! bisection alone needs 53
  real(wp), parameter :: least = 1.0e-100_wp     !! keeps quotients finite that are not used [unit]

contains

  !> Flow direction, back stress and plastic increment of the rest.
  !>
  !>   b' = b - h da n, moved back along itself to |b'| <= R,   e' = a - 3 G da n - b' = sigma_y n
  !>
  !> Errors: none: there is exactly one answer (doc/theory.md), and it is bracketed.
  pure subroutine slide(points)
    type(sliding_t), intent(inout) :: points
    type(planes_t) :: planes
    type(trials_t) :: trials
    real(wp) :: part(n_block)
    integer  :: i, c

    call find_planes(points, planes)
    do i = 1, points%n
      call try_known_answers(i, planes, points)
    end do
    if (all(planes%solved(:points%n))) return
    call solve(points, planes, trials)
    !$omp simd simdlen(8)
    do i = 1, points%n
      part(i) = root_2_3 * min(1.0_wp, trials%radius(i) / trials%distance(i))
    end do
    do c = 1, 4
      do i = 1, points%n
        if (planes%solved(i)) cycle
        points%flow(i, c) = (planes%a(i, c) - trials%t(i) * planes%b(i, c)) / trials%length(i)
        points%beta(i, c) = part(i) &
          * (planes%b(i, c) - points%h * trials%da(i) * points%flow(i, c))
      end do
    end do
    do i = 1, points%n
      if (.not. planes%solved(i)) points%da(i) = trials%da(i)
    end do
  end subroutine slide

  !> a, b and their products.
  pure subroutine find_planes(points, planes)
    type(sliding_t), intent(in)  :: points
    type(planes_t),  intent(out) :: planes
    integer :: i, c

    do c = 1, 4
      !$omp simd simdlen(8)
      do i = 1, points%n
        planes%b(i, c) = root_3_2 * points%beta(i, c)
        planes%a(i, c) = points%q(i) * points%flow(i, c) + planes%b(i, c)
      end do
    end do
    call inner_products(points%n, planes%a, planes%a, planes%aa)
    call inner_products(points%n, planes%a, planes%b, planes%ab)
    call inner_products(points%n, planes%b, planes%b, planes%bb)
  end subroutine find_planes

  !> a : b of symmetric tensors.
  pure subroutine inner_products(n, a, b, ab)
    integer,  intent(in)  :: n
    real(wp), intent(in)  :: a(n_block, 4), b(n_block, 4)
    real(wp), intent(out) :: ab(n_block)
    integer :: i

    !$omp simd simdlen(8)
    do i = 1, n
      ab(i) = a(i, 1) * b(i, 1) + a(i, 2) * b(i, 2) + a(i, 3) * b(i, 3) &
        + 2.0_wp * a(i, 4) * b(i, 4)
    end do
  end subroutine inner_products

  !> A straight path, on which flow goes on as it was, and a bound that shrinks to nothing.
  pure subroutine try_known_answers(i, planes, points)
    integer,         intent(in)    :: i
    type(planes_t),  intent(inout) :: planes
    type(sliding_t), intent(inout) :: points
    real(wp) :: bn, across(4), length, shrinking, residual

    shrinking = max(0.0_wp, -points%hi)
    associate (n => points%flow(i, :), b => planes%b(i, :), radius => points%radius(i))
      planes%solved(i) = radius <= 0.0_wp
      bn = b(1) * n(1) + b(2) * n(2) + b(3) * n(3) + 2.0_wp * b(4) * n(4)
      if (bn <= 0.0_wp) then
        across = b - bn * n
        if (across(1)**2 + across(2)**2 + across(3)**2 + 2.0_wp * across(4)**2 &
          <= straight**2 * planes%bb(i)) planes%solved(i) = .true.
      end if
      if (planes%solved(i)) then
        if (shrinking > 0.0_wp) points%beta(i, :) = points%beta(i, :) &
          * max(0.0_wp, 1.0_wp - shrinking * points%da(i) / max(radius, least))
        return
      end if
      residual = points%strength(i) - radius
      length = sqrt(planes%aa(i))
      if (shrinking * (length - residual) >= points%g3 * radius) then   ! R ends at zero
        points%beta(i, :) = 0.0_wp
        points%flow(i, :) = planes%a(i, :) / length
        points%da(i) = (length - residual) / points%g3
        planes%solved(i) = .true.
      end if
    end associate
  end subroutine try_known_answers

  !> The roots of the excess, which grows with t, in 0 < t <= 1: Newton's steps within brackets.
  pure subroutine solve(points, planes, trials)
    type(sliding_t), intent(in)  :: points
    type(planes_t),  intent(in)  :: planes
    type(trials_t),  intent(out) :: trials
    real(wp) :: low(n_block), high(n_block), step(n_block), next
    logical  :: goes_on(n_block), last(n_block)
    integer  :: i, k

    low = 0.0_wp
    high = 1.0_wp
    trials%t = 1.0_wp
    last = .false.
    call evaluate(points, planes, trials)
    do i = 1, points%n   ! not above zero: but for round-off, the back stress was not going to leave
      goes_on(i) = trials%excess(i) > 0.0_wp .and. .not. planes%solved(i)
    end do
    do k = 1, most_trials
      if (.not. any(goes_on(:points%n))) return
      !$omp simd simdlen(8)
      do i = 1, points%n
        step(i) = trials%excess(i) / max(trials%slope(i), least)
      end do
      do i = 1, points%n
        if (.not. goes_on(i)) cycle
        next = trials%t(i) - step(i)
        last(i) = abs(next - trials%t(i)) <= close * trials%t(i)
        if (.not. (next >= low(i) .and. next <= high(i))) then
          next = 0.5_wp * (low(i) + high(i))
          last(i) = high(i) - low(i) <= epsilon(1.0_wp) * high(i)
        end if
        trials%t(i) = next
      end do
      call evaluate(points, planes, trials)
      do i = 1, points%n
        if (trials%excess(i) > 0.0_wp) high(i) = trials%t(i)
        if (trials%excess(i) <= 0.0_wp) low(i) = trials%t(i)
        goes_on(i) = goes_on(i) .and. .not. last(i)
      end do
    end do
  end subroutine solve

  !> What follows from t, with M = 3 G + H_i - h t and w = h da - b . n:
  !>
  !>   n = (a - t b) / |a - t b|,  da = (|a - t b| - sigma_y1) / M,  da' = w / M
  !>   excess' = |b - h da n| + t h (w da' + da |b - (b . n) n|^2 / |a - t b|) / |b - h da n| - R'
  pure subroutine evaluate(points, planes, trials)
    type(sliding_t), intent(in)    :: points
    type(planes_t),  intent(in)    :: planes
    type(trials_t),  intent(inout) :: trials   !! t is given
    real(wp) :: over_modulus, over_length, bn, w, rate, shrinking, way, t
    integer  :: i

    shrinking = max(0.0_wp, -points%hi)
    !$omp simd simdlen(8) private(over_modulus, over_length, bn, w, rate, way, t)
    do i = 1, points%n
      t = trials%t(i)
      over_modulus = 1.0_wp / (points%g3 + points%hi - points%h * t)
      trials%length(i) = sqrt(max(0.0_wp, planes%aa(i) - 2.0_wp * t * planes%ab(i) &
        + t**2 * planes%bb(i)))
      over_length = 1.0_wp / max(trials%length(i), least)
      trials%da(i) = max(0.0_wp, (trials%length(i) - points%strength(i)) * over_modulus)
      bn = (planes%ab(i) - t * planes%bb(i)) * over_length
      way = points%h * trials%da(i)
      trials%distance(i) = sqrt(max(least, planes%bb(i) + way * (way - 2.0_wp * bn)))
      trials%radius(i) = max(0.0_wp, points%radius(i) - shrinking * trials%da(i))
      trials%excess(i) = t * trials%distance(i) - trials%radius(i)
      w = way - bn
      rate = w * over_modulus
      trials%slope(i) = trials%distance(i) + shrinking * rate + t * points%h * (w * rate &
        + trials%da(i) * max(0.0_wp, planes%bb(i) - bn**2) * over_length) / trials%distance(i)
    end do
  end subroutine evaluate

end module pd_sliding
