!> How far the parts of a model look around.
module pd_setup_reach
  use pd_input_shapes, only: is_bearing
  use pd_input_types, only: input_t
  use pd_kinds, only: is_set, wp
  implicit none
  private

  public :: looks_near

contains

  !> Whether nothing in a model looks farther than a horizon, but for supports and probes: neither
  !> stages, cuts, mirrors, loads, initial stress, nor statistics of what varies over the body.
  !>
  !> A lattice is kept in runs then, and each rank sets up its own rows only.
  pure logical function looks_near(input)
    type(input_t), intent(in) :: input
    integer :: k

    looks_near = size(input%stages) == 0 .and. size(input%pressures) == 0 &
      .and. .not. is_set(input%initial_stress%k0) &
      .and. .not. is_set(input%random_field%coefficient_of_variation) &
      .and. .not. is_set(input%random_field%correlation_length) &
      .and. size(input%cuts) == 0 .and. input%run%operators /= 'list'
    do k = 1, size(input%boundaries)
      looks_near = looks_near .and. .not. is_bearing(input%boundaries(k))
      ! points that begin to be moved lose their weight, which every rank adds up
      if (size(input%gravity%acceleration) > 0) &
        looks_near = looks_near .and. .not. is_set(input%boundaries(k)%traction_until)
    end do
    do k = 1, size(input%materials)
      looks_near = looks_near &
        .and. .not. abs(input%materials(k)%youngs_modulus_gradient) > 0.0_wp &
        .and. .not. abs(input%materials(k)%yield_stress_gradient) > 0.0_wp
    end do
  end function looks_near

end module pd_setup_reach
