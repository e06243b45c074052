!> What a run tells about itself: one number per column of the history.
!>
!> A column knows its name, and how its value is found; `pd_history_columns` lists all columns. The
!> blocks of rows are visited once, for all columns of a block while it is in the cache.
!> Source: doc/theory.md, section 10.
module pd_observe
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_clock, only: clock_t
  use pd_control_energy, only: control_energy
  use pd_kinds, only: block_sum, n_block, wp
  use pd_labels, only: label_t
  use pd_ledger, only: ledger_t
  use pd_model, only: model_t
  use pd_platens, only: nominal_strain
  use pd_state, only: state_t
  use pd_unbalanced, only: look_at_forces, unbalanced_t
  implicit none
  private

  public :: moment_t, block_view_t, row_view_t, column_t, observation_t
  public :: total, mean, largest, smallest
  public :: moment_at, observe, surplus, imbalance, over_work, noise

  !> When a state is looked at.
  type :: moment_t
    integer  :: step = 0
    real(wp) :: time = 0.0_wp                   !! [s]
    real(wp) :: strain = 0.0_wp                 !! nominal; 0 without platens
    type(ledger_t) :: ledger
    real(wp) :: time_step = 0.0_wp              !! dt of the step that ends here [s]
  end type moment_t

  !> A block of rows lo to hi of the fields as the columns see it; row 1 of the arrays is row lo.
  !> Rows behind the last one are 0, for sums go over whole blocks.
  type :: block_view_t
    type(model_t), pointer :: model => null()
    type(state_t), pointer :: state => null()
    integer  :: number = 0, lo = 1, hi = 0
    real(wp) :: weight(n_block)                 !! volume of a point of the body; fictitious: 0
    real(wp) :: p(n_block, 4)                   !! first Piola-Kirchhoff stress xx xy yx yy [Pa]
    real(wp) :: strain(n_block, 4)              !! xx yy zz xy
  end type block_view_t

  !> Energies below this part of an initial strain energy are round-off of it.
  real(wp), parameter :: noise = 1.0e-9_wp

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
    type(state_t), pointer :: state => null()
    type(moment_t) :: moment
    type(observation_t) :: seen                 !! columns from blocks, and those before this one
    type(unbalanced_t) :: unbalanced            !! forces
    real(wp) :: control_energy = 0.0_wp         !! stored in the control [J/m]
    integer  :: boundary = 0, component = 0, probe = 0   !! that the column is about
  end type row_view_t

  !> A column of the history: its value comes from the blocks or from elsewhere.
  type, extends(label_t) :: column_t
    logical :: whole_number = .false.
    integer :: joined = 0                       !! how, where there are parts of blocks
    procedure(part_of_block), pointer, nopass :: part => null()
    procedure(value_of_row), pointer, nopass :: value => null()
    integer :: boundary = 0, component = 0, probe = 0   !! that it is about, if it is
  end type column_t

  abstract interface
    !> What a block of points gives to a column.
    pure real(wp) function part_of_block(block)
      import :: block_view_t, wp
      type(block_view_t), intent(in) :: block
    end function part_of_block
    !> A value that comes from elsewhere.
    real(wp) function value_of_row(row)
      import :: row_view_t, wp
      type(row_view_t), intent(in) :: row
    end function value_of_row
  end interface

contains

  !> The moment that a clock shows.
  pure type(moment_t) function moment_at(clock, model, state, ledger) result(moment)
    type(clock_t),  intent(in) :: clock
    type(model_t),  intent(in) :: model
    type(state_t),  intent(in) :: state
    type(ledger_t), intent(in) :: ledger

    moment%step = clock%step
    moment%time = clock%time()
    moment%strain = nominal_strain(model%platens, state%displacement)
    moment%ledger = ledger
    moment%time_step = clock%time_step
  end function moment_at

  !> The values of all columns.
  subroutine observe(columns, model, state, moment, seen)
    type(column_t),        intent(in)    :: columns(:)
    type(model_t), target, intent(in)    :: model
    type(state_t), target, intent(in)    :: state
    type(moment_t),        intent(in)    :: moment
    type(observation_t),   intent(out)   :: seen
    type(row_view_t) :: row
    real(wp) :: held
    integer  :: k

    row%model => model
    row%state => state
    row%moment = moment
    call control_energy(model%operators, model%points%volume, state%displacement, &
      state%displacement_gradient, row%control_energy)
    call model%operators%relaxing_energy(state%control_memory, held)
    row%control_energy = row%control_energy + held
    call look_at_forces(model, state, moment%time, row%unbalanced)
    allocate (row%seen%names(size(columns)), source=columns%name)
    allocate (row%seen%values(size(columns)), source=ieee_value(1.0_wp, ieee_quiet_nan))
    call observe_blocks(columns, model, state, row%seen%values)
    do k = 1, size(columns)
      if (.not. associated(columns(k)%value)) cycle
      row%boundary = columns(k)%boundary
      row%component = columns(k)%component
      row%probe = columns(k)%probe
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
    integer :: block, k

    allocate (parts(size(columns), model%blocks%count), weights(model%blocks%count))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(columns, model, state, parts, weights)
    do block = 1, model%blocks%count
      call look_at_block(block, columns, model, state, parts(:, block), weights(block))
    end do
    !$omp end parallel do
    do k = 1, size(columns)
      if (.not. associated(columns(k)%part)) cycle
      select case (columns(k)%joined)
      case (total)
        values(k) = model%blocks%total(parts(k, :))
      case (mean)
        values(k) = model%blocks%total(parts(k, :)) / model%blocks%total(weights)
      case (largest)
        values(k) = model%blocks%largest(parts(k, :))
      case (smallest)
        values(k) = model%blocks%smallest(parts(k, :))
      case default   ! not one of them: not a number
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
    block%number = number
    block%lo = model%blocks%lo(number)
    block%hi = model%blocks%hi(number)
    call fill_view(model, state, block)
    weight = block_sum(block%weight)
    parts = 0.0_wp
    do k = 1, size(columns)
      if (associated(columns(k)%part)) parts(k) = columns(k)%part(block)
    end do
  end subroutine look_at_block

  !> Weights, stress and strain of a block; without a branch.
  pure subroutine fill_view(model, state, block)
    type(model_t),      intent(in)    :: model
    type(state_t),      intent(in)    :: state
    type(block_view_t), intent(inout) :: block

    if (block%hi - block%lo + 1 < n_block) then
      block%weight = 0.0_wp
      block%p = 0.0_wp
      block%strain = 0.0_wp
    end if
    block%weight(:block%hi - block%lo + 1) = model%points%in_body(block%lo:block%hi) &
      * model%points%volume(block%lo:block%hi)
    call model%materials%first_piola_block(block%number, state%displacement_gradient, &
      state%stress, block%strain, block%p)
  end subroutine fill_view

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
      + seen%value('stabilisation_energy') - ledger%initial_kinetic_energy &
      - ledger%initial_strain_energy - seen%value('external_work')
  end function surplus

  !> What the balance lacks, over the largest work that was ever done or the initial kinetic energy;
  !> not a number where the state is not one.
  pure real(wp) function imbalance(seen, ledger)
    type(observation_t), intent(in) :: seen
    type(ledger_t),      intent(in) :: ledger

    imbalance = over_work(surplus(seen, ledger), ledger)
  end function imbalance

  !> An energy over the largest work that was ever done or the initial kinetic energy; beside an
  !> initial stress over its round-off at least.
  pure real(wp) function over_work(energy, ledger)
    real(wp),       intent(in) :: energy   !! [J/m]
    type(ledger_t), intent(in) :: ledger
    real(wp), parameter :: nothing = 1.0e-280_wp   !! [J/m]; keeps the quotient finite

    over_work = energy / max(ledger%largest_work, ledger%initial_kinetic_energy, &
      noise * ledger%initial_strain_energy, nothing)
  end function over_work

end module pd_observe
