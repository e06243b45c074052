!> Weights for points off a lattice, found at set-up, with which a homogeneous stress is in balance.
!>
!> A stress P that is the same everywhere leaves the force density P N_i on point i:
!>
!>   N_i = sum_j V_j (g_ij - g_ji)        g_ij = omega K_i^-1 xi: the plain weights
!>
!> On a lattice N = 0 where families are whole. Elsewhere the plain weights are changed by as little
!> as possible, sum_ij V_i V_j |e_ij|^2 / omega least, so that affine motions stay exact and N
!> becomes T: zero inside; near a free surface N itself, smoothed along the surface, for its noise
!> would load a surface that is free. Lagrange's multipliers are then a field lambda,
!>
!>   e_ij = omega z_ij[lambda]            z_ij[x] = x_j - x_i - H_i[x] xi
!>   sum_j omega V_j (z_ij[lambda] - z_ji[lambda]) = T_i - N_i
!>
!> which is the control of zero-energy modes with the stiffness 1: self-adjoint, never positive.
!> Conjugate gradients find lambda. Points of boundaries have lambda = 0, and their N, which only
!> reactions feel, takes up what there is to take.
!> Source: doc/theory.md, section 4; Chen, Hillman & Rueter (2013).
module pd_balance
  use pd_balanced_list, only: balanced_list_t, new_balanced_list, residual_sums_block
  use pd_bond_list, only: bond_list_t
  use pd_kinds, only: block_sum, i8, n_block, wp
  use pd_long_waves, only: long_waves_t, new_long_waves, probes
  use pd_operators, only: operators_t
  use pd_surface, only: find_bare_points, find_near, find_two_families_near, smooth_along_surface
  implicit none
  private

  public :: balance_t, look_for_balance, balance_list, left_by_unit_stress

  !> |N_i| sqrt(V_i) that counts as none; 1 at a straight surface.
  real(wp), parameter :: none = 1.0e-10_wp, tolerance = 1.0e-11_wp
  !> How often what is left near a surface is spread over families.
  integer, parameter :: passes = 2

  !> Points of a cloud by where they are, and what is unbalanced inside: largest |N_i| sqrt(V_i).
  type :: balance_t
    logical, allocatable :: in_body(:)   !! not of a boundary (n)
    logical, allocatable :: zone(:)      !! near a free surface (n)
    real(wp) :: before = -1.0_wp         !! of the plain weights; below 0: nothing is inside
    real(wp) :: after = -1.0_wp          !! of the balanced ones; below 0: there are none
    integer  :: iterations = 0
  contains
    procedure :: needed
  end type balance_t

contains

  !> Whether the plain weights leave something.
  pure logical function needed(self)
    class(balance_t), intent(in) :: self

    needed = self%before > none
  end function needed

  !> Find the surface, and what the plain weights leave inside. Inside is what is more than two
  !> families from bare points or, where there is no such point, what is not near them.
  subroutine look_for_balance(list, volume, delta, in_body, balance)
    type(bond_list_t), intent(inout) :: list        !! with its K^-1
    real(wp),          intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp),          intent(in)    :: delta       !! horizon [m]
    logical,           intent(in)    :: in_body(:)  !! not of a boundary (n)
    type(balance_t),   intent(out)   :: balance
    logical,  allocatable :: bare(:), near(:)
    real(wp), allocatable :: n(:, :)

    allocate (bare(list%n), near(list%n), balance%zone(list%n), n(list%n, 2))
    balance%in_body = in_body
    call find_bare_points(list, bare)
    call find_near(list, volume, delta, bare .and. in_body, balance%zone)
    balance%zone = balance%zone .and. in_body
    call find_two_families_near(list, bare, near)
    near = near .or. .not. in_body
    if (all(near)) near = balance%zone .or. .not. in_body
    if (all(near)) return
    call left_by_unit_stress(list, n)
    balance%before = largest_of(n, volume, .not. near)
  end subroutine look_for_balance

  !> Find lambda, and with it the balanced list.
  subroutine balance_list(list, volume, delta, balance, balanced)
    type(bond_list_t),     intent(inout) :: list
    real(wp),              intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp),              intent(in)    :: delta     !! horizon [m]
    type(balance_t),       intent(inout) :: balance
    type(balanced_list_t), intent(out)   :: balanced
    real(wp), allocatable :: lambda(:, :), rest(:, :), left(:, :)
    logical,  allocatable :: moves(:)
    integer :: k

    allocate (lambda(list%n, 2), source=0.0_wp)
    allocate (rest(list%n, 2), left(list%n, 2))
    call left_by_unit_stress(list, left)
    associate (inside => balance%in_body .and. .not. balance%zone)
      ! what is unbalanced inside goes to the surface and the boundaries; N there is smoothed then
      rest = left
      call solve(list, volume, delta, inside, lambda, rest, balance%iterations)
      call residual_force(list, lambda, rest)
      left = left + rest
      rest = left
      where (spread(.not. balance%zone, 2, 2)) rest = 0.0_wp
      do k = 1, passes
        call smooth_along_surface(list, volume, delta, balance%zone, rest)
      end do
      rest = left - rest
      moves = balance%in_body
      call hold_free_pieces(list, moves)
      call solve(list, volume, delta, moves, lambda, rest, balance%iterations)
      call new_balanced_list(list, lambda, balanced)
      call left_by_unit_stress(balanced, left)
      balance%after = largest_of(left, volume, inside)
    end associate
  end subroutine balance_list

  !> Take three points out of the mask in every piece of the body that is wholly in it: an affine
  !> lambda does nothing. If all others have what they should, so have these, for sum and first
  !> moments of N are given.
  subroutine hold_free_pieces(list, mask)
    type(bond_list_t), intent(in)    :: list
    logical,           intent(inout) :: mask(:)   !! (n)
    integer, allocatable :: piece(:)
    integer  :: i, n
    real(wp) :: arm(2)

    allocate (piece(list%n), source=0)
    n = 0
    do i = 1, list%n
      if (piece(i) > 0) cycle
      n = n + 1
      call mark_piece(list, i, n, piece)
      if (.not. all(mask .or. piece /= n)) cycle
      associate (x => list%position)
        mask(i) = .false.
        ! the point farthest from it, and that farthest from the line between the two
        arm = x(farthest((x(:, 1) - x(i, 1))**2 + (x(:, 2) - x(i, 2))**2), :) - x(i, :)
        mask(farthest((x(:, 1) - x(i, 1))**2 + (x(:, 2) - x(i, 2))**2)) = .false.
        mask(farthest(abs((x(:, 1) - x(i, 1)) * arm(2) - (x(:, 2) - x(i, 2)) * arm(1)))) = .false.
      end associate
    end do

  contains

    !> The point of piece n where a number is largest.
    integer function farthest(number)
      real(wp), intent(in) :: number(:)

      farthest = maxloc(number, dim=1, mask=piece == n)
    end function farthest

  end subroutine hold_free_pieces

  !> Give a number to all points that are tied to point i through bonds.
  subroutine mark_piece(list, i, number, piece)
    type(bond_list_t), intent(in)    :: list
    integer,           intent(in)    :: i, number
    integer,           intent(inout) :: piece(:)   !! 0: not marked yet (n)
    integer, allocatable :: found(:)
    integer     :: j, k, n_found
    integer(i8) :: b

    allocate (found(list%n))
    found(1) = i
    n_found = 1
    piece(i) = number
    k = 0
    do while (k < n_found)
      k = k + 1
      do b = list%first(found(k)), list%first(found(k) + 1) - 1
        j = list%neighbour(b)
        if (piece(j) > 0) cycle
        piece(j) = number
        n_found = n_found + 1
        found(n_found) = j
      end do
    end do
  end subroutine mark_piece

  !> Largest |N_i| sqrt(V_i) of some points.
  pure real(wp) function largest_of(n, volume, mask) result(largest)
    real(wp), intent(in) :: n(:, :)     !! (n,2) [1/m]
    real(wp), intent(in) :: volume(:)   !! V (n) [m^2]
    logical,  intent(in) :: mask(:)

    largest = maxval(norm2(n, dim=2) * sqrt(volume), mask=mask)
  end function largest_of

  !> N_i: the force density of a stress of 1, without control. Rows without a point: 0.
  subroutine left_by_unit_stress(operators, n)
    class(operators_t), intent(inout) :: operators
    real(wp),           intent(inout), contiguous :: n(:, :)   !! out: N (n,2) [1/m]
    real(wp), allocatable :: u(:, :), h(:, :)
    real(wp) :: p(n_block, 4)
    integer  :: block, lo

    allocate (u(size(n, 1), 2), h(size(n, 1), 4), source=0.0_wp)
    p(:, [1, 4]) = 1.0_wp
    p(:, [2, 3]) = 0.0_wp
    call operators%take_in(u)
    do block = 1, operators%domain%blocks%count
      lo = operators%domain%blocks%lo(block)
      call operators%hand_over_block(lo, operators%domain%blocks%hi(block), h, p)
    end do
    call operators%share()
    do block = 1, operators%domain%blocks%count
      call operators%force_block(operators%domain%blocks%lo(block), &
        operators%domain%blocks%hi(block), u, n)
    end do
    call operators%mirror%hand_back(n)
  end subroutine left_by_unit_stress

  !> Add to lambda, at some points, what makes N there smaller by `rest`. Conjugate gradients in the
  !> inner product weighted with V; for a preconditioner 1 / (2 W) and the answer in long waves.
  !> They end when |rest_i| sqrt(V_i) is below the tolerance everywhere, or after so many steps that
  !> they have failed.
  subroutine solve(list, volume, delta, mask, lambda, rest, iterations)
    type(bond_list_t), intent(in)    :: list
    real(wp),          intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp),          intent(in)    :: delta                !! horizon [m]
    logical,           intent(in)    :: mask(:)              !! where (n)
    real(wp),          intent(inout), contiguous :: lambda(:, :)   !! (n,2) [1/m^3]
    real(wp),          intent(inout), contiguous :: rest(:, :)     !! (n,2) [1/m]
    integer,           intent(inout) :: iterations           !! of all solutions
    integer, parameter :: most = 5000
    real(wp), allocatable :: way(:, :), image(:, :), scaled(:, :), scale(:)
    type(long_waves_t) :: waves
    real(wp) :: length, product_now, product_before
    integer  :: k

    if (.not. any(mask)) return
    allocate (way(list%n, 2), image(list%n, 2), scaled(list%n, 2), scale(list%n))
    call find_long_waves(list, volume, delta, mask, waves)
    scale = merge(0.5_wp / list%weight_sum, 0.0_wp, mask)
    where (spread(.not. mask, 2, 2)) rest = 0.0_wp
    way = 0.0_wp
    product_before = 1.0_wp
    do k = 1, most
      if (largest_of(rest, volume, mask) <= tolerance) return
      iterations = iterations + 1
      scaled = spread(scale, 2, 2) * rest
      call waves%correct(rest, scaled)
      product_now = inner_product(list, volume, rest, scaled)
      way = scaled + product_now / product_before * way
      product_before = product_now
      call residual_force(list, way, image)
      where (spread(.not. mask, 2, 2)) image = 0.0_wp
      length = -product_now / inner_product(list, volume, way, image)
      lambda = lambda + length * way
      rest = rest + length * image
    end do
  end subroutine solve

  !> The control with stiffness 1, seen by long waves. It reaches two horizons far.
  subroutine find_long_waves(list, volume, delta, mask, waves)
    type(bond_list_t),  intent(in)  :: list
    real(wp),           intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp),           intent(in)  :: delta                  !! horizon [m]
    logical,            intent(in)  :: mask(:)                !! points that may move (n)
    type(long_waves_t), intent(out) :: waves
    real(wp), parameter :: two_horizons = 2.001_wp   ! and the tolerance of a horizon
    real(wp), allocatable :: field(:, :), image(:, :)
    integer :: k

    allocate (field(list%n, 2), image(list%n, 2))
    waves = new_long_waves(list%position, volume, mask, two_horizons * delta)
    do k = 1, probes
      call waves%probe(k, field)
      call residual_force(list, field, image)
      image = -image
      call waves%take_image(k, image)
    end do
    call waves%factorise()
  end subroutine find_long_waves

  !> The force of the control with stiffness 1: sum_j omega V_j (z_ij - z_ji).
  subroutine residual_force(list, x, f)
    type(bond_list_t), intent(in)    :: list
    real(wp),          intent(in),    contiguous :: x(:, :)   !! (n,2)
    real(wp),          intent(inout), contiguous :: f(:, :)   !! out: (n,2)
    real(wp), allocatable :: h(:, :), one(:)
    integer :: block, lo, hi

    allocate (h(list%n, 4))
    allocate (one(list%n), source=1.0_wp)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi) shared(list, x, h)
    do block = 1, list%domain%blocks%count
      lo = list%domain%blocks%lo(block)
      hi = list%domain%blocks%hi(block)
      call list%gradient_block(lo, hi, x, h)
    end do
    !$omp end parallel do
    !$omp parallel do schedule(static) default(none) private(block, lo, hi) &
    !$omp shared(list, x, h, f, one)
    do block = 1, list%domain%blocks%count
      lo = list%domain%blocks%lo(block)
      hi = list%domain%blocks%hi(block)
      f(lo:hi, :) = 0.0_wp
      call residual_sums_block(list, lo, hi, one, x, h, f)
    end do
    !$omp end parallel do
  end subroutine residual_force

  !> sum V a . b, block by block: the same bits for any number of threads.
  real(wp) function inner_product(list, volume, a, b) result(total)
    type(bond_list_t), intent(in) :: list
    real(wp),          intent(in), contiguous :: volume(:)         !! V (n) [m^2]
    real(wp),          intent(in), contiguous :: a(:, :), b(:, :)  !! (n,2)
    real(wp), allocatable :: parts(:)
    real(wp) :: terms(n_block)
    integer  :: block, lo, hi

    allocate (parts(list%domain%blocks%count))
    do block = 1, list%domain%blocks%count
      lo = list%domain%blocks%lo(block)
      hi = list%domain%blocks%hi(block)
      terms = 0.0_wp
      terms(:hi - lo + 1) = volume(lo:hi) * (a(lo:hi, 1) * b(lo:hi, 1) + a(lo:hi, 2) * b(lo:hi, 2))
      parts(block) = block_sum(terms)
    end do
    total = list%domain%blocks%total(parts)
  end function inner_product

end module pd_balance
