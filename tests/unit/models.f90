!> Models from the texts of input files, for the suites of what reads and translates them.
module models
  use pd_body, only: body_t
  use pd_clock, only: clock_t
  use pd_doubt_list, only: doubts_t
  use pd_errors, only: error_list_t
  use pd_input, only: read_input
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_schedule, only: schedule_t
  use pd_setup, only: set_up_model
  use pd_setup_body, only: set_up_body
  use pd_setup_schedule, only: set_up_schedule
  implicit none
  private

  public :: made_t, made_of, problem
  public :: head, mesh, body, material, bottom, top, left, right, to_strain

  character(*), parameter :: head = '&run name = ''case'', operators = ''list'' /', &
    mesh = '&discretisation spacing = 0.1, horizon = 0.25 /', &
    body = '&body x_min = 0.0, x_max = 0.5, y_min = 1.0, y_max = 2.0 /', &
    material = '&material model = ''j2'', density = 2000.0, youngs_modulus = 50.0e6, ' &
    //'poissons_ratio = 0.3, yield_stress = 0.15e6, kinematic_modulus = -1.5e6, ' &
    //'residual_strength = 15.0e3 /', &
    bottom = '&boundary name = ''bottom'', side = ''bottom'' /', &
    top = '&boundary name = ''top'', side = ''top'', contact = ''smooth'', ' &
    //'velocity = 0.0, -0.01 /', &
    left = '&boundary name = ''left'', side = ''left'', contact = ''smooth'', ' &
    //'velocity = 0.02, 0.0 /', &
    right = '&boundary name = ''right'', side = ''right'', contact = ''rough'' /', &
    to_strain = '&integration final_strain = 0.016, time_step_rule = ''courant'', safety = 0.5 /'

  !> All that set-up makes of a text.
  type :: made_t
    type(input_t)    :: input
    type(model_t)    :: model
    type(schedule_t) :: schedule
    type(clock_t)    :: clock
    type(doubts_t) :: doubts
    type(error_list_t) :: errors
  end type made_t

contains

  !> Set up the model of groups; `time_step` as of a checkpoint.
  function made_of(groups, time_step) result(made)
    character(*), intent(in) :: groups
    real(wp),     intent(in), optional :: time_step
    type(made_t) :: made
    integer :: unit

    if (present(time_step)) made%clock%time_step = time_step
    open (newunit=unit, file='case.nml', access='stream', status='replace', action='write')
    write (unit) groups//achar(10)
    close (unit)
    call read_input('case.nml', made%input, made%errors)
    if (made%errors%count() > 0) return
    call set_up_body(made%input, made%model%body, made%doubts, made%errors, made%errors)
    if (made%errors%count() > 0) return
    call set_up_model(made%input, made%model, made%errors)
    if (made%model%body%runs%n > 0) call take_apart(made%model%body)
    if (made%errors%count() > 0) return
    call set_up_schedule(made%input, made%clock, made%model, made%schedule, made%errors)
  end function made_of

  !> Give the points of a body in runs a number each, for suites to look at.
  subroutine take_apart(points)
    type(body_t), intent(inout) :: points
    integer :: i

    associate (ends => [1, points%n])
      points%position = points%positions(ends)
      points%volume = points%volumes(ends)
      points%part = points%parts(ends)
      points%boundary = points%boundaries(ends)
    end associate
    allocate (points%place(points%n, 2))
    do i = 1, points%n
      points%place(i, :) = points%runs%place_of(i)
    end do
  end subroutine take_apart

  !> The first problem, '' where there is none.
  function problem(made) result(text)
    type(made_t), intent(in) :: made
    character(:), allocatable :: text

    text = ''
    if (made%errors%count() > 0) text = made%errors%message(1)
  end function problem

end module models
