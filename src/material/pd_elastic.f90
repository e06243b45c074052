!> Linear isotropic elasticity: S = lambda tr(E) I + 2 G E.
!>
!> Source: doc/theory.md, section 3.
module pd_elastic
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t, law_t
  implicit none
  private

  public :: elastic_t, new_elastic, isotropic_stress_block

  !> Material constants [Pa].
  type, extends(law_t) :: elastic_t
    real(wp) :: lambda = 0.0_wp          !! Lame's first constant
    real(wp) :: shear_modulus = 0.0_wp   !! G
  contains
    procedure, nopass :: remembers
    procedure :: stress_block
    procedure :: energy_block
    procedure :: heat_block
    procedure :: lame_constants
    procedure :: reduced
  end type elastic_t

contains

  !> The law of engineering constants.
  pure type(elastic_t) function new_elastic(youngs_modulus, poissons_ratio) result(law)
    real(wp), intent(in) :: youngs_modulus   !! E [Pa]
    real(wp), intent(in) :: poissons_ratio   !! nu, -1 < nu < 1/2

    law%shear_modulus = 0.5_wp * youngs_modulus / (1.0_wp + poissons_ratio)
    law%lambda = youngs_modulus * poissons_ratio &
      / ((1.0_wp + poissons_ratio) * (1.0_wp - 2.0_wp * poissons_ratio))
  end function new_elastic

  !> Nothing.
  pure function remembers() result(columns)
    type(label_t), allocatable :: columns(:)

    allocate (columns(0))
  end function remembers

  !> Stress of rows lo to hi.
  pure subroutine stress_block(self, first, lo, hi, strain, points, flow)
    class(elastic_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1 is row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow
    real(wp) :: stress(n_block, 4)

    flow%n = 0
    call isotropic_stress_block(self%lambda, self%shear_modulus, first, lo, hi, strain, stress)
    points%stress(lo:hi, :) = stress(lo - first + 1:hi - first + 1, :)
  end subroutine stress_block

  !> S = lambda tr(E) I + 2 G E of rows lo to hi.
  pure subroutine isotropic_stress_block(lambda, shear_modulus, first, lo, hi, strain, stress)
    real(wp), intent(in) :: lambda, shear_modulus         !! [Pa]
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: strain(:, :)   !! xx yy zz xy; row 1 is row `first`
    real(wp), intent(inout), contiguous :: stress(:, :)   !! out: likewise [Pa]
    real(wp) :: g2, pressure_part
    integer  :: b

    g2 = 2.0_wp * shear_modulus
    !$omp simd simdlen(8) private(pressure_part)
    do b = lo - first + 1, hi - first + 1
      pressure_part = lambda * (strain(b, 1) + strain(b, 2) + strain(b, 3))
      stress(b, 1) = g2 * strain(b, 1) + pressure_part
      stress(b, 2) = g2 * strain(b, 2) + pressure_part
      stress(b, 3) = g2 * strain(b, 3) + pressure_part
      stress(b, 4) = g2 * strain(b, 4)
    end do
  end subroutine isotropic_stress_block

  !> Stored elastic energy of rows lo to hi.
  pure subroutine energy_block(self, first, lo, hi, points, energy)
    class(elastic_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: energy(:)   !! out: [J/m^3]; row 1 is row `first`
    real(wp) :: over_4g, part, trace
    integer  :: i

    over_4g = 0.25_wp / self%shear_modulus
    part = self%lambda / (3.0_wp * self%lambda + 2.0_wp * self%shear_modulus)
    associate (stress => points%stress)
      !$omp simd simdlen(8) private(trace)
      do i = lo, hi
        trace = stress(i, 1) + stress(i, 2) + stress(i, 3)
        energy(i - first + 1) = over_4g * (stress(i, 1)**2 + stress(i, 2)**2 + stress(i, 3)**2 &
          + 2.0_wp * stress(i, 4)**2 - part * trace**2)
      end do
    end associate
  end subroutine energy_block

  !> No flow (the law has no column for it), no heat.
  pure subroutine heat_block(self, first, lo, hi, points, heat)
    class(elastic_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: heat(:)   !! out: [J/m^3]; row 1 is row `first`

    if (self%plastic_strain == 0 .and. size(points%stress, 1) >= hi) &
      heat(lo - first + 1:hi - first + 1) = 0.0_wp
  end subroutine heat_block

  !> Lame's constants.
  pure subroutine lame_constants(self, lambda, shear_modulus)
    class(elastic_t), intent(in)  :: self
    real(wp),         intent(out) :: lambda, shear_modulus   !! [Pa]

    lambda = self%lambda
    shear_modulus = self%shear_modulus
  end subroutine lame_constants

  !> The law itself: it has no strength.
  function reduced(self, factor) result(law)
    class(elastic_t), intent(in)  :: self
    real(wp),         intent(in)  :: factor
    class(law_t), allocatable :: law

    if (factor > 0.0_wp) allocate (law, source=self)
  end function reduced

end module pd_elastic
