!> Whose part of N_i: the weights with which the points near the edges of a body carry what acts on
!> each edge.
!>
!> N_i is what a homogeneous stress of 1 leaves on point i (`pd_pressure`). It is divided among the
!> edges in reach,
!>
!>   sum_e w_ie n_e + sum_e r_ie = -N_i      sum_i w_ie = length of e
!>
!> so that tractions P n_e on all edges, carried by w_ie, keep every homogeneous stress P in
!> equilibrium: parts along the normals leave no freedom but among parallel edges, and there the
!> lengths decide. What is left of it goes to the nearest edges: sum w_ie^2 / c_ie least, where c is
!> the closeness of point and edge. r is zero where edges of different directions are in reach, and
!> on edges along the lattice; on others it is the noise of N along the edge.
!> Source: doc/theory.md, section 7.
module pd_edge_weights
  use pd_cells, only: cells_t, largest_neighbourhood, neighbourhood, sort_into_cells
  use pd_edges, only: edge_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: edge_weights_t, find_edge_weights

  !> Pairs of an edge and a point in its reach, edge by edge.
  type :: edge_weights_t
    type(edge_t), allocatable :: edges(:)
    integer,  allocatable :: first(:)          !! pair of every edge (edges + 1)
    integer,  allocatable :: point(:)          !! of a pair
    real(wp), allocatable :: weight(:)         !! w [m]
    real(wp), allocatable :: rest(:, :)        !! r (pairs,2) [m]
    real(wp), allocatable :: length(:)         !! that free points stand for (edges) [m]
    real(wp), allocatable, private :: closeness(:)   !! c > 0 (pairs) [m]
    real(wp), allocatable, private :: normal(:, :)   !! of the edge (pairs,2); where all edges in
                                                     !! reach of a point are nearly parallel, that
                                                     !! of the closest one, there or back
  end type edge_weights_t

  !> The least sine between two edges that counts as two directions.
  real(wp), parameter :: two_directions = 0.3_wp

contains

  !> Divide N among the edges. Points that are held along a normal carry nothing of its edge, and
  !> what is left of N along the components that are held is nobody's.
  subroutine find_edge_weights(edges, position, vectors, free, reach, spacing, weights)
    type(edge_t), intent(in) :: edges(:)
    real(wp),     intent(in) :: position(:, :)   !! X (n,2) [m]
    real(wp),     intent(in) :: vectors(:, :)    !! N (n,2) [m]
    logical,      intent(in) :: free(:, :)       !! components that no boundary takes (n,2)
    real(wp),     intent(in) :: reach            !! of the edges: where N begins to be zero [m]
    real(wp),     intent(in) :: spacing          !! dx [m]
    type(edge_weights_t), intent(out) :: weights
    real(wp), allocatable :: left(:, :)          ! -N without what is held, then without w n
    real(wp), allocatable :: inverse(:, :)       ! of sum_e c n (x) n (n,3) xx yy xy [1/m]
    real(wp), allocatable :: multiplier(:)       ! of the lengths (edges)
    real(wp), allocatable :: slope(:, :)         ! multiplier of N (n,2)
    real(wp), parameter   :: round_off = 1.0e-11_wp
    integer :: e, k

    weights%edges = edges
    call find_pairs(position, free, reach, spacing, weights)
    allocate (left(size(position, 1), 2))
    left = merge(-vectors, 0.0_wp, free)
    call invert_normals(size(position, 1), weights, inverse)
    call find_multipliers(weights, left, inverse, multiplier)
    allocate (slope(size(position, 1), 2))
    call find_slopes(weights, left, inverse, multiplier, slope)
    allocate (weights%weight(size(weights%point)))
    do e = 1, size(edges)
      do k = weights%first(e), weights%first(e + 1) - 1
        associate (i => weights%point(k))
          weights%weight(k) = weights%closeness(k) &
            * (multiplier(e) + dot_product(weights%normal(k, :), slope(i, :)))
          left(i, :) = left(i, :) - weights%weight(k) * edges(e)%normal
        end associate
      end do
    end do
    where (abs(left) <= round_off * spacing) left = 0.0_wp   ! edges along the lattice have none
    call share_rest(weights, left)
  end subroutine find_edge_weights

  !> Points in reach of every edge, with their closeness: the integral of (1 - |x - X|^2/reach^2)^3
  !> over the edge. The part of an edge whose nearest point is held is not in its length.
  subroutine find_pairs(position, free, reach, spacing, weights)
    real(wp), intent(in) :: position(:, :), reach, spacing
    logical,  intent(in) :: free(:, :)
    type(edge_weights_t), intent(inout) :: weights
    type(cells_t) :: cells
    integer,  allocatable :: found(:), number(:), points(:)
    real(wp), allocatable :: close_to(:), values(:)
    integer :: e, n

    call sort_into_cells(position, reach, cells)
    allocate (found(largest_neighbourhood(cells)), points(size(position, 1)))
    allocate (close_to(size(position, 1)), source=0.0_wp)
    allocate (weights%length(size(weights%edges)), weights%first(size(weights%edges) + 1))
    allocate (number(0), values(0))
    weights%first(1) = 1
    do e = 1, size(weights%edges)
      n = 0
      call integrate(weights%edges(e), position, free, reach, spacing)
      number = [number, points(:n)]
      values = [values, close_to(points(:n))]
      close_to(points(:n)) = 0.0_wp
      weights%first(e + 1) = weights%first(e) + n
    end do
    call move_alloc(number, weights%point)
    call move_alloc(values, weights%closeness)

  contains

    subroutine integrate(edge, position, free, reach, spacing)
      type(edge_t), intent(in) :: edge
      real(wp),     intent(in) :: position(:, :), reach, spacing
      logical,      intent(in) :: free(:, :)
      real(wp) :: x(2), piece, part, nearest
      logical  :: nearest_free
      integer  :: k, j, pieces, n_found

      pieces = max(1, ceiling(2.0_wp * edge%length() / spacing - 1.0e-6_wp))
      piece = edge%length() / real(pieces, wp)
      weights%length(e) = 0.0_wp
      do k = 1, pieces
        x = edge%start + (real(k, wp) - 0.5_wp) / real(pieces, wp) * (edge%finish - edge%start)
        call neighbourhood(cells, x, found, n_found)
        nearest = -1.0_wp
        nearest_free = .false.
        do j = 1, n_found
          associate (p => found(j))
            part = 1.0_wp - ((position(p, 1) - x(1))**2 + (position(p, 2) - x(2))**2) / reach**2
            if (part <= 0.0_wp) cycle
            if (part > nearest) nearest_free = carries(edge, free(p, :))
            nearest = max(nearest, part)
            if (.not. carries(edge, free(p, :))) cycle
            if (close_to(p) <= 0.0_wp) then
              n = n + 1
              points(n) = p
            end if
            close_to(p) = close_to(p) + piece * part**3
          end associate
        end do
        if (nearest_free) weights%length(e) = weights%length(e) + piece
      end do
    end subroutine integrate

  end subroutine find_pairs

  !> Whether a point can carry a load along the normal of an edge.
  pure logical function carries(edge, free)
    type(edge_t), intent(in) :: edge
    logical,      intent(in) :: free(:)   !! components
    real(wp), parameter :: round_off = 1.0e-6_wp

    carries = all(free .or. abs(edge%normal) < round_off)
  end function carries

  !> Normals of the pairs, and (sum_e c n (x) n)^-1 of every point; where all edges in reach are
  !> nearly parallel, its inverse along their one direction.
  pure subroutine invert_normals(n, weights, inverse)
    integer,              intent(in)    :: n              !! points
    type(edge_weights_t), intent(inout) :: weights
    real(wp), allocatable, intent(out)  :: inverse(:, :)  !! (n,3) xx yy xy [1/m]
    real(wp), allocatable :: closest(:), normal(:, :), sine(:), m(:, :)
    integer :: e, i, k

    allocate (closest(n), normal(n, 2), sine(n), m(n, 3), source=0.0_wp)
    allocate (weights%normal(size(weights%point), 2))
    do e = 1, size(weights%edges)
      do k = weights%first(e), weights%first(e + 1) - 1
        weights%normal(k, :) = weights%edges(e)%normal
        i = weights%point(k)
        if (weights%closeness(k) <= closest(i)) cycle
        closest(i) = weights%closeness(k)
        normal(i, :) = weights%normal(k, :)
      end do
    end do
    do k = 1, size(weights%point)
      associate (d => weights%normal(k, :), i => weights%point(k))
        sine(i) = max(sine(i), abs(d(1) * normal(i, 2) - d(2) * normal(i, 1)))
      end associate
    end do
    do k = 1, size(weights%point)
      i = weights%point(k)
      if (sine(i) <= two_directions) weights%normal(k, :) = &
        sign(1.0_wp, dot_product(weights%normal(k, :), normal(i, :))) * normal(i, :)
      associate (d => weights%normal(k, :))
        m(i, :) = m(i, :) + weights%closeness(k) * [d(1)**2, d(2)**2, d(1) * d(2)]
      end associate
    end do
    allocate (inverse(n, 3), source=0.0_wp)
    do i = 1, n
      if (closest(i) <= 0.0_wp) cycle
      if (sine(i) > two_directions) then
        inverse(i, :) = [m(i, 2), m(i, 1), -m(i, 3)] / (m(i, 1) * m(i, 2) - m(i, 3)**2)
      else
        inverse(i, :) = [normal(i, 1)**2, normal(i, 2)**2, normal(i, 1) * normal(i, 2)] &
          / (m(i, 1) + m(i, 2))
      end if
    end do
  end subroutine invert_normals

  !> The multipliers of the lengths. Lengths that cannot be had, those of edges that share no point
  !> with a parallel one, are left alone: they are in the null space of the matrix.
  !>
  !> w = c (mu_e + n_e . s_i), s_i = M_i^-1 (-N_i - sum_e c n_e mu_e), with sum_i w = length:
  !>
  !>   sum_i c_ie [mu_e - n_e . M_i^-1 sum_f c_if n_f mu_f]
  !>     = length_e - sum_i c_ie n_e . M_i^-1 (-N_i)
  pure subroutine find_multipliers(weights, left, inverse, multiplier)
    type(edge_weights_t), intent(in) :: weights
    real(wp), intent(in) :: left(:, :), inverse(:, :)
    real(wp), allocatable, intent(out) :: multiplier(:)   !! mu
    real(wp), parameter :: regular = 1.0e-7_wp   ! relative, added to the diagonal
    integer,  parameter :: passes = 4            ! what it changes is taken back
    real(wp), allocatable :: matrix(:, :), factor(:, :), row(:, :), rest(:), zero(:), slope(:, :)
    real(wp), allocatable :: diagonal(:), step(:)
    integer :: e, k, n

    n = size(weights%edges)
    allocate (matrix(n, n), source=0.0_wp)
    allocate (rest, source=weights%length)
    allocate (zero(n), multiplier(n), diagonal(n), source=0.0_wp)
    allocate (slope(size(left, 1), 2))
    allocate (row(size(left, 1), 2), source=0.0_wp)
    call find_slopes(weights, left, inverse, zero, slope)
    do e = 1, n
      associate (a => weights%first(e), b => weights%first(e + 1) - 1)
        do k = a, b
          associate (i => weights%point(k), c => weights%closeness(k), d => weights%normal(k, :))
            rest(e) = rest(e) - c * dot_product(d, slope(i, :))
            row(i, :) = -c * [inverse(i, 1) * d(1) + inverse(i, 3) * d(2), &
              inverse(i, 3) * d(1) + inverse(i, 2) * d(2)]
          end associate
        end do
        call add_products(weights, row, matrix(:, e))
        row(weights%point(a:b), :) = 0.0_wp
        diagonal(e) = sum(weights%closeness(a:b))
        matrix(e, e) = matrix(e, e) + diagonal(e)
      end associate
    end do
    ! what acts on an edge of held points alone is felt by no one
    do e = 1, n
      if (weights%length(e) > 0.0_wp .and. diagonal(e) > 0.0_wp) cycle
      matrix(:, e) = 0.0_wp
      matrix(e, :) = 0.0_wp
      matrix(e, e) = 1.0_wp
      rest(e) = 0.0_wp
    end do
    factor = matrix
    do e = 1, n
      factor(e, e) = factor(e, e) + regular * diagonal(e)
    end do
    call factorise(factor)
    do k = 1, passes
      step = rest - matmul(matrix, multiplier)
      call solve_factorised(factor, step)
      multiplier = multiplier + step
    end do
  end subroutine find_multipliers

  !> Add sum_i c_if n_f . row_i for every edge f.
  pure subroutine add_products(weights, row, sums)
    type(edge_weights_t), intent(in) :: weights
    real(wp), intent(in)    :: row(:, :)
    real(wp), intent(inout) :: sums(:)   !! (edges)
    integer :: f, k

    do f = 1, size(weights%edges)
      do k = weights%first(f), weights%first(f + 1) - 1
        sums(f) = sums(f) + weights%closeness(k) &
          * dot_product(weights%normal(k, :), row(weights%point(k), :))
      end do
    end do
  end subroutine add_products

  !> s_i = M_i^-1 (left_i - sum_e c n_e mu_e)
  pure subroutine find_slopes(weights, left, inverse, multiplier, slope)
    type(edge_weights_t), intent(in) :: weights
    real(wp), intent(in)  :: left(:, :), inverse(:, :), multiplier(:)
    real(wp), intent(out) :: slope(:, :)
    integer :: e, i, k

    slope = left
    do e = 1, size(weights%edges)
      do k = weights%first(e), weights%first(e + 1) - 1
        i = weights%point(k)
        slope(i, :) = slope(i, :) - weights%closeness(k) * multiplier(e) * weights%normal(k, :)
      end do
    end do
    do i = 1, size(slope, 1)
      slope(i, :) = [inverse(i, 1) * slope(i, 1) + inverse(i, 3) * slope(i, 2), &
        inverse(i, 3) * slope(i, 1) + inverse(i, 2) * slope(i, 2)]
    end do
  end subroutine find_slopes

  !> Cholesky's factor of a symmetric, positive matrix, below and on its diagonal.
  pure subroutine factorise(a)
    real(wp), intent(inout) :: a(:, :)
    integer :: k

    do k = 1, size(a, 1)
      a(k:, k) = a(k:, k) - matmul(a(k:, :k - 1), a(k, :k - 1))
      a(k:, k) = a(k:, k) / sqrt(a(k, k))
    end do
  end subroutine factorise

  !> Solve with such a factor; x in the place of b.
  pure subroutine solve_factorised(a, b)
    real(wp), intent(in)    :: a(:, :)
    real(wp), intent(inout) :: b(:)
    integer :: k

    do k = 1, size(b)
      b(k) = (b(k) - dot_product(a(k, :k - 1), b(:k - 1))) / a(k, k)
    end do
    do k = size(b), 1, -1
      b(k) = (b(k) - dot_product(a(k + 1:, k), b(k + 1:))) / a(k, k)
    end do
  end subroutine solve_factorised

  !> What is left of N goes to the edges by their closeness.
  pure subroutine share_rest(weights, left)
    type(edge_weights_t), intent(inout) :: weights
    real(wp),             intent(in)    :: left(:, :)   !! (n,2) [m]
    real(wp), allocatable :: total(:)
    integer :: k

    allocate (total(size(left, 1)), source=0.0_wp)
    allocate (weights%rest(size(weights%point), 2))
    do k = 1, size(weights%point)
      total(weights%point(k)) = total(weights%point(k)) + weights%closeness(k)
    end do
    do k = 1, size(weights%point)
      weights%rest(k, :) = weights%closeness(k) / total(weights%point(k)) &
        * left(weights%point(k), :)
    end do
  end subroutine share_rest

end module pd_edge_weights
