!> Bonds of a lattice that are not there: the mask of bonds.
!>
!> Sums by columns go over whole families. Points whose family lacks bonds are few; what the missing
!> bonds have added to their sums is taken out again, bond by bond and in a fixed order. Weights of
!> families (K, W, s) are added up anew from the bonds that are there, so that a family without
!> bonds has exactly nothing.
!> Source: doc/theory.md, section 1.
module pd_blocked_bonds
  use pd_kinds, only: i8, n_line, wp
  use pd_sight, only: sight_t
  use pd_storage, only: storage_t
  implicit none
  private

  public :: blocked_bonds_t, new_blocked_bonds

  !> Rows that lack bonds, and the offsets of these bonds: 1 to the number of pairs for xi, as many
  !> more for -xi.
  type :: blocked_bonds_t
    integer(i8) :: count = 0_i8                       !! directed bonds that are missing
    integer,     allocatable, private :: row(:)       !! ascending
    integer(i8), allocatable, private :: first(:)     !! first bond of each of these rows (rows+1)
    integer,     allocatable, private :: offset(:)    !! of every bond, ascending in a row
    integer,     allocatable, private :: before(:)    !! rows above that precede cache line k (0:)
    integer,     allocatable, private :: shift(:)     !! to the other row (offsets)
    real(wp),    allocatable, private :: xi(:, :)     !! (offsets,2) [m]
    real(wp),    allocatable, private :: weight(:)    !! omega V_0 (offsets) [m^2]
    real(wp),    allocatable, private :: wx(:), wy(:) !! omega V_0 xi (offsets) [m^3]
    real(wp),    allocatable, private :: residual(:)  !! omega V_0 (1 - a |xi|^2) (offsets) [m^2]
  contains
    procedure :: weigh_residuals
    procedure :: take_out_of_gradient
    procedure :: take_out_of_divergence
    procedure :: take_out_of_near
    procedure :: take_out_of_residual
    procedure :: take_out_of_differences
    procedure :: recount
    procedure :: reshape_rows
    procedure :: recount_zero_energy
    procedure :: memory
    procedure, private :: find_rows
    procedure, private :: weights_left
  end type blocked_bonds_t

contains

  !> The bonds between points that do not see each other; not allocated: there is none.
  subroutine new_blocked_bonds(sight, storage, shift, xi, weight, blocked)
    type(sight_t),   intent(in) :: sight
    type(storage_t), intent(in) :: storage
    integer,         intent(in) :: shift(:)    !! half of the offsets, in rows (pairs)
    real(wp),        intent(in) :: xi(:, :)    !! (pairs,2) [m]
    real(wp),        intent(in) :: weight(:)   !! omega V_0 (pairs) [m^2]
    type(blocked_bonds_t), allocatable, intent(out) :: blocked
    integer, allocatable :: point(:)   !! of a row, 0: none
    integer :: i, line, n_rows, pass
    integer(i8) :: n

    allocate (blocked)
    blocked%shift = [shift, -shift]
    blocked%weight = [weight, weight]
    allocate (blocked%xi(2 * size(shift), 2))
    blocked%xi(:size(shift), :) = xi
    blocked%xi(size(shift) + 1:, :) = -xi
    blocked%wx = blocked%weight * blocked%xi(:, 1)
    blocked%wy = blocked%weight * blocked%xi(:, 2)
    allocate (point(storage%rows), source=0)
    point(storage%row()) = [(i, i=1, storage%n)]
    do pass = 1, 2
      n = 0_i8
      n_rows = 0
      do i = 1, storage%n
        if (sight%all_clear(i)) cycle
        call look_around(storage%row(i))
      end do
      if (pass == 2) exit
      allocate (blocked%row(n_rows), blocked%first(n_rows + 1), blocked%offset(n))
      blocked%first(1) = 1_i8
    end do
    if (n == 0_i8) then
      deallocate (blocked)
      return
    end if
    blocked%count = n
    allocate (blocked%before(0:storage%rows / n_line + 1), source=0)
    do i = 1, n_rows
      line = (blocked%row(i) - 1) / n_line + 1
      blocked%before(line) = blocked%before(line) + 1
    end do
    do line = 1, ubound(blocked%before, 1)
      blocked%before(line) = blocked%before(line) + blocked%before(line - 1)
    end do

  contains

    !> Count the bonds of point i that are missing; in the second pass, list them.
    subroutine look_around(row)
      integer, intent(in) :: row
      integer(i8) :: n_before
      integer :: k

      n_before = n
      do k = 1, size(blocked%shift)
        if (point(row + blocked%shift(k)) == 0) cycle
        if (sight%sees(i, point(row + blocked%shift(k)))) cycle
        n = n + 1_i8
        if (pass == 2) blocked%offset(n) = k
      end do
      if (n == n_before) return
      n_rows = n_rows + 1
      if (pass == 1) return
      blocked%row(n_rows) = row
      blocked%first(n_rows + 1) = n + 1_i8
    end subroutine look_around

  end subroutine new_blocked_bonds

  !> Which of the rows that lack bonds are among rows lo to hi: numbers a to b.
  pure subroutine find_rows(self, lo, hi, a, b)
    class(blocked_bonds_t), intent(in) :: self
    integer, intent(in)  :: lo, hi
    integer, intent(out) :: a, b

    a = self%before((lo - 1) / n_line) + 1
    b = self%before((hi - 1) / n_line + 1)
    do while (a <= b)
      if (self%row(a) >= lo) exit
      a = a + 1
    end do
    do while (b >= a)
      if (self%row(b) <= hi) exit
      b = b - 1
    end do
  end subroutine find_rows

  !> Weights of the residual sums, from now on.
  pure subroutine weigh_residuals(self, falloff)
    class(blocked_bonds_t), intent(inout) :: self
    real(wp), intent(in) :: falloff   !! a [1/m^2]

    self%residual = self%weight * (1.0_wp - falloff * sum(self%xi**2, dim=2))
  end subroutine weigh_residuals

  !> g <- g - sum_j omega V_0 u~_j (x) xi over the missing bonds of rows lo to hi.
  pure subroutine take_out_of_gradient(self, lo, hi, u, g)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: u(:, :)   !! u~ (n,2) [m]
    real(wp), intent(inout), contiguous :: g(:, :)   !! (n,4) xx xy yx yy [m^4]
    integer     :: a, b, i, j, k, o
    integer(i8) :: e
    real(wp)    :: xx, xy, yx, yy

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      xx = 0.0_wp
      xy = 0.0_wp
      yx = 0.0_wp
      yy = 0.0_wp
      do e = self%first(k), self%first(k + 1) - 1
        o = self%offset(e)
        j = i + self%shift(o)
        xx = xx + u(j, 1) * self%wx(o)
        xy = xy + u(j, 1) * self%wy(o)
        yx = yx + u(j, 2) * self%wx(o)
        yy = yy + u(j, 2) * self%wy(o)
      end do
      g(i, 1) = g(i, 1) - xx
      g(i, 2) = g(i, 2) - xy
      g(i, 3) = g(i, 3) - yx
      g(i, 4) = g(i, 4) - yy
    end do
  end subroutine take_out_of_gradient

  !> f <- f - sum_j omega V_0 A~_j xi over the missing bonds of rows lo to hi.
  pure subroutine take_out_of_divergence(self, lo, hi, tensor, f)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: tensor(:, :)   !! A~ (n,4) xx xy yx yy [N/m^6]
    real(wp), intent(inout), contiguous :: f(:, :)        !! (n,2) [N/m^3]
    integer     :: a, b, i, j, k, o
    integer(i8) :: e
    real(wp)    :: fx, fy

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      fx = 0.0_wp
      fy = 0.0_wp
      do e = self%first(k), self%first(k + 1) - 1
        o = self%offset(e)
        j = i + self%shift(o)
        fx = fx + tensor(j, 1) * self%wx(o) + tensor(j, 2) * self%wy(o)
        fy = fy + tensor(j, 3) * self%wx(o) + tensor(j, 4) * self%wy(o)
      end do
      f(i, 1) = f(i, 1) - fx
      f(i, 2) = f(i, 2) - fy
    end do
  end subroutine take_out_of_divergence

  !> total <- total - sum_j omega V_0 x_j over the missing bonds of rows lo to hi.
  pure subroutine take_out_of_near(self, lo, hi, x, total)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: x(:)       !! (n)
    real(wp), intent(inout), contiguous :: total(:)   !! row 1 is row lo

    call take_out(self, self%weight, lo, hi, x, total)
  end subroutine take_out_of_near

  !> The same with the weights of the residual sums.
  pure subroutine take_out_of_residual(self, lo, hi, x, total)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: x(:)       !! (n)
    real(wp), intent(inout), contiguous :: total(:)   !! row 1 is row lo

    call take_out(self, self%residual, lo, hi, x, total)
  end subroutine take_out_of_residual

  !> The same of both components of a field.
  pure subroutine take_out_of_differences(self, lo, hi, x, total)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: x(:, :)   !! (n,2)
    real(wp), intent(inout) :: total(:, :)        !! (:,2); row 1 is row lo
    integer     :: a, b, i, j, k, o
    integer(i8) :: e
    real(wp)    :: sx, sy

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      sx = 0.0_wp
      sy = 0.0_wp
      do e = self%first(k), self%first(k + 1) - 1
        o = self%offset(e)
        j = i + self%shift(o)
        sx = sx + self%residual(o) * x(j, 1)
        sy = sy + self%residual(o) * x(j, 2)
      end do
      total(i - lo + 1, 1) = total(i - lo + 1, 1) - sx
      total(i - lo + 1, 2) = total(i - lo + 1, 2) - sy
    end do
  end subroutine take_out_of_differences

  !> The same of one field with any weights.
  pure subroutine take_out(self, weight, lo, hi, x, total)
    type(blocked_bonds_t), intent(in) :: self
    real(wp), intent(in) :: weight(:)                 !! (offsets)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: x(:)       !! (n)
    real(wp), intent(inout), contiguous :: total(:)
    integer     :: a, b, i, k, o
    integer(i8) :: e
    real(wp)    :: s

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      s = 0.0_wp
      do e = self%first(k), self%first(k + 1) - 1
        o = self%offset(e)
        s = s + weight(o) * x(i + self%shift(o))
      end do
      total(i - lo + 1) = total(i - lo + 1) - s
    end do
  end subroutine take_out

  !> omega V_j of the bonds that row k of those that lack bonds has; 0 where there is none.
  pure function weights_left(self, k, share) result(weight)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: k
    real(wp), intent(in), contiguous :: share(:)   !! V / V_0 (n)
    real(wp), allocatable :: weight(:)             !! (offsets) [m^2]
    integer(i8) :: e

    weight = self%weight * share(self%row(k) + self%shift)
    do e = self%first(k), self%first(k + 1) - 1
      weight(self%offset(e)) = 0.0_wp
    end do
  end function weights_left

  !> W, s and the number of bonds of rows lo to hi anew, where bonds are missing.
  pure subroutine recount(self, lo, hi, share, total, moment, found)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: share(:)   !! V / V_0 (n)
    real(wp), intent(inout) :: total(:)            !! W [m^2]; row 1 is row lo
    real(wp), intent(inout) :: moment(:, :)        !! s (:,2) [m^3]
    integer,  intent(inout) :: found(:)            !! bonds
    real(wp), allocatable :: weight(:)
    integer :: a, b, i, k

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k) - lo + 1
      weight = self%weights_left(k, share)
      total(i) = sum(weight)
      moment(i, 1) = sum(weight * self%xi(:, 1))
      moment(i, 2) = sum(weight * self%xi(:, 2))
      found(i) = count(weight > 0.0_wp)
    end do
  end subroutine recount

  !> K of rows lo to hi anew, where bonds are missing.
  pure subroutine reshape_rows(self, lo, hi, share, shape_tensor)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: share(:)              !! V / V_0 (n)
    real(wp), intent(inout), contiguous :: shape_tensor(:, :)    !! K (n,3) xx yy xy [m^4]
    real(wp), allocatable :: weight(:)
    integer :: a, b, i, k

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      weight = self%weights_left(k, share)
      shape_tensor(i, 1) = sum(weight * self%xi(:, 1)**2)
      shape_tensor(i, 2) = sum(weight * self%xi(:, 2)**2)
      shape_tensor(i, 3) = sum(weight * self%xi(:, 1) * self%xi(:, 2))
    end do
  end subroutine reshape_rows

  !> sum_j omega V_j |z|^2 of rows lo to hi anew, where bonds are missing.
  pure subroutine recount_zero_energy(self, lo, hi, share, u, h, z2)
    class(blocked_bonds_t), intent(in) :: self
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: share(:)   !! V / V_0 (n)
    real(wp), intent(in),    contiguous :: u(:, :)    !! (n,2) [m]
    real(wp), intent(in),    contiguous :: h(:, :)    !! H (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: z2(:)      !! (n) [m^4]
    real(wp), allocatable :: weight(:)
    integer  :: a, b, i, j, k, o
    real(wp) :: z(2)

    call self%find_rows(lo, hi, a, b)
    do k = a, b
      i = self%row(k)
      weight = self%weights_left(k, share)
      z2(i) = 0.0_wp
      do o = 1, size(weight)
        if (weight(o) <= 0.0_wp) cycle
        j = i + self%shift(o)
        z(1) = u(j, 1) - u(i, 1) - h(i, 1) * self%xi(o, 1) - h(i, 2) * self%xi(o, 2)
        z(2) = u(j, 2) - u(i, 2) - h(i, 3) * self%xi(o, 1) - h(i, 4) * self%xi(o, 2)
        z2(i) = z2(i) + weight(o) * (z(1)**2 + z(2)**2)
      end do
    end do
  end subroutine recount_zero_energy

  !> Memory that the mask takes [bytes].
  pure real(wp) function memory(self)
    class(blocked_bonds_t), intent(in) :: self

    memory = 4.0_wp * real(size(self%offset, kind=i8), wp) + 12.0_wp * real(size(self%row), wp) &
      + 4.0_wp * real(size(self%before), wp) + 60.0_wp * real(size(self%shift), wp)
  end function memory

end module pd_blocked_bonds
