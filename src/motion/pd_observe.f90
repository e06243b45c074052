!> What a run tells about itself: one number per column of the history.
!>
!> A column says how its value comes about, and what it is called; which columns there are stands
!> in `pd_history_columns`. The blocks of points are gone through once, all columns of a block
!> while it is in the cache.
!> Source: doc/theory.md, section 10.
module pd_observe
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_boundary, only: nominal_strain
  use pd_force, only: solid_t
  use pd_geometry, only: body_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_labels, only: label_t
  use pd_model, only: model_t
  use pd_operators, only: operators_t
  use pd_state, only: state_t
  use pd_strain, only: first_piola_block, green_lagrange_block
  implicit none
  private

  public :: ledger_t, moment_t, block_view_t, row_view_t, column_t, observation_t
  public :: total, mean, largest, smallest
  public :: moment_at, observe, surplus, running_away

  !> Energies that are added up step by step [J/m], and what the balance refers to.
  type :: ledger_t
    real(wp) :: initial_kinetic_energy = 0.0_wp
    real(wp) :: plastic_dissipation = 0.0_wp
    real(wp) :: damping_dissipation = 0.0_wp
    real(wp) :: external_work = 0.0_wp
    real(wp) :: largest_work = 0.0_wp           !! largest |W| so far
  contains
    procedure :: enter
  end type ledger_t

  !> When a state is looked at.
  type :: moment_t
    integer  :: step = 0
    real(wp) :: time = 0.0_wp                   !! [s]
    real(wp) :: strain = 0.0_wp                 !! nominal; 0 without platens
    type(ledger_t) :: ledger
  end type moment_t

  !> Points lo to hi as the columns see them; row 1 of the arrays is point lo. Rows behind the last
  !> point are 0, for sums go over whole blocks.
  type :: block_view_t
    type(model_t), pointer :: model => null()
    type(state_t), pointer :: state => null()
    integer  :: lo = 1, hi = 0
    real(wp) :: weight(n_block)                 !! volume of a point of the body; fictitious: 0
    real(wp) :: p(n_block, 4)                   !! first Piola-Kirchhoff stress xx xy yx yy [Pa]
    real(wp) :: strain(n_block, 4)              !! xx yy zz xy
  end type block_view_t

  !> How the parts of the blocks become the value of a column.
  integer, parameter :: total = 1      !! added up
  integer, parameter :: mean = 2       !! added up, over the volume of the body
  integer, parameter :: largest = 3
  integer, parameter :: smallest = 4

  !> One row of the history.
  type :: observation_t
    character(80), allocatable :: names(:)
    real(wp),      allocatable :: values(:)
  contains
    procedure :: value => value_by_name
  end type observation_t

  !> What a column sees that needs no look at the points.
  type :: row_view_t
    type(model_t), pointer :: model => null()
    type(moment_t) :: moment
    type(observation_t) :: seen                 !! columns from blocks, and those before this one
    real(wp) :: control_energy = 0.0_wp         !! [J/m]
    integer  :: boundary = 0, component = 0     !! that the column is about
  end type row_view_t

  !> A column of the history: its value comes from the blocks or from elsewhere.
  type, extends(label_t) :: column_t
    logical :: whole_number = .false.
    integer :: joined = 0                       !! how, where there are parts of blocks
    procedure(part_of_block), pointer, nopass :: part => null()
    procedure(value_of_row), pointer, nopass :: value => null()
    integer :: boundary = 0, component = 0      !! that it is about, if it is
  end type column_t

  abstract interface
    !> What a block of points gives to a column.
    pure real(wp) function part_of_block(block)
      import :: block_view_t, wp
      type(block_view_t), intent(in) :: block
    end function part_of_block
    !> A value that comes from elsewhere.
    pure real(wp) function value_of_row(row)
      import :: row_view_t, wp
      type(row_view_t), intent(in) :: row
    end function value_of_row
  end interface

contains

  !> Add what one step has done.
  pure subroutine enter(self, dissipated, damping, work)
    class(ledger_t), intent(inout) :: self
    real(wp),        intent(in)    :: dissipated   !! by plastic flow [J/m]
    real(wp),        intent(in)    :: damping      !! dissipated by the damping [J/m]
    real(wp),        intent(in)    :: work         !! from outside [J/m]

    self%plastic_dissipation = self%plastic_dissipation + dissipated
    self%damping_dissipation = self%damping_dissipation + damping
    self%external_work = self%external_work + work
    self%largest_work = max(self%largest_work, abs(self%external_work))
  end subroutine enter

  !> The moment after a step.
  pure type(moment_t) function moment_at(step, model, state, ledger) result(moment)
    integer,        intent(in) :: step
    type(model_t),  intent(in) :: model
    type(state_t),  intent(in) :: state
    type(ledger_t), intent(in) :: ledger

    moment%step = step
    moment%time = real(step, wp) * model%motion%time_step
    if (model%platens%axis > 0) moment%strain = nominal_strain(model%platens, model%boundaries, &
      moment%time, state%displacement)
    moment%ledger = ledger
  end function moment_at

  !> The values of all columns.
  subroutine observe(columns, model, state, moment, seen)
    type(column_t),        intent(in)    :: columns(:)
    type(model_t), target, intent(inout) :: model    !! work space of its operators
    type(state_t),         intent(in)    :: state
    type(moment_t),        intent(in)    :: moment
    type(observation_t),   intent(out)   :: seen
    type(row_view_t) :: row
    integer :: k

    row%model => model
    row%moment = moment
    call control_energy(model%body, model%solid, model%operators, state, row%control_energy)
    allocate (row%seen%names(size(columns)), source=columns%name)
    allocate (row%seen%values(size(columns)), source=ieee_value(1.0_wp, ieee_quiet_nan))
    call observe_blocks(columns, model, state, row%seen%values)
    do k = 1, size(columns)
      if (.not. associated(columns(k)%value)) cycle
      row%boundary = columns(k)%boundary
      row%component = columns(k)%component
      row%seen%values(k) = columns(k)%value(row)
    end do
    seen = row%seen
  end subroutine observe

  !> The values of those columns that come from blocks.
  subroutine observe_blocks(columns, model, state, values)
    type(column_t), intent(in)    :: columns(:)
    type(model_t), target, intent(in) :: model
    type(state_t), target, intent(in) :: state
    real(wp),       intent(inout) :: values(:)
    real(wp), allocatable :: parts(:, :), weights(:)
    integer :: block, n_blocks, k

    n_blocks = (model%body%n + n_block - 1) / n_block
    allocate (parts(size(columns), n_blocks), weights(n_blocks))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n_blocks, columns, model, state, parts, weights)
    do block = 1, n_blocks
      call look_at_block(block, columns, model, state, parts(:, block), weights(block))
    end do
    !$omp end parallel do
    do k = 1, size(columns)
      if (.not. associated(columns(k)%part)) cycle
      select case (columns(k)%joined)
      case (total)
        values(k) = sum(parts(k, :))
      case (mean)
        values(k) = sum(parts(k, :)) / sum(weights)
      case (largest)
        values(k) = maxval(parts(k, :))
      case (smallest)
        values(k) = minval(parts(k, :))
      case default   ! no way to join them
        values(k) = ieee_value(1.0_wp, ieee_quiet_nan)
      end select
    end do
  end subroutine observe_blocks

  !> What one block gives to the columns, and the volume of its points of the body.
  subroutine look_at_block(number, columns, model, state, parts, weight)
    integer,        intent(in)  :: number
    type(column_t), intent(in)  :: columns(:)
    type(model_t), target, intent(in) :: model
    type(state_t), target, intent(in) :: state
    real(wp),       intent(out) :: parts(:), weight
    type(block_view_t) :: block
    integer :: k

    block%model => model
    block%state => state
    block%lo = (number - 1) * n_block + 1
    block%hi = min(number * n_block, model%body%n)
    call fill_view(model%body, state, block)
    weight = block_sum(block%weight)
    parts = 0.0_wp
    do k = 1, size(columns)
      if (associated(columns(k)%part)) parts(k) = columns(k)%part(block)
    end do
  end subroutine look_at_block

  !> Weights, stress and strain of a block; without a branch.
  pure subroutine fill_view(body, state, block)
    type(body_t),       intent(in)    :: body
    type(state_t),      intent(in)    :: state
    type(block_view_t), intent(inout) :: block
    integer :: i, b

    if (block%hi - block%lo + 1 < n_block) then
      block%weight = 0.0_wp
      block%p = 0.0_wp
      block%strain = 0.0_wp
    end if
    !$omp simd simdlen(8) private(b)
    do i = block%lo, block%hi
      b = i - block%lo + 1
      block%weight(b) = real(1 - min(1, abs(body%boundary(i))), wp) * body%volume(i)
    end do
    call green_lagrange_block(block%lo, block%hi, state%deformation_gradient, block%strain)
    call first_piola_block(block%lo, block%hi, state%deformation_gradient, state%stress, block%p)
  end subroutine fill_view

  !> Energy of the control: with constant c it has a potential, (1/2) sum V c sum omega V_j |z|^2,
  !> which is the work of the control forces without the error of adding it up. The force is linear
  !> in u, so this is half of the force times u:
  !>
  !>   -(1/2) sum_i V_i (u_i - u_mean) . Z[u]_i - (1/2) sum_i V_i c_i H_i : H_i K_i,   H = F - I
  !>
  !> The mean adds nothing, for the forces are in balance; without it digits of u would be lost.
  subroutine control_energy(body, solid, operators, state, energy)
    type(body_t),       intent(in)    :: body
    type(solid_t),      intent(in)    :: solid
    class(operators_t), intent(inout) :: operators
    type(state_t),      intent(in)    :: state
    real(wp),           intent(out)   :: energy   !! [J/m]; round-off does not make it negative
    real(wp), allocatable :: z(:, :), energy_of(:)
    real(wp) :: mean(2)
    integer  :: block, n_blocks

    energy = 0.0_wp
    if (.not. allocated(operators%control)) return
    n_blocks = (body%n + n_block - 1) / n_block
    allocate (energy_of(n_blocks))
    allocate (z(body%n, 2), source=0.0_wp)
    call operators%add_control(state%displacement, z)
    mean = matmul(body%volume, state%displacement) / sum(body%volume)
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n_blocks, body, solid, operators, state, z, mean, energy_of)
    do block = 1, n_blocks
      energy_of(block) = control_energy_of_block((block - 1) * n_block + 1, &
        min(block * n_block, body%n), body%volume, operators%control, solid%k_inverse, &
        state%deformation_gradient, state%displacement, mean, z)
    end do
    !$omp end parallel do
    energy = sum(energy_of)
    if (energy < 0.0_wp) energy = 0.0_wp   ! not max: it would hide what is not a number
  end subroutine control_energy

  !> The same for points lo to hi.
  pure real(wp) function control_energy_of_block(lo, hi, volume, c, k_inverse, f, u, mean, z) &
    result(energy)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: volume(:), c(:), k_inverse(:, :), f(:, :), u(:, :), z(:, :)
    real(wp), intent(in) :: mean(2)   !! of u [m]
    real(wp) :: terms(n_block), determinant_of_k, kxx, kyy, kxy, hxx, hyy
    integer  :: i

    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    !$omp simd simdlen(8) private(determinant_of_k, kxx, kyy, kxy, hxx, hyy)
    do i = lo, hi
      ! voids have K^-1 = 0 and c = 0: the quotients stay finite
      determinant_of_k = 1.0_wp / max(k_inverse(i, 1) * k_inverse(i, 2) - k_inverse(i, 3)**2, &
        tiny(1.0_wp))
      kxx = k_inverse(i, 2) * determinant_of_k
      kyy = k_inverse(i, 1) * determinant_of_k
      kxy = -k_inverse(i, 3) * determinant_of_k
      hxx = f(i, 1) - 1.0_wp
      hyy = f(i, 4) - 1.0_wp
      terms(i - lo + 1) = -0.5_wp * volume(i) * ((u(i, 1) - mean(1)) * z(i, 1) &
        + (u(i, 2) - mean(2)) * z(i, 2) + c(i) * (kxx * (hxx**2 + f(i, 3)**2) &
        + kyy * (f(i, 2)**2 + hyy**2) + 2.0_wp * kxy * (hxx * f(i, 2) + f(i, 3) * hyy)))
    end do
    energy = block_sum(terms)
  end function control_energy_of_block

  !> The value of a column; not a number where there is none of this name.
  pure real(wp) function value_by_name(self, name) result(value)
    class(observation_t), intent(in) :: self
    character(*),         intent(in) :: name
    integer :: k

    value = ieee_value(1.0_wp, ieee_quiet_nan)
    do k = 1, size(self%names)
      if (self%names(k) == name) value = self%values(k)
    end do
  end function value_by_name

  !> Energy that came from nowhere [J/m].
  pure real(wp) function surplus(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    surplus = seen%value('kinetic_energy') + seen%value('strain_energy') &
      + seen%value('plastic_dissipation') + seen%value('damping_dissipation') &
      + seen%value('stabilisation_energy') - ledger%initial_kinetic_energy - ledger%external_work
  end function surplus

  !> Whether the run has gained as much energy from nowhere as was ever put into it. Not a number
  !> counts as running away.
  pure logical function running_away(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    running_away = .not. surplus(seen, ledger) <= max(ledger%largest_work, &
      ledger%initial_kinetic_energy) + tiny(1.0_wp)
  end function running_away

end module pd_observe
