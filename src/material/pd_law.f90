!> A material law: what the points of a material remember, and their stress.
!>
!> A law is a type that extends `law_t`, in a module of its own; set-up chooses it in one line. A
!> law works on rows lo to hi of the fields of all points; these rows have its material. Strain is
!> an array of one block; its row 1 belongs to row `first` of the fields.
!> Source: doc/theory.md, section 3.
module pd_law
  use pd_flow, only: flow_t
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  implicit none
  private

  public :: law_t, law_points_t

  !> Fields that laws read and write.
  type :: law_points_t
    real(wp), allocatable :: stress(:, :)    !! conjugate to the strain (n,4) xx yy zz xy [Pa]
    real(wp), allocatable :: history(:, :)   !! what the points remember (n, most of any law)
    real(wp), allocatable :: strength(:)     !! before any flow (n) [Pa]; laws without one ignore it
    !> Strain before any motion, which is added to that of the measure (n,4) xx yy zz xy; not
    !> allocated: none.
    real(wp), allocatable :: initial_strain(:, :)
  end type law_points_t

  type, abstract :: law_t
    integer :: plastic_strain = 0   !! column of the equivalent plastic strain; 0: none
  contains
    procedure(remembers_of), deferred, nopass :: remembers
    procedure(stress_of), deferred :: stress_block
    procedure(energy_of), deferred :: energy_block
    procedure(heat_of), deferred :: heat_block
    procedure(moduli_of), deferred :: lame_constants
    procedure(reduced_of), deferred :: reduced
  end type law_t

  abstract interface
    !> The columns of the history, all 0 at first.
    pure function remembers_of() result(columns)
      import :: label_t
      type(label_t), allocatable :: columns(:)
    end function remembers_of
    !> Stress of rows lo to hi; the history goes from step n to n+1.
    pure subroutine stress_of(self, first, lo, hi, strain, points, flow)
      import :: flow_t, law_points_t, law_t, wp
      class(law_t), intent(in) :: self
      integer,      intent(in) :: first, lo, hi
      real(wp),     intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1: row `first`
      type(law_points_t), intent(inout) :: points
      type(flow_t), intent(inout) :: flow
    end subroutine stress_of
    !> Stored elastic energy per volume, (1/2) E^e : C : E^e, of rows lo to hi.
    pure subroutine energy_of(self, first, lo, hi, points, energy)
      import :: law_points_t, law_t, wp
      class(law_t), intent(in) :: self
      integer,      intent(in) :: first, lo, hi
      type(law_points_t), intent(in) :: points
      real(wp),     intent(inout), contiguous :: energy(:)   !! [J/m^3]; row 1: row `first`
    end subroutine energy_of
    !> Heat per volume that the flow has made so far, a function of what the points remember, of
    !> rows lo to hi. What is left of the plastic work is energy of the back stress.
    pure subroutine heat_of(self, first, lo, hi, points, heat)
      import :: law_points_t, law_t, wp
      class(law_t), intent(in) :: self
      integer,      intent(in) :: first, lo, hi
      type(law_points_t), intent(in) :: points
      real(wp),     intent(inout), contiguous :: heat(:)     !! [J/m^3]; row 1: row `first`
    end subroutine heat_of
    !> Constants of the elastic law without flow: for the stable step and the wave speed.
    pure subroutine moduli_of(self, lambda, shear_modulus)
      import :: law_t, wp
      class(law_t), intent(in)  :: self
      real(wp),     intent(out) :: lambda, shear_modulus   !! [Pa]
    end subroutine moduli_of
    !> The same law with its strengths divided by a factor. The strength of the points is not part
    !> of it.
    function reduced_of(self, factor) result(law)
      import :: law_t, wp
      class(law_t), intent(in)  :: self
      real(wp),     intent(in)  :: factor
      class(law_t), allocatable :: law
    end function reduced_of
  end interface

end module pd_law
