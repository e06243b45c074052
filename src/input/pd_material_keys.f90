!> Groups of the input file: materials, and what varies from point to point.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_material_keys
  use pd_keys, only: group_key_t, key_t, key_visitor_t, not_negative, positive, range_t
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: material_input_t, imperfection_input_t, random_field_input_t

  character(*), parameter :: default_material = 'material'   !! name of a material without one

  type :: material_input_t
    character(:), allocatable :: name, model, strain_measure
    real(wp) :: density = unset                        !! [kg/m^3]
    real(wp) :: youngs_modulus = unset                 !! [Pa]
    real(wp) :: poissons_ratio = unset
    real(wp) :: yield_stress = unset                   !! [Pa]
    real(wp) :: kinematic_modulus = 0.0_wp             !! H_k [Pa]
    real(wp) :: isotropic_modulus = 0.0_wp             !! H_i [Pa]
    real(wp) :: residual_strength = unset              !! sigma_r [Pa]
    real(wp) :: youngs_modulus_gradient = 0.0_wp       !! with depth [Pa/m]
    real(wp) :: yield_stress_gradient = 0.0_wp         !! with depth [Pa/m]
    real(wp) :: reference_y = unset                    !! [m]; unset: top of the body
  contains
    procedure :: visit => visit_material
  end type material_input_t

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

contains

  subroutine visit_material(self, visitor)
    class(material_input_t), intent(inout) :: self
    class(key_visitor_t),    intent(inout) :: visitor

    call visitor%group(group_key_t('material', required=.true., repeats=.true., &
      meaning='the constitutive law'))
    call visitor%text_key(key_t('name', is_name=.true., default=default_material, &
      also='needed where there are several materials, each name once', &
      meaning='name by which a body asks for the material'), self%name)
    call visitor%text_key(key_t('model', required=.true., choices='elastic j2', &
      meaning='elastic, or von Mises plasticity with hardening or softening'), self%model)
    call visitor%text_key(key_t('strain_measure', default='logarithmic', &
      choices='green_lagrange logarithmic small', meaning='strain in which the law is written: ' &
      //'logarithmic for any use, small to compare with limit theorems, green_lagrange to ' &
      //'compare with the paper'), self%strain_measure)
    call visitor%real_key(key_t('density', unit='kg/m^3', required=.true., range=positive, &
      meaning='mass per volume'), self%density)
    call visitor%real_key(key_t('youngs_modulus', unit='Pa', required=.true., range=positive, &
      meaning='Young''s modulus, E'), self%youngs_modulus)
    call visitor%real_key(key_t('poissons_ratio', unit='1', required=.true., &
      range=range_t(-1.0_wp, 0.5_wp, .true., .true.), meaning='Poisson''s ratio'), &
      self%poissons_ratio)
    call visitor%real_key(key_t('yield_stress', unit='Pa', range=positive, also='needed for j2', &
      meaning='initial yield stress in a uniaxial test, sigma_y'), self%yield_stress)
    call visitor%real_key(key_t('kinematic_modulus', unit='Pa', default='0.0', &
      also='3 G + H_k + H_i > 0; where both are negative also 3 G + H_i + min(H_k, H_i) > 0', &
      meaning='slope of stress against plastic strain due to the back stress, H_k; negative: ' &
      //'softening, which makes the material stronger backwards, up to 2 sigma_y - sigma_r: ' &
      //'for loading that is not monotonic take isotropic_modulus'), self%kinematic_modulus)
    call visitor%real_key(key_t('isotropic_modulus', unit='Pa', default='0.0', &
      also='as kinematic_modulus', &
      meaning='slope of the yield stress against plastic strain, H_i; negative: softening, the ' &
      //'same in all directions'), &
      self%isotropic_modulus)
    call visitor%real_key(key_t('residual_strength', unit='Pa', range=not_negative, &
      also='at most yield_stress; needed for j2 with a negative modulus', &
      meaning='strength at which softening stops, sigma_r, in every direction in which the ' &
      //'material goes on flowing; without effect on hardening'), &
      self%residual_strength)
    call visitor%real_key(key_t('youngs_modulus_gradient', unit='Pa/m', default='0.0', &
      also='E above 0 at every point', meaning='growth of E with depth below reference_y; ' &
      //'kinematic_modulus, isotropic_modulus and residual_strength grow in proportion'), &
      self%youngs_modulus_gradient)
    call visitor%real_key(key_t('yield_stress_gradient', unit='Pa/m', default='0.0', &
      also='yield stress above 0 at every point', meaning='growth of the initial yield stress ' &
      //'with depth below reference_y'), self%yield_stress_gradient)
    call visitor%real_key(key_t('reference_y', unit='m', stands_for='the top of the body', &
      needs_effect=.true., also='only with a gradient', meaning='height at which youngs_modulus ' &
      //'and yield_stress hold; they stay the same above it'), self%reference_y)
  end subroutine visit_material

  subroutine visit_imperfection(self, visitor)
    class(imperfection_input_t), intent(inout) :: self
    class(key_visitor_t),        intent(inout) :: visitor
    character(*), parameter :: needed = 'needed where amplitude is above 0'

    call visitor%group(group_key_t('imperfection', meaning='a weak patch that seeds a shear band'))
    call visitor%real_key(key_t('amplitude', unit='1', default='0.0', &
      range=range_t(0.0_wp, 1.0_wp, .false., .true.), &
      also='(1 - amplitude) yield_stress not below residual_strength', &
      meaning='relative reduction of the initial yield stress in the patch'), self%amplitude)
    call visitor%real_key(key_t('x', unit='m', default='0.0', stands_for='none', also=needed, &
      meaning='centre of the patch'), self%x)
    call visitor%real_key(key_t('y', unit='m', default='0.0', stands_for='none', also=needed, &
      meaning='centre of the patch'), self%y)
    call visitor%real_key(key_t('radius', unit='m', default='0.0', stands_for='none', &
      range=not_negative, also='above 0 where amplitude is', &
      meaning='radius of the patch'), self%radius)
  end subroutine visit_imperfection

  subroutine visit_random_field(self, visitor)
    class(random_field_input_t), intent(inout) :: self
    class(key_visitor_t),        intent(inout) :: visitor

    call visitor%group(group_key_t('random_field', meaning='a yield stress that varies'))
    call visitor%real_key(key_t('coefficient_of_variation', unit='1', required=.true., &
      range=positive, &
      meaning='standard deviation of the yield stress over its mean, yield_stress'), &
      self%coefficient_of_variation)
    call visitor%real_key(key_t('correlation_length', unit='m', required=.true., range=positive, &
      also='a warning where it is below 2 spacing', &
      meaning='distance at which the correlation has fallen to 1/e'), self%correlation_length)
    call visitor%integer_key(key_t('seed', unit='1', default='1', range=not_negative, &
      also='at most nine digits', meaning='number of the soil: each seed gives another one'), &
      self%seed)
  end subroutine visit_random_field

end module pd_material_keys
