!> The history `<stem>_history.csv`: one row of numbers now and then during a run.
!>
!> Numbers have 17 significant digits, so a row read back is exact. Every row is handed to the
!> operating system at once: a kill loses at most the row being written. A restart cuts the file
!> back to the rows before the checkpoint and goes on from there, with the same bytes.
module pd_history
  use, intrinsic :: iso_fortran_env, only: iostat_end
  use pd_errors, only: error_list_t
  use pd_files, only: close_output, flush_output, open_output, output_file_t, replace_file, &
    write_line
  use pd_kinds, only: wp
  use pd_system, only: remove_file
  use pd_text, only: integer_text
  implicit none
  private

  public :: history_t, history_row_t, create_history, resume_history, write_row, close_history

  !> The values of one row, in the order of the columns.
  type :: history_row_t
    integer  :: step = 0
    real(wp) :: time = 0.0_wp                     !! [s]
    real(wp) :: strain = 0.0_wp                   !! nominal; without platens not written
    real(wp), allocatable :: force(:, :)          !! (boundaries,2) on the body [N/m]
    real(wp) :: mean_stress_xx = 0.0_wp           !! [Pa]
    real(wp) :: mean_stress_yy = 0.0_wp           !! [Pa]
    real(wp) :: mean_strain_yy = 0.0_wp
    real(wp) :: max_plastic_strain = 0.0_wp
    real(wp) :: kinetic_energy = 0.0_wp           !! [J/m], as all energies
    real(wp) :: strain_energy = 0.0_wp
    real(wp) :: plastic_dissipation = 0.0_wp
    real(wp) :: damping_dissipation = 0.0_wp
    real(wp) :: stabilisation_energy = 0.0_wp
    real(wp) :: external_work = 0.0_wp
    real(wp) :: energy_error = 0.0_wp             !! relative
  end type history_row_t

  !> A history that is being written.
  type :: history_t
    integer :: rows = 0   !! rows written so far, those before a restart among them
    logical, private :: has_strain = .false.
    type(output_file_t), private :: file
  end type history_t

contains

  !> Start a history, replacing one of that name.
  !>
  !> Errors: the file cannot be written.
  subroutine create_history(history, stem, boundary_names, has_strain, errors)
    type(history_t),    intent(out)   :: history
    character(*),       intent(in)    :: stem   !! output folder and name of the run
    character(*),       intent(in)    :: boundary_names(:)
    logical,            intent(in)    :: has_strain   !! whether there are platens
    type(error_list_t), intent(inout) :: errors

    history%has_strain = has_strain
    call open_output(history%file, stem//'_history.csv', .false., errors)
    call write_line(history%file, header(boundary_names, has_strain), errors)
    call flush_output(history%file, errors)
  end subroutine create_history

  !> Go on with the history of a run that was cut off, behind its first `rows` rows.
  !>
  !> Errors: the file is missing, has other columns or too few rows, or cannot be written; it is
  !> then as it was.
  subroutine resume_history(history, stem, boundary_names, has_strain, rows, errors)
    type(history_t),    intent(out)   :: history
    character(*),       intent(in)    :: stem
    character(*),       intent(in)    :: boundary_names(:)
    logical,            intent(in)    :: has_strain
    integer,            intent(in)    :: rows   !! written up to the checkpoint
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: path
    integer :: before

    path = stem//'_history.csv'
    before = errors%count()
    call cut_back(path, header(boundary_names, has_strain), rows, errors)
    if (errors%count() > before) return
    history%has_strain = has_strain
    history%rows = rows
    call open_output(history%file, path, .true., errors)
  end subroutine resume_history

  !> Append a row and hand it to the operating system.
  !>
  !> Errors: the file cannot be written to; reported once.
  subroutine write_row(history, row, errors)
    type(history_t),     intent(inout) :: history
    type(history_row_t), intent(in)    :: row
    type(error_list_t),  intent(inout) :: errors
    real(wp) :: numbers(13 + 2 * size(row%force, 1))
    character(12) :: step
    integer :: n, k

    numbers(1) = row%time
    n = 1
    if (history%has_strain) then
      n = 2
      numbers(2) = row%strain
    end if
    do k = 1, size(row%force, 1)
      numbers(n + 1:n + 2) = row%force(k, :)
      n = n + 2
    end do
    numbers(n + 1:n + 11) = [row%mean_stress_xx, row%mean_stress_yy, row%mean_strain_yy, &
      row%max_plastic_strain, row%kinetic_energy, row%strain_energy, row%plastic_dissipation, &
      row%damping_dissipation, row%stabilisation_energy, row%external_work, row%energy_error]
    write (step, '(i0)') row%step
    call write_line(history%file, trim(step)//comma_separated(numbers(:n + 11)), errors)
    call flush_output(history%file, errors)
    if (history%file%is_open()) history%rows = history%rows + 1
  end subroutine write_row

  !> Close the history; harmless where it is not open.
  subroutine close_history(history, errors)
    type(history_t),    intent(inout) :: history
    type(error_list_t), intent(inout) :: errors

    call close_output(history%file, errors)
  end subroutine close_history

  !> Cut a history back to its header and its first `rows` rows, in one step.
  subroutine cut_back(path, header_wanted, rows, errors)
    character(*),       intent(in)    :: path, header_wanted
    integer,            intent(in)    :: rows
    type(error_list_t), intent(inout) :: errors
    type(output_file_t) :: short
    character(:), allocatable :: line
    integer :: unit, status, i, before
    logical :: ignored

    before = errors%count()
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) then
      call errors%add('the history of the run that is to go on is missing or cannot be read', &
        where=path)
      return
    end if
    call open_output(short, path//'.tmp', .false., errors)
    do i = 0, rows
      call read_line(unit, line, status)
      if (status /= 0) then
        call errors%add('has fewer rows than the checkpoint knows of', where=path, &
          found=integer_text(max(i - 1, 0)), allowed='at least '//integer_text(rows))
      else if (i == 0 .and. line /= header_wanted) then
        call errors%add('has other columns than this run writes', where=path, found=line, &
          allowed=header_wanted)
      end if
      if (errors%count() > before) exit
      call write_line(short, line, errors)
    end do
    close (unit)
    call close_output(short, errors)
    if (errors%count() == before) call replace_file(path//'.tmp', path, errors)
    if (errors%count() > before) ignored = remove_file(path//'.tmp')
  end subroutine cut_back

  !> Read a line of any length. A last line that is not ended counts as missing.
  subroutine read_line(unit, line, status)
    integer,                   intent(in)  :: unit
    character(:), allocatable, intent(out) :: line
    integer,                   intent(out) :: status   !! 0: a line
    character(1024) :: part
    integer :: length

    line = ''
    do
      read (unit, '(a)', advance='no', iostat=status, size=length) part
      line = line//part(:length)
      if (is_iostat_eor(status)) then
        status = 0
        return
      end if
      if (status == 0) cycle
      status = iostat_end
      return
    end do
  end subroutine read_line

  pure function header(boundary_names, has_strain) result(text)
    character(*), intent(in) :: boundary_names(:)
    logical,      intent(in) :: has_strain
    character(:), allocatable :: text
    integer :: k

    text = 'step,time'
    if (has_strain) text = text//',strain'
    do k = 1, size(boundary_names)
      text = text//','//trim(boundary_names(k))//'_force_x,'//trim(boundary_names(k))//'_force_y'
    end do
    text = text//',mean_stress_xx,mean_stress_yy,mean_strain_yy,max_plastic_strain,' &
      //'kinetic_energy,strain_energy,plastic_dissipation,damping_dissipation,' &
      //'stabilisation_energy,external_work,energy_error'
  end function header

  !> Numbers with 17 significant digits, each after a comma.
  pure function comma_separated(numbers) result(text)
    real(wp), intent(in) :: numbers(:)
    character(:), allocatable :: text
    integer, parameter :: width = 24   !! of a number with its sign
    character(width * size(numbers)) :: cells
    character((width + 1) * size(numbers)) :: line
    integer :: k, first, length

    write (cells, '(*(es24.16e3))') numbers
    length = 0
    do k = 1, size(numbers)
      first = width * (k - 1) + 1
      if (cells(first:first) == ' ') first = first + 1
      line(length + 1:length + 1) = ','
      line(length + 2:length + 2 + width * k - first) = cells(first:width * k)
      length = length + 2 + width * k - first
    end do
    text = line(:length)
  end function comma_separated

end module pd_history
