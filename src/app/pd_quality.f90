!> How far the numbers of a run can be trusted, as it is at a moment: a handful of ratios, all small
!> in a good quasi-static run (and det F near 1).
!>
!> Doubts compare them with their thresholds as the run goes on; a line near the end of the log,
!> and the result file, tell them as they are at the end.
!> Source: doc/doubts.md; doc/theory.md, section 10.
module pd_quality
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  use pd_doubt_list, only: where_to_read
  use pd_errors, only: error_list_t
  use pd_kinds, only: wp
  use pd_observe, only: imbalance, over_work
  use pd_platens, only: press_along
  use pd_record, only: record_line, record_quality
  use pd_run, only: run_t
  use pd_text, only: short_number
  use pd_trust, only: quality_t
  use pd_zero_energy, only: zero_energy_ratio
  implicit none
  private

  public :: find_reaction_gap, kinetic_ratio, stress_times_strain, tell_quality

contains

  !> Kinetic over internal energy (stored and dissipated by flow); 0 at equilibrium, and before
  !> anything has been strained.
  real(wp) function kinetic_ratio(run) result(ratio)
    type(run_t), intent(in) :: run
    real(wp) :: internal

    ratio = 0.0_wp
    associate (seen => run%record%seen)
      internal = seen%value('strain_energy') + seen%value('plastic_dissipation')
      if (internal > 0.0_wp) ratio = seen%value('kinetic_energy') / internal
    end associate
  end function kinetic_ratio

  !> Sum of the normal forces of the platens over the largest of either so far (which is kept); 0
  !> where something else acts on the body too, nothing does, or they only slide past each other.
  subroutine find_reaction_gap(run, gap)
    type(run_t), intent(inout) :: run
    real(wp),    intent(out)   :: gap
    real(wp) :: forces(2)
    integer  :: k

    gap = 0.0_wp
    associate (platens => run%model%platens, items => run%model%supports%items)
      if (.not. press_along(platens) .or. run%model%loads%count() > 0) return
      do k = 1, size(items)
        if (allocated(items(k)%support%load_kind)) return
      end do
      forces = [items(platens%first)%support%force(platens%axis), &
        items(platens%second)%support%force(platens%axis)]
    end associate
    run%largest_reaction = max(run%largest_reaction, maxval(abs(forces)))
    if (run%largest_reaction > 0.0_wp) gap = abs(sum(forces)) / run%largest_reaction
  end subroutine find_reaction_gap

  !> Mean stress times mean strain over the smallest yield stress of a material with Green-Lagrange
  !> strain; 0 without such a material.
  real(wp) function stress_times_strain(run) result(product)
    type(run_t), intent(in) :: run
    real(wp) :: yield_stress, strain
    integer  :: k

    product = 0.0_wp
    yield_stress = huge(1.0_wp)
    do k = 1, size(run%input%materials)
      associate (given => run%input%materials(k))
        if (given%model == 'j2' .and. given%strain_measure == 'green_lagrange' .and. &
          run%model%materials%is_used(k)) yield_stress = min(yield_stress, given%yield_stress)
      end associate
    end do
    if (yield_stress >= huge(1.0_wp)) return
    associate (seen => run%record%seen)
      strain = max(abs(seen%value('mean_strain_yy')), abs(run%record%moment%strain))
      product = 0.5_wp * abs(seen%value('mean_stress_xx') + seen%value('mean_stress_yy')) &
        * strain / yield_stress
    end associate
  end function stress_times_strain

  !> All of them, of the moment that was looked at last; what does not apply is not a number.
  subroutine find_quality(run, failed, quality)
    type(run_t),     intent(inout) :: run
    logical,         intent(in)    :: failed
    type(quality_t), intent(out)   :: quality
    real(wp) :: nan

    nan = ieee_value(1.0_wp, ieee_quiet_nan)
    associate (seen => run%record%seen, ledger => run%ledger)
      quality%energy_error = imbalance(seen, ledger)
      quality%min_det_f = seen%value('min_det_f')
      quality%kinetic_ratio = nan
      quality%damping_share = nan
      if (.not. run%model%at_equilibrium) then
        quality%kinetic_ratio = kinetic_ratio(run)
        if (run%model%damping > 0.0_wp) quality%damping_share = seen%value('damping_share')
      end if
      quality%reaction_gap = nan
      if (press_along(run%model%platens) .and. run%model%loads%count() == 0) &
        call find_reaction_gap(run, quality%reaction_gap)
      quality%control_share = nan
      if (run%input%stabilisation%method /= 'none') &
        quality%control_share = over_work(seen%value('stabilisation_energy'), ledger)
      quality%zero_energy = nan
      if (.not. failed) quality%zero_energy = zero_energy_ratio(run%model, run%state)
    end associate
  end subroutine find_quality

  !> Tell the quality in a line, and write it into the result file: that of the present state, or as
  !> it was at the last row of a run that has failed, whose state has no zero-energy part to speak
  !> of. Where there were warnings, tell what to read.
  subroutine tell_quality(run, when, failed, errors)
    type(run_t),        intent(inout) :: run
    character(*),       intent(in)    :: when     !! this is, in words
    logical,            intent(in)    :: failed
    type(error_list_t), intent(inout) :: errors
    type(quality_t) :: quality
    character(:), allocatable :: line

    call find_quality(run, failed, quality)
    line = 'quality '//when//': '
    call append('energy error', quality%energy_error, percent=.true.)
    call append('kinetic over internal energy', quality%kinetic_ratio, percent=.true.)
    call append('reactions apart by', quality%reaction_gap, percent=.true.)
    call append('damping', quality%damping_share, percent=.true.)
    call append('control', quality%control_share, percent=.true.)
    call append('smallest det F', quality%min_det_f, percent=.false.)
    call append('zero-energy over strain', quality%zero_energy, percent=.false.)
    call record_line(run%record, line, errors)
    if (run%doubts%any_told()) call record_line(run%record, where_to_read, errors)
    call record_quality(run%record, quality, errors)

  contains

    subroutine append(what, value, percent)
      character(*), intent(in) :: what
      real(wp),     intent(in) :: value
      logical,      intent(in) :: percent
      real(wp), parameter :: most = 1.0e99_wp   ! beyond, the state is none

      if (.not. ieee_is_finite(value)) return
      if (abs(value) > most) return
      if (line(len(line) - 1:) /= ': ') line = line//', '
      line = line//what//' '
      if (percent) then
        line = line//short_number(100.0_wp * value)//' %'
      else
        line = line//short_number(value)
      end if
    end subroutine append

  end subroutine tell_quality

end module pd_quality
