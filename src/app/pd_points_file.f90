!> The points of a model as text: for whoever wants to see a body before it is run.
!>
!> Lines of words separated by blanks; the first word says of what the line is:
!>
!>   point X Y VOLUME MATERIAL BOUNDARY      a dash where it belongs to the body
!>   load NAME X Y FORCE_X FORCE_Y           force at full load [N/m]
!>   patch NAME X Y RADIUS
!>   probe NAME X Y                          where it is asked for
!>   cut NUMBER X1 Y1 X2 Y2
!>
!> perigeo-post geometry reads it. A new kind of thing that a model holds is one more kind of line.
module pd_points_file
  use pd_errors, only: error_list_t
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_own_files, only: keep_inputs_from
  use pd_pressure, only: pressure_t
  use pd_text, only: integer_text, number_text
  implicit none
  private

  public :: write_points

  character(*), parameter :: head = '# perigeo points 1: lengths in m, forces in N/m'

contains

  !> Write the points, loads, patches, probes and cuts of a model that is set up.
  !>
  !> Errors: the file cannot be written.
  subroutine write_points(path, input, model, errors)
    character(*),       intent(in)    :: path
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(in)    :: model
    type(error_list_t), intent(inout) :: errors
    integer :: status, unit, before
    logical :: good

    before = errors%count()
    call keep_inputs_from(path, input, errors)
    if (.not. may_be_replaced(path)) call errors%add('is not overwritten: it holds something '// &
      'else than points that --points has written', path)
    if (errors%count() > before) return
    open (newunit=unit, file=path, status='replace', action='write', iostat=status)
    good = status == 0
    if (good) then
      call put(unit, head, good)
      call put_points(unit, input, model, good)
      call put_loads(unit, model, good)
      call put_marks(unit, input, good)
      close (unit, iostat=status)
      good = good .and. status == 0
    end if
    if (.not. good) call errors%add('the file cannot be written', path)
  end subroutine write_points

  !> Whether a file is not there, is empty, or holds points of an earlier call.
  logical function may_be_replaced(path) result(may)
    character(*), intent(in) :: path
    character(len(head)) :: line
    integer :: status, unit, bytes

    inquire (file=path, exist=may, size=bytes)
    may = .not. may .or. bytes <= 0
    if (may) return
    open (newunit=unit, file=path, status='old', action='read', iostat=status)
    if (status /= 0) return
    read (unit, '(a)', iostat=status) line
    close (unit)
    may = status == 0 .and. line == head
  end function may_be_replaced

  !> Write one line, unless one before it could not be written.
  subroutine put(unit, line, good)
    integer,      intent(in)    :: unit
    character(*), intent(in)    :: line
    logical,      intent(inout) :: good
    integer :: status

    if (.not. good) return
    write (unit, '(a)', iostat=status) line
    good = status == 0
  end subroutine put

  subroutine put_points(unit, input, model, good)
    integer,       intent(in)    :: unit
    type(input_t), intent(in)    :: input
    type(model_t), intent(in)    :: model
    logical,       intent(inout) :: good
    character(:), allocatable :: boundary
    integer :: i

    associate (body => model%body)
      do i = 1, body%n
        boundary = '-'
        if (body%boundary_of(i) > 0) boundary = input%boundaries(body%boundary_of(i))%name
        call put(unit, 'point '//numbers([body%position_of(i), body%volume_of(i)])//' '// &
          input%bodies(body%part_of(i))%material//' '//boundary, good)
      end do
    end associate
  end subroutine put_points

  !> The forces of the pressures on their points.
  subroutine put_loads(unit, model, good)
    integer,       intent(in)    :: unit
    type(model_t), intent(in)    :: model
    logical,       intent(inout) :: good
    integer :: i, k

    do k = 1, size(model%loads%items)
      select type (load => model%loads%items(k)%load)
      class is (pressure_t)
        do i = 1, size(load%points)
          call put(unit, 'load '//load%name//' '// &
            numbers([model%points%position(load%points(i), 1), &
                     model%points%position(load%points(i), 2), load%force(i, :)]), good)
        end do
      end select
    end do
  end subroutine put_loads

  !> What an input marks in its body.
  subroutine put_marks(unit, input, good)
    integer,       intent(in)    :: unit
    type(input_t), intent(in)    :: input
    logical,       intent(inout) :: good
    integer :: k

    associate (flaw => input%imperfection)
      if (flaw%amplitude > 0.0_wp) call put(unit, 'patch imperfection '// &
        numbers([flaw%x, flaw%y, flaw%radius]), good)
    end associate
    do k = 1, size(input%probes)
      associate (probe => input%probes(k))
        call put(unit, 'probe '//probe%name//' '//numbers([probe%x, probe%y]), good)
      end associate
    end do
    do k = 1, size(input%cuts)
      associate (x => input%cuts(k)%x, y => input%cuts(k)%y)
        call put(unit, 'cut '//integer_text(k)//' '//numbers([x(1), y(1), x(2), y(2)]), good)
      end associate
    end do
  end subroutine put_marks

  !> Numbers with blanks between them.
  pure function numbers(x) result(text)
    real(wp), intent(in) :: x(:)
    character(:), allocatable :: text
    integer :: k

    text = number_text(x(1))
    do k = 2, size(x)
      text = text//' '//number_text(x(k))
    end do
  end function numbers

end module pd_points_file
