!> The fields of a frame, in their order: what each is, in words and in numbers.
!>
!> This is the only list of them. Creating and writing datasets, copying them on a restart and the
!> XDMF file loop over it; one more field is a procedure and a call here.
!> Source: doc/theory.md, section 10.
module pd_frame_fields
  use pd_gather, only: own_points
  use pd_kinds, only: n_block, wp
  use pd_labels, only: field_label_t
  use pd_model, only: model_t
  use pd_state, only: state_t
  use pd_tensors, only: determinant, von_mises
  implicit none
  private

  public :: points_view_t, frame_field_t, frame_fields, fill_field

  !> What a field sees.
  type :: points_view_t
    type(model_t), pointer :: model => null()
    type(state_t), pointer :: state => null()
    integer :: column = 0   !! of the history that the field shows
  end type points_view_t

  !> A field over the points.
  type, extends(field_label_t) :: frame_field_t
    procedure(field_of_points), pointer, nopass :: values => null()
    integer :: column = 0   !! of the history, for fields that share one procedure
  end type frame_field_t

  abstract interface
    !> The values at the points of the body and of its layers, point by point as they go to the
    !> file: those of the points of this rank.
    subroutine field_of_points(view, values)
      import :: points_view_t, wp
      type(points_view_t), intent(in)  :: view
      real(wp),            intent(out), contiguous :: values(:, :)   !! (components,points)
    end subroutine field_of_points
    !> Up to four numbers in each row of a block; row 1 is the first row of the block.
    pure subroutine numbers_of_block(view, block, numbers)
      import :: n_block, points_view_t, wp
      type(points_view_t), intent(in)    :: view
      integer,             intent(in)    :: block
      real(wp),            intent(inout) :: numbers(n_block, 4)   !! out
    end subroutine numbers_of_block
  end interface

contains

  !> The fields of the frames of a run.
  subroutine frame_fields(fields, in_stages)
    type(frame_field_t), allocatable, intent(out) :: fields(:)
    logical, optional, intent(in) :: in_stages   !! points come and go
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
      frame_field_t('det_f', '1', 'det F, volume over that of the undeformed body', '', det_f), &
      frame_field_t('von_mises', 'Pa', 'equivalent stress sqrt(3/2) |deviator of the Cauchy '// &
      'stress|', '', mises_stress), &
      frame_field_t('zero_energy', '1', 'root mean square over the family of the part of the '// &
      'deformation that F does not describe, divided by the horizon', '', zero_energy)]
    if (.not. present(in_stages)) return
    if (in_stages) fields = [fields, frame_field_t('active', '1', 'whether the point is there '// &
      'in this stage: 1, or 0', '', active)]
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

  subroutine active(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    integer :: i

    do i = 1, size(values, 2)
      values(1, i) = merge(1.0_wp, 0.0_wp, &
        view%model%points%volume(view%model%shown%row(i)) > 0.0_wp)
    end do
  end subroutine active

  subroutine displacement(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take(view%model, view%state%displacement, values)
  end subroutine displacement

  subroutine velocity(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take(view%model, view%state%velocity, values)
  end subroutine velocity

  subroutine stress(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take_blocks(view, cauchy_of_block, values)
  end subroutine stress

  subroutine mises_stress(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take_blocks(view, mises_of_block, values)
  end subroutine mises_stress

  subroutine strain(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take_blocks(view, strain_of_block, values)
  end subroutine strain

  subroutine plastic_strain(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)

    call take_blocks(view, plastic_strain_of_block, values)
  end subroutine plastic_strain

  subroutine det_f(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    integer :: i, ends(2)

    ends = own_points(view%model%blocks, view%model%shown)
    associate (h => view%state%displacement_gradient, rows => view%model%shown%rows_of(ends))
      do i = ends(1), ends(2)
        values(1, i) = determinant(h(rows(i - ends(1) + 1), :))
      end do
    end associate
  end subroutine det_f

  !> The rms of the zero-energy part of the deformation, weighted with omega V over the family, over
  !> the horizon.
  subroutine zero_energy(view, values)
    type(points_view_t), intent(in)  :: view
    real(wp),            intent(out), contiguous :: values(:, :)
    real(wp), allocatable :: z2(:)
    integer :: i, ends(2)

    ends = own_points(view%model%blocks, view%model%shown)
    associate (operators => view%model%operators, state => view%state, &
      rows => view%model%shown%rows_of(ends))
      allocate (z2(operators%n))
      call operators%zero_energy_squared(state%displacement, state%displacement_gradient, z2)
      do i = ends(1), ends(2)
        associate (row => rows(i - ends(1) + 1))
          values(1, i) = sqrt(z2(row) / operators%weight_sum(row)) / view%model%delta
        end associate
      end do
    end associate
  end subroutine zero_energy

  !> The values of a field of the state at the points.
  subroutine take(model, field, values)
    type(model_t), intent(in) :: model
    real(wp), intent(in)  :: field(:, :)                    !! (rows,components)
    real(wp), intent(out), contiguous :: values(:, :)       !! (components,points)
    integer, allocatable :: rows(:)
    integer :: i, ends(2)

    ends = own_points(model%blocks, model%shown)
    allocate (rows, source=model%shown%rows_of(ends))
    !$omp parallel do schedule(static) default(none) private(i) shared(rows, values, field, ends)
    do i = ends(1), ends(2)
      values(:, i) = field(rows(i - ends(1) + 1), :)
    end do
    !$omp end parallel do
  end subroutine take

  !> The values at the points of a field that is computed block by block.
  subroutine take_blocks(view, of_block, values)
    type(points_view_t), intent(in)  :: view
    procedure(numbers_of_block) :: of_block
    real(wp),            intent(out), contiguous :: values(:, :)   !! (components,points)
    real(wp) :: numbers(n_block, 4)
    integer  :: block, i, lo

    !$omp parallel do schedule(static) default(none) private(block, i, lo, numbers) &
    !$omp shared(view, values)
    do block = 1, view%model%blocks%count
      lo = view%model%blocks%lo(block)
      call of_block(view, block, numbers)
      associate (storage => view%model%shown)
        do i = storage%first_point(lo), storage%first_point(view%model%blocks%hi(block) + 1) - 1
          values(:, i) = numbers(storage%row(i) - lo + 1, :size(values, 1))
        end do
      end associate
    end do
    !$omp end parallel do
  end subroutine take_blocks

  !> Cauchy stress; 0 at a point that has failed (det F <= 0).
  pure subroutine cauchy_of_block(view, block, numbers)
    type(points_view_t), intent(in)    :: view
    integer,             intent(in)    :: block
    real(wp),            intent(inout) :: numbers(n_block, 4)

    call view%model%materials%cauchy_block(block, view%state%displacement_gradient, &
      view%state%stress, numbers)
  end subroutine cauchy_of_block

  pure subroutine mises_of_block(view, block, numbers)
    type(points_view_t), intent(in)    :: view
    integer,             intent(in)    :: block
    real(wp),            intent(inout) :: numbers(n_block, 4)
    integer :: b

    call cauchy_of_block(view, block, numbers)
    do b = 1, view%model%blocks%hi(block) - view%model%blocks%lo(block) + 1
      numbers(b, 1) = von_mises(numbers(b, :))
    end do
  end subroutine mises_of_block

  pure subroutine strain_of_block(view, block, numbers)
    type(points_view_t), intent(in)    :: view
    integer,             intent(in)    :: block
    real(wp),            intent(inout) :: numbers(n_block, 4)

    call view%model%materials%strain_block(block, view%state%displacement_gradient, numbers)
  end subroutine strain_of_block

  pure subroutine plastic_strain_of_block(view, block, numbers)
    type(points_view_t), intent(in)    :: view
    integer,             intent(in)    :: block
    real(wp),            intent(inout) :: numbers(n_block, 4)

    call view%model%materials%plastic_strain_block(block, view%state%law_points_t, &
      numbers(:, 1))
  end subroutine plastic_strain_of_block

end module pd_frame_fields
