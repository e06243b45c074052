!> A run: what it consists of, and how it begins.
module pd_run
  use, intrinsic :: iso_fortran_env, only: compiler_version, int64, output_unit
  use omp_lib, only: omp_get_max_threads
  use pd_body_force, only: body_force_t, new_body_force
  use pd_checkpoint, only: checkpoint_mark, checkpoint_t
  use pd_checkpoint_fit, only: compare_history, compare_points
  use pd_clock, only: clock_t
  use pd_command_line, only: options_t
  use pd_division, only: divide_model
  use pd_doubt_list, only: doubts_t
  use pd_earlier_run, only: largest_reaction_before, load_doubts, look_for_end, results_in_the_way
  use pd_errors, only: error_list_t, exit_file, exit_input, exit_model, exit_ok, outcome_t
  use pd_files, only: meant_path, prepare_folder
  use pd_history_columns, only: history_columns
  use pd_increment, only: begin_increments, increments_t, new_increments
  use pd_input, only: read_input
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  use pd_ledger, only: ledger_t, new_ledger
  use pd_lock, only: lock_holder, lock_t, take_lock
  use pd_model, only: model_t, release_points, release_set_up, start
  use pd_observe, only: column_t, moment_at, observation_t, observe
  use pd_own_files, only: keep_inputs, lock_path
  use pd_plausibility, only: look_at_model, look_at_motion
  use pd_ranks, only: ranks_t
  use pd_record, only: observe_state, open_record, record_doubts, record_frame, record_line, &
    record_progress, record_row, record_t
  use pd_record_checkpoint, only: load_checkpoint
  use pd_reversal, only: new_reversal, reversal_t
  use pd_run_description, only: provenance_t
  use pd_schedule, only: schedule_t
  use pd_setup, only: set_up_model
  use pd_setup_changes, only: repeat_changes
  use pd_setup_schedule, only: set_up_schedule
  use pd_setup_stages, only: set_up_stage_body, set_up_whole
  use pd_size, only: look_at_memory, look_at_size
  use pd_stages, only: stage_t, stages_of
  use pd_state, only: state_t
  use pd_step, only: step_work_t
  use pd_step_limit, only: new_step_limit, step_limit_t
  use pd_summary, only: summarise, summary_t
  use pd_tables, only: new_table
  use pd_threads, only: choose_threads, spare_threads, words_on_cores
  use pd_timing, only: timing_t
  use pd_version, only: build_flags, code_version, git_hash
  implicit none
  private

  public :: run_t, set_up_run, open_outputs, start_increments, add_release
  public :: keep_standing_load

  type :: run_t
    type(ranks_t)      :: ranks               !! that share it
    type(input_t)      :: input
    type(stage_t), allocatable :: stages(:)
    type(model_t)      :: model
    type(schedule_t)   :: schedule
    type(clock_t)      :: clock
    type(step_limit_t) :: limit
    type(reversal_t)   :: reversal
    type(state_t)      :: state
    type(ledger_t)     :: ledger
    type(step_work_t)  :: work
    type(increments_t) :: increments          !! on the way of equilibrium
    type(lock_t)       :: lock                !! on the files of the run
    type(record_t)     :: record
    type(timing_t)     :: timing
    type(checkpoint_t) :: checkpoint          !! to continue from; no rows: a new run
    character(:), allocatable :: mark         !! of its file
    logical :: whole = .false.                !! files are open, and the state is one to go on from
    type(error_list_t) :: trouble             !! with files, in a step whose state is not whole
    logical :: heard = .false.                !! there have been news
    type(doubts_t)     :: doubts
    logical :: jump_told = .false.            !! at equilibrium
    real(wp) :: largest_reaction = 0.0_wp     !! of a platen so far [N/m]
    integer(int64) :: last_checkpoint = 0     !! count of the system clock
    real(wp) :: checkpoint_seconds = 0.0_wp   !! that it took
    integer(int64) :: loop_start = 0          !! count of the system clock
  end type run_t

contains

  !> Input, body, model, time step, and the state to begin with: unloaded, or of a checkpoint.
  subroutine set_up_run(options, run, outcome)
    type(options_t), intent(in)    :: options
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, input_errors

    call read_input(options%input_path, run%input, errors, options%settings)
    call outcome%end_if_any(errors, exit_input)
    if (outcome%done) return
    if (options%output_dir /= '') run%input%run%output_dir = options%output_dir
    run%input%run%output_dir = meant_path(run%input%run%output_dir)
    call keep_inputs(stem_of(run), run%input, errors)
    call outcome%end_if_any(errors, exit_file)
    if (.not. (options%check .or. outcome%done)) call look_for_earlier_run(options, run, outcome)
    if (outcome%done) return

    allocate (run%stages, source=stages_of(run%input))
    call look_at_size(run%input, run%ranks, options%check, errors)
    call spare_threads(options%threads, run%ranks%count, run%input)
    if (errors%count() == 0) call set_up_bodies(run, input_errors, errors)
    call outcome%end_if_any(input_errors, exit_input)
    call outcome%end_if_any(errors, exit_model)
    if (outcome%done) return
    call compare_points(run%checkpoint, run%model, run%input%path, errors)
    call outcome%end_if_any(errors, exit_input)
    if (outcome%done) return
    if (options%check) then   ! rank 0 tells of the whole model
      call set_up_model(run%input, run%model, errors, run%stages(run%checkpoint%clock%stage))
    else
      call set_up_model(run%input, run%model, errors, run%stages(run%checkpoint%clock%stage), &
        run%ranks)
    end if
    call try_later_stages(run, options%check, errors)
    call outcome%end_if_any(errors, exit_model)
    if (outcome%done) return
    if (allocated(run%checkpoint%changes)) &
      call repeat_changes(run%checkpoint%changes, run%model)
    call keep_standing_load(run, run%stages(run%checkpoint%clock%stage), run%model)
    call look_at_model(run%input, run%model, run%doubts)
    call compare_history(run%checkpoint, run%state, run%model, run%input%path, errors)
    call outcome%end_if_any(errors, exit_file)
    if (outcome%done) return
    if (.not. options%check) call divide_run(run, outcome)
    if (outcome%done) return
    run%clock = run%checkpoint%clock
    run%limit = run%checkpoint%limit
    call set_up_schedule(run%input, run%clock, run%model, run%schedule, errors)
    if (run%checkpoint%history_rows == 0) &
      run%limit = new_step_limit(run%model%highest_frequency, run%clock%time_step)
    if (errors%count() == 0) call look_at_motion(run%input, run%stages, run%clock, run%schedule, &
      run%model, run%doubts, errors)
    call outcome%end_if_any(errors, exit_input)
    if (outcome%done .or. options%check) return
    if (run%model%at_equilibrium) then
      call start_increments(run)
      if (run%clock%step == 0) call begin_increments(run%increments, run%schedule, run%clock)
    end if
    if (run%ranks%count == 1) call choose_threads(options%threads, run%model)
    call begin_state(run)
  end subroutine set_up_run

  !> Divide the model among the ranks, if all of them have set it up.
  subroutine divide_run(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome

    call outcome%agree(run%ranks)
    if (outcome%done) return
    call run%ranks%largest_numbers(run%doubts%step)   ! what has been told is not looked at again
    call release_points(run%model%body)
    call divide_model(run%ranks, run%model)
  end subroutine divide_run

  !> The body of the present stage and, where there are several, the points of all of them.
  subroutine set_up_bodies(run, input_errors, errors)
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: input_errors, errors

    call set_up_whole(run%input, run%stages, run%model%whole, input_errors, errors)
    if (errors%count() + input_errors%count() > 0) return
    call set_up_stage_body(run%input, run%stages(run%checkpoint%clock%stage), run%model%whole, &
      run%model%body, run%doubts, input_errors, errors)
  end subroutine set_up_bodies

  !> Set up the models of all stages before the first one runs, and look whether there is memory
  !> for the run, unless it is only checked.
  subroutine try_later_stages(run, only_checked, errors)
    type(run_t),        intent(in)    :: run
    logical,            intent(in)    :: only_checked
    type(error_list_t), intent(inout) :: errors
    type(doubts_t) :: unheard
    type(model_t) :: model, empty
    integer :: k

    do k = run%checkpoint%clock%stage + 1, size(run%stages)
      if (errors%count() > 0) return
      model = empty
      model%whole = run%model%whole
      call set_up_stage_body(run%input, run%stages(k), model%whole, model%body, unheard, errors, &
        errors)
      if (errors%count() == 0) call set_up_model(run%input, model, errors, run%stages(k))
      if (errors%count() > 0) call errors%add('that is in the stage '''//run%stages(k)%name//'''')
    end do
    if (errors%count() == 0 .and. .not. only_checked) &
      call look_at_memory(run%input, run%model, run%ranks, errors)
  end subroutine try_later_stages

  !> Increments of the present stage.
  subroutine start_increments(run)
    type(run_t), intent(inout) :: run
    real(wp) :: duration

    associate (given => run%input%integration, stage => run%stages(run%clock%stage))
      duration = min(stage%end_time, run%schedule%end_time) - stage%start_time
      call new_increments(run%model, duration / real(given%increments, wp), given%relaxation, &
        given%residual, run%increments)
    end associate
  end subroutine start_increments

  !> What the present stage has changed comes in evenly over it: a load that holds the change falls
  !> to nothing.
  subroutine add_release(stage, state, model)
    type(stage_t), intent(in)    :: stage
    type(state_t), intent(in)    :: state
    type(model_t), intent(inout) :: model
    type(body_force_t) :: release

    if (.not. stage%start_time > 0.0_wp) return
    release = new_body_force('release', -state%released, model%points%volume, 0.0_wp, &
      [0.0_wp, 0.0_wp], 'what the stage has changed')
    release%factor = new_table([stage%start_time, stage%end_time], [1.0_wp, 0.0_wp], 0.0_wp)
    call release%divide(model%blocks)
    call model%loads%append(release)
    model%releases = .true.
  end subroutine add_release

  !> A later stage keeps the load that goes with the initial stress, on the points that are left.
  subroutine keep_standing_load(run, stage, model)
    type(run_t),   intent(in)    :: run
    type(stage_t), intent(in)    :: stage   !! of the model
    type(model_t), intent(inout) :: model
    type(doubts_t) :: doubts
    type(error_list_t) :: unheard
    type(model_t) :: first
    integer :: k

    if (.not. stage%start_time > 0.0_wp .or. .not. is_set(run%input%initial_stress%k0)) return
    first%whole = model%whole
    call set_up_stage_body(run%input, run%stages(1), first%whole, first%body, doubts, unheard, &
      unheard)
    call set_up_model(run%input, first, unheard, run%stages(1))
    do k = 1, size(first%loads%items)
      select type (load => first%loads%items(k)%load)
      class is (body_force_t)
        if (load%kind /= 'initial stress') cycle
        call model%loads%append(new_body_force(load%kind, load%density * model%points%free, &
          model%points%volume, 0.0_wp, [0.0_wp, 0.0_wp], 'of the initial stress'))
      end select
    end do
  end subroutine keep_standing_load

  !> Output folder and name of a run.
  pure function stem_of(run) result(stem)
    type(run_t), intent(in) :: run
    character(:), allocatable :: stem

    stem = run%input%run%output_dir//'/'//run%input%run%name
  end function stem_of

  !> Results of an earlier run are overwritten or continued only on request, those of a living one
  !> never; a checkpoint is read if the run continues from it.
  subroutine look_for_earlier_run(options, run, outcome)
    type(options_t), intent(in)    :: options
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors, input_errors
    character(:), allocatable :: warning
    logical :: complete

    complete = .false.
    if (run%ranks%mine == 0) call look_at_files(options, run, complete, outcome)
    call outcome%agree(run%ranks)
    if (outcome%done) return
    if (options%restart) then
      run%mark = checkpoint_mark(stem_of(run))
      call load_checkpoint(run%input, run%checkpoint, run%state, run%ledger, warning, errors, &
        input_errors)
      if (complete .and. errors%count() > 0) call errors%add('the run is finished, and no '// &
        'state was kept from which it could go on; &output checkpoint_every keeps one')
      call outcome%end_if_any(errors, exit_file)
      call outcome%end_if_any(input_errors, exit_input)
      if (outcome%done) return
      if (warning /= '') call run%doubts%add('older_checkpoint', 0.0_wp, warning)
      call load_doubts(stem_of(run), run%checkpoint, run%doubts)
    end if
  end subroutine look_for_earlier_run

  !> Whether the files of the run are another one's, or finished already. One rank looks, and takes
  !> the lock later: others would hold it against each other.
  subroutine look_at_files(options, run, complete, outcome)
    type(options_t), intent(in)    :: options
    type(run_t),     intent(in)    :: run
    logical,         intent(out)   :: complete   !! a finished run, of which a restart is asked
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    character(:), allocatable :: living
    logical :: same

    complete = .false.
    living = lock_holder(lock_path(stem_of(run)))
    if (living /= '') call errors%add(living, stem_of(run))
    call outcome%end_if_any(errors, exit_file)
    if (outcome%done) return
    if (options%restart) then
      call look_for_end(run%input, complete, same)
      if (.not. (complete .and. same)) return
      if (.not. options%quiet) write (output_unit, '(a)') 'the run is finished: '// &
        stem_of(run)//'.h5 is complete; a later end goes on from a checkpoint, --force '// &
        'begins anew'
      call outcome%end_with(exit_ok)
    else
      call refuse_results(options, run, errors)
      call outcome%end_if_any(errors, exit_file)
    end if
  end subroutine look_at_files

  !> Report an error where there are results that the user does not want to lose.
  subroutine refuse_results(options, run, errors)
    type(options_t),    intent(in)    :: options
    type(run_t),        intent(in)    :: run
    type(error_list_t), intent(inout) :: errors

    if (options%force) return
    if (.not. results_in_the_way(stem_of(run))) return
    call errors%add('there are results of an earlier run; --force overwrites them, --restart '// &
      'goes on from a checkpoint, --output DIR writes elsewhere', stem_of(run))
  end subroutine refuse_results

  !> Lock the files of the run. Another one may have come in between while the model was set up:
  !> look again whether its results, or another checkpoint, are there.
  subroutine claim_files(options, run, errors)
    type(options_t),    intent(in)    :: options
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    call prepare_folder(run%input%run%output_dir, errors)
    if (errors%count() == 0) call take_lock(run%lock, lock_path(stem_of(run)), errors)
    if (errors%count() > 0) return
    if (.not. options%restart) then
      call refuse_results(options, run, errors)
    else if (run%mark /= checkpoint_mark(stem_of(run))) then
      call errors%add('another run has written a checkpoint just now', stem_of(run))
    end if
  end subroutine claim_files

  !> The unloaded state, or that of the checkpoint.
  subroutine begin_state(run)
    type(run_t), intent(inout) :: run
    type(column_t), allocatable :: columns(:)
    type(observation_t) :: seen

    associate (model => run%model, state => run%state, ledger => run%ledger)
      if (run%checkpoint%history_rows > 0) then
        state%remembered = model%materials%remembered()
        call state%scatter(model%shown%row(), model%operators%n)
        state%strength = model%strength
        call add_release(run%stages(run%clock%stage), state, model)
        call ledger%fit(model%blocks)
        call model%operators%mirror%move(run%clock%time())
        call model%operators%take_in(state%displacement, model%operators%mirror%place)
        call model%supports%take_reactions(model%points%volume, run%clock%time(), state%force)
        call state%forget(model%operators%domain%kept(model%operators%n))
      else
        call start(model, state)
        ledger = new_ledger(model%blocks)
        call history_columns(model, columns)
        call observe(columns, model, state, moment_at(run%clock, model, state, ledger), seen)
        ledger%initial_kinetic_energy = seen%value('kinetic_energy')
        if (state%has_initial_strain) ledger%initial_strain_energy = seen%value('strain_energy')
        run%checkpoint%clock = run%clock
      end if
      call release_set_up(model)
      run%reversal = new_reversal(model%materials, run%input%materials%kinematic_modulus < 0.0_wp, &
        model%blocks)
    end associate
  end subroutine begin_state

  !> Open all files; the unloaded state is the first row and the first frame.
  subroutine open_outputs(options, run, outcome)
    type(options_t), intent(in)    :: options
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    type(summary_t)    :: summary
    character(:), allocatable :: command
    integer :: length, i

    call get_command(length=length)
    allocate (character(length) :: command)
    call get_command(command)
    if (run%ranks%mine == 0) call claim_files(options, run, errors)
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
    if (outcome%done) return
    call open_record(run%input, provenance_t(code_version, git_hash, compiler_version(), &
      build_flags, command, omp_get_max_threads()), run%model, run%schedule, run%checkpoint, &
      options%quiet, run%record, errors)
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
    if (outcome%done) return
    associate (record => run%record)
      call record_line(record, 'perigeo '//code_version//' ('//git_hash//'), '// &
        options%input_path, errors)
      summary = summarise(run%input, run%model, run%clock, run%schedule)
      do i = 1, size(summary%lines)
        call record_line(record, trim(summary%lines(i)), errors)
      end do
      call record_warnings(run%doubts, words_on_cores(run%ranks%count), record, errors)
      if (run%checkpoint%history_rows > 0) call largest_reaction_before(record, run%model, &
        run%checkpoint%history_rows, run%largest_reaction)
      call observe_state(run%model, run%state, run%ledger, run%clock, record)
      if (run%checkpoint%history_rows == 0) then
        call record_row(record, errors)
        call outcome%end_if_any(errors, exit_file)
        call outcome%agree(run%ranks)
        if (outcome%done) return
        call record_frame(run%model, run%state, record, errors)
      else
        call record_line(record, 'going on from a checkpoint', errors)
        do i = 1, run%checkpoint%rows_owed
          call record_row(record, errors)
        end do
        do i = 1, run%checkpoint%frames_owed
          call record_frame(run%model, run%state, record, errors)
        end do
      end if
      call record_progress(run%model, run%state, run%schedule, run%clock, record, errors)
    end associate
    deallocate (run%model%strength)   ! the state has it, and the result file
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
    run%whole = .not. outcome%done
    call system_clock(run%last_checkpoint)
    run%loop_start = run%last_checkpoint
  end subroutine open_outputs

  !> Lines of the log on what is doubtful from the start, and on threads.
  subroutine record_warnings(doubts, on_threads, record, errors)
    type(doubts_t),     intent(in)    :: doubts
    character(*),       intent(in)    :: on_threads   !! '': nothing
    type(record_t),     intent(inout) :: record
    type(error_list_t), intent(inout) :: errors
    integer :: i

    do i = 1, doubts%count()
      call record_line(record, 'warning: '//doubts%message(i), errors)
    end do
    call record_doubts(record, doubts, errors)
    if (on_threads /= '') call record_line(record, 'warning: '//on_threads, errors)
  end subroutine record_warnings

end module pd_run
