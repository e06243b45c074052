!> A sliding bearing: it carries stress across itself, and no other.
!>
!>   S_aa = (lambda + 2 G) E_aa along the axis a of its normal, all other components 0
!>
!> Layers of a smooth boundary on a part of a side are made of it: soil in their place would shear
!> where the body slides out below it, and flow.
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
    integer :: axis = 0                  !! of the normal; 1: x, 2: y
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
  pure type(bearing_t) function new_bearing(axis, material) result(law)
    integer,      intent(in) :: axis
    class(law_t), intent(in) :: material

    law%axis = axis
    call material%lame_constants(law%lambda, law%shear_modulus)
  end function new_bearing

  !> Nothing.
  pure function remembers() result(columns)
    type(label_t), allocatable :: columns(:)

    allocate (columns(0))
  end function remembers

  !> Stress of rows lo to hi.
  pure subroutine stress_block(self, first, lo, hi, strain, points, flow)
    class(bearing_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1 is row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow

    flow%n = 0
    points%stress(lo:hi, :) = 0.0_wp
    points%stress(lo:hi, self%axis) = (self%lambda + 2.0_wp * self%shear_modulus) &
      * strain(lo - first + 1:hi - first + 1, self%axis)
  end subroutine stress_block

  !> Stored elastic energy of rows lo to hi.
  pure subroutine energy_block(self, first, lo, hi, points, energy)
    class(bearing_t), intent(in) :: self
    integer,  intent(in) :: first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout), contiguous :: energy(:)   !! out: [J/m^3]; row 1 is row `first`

    energy(lo - first + 1:hi - first + 1) = 0.5_wp * points%stress(lo:hi, self%axis)**2 &
      / (self%lambda + 2.0_wp * self%shear_modulus)
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
  pure function reduced(self, factor) result(law)
    class(bearing_t), intent(in)  :: self
    real(wp),         intent(in)  :: factor
    class(law_t), allocatable :: law

    if (factor > 0.0_wp) allocate (law, source=self)
  end function reduced

end module pd_bearing
