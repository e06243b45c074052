!> The non-local operators over all families, behind one interface:
!>
!>   gradient    G[u]_i = sum_j omega V_j (u_j - u_i) (x) xi
!>   divergence  D[A]_i = sum_j omega V_j (A_i + A_j) xi
!>   control     Z[u]_i = sum_j omega V_j (c_i + c_j) (u_j - u_i)
!>
!> Two realisations: `pd_bond_list` for any points, `pd_lattice` for bodies on a lattice. Set-up
!> chooses; nobody else knows which it is.
!>
!> Sums are offered for a block of points, so that a time step can go on with a block while it is
!> in the cache, and for all points. Where the weights of the bonds do not know what the neighbour
!> owns, its share belongs to the field: `weigh_displacement` goes before the blocks of G,
!> `weigh_block` follows whoever has written a block of A.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_operators
  use pd_kinds, only: i8, n_block, wp
  implicit none
  private

  public :: operators_t

  !> Operators of one body. Fields have a place for each of its n points; places of a lattice that
  !> hold no point (voids) must carry zero in every field.
  type, abstract :: operators_t
    integer :: n = 0                             !! points, voids included
    integer :: first_point = 1, last_point = 0   !! between which all points lie that are no voids
    real(wp), allocatable :: weight_sum(:)       !! W_i = sum_j omega V_j (n) [m^2]; voids: 1
    logical :: weighs = .false.                  !! fields are weighed with the share
    real(wp), allocatable :: share(:)            !! part of a whole cell that a point owns (n)
    real(wp), allocatable :: weighed(:, :)       !! share u, for blocks of G and Z (n,2) [m]
    real(wp), allocatable :: control(:)          !! c (n) [N/m^6]; not allocated: no control
    real(wp), allocatable :: pull(:, :)          !! share times c u (n,2) [N/m^5]; where Z needs it
  contains
    procedure(gradient_of), deferred :: gradient_block
    procedure(divergence_of), deferred :: divergence_block
    procedure(control_of), deferred :: control_block
    procedure :: set_control
    procedure :: weigh_displacement
    procedure :: weigh_block
    procedure :: gradient
    procedure :: divergence
    procedure :: add_control
    procedure(shape_of), deferred :: shape_tensor
    procedure(zero_energy_of), deferred :: zero_energy_squared
    procedure(bonds_of), deferred :: bonds
    procedure(fewest_of), deferred :: fewest_bonds
    procedure(memory_of), deferred :: memory
  end type operators_t

  abstract interface
    !> G[u] of points lo to hi: h = sum_j omega V_j (u_j - u_i) (x) xi. u has been weighed.
    pure subroutine gradient_of(self, lo, hi, u, h)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    end subroutine gradient_of
    !> D[A] of points lo to hi: f = sum_j omega V_j (A_i + A_j) xi. A has been weighed.
    pure subroutine divergence_of(self, lo, hi, a, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
      real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    end subroutine divergence_of
    !> f <- f + Z[u] for points lo to hi: the bond part of the zero-energy control. Its affine part
    !> belongs to A. u has been weighed.
    pure subroutine control_of(self, lo, hi, u, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
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

contains

  !> Stiffness of the zero-energy control, from now on.
  subroutine set_control(self, c)
    class(operators_t), intent(inout) :: self
    real(wp), intent(in), contiguous  :: c(:)   !! (n) [N/m^6]; voids: 0

    self%control = c
  end subroutine set_control

  !> Keep u for the blocks of G and Z, weighed with what the points own and, where Z needs it, with
  !> the stiffness of the control.
  subroutine weigh_displacement(self, u)
    class(operators_t), intent(inout) :: self
    real(wp), intent(in), contiguous  :: u(:, :)   !! (n,2) [m]
    integer :: i

    if (self%weighs) then
      if (.not. allocated(self%weighed)) allocate (self%weighed(self%n, 2), source=0.0_wp)
      !$omp parallel do simd schedule(static) default(none) shared(self, u) private(i)
      do i = self%first_point, self%last_point
        self%weighed(i, 1) = self%share(i) * u(i, 1)
        self%weighed(i, 2) = self%share(i) * u(i, 2)
      end do
      !$omp end parallel do simd
    end if
    if (allocated(self%pull)) then
      !$omp parallel do simd schedule(static) default(none) shared(self, u) private(i)
      do i = self%first_point, self%last_point
        self%pull(i, 1) = self%share(i) * self%control(i) * u(i, 1)
        self%pull(i, 2) = self%share(i) * self%control(i) * u(i, 2)
      end do
      !$omp end parallel do simd
    end if
  end subroutine weigh_displacement

  !> A <- A weighed with what the points own, for points lo to hi.
  pure subroutine weigh_block(self, lo, hi, a)
    class(operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(inout), contiguous :: a(:, :)   !! (n,4) [N/m^6]
    integer :: i, c

    if (.not. self%weighs) return
    do c = 1, size(a, 2)
      do i = lo, hi
        a(i, c) = self%share(i) * a(i, c)
      end do
    end do
  end subroutine weigh_block

  !> G[u] of all points.
  subroutine gradient(self, u, h)
    class(operators_t), intent(inout) :: self
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    integer :: lo

    call self%weigh_displacement(u)
    !$omp parallel do schedule(static) default(none) shared(self, u, h) private(lo)
    do lo = self%first_point, self%last_point, n_block
      call self%gradient_block(lo, min(lo + n_block - 1, self%last_point), u, h)
    end do
    !$omp end parallel do
  end subroutine gradient

  !> D[A] of all points.
  subroutine divergence(self, a, f)
    class(operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]; not weighed
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    real(wp), allocatable :: weighed(:, :)
    integer :: lo

    allocate (weighed(size(a, 1), size(a, 2)), source=a)
    call self%weigh_block(1, self%n, weighed)
    !$omp parallel do schedule(static) default(none) shared(self, weighed, f) private(lo)
    do lo = self%first_point, self%last_point, n_block
      call self%divergence_block(lo, min(lo + n_block - 1, self%last_point), weighed, f)
    end do
    !$omp end parallel do
  end subroutine divergence

  !> f <- f + Z[u] for all points.
  subroutine add_control(self, u, f)
    class(operators_t), intent(inout) :: self
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    integer :: lo

    call self%weigh_displacement(u)
    !$omp parallel do schedule(static) default(none) shared(self, u, f) private(lo)
    do lo = self%first_point, self%last_point, n_block
      call self%control_block(lo, min(lo + n_block - 1, self%last_point), u, f)
    end do
    !$omp end parallel do
  end subroutine add_control

end module pd_operators
