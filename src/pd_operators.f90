!> The non-local operators over all families:
!>
!>   gradient    G[u]_i = sum_j omega V_j (u_j - u_i) (x) xi
!>   divergence  D[A]_i = sum_j omega V_j (A_i + A_j) xi
!>   control     Z[u]_i = sum_j omega V_j (c_i + c_j) (u_j - u_i)
!>
!> The only module that knows how bonds are stored: here, as a list in which the bonds of a point
!> stand together. Every point gathers its own bonds in a fixed order, so the result has the
!> same bits for any number of threads.
!> Source: doc/theory.md, sections 2, 4 and 5.
module pd_operators
  use pd_cells, only: cells_t, largest_neighbourhood, sort_into_cells
  use pd_errors, only: error_list_t
  use pd_families, only: family, horizon_t, influence
  use pd_kinds, only: i8, wp
  implicit none
  private

  public :: operators_t, new_operators

  !> Bond list of all points, with the weights that belong to the bonds.
  type :: operators_t
    integer :: n = 0                                   !! points
    real(wp), allocatable :: weight_sum(:)             !! W_i = sum_j omega V_j (n) [m^2]
    integer(i8), allocatable, private :: first(:)      !! first bond of point i (n+1)
    integer,     allocatable, private :: neighbour(:)  !! j (bonds)
    real(wp),    allocatable, private :: wx(:), wy(:)  !! omega V_j xi (bonds) [m^3]
    real(wp),    allocatable, private :: weight(:)     !! omega V_j (bonds) [m^2]
  contains
    procedure :: gradient
    procedure :: divergence
    procedure :: add_control
    procedure :: zero_energy_squared
    procedure :: bonds
    procedure :: fewest_bonds
    procedure :: memory
  end type operators_t

contains

  !> Find all families and weigh their bonds.
  !>
  !> Errors: two points in one place; the first few are named with their positions.
  subroutine new_operators(horizon, position, volume, operators, errors)
    type(horizon_t),    intent(in)    :: horizon
    real(wp),           intent(in)    :: position(:, :)  !! X (n,2) [m]
    real(wp),           intent(in)    :: volume(:)       !! V (n) [m^2]
    type(operators_t),  intent(out)   :: operators
    type(error_list_t), intent(inout) :: errors
    type(cells_t) :: cells
    integer, allocatable :: members(:)
    integer :: i, n, n_members, most

    n = size(position, 1)
    operators%n = n
    call sort_into_cells(position, horizon%delta, cells)
    most = largest_neighbourhood(cells)
    allocate (operators%first(n + 1))

    operators%first(1) = 1
    !$omp parallel default(none) shared(n, most, horizon, cells, position, operators) &
    !$omp private(i, n_members, members)
    allocate (members(most))
    !$omp do schedule(static)
    do i = 1, n
      call family(horizon, cells, position, i, members, n_members)
      operators%first(i + 1) = int(n_members, i8)
    end do
    !$omp end do
    deallocate (members)
    !$omp end parallel

    do i = 2, n + 1
      operators%first(i) = operators%first(i) + operators%first(i - 1)
    end do
    call weigh_bonds(horizon, cells, position, volume, operators)
    call report_coincident(operators, position, errors)
  end subroutine new_operators

  !> Fill the bond list, whose places are already counted.
  subroutine weigh_bonds(horizon, cells, position, volume, operators)
    type(horizon_t),   intent(in)    :: horizon
    type(cells_t),     intent(in)    :: cells
    real(wp),          intent(in)    :: position(:, :), volume(:)
    type(operators_t), intent(inout) :: operators
    integer, allocatable :: members(:)
    integer     :: i, j, k, n, n_members, most
    integer(i8) :: b, n_bonds
    real(wp)    :: xi(2), weight

    n = operators%n
    most = largest_neighbourhood(cells)
    n_bonds = operators%first(n + 1) - 1
    allocate (operators%neighbour(n_bonds), operators%wx(n_bonds), operators%wy(n_bonds), &
      operators%weight(n_bonds), operators%weight_sum(n))

    !$omp parallel default(none) shared(n, most, horizon, cells, position, volume, operators) &
    !$omp private(i, j, k, b, n_members, members, xi, weight)
    allocate (members(most))
    !$omp do schedule(static)
    do i = 1, n
      call family(horizon, cells, position, i, members, n_members)
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

  !> Two points nearer than 1e-9 of the extent of the body stand in one place.
  subroutine report_coincident(operators, position, errors)
    type(operators_t),  intent(in)    :: operators
    real(wp),           intent(in)    :: position(:, :)
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_reported = 10
    character(96) :: text
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
        write (text, '(a,i0,a,i0,a,g0.7,a,g0.7,a)') 'points ', i, ' and ', j, &
          ' stand in one place, (', position(i, 1), ', ', position(i, 2), ') m'
        call errors%add(trim(text))
      end do
    end do
    if (n_found > most_reported) then
      write (text, '(i0,a)') n_found - most_reported, ' more pairs of points stand in one place'
      call errors%add(trim(text))
    end if
  end subroutine report_coincident

  !> G[u]: h = sum_j omega V_j (u_j - u_i) (x) xi.
  subroutine gradient(self, u, h)
    class(operators_t), intent(in)  :: self
    real(wp),           intent(in)  :: u(:, :)   !! (n,2) [m]
    real(wp),           intent(out) :: h(:, :)   !! (n,4) xx xy yx yy [m^4]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: dx, dy, hxx, hxy, hyx, hyy

    !$omp parallel do schedule(static) default(none) shared(self, u, h) &
    !$omp private(i, j, b, dx, dy, hxx, hxy, hyx, hyy)
    do i = 1, self%n
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
      h(i, 1) = hxx
      h(i, 2) = hxy
      h(i, 3) = hyx
      h(i, 4) = hyy
    end do
    !$omp end parallel do
  end subroutine gradient

  !> D[A]: f = sum_j omega V_j (A_i + A_j) xi.
  subroutine divergence(self, a, f)
    class(operators_t), intent(in)  :: self
    real(wp),           intent(in)  :: a(:, :)   !! (n,4) xx xy yx yy [N/m^6]
    real(wp),           intent(out) :: f(:, :)   !! (n,2) [N/m^3]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy

    !$omp parallel do schedule(static) default(none) shared(self, a, f) private(i, j, b, fx, fy)
    do i = 1, self%n
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
    !$omp end parallel do
  end subroutine divergence

  !> f <- f + Z[u]: the bond part of the zero-energy control. Its affine part belongs to A.
  subroutine add_control(self, c, u, f)
    class(operators_t), intent(in)    :: self
    real(wp),           intent(in)    :: c(:)      !! (n) [N/m^6]
    real(wp),           intent(in)    :: u(:, :)   !! (n,2) [m]
    real(wp),           intent(inout) :: f(:, :)   !! (n,2) [N/m^3]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: fx, fy, weight

    !$omp parallel do schedule(static) default(none) shared(self, c, u, f) &
    !$omp private(i, j, b, fx, fy, weight)
    do i = 1, self%n
      fx = 0.0_wp
      fy = 0.0_wp
      do b = self%first(i), self%first(i + 1) - 1
        j = self%neighbour(b)
        weight = self%weight(b) * (c(i) + c(j))
        fx = fx + weight * (u(j, 1) - u(i, 1))
        fy = fy + weight * (u(j, 2) - u(i, 2))
      end do
      f(i, 1) = f(i, 1) + fx
      f(i, 2) = f(i, 2) + fy
    end do
    !$omp end parallel do
  end subroutine add_control

  !> Part of the deformation that the deformation gradient does not see, squared and weighted over
  !> the family: sum_j omega V_j |z|^2 with z = (u_j - u_i) - (F_i - I) xi.
  subroutine zero_energy_squared(self, position, u, deformation_gradient, z2)
    class(operators_t), intent(in)  :: self
    real(wp),           intent(in)  :: position(:, :)              !! X (n,2) [m]
    real(wp),           intent(in)  :: u(:, :)                     !! (n,2) [m]
    real(wp),           intent(in)  :: deformation_gradient(:, :)  !! F (n,4) xx xy yx yy
    real(wp),           intent(out) :: z2(:)                       !! (n) [m^4]
    integer     :: i, j
    integer(i8) :: b
    real(wp)    :: xi(2), z(2)

    !$omp parallel do schedule(static) default(none) private(i, j, b, xi, z) &
    !$omp shared(self, position, u, deformation_gradient, z2)
    do i = 1, self%n
      z2(i) = 0.0_wp
      associate (f => deformation_gradient)
        do b = self%first(i), self%first(i + 1) - 1
          j = self%neighbour(b)
          xi(1) = position(j, 1) - position(i, 1)
          xi(2) = position(j, 2) - position(i, 2)
          z(1) = u(j, 1) - u(i, 1) - (f(i, 1) - 1.0_wp) * xi(1) - f(i, 2) * xi(2)
          z(2) = u(j, 2) - u(i, 2) - f(i, 3) * xi(1) - (f(i, 4) - 1.0_wp) * xi(2)
          z2(i) = z2(i) + self%weight(b) * (z(1)**2 + z(2)**2)
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine zero_energy_squared

  !> Number of directed bonds.
  pure integer(i8) function bonds(self)
    class(operators_t), intent(in) :: self

    bonds = self%first(self%n + 1) - 1
  end function bonds

  !> Fewest bonds of any point, and the first point that has so few.
  pure subroutine fewest_bonds(self, fewest, point)
    class(operators_t), intent(in)  :: self
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
    class(operators_t), intent(in) :: self

    memory = real(self%bonds(), wp) * 28.0_wp + real(self%n, wp) * 16.0_wp
  end function memory

end module pd_operators
