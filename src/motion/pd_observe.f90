!> What a run tells about itself: averages, energies and their balance, fields at the points.
!>
!> Source: doc/theory.md, section 10.
module pd_observe
  use pd_force, only: solid_t
  use pd_geometry, only: body_t
  use pd_j2, only: elastic_energy_block, von_mises
  use pd_kinds, only: block_dot, block_sum, n_block, wp
  use pd_operators, only: operators_t
  use pd_state, only: state_t
  use pd_strain, only: cauchy, determinant, green_lagrange, normal_components_block
  implicit none
  private

  public :: ledger_t, observation_t, observe, running_away, point_field

  !> Energies that are added up step by step [J/m], and what the balance refers to.
  type :: ledger_t
    real(wp) :: initial_kinetic_energy = 0.0_wp
    real(wp) :: plastic_dissipation = 0.0_wp
    real(wp) :: damping_dissipation = 0.0_wp
    real(wp) :: external_work = 0.0_wp
    real(wp) :: largest_work = 0.0_wp           !! largest |W| so far
  contains
    procedure :: enter
  end type ledger_t

  !> Numbers of one row of the history, boundary forces aside.
  type :: observation_t
    real(wp) :: mean_stress_xx = 0.0_wp, mean_stress_yy = 0.0_wp     !! of P [Pa]
    real(wp) :: mean_strain_yy = 0.0_wp
    real(wp) :: max_plastic_strain = 0.0_wp
    real(wp) :: kinetic_energy = 0.0_wp, strain_energy = 0.0_wp      !! [J/m]
    real(wp) :: plastic_dissipation = 0.0_wp, damping_dissipation = 0.0_wp
    real(wp) :: stabilisation_energy = 0.0_wp, external_work = 0.0_wp
    real(wp) :: energy_error = 0.0_wp
  end type observation_t

  integer, parameter :: n_sums = 6

contains

  !> Add what one step has done.
  pure subroutine enter(self, dissipated, damping, work)
    class(ledger_t), intent(inout) :: self
    real(wp),        intent(in)    :: dissipated   !! by plastic flow [J/m]
    real(wp),        intent(in)    :: damping      !! dissipated by the damping [J/m]
    real(wp),        intent(in)    :: work         !! from outside [J/m]

    self%plastic_dissipation = self%plastic_dissipation + dissipated
    self%damping_dissipation = self%damping_dissipation + damping
    self%external_work = self%external_work + work
    self%largest_work = max(self%largest_work, abs(self%external_work))
  end subroutine enter

  !> Averages over the body without fictitious points, energies over all points.
  subroutine observe(body, solid, operators, state, ledger, seen)
    type(body_t),        intent(in)  :: body
    type(solid_t),       intent(in)  :: solid
    class(operators_t),  intent(inout) :: operators   !! their work space alone
    type(state_t),       intent(in)  :: state
    type(ledger_t),      intent(in)  :: ledger
    type(observation_t), intent(out) :: seen
    real(wp), allocatable :: sums_of(:, :), largest_of(:)
    real(wp) :: sums(n_sums)
    integer  :: block, n_blocks

    n_blocks = (body%n + n_block - 1) / n_block
    allocate (sums_of(n_sums, n_blocks), largest_of(n_blocks))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n_blocks, body, solid, state, sums_of, largest_of)
    do block = 1, n_blocks
      call sum_block((block - 1) * n_block + 1, min(block * n_block, body%n), body, solid, &
        state, sums_of(:, block), largest_of(block))
    end do
    !$omp end parallel do
    sums = sum(sums_of, dim=2)

    seen%max_plastic_strain = maxval(largest_of)
    seen%mean_stress_xx = sums(2) / sums(1)
    seen%mean_stress_yy = sums(3) / sums(1)
    seen%mean_strain_yy = sums(4) / sums(1)
    seen%strain_energy = sums(5)
    seen%kinetic_energy = sums(6)
    call control_energy(body, solid, operators, state, seen%stabilisation_energy)
    seen%plastic_dissipation = ledger%plastic_dissipation
    seen%damping_dissipation = ledger%damping_dissipation
    seen%external_work = ledger%external_work
    seen%energy_error = surplus(seen, ledger)
    if (abs(seen%energy_error) > 0.0_wp) seen%energy_error = seen%energy_error &
      / max(abs(ledger%external_work), ledger%initial_kinetic_energy, abs(seen%energy_error))
  end subroutine observe

  !> Sums over points lo to hi: volume, V P_xx, V P_yy, V E_yy (body), strain and kinetic energy
  !> (all points); and the largest equivalent plastic strain of the body.
  pure subroutine sum_block(lo, hi, body, solid, state, sums, largest)
    integer,       intent(in)  :: lo, hi
    type(body_t),  intent(in)  :: body
    type(solid_t), intent(in)  :: solid
    type(state_t), intent(in)  :: state
    real(wp),      intent(out) :: sums(n_sums), largest
    real(wp) :: weight(n_block), pxx(n_block), pyy(n_block), eyy(n_block), energy(n_block)
    real(wp) :: kinetic(n_block)
    integer  :: n

    n = hi - lo + 1
    if (n < n_block) then   ! sums go over whole blocks
      weight = 0.0_wp
      pxx = 0.0_wp
      pyy = 0.0_wp
      eyy = 0.0_wp
      energy = 0.0_wp
      kinetic = 0.0_wp
    end if
    call normal_components_block(lo, hi, state%deformation_gradient, state%stress, pxx, pyy, eyy)
    call elastic_energy_block(solid%material, lo, hi, state%stress, energy)
    call weigh_block(lo, hi, body%boundary, body%volume, state%velocity, weight, energy, kinetic)
    largest = largest_of_block(lo, hi, body%boundary, state%alpha)
    sums(1) = block_sum(weight)
    sums(2) = block_dot(weight, pxx)
    sums(3) = block_dot(weight, pyy)
    sums(4) = block_dot(weight, eyy)
    sums(5) = block_sum(energy)
    sums(6) = 0.5_wp * solid%density * block_sum(kinetic)
  end subroutine sum_block

  !> Weights of points lo to hi in averages over the body, and their energies times volumes; without
  !> a branch.
  pure subroutine weigh_block(lo, hi, boundary, volume, v, weight, energy, kinetic)
    integer,  intent(in) :: lo, hi
    integer,  intent(in), contiguous :: boundary(:)       !! 0: the body
    real(wp), intent(in), contiguous :: volume(:), v(:, :)
    real(wp), intent(inout) :: weight(n_block), energy(n_block), kinetic(n_block)
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      weight(b) = real(1 - min(1, abs(boundary(i))), wp) * volume(i)
      energy(b) = volume(i) * energy(b)
      kinetic(b) = volume(i) * (v(i, 1)**2 + v(i, 2)**2)
    end do
  end subroutine weigh_block

  !> Largest alpha of the body among points lo to hi.
  pure real(wp) function largest_of_block(lo, hi, boundary, alpha) result(largest)
    integer,  intent(in) :: lo, hi
    integer,  intent(in), contiguous :: boundary(:)       !! 0: the body
    real(wp), intent(in), contiguous :: alpha(:)
    integer :: i

    largest = 0.0_wp
    !$omp simd simdlen(8) reduction(max:largest)
    do i = lo, hi
      largest = max(largest, real(1 - min(1, abs(boundary(i))), wp) * alpha(i))
    end do
  end function largest_of_block

  !> Energy of the control: with constant c it has a potential, (1/2) sum V c sum omega V_j |z|^2,
  !> which is the work of the control forces without the error of adding it up. The force is linear
  !> in u, so this is half of the force times u:
  !>
  !>   -(1/2) sum_i V_i (u_i - u_mean) . Z[u]_i - (1/2) sum_i V_i c_i H_i : H_i K_i,   H = F - I
  !>
  !> The mean adds nothing, for the forces are in balance; without it digits of u would be lost.
  subroutine control_energy(body, solid, operators, state, energy)
    type(body_t),       intent(in)    :: body
    type(solid_t),      intent(in)    :: solid
    class(operators_t), intent(inout) :: operators
    type(state_t),      intent(in)    :: state
    real(wp),           intent(out)   :: energy   !! [J/m]; round-off does not make it negative
    real(wp), allocatable :: z(:, :), energy_of(:)
    real(wp) :: mean(2)
    integer  :: block, n_blocks

    energy = 0.0_wp
    if (.not. allocated(operators%control)) return
    n_blocks = (body%n + n_block - 1) / n_block
    allocate (energy_of(n_blocks))
    allocate (z(body%n, 2), source=0.0_wp)
    call operators%add_control(state%displacement, z)
    mean = matmul(body%volume, state%displacement) / sum(body%volume)
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n_blocks, body, solid, operators, state, z, mean, energy_of)
    do block = 1, n_blocks
      energy_of(block) = control_energy_of_block((block - 1) * n_block + 1, &
        min(block * n_block, body%n), body%volume, operators%control, solid%k_inverse, &
        state%deformation_gradient, state%displacement, mean, z)
    end do
    !$omp end parallel do
    energy = sum(energy_of)
    if (energy < 0.0_wp) energy = 0.0_wp   ! not max: it would hide what is not a number
  end subroutine control_energy

  !> The same for points lo to hi.
  pure real(wp) function control_energy_of_block(lo, hi, volume, c, k_inverse, f, u, mean, z) &
    result(energy)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: volume(:), c(:), k_inverse(:, :), f(:, :), u(:, :), z(:, :)
    real(wp), intent(in) :: mean(2)   !! of u [m]
    real(wp) :: terms(n_block), determinant_of_k, kxx, kyy, kxy, hxx, hyy
    integer  :: i

    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    !$omp simd simdlen(8) private(determinant_of_k, kxx, kyy, kxy, hxx, hyy)
    do i = lo, hi
      ! voids have K^-1 = 0 and c = 0: the quotients stay finite
      determinant_of_k = 1.0_wp / max(k_inverse(i, 1) * k_inverse(i, 2) - k_inverse(i, 3)**2, &
        tiny(1.0_wp))
      kxx = k_inverse(i, 2) * determinant_of_k
      kyy = k_inverse(i, 1) * determinant_of_k
      kxy = -k_inverse(i, 3) * determinant_of_k
      hxx = f(i, 1) - 1.0_wp
      hyy = f(i, 4) - 1.0_wp
      terms(i - lo + 1) = -0.5_wp * volume(i) * ((u(i, 1) - mean(1)) * z(i, 1) &
        + (u(i, 2) - mean(2)) * z(i, 2) + c(i) * (kxx * (hxx**2 + f(i, 3)**2) &
        + kyy * (f(i, 2)**2 + hyy**2) + 2.0_wp * kxy * (hxx * f(i, 2) + f(i, 3) * hyy)))
    end do
    energy = block_sum(terms)
  end function control_energy_of_block

  !> Energy that came from nowhere [J/m].
  pure real(wp) function surplus(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    surplus = seen%kinetic_energy + seen%strain_energy + seen%plastic_dissipation &
      + seen%damping_dissipation + seen%stabilisation_energy - ledger%initial_kinetic_energy &
      - ledger%external_work
  end function surplus

  !> Whether the run has gained as much energy from nowhere as was ever put into it. Not a number
  !> counts as running away.
  pure logical function running_away(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    running_away = .not. surplus(seen, ledger) <= max(ledger%largest_work, &
      ledger%initial_kinetic_energy) + tiny(1.0_wp)
  end function running_away

  !> A field of a frame, for the points without voids: displacement, velocity, Cauchy stress,
  !> strain, plastic_strain, von_mises, or zero_energy: the rms of the zero-energy part of the
  !> deformation, weighted with omega V over the family, over the horizon. A point that has failed
  !> (det F <= 0) has no Cauchy stress: 0.
  subroutine point_field(name, body, operators, state, delta, values)
    character(*),       intent(in)  :: name
    type(body_t),       intent(in)  :: body
    class(operators_t), intent(in)  :: operators
    type(state_t),      intent(in)  :: state
    real(wp),           intent(in)  :: delta                       !! horizon [m]
    real(wp),           intent(out), contiguous :: values(:, :)    !! (components,points)
    real(wp), allocatable :: z2(:)

    select case (name)
    case ('displacement')
      call take(state%displacement)
    case ('velocity')
      call take(state%velocity)
    case ('stress', 'von_mises')
      call take_stress(name == 'von_mises')
    case ('strain')
      call take_strain()
    case ('plastic_strain')
      values(1, :) = state%alpha(body%points)
    case default   ! zero_energy
      allocate (z2(body%n))
      call operators%zero_energy_squared(state%displacement, state%deformation_gradient, z2)
      values(1, :) = sqrt(z2(body%points) / operators%weight_sum(body%points)) / delta
    end select

  contains

    subroutine take(field)
      real(wp), intent(in) :: field(:, :)   !! (n,components)
      integer :: i

      !$omp parallel do schedule(static) default(none) private(i) shared(body, values, field)
      do i = 1, size(body%points)
        values(:, i) = field(body%points(i), :)
      end do
      !$omp end parallel do
    end subroutine take

    subroutine take_stress(as_mises)
      logical, intent(in) :: as_mises
      real(wp) :: f(4), s(4), stress(4)
      integer  :: i

      !$omp parallel do schedule(static) default(none) private(i, f, s, stress) &
      !$omp shared(body, values, state, as_mises)
      do i = 1, size(body%points)
        f = state%deformation_gradient(body%points(i), :)
        s = state%stress(body%points(i), :)
        stress = cauchy_or_zero(f, s)
        if (as_mises) then
          values(1, i) = von_mises(stress)
        else
          values(:, i) = stress
        end if
      end do
      !$omp end parallel do
    end subroutine take_stress

    subroutine take_strain()
      real(wp) :: f(4)
      integer  :: i

      !$omp parallel do schedule(static) default(none) private(i, f) shared(body, values, state)
      do i = 1, size(body%points)
        f = state%deformation_gradient(body%points(i), :)
        values(:, i) = green_lagrange(f)
      end do
      !$omp end parallel do
    end subroutine take_strain

  end subroutine point_field

  !> Cauchy stress; 0 where det F is not positive.
  pure function cauchy_or_zero(f, s) result(stress)
    real(wp), intent(in) :: f(4), s(4)   !! F xx xy yx yy; S xx yy zz xy [Pa]
    real(wp) :: stress(4)                !! xx yy zz xy [Pa]

    stress = 0.0_wp
    if (determinant(f) > 0.0_wp) stress = cauchy(f, s)
  end function cauchy_or_zero

end module pd_observe
