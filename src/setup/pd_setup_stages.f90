!> The bodies of the stages of a run, on one lattice.
!>
!> Every stage has a body of its own: which points there are, their volumes, and what is material
!> between them. All have the rows of the fields in common, so that a state goes on from one stage
!> to the next.
module pd_setup_stages
  use pd_body, only: body_t
  use pd_doubt_list, only: doubts_t
  use pd_errors, only: error_list_t
  use pd_input_types, only: body_input_t, boundary_input_t, input_t
  use pd_kinds, only: wp
  use pd_setup_body, only: set_up_body
  use pd_stages, only: stage_t
  use pd_text, only: number_text
  implicit none
  private

  public :: set_up_stage_body, set_up_whole

contains

  !> The body of a stage. In a run with stages it is numbered as in the input: its boundaries and
  !> parts are indices into all of them.
  !>
  !> `whole`: the points of all stages; n = 0: there are no stages, or they are not known yet.
  !> Errors: those of `set_up_body`.
  subroutine set_up_stage_body(input, stage, whole, body, doubts, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(stage_t),      intent(in)    :: stage
    type(body_t),       intent(in)    :: whole
    type(body_t),       intent(out)   :: body
    type(doubts_t),     intent(inout) :: doubts
    type(error_list_t), intent(inout) :: input_errors, errors
    type(input_t) :: present
    integer, allocatable :: bodies(:), boundaries(:)
    integer :: before, i

    if (stage%name == '') then
      call set_up_body(input, body, doubts, input_errors, errors)
      return
    end if
    present = input
    bodies = pack([(i, i=1, size(input%bodies))], stage%has_body)
    boundaries = pack([(i, i=1, size(input%boundaries))], stage%has_boundary)
    present%bodies = input%bodies(bodies)
    present%boundaries = input%boundaries(boundaries)
    before = errors%count()
    if (size(bodies) == 0) then
      call errors%add('a stage has no body', '&stage name = '//stage%name)
    else
      call set_up_body(present, body, doubts, input_errors, errors)
    end if
    if (errors%count() > before) then
      call errors%add('that is in the stage '''//stage%name//'''')
      return
    end if
    do i = 1, body%n
      body%part(i) = bodies(body%part(i))
      if (body%boundary(i) > 0) body%boundary(i) = boundaries(body%boundary(i))
    end do
    if (whole%n > 0) body%box = spread(places_apart(body, whole), 2, 2) + reshape( &
      [minval(whole%place, dim=1), maxval(whole%place, dim=1)], [2, 2])
  end subroutine set_up_stage_body

  !> Columns and rows by which the places of a body are ahead of those of another one.
  pure function places_apart(body, other) result(apart)
    type(body_t), intent(in) :: body, other
    integer :: apart(2)

    apart = nint((other%position(1, :) - body%position(1, :)) / spacing_of(other)) &
      + body%place(1, :) - other%place(1, :)
  end function places_apart

  !> Distance of the lines of the lattice of a body [m].
  pure real(wp) function spacing_of(body) result(spacing)
    type(body_t), intent(in) :: body
    integer :: i

    spacing = 0.0_wp
    do i = 2, body%n
      if (body%place(i, 1) == body%place(1, 1)) cycle
      spacing = (body%position(i, 1) - body%position(1, 1)) &
        / real(body%place(i, 1) - body%place(1, 1), wp)
      return
    end do
  end function spacing_of

  !> The points of all stages, with the largest volume that they have in any, in the order of the
  !> lattice; without stages n = 0.
  !>
  !> Errors: those of `set_up_body`; a stage that changes no point although it digs or fills; a
  !> place that belongs to a body in one stage and to a boundary in another.
  subroutine set_up_whole(input, stages, whole, input_errors, errors)
    type(input_t),      intent(in)    :: input
    type(stage_t),      intent(in)    :: stages(:)
    type(body_t),       intent(out)   :: whole
    type(error_list_t), intent(inout) :: input_errors, errors
    type(doubts_t) :: unheard
    type(body_t) :: bodies(size(stages)), none
    integer, allocatable :: owner(:, :), part(:, :)
    real(wp), allocatable :: volume(:, :), position(:, :, :)
    integer :: apart(2, size(stages)), low(2), high(2), before, k, i

    if (stages(1)%name == '') return
    do k = 1, size(stages)
      call set_up_stage_body(input, stages(k), none, bodies(k), unheard, input_errors, errors)
      if (k > 1) call check_change(input, k, before, bodies(k)%n, errors)
      before = bodies(k)%n
      if (errors%count() + input_errors%count() > 0) return
      apart(:, k) = -places_apart(bodies(k), bodies(1))
    end do
    low = huge(1)
    high = -huge(1)
    do k = 1, size(stages)
      low = min(low, minval(bodies(k)%place, dim=1) + apart(:, k))
      high = max(high, maxval(bodies(k)%place, dim=1) + apart(:, k))
    end do
    allocate (owner(low(1):high(1), low(2):high(2)), source=-1)
    allocate (part(low(1):high(1), low(2):high(2)), source=1)
    allocate (volume(low(1):high(1), low(2):high(2)), source=0.0_wp)
    allocate (position(2, low(1):high(1), low(2):high(2)), source=0.0_wp)
    do k = 1, size(stages)
      do i = 1, bodies(k)%n
        associate (x => bodies(k)%place(i, 1) + apart(1, k), &
          y => bodies(k)%place(i, 2) + apart(2, k), boundary => bodies(k)%boundary(i))
          if (owner(x, y) == -1) position(:, x, y) = bodies(k)%position(i, :)
          if (owner(x, y) == -1) part(x, y) = bodies(k)%part(i)
          if (owner(x, y) >= 0 .and. owner(x, y) /= boundary) then
            call report_change(position(:, x, y), stages(k)%name, errors)
            return
          end if
          owner(x, y) = boundary
          volume(x, y) = max(volume(x, y), bodies(k)%volume(i))
        end associate
      end do
    end do
    call list_points(owner, part, volume, position, low, whole)
    do k = 1, 2
      whole%lower(k) = minval(bodies%lower(k))
      whole%upper(k) = maxval(bodies%upper(k))
    end do
  end subroutine set_up_whole

  !> Where bodies overlap, one that goes or comes may leave all points as they are.
  subroutine check_change(input, k, before, now, errors)
    type(input_t),      intent(in)    :: input
    integer,            intent(in)    :: k             !! number of the stage
    integer,            intent(in)    :: before, now   !! points
    type(error_list_t), intent(inout) :: errors

    associate (stage => input%stages(k))
      if ((stage%excavate /= '') .eqv. (stage%fill /= '')) return
      if (now == before) call errors%add('what the stage excavates or fills changes no point', &
        '&stage name = '//stage%name, stage%excavate//stage%fill, &
        'bodies that no other body covers')
    end associate
  end subroutine check_change

  !> A point cannot turn from soil into a boundary, or back.
  subroutine report_change(position, name, errors)
    real(wp),           intent(in)    :: position(2)   !! [m]
    character(*),       intent(in)    :: name
    type(error_list_t), intent(inout) :: errors

    call errors%add('a place belongs to a body in one stage and to the layers of a boundary in '// &
      'another, or to two boundaries', '&stage name = '//name//', place ('// &
      number_text(position(1))//', '//number_text(position(2))//') m', &
      allowed='one of them in all stages')
  end subroutine report_change

  !> The points of the occupied places, row by row.
  pure subroutine list_points(owner, part, volume, position, low, whole)
    integer,      intent(in)    :: low(2)
    integer,      intent(in)    :: owner(low(1):, low(2):)        !! -1: none
    integer,      intent(in)    :: part(low(1):, low(2):)         !! of the first stage with it
    real(wp),     intent(in)    :: volume(low(1):, low(2):)       !! [m^2]
    real(wp),     intent(in)    :: position(:, low(1):, low(2):)  !! [m]
    type(body_t), intent(inout) :: whole
    integer :: x, y

    whole%n = count(owner >= 0)
    allocate (whole%position(whole%n, 2), whole%volume(whole%n), whole%boundary(whole%n), &
      whole%part(whole%n), whole%place(whole%n, 2))
    whole%n = 0
    do y = low(2), ubound(owner, 2)
      do x = low(1), ubound(owner, 1)
        if (owner(x, y) < 0) cycle
        whole%n = whole%n + 1
        whole%position(whole%n, :) = position(:, x, y)
        whole%volume(whole%n) = volume(x, y)
        whole%boundary(whole%n) = owner(x, y)
        whole%part(whole%n) = part(x, y)
        whole%place(whole%n, :) = [x, y]
      end do
    end do
  end subroutine list_points

end module pd_setup_stages
