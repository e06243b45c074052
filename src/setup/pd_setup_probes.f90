!> From checked input to the points that the history follows.
module pd_setup_probes
  use pd_body, only: body_t
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
    real(wp) :: x(2)
    integer  :: k, point, found(size(input%probes))

    allocate (model%probes(size(input%probes)))
    do k = 1, size(input%probes)
      associate (given => input%probes(k), probe => model%probes(k))
        point = nearest_point(model%body, [given%x, given%y])
        x = model%body%position_of(point)
        probe%name = given%name
        probe%row = model%operators%storage%row(point)
        model%points%position(probe%row, :) = x   ! on every rank
        probe%distance = norm2(x - [given%x, given%y])
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

  !> The point of the body that is nearest to a place; the first of several.
  pure integer function nearest_point(body, place) result(nearest)
    type(body_t), intent(in) :: body
    real(wp),     intent(in) :: place(2)   !! [m]
    real(wp) :: least, square, x(2)
    integer  :: i

    nearest = 1
    least = huge(1.0_wp)
    do i = 1, body%n
      x = body%position_of(i)
      square = (x(1) - place(1))**2 + (x(2) - place(2))**2
      if (square >= least) cycle
      if (body%boundary_of(i) > 0) cycle
      least = square
      nearest = i
    end do
  end function nearest_point

end module pd_setup_probes
