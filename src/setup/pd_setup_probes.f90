!> From checked input to the points that the history follows.
module pd_setup_probes
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_text, only: number_text, short_number
  implicit none
  private

  public :: set_up_probes

contains

  !> The nearest point of the body for every probe; the first of several.
  !>
  !> Errors: it is farther than a spacing.
  subroutine set_up_probes(input, model, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: round_off = 1.0e-6_wp
    integer :: k, point, found(size(input%probes))

    allocate (model%probes(size(input%probes)))
    do k = 1, size(input%probes)
      associate (given => input%probes(k), probe => model%probes(k), x => model%body%position)
        point = minloc((x(:, 1) - given%x)**2 + (x(:, 2) - given%y)**2, dim=1, &
          mask=model%body%boundary == 0)
        probe%name = given%name
        probe%row = model%operators%storage%row(point)
        model%points%position(probe%row, :) = x(point, :)   ! on every rank
        probe%distance = norm2(x(point, :) - [given%x, given%y])
        if (probe%distance > (1.0_wp + round_off) * model%spacing) call errors%add( &
          'a probe is not in the body', '&probe name = '//given%name, &
          number_text(given%x)//', '//number_text(given%y), 'within '// &
          number_text(model%spacing)//' m of a point of the body; the nearest is '// &
          short_number(probe%distance)//' m away')
      end associate
    end do
    found = 0
    do k = 1, size(found)
      associate (row => model%probes(k)%row)
        if (row >= model%blocks%first .and. row <= model%blocks%last) &
          found(k) = model%materials%material_of(row)
      end associate
    end do
    call model%blocks%ranks%largest_numbers(found)
    model%probes%material = found
  end subroutine set_up_probes

end module pd_setup_probes
