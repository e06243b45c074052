!> Small bodies, fields and random numbers that the suites of the physics modules share.
module samples
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_bond_list, only: bond_list_t, new_bond_list
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, new_horizon
  use pd_force, only: control_stiffness, force_of => internal_force, force_state, solid_t
  use pd_geometry, only: body_t, lattice_body, lattice_t, layer_t
  use pd_j2, only: new_j2
  use pd_kinds, only: wp
  use pd_kinematics, only: inverse_shape_tensor
  use pd_state, only: block_work_t, state_t
  use pd_timing, only: timing_t
  implicit none
  private

  public :: random_t, rectangle, sides, jittered_cloud, connect, material_of
  public :: linear_map, rotation, internal_force

  !> Pseudo-random numbers that are the same in every run (Lehmer's generator).
  type :: random_t
    integer(int64), private :: seed = 20240229_int64
  contains
    procedure :: number
    procedure :: fill
    procedure :: reseed
  end type random_t

contains

  subroutine reseed(self, seed)
    class(random_t), intent(inout) :: self
    integer,         intent(in)    :: seed
    real(wp) :: ignored
    integer  :: k

    self%seed = 7919_int64 * int(seed, int64) + 104729_int64
    do k = 1, 5
      ignored = self%number()
    end do
  end subroutine reseed

  !> The next number between -1 and 1.
  real(wp) function number(self)
    class(random_t), intent(inout) :: self
    integer(int64), parameter :: modulus = 2147483647_int64

    self%seed = modulo(16807_int64 * self%seed, modulus)
    number = 2.0_wp * real(self%seed, wp) / real(modulus, wp) - 1.0_wp
  end function number

  !> Numbers between -size and size.
  subroutine fill(self, size, values)
    class(random_t), intent(inout) :: self
    real(wp),        intent(in)    :: size
    real(wp),        intent(out)   :: values(:, :)
    integer :: i, k

    do k = 1, ubound(values, 2)
      do i = 1, ubound(values, 1)
        values(i, k) = size * self%number()
      end do
    end do
  end subroutine fill

  !> Layers beyond sides: 'bottom top' makes boundary 1 at the bottom and boundary 2 at the top.
  function sides(text) result(layers)
    character(*), intent(in) :: text
    type(layer_t), allocatable :: layers(:)
    character(8) :: words(4)
    integer :: k, n, status

    words = ''
    read (text, *, iostat=status) words
    n = count(words /= '')
    allocate (layers(n))
    do k = 1, n
      layers(k)%side = trim(words(k))
      layers(k)%boundary = k
    end do
  end function sides

  !> A rectangle of nx x ny squares with its lower left corner at `origin`.
  function rectangle(nx, ny, spacing, layers, rows, cells, tributary, origin) result(body)
    integer,       intent(in) :: nx, ny
    real(wp),      intent(in) :: spacing
    type(layer_t), intent(in), optional :: layers(:)
    integer,       intent(in), optional :: rows
    logical,       intent(in), optional :: cells, tributary
    real(wp),      intent(in), optional :: origin(2)
    type(body_t) :: body
    type(lattice_t)    :: lattice
    type(error_list_t) :: errors
    type(layer_t)      :: none(0)
    real(wp) :: lower(2, 1), upper(2, 1)

    lattice = lattice_t(spacing, .false., .false., 0)
    if (present(rows)) lattice%rows = rows
    if (present(cells)) lattice%cells = cells
    if (present(tributary)) lattice%tributary = tributary
    lower = 0.0_wp
    if (present(origin)) lower(:, 1) = origin
    upper(:, 1) = lower(:, 1) + spacing * real([nx, ny], wp)
    if (present(layers)) then
      call lattice_body(lower, upper, lattice, layers, body, errors)
    else
      call lattice_body(lower, upper, lattice, none, body, errors)
    end if
  end function rectangle

  !> n x n points near the places of a lattice of spacing 1 / n, each moved at random by up to
  !> 0.35 of it, with volumes that differ by up to 30 %.
  function jittered_cloud(n, random) result(body)
    integer,        intent(in)    :: n
    type(random_t), intent(inout) :: random
    type(body_t) :: body
    real(wp) :: spacing, wobble(n * n, 3)
    integer  :: i, ix, iy

    spacing = 1.0_wp / real(n, wp)
    body%n = n * n
    allocate (body%position(n * n, 2), body%volume(n * n))
    allocate (body%boundary(n * n), source=0)
    call random%fill(1.0_wp, wobble)
    do iy = 1, n
      do ix = 1, n
        i = ix + n * (iy - 1)
        body%position(i, :) = spacing * (real([ix, iy], wp) + 0.35_wp * wobble(i, :2))
        body%volume(i) = spacing**2 * (1.0_wp + 0.3_wp * wobble(i, 3))
      end do
    end do
    body%lower = minval(body%position, dim=1)
    body%upper = maxval(body%position, dim=1)
  end function jittered_cloud

  !> E = 50 MPa and 2000 kg/m^3 with Poisson's ratio 0.3 or another, elastic.
  function material_of(n, poissons_ratio) result(solid)
    integer,  intent(in)           :: n
    real(wp), intent(in), optional :: poissons_ratio
    type(solid_t) :: solid

    solid%material = new_j2(50.0e6_wp, 0.3_wp)
    if (present(poissons_ratio)) solid%material = new_j2(50.0e6_wp, poissons_ratio)
    solid%density = 2000.0_wp
    allocate (solid%yield_stress(n), source=0.15e6_wp)
  end function material_of

  !> Operators and K^-1 of a body; control of strength g where that is above 0.
  subroutine connect(body, delta, solid, operators, g, influence)
    type(body_t),      intent(in)    :: body
    real(wp),          intent(in)    :: delta
    type(solid_t),     intent(inout) :: solid
    type(bond_list_t), intent(out)   :: operators
    real(wp),          intent(in), optional :: g
    character(*),      intent(in), optional :: influence
    type(error_list_t) :: errors
    type(horizon_t)    :: horizon

    horizon = new_horizon(delta, 'gaussian')
    if (present(influence)) horizon = new_horizon(delta, influence)
    call new_bond_list(horizon, body%position, body%volume, operators, errors)
    if (allocated(solid%k_inverse)) deallocate (solid%k_inverse)
    allocate (solid%k_inverse(body%n, 3))
    call inverse_shape_tensor(operators, body%position, body%volume, solid%k_inverse, errors)
    if (errors%count() > 0) error stop 'samples: a body that cannot be connected'
    if (.not. present(g)) return
    if (g > 0.0_wp) &
      call operators%set_control(control_stiffness(g, 50.0e6_wp, delta, operators%weight_sum))
  end subroutine connect

  !> u = (F - I) X with F as xx xy yx yy.
  function linear_map(f, x) result(u)
    real(wp), intent(in) :: f(4), x(:, :)
    real(wp) :: u(size(x, 1), 2)

    u(:, 1) = (f(1) - 1.0_wp) * x(:, 1) + f(2) * x(:, 2)
    u(:, 2) = f(3) * x(:, 1) + (f(4) - 1.0_wp) * x(:, 2)
  end function linear_map

  !> Rotation by an angle as xx xy yx yy.
  pure function rotation(angle) result(f)
    real(wp), intent(in) :: angle   !! [rad]
    real(wp) :: f(4)

    f = [cos(angle), -sin(angle), sin(angle), cos(angle)]
  end function rotation

  !> Displacement gives F, S and the internal force density, control included.
  subroutine internal_force(operators, solid, volume, state, dissipated, failed)
    type(bond_list_t), intent(inout) :: operators
    type(solid_t),     intent(in)    :: solid
    real(wp),          intent(in)    :: volume(:)
    type(state_t),     intent(inout) :: state
    real(wp), intent(out), optional :: dissipated
    integer,  intent(out), optional :: failed
    real(wp), allocatable :: a(:, :)
    type(block_work_t) :: blocks
    type(timing_t) :: timing
    integer :: first

    allocate (a(size(volume), 4))
    call force_state(operators, solid, volume, state, a, blocks, timing, first)
    call force_of(operators, state%displacement, a, state%force, blocks, timing)
    if (present(dissipated)) dissipated = sum(blocks%dissipated)
    if (present(failed)) failed = first
  end subroutine internal_force

end module samples
