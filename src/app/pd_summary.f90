!> The derived figures of a run in words: what `--check` prints and the log begins with.
module pd_summary
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_clock, only: clock_t
  use pd_forces, only: linear_forces
  use pd_frame_fields, only: frame_field_t, frame_fields
  use pd_history_columns, only: history_columns
  use pd_input_types, only: input_t, material_input_t
  use pd_kinds, only: is_set, wp
  use pd_model, only: model_t
  use pd_observe, only: column_t
  use pd_random_field, only: spread_of, spread_t
  use pd_relaxation, only: numbers_per_row
  use pd_schedule, only: schedule_t
  use pd_state, only: state_t
  use pd_text, only: coordinate_text, number => short_number, whole => integer_text
  implicit none
  private

  public :: seconds_of_step, summary_t, summarise, estimated_seconds, memory_of_run

  integer, parameter :: line_length = 540   !! the longest title fits

  !> Lines of text.
  type :: summary_t
    character(line_length), allocatable :: lines(:)
  contains
    procedure :: add
  end type summary_t

contains

  !> Append 'label  text'.
  pure subroutine add(self, label, text)
    class(summary_t), intent(inout) :: self
    character(*),     intent(in)    :: label, text
    character(line_length), allocatable :: longer(:)
    character(20) :: column
    integer :: n

    n = 0
    if (allocated(self%lines)) n = size(self%lines)
    allocate (longer(n + 1))
    if (n > 0) longer(:n) = self%lines
    column = label
    longer(n + 1) = '  '//column//text
    call move_alloc(longer, self%lines)
  end subroutine add

  !> Points, bonds, lengths, time step, steps, memory.
  function summarise(input, model, clock, schedule) result(summary)
    type(input_t),    intent(in) :: input
    type(model_t),    intent(in) :: model
    type(clock_t),    intent(in) :: clock
    type(schedule_t), intent(in) :: schedule
    type(summary_t) :: summary
    integer :: fewest, point

    associate (body => model%body, bonds => real(model%operators%bonds(), wp))
      call summary%add('title', input%run%title)
      call summary%add('body', number(body%upper(1) - body%lower(1))//' m x '// &
        number(body%upper(2) - body%lower(2))//' m')
      call summary%add('points', whole(body%n)//', of which fictitious '// &
        whole(size(body%points_beside())))
      call model%operators%fewest_bonds(fewest, point)
      call summary%add('bonds', number(bonds)//'; per point '// &
        number(bonds / real(body%n, wp))// &
        ' on average, '//whole(fewest)//' at least')
      if (model%operators%hidden_bonds > 0) call summary%add('no bonds', &
        number(real(model%operators%hidden_bonds, wp))//' that would cross air or a cut')
      call add_imbalance(model, summary)
      call summary%add('horizon', number(model%delta)//' m, spacing '// &
        number(model%spacing)//' m: m = '//number(model%delta / model%spacing))
      call summary%add('wave speed', 'c_p = '//number(model%materials%wave_speed())//' m/s')
      call add_field(input, model, summary)
      if (model%at_equilibrium) then
        call summary%add('equilibrium', 'residual '//number(input%integration%residual)// &
          ' of reactions and loads, relaxation '//input%integration%relaxation)
        call summary%add('increments', whole(input%integration%increments)//' to '// &
          number(schedule%end_time)//' s, shorter ones where they are hard')
      else
        call add_time_step(input, model, clock, summary)
        call summary%add('steps', whole(schedule%steps)//' to '//number(schedule%end_time)//' s')
      end if
      associate (platens => model%platens, items => model%supports%items)
        if (platens%axis > 0) call summary%add('platens', items(platens%first)%support%name// &
          ' and '//items(platens%second)%support%name//', '//number(platens%length)//' m apart')
      end associate
      call add_loads(model, summary)
      call add_probes(model, summary)
      call summary%add('frames', whole(size(schedule%frame_steps))// &
        ' and the unloaded state; history rows '//whole(schedule%rows))
      call summary%add('disk', number((frames_on_disk(model, schedule) &
        + rows_on_disk(model, schedule)) / 1.0e6_wp)//' MB, of which frames '// &
        number(frames_on_disk(model, schedule) / 1.0e6_wp)//' MB')
      call summary%add('memory', number(memory_of_run(input, model) / 1.0e6_wp)//' MB')
    end associate
  end function summarise

  !> The time step, its rule, and the stable one.
  subroutine add_time_step(input, model, clock, summary)
    type(input_t),   intent(in)    :: input
    type(model_t),   intent(in)    :: model
    type(clock_t),   intent(in)    :: clock
    type(summary_t), intent(inout) :: summary
    character(:), allocatable :: text
    real(wp) :: courant

    courant = model%spacing / model%materials%wave_speed()
    text = number(clock%time_step)//' s = '//number(clock%time_step / courant)// &
      ' dx/c_p, rule '//input%integration%time_step_rule
    if (input%integration%time_step_rule /= 'fixed') &
      text = text//', safety '//number(input%integration%safety)
    call summary%add('time step', text)
    if (model%highest_frequency > 0.0_wp) call summary%add('stable step', &
      '2/omega_max = '//number(2.0_wp / model%highest_frequency)//' s, of the elastic body')
  end subroutine add_time_step

  !> How far a homogeneous stress is from equilibrium inside a cloud.
  subroutine add_imbalance(model, summary)
    type(model_t),   intent(in)    :: model
    type(summary_t), intent(inout) :: summary
    character(:), allocatable :: text

    if (model%unbalanced(1) < 0.0_wp) return
    text = number(model%unbalanced(1))
    if (model%unbalanced(2) >= 0.0_wp) &
      text = number(model%unbalanced(2))//', with plain weights '//text
    call summary%add('imbalance', text// &
      ': the force that a homogeneous stress leaves on a point inside, at most, over that at a '// &
      'surface; 0 on a lattice')
  end subroutine add_imbalance

  !> The random field, its statistics in every material that yields, and what grows with depth.
  subroutine add_field(input, model, summary)
    type(input_t),   intent(in)    :: input
    type(model_t),   intent(in)    :: model
    type(summary_t), intent(inout) :: summary
    integer :: k

    associate (field => input%random_field)
      if (is_set(field%coefficient_of_variation)) call summary%add('random field', &
        'coefficient of variation '//number(field%coefficient_of_variation)// &
        ', correlation length '//number(field%correlation_length)//' m, seed '//whole(field%seed))
      do k = 1, size(input%materials)
        associate (given => input%materials(k), several => size(input%materials) > 1)
          if (abs(given%youngs_modulus_gradient) > 0.0_wp) &
            call add_stiffness(k, given, several, model, summary)
          if (model%materials%list(k)%law%plastic_strain > 0 .and. &
            (is_set(field%coefficient_of_variation) .or. &
            abs(given%yield_stress_gradient) > 0.0_wp)) &
            call add_strength(k, given, several, model, summary)
        end associate
      end do
    end associate
  end subroutine add_field

  !> E of a material over the body.
  subroutine add_stiffness(k, material, several, model, summary)
    integer,                intent(in)    :: k          !! number of the material
    type(material_input_t), intent(in)    :: material
    logical,                intent(in)    :: several    !! it is not the only one
    type(model_t),          intent(in)    :: model
    type(summary_t),        intent(inout) :: summary
    character(:), allocatable :: of_which
    logical :: inside(model%operators%n)

    inside = model%materials%rows_of(k, model%operators%n) .and. model%points%in_body > 0.0_wp
    if (.not. any(inside)) return
    of_which = ''
    if (several) of_which = material%name//': '
    associate (stiffness => model%materials%stiffness)
      call summary%add('stiffness', of_which//'E from '// &
        number(material%youngs_modulus * minval(stiffness, mask=inside))//' to '// &
        number(material%youngs_modulus * maxval(stiffness, mask=inside))//' Pa')
    end associate
  end subroutine add_stiffness

  !> Yield stress of a material over the body, the weak patch included.
  subroutine add_strength(k, material, several, model, summary)
    integer,                intent(in)    :: k          !! number of the material
    type(material_input_t), intent(in)    :: material
    logical,                intent(in)    :: several    !! it is not the only one
    type(model_t),          intent(in)    :: model
    type(summary_t),        intent(inout) :: summary
    type(spread_t) :: spread
    character(:), allocatable :: of_which
    logical, allocatable :: inside(:)
    integer :: weaker

    associate (row => model%operators%storage%row(), rows => model%operators%n)
      associate (strength => model%strength(row), here => model%materials%rows_of(k, rows))
        inside = model%body%boundaries([1, model%body%n]) == 0 .and. here(row)
        if (.not. any(inside)) return   ! it is that of no body
        spread = spread_of(strength, model%points%volume(row), inside)
        weaker = 0
        if (min(material%kinematic_modulus, material%isotropic_modulus) < 0.0_wp) &
          weaker = count(inside .and. strength < material%residual_strength)
      end associate
    end associate
    of_which = ''
    if (several) of_which = material%name//': '
    call summary%add('yield stress', of_which//'mean '//number(spread%mean)// &
      ' Pa, coefficient of variation '//number(spread%variation)//', from '// &
      number(spread%smallest)//' to '//number(spread%largest)//' Pa')
    if (weaker > 0) call summary%add('no softening', of_which//'at '//whole(weaker)// &
      ' points, which are weaker than residual_strength')
  end subroutine add_strength

  !> Supports under a load, and loads.
  subroutine add_loads(model, summary)
    type(model_t),   intent(in)    :: model
    type(summary_t), intent(inout) :: summary
    integer :: k

    do k = 1, size(model%supports%items)
      associate (support => model%supports%items(k)%support)
        if (allocated(support%load_kind)) &
          call summary%add(support%load_kind, support%description())
      end associate
    end do
    do k = 1, size(model%loads%items)
      associate (load => model%loads%items(k)%load)
        call summary%add(load%kind, load%description())
      end associate
    end do
  end subroutine add_loads

  !> Points that the history follows.
  subroutine add_probes(model, summary)
    type(model_t),   intent(in)    :: model
    type(summary_t), intent(inout) :: summary
    integer :: k

    do k = 1, size(model%probes)
      associate (probe => model%probes(k), x => model%points%position(model%probes(k)%row, :))
        call summary%add('probe', probe%name//': point '// &
          whole(model%operators%storage%point_at(probe%row))//' at ('// &
          coordinate_text(x(1), model%spacing)//', '//coordinate_text(x(2), model%spacing)// &
          ') m, '//number(probe%distance)//' m from where it was asked for')
      end associate
    end do
  end subroutine add_probes

  !> Memory of a run [bytes]: operators; per row the fields of the state, what does not change at
  !> the points (7 numbers), K^-1 (3), A (4), and what is needed at times: a field of a frame on its
  !> way to the disk (5), the points and a field of a checkpoint likewise (15), the search for the
  !> highest frequency of the strained body (21).
  real(wp) function memory_of_run(input, model) result(memory)
    type(input_t), intent(in) :: input
    type(model_t), intent(in) :: model
    type(state_t) :: state
    integer, parameter :: of_body_force = 3
    integer :: numbers, at_times, k

    state%remembered = model%materials%remembered()
    state%has_initial_strain = is_set(input%initial_stress%k0)
    at_times = 5
    if (input%output%checkpoint_due(huge(1.0_wp), last=.false.)) at_times = at_times + 15
    do k = 1, size(input%materials)
      if (input%materials(k)%strain_measure /= 'small') at_times = max(at_times, 21)
    end do
    numbers = state%numbers_per_point() + 7 + 3 + 4 + at_times
    if (state%has_initial_strain) numbers = numbers + of_body_force
    if (size(input%gravity%acceleration) > 0) numbers = numbers + of_body_force
    if (allocated(model%materials%stiffness)) numbers = numbers + 1
    if (model%at_equilibrium) numbers = numbers + numbers_per_row(state)
    memory = model%operators%memory() + real(model%operators%n, wp) * 8.0_wp * real(numbers, wp)
  end function memory_of_run

  !> Frames on the disk [bytes]: their numbers, and what names and describes them in both files.
  real(wp) function frames_on_disk(model, schedule) result(bytes)
    type(model_t),    intent(in) :: model
    type(schedule_t), intent(in) :: schedule
    type(frame_field_t), allocatable :: fields(:)
    real(wp), parameter :: around = 1.0e4_wp
    integer :: numbers, k

    call frame_fields(fields, model%whole%n > 0)
    numbers = 0
    do k = 1, size(fields)
      numbers = numbers + fields(k)%width()
    end do
    ! the unloaded state, and room for the state of a failure
    bytes = real(size(schedule%frame_steps) + 2, wp) * (around + 8.0_wp * real(numbers, wp) &
      * real(max(model%body%n, model%whole%n), wp))
  end function frames_on_disk

  !> The history on the disk [bytes]: 8 for a number in the result file, 24 in the CSV file.
  real(wp) function rows_on_disk(model, schedule) result(bytes)
    type(model_t),    intent(in) :: model
    type(schedule_t), intent(in) :: schedule
    type(column_t), allocatable :: columns(:)

    call history_columns(model, columns)
    bytes = 32.0_wp * real(size(columns), wp) * real(schedule%rows + 1, wp)
  end function rows_on_disk

  !> Estimated wall clock time of the run [s], from the fastest of a few applications of the linear
  !> operator to this model, and the time for which frames keep the disk busy.
  real(wp) function estimated_seconds(model, schedule) result(seconds)
    type(model_t),    intent(inout) :: model
    type(schedule_t), intent(in) :: schedule
    !> Evaluations of the forces that an increment takes until it is at rest, in soil that softens.
    real(wp), parameter :: moves = 300.0_wp
    !> Opening, closing and describing a frame [s]; bytes that a disk takes in a second.
    real(wp), parameter :: per_frame = 1.5e-3_wp, per_second = 3.0e8_wp

    seconds = seconds_of_step(model) * real(schedule%steps, wp)
    if (model%at_equilibrium) seconds = seconds * moves
    seconds = seconds + real(size(schedule%frame_steps) + 1, wp) * per_frame &
      + frames_on_disk(model, schedule) / per_second
  end function estimated_seconds

  !> Estimated wall clock time of a step [s].
  real(wp) function seconds_of_step(model) result(seconds)
    type(model_t), intent(inout) :: model
    !> A step with radial return, motion and energies against one with the linear operator.
    real(wp), parameter :: whole_step = 1.5_wp
    integer,  parameter :: repetitions = 5
    real(wp), allocatable :: u(:, :), h(:, :), f(:, :)
    integer(int64) :: start, finish, rate
    integer :: k

    allocate (h(model%operators%n, 4), f(model%operators%n, 2), source=0.0_wp)
    allocate (u(model%operators%n, 2), source=0.0_wp)
    seconds = huge(1.0_wp)
    do k = 1, repetitions
      call system_clock(start, rate)
      call linear_forces(model%operators, model%materials, u, h, f)
      call system_clock(finish)
      seconds = min(seconds, real(finish - start, wp) / real(rate, wp))
    end do
    seconds = whole_step * seconds
  end function seconds_of_step

end module pd_summary
