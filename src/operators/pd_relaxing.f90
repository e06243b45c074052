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
  implicit none
  private

  public :: relaxing_t, springs_t, whole_family_t, whole_family, new_relaxing

  !> Sums over the whole family of an inner point.
  type :: whole_family_t
    real(wp) :: falloff = 0.0_wp   !! M_2 / M_4 [1/m^2], M_k = sum omega V |xi|^k
    real(wp) :: weight = 0.0_wp    !! W~ = M_0 - M_2^2 / M_4 [m^2]; 0: all bonds equally long
  end type whole_family_t

  !> What the control needs at the rows; rows without a point: 0.
  type :: relaxing_t
    real(wp) :: falloff = 0.0_wp                 !! M_2 / M_4 [1/m^2]
    real(wp) :: turns = 1.0_wp                   !! 1: h is seen in the point's frame; 0: at rest
    real(wp), allocatable :: volume(:)           !! V (n) [m^2]
    real(wp), allocatable :: stiffness(:)        !! c (n) [Pa/m^2]
    real(wp), allocatable :: clock(:)            !! kappa E / beta (n) [Pa]
    real(wp), allocatable :: inverse_weight(:)   !! 1 / W~ (n) [1/m^2]
    real(wp), allocatable :: moment(:, :)        !! s~ (n,2) [m^3]
    real(wp), allocatable :: pull(:, :)          !! g, weighed (n,2) [Pa/m^3]
    !> Part of the springs that is kept as it follows the flow, on the way to equilibrium (n); not
    !> allocated: it is that of the flow.
    real(wp), allocatable, private :: following(:)
    real(wp), private :: rate = 1.0_wp           !! how fast it follows
  contains
    procedure :: look_at_rows
    procedure :: relax_rows
    procedure :: hold_rows
    procedure :: join_rows
    procedure :: stored
    procedure :: follow
  end type relaxing_t

  !> The springs of one block; row 1 is the first row of the block.
  type :: springs_t
    real(wp) :: h(n_block, 2)             !! residual [m]
    real(wp) :: q(n_block, 2)             !! its force [Pa/m]
    real(wp) :: cosine(n_block), sine(n_block)   !! of the angle of R
    real(wp) :: inverse_length(n_block)   !! of (F_11 + F_22, F_21 - F_12)
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
    family%weight = moment(0) - moment(1)**2 / moment(2)
    if (family%weight <= tolerance * moment(0)) family%weight = 0.0_wp
  end function whole_family

  !> The control of rows with these volumes; the moments s~ are still to come.
  pure function new_relaxing(family, volume, youngs_modulus, delta, kappa, beta, turns) &
    result(relaxing)
    type(whole_family_t), intent(in) :: family
    real(wp), intent(in) :: volume(:)           !! V (n) [m^2]; 0: a row without a point
    real(wp), intent(in) :: youngs_modulus(:)   !! E (n) [Pa]
    real(wp), intent(in) :: delta               !! horizon [m]
    real(wp), intent(in) :: kappa, beta         !! stiffness [1], strain at which it relaxes [1]
    logical,  intent(in) :: turns               !! h is seen in the frame of the point
    type(relaxing_t) :: relaxing
    integer :: n

    n = size(volume)
    relaxing%falloff = family%falloff
    relaxing%turns = merge(1.0_wp, 0.0_wp, turns)
    allocate (relaxing%volume(n), source=volume)
    allocate (relaxing%stiffness(n), source=kappa * youngs_modulus / delta**2)
    allocate (relaxing%clock(n), source=kappa * youngs_modulus / beta)
    allocate (relaxing%inverse_weight(n), source=1.0_wp / family%weight)
    where (volume <= 0.0_wp)
      relaxing%stiffness = 0.0_wp
      relaxing%inverse_weight = 0.0_wp
    end where
    allocate (relaxing%moment(n, 2), relaxing%pull(n, 2), source=0.0_wp)
  end function new_relaxing

  !> h and the frame of rows lo to hi.
  pure subroutine look_at_rows(self, lo, hi, gradient, rows)
    class(relaxing_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: gradient(:, :)   !! H (n,4) xx xy yx yy
    type(springs_t), intent(inout) :: rows               !! in: h holds sum_j w~ (u_j - u_i) [m^3]
    real(wp) :: a, d
    integer  :: i, b

    associate (s => self%moment, inverse => self%inverse_weight, turns => self%turns)
      !$omp simd simdlen(8) private(b, a, d)
      do i = lo, hi
        b = i - lo + 1
        rows%h(b, 1) = inverse(i) &
          * (rows%h(b, 1) - gradient(i, 1) * s(i, 1) - gradient(i, 2) * s(i, 2))
        rows%h(b, 2) = inverse(i) &
          * (rows%h(b, 2) - gradient(i, 3) * s(i, 1) - gradient(i, 4) * s(i, 2))
        ! tan theta = (F_21 - F_12) / (F_11 + F_22); their squares add up to |F|^2 + 2 det F
        a = 2.0_wp + turns * (gradient(i, 1) + gradient(i, 4))
        d = turns * (gradient(i, 3) - gradient(i, 2))
        rows%inverse_length(b) = 1.0_wp / sqrt(a**2 + d**2)
        rows%cosine(b) = a * rows%inverse_length(b)
        rows%sine(b) = d * rows%inverse_length(b)
      end do
    end associate
  end subroutine look_at_rows

  !> q of rows lo to hi, whose p goes from step n to n+1 as they flow:
  !>
  !>   Q = c (R^T h - p_n) / (1 + kappa E d alpha / (beta sigma)),   p_{n+1} = R^T h - Q / c
  !>
  !> The work of the force in a step is that of the mean of Q_n and Q_{n+1}, and so is its part that
  !> is dissipated: Q / c is remembered beside p.
  pure subroutine relax_rows(self, lo, hi, flow, rows, memory, dissipated)
    class(relaxing_t), intent(inout) :: self
    integer,         intent(in)    :: lo, hi
    type(flow_t),    intent(in)    :: flow               !! of these rows
    type(springs_t), intent(inout) :: rows               !! gets q
    real(wp), intent(inout), contiguous :: memory(:, :)  !! p, Q / c (n,4) [m]
    real(wp), intent(out) :: dissipated                  !! (Q_n + Q_{n+1}) . dp / 2 [J/m]
    real(wp) :: kept(n_block), work(n_block), e1, e2, p1, p2
    integer  :: i, b, k

    kept = 1.0_wp
    work = 0.0_wp
    do k = 1, flow%n
      ! a point without strength keeps nothing
      kept(flow%rows(k) - lo + 1) = flow%strength(k) / max(tiny(1.0_wp), &
        flow%strength(k) + self%clock(flow%rows(k)) * flow%increment(k))
    end do
    if (allocated(self%following)) then
      self%following(lo:hi) = self%following(lo:hi) &
        + self%rate * (kept(:hi - lo + 1) - self%following(lo:hi))
      kept(:hi - lo + 1) = self%following(lo:hi)
    end if
    !$omp simd simdlen(8) private(b, e1, e2, p1, p2)
    do i = lo, hi
      b = i - lo + 1
      e1 = rows%cosine(b) * rows%h(b, 1) + rows%sine(b) * rows%h(b, 2) - memory(i, 1)
      e2 = rows%cosine(b) * rows%h(b, 2) - rows%sine(b) * rows%h(b, 1) - memory(i, 2)
      p1 = (1.0_wp - kept(b)) * e1
      p2 = (1.0_wp - kept(b)) * e2
      e1 = kept(b) * e1
      e2 = kept(b) * e2
      work(b) = 0.5_wp * self%volume(i) * self%stiffness(i) &
        * ((memory(i, 3) + e1) * p1 + (memory(i, 4) + e2) * p2)
      memory(i, 1) = memory(i, 1) + p1
      memory(i, 2) = memory(i, 2) + p2
      memory(i, 3) = e1
      memory(i, 4) = e2
      rows%q(b, 1) = self%stiffness(i) * (rows%cosine(b) * e1 - rows%sine(b) * e2)
      rows%q(b, 2) = self%stiffness(i) * (rows%cosine(b) * e2 + rows%sine(b) * e1)
    end do
    dissipated = block_sum(work)
  end subroutine relax_rows

  !> From now on the part of the springs that is kept follows the flow: at every look by this part
  !> of what is missing. 1: at once, 0: it stays.
  subroutine follow(self, rate)
    class(relaxing_t), intent(inout) :: self
    real(wp),          intent(in)    :: rate

    if (.not. allocated(self%following)) &
      allocate (self%following(size(self%stiffness)), source=1.0_wp)
    self%rate = rate
  end subroutine follow

  !> q = c h of rows lo to hi: a small displacement of a body that has never flowed.
  pure subroutine hold_rows(self, lo, hi, rows)
    class(relaxing_t), intent(in) :: self
    integer,         intent(in)    :: lo, hi
    type(springs_t), intent(inout) :: rows
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      rows%q(b, 1) = self%stiffness(i) * rows%h(b, 1)
      rows%q(b, 2) = self%stiffness(i) * rows%h(b, 2)
    end do
  end subroutine hold_rows

  !> Take what h has from H off P, and keep g, for rows lo to hi.
  pure subroutine join_rows(self, lo, hi, rows, p)
    class(relaxing_t), intent(inout) :: self
    integer,         intent(in)    :: lo, hi
    type(springs_t), intent(in)    :: rows
    real(wp),        intent(inout) :: p(n_block, 4)   !! P xx xy yx yy [Pa]; row 1 is row lo
    real(wp) :: g1, g2, couple
    integer  :: i, b

    associate (s => self%moment, inverse => self%inverse_weight, turns => self%turns)
      !$omp simd simdlen(8) private(b, g1, g2, couple)
      do i = lo, hi
        b = i - lo + 1
        g1 = inverse(i) * rows%q(b, 1)
        g2 = inverse(i) * rows%q(b, 2)
        couple = turns * rows%inverse_length(b) &
          * (rows%h(b, 1) * rows%q(b, 2) - rows%h(b, 2) * rows%q(b, 1))
        p(b, 1) = p(b, 1) - g1 * s(i, 1) + couple * rows%sine(b)
        p(b, 2) = p(b, 2) - g1 * s(i, 2) + couple * rows%cosine(b)
        p(b, 3) = p(b, 3) - g2 * s(i, 1) - couple * rows%cosine(b)
        p(b, 4) = p(b, 4) - g2 * s(i, 2) + couple * rows%sine(b)
        self%pull(i, 1) = g1
        self%pull(i, 2) = g2
      end do
    end associate
  end subroutine join_rows

  !> Energy of the springs of rows lo to hi, sum V c |R^T h - p|^2 / 2 [J/m].
  pure real(wp) function stored(self, lo, hi, rows, memory)
    class(relaxing_t), intent(in) :: self
    integer,         intent(in) :: lo, hi
    type(springs_t), intent(in) :: rows
    real(wp), intent(in), contiguous :: memory(:, :)   !! p, Q / c (n,4) [m]
    real(wp) :: energy(n_block), e1, e2
    integer  :: i, b

    energy = 0.0_wp
    !$omp simd simdlen(8) private(b, e1, e2)
    do i = lo, hi
      b = i - lo + 1
      e1 = rows%cosine(b) * rows%h(b, 1) + rows%sine(b) * rows%h(b, 2) - memory(i, 1)
      e2 = rows%cosine(b) * rows%h(b, 2) - rows%sine(b) * rows%h(b, 1) - memory(i, 2)
      energy(b) = 0.5_wp * self%volume(i) * self%stiffness(i) * (e1**2 + e2**2)
    end do
    stored = block_sum(energy)
  end function stored

end module pd_relaxing
