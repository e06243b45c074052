!> From checked input to the weight of the points.
!>
!> Source: doc/theory.md, section 7.
module pd_setup_gravity
  use pd_body_force, only: new_body_force
  use pd_input_shapes, only: is_bearing
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_setup_surface, only: taken
  use pd_text, only: short_number
  implicit none
  private

  public :: set_up_gravity

contains

  !> b = rho g on all points. Those of a boundary have none in the components in which it transfers
  !> forces: they are moved there, and their weight would only come back as a reaction. Where they
  !> slide they stand for a body that goes on, and carry their own weight; bearings are no soil, and
  !> have none.
  subroutine set_up_gravity(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: density(:, :)
    character(:), allocatable :: text
    real(wp) :: layers(2)
    integer  :: c, k

    associate (g => input%gravity%acceleration, points => model%points, &
      storage => model%operators%storage, blocks => model%blocks)
      if (size(g) == 0) return
      call storage%new_field(carries(input, model%body%boundaries(storage%points)), density)
      do k = 1, size(model%materials%runs)
        associate (run => model%materials%runs(k))
          do c = 1, 2
            density(run%lo:run%hi, c) = density(run%lo:run%hi, c) &
              * (model%materials%list(run%material)%density * g(c))
          end do
        end associate
      end do
      do c = 1, 2
        associate (i => blocks%first, j => blocks%last)
          layers(c) = blocks%total_of_rows((1.0_wp - points%in_body(i:j)) * points%volume(i:j) &
            * density(i:j, c))
        end associate
      end do
      text = short_number(g(1))//', '//short_number(g(2))//' m/s^2'
      if (any(abs(layers) > 0.0_wp)) text = text//', layers that slide have '// &
        short_number(layers(1))//', '//short_number(layers(2))//' N/m of it'
      call model%loads%append(new_body_force('gravity', density, points%volume, &
        input%gravity%ramp_time, g, text, blocks))
    end associate
  end subroutine set_up_gravity

  !> 1 where a point carries its own weight.
  pure function carries(input, boundary) result(mask)
    type(input_t), intent(in) :: input
    integer,       intent(in) :: boundary(:)   !! of every point, 0: body
    real(wp) :: mask(size(boundary), 2)
    integer  :: i

    mask = 1.0_wp
    do i = 1, size(boundary)
      if (boundary(i) == 0) cycle
      associate (b => input%boundaries(boundary(i)))
        where (taken(b) .or. is_bearing(b)) mask(i, :) = 0.0_wp
      end associate
    end do
  end function carries

end module pd_setup_gravity
