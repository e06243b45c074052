!> What a result file says about how far its numbers can be trusted: the doubts of the run, and its
!> quality at the end.
!>
!> `/doubts` is a table of all kinds; a doubt is two numbers written in place. `/quality` holds
!> attributes. Both are there from the start, so that the structure of the file never changes.
module pd_trust
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_doubt_list, only: doubt_kinds, doubts_t, never
  use pd_errors, only: error_list_t
  use pd_frames, only: write_label
  use pd_hdf5, only: close_file, create_group, hdf5_file_t, object_exists, open_file, &
    overwrite_dataset, read_dataset, write_attribute, write_dataset
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  implicit none
  private

  public :: quality_t, reserve_trust, write_doubts, read_doubts, write_quality, largest_of_column

  !> Texts of a dataset.
  type :: texts_t
    character(:), allocatable :: texts(:)
  end type texts_t

  !> Quality of a run at its end; what does not apply is not a number.
  type :: quality_t
    real(wp) :: energy_error = 0.0_wp    !! what the balance lacks over the work
    real(wp) :: kinetic_ratio = 0.0_wp   !! kinetic over internal energy
    real(wp) :: reaction_gap = 0.0_wp    !! sum of the normal forces of the platens over the largest
    real(wp) :: damping_share = 0.0_wp   !! forces of the damping over reactions and loads
    real(wp) :: control_share = 0.0_wp   !! energy of the control over the work
    real(wp) :: min_det_f = 0.0_wp       !! smallest det F
    real(wp) :: zero_energy = 0.0_wp     !! over the strain where nothing has flowed
  end type quality_t

contains

  !> Create the groups in a new result file: no doubt, no quality yet.
  subroutine reserve_trust(file, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(error_list_t), intent(inout) :: errors
    type(doubts_t)  :: none
    type(quality_t) :: unknown
    real(wp) :: nan

    call write_attribute(file, '/', 'doubts', 0, errors)
    call create_group(file, '/doubts', errors)
    call write_dataset(file, '/doubts/name', doubt_kinds%name, errors)
    call write_label(file, '/doubts/name', label_t('', '1', 'kinds of doubts'), errors)
    call write_dataset(file, '/doubts/meaning', doubt_kinds%meaning, errors)
    call write_label(file, '/doubts/meaning', label_t('', '1', 'what is looked at'), errors)
    call write_numbers('lower', 'doubtful below', doubt_kinds%lower)
    call write_numbers('upper', 'doubtful above', doubt_kinds%upper)
    call write_numbers('step', 'step at which it was told first; 0: at the start, -1: never', &
      real(none%step, wp))
    call write_numbers('value', 'what was found then', none%value)
    nan = ieee_value(1.0_wp, ieee_quiet_nan)
    unknown = quality_t(nan, nan, nan, nan, nan, nan, nan)
    call create_group(file, '/quality', errors)
    call put_quality(file, unknown, errors)

  contains

    subroutine write_numbers(name, description, values)
      character(*), intent(in) :: name, description
      real(wp),     intent(in) :: values(:)

      call write_dataset(file, '/doubts/'//name, values, errors)
      call write_label(file, '/doubts/'//name, label_t(name, '1', description), errors)
    end subroutine write_numbers

  end subroutine reserve_trust

  !> Write the doubts of a run into its result file.
  subroutine write_doubts(path, doubts, errors)
    character(*),       intent(in)    :: path
    type(doubts_t),     intent(in)    :: doubts
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_file(file, path, .true., errors)
    call overwrite_dataset(file, '/doubts/step', real(doubts%step, wp), errors)
    call overwrite_dataset(file, '/doubts/value', doubts%value, errors)
    call write_attribute(file, '/', 'doubts', count(doubts%step /= never), errors)
    call close_file(file, errors)
  end subroutine write_doubts

  !> Read those doubts that were told up to a step during the run, to go on from there. A file
  !> without them, or with another table, has none.
  subroutine read_doubts(path, last_step, doubts)
    character(*),   intent(in)    :: path
    integer,        intent(in)    :: last_step
    type(doubts_t), intent(inout) :: doubts
    type(error_list_t) :: unheard
    type(hdf5_file_t)  :: file
    type(texts_t) :: names
    real(wp),     allocatable :: step(:), value(:)
    logical :: known
    integer :: k

    call open_file(file, path, .false., unheard)
    known = .false.
    if (file%is_good()) known = object_exists(file, '/doubts')
    if (known) then
      call read_dataset(file, '/doubts/name', names%texts, unheard)
      call read_dataset(file, '/doubts/step', step, unheard)
      call read_dataset(file, '/doubts/value', value, unheard)
    end if
    call close_file(file, unheard)
    if (.not. known .or. unheard%count() > 0) return
    do k = 1, min(size(names%texts), size(step), size(value))
      if (step(k) < 1.0_wp .or. step(k) > real(last_step, wp)) cycle
      call doubts%note(trim(names%texts(k)), value(k), nint(step(k)))
    end do
  end subroutine read_doubts

  !> Largest magnitude in the first rows of a column of the history; 0 where it cannot be read.
  real(wp) function largest_of_column(path, rows, column) result(largest)
    character(*), intent(in) :: path, column
    integer,      intent(in) :: rows
    type(error_list_t) :: unheard
    type(hdf5_file_t)  :: file
    real(wp), allocatable :: values(:)

    call open_file(file, path, .false., unheard)
    call read_dataset(file, '/history/'//column, values, unheard)
    call close_file(file, unheard)
    largest = 0.0_wp
    if (allocated(values) .and. unheard%count() == 0) &
      largest = maxval(abs(values(:min(rows, size(values)))))
  end function largest_of_column

  !> Write the quality of a run that has come to its end.
  subroutine write_quality(path, quality, errors)
    character(*),       intent(in)    :: path
    type(quality_t),    intent(in)    :: quality
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    call open_file(file, path, .true., errors)
    call put_quality(file, quality, errors)
    call close_file(file, errors)
  end subroutine write_quality

  subroutine put_quality(file, quality, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(quality_t),    intent(in)    :: quality
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: group = '/quality'

    call write_attribute(file, group, 'energy_error', quality%energy_error, errors)
    call write_attribute(file, group, 'kinetic_ratio', quality%kinetic_ratio, errors)
    call write_attribute(file, group, 'reaction_gap', quality%reaction_gap, errors)
    call write_attribute(file, group, 'damping_share', quality%damping_share, errors)
    call write_attribute(file, group, 'control_share', quality%control_share, errors)
    call write_attribute(file, group, 'min_det_f', quality%min_det_f, errors)
    call write_attribute(file, group, 'zero_energy', quality%zero_energy, errors)
  end subroutine put_quality

end module pd_trust
