!> Groups of the input file: the control, the time step and the end.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_motion_keys
  use pd_keys, only: group_key_t, key_t, key_visitor_t, not_negative, positive, range_t
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: stabilisation_input_t, integration_input_t

  real(wp), parameter :: most_increments = 1.0e7_wp

  type :: stabilisation_input_t
    character(:), allocatable :: method
    real(wp) :: factor = 0.0_wp
    real(wp) :: relaxing_stiffness = 0.5_wp            !! kappa
    real(wp) :: relaxing_strain = 1.0e-4_wp            !! beta
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
    character(:), allocatable :: method
    real(wp) :: residual = 1.0e-4_wp
    integer  :: increments = 200
    character(:), allocatable :: relaxation
  contains
    procedure :: visit => visit_integration
  end type integration_input_t

contains

  subroutine visit_stabilisation(self, visitor)
    class(stabilisation_input_t), intent(inout) :: self
    class(key_visitor_t),         intent(inout) :: visitor

    call visitor%group(group_key_t('stabilisation', meaning='control of zero-energy modes'))
    call visitor%text_key(key_t('method', default='relaxing', choices='none silling relaxing', &
      meaning='none; silling: the control of Silling (2017); relaxing: a control that lets go ' &
      //'where the material flows'), self%method)
    call visitor%real_key(key_t('factor', unit='1', default='0.0', range=not_negative, &
      also='above 0 for silling, else 0', meaning='strength of the control, g'), self%factor)
    call visitor%real_key(key_t('relaxing_stiffness', unit='1', default='0.5', range=positive, &
      needs_effect=.true., also='only for relaxing', &
      meaning='stiffness of the control over E / horizon^2, kappa'), self%relaxing_stiffness)
    call visitor%real_key(key_t('relaxing_strain', unit='1', default='1.0e-4', range=positive, &
      needs_effect=.true., also='only for relaxing', &
      meaning='how slowly the control lets go, beta: plastic strain in strains ' &
      //'strength / (kappa E) at which half is left'), self%relaxing_strain)
  end subroutine visit_stabilisation

  subroutine visit_integration(self, visitor)
    class(integration_input_t), intent(inout) :: self
    class(key_visitor_t),       intent(inout) :: visitor

    call visitor%group(group_key_t('integration', required=.true., &
      meaning='end of the run, time step and damping'))
    call visitor%real_key(key_t('end_time', unit='s', range=positive, &
      also='this or final_strain, never both', meaning='end of the run'), self%end_time)
    call visitor%real_key(key_t('final_strain', unit='1', &
      range=range_t(0.0_wp, 1.0_wp, .true., .true.), also='only with platens; no per cent', &
      meaning='nominal strain at which the run ends'), &
      self%final_strain)
    call visitor%text_key(key_t('time_step_rule', default='spectral', needs_effect=.true., &
      choices='courant spectral fixed', also='not at equilibrium', &
      meaning='courant: safety * spacing / c_p; spectral: safety * 2 / (largest frequency); ' &
      //'fixed: time_step'), self%time_step_rule)
    call visitor%real_key(key_t('time_step', unit='s', range=positive, &
      also='needed for the rule fixed, else not allowed', meaning='the time step'), &
      self%time_step)
    call visitor%real_key(key_t('safety', unit='1', default='0.9', needs_effect=.true., &
      range=range_t(0.0_wp, 10.0_wp, .true., .false.), &
      also='below 1 for the rule spectral; not with fixed or at equilibrium', &
      meaning='factor on the time step of the rule'), self%safety)
    call visitor%real_key(key_t('damping', unit='kg/(m^3 s)', default='0.0', range=not_negative, &
      needs_effect=.true., also='not at equilibrium', &
      meaning='force per volume and velocity against the motion, C'), self%damping)
    call visitor%text_key(key_t('damping_frame', default='rest', choices='rest platens', &
      needs_effect=.true., also='platens: only with platens; not at equilibrium', &
      meaning='rest: damping against rest, the body starts at rest; platens: against the ' &
      //'affine velocity between the platens, with which the body also starts'), &
      self%damping_frame)
    call visitor%text_key(key_t('method', default='verlet', choices='verlet equilibrium', &
      meaning='verlet: motion in time; equilibrium: increments of load and motion, each ' &
      //'brought to rest'), self%method)
    call visitor%real_key(key_t('residual', unit='1', default='1.0e-4', needs_effect=.true., &
      range=range_t(0.0_wp, 1.0_wp, .true., .true.), also='only for equilibrium', &
      meaning='unbalanced force at rest, over reactions and loads'), self%residual)
    call visitor%integer_key(key_t('increments', unit='1', default='200', needs_effect=.true., &
      range=range_t(1.0_wp, most_increments), also='only for equilibrium', &
      meaning='of the run, where none is hard; shorter ones follow where they are'), &
      self%increments)
    call visitor%text_key(key_t('relaxation', default='adaptive', needs_effect=.true., &
      choices='adaptive kinetic local accelerated', also='only for equilibrium', &
      meaning='way to rest: adaptive dynamic relaxation, kinetic damping, local damping, ' &
      //'accelerated gradient'), self%relaxation)
  end subroutine visit_integration

end module pd_motion_keys
