!> What a result file says of the points themselves, from ranks that know their own.
module pd_parts_of_points
  use pd_errors, only: error_list_t
  use pd_hdf5, only: close_file, hdf5_file_t, open_file
  use pd_model, only: model_t
  use pd_parts, only: as_column, put_field
  implicit none
  private

  public :: hand_in_points

contains

  !> Write positions, volumes and yield stresses into a file that has room for them. Every rank
  !> must come here.
  !>
  !> Errors: the file cannot be written.
  subroutine hand_in_points(path, with_strength, model, errors)
    character(*),       intent(in)    :: path
    logical,            intent(in)    :: with_strength
    type(model_t),      intent(in)    :: model
    type(error_list_t), intent(inout) :: errors
    type(hdf5_file_t) :: file

    associate (blocks => model%blocks, shown => model%shown)
      if (blocks%ranks%mine == 0) call open_file(file, path, .true., errors)
      call put_field(file, '/points/position', blocks, shown, model%points%position, errors)
      call put_field(file, '/points/volume', blocks, shown, as_column(model%points%volume), errors)
      if (with_strength) call put_field(file, '/points/yield_stress', blocks, shown, &
        as_column(model%strength), errors)
      if (blocks%ranks%mine == 0) call close_file(file, errors)
    end associate
  end subroutine hand_in_points

end module pd_parts_of_points
