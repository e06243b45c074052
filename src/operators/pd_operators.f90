!> The consistent gradient over families and its adjoint; everything that they need is inside.
!>
!>   H_i = G[u]_i K_i^-1               G[u]_i = sum_j omega V_j (u_j - u_i) (x) xi
!>   f_i = D[A]_i + Z[u]_i             D[A]_i = sum_j omega V_j (A_i + A_j) xi
!>   A_i = P_i K_i^-1 - c_i H_i        Z[u]_i = sum_j omega V_j (c_i + c_j) (u_j - u_i)
!>
!> H = F - I is handed out and the first Piola stress P taken in; f is minus the adjoint of H. A is
!> the force tensor: the force state of a bond is omega A xi. c is the stiffness of the zero-energy
!> control, whose affine part joins A. The relaxing control is in `pd_relaxing`; its sums are
!>   S[x]_i = sum_j w~_ij (x_j - x_i)    w~_ij = omega V_j (1 - falloff |xi|^2)
!> In this order, once per state of u:
!>   take_in(u, moved)                   the sums can read u
!>   gradient_block(lo, hi, u, h)        for every block
!>   relax_block(block, u, h, ..., p)    for every block; the relaxing control joins P
!>   hand_over_block(lo, hi, h, p)       for every block; takes P, keeps A
!>   share()                             the sums can read A
!>   force_block(lo, hi, u, f)           for every block
!> Where ranks share the body, take_in and share wait for the rows of others. In their other form
!> the blocks `domain%inner` go between begin_ and finish_, and `domain%outer` afterwards.
!> Realisations: `pd_bond_list` for any points, `pd_balanced_list` off lattices, `pd_lattice` on
!> them; set-up chooses. Each provides the sums G, D, Z and S. Where its weights leave out the
!> volume of the neighbour, fields are first multiplied by its share. Families: see `pd_sight`.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_operators
  use pd_blocks, only: blocks_t
  use pd_domain, only: domain_t
  use pd_flow, only: flow_t
  use pd_kinds, only: i8, n_block, wp
  use pd_mirror, only: mirror_t
  use pd_operator_rows, only: control_stiffness, stress_times_k_inverse, &
    subtract_affine_control, times_k_inverse, weigh_rows
  use pd_relaxing, only: relaxing_t, springs_t
  use pd_storage, only: storage_t
  use pd_stretches, only: stretches_t
  implicit none
  private

  public :: operators_t, control_stiffness

  !> Operators of one body. Fields have n rows, some of which may hold no point.
  type, abstract :: operators_t
    integer :: n = 0                                      !! rows of the fields
    type(storage_t) :: storage                            !! row of every point
    type(domain_t)  :: domain                             !! blocks of rows
    type(mirror_t)  :: mirror                             !! layers that are images of the body
    type(stretches_t) :: stretches                        !! rows in blocks that hold points
    real(wp), allocatable :: weight_sum(:)                !! W_i = sum_j omega V_j (n) [m^2]
    real(wp), allocatable :: k_inverse(:, :)              !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), allocatable :: control(:)                   !! c (n) [N/m^6]; not allocated: none
    integer(i8) :: hidden_bonds = 0_i8                    !! directed, over air or cuts: left out
    logical :: sums_whole_control = .false.               !! Z holds the affine part too
    type(relaxing_t), allocatable :: relaxing             !! not allocated: none
    real(wp), allocatable, private :: force_tensor(:, :)  !! A (n,4), weighed [N/m^6]
    logical :: weighs = .false.                           !! the sums read fields times the share
    real(wp), allocatable :: share_of(:)                  !! V over that of a whole cell (n)
    real(wp), allocatable :: weighed(:, :)                !! share u (n,2) [m]
    real(wp), allocatable :: pull(:, :)                   !! share c u, which Z reads (n,2) [N/m^5]
  contains
    procedure :: take_in, begin_taking_in, finish_taking_in
    procedure :: gradient_block
    procedure :: relax_block
    procedure :: hold_block
    procedure :: hand_over_block
    procedure :: share, begin_sharing, finish_sharing
    procedure :: force_block
    procedure :: set_control
    procedure :: set_relaxing, relaxing_energy
    procedure :: needed_rows, reached_rows
    procedure, private :: residual_sums, weigh_in, weigh_block
    procedure(gradient_of), deferred :: gradient_sums_block
    procedure(divergence_of), deferred :: divergence_sums_block
    procedure(control_of), deferred :: control_sums_block
    procedure(differences_of), deferred :: difference_sums_block
    procedure(residual_weights_of), deferred :: weigh_residuals
    procedure(shape_of), deferred :: shape_tensor
    procedure(zero_energy_of), deferred :: zero_energy_squared
    procedure(bonds_of), deferred :: bonds
    procedure(fewest_of), deferred :: fewest_bonds
    procedure(memory_of), deferred :: memory
  end type operators_t

  abstract interface
    !> G[u] of rows lo to hi. u has been weighed in.
    pure subroutine gradient_of(self, lo, hi, u, g)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(inout), contiguous :: g(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    end subroutine gradient_of
    !> D[A] of rows lo to hi. A has been weighed.
    pure subroutine divergence_of(self, lo, hi, a, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
      real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    end subroutine divergence_of
    !> f <- f + Z[u] for rows lo to hi. u has been weighed in.
    pure subroutine control_of(self, lo, hi, u, f)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    end subroutine control_of
    !> S[x] of rows lo to hi; row 1 of the sums is row lo.
    pure subroutine differences_of(self, lo, hi, x, s)
      import :: n_block, operators_t, wp
      class(operators_t), intent(in) :: self
      integer,  intent(in) :: lo, hi
      real(wp), intent(in), contiguous :: x(:, :)   !! weighed (n,2)
      real(wp), intent(inout) :: s(n_block, 2)      !! out
    end subroutine differences_of
    !> Weights of the sums S, from now on.
    subroutine residual_weights_of(self, falloff)
      import :: operators_t, wp
      class(operators_t), intent(inout) :: self
      real(wp), intent(in) :: falloff               !! [1/m^2]
    end subroutine residual_weights_of
    !> K = sum_j omega V_j xi (x) xi; rows without a point: zero.
    subroutine shape_of(self, k)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: k(:, :)   !! out: (n,3) xx yy xy [m^4]
    end subroutine shape_of
    !> Part of the deformation that H does not see, squared and weighted over the family:
    !> sum_j omega V_j |z|^2 with z = (u_j - u_i) - H_i xi.
    subroutine zero_energy_of(self, u, h, z2)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
      real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
      real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
      real(wp), intent(inout), contiguous :: z2(:)     !! out: (n) [m^4]
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
    !> Memory that the realisation takes beside the fields of this type [bytes].
    pure real(wp) function memory_of(self)
      import :: operators_t, wp
      class(operators_t), intent(in) :: self
    end function memory_of
  end interface

contains

  !> Make u readable for the sums. `moved`: what the planes of mirrors do, absent: nothing.
  subroutine take_in(self, u, moved)
    class(operators_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: u(:, :)   !! (n,2) [m]; its halo is brought up to date
    real(wp), intent(in), optional :: moved(:)       !! along their normals (planes) [m]

    call self%begin_taking_in(u, moved)
    call self%finish_taking_in(u)
  end subroutine take_in

  !> Make u readable for the sums of inner blocks.
  subroutine begin_taking_in(self, u, moved)
    class(operators_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(in), optional :: moved(:)       !! along their normals (planes) [m]

    call self%mirror%reflect_motion(u, moved)
    call self%domain%halo%begin(u)
    call self%weigh_in([self%domain%blocks%first, self%domain%blocks%last], u)
    call self%domain%make_room(self%n, 4, self%force_tensor)   ! rows without a point stay zero
  end subroutine begin_taking_in

  !> Make u readable for the sums of the others.
  subroutine finish_taking_in(self, u)
    class(operators_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: u(:, :)   !! (n,2) [m]; its halo is brought up to date

    call self%domain%halo%finish(u)
    associate (known => self%domain%known, blocks => self%domain%blocks)
      call self%weigh_in([known(1), blocks%first - 1], u)
      call self%weigh_in([blocks%last + 1, known(2)], u)
    end associate
  end subroutine finish_taking_in

  !> Keep u times the share of the points and, for Z, times the stiffness of the control.
  subroutine weigh_in(self, rows, u)
    class(operators_t), intent(inout) :: self
    integer,  intent(in) :: rows(2)               !! first and last
    real(wp), intent(in), contiguous :: u(:, :)   !! (n,2) [m]

    if (rows(2) < rows(1)) return
    if (self%weighs) then
      call self%domain%make_room(self%n, 2, self%weighed)
      call weigh_rows(rows, self%share_of, u, self%weighed)
    end if
    if (allocated(self%pull)) call weigh_rows(rows, self%share_of, u, self%pull, self%control)
  end subroutine weigh_in

  !> A <- A times the share of the points, for rows lo to hi.
  pure subroutine weigh_block(self, lo, hi, a)
    class(operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(inout), contiguous :: a(:, :)   !! (n,4) [N/m^6]
    integer :: i, c

    if (.not. self%weighs) return
    do c = 1, size(a, 2)
      do i = lo, hi
        a(i, c) = self%share_of(i) * a(i, c)
      end do
    end do
  end subroutine weigh_block

  !> H = F - I of rows lo to hi: affine motions are exact at every point.
  pure subroutine gradient_block(self, lo, hi, u, h)
    class(operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]; as taken in
    real(wp), intent(inout), contiguous :: h(:, :)   !! out: (n,4) xx xy yx yy
    integer :: k, rows(2)

    call self%stretches%clear_gaps(lo, hi, h)
    do k = self%stretches%from(lo), self%stretches%to(hi)
      rows = self%stretches%rows(k, lo, hi)
      call self%gradient_sums_block(rows(1), rows(2), u, h)
      call times_k_inverse(rows(1), rows(2), self%k_inverse, h)
    end do
  end subroutine gradient_block

  !> The relaxing control of a block: what it remembers goes from step n to n+1 as the points flow,
  !> and it joins P.
  pure subroutine relax_block(self, block, u, h, flow, memory, p, dissipated)
    class(operators_t), intent(inout) :: self
    integer,      intent(in) :: block
    real(wp),     intent(in), contiguous :: u(:, :)           !! (n,2) [m]; as taken in
    real(wp),     intent(in), contiguous :: h(:, :)           !! H (n,4) xx xy yx yy
    type(flow_t), intent(in) :: flow                          !! of the block
    real(wp),     intent(inout), contiguous :: memory(:, :)   !! of `pd_relaxing` (n,4) [m]
    real(wp),     intent(inout) :: p(n_block, 4)              !! P xx xy yx yy [Pa]
    real(wp),     intent(out)   :: dissipated                 !! by the control in this step [J/m]
    type(springs_t) :: rows
    integer :: lo, hi

    dissipated = 0.0_wp
    if (.not. allocated(self%relaxing)) return
    lo = self%domain%blocks%lo(block)
    hi = self%domain%blocks%hi(block)
    call self%residual_sums(lo, hi, u, rows%sums)
    call self%relaxing%let_go(lo, hi, flow, memory, rows)
    call self%relaxing%join_rows(lo, hi, h, rows, memory, p)
    call self%relaxing%remember(rows, memory, dissipated)
    call self%weigh_block(lo, hi, self%relaxing%pull)
  end subroutine relax_block

  !> The same for a small displacement of a body that has never flowed.
  pure subroutine hold_block(self, block, u, h, p)
    class(operators_t), intent(inout) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: u(:, :)   !! (n,2) [m]; as taken in
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout) :: p(n_block, 4)      !! P xx xy yx yy [Pa]
    type(springs_t) :: rows
    integer :: lo, hi

    if (.not. allocated(self%relaxing)) return
    lo = self%domain%blocks%lo(block)
    hi = self%domain%blocks%hi(block)
    call self%residual_sums(lo, hi, u, rows%sums)
    call self%relaxing%hold_rows(lo, hi, h, rows, p)
    call self%weigh_block(lo, hi, self%relaxing%pull)
  end subroutine hold_block

  !> S[u] of rows lo to hi.
  pure subroutine residual_sums(self, lo, hi, u, s)
    class(operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: u(:, :)   !! (n,2) [m]; as taken in
    real(wp), intent(inout) :: s(n_block, 2)      !! out [m^3]; row 1 is row lo

    if (self%weighs) then
      call self%difference_sums_block(lo, hi, self%weighed, s)
    else
      call self%difference_sums_block(lo, hi, u, s)
    end if
  end subroutine residual_sums

  !> Take the first Piola stress of rows lo to hi, and keep A = P K^-1 - c H.
  pure subroutine hand_over_block(self, lo, hi, h, p)
    class(operators_t), intent(inout) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: p(:, :)   !! P xx xy yx yy [Pa]; row 1 is row lo
    integer :: k, rows(2)

    do k = self%stretches%from(lo), self%stretches%to(hi)
      rows = self%stretches%rows(k, lo, hi)
      call stress_times_k_inverse([lo, rows(1), rows(2)], self%k_inverse, p, self%force_tensor)
    end do
    if (allocated(self%control) .and. .not. self%sums_whole_control) &
      call subtract_affine_control(lo, hi, self%control, h, self%force_tensor)
    call self%weigh_block(lo, hi, self%force_tensor)
  end subroutine hand_over_block

  !> Make A readable for the sums, after the last block has been handed over.
  subroutine share(self)
    class(operators_t), intent(inout) :: self

    call self%begin_sharing()
    call self%finish_sharing()
  end subroutine share

  !> Make A readable for the sums of inner blocks.
  subroutine begin_sharing(self)
    class(operators_t), intent(inout) :: self

    if (allocated(self%relaxing)) then
      call self%domain%halo%begin(self%force_tensor, self%relaxing%pull)
    else
      call self%domain%halo%begin(self%force_tensor)
    end if
  end subroutine begin_sharing

  !> Make A readable for the sums of the others.
  subroutine finish_sharing(self)
    class(operators_t), intent(inout) :: self

    if (allocated(self%relaxing)) then
      call self%domain%halo%finish(self%force_tensor, self%relaxing%pull)
    else
      call self%domain%halo%finish(self%force_tensor)
    end if
  end subroutine finish_sharing

  !> Internal force density of rows lo to hi, the control included.
  pure subroutine force_block(self, lo, hi, u, f)
    class(operators_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]; as taken in
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    real(wp) :: sums(n_block, 2)
    integer  :: k, rows(2)

    call self%stretches%clear_gaps(lo, hi, f)
    do k = self%stretches%from(lo), self%stretches%to(hi)
      rows = self%stretches%rows(k, lo, hi)
      call self%divergence_sums_block(rows(1), rows(2), self%force_tensor, f)
      if (allocated(self%control)) call self%control_sums_block(rows(1), rows(2), u, f)
      if (.not. allocated(self%relaxing)) cycle
      call self%difference_sums_block(rows(1), rows(2), self%relaxing%pull, sums)
      f(rows(1):rows(2), :) = f(rows(1):rows(2), :) - sums(:rows(2) - rows(1) + 1, :)
    end do
  end subroutine force_block

  !> Stiffness of the zero-energy control, from now on.
  subroutine set_control(self, c)
    class(operators_t), intent(inout) :: self
    real(wp), intent(in), contiguous  :: c(:)   !! (n) [N/m^6]; rows without a point: 0

    self%control = c
  end subroutine set_control

  !> The relaxing control, from now on, which goes over; its moments s~ are S[X].
  subroutine set_relaxing(self, relaxing, position)
    class(operators_t), intent(inout) :: self
    type(relaxing_t), allocatable, intent(inout) :: relaxing
    real(wp), intent(in), contiguous  :: position(:, :)   !! X (n,2) [m]
    real(wp), allocatable :: x(:, :)
    real(wp) :: sums(n_block, 2)
    integer  :: block, lo, hi

    call move_alloc(relaxing, self%relaxing)
    call self%weigh_residuals(self%relaxing%falloff)
    call self%domain%make_room(self%n, 2, x)
    lo = self%storage%kept(1)
    hi = self%storage%kept(2)
    x(lo:hi, :) = position(lo:hi, :)
    call self%weigh_block(lo, hi, x)
    !$omp parallel do schedule(static) default(none) shared(self, x) private(block, lo, hi, sums)
    do block = 1, self%domain%blocks%count
      lo = self%domain%blocks%lo(block)
      hi = self%domain%blocks%hi(block)
      call self%difference_sums_block(lo, hi, x, sums)
      self%relaxing%moment(lo:hi, :) = sums(:hi - lo + 1, :)
    end do
    !$omp end parallel do
  end subroutine set_relaxing

  !> Energy stored in the relaxing control [J/m]; 0 without.
  subroutine relaxing_energy(self, memory, energy)
    class(operators_t), intent(in) :: self
    real(wp), intent(in), contiguous :: memory(:, :)   !! (n,4) [m]
    real(wp), intent(out) :: energy
    type(blocks_t) :: blocks
    real(wp), allocatable :: parts(:)
    integer :: block

    energy = 0.0_wp
    if (.not. allocated(self%relaxing)) return
    blocks = self%domain%blocks
    allocate (parts(blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(self, blocks, memory, parts)
    do block = 1, blocks%count
      parts(block) = self%relaxing%stored(blocks%lo(block), blocks%hi(block), memory)
    end do
    !$omp end parallel do
    energy = blocks%total(parts)
  end subroutine relaxing_energy

  !> Rows that the families of rows `first` to `last` read, ascending; none for no rows.
  pure function needed_rows(self, first, last) result(rows)
    class(operators_t), intent(in) :: self
    integer, intent(in)  :: first, last
    integer, allocatable :: rows(:)

    rows = self%storage%around(first, last, self%domain%blocks%ends)
  end function needed_rows

  !> The first and the last of them.
  pure function reached_rows(self, first, last) result(ends)
    class(operators_t), intent(in) :: self
    integer, intent(in) :: first, last
    integer :: ends(2)

    ends = self%storage%reached(first, last, self%domain%blocks%ends)
  end function reached_rows

end module pd_operators
