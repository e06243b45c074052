!> The values of an input file, as checked: what `pd_input` fills and set-up translates.
!>
!> A key is a component of its group's type, and a line in the `visit` of that group that says its
!> name, unit, default, range and meaning: nothing else knows the list of keys. Numbers without a
!> default hold `unset` until the file gives them.
module pd_input_types
  use pd_keys, only: any_count, group_key_t, key_t, key_visitor_t, not_negative, positive, range_t
  use pd_kinds, only: unset, wp
  use pd_namelist, only: namelist_group_t
  implicit none
  private

  public :: input_t, run_input_t, discretisation_input_t, body_input_t, material_input_t
  public :: boundary_input_t, stabilisation_input_t, integration_input_t, imperfection_input_t
  public :: random_field_input_t, output_input_t, pressure_input_t

  character(*), parameter :: ramp = 'time in which it rises linearly from 0; 0: whole at once'

  type :: run_input_t
    character(:), allocatable :: title, name, output_dir
    character(:), allocatable :: operators              !! auto, lattice or list
  contains
    procedure :: visit => visit_run
  end type run_input_t

  type :: discretisation_input_t
    real(wp) :: spacing = unset                        !! [m]
    real(wp) :: horizon = unset                        !! [m]
    character(:), allocatable :: layout, volumes, influence, fit
  contains
    procedure :: visit => visit_discretisation
  end type discretisation_input_t

  type :: body_input_t
    character(:), allocatable :: shape, file           !! file: as in the input, relative to it
    character(:), allocatable :: material              !! name of one
    real(wp) :: x_min = unset, x_max = unset, y_min = unset, y_max = unset   !! [m]
  contains
    procedure :: visit => visit_body
  end type body_input_t

  type :: material_input_t
    character(:), allocatable :: name, model, strain_measure
    real(wp) :: density = unset                        !! [kg/m^3]
    real(wp) :: youngs_modulus = unset                 !! [Pa]
    real(wp) :: poissons_ratio = unset
    real(wp) :: yield_stress = unset                   !! [Pa]
    real(wp) :: kinematic_modulus = 0.0_wp             !! H_k [Pa]
    real(wp) :: isotropic_modulus = 0.0_wp             !! H_i [Pa]
    real(wp) :: residual_strength = unset              !! sigma_r [Pa]
  contains
    procedure :: visit => visit_material
  end type material_input_t

  type :: boundary_input_t
    character(:), allocatable :: name, side, contact   !! side: '' where a point cloud names it
    real(wp) :: velocity(2) = 0.0_wp                   !! [m/s]
    real(wp), allocatable :: times(:)                  !! [s]; size 0: no table
    real(wp), allocatable :: velocities_x(:), velocities_y(:)   !! [m/s]; size 0: zero
    real(wp) :: velocity_gradient(4) = 0.0_wp          !! xx, xy, yx, yy [1/s]
    real(wp), allocatable :: factors(:)                !! size 0: 1 at all times
    real(wp), allocatable :: traction(:)               !! x, y [Pa]; size 0: motion prescribed
    real(wp) :: ramp_time = 0.0_wp                     !! of the traction [s]
  contains
    procedure :: visit => visit_boundary
  end type boundary_input_t

  type :: pressure_input_t
    character(:), allocatable :: name, side
    real(wp), allocatable :: span(:)                   !! from, to [m]; size 0: the whole side
    real(wp) :: value = unset                          !! [Pa]
    real(wp) :: ramp_time = 0.0_wp                     !! [s]
  contains
    procedure :: visit => visit_pressure
  end type pressure_input_t

  type :: stabilisation_input_t
    character(:), allocatable :: method
    real(wp) :: factor = 0.0_wp
  contains
    procedure :: visit => visit_stabilisation
  end type stabilisation_input_t

  type :: integration_input_t
    real(wp) :: end_time = unset                       !! [s]
    real(wp) :: final_strain = unset
    character(:), allocatable :: time_step_rule
    real(wp) :: time_step = unset                      !! [s]
    real(wp) :: safety = 0.9_wp
    real(wp) :: damping = 0.0_wp                       !! C [kg/(m^3 s)]
    character(:), allocatable :: damping_frame
  contains
    procedure :: visit => visit_integration
  end type integration_input_t

  type :: imperfection_input_t
    real(wp) :: amplitude = 0.0_wp
    real(wp) :: x = 0.0_wp, y = 0.0_wp, radius = 0.0_wp   !! [m]
  contains
    procedure :: visit => visit_imperfection
  end type imperfection_input_t

  type :: random_field_input_t
    real(wp) :: coefficient_of_variation = unset       !! unset: no field
    real(wp) :: correlation_length = unset             !! [m]
    integer  :: seed = 1
  contains
    procedure :: visit => visit_random_field
  end type random_field_input_t

  type :: output_input_t
    real(wp), allocatable :: frame_strains(:)          !! size 0: not given
    real(wp), allocatable :: frame_times(:)            !! [s]; size 0: not given
    integer  :: frame_count = 0                        !! 0: not given
    integer  :: history_count = 1000
    real(wp) :: checkpoint_every = 0.0_wp              !! wall seconds
  contains
    procedure :: visit => visit_output
  end type output_input_t

  type :: input_t
    character(:), allocatable    :: path               !! of the input file
    character(:), allocatable    :: text               !! the input file, byte for byte
    type(namelist_group_t), allocatable :: groups(:)   !! as given, in the file and by --set
    type(run_input_t)            :: run
    type(discretisation_input_t) :: discretisation
    type(body_input_t),     allocatable :: bodies(:)
    type(material_input_t), allocatable :: materials(:)   !! the first one is the default
    type(boundary_input_t), allocatable :: boundaries(:)
    type(pressure_input_t), allocatable :: pressures(:)
    type(stabilisation_input_t)  :: stabilisation
    type(integration_input_t)    :: integration
    type(imperfection_input_t)   :: imperfection
    type(random_field_input_t)   :: random_field
    type(output_input_t)         :: output
    !> Index into `boundaries` of the platens: two boundaries that cover opposite sides whole, with
    !> none on the other two sides; 0, 0 where there are none. The first is 'bottom' or 'left'.
    integer :: platens(2) = 0
  contains
    procedure :: visit => visit_input
  end type input_t

contains

  !> Show every group and key, in the order of the reference.
  subroutine visit_input(self, visitor)
    class(input_t),       intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    integer :: k

    call visitor%group(group_key_t('run', required=.true., &
      meaning='names of the run and of its files'))
    call self%run%visit(visitor)
    call visitor%group(group_key_t('discretisation', required=.true., &
      meaning='points, horizon and weights'))
    call self%discretisation%visit(visitor)
    do k = 1, size(self%bodies)
      call visitor%group(group_key_t('body', required=.true., repeats=.true., number=k, &
        of=size(self%bodies), meaning='where there is material'))
      call self%bodies(k)%visit(visitor)
    end do
    do k = 1, size(self%materials)
      call visitor%group(group_key_t('material', required=.true., repeats=.true., &
        number=k, of=size(self%materials), meaning='the constitutive law'))
      call self%materials(k)%visit(visitor)
    end do
    do k = 1, size(self%boundaries)
      call visitor%group(group_key_t('boundary', repeats=.true., number=k, &
        of=size(self%boundaries), &
        meaning='points of prescribed motion, and platens under a load'))
      call self%boundaries(k)%visit(visitor)
    end do
    do k = 1, size(self%pressures)
      call visitor%group(group_key_t('pressure', repeats=.true., number=k, &
        of=size(self%pressures), meaning='a load on a side without boundary'))
      call self%pressures(k)%visit(visitor)
    end do
    call visitor%group(group_key_t('stabilisation', meaning='control of zero-energy modes'))
    call self%stabilisation%visit(visitor)
    call visitor%group(group_key_t('integration', required=.true., &
      meaning='end of the run, time step and damping'))
    call self%integration%visit(visitor)
    call visitor%group(group_key_t('imperfection', &
      meaning='a weak patch that seeds a shear band'))
    call self%imperfection%visit(visitor)
    call visitor%group(group_key_t('random_field', meaning='a yield stress that varies'))
    call self%random_field%visit(visitor)
    call visitor%group(group_key_t('output', meaning='what is written and when'))
    call self%output%visit(visitor)
  end subroutine visit_input

  subroutine visit_run(self, visitor)
    class(run_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%text(key_t('name', required=.true., is_name=.true., &
      meaning='stem of the name of every output file'), self%name)
    call visitor%text(key_t('title', stands_for='the name', &
      meaning='title that stands in the results and above figures'), self%title)
    call visitor%text(key_t('output_dir', stands_for='`results/<name>`', &
      meaning='folder of the output files, relative to the working directory; created where ' &
      //'it does not exist'), self%output_dir)
    call visitor%text(key_t('operators', default='auto', choices='auto lattice list', &
      also='''lattice'': only for rectangles', &
      meaning='form of the non-local operators: ''lattice'' is several times faster and ' &
      //'needs a body on a lattice, ''list'' takes any points, ''auto'' chooses'), self%operators)
  end subroutine visit_run

  subroutine visit_discretisation(self, visitor)
    class(discretisation_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%number(key_t('spacing', unit='m', required=.true., range=positive, &
      meaning='distance of neighbouring points, dx; for a point cloud a typical distance, ' &
      //'which serves the rule courant and the plots'), self%spacing)
    call visitor%number(key_t('horizon', unit='m', required=.true., range=positive, &
      also='for rectangles from spacing to 100 spacing', &
      meaning='radius of the family of a point, delta'), self%horizon)
    call visitor%text(key_t('layout', default='nodes', choices='nodes cells', &
      also='not with shape = ''file''', &
      meaning='nodes: points stand on the boundary of a rectangle; cells: at the centres of ' &
      //'cells, half a spacing inside'), self%layout)
    call visitor%text(key_t('volumes', default='uniform', choices='uniform tributary', &
      also='not with shape = ''file''', &
      meaning='uniform: every point has the volume spacing^2; tributary: points on the ' &
      //'boundary own the half or quarter cell that lies inside'), self%volumes)
    call visitor%text(key_t('influence', default='gaussian', &
      choices='gaussian constant conical', &
      also='conical needs a horizon of at least 1.5 spacing', &
      meaning='weight of a bond of length r: exp(-r^2/horizon^2), 1, or 1 - r/horizon'), &
      self%influence)
    call visitor%text(key_t('fit', default='exact', choices='exact nearest', &
      also='not with shape = ''file''', &
      meaning='extents that are no multiples of spacing: exact: an error that names the ' &
      //'nearest; nearest: adjusted, with a warning'), self%fit)
  end subroutine visit_discretisation

  subroutine visit_body(self, visitor)
    class(body_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: extents = 'needed for rectangles; for a cloud all four or none'

    call visitor%text(key_t('shape', default='rectangle', choices='rectangle file', &
      also='file: as the only body', &
      meaning='rectangle: a lattice of points; file: a cloud of points from a text file'), &
      self%shape)
    call visitor%number(key_t('x_min', unit='m', also=extents, meaning='left edge'), self%x_min)
    call visitor%number(key_t('x_max', unit='m', also='above x_min; '//extents, &
      meaning='right edge'), self%x_max)
    call visitor%number(key_t('y_min', unit='m', also=extents, meaning='lower edge'), self%y_min)
    call visitor%number(key_t('y_max', unit='m', also='above y_min; '//extents, &
      meaning='upper edge'), self%y_max)
    call visitor%text(key_t('file', also='needed for shape = ''file'', else not allowed', &
      meaning='file of the point cloud, relative to the folder of the input file or, where ' &
      //'it is not found there, to the working directory'), self%file)
    call visitor%text(key_t('material', stands_for='the first &material', is_name=.true., &
      also='name of a &material', &
      meaning='material of the body; where bodies overlap the later one counts'), self%material)
  end subroutine visit_body

  subroutine visit_material(self, visitor)
    class(material_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%text(key_t('name', default='material', is_name=.true., &
      also='each name once; needed where there are several', &
      meaning='name that bodies refer to'), self%name)
    call visitor%text(key_t('model', required=.true., choices='elastic j2', &
      meaning='elastic, or von Mises plasticity with hardening or softening'), self%model)
    call visitor%text(key_t('strain_measure', default='green_lagrange', &
      choices='green_lagrange', meaning='strain in which the law is written'), &
      self%strain_measure)
    call visitor%number(key_t('density', unit='kg/m^3', required=.true., range=positive, &
      meaning='mass per volume'), self%density)
    call visitor%number(key_t('youngs_modulus', unit='Pa', required=.true., range=positive, &
      meaning='Young''s modulus, E'), self%youngs_modulus)
    call visitor%number(key_t('poissons_ratio', unit='1', required=.true., &
      range=range_t(-1.0_wp, 0.5_wp, .true., .true.), meaning='Poisson''s ratio'), &
      self%poissons_ratio)
    call visitor%number(key_t('yield_stress', unit='Pa', range=positive, also='needed for j2', &
      meaning='initial yield stress in a uniaxial test, sigma_y'), self%yield_stress)
    call visitor%number(key_t('kinematic_modulus', unit='Pa', default='0.0', &
      also='3 G + H_k + H_i > 0; where both are negative also 3 G + H_i + min(H_k, H_i) > 0', &
      meaning='slope of stress against plastic strain due to the back stress, H_k; ' &
      //'negative: softening'), self%kinematic_modulus)
    call visitor%number(key_t('isotropic_modulus', unit='Pa', default='0.0', &
      also='as kinematic_modulus', &
      meaning='slope of the yield stress against plastic strain, H_i; negative: softening'), &
      self%isotropic_modulus)
    call visitor%number(key_t('residual_strength', unit='Pa', range=not_negative, &
      also='at most yield_stress; needed for j2 with a negative modulus', &
      meaning='strength at which softening stops, sigma_r; without effect on hardening'), &
      self%residual_strength)
  end subroutine visit_material

  subroutine visit_boundary(self, visitor)
    class(boundary_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%text(key_t('name', required=.true., is_name=.true., also='each name once', &
      meaning='name in the results, and in the file of a point cloud'), self%name)
    call visitor%text(key_t('side', stands_for='none', choices='bottom top left right all', &
      also='needed for rectangles, each side once, all alone; not all for a cloud', &
      meaning='side of the body beyond which the layers of points lie; for a cloud the side ' &
      //'that the boundary stands for'), self%side)
    call visitor%text(key_t('contact', default='rough', choices='rough smooth affine', &
      also='smooth needs one side, not all', &
      meaning='rough: both components of the motion prescribed; smooth: only the one across ' &
      //'the side; affine: the motion of a homogeneous deformation'), self%contact)
    call visitor%numbers(key_t('velocity', count=2, unit='m/s', default='0.0, 0.0', &
      also='smooth: 0 along the side; not with times, traction or affine', &
      meaning='constant velocity, x and y'), self%velocity)
    call visitor%list(key_t('times', count=any_count, unit='s', stands_for='none', &
      range=not_negative, also='increasing', meaning='times of the tables below'), self%times)
    call visitor%list(key_t('velocities_x', count=any_count, unit='m/s', stands_for='zero', &
      also='as many as times; not with affine', meaning='velocity along x at these times'), &
      self%velocities_x)
    call visitor%list(key_t('velocities_y', count=any_count, unit='m/s', stands_for='zero', &
      also='as many as times; not with affine', meaning='velocity along y at these times'), &
      self%velocities_y)
    call visitor%numbers(key_t('velocity_gradient', count=4, unit='1/s', stands_for='none', &
      also='needed for affine, else not allowed', &
      meaning='L of the velocity L x, in the order xx, xy, yx, yy'), self%velocity_gradient)
    call visitor%list(key_t('factors', count=any_count, unit='1', stands_for='1 at all times', &
      also='as many as times; only with affine', &
      meaning='factors on velocity_gradient at these times'), self%factors)
    call visitor%list(key_t('traction', count=2, unit='Pa', stands_for='none', &
      also='in place of a motion; smooth: 0 along the side; rectangles only, not affine, ' &
      //'not all', &
      meaning='force per area that acts on the platen from outside, x and y: the platen ' &
      //'moves under it and stays plane'), self%traction)
    call visitor%number(key_t('ramp_time', unit='s', default='0.0', range=not_negative, &
      also='only with traction', meaning=ramp), self%ramp_time)
  end subroutine visit_boundary

  subroutine visit_pressure(self, visitor)
    class(pressure_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%text(key_t('name', required=.true., is_name=.true., also='each name once', &
      meaning='name in the log and in the values of the results'), self%name)
    call visitor%text(key_t('side', required=.true., choices='bottom top left right', &
      also='a side without a boundary; not for a cloud', &
      meaning='side of the body that the pressure acts on'), self%side)
    call visitor%list(key_t('span', count=2, unit='m', stands_for='the whole side', &
      also='increasing, within the side', &
      meaning='part of the side: from, to, in the coordinate along it'), self%span)
    call visitor%number(key_t('value', unit='Pa', required=.true., &
      meaning='the pressure; positive: it pushes on the body'), self%value)
    call visitor%number(key_t('ramp_time', unit='s', default='0.0', range=not_negative, &
      meaning=ramp), self%ramp_time)
  end subroutine visit_pressure

  subroutine visit_stabilisation(self, visitor)
    class(stabilisation_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%text(key_t('method', default='none', choices='none silling', &
      meaning='none, or the control of Silling (2017)'), self%method)
    call visitor%number(key_t('factor', unit='1', default='0.0', range=not_negative, &
      also='above 0 for silling, else 0', meaning='strength of the control, g'), self%factor)
  end subroutine visit_stabilisation

  subroutine visit_integration(self, visitor)
    class(integration_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%number(key_t('end_time', unit='s', range=positive, &
      also='this or final_strain, never both', meaning='end of the run'), self%end_time)
    call visitor%number(key_t('final_strain', unit='1', range=positive, &
      also='only with platens', meaning='nominal strain at which the run ends'), &
      self%final_strain)
    call visitor%text(key_t('time_step_rule', default='spectral', &
      choices='courant spectral fixed', &
      meaning='courant: safety * spacing / c_p; spectral: safety * 2 / (largest frequency); ' &
      //'fixed: time_step'), self%time_step_rule)
    call visitor%number(key_t('time_step', unit='s', range=positive, &
      also='needed for the rule fixed, else not allowed', meaning='the time step'), &
      self%time_step)
    call visitor%number(key_t('safety', unit='1', default='0.9', range=range_t(0.0_wp, 10.0_wp, &
      .true., .false.), also='below 1 for the rule spectral; not with fixed', &
      meaning='factor on the time step of the rule'), self%safety)
    call visitor%number(key_t('damping', unit='kg/(m^3 s)', default='0.0', range=not_negative, &
      meaning='force per volume and velocity against the motion, C'), self%damping)
    call visitor%text(key_t('damping_frame', default='rest', choices='rest platens', &
      also='platens: only with platens', &
      meaning='rest: damping against rest, the body starts at rest; platens: against the ' &
      //'affine velocity between the platens, with which the body also starts'), &
      self%damping_frame)
  end subroutine visit_integration

  subroutine visit_imperfection(self, visitor)
    class(imperfection_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: needed = 'needed where amplitude is above 0'

    call visitor%number(key_t('amplitude', unit='1', default='0.0', range=range_t(0.0_wp, &
      1.0_wp, .false., .true.), also='(1 - amplitude) yield_stress not below residual_strength', &
      meaning='relative reduction of the initial yield stress in the patch'), self%amplitude)
    call visitor%number(key_t('x', unit='m', also=needed, meaning='centre of the patch'), self%x)
    call visitor%number(key_t('y', unit='m', also=needed, meaning='centre of the patch'), self%y)
    call visitor%number(key_t('radius', unit='m', range=not_negative, &
      also='above 0 where amplitude is', meaning='radius of the patch'), self%radius)
  end subroutine visit_imperfection

  subroutine visit_random_field(self, visitor)
    class(random_field_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%number(key_t('coefficient_of_variation', unit='1', required=.true., &
      range=positive, &
      meaning='standard deviation of the yield stress over its mean, yield_stress'), &
      self%coefficient_of_variation)
    call visitor%number(key_t('correlation_length', unit='m', required=.true., range=positive, &
      also='a warning where it is below 2 spacing', &
      meaning='distance at which the correlation has fallen to 1/e'), self%correlation_length)
    call visitor%whole(key_t('seed', unit='1', default='1', range=not_negative, &
      also='at most nine digits', meaning='number of the soil: each seed gives another one'), &
      self%seed)
  end subroutine visit_random_field

  subroutine visit_output(self, visitor)
    class(output_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: one = 'increasing, within the run; only one of the three requests'

    call visitor%list(key_t('frame_strains', count=any_count, unit='1', stands_for='none', &
      range=positive, also=one//'; only with platens', &
      meaning='nominal strains at which a frame is written'), self%frame_strains)
    call visitor%list(key_t('frame_times', count=any_count, unit='s', stands_for='none', &
      range=positive, also=one, meaning='times at which a frame is written'), self%frame_times)
    call visitor%whole(key_t('frame_count', unit='1', &
      stands_for='10 where no frames are asked for', range=range_t(1.0_wp, 1.0e5_wp), &
      also='only one of the three requests', &
      meaning='number of frames, evenly spread over the run'), self%frame_count)
    call visitor%whole(key_t('history_count', unit='1', default='1000', range=range_t(1.0_wp, &
      1.0e6_wp), &
      meaning='rows of the history over the run, the unloaded state aside'), self%history_count)
    call visitor%number(key_t('checkpoint_every', unit='s', default='0.0', range=not_negative, &
      meaning='wall-clock time between checkpoints; 0: only when stopped by a signal'), &
      self%checkpoint_every)
  end subroutine visit_output

end module pd_input_types
