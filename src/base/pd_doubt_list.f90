!> Doubts: what makes the numbers of a run questionable without being an error.
!>
!> The kinds stand here once: name, when they are looked for, the threshold, and what is looked at.
!> Each is told on the screen and in the log, and stands in the result file; `perigeo --doubts`
!> prints the table, which doc/doubts.md shows.
module pd_doubt_list
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_text, only: short_number
  implicit none
  private

  public :: doubt_kind_t, doubt_kinds, doubts_t, is_doubtful, kind_number, never
  public :: where_to_read, write_doubt_table

  character(*), parameter :: where_to_read = 'what was warned of: doc/doubts.md; how far ' &
    //'numbers can be trusted: doc/limits.md'

  !> One kind of doubt.
  type :: doubt_kind_t
    character(20)  :: name
    character(5)   :: told                     !! 'start': by --check too; 'run'
    character(200) :: meaning                  !! what is looked at
    real(wp) :: lower = -huge(1.0_wp)          !! doubtful below
    real(wp) :: upper = huge(1.0_wp)           !! doubtful above
  end type doubt_kind_t

  integer, parameter :: never = -1

  type(doubt_kind_t), parameter :: doubt_kinds(*) = [ &
    doubt_kind_t('few_points', 'start', 'points of the body', lower=50.0_wp), &
    doubt_kind_t('horizon_ratio', 'start', 'horizon over spacing, m', lower=2.0_wp), &
    doubt_kind_t('wave_speed', 'start', 'speed of waves, c_p [m/s]', 10.0_wp, 1.0e4_wp), &
    doubt_kind_t('density', 'start', 'density of a material [kg/m^3]', lower=100.0_wp), &
    doubt_kind_t('yield_strain', 'start', 'strain at yield, yield_stress / youngs_modulus', &
    1.0e-5_wp, 0.1_wp), &
    doubt_kind_t('perfect_plasticity', 'start', 'kinematic_modulus or isotropic_modulus, the '// &
    'larger in magnitude, over the yield stress, with Green-Lagrange strain', lower=1.0_wp), &
    doubt_kind_t('variation', 'start', 'coefficient of variation of the random field', &
    upper=1.0_wp), &
    doubt_kind_t('field_resolution', 'start', 'correlation length of the random field over the '// &
    'spacing', lower=2.0_wp), &
    doubt_kind_t('final_strain', 'start', 'nominal strain at the end of the run', upper=0.3_wp), &
    doubt_kind_t('few_steps', 'start', 'steps of the whole run, where it is a motion', &
    lower=100.0_wp), &
    doubt_kind_t('fast_boundary', 'start', 'way of a boundary in one step of a motion, over '// &
    'the smaller extent of the body', upper=1.0e-3_wp), &
    doubt_kind_t('unstable_step', 'start', 'time step of the rules fixed and courant over the '// &
    'stable one, 2/omega_max', upper=1.0_wp), &
    doubt_kind_t('unfinished_ramp', 'start', 'end of a ramp or table over the end of the run', &
    upper=1.0_wp), &
    doubt_kind_t('body_adjusted', 'start', 'extents of the body that were moved to the lattice'), &
    doubt_kind_t('unused_material', 'start', 'a material that no point has'), &
    doubt_kind_t('thin_body', 'start', 'horizons between a pressure and what holds the body', &
    lower=1.5_wp), &
    doubt_kind_t('free_wall', 'start', 'a side without boundary, under initial stress'), &
    doubt_kind_t('cloud_control', 'start', 'a cloud of points without a control of zero-energy '// &
    'modes'), &
    doubt_kind_t('cloud_weights', 'start', 'force that a homogeneous stress leaves inside a '// &
    'cloud, over that at a surface', upper=1.0e-6_wp), &
    doubt_kind_t('cloud_volume', 'start', 'volume of the fullest family of a cloud over that '// &
    'of the whole disc, weighted with the influence function', 0.5_wp, 2.0_wp), &
    doubt_kind_t('cloud_extents', 'start', 'spacings from the extents given for a cloud to its '// &
    'outermost points', upper=1.5_wp), &
    doubt_kind_t('older_checkpoint', 'start', 'a restart from the checkpoint before the newest'), &
    doubt_kind_t('energy_balance', 'run', 'what the balance of energies lacks over the work, '// &
    'in magnitude; at equilibrium after the first fifth of the run', upper=0.01_wp), &
    doubt_kind_t('control_work', 'run', 'energy of the zero-energy control over the work; at '// &
    'equilibrium after the first fifth of the run', &
    upper=0.01_wp), &
    doubt_kind_t('zero_energy', 'run', 'zero-energy part of the deformation over the strain, '// &
    'rms of both at the points in whose family nothing has flowed, at frames', upper=3.0_wp), &
    doubt_kind_t('damping_share', 'run', 'forces of the damping over reactions and loads, '// &
    'after the first fifth of the run', upper=0.05_wp), &
    doubt_kind_t('kinetic_ratio', 'run', 'kinetic over internal energy of a damped motion, '// &
    'after the first fifth of the run', upper=0.05_wp), &
    doubt_kind_t('reaction_gap', 'run', 'sum of the normal forces of the platens, where they '// &
    'alone act on the body, over the largest so far, after the first fifth of the run', &
    upper=0.05_wp), &
    doubt_kind_t('stress_strain', 'run', 'mean stress times mean strain over the smallest '// &
    'yield stress of a material with Green-Lagrange strain', upper=0.02_wp), &
    doubt_kind_t('flow_reversal', 'run', 'heat of flow against the back stress over all '// &
    'plastic heat, where kinematic_modulus is negative', upper=0.05_wp), &
    doubt_kind_t('long_step', 'run', 'fixed time step over the stable one of the deformed body', &
    upper=1.0_wp), &
    doubt_kind_t('no_rest', 'run', 'an equilibrium increment that was taken before it was at '// &
    'rest: its unbalanced force'), &
    doubt_kind_t('overshoot', 'run', 'nominal strain at the end of the run over final_strain', &
    upper=1.01_wp)]

  !> The doubts of a run. The first of each kind is kept with its number; the words of all.
  type :: doubts_t
    integer  :: step(size(doubt_kinds)) = never     !! at which it was told; 0: at the start
    real(wp) :: value(size(doubt_kinds)) = 0.0_wp   !! what was found then
    type(error_list_t), private :: words
  contains
    procedure :: add
    procedure :: note
    procedure :: is_told
    procedure :: any_told
    procedure :: count => number_of_messages
    procedure :: message
    procedure :: print => print_messages
  end type doubts_t

contains

  !> Number of the kind of this name; 0: there is none.
  pure integer function kind_number(name) result(k)
    character(*), intent(in) :: name

    do k = size(doubt_kinds), 1, -1
      if (doubt_kinds(k)%name == name) return
    end do
  end function kind_number

  !> Write the table of all kinds as Markdown.
  subroutine write_doubt_table(unit)
    integer, intent(in) :: unit   !! open for formatted writing
    integer :: k

    write (unit, '(a)') '| doubt | told | doubtful | what is looked at |', '|---|---|---|---|'
    do k = 1, size(doubt_kinds)
      write (unit, '(a)') '| `'//trim(doubt_kinds(k)%name)//'` | '//trim(doubt_kinds(k)%told)// &
        ' | '//threshold_text(doubt_kinds(k)%lower, doubt_kinds(k)%upper)//' | '// &
        trim(doubt_kinds(k)%meaning)//' |'
    end do
  end subroutine write_doubt_table

  !> A threshold in words.
  pure function threshold_text(lower, upper) result(text)
    real(wp), intent(in) :: lower, upper
    character(:), allocatable :: text

    text = 'always'
    if (upper < huge(1.0_wp)) text = 'above '//short_number(upper)
    if (lower > -huge(1.0_wp)) then
      text = 'below '//short_number(lower)
      if (upper < huge(1.0_wp)) text = text//', above '//short_number(upper)
    end if
  end function threshold_text

  !> Whether a value is beyond the threshold of the kind of this name; what is not a number is not.
  pure logical function is_doubtful(name, value)
    character(*), intent(in) :: name
    real(wp),     intent(in) :: value

    integer :: k

    is_doubtful = .false.
    if (ieee_is_nan(value)) return
    k = kind_number(name)
    is_doubtful = value < doubt_kinds(k)%lower .or. value > doubt_kinds(k)%upper
  end function is_doubtful

  !> Take in a doubt, with words for it; its name goes with them.
  pure subroutine add(self, name, value, what, where)
    class(doubts_t), intent(inout) :: self
    character(*),    intent(in)    :: name    !! of the kind
    real(wp),        intent(in)    :: value   !! that was found; 0 for kinds without a number
    character(*),    intent(in)    :: what
    character(*),    intent(in), optional :: where

    call self%note(name, value, 0)
    call self%words%add(what//' ['//name//']', where)
  end subroutine add

  !> Keep the number of a doubt, the first of its kind.
  pure subroutine note(self, name, value, step)
    class(doubts_t), intent(inout) :: self
    character(*),    intent(in)    :: name
    real(wp),        intent(in)    :: value
    integer,         intent(in)    :: step
    integer :: k

    k = kind_number(name)
    if (k == 0) return
    if (self%step(k) /= never) return
    self%step(k) = step
    self%value(k) = value
  end subroutine note

  !> Whether a doubt of this kind has been told.
  pure logical function is_told(self, name)
    class(doubts_t), intent(in) :: self
    character(*),    intent(in) :: name

    is_told = self%step(kind_number(name)) /= never
  end function is_told

  !> Whether any doubt was told.
  pure logical function any_told(self)
    class(doubts_t), intent(in) :: self

    any_told = any(self%step /= never)
  end function any_told

  !> How many doubts there are in words.
  pure integer function number_of_messages(self) result(n)
    class(doubts_t), intent(in) :: self

    n = self%words%count()
  end function number_of_messages

  !> Words of doubt i, 1 <= i <= count.
  pure function message(self, i) result(text)
    class(doubts_t), intent(in) :: self
    integer,         intent(in) :: i
    character(:), allocatable :: text

    text = self%words%message(i)
  end function message

  !> Print one doubt per line: 'perigeo: warning: ...', and where to read on.
  subroutine print_messages(self, unit)
    class(doubts_t), intent(in) :: self
    integer,         intent(in) :: unit

    call self%words%print(unit, 'warning')
    if (self%count() > 0) write (unit, '(a)') where_to_read
  end subroutine print_messages

end module pd_doubt_list
