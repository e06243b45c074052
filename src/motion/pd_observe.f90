!> What a run tells about itself: averages, energies and their balance, fields at the points.
!>
!> Source: doc/theory.md, section 10.
module pd_observe
  use pd_kinds, only: block_dot, block_sum, n_block, wp
  use pd_ledger, only: ledger_t
  use pd_model, only: model_t
  use pd_state, only: state_t
  use pd_tensors, only: von_mises
  implicit none
  private

  public :: observation_t, observe, running_away, point_field

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
  subroutine observe(model, state, ledger, seen)
    type(model_t),       intent(in)  :: model
    type(state_t),       intent(in)  :: state
    type(ledger_t),      intent(in)  :: ledger
    type(observation_t), intent(out) :: seen
    real(wp), allocatable :: sums_of(:, :), largest_of(:)
    real(wp) :: sums(n_sums)
    integer  :: block, k

    allocate (sums_of(model%blocks%count, n_sums), largest_of(model%blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(model, state, sums_of, largest_of)
    do block = 1, model%blocks%count
      call sum_block(block, model, state, sums_of(block, :), largest_of(block))
    end do
    !$omp end parallel do
    do k = 1, n_sums
      sums(k) = model%blocks%total(sums_of(:, k))
    end do

    seen%max_plastic_strain = model%blocks%largest(largest_of)
    seen%mean_stress_xx = sums(2) / sums(1)
    seen%mean_stress_yy = sums(3) / sums(1)
    seen%mean_strain_yy = sums(4) / sums(1)
    seen%strain_energy = sums(5)
    seen%kinetic_energy = sums(6)
    call model%operators%control_energy(model%points%volume, state%displacement, &
      state%displacement_gradient, seen%stabilisation_energy)
    seen%plastic_dissipation = ledger%plastic_dissipation(model%blocks)
    seen%damping_dissipation = ledger%damping_dissipation(model%blocks)
    seen%external_work = ledger%external_work(model%blocks)
    seen%energy_error = surplus(seen, ledger)
    if (abs(seen%energy_error) > 0.0_wp) seen%energy_error = seen%energy_error &
      / max(abs(seen%external_work), ledger%initial_kinetic_energy, abs(seen%energy_error))
  end subroutine observe

  !> Sums over the rows of a block: volume, V P_xx, V P_yy, V E_yy (body), strain and kinetic energy
  !> (all points); and the largest equivalent plastic strain of the body.
  pure subroutine sum_block(block, model, state, sums, largest)
    integer,       intent(in)  :: block
    type(model_t), intent(in)  :: model
    type(state_t), intent(in)  :: state
    real(wp),      intent(out) :: sums(n_sums), largest
    real(wp) :: weight(n_block), p(n_block, 4), strain(n_block, 4), energy(n_block)
    real(wp) :: kinetic(n_block), density(n_block), plastic(n_block)
    integer  :: lo, hi

    lo = model%blocks%lo(block)
    hi = model%blocks%hi(block)
    if (hi - lo + 1 < n_block) then   ! sums go over whole blocks
      weight = 0.0_wp
      p = 0.0_wp
      strain = 0.0_wp
      energy = 0.0_wp
      kinetic = 0.0_wp
      density = 0.0_wp
    end if
    call model%materials%strain_block(block, state%displacement_gradient, strain)
    call model%materials%first_piola_block(block, state%displacement_gradient, state%stress, p)
    call model%materials%energy_block(block, state%law_points_t, energy)
    call weigh_rows(lo, hi, model%points%in_body, model%points%volume, state%velocity, weight, &
      energy, kinetic)
    call model%materials%plastic_strain_block(block, state%law_points_t, plastic)
    largest = maxval(model%points%in_body(lo:hi) * plastic(:hi - lo + 1))
    call model%materials%density_block(block, density)
    sums(1) = block_sum(weight)
    sums(2) = block_dot(weight, p(:, 1))
    sums(3) = block_dot(weight, p(:, 4))
    sums(4) = block_dot(weight, strain(:, 2))
    sums(5) = block_sum(energy)
    sums(6) = 0.5_wp * block_dot(density, kinetic)
  end subroutine sum_block

  !> Weights of rows lo to hi in averages over the body, and their energies times volumes; without
  !> a branch.
  pure subroutine weigh_rows(lo, hi, in_body, volume, v, weight, energy, kinetic)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: in_body(:), volume(:), v(:, :)
    real(wp), intent(inout) :: weight(n_block), energy(n_block), kinetic(n_block)
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      weight(b) = in_body(i) * volume(i)
      energy(b) = volume(i) * energy(b)
      kinetic(b) = volume(i) * (v(i, 1)**2 + v(i, 2)**2)
    end do
  end subroutine weigh_rows

  !> Energy that came from nowhere [J/m].
  pure real(wp) function surplus(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    surplus = seen%kinetic_energy + seen%strain_energy + seen%plastic_dissipation &
      + seen%damping_dissipation + seen%stabilisation_energy - ledger%initial_kinetic_energy &
      - seen%external_work
  end function surplus

  !> Whether the run has gained as much energy from nowhere as was ever put into it. Not a number
  !> counts as running away.
  pure logical function running_away(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    running_away = .not. surplus(seen, ledger) <= max(ledger%largest_work, &
      ledger%initial_kinetic_energy) + tiny(1.0_wp)
  end function running_away

  !> A field of a frame, for the points: displacement, velocity, Cauchy stress, strain,
  !> plastic_strain, von_mises, or zero_energy: the rms of the zero-energy part of the deformation,
  !> weighted with omega V over the family, over the horizon. A point that has failed (det F <= 0)
  !> has no Cauchy stress: 0.
  subroutine point_field(name, model, state, values)
    character(*),  intent(in)  :: name
    type(model_t), intent(in)  :: model
    type(state_t), intent(in)  :: state
    real(wp),      intent(out), contiguous :: values(:, :)    !! (components,points)
    real(wp), allocatable :: z2(:), rows(:, :)
    real(wp) :: in_block(n_block, 4)
    integer  :: block, k, lo, n

    allocate (rows(size(model%points%volume), size(values, 1)), source=0.0_wp)
    allocate (z2(size(rows, 1)))
    if (name == 'zero_energy') call model%operators%zero_energy_squared(state%displacement, &
      state%displacement_gradient, z2)
    do block = 1, model%blocks%count
      lo = model%blocks%lo(block)
      n = model%blocks%hi(block) - lo + 1
      select case (name)
      case ('displacement')
        in_block(:n, :2) = state%displacement(lo:lo + n - 1, :)
      case ('velocity')
        in_block(:n, :2) = state%velocity(lo:lo + n - 1, :)
      case ('stress', 'von_mises')
        call model%materials%cauchy_block(block, state%displacement_gradient, state%stress, in_block)
      case ('strain')
        call model%materials%strain_block(block, state%displacement_gradient, in_block)
      case ('plastic_strain')
        call model%materials%plastic_strain_block(block, state%law_points_t, in_block(:, 1))
      case ('zero_energy')
        in_block(:n, 1) = sqrt(z2(lo:lo + n - 1) / model%operators%weight_sum(lo:lo + n - 1)) &
          / model%delta
      end select
      if (name == 'von_mises') then
        do k = 1, n
          in_block(k, 1) = von_mises(in_block(k, :))
        end do
      end if
      rows(lo:lo + n - 1, :) = in_block(:n, :size(rows, 2))
    end do
    values = transpose(rows(model%operators%storage%row, :))
  end subroutine point_field

end module pd_observe
