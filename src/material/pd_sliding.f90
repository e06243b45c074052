!> The rest of a return to the yield surface when the back stress has met its bound: it slides.
!>
!> Everything here lies in the plane of two tensors, so that one scalar equation is left.
!> Source: doc/theory.md, section 3.
module pd_sliding
  use pd_kinds, only: wp
  use pd_tensors, only: inner, norm
  implicit none
  private

  public :: bound_t, slide

  !> A point whose back stress has met its bound.
  type :: bound_t
    real(wp) :: g3         !! 3 G [Pa]
    real(wp) :: h          !! |H_k|, H_k < 0 [Pa]
    real(wp) :: hi         !! H_i [Pa]
    real(wp) :: strength   !! sigma_y1 [Pa]
    real(wp) :: radius     !! R1; where H_i < 0 it falls with sigma_y [Pa]
  end type bound_t

  !> a = sqrt(3/2) dev S and b = sqrt(3/2) beta before the rest, as scalars.
  type :: plane_t
    real(wp) :: aa, ab, bb   !! a . a, a . b, b . b [Pa^2]
  end type plane_t

  !> A trial value t of R / |b - h da n|, and what follows from it.
  type :: trial_t
    real(wp) :: da           !! plastic increment
    real(wp) :: length       !! |a - t b| [Pa]
    real(wp) :: distance     !! |b - h da n| [Pa]
    real(wp) :: radius       !! R at the end [Pa]
    real(wp) :: excess       !! t |b - h da n| - R: zero at the answer [Pa]
    real(wp) :: slope        !! of the excess with t [Pa]
  end type trial_t

  !> |b - (b : n) n| / |b| below which the path counts as straight: the answer is then known.
  real(wp), parameter :: straight = 1.0e-12_wp
  real(wp), parameter :: root_3_2 = sqrt(1.5_wp), root_2_3 = sqrt(2.0_wp / 3.0_wp)
  real(wp), parameter :: close = 1.0e-9_wp       !! the error after such a step is of its square
  integer,  parameter :: most_trials = 100   !! bisection alone needs 53
  real(wp), parameter :: least = 1.0e-100_wp     !! keeps quotients finite that are not used [Pa]

contains

  !> Flow direction, back stress and plastic increment of the rest.
  !>
  !>   b' = b - h da n, moved back along itself to |b'| <= R,   e' = a - 3 G da n - b' = sigma_y n
  !>
  !> Errors: none: there is exactly one answer (doc/theory.md), and it is bracketed.
  pure subroutine slide(bound, q, n, beta, da)
    type(bound_t), intent(in)    :: bound
    real(wp),      intent(in)    :: q         !! sqrt(3/2)|eta| before the rest [Pa]
    real(wp),      intent(inout) :: n(4)      !! flow direction, |n| = 1
    real(wp),      intent(inout) :: beta(4)   !! back stress [Pa]
    real(wp),      intent(inout) :: da        !! in: that of a straight path
    real(wp) :: a(4), b(4), bn, t, shrinking, residual
    logical  :: is_straight
    type(plane_t) :: plane
    type(trial_t) :: end

    shrinking = max(0.0_wp, -bound%hi)
    b = root_3_2 * beta
    bn = inner(b, n)
    is_straight = bn <= 0.0_wp .and. norm(b - bn * n) <= straight * norm(b)
    if (is_straight .or. bound%radius <= 0.0_wp) then
      if (shrinking > 0.0_wp) beta = beta &
        * max(0.0_wp, 1.0_wp - shrinking * da / max(bound%radius, least))
      return
    end if
    a = q * n + b
    residual = bound%strength - bound%radius
    if (shrinking * (norm(a) - residual) >= bound%g3 * bound%radius) then   ! R ends at zero
      beta = 0.0_wp
      n = a / norm(a)
      da = (norm(a) - residual) / bound%g3
      return
    end if
    plane = plane_t(inner(a, a), inner(a, b), inner(b, b))
    call solve(bound, plane, t, end)
    n = (a - t * b) / end%length
    da = end%da
    beta = root_2_3 * min(1.0_wp, end%radius / end%distance) &
      * (b - bound%h * da * n)
  end subroutine slide

  !> The root of the excess, which grows with t, in 0 < t <= 1: Newton's steps within a bracket.
  pure subroutine solve(bound, plane, t, end)
    type(bound_t), intent(in)  :: bound
    type(plane_t), intent(in)  :: plane
    real(wp),      intent(out) :: t
    type(trial_t), intent(out) :: end
    real(wp) :: low, high, next
    logical  :: last
    integer  :: k

    low = 0.0_wp
    high = 1.0_wp
    t = 1.0_wp
    end = at(bound, plane, t)
    if (end%excess <= 0.0_wp) return   ! but for round-off, the back stress was not going to leave
    do k = 1, most_trials
      next = t - end%excess / max(end%slope, least)
      last = abs(next - t) <= close * t
      if (.not. (next >= low .and. next <= high)) then
        next = 0.5_wp * (low + high)
        last = high - low <= epsilon(1.0_wp) * high
      end if
      t = next
      end = at(bound, plane, t)
      if (last) return
      if (end%excess > 0.0_wp) high = t
      if (end%excess <= 0.0_wp) low = t
    end do
  end subroutine solve

  !> What follows from t, with M = 3 G + H_i - h t and w = h da - b . n:
  !>
  !>   n = (a - t b) / |a - t b|,  da = (|a - t b| - sigma_y1) / M,  da' = w / M
  !>   excess' = |b - h da n| + t h (w da' + da |b - (b . n) n|^2 / |a - t b|) / |b - h da n| - R'
  pure type(trial_t) function at(bound, plane, t) result(trial)
    type(bound_t), intent(in) :: bound
    type(plane_t), intent(in) :: plane
    real(wp),      intent(in) :: t
    real(wp) :: over_modulus, over_length, bn, w, rate, shrinking, way

    shrinking = max(0.0_wp, -bound%hi)
    over_modulus = 1.0_wp / (bound%g3 + bound%hi - bound%h * t)
    trial%length = sqrt(max(0.0_wp, plane%aa - 2.0_wp * t * plane%ab + t**2 * plane%bb))
    over_length = 1.0_wp / max(trial%length, least)
    trial%da = max(0.0_wp, (trial%length - bound%strength) * over_modulus)
    bn = (plane%ab - t * plane%bb) * over_length
    way = bound%h * trial%da
    trial%distance = sqrt(max(least, plane%bb + way * (way - 2.0_wp * bn)))
    trial%radius = max(0.0_wp, bound%radius - shrinking * trial%da)
    trial%excess = t * trial%distance - trial%radius
    w = way - bn
    rate = w * over_modulus
    trial%slope = trial%distance + shrinking * rate + t * bound%h * (w * rate + trial%da &
      * max(0.0_wp, plane%bb - bn**2) * over_length) / trial%distance
  end function at

end module pd_sliding
