!> Groups of the input file: the ground under its own weight, and what is followed in it.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_ground_keys
  use pd_keys, only: group_key_t, key_t, key_visitor_t, not_negative
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: gravity_input_t, initial_stress_input_t, probe_input_t

  type :: gravity_input_t
    real(wp), allocatable :: acceleration(:)           !! x, y [m/s^2]; size 0: no gravity
    real(wp) :: ramp_time = 0.0_wp                     !! [s]
  contains
    procedure :: visit => visit_gravity
  end type gravity_input_t

  type :: initial_stress_input_t
    real(wp) :: surface_y = unset                      !! [m]; unset: top of the body
    real(wp) :: unit_weight = unset                    !! [N/m^3]
    real(wp) :: k0 = unset                             !! unset: no initial stress
    real(wp) :: surcharge = 0.0_wp                     !! [Pa]
  contains
    procedure :: visit => visit_initial_stress
  end type initial_stress_input_t

  type :: probe_input_t
    character(:), allocatable :: name
    real(wp) :: x = unset, y = unset                   !! [m]
  contains
    procedure :: visit => visit_probe
  end type probe_input_t

contains

  subroutine visit_gravity(self, visitor)
    class(gravity_input_t), intent(inout) :: self
    class(key_visitor_t),   intent(inout) :: visitor

    call visitor%group(group_key_t('gravity', meaning='weight of all points'))
    call visitor%list_key(key_t('acceleration', count=2, unit='m/s^2', required=.true., &
      also='not 0; with an initial stress 0 along x and downwards along y', &
      meaning='acceleration of gravity, x and y; points of boundaries have weight only where '// &
      'they slide, bearings none'), self%acceleration)
    call visitor%real_key(key_t('ramp_time', unit='s', default='0.0', range=not_negative, &
      needs_effect=.true., also='not with an initial stress', &
      meaning='time in which it rises linearly from 0; 0: whole at once'), self%ramp_time)
  end subroutine visit_gravity

  subroutine visit_initial_stress(self, visitor)
    class(initial_stress_input_t), intent(inout) :: self
    class(key_visitor_t),          intent(inout) :: visitor

    call visitor%group(group_key_t('initial_stress', &
      meaning='stress of the ground before anything moves, in equilibrium'))
    call visitor%real_key(key_t('surface_y', unit='m', stands_for='the top of the body', &
      also='not below the top of the body', &
      meaning='height of the surface of the ground'), self%surface_y)
    call visitor%real_key(key_t('unit_weight', unit='N/m^3', required=.true., &
      range=not_negative, also='with &gravity density times its acceleration', &
      meaning='growth of the vertical pressure with depth, gamma'), self%unit_weight)
    call visitor%real_key(key_t('k0', unit='1', required=.true., range=not_negative, &
      meaning='horizontal stresses over the vertical one'), self%k0)
    call visitor%real_key(key_t('surcharge', unit='Pa', default='0.0', range=not_negative, &
      also='above 0 where unit_weight is 0', &
      meaning='vertical pressure at the surface'), self%surcharge)
  end subroutine visit_initial_stress

  subroutine visit_probe(self, visitor)
    class(probe_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%group(group_key_t('probe', repeats=.true., &
      meaning='a point that the history follows'))
    call visitor%text_key(key_t('name', required=.true., is_name=.true., &
      also='each name once, not that of a boundary, not mean or max', &
      meaning='first word of its columns of the history'), self%name)
    call visitor%real_key(key_t('x', unit='m', required=.true., &
      also='a point of the body within a spacing', meaning='where it is'), self%x)
    call visitor%real_key(key_t('y', unit='m', required=.true., &
      also='a point of the body within a spacing', meaning='where it is'), self%y)
  end subroutine visit_probe

end module pd_ground_keys
