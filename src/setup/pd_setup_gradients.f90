!> From checked input to strength and stiffness that grow with depth.
!>
!>   E(y) = E + E' d,   sigma_y(y) = sigma_y + sigma_y' d,   d = max(0, y_ref - y)
!>
!> Source: doc/theory.md, section 3.
module pd_setup_gradients
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t, material_input_t
  use pd_kinds, only: is_set, wp
  use pd_model, only: model_t, top_of
  use pd_text, only: number_text
  implicit none
  private

  public :: yield_stress_at, set_up_stiffness, check_gradients

contains

  !> Depth below the height at which the numbers of a material hold [m].
  elemental real(wp) function depth(given, y, top)
    type(material_input_t), intent(in) :: given
    real(wp),               intent(in) :: y, top   !! of the body [m]

    depth = top
    if (is_set(given%reference_y)) depth = given%reference_y
    depth = max(0.0_wp, depth - y)
  end function depth

  !> Initial yield stress; 0 where a material has none.
  elemental real(wp) function yield_stress_at(given, y, top) result(yield_stress)
    type(material_input_t), intent(in) :: given
    real(wp),               intent(in) :: y, top   !! of the body [m]

    yield_stress = 0.0_wp
    if (is_set(given%yield_stress)) yield_stress = given%yield_stress &
      + given%yield_stress_gradient * depth(given, y, top)
  end function yield_stress_at

  !> Stiffness of the rows over that of their material, where a material has a gradient.
  subroutine set_up_stiffness(input, material_of, model)
    type(input_t), intent(in)    :: input
    integer,       intent(in)    :: material_of(:)   !! of every point
    type(model_t), intent(inout) :: model
    integer :: i

    if (.not. any(abs(input%materials%youngs_modulus_gradient) > 0.0_wp)) return
    allocate (model%materials%stiffness(model%operators%n), source=1.0_wp)
    do i = 1, size(material_of)
      associate (given => input%materials(material_of(i)))
        model%materials%stiffness(model%operators%storage%row(i)) = 1.0_wp &
          + given%youngs_modulus_gradient / given%youngs_modulus &
          * depth(given, model%body%position(i, 2), top_of(model))
      end associate
    end do
  end subroutine set_up_stiffness

  !> The same of every point; 1 where there is no gradient.
  pure function stiffness_of_points(model) result(stiffness)
    type(model_t), intent(in) :: model
    real(wp) :: stiffness(model%operators%storage%n)

    stiffness = 1.0_wp
    if (allocated(model%materials%stiffness)) &
      stiffness = model%materials%stiffness(model%operators%storage%row())
  end function stiffness_of_points

  !> Points at which a gradient has left no stiffness or strength.
  subroutine check_gradients(input, model, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(in)    :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), allocatable :: stiffness(:)
    integer  :: i, k

    if (.not. (allocated(model%materials%stiffness) .or. &
      any(input%materials%yield_stress_gradient < 0.0_wp))) return
    allocate (stiffness, source=stiffness_of_points(model))
    if (any(stiffness <= 0.0_wp)) call report('youngs_modulus_gradient', minloc(stiffness, dim=1))
    if (.not. any(input%materials%yield_stress_gradient < 0.0_wp)) return
    do i = 1, size(stiffness)
      associate (row => model%operators%storage%row(i))
        k = model%materials%material_of(row)
        if (model%strength(row) > 0.0_wp .or. model%materials%list(k)%law%plastic_strain == 0) cycle
        call report('yield_stress_gradient', i)
        return
      end associate
    end do

  contains

    subroutine report(key, point)
      character(*), intent(in) :: key
      integer,      intent(in) :: point

      call errors%add('nothing is left of the material at ('// &
        number_text(model%body%position(point, 1))//', '// &
        number_text(model%body%position(point, 2))//') m', '&material '//key, &
        allowed='a gradient that leaves more than 0 at every point, layers included')
    end subroutine report

  end subroutine check_gradients

end module pd_setup_gradients
