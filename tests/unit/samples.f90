!> Small bodies, fields and random numbers that the suites of the physics modules share.
module samples
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_blocks, only: blocks_t, new_blocks
  use pd_bond_list, only: bond_list_t, new_bond_list
  use pd_elastic, only: new_elastic
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t, new_horizon
  use pd_flow, only: flow_t
  use pd_forces, only: internal_forces
  use pd_geometry, only: body_t, lattice_body, lattice_t, layer_t
  use pd_green_lagrange, only: green_lagrange_t
  use pd_kinds, only: n_block, wp
  use pd_law, only: law_points_t, law_t
  use pd_materials, only: divide_into_runs, material_t, materials_t
  use pd_measure, only: measure_t
  use pd_model, only: model_t
  use pd_operators, only: control_stiffness, operators_t
  use pd_shape_tensor, only: invert_shape_tensors
  use pd_state, only: block_work_t, state_t
  use pd_timing, only: timing_t
  implicit none
  private

  public :: random_t, rectangle, sides, jittered_cloud, connect, model_of
  public :: new_material, materials_of, material_of, stress_at_point
  public :: gradient_of, divergence_of, control_of, differences_of, internal_force
  public :: linear_map, rotation

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

  !> A material of 2000 kg/m^3 or another density, with the strain of Green and Lagrange or another.
  function new_material(law, density, measure) result(material)
    class(law_t), intent(in)               :: law
    real(wp),     intent(in), optional     :: density
    class(measure_t), intent(in), optional :: measure
    type(material_t) :: material

    material%name = 'soil'
    allocate (material%law, source=law)
    if (present(measure)) then
      allocate (material%measure, source=measure)
    else
      allocate (green_lagrange_t :: material%measure)
    end if
    material%density = 2000.0_wp
    if (present(density)) material%density = density
    material%youngs_modulus = 50.0e6_wp
  end function new_material

  !> Materials of rows, 1 is the first, 2 the second. The blocks begin with row 1 unless given.
  function materials_of(rows, first, second, blocks) result(materials)
    integer,          intent(in)           :: rows(:)
    type(material_t), intent(in)           :: first
    type(material_t), intent(in), optional :: second
    type(blocks_t),   intent(in), optional :: blocks
    type(materials_t) :: materials

    if (present(second)) then
      allocate (materials%list(2))
      materials%list(2) = second
    else
      allocate (materials%list(1))
    end if
    materials%list(1) = first
    if (present(blocks)) then
      call divide_into_runs(blocks, rows, materials)
    else
      call divide_into_runs(new_blocks(1, size(rows)), rows, materials)
    end if
  end function materials_of

  !> One material in n rows: a law or, without one, E = 50 MPa with Poisson's ratio 0.3 or another.
  function material_of(n, poissons_ratio, law, blocks) result(materials)
    integer,        intent(in)           :: n
    real(wp),       intent(in), optional :: poissons_ratio
    class(law_t),   intent(in), optional :: law
    type(blocks_t), intent(in), optional :: blocks
    type(materials_t) :: materials
    type(material_t)  :: material
    real(wp) :: nu
    integer  :: i

    nu = 0.3_wp
    if (present(poissons_ratio)) nu = poissons_ratio
    if (present(law)) then
      material = new_material(law)
    else
      material = new_material(new_elastic(50.0e6_wp, nu))
    end if
    materials = materials_of([(1, i=1, n)], material, blocks=blocks)
  end function material_of

  !> Stress of one point by a law; what it remembers goes from step n to n+1.
  subroutine stress_at_point(law, strength, strain, history, stress, dissipated)
    class(law_t), intent(in)    :: law
    real(wp),     intent(in)    :: strength, strain(4)
    real(wp),     intent(inout) :: history(:)
    real(wp),     intent(inout) :: stress(4)   !! in: of step n
    real(wp),     intent(out), optional :: dissipated
    type(law_points_t) :: point
    type(flow_t)       :: flow

    allocate (point%stress(1, 4), source=reshape(stress, [1, 4]))
    allocate (point%history(1, size(history)), source=reshape(history, [1, size(history)]))
    allocate (point%strength(1), source=strength)
    call law%stress_block(1, 1, 1, reshape(strain, [1, 4]), point, flow)
    stress = point%stress(1, :)
    history = point%history(1, :)
    if (.not. present(dissipated)) return
    dissipated = 0.0_wp
    if (flow%n > 0) dissipated = flow%dissipated(1)
  end subroutine stress_at_point

  !> Operators of a body with their K^-1; control of strength g where that is above 0.
  subroutine connect(body, delta, operators, g, influence)
    type(body_t),      intent(in)  :: body
    real(wp),          intent(in)  :: delta
    type(bond_list_t), intent(out) :: operators
    real(wp),          intent(in), optional :: g
    character(*),      intent(in), optional :: influence
    type(error_list_t) :: errors
    type(horizon_t)    :: horizon

    horizon = new_horizon(delta, 'gaussian')
    if (present(influence)) horizon = new_horizon(delta, influence)
    call new_bond_list(horizon, body%position, body%volume, operators, errors)
    call invert_shape_tensors(operators, body%position, body%volume, errors)
    if (errors%count() > 0) error stop 'samples: a body that cannot be connected'
    if (.not. present(g)) return
    if (g > 0.0_wp) &
      call operators%set_control(control_stiffness(g, 50.0e6_wp, delta, operators%weight_sum))
  end subroutine connect

  !> The model of a body without supports and loads, with a strength of 0.15 MPa everywhere.
  !>
  !> `free`: 0 where a component keeps its velocity; all move freely without it.
  function model_of(body, delta, materials, g, free) result(model)
    type(body_t),      intent(in) :: body
    real(wp),          intent(in) :: delta
    type(materials_t), intent(in) :: materials
    real(wp),          intent(in), optional :: g, free(:, :)
    type(model_t) :: model
    type(bond_list_t), allocatable :: operators

    allocate (operators)
    call connect(body, delta, operators, g)
    model%body = body
    model%blocks = operators%domain%blocks
    call move_alloc(operators, model%operators)
    model%shown = model%operators%storage
    model%materials = materials
    model%delta = delta
    model%points%position = body%position
    model%points%volume = body%volume
    model%points%all_volume = sum(body%volume)
    model%points%largest_volume = maxval(body%volume)
    allocate (model%points%free(body%n, 2), source=1.0_wp)
    if (present(free)) model%points%free = free
    allocate (model%points%place(body%n), model%points%in_body(body%n), source=0.0_wp)
    where (body%boundary == 0) model%points%in_body = 1.0_wp
    allocate (model%strength(body%n), source=0.15e6_wp)
    allocate (model%supports%items(0), model%loads%items(0))
  end function model_of

  !> G[u] of all rows.
  subroutine gradient_of(operators, u, g)
    class(operators_t), intent(inout) :: operators
    real(wp), intent(in)  :: u(:, :)
    real(wp), intent(out) :: g(:, :)
    real(wp), allocatable :: field(:, :), sums(:, :)
    integer :: block

    field = u
    allocate (sums(operators%n, 4), source=0.0_wp)
    call operators%take_in(field)
    associate (blocks => operators%domain%blocks)
      do block = 1, blocks%count
        call operators%gradient_sums_block(blocks%lo(block), blocks%hi(block), field, sums)
      end do
    end associate
    g = sums
  end subroutine gradient_of

  !> D[A] of all rows.
  subroutine divergence_of(operators, a, f)
    class(operators_t), intent(in) :: operators
    real(wp), intent(in)  :: a(:, :)
    real(wp), intent(out) :: f(:, :)
    real(wp), allocatable :: field(:, :), sums(:, :)
    integer :: block

    field = a
    if (operators%weighs) field = spread(operators%share_of, 2, 4) * a
    allocate (sums(operators%n, 2), source=0.0_wp)
    associate (blocks => operators%domain%blocks)
      do block = 1, blocks%count
        call operators%divergence_sums_block(blocks%lo(block), blocks%hi(block), field, sums)
      end do
    end associate
    f = sums
  end subroutine divergence_of

  !> S[x] of all rows.
  subroutine differences_of(operators, x, s)
    class(operators_t), intent(in) :: operators
    real(wp), intent(in)  :: x(:, :)
    real(wp), intent(out) :: s(:, :)
    real(wp), allocatable :: field(:, :)
    real(wp) :: sums(n_block, 2)
    integer  :: block, lo, hi

    field = x
    if (operators%weighs) field = spread(operators%share_of, 2, 2) * x
    s = 0.0_wp
    do block = 1, operators%domain%blocks%count
      lo = operators%domain%blocks%lo(block)
      hi = operators%domain%blocks%hi(block)
      call operators%difference_sums_block(lo, hi, field, sums)
      s(lo:hi, :) = sums(:hi - lo + 1, :)
    end do
  end subroutine differences_of

  !> f <- f + Z[u] of all rows.
  subroutine control_of(operators, u, f)
    class(operators_t), intent(inout) :: operators
    real(wp), intent(in)    :: u(:, :)
    real(wp), intent(inout) :: f(:, :)
    real(wp), allocatable :: field(:, :), sums(:, :)
    integer :: block

    field = u
    sums = f
    call operators%take_in(field)
    associate (blocks => operators%domain%blocks)
      do block = 1, blocks%count
        call operators%control_sums_block(blocks%lo(block), blocks%hi(block), field, sums)
      end do
    end associate
    f = sums
  end subroutine control_of

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

  !> Displacement gives H, S and the internal force density, control included.
  subroutine internal_force(operators, materials, volume, state, dissipated, failed)
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp),           intent(in)    :: volume(:)
    type(state_t),      intent(inout) :: state
    real(wp), intent(out), optional :: dissipated
    integer,  intent(out), optional :: failed
    type(block_work_t) :: work
    type(timing_t) :: timing
    integer :: first

    call internal_forces(operators, materials, volume, state, work, timing, first)
    if (present(dissipated)) dissipated = operators%domain%blocks%total(work%dissipated)
    if (present(failed)) failed = first
  end subroutine internal_force

end module samples
