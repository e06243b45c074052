!> The operators of a body on a lattice: all points share one set of offsets and weights.
!>
!> Places of a box of rows, voids among them, are numbered along the rows, so that the bond to the
!> place kx columns and ky rows away is a shift by kx + ky * stride. Bonds come in pairs +-xi:
!>
!>   G[u]_i = sum_{k > 0} omega_k V_0 (u~_{i+k} - u~_{i-k}) (x) xi_k - u_i (x) s_i
!>   D[A]_i = sum_{k > 0} omega_k V_0 (A~_{i+k} - A~_{i-k}) xi_k + A_i s_i
!>
!> with u~ = u V / V_0, V_0 = dx^2, and s_i = sum_j omega V_j xi, which differs from zero only where
!> points are missing or own less than a whole cell. No test in the inner loops: voids carry zero.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_lattice
  use pd_families, only: horizon_t, influence, within_horizon
  use pd_kinds, only: i8, n_block, wp
  use pd_operators, only: operators_t
  implicit none
  private

  public :: lattice_operators_t, new_lattice_operators

  integer, parameter :: group = 4   !! pairs of bonds to a pass: their sums stay in registers

  !> Half of the offsets (the others are their opposites), padded with pairs of no weight.
  type, extends(operators_t) :: lattice_operators_t
    integer, private :: first = 1, last = 0               !! places between which all points lie
    integer, private :: n_pairs = 0                       !! pairs of bonds of an inner point
    logical, private :: uniform = .true.                  !! every point owns a whole cell
    integer,  allocatable, private :: shift(:)            !! (pairs)
    real(wp), allocatable, private :: xi(:, :)            !! (pairs,2) [m]
    real(wp), allocatable, private :: weight(:)           !! omega V_0 (pairs) [m^2]
    real(wp), allocatable, private :: share(:)            !! V / V_0 (n); voids: 0
    real(wp), allocatable, private :: moment(:, :)        !! s (n,2) [m^3]
  contains
    procedure :: gradient
    procedure :: divergence
    procedure :: add_control
    procedure :: shape_tensor
    procedure :: zero_energy_squared
    procedure :: bonds
    procedure :: fewest_bonds
    procedure :: memory
  end type lattice_operators_t

contains

  !> Offsets, weights and moments.
  subroutine new_lattice_operators(horizon, spacing, stride, volume, operators)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing     !! dx [m]
    integer,         intent(in) :: stride      !! places from a row to the next
    real(wp),        intent(in) :: volume(:)   !! V (n) [m^2]; voids: 0
    type(lattice_operators_t), intent(out) :: operators
    integer  :: k, reach, kx, ky, i
    real(wp) :: xi(2), length_squared

    operators%n = size(volume)
    reach = int(horizon%delta / spacing * (1.0_wp + 1.0e-5_wp)) + 1
    allocate (operators%shift((2 * reach + 1)**2), source=0)
    allocate (operators%xi(size(operators%shift), 2), operators%weight(size(operators%shift)), &
      source=0.0_wp)
    k = 0
    do ky = 0, reach
      do kx = -reach, reach
        if (ky == 0 .and. kx <= 0) cycle
        xi = spacing * real([kx, ky], wp)
        length_squared = xi(1)**2 + xi(2)**2
        if (.not. within_horizon(horizon, length_squared)) cycle
        k = k + 1
        operators%shift(k) = kx + ky * stride
        operators%xi(k, :) = xi
        operators%weight(k) = influence(horizon, length_squared) * spacing**2
      end do
    end do
    operators%n_pairs = k
    k = group * ((k + group - 1) / group)
    operators%shift = operators%shift(:k)
    operators%xi = operators%xi(:k, :)
    operators%weight = operators%weight(:k)

    allocate (operators%share(operators%n))
    operators%share = volume / spacing**2
    operators%uniform = all(abs(operators%share) <= 0.0_wp .or. &
      abs(operators%share - 1.0_wp) <= 1.0e-12_wp)
    if (operators%uniform) operators%share = anint(operators%share)
    operators%first = findloc(volume > 0.0_wp, .true., dim=1)
    operators%last = findloc(volume > 0.0_wp, .true., dim=1, back=.true.)
    call weigh(operators)
    do i = 1, operators%n
      if (operators%share(i) <= 0.0_wp) operators%weight_sum(i) = 1.0_wp
    end do
  end subroutine new_lattice_operators

  !> W_i and s_i from the shares of the neighbours.
  subroutine weigh(operators)
    type(lattice_operators_t), intent(inout) :: operators
    integer  :: i, k, lo, hi
    real(wp) :: plus, minus

    allocate (operators%weight_sum(operators%n), operators%moment(operators%n, 2), source=0.0_wp)
    !$omp parallel do schedule(static) default(none) shared(operators) &
    !$omp private(i, k, lo, hi, plus, minus)
    do lo = operators%first, operators%last, n_block
      hi = min(lo + n_block - 1, operators%last)
      associate (share => operators%share, shift => operators%shift, xi => operators%xi)
        do k = 1, operators%n_pairs
          do i = lo, hi
            plus = operators%weight(k) * share(i + shift(k))
            minus = operators%weight(k) * share(i - shift(k))
            operators%weight_sum(i) = operators%weight_sum(i) + plus + minus
            operators%moment(i, 1) = operators%moment(i, 1) + (plus - minus) * xi(k, 1)
            operators%moment(i, 2) = operators%moment(i, 2) + (plus - minus) * xi(k, 2)
          end do
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine weigh

  !> G[u]: h = sum_j omega V_j (u_j - u_i) (x) xi.
  subroutine gradient(self, u, h)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    real(wp), allocatable :: shared_u(:, :)

    if (self%uniform) then
      call gradient_of_shares(self, u, u, h)
    else
      call take_shares(self%share, u, shared_u)
      call gradient_of_shares(self, shared_u, u, h)
    end if
  end subroutine gradient

  !> Field times V / V_0.
  subroutine take_shares(share, field, shared_field)
    real(wp), intent(in), contiguous   :: share(:)      !! (n)
    real(wp), intent(in), contiguous   :: field(:, :)   !! (n,k)
    real(wp), allocatable, intent(out) :: shared_field(:, :)
    integer :: i, c, lo

    allocate (shared_field(size(field, 1), size(field, 2)))
    !$omp parallel do schedule(static) default(none) shared(share, field, shared_field) &
    !$omp private(i, c, lo)
    do lo = 1, size(share), n_block
      do c = 1, size(field, 2)
        do i = lo, min(lo + n_block - 1, size(share))
          shared_field(i, c) = share(i) * field(i, c)
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine take_shares

  !> The gradient from u~ and u.
  subroutine gradient_of_shares(self, w, u, h)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: w(:, :)   !! u~ (n,2) [m]
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) [m^4]
    integer :: lo, hi, i, g

    !$omp parallel do schedule(static) default(none) shared(self, w, u, h) private(lo, hi, i, g)
    do lo = self%first, self%last, n_block
      hi = min(lo + n_block - 1, self%last)
      !$omp simd
      do i = lo, hi
        h(i, 1) = -u(i, 1) * self%moment(i, 1)
        h(i, 2) = -u(i, 1) * self%moment(i, 2)
        h(i, 3) = -u(i, 2) * self%moment(i, 1)
        h(i, 4) = -u(i, 2) * self%moment(i, 2)
      end do
      do g = 1, size(self%shift), group
        call add_differences(lo, hi, self%shift(g:g + group - 1), &
          self%weight(g:g + group - 1), self%xi(g:g + group - 1, :), w, h)
      end do
    end do
    !$omp end parallel do
  end subroutine gradient_of_shares

  !> h <- h + sum over four pairs of weight (w_{i+k} - w_{i-k}) (x) xi, for points lo to hi.
  pure subroutine add_differences(lo, hi, shift, weight, xi, w, h)
    integer,  intent(in) :: lo, hi, shift(group)
    real(wp), intent(in) :: weight(group), xi(group, 2)
    real(wp), intent(in),    contiguous :: w(:, :)   !! (n,2)
    real(wp), intent(inout), contiguous :: h(:, :)   !! (n,4)
    integer  :: i, k1, k2, k3, k4
    real(wp) :: x1, x2, x3, x4, y1, y2, y3, y4, d1, d2, d3, d4

    k1 = shift(1)
    k2 = shift(2)
    k3 = shift(3)
    k4 = shift(4)
    x1 = weight(1) * xi(1, 1)
    x2 = weight(2) * xi(2, 1)
    x3 = weight(3) * xi(3, 1)
    x4 = weight(4) * xi(4, 1)
    y1 = weight(1) * xi(1, 2)
    y2 = weight(2) * xi(2, 2)
    y3 = weight(3) * xi(3, 2)
    y4 = weight(4) * xi(4, 2)
    !$omp simd private(d1, d2, d3, d4)
    do i = lo, hi
      d1 = w(i + k1, 1) - w(i - k1, 1)
      d2 = w(i + k2, 1) - w(i - k2, 1)
      d3 = w(i + k3, 1) - w(i - k3, 1)
      d4 = w(i + k4, 1) - w(i - k4, 1)
      h(i, 1) = h(i, 1) + ((d1 * x1 + d2 * x2) + (d3 * x3 + d4 * x4))
      h(i, 2) = h(i, 2) + ((d1 * y1 + d2 * y2) + (d3 * y3 + d4 * y4))
      d1 = w(i + k1, 2) - w(i - k1, 2)
      d2 = w(i + k2, 2) - w(i - k2, 2)
      d3 = w(i + k3, 2) - w(i - k3, 2)
      d4 = w(i + k4, 2) - w(i - k4, 2)
      h(i, 3) = h(i, 3) + ((d1 * x1 + d2 * x2) + (d3 * x3 + d4 * x4))
      h(i, 4) = h(i, 4) + ((d1 * y1 + d2 * y2) + (d3 * y3 + d4 * y4))
    end do
  end subroutine add_differences

  !> D[A]: f = sum_j omega V_j (A_i + A_j) xi.
  subroutine divergence(self, a, f)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    real(wp), allocatable :: shared_a(:, :)

    if (self%uniform) then
      call divergence_of_shares(self, a, a, f)
    else
      call take_shares(self%share, a, shared_a)
      call divergence_of_shares(self, shared_a, a, f)
    end if
  end subroutine divergence

  !> The divergence from A~ and A.
  subroutine divergence_of_shares(self, w, a, f)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: w(:, :)   !! A~ (n,4) [N/m^6]
    real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    integer :: lo, hi, i, c, g

    !$omp parallel do schedule(static) default(none) shared(self, w, a, f) private(lo, hi, i, c, g)
    do lo = self%first, self%last, n_block
      hi = min(lo + n_block - 1, self%last)
      !$omp simd
      do i = lo, hi
        f(i, 1) = a(i, 1) * self%moment(i, 1) + a(i, 2) * self%moment(i, 2)
        f(i, 2) = a(i, 3) * self%moment(i, 1) + a(i, 4) * self%moment(i, 2)
      end do
      do c = 1, 4
        do g = 1, size(self%shift), group
          call add_projections(lo, hi, self%shift(g:g + group - 1), &
            self%weight(g:g + group - 1) * self%xi(g:g + group - 1, 2 - modulo(c, 2)), &
            w(:, c), f(:, (c + 1) / 2))
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine divergence_of_shares

  !> f <- f + sum over four pairs of (w_{i+k} - w_{i-k}) x, for points lo to hi.
  pure subroutine add_projections(lo, hi, shift, x, w, f)
    integer,  intent(in) :: lo, hi, shift(group)
    real(wp), intent(in) :: x(group)
    real(wp), intent(in),    contiguous :: w(:)   !! (n)
    real(wp), intent(inout), contiguous :: f(:)   !! (n)
    integer  :: i, k1, k2, k3, k4
    real(wp) :: x1, x2, x3, x4

    k1 = shift(1)
    k2 = shift(2)
    k3 = shift(3)
    k4 = shift(4)
    x1 = x(1)
    x2 = x(2)
    x3 = x(3)
    x4 = x(4)
    !$omp simd
    do i = lo, hi
      f(i) = f(i) + (((w(i + k1) - w(i - k1)) * x1 + (w(i + k2) - w(i - k2)) * x2) &
        + ((w(i + k3) - w(i - k3)) * x3 + (w(i + k4) - w(i - k4)) * x4))
    end do
  end subroutine add_projections

  !> f <- f + Z[u], bond by bond: c varies, and voids must not pull.
  subroutine add_control(self, c, u, f)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: c(:)      !! (n) [N/m^6]
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    integer  :: lo, hi, i, k, s
    real(wp) :: plus, minus

    !$omp parallel do schedule(static) default(none) shared(self, c, u, f) &
    !$omp private(lo, hi, i, k, s, plus, minus)
    do lo = self%first, self%last, n_block
      hi = min(lo + n_block - 1, self%last)
      do k = 1, self%n_pairs
        s = self%shift(k)
        !$omp simd private(plus, minus)
        do i = lo, hi
          plus = self%weight(k) * self%share(i + s) * (c(i) + c(i + s))
          minus = self%weight(k) * self%share(i - s) * (c(i) + c(i - s))
          f(i, 1) = f(i, 1) + plus * (u(i + s, 1) - u(i, 1)) + minus * (u(i - s, 1) - u(i, 1))
          f(i, 2) = f(i, 2) + plus * (u(i + s, 2) - u(i, 2)) + minus * (u(i - s, 2) - u(i, 2))
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine add_control

  !> K = sum_j omega V_j xi (x) xi.
  subroutine shape_tensor(self, k)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: k(:, :)   !! out: (n,3) xx yy xy [m^4]
    integer  :: lo, hi, i, p
    real(wp) :: both

    k = 0.0_wp
    !$omp parallel do schedule(static) default(none) shared(self, k) private(lo, hi, i, p, both)
    do lo = self%first, self%last, n_block
      hi = min(lo + n_block - 1, self%last)
      associate (share => self%share, shift => self%shift, xi => self%xi)
        do p = 1, self%n_pairs
          do i = lo, hi
            if (share(i) <= 0.0_wp) cycle
            both = self%weight(p) * (share(i + shift(p)) + share(i - shift(p)))
            k(i, 1) = k(i, 1) + both * xi(p, 1)**2
            k(i, 2) = k(i, 2) + both * xi(p, 2)**2
            k(i, 3) = k(i, 3) + both * xi(p, 1) * xi(p, 2)
          end do
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine shape_tensor

  !> Part of the deformation that F does not see, squared and weighted over the family.
  subroutine zero_energy_squared(self, u, deformation_gradient, z2)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: u(:, :)                     !! (n,2) [m]
    real(wp), intent(in),    contiguous :: deformation_gradient(:, :)  !! F (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)                       !! out: (n) [m^4]
    integer  :: lo, hi, i, p, side, s
    real(wp) :: xi(2), z(2)

    z2 = 0.0_wp
    !$omp parallel do schedule(static) default(none) private(lo, hi, i, p, side, s, xi, z) &
    !$omp shared(self, u, deformation_gradient, z2)
    do lo = self%first, self%last, n_block
      hi = min(lo + n_block - 1, self%last)
      do p = 1, self%n_pairs
        do side = -1, 1, 2
          s = side * self%shift(p)
          xi = real(side, wp) * self%xi(p, :)
          do i = lo, hi
            if (self%share(i) <= 0.0_wp) cycle
            associate (f => deformation_gradient)
              z(1) = u(i + s, 1) - u(i, 1) - (f(i, 1) - 1.0_wp) * xi(1) - f(i, 2) * xi(2)
              z(2) = u(i + s, 2) - u(i, 2) - f(i, 3) * xi(1) - (f(i, 4) - 1.0_wp) * xi(2)
            end associate
            z2(i) = z2(i) + self%weight(p) * self%share(i + s) * (z(1)**2 + z(2)**2)
          end do
        end do
      end do
    end do
    !$omp end parallel do
  end subroutine zero_energy_squared

  !> Number of bonds of point i.
  pure integer function bonds_of_point(self, i) result(n)
    class(lattice_operators_t), intent(in) :: self
    integer,                    intent(in) :: i
    integer :: k

    n = 0
    do k = 1, self%n_pairs
      if (self%share(i + self%shift(k)) > 0.0_wp) n = n + 1
      if (self%share(i - self%shift(k)) > 0.0_wp) n = n + 1
    end do
  end function bonds_of_point

  !> Number of directed bonds.
  pure integer(i8) function bonds(self)
    class(lattice_operators_t), intent(in) :: self
    integer :: i

    bonds = 0
    do i = self%first, self%last
      if (self%share(i) > 0.0_wp) bonds = bonds + bonds_of_point(self, i)
    end do
  end function bonds

  !> Fewest bonds of any point, and the first point that has so few.
  pure subroutine fewest_bonds(self, fewest, point)
    class(lattice_operators_t), intent(in)  :: self
    integer,                    intent(out) :: fewest, point
    integer :: i

    fewest = huge(1)
    point = 0
    do i = self%first, self%last
      if (self%share(i) <= 0.0_wp) cycle
      if (bonds_of_point(self, i) >= fewest) cycle
      fewest = bonds_of_point(self, i)
      point = i
    end do
  end subroutine fewest_bonds

  !> Memory that the operators take [bytes].
  pure real(wp) function memory(self)
    class(lattice_operators_t), intent(in) :: self

    memory = real(self%n, wp) * 32.0_wp
    if (.not. self%uniform) memory = memory + real(self%n, wp) * 32.0_wp
  end function memory

end module pd_lattice
