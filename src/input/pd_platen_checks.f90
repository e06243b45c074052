!> Platens as the input describes them: which boundaries they are, and how they approach.
module pd_platen_checks
  use pd_input_shapes, only: find_extents
  use pd_input_types, only: boundary_input_t, input_t
  use pd_kinds, only: is_set, unset, wp
  use pd_sides, only: normal_axis, outward
  use pd_tables, only: difference, new_table, table_t
  implicit none
  private

  public :: platens_of, platen_approach, platen_extent, platen_under_load
  public :: all_moved_later

contains

  !> Indices of the platens, the one at the lower end of their axis first: exactly two boundaries,
  !> on opposite sides, whole ones, neither affine; 0, 0 where there are none.
  pure function platens_of(boundaries) result(platens)
    type(boundary_input_t), intent(in) :: boundaries(:)
    integer :: platens(2)

    platens = 0
    if (size(boundaries) /= 2) return
    associate (a => boundaries(1), b => boundaries(2))
      if (a%contact == 'affine' .or. b%contact == 'affine') return
      if (on_part(a) .or. on_part(b)) return
      if (normal_axis(a%side) /= normal_axis(b%side)) return
      if (outward(a%side) < outward(b%side)) platens = [1, 2]
      if (outward(a%side) > outward(b%side)) platens = [2, 1]
    end associate
  end function platens_of

  !> Whether a boundary stands on a part of its side.
  pure logical function on_part(boundary)
    type(boundary_input_t), intent(in) :: boundary

    on_part = .false.
    if (allocated(boundary%span)) on_part = size(boundary%span) > 0
  end function on_part

  !> Whether there are platens one of which moves under a load: its motion is known only in the run.
  pure logical function platen_under_load(input) result(found)
    type(input_t), intent(in) :: input
    integer :: i

    found = .false.
    if (input%platens(1) == 0) return
    do i = 1, 2
      found = found .or. size(input%boundaries(input%platens(i))%traction) > 0
    end do
  end function platen_under_load

  !> Whether each of the platens is moved, if only after a load.
  pure logical function all_moved_later(input) result(moved)
    type(input_t), intent(in) :: input
    integer :: i

    moved = .true.
    do i = 1, 2
      associate (b => input%boundaries(input%platens(i)))
        if (size(b%traction) > 0) moved = moved .and. is_set(b%traction_until)
      end associate
    end do
  end function all_moved_later

  !> Rate at which the platens of the input approach each other [m/s]. Needs platens, and tables as
  !> long as times.
  pure type(table_t) function platen_approach(input) result(approach)
    type(input_t), intent(in) :: input

    approach = difference(velocity_across(input%boundaries(input%platens(1))), &
      velocity_across(input%boundaries(input%platens(2))))
  end function platen_approach

  !> Velocity of a boundary across its side [m/s].
  pure type(table_t) function velocity_across(boundary) result(velocity)
    type(boundary_input_t), intent(in) :: boundary

    if (normal_axis(boundary%side) == 1) then
      velocity = component(boundary%velocities_x, boundary%velocity(1))
    else
      velocity = component(boundary%velocities_y, boundary%velocity(2))
    end if

  contains

    pure type(table_t) function component(rates, constant)
      real(wp), intent(in) :: rates(:), constant

      component = new_table(boundary%times, rates, constant)
    end function component

  end function velocity_across

  !> Extent of the body between the platens as the set-up will make it [m]; `unset` where it is
  !> not in the input.
  pure real(wp) function platen_extent(input) result(extent)
    type(input_t), intent(in) :: input
    real(wp) :: lower(2), upper(2)
    integer  :: axis
    logical  :: known

    extent = unset
    axis = normal_axis(input%boundaries(input%platens(1))%side)
    call find_extents(input%bodies, input%discretisation%spacing, lower, upper, known)
    if (.not. known) return
    extent = upper(axis) - lower(axis)
    if (input%bodies(1)%shape == 'rectangle' .and. is_set(input%discretisation%spacing)) &
      extent = aint(extent/input%discretisation%spacing + 0.5_wp + 1.0e-6_wp) &
               *input%discretisation%spacing   ! aint: of any size
    if (extent <= 0.0_wp) extent = unset
  end function platen_extent

end module pd_platen_checks
