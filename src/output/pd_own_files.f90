!> The files that a run writes, and what they must not replace.
module pd_own_files
  use pd_errors, only: error_list_t
  use pd_input, only: resolved_path
  use pd_input_types, only: input_t
  use pd_system, only: same_file
  implicit none
  private

  public :: keep_inputs, keep_inputs_from, lock_path

  !> Behind the output folder and the name of the run.
  character(*), parameter :: endings(10) = [character(24) :: '.h5', '.h5.tmp', '.xdmf', &
    '.xdmf.tmp', '.log', '.lock', '_history.csv', '_history.csv.tmp', '_checkpoint.h5', &
    '_checkpoint_previous.h5']

contains

  !> Name of the lock file.
  pure function lock_path(stem) result(path)
    character(*), intent(in) :: stem   !! output folder and name of the run
    character(:), allocatable :: path

    path = stem//'.lock'
  end function lock_path

  !> Report an error for every file of a run that is one of its inputs.
  subroutine keep_inputs(stem, input, errors)
    character(*),       intent(in)    :: stem   !! output folder and name of the run
    type(input_t),      intent(in)    :: input
    type(error_list_t), intent(inout) :: errors
    integer :: k

    do k = 1, size(endings)
      call keep_inputs_from(stem//trim(endings(k)), input, errors)
    end do
  end subroutine keep_inputs

  !> Report an error where a file that is to be written is the input, or a file that it names.
  subroutine keep_inputs_from(path, input, errors)
    character(*),       intent(in)    :: path
    type(input_t),      intent(in)    :: input
    type(error_list_t), intent(inout) :: errors
    integer :: k

    if (same_file(path, input%path)) call refuse()
    do k = 1, size(input%bodies)
      if (input%bodies(k)%shape /= 'file') cycle
      if (same_file(path, resolved_path(input, input%bodies(k)%file))) call refuse()
    end do

  contains

    subroutine refuse()
      call errors%add('is an input of this run, and an output would replace it; give the run '// &
        'another name or folder', where=path)
    end subroutine refuse

  end subroutine keep_inputs_from

end module pd_own_files
