!> The non-local operators over all families, behind one interface:
!>
!>   gradient    G[u]_i = sum_j omega V_j (u_j - u_i) (x) xi
!>   divergence  D[A]_i = sum_j omega V_j (A_i + A_j) xi
!>   control     Z[u]_i = sum_j omega V_j (c_i + c_j) (u_j - u_i)
!>
!> Two realisations: `pd_bond_list` for any points, `pd_lattice` for bodies on a lattice. Set-up
!> chooses; nobody else knows which it is.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_operators
  use pd_kinds, only: i8, wp
  implicit none
  private

  public :: operators_t

  !> Operators of one body. Fields have a place for each of its n points; places of a lattice that
  !> hold no point (voids) must carry zero in every field.
  type, abstract :: operators_t
    integer :: n = 0                             !! points, voids included
    real(wp), allocatable :: weight_sum(:)       !! W_i = sum_j omega V_j (n) [m^2]; voids: 1
  contains
    procedure(gradient_of), deferred :: gradient
    procedure(divergence_of), deferred :: divergence
    procedure(control_of), deferred :: add_control
    procedure(shape_of), deferred :: shape_tensor
    procedure(zero_energy_of), deferred :: zero_energy_squared
    procedure(bonds_of), deferred :: bonds
    procedure(fewest_of), deferred :: fewest_bonds
    procedure(memory_of), deferred :: memory
  end type operators_t

  abstract interface
    !> G[u]: h = sum_j omega V_j (u_j - u_i) (x) xi.
    subroutine gradient_of(self, u, h)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    end subroutine gradient_of
    !> D[A]: f = sum_j omega V_j (A_i + A_j) xi.
    subroutine divergence_of(self, a, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
      real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    end subroutine divergence_of
    !> f <- f + Z[u]: the bond part of the zero-energy control. Its affine part belongs to A.
    subroutine control_of(self, c, u, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(in),    contiguous :: c(:)      !! (n) [N/m^6]
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    end subroutine control_of
    !> K = sum_j omega V_j xi (x) xi; voids: zero.
    subroutine shape_of(self, k)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: k(:, :)   !! out: (n,3) xx yy xy [m^4]
    end subroutine shape_of
    !> Part of the deformation that the deformation gradient does not see, squared and weighted
    !> over the family: sum_j omega V_j |z|^2 with z = (u_j - u_i) - (F_i - I) xi.
    subroutine zero_energy_of(self, u, deformation_gradient, z2)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(in),    contiguous :: u(:, :)                     !! (n,2) [m]
      real(wp), intent(in),    contiguous :: deformation_gradient(:, :)  !! F (n,4) xx xy yx yy
      real(wp), intent(inout), contiguous :: z2(:)                       !! out: (n) [m^4]
    end subroutine zero_energy_of
    !> Number of directed bonds.
    pure integer(i8) function bonds_of(self)
      import :: operators_t, i8
      class(operators_t), intent(in) :: self
    end function bonds_of
    !> Fewest bonds of any point, and the first point that has so few.
    pure subroutine fewest_of(self, fewest, point)
      import :: operators_t
      class(operators_t), intent(in) :: self
      integer, intent(out) :: fewest, point
    end subroutine fewest_of
    !> Memory that the operators take [bytes].
    pure real(wp) function memory_of(self)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
    end function memory_of
  end interface

end module pd_operators
