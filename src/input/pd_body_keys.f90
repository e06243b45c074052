!> Groups of the input file: the points and where there is material.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_body_keys
  use pd_keys, only: group_key_t, key_t, key_visitor_t, positive
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: discretisation_input_t, body_input_t

  type :: discretisation_input_t
    real(wp) :: spacing = unset                        !! [m]
    real(wp) :: horizon = unset                        !! [m]
    character(:), allocatable :: layout, volumes, influence, fit, cloud_weights
  contains
    procedure :: visit => visit_discretisation
  end type discretisation_input_t

  type :: body_input_t
    character(:), allocatable :: name
    character(:), allocatable :: shape, file           !! file: as in the input, relative to it
    character(:), allocatable :: material              !! name of one of the materials
    real(wp) :: x_min = unset, x_max = unset, y_min = unset, y_max = unset   !! [m]
  contains
    procedure :: visit => visit_body
  end type body_input_t

contains

  subroutine visit_discretisation(self, visitor)
    class(discretisation_input_t), intent(inout) :: self
    class(key_visitor_t),          intent(inout) :: visitor

    call visitor%group(group_key_t('discretisation', required=.true., &
      meaning='points, horizon and weights'))
    call visitor%real_key(key_t('spacing', unit='m', required=.true., range=positive, &
      meaning='distance of neighbouring points, dx; for a point cloud a typical distance, which ' &
      //'serves the rule courant and the plots'), self%spacing)
    call visitor%real_key(key_t('horizon', unit='m', required=.true., range=positive, &
      also='for rectangles from spacing to 100 spacing', &
      meaning='radius of the family of a point, delta'), self%horizon)
    call visitor%text_key(key_t('layout', default='nodes', needs_effect=.true., &
      choices='nodes cells', &
      also='not with shape = ''file''', &
      meaning='nodes: points stand on the boundary of a rectangle; cells: at the centres of ' &
      //'cells, half a spacing inside'), self%layout)
    call visitor%text_key(key_t('volumes', default='uniform', needs_effect=.true., &
      choices='uniform tributary', &
      also='not with shape = ''file''', &
      meaning='uniform: every point has the volume spacing^2; tributary: points on the ' &
      //'boundary own the half or quarter cell that lies inside'), self%volumes)
    call visitor%text_key(key_t('influence', default='gaussian', &
      choices='gaussian constant conical', &
      also='conical needs a horizon of at least 1.5 spacing', &
      meaning='weight of a bond of length r: exp(-r^2/horizon^2), 1, or 1 - r/horizon'), &
      self%influence)
    call visitor%text_key(key_t('fit', default='exact', needs_effect=.true., &
      choices='exact nearest', &
      also='not with shape = ''file''', &
      meaning='extents that are no multiples of spacing: exact: an error that names the ' &
      //'nearest; nearest: adjusted, with a warning'), self%fit)
    call visitor%text_key(key_t('cloud_weights', default='balanced', needs_effect=.true., &
      choices='balanced plain', &
      also='only with shape = ''file''', &
      meaning='balanced: a homogeneous stress is in equilibrium inside a cloud of points; plain: ' &
      //'it is not, and stresses come out too small'), self%cloud_weights)
  end subroutine visit_discretisation

  subroutine visit_body(self, visitor)
    class(body_input_t),  intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: extents = 'needed for rectangles; for a cloud all four or none'

    call visitor%group(group_key_t('body', required=.true., repeats=.true., &
      meaning='where there is material'))
    call visitor%text_key(key_t('name', is_name=.true., stands_for='none', &
      also='each name once', meaning='name by which stages call the body'), self%name)
    call visitor%text_key(key_t('shape', default='rectangle', choices='rectangle file', &
      also='file: as the only body', &
      meaning='rectangle: a lattice of points; file: a cloud of points from a text file'), &
      self%shape)
    call visitor%real_key(key_t('x_min', unit='m', also=extents, meaning='left edge'), &
      self%x_min)
    call visitor%real_key(key_t('x_max', unit='m', also='above x_min; '//extents, &
      meaning='right edge'), self%x_max)
    call visitor%real_key(key_t('y_min', unit='m', also=extents, meaning='lower edge'), &
      self%y_min)
    call visitor%real_key(key_t('y_max', unit='m', also='above y_min; '//extents, &
      meaning='upper edge'), self%y_max)
    call visitor%text_key(key_t('file', also='needed for shape = ''file'', else not allowed', &
      meaning='file of the point cloud, relative to the folder of the input file or, where it ' &
      //'is not found there, to the working directory'), self%file)
    call visitor%text_key(key_t('material', is_name=.true., stands_for='the first material', &
      also='name of a material', &
      meaning='material of the body; a cloud has one for all its points'), self%material)
  end subroutine visit_body

end module pd_body_keys
