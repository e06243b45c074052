!> The factor of safety: the largest number by which the strength can be divided.
!>
!> Every try begins with the state at the end of the run. The strength of all points is divided by
!> a factor, and the body relaxes under its loads: it comes to rest, or it does not. Halving the
!> interval between a factor that it bears and one that it does not gives the factor of safety.
!> Source: doc/theory.md, section 6.
module pd_strength_reduction
  use pd_agreement, only: signal_of
  use pd_errors, only: error_list_t, exit_file, outcome_t
  use pd_forces, only: forces
  use pd_kinds, only: wp
  use pd_materials, only: material_t
  use pd_record, only: record_frame, record_line, record_tries
  use pd_relaxation, only: keep_start, relax, relaxed_t, return_to_start
  use pd_run, only: run_t
  use pd_run_end, only: fail, fastest_row, stop_by_signal
  use pd_state, only: state_t
  use pd_text, only: integer_text, short_number
  use pd_tries, only: tries_t
  implicit none
  private

  public :: find_factor_of_safety

contains

  !> Find the factor of safety where the input asks for it, and write tries and two frames: the
  !> last equilibrium, and the mechanism of the smallest factor that is not borne.
  !>
  !> Errors: the first factor is not borne already.
  subroutine find_factor_of_safety(run, outcome)
    type(run_t),     intent(inout) :: run
    type(outcome_t), intent(inout) :: outcome
    type(state_t) :: start, held, moving
    type(material_t), allocatable :: unreduced(:)
    type(tries_t) :: tries
    type(error_list_t) :: errors

    if (outcome%done .or. size(run%input%strength_reduction) == 0) return
    start = run%state
    run%whole = .false.   ! the states of the search are none to go on from
    allocate (unreduced, source=run%model%materials%list)
    associate (given => run%input%strength_reduction(1))
      call try(given%first, start, unreduced, run, tries, errors)
      held = run%state
      if (signal_of(run%ranks) == 0) then
        if (.not. tries%held(1)) then
          call fail('the body does not bear the first factor of strength_reduction', &
            fastest_row(run), run, outcome)
          return
        end if
        call try(given%last, start, unreduced, run, tries, errors)
      end if
      moving = run%state
      do while (signal_of(run%ranks) == 0)
        if (tries%held(2) .or. tries%most() - tries%least() <= given%tolerance) exit
        call try(0.5_wp * (tries%least() + tries%most()), start, unreduced, run, tries, errors)
        if (tries%held(tries%n)) held = run%state
        if (.not. tries%held(tries%n)) moving = run%state
      end do
    end associate
    if (signal_of(run%ranks) /= 0) then
      run%state = start
      call stop_by_signal('looks for the factor of safety anew', run, outcome)
      return
    end if
    if (tries%held(2)) held = moving
    run%state = held
    call record_frame(run%model, run%state, run%record, errors)
    run%state = moving
    call record_frame(run%model, run%state, run%record, errors)
    call record_tries(tries, run%record, errors)
    call tell_factor(tries, run, errors)
    call outcome%end_if_any(errors, exit_file)
    call outcome%agree(run%ranks)
  end subroutine find_factor_of_safety

  !> Divide the strength by a factor, and relax from the start. Where a signal comes on the way it
  !> is no try.
  subroutine try(factor, start, unreduced, run, tries, errors)
    real(wp),           intent(in)    :: factor
    type(state_t),      intent(in)    :: start
    type(material_t),   intent(in)    :: unreduced(:)
    type(run_t),        intent(inout) :: run       !! its state becomes that of the try
    type(tries_t),      intent(inout) :: tries
    type(error_list_t), intent(inout) :: errors
    type(relaxed_t) :: relaxed
    real(wp) :: largest
    character(:), allocatable :: outcome
    integer :: failed_row, k

    run%state = start
    run%state%strength = start%strength / factor
    do k = 1, size(unreduced)
      deallocate (run%model%materials%list(k)%law)
      allocate (run%model%materials%list(k)%law, source=unreduced(k)%law%reduced(factor))
    end do
    associate (relaxation => run%increments%relaxation, model => run%model)
      call keep_start(relaxation, run%state)
      call relax(model, run%clock%time(), run%state, relaxation, run%timing, relaxed)
      if (relaxed%stopped) return
      call return_to_start(relaxation, run%state)
      if (allocated(model%operators%relaxing)) call model%operators%relaxing%follow(0.0_wp)
      call forces(model, run%clock%time(), run%state, relaxation%blocks, run%timing, failed_row)
    end associate
    run%state%velocity = run%state%displacement - start%displacement
    call run%model%blocks%spread_rows(run%state%velocity)
    largest = sqrt(maxval(sum(run%state%velocity**2, dim=2)))
    call tries%add(factor, relaxed%at_rest, largest, relaxed%residual)
    outcome = 'no equilibrium, unbalanced force '//short_number(relaxed%residual)
    if (relaxed%at_rest) outcome = 'in equilibrium'
    call record_line(run%record, 'strength divided by '//short_number(factor)//': '//outcome// &
      ' after '//integer_text(relaxed%moves)//' moves, largest displacement '// &
      short_number(largest)//' m', errors)
  end subroutine try

  subroutine tell_factor(tries, run, errors)
    type(tries_t),      intent(in)    :: tries
    type(run_t),        intent(inout) :: run
    type(error_list_t), intent(inout) :: errors

    if (tries%held(2)) then
      call record_line(run%record, 'factor of safety: above '//short_number(tries%least())// &
        ', the last factor that was asked for', errors)
    else
      call record_line(run%record, 'factor of safety: '//short_number(tries%least())// &
        ' is borne, '//short_number(tries%most())//' is not', errors)
    end if
  end subroutine tell_factor

end module pd_strength_reduction
