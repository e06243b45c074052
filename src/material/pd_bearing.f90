!> The law of layers that are images of the body: they have no stress and no energy of their own.
!>
!> Their force tensors are those of the body, reflected (`pd_mirror`).
!> Source: doc/theory.md, section 7.
module pd_bearing
  use pd_flow, only: flow_t
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t, law_t
  implicit none
  private

  public :: bearing_t, new_bearing

  type, extends(law_t) :: bearing_t
    real(wp), private :: lambda = 0.0_wp          !! of the material in whose place it is [Pa]
    real(wp), private :: shear_modulus = 0.0_wp   !! [Pa]
  contains
    procedure, nopass :: remembers
    procedure :: stress_block
    procedure :: energy_block
    procedure :: heat_block
    procedure :: lame_constants
    procedure :: reduced
  end type bearing_t

contains

  !> The bearing in place of a material.
  pure type(bearing_t) function new_bearing(material) result(law)
    class(law_t), intent(in) :: material

    call material%lame_constants(law%lambda, law%shear_modulus)
  end function new_bearing

  !> Nothing.
  pure function remembers() result(columns)
    type(label_t), allocatable :: columns(:)

    allocate (columns(0))
  end function remembers

  !> None.
  pure subroutine stress_block(self, first, lo, hi, strain, points, flow)
    class(bearing_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1 is row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow

    associate (unused => self, unused_first => first, unused_strain => strain)
    end associate
    flow%n = 0
    points%stress(lo:hi, :) = 0.0_wp
  end subroutine stress_block

  !> None.
  pure subroutine energy_block(self, first, lo, hi, points, energy)
    class(bearing_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: energy(:)   !! out: [J/m^3]; row 1 is row `first`

    associate (unused => self, unused_points => points)
    end associate
    energy(lo - first + 1:hi - first + 1) = 0.0_wp
  end subroutine energy_block

  !> No flow, no heat.
  pure subroutine heat_block(self, first, lo, hi, points, heat)
    class(bearing_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: heat(:)   !! out: [J/m^3]; row 1 is row `first`

    if (self%plastic_strain == 0 .and. size(points%stress, 1) >= hi) &
      heat(lo - first + 1:hi - first + 1) = 0.0_wp
  end subroutine heat_block

  !> Lame's constants of the material in whose place it is: the bearing is nowhere stiffer.
  pure subroutine lame_constants(self, lambda, shear_modulus)
    class(bearing_t), intent(in)  :: self
    real(wp),         intent(out) :: lambda, shear_modulus   !! [Pa]

    lambda = self%lambda
    shear_modulus = self%shear_modulus
  end subroutine lame_constants

  !> The law itself: it has no strength.
  function reduced(self, factor) result(law)
    class(bearing_t), intent(in)  :: self
    real(wp),         intent(in)  :: factor
    class(law_t), allocatable :: law

    if (factor > 0.0_wp) allocate (law, source=self)
  end function reduced

end module pd_bearing
