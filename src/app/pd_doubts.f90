!> What a run is asked while it goes on, lest a wrong answer comes without a word: its time step,
!> its balances of energy and force, its control, its flow. Doubts are told once, on the screen, in
!> the log and in the result file (`pd_doubt_list` has their kinds and thresholds); errors end it.
module pd_doubts
  use pd_doubt_list, only: is_doubtful
  use pd_errors, only: error_list_t, exit_file, outcome_t
  use pd_kinds, only: is_set, wp
  use pd_observe, only: imbalance, over_work
  use pd_quality, only: find_reaction_gap, kinetic_ratio, stress_times_strain
  use pd_record, only: record_doubts, record_line
  use pd_run, only: run_t
  use pd_run_end, only: fail, fastest_row, remedy
  use pd_text, only: integer_text, short_number
  use pd_timing, only: kernel_history
  use pd_zero_energy, only: zero_energy_ratio
  implicit none
  private

  public :: look_at_time_step, look_at_balance, look_at_frame, look_at_end

  !> The start of a motion is none of equilibrium: this part of the run is not asked about it.
  real(wp), parameter :: at_first = 0.2_wp

contains

  !> Tell a doubt: a line on the screen and in the log, and its number in the result file.
  subroutine tell(name, value, words, run, errors)
    character(*),       intent(in)    :: name    !! of its kind
    real(wp),           intent(in)    :: value   !! that was found
    character(*),       intent(in)    :: words
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    call run%doubts%note(name, value, run%clock%step)
    call record_line(run%record, 'warning: '//words//' ['//name//']', errors)
    call record_doubts(run%record, run%doubts, errors)
  end subroutine tell

  !> Whether a kind of doubt is due: its threshold is passed, and it has not been told yet.
  logical function is_new(name, value, run)
    character(*), intent(in) :: name
    real(wp),     intent(in) :: value
    type(run_t),  intent(in) :: run

    is_new = is_doubtful(name, value)
    if (is_new) is_new = .not. run%doubts%is_told(name)
  end function is_new

  !> Before a step: make it shorter if the body has strained so much that it is too long by now. A
  !> step that the user has fixed is only doubted, once.
  subroutine look_at_time_step(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    real(wp), parameter :: courant_safety = 0.9_wp   ! that of the input is of another limit
    type(error_list_t) :: errors
    logical :: found

    if (.not. run%limit%look_due(run%clock%step)) return
    call look_at_flow(run, errors)
    call run%limit%look(run%model, run%state, run%clock, &
      run%ledger%plastic_dissipation(run%model%blocks), found)
    if (found) then
      associate (given => run%input%integration)
        if (given%time_step_rule == 'fixed') then
          call doubt_time_step(run, errors)
        else if (given%time_step_rule == 'courant') then
          call shorten_time_step(courant_safety, run, outcome, errors)
        else
          call shorten_time_step(given%safety, run, outcome, errors)
        end if
      end associate
      call run%timing%lap(kernel_history)
    end if
    if (.not. outcome%done) call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine look_at_time_step

  !> Go back to a part of the stable step where half of the margin is used up.
  !> A body that goes on to collapse would have ever shorter steps: it has failed.
  subroutine shorten_time_step(safety, run, outcome, errors)
    real(wp),           intent(in)    :: safety
    type(run_t),        intent(inout) :: run
    type(outcome_t),    intent(inout) :: outcome
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: most = 0.95_wp   ! or one would have to look all the time
    real(wp) :: part, stable

    part = min(safety, most)
    stable = 2.0_wp / run%limit%frequency
    if (run%clock%time_step <= 0.5_wp * (1.0_wp + part) * stable) return
    if (part * stable < run%limit%shortest) then
      call fail('the stable time step has fallen below a thousandth of the first one', &
        fastest_row(run), run, outcome)
      return
    end if
    call run%clock%change_step(part * stable)
    call run%schedule%fit(run%clock)
    call record_line(run%record, 'time step shortened to '//short_number(run%clock%time_step)// &
      ' s at step '//integer_text(run%clock%step)//', time '//short_number(run%clock%time())// &
      ' s: 2/omega_max of the deformed body is now '//short_number(stable)//' s', errors)
  end subroutine shorten_time_step

  !> Warn of a time step beyond the stable one.
  subroutine doubt_time_step(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    associate (part => 0.5_wp * run%clock%time_step * run%limit%frequency)
      if (is_new('long_step', part, run)) call tell('long_step', part, 'the time step is too '// &
        'long for the deformed body at step '//integer_text(run%clock%step)//': 2/omega_max is '// &
        'now '//short_number(2.0_wp / run%limit%frequency)//' s; the rule spectral would '// &
        'shorten it', run, errors)
    end associate
  end subroutine doubt_time_step

  !> Flow that turns back meets a strength that kinematic softening has raised: told once, when it
  !> has made more than a twentieth of the heat.
  subroutine look_at_flow(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    if (run%doubts%is_told('flow_reversal') .or. .not. run%reversal%is_possible()) return
    call run%reversal%look(run%model%materials, run%model%blocks, run%model%points%volume, &
      run%state, run%ledger%plastic)
    associate (part => run%reversal%part())
      if (is_new('flow_reversal', part, run)) call tell('flow_reversal', part, 'the flow turns '// &
        'back: at step '//integer_text(run%clock%step)//', '//short_number(100.0_wp * part)// &
        ' % of the plastic heat is of flow against the back stress; kinematic softening makes '// &
        'the material stronger backwards, up to 2 sigma_y - sigma_r; isotropic_modulus does not', &
        run, errors)
    end associate
  end subroutine look_at_flow

  !> A balance of energies that lacks more than 1 % is a doubt, told once; more than a tenth is a
  !> failure: the row is not called good, whether energy came or went.
  !>
  !> Loads and platens that set in at once excite motions at the frequency of the steps, whose
  !> energy the scheme does not see rightly. That error stays while the work grows: the first steps
  !> fail only where they have gained as much energy as was put in, and the very first one, after
  !> which loads have given half a kick and no work has been done, not at all.
  subroutine look_at_balance(run, outcome, errors)
    type(run_t),        intent(inout) :: run
    type(outcome_t),    intent(inout) :: outcome
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: failed = 0.1_wp
    integer,  parameter :: first_steps = 20
    real(wp) :: lacking
    logical  :: first, early

    first = run%clock%step <= first_steps .and. .not. run%schedule%is_over(run%clock) &
      .and. .not. run%model%at_equilibrium
    if (first .and. run%clock%step == 1) return
    lacking = imbalance(run%record%seen, run%ledger)
    early = run%model%at_equilibrium .and. &
      run%clock%time() < at_first * run%schedule%end_time   ! there is hardly any work yet
    if (first .and. lacking <= 1.0_wp) return
    if (.not. abs(lacking) <= failed .and. .not. run%model%at_equilibrium) then
      call fail('the energy balance is off by '//short_number(100.0_wp * lacking)// &
        ' % of the work, at most 10 %', fastest_row(run), run, outcome)
    else if (is_new('energy_balance', abs(lacking), run) .and. .not. early) then
      call tell('energy_balance', abs(lacking), 'the energy balance is off by '// &
        short_number(100.0_wp * lacking)//' % of the work at step '// &
        integer_text(run%clock%step)//'; above 1 % '//remedy(run)//' is due', run, errors)
    end if
    if (outcome%done) return
    if (.not. early) call look_at_control(run, errors)
    call look_at_equilibrium(run, errors)
  end subroutine look_at_balance

  !> A control of zero-energy modes with more than 1 % of the work carries load that the material
  !> may not be able to: told once.
  subroutine look_at_control(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp) :: part

    part = over_work(run%record%seen%value('stabilisation_energy'), run%ledger)
    if (is_new('control_work', part, run)) call tell('control_work', part, 'the control of '// &
      'zero-energy modes has '//short_number(100.0_wp * part)//' % of the work at step '// &
      integer_text(run%clock%step)//'; above 1 % it carries load that the material may not: a '// &
      'weaker control is due (&stabilisation factor, relaxing_strain)', run, errors)
  end subroutine look_at_control

  !> Forces that are not in balance where they are meant to be: told once.
  !>
  !> On the way of equilibrium increments that did not come to rest. In a damped motion, which is
  !> meant to follow equilibrium, a damping that carries a sizeable part of the load, kinetic
  !> energy, and platens that push with different forces.
  subroutine look_at_equilibrium(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp) :: part, gap
    character(*), parameter :: cures = ': slower loading, less damping, or method = '// &
      '''equilibrium'''

    part = stress_times_strain(run)
    if (is_new('stress_strain', part, run)) &
      call tell('stress_strain', part, 'mean stress times '// &
      'strain is '//short_number(100.0_wp * part)//' % of the yield stress at step '// &
      integer_text(run%clock%step)//': Green-Lagrange strain then softens the body by its '// &
      'geometry alone; strain_measure = ''logarithmic'' does not', run, errors)
    call find_reaction_gap(run, gap)
    if (run%model%at_equilibrium) then
      call look_at_increments(run, errors)
    else if (run%clock%time() >= at_first * run%schedule%end_time) then
      part = run%record%seen%value('damping_share')
      if (is_new('damping_share', part, run)) call tell('damping_share', part, 'forces of the '// &
        'damping are '//short_number(100.0_wp * part)//' % of the reactions and loads at step '// &
        integer_text(run%clock%step)//'; stresses then depend on rate and damping'//cures, run, &
        errors)
      part = 0.0_wp
      if (run%model%damping > 0.0_wp) part = kinetic_ratio(run)
      if (is_new('kinetic_ratio', part, run)) call tell('kinetic_ratio', part, 'the kinetic '// &
        'energy is '//short_number(100.0_wp * part)//' % of the internal one at step '// &
        integer_text(run%clock%step)//'; a damped motion is meant to follow equilibrium: '// &
        'slower loading, more damping, or method = ''equilibrium''', run, errors)
      if (is_new('reaction_gap', gap, run)) call tell('reaction_gap', gap, 'the reactions of '// &
        'the platens are apart by '//short_number(100.0_wp * gap)//' % at step '// &
        integer_text(run%clock%step)//'; what is between them goes into inertia and damping'// &
        cures, run, errors)
    end if
  end subroutine look_at_equilibrium

  !> On the way of equilibrium: flow, jumps, and an increment that did not come to rest.
  subroutine look_at_increments(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    call look_at_flow(run, errors)
    call tell_of_jump(run, errors)
    associate (unfinished => run%increments%unfinished)
      if (run%doubts%is_told('no_rest') .or. unfinished%step == 0) return
      call tell('no_rest', unfinished%number, 'an increment was taken that is not at rest: the '// &
        'unbalanced force at step '//integer_text(unfinished%step)//' is '// &
        short_number(unfinished%number)//' of the reactions and loads; '//remedy(run)// &
        ', or a control of zero-energy modes, may help', run, errors)
    end associate
  end subroutine look_at_increments

  !> At a frame: noise of zero-energy modes.
  subroutine look_at_frame(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: cure
    real(wp) :: ratio

    if (run%doubts%is_told('zero_energy')) return
    ratio = zero_energy_ratio(run%model, run%state)
    if (.not. is_doubtful('zero_energy', ratio)) return
    cure = 'a control of zero-energy modes (&stabilisation) takes them out'
    if (run%input%stabilisation%method /= 'none') cure = 'a stronger control takes them out'
    call tell('zero_energy', ratio, 'the displacements are noisy: at step '// &
      integer_text(run%clock%step)//' zero-energy modes, which no stress resists, are '// &
      short_number(ratio)//' times the strain where nothing has flowed; '//cure, run, errors)
  end subroutine look_at_frame

  !> At the end: a strain that a long last step has passed.
  subroutine look_at_end(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    real(wp) :: part

    call look_at_frame(run, errors)
    associate (asked => run%input%integration%final_strain, reached => run%record%moment%strain)
      part = 1.0_wp
      if (is_set(asked)) part = reached / asked
      if (is_new('overshoot', part, run)) &
        call tell('overshoot', part, 'the run ends at a strain '// &
        'of '//short_number(reached)//', final_strain is '//short_number(asked)//': steps are '// &
        'too long for the velocity of the platens', run, errors)
    end associate
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine look_at_end

  !> Where no equilibrium is near, the next one may be far: told once.
  subroutine tell_of_jump(run, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: sizeable = 1.0e-2_wp   ! of all work

    if (run%jump_told) return
    if (over_work(run%increments%jump%number, run%ledger) <= sizeable) return
    run%jump_told = .true.
    call record_line(run%record, 'a jump at step '//integer_text(run%increments%jump%step)// &
      ': no equilibrium was near, and '//short_number(run%increments%jump%number)// &
      ' J/m were set free on the way to the next one (damping_dissipation)', errors)
  end subroutine tell_of_jump

end module pd_doubts
