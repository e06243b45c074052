!> Groups of the input file: the points and where there is material.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_body_keys
  use pd_keys, only: any_count, group_key_t, key_t, key_visitor_t, positive
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: discretisation_input_t, body_input_t, cut_input_t

  type :: discretisation_input_t
    real(wp) :: spacing = unset                        !! [m]
    real(wp) :: horizon = unset                        !! [m]
    character(:), allocatable :: layout, volumes, influence, fit, cloud_weights
    character(:), allocatable :: families              !! line_of_sight or distance
  contains
    procedure :: visit => visit_discretisation
  end type discretisation_input_t

  type :: body_input_t
    character(:), allocatable :: name, role
    character(:), allocatable :: shape, file           !! file: as in the input, relative to it
    character(:), allocatable :: material              !! name of one of the materials
    real(wp) :: x_min = unset, x_max = unset, y_min = unset, y_max = unset   !! [m]
    real(wp), allocatable :: vertices(:)               !! x1, y1, x2, y2, ... [m]; size 0: none
    real(wp) :: x = unset, y = unset, radius = unset   !! of a circle [m]
  contains
    procedure :: visit => visit_body
  end type body_input_t

  type :: cut_input_t
    real(wp) :: x(2) = unset, y(2) = unset             !! of both ends [m]
  contains
    procedure :: visit => visit_cut
  end type cut_input_t

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
      also='on a lattice from spacing to 100 spacing', &
      meaning='radius of the family of a point, delta'), self%horizon)
    call visitor%text_key(key_t('layout', default='nodes', needs_effect=.true., &
      choices='nodes cells', &
      also='not with shape = ''file''', &
      meaning='nodes: points stand on the boundary of a rectangle; cells: at the centres of ' &
      //'cells, half a spacing inside; a point on an edge belongs to the body'), self%layout)
    call visitor%text_key(key_t('volumes', default='uniform', needs_effect=.true., &
      choices='uniform tributary', &
      also='not with shape = ''file''', &
      meaning='uniform: every point has the volume spacing^2; tributary: that of the part of ' &
      //'its cell that lies inside: half or a quarter on the boundary of a rectangle'), &
      self%volumes)
    call visitor%text_key(key_t('influence', default='gaussian', &
      choices='gaussian constant conical', &
      also='conical needs a horizon of at least 1.5 spacing', &
      meaning='weight of a bond of length r: exp(-r^2/horizon^2), 1, or 1 - r/horizon'), &
      self%influence)
    call visitor%text_key(key_t('families', default='line_of_sight', needs_effect=.true., &
      choices='line_of_sight distance', &
      also='line_of_sight for a cloud only with &cut, which distance does not allow', &
      meaning='points within the horizon that a bond joins: line_of_sight: those whose straight ' &
      //'line stays in material and crosses no cut; distance: all, across gaps too'), self%families)
    call visitor%text_key(key_t('fit', default='exact', needs_effect=.true., &
      choices='exact nearest', &
      also='only with shape = ''rectangle''', &
      meaning='rectangles whose extents are no multiples of spacing: exact: an error that ' &
      //'names the nearest; nearest: adjusted, with a warning'), self%fit)
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
    character(*), parameter :: circles = 'needed for shape = ''circle'', else not allowed'

    call visitor%group(group_key_t('body', required=.true., repeats=.true., &
      meaning='where there is material'))
    call visitor%text_key(key_t('name', is_name=.true., stands_for='none', &
      also='each name once', meaning='name by which other groups call the body'), self%name)
    call visitor%text_key(key_t('shape', default='rectangle', &
      choices='rectangle polygon circle file', also='file: as the only body', &
      meaning='rectangle, polygon, circle: points of one lattice; file: a cloud of points from ' &
      //'a text file'), self%shape)
    call visitor%text_key(key_t('role', default='solid', needs_effect=.true., &
      choices='solid hole', also='not for a cloud; the first body is solid', &
      meaning='solid: material; hole: none, where bodies before it have some. Where bodies ' &
      //'overlap, the last one decides'), self%role)
    call visitor%real_key(key_t('x_min', unit='m', also=extents, meaning='left edge'), &
      self%x_min)
    call visitor%real_key(key_t('x_max', unit='m', also='above x_min; '//extents, &
      meaning='right edge'), self%x_max)
    call visitor%real_key(key_t('y_min', unit='m', also=extents, meaning='lower edge'), &
      self%y_min)
    call visitor%real_key(key_t('y_max', unit='m', also='above y_min; '//extents, &
      meaning='upper edge'), self%y_max)
    call visitor%list_key(key_t('vertices', count=any_count, unit='m', stands_for='none', &
      also='needed for polygons, else not allowed: three or more pairs, no edges that cross', &
      meaning='x1, y1, x2, y2, ... of a polygon, either way round; edge k goes from vertex k ' &
      //'to the next one'), self%vertices)
    call visitor%real_key(key_t('x', unit='m', also=circles, meaning='centre of a circle'), &
      self%x)
    call visitor%real_key(key_t('y', unit='m', also=circles, meaning='centre of a circle'), &
      self%y)
    call visitor%real_key(key_t('radius', unit='m', range=positive, also=circles, &
      meaning='radius of a circle'), self%radius)
    call visitor%text_key(key_t('file', also='needed for shape = ''file'', else not allowed', &
      meaning='file of the point cloud, relative to the folder of the input file or, where it ' &
      //'is not found there, to the working directory'), self%file)
    call visitor%text_key(key_t('material', is_name=.true., stands_for='the first material', &
      also='name of a material; not for a hole', &
      meaning='material of the body; a cloud has one for all its points'), self%material)
  end subroutine visit_body

  subroutine visit_cut(self, visitor)
    class(cut_input_t),   intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: ends = 'the two ends differ; the cut crosses a bond'

    call visitor%group(group_key_t('cut', repeats=.true., &
      meaning='a straight line that no bond crosses, for slots thinner than a spacing'))
    call visitor%vector_key(key_t('x', count=2, unit='m', required=.true., also=ends, &
      meaning='of the first and the second end; points on the cut lie at its left side, as seen ' &
      //'from the first end to the second'), self%x)
    call visitor%vector_key(key_t('y', count=2, unit='m', required=.true., also=ends, &
      meaning='of the same ends, which belong to the cut'), self%y)
  end subroutine visit_cut

end module pd_body_keys
