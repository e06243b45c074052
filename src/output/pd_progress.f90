!> Progress of a run: on the screen, and in plain lines in `<stem>.log`.
!>
!> On a terminal one line is rewritten several times a second; elsewhere, and in the log, a line is
!> added at every tenth of the run and at the latest after ten seconds (log: a minute where the
!> screen is a terminal). A screen that cannot be written to (a full disk behind it, a closed pipe)
!> is left alone from then on: it must not end a run.
module pd_progress
  use, intrinsic :: iso_fortran_env, only: output_unit
  use pd_errors, only: error_list_t
  use pd_files, only: close_output, flush_output, open_output, output_file_t, write_line
  use pd_kinds, only: i8, wp
  use pd_system, only: is_terminal
  use pd_text, only: integer_text
  implicit none
  private

  public :: progress_t, status_t, open_progress, say, progress_due, show_progress, close_progress

  real(wp), parameter :: seconds_between_rewrites = 0.2_wp
  real(wp), parameter :: seconds_between_lines = 10.0_wp

  character(*), parameter :: carriage_return = achar(13), escape = achar(27)
  character(*), parameter :: clear_rest = escape//'[K'

  !> How far a run has come.
  type :: status_t
    integer  :: step = 0, steps = 0          !! steps done, steps of the whole run
    real(wp) :: time = 0.0_wp                !! [s]
    logical  :: has_strain = .false.         !! whether there are platens
    real(wp) :: strain = 0.0_wp              !! nominal
    real(wp) :: axial_stress = 0.0_wp        !! [Pa]
    real(wp) :: largest_alpha = 0.0_wp
    !> Without platens: the boundary that has moved most, and along which axis; '': none has.
    character(24) :: moved = ''
    real(wp) :: displacement = 0.0_wp        !! of it [m]
    real(wp) :: force = 0.0_wp               !! on the body, along the same axis [N/m]
  end type status_t

  !> Screen and log of a run.
  type :: progress_t
    private
    type(output_file_t) :: log
    logical  :: on_screen = .false.          !! whether the screen is written to
    logical  :: terminal = .false.           !! whether a line is rewritten there
    logical  :: line_shown = .false.         !! whether such a line is on the screen
    integer  :: tenths = 0                   !! tenths of the run that have been reported
    real(wp) :: last_rewrite = 0.0_wp, last_line = 0.0_wp   !! wall clock [s]
    integer  :: last_step = -1               !! the step and wall clock of the last rate
    real(wp) :: last_clock = 0.0_wp
    real(wp) :: rate = 0.0_wp                !! steps per second, running average
  end type progress_t

contains

  !> Open the log `<stem>.log`: anew, or with `append` behind what it holds. `quiet`: nothing on the
  !> screen.
  !>
  !> Errors: the log cannot be written.
  subroutine open_progress(progress, stem, append, quiet, errors, plain)
    type(progress_t),   intent(out)   :: progress
    character(*),       intent(in)    :: stem   !! output folder and name of the run
    logical,            intent(in)    :: append, quiet
    type(error_list_t), intent(inout) :: errors
    logical, optional,  intent(in)    :: plain   !! a screen that looks like a terminal is none

    progress%on_screen = .not. quiet
    if (.not. quiet) progress%terminal = can_rewrite()
    if (present(plain)) progress%terminal = progress%terminal .and. .not. plain
    progress%last_line = clock()
    progress%last_rewrite = progress%last_line
    call open_output(progress%log, stem//'.log', append, errors)
  end subroutine open_progress

  !> Write a line to the screen and to the log.
  !>
  !> Errors: the log cannot be written to; reported once.
  subroutine say(progress, text, errors)
    type(progress_t),   intent(inout) :: progress
    character(*),       intent(in)    :: text
    type(error_list_t), intent(inout) :: errors

    call clear_line(progress)
    call put_on_screen(progress, text, .true.)
    call write_line(progress%log, text, errors)
    call flush_output(progress%log, errors)
  end subroutine say

  !> Whether it is time to call `show_progress`; cheap enough to ask at every step.
  logical function progress_due(progress, step, steps)
    type(progress_t), intent(in) :: progress
    integer,          intent(in) :: step, steps   !! steps done, steps of the whole run
    real(wp) :: now

    now = clock()
    progress_due = line_due(progress, step, steps, now)
    if (progress%terminal .and. now - progress%last_rewrite >= seconds_between_rewrites) then
      progress_due = .true.
    end if
  end function progress_due

  !> Show the progress of the run: rewrite the line on a terminal; elsewhere add a line if one is
  !> due.
  !>
  !> Errors: the log cannot be written to; reported once.
  subroutine show_progress(progress, status, errors)
    type(progress_t),   intent(inout) :: progress
    type(status_t),     intent(in)    :: status
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: line
    real(wp) :: now

    now = clock()
    call update_rate(progress, status%step, now)
    if (line_due(progress, status%step, status%steps, now)) then
      progress%last_line = now
      progress%tenths = tenths_done(status%step, status%steps)
      line = long_text(status, progress%rate)
      call write_line(progress%log, line, errors)
      call flush_output(progress%log, errors)
      if (.not. progress%terminal) call put_on_screen(progress, line, .true.)
    end if
    if (progress%terminal) then
      progress%last_rewrite = now
      call rewrite_line(progress, short_text(status, progress%rate))
    end if
  end subroutine show_progress

  !> End the line that is being rewritten and close the log; harmless where it is not open.
  subroutine close_progress(progress, errors)
    type(progress_t),   intent(inout) :: progress
    type(error_list_t), intent(inout) :: errors

    call clear_line(progress)
    call close_output(progress%log, errors)
  end subroutine close_progress

  pure logical function line_due(progress, step, steps, now)
    type(progress_t), intent(in) :: progress
    integer,          intent(in) :: step, steps
    real(wp),         intent(in) :: now
    real(wp) :: interval

    interval = seconds_between_lines
    if (progress%terminal) interval = 6.0_wp * seconds_between_lines
    line_due = tenths_done(step, steps) > progress%tenths .or. now - progress%last_line >= interval
  end function line_due

  pure integer function tenths_done(step, steps)
    integer, intent(in) :: step, steps

    tenths_done = int(10_i8 * step / max(steps, 1))
  end function tenths_done

  !> Running average of the steps per second over the last ten seconds or so.
  subroutine update_rate(progress, step, now)
    type(progress_t), intent(inout) :: progress
    integer,          intent(in)    :: step
    real(wp),         intent(in)    :: now   !! wall clock [s]
    real(wp), parameter :: memory = 10.0_wp
    real(wp) :: elapsed, newest, weight

    elapsed = now - progress%last_clock
    if (progress%last_step >= 0) then
      if (step <= progress%last_step .or. elapsed < 1.0e-3_wp) return
      newest = real(step - progress%last_step, wp) / elapsed
      weight = exp(-elapsed / memory)
      if (progress%rate <= 0.0_wp) weight = 0.0_wp
      progress%rate = weight * progress%rate + (1.0_wp - weight) * newest
    end if
    progress%last_step = step
    progress%last_clock = now
  end subroutine update_rate

  !> 'step 1200/4800 (25 %)  time 0.8120 s  strain 0.4050 %  stress 120.1 kPa  alpha 0.0130 ...'
  pure function long_text(status, rate) result(text)
    type(status_t), intent(in) :: status
    real(wp),       intent(in) :: rate   !! steps per second; 0: not known yet
    character(:), allocatable :: text
    integer :: percent

    percent = int(100_i8 * status%step / max(status%steps, 1))
    text = 'step '//integer_text(status%step)//'/'//integer_text(status%steps)//' (' &
      //integer_text(percent)//' %)  time '//short_number(status%time)//' s'
    if (status%has_strain) then
      text = text//'  strain '//short_number(100.0_wp * status%strain)//' %  stress ' &
        //short_number(1.0e-3_wp * status%axial_stress)//' kPa'
    end if
    text = text//moved_text(status)//'  alpha '//short_number(status%largest_alpha)
    if (rate > 0.0_wp) then
      text = text//'  '//short_number(rate)//' steps/s  '//time_left(status, rate)//' left'
    end if
  end function long_text

  !> The same for a terminal of 80 columns.
  pure function short_text(status, rate) result(text)
    type(status_t), intent(in) :: status
    real(wp),       intent(in) :: rate
    character(:), allocatable :: text

    text = integer_text(status%step)//'/'//integer_text(status%steps)//'  ' &
      //short_number(status%time)//' s'
    if (status%has_strain) then
      text = text//'  strain '//short_number(100.0_wp * status%strain)//' %  ' &
        //short_number(1.0e-3_wp * status%axial_stress)//' kPa'
    end if
    text = text//moved_text(status)//'  alpha '//short_number(status%largest_alpha)
    if (rate > 0.0_wp) then
      text = text//'  '//short_number(rate)//'/s  '//time_left(status, rate)//' left'
    end if
  end function short_text

  !> '  footing y -0.0213 m  51.40 kN/m', with the force on the body.
  pure function moved_text(status) result(text)
    type(status_t), intent(in) :: status
    character(:), allocatable :: text

    text = ''
    if (status%moved == '') return
    text = '  '//trim(status%moved)//' '//short_number(status%displacement)//' m  ' &
      //short_number(1.0e-3_wp * status%force)//' kN/m'
  end function moved_text

  pure function time_left(status, rate) result(text)
    type(status_t), intent(in) :: status
    real(wp),       intent(in) :: rate
    character(:), allocatable :: text

    text = duration(real(max(status%steps - status%step, 0), wp) / rate)
  end function time_left

  !> About four significant digits.
  pure function short_number(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text
    character(24) :: buffer

    if (abs(x) <= 0.0_wp) then
      buffer = '0'
    else if (abs(x) < 1.0e-3_wp .or. .not. abs(x) < 1.0e6_wp) then
      write (buffer, '(es12.3)') x
    else if (abs(x) < 10.0_wp) then
      write (buffer, '(f12.4)') x
    else if (abs(x) < 100.0_wp) then
      write (buffer, '(f12.2)') x
    else if (abs(x) < 1000.0_wp) then
      write (buffer, '(f12.1)') x
    else
      write (buffer, '(i12)') nint(x)
    end if
    text = trim(adjustl(buffer))
  end function short_number

  !> '1 h 05 min', '12 min 30 s', '45 s'.
  pure function duration(seconds) result(text)
    real(wp), intent(in) :: seconds
    character(:), allocatable :: text
    character(40) :: buffer
    integer(i8) :: whole

    whole = int(min(seconds, 1.0e12_wp), i8)
    if (whole >= 3600) then
      write (buffer, '(i0, " h ", i2.2, " min")') whole / 3600, modulo(whole, 3600_i8) / 60
    else if (whole >= 60) then
      write (buffer, '(i0, " min ", i2.2, " s")') whole / 60, modulo(whole, 60_i8)
    else
      write (buffer, '(i0, " s")') whole
    end if
    text = trim(buffer)
  end function duration

  ! ---- the screen --------------------------------------------------------------------------

  !> Whether standard output is a terminal that knows the usual control sequences.
  logical function can_rewrite()
    character(16) :: kind_of_terminal

    call get_environment_variable('TERM', kind_of_terminal)
    can_rewrite = kind_of_terminal /= '' .and. kind_of_terminal /= 'dumb'
    if (can_rewrite) can_rewrite = is_terminal()
  end function can_rewrite

  subroutine put_on_screen(progress, text, ended)
    type(progress_t), intent(inout) :: progress
    character(*),     intent(in)    :: text
    logical,          intent(in)    :: ended   !! whether the line ends with the text
    integer :: status

    if (.not. progress%on_screen) return
    if (ended) then
      write (output_unit, '(a)', iostat=status) text
    else
      write (output_unit, '(a)', advance='no', iostat=status) text
    end if
    if (status == 0) flush (output_unit, iostat=status)
    if (status /= 0) progress%on_screen = .false.
  end subroutine put_on_screen

  !> Overwrite the line; it is cut off at the edge of the screen.
  subroutine rewrite_line(progress, line)
    type(progress_t), intent(inout) :: progress
    character(*),     intent(in)    :: line
    character(*), parameter :: stop_at_edge = escape//'[?7l', wrap_at_edge = escape//'[?7h'

    call put_on_screen(progress, carriage_return//stop_at_edge//line//clear_rest//wrap_at_edge, &
      .false.)
    progress%line_shown = .true.
  end subroutine rewrite_line

  !> Erase the line that is being rewritten.
  subroutine clear_line(progress)
    type(progress_t), intent(inout) :: progress

    if (.not. progress%line_shown) return
    call put_on_screen(progress, carriage_return//clear_rest, .false.)
    progress%line_shown = .false.
  end subroutine clear_line

  !> Wall clock [s].
  real(wp) function clock()
    integer(i8) :: count, rate

    call system_clock(count, rate)
    clock = real(count, wp) / real(rate, wp)
  end function clock

end module pd_progress
