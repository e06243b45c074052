!> Columns of the history that depend on what the input asks for: motion of boundaries, gravity,
!> probes. `pd_history_columns` puts them at the end.
!> Source: doc/theory.md, section 10.
module pd_ground_columns
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_observe, only: column_t, row_view_t
  implicit none
  private

  public :: add_ground_columns

  character(1), parameter :: axes(2) = ['x', 'y']
  character(2), parameter :: tensor(4) = ['xx', 'yy', 'zz', 'xy']

contains

  !> Add the columns of boundaries, gravity and probes.
  subroutine add_ground_columns(model, columns)
    type(model_t),               intent(in)    :: model
    type(column_t), allocatable, intent(inout) :: columns(:)
    integer :: c, k

    do k = 1, size(model%supports%items)
      associate (support => model%supports%items(k)%support)
        do c = 1, 2
          columns = [columns, column_t(trim(support%name)//'_displacement_'//axes(c), 'm', &
            axes(c)//'-component of the mean displacement of the points of the boundary '// &
            trim(support%name), value=boundary_displacement, boundary=k, component=c)]
        end do
        if (support%turns()) columns = [columns, column_t(trim(support%name)//'_rotation', &
          'rad', 'rotation of the boundary '//trim(support%name)//', positive from x to y', &
          value=boundary_rotation, boundary=k)]
      end associate
    end do
    do k = 1, model%loads%count()
      if (model%loads%items(k)%load%kind == 'gravity') columns = [columns, column_t('gravity', &
        'm/s^2', 'magnitude of the acceleration of gravity', value=gravity)]
    end do
    if (.not. allocated(model%probes)) return
    do k = 1, size(model%probes)
      call add_probe(model%probes(k)%name, k, columns)
    end do
  end subroutine add_ground_columns

  !> Displacement, stress and plastic strain of a probe.
  subroutine add_probe(name, k, columns)
    character(*), intent(in) :: name
    integer,      intent(in) :: k
    type(column_t), allocatable, intent(inout) :: columns(:)
    integer :: c

    do c = 1, 2
      columns = [columns, column_t(name//'_displacement_'//axes(c), 'm', axes(c)// &
        '-component of the displacement at the probe '//name, value=probe_displacement, &
        probe=k, component=c)]
    end do
    do c = 1, 4
      columns = [columns, column_t(name//'_stress_'//tensor(c), 'Pa', 'Cauchy stress '// &
        tensor(c)//' at the probe '//name, value=probe_stress, probe=k, component=c)]
    end do
    columns = [columns, column_t(name//'_plastic_strain', '1', &
      'equivalent plastic strain at the probe '//name, value=probe_plastic_strain, probe=k)]
  end subroutine add_probe

  !> Mean over the points, weighted with their volumes; 0 for a boundary without points. Where they
  !> are images of the body, that of the plane between.
  pure real(wp) function boundary_displacement(row) result(value)
    type(row_view_t), intent(in) :: row
    integer :: plane

    value = 0.0_wp
    associate (points => row%model%supports%items(row%boundary)%support%points, &
      volume => row%model%points%volume)
      if (size(points) > 0) value = sum(volume(points) &
        * row%state%displacement(points, row%component)) / sum(volume(points))
    end associate
    associate (mirror => row%model%operators%mirror)
      plane = mirror%moves_with(row%boundary)
      if (plane == 0) return
      if (mirror%normal(plane) == row%component) value = mirror%place(plane)
    end associate
  end function boundary_displacement

  pure real(wp) function boundary_rotation(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%model%supports%items(row%boundary)%support%rotation(row%moment%time)
  end function boundary_rotation

  pure real(wp) function gravity(row) result(value)
    type(row_view_t), intent(in) :: row

    value = norm2(row%model%loads%acceleration(row%moment%time))
  end function gravity

  pure real(wp) function probe_displacement(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%state%displacement(row%model%probes(row%probe)%row, row%component)
  end function probe_displacement

  pure real(wp) function probe_stress(row) result(value)
    type(row_view_t), intent(in) :: row
    real(wp) :: stress(4)
    integer  :: i, k

    i = row%model%probes(row%probe)%row
    k = row%model%probes(row%probe)%material
    stress = row%model%materials%list(k)%measure%cauchy(row%state%displacement_gradient(i, :), &
      row%state%stress(i, :))
    value = stress(row%component)
  end function probe_stress

  pure real(wp) function probe_plastic_strain(row) result(value)
    type(row_view_t), intent(in) :: row
    integer :: column, i, k

    value = 0.0_wp
    i = row%model%probes(row%probe)%row
    k = row%model%probes(row%probe)%material
    column = row%model%materials%list(k)%law%plastic_strain
    if (column > 0) value = row%state%history(i, column)
  end function probe_plastic_strain

end module pd_ground_columns
