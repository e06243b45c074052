!> From checked input to the materials of the points: laws, strain measures, strength, control.
!>
!> A new law or strain measure is a module of its own and a line in `new_law` or `new_measure`.
module pd_setup_materials
  use pd_bearing, only: new_bearing
  use pd_elastic, only: new_elastic
  use pd_errors, only: error_list_t
  use pd_families, only: horizon_t
  use pd_green_lagrange, only: green_lagrange_t
  use pd_input_shapes, only: is_bearing
  use pd_input_types, only: boundary_input_t, input_t, material_input_t, &
    stabilisation_input_t
  use pd_j2, only: new_j2
  use pd_kinds, only: is_set, wp
  use pd_law, only: law_t
  use pd_logarithmic, only: logarithmic_t
  use pd_materials, only: divide_into_runs, leave_out_gaps, material_t
  use pd_measure, only: measure_t
  use pd_model, only: model_t, top_of
  use pd_operators, only: control_stiffness
  use pd_pages, only: clear_rows
  use pd_random_field, only: lognormal, new_random_field, standard_normal
  use pd_relaxing, only: new_relaxing, relaxing_t, whole_family, whole_family_t
  use pd_setup_gradients, only: set_up_stiffness, yield_stress_at
  use pd_small_strain, only: small_strain_t
  use pd_stages, only: first_stage, stage_t
  implicit none
  private

  public :: set_up_points, set_up_materials, set_up_relaxing_control

contains

  !> What does not change at the points.
  subroutine set_up_points(model)
    type(model_t), intent(inout) :: model
    integer, allocatable :: beside(:), boundary(:), rows(:)
    integer :: i

    associate (points => model%points, body => model%body, storage => model%operators%storage)
      call storage%new_field(body%positions(storage%points), points%position)
      if (model%whole%n > 0) points%position = model%shown%spread(model%whole%position)
      call storage%new_field(body%volumes(storage%points), points%volume)
      allocate (points%in_body(storage%rows), points%place(storage%rows))
      allocate (points%free(storage%rows, 2))
      call clear_rows(points%in_body, storage%kept)
      call clear_rows(points%place, storage%kept)
      call clear_rows(points%free, storage%kept)
      rows = storage%rows_of(storage%points)
      boundary = body%boundaries(storage%points)
      do i = 1, size(rows)
        if (boundary(i) == 0) points%in_body(rows(i)) = 1.0_wp
        points%free(rows(i), :) = 1.0_wp
      end do
      beside = body%points_beside()
      do i = 1, size(beside)   ! supports look at theirs, on every rank
        associate (row => storage%row(beside(i)))
          points%position(row, :) = body%position_of(beside(i))
          points%volume(row) = body%volume_of(beside(i))
        end associate
      end do
      call body%add_up(points%all_volume, points%largest_volume)
    end associate
  end subroutine set_up_points

  !> Materials, initial strength, zero-energy control.
  subroutine set_up_materials(input, stage, model)
    type(input_t), intent(in)    :: input
    type(stage_t), intent(in)    :: stage
    type(model_t), intent(inout) :: model
    type(stage_t) :: first
    integer,  allocatable :: law_of(:), material_of(:)
    real(wp), allocatable :: strength(:)
    integer :: k

    allocate (model%materials%list(size(input%materials)))
    do k = 1, size(input%materials)
      associate (given => input%materials(k), material => model%materials%list(k))
        material%name = given%name
        material%density = given%density
        material%youngs_modulus = given%youngs_modulus
        allocate (material%measure, source=new_measure(given%strain_measure))
        allocate (material%law, source=new_law(given))
      end associate
    end do
    associate (ends => model%operators%storage%points)
      material_of = stage%material_of(model%body%parts(ends))
      law_of = material_of
      call set_up_bearings(input, law_of, model)
      call divide_into_runs(model%blocks, model%operators%storage%spread(law_of), model%materials)
      call leave_out_gaps(model%operators%stretches, model%materials)
      call note_used(model)
      call set_up_stiffness(input, material_of, model)
      allocate (strength(size(material_of)))
      call set_up_strength(input, material_of, model%body%positions(ends), top_of(model), strength)
      call model%operators%storage%new_field(strength, model%strength)
    end associate
    if (model%whole%n > 0) then
      allocate (model%shown_strength(model%whole%n))
      first = first_stage(input)
      call set_up_strength(input, first%material_of(model%whole%part), model%whole%position, &
        top_of(model), model%shown_strength)
    end if
    if (input%stabilisation%method == 'silling') &
      call set_up_control(input%stabilisation%factor, law_of, model)
  end subroutine set_up_materials

  !> Which materials the body has, on any rank.
  subroutine note_used(model)
    type(model_t), intent(inout) :: model
    integer :: found(size(model%materials%list)), k

    found = [(merge(1, 0, model%materials%is_used(k)), k=1, size(found))]
    call model%blocks%ranks%largest_numbers(found)
    model%materials%used = found > 0
  end subroutine note_used

  !> The layers of smooth boundaries that hold a part of a side, or an edge, become bearings: one
  !> for each material that they would continue, behind those of the input.
  subroutine set_up_bearings(input, law_of, model)
    type(input_t), intent(in)    :: input
    integer,       intent(inout) :: law_of(:)      !! index of the material of every point
    type(model_t), intent(inout) :: model
    type(material_t), allocatable :: list(:)
    logical :: here(size(law_of))
    integer :: j, k, n

    do k = 1, size(input%boundaries)
      if (.not. is_bearing(input%boundaries(k))) cycle
      do j = 1, size(input%materials)
        here = model%body%boundary == k .and. law_of == j
        if (.not. any(here)) cycle
        n = size(model%materials%list)
        allocate (list(n + 1))
        list(:n) = model%materials%list
        list(n + 1) = list(j)
        list(n + 1)%youngs_modulus = 0.0_wp   ! no control: what does not flow would never let it go
        deallocate (list(n + 1)%law)
        allocate (list(n + 1)%law, source=new_bearing(list(j)%law))
        call move_alloc(list, model%materials%list)
        where (here) law_of = n + 1
      end do
    end do
  end subroutine set_up_bearings

  !> The law of a material.
  function new_law(given) result(law)
    type(material_input_t), intent(in) :: given
    class(law_t), allocatable :: law

    if (given%model == 'elastic') then
      allocate (law, source=new_elastic(given%youngs_modulus, given%poissons_ratio))
    else if (given%model == 'j2') then
      allocate (law, source=new_j2(given%youngs_modulus, given%poissons_ratio, &
        given%kinematic_modulus, given%isotropic_modulus, max(0.0_wp, given%residual_strength)))
    end if
  end function new_law

  !> The strain measure of a material.
  function new_measure(name) result(measure)
    character(*), intent(in) :: name
    class(measure_t), allocatable :: measure

    if (name == 'green_lagrange') then
      allocate (green_lagrange_t :: measure)
    else if (name == 'logarithmic') then
      allocate (logarithmic_t :: measure)
    else if (name == 'small') then
      allocate (small_strain_t :: measure)
    end if
  end function new_measure

  !> Control of zero-energy modes after Silling, with the stiffness of each point's material.
  subroutine set_up_control(factor, material_of, model)
    real(wp),      intent(in)    :: factor           !! g
    integer,       intent(in)    :: material_of(:)   !! of the points that give rows values
    type(model_t), intent(inout) :: model
    real(wp), allocatable :: c(:)
    real(wp) :: youngs_modulus
    integer  :: i, row

    associate (storage => model%operators%storage)
      allocate (c(size(material_of)), source=0.0_wp)
      do i = 1, size(c)
        row = storage%row(storage%points(1) + i - 1)
        if (row < storage%kept(1)) cycle
        youngs_modulus = model%materials%list(material_of(i))%youngs_modulus
        if (allocated(model%materials%stiffness)) &
          youngs_modulus = youngs_modulus * model%materials%stiffness(row)
        c(i) = control_stiffness(factor, youngs_modulus, model%delta, &
          model%operators%weight_sum(row))
      end do
      call model%operators%set_control(storage%spread(c))
    end associate
  end subroutine set_up_control

  !> The control that relaxes where the points flow, with the stiffness of each point's material.
  !> On a lattice the whole family is that of its inner points, on a point cloud a full disc.
  !>
  !> Errors: all bonds of the family are equally long: nothing is left beside an affine field.
  subroutine set_up_relaxing_control(given, horizon, model, errors)
    type(stabilisation_input_t), intent(in) :: given
    type(horizon_t),    intent(in)    :: horizon
    type(model_t),      intent(inout) :: model
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: fine = 64.0_wp   !! points per horizon that make a disc
    type(whole_family_t)  :: family
    type(relaxing_t), allocatable :: relaxing
    real(wp), allocatable :: youngs_modulus(:)
    logical :: turns
    integer :: k

    turns = .false.   ! with small strain a rotation is strain, and moments are those of the start
    do k = 1, size(model%materials%list)
      turns = turns .or. .not. same_type_as(model%materials%list(k)%measure, small_strain_t())
    end do
    family = whole_family(horizon, merge(model%spacing, model%delta / fine, &
      model%body%on_lattice()))
    if (family%weight <= 0.0_wp) then
      call errors%add('the relaxing control needs bonds of different lengths', &
        where='&stabilisation, key method', found='one length in every family', &
        allowed='a horizon of at least 1.5 spacings, or method = ''none'' or ''silling''')
      return
    end if
    allocate (youngs_modulus(model%operators%n))
    call clear_rows(youngs_modulus, model%operators%storage%kept)
    do k = 1, size(model%materials%runs)
      associate (run => model%materials%runs(k))
        youngs_modulus(run%lo:run%hi) = model%materials%list(run%material)%youngs_modulus
      end associate
    end do
    if (allocated(model%materials%stiffness)) &
      youngs_modulus = youngs_modulus * model%materials%stiffness
    call new_relaxing(family, model%points%volume, youngs_modulus, model%operators%storage%kept, &
      model%delta, [given%relaxing_stiffness, given%relaxing_strain], turns, relaxing)
    call model%operators%set_relaxing(relaxing, model%points%position)
  end subroutine set_up_relaxing_control

  !> sigma_y0 of every point: that of its material or a random field about it, reduced in the weak
  !> patch.
  subroutine set_up_strength(input, material_of, position, top, strength)
    type(input_t), intent(in)  :: input
    integer,       intent(in)  :: material_of(:)             !! of every point
    real(wp),      intent(in),  contiguous :: position(:, :)    !! X (n,2) [m]
    real(wp),      intent(in)  :: top                        !! of the body [m]
    real(wp),      intent(out), contiguous :: strength(:)       !! (n) [Pa]
    real(wp) :: mean
    integer  :: i

    associate (field => input%random_field, flaw => input%imperfection)
      strength = 0.0_wp
      if (is_set(field%coefficient_of_variation)) call standard_normal( &
        new_random_field(field%correlation_length, field%seed), position, strength)
      do i = 1, size(strength)
        mean = yield_stress_at(input%materials(material_of(i)), position(i, 2), top)
        if (is_set(field%coefficient_of_variation)) then
          strength(i) = lognormal(mean, field%coefficient_of_variation, strength(i))
        else
          strength(i) = mean
        end if
        if (flaw%amplitude <= 0.0_wp) cycle
        if (norm2(position(i, :) - [flaw%x, flaw%y]) <= flaw%radius * (1.0_wp + 1.0e-6_wp)) &
          strength(i) = (1.0_wp - flaw%amplitude) * strength(i)
      end do
    end associate
  end subroutine set_up_strength

end module pd_setup_materials
