!> The tries of a search for the factor of safety, in a result file.
module pd_result_tries
  use pd_errors, only: error_list_t
  use pd_frames, only: write_label
  use pd_hdf5, only: create_group, hdf5_file_t, write_attribute, write_dataset
  use pd_kinds, only: wp
  use pd_labels, only: label_t
  use pd_tries, only: tries_t
  implicit none
  private

  public :: put_tries

contains

  !> A group of its own; the factor lies between its two attributes.
  subroutine put_tries(file, tries, errors)
    type(hdf5_file_t),  intent(inout) :: file
    type(tries_t),      intent(in)    :: tries
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: group = '/strength_reduction'

    call create_group(file, group, errors)
    call write_attribute(file, group, 'borne', tries%least(), errors)
    call write_attribute(file, group, 'not_borne', tries%most(), errors)
    call put('factor', '1', 'number by which the strength was divided', tries%factor)
    call put('held', '1', 'whether an equilibrium was found: 1, or 0', &
      merge(1.0_wp, 0.0_wp, tries%held))
    call put('displacement', 'm', 'largest displacement from the start of the try', &
      tries%displacement)
    call put('unbalanced_force', '1', 'unbalanced force at the end of the try, over '// &
      'reactions and loads', tries%unbalanced)

  contains

    subroutine put(name, unit, description, values)
      character(*), intent(in) :: name, unit, description
      real(wp),     intent(in) :: values(:)

      call write_dataset(file, group//'/'//name, values, errors)
      call write_label(file, group//'/'//name, label_t(name, unit, description), errors)
    end subroutine put

  end subroutine put_tries

end module pd_result_tries
