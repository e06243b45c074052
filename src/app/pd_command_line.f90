!> The command line: options, their help, and how they are read.
module pd_command_line
  use, intrinsic :: iso_fortran_env, only: output_unit
  use pd_errors, only: error_list_t
  use pd_input, only: setting_t
  use pd_text, only: nearest_name
  implicit none
  private

  public :: options_t, read_command_line, print_help

  !> What the user asked for.
  type :: options_t
    character(:), allocatable :: input_path
    character(:), allocatable :: output_dir   !! '': as in the input
    character(:), allocatable :: points_path  !! file for the points, with --check; '': none
    type(setting_t), allocatable :: settings(:)   !! values in place of those of the input file
    integer :: threads = 0                    !! 0: as OMP_NUM_THREADS says
    logical :: check = .false., restart = .false., force = .false., quiet = .false.
    logical :: version = .false., help = .false., input_reference = .false.
    logical :: json = .false., print_input = .false., doubts = .false.
  end type options_t

  !> What --help prints, and the only list of the options: a line that begins with them names them.
  character(*), parameter :: help_text(*) = [character(96) :: &
    'perigeo: peridynamics for geomaterials. Shows where soil fails: plane strain,', &
    'J2 plasticity with softening, non-ordinary state-based peridynamics.', &
    '', &
    'usage: perigeo [options] RUN.nml', &
    '', &
    '  RUN.nml             the input file, Fortran namelists: see doc/input.md and input/', &
    '', &
    'A value may stand behind its option or behind an =: --threads 2, --threads=2.', &
    '', &
    '  --check             check the input and print the derived figures; run nothing', &
    '  --points FILE       with --check: write points, boundaries and loads to a file;', &
    '                      perigeo-post geometry RUN.nml draws them', &
    '  --output DIR        folder for the results (default: output_dir of the input file,', &
    '                      or results/<name>)', &
    '  --threads N         number of threads (default: OMP_NUM_THREADS, or all cores)', &
    '  --restart           go on from the newest checkpoint in the output folder', &
    '  --force             overwrite the results of an earlier run', &
    '  --quiet             no progress on the screen; errors still appear', &
    '  --set GROUP.KEY=VALUE', &
    '                      a value in place of that of the input file, as often as needed:', &
    '                      material.density=1800, boundary.top.velocity=0,-0.02; nothing', &
    '                      behind the = takes a key or a group out', &
    '  --print-input       print an input file with all values as used; run nothing', &
    '  --input-reference   print the tables of all input keys (see doc/input.md)', &
    '  --json              with --input-reference: for programs', &
    '  --doubts            print the table of what a run is warned of (see doc/doubts.md)', &
    '  --version, --help', &
    '', &
    'Results, in the output folder: <name>_history.csv (curves), <name>.h5 (fields),', &
    '<name>.xdmf (open this in ParaView), <name>.log. Figures: perigeo-post --help', &
    '', &
    'A first run, in the folder of perigeo (once installed: PREFIX/share/perigeo):', &
    '  perigeo input/compression_quick.nml --output ~/results/quick', &
    '  perigeo-post contours ~/results/quick/compression_quick.h5', &
    '', &
    'Ctrl-C (or SIGTERM, SIGUSR1) writes a checkpoint and stops; --restart goes on from there.', &
    '', &
    'exit status: 0 finished; 1 wrong command line; 2 wrong input file; 3 the model cannot be', &
    '  set up; 4 the calculation failed; 5 a file cannot be written or read (also: results of', &
    '  an earlier run in the way, no checkpoint to restart from); 130, 143 stopped by a signal']

contains

  !> Read the options.
  !>
  !> Errors: an unknown option (the nearest right one is named), a missing or surplus argument,
  !> options that exclude each other.
  subroutine read_command_line(options, errors)
    type(options_t),    intent(out)   :: options
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: word, given   ! given: a value behind =, until it is taken
    integer :: i

    options%input_path = ''
    options%output_dir = ''
    options%points_path = ''
    allocate (options%settings(0))
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      call take_apart(word, given)
      select case (word)
      case ('--check')
        options%check = .true.
      case ('--restart')
        options%restart = .true.
      case ('--force')
        options%force = .true.
      case ('--quiet')
        options%quiet = .true.
      case ('--version')
        options%version = .true.
      case ('--help', '-h')
        options%help = .true.
      case ('--input-reference')
        options%input_reference = .true.
      case ('--doubts')
        options%doubts = .true.
      case ('--json')
        options%json = .true.
      case ('--print-input')
        options%print_input = .true.
      case ('--set')
        call value_of('--set', 'group.key=value', word)
        call add_setting(word, options)
      case ('--output')
        call value_of('--output', 'a folder', options%output_dir)
      case ('--points')
        call value_of('--points', 'a file', options%points_path)
      case ('--threads')
        call value_of('--threads', 'a whole number', word)
        call read_threads(word, options%threads, errors)
      case default
        call take_input_path(word, options, errors)
        cycle
      end select
      if (allocated(given)) call errors%add('the option takes no value', word, '"'//given//'"')
    end do
    call check_together(options, errors)

  contains

    !> The argument that follows an option, or the value behind its =.
    subroutine value_of(option, meaning, value)
      character(*),              intent(in)    :: option, meaning
      character(:), allocatable, intent(inout) :: value

      if (allocated(given)) then
        value = given
        deallocate (given)
      else
        i = i + 1
        value = ''
        if (i <= command_argument_count()) value = argument(i)
      end if
      if (value == '' .or. index(value, '--') == 1) &
        call errors%add('a value is missing', option, '"'//value//'"', meaning)
    end subroutine value_of

  end subroutine read_command_line

  !> The value of --threads; what is missing has been reported.
  subroutine read_threads(value, threads, errors)
    character(*),       intent(in)    :: value
    integer,            intent(out)   :: threads
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: most_threads = 4096
    integer :: status

    threads = 0
    if (value == '' .or. index(value, '--') == 1) return
    status = 1
    if (verify(value, '0123456789') == 0 .and. len(value) < 9) &
      read (value, *, iostat=status) threads
    if (status /= 0 .or. threads < 1 .or. threads > most_threads) &
      call errors%add('the number of threads is wrong', '--threads', '"'//value//'"', &
      '1 to 4096')
  end subroutine read_threads

  !> An option and the value behind its =, if there is one: --threads=2.
  subroutine take_apart(word, value)
    character(:), allocatable, intent(inout) :: word
    character(:), allocatable, intent(out)   :: value
    integer :: equals

    equals = index(word, '=')
    if (index(word, '--') /= 1 .or. equals == 0) return
    value = word(equals + 1:)
    word = word(:equals - 1)
  end subroutine take_apart

  !> A word that is no option is the input file; one that looks like an option is unknown.
  subroutine take_input_path(word, options, errors)
    character(*),       intent(in)    :: word
    type(options_t),    intent(inout) :: options
    type(error_list_t), intent(inout) :: errors

    if (index(word, '-') == 1) then
      call report_unknown(word, errors)
    else if (options%input_path /= '') then
      call errors%add('more than one input file is given: '//options%input_path//' and '//word)
    else
      options%input_path = word
    end if
  end subroutine take_input_path

  !> Check what options need, and what they exclude.
  subroutine check_together(options, errors)
    type(options_t),    intent(in)    :: options
    type(error_list_t), intent(inout) :: errors

    if (options%json .and. .not. options%input_reference) call errors%add( &
      '--json goes with --input-reference')
    if (options%points_path /= '' .and. .not. options%check) call errors%add( &
      '--points goes with --check')
    if (options%version .or. options%help .or. options%input_reference .or. options%doubts) return
    if (options%input_path == '' .and. errors%count() == 0) &
      call errors%add('no input file is given; perigeo --help shows how')
    if (options%restart .and. options%force) call errors%add('--restart goes on with the '// &
      'results of an earlier run, --force overwrites them: use one of them')
  end subroutine check_together

  !> Add one --set.
  subroutine add_setting(text, options)
    character(*),    intent(in)    :: text
    type(options_t), intent(inout) :: options
    type(setting_t), allocatable :: more(:)
    integer :: i, n

    n = size(options%settings)
    allocate (more(n + 1))
    do i = 1, n
      more(i)%text = options%settings(i)%text
    end do
    more(n + 1)%text = text
    call move_alloc(more, options%settings)
  end subroutine add_setting

  !> Report an unknown option, with the one that was probably meant.
  subroutine report_unknown(word, errors)
    character(*),       intent(in)    :: word
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: near

    near = nearest_name(word, known_options())
    if (near /= '') near = '; did you mean '//near//'?'
    call errors%add('unknown option '//word//near)
  end subroutine report_unknown

  !> All options: the words of the help that begin with -- where a line begins with one.
  pure function known_options() result(known)
    character(17), allocatable :: known(:)
    character(17) :: name
    integer :: i, from

    allocate (known(0))
    do i = 1, size(help_text)
      if (index(help_text(i), '  --') /= 1) cycle
      from = 3
      do while (index(help_text(i)(from:), '--') == 1)
        name = help_text(i)(from:from + scan(help_text(i)(from:), ' ,') - 2)
        known = [known, name]
        from = from + len_trim(name) + 2   ! behind a comma and a blank
      end do
    end do
  end function known_options

  !> Argument i in its whole length.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: word)
    if (length > 0) call get_command_argument(i, word)
  end function argument

  !> The text of --help.
  subroutine print_help()
    integer :: i

    do i = 1, size(help_text)
      write (output_unit, '(a)') trim(help_text(i))
    end do
  end subroutine print_help

end module pd_command_line
