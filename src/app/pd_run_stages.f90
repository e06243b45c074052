!> From one stage of construction to the next.
!>
!> The points that stay keep their displacement, their stress and what their material remembers,
!> although their families are others now: strain counts from there on. What is new is without
!> stress, what is gone takes its energy along. The change of the forces comes in evenly over the
!> stage (a load, `pd_body_force`).
!> Source: doc/theory.md, section 7.
module pd_run_stages
  use pd_changes, only: changes_of
  use pd_division, only: divide_model
  use pd_doubt_list, only: doubts_t
  use pd_errors, only: error_list_t, exit_file, exit_input, exit_model, outcome_t
  use pd_fields, only: clearing_t
  use pd_forces, only: forces
  use pd_increment, only: begin_increments
  use pd_kinds, only: n_block, wp
  use pd_model, only: model_t, release_set_up
  use pd_observe, only: observation_t
  use pd_record, only: observe_state, record_line
  use pd_run, only: add_release, keep_standing_load, run_t, start_increments
  use pd_setup, only: set_up_model
  use pd_setup_changes, only: repeat_changes
  use pd_setup_stages, only: set_up_stage_body
  use pd_stability, only: find_highest_frequency
  use pd_text, only: short_number
  implicit none
  private

  public :: begin_stage_if_due

contains

  !> Begin the next stage where one has come to its end.
  !>
  !> Errors: a model that cannot be set up; a file.
  subroutine begin_stage_if_due(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    type(model_t) :: model
    real(wp), parameter :: round_off = 1.0e-9_wp

    if (outcome%done .or. run%clock%stage >= size(run%stages)) return
    if (run%clock%time() < run%stages(run%clock%stage)%end_time * (1.0_wp - round_off)) return
    call set_up_next(run, model, outcome)
    call outcome%agree(run%ranks)   ! one of them may be short of memory
    if (outcome%done) return
    call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
    call carry_over(run, model)
    run%clock%stage = run%clock%stage + 1
    call add_release(run%stages(run%clock%stage), run%state, run%model)
    call run%model%shared%bring(run%state%force)
    call run%model%supports%take_reactions(run%model%points%volume, run%clock%time(), &
      run%state%force)
    call enter_change(run)
    call find_highest_frequency(run%model)
    call start_increments(run)
    call begin_increments(run%increments, run%schedule, run%clock)
    associate (stage => run%stages(run%clock%stage))
      call record_line(run%record, 'stage '''//stage%name//''' begins at '// &
        short_number(run%clock%time())//' s', errors)
    end associate
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine begin_stage_if_due

  !> The model of the next stage.
  subroutine set_up_next(run, model, outcome)
    type(run_t),     intent(inout) :: run
    type(model_t),   intent(out)   :: model
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, input_errors
    type(doubts_t) :: heard_before

    model%whole = run%model%whole
    associate (stage => run%stages(run%clock%stage + 1))
      call set_up_stage_body(run%input, stage, model%whole, model%body, heard_before, &
        input_errors, errors)
      if (errors%count() + input_errors%count() == 0) &
        call set_up_model(run%input, model, errors, stage)
      if (errors%count() + input_errors%count() == 0) then
        call repeat_changes(changes_of(run%model%supports), model)
        call keep_standing_load(run, stage, model)
        call divide_model(run%ranks, model)
      end if
    end associate
    call outcome%end_if_any(input_errors, exit_input)
    call outcome%end_if_any(errors, exit_model)
  end subroutine set_up_next

  !> Go on with a model: state, blocks, and the change of the forces.
  subroutine carry_over(run, model)
    type(run_t),   intent(inout) :: run
    type(model_t), intent(inout) :: model
    type(clearing_t) :: clear
    real(wp), allocatable :: before(:, :)
    integer :: i

    associate (state => run%state)
      allocate (clear%rows(count(model%points%volume <= 0.0_wp)))
      clear%rows = pack([(i, i=1, size(model%points%volume))], model%points%volume <= 0.0_wp)
      call state%visit(clear)
      state%strength = model%strength
      allocate (before, source=state%force)
      call keep_stress(run, model)
      call find_forces(run, model)
      state%released = model%points%free * (state%force - before)
      state%force = state%force - state%released
    end associate
    call release_set_up(model)
    run%ledger = run%ledger%gathered(run%model%blocks)
    run%model = model
    call run%ledger%fit(run%model%blocks)
  end subroutine carry_over

  !> Families are others: count strain, and the residual of the control, from where they are now.
  subroutine keep_stress(run, model)
    type(run_t),   intent(inout) :: run
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: memory(:, :), strain(:, :)

    associate (state => run%state)
      allocate (memory, source=state%control_memory)
      allocate (strain, source=strain_of(run%model, state%displacement_gradient))
      call find_forces(run, model)
      state%initial_strain = state%initial_strain + strain &
        - strain_of(model, state%displacement_gradient)
      state%control_memory = memory   ! the strain of the first look made points flow
      call find_forces(run, model)
      memory(:, 1:2) = memory(:, 1:2) + state%control_memory(:, 3:4) - memory(:, 3:4)
      state%control_memory = memory
    end associate
  end subroutine keep_stress

  !> Strain of all rows, in the measures of a model.
  function strain_of(model, h) result(strain)
    type(model_t), intent(in) :: model
    real(wp),      intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp) :: strain(size(h, 1), 4), of_block(n_block, 4)
    integer  :: block

    strain = 0.0_wp
    do block = 1, model%blocks%count
      associate (lo => model%blocks%lo(block), hi => model%blocks%hi(block))
        call model%materials%strain_block(block, h, of_block)
        strain(lo:hi, :) = of_block(:hi - lo + 1, :)
      end associate
    end do
  end function strain_of

  !> Forces of the present state in a new model; stress and history stay.
  subroutine find_forces(run, model)
    type(run_t),   intent(inout) :: run
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: stress(:, :), history(:, :)
    integer :: failed_row

    associate (state => run%state)
      allocate (stress, source=state%stress)
      allocate (history, source=state%history)
      call forces(model, run%clock%time(), state, run%increments%relaxation%blocks, run%timing, &
        failed_row)
      state%stress = stress
      state%history = history
    end associate
  end subroutine find_forces

  !> Energy that has come and gone with points is work from outside.
  subroutine enter_change(run)
    type(run_t), intent(inout) :: run
    type(observation_t) :: before
    character(*), parameter :: energies(3) = [character(24) :: 'kinetic_energy', &
      'strain_energy', 'stabilisation_energy']
    integer :: k

    before = run%record%seen
    call observe_state(run%model, run%state, run%ledger, run%clock, run%record)
    do k = 1, size(energies)
      run%ledger%outer_work = run%ledger%outer_work &
        + run%record%seen%value(trim(energies(k))) - before%value(trim(energies(k)))
    end do
  end subroutine enter_change

end module pd_run_stages
