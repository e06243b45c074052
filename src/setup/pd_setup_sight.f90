!> From checked input to which points see each other.
module pd_setup_sight
  use pd_body, only: body_t
  use pd_cells, only: cells_t, largest_neighbourhood, sort_into_cells
  use pd_errors, only: error_list_t
  use pd_families, only: family, horizon_t
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_sight, only: new_sight, sight_t
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: look_around

contains

  !> Sight of the points of a body; not allocated: all points within the horizon see each other, as
  !> those in runs do.
  !>
  !> Errors: a cut that no bond crosses.
  subroutine look_around(input, horizon, body, sight, errors)
    type(input_t),   intent(in) :: input
    type(horizon_t), intent(in) :: horizon
    type(body_t),    intent(in) :: body
    type(sight_t), allocatable, intent(out) :: sight
    type(error_list_t), intent(inout) :: errors
    real(wp) :: cuts(4, size(input%cuts))
    integer  :: k

    if (input%discretisation%families == 'distance' .or. body%runs%n > 0) return
    if (size(input%cuts) == 0 .and. .not. allocated(body%place)) return
    do k = 1, size(input%cuts)
      cuts(:, k) = [input%cuts(k)%x(1), input%cuts(k)%y(1), input%cuts(k)%x(2), input%cuts(k)%y(2)]
    end do
    sight = new_sight(body, input%discretisation%layout == 'cells', input%discretisation%spacing, &
      input%discretisation%horizon, cuts)
    if (size(cuts) > 0) call look_at_cuts(horizon, body, sight, errors)
  end subroutine look_around

  !> Look for cuts that no bond crosses.
  subroutine look_at_cuts(horizon, body, sight, errors)
    type(horizon_t),    intent(in)    :: horizon
    type(body_t),       intent(in)    :: body
    type(sight_t),      intent(in)    :: sight
    type(error_list_t), intent(inout) :: errors
    type(cells_t) :: cells
    integer, allocatable :: members(:)
    integer :: i, j, k, n_members
    logical :: crossed(size(sight%cuts, 2))

    call sort_into_cells(body%position, horizon%delta, cells)
    allocate (members(largest_neighbourhood(cells)))
    crossed = .false.
    do i = 1, body%n
      if (all(crossed)) return
      if (sight%all_clear(i)) cycle
      call family(horizon, cells, body%position, i, members, n_members)
      do j = 1, n_members
        do k = 1, size(crossed)
          if (.not. crossed(k)) crossed(k) = sight%crosses(k, i, members(j)) &
            .and. sight%through_material(i, members(j))
        end do
      end do
    end do
    do k = 1, size(crossed)
      if (crossed(k)) cycle
      associate (cut => sight%cuts(:, k))
        call errors%add('no bond crosses the cut', '&cut '//integer_text(k), &
          'from ('//number_text(cut(1))//', '//number_text(cut(2))//') to ('// &
          number_text(cut(3))//', '//number_text(cut(4))//')', &
          'a line between points of one body that are less than a horizon apart')
      end associate
    end do
  end subroutine look_at_cuts

end module pd_setup_sight
