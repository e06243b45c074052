!> The bond list of points off a lattice, whose weights leave a homogeneous stress in balance.
!>
!>   g_ij = omega (K_i^-1 xi + z_ij[lambda])      z_ij[x] = x_j - x_i - H_i[x] xi
!>   H_i = sum_j V_j (u_j - u_i) (x) g_ij         f_i = sum_j V_j (P_i g_ij - P_j g_ji)
!>
!> The field lambda is that of `pd_balance`. Residuals have no moment, sum_j omega V_j z_ij (x) xi
!> = 0: affine motions stay exact, and K is what it was. The force is minus the adjoint of H, so
!> momentum and moments stay exact. The bonds hold w_ij = V_j K_i g_ij, as those of the plain list
!> do, and the weight with which they are seen from the other end, b_ij = -(V_j K_j g_ji):
!>
!>   G[u]_i = sum_j (u_j - u_i) (x) w_ij          D[A]_i = A_i sum_j w_ij + sum_j A_j b_ij
!>
!> The control after Silling keeps the plain weights, for its potential needs residuals without
!> moment: Z holds all of it, with H^0 = G[u] K^-1 of the plain weights.
!> Source: doc/theory.md, sections 4 and 5.
module pd_balanced_list
  use pd_bond_list, only: bond_list_t
  use pd_kinds, only: i8, wp
  use pd_operator_rows, only: times_k_inverse
  implicit none
  private

  public :: balanced_list_t, new_balanced_list, residual_sums_block

  type, extends(bond_list_t) :: balanced_list_t
    real(wp), allocatable, private :: bx(:), by(:)     !! b (bonds) [m^3]
    real(wp), allocatable, private :: own(:, :)        !! sum_j w_ij (n,2) [m^3]
    real(wp), allocatable, private :: affine(:, :)     !! c H^0 (n,4) xx xy yx yy [N/m^6]
  contains
    procedure :: finish_taking_in
    procedure :: divergence_sums_block
    procedure :: control_sums_block
    procedure :: memory
  end type balanced_list_t

contains

  !> The list with the weights that belong to a field lambda. K^-1 remains.
  subroutine new_balanced_list(list, lambda, balanced)
    type(bond_list_t),     intent(in)  :: list           !! with its K^-1
    real(wp),              intent(in), contiguous :: lambda(:, :)   !! (n,2) [1/m^3]
    type(balanced_list_t), intent(out) :: balanced
    real(wp), allocatable :: h(:, :), k(:, :)
    real(wp)    :: xi(2), step(2), here(2), there(2)
    integer     :: i, j
    integer(i8) :: b

    balanced%bond_list_t = list
    balanced%sums_whole_control = .true.
    allocate (balanced%bx, source=list%wx)
    allocate (balanced%by, source=list%wy)
    allocate (balanced%own(list%n, 2), h(list%n, 4), k(list%n, 3))
    call list%shape_tensor(k)
    call list%gradient_block(1, list%n, lambda, h)
    !$omp parallel do schedule(static) default(none) private(i, j, b, xi, step, here, there) &
    !$omp shared(list, lambda, balanced, h, k)
    do i = 1, list%n
      do b = list%first(i), list%first(i + 1) - 1
        j = list%neighbour(b)
        xi(1) = list%position(j, 1) - list%position(i, 1)
        xi(2) = list%position(j, 2) - list%position(i, 2)
        step(1) = lambda(j, 1) - lambda(i, 1)
        step(2) = lambda(j, 2) - lambda(i, 2)
        call residual(h(i, :), xi, step, here)       ! z_ij
        call residual(h(j, :), -xi, -step, there)    ! z_ji
        balanced%wx(b) = list%wx(b) + list%weight(b) * (k(i, 1) * here(1) + k(i, 3) * here(2))
        balanced%wy(b) = list%wy(b) + list%weight(b) * (k(i, 3) * here(1) + k(i, 2) * here(2))
        balanced%bx(b) = list%wx(b) - list%weight(b) * (k(j, 1) * there(1) + k(j, 3) * there(2))
        balanced%by(b) = list%wy(b) - list%weight(b) * (k(j, 3) * there(1) + k(j, 2) * there(2))
      end do
      balanced%own(i, 1) = sum(balanced%wx(list%first(i):list%first(i + 1) - 1))
      balanced%own(i, 2) = sum(balanced%wy(list%first(i):list%first(i + 1) - 1))
    end do
    !$omp end parallel do
  end subroutine new_balanced_list

  !> z = step - H xi.
  pure subroutine residual(h, xi, step, z)
    real(wp), intent(in)  :: h(4), xi(2), step(2)
    real(wp), intent(out) :: z(2)

    z(1) = step(1) - h(1) * xi(1) - h(2) * xi(2)
    z(2) = step(2) - h(3) * xi(1) - h(4) * xi(2)
  end subroutine residual

  !> Make u readable for the sums, and for the control find c H^0.
  subroutine finish_taking_in(self, u)
    class(balanced_list_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: u(:, :)   !! (n,2) [m]; its halo is brought up to date
    integer :: block, lo, hi, k

    call self%bond_list_t%finish_taking_in(u)
    if (.not. allocated(self%control)) return
    if (.not. allocated(self%affine)) allocate (self%affine(self%n, 4))
    !$omp parallel do schedule(static) default(none) shared(self, u) private(block, lo, hi, k)
    do block = 1, self%domain%blocks%count
      lo = self%domain%blocks%lo(block)
      hi = self%domain%blocks%hi(block)
      call plain_gradient_sums(self, lo, hi, u, self%affine)
      call times_k_inverse(lo, hi, self%k_inverse, self%affine)
      do k = 1, 4
        self%affine(lo:hi, k) = self%control(lo:hi) * self%affine(lo:hi, k)
      end do
    end do
    !$omp end parallel do
    call self%domain%halo%exchange(self%affine)
  end subroutine finish_taking_in

  !> G[u] of rows lo to hi with the plain weights, omega V_j xi.
  pure subroutine plain_gradient_sums(self, lo, hi, u, g)
    class(bond_list_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: g(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: x, y, dx, dy, sums(4)

    do i = lo, hi
      sums = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        x = self%weight(b) * (self%position(j, 1) - self%position(i, 1))
        y = self%weight(b) * (self%position(j, 2) - self%position(i, 2))
        dx = u(j, 1) - u(i, 1)
        dy = u(j, 2) - u(i, 2)
        sums(1) = sums(1) + dx * x
        sums(2) = sums(2) + dx * y
        sums(3) = sums(3) + dy * x
        sums(4) = sums(4) + dy * y
      end do
      g(i, 1) = sums(1)
      g(i, 2) = sums(2)
      g(i, 3) = sums(3)
      g(i, 4) = sums(4)
    end do
  end subroutine plain_gradient_sums

  !> D[A] of rows lo to hi: f = A_i sum_j w_ij + sum_j A_j b_ij.
  pure subroutine divergence_sums_block(self, lo, hi, a, f)
    class(balanced_list_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy

    do i = lo, hi
      fx = a(i, 1) * self%own(i, 1) + a(i, 2) * self%own(i, 2)
      fy = a(i, 3) * self%own(i, 1) + a(i, 4) * self%own(i, 2)
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        fx = fx + a(j, 1) * self%bx(b) + a(j, 2) * self%by(b)
        fy = fy + a(j, 3) * self%bx(b) + a(j, 4) * self%by(b)
      end do
      f(i, 1) = fx
      f(i, 2) = fy
    end do
  end subroutine divergence_sums_block

  !> f <- f + sum_j omega V_j (c_i z_ij - c_j z_ji) for rows lo to hi: all of Silling's control.
  pure subroutine control_sums_block(self, lo, hi, u, f)
    class(balanced_list_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]

    call residual_sums_block(self, lo, hi, self%control, u, self%affine, f)
  end subroutine control_sums_block

  !> The same with any stiffness c and its c H^0.
  pure subroutine residual_sums_block(list, lo, hi, c, u, ch, f)
    class(bond_list_t), intent(in) :: list
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: c(:)      !! (n)
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2)
    real(wp), intent(in),    contiguous :: ch(:, :)  !! c H^0 of u (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2)
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy, x, y, both

    do i = lo, hi
      fx = 0.0_wp
      fy = 0.0_wp
      do b = list%first(i), list%first(i + 1) - 1
        j = list%neighbour(b)
        x = list%position(j, 1) - list%position(i, 1)
        y = list%position(j, 2) - list%position(i, 2)
        both = c(i) + c(j)
        fx = fx + list%weight(b) * (both * (u(j, 1) - u(i, 1)) &
          - (ch(i, 1) + ch(j, 1)) * x - (ch(i, 2) + ch(j, 2)) * y)
        fy = fy + list%weight(b) * (both * (u(j, 2) - u(i, 2)) &
          - (ch(i, 3) + ch(j, 3)) * x - (ch(i, 4) + ch(j, 4)) * y)
      end do
      f(i, 1) = f(i, 1) + fx
      f(i, 2) = f(i, 2) + fy
    end do
  end subroutine residual_sums_block

  !> Memory that the operators take [bytes].
  pure real(wp) function memory(self)
    class(balanced_list_t), intent(in) :: self

    memory = self%bond_list_t%memory() + real(self%bonds(), wp) * 16.0_wp &
      + real(self%n, wp) * 16.0_wp
    if (allocated(self%control)) memory = memory + real(self%n, wp) * 32.0_wp
  end function memory

end module pd_balanced_list
