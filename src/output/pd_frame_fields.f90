!> The fields of a frame, in their order: what each is, in words and in numbers.
!>
!> This is the only list of them. Places in the result file, writing, taking over on a restart and
!> the XDMF file loop over it; one more field is a procedure and a call here.
!> Source: doc/theory.md, section 10.
module pd_frame_fields
  use pd_j2, only: von_mises
  use pd_kinds, only: wp
  use pd_labels, only: field_label_t
  use pd_model, only: model_t
  use pd_state, only: state_t
  use pd_strain, only: cauchy, determinant, green_lagrange
  implicit none
  private

  public :: points_view_t, frame_field_t, frame_fields, fill_field

  !> What a field sees.
  type :: points_view_t
    type(model_t), pointer :: model => null()
    type(state_t), pointer :: state => null()
    integer :: column = 0   !! that the field is about
  end type points_view_t

  !> A field over the points, voids left out.
  type, extends(field_label_t) :: frame_field_t
    procedure(field_of_points), pointer, nopass :: values => null()
    integer :: column = 0   !! that it is about, if it is: fields that one procedure serves
  end type frame_field_t

  abstract interface
    !> The values at the points of the body and of its layers, point by point as they go to the
    !> file.
    subroutine field_of_points(view, values)
      import :: points_view_t, wp
      type(points_view_t), intent(in)  :: view
      real(wp),            intent(out), contiguous :: values(:, :)   !! (components,points)
    end subroutine field_of_points
  end interface

contains

  !> The fields of the frames of a run.
  subroutine frame_fields(fields)
    type(frame_field_t), allocatable, intent(out) :: fields(:)
    character(*), parameter :: tensor = 'xx yy zz xy'

    fields = [ &
      frame_field_t('displacement', 'm', 'displacement from the reference position', 'x y', &
      displacement), &
      frame_field_t('velocity', 'm/s', 'velocity', 'x y', velocity), &
      frame_field_t('stress', 'Pa', 'Cauchy stress, tension positive', tensor, stress), &
      frame_field_t('strain', '1', 'strain in the measure of the material (xy: tensor '// &
      'component)', tensor, strain), &
      frame_field_t('plastic_strain', '1', 'equivalent plastic strain alpha', '', &
      plastic_strain), &
      frame_field_t('von_mises', 'Pa', 'equivalent stress sqrt(3/2) |deviator of the Cauchy '// &
      'stress|', '', mises_stress), &
      frame_field_t('zero_energy', '1', 'root mean square over the family of the part of the '// &
      'deformation that F does not describe, divided by the horizon', '', zero_energy)]
  end subroutine frame_fields

  !> The values of a field at the points of the body and of its layers.
  subroutine fill_field(field, model, state, values)
    type(frame_field_t),   intent(in)  :: field
    type(model_t), target, intent(in)  :: model
    type(state_t), target, intent(in)  :: state
    real(wp),              intent(out), contiguous :: values(:, :)   !! (components,points)
    type(points_view_t) :: view

    view%model => model
    view%state => state
    view%column = field%column
    call field%values(view, values)
  end subroutine fill_field

  subroutine displacement(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take(view%model%body%points, view%state%displacement, values)
  end subroutine displacement

  subroutine velocity(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take(view%model%body%points, view%state%velocity, values)
  end subroutine velocity

  !> Cauchy stress; a point that has failed (det F <= 0) has none: 0.
  subroutine stress(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    integer :: i

    !$omp parallel do schedule(static) default(none) private(i) shared(view, values)
    do i = 1, size(view%model%body%points)
      values(:, i) = cauchy_or_zero(view%model%body%points(i), view%state)
    end do
    !$omp end parallel do
  end subroutine stress

  subroutine mises_stress(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    integer :: i

    !$omp parallel do schedule(static) default(none) private(i) shared(view, values)
    do i = 1, size(view%model%body%points)
      values(1, i) = von_mises(cauchy_or_zero(view%model%body%points(i), view%state))
    end do
    !$omp end parallel do
  end subroutine mises_stress

  subroutine strain(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    real(wp) :: f(4)
    integer  :: i

    !$omp parallel do schedule(static) default(none) private(i, f) shared(view, values)
    do i = 1, size(view%model%body%points)
      f = view%state%deformation_gradient(view%model%body%points(i), :)
      values(:, i) = green_lagrange(f)
    end do
    !$omp end parallel do
  end subroutine strain

  subroutine plastic_strain(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    values(1, :) = view%state%alpha(view%model%body%points)
  end subroutine plastic_strain

  !> The rms of the zero-energy part of the deformation, weighted with omega V over the family, over
  !> the horizon.
  subroutine zero_energy(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    real(wp), allocatable :: z2(:)

    allocate (z2(view%model%body%n))
    associate (places => view%model%body%points, operators => view%model%operators)
      call operators%zero_energy_squared(view%state%displacement, &
        view%state%deformation_gradient, z2)
      values(1, :) = sqrt(z2(places) / operators%weight_sum(places)) / view%model%delta
    end associate
  end subroutine zero_energy

  !> The values of a field of the state at some places.
  subroutine take(places, field, values)
    integer,  intent(in)  :: places(:)
    real(wp), intent(in)  :: field(:, :)                    !! (n,components)
    real(wp), intent(out), contiguous :: values(:, :)       !! (components,places)
    integer :: i

    !$omp parallel do schedule(static) default(none) private(i) shared(places, values, field)
    do i = 1, size(places)
      values(:, i) = field(places(i), :)
    end do
    !$omp end parallel do
  end subroutine take

  !> Cauchy stress at a place; 0 where det F is not positive.
  pure function cauchy_or_zero(place, state) result(sigma)
    integer,       intent(in) :: place
    type(state_t), intent(in) :: state
    real(wp) :: sigma(4)   !! xx yy zz xy [Pa]
    real(wp) :: f(4), s(4)

    f = state%deformation_gradient(place, :)
    s = state%stress(place, :)
    sigma = 0.0_wp
    if (determinant(f) > 0.0_wp) sigma = cauchy(f, s)
  end function cauchy_or_zero

end module pd_frame_fields
