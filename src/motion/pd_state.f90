!> The state of a run: everything that changes from step to step at the points.
!>
!> `visit` is the table of its fields: everything that is done with all of them is a visitor.
module pd_state
  use pd_blocks, only: blocks_t
  use pd_fields, only: counting_t, field_visitor_t, scattering_t, state_field_t
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t
  use pd_pages, only: clear_rows, forget_rows
  use pd_ranks, only: messages_t
  implicit none
  private

  public :: state_t, block_work_t, n_news

  integer, parameter :: n_news = 4   !! numbers of which a step finds the largest on any rank

  !> Fields over all rows, fictitious points included; stress, history, strength and initial
  !> strain belong to the laws.
  type, extends(law_points_t) :: state_t
    real(wp), allocatable :: displacement(:, :)            !! u (n,2) [m]
    real(wp), allocatable :: velocity(:, :)                !! v (n,2) [m/s]
    real(wp), allocatable :: force(:, :)                   !! force density f (n,2) [N/m^3]
    real(wp), allocatable :: displacement_gradient(:, :)   !! H = F - I (n,4) xx xy yx yy
    real(wp), allocatable :: control_memory(:, :)          !! of the relaxing control (n,4) [m]
    real(wp), allocatable :: released(:, :)                !! by the stage, of f (n,2) [N/m^3]
    type(label_t), allocatable :: remembered(:)            !! columns of the history
    logical :: has_initial_strain = .false.                !! it is a field of this state
    logical :: in_stages = .false.                         !! `released` is needed
  contains
    procedure :: visit
    procedure :: allocate => allocate_state
    procedure :: scatter
    procedure :: forget
    procedure :: numbers_per_point
  end type state_t

  !> What the blocks return in a step. Added up in the order of the blocks, it has the same bits
  !> for any number of threads. Allocated once, not in every step.
  type :: block_work_t
    real(wp), allocatable :: damping(:, :)    !! work of the damping, see `pd_verlet` (4,blocks)
    real(wp), allocatable :: dissipated(:)    !! work of S on dE^p (blocks) [J/m]
    real(wp), allocatable :: relaxed(:)       !! dissipated by the relaxing control (blocks) [J/m]
    integer,  allocatable :: failed(:)        !! first row with det F <= 0, 0: none (blocks)
    integer,  allocatable :: flowed(:)        !! rows that flow in this step (blocks)
    real(wp), allocatable :: times(:, :)      !! clock at the ends of kernels (3,blocks) [s]
    integer :: news(n_news) = 0               !! in: of this rank; out: the largest of any
    integer, private :: told(n_news + 1) = 0
    type(messages_t), private :: messages
  contains
    procedure :: fit
    procedure :: begin_telling
    procedure :: hear
  end type block_work_t

  !> Make room for unloaded points, with memory for some rows only.
  type, extends(field_visitor_t) :: room_t
    integer :: n = 0
    integer :: kept(2) = 0              !! first and last of these rows
  contains
    procedure :: one_number => room_1
    procedure :: several_numbers => room_2
  end type room_t

  !> Forget all rows but some.
  type, extends(field_visitor_t) :: forgetting_t
    integer :: kept(2) = 0
  contains
    procedure :: one_number => forget_1
    procedure :: several_numbers => forget_2
  end type forgetting_t

contains

  !> Allocate for these blocks, unless that is done.
  subroutine fit(self, blocks)
    class(block_work_t), intent(inout) :: self
    type(blocks_t),      intent(in)    :: blocks

    if (allocated(self%failed)) then
      if (size(self%failed) == blocks%count) return
      deallocate (self%damping, self%dissipated, self%relaxed, self%failed, self%flowed, self%times)
    end if
    allocate (self%damping(4, blocks%count), self%dissipated(blocks%count), &
      self%relaxed(blocks%count), self%times(3, blocks%count), source=0.0_wp)
    allocate (self%failed(blocks%count), self%flowed(blocks%count), source=0)
  end subroutine fit

  !> Begin to tell the other ranks whether the state of this one failed, and its news. While this
  !> is on its way a step goes on: what it does with a state that has failed is looked at by nobody.
  subroutine begin_telling(self, blocks)
    class(block_work_t), intent(inout) :: self
    type(blocks_t),      intent(in)    :: blocks
    integer :: lowest

    lowest = minval(self%failed, mask=self%failed > 0)   ! huge where there is none
    self%told = [huge(lowest) - lowest, self%news]
    call blocks%ranks%begin_largest(self%told, self%messages)
  end subroutine begin_telling

  !> The first row of all whose state failed, 0: none; and the news.
  subroutine hear(self, failed_row)
    class(block_work_t), intent(inout) :: self
    integer,             intent(out)   :: failed_row

    call self%messages%await(self%told)
    failed_row = merge(huge(failed_row) - self%told(1), 0, self%told(1) > 0)
    self%news = self%told(2:)
  end subroutine hear

  !> Show all fields to a visitor.
  subroutine visit(self, visitor)
    class(state_t),         intent(inout) :: self
    class(field_visitor_t), intent(inout) :: visitor
    character(*), parameter :: tensor = 'xx yy zz xy'

    call visitor%field(state_field_t('displacement', 'm', 'displacement u', 'x y', &
      by_neighbours=.true.), self%displacement)
    call visitor%field(state_field_t('velocity', 'm/s', 'velocity v', 'x y'), self%velocity)
    call visitor%field(state_field_t('force', 'N/m^3', 'force density f, loads and control '// &
      'included', 'x y'), self%force)
    call visitor%field(state_field_t('displacement_gradient', '1', 'H = F - I', 'xx xy yx yy'), &
      self%displacement_gradient)
    call visitor%field(state_field_t('control_memory', 'm', 'residual that the relaxing '// &
      'control has let go, and that it holds, in the frame of the point', &
      'gone_x gone_y held_x held_y'), self%control_memory)
    if (self%in_stages) call visitor%field(state_field_t('released', 'N/m^3', 'change of the '// &
      'forces at the start of the stage', 'x y'), self%released)
    call visitor%field(state_field_t('stress', 'Pa', 'stress conjugate to the strain', tensor), &
      self%stress)
    if (self%has_initial_strain) call visitor%field(state_field_t('initial_strain', '1', &
      'strain before any motion, added to that of the motion', tensor), self%initial_strain)
    call visitor%field(state_field_t('strength', 'Pa', 'initial strength', '', &
      kept=.false.), self%strength)
    call visitor%field(state_field_t('history', '', 'what the laws remember', '', &
      columns=self%remembered), self%history)
  end subroutine visit

  !> The unloaded state of n rows.
  subroutine allocate_state(self, n, remembered, kept)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: n
    type(label_t),  intent(in)    :: remembered(:)   !! columns of the history
    integer, optional, intent(in) :: kept(2)         !! first and last row that is needed here
    type(room_t) :: room

    self%remembered = remembered
    room%n = n
    room%kept = [1, n]
    if (present(kept)) room%kept = kept
    call self%visit(room)
  end subroutine allocate_state

  subroutine room_1(self, about, values)
    class(room_t),         intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    if (allocated(values)) deallocate (values)
    allocate (values(self%n))
    call clear_rows(values, self%kept)
    if (abs(about%unloaded(1)) > 0.0_wp) values(self%kept(1):self%kept(2)) = about%unloaded(1)
  end subroutine room_1

  subroutine room_2(self, about, values)
    class(room_t),         intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)
    integer :: k

    if (allocated(values)) deallocate (values)
    allocate (values(self%n, about%width()))
    call clear_rows(values, self%kept)
    do k = 1, about%width()
      if (abs(about%unloaded(k)) > 0.0_wp) values(self%kept(1):self%kept(2), k) = about%unloaded(k)
    end do
  end subroutine room_2

  !> Keep nothing but these rows; the others are zero, or what they were.
  subroutine forget(self, kept)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: kept(2)
    type(forgetting_t) :: forgetting

    forgetting%kept = kept
    call self%visit(forgetting)
  end subroutine forget

  subroutine forget_1(self, about, values)
    class(forgetting_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    associate (unused => about)
    end associate
    call forget_rows(values, self%kept)
  end subroutine forget_1

  subroutine forget_2(self, about, values)
    class(forgetting_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)

    associate (unused => about)
    end associate
    call forget_rows(values, self%kept)
  end subroutine forget_2

  !> The state of n rows from that of some of them; the others are unloaded and at rest.
  subroutine scatter(self, rows, n)
    class(state_t), intent(inout) :: self
    integer,        intent(in)    :: rows(:), n
    type(scattering_t) :: spread_out

    allocate (spread_out%rows, source=rows)
    spread_out%n = n
    call self%visit(spread_out)
  end subroutine scatter

  !> Numbers per point in all fields.
  integer function numbers_per_point(self) result(numbers)
    class(state_t), intent(inout) :: self   !! visited, not changed
    type(counting_t) :: count

    call self%visit(count)
    numbers = count%numbers
  end function numbers_per_point

end module pd_state
