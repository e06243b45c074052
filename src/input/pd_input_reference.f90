!> doc/input.md: the reference of the input file, written from the table of keys.
module pd_input_reference
  use pd_key_table, only: group_table, key_table
  use pd_keys, only: allowed_values, group_key_t, key_t, kind_text
  implicit none
  private

  public :: write_input_reference

contains

  !> Write the whole reference, as Markdown, on a unit that is open for formatted writing.
  subroutine write_input_reference(unit)
    integer, intent(in) :: unit
    type(group_key_t), allocatable :: groups(:)
    type(key_t),       allocatable :: keys(:)
    integer :: g, k

    allocate (groups, source=group_table())
    allocate (keys, source=key_table())
    call write_introduction(unit)
    do g = 1, size(groups)
      call put(unit, '')
      call put(unit, '## &'//trim(groups(g)%name)//': '//trim(groups(g)%meaning))
      call put(unit, '')
      call put(unit, standing(groups(g)))
      call put(unit, '')
      call put(unit, '| key | meaning | unit | default | allowed |')
      call put(unit, '|---|---|---|---|---|')
      do k = 1, size(keys)
        if (keys(k)%group == groups(g)%name) call put(unit, row(keys(k)))
      end do
      call write_note(unit, trim(groups(g)%name))
    end do
    call write_cloud(unit)
    call write_example(unit)
  end subroutine write_input_reference

  subroutine put(unit, line)
    integer,      intent(in) :: unit
    character(*), intent(in) :: line

    write (unit, '(a)') trim(line)
  end subroutine put

  pure function standing(group) result(text)
    type(group_key_t), intent(in) :: group
    character(:), allocatable :: text

    if (group%required .and. group%repeats) then
      text = 'Must be given; may be given several times.'
    else if (group%required) then
      text = 'Must be given once.'
    else if (group%repeats) then
      text = 'May be left out; may be given several times.'
    else
      text = 'May be left out; may be given once.'
    end if
  end function standing

  !> One key as a row of the table of its group.
  pure function row(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text, allowed, default, unit

    unit = trim(key%unit)
    if (unit == '' .and. key%kind == kind_text) unit = '-'
    default = trim(key%stands_for)
    if (key%default /= '') default = '`'//trim(key%default)//'`'
    if (key%default /= '' .and. key%kind == kind_text) default = '`'''//trim(key%default)//'''`'
    if (key%required) default = '**must be given**'
    if (default == '') default = 'none'
    allowed = allowed_values(key)
    if (key%also /= '') allowed = allowed//'; '//trim(key%also)
    text = '| `'//trim(key%name)//'` | '//trim(key%meaning)//' | '//unit//' | ' &
      //default//' | '//allowed//' |'
  end function row

  subroutine write_introduction(unit)
    integer, intent(in) :: unit

    call put(unit, '# The input file')
    call put(unit, '')
    call put(unit, 'Written by `perigeo --input-reference`; change `src/input/pd_input_types.f90` and')
    call put(unit, '`src/input/pd_input_reference.f90`, not this page.')
    call put(unit, '')
    call put(unit, 'A run is described by one text file of Fortran namelist groups. A group')
    call put(unit, 'starts with `&` and its name and ends with `/`; between them stand keys')
    call put(unit, 'with their values. The order of the groups, and of the keys in a group,')
    call put(unit, 'is free.')
    call put(unit, '')
    call put(unit, '```fortran')
    call put(unit, '&body                        ! a comment goes from ! to the end of the line')
    call put(unit, '  shape = ''rectangle''        ! texts stand in quotes')
    call put(unit, '  x_min = 0.0, x_max = 1.0   ! several keys on one line')
    call put(unit, '  y_min = 0, y_max = 2.0e0   ! 2, 2.0, 2.0e0 and 2.0d0 are the same number')
    call put(unit, '/')
    call put(unit, '```')
    call put(unit, '')
    call put(unit, '- All quantities are in SI units; tension is positive; angles do not')
    call put(unit, '  occur.')
    call put(unit, '- Names of groups and keys are the same in small and capital letters.')
    call put(unit, '  Choices and names of your own are written in small letters.')
    call put(unit, '- Lists are separated by commas, blanks or line ends; `3*0.5` stands for')
    call put(unit, '  `0.5, 0.5, 0.5`. Empty values (`1.0,,2.0`) and indices (`velocity(2) =')
    call put(unit, '  1.0`) are not accepted.')
    call put(unit, '- A text ends on the line where it starts. A quote inside is doubled:')
    call put(unit, '  `''it''''s''`.')
    call put(unit, '- Numbers have magnitudes from 1e-100 to 1e100, or are 0. A file has at')
    call put(unit, '  most 1 MiB, a key at most 10000 values.')
    call put(unit, '- Nothing is ignored: an unknown group or key, a key that would have no')
    call put(unit, '  effect, or a value out of range is an error. All mistakes of a file')
    call put(unit, '  are listed in one go, and the program ends with exit status 2 before')
    call put(unit, '  it writes anything. `perigeo --check RUN.nml` looks at a file without')
    call put(unit, '  running it.')
  end subroutine write_introduction

  !> What the table of a group cannot say.
  subroutine write_note(unit, group)
    integer,      intent(in) :: unit
    character(*), intent(in) :: group

    select case (group)
    case ('discretisation')
      call put(unit, '')
      call put(unit, 'The family of a point holds all points within `horizon` of it. The ratio')
      call put(unit, '`horizon / spacing`, called m, sets accuracy and cost: 3 to 5 is usual.')
      call put(unit, '')
      call put(unit, 'Extents of a rectangle, and distances between rectangles, must be')
      call put(unit, 'multiples of `spacing` to within 1e-6 spacing. With `fit = ''nearest''`')
      call put(unit, 'they are adjusted to the nearest multiple, with a warning; the real')
      call put(unit, 'extents are then stored, and used in every area, width and strain.')
    case ('body')
      call put(unit, '')
      call put(unit, 'Rectangles that touch or overlap on the lattice form one continuum.')
    case ('material')
      call put(unit, '')
      call put(unit, 'G is the shear modulus, H_k the kinematic and H_i the isotropic modulus.')
      call put(unit, 'Softening ends at `residual_strength`; hardening has no end. The keys of')
      call put(unit, 'plasticity may stay in the file with `model = ''elastic''`, where they are')
      call put(unit, 'not used: one word switches the model.')
    case ('boundary')
      call write_boundary_note(unit)
    case ('pressure')
      call write_pressure_note(unit)
    case ('integration')
      call put(unit, '')
      call put(unit, 'Nominal strain is the approach of the two platens over the extent of the')
      call put(unit, 'body between them, compression positive. The run ends at the first step')
      call put(unit, 'at or past its end. The default rule asks for the largest frequency of')
      call put(unit, 'the discrete body, and so knows the true limit of the time step;')
      call put(unit, '`courant` estimates it from the wave speed c_p, too small for m above 2,')
      call put(unit, 'so that `safety` may exceed 1 there, at your own risk.')
    case ('imperfection')
      call put(unit, '')
      call put(unit, 'The initial yield stress is reduced to (1 - amplitude) yield_stress in')
      call put(unit, 'the patch; the residual strength is not. `x`, `y` and `radius` may stay')
      call put(unit, 'in the file with `amplitude = 0.0`.')
    case ('random_field')
      call put(unit, '')
      call put(unit, 'The initial yield stress of a point is drawn from a lognormal distribution')
      call put(unit, 'with the mean `yield_stress`; its logarithm has the correlation')
      call put(unit, 'exp(-(r / correlation_length)^2) over a distance r. The field is a function')
      call put(unit, 'of position: a seed gives the same soil for every spacing and body. Where')
      call put(unit, 'it is below `residual_strength` there is no softening. `&imperfection`')
      call put(unit, 'multiplies the field. Only with `model = ''j2''`.')
    case ('output')
      call put(unit, '')
      call put(unit, 'Frame 0, the unloaded state, is always written; requests come after it.')
      call put(unit, 'They never change the time step: a frame or row is taken at the first')
      call put(unit, 'step at or past its request.')
    case default   ! the table says it all
      continue
    end select
  end subroutine write_note

  subroutine write_boundary_note(unit)
    integer, intent(in) :: unit

    call put(unit, '')
    call put(unit, 'A boundary consists of fictitious points: layers at least `horizon`')
    call put(unit, 'thick beyond a side of the body, or all round with `side = ''all''`. They')
    call put(unit, 'belong to the families of the body, and their motion is prescribed. The')
    call put(unit, 'corner between two sides belongs to the bottom or top.')
    call put(unit, '')
    call put(unit, 'It moves in one of three ways:')
    call put(unit, '')
    call put(unit, '- with a constant `velocity`;')
    call put(unit, '- by tables: `times` with `velocities_x`, `velocities_y` or both (the')
    call put(unit, '  one that is left out is zero). Velocities are linear between the')
    call put(unit, '  times, and held constant before the first and after the last;')
    call put(unit, '- affinely (`contact = ''affine''`): v = L x about the origin of the')
    call put(unit, '  coordinates, with x the reference position and L the')
    call put(unit, '  `velocity_gradient`, times the table `factors` at `times` where these')
    call put(unit, '  are given. A single point between layers on all sides deforms')
    call put(unit, '  homogeneously; in a larger body points near the layers deviate, for the')
    call put(unit, '  layers are cut off at their outer side.')
    call put(unit, '')
    call put(unit, 'Instead, a load may move it: `traction` is the force per length of its side')
    call put(unit, 'that acts on the boundary from outside, along the axes; on a top platen')
    call put(unit, '`traction = 0.0, -1.0e5` compresses the body. It rises linearly within')
    call put(unit, '`ramp_time`. The boundary translates as one and stays plane; its mass is that')
    call put(unit, 'of its layers. Rough: both components of the traction act. Smooth: only')
    call put(unit, 'the one across the side, the points slide freely along it. Ramp it slowly,')
    call put(unit, 'with damping, where the state at rest is wanted: a sudden load swings to')
    call put(unit, 'twice its value.')
    call put(unit, '')
    call put(unit, '**Platens** are exactly two boundaries on opposite sides (bottom and')
    call put(unit, 'top, or left and right), neither of them affine, with no boundary on the')
    call put(unit, 'other two sides. Only with platens is there a nominal strain, and only')
    call put(unit, 'then may `final_strain`, `frame_strains` and `damping_frame = ''platens''`')
    call put(unit, 'be used. Where a platen moves under a `traction`, its strain follows from')
    call put(unit, 'the run: use `end_time`, `frame_times` or `frame_count`, and')
    call put(unit, '`damping_frame = ''rest''`.')
  end subroutine write_boundary_note

  subroutine write_pressure_note(unit)
    integer, intent(in) :: unit

    call put(unit, '')
    call put(unit, 'A stress -p n on a side of the rectangles, n pointing outwards. It is a')
    call put(unit, 'dead load: it keeps its direction and acts on the reference length of the')
    call put(unit, 'side. In all it is the value times the length that it acts on, whatever')
    call put(unit, 'layout and volumes.')
    call put(unit, 'Pressures that overlap add up.')
    call put(unit, '')
    call put(unit, '- The side is where the body reaches the outermost line of all rectangles;')
    call put(unit, '  parts that are set back from it carry nothing.')
    call put(unit, '- The points within two horizons of the side carry the load, in the')
    call put(unit, '  proportions that keep a homogeneous stress in equilibrium near a surface.')
    call put(unit, '  This is exact where the body is at least four horizons wide.')
    call put(unit, '- Layers of a smooth boundary beside the side slide along with the body and')
    call put(unit, '  stand for a body that goes on: where the pressure reaches that end of the')
    call put(unit, '  side, they carry it too. Layers of rough boundaries carry nothing.')
    call put(unit, '- With `layout = ''nodes''` and `volumes = ''uniform''` the body is larger')
    call put(unit, '  than its rectangle by half a spacing all round. At free ends of a side the')
    call put(unit, '  same load then makes a smaller stress, by length / (length + spacing).')
    call put(unit, '  Take `volumes = ''tributary''` with loads.')
  end subroutine write_pressure_note

  subroutine write_cloud(unit)
    integer, intent(in) :: unit

    call put(unit, '')
    call put(unit, '## The file of a point cloud')
    call put(unit, '')
    call put(unit, 'With `shape = ''file''` the points are read from the text file `file`, one')
    call put(unit, 'line a point: x [m], y [m], volume per unit thickness [m^2], and for a')
    call put(unit, 'point of a boundary the `name` of that boundary. `#` starts a comment.')
    call put(unit, '')
    call put(unit, '```')
    call put(unit, '# x       y       volume')
    call put(unit, '0.013     0.008   4.0e-4')
    call put(unit, '0.032     0.011   3.9e-4')
    call put(unit, '0.011    -0.009   4.0e-4   bottom')
    call put(unit, '```')
    call put(unit, '')
    call put(unit, 'Every boundary named in the file needs its group `&boundary`, and every')
    call put(unit, 'group needs at least one point. `side` then creates no points: it says')
    call put(unit, 'which way a smooth boundary faces, and which boundaries are platens.')
    call put(unit, '`x_min` to `y_max` state the extents of the body that strains and')
    call put(unit, 'stresses refer to.')
  end subroutine write_cloud

  subroutine write_example(unit)
    integer, intent(in) :: unit

    call put(unit, '')
    call put(unit, '## A complete example')
    call put(unit, '')
    call put(unit, '```fortran')
    call put(unit, '&run')
    call put(unit, '  title = ''Plane strain compression, m = 4''')
    call put(unit, '  name = ''compression_m4''')
    call put(unit, '/')
    call put(unit, '&discretisation')
    call put(unit, '  spacing = 0.02             ! [m]')
    call put(unit, '  horizon = 0.08             ! [m]')
    call put(unit, '/')
    call put(unit, '&body')
    call put(unit, '  shape = ''rectangle''')
    call put(unit, '  x_min = 0.0, x_max = 1.0   ! [m]')
    call put(unit, '  y_min = 0.0, y_max = 2.0   ! [m]')
    call put(unit, '/')
    call put(unit, '&material')
    call put(unit, '  model = ''j2''')
    call put(unit, '  density = 2000.0           ! [kg/m^3]')
    call put(unit, '  youngs_modulus = 50.0e6    ! [Pa]')
    call put(unit, '  poissons_ratio = 0.3')
    call put(unit, '  yield_stress = 0.15e6      ! [Pa]')
    call put(unit, '  kinematic_modulus = -1.5e6 ! [Pa], negative: softening')
    call put(unit, '  residual_strength = 15.0e3 ! [Pa]')
    call put(unit, '/')
    call put(unit, '&boundary')
    call put(unit, '  name = ''bottom'', side = ''bottom'', contact = ''rough''')
    call put(unit, '/')
    call put(unit, '&boundary')
    call put(unit, '  name = ''top'', side = ''top'', contact = ''smooth''')
    call put(unit, '  velocity = 0.0, -0.01      ! [m/s]')
    call put(unit, '/')
    call put(unit, '&integration')
    call put(unit, '  final_strain = 0.016')
    call put(unit, '  damping = 5.0e5            ! [kg/(m^3 s)]')
    call put(unit, '  damping_frame = ''platens''')
    call put(unit, '/')
    call put(unit, '&output')
    call put(unit, '  frame_strains = 0.010, 0.013, 0.016')
    call put(unit, '/')
    call put(unit, '```')
  end subroutine write_example

end module pd_input_reference
