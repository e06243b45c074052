!> J2 plasticity: linear elasticity and radial return with kinematic and isotropic hardening or
!> softening, the latter bounded by a residual strength.
!>
!> Symmetric tensors: xx yy zz xy. Source: doc/theory.md, section 3; Simo & Hughes (1998),
!> chapter 3.
module pd_j2
  use pd_elastic, only: elastic_t, new_elastic
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_law, only: law_points_t, law_t
  use pd_sliding, only: slide, sliding_t
  use pd_yielding, only: alpha, gather_points, remembers, scatter_points, yielding_t
  implicit none
  private

  public :: j2_t, new_j2

  !> Material constants [Pa]; the initial yield stress belongs to the point (it may carry a flaw).
  type, extends(elastic_t) :: j2_t
    real(wp) :: kinematic_modulus = 0.0_wp !! H_k
    real(wp) :: isotropic_modulus = 0.0_wp !! H_i
    real(wp) :: residual_strength = 0.0_wp !! sigma_r; at weaker points sigma_y0 instead
  contains
    procedure, nopass :: remembers
    procedure :: stress_block
    procedure :: heat_block
    procedure :: reduced
  end type j2_t

  real(wp), parameter :: tiny_square = 1.0e-30_wp    !! of h^2: keeps unused quotients finite
  real(wp), parameter :: far = 1.0e100_wp            !! a plastic increment that no point reaches
  real(wp), parameter :: root_3_2 = sqrt(1.5_wp), root_2_3 = sqrt(2.0_wp / 3.0_wp)

contains

  !> The law of engineering constants.
  pure type(j2_t) function new_j2(youngs_modulus, poissons_ratio, kinematic_modulus, &
    isotropic_modulus, residual_strength) result(law)
    real(wp), intent(in) :: youngs_modulus   !! E [Pa]
    real(wp), intent(in) :: poissons_ratio   !! nu, -1 < nu < 1/2
    real(wp), intent(in) :: kinematic_modulus, isotropic_modulus, residual_strength   !! [Pa]

    law%elastic_t = new_elastic(youngs_modulus, poissons_ratio)
    law%plastic_strain = alpha
    law%kinematic_modulus = kinematic_modulus
    law%isotropic_modulus = isotropic_modulus
    law%residual_strength = residual_strength
  end function new_j2

  !> The same law with its residual strength divided by a factor.
  function reduced(self, factor) result(law)
    class(j2_t), intent(in) :: self
    real(wp),    intent(in) :: factor
    class(law_t), allocatable :: law
    type(j2_t) :: weaker

    weaker%elastic_t = self%elastic_t
    weaker%kinematic_modulus = self%kinematic_modulus
    weaker%isotropic_modulus = self%isotropic_modulus
    weaker%residual_strength = self%residual_strength / factor
    allocate (law, source=weaker)
  end function reduced

  !> Return the trial stresses of n yielding points to the yield surface.
  !>
  !>   f = sqrt(3/2)|eta*| - sigma_y(alpha),  da = f / (3 G + H_k + H_i)
  !>
  !> in pieces, because softening stops at the residual strength: first both moduli as they are
  !> up to the nearest bound, then what is left with the modulus that still acts, while a back
  !> stress that has met its bound slides along it.
  !> Errors: none: every trial state has exactly one answer (3 G + H_k + H_i > 0, and with two
  !> negative moduli 3 G + H_i + min(H_k, H_i) > 0).
  pure subroutine return_to_surface(material, n, points)
    class(j2_t),      intent(in)    :: material
    integer,          intent(in)    :: n
    type(yielding_t), intent(inout) :: points
    real(wp) :: flow(n_block, 4)   !! direction of the flow, of length 1
    real(wp) :: deviator_trial(n_block, 4), first(n_block), da(n_block), q(n_block)

    call flow_directions(n, points, deviator_trial, q, flow)
    call increments(material, n, points, q, flow, first, da)
    call move_back_stress(material, n, flow, first, da, points)
    if (material%kinematic_modulus < 0.0_wp) then
      if (any(first(:n) < da(:n))) call end_on_bound(material, n, q, first, points, flow, da)
    end if
    call update_points(material, n, flow, deviator_trial, da, points)
  end subroutine return_to_surface

  !> The rest of the return of the points whose back stress has met its bound.
  pure subroutine end_on_bound(material, n, q, first, points, flow, da)
    class(j2_t),      intent(in)    :: material
    integer,          intent(in)    :: n
    real(wp),         intent(in)    :: q(n_block), first(n_block)
    type(yielding_t), intent(inout) :: points
    real(wp),         intent(inout) :: flow(n_block, 4)
    real(wp),         intent(inout) :: da(n_block)   !! in: that of a straight path
    type(sliding_t) :: sliding
    real(wp) :: residual, unit, straight(n_block)
    integer  :: i, k, number(n_block)

    unit = near(material%shear_modulus)
    sliding%g3 = 3.0_wp * material%shear_modulus / unit
    sliding%h = -material%kinematic_modulus / unit
    sliding%hi = material%isotropic_modulus / unit
    k = 0
    do i = 1, n
      if (.not. first(i) < da(i)) cycle
      k = k + 1
      number(k) = i
      residual = min(material%residual_strength, points%yield_stress(i)) / unit
      sliding%strength(k) = strength_now(material, points%yield_stress(i), &
        points%alpha(i) + first(i)) / unit
      sliding%radius(k) = points%yield_stress(i) / unit - residual
      if (sliding%hi < 0.0_wp) sliding%radius(k) = max(0.0_wp, sliding%strength(k) - residual)
      sliding%q(k) = q(i) / unit - (sliding%g3 - sliding%h) * first(i)
      straight(k) = da(i) - first(i)
    end do
    sliding%n = k
    sliding%da(:k) = straight(:k)
    sliding%flow(:k, :) = flow(number(:k), :)
    sliding%beta(:k, :) = points%back_stress(number(:k), :) / unit
    call slide(sliding)
    flow(number(:k), :) = sliding%flow(:k, :)
    points%back_stress(number(:k), :) = unit * sliding%beta(:k, :)
    ! a straight path keeps the bits of its da
    da(number(:k)) = da(number(:k)) + (sliding%da(:k) - straight(:k))
  end subroutine end_on_bound

  !> A power of two near a stress. Counted in it, products of stresses neither overflow nor vanish,
  !> whatever their unit is; it makes no round-off.
  pure real(wp) function near(stress) result(unit)
    real(wp), intent(in) :: stress   !! [Pa]

    unit = scale(1.0_wp, exponent(stress))
  end function near

  !> dev S*, q* = sqrt(3/2)|eta*| and eta* / |eta*|.
  pure subroutine flow_directions(n, points, s, q, flow)
    integer,          intent(in)  :: n
    type(yielding_t), intent(in)  :: points
    real(wp),         intent(out) :: s(n_block, 4), q(n_block), flow(n_block, 4)
    real(wp) :: mean, exx, eyy, ezz, exy, length
    integer  :: i

    !$omp simd simdlen(8) private(mean, exx, eyy, ezz, exy, length)
    do i = 1, n
      mean = (points%stress(i, 1) + points%stress(i, 2) + points%stress(i, 3)) / 3.0_wp
      s(i, 1) = points%stress(i, 1) - mean
      s(i, 2) = points%stress(i, 2) - mean
      s(i, 3) = points%stress(i, 3) - mean
      s(i, 4) = points%stress(i, 4)
      exx = s(i, 1) - points%back_stress(i, 1)
      eyy = s(i, 2) - points%back_stress(i, 2)
      ezz = s(i, 3) - points%back_stress(i, 3)
      exy = s(i, 4) - points%back_stress(i, 4)
      length = sqrt(exx**2 + eyy**2 + ezz**2 + 2.0_wp * exy**2)
      q(i) = root_3_2 * length
      flow(i, 1) = exx / length
      flow(i, 2) = eyy / length
      flow(i, 3) = ezz / length
      flow(i, 4) = exy / length
    end do
  end subroutine flow_directions

  !> Plastic increments: `first` with both moduli as they are, `da` whole, on a straight path (where
  !> the back stress has met its bound and slides, `slide` finds the rest).
  !>
  !> `first` ends where sigma_y(alpha) meets sigma_r, or where the back stress meets its bound.
  pure subroutine increments(material, n, points, q, flow, first, da)
    class(j2_t),      intent(in)  :: material
    integer,          intent(in)  :: n
    type(yielding_t), intent(in)  :: points
    real(wp),         intent(in)  :: q(n_block), flow(n_block, 4)
    real(wp),         intent(out) :: first(n_block), da(n_block)
    real(wp) :: g3, hi, k, modulus, modulus_left, floor_strength, lowest, strength, f, r
    real(wp) :: one_over_k, no_floor, radius(n_block), room(n_block)
    integer  :: i

    g3 = 3.0_wp * material%shear_modulus
    hi = material%isotropic_modulus
    k = max(0.0_wp, -hi)
    floor_strength = merge(material%residual_strength, -huge(1.0_wp), k > 0.0_wp)
    modulus = g3 + material%kinematic_modulus + hi
    modulus_left = g3 + merge(max(0.0_wp, material%kinematic_modulus), hi, k > 0.0_wp)
    one_over_k = 0.0_wp
    if (k > 0.0_wp) one_over_k = 1.0_wp / k
    no_floor = merge(0.0_wp, far, k > 0.0_wp)
    !$omp simd simdlen(8) private(lowest, r)
    do i = 1, n
      lowest = min(floor_strength, points%yield_stress(i))
      r = points%yield_stress(i) - k * points%alpha(i)
      radius(i) = max(lowest, r) - min(material%residual_strength, points%yield_stress(i))
      room(i) = radius(i) * one_over_k + no_floor
    end do
    if (material%kinematic_modulus < 0.0_wp) &
      call end_at_bound([-material%kinematic_modulus, k], n, points, flow, radius, room)
    !$omp simd simdlen(8) private(lowest, strength, f)
    do i = 1, n
      lowest = min(floor_strength, points%yield_stress(i))
      strength = max(lowest, points%yield_stress(i) + hi * points%alpha(i))
      f = max(0.0_wp, q(i) - strength)
      da(i) = f / modulus
      first(i) = min(da(i), room(i))
      ! never beyond a straight path, for the modulus that is left is the larger one
      da(i) = min(da(i), first(i) + max(0.0_wp, f - modulus * first(i)) / modulus_left)
    end do
  end subroutine increments

  !> Shorten the room for plastic increments to where the back stress b - h da n, with
  !> b = sqrt(3/2) beta and h = -H_k, meets its bound r - k da, k = -H_i, r = sigma_y - sigma_r
  !> (sigma_y0 where H_i >= 0: the bound then stays; sigma_r is at most sigma_y0): the smallest
  !> root da >= 0 of
  !> (h^2 - k^2) da^2 - 2 (h b . n - r k) da - (r^2 - b . b) = 0, in the form that does not cancel.
  !> Written without a branch: every quotient is finite, also where it is not used. They are kept
  !> for a loop of their own, for what is computed only to be chosen becomes a branch.
  pure subroutine end_at_bound(moduli, n, points, flow, radius, room)
    real(wp),         intent(in)    :: moduli(2)         !! h > 0, k >= 0 [Pa]
    integer,          intent(in)    :: n
    type(yielding_t), intent(in)    :: points
    real(wp),         intent(in)    :: flow(n_block, 4)
    real(wp),         intent(in)    :: radius(n_block)   !! r [Pa]
    real(wp),         intent(inout) :: room(n_block)
    real(wp) :: unit, in_unit, h, k, r, square, square_or_tiny, edge, bb, bn, rest, least
    real(wp) :: linear(n_block), reach(n_block), of_square(n_block), of_reach(n_block)
    integer  :: i

    unit = near(maxval(moduli))
    in_unit = 1.0_wp / unit
    h = in_unit * moduli(1)
    k = in_unit * moduli(2)
    square = h**2 - k**2
    square_or_tiny = merge(square, tiny_square, square > 0.0_wp)
    edge = merge(0.0_wp, far, square > 0.0_wp)
    !$omp simd simdlen(8) private(r, bb, bn, rest, least)
    do i = 1, n
      r = in_unit * radius(i)
      bb = 1.5_wp * in_unit**2 * (points%back_stress(i, 1)**2 + points%back_stress(i, 2)**2 &
        + points%back_stress(i, 3)**2 + 2.0_wp * points%back_stress(i, 4)**2)
      bn = root_3_2 * in_unit * (points%back_stress(i, 1) * flow(i, 1) &
        + points%back_stress(i, 2) * flow(i, 2) + points%back_stress(i, 3) * flow(i, 3) &
        + 2.0_wp * points%back_stress(i, 4) * flow(i, 4))
      rest = max(0.0_wp, r**2 - bb)
      linear(i) = h * bn - r * k
      reach(i) = sqrt(max(0.0_wp, linear(i)**2 + square * rest)) + abs(linear(i))
      ! small beside the products of stresses in `reach`
      least = tiny_square * min(1.0_wp, in_unit * points%yield_stress(i))
      of_square(i) = reach(i) / square_or_tiny
      of_reach(i) = rest / max(reach(i), least)
    end do
    ! 0 / 0: on the bound and about to leave it
    !$omp simd simdlen(8)
    do i = 1, n
      room(i) = min(room(i), merge(of_square(i), of_reach(i), linear(i) > 0.0_wp) &
        + merge(0.0_wp, edge, reach(i) > 0.0_wp))
    end do
  end subroutine end_at_bound

  !> beta <- beta + sqrt(2/3) H_k da n: `first` where kinematic softening ends, else all of da.
  pure subroutine move_back_stress(material, n, flow, first, da, points)
    class(j2_t),      intent(in)    :: material
    integer,          intent(in)    :: n
    real(wp),         intent(in)    :: flow(n_block, 4), first(n_block), da(n_block)
    type(yielding_t), intent(inout) :: points
    real(wp) :: factor, way
    logical  :: softens
    integer  :: i, c

    factor = root_2_3 * material%kinematic_modulus
    softens = material%kinematic_modulus < 0.0_wp
    do c = 1, 4
      !$omp simd simdlen(8) private(way)
      do i = 1, n
        way = factor * merge(first(i), da(i), softens)
        points%back_stress(i, c) = points%back_stress(i, c) + way * flow(i, c)
      end do
    end do
  end subroutine move_back_stress

  !> alpha <- alpha + da, S on the yield surface, E^p by the stress that was taken back.
  pure subroutine update_points(material, n, flow, deviator_trial, da, points)
    class(j2_t),      intent(in)    :: material
    integer,          intent(in)    :: n
    real(wp),         intent(in)    :: flow(n_block, 4), deviator_trial(n_block, 4), da(n_block)
    type(yielding_t), intent(inout) :: points
    real(wp) :: hi, floor_strength, radius(n_block), back, g2
    integer  :: i, c

    hi = material%isotropic_modulus
    floor_strength = merge(material%residual_strength, -huge(1.0_wp), hi < 0.0_wp)
    g2 = 2.0_wp * material%shear_modulus
    !$omp simd simdlen(8)
    do i = 1, n
      points%alpha(i) = points%alpha(i) + da(i)
      radius(i) = root_2_3 * max(min(floor_strength, points%yield_stress(i)), &
        points%yield_stress(i) + hi * points%alpha(i))
    end do
    do c = 1, 4
      !$omp simd simdlen(8) private(back)
      do i = 1, n
        back = deviator_trial(i, c) - (points%back_stress(i, c) + radius(i) * flow(i, c))
        points%plastic_strain(i, c) = points%plastic_strain(i, c) + back / g2
        points%stress(i, c) = points%stress(i, c) - back
      end do
    end do
  end subroutine update_points

  !> Stress of rows lo to hi; the history goes from step n to n+1.
  !>
  !> The trial state of all points comes first; then those that yield are gathered, returned
  !> together, and put back: no loop over points has a branch in it.
  !> The dissipation is the work of S on dE^p of this step by the trapezoidal rule.
  pure subroutine stress_block(self, first, lo, hi, strain, points, flow)
    class(j2_t), intent(in) :: self
    integer,     intent(in) :: first, lo, hi
    real(wp),    intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1: row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow
    type(yielding_t) :: yielding
    real(wp) :: trial(n_block, 4), excess(n_block), largest
    integer  :: n, i

    call trial_block(self, [first, lo, hi], strain, points%history, points%strength, trial, &
      excess, largest)
    n = 0
    if (.not. largest <= 0.0_wp) then   ! in elastic blocks, which most are, no row is looked at
      do i = lo, hi
        if (excess(i - first + 1) <= 0.0_wp) cycle
        n = n + 1
        flow%rows(n) = i
      end do
    end if
    flow%n = n
    if (n > 0) then
      call gather_points(n, first, flow%rows, trial, points, yielding)
      call return_to_surface(self, n, yielding)
      call scatter_points(n, first, yielding, trial, points, flow)
    end if
    points%stress(lo:hi, :) = trial(lo - first + 1:hi - first + 1, :)
  end subroutine stress_block

  !> Trial stress of rows lo to hi, and by how much 3/2 |eta*|^2 exceeds sigma_y^2.
  pure subroutine trial_block(law, rows, strain, history, yield_stress, trial, excess, largest)
    class(j2_t), intent(in) :: law
    integer,    intent(in) :: rows(3)              !! first, lo, hi
    real(wp),   intent(in), contiguous :: strain(:, :), history(:, :), yield_stress(:)
    real(wp),   intent(out) :: trial(n_block, 4)   !! S* xx yy zz xy [Pa]; row 1: row `first`
    real(wp),   intent(out) :: excess(n_block)     !! [Pa^2]
    real(wp),   intent(out) :: largest             !! excess of any row
    real(wp) :: g2, lambda, hi_modulus, floor_strength, volumetric, mean, strength
    real(wp) :: exx, eyy, ezz, exy, etaxx, etayy, etazz, etaxy
    integer  :: i, b

    g2 = 2.0_wp * law%shear_modulus
    lambda = law%lambda
    hi_modulus = law%isotropic_modulus
    floor_strength = 0.0_wp
    if (law%isotropic_modulus < 0.0_wp) floor_strength = law%residual_strength
    largest = -huge(1.0_wp)
    !$omp simd simdlen(8) private(b, volumetric, exx, eyy, ezz, exy, mean, strength) &
    !$omp private(etaxx, etayy, etazz, etaxy) reduction(max:largest)
    do i = rows(2), rows(3)
      b = i - rows(1) + 1
      exx = strain(b, 1) - history(i, 1)
      eyy = strain(b, 2) - history(i, 2)
      ezz = strain(b, 3) - history(i, 3)
      exy = strain(b, 4) - history(i, 4)
      volumetric = exx + eyy + ezz
      trial(b, 1) = g2 * exx + lambda * volumetric
      trial(b, 2) = g2 * eyy + lambda * volumetric
      trial(b, 3) = g2 * ezz + lambda * volumetric
      trial(b, 4) = g2 * exy
      mean = volumetric / 3.0_wp
      etaxx = g2 * (exx - mean) - history(i, 5)
      etayy = g2 * (eyy - mean) - history(i, 6)
      etazz = g2 * (ezz - mean) - history(i, 7)
      etaxy = g2 * exy - history(i, 8)
      strength = max(min(floor_strength, yield_stress(i)), &
        yield_stress(i) + hi_modulus * history(i, 9))
      excess(b) = 1.5_wp * (etaxx**2 + etayy**2 + etazz**2 + 2.0_wp * etaxy**2) - strength**2
      largest = max(largest, excess(b))
    end do
  end subroutine trial_block

  !> Heat so far: eta : dE^p = sigma_y(alpha) dalpha, from 0 to alpha.
  pure subroutine heat_block(self, first, lo, hi, points, heat)
    class(j2_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: heat(:)   !! out: [J/m^3]; row 1 is row `first`
    real(wp) :: hi_modulus, lowest, over_k, no_end, changing
    integer  :: i

    hi_modulus = self%isotropic_modulus
    over_k = 0.0_wp
    if (hi_modulus < 0.0_wp) over_k = -1.0_wp / hi_modulus
    no_end = merge(0.0_wp, far, hi_modulus < 0.0_wp)
    !$omp simd simdlen(8) private(lowest, changing)
    do i = lo, hi
      lowest = min(self%residual_strength, points%strength(i))
      changing = min(points%history(i, alpha), (points%strength(i) - lowest) * over_k + no_end)
      heat(i - first + 1) = (points%strength(i) + 0.5_wp * hi_modulus * changing) * changing &
        + lowest * (points%history(i, alpha) - changing)
    end do
  end subroutine heat_block

  !> sigma_y(alpha): isotropic softening ends at the residual strength, hardening has no end. A
  !> point that is weaker than that from the start does not soften.
  pure real(wp) function strength_now(material, yield_stress, alpha) result(strength)
    class(j2_t), intent(in) :: material
    real(wp),    intent(in) :: yield_stress, alpha

    strength = yield_stress + material%isotropic_modulus * alpha
    if (material%isotropic_modulus < 0.0_wp) &
      strength = max(strength, min(material%residual_strength, yield_stress))
  end function strength_now

end module pd_j2
