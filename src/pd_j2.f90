!> J2 plasticity at one point: elastic law and radial return with kinematic and isotropic
!> hardening or softening, the latter bounded by a residual strength.
!>
!> Symmetric tensors: xx yy zz xy. Source: doc/theory.md, section 3; Simo & Hughes (1998),
!> chapter 3.
module pd_j2
  use pd_kinds, only: wp
  implicit none
  private

  public :: j2_t, j2_history_t, new_j2, elastic_stress, radial_return, elastic_energy
  public :: deviator, norm, inner, von_mises

  !> Material constants [Pa]; the yield stress belongs to the point (it may carry a flaw).
  type :: j2_t
    logical  :: plastic = .false.
    real(wp) :: lambda = 0.0_wp            !! Lame's first constant
    real(wp) :: shear_modulus = 0.0_wp     !! G
    real(wp) :: kinematic_modulus = 0.0_wp !! H_k
    real(wp) :: isotropic_modulus = 0.0_wp !! H_i
    real(wp) :: residual_strength = 0.0_wp !! sigma_r
  end type j2_t

  !> What a point remembers.
  type :: j2_history_t
    real(wp) :: plastic_strain(4) = 0.0_wp !! E^p
    real(wp) :: back_stress(4) = 0.0_wp    !! beta [Pa]
    real(wp) :: alpha = 0.0_wp             !! equivalent plastic strain
  end type j2_history_t

  real(wp), parameter :: root_3_2 = sqrt(1.5_wp), root_2_3 = sqrt(2.0_wp / 3.0_wp)

contains

  !> Material from engineering constants.
  pure type(j2_t) function new_j2(youngs_modulus, poissons_ratio) result(material)
    real(wp), intent(in) :: youngs_modulus   !! E [Pa]
    real(wp), intent(in) :: poissons_ratio   !! nu, -1 < nu < 1/2

    material%shear_modulus = 0.5_wp * youngs_modulus / (1.0_wp + poissons_ratio)
    material%lambda = youngs_modulus * poissons_ratio &
      / ((1.0_wp + poissons_ratio) * (1.0_wp - 2.0_wp * poissons_ratio))
  end function new_j2

  !> S = lambda tr(E) I + 2 G E.
  pure function elastic_stress(material, strain) result(stress)
    type(j2_t), intent(in) :: material
    real(wp),   intent(in) :: strain(4)
    real(wp) :: stress(4)                    !! [Pa]
    real(wp) :: pressure_part

    pressure_part = material%lambda * (strain(1) + strain(2) + strain(3))
    stress = 2.0_wp * material%shear_modulus * strain
    stress(1:3) = stress(1:3) + pressure_part
  end function elastic_stress

  !> Stored elastic energy per volume, (1/2) E^e : C : E^e, of a stress.
  pure real(wp) function elastic_energy(material, stress) result(energy)
    type(j2_t), intent(in) :: material
    real(wp),   intent(in) :: stress(4)      !! [Pa]
    real(wp) :: trace

    trace = stress(1) + stress(2) + stress(3)
    energy = (inner(stress, stress) - trace**2 * material%lambda &
      / (3.0_wp * material%lambda + 2.0_wp * material%shear_modulus)) &
      / (4.0_wp * material%shear_modulus)
  end function elastic_energy

  !> Stress at a strain, and the history n -> n+1.
  !>
  !>   f = sqrt(3/2)|eta*| - sigma_y(alpha),  da = f / (3 G + H_k + H_i)
  !>
  !> in pieces, because softening stops at the residual strength: first both moduli as they are
  !> up to the nearest bound, then what is left with the modulus that still acts.
  !> Errors: none: every trial state has exactly one answer (3 G + H_k + H_i > 0, and with two
  !> negative moduli 3 G + H_i + min(H_k, H_i) > 0).
  pure subroutine radial_return(material, yield_stress, strain, history, stress)
    type(j2_t), intent(in)            :: material
    real(wp),   intent(in)            :: yield_stress  !! sigma_y0 of this point [Pa]
    real(wp),   intent(in)            :: strain(4)     !! E
    type(j2_history_t), intent(inout) :: history
    real(wp),   intent(out)           :: stress(4)     !! S [Pa]
    real(wp) :: eta(4), n(4), beta(4), s_trial(4), s(4)
    real(wp) :: q, f, g3, strength, da, first, modulus

    stress = elastic_stress(material, strain - history%plastic_strain)
    if (.not. material%plastic) return
    s_trial = deviator(stress)
    eta = s_trial - history%back_stress
    q = root_3_2 * norm(eta)
    strength = strength_now(material, yield_stress, history%alpha)
    f = q - strength
    if (f <= 0.0_wp) return

    g3 = 3.0_wp * material%shear_modulus
    n = eta * (root_3_2 / q)
    modulus = g3 + material%kinematic_modulus + material%isotropic_modulus
    da = f / modulus
    first = min(da, room_to_soften(material, yield_stress, history, strength, n))
    beta = history%back_stress + root_2_3 * material%kinematic_modulus * first * n
    if (first < da) then
      f = f - modulus * first
      if (material%isotropic_modulus >= 0.0_wp) then
        da = first + f / (g3 + material%isotropic_modulus)
      else if (material%kinematic_modulus >= 0.0_wp) then
        da = first + f / (g3 + material%kinematic_modulus)
        beta = history%back_stress + root_2_3 * material%kinematic_modulus * da * n
      else
        call shrink_to_residual(material, q - (g3 + material%kinematic_modulus) * first, &
          strength + material%isotropic_modulus * first, n, beta, da)
        da = first + da
      end if
    end if

    history%alpha = history%alpha + da
    strength = strength_now(material, yield_stress, history%alpha)
    s = beta + root_2_3 * strength * n
    history%plastic_strain = history%plastic_strain + (s_trial - s) / (2.0_wp * g3 / 3.0_wp)
    history%back_stress = beta
    stress = stress + (s - s_trial)
  end subroutine radial_return

  !> sigma_y(alpha): isotropic softening ends at the residual strength, hardening has no end.
  pure real(wp) function strength_now(material, yield_stress, alpha) result(strength)
    type(j2_t), intent(in) :: material
    real(wp),   intent(in) :: yield_stress, alpha

    strength = yield_stress + material%isotropic_modulus * alpha
    if (material%isotropic_modulus < 0.0_wp) strength = max(strength, material%residual_strength)
  end function strength_now

  !> The largest da for which both moduli act as they are: until sigma_y(alpha) meets sigma_r, or
  !> the back stress, b + H_k da n with b = sqrt(3/2) beta, meets its bound R - |H_i| da,
  !> R = sigma_y - sigma_r (sigma_y0 where H_i >= 0: the bound then stays).
  pure real(wp) function room_to_soften(material, yield_stress, history, strength, n) result(room)
    type(j2_t),         intent(in) :: material
    real(wp),           intent(in) :: yield_stress, strength, n(4)
    type(j2_history_t), intent(in) :: history
    real(wp) :: b(4), r, h, k, linear, square, rest, root

    room = huge(1.0_wp)
    h = max(0.0_wp, -material%kinematic_modulus)
    k = max(0.0_wp, -material%isotropic_modulus)
    r = yield_stress - material%residual_strength
    if (k > 0.0_wp) then
      r = strength - material%residual_strength
      room = r / k
    end if
    if (h <= 0.0_wp) return

    ! |b - h da n|^2 = (r - k da)^2, smallest root da >= 0 of square da^2 - 2 linear da + rest = 0
    b = root_3_2 * history%back_stress
    rest = min(0.0_wp, inner(b, b) - r**2)
    square = h**2 - k**2
    linear = h * inner(b, n) - r * k
    root = sqrt(max(0.0_wp, linear**2 - square * rest))
    if (linear <= 0.0_wp) then
      if (root - linear > 0.0_wp) room = min(room, -rest / (root - linear))
    else if (square > 0.0_wp) then
      room = min(room, (linear + root) / square)
    end if
  end function room_to_soften

  !> The rest of a return when both moduli are negative and the back stress has met its bound R.
  !>
  !> With b = sqrt(3/2) beta and e = sqrt(3/2) eta after da1: the back stress shrinks with its
  !> bound, b <- b (1 - k da2 / R), k = |H_i|, which turns the flow direction e + (k da2 / R) b;
  !> da2 solves |e + (k da2 / R) b| - 3 G da2 = sigma_y1 - k da2, a quadratic. When nothing is left
  !> of b the strength is the residual one and da3 is the rest.
  pure subroutine shrink_to_residual(material, q, strength, n, beta, da)
    type(j2_t), intent(in)    :: material
    real(wp),   intent(in)    :: q         !! |e| = q* - (3 G + H_k) da1 [Pa]
    real(wp),   intent(in)    :: strength  !! sigma_y1 = sigma_y(alpha + da1) [Pa]
    real(wp),   intent(inout) :: n(4)      !! flow direction, |n| = 1
    real(wp),   intent(inout) :: beta(4)   !! back stress after da1, then at the end [Pa]
    real(wp),   intent(out)   :: da        !! da2 + da3
    real(wp) :: g3, k, r, b(4), e(4), square, linear, rest, root
    logical  :: spent

    g3 = 3.0_wp * material%shear_modulus
    k = -material%isotropic_modulus
    r = max(0.0_wp, strength - material%residual_strength)
    b = root_3_2 * beta
    e = q * n
    da = 0.0_wp
    spent = r <= 0.0_wp
    if (.not. spent) then
      square = g3 * (g3 - 2.0_wp * k)
      linear = strength * (g3 - k) - k * inner(e, b) / r
      rest = strength**2 - q**2
      root = sqrt(max(0.0_wp, linear**2 - square * rest))
      if (linear > 0.0_wp) then
        da = max(0.0_wp, -rest / (linear + root))
      else
        da = (root - linear) / square
      end if
      spent = da >= r / k
      da = min(da, r / k)
      e = e + (k * da / r) * b
      n = e / norm(e)
    end if
    if (spent) then
      beta = 0.0_wp
      da = da + (norm(e) - g3 * da - material%residual_strength) / g3
    else
      beta = beta * (1.0_wp - k * da / r)
    end if
  end subroutine shrink_to_residual

  !> Deviatoric part.
  pure function deviator(tensor) result(s)
    real(wp), intent(in) :: tensor(4)
    real(wp) :: s(4)

    s = tensor
    s(1:3) = s(1:3) - (tensor(1) + tensor(2) + tensor(3)) / 3.0_wp
  end function deviator

  !> a : b of two symmetric tensors.
  pure real(wp) function inner(a, b)
    real(wp), intent(in) :: a(4), b(4)

    inner = a(1) * b(1) + a(2) * b(2) + a(3) * b(3) + 2.0_wp * a(4) * b(4)
  end function inner

  !> |a|.
  pure real(wp) function norm(a)
    real(wp), intent(in) :: a(4)

    norm = sqrt(inner(a, a))
  end function norm

  !> sqrt(3/2)|dev stress|.
  pure real(wp) function von_mises(stress)
    real(wp), intent(in) :: stress(4)

    von_mises = root_3_2 * norm(deviator(stress))
  end function von_mises

end module pd_j2
