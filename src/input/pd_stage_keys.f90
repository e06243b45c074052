!> Groups of the input file: stages of construction, and the search for a factor of safety.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_stage_keys
  use pd_keys, only: group_key_t, key_t, key_visitor_t, positive, range_t
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: stage_input_t, strength_reduction_input_t

  type :: stage_input_t
    character(:), allocatable :: name
    real(wp) :: end_time = unset                       !! [s]
    !> Names that are there, separated by blanks; '': those of the stage before.
    character(:), allocatable :: boundaries, pressures
    character(:), allocatable :: excavate, fill        !! bodies that go, that come; '': none
    character(:), allocatable :: materials             !! 'body=material ...'; '': unchanged
  contains
    procedure :: visit => visit_stage
  end type stage_input_t

  type :: strength_reduction_input_t
    real(wp) :: first = unset                          !! factor that is tried first
    real(wp) :: last = unset                           !! factor beyond which nobody asks
    real(wp) :: tolerance = 0.01_wp                    !! of the factor that is found
  contains
    procedure :: visit => visit_strength_reduction
  end type strength_reduction_input_t

contains

  subroutine visit_stage(self, visitor)
    class(stage_input_t), intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor
    character(*), parameter :: before = 'those of the stage before; in the first all'
    character(*), parameter :: words = 'names, separated by blanks'

    call visitor%group(group_key_t('stage', repeats=.true., &
      meaning='stages of construction, one after the other; what changes at the start of a ' &
      //'stage comes in evenly over it'))
    call visitor%text_key(key_t('name', required=.true., is_name=.true., also='each name once', &
      meaning='name in the log'), self%name)
    call visitor%real_key(key_t('end_time', unit='s', required=.true., range=positive, &
      also='above that of the stage before; that of the last one is the end of the run', &
      meaning='end of the stage'), self%end_time)
    call visitor%text_key(key_t('excavate', stands_for='none', also=words//'; they are there', &
      meaning='bodies that are dug away'), self%excavate)
    call visitor%text_key(key_t('fill', stands_for='none', also=words//'; they are not there', &
      meaning='bodies that are placed, without stress; a body that any stage fills is not there ' &
      //'at the beginning, unless it is dug away first'), self%fill)
    call visitor%text_key(key_t('boundaries', stands_for=before, also=words//', or none', &
      meaning='boundaries that are there; they move from their first stage on'), self%boundaries)
    call visitor%text_key(key_t('pressures', stands_for=before, also=words//', or none', &
      meaning='pressures that act; a ramp_time counts from their first stage on'), self%pressures)
    call visitor%text_key(key_t('materials', stands_for='no change', &
      also='body=material, separated by blanks', &
      meaning='bodies that have another material from now on'), self%materials)
  end subroutine visit_stage

  subroutine visit_strength_reduction(self, visitor)
    class(strength_reduction_input_t), intent(inout) :: self
    class(key_visitor_t),              intent(inout) :: visitor

    call visitor%group(group_key_t('strength_reduction', &
      meaning='factor of safety at the end of the run: the largest number by which the strength ' &
      //'can be divided'))
    call visitor%real_key(key_t('first', unit='1', required=.true., range=positive, &
      meaning='factor that is tried first; the body must bear it'), &
      self%first)
    call visitor%real_key(key_t('last', unit='1', required=.true., range=positive, &
      also='above first', meaning='largest factor that is asked for'), &
      self%last)
    call visitor%real_key(key_t('tolerance', unit='1', default='0.01', &
      range=range_t(1.0e-4_wp, 1.0_wp), &
      meaning='uncertainty of the factor that is found'), self%tolerance)
  end subroutine visit_strength_reduction

end module pd_stage_keys
