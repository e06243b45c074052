!> From checked input to what the points are made of: laws, strain measures, strength, control.
!>
!> A new law or strain measure is a module of its own and a line in `new_law` or `new_measure`.
module pd_setup_materials
  use pd_elastic, only: new_elastic
  use pd_green_lagrange, only: green_lagrange_t
  use pd_input_types, only: input_t, material_input_t
  use pd_j2, only: new_j2
  use pd_kinds, only: is_set, wp
  use pd_law, only: law_t
  use pd_materials, only: divide_into_runs
  use pd_measure, only: measure_t
  use pd_model, only: model_t
  use pd_operators, only: control_stiffness
  use pd_random_field, only: lognormal, new_random_field, standard_normal
  implicit none
  private

  public :: set_up_points, set_up_materials

contains

  !> What does not change at the points.
  subroutine set_up_points(model)
    type(model_t), intent(inout) :: model

    associate (points => model%points, body => model%body, storage => model%operators%storage)
      points%position = storage%spread(body%position)
      points%volume = storage%spread(body%volume)
      points%in_body = storage%spread(merge(1.0_wp, 0.0_wp, body%boundary == 0))
      points%free = spread(storage%spread(spread(1.0_wp, 1, body%n)), 2, 2)
      allocate (points%place(storage%rows), source=0.0_wp)
    end associate
  end subroutine set_up_points

  !> Materials, initial strength, zero-energy control.
  subroutine set_up_materials(input, model)
    type(input_t), intent(in)    :: input
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: strength(:)

    allocate (model%materials%list(1))
    associate (m => input%material, material => model%materials%list(1))
      material%name = 'material'
      material%density = m%density
      material%youngs_modulus = m%youngs_modulus
      allocate (material%measure, source=new_measure(m%strain_measure))
      allocate (material%law, source=new_law(m))
      call divide_into_runs(model%blocks, &
        model%operators%storage%spread(spread(1, 1, model%body%n)), model%materials)
      allocate (strength(model%body%n))
      call set_up_strength(input, model%body%position, strength)
      model%strength = model%operators%storage%spread(strength)
      if (input%stabilisation%method == 'silling') call set_up_control( &
        input%stabilisation%factor, m%youngs_modulus, model)
    end associate
  end subroutine set_up_materials

  !> The law of a material.
  pure function new_law(given) result(law)
    type(material_input_t), intent(in) :: given
    class(law_t), allocatable :: law

    select case (given%model)
    case ('elastic')
      allocate (law, source=new_elastic(given%youngs_modulus, given%poissons_ratio))
    case ('j2')
      allocate (law, source=new_j2(given%youngs_modulus, given%poissons_ratio, &
        given%kinematic_modulus, given%isotropic_modulus, max(0.0_wp, given%residual_strength)))
    end select
  end function new_law

  !> The strain measure of a material.
  pure function new_measure(name) result(measure)
    character(*), intent(in) :: name
    class(measure_t), allocatable :: measure

    select case (name)
    case ('green_lagrange')
      allocate (green_lagrange_t :: measure)
    end select
  end function new_measure

  !> Control of zero-energy modes after Silling: c_i = g C_0 / W_i with C_0 = 48 E / (5 pi delta^2).
  subroutine set_up_control(factor, youngs_modulus, model)
    real(wp),      intent(in)    :: factor           !! g
    real(wp),      intent(in)    :: youngs_modulus   !! E [Pa]
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: c(:)

    allocate (c(model%operators%n), source=control_stiffness(factor, youngs_modulus, model%delta, &
      model%operators%weight_sum))
    where (model%points%volume <= 0.0_wp) c = 0.0_wp
    call model%operators%set_control(c)
  end subroutine set_up_control

  !> sigma_y0 of every point: the same everywhere or a random field, reduced in the weak patch.
  subroutine set_up_strength(input, position, yield_stress)
    type(input_t), intent(in)  :: input
    real(wp),      intent(in),  contiguous :: position(:, :)    !! X (n,2) [m]
    real(wp),      intent(out), contiguous :: yield_stress(:)   !! (n) [Pa]
    integer :: i

    associate (mean => max(0.0_wp, input%material%yield_stress), field => input%random_field, &
      flaw => input%imperfection)
      yield_stress = mean
      if (is_set(field%coefficient_of_variation)) then
        call standard_normal(new_random_field(field%correlation_length, field%seed), position, &
          yield_stress)
        yield_stress = lognormal(mean, field%coefficient_of_variation, yield_stress)
      end if
      if (flaw%amplitude <= 0.0_wp) return
      do i = 1, size(yield_stress)
        if (norm2(position(i, :) - [flaw%x, flaw%y]) <= flaw%radius * (1.0_wp + 1.0e-6_wp)) &
          yield_stress(i) = (1.0_wp - flaw%amplitude) * yield_stress(i)
      end do
    end associate
  end subroutine set_up_strength

end module pd_setup_materials
