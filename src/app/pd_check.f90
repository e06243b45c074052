!> Options that answer without a run: --help, --version, --input-reference, --print-input, --check.
module pd_check
  use, intrinsic :: iso_fortran_env, only: output_unit
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use pd_command_line, only: options_t, print_help, read_command_line
  use pd_division, only: share_t, shares, traffic, traffic_t
  use pd_doubt_list, only: write_doubt_table
  use pd_errors, only: error_list_t, exit_command_line, exit_file, exit_input, exit_ok, outcome_t
  use pd_files, only: meant_path
  use pd_input, only: print_input
  use pd_input_reference, only: write_input_reference, write_input_reference_json
  use pd_input_types, only: all_keys
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_points_file, only: write_points
  use pd_ranks, only: begin_ranks, ranks_t
  use pd_room, only: machine_memory
  use pd_run, only: run_t
  use pd_size, only: memory_in_words
  use pd_stability, only: find_highest_frequency
  use pd_summary, only: estimated_seconds, memory_of_run, seconds_of_step, summarise, summary_t
  use pd_text, only: integer_text, short_number
  use pd_threads, only: choose_threads, words_on_cores
  use pd_version, only: code_version, git_hash
  implicit none
  private

  public :: begin_program, print_check

contains

  !> Ranks, threads and options; where the command line asks what needs no model, the answer.
  !>
  !> Errors: a wrong command line.
  subroutine begin_program(options, ranks, outcome)
    type(options_t), intent(out)   :: options
    type(ranks_t),   intent(out)   :: ranks
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors

    call begin_ranks(ranks)
    call read_command_line(options, errors)
    call outcome%end_if_any(errors, exit_command_line)
    if (.not. outcome%done) call answer_questions(options, ranks, outcome)
    if (options%threads > 0) call omp_set_num_threads(options%threads)
  end subroutine begin_program

  !> Answer what needs no model; the program then ends. Rank 0 answers.
  subroutine answer_questions(options, ranks, outcome)
    type(options_t), intent(in)    :: options
    type(ranks_t),   intent(in)    :: ranks
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors

    if (ranks%mine > 0) then
      if (options%help .or. options%version .or. options%input_reference .or. options%doubts .or. &
        options%print_input) call outcome%end_with(exit_ok)
      return
    end if

    if (options%help) call print_help()
    if (options%version) write (output_unit, '(a)') 'perigeo '//code_version//' ('//git_hash//')'
    if (options%input_reference .and. options%json) then
      call write_input_reference_json(all_keys(), output_unit)
    else if (options%input_reference) then
      call write_input_reference(all_keys(), output_unit)
    end if
    if (options%doubts) call write_doubt_table(output_unit)
    if (options%help .or. options%version .or. options%input_reference .or. options%doubts) then
      call outcome%end_with(exit_ok)
    else if (options%print_input) then
      call print_input(options%input_path, output_unit, errors, options%settings)
      call outcome%end_if_any(errors, exit_input)
      if (.not. outcome%done) call outcome%end_with(exit_ok)
    end if
  end subroutine answer_questions

  !> Print the derived figures of a run that is set up; the program then ends.
  subroutine print_check(path, points_path, threads, run, outcome)
    character(*),    intent(in)    :: path          !! of the input file
    character(*),    intent(in)    :: points_path   !! file for the points; '': none
    integer,         intent(in)    :: threads       !! asked for, 0: not
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(error_list_t) :: errors
    type(summary_t) :: summary
    integer :: i

    if (run%ranks%mine > 0) then   ! rank 0 looks at the whole model
      call outcome%end_with(exit_ok)
      return
    end if
    if (points_path /= '') &
      call write_points(meant_path(points_path), run%input, run%model, errors)
    call outcome%end_if_any(errors, exit_file)
    if (outcome%done) return
    call find_highest_frequency(run%model)
    associate (bytes => memory_of_run(run%input, run%model) / real(run%ranks%count, wp))
      if (real(run%ranks%on_machine, wp) * bytes > machine_memory()) &   ! a run is refused for it
        write (output_unit, '(a)') 'warning: '//memory_in_words(bytes, run%ranks)
    end associate
    summary = summarise(run%input, run%model, run%clock, run%schedule)
    write (output_unit, '(a)') path//': the input is right'
    do i = 1, size(summary%lines)
      write (output_unit, '(a)') trim(summary%lines(i))
    end do
    if (run%ranks%count > 1) then
      call print_shares(run)
    else
      call choose_threads(threads, run%model)
    end if
    call print_estimate(estimated_seconds(run%model, run%schedule))
    call run%doubts%print(output_unit)
    call outcome%end_with(exit_ok)
  end subroutine print_check

  !> What the ranks would have: points, the halo, memory, and what goes between them in every step.
  subroutine print_shares(run)
    type(run_t), intent(inout) :: run
    type(share_t) :: of_rank(run%ranks%count)
    type(traffic_t) :: sent
    real(wp) :: balance
    integer  :: halo, others

    of_rank = shares(run%model, size(of_rank))
    sent = traffic(run%model)
    halo = maxval(of_rank%halo)
    others = maxval(of_rank%others)
    balance = sum(real(of_rank%points, wp)) / (real(size(of_rank), wp) &
      * real(maxval(of_rank%points), wp))
    call line('ranks', integer_text(size(of_rank))//': '//integer_text(minval(of_rank%points))// &
      ' to '//integer_text(maxval(of_rank%points))//' points each, balance '// &
      short_number(balance))
    call line('halo', integer_text(halo)//' rows of other ranks at most, '// &
      short_number(maxval(real(of_rank%halo, wp) / real(max(1, of_rank%rows), wp)))// &
      ' of the own ones')
    call line('messages', integer_text(size(sent%numbers) * others)//' per step and rank with '// &
      integer_text(8 * sum(sent%numbers) * halo)//' bytes beside the work of '//integer_text( &
      minval(of_rank%inner))//' rows; reductions '//integer_text(sent%reductions)//' with '// &
      integer_text(sent%reduced)//' bytes')
    if (.not. run%model%at_equilibrium) call line('efficiency', 'about '//short_number( &
      efficiency(run%model, of_rank, sent))//' with 2e-6 s and 1e10 bytes/s per message')
    associate (part => real(maxval(of_rank%rows + of_rank%halo), wp) / run%model%operators%n)
      call line('memory of a rank', short_number(1.0e-6_wp * part &
        * memory_of_run(run%input, run%model))//' MB at most')
    end associate
    if (run%model%body%runs%n == 0) call line('set-up', 'that of the whole body, by every rank')
    if (words_on_cores(run%ranks%count) /= '') call line('cores', words_on_cores(run%ranks%count))
  end subroutine print_shares

  !> 'label  text'.
  subroutine line(label, text)
    character(*), intent(in) :: label, text
    character(20) :: column

    column = label
    write (output_unit, '(a)') '  '//column//text
  end subroutine line

  !> Time of a step without messages, all ranks being equal, over that of the rank with most points.
  !> Rows that need none of other ranks are worked on while the halo is on its way.
  real(wp) function efficiency(model, of_rank, sent)
    type(model_t),   intent(inout) :: model
    type(share_t),   intent(in)    :: of_rank(:)
    type(traffic_t), intent(in)    :: sent
    real(wp), parameter :: latency = 2.0e-6_wp     !! of a message [s]
    real(wp), parameter :: bandwidth = 1.0e10_wp   !! of a rank [bytes/s]
    !> Of the time of a step: gradient and stress, force; as the kernels of a log, m = 4.
    real(wp), parameter :: during(2) = [0.6_wp, 0.25_wp]
    real(wp) :: alone, largest, exchanges(2), hidden(2), reductions

    alone = seconds_of_step(model)
    largest = alone * real(maxval(of_rank%points), wp) / sum(real(of_rank%points, wp))
    exchanges = latency * real(maxval(of_rank%others), wp) + 8.0_wp &
      * real(sent%numbers, wp) * real(maxval(of_rank%halo), wp) / bandwidth
    hidden = during * largest * minval(real(of_rank%inner, wp) / real(max(1, of_rank%rows), wp))
    reductions = 2.0_wp * latency * real(sent%reductions * ceiling( &
      log(real(size(of_rank), wp)) / log(2.0_wp)), wp) + 2.0_wp * real(sent%reduced, wp) / bandwidth
    efficiency = alone / real(size(of_rank), wp) / (largest + reductions &
      + sum(max(0.0_wp, exchanges - hidden)))
  end function efficiency

  !> Last line of --check.
  subroutine print_estimate(seconds)
    real(wp), intent(in) :: seconds
    character(16) :: text, threads

    write (threads, '(i0)') omp_get_max_threads()
    if (seconds < 100.0_wp) then
      write (text, '(f12.1,a)') max(0.1_wp, seconds), ' s'
    else if (seconds < 6000.0_wp) then
      write (text, '(f12.1,a)') seconds / 60.0_wp, ' min'
    else
      write (text, '(f12.1,a)') seconds / 3600.0_wp, ' h'
    end if
    write (output_unit, '(a)') '  run time            about '//trim(adjustl(text))// &
      ', threads: '//trim(threads)
  end subroutine print_estimate

end module pd_check
