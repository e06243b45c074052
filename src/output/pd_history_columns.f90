!> The columns of the history, in their order: what each is, in words and in numbers.
!>
!> This is the only list of them. Observation, the CSV file, the result file and the tests of the
!> documents loop over it; one more column is a procedure and a call here.
!> Source: doc/theory.md, section 10.
module pd_history_columns
  use pd_ground_columns, only: add_ground_columns
  use pd_kinds, only: block_dot, block_sum, n_block, wp
  use pd_model, only: model_t
  use pd_observe, only: block_view_t, column_t, largest, mean, noise, row_view_t, smallest, &
    surplus, total
  use pd_unbalanced, only: over
  implicit none
  private

  public :: history_columns

contains

  !> The columns of a run. Averages and extrema are over the body without fictitious points,
  !> energies over all points.
  subroutine history_columns(model, columns)
    type(model_t),               intent(in)  :: model
    type(column_t), allocatable, intent(out) :: columns(:)
    character(*), parameter :: in_body = ' of the body without fictitious points'
    integer :: k

    allocate (columns(0))
    call add(columns, column_t('step', '1', 'number of the step', whole_number=.true., &
      value=step))
    call add(columns, column_t('time', 's', 'sum of the time steps', value=time))
    if (model%platens%axis > 0) call add(columns, column_t('strain', '1', &
      'nominal strain between the platens, compression positive', value=strain))
    do k = 1, size(model%supports%items)
      call add_force(columns, model%supports%items(k)%support%name, k)
    end do
    call add(columns, column_t('mean_stress_xx', 'Pa', 'mean first Piola-Kirchhoff stress P_xx'// &
      in_body, joined=mean, part=stress_xx))
    call add(columns, column_t('mean_stress_yy', 'Pa', 'mean first Piola-Kirchhoff stress P_yy'// &
      in_body, joined=mean, part=stress_yy))
    call add(columns, column_t('mean_strain_yy', '1', 'mean strain E_yy'//in_body, joined=mean, &
      part=strain_yy))
    call add(columns, column_t('max_plastic_strain', '1', 'largest equivalent plastic strain'// &
      in_body, joined=largest, part=plastic_strain))
    call add(columns, column_t('kinetic_energy', 'J/m', 'kinetic energy of all points', &
      joined=total, part=kinetic_energy))
    call add(columns, column_t('strain_energy', 'J/m', 'stored elastic energy of all points', &
      joined=total, part=strain_energy))
    call add(columns, column_t('plastic_dissipation', 'J/m', 'plastic work so far', &
      value=plastic_dissipation))
    call add(columns, column_t('damping_dissipation', 'J/m', 'work of the damping forces '// &
      'against the frame of the damping so far', value=damping_dissipation))
    call add(columns, column_t('stabilisation_energy', 'J/m', 'energy of the zero-energy '// &
      'control, with what it has dissipated; 0 without', value=stabilisation_energy))
    call add(columns, column_t('external_work', 'J/m', 'work of prescribed motion, of loads, '// &
      'and of the moving frame of the damping so far', value=external_work))
    call add(columns, column_t('energy_error', '1', 'what the balance lacks, over the external '// &
      'work or the initial kinetic energy', value=energy_error))
    call add(columns, column_t('plastic_heat', 'J/m', 'heat of the plastic flow so far; what '// &
      'is left of plastic_dissipation is energy of the back stress', joined=total, &
      part=plastic_heat))
    call add(columns, column_t('min_det_f', '1', 'smallest det F, volume over that of the '// &
      'undeformed body,'//in_body, joined=smallest, part=det_f))
    call add(columns, column_t('unbalanced_force', '1', 'sum of the net forces on what is free '// &
      'to move, over reactions and loads', value=unbalanced_force))
    call add(columns, column_t('damping_share', '1', 'sum of the forces of the damping, over '// &
      'reactions and loads', value=damping_share))
    call add(columns, column_t('time_step', 's', 'time step of the step that ends here', &
      value=time_step))
    call add_ground_columns(model, columns)
  end subroutine history_columns

  subroutine add(columns, column)
    type(column_t), allocatable, intent(inout) :: columns(:)
    type(column_t),              intent(in)    :: column

    columns = [columns, column]
  end subroutine add

  !> Both components of the force of boundary k.
  subroutine add_force(columns, name, k)
    type(column_t), allocatable, intent(inout) :: columns(:)
    character(*),                intent(in)    :: name
    integer,                     intent(in)    :: k
    character(1), parameter :: axes(2) = ['x', 'y']
    integer :: c

    do c = 1, 2
      call add(columns, column_t(trim(name)//'_force_'//axes(c), 'N/m', axes(c)//'-component '// &
        'of the force that the boundary '//trim(name)//' applies to the body', value=force, &
        boundary=k, component=c))
    end do
  end subroutine add_force

  ! ---- from the blocks ----------------------------------------------------------------------

  pure real(wp) function stress_xx(block) result(part)
    type(block_view_t), intent(in) :: block

    part = block_dot(block%weight, block%p(:, 1))
  end function stress_xx

  pure real(wp) function stress_yy(block) result(part)
    type(block_view_t), intent(in) :: block

    part = block_dot(block%weight, block%p(:, 4))
  end function stress_yy

  pure real(wp) function strain_yy(block) result(part)
    type(block_view_t), intent(in) :: block

    part = block_dot(block%weight, block%strain(:, 2))
  end function strain_yy

  pure real(wp) function plastic_strain(block) result(part)
    type(block_view_t), intent(in) :: block
    real(wp) :: alpha(n_block)

    call block%model%materials%plastic_strain_block(block%number, block%state%law_points_t, alpha)
    part = largest_with_weight(block%hi - block%lo + 1, block%weight, alpha)
  end function plastic_strain

  !> Largest of the first n values that have a weight, or 0; without a branch.
  pure real(wp) function largest_with_weight(n, weight, values) result(found)
    integer,  intent(in) :: n
    real(wp), intent(in) :: weight(n_block), values(n_block)
    integer :: b

    found = 0.0_wp
    !$omp simd simdlen(8) reduction(max:found)
    do b = 1, n
      found = max(found, merge(values(b), 0.0_wp, weight(b) > 0.0_wp))
    end do
  end function largest_with_weight

  !> Smallest det F of the points with a weight, or huge; without a branch.
  pure real(wp) function det_f(block) result(found)
    type(block_view_t), intent(in) :: block

    found = smallest_det_f(block%lo, block%hi, block%weight, block%state%displacement_gradient)
  end function det_f

  pure real(wp) function smallest_det_f(lo, hi, weight, h) result(found)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in) :: weight(n_block)
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4)
    integer :: i

    found = huge(1.0_wp)
    !$omp simd simdlen(8) reduction(min:found)
    do i = lo, hi
      found = min(found, merge((1.0_wp + h(i, 1)) * (1.0_wp + h(i, 4)) - h(i, 2) * h(i, 3), &
        huge(1.0_wp), weight(i - lo + 1) > 0.0_wp))
    end do
  end function smallest_det_f

  pure real(wp) function kinetic_energy(block) result(part)
    type(block_view_t), intent(in) :: block
    real(wp) :: terms(n_block), density(n_block)

    part = 0.0_wp
    if (block%model%at_equilibrium) return   ! velocity is that of a time without meaning
    if (block%hi - block%lo + 1 < n_block) terms = 0.0_wp
    density = 0.0_wp
    call block%model%materials%density_block(block%number, density)
    call square(block%lo, block%hi, block%model%points%volume, block%state%velocity, terms)
    part = 0.5_wp * block_dot(density, terms)
  end function kinetic_energy

  !> V |v|^2 of rows lo to hi.
  pure subroutine square(lo, hi, volume, v, terms)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: volume(:), v(:, :)
    real(wp), intent(inout) :: terms(n_block)
    integer :: i, b

    !$omp simd simdlen(8) private(b)
    do i = lo, hi
      b = i - lo + 1
      terms(b) = volume(i) * (v(i, 1)**2 + v(i, 2)**2)
    end do
  end subroutine square

  pure real(wp) function strain_energy(block) result(part)
    type(block_view_t), intent(in) :: block
    real(wp) :: terms(n_block)

    if (block%hi - block%lo + 1 < n_block) terms = 0.0_wp
    call block%model%materials%energy_block(block%number, block%state%law_points_t, terms)
    call weigh(block%lo, block%hi, block%model%points%volume, terms)
    part = block_sum(terms)
  end function strain_energy

  pure real(wp) function plastic_heat(block) result(part)
    type(block_view_t), intent(in) :: block
    real(wp) :: terms(n_block)

    if (block%hi - block%lo + 1 < n_block) terms = 0.0_wp
    call block%model%materials%heat_block(block%number, block%state%law_points_t, terms)
    call weigh(block%lo, block%hi, block%model%points%volume, terms)
    part = block_sum(terms)
  end function plastic_heat

  !> V times the terms of rows lo to hi.
  pure subroutine weigh(lo, hi, volume, terms)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: volume(:)
    real(wp), intent(inout) :: terms(n_block)
    integer :: i

    !$omp simd simdlen(8)
    do i = lo, hi
      terms(i - lo + 1) = volume(i) * terms(i - lo + 1)
    end do
  end subroutine weigh

  ! ---- from elsewhere -----------------------------------------------------------------------

  pure real(wp) function step(row) result(value)
    type(row_view_t), intent(in) :: row

    value = real(row%moment%step, wp)
  end function step

  pure real(wp) function time(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%time
  end function time

  pure real(wp) function time_step(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%time_step
  end function time_step

  pure real(wp) function strain(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%strain
  end function strain

  pure real(wp) function force(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%model%supports%items(row%boundary)%support%force(row%component)
  end function force

  real(wp) function plastic_dissipation(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%ledger%plastic_dissipation(row%model%blocks)
  end function plastic_dissipation

  real(wp) function damping_dissipation(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%ledger%damping_dissipation(row%model%blocks)
  end function damping_dissipation

  real(wp) function stabilisation_energy(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%control_energy + row%moment%ledger%control_dissipation(row%model%blocks)
  end function stabilisation_energy

  real(wp) function external_work(row) result(value)
    type(row_view_t), intent(in) :: row

    value = row%moment%ledger%external_work(row%model%blocks)
  end function external_work

  pure real(wp) function unbalanced_force(row) result(value)
    type(row_view_t), intent(in) :: row

    value = over(row%unbalanced%free, row%unbalanced%outside)
  end function unbalanced_force

  pure real(wp) function damping_share(row) result(value)
    type(row_view_t), intent(in) :: row

    value = 0.0_wp   ! nothing is loaded yet
    if (row%unbalanced%outside > 0.0_wp) &
      value = over(row%unbalanced%damping, row%unbalanced%outside)
  end function damping_share

  pure real(wp) function energy_error(row) result(value)
    type(row_view_t), intent(in) :: row

    associate (ledger => row%moment%ledger)
      value = surplus(row%seen, ledger)
      if (abs(value) > 0.0_wp) value = value &
        / max(abs(row%seen%value('external_work')), ledger%initial_kinetic_energy, &
        noise * ledger%initial_strain_energy, abs(value))
    end associate
  end function energy_error

end module pd_history_columns
