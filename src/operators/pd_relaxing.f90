!> Control of zero-energy modes by one vector per point, which relaxes as the point flows.
!>
!>   h_i = (1/W~) sum_j w~_ij (u_j - u_i - H_i xi)   w~_ij = omega V_j (1 - (M_2/M_4) |xi|^2)
!>   q_i = R Q_i,  Q_i = c (R^T h_i - p_i)           c = kappa E / delta^2
!>
!> h is the mean residual: what the family moves beyond an affine field, blind to quadratic fields
!> too where the family is whole. It is seen in the frame R that turns with the point. A spring of
!> stiffness c holds it; p is the part of it that has relaxed: a Maxwell element whose clock is the
!> plastic strain, measured in the strains beta sigma / (kappa E).
!>
!> The force follows from the power q . dh, so momentum and moments are exact:
!>
!>   P <- P - g (x) s~ - (h x q) d theta / dF    f_i <- f_i + sum_j w~_ij (g_i - g_j)    g = q / W~
!>
!> with s~_i = sum_j w~_ij xi and the angle theta of R.
!> Source: doc/theory.md, section 5.
module pd_relaxing
  use pd_families, only: horizon_t, influence, within_horizon
  use pd_flow, only: flow_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_pages, only: clear_rows
  implicit none
  private

  public :: relaxing_t, springs_t, whole_family_t, whole_family, new_relaxing

  !> Sums over the whole family of an inner point.
  type :: whole_family_t
    real(wp) :: falloff = 0.0_wp   !! M_2 / M_4 [1/m^2], M_k = sum omega V |xi|^k
    real(wp) :: weight = 0.0_wp    !! W~ = M_0 - M_2^2 / M_4 [m^2]; 0: all bonds equally long
    real(wp) :: shape = 0.0_wp     !! M_2 / 2: the shape tensor is K = shape I [m^4]
  end type whole_family_t

  !> What the control needs at the rows; rows without a point: 0.
  type :: relaxing_t
    real(wp) :: falloff = 0.0_wp                 !! M_2 / M_4 [1/m^2]
    real(wp) :: inverse_weight = 0.0_wp          !! 1 / W~ [1/m^2]
    real(wp) :: turns = 1.0_wp                   !! 1: h is seen in the point's frame; 0: at rest
    real(wp), allocatable :: volume(:)           !! V (n) [m^2]
    real(wp), allocatable :: stiffness(:)        !! c (n) [Pa/m^2]
    real(wp), allocatable :: clock(:)            !! kappa E / beta (n) [Pa]
    real(wp), allocatable :: moment(:, :)        !! s~ (n,2) [m^3]
    real(wp), allocatable :: pull(:, :)          !! g, weighed (n,2) [Pa/m^3]
    !> What is kept as it follows the flow, on the way to equilibrium (n); not allocated: at once.
    real(wp), allocatable, private :: following(:)
    real(wp), private :: rate = 1.0_wp           !! how fast it follows
  contains
    procedure :: let_go
    procedure :: join_rows
    procedure :: remember
    procedure :: hold_rows
    procedure :: stored
    procedure :: follow
    procedure, private :: lag
  end type relaxing_t

  !> What happens to the springs of one block; row 1 is the first row of the block.
  type :: springs_t
    real(wp) :: sums(n_block, 2)   !! sum_j w~ (u_j - u_i) [m^3]
    real(wp) :: stiffness(n_block) !! c, times what is kept of the force in this step [Pa/m^2]
    integer  :: n = 0              !! rows that let go
    integer  :: row(n_block)       !! (n) ascending
    real(wp) :: kept(n_block)      !! part of the force that they keep (n)
    real(wp) :: before(n_block, 2) !! their Q_n / c (n) [m]
  end type springs_t

contains

  !> The family of a point of an endless lattice.
  pure type(whole_family_t) function whole_family(horizon, spacing) result(family)
    type(horizon_t), intent(in) :: horizon
    real(wp),        intent(in) :: spacing   !! dx [m]
    !> Bonds whose lengths differ by less than this are equally long.
    real(wp), parameter :: tolerance = 1.0e-6_wp
    real(wp) :: moment(0:2), square, weight
    integer  :: kx, ky, reach

    moment = 0.0_wp
    reach = int(horizon%delta / spacing) + 1
    do ky = -reach, reach
      do kx = -reach, reach
        square = real(kx**2 + ky**2, wp) * spacing**2
        if (.not. within_horizon(horizon, square) .or. (kx == 0 .and. ky == 0)) cycle
        weight = influence(horizon, square) * spacing**2
        moment = moment + weight * [1.0_wp, square, square**2]
      end do
    end do
    family%falloff = moment(1) / moment(2)
    family%shape = 0.5_wp * moment(1)
    family%weight = moment(0) - moment(1)**2 / moment(2)
    if (family%weight <= tolerance * moment(0)) family%weight = 0.0_wp
  end function whole_family

  !> The control of rows with these volumes; the moments s~ are still to come.
  subroutine new_relaxing(family, volume, youngs_modulus, kept, delta, given, turns, relaxing)
    type(whole_family_t), intent(in) :: family
    real(wp), intent(in) :: volume(:)           !! V (n) [m^2]; 0: a row without a point
    real(wp), intent(in) :: youngs_modulus(:)   !! E (n) [Pa]
    integer,  intent(in) :: kept(2)             !! first and last of the rows that are needed
    real(wp), intent(in) :: delta               !! horizon [m]
    real(wp), intent(in) :: given(2)            !! kappa: stiffness [1]; beta: strain at which it
                                                !! relaxes [1]
    logical,  intent(in) :: turns               !! h is seen in the frame of the point
    type(relaxing_t), allocatable, intent(out) :: relaxing
    integer :: n

    n = size(volume)
    allocate (relaxing)
    relaxing%falloff = family%falloff
    relaxing%turns = merge(1.0_wp, 0.0_wp, turns)
    relaxing%inverse_weight = 1.0_wp / family%weight
    allocate (relaxing%volume(n), relaxing%stiffness(n), relaxing%clock(n))
    allocate (relaxing%moment(n, 2), relaxing%pull(n, 2))
    call clear_rows(relaxing%volume, kept)
    call clear_rows(relaxing%stiffness, kept)
    call clear_rows(relaxing%clock, kept)
    call clear_rows(relaxing%moment, kept)
    call clear_rows(relaxing%pull, kept)
    associate (a => kept(1), b => kept(2), kappa => given(1), beta => given(2))
      relaxing%volume(a:b) = volume(a:b)
      relaxing%stiffness(a:b) = kappa * youngs_modulus(a:b) / delta**2
      relaxing%clock(a:b) = kappa * youngs_modulus(a:b) / beta
      where (volume(a:b) <= 0.0_wp) relaxing%stiffness(a:b) = 0.0_wp
    end associate
  end subroutine new_relaxing

  !> What rows lo to hi keep of their force as they flow: 1 / (1 + kappa E d alpha / (beta sigma)).
  pure subroutine let_go(self, lo, hi, flow, memory, rows)
    class(relaxing_t), intent(inout) :: self
    integer,         intent(in)    :: lo, hi
    type(flow_t),    intent(in)    :: flow               !! of these rows
    real(wp), intent(in), contiguous :: memory(:, :)     !! p, Q / c (n,4) [m]
    type(springs_t), intent(inout) :: rows
    integer :: i, k, b

    rows%stiffness(:hi - lo + 1) = self%stiffness(lo:hi)
    rows%n = flow%n
    do k = 1, flow%n
      i = flow%rows(k)
      rows%row(k) = i
      ! a point without strength keeps nothing
      rows%kept(k) = flow%strength(k) &
        / max(tiny(1.0_wp), flow%strength(k) + self%clock(i) * flow%increment(k))
    end do
    if (allocated(self%following)) call self%lag(lo, hi, rows)
    do k = 1, rows%n
      i = rows%row(k)
      b = i - lo + 1
      rows%before(k, 1) = memory(i, 3)
      rows%before(k, 2) = memory(i, 4)
      rows%stiffness(b) = rows%kept(k) * rows%stiffness(b)
    end do
  end subroutine let_go

  !> What is kept follows that of the flow: rows that have flowed on the way let go as well.
  pure subroutine lag(self, lo, hi, rows)
    class(relaxing_t), intent(inout) :: self
    integer,         intent(in)    :: lo, hi
    type(springs_t), intent(inout) :: rows
    real(wp) :: kept(n_block)
    integer  :: i, k

    kept = 1.0_wp
    do k = 1, rows%n
      kept(rows%row(k) - lo + 1) = rows%kept(k)
    end do
    rows%n = 0
    do i = lo, hi
      self%following(i) = (1.0_wp - self%rate) * self%following(i) + self%rate * kept(i - lo + 1)
      if (self%following(i) >= 1.0_wp) cycle
      rows%n = rows%n + 1
      rows%row(rows%n) = i
      rows%kept(rows%n) = self%following(i)
    end do
  end subroutine lag

  !> From now on what is kept follows the flow: at every look by this part of what is missing. 1: at
  !> once, 0: it stays.
  subroutine follow(self, rate)
    class(relaxing_t), intent(inout) :: self
    real(wp),          intent(in)    :: rate

    if (.not. allocated(self%following)) &
      allocate (self%following(size(self%stiffness)), source=1.0_wp)
    self%rate = rate
  end subroutine follow

  !> The springs of rows lo to hi join P: Q = kept c (R^T h - p).
  pure subroutine join_rows(self, lo, hi, gradient, rows, memory, p)
    class(relaxing_t), intent(inout) :: self             !! gets g
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: gradient(:, :)   !! H (n,4) xx xy yx yy
    type(springs_t), intent(in) :: rows
    real(wp), intent(inout), contiguous :: memory(:, :)  !! p, (n,4) [m]; gets R^T h - p
    real(wp), intent(inout) :: p(n_block, 4)             !! P xx xy yx yy [Pa]; row 1 is row lo
    real(wp) :: h1, h2, a, d, over, cosine, sine, e1, e2, q1, q2, couple, turns, inverse
    integer  :: i, b

    turns = self%turns
    inverse = self%inverse_weight
    !$omp simd simdlen(8) private(b, h1, h2, a, d, over, cosine, sine, e1, e2, q1, q2, couple)
    do i = lo, hi
      b = i - lo + 1
      h1 = inverse * (rows%sums(b, 1) - gradient(i, 1) * self%moment(i, 1) &
        - gradient(i, 2) * self%moment(i, 2))
      h2 = inverse * (rows%sums(b, 2) - gradient(i, 3) * self%moment(i, 1) &
        - gradient(i, 4) * self%moment(i, 2))
      ! tan theta = (F_21 - F_12) / (F_11 + F_22); their squares add up to |F|^2 + 2 det F
      a = 2.0_wp + turns * (gradient(i, 1) + gradient(i, 4))
      d = turns * (gradient(i, 3) - gradient(i, 2))
      over = 1.0_wp / sqrt(a**2 + d**2)
      cosine = a * over
      sine = d * over
      e1 = cosine * h1 + sine * h2 - memory(i, 1)
      e2 = cosine * h2 - sine * h1 - memory(i, 2)
      memory(i, 3) = e1
      memory(i, 4) = e2
      q1 = rows%stiffness(b) * (cosine * e1 - sine * e2)
      q2 = rows%stiffness(b) * (cosine * e2 + sine * e1)
      couple = turns * over * (h1 * q2 - h2 * q1)
      q1 = inverse * q1
      q2 = inverse * q2
      p(b, 1) = p(b, 1) - q1 * self%moment(i, 1) + couple * sine
      p(b, 2) = p(b, 2) - q1 * self%moment(i, 2) + couple * cosine
      p(b, 3) = p(b, 3) - q2 * self%moment(i, 1) - couple * cosine
      p(b, 4) = p(b, 4) - q2 * self%moment(i, 2) + couple * sine
      self%pull(i, 1) = q1
      self%pull(i, 2) = q2
    end do
  end subroutine join_rows

  !> Let the rows of a block that let go remember it:
  !>
  !>   p_{n+1} = R^T h - Q / c
  !>
  !> The work of the force in a step is that of the mean of Q_n and Q_{n+1}, and so is its part that
  !> is dissipated.
  pure subroutine remember(self, rows, memory, dissipated)
    class(relaxing_t), intent(in) :: self
    type(springs_t), intent(in) :: rows
    real(wp), intent(inout), contiguous :: memory(:, :)   !! p, R^T h - p (n,4) [m] -> p, Q / c
    real(wp), intent(out) :: dissipated                   !! in this step [J/m]
    real(wp) :: gone(2)
    integer  :: i, k

    dissipated = 0.0_wp
    do k = 1, rows%n
      i = rows%row(k)
      gone = (1.0_wp - rows%kept(k)) * memory(i, 3:4)
      memory(i, 1:2) = memory(i, 1:2) + gone
      memory(i, 3:4) = rows%kept(k) * memory(i, 3:4)
      dissipated = dissipated + 0.5_wp * self%volume(i) * self%stiffness(i) &
        * ((rows%before(k, 1) + memory(i, 3)) * gone(1) &
        + (rows%before(k, 2) + memory(i, 4)) * gone(2))
    end do
  end subroutine remember

  !> The same for a small displacement of a body that has never flowed: q = c h.
  pure subroutine hold_rows(self, lo, hi, gradient, rows, p)
    class(relaxing_t), intent(inout) :: self             !! gets g
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: gradient(:, :)   !! H (n,4) xx xy yx yy
    type(springs_t), intent(in) :: rows
    real(wp), intent(inout) :: p(n_block, 4)             !! P xx xy yx yy [Pa]; row 1 is row lo
    real(wp) :: factor, g1, g2
    integer  :: i, b

    !$omp simd simdlen(8) private(b, factor, g1, g2)
    do i = lo, hi
      b = i - lo + 1
      factor = self%inverse_weight**2 * self%stiffness(i)
      g1 = factor * (rows%sums(b, 1) - gradient(i, 1) * self%moment(i, 1) &
        - gradient(i, 2) * self%moment(i, 2))
      g2 = factor * (rows%sums(b, 2) - gradient(i, 3) * self%moment(i, 1) &
        - gradient(i, 4) * self%moment(i, 2))
      p(b, 1) = p(b, 1) - g1 * self%moment(i, 1)
      p(b, 2) = p(b, 2) - g1 * self%moment(i, 2)
      p(b, 3) = p(b, 3) - g2 * self%moment(i, 1)
      p(b, 4) = p(b, 4) - g2 * self%moment(i, 2)
      self%pull(i, 1) = g1
      self%pull(i, 2) = g2
    end do
  end subroutine hold_rows

  !> Energy of the springs of rows lo to hi, sum V |Q|^2 / (2 c) [J/m].
  pure real(wp) function stored(self, lo, hi, memory)
    class(relaxing_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: memory(:, :)   !! p, Q / c (n,4) [m]
    real(wp) :: energy(n_block)
    integer  :: i

    energy = 0.0_wp
    !$omp simd simdlen(8)
    do i = lo, hi
      energy(i - lo + 1) = 0.5_wp * self%volume(i) * self%stiffness(i) &
        * (memory(i, 3)**2 + memory(i, 4)**2)
    end do
    stored = block_sum(energy)
  end function stored

end module pd_relaxing
