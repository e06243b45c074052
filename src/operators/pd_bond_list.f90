!> The operators as a list of bonds, for any points.
!>
!> The bonds of a point are stored together. Every point gathers its own bonds in a fixed order, so
!> the result has the same bits for any number of threads.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_bond_list
  use pd_cells, only: cells_t, largest_neighbourhood, sort_into_cells
  use pd_domain, only: new_domain
  use pd_errors, only: error_list_t
  use pd_families, only: family, horizon_t, influence
  use pd_kinds, only: i8, n_block, wp
  use pd_operators, only: operators_t
  use pd_room, only: has_room
  use pd_sight, only: sight_t
  use pd_storage, only: listed_storage
  use pd_stretches, only: new_stretches
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: bond_list_t, new_bond_list

  !> Bond list of all points, with the weights that belong to the bonds.
  type, extends(operators_t) :: bond_list_t
    integer(i8), allocatable :: first(:)      !! first bond of point i (n+1)
    integer,     allocatable :: neighbour(:)  !! j (bonds)
    real(wp),    allocatable :: wx(:), wy(:)  !! omega V_j xi (bonds) [m^3]
    real(wp),    allocatable :: weight(:)     !! omega V_j (bonds) [m^2]
    real(wp),    allocatable, private :: residual_weight(:)   !! w~ (bonds) [m^2]
    real(wp),    allocatable :: position(:, :)  !! X (n,2) [m]
  contains
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
    procedure :: needed_rows, reached_rows
  end type bond_list_t

contains

  !> Find all families and weigh their bonds.
  !>
  !> Errors: two points coincide; the first few are reported with their positions.
  subroutine new_bond_list(horizon, position, volume, operators, errors, sight)
    type(horizon_t),    intent(in)    :: horizon
    real(wp),           intent(in)    :: position(:, :)  !! X (n,2) [m]
    real(wp),           intent(in)    :: volume(:)       !! V (n) [m^2]
    type(bond_list_t),  intent(out)   :: operators
    type(error_list_t), intent(inout) :: errors
    type(sight_t), optional, intent(in) :: sight         !! absent: bonds cross air
    type(cells_t) :: cells
    integer, allocatable :: members(:)
    integer :: i, n, n_members, most
    integer(i8) :: n_hidden

    n = size(position, 1)
    operators%n = n
    operators%storage = listed_storage(n)
    operators%domain = new_domain(1, n)
    operators%stretches = new_stretches(operators%domain%blocks, spread(1.0_wp, 1, n))
    allocate (operators%position(n, 2), source=position)
    call sort_into_cells(position, horizon%delta, cells)
    most = largest_neighbourhood(cells)
    allocate (operators%first(n + 1))

    operators%first(1) = 1
    n_hidden = 0_i8
    !$omp parallel default(none) shared(n, most, horizon, cells, position, operators, sight) &
    !$omp private(i, n_members, members) reduction(+:n_hidden)
    allocate (members(most))
    !$omp do schedule(static)
    do i = 1, n
      call family(horizon, cells, position, i, members, n_members)
      n_hidden = n_hidden + int(n_members, i8)
      if (present(sight)) call sight%leave_out_hidden(i, members, n_members)
      n_hidden = n_hidden - int(n_members, i8)
      operators%first(i + 1) = int(n_members, i8)
    end do
    !$omp end do
    deallocate (members)
    !$omp end parallel

    do i = 2, n + 1
      operators%first(i) = operators%first(i) + operators%first(i - 1)
    end do
    operators%hidden_bonds = n_hidden
    call weigh_bonds(horizon, cells, position, volume, operators, errors, sight)
    if (.not. allocated(operators%weight_sum)) return
    call report_coincident(operators, position, errors)
  end subroutine new_bond_list

  !> Fill the bond list, whose length is known already.
  subroutine weigh_bonds(horizon, cells, position, volume, operators, errors, sight)
    type(horizon_t),   intent(in)    :: horizon
    type(cells_t),     intent(in)    :: cells
    real(wp),          intent(in)    :: position(:, :), volume(:)
    type(bond_list_t), intent(inout) :: operators
    type(error_list_t), intent(inout) :: errors
    type(sight_t), optional, intent(in) :: sight
    integer, allocatable :: members(:)
    integer     :: i, j, k, n, n_members, most
    integer(i8) :: b, n_bonds
    character(24) :: size_text
    real(wp)    :: xi(2), weight

    n = operators%n
    most = largest_neighbourhood(cells)
    n_bonds = operators%first(n + 1) - 1
    if (.not. has_room(28.0_wp * real(n_bonds, wp))) then
      write (size_text, '(f0.1,a)') 28.0e-9_wp * real(n_bonds, wp), ' GB'
      call errors%add('the bonds do not fit into memory', found=trim(size_text), &
        allowed='less than this machine has: a smaller horizon or a larger spacing')
      return
    end if
    allocate (operators%neighbour(n_bonds), operators%wx(n_bonds), operators%wy(n_bonds), &
      operators%weight(n_bonds), operators%weight_sum(n))

    !$omp parallel default(none) &
    !$omp shared(n, most, horizon, cells, position, volume, operators, sight) &
    !$omp private(i, j, k, b, n_members, members, xi, weight)
    allocate (members(most))
    !$omp do schedule(static)
    do i = 1, n
      call family(horizon, cells, position, i, members, n_members)
      if (present(sight)) call sight%leave_out_hidden(i, members, n_members)
      operators%weight_sum(i) = 0.0_wp
      do k = 1, n_members
        j = members(k)
        b = operators%first(i) + k - 1
        xi(1) = position(j, 1) - position(i, 1)
        xi(2) = position(j, 2) - position(i, 2)
        weight = influence(horizon, xi(1)**2 + xi(2)**2) * volume(j)
        operators%neighbour(b) = j
        operators%wx(b) = weight * xi(1)
        operators%wy(b) = weight * xi(2)
        operators%weight(b) = weight
        operators%weight_sum(i) = operators%weight_sum(i) + weight
      end do
    end do
    !$omp end do
    deallocate (members)
    !$omp end parallel
  end subroutine weigh_bonds

  !> Report points that coincide: closer than 1e-9 of the extent of the body.
  subroutine report_coincident(operators, position, errors)
    type(bond_list_t),  intent(in)    :: operators
    real(wp),           intent(in)    :: position(:, :)
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_reported = 10
    real(wp)      :: scale, distance
    integer       :: i, j, n_found
    integer(i8)   :: b

    scale = maxval(maxval(position, dim=1) - minval(position, dim=1))
    n_found = 0
    do i = 1, operators%n
      do b = operators%first(i), operators%first(i + 1) - 1
        j = operators%neighbour(b)
        if (j < i) cycle
        distance = abs(position(j, 1) - position(i, 1)) + abs(position(j, 2) - position(i, 2))
        if (distance > 1.0e-9_wp * scale) cycle
        n_found = n_found + 1
        if (n_found > most_reported) cycle
        call errors%add('points '//integer_text(i)//' and '//integer_text(j)//' coincide at ('// &
          number_text(position(i, 1))//', '//number_text(position(i, 2))//') m')
      end do
    end do
    if (n_found > most_reported) then
      call errors%add(integer_text(n_found - most_reported)//' more pairs of points coincide')
    end if
  end subroutine report_coincident

  !> G[u] of rows lo to hi: g = sum_j omega V_j (u_j - u_i) (x) xi.
  pure subroutine gradient_sums_block(self, lo, hi, u, g)
    class(bond_list_t), intent(in)  :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: g(:, :)   !! out: (n,4) xx xy yx yy [m^4]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: dx, dy, hxx, hxy, hyx, hyy

    do i = lo, hi
      hxx = 0.0_wp
      hxy = 0.0_wp
      hyx = 0.0_wp
      hyy = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        dx = u(j, 1) - u(i, 1)
        dy = u(j, 2) - u(i, 2)
        hxx = hxx + dx * self%wx(b)
        hxy = hxy + dx * self%wy(b)
        hyx = hyx + dy * self%wx(b)
        hyy = hyy + dy * self%wy(b)
      end do
      g(i, 1) = hxx
      g(i, 2) = hxy
      g(i, 3) = hyx
      g(i, 4) = hyy
    end do
  end subroutine gradient_sums_block

  !> D[A] of rows lo to hi: f = sum_j omega V_j (A_i + A_j) xi.
  pure subroutine divergence_sums_block(self, lo, hi, a, f)
    class(bond_list_t), intent(in)  :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy

    do i = lo, hi
      fx = 0.0_wp
      fy = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        fx = fx + (a(i, 1) + a(j, 1)) * self%wx(b) + (a(i, 2) + a(j, 2)) * self%wy(b)
        fy = fy + (a(i, 3) + a(j, 3)) * self%wx(b) + (a(i, 4) + a(j, 4)) * self%wy(b)
      end do
      f(i, 1) = fx
      f(i, 2) = fy
    end do
  end subroutine divergence_sums_block

  !> f <- f + Z[u] for rows lo to hi: the bond part of the zero-energy control.
  pure subroutine control_sums_block(self, lo, hi, u, f)
    class(bond_list_t), intent(in)    :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: f(:, :)   !! (n,2) [N/m^3]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy, weight

    do i = lo, hi
      fx = 0.0_wp
      fy = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        weight = self%weight(b) * (self%control(i) + self%control(j))
        fx = fx + weight * (u(j, 1) - u(i, 1))
        fy = fy + weight * (u(j, 2) - u(i, 2))
      end do
      f(i, 1) = f(i, 1) + fx
      f(i, 2) = f(i, 2) + fy
    end do
  end subroutine control_sums_block

  !> S[x] of rows lo to hi: s = sum_j w~_ij (x_j - x_i).
  pure subroutine difference_sums_block(self, lo, hi, x, s)
    class(bond_list_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: x(:, :)   !! (n,2)
    real(wp), intent(inout) :: s(n_block, 2)      !! out; row 1 is row lo
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: sx, sy

    do i = lo, hi
      sx = 0.0_wp
      sy = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        sx = sx + self%residual_weight(b) * (x(j, 1) - x(i, 1))
        sy = sy + self%residual_weight(b) * (x(j, 2) - x(i, 2))
      end do
      s(i - lo + 1, 1) = sx
      s(i - lo + 1, 2) = sy
    end do
  end subroutine difference_sums_block

  !> w~ = omega V_j (1 - falloff |xi|^2) of all bonds.
  subroutine weigh_residuals(self, falloff)
    class(bond_list_t), intent(inout) :: self
    real(wp),           intent(in)    :: falloff   !! [1/m^2]
    integer     :: i, j
    integer(i8) :: b

    if (.not. allocated(self%residual_weight)) allocate (self%residual_weight(self%bonds()))
    !$omp parallel do schedule(static) default(none) private(i, j, b) shared(self, falloff)
    do i = 1, self%n
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        self%residual_weight(b) = self%weight(b) * (1.0_wp - falloff &
          * ((self%position(j, 1) - self%position(i, 1))**2 &
          + (self%position(j, 2) - self%position(i, 2))**2))
      end do
    end do
    !$omp end parallel do
  end subroutine weigh_residuals

  !> K = sum_j omega V_j xi (x) xi.
  subroutine shape_tensor(self, k)
    class(bond_list_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: k(:, :)   !! out: (n,3) xx yy xy [m^4]
    real(wp), allocatable :: h(:, :)
    integer :: lo

    ! the gradient of X: an affine map is then exact whatever the round-off of the sums
    allocate (h(self%n, 4))
    !$omp parallel do schedule(static) default(none) shared(self, h) private(lo)
    do lo = 1, self%n, n_block
      call self%gradient_sums_block(lo, min(lo + n_block - 1, self%n), self%position, h)
    end do
    !$omp end parallel do
    k(:, 1) = h(:, 1)
    k(:, 2) = h(:, 4)
    k(:, 3) = h(:, 2)
  end subroutine shape_tensor

  !> Part of the deformation that H does not see, squared and weighted over the family.
  subroutine zero_energy_squared(self, u, h, z2)
    class(bond_list_t), intent(in) :: self
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(in),    contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)     !! out: (n) [m^4]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: xi(2), z(2)

    !$omp parallel do schedule(static) default(none) private(i, j, b, xi, z) &
    !$omp shared(self, u, h, z2)
    do i = self%domain%blocks%first, self%domain%blocks%last
      z2(i) = 0.0_wp
      associate (x => self%position)
        do b = self%first(i), self%first(i + 1) - 1
          j = self%neighbour(b)
          xi(1) = x(j, 1) - x(i, 1)
          xi(2) = x(j, 2) - x(i, 2)
          z(1) = u(j, 1) - u(i, 1) - h(i, 1) * xi(1) - h(i, 2) * xi(2)
          z(2) = u(j, 2) - u(i, 2) - h(i, 3) * xi(1) - h(i, 4) * xi(2)
          z2(i) = z2(i) + self%weight(b) * (z(1)**2 + z(2)**2)
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine zero_energy_squared

  !> Number of directed bonds.
  pure integer(i8) function bonds(self)
    class(bond_list_t), intent(in) :: self

    bonds = self%first(self%n + 1) - 1
  end function bonds

  !> Fewest bonds of any point, and the first point that has so few.
  pure subroutine fewest_bonds(self, fewest, point)
    class(bond_list_t), intent(in)  :: self
    integer,            intent(out) :: fewest, point
    integer :: i

    fewest = huge(1)
    point = 0
    do i = 1, self%n
      if (self%first(i + 1) - self%first(i) >= int(fewest, i8)) cycle
      fewest = int(self%first(i + 1) - self%first(i))
      point = i
    end do
  end subroutine fewest_bonds

  !> Memory that the operators take [bytes].
  pure real(wp) function memory(self)
    class(bond_list_t), intent(in) :: self

    memory = real(self%bonds(), wp) * 28.0_wp + real(self%n, wp) * 32.0_wp
    if (allocated(self%control)) memory = memory + real(self%n, wp) * 8.0_wp
    if (allocated(self%relaxing)) &
      memory = memory + real(self%bonds(), wp) * 8.0_wp + real(self%n, wp) * 64.0_wp
  end function memory

  !> Rows that the families of rows `first` to `last` read.
  pure function needed_rows(self, first, last) result(rows)
    class(bond_list_t), intent(in) :: self
    integer, intent(in)  :: first, last
    integer, allocatable :: rows(:)
    logical, allocatable :: needed(:)
    integer :: i

    allocate (needed(self%n), source=.false.)
    do i = first, last
      needed(self%neighbour(self%first(i):self%first(i + 1) - 1)) = .true.
    end do
    rows = pack([(i, i=1, self%n)], needed)
  end function needed_rows

  !> The first and the last of them.
  pure function reached_rows(self, first, last) result(ends)
    class(bond_list_t), intent(in) :: self
    integer, intent(in) :: first, last
    integer :: ends(2)

    associate (neighbours => self%neighbour(self%first(first):self%first(last + 1) - 1))
      ends = [minval(neighbours), maxval(neighbours)]
    end associate
  end function reached_rows

end module pd_bond_list
