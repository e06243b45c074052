!> What a run tells about itself: averages, energies and their balance, fields at the points.
!>
!> Source: doc/theory.md, section 10.
module pd_observe
  use pd_force, only: solid_t
  use pd_geometry, only: body_t
  use pd_j2, only: elastic_energy_block, von_mises
  use pd_kinds, only: block_sum, n_block, wp
  use pd_operators, only: operators_t
  use pd_state, only: state_t
  use pd_strain, only: cauchy, determinant, first_piola_block, green_lagrange, green_lagrange_block
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

  !> Averages over the body without fictitious points, energies over all points.
  subroutine observe(body, solid, operators, state, ledger, seen)
    type(body_t),        intent(in)  :: body
    type(solid_t),       intent(in)  :: solid
    class(operators_t),  intent(in)  :: operators
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
    seen%stabilisation_energy = control_energy(body, solid, operators, state)
    seen%plastic_dissipation = ledger%plastic_dissipation
    seen%damping_dissipation = ledger%damping_dissipation
    seen%external_work = ledger%external_work
    seen%energy_error = surplus(seen, ledger)
    if (abs(seen%energy_error) > 0.0_wp) seen%energy_error = seen%energy_error &
      / max(abs(ledger%external_work), ledger%initial_kinetic_energy, tiny(1.0_wp))
  end subroutine observe

  !> Sums over points lo to hi: volume, V P_xx, V P_yy, V E_yy (body), strain and kinetic energy
  !> (all points); and the largest equivalent plastic strain of the body.
  pure subroutine sum_block(lo, hi, body, solid, state, sums, largest)
    integer,       intent(in)  :: lo, hi
    type(body_t),  intent(in)  :: body
    type(solid_t), intent(in)  :: solid
    type(state_t), intent(in)  :: state
    real(wp),      intent(out) :: sums(n_sums), largest
    real(wp) :: weight(n_block), p(n_block, 4), e(n_block, 4), energy(n_block)
    real(wp) :: terms(n_block, n_sums)
    integer  :: n

    n = hi - lo + 1
    terms = 0.0_wp
    call first_piola_block(lo, hi, state%deformation_gradient, state%stress, p)
    call green_lagrange_block(lo, hi, state%deformation_gradient, e)
    call elastic_energy_block(solid%material, lo, hi, state%stress, energy)
    associate (volume => body%volume(lo:hi), boundary => body%boundary(lo:hi), &
      v => state%velocity(lo:hi, :))
      weight(:n) = merge(volume, 0.0_wp, boundary == 0)
      terms(:n, 1) = weight(:n)
      terms(:n, 2) = weight(:n) * p(:n, 1)
      terms(:n, 3) = weight(:n) * p(:n, 4)
      terms(:n, 4) = weight(:n) * e(:n, 2)
      terms(:n, 5) = volume * energy(:n)
      terms(:n, 6) = 0.5_wp * solid%density * volume * (v(:, 1)**2 + v(:, 2)**2)
    end associate
    do n = 1, n_sums
      sums(n) = block_sum(terms(:, n))
    end do
    largest = maxval(merge(state%alpha(lo:hi), 0.0_wp, body%boundary(lo:hi) == 0))
  end subroutine sum_block

  !> Energy of the control: with constant c it has a potential, (1/2) sum V c sum omega V_j |z|^2,
  !> which is the work of the control forces without the error of adding it up.
  real(wp) function control_energy(body, solid, operators, state) result(energy)
    type(body_t),      intent(in) :: body
    type(solid_t),     intent(in) :: solid
    class(operators_t), intent(in) :: operators
    type(state_t),     intent(in) :: state
    real(wp), allocatable :: z2(:)

    energy = 0.0_wp
    if (.not. allocated(solid%control)) return
    allocate (z2(body%n))
    call operators%zero_energy_squared(state%displacement, &
      state%deformation_gradient, z2)
    energy = 0.5_wp * sum(body%volume * solid%control * z2)
  end function control_energy

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
    integer :: i, p

    if (name == 'zero_energy') then
      allocate (z2(body%n))
      call operators%zero_energy_squared(state%displacement, state%deformation_gradient, z2)
    end if
    !$omp parallel do schedule(static) default(none) private(i, p) &
    !$omp shared(name, body, operators, state, delta, values, z2)
    do i = 1, size(body%points)
      p = body%points(i)
      select case (name)
      case ('displacement')
        values(:, i) = state%displacement(p, :)
      case ('velocity')
        values(:, i) = state%velocity(p, :)
      case ('stress')
        values(:, i) = cauchy_or_zero(state%deformation_gradient(p, :), state%stress(p, :))
      case ('strain')
        values(:, i) = green_lagrange(state%deformation_gradient(p, :))
      case ('plastic_strain')
        values(1, i) = state%alpha(p)
      case ('von_mises')
        values(1, i) = von_mises(cauchy_or_zero(state%deformation_gradient(p, :), &
          state%stress(p, :)))
      case ('zero_energy')
        values(1, i) = sqrt(z2(p) / operators%weight_sum(p)) / delta
      end select
    end do
    !$omp end parallel do
  end subroutine point_field

  !> Cauchy stress; 0 where det F is not positive.
  pure function cauchy_or_zero(f, s) result(stress)
    real(wp), intent(in) :: f(4), s(4)   !! F xx xy yx yy; S xx yy zz xy [Pa]
    real(wp) :: stress(4)                !! xx yy zz xy [Pa]

    stress = 0.0_wp
    if (determinant(f) > 0.0_wp) stress = cauchy(f, s)
  end function cauchy_or_zero

end module pd_observe
