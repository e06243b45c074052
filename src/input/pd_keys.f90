!> The one table of every group and key of an input file.
!>
!> The checks, their messages and doc/input.md all come from it: a key is added here, in
!> `input_t`, where `pd_input` fills that type and where `pd_used_values` lists it.
module pd_keys
  use pd_kinds, only: is_set, unset, wp
  use pd_text, only: integer_text, number_text, quoted_list
  implicit none
  private

  public :: key_t, group_key_t, range_t, key_table, group_table
  public :: find_key, find_group, keys_of, allowed_values, words_of
  public :: kind_real, kind_integer, kind_text

  integer, parameter :: kind_real = 1, kind_integer = 2, kind_text = 3

  !> Numbers between two bounds; a bound that is `unset` does not exist.
  type :: range_t
    real(wp) :: lower = unset, upper = unset
    logical  :: above = .false.          !! the lower bound itself is excluded
    logical  :: below = .false.          !! the upper bound itself is excluded
  end type range_t

  type(range_t), parameter :: positive = range_t(lower=0.0_wp, above=.true.)
  type(range_t), parameter :: not_negative = range_t(lower=0.0_wp)

  integer, parameter :: any_count = 0
  integer, parameter :: max_frames = 100000, max_rows = 1000000
  integer, parameter :: length = 32, long = 240

  !> One key. Texts: `choices` are the words allowed, apart by blanks (none: any text), `is_name`
  !> asks for a-z, 0-9 and _. Numbers: `count` is how many are due (any_count: one or more).
  type :: key_t
    character(length) :: group = '', name = ''
    integer           :: kind = kind_real
    integer           :: count = 1
    character(length) :: unit = ''
    character(long)   :: default = ''    !! as it would stand in the file; empty: none
    character(long)   :: stands_for = '' !! what the reference says of a default that is computed
    logical           :: required = .false.
    type(range_t)     :: range = range_t()
    character(long)   :: choices = ''
    logical           :: is_name = .false.
    character(long)   :: also = ''       !! what else must hold, for the reference
    character(long)   :: meaning = ''
  end type key_t

  type :: group_key_t
    character(length) :: name = ''
    logical           :: required = .false.
    logical           :: repeats = .false.
    character(long)   :: meaning = ''
  end type group_key_t

contains

  !> All groups, in the order of the reference.
  pure function group_table() result(groups)
    type(group_key_t), allocatable :: groups(:)

    allocate (groups(11))
    groups(1) = group_key_t('run', required=.true., meaning='names of the run and of its files')
    groups(2) = group_key_t('discretisation', required=.true., &
                            meaning='points, horizon and weights')
    groups(3) = group_key_t('body', required=.true., repeats=.true., &
                            meaning='where there is material')
    groups(4) = group_key_t('material', required=.true., meaning='the constitutive law')
    groups(5) = group_key_t('boundary', repeats=.true., &
                            meaning='points of prescribed motion, and platens under a load')
    groups(6) = group_key_t('pressure', repeats=.true., meaning='a load on a side without boundary')
    groups(7) = group_key_t('stabilisation', meaning='control of zero-energy modes')
    groups(8) = group_key_t('integration', required=.true., &
                            meaning='end of the run, time step and damping')
    groups(9) = group_key_t('imperfection', meaning='a weak patch that seeds a shear band')
    groups(10) = group_key_t('random_field', meaning='a yield stress that varies')
    groups(11) = group_key_t('output', meaning='what is written and when')
  end function group_table

  !> All keys, group by group.
  pure function key_table() result(keys)
    type(key_t), allocatable :: keys(:)
    type(key_t), allocatable :: list(:)
    integer :: n

    allocate (list(96))
    n = 0
    call declare_run(list, n)
    call declare_discretisation(list, n)
    call declare_body(list, n)
    call declare_material(list, n)
    call declare_boundary(list, n)
    call declare_loads(list, n)
    call declare_integration(list, n)
    call declare_imperfection(list, n)
    call declare_random_field(list, n)
    call declare_output(list, n)
    allocate (keys(n))
    keys = list(:n)
  end function key_table

  pure subroutine declare(list, n, key)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    type(key_t), intent(in)    :: key

    n = n + 1
    list(n) = key
  end subroutine declare

  pure subroutine declare_run(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'run'

    call declare(list, n, key_t(group, 'name', kind_text, required=.true., is_name=.true., &
      meaning='stem of the name of every output file'))
    call declare(list, n, key_t(group, 'title', kind_text, stands_for='the name', &
      meaning='title that stands in the results and above figures'))
    call declare(list, n, key_t(group, 'output_dir', kind_text, stands_for='`results/<name>`', &
      meaning='folder of the output files, relative to the working directory; created where ' &
      //'it does not exist'))
    call declare(list, n, key_t(group, 'operators', kind_text, default='auto', &
      choices='auto lattice list', also='''lattice'': only for rectangles', &
      meaning='form of the non-local operators: ''lattice'' is several times faster and needs ' &
      //'a body on a lattice, ''list'' takes any points, ''auto'' chooses'))
  end subroutine declare_run

  pure subroutine declare_discretisation(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'discretisation'

    call declare(list, n, key_t(group, 'spacing', unit='m', required=.true., range=positive, &
      meaning='distance of neighbouring points, dx; for a point cloud a typical distance, which ' &
      //'serves the rule courant and the plots'))
    call declare(list, n, key_t(group, 'horizon', unit='m', required=.true., range=positive, &
      also='for rectangles from spacing to 100 spacing', &
      meaning='radius of the family of a point, delta'))
    call declare(list, n, key_t(group, 'layout', kind_text, default='nodes', &
      choices='nodes cells', also='not with shape = ''file''', &
      meaning='nodes: points stand on the boundary of a rectangle; cells: at the centres of ' &
      //'cells, half a spacing inside'))
    call declare(list, n, key_t(group, 'volumes', kind_text, default='uniform', &
      choices='uniform tributary', also='not with shape = ''file''', &
      meaning='uniform: every point has the volume spacing^2; tributary: points on the ' &
      //'boundary own the half or quarter cell that lies inside'))
    call declare(list, n, key_t(group, 'influence', kind_text, default='gaussian', &
      choices='gaussian constant conical', &
      also='conical needs a horizon of at least 1.5 spacing', &
      meaning='weight of a bond of length r: exp(-r^2/horizon^2), 1, or 1 - r/horizon'))
    call declare(list, n, key_t(group, 'fit', kind_text, default='exact', &
      choices='exact nearest', also='not with shape = ''file''', &
      meaning='extents that are no multiples of spacing: exact: an error that names the ' &
      //'nearest; nearest: adjusted, with a warning'))
  end subroutine declare_discretisation

  pure subroutine declare_body(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'body'
    character(*), parameter :: extents = 'needed for rectangles; for a cloud all four or none'

    call declare(list, n, key_t(group, 'shape', kind_text, default='rectangle', &
      choices='rectangle file', also='file: as the only body', &
      meaning='rectangle: a lattice of points; file: a cloud of points from a text file'))
    call declare(list, n, key_t(group, 'x_min', unit='m', also=extents, meaning='left edge'))
    call declare(list, n, key_t(group, 'x_max', unit='m', also='above x_min; '//extents, &
      meaning='right edge'))
    call declare(list, n, key_t(group, 'y_min', unit='m', also=extents, meaning='lower edge'))
    call declare(list, n, key_t(group, 'y_max', unit='m', also='above y_min; '//extents, &
      meaning='upper edge'))
    call declare(list, n, key_t(group, 'file', kind_text, &
      also='needed for shape = ''file'', else not allowed', &
      meaning='file of the point cloud, relative to the folder of the input file or, where it ' &
      //'is not found there, to the working directory'))
  end subroutine declare_body

  pure subroutine declare_material(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'material'

    call declare(list, n, key_t(group, 'model', kind_text, required=.true., &
      choices='elastic j2', meaning='elastic, or von Mises plasticity with hardening or softening'))
    call declare(list, n, key_t(group, 'strain_measure', kind_text, default='green_lagrange', &
      choices='green_lagrange', meaning='strain in which the law is written'))
    call declare(list, n, key_t(group, 'density', unit='kg/m^3', required=.true., range=positive, &
      meaning='mass per volume'))
    call declare(list, n, key_t(group, 'youngs_modulus', unit='Pa', required=.true., &
      range=positive, meaning='Young''s modulus, E'))
    call declare(list, n, key_t(group, 'poissons_ratio', unit='1', required=.true., &
      range=range_t(-1.0_wp, 0.5_wp, .true., .true.), meaning='Poisson''s ratio'))
    call declare(list, n, key_t(group, 'yield_stress', unit='Pa', range=positive, &
      also='needed for j2', meaning='initial yield stress in a uniaxial test, sigma_y'))
    call declare(list, n, key_t(group, 'kinematic_modulus', unit='Pa', default='0.0', &
      also='3 G + H_k + H_i > 0; where both are negative also 3 G + H_i + min(H_k, H_i) > 0', &
      meaning='slope of stress against plastic strain due to the back stress, H_k; negative: ' &
      //'softening'))
    call declare(list, n, key_t(group, 'isotropic_modulus', unit='Pa', default='0.0', &
      also='as kinematic_modulus', &
      meaning='slope of the yield stress against plastic strain, H_i; negative: softening'))
    call declare(list, n, key_t(group, 'residual_strength', unit='Pa', range=not_negative, &
      also='at most yield_stress; needed for j2 with a negative modulus', &
      meaning='strength at which softening stops, sigma_r; without effect on hardening'))
  end subroutine declare_material

  pure subroutine declare_boundary(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'boundary'

    call declare(list, n, key_t(group, 'name', kind_text, required=.true., is_name=.true., &
      also='each name once', meaning='name in the results, and in the file of a point cloud'))
    call declare(list, n, key_t(group, 'side', kind_text, stands_for='none', &
      choices='bottom top left right all', &
      also='needed for rectangles, each side once, all alone; not all for a cloud', &
      meaning='side of the body beyond which the layers of points lie; for a cloud the side ' &
      //'that the boundary stands for'))
    call declare(list, n, key_t(group, 'contact', kind_text, default='rough', &
      choices='rough smooth affine', also='smooth needs one side, not all', &
      meaning='rough: both components of the motion prescribed; smooth: only the one across ' &
      //'the side; affine: the motion of a homogeneous deformation'))
    call declare(list, n, key_t(group, 'velocity', count=2, unit='m/s', default='0.0, 0.0', &
      also='smooth: 0 along the side; not with times, traction or affine', &
      meaning='constant velocity, x and y'))
    call declare(list, n, key_t(group, 'times', count=any_count, unit='s', stands_for='none', &
      range=not_negative, also='increasing', meaning='times of the tables below'))
    call declare(list, n, key_t(group, 'velocities_x', count=any_count, unit='m/s', &
      stands_for='zero', also='as many as times; not with affine', &
      meaning='velocity along x at these times'))
    call declare(list, n, key_t(group, 'velocities_y', count=any_count, unit='m/s', &
      stands_for='zero', also='as many as times; not with affine', &
      meaning='velocity along y at these times'))
    call declare(list, n, key_t(group, 'velocity_gradient', count=4, unit='1/s', &
      stands_for='none', also='needed for affine, else not allowed', &
      meaning='L of the velocity L x, in the order xx, xy, yx, yy'))
    call declare(list, n, key_t(group, 'factors', count=any_count, unit='1', &
      stands_for='1 at all times', also='as many as times; only with affine', &
      meaning='factors on velocity_gradient at these times'))
  end subroutine declare_boundary

  pure subroutine declare_loads(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'pressure'
    character(*), parameter :: ramp = 'time in which it rises linearly from 0; 0: whole at once'

    call declare(list, n, key_t('boundary', 'traction', count=2, unit='Pa', stands_for='none', &
      also='in place of a motion; smooth: 0 along the side; rectangles only, not affine, not all', &
      meaning='force per area that acts on the platen from outside, x and y: the platen moves ' &
      //'under it and stays plane'))
    call declare(list, n, key_t('boundary', 'ramp_time', unit='s', default='0.0', &
      range=not_negative, also='only with traction', meaning=ramp))
    call declare(list, n, key_t(group, 'name', kind_text, required=.true., is_name=.true., &
      also='each name once', meaning='name in the log and in the values of the results'))
    call declare(list, n, key_t(group, 'side', kind_text, required=.true., &
      choices='bottom top left right', also='a side without a boundary; not for a cloud', &
      meaning='side of the body that the pressure acts on'))
    call declare(list, n, key_t(group, 'span', count=2, unit='m', stands_for='the whole side', &
      also='increasing, within the side', &
      meaning='part of the side: from, to, in the coordinate along it'))
    call declare(list, n, key_t(group, 'value', unit='Pa', required=.true., &
      meaning='the pressure; positive: it pushes on the body'))
    call declare(list, n, key_t(group, 'ramp_time', unit='s', default='0.0', &
      range=not_negative, meaning=ramp))
  end subroutine declare_loads

  pure subroutine declare_integration(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'integration'

    call declare(list, n, key_t('stabilisation', 'method', kind_text, default='none', &
      choices='none silling', meaning='none, or the control of Silling (2017)'))
    call declare(list, n, key_t('stabilisation', 'factor', unit='1', default='0.0', &
      range=not_negative, also='above 0 for silling, else 0', &
      meaning='strength of the control, g'))
    call declare(list, n, key_t(group, 'end_time', unit='s', range=positive, &
      also='this or final_strain, never both', meaning='end of the run'))
    call declare(list, n, key_t(group, 'final_strain', unit='1', range=positive, &
      also='only with platens', meaning='nominal strain at which the run ends'))
    call declare(list, n, key_t(group, 'time_step_rule', kind_text, default='spectral', &
      choices='courant spectral fixed', &
      meaning='courant: safety * spacing / c_p; spectral: safety * 2 / (largest frequency); ' &
      //'fixed: time_step'))
    call declare(list, n, key_t(group, 'time_step', unit='s', range=positive, &
      also='needed for the rule fixed, else not allowed', meaning='the time step'))
    call declare(list, n, key_t(group, 'safety', unit='1', default='0.9', &
      range=range_t(0.0_wp, 10.0_wp, .true., .false.), &
      also='below 1 for the rule spectral; not with fixed', &
      meaning='factor on the time step of the rule'))
    call declare(list, n, key_t(group, 'damping', unit='kg/(m^3 s)', default='0.0', &
      range=not_negative, meaning='force per volume and velocity against the motion, C'))
    call declare(list, n, key_t(group, 'damping_frame', kind_text, default='rest', &
      choices='rest platens', also='platens: only with platens', &
      meaning='rest: damping against rest, the body starts at rest; platens: against the ' &
      //'affine velocity between the platens, with which the body also starts'))
  end subroutine declare_integration

  pure subroutine declare_imperfection(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'imperfection'
    character(*), parameter :: needed = 'needed where amplitude is above 0'

    call declare(list, n, key_t(group, 'amplitude', unit='1', default='0.0', &
      range=range_t(0.0_wp, 1.0_wp, .false., .true.), &
      also='(1 - amplitude) yield_stress not below residual_strength', &
      meaning='relative reduction of the initial yield stress in the patch'))
    call declare(list, n, key_t(group, 'x', unit='m', also=needed, meaning='centre of the patch'))
    call declare(list, n, key_t(group, 'y', unit='m', also=needed, meaning='centre of the patch'))
    call declare(list, n, key_t(group, 'radius', unit='m', range=not_negative, &
      also='above 0 where amplitude is', meaning='radius of the patch'))
  end subroutine declare_imperfection

  pure subroutine declare_random_field(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'random_field'

    call declare(list, n, key_t(group, 'coefficient_of_variation', unit='1', required=.true., &
      range=positive, meaning='standard deviation of the yield stress over its mean, yield_stress'))
    call declare(list, n, key_t(group, 'correlation_length', unit='m', required=.true., &
      range=positive, also='a warning where it is below 2 spacing', &
      meaning='distance at which the correlation has fallen to 1/e'))
    call declare(list, n, key_t(group, 'seed', kind_integer, unit='1', default='1', &
      range=not_negative, also='at most nine digits', &
      meaning='number of the soil: each seed gives another one'))
  end subroutine declare_random_field

  pure subroutine declare_output(list, n)
    type(key_t), intent(inout) :: list(:)
    integer,     intent(inout) :: n
    character(*), parameter :: group = 'output'
    character(*), parameter :: one = 'increasing, within the run; only one of the three requests'

    call declare(list, n, key_t(group, 'frame_strains', count=any_count, unit='1', &
      stands_for='none', range=positive, also=one//'; only with platens', &
      meaning='nominal strains at which a frame is written'))
    call declare(list, n, key_t(group, 'frame_times', count=any_count, unit='s', &
      stands_for='none', range=positive, also=one, meaning='times at which a frame is written'))
    call declare(list, n, key_t(group, 'frame_count', kind_integer, unit='1', &
      stands_for='10 where no frames are asked for', &
      range=range_t(1.0_wp, real(max_frames, wp)), also='only one of the three requests', &
      meaning='number of frames, evenly spread over the run'))
    call declare(list, n, key_t(group, 'history_count', kind_integer, unit='1', default='1000', &
      range=range_t(1.0_wp, real(max_rows, wp)), &
      meaning='rows of the history over the run, the unloaded state aside'))
    call declare(list, n, key_t(group, 'checkpoint_every', unit='s', default='0.0', &
      range=not_negative, &
      meaning='wall-clock time between checkpoints; 0: only when stopped by a signal'))
  end subroutine declare_output

  !> Index of a key in the table, 0 where there is none.
  pure integer function find_key(keys, group, name) result(i)
    type(key_t),  intent(in) :: keys(:)
    character(*), intent(in) :: group, name

    do i = 1, size(keys)
      if (keys(i)%group == group .and. keys(i)%name == name) return
    end do
    i = 0
  end function find_key

  !> Index of a group in the table, 0 where there is none.
  pure integer function find_group(groups, name) result(i)
    type(group_key_t), intent(in) :: groups(:)
    character(*),      intent(in) :: name

    do i = 1, size(groups)
      if (groups(i)%name == name) return
    end do
    i = 0
  end function find_group

  !> Names of the keys of a group.
  pure function keys_of(keys, group) result(names)
    type(key_t),  intent(in) :: keys(:)
    character(*), intent(in) :: group
    character(length), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(keys)
      if (keys(i)%group == group) names = [names, keys(i)%name]
    end do
  end function keys_of

  !> The words of a text, apart by blanks.
  pure function words_of(text) result(words)
    character(*), intent(in) :: text
    character(length), allocatable :: words(:)
    character(length) :: word
    integer :: from, to

    allocate (words(0))
    from = 1
    do while (from <= len_trim(text))
      to = index(text(from:)//' ', ' ') + from - 2
      word = text(from:to)
      if (to >= from) words = [words, word]
      from = to + 2
    end do
  end function words_of

  !> What a key may hold by itself: choices, a range, or a number of values.
  pure function allowed_values(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text

    if (key%kind == kind_text) then
      text = 'text'
      if (key%is_name) text = 'a name of a-z, 0-9 and _'
      if (key%choices /= '') text = quoted_list(words_of(key%choices))
      return
    end if
    text = range_text(key%range)
    if (key%kind == kind_integer) text = 'a whole number '//text
    if (key%count > 1) text = integer_text(key%count)//' numbers '//text
    if (key%count == any_count) text = 'one or more numbers '//text
    if (text == '') text = 'any number'
    text = trim(text)
  end function allowed_values

  !> A range in words, empty where every number is allowed.
  pure function range_text(range) result(text)
    type(range_t), intent(in) :: range
    character(:), allocatable :: text

    text = ''
    if (is_set(range%lower)) then
      text = '>= '
      if (range%above) text = '> '
      text = text//without_point(number_text(range%lower))
    end if
    if (is_set(range%upper)) then
      if (text /= '') text = text//' and '
      if (range%below) then
        text = text//'< '
      else
        text = text//'<= '
      end if
      text = text//without_point(number_text(range%upper))
    end if
  end function range_text

  !> A number without the .0 of a whole number.
  pure function without_point(number) result(text)
    character(*), intent(in) :: number
    character(:), allocatable :: text
    integer :: n

    n = len(number)
    text = number
    if (n > 2) then
      if (number(n - 1:n) == '.0') text = number(:n - 2)
    end if
  end function without_point

end module pd_keys
