!> The values of a run as lines "group.key = value": for the provenance of results, and to name
!> what differs from the run that a checkpoint belongs to.
module pd_used_values
  use pd_errors, only: error_list_t
  use pd_input_types, only: boundary_input_t, input_t, pressure_input_t
  use pd_kinds, only: wp
  use pd_text, only: integer_text, number_text, read_number, shortened
  implicit none
  private

  public :: used_values, compare_used

  type :: line_t
    character(:), allocatable :: text
  end type line_t

  !> Lines that are collected one by one.
  type :: lines_t
    type(line_t), allocatable :: list(:)
    integer :: n = 0
  contains
    procedure :: add
    procedure :: add_text
    procedure :: add_real
    procedure :: add_reals
    procedure :: add_integer
  end type lines_t

  character(*), parameter :: equals = ' = '

contains

  !> All values as used, defaults included, in the order of the reference; numbers with as many
  !> digits as read back to the same bits, 'none' where there is no value. Bodies carry their
  !> number, boundaries and pressures their name: body(1).x_min, boundary(top).velocity.
  function used_values(input) result(values)
    type(input_t), intent(in) :: input
    character(:), allocatable :: values(:)
    type(lines_t) :: lines
    integer :: i, longest

    call add_run(input, lines)
    do i = 1, size(input%boundaries)
      call add_boundary(input%boundaries(i), lines)
    end do
    do i = 1, size(input%pressures)
      call add_pressure(input%pressures(i), lines)
    end do
    call add_rest(input, lines)
    longest = 1
    do i = 1, lines%n
      longest = max(longest, len(lines%list(i)%text))
    end do
    allocate (character(longest) :: values(lines%n))
    do i = 1, lines%n
      values(i) = lines%list(i)%text
    end do
  end function used_values

  subroutine add_run(input, lines)
    type(input_t), intent(in)    :: input
    type(lines_t), intent(inout) :: lines
    character(:), allocatable :: body
    integer :: i

    call lines%add_text('run.name', input%run%name)
    call lines%add_text('run.title', input%run%title)
    call lines%add_text('run.output_dir', input%run%output_dir)
    call lines%add_text('run.operators', input%run%operators)
    associate (d => input%discretisation)
      call lines%add_real('discretisation.spacing', d%spacing)
      call lines%add_real('discretisation.horizon', d%horizon)
      call lines%add_text('discretisation.layout', d%layout)
      call lines%add_text('discretisation.volumes', d%volumes)
      call lines%add_text('discretisation.influence', d%influence)
      call lines%add_text('discretisation.fit', d%fit)
    end associate
    do i = 1, size(input%bodies)
      body = 'body('//integer_text(i)//').'
      call lines%add_text(body//'shape', input%bodies(i)%shape)
      call lines%add_real(body//'x_min', input%bodies(i)%x_min)
      call lines%add_real(body//'x_max', input%bodies(i)%x_max)
      call lines%add_real(body//'y_min', input%bodies(i)%y_min)
      call lines%add_real(body//'y_max', input%bodies(i)%y_max)
      call lines%add_text(body//'file', input%bodies(i)%file)
    end do
    associate (m => input%material)
      call lines%add_text('material.model', m%model)
      call lines%add_text('material.strain_measure', m%strain_measure)
      call lines%add_real('material.density', m%density)
      call lines%add_real('material.youngs_modulus', m%youngs_modulus)
      call lines%add_real('material.poissons_ratio', m%poissons_ratio)
      call lines%add_real('material.yield_stress', m%yield_stress)
      call lines%add_real('material.kinematic_modulus', m%kinematic_modulus)
      call lines%add_real('material.isotropic_modulus', m%isotropic_modulus)
      call lines%add_real('material.residual_strength', m%residual_strength)
    end associate
  end subroutine add_run

  subroutine add_boundary(boundary, lines)
    type(boundary_input_t), intent(in)    :: boundary
    type(lines_t),          intent(inout) :: lines
    character(:), allocatable :: stem

    stem = 'boundary('//boundary%name//').'
    call lines%add_text(stem//'side', boundary%side)
    call lines%add_text(stem//'contact', boundary%contact)
    call lines%add_reals(stem//'velocity', boundary%velocity)
    call lines%add_reals(stem//'times', boundary%times)
    call lines%add_reals(stem//'velocities_x', boundary%velocities_x)
    call lines%add_reals(stem//'velocities_y', boundary%velocities_y)
    call lines%add_reals(stem//'velocity_gradient', boundary%velocity_gradient)
    call lines%add_reals(stem//'factors', boundary%factors)
    call lines%add_reals(stem//'traction', boundary%traction)
    call lines%add_real(stem//'ramp_time', boundary%ramp_time)
  end subroutine add_boundary

  subroutine add_pressure(pressure, lines)
    type(pressure_input_t), intent(in)    :: pressure
    type(lines_t),          intent(inout) :: lines
    character(:), allocatable :: stem

    stem = 'pressure('//pressure%name//').'
    call lines%add_text(stem//'side', pressure%side)
    call lines%add_reals(stem//'span', pressure%span)
    call lines%add_real(stem//'value', pressure%value)
    call lines%add_real(stem//'ramp_time', pressure%ramp_time)
  end subroutine add_pressure

  subroutine add_rest(input, lines)
    type(input_t), intent(in)    :: input
    type(lines_t), intent(inout) :: lines

    call lines%add_text('stabilisation.method', input%stabilisation%method)
    call lines%add_real('stabilisation.factor', input%stabilisation%factor)
    associate (t => input%integration)
      call lines%add_real('integration.end_time', t%end_time)
      call lines%add_real('integration.final_strain', t%final_strain)
      call lines%add_text('integration.time_step_rule', t%time_step_rule)
      call lines%add_real('integration.time_step', t%time_step)
      call lines%add_real('integration.safety', t%safety)
      call lines%add_real('integration.damping', t%damping)
      call lines%add_text('integration.damping_frame', t%damping_frame)
    end associate
    associate (p => input%imperfection)
      call lines%add_real('imperfection.amplitude', p%amplitude)
      call lines%add_real('imperfection.x', p%x)
      call lines%add_real('imperfection.y', p%y)
      call lines%add_real('imperfection.radius', p%radius)
    end associate
    associate (f => input%random_field)
      call lines%add_real('random_field.coefficient_of_variation', f%coefficient_of_variation)
      call lines%add_real('random_field.correlation_length', f%correlation_length)
      call lines%add_integer('random_field.seed', f%seed)
    end associate
    associate (o => input%output)
      call lines%add_reals('output.frame_strains', o%frame_strains)
      call lines%add_reals('output.frame_times', o%frame_times)
      call lines%add_integer('output.frame_count', o%frame_count)
      call lines%add_integer('output.history_count', o%history_count)
      call lines%add_real('output.checkpoint_every', o%checkpoint_every)
    end associate
  end subroutine add_rest

  subroutine add(self, key, value)
    class(lines_t), intent(inout) :: self
    character(*),   intent(in)    :: key, value
    type(line_t), allocatable :: longer(:)
    integer :: i

    if (.not. allocated(self%list)) allocate (self%list(64))
    if (self%n == size(self%list)) then
      allocate (longer(2*self%n))
      do i = 1, self%n
        call move_alloc(self%list(i)%text, longer(i)%text)
      end do
      call move_alloc(longer, self%list)
    end if
    self%n = self%n + 1
    self%list(self%n)%text = key//equals//value
  end subroutine add

  subroutine add_text(self, key, text)
    class(lines_t), intent(inout) :: self
    character(*),   intent(in)    :: key, text

    if (text == '') then
      call self%add(key, 'none')
    else
      call self%add(key, text)
    end if
  end subroutine add_text

  subroutine add_real(self, key, x)
    class(lines_t), intent(inout) :: self
    character(*),   intent(in)    :: key
    real(wp),       intent(in)    :: x

    call self%add(key, number_text(x))
  end subroutine add_real

  subroutine add_reals(self, key, x)
    class(lines_t), intent(inout) :: self
    character(*),   intent(in)    :: key
    real(wp),       intent(in)    :: x(:)
    character(26*size(x)) :: buffer
    character(:), allocatable :: number
    integer :: i, n

    n = 0
    do i = 1, size(x)
      number = number_text(x(i))
      if (i < size(x)) number = number//', '
      buffer(n + 1:n + len(number)) = number
      n = n + len(number)
    end do
    call self%add_text(key, buffer(:n))
  end subroutine add_reals

  subroutine add_integer(self, key, i)
    class(lines_t), intent(inout) :: self
    character(*),   intent(in)    :: key
    integer,        intent(in)    :: i

    call self%add(key, integer_text(i))
  end subroutine add_integer

  !> Name every value in which a run that is to go on differs from the run so far.
  !>
  !> May differ: everything of output, run.title, run.output_dir, run.operators, and a later end.
  subroutine compare_used(old, new, errors)
    character(*),       intent(in)    :: old(:), new(:)
    type(error_list_t), intent(inout) :: errors
    integer :: i, j

    do i = 1, size(new)
      if (may_differ(key_in(new(i)))) cycle
      j = place_in(old, key_in(new(i)))
      if (j == 0) then
        call report(key_in(new(i)), value_in(new(i)), 'nothing')
      else if (value_in(old(j)) /= value_in(new(i))) then
        if (.not. is_later_end(old(j), new(i))) &
          call report(key_in(new(i)), value_in(new(i)), value_in(old(j)))
      end if
    end do
    do j = 1, size(old)
      if (may_differ(key_in(old(j)))) cycle
      if (place_in(new, key_in(old(j))) == 0) &
        call report(key_in(old(j)), 'nothing', value_in(old(j)))
    end do

  contains

    subroutine report(key, found, allowed)
      character(*), intent(in) :: key, found, allowed
      character(:), allocatable :: or_later

      or_later = ''
      if (is_end(key) .and. allowed /= 'none' .and. found /= 'none') or_later = ' or more'
      call errors%add('differs from the run that is to go on', where=key, &
                      found=shortened(found), allowed=shortened(allowed)//or_later)
    end subroutine report

  end subroutine compare_used

  pure logical function may_differ(key)
    character(*), intent(in) :: key

    may_differ = index(key, 'output.') == 1 .or. key == 'run.title' .or. key == 'run.output_dir' &
      .or. key == 'run.operators'
  end function may_differ

  pure logical function is_end(key)
    character(*), intent(in) :: key

    is_end = key == 'integration.end_time' .or. key == 'integration.final_strain'
  end function is_end

  !> Whether both lines give the end of the run in the same manner, and the new one a later end.
  pure logical function is_later_end(old, new)
    character(*), intent(in) :: old, new
    character(:), allocatable :: problem_old, problem_new
    real(wp) :: x_old, x_new

    is_later_end = .false.
    if (.not. is_end(key_in(new))) return
    call read_number(value_in(old), x_old, problem_old)
    call read_number(value_in(new), x_new, problem_new)
    if (problem_old == '' .and. problem_new == '') is_later_end = x_new >= x_old
  end function is_later_end

  pure integer function place_in(lines, key) result(i)
    character(*), intent(in) :: lines(:), key

    do i = 1, size(lines)
      if (index(lines(i), key//equals) == 1) return
    end do
    i = 0
  end function place_in

  pure function key_in(line) result(key)
    character(*), intent(in) :: line
    character(:), allocatable :: key

    key = line(:max(0, index(line, equals) - 1))
  end function key_in

  pure function value_in(line) result(value)
    character(*), intent(in) :: line
    character(:), allocatable :: value

    value = trim(line(index(line, equals) + len(equals):))
  end function value_in

end module pd_used_values
