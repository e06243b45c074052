!> Groups of the input file: boundaries and loads.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_load_keys
  use pd_keys, only: any_count, group_key_t, key_t, key_visitor_t, not_negative, positive, range_t
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: boundary_input_t, pressure_input_t

  type :: boundary_input_t
    character(:), allocatable :: name, side, contact   !! side: '' where a point cloud names it
    character(:), allocatable :: body                  !! name of a body; '': on a side
    integer  :: edge = 0                               !! of this body; 0: all of them
    integer  :: axis = 0                               !! of the normal, 1: x, 2: y; 0: no single
                                                       !! one; no key
    real(wp), allocatable :: span(:)                   !! from, to [m]; size 0: the whole side
    real(wp) :: velocity(2) = 0.0_wp                   !! [m/s]
    real(wp), allocatable :: times(:)                  !! [s]; size 0: no table
    real(wp), allocatable :: velocities_x(:), velocities_y(:)   !! [m/s]; size 0: zero
    real(wp) :: velocity_gradient(4) = 0.0_wp          !! xx, xy, yx, yy [1/s]
    real(wp), allocatable :: factors(:)                !! size 0: 1 at all times
    real(wp), allocatable :: traction(:)               !! x, y [Pa]; size 0: motion prescribed
    real(wp) :: ramp_time = 0.0_wp                     !! of the traction [s]
    real(wp) :: traction_until = unset                 !! motion from then on [s]; unset: never
  contains
    procedure :: visit => visit_boundary
  end type boundary_input_t

  type :: pressure_input_t
    character(:), allocatable :: name, side
    character(:), allocatable :: body                  !! name of a body; '': on a side
    integer  :: edge = 0                               !! of this body; 0: all of them
    real(wp), allocatable :: span(:)                   !! from, to [m]; size 0: the whole side
    real(wp) :: value = unset                          !! [Pa]
    real(wp) :: ramp_time = 0.0_wp                     !! [s]
  contains
    procedure :: visit => visit_pressure
  end type pressure_input_t

contains

  subroutine visit_boundary(self, visitor)
    class(boundary_input_t), intent(inout) :: self
    class(key_visitor_t),    intent(inout) :: visitor
    character(*), parameter :: ramp = 'time in which it rises linearly from 0; 0: whole at once'

    call visitor%group(group_key_t('boundary', repeats=.true., &
      meaning='points of prescribed motion, and platens under a load'))
    call visitor%text_key(key_t('name', required=.true., is_name=.true., also='each name once', &
      meaning='name in the results, and in the file of a point cloud'), self%name)
    call visitor%text_key(key_t('side', stands_for='none', choices='bottom top left right all', &
      also='on a lattice this or body; each side or span once, all alone; not all for a cloud', &
      meaning='side of the body beyond which the layers of points lie; for a cloud the side ' &
      //'that the boundary stands for'), self%side)
    call visitor%list_key(key_t('span', count=2, unit='m', stands_for='the whole side', &
      also='increasing, within the side; only with side; not with traction, not all, no cloud', &
      meaning='part of the side, as of a footing: from, to, in the coordinate along it; the ' &
      //'layers hold the points strictly inside'), self%span)
    call visitor%text_key(key_t('body', is_name=.true., stands_for='none', &
      also='name of a body; in place of side', &
      meaning='body beyond whose edges the layers lie: outside of a solid, inside of a hole'), &
      self%body)
    call visitor%integer_key(key_t('edge', unit='1', range=range_t(lower=1.0_wp), &
      stands_for='all edges of the body', needs_effect=.true., &
      also='only with body; not for a circle; each edge once', &
      meaning='number of the edge: that of the vertex it begins at; of a rectangle 1: bottom, ' &
      //'2: right, 3: top, 4: left'), self%edge)
    call visitor%text_key(key_t('contact', default='rough', choices='rough smooth affine', &
      also='smooth needs one side, or one edge along an axis', &
      meaning='rough: both components of the motion prescribed; smooth: only the one across ' &
      //'the side; affine: the motion of a homogeneous deformation'), self%contact)
    call visitor%vector_key(key_t('velocity', count=2, unit='m/s', default='0.0, 0.0', &
      needs_effect=.true., &
      also='smooth: 0 along the side; not with times, traction or affine', &
      meaning='constant velocity, x and y'), self%velocity)
    call visitor%list_key(key_t('times', count=any_count, unit='s', stands_for='none', &
      range=not_negative, also='increasing', meaning='times of the tables below'), self%times)
    call visitor%list_key(key_t('velocities_x', count=any_count, unit='m/s', stands_for='zero', &
      also='as many as times; not with affine', meaning='velocity along x at these times'), &
      self%velocities_x)
    call visitor%list_key(key_t('velocities_y', count=any_count, unit='m/s', stands_for='zero', &
      also='as many as times; not with affine', meaning='velocity along y at these times'), &
      self%velocities_y)
    call visitor%vector_key(key_t('velocity_gradient', count=4, unit='1/s', &
      stands_for='none', needs_effect=.true., also='needed for affine, else not allowed', &
      meaning='L of the velocity L x, in the order xx, xy, yx, yy'), self%velocity_gradient)
    call visitor%list_key(key_t('factors', count=any_count, unit='1', &
      stands_for='1 at all times', also='as many as times; only with affine', &
      meaning='factors on velocity_gradient at these times'), self%factors)
    call visitor%list_key(key_t('traction', count=2, unit='Pa', stands_for='none', &
      also='in place of a motion, or before it: traction_until; smooth: 0 along the side; ' &
      //'a whole side only, not affine', &
      meaning='force per area that acts on the platen from outside, x and y: the platen moves ' &
      //'under it and stays plane'), self%traction)
    call visitor%real_key(key_t('ramp_time', unit='s', default='0.0', range=not_negative, &
      needs_effect=.true., also='only with traction', meaning=ramp), self%ramp_time)
    call visitor%real_key(key_t('traction_until', unit='s', stands_for='the end of the run', &
      range=positive, also='only with traction; not before its ramp_time; within the run', &
      meaning='time at which the traction ends: from then on the boundary is moved, by ' &
      //'velocity or the tables, from where it is'), self%traction_until)
  end subroutine visit_boundary

  subroutine visit_pressure(self, visitor)
    class(pressure_input_t), intent(inout) :: self
    class(key_visitor_t),    intent(inout) :: visitor
    character(*), parameter :: ramp = 'time in which it rises linearly from 0; 0: whole at once'

    call visitor%group(group_key_t('pressure', repeats=.true., &
      meaning='a load on a side without boundary, or on edges of a body'))
    call visitor%text_key(key_t('name', required=.true., is_name=.true., also='each name once', &
      meaning='name in the log and in the values of the results'), self%name)
    call visitor%text_key(key_t('side', stands_for='none', choices='bottom top left right', &
      also='this or body; a side without a boundary; not for a cloud', &
      meaning='side of the body that the pressure acts on'), self%side)
    call visitor%text_key(key_t('body', is_name=.true., stands_for='none', &
      also='name of a body; in place of side', &
      meaning='body on whose edges the pressure acts, where they are surface; of a hole the rim'), &
      self%body)
    call visitor%integer_key(key_t('edge', unit='1', range=range_t(lower=1.0_wp), &
      stands_for='all edges of the body', needs_effect=.true., &
      also='only with body; not for a circle', &
      meaning='number of the edge: that of the vertex it begins at; of a rectangle 1: bottom, ' &
      //'2: right, 3: top, 4: left'), self%edge)
    call visitor%list_key(key_t('span', count=2, unit='m', stands_for='the whole side or edge', &
      also='increasing, within the side; with body only on one edge', &
      meaning='part of the side: from, to, in the coordinate along it; of an edge: from its ' &
      //'first vertex'), self%span)
    call visitor%real_key(key_t('value', unit='Pa', required=.true., &
      meaning='the pressure; positive: it pushes on the body'), self%value)
    call visitor%real_key(key_t('ramp_time', unit='s', default='0.0', range=not_negative, &
      meaning=ramp), self%ramp_time)
  end subroutine visit_pressure

end module pd_load_keys
