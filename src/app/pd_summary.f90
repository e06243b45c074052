!> The derived figures of a run in words: what `--check` prints and the log begins with.
module pd_summary
  use, intrinsic :: iso_fortran_env, only: int64
  use pd_clock, only: clock_t
  use pd_forces, only: linear_forces
  use pd_input_types, only: input_t, material_input_t, random_field_input_t
  use pd_kinds, only: is_set, wp
  use pd_random_field, only: spread_of, spread_t
  use pd_model, only: model_t
  use pd_schedule, only: schedule_t
  use pd_state, only: state_t
  implicit none
  private

  public :: summary_t, summarise, estimated_seconds

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
    character(:), allocatable :: text
    integer  :: fewest, point
    real(wp) :: courant

    associate (body => model%body, bonds => real(model%operators%bonds(), wp))
      call summary%add('title', input%run%title)
      call summary%add('body', number(body%upper(1) - body%lower(1))//' m x '// &
        number(body%upper(2) - body%lower(2))//' m')
      call summary%add('points', whole(body%n)//', of which fictitious '// &
        whole(count(body%boundary > 0)))
      call model%operators%fewest_bonds(fewest, point)
      call summary%add('bonds', number(bonds)//'; per point '// &
        number(bonds / real(body%n, wp))// &
        ' on average, '//whole(fewest)//' at least')
      call summary%add('horizon', number(model%delta)//' m, spacing '// &
        number(model%spacing)//' m: m = '//number(model%delta / model%spacing))
      call summary%add('wave speed', 'c_p = '//number(model%materials%wave_speed())//' m/s')
      call add_field(input%random_field, input%material, model, summary)
      courant = model%spacing / model%materials%wave_speed()
      text = number(clock%time_step)//' s = '//number(clock%time_step / courant)// &
        ' dx/c_p, rule '//input%integration%time_step_rule
      if (input%integration%time_step_rule /= 'fixed') &
        text = text//', safety '//number(input%integration%safety)
      call summary%add('time step', text)
      if (model%highest_frequency > 0.0_wp) call summary%add('stable step', &
        '2/omega_max = '//number(2.0_wp / model%highest_frequency)//' s, of the elastic body')
      call summary%add('steps', whole(schedule%steps)//' to '//number(schedule%end_time)//' s')
      if (model%platens%axis > 0) call summary%add('platens', &
        model%boundaries(model%platens%first)%name//' and '// &
        model%boundaries(model%platens%second)%name//', '//number(model%platens%length)// &
        ' m apart')
      call add_loads(input, model, summary)
      call summary%add('frames', whole(size(schedule%frame_steps))// &
        ' and the unloaded state; history rows '//whole(schedule%rows))
      call summary%add('memory', number(memory(model) / 1.0e6_wp)//' MB')
    end associate
  end function summarise

  !> The random field and what it has come to over the body, the weak patch included.
  subroutine add_field(field, material, model, summary)
    type(random_field_input_t), intent(in)    :: field
    type(material_input_t),     intent(in)    :: material
    type(model_t),              intent(in)    :: model
    type(summary_t),            intent(inout) :: summary
    type(spread_t) :: spread
    integer :: weaker

    if (.not. is_set(field%coefficient_of_variation)) return
    associate (strength => model%strength(model%operators%storage%row), &
      inside => model%body%boundary == 0)
      spread = spread_of(strength, model%body%volume, inside)
      weaker = 0
      if (min(material%kinematic_modulus, material%isotropic_modulus) < 0.0_wp) &
        weaker = count(inside .and. strength < material%residual_strength)
    end associate
    call summary%add('random field', 'coefficient of variation '// &
      number(field%coefficient_of_variation)//', correlation length '// &
      number(field%correlation_length)//' m, seed '//whole(field%seed))
    call summary%add('yield stress', 'mean '//number(spread%mean)//' Pa, coefficient of '// &
      'variation '//number(spread%variation)//', from '//number(spread%smallest)//' to '// &
      number(spread%largest)//' Pa')
    if (weaker > 0) call summary%add('no softening', 'at '//whole(weaker)//' points, which are '// &
      'weaker than residual_strength')
  end subroutine add_field

  !> Platens that move under a load, and pressures.
  subroutine add_loads(input, model, summary)
    type(input_t),   intent(in)    :: input
    type(model_t),   intent(in)    :: model
    type(summary_t), intent(inout) :: summary
    character(*), parameter :: per_length = ' N/m in all'
    character(:), allocatable :: on
    integer :: k

    do k = 1, size(input%boundaries)
      associate (given => input%boundaries(k), boundary => model%boundaries(k))
        if (.not. any(boundary%held)) cycle
        call summary%add('traction', number(given%traction(1))//', '// &
          number(given%traction(2))//' Pa on '//given%name//': '//number(boundary%applied(1))// &
          ', '//number(boundary%applied(2))//per_length//whole_from(given%ramp_time))
      end associate
    end do
    do k = 1, size(input%pressures)
      associate (given => input%pressures(k), pressure => model%pressures(k))
        on = ' m of the body'
        if (any(model%points%in_body(pressure%points) < 0.5_wp)) on = on//' and layers that continue it'
        call summary%add('pressure', given%name//': '//number(given%value)//' Pa on '// &
          given%side//', '//number(pressure%length)//on//', '// &
          whole(size(pressure%points))//' points: '//number(abs(sum(pressure%force)))// &
          per_length//whole_from(given%ramp_time))
      end associate
    end do

  contains

    function whole_from(ramp_time) result(text)
      real(wp), intent(in) :: ramp_time   !! [s]
      character(:), allocatable :: text

      text = ''
      if (ramp_time > 0.0_wp) text = ', whole from '//number(ramp_time)//' s'
    end function whole_from

  end subroutine add_loads

  !> Memory of a run [bytes]: bonds; per point the fields of the state, what is fixed (10 numbers),
  !> work space (4), a field of a frame on its way to the disk (5).
  real(wp) function memory(model)
    type(model_t), intent(in) :: model
    type(state_t) :: state

    memory = model%operators%memory() &
      + real(model%operators%n, wp) * 8.0_wp * real(state%numbers_per_point() + 10 + 4 + 5, wp)
  end function memory

  !> Wall clock time of the run [s], from the fastest of a few applications of the linear operator
  !> to this very model.
  real(wp) function estimated_seconds(model, schedule) result(seconds)
    type(model_t),    intent(inout) :: model
    type(schedule_t), intent(in) :: schedule
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
    seconds = whole_step * seconds * real(schedule%steps, wp)
  end function estimated_seconds

  !> Up to five significant digits.
  pure function number(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text
    character(24) :: buffer
    character(8)  :: form
    integer :: decimals

    if (abs(x) >= 1.0e7_wp .or. (abs(x) < 1.0e-3_wp .and. abs(x) > 0.0_wp)) then
      write (buffer, '(es12.4)') x
    else if (abs(x - anint(x)) <= 1.0e-9_wp * abs(x)) then
      write (buffer, '(i0)') nint(x)
    else
      decimals = max(0, 4 - floor(log10(abs(x))))
      write (form, '(a,i0,a)') '(f24.', decimals, ')'
      write (buffer, form) x
      if (decimals > 0) buffer = buffer(:verify(trim(buffer), '0', back=.true.))
      if (buffer(len_trim(buffer):) == '.') buffer = buffer(:len_trim(buffer) - 1)
    end if
    text = trim(adjustl(buffer))
  end function number

  !> A whole number.
  pure function whole(i) result(text)
    integer, intent(in) :: i
    character(:), allocatable :: text
    character(12) :: buffer

    write (buffer, '(i0)') i
    text = trim(buffer)
  end function whole

end module pd_summary
