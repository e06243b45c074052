!> Groups of the input file: the run, its files and what they hold.
!>
!> A key is a component here and a line in the procedure that visits it: nothing else lists it.
module pd_run_keys
  use pd_keys, only: any_count, group_key_t, key_t, key_visitor_t, not_negative, positive, range_t
  use pd_kinds, only: is_set, unset, wp
  implicit none
  private

  public :: run_input_t, output_input_t

  integer, parameter :: max_frames = 100000, max_rows = 1000000
  integer, parameter :: frames_by_default = 10

  type :: run_input_t
    character(:), allocatable :: title, name, output_dir
    character(:), allocatable :: operators              !! auto, lattice or list
  contains
    procedure :: visit => visit_run
    procedure :: complete => complete_run
  end type run_input_t

  type :: output_input_t
    real(wp), allocatable :: frame_strains(:)          !! size 0: not given
    real(wp), allocatable :: frame_times(:)            !! [s]; size 0: not given
    integer  :: frame_count = 0                        !! 0: not given
    integer  :: history_count = 1000
    real(wp) :: checkpoint_every = unset               !! wall seconds; unset: see below
  contains
    procedure :: visit => visit_output
    procedure :: complete => complete_output
    procedure :: checkpoint_due
  end type output_input_t

contains

  subroutine visit_run(self, visitor)
    class(run_input_t),   intent(inout) :: self
    class(key_visitor_t), intent(inout) :: visitor

    call visitor%group(group_key_t('run', required=.true., &
      meaning='names of the run and of its files'))
    call visitor%text_key(key_t('name', required=.true., is_name=.true., &
      meaning='stem of the name of every output file'), self%name)
    call visitor%text_key(key_t('title', stands_for='the name', &
      meaning='title that stands in the results and above figures'), self%title)
    call visitor%text_key(key_t('output_dir', stands_for='`results/<name>`', &
      meaning='folder of the output files, relative to the working directory; created where ' &
      //'it does not exist'), self%output_dir)
    call visitor%text_key(key_t('operators', default='auto', choices='auto lattice list', &
      also='''lattice'': not for a cloud', &
      meaning='form of the non-local operators: ''lattice'' is several times faster and needs ' &
      //'a body on a lattice, ''list'' takes any points, ''auto'' chooses'), self%operators)
  end subroutine visit_run

  !> Defaults that follow from other keys.
  subroutine complete_run(self)
    class(run_input_t), intent(inout) :: self

    if (self%title == '') self%title = self%name
    if (self%output_dir == '') self%output_dir = 'results/'//self%name
  end subroutine complete_run

  subroutine visit_output(self, visitor)
    class(output_input_t), intent(inout) :: self
    class(key_visitor_t),  intent(inout) :: visitor
    character(*), parameter :: one = 'increasing, within the run; only one of the three requests'

    call visitor%group(group_key_t('output', meaning='what is written and when'))
    call visitor%list_key(key_t('frame_strains', count=any_count, unit='1', stands_for='none', &
      range=range_t(0.0_wp, 1.0_wp, .true., .true.), also=one//'; only with platens', &
      meaning='nominal strains at which a frame is written'), self%frame_strains)
    call visitor%list_key(key_t('frame_times', count=any_count, unit='s', stands_for='none', &
      range=positive, also=one, meaning='times at which a frame is written'), self%frame_times)
    call visitor%integer_key(key_t('frame_count', unit='1', &
      stands_for='10 where no frames are asked for', range=range_t(1.0_wp, real(max_frames, wp)), &
      also='only one of the three requests', &
      meaning='number of frames, evenly spread over the run'), self%frame_count)
    call visitor%integer_key(key_t('history_count', unit='1', default='1000', &
      range=range_t(1.0_wp, real(max_rows, wp)), &
      meaning='rows of the history over the run, the unloaded state aside'), self%history_count)
    call visitor%real_key(key_t('checkpoint_every', unit='s', range=not_negative, &
      stands_for='900, or more if a checkpoint takes longer than 9 s; none of the last step', &
      meaning='wall-clock time between checkpoints, the last one of the last step; 0: only when ' &
      //'stopped by a signal'), &
      self%checkpoint_every)
  end subroutine visit_output

  !> Without a request for frames there is a default number of them.
  subroutine complete_output(self)
    class(output_input_t), intent(inout) :: self

    if (size(self%frame_strains) == 0 .and. size(self%frame_times) == 0 &
        .and. self%frame_count == 0) self%frame_count = frames_by_default
  end subroutine complete_output

  !> Whether a checkpoint is due for the clock's sake. Who asks for some gets one of the last step
  !> as well; of a run that says nothing one is kept too, so seldom that it costs less than 1 %.
  pure logical function checkpoint_due(self, seconds, last, cost) result(due)
    class(output_input_t), intent(in) :: self
    real(wp), intent(in) :: seconds   !! since the last checkpoint, or since the run began
    logical,  intent(in) :: last      !! at the last step
    real(wp), intent(in), optional :: cost   !! of the last checkpoint [s]
    real(wp), parameter  :: by_default = 900.0_wp, part = 0.01_wp

    if (is_set(self%checkpoint_every)) then
      due = self%checkpoint_every > 0.0_wp .and. (last .or. seconds >= self%checkpoint_every)
    else
      due = seconds >= by_default
      if (present(cost)) due = due .and. cost <= part * seconds
    end if
  end function checkpoint_due

end module pd_run_keys
