!> Smooth layers on a part of a side, or on an edge, become mirror images of the body.
!>
!> Source: doc/theory.md, section 7.
module pd_setup_mirror
  use pd_body, only: body_t
  use pd_errors, only: error_list_t
  use pd_input_shapes, only: is_bearing
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_mirror, only: new_mirror
  use pd_model, only: model_t
  use pd_point_sets, only: boundary_set, images_of, point_set_t
  use pd_tables, only: table_t
  use pd_text, only: numbers_text
  implicit none
  private

  public :: give_images_their_volume, set_up_mirror

contains

  !> Images have the volume of what they are images of: forces and gradients then stay adjoint.
  !>
  !> Errors: a layer that is deeper than the body before it.
  subroutine give_images_their_volume(input, rows, body, errors)
    type(input_t),      intent(in)    :: input
    integer,            intent(in)    :: rows     !! of points in a layer
    type(body_t),       intent(inout) :: body
    type(error_list_t), intent(inout) :: errors
    type(point_set_t) :: set
    integer, allocatable :: origin(:)
    integer :: k, lost

    do k = 1, size(input%boundaries)
      if (.not. is_bearing(input%boundaries(k))) cycle
      set = boundary_set(input%boundaries(k)%name, body%boundary, k)
      if (size(set%points) == 0) cycle            ! it is not there in this stage
      origin = images_of(set%points, body%boundary, body%place, input%boundaries(k)%axis, rows)
      lost = findloc(origin, 0, dim=1)
      if (lost > 0) then
        call errors%add('a smooth boundary on a part of a side is a mirror, and the body before'// &
          ' it is thinner than its layer', '&boundary name = '//set%name, &
          'point at ('//numbers_text(body%position(set%points(lost), :))//') m', &
          'a body at least as thick as the horizon there, of points of its own')
        return
      end if
      body%volume(set%points) = body%volume(origin)
    end do
  end subroutine give_images_their_volume

  !> The mirror of the operators: a plane for each such boundary.
  subroutine set_up_mirror(input, rows, model)
    type(input_t), intent(in)    :: input
    integer,       intent(in)    :: rows          !! of points in a layer
    type(model_t), intent(inout) :: model
    type(point_set_t) :: set
    integer, allocatable :: row(:), origin(:), plane(:), support(:), normal(:)
    type(table_t), allocatable :: velocity(:)
    type(table_t) :: along_normal   ! gfortran loses the parts of a result in a constructor
    integer :: k

    allocate (row(0), origin(0), plane(0), support(0), normal(0), velocity(0))
    do k = 1, size(input%boundaries)
      if (.not. is_bearing(input%boundaries(k))) cycle
      set = boundary_set(input%boundaries(k)%name, model%body%boundary, k)
      if (size(set%points) == 0) cycle
      support = [support, k]
      normal = [normal, input%boundaries(k)%axis]
      along_normal = model%supports%items(k)%support%common_velocity(normal(size(normal)))
      velocity = [velocity, along_normal]
      row = [row, set%points]
      origin = [origin, images_of(set%points, model%body%boundary, model%body%place, &
        input%boundaries(k)%axis, rows)]
      plane = [plane, spread(size(support), 1, size(set%points))]
    end do
    if (size(row) == 0) return
    associate (operators => model%operators)
      operators%mirror = new_mirror(operators%storage%row(row), operators%storage%row(origin), &
        plane, support, normal, velocity)
      operators%k_inverse(operators%mirror%rows(), :) = 0.0_wp   ! images have no gradient
    end associate
  end subroutine set_up_mirror

end module pd_setup_mirror
