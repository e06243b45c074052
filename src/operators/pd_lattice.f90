!> The operators of a body on a lattice: all points share one set of offsets and weights.
!>
!> The rows of the fields are the places of a box, voids among them, line by line, so that the bond
!> to the place kx columns and ky lines away is a shift by kx + ky * stride. All sums go by columns
!> (`pd_columns`, S in `pd_radial_sums`):
!>
!>   G[u]_i = sum_j omega V_0 u~_j (x) xi - u_i (x) s_i
!>   D[A]_i = sum_j omega V_0 A~_j xi + A_i s_i
!>   Z[u]_i = c_i sum_j omega V_0 u~_j + sum_j omega V_0 c_j u~_j - u_i sum_j omega V_j (c_i + c_j)
!>   S[x]_i = sum_j omega V_0 (1 - a |xi|^2) x~_j - x_i sum_j omega V_j (1 - a |xi|^2)
!>
!> with u~ = u V / V_0, V_0 = dx^2 (the fields as weighed), and s_i = sum_j omega V_j xi, which
!> differs from zero only where points are missing or have less than a whole cell. The inner loops
!> need no test: voids hold zero. What bonds that cross air or a cut have added is taken out again
!> (`pd_blocked_bonds`).
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_lattice
  use pd_blocked_bonds, only: blocked_bonds_t, new_blocked_bonds
  use pd_blocks, only: blocks_t
  use pd_columns, only: add_sums, columns_t
  use pd_domain, only: new_domain
  use pd_families, only: horizon_t, influence
  use pd_family_weights, only: add_zero_energy, bond_count_t, count_bonds, weigh_families
  use pd_kinds, only: i8, n_block, wp
  use pd_offsets, only: columns_of, half_of_offsets, residual_weights
  use pd_operator_parts, only: divide_domain, points_in_blocks
  use pd_operator_rows, only: own_part_of_force
  use pd_operators, only: operators_t
  use pd_pages, only: clear_rows
  use pd_radial_sums, only: add_radial_sums, new_radial_sums, radial_sums_t
  use pd_ranks, only: ranks_t
  use pd_runs, only: runs_t
  use pd_sight, only: sight_t
  use pd_storage, only: lattice_storage, line_start
  use pd_stretches, only: new_stretches
  implicit none
  private

  public :: lattice_operators_t, new_lattice_operators

  !> Half of the offsets (the others are their opposites), and the columns that they form.
  type, extends(operators_t) :: lattice_operators_t
    integer, private :: n_pairs = 0                       !! pairs of bonds of an inner point
    integer, private :: fewest = 0, poorest = 0           !! bonds of any point, and the first such
    integer(i8), private :: n_bonds = 0                   !! directed
    type(columns_t), private :: columns
    real(wp), private :: own_weight = 0.0_wp              !! omega V_0 of bond length 0 [m^2]
    integer,  allocatable, private :: shift(:)            !! (pairs)
    real(wp), allocatable, private :: xi(:, :)            !! (pairs,2) [m]
    real(wp), allocatable, private :: weight(:)           !! omega V_0 (pairs) [m^2]
    real(wp), allocatable, private :: moment(:, :)        !! s (n,2) [m^3]
    real(wp), allocatable, private :: weighed_moment(:, :)   !! s over the share (n,2) [m^3]
    real(wp), allocatable, private :: stiffness(:)        !! sum_j omega V_j (c_i + c_j) (n) [N/m^4]
    type(radial_sums_t), private :: residual                !! S without the part of x_i
    real(wp), allocatable, private :: residual_weight(:)  !! of x~_i in S (n) [m^2]
    type(blocked_bonds_t), allocatable, private :: blocked  !! not allocated: families are whole
  contains
    procedure :: set_control
    procedure :: gradient_sums_block
    procedure :: divergence_sums_block
    procedure :: control_sums_block
    procedure :: difference_sums_block
    procedure :: weigh_residuals
    procedure :: shape_tensor
    procedure :: zero_energy_squared
    procedure :: bonds
    procedure :: fewest_bonds
    procedure :: memory
  end type lattice_operators_t

contains

  !> Offsets, weights and moments. `ranks`: unless bonds are blocked, each has its own blocks only.
  subroutine new_lattice_operators(horizon, spacing, runs, operators, sight, box, ranks)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing       !! dx [m]
    type(runs_t),    intent(in) :: runs          !! of the points
    type(lattice_operators_t), intent(out) :: operators
    type(sight_t), optional, intent(in) :: sight   !! absent: bonds cross air
    integer, optional, intent(in) :: box(:, :)   !! of `lattice_storage`
    type(ranks_t), optional, intent(in) :: ranks
    integer :: reach, i

    operators%storage = lattice_storage(horizon, spacing, runs, box)
    operators%n = operators%storage%rows
    reach = int(horizon%delta / spacing * (1.0_wp + 1.0e-5_wp)) + 1
    call half_of_offsets(horizon, spacing, operators%storage%stride, reach, operators%shift, &
      operators%xi, operators%weight)
    operators%n_pairs = size(operators%shift)
    operators%columns = columns_of(horizon, spacing, operators%storage%stride, reach)
    operators%own_weight = influence(horizon, 0.0_wp) * spacing**2

    operators%domain = new_domain(line_start(operators%storage%ends(1)), operators%storage%ends(2))
    if (present(sight)) call new_blocked_bonds(sight, operators%storage, operators%shift, &
      operators%xi, operators%weight, operators%blocked)
    if (allocated(operators%blocked)) then
      operators%hidden_bonds = operators%blocked%count
    else if (present(ranks)) then
      call divide_domain(operators, ranks, &
        points_in_blocks(operators%storage, operators%domain%blocks))
    end if
    call operators%storage%take_shares(runs, spacing**2, operators%weighs, operators%share_of)
    operators%stretches = new_stretches(operators%domain%blocks, operators%share_of)
    call weigh(operators)
    if (operators%weighs) then
      allocate (operators%weighed_moment(operators%n, 2))
      call clear_rows(operators%weighed_moment, operators%storage%kept)
      do i = operators%storage%kept(1), operators%storage%kept(2)
        if (operators%share_of(i) > 0.0_wp) &
          operators%weighed_moment(i, :) = operators%moment(i, :) / operators%share_of(i)
      end do
    end if
  end subroutine new_lattice_operators

  !> W_i and s_i from the shares of the neighbours, and the numbers of bonds.
  subroutine weigh(operators)
    type(lattice_operators_t), intent(inout) :: operators
    type(bond_count_t), allocatable :: found(:)
    type(bond_count_t) :: unheard
    type(blocks_t) :: blocks
    integer :: block, lo, kept(2)

    blocks = operators%domain%blocks
    kept = operators%domain%kept(operators%n)
    allocate (operators%weight_sum(operators%n), operators%moment(operators%n, 2))
    operators%weight_sum(kept(1):kept(2)) = 1.0_wp
    allocate (found(blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) shared(operators, blocks, found)
    do block = 1, blocks%count
      call weigh_rows(operators, blocks%lo(block), blocks%hi(block), found(block))
    end do
    !$omp end parallel do
    associate (known => operators%domain%known)
      do lo = known(1), blocks%first - 1, n_block   ! the halo
        call weigh_rows(operators, lo, min(lo + n_block, blocks%first) - 1, unheard)
      end do
      do lo = blocks%last + 1, known(2), n_block
        call weigh_rows(operators, lo, min(lo + n_block - 1, known(2)), unheard)
      end do
    end associate
    operators%n_bonds = nint(blocks%total(real(found%bonds, wp)), i8)
    operators%fewest = nint(blocks%smallest(real(found%fewest, wp)))
    operators%poorest = blocks%lowest_number(merge(found%poorest, 0, &
      found%fewest == operators%fewest))
  end subroutine weigh

  !> The same for rows lo to hi.
  subroutine weigh_rows(operators, lo, hi, found)
    type(lattice_operators_t), intent(inout) :: operators
    integer,            intent(in)  :: lo, hi
    type(bond_count_t), intent(out) :: found
    real(wp) :: total(n_block), moment(n_block, 2)
    integer  :: bonds(n_block), i

    call weigh_families(operators%shift, operators%xi, operators%weight, operators%share_of, &
      [lo, hi], total, moment, bonds)
    if (allocated(operators%blocked)) &
      call operators%blocked%recount(lo, hi, operators%share_of, total, moment, bonds)
    operators%moment(lo:hi, :) = moment(:hi - lo + 1, :)
    do i = lo, hi
      if (operators%share_of(i) > 0.0_wp) operators%weight_sum(i) = total(i - lo + 1)
    end do
    found = count_bonds(lo, bonds(:hi - lo + 1), operators%share_of(lo:hi))
  end subroutine weigh_rows

  !> G[u] of rows lo to hi: g = sum_j omega V_j (u_j - u_i) (x) xi.
  pure subroutine gradient_sums_block(self, lo, hi, u, g)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: g(:, :)   !! out: (n,4) xx xy yx yy [m^4]

    if (self%weighs) then
      call gradient_of_shares(self, lo, hi, self%weighed, u, g)
    else
      call gradient_of_shares(self, lo, hi, u, u, g)
    end if
  end subroutine gradient_sums_block

  !> The same from u~ and u.
  pure subroutine gradient_of_shares(self, lo, hi, w, u, g)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: w(:, :)   !! u~ (n,2) [m]
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: g(:, :)   !! out: (n,4) [m^4]
    integer :: i, c

    !$omp simd simdlen(8)
    do i = lo, hi
      g(i, 1) = -u(i, 1) * self%moment(i, 1)
      g(i, 2) = -u(i, 1) * self%moment(i, 2)
      g(i, 3) = -u(i, 2) * self%moment(i, 1)
      g(i, 4) = -u(i, 2) * self%moment(i, 2)
    end do
    do c = 1, 2
      call add_sums(self%columns, self%columns%x, lo, hi, w(:, c), g(lo:hi, 2 * c - 1))
      call add_sums(self%columns, self%columns%y, lo, hi, w(:, c), g(lo:hi, 2 * c))
    end do
    if (allocated(self%blocked)) call self%blocked%take_out_of_gradient(lo, hi, w, g)
  end subroutine gradient_of_shares

  !> D[A] of rows lo to hi: f = sum_j omega V_j (A_i + A_j) xi.
  pure subroutine divergence_sums_block(self, lo, hi, a, f)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: a(:, :)   !! A~ (n,4) xx xy yx yy [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    integer :: c

    if (self%weighs) then
      call own_part_of_force(lo, hi, self%weighed_moment, a, f)
    else
      call own_part_of_force(lo, hi, self%moment, a, f)
    end if
    do c = 1, 2
      call add_sums(self%columns, self%columns%x, lo, hi, a(:, 2 * c - 1), f(lo:hi, c))
      call add_sums(self%columns, self%columns%y, lo, hi, a(:, 2 * c), f(lo:hi, c))
    end do
    if (allocated(self%blocked)) call self%blocked%take_out_of_divergence(lo, hi, a, f)
  end subroutine divergence_sums_block

  !> Stiffness of the control, and the factor of u_i in Z:
  !> k = c L[share] + L[c share], L by columns, with the point itself.
  subroutine set_control(self, c)
    class(lattice_operators_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: c(:)   !! (n) [N/m^6]; voids: 0
    real(wp), allocatable :: shared(:)
    integer :: block, lo, hi, kept(2)

    kept = self%storage%kept
    allocate (shared(self%n))
    call clear_rows(shared, kept)
    if (.not. allocated(self%control)) allocate (self%control, mold=shared)
    if (.not. allocated(self%stiffness)) allocate (self%stiffness, mold=shared)
    self%control(kept(1):kept(2)) = c(kept(1):kept(2))
    shared(kept(1):kept(2)) = self%share_of(kept(1):kept(2)) * c(kept(1):kept(2))
    call self%domain%make_room(self%n, 2, self%pull)
    !$omp parallel do schedule(static) default(none) shared(self, c, shared) private(block, lo, hi)
    do block = 1, self%domain%blocks%count
      lo = self%domain%blocks%lo(block)
      hi = self%domain%blocks%hi(block)
      self%stiffness(lo:hi) = c(lo:hi) &
        * (self%weight_sum(lo:hi) + self%own_weight * self%share_of(lo:hi))
      call add_sums(self%columns, self%columns%l, lo, hi, shared, self%stiffness(lo:hi))
      if (allocated(self%blocked)) &
        call self%blocked%take_out_of_near(lo, hi, shared, self%stiffness(lo:hi))
    end do
    !$omp end parallel do
  end subroutine set_control

  !> f <- f + Z[u] for rows lo to hi: Z_i = c_i L[u~]_i + L[c u~]_i - k_i u_i. Each L contains
  !> the point itself; these terms cancel.
  pure subroutine control_sums_block(self, lo, hi, u, f)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]

    if (self%weighs) then
      call control_of_shares(self, lo, hi, self%weighed, u, f)
    else
      call control_of_shares(self, lo, hi, u, u, f)
    end if
  end subroutine control_sums_block

  !> The same from u~ and u.
  pure subroutine control_of_shares(self, lo, hi, w, u, f)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: w(:, :)   !! u~ (n,2) [m]
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    real(wp) :: near(n_block)
    integer  :: i, b, n, k

    n = hi - lo + 1
    do k = 1, 2
      near = 0.0_wp
      call add_sums(self%columns, self%columns%l, lo, hi, w(:, k), near(:n))
      if (allocated(self%blocked)) call self%blocked%take_out_of_near(lo, hi, w(:, k), near(:n))
      !$omp simd simdlen(8) private(b)
      do i = lo, hi
        b = i - lo + 1
        near(b) = self%control(i) * near(b) - self%stiffness(i) * u(i, k)
      end do
      call add_sums(self%columns, self%columns%l, lo, hi, self%pull(:, k), near(:n))
      if (allocated(self%blocked)) &
        call self%blocked%take_out_of_near(lo, hi, self%pull(:, k), near(:n))
      !$omp simd simdlen(8)
      do i = lo, hi
        f(i, k) = f(i, k) + near(i - lo + 1)
      end do
    end do
  end subroutine control_of_shares

  !> S[x] of rows lo to hi from x~: s = sum_j w~_ij (x_j - x_i).
  pure subroutine difference_sums_block(self, lo, hi, x, s)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: x(:, :)   !! x~ (n,2)
    real(wp), intent(inout) :: s(n_block, 2)      !! out; row 1 is row lo
    integer :: c, k, rows(2)

    s = 0.0_wp
    do k = self%stretches%from(lo), self%stretches%to(hi)
      rows = self%stretches%rows(k, lo, hi)
      do c = 1, 2
        call add_radial_sums(self%residual, rows(1), rows(2), self%residual_weight, x(:, c), &
          s(rows(1) - lo + 1:rows(2) - lo + 1, c))
      end do
    end do
    if (allocated(self%blocked)) call self%blocked%take_out_of_differences(lo, hi, x, s)
  end subroutine difference_sums_block

  !> Weights of S, and the factor of x~_i in it: the sums over the shares, over the own share.
  subroutine weigh_residuals(self, falloff)
    class(lattice_operators_t), intent(inout) :: self
    real(wp), intent(in) :: falloff   !! a [1/m^2]
    real(wp), allocatable :: nothing(:)
    integer :: block, lo, hi

    self%residual = new_radial_sums(residual_weights(self%xi, self%weight, falloff), &
      self%storage%stride)
    if (allocated(self%blocked)) call self%blocked%weigh_residuals(falloff)
    allocate (nothing(self%n))
    call clear_rows(nothing, self%storage%kept)
    if (.not. allocated(self%residual_weight)) allocate (self%residual_weight, mold=nothing)
    call clear_rows(self%residual_weight, self%storage%kept)
    !$omp parallel do schedule(static) default(none) shared(self, nothing) private(block, lo, hi)
    do block = 1, self%domain%blocks%count
      lo = self%domain%blocks%lo(block)
      hi = self%domain%blocks%hi(block)
      call add_radial_sums(self%residual, lo, hi, nothing, self%share_of, &
        self%residual_weight(lo:hi))
      if (allocated(self%blocked)) &
        call self%blocked%take_out_of_residual(lo, hi, self%share_of, self%residual_weight(lo:hi))
    end do
    !$omp end parallel do
    associate (a => self%domain%blocks%first, b => self%domain%blocks%last)
      ! where there is no point, x~ is zero
      where (self%share_of(a:b) > 0.0_wp) &
        self%residual_weight(a:b) = self%residual_weight(a:b) / self%share_of(a:b)
    end associate
  end subroutine weigh_residuals

  !> K = sum_j omega V_j xi (x) xi.
  subroutine shape_tensor(self, k)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: k(:, :)   !! out: (n,3) xx yy xy [m^4]
    integer  :: block, lo, hi, i, p
    real(wp) :: both

    k(self%domain%blocks%first:self%domain%blocks%last, :) = 0.0_wp
    !$omp parallel do schedule(static) default(none) shared(self, k) &
    !$omp private(block, lo, hi, i, p, both)
    do block = 1, self%domain%blocks%count
      lo = self%domain%blocks%lo(block)
      hi = self%domain%blocks%hi(block)
      associate (share => self%share_of, shift => self%shift, xi => self%xi)
        do p = 1, self%n_pairs
          do i = lo, hi
            if (share(i) <= 0.0_wp) cycle
            both = self%weight(p) * (share(i + shift(p)) + share(i - shift(p)))
            k(i, 1) = k(i, 1) + both * xi(p, 1)**2
            k(i, 2) = k(i, 2) + both * xi(p, 2)**2
            k(i, 3) = k(i, 3) + both * xi(p, 1) * xi(p, 2)
          end do
        end do
        if (allocated(self%blocked)) call self%blocked%reshape_rows(lo, hi, share, k)
      end associate
    end do
    !$omp end parallel do
  end subroutine shape_tensor

  !> Part of the deformation that H does not see, squared and weighted over the family.
  subroutine zero_energy_squared(self, u, h, z2)
    class(lattice_operators_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)     !! out: (n) [m^4]
    type(blocks_t) :: blocks
    integer :: block

    blocks = self%domain%blocks
    z2(blocks%first:blocks%last) = 0.0_wp
    !$omp parallel do schedule(static) default(none) private(block) shared(self, blocks, u, h, z2)
    do block = 1, blocks%count
      call zero_energy_block(self, blocks%lo(block), blocks%hi(block), u, h, z2)
    end do
    !$omp end parallel do
  end subroutine zero_energy_squared

  !> The same for rows lo to hi.
  pure subroutine zero_energy_block(self, lo, hi, u, h, z2)
    class(lattice_operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)     !! out: (n) [m^4]; voids: 0

    call add_zero_energy(self%shift, self%xi, self%weight, self%share_of, [lo, hi], u, h, z2)
    if (allocated(self%blocked)) &
      call self%blocked%recount_zero_energy(lo, hi, self%share_of, u, h, z2)
  end subroutine zero_energy_block

  !> Number of directed bonds.
  pure integer(i8) function bonds(self)
    class(lattice_operators_t), intent(in) :: self

    bonds = self%n_bonds
  end function bonds

  !> Fewest bonds of any point, and the first point that has so few.
  pure subroutine fewest_bonds(self, fewest, point)
    class(lattice_operators_t), intent(in)  :: self
    integer,                    intent(out) :: fewest, point

    fewest = self%fewest
    point = self%storage%point_at(self%poorest)
  end subroutine fewest_bonds

  !> Memory that the operators take [bytes].
  pure real(wp) function memory(self)
    class(lattice_operators_t), intent(in) :: self

    memory = real(self%n, wp) * 32.0_wp
    if (self%weighs) memory = memory + real(self%n, wp) * 32.0_wp
    if (allocated(self%control)) memory = memory + real(self%n, wp) * 32.0_wp
    if (allocated(self%relaxing)) memory = memory + real(self%n, wp) * 72.0_wp
    if (allocated(self%blocked)) memory = memory + self%blocked%memory()
  end function memory

end module pd_lattice
