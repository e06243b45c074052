!> A law that the program does not know: what it takes to add one.
!>
!> Damage with a plateau, written as a module of `src/material` would be. Its points remember two
!> numbers. Everything else runs with it as it is (`test_pd_law`): a new law touches its own file
!> and the line of set-up that chooses it.
module damage_law
  use pd_elastic, only: isotropic_stress_block
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t, law_t
  implicit none
  private

  public :: damage_t

  !> S = (1 - D) C : E with D = 1 - kappa_0 / kappa, kappa the largest sqrt(E : C : E / G) so far.
  type, extends(law_t) :: damage_t
    real(wp) :: lambda = 0.0_wp          !! [Pa]
    real(wp) :: shear_modulus = 0.0_wp   !! G [Pa]
    real(wp) :: threshold = 0.0_wp       !! kappa_0
  contains
    procedure, nopass :: remembers
    procedure :: stress_block
    procedure :: energy_block
    procedure :: heat_block
    procedure :: lame_constants
    procedure :: reduced
  end type damage_t

contains

  pure function remembers() result(columns)
    type(label_t), allocatable :: columns(:)

    allocate (columns(2))
    columns(1) = label_t('largest_strain', '1', 'largest equivalent strain so far')
    columns(2) = label_t('damage', '1', 'part of the stiffness that is lost')
  end function remembers

  !> The dissipation is (1/2) G kappa_0 d kappa: half of the work on the plateau.
  pure subroutine stress_block(self, first, lo, hi, strain, points, flow)
    class(damage_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in), contiguous :: strain(:, :)
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow
    real(wp) :: whole(n_block, 4), kappa, before
    integer  :: i, b

    call isotropic_stress_block(self%lambda, self%shear_modulus, first, lo, hi, strain, whole)
    flow%n = hi - lo + 1
    associate (largest => points%history(:, 1), damage => points%history(:, 2))
      do i = lo, hi
        b = i - first + 1
        before = max(self%threshold, largest(i))
        kappa = sqrt((sum(whole(b, :) * strain(b, :)) + whole(b, 4) * strain(b, 4)) &
          / self%shear_modulus)
        largest(i) = max(largest(i), kappa)
        kappa = max(before, largest(i))
        damage(i) = 1.0_wp - self%threshold / kappa
        points%stress(i, :) = (1.0_wp - damage(i)) * whole(b, :)
        flow%rows(i - lo + 1) = i
        flow%increment(i - lo + 1) = 0.0_wp
        flow%strength(i - lo + 1) = self%shear_modulus * self%threshold
        flow%dissipated(i - lo + 1) = 0.5_wp * self%shear_modulus * self%threshold &
          * (kappa - before)
      end do
    end associate
  end subroutine stress_block

  pure subroutine energy_block(self, first, lo, hi, points, energy)
    class(damage_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: energy(:)
    real(wp) :: trace, part
    integer  :: i

    part = self%lambda / (3.0_wp * self%lambda + 2.0_wp * self%shear_modulus)
    associate (stress => points%stress)
      do i = lo, hi
        trace = sum(stress(i, :3))
        energy(i - first + 1) = (sum(stress(i, :)**2) + stress(i, 4)**2 - part * trace**2) &
          / (4.0_wp * self%shear_modulus * (1.0_wp - points%history(i, 2)))
      end do
    end associate
  end subroutine energy_block

  !> What was dissipated.
  pure subroutine heat_block(self, first, lo, hi, points, heat)
    class(damage_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: heat(:)
    integer :: i

    do i = lo, hi
      heat(i - first + 1) = 0.5_wp * self%shear_modulus * self%threshold &
        * max(0.0_wp, points%history(i, 1) - self%threshold)
    end do
  end subroutine heat_block

  pure subroutine lame_constants(self, lambda, shear_modulus)
    class(damage_t), intent(in)  :: self
    real(wp),        intent(out) :: lambda, shear_modulus

    lambda = self%lambda
    shear_modulus = self%shear_modulus
  end subroutine lame_constants

  function reduced(self, factor) result(law)
    class(damage_t), intent(in) :: self
    real(wp),        intent(in) :: factor
    class(law_t), allocatable :: law

    allocate (law, source=damage_t(0, self%lambda, self%shear_modulus, self%threshold / factor))
  end function reduced

end module damage_law
