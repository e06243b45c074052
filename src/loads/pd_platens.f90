!> Platens: two supports that approach each other along an axis.
!>
!> What is known of their motion beforehand is taken from the supports once; during a run the
!> strain follows from the displacements, whatever moves the platens.
!> Source: doc/theory.md, section 7.
module pd_platens
  use pd_kinds, only: wp
  use pd_supports, only: support_t
  use pd_tables, only: constant_table, difference, table_t
  implicit none
  private

  public :: platens_t, new_platens, move_frame, nominal_strain, reference_ends
  public :: times_of_strains, press_along

  type :: platens_t
    integer  :: axis = 0                     !! 1: x, 2: y, 0: there are no platens
    integer  :: first = 0, second = 0        !! supports at the lower and the upper end
    real(wp) :: start = 0.0_wp               !! coordinate of the lower end of the body [m]
    real(wp) :: length = 1.0_wp              !! extent of the body between them [m]
    real(wp) :: width = 1.0_wp               !! extent of the body across the axis [m]
    integer, private :: points(2) = 0        !! one of each platen
    !> Nominal strain as far as it is prescribed; without times where a platen is free to move.
    type(table_t), private :: strain
    type(table_t), private :: lower(2), upper(2)   !! velocity of the ends of the frame [m/s]
  end type platens_t

contains

  !> Platens at both ends of a body. The frame of the damping moves with them along the axis, and
  !> across it as the rough ones prescribe.
  pure type(platens_t) function new_platens(axis, supports, first, second, lower, upper) &
    result(platens)
    integer,          intent(in) :: axis                  !! 1: x, 2: y
    class(support_t), intent(in) :: first, second         !! at the lower and the upper end
    integer,          intent(in) :: supports(2)           !! their numbers
    real(wp),         intent(in) :: lower(2), upper(2)    !! corners of the extent of the body [m]
    type(table_t) :: one, two

    platens%axis = axis
    platens%first = supports(1)
    platens%second = supports(2)
    platens%start = lower(axis)
    platens%length = upper(axis) - lower(axis)
    platens%width = upper(3 - axis) - lower(3 - axis)
    platens%points = [first%points(1), second%points(1)]
    one = first%common_velocity(axis)
    two = second%common_velocity(axis)
    if (allocated(one%times) .and. allocated(two%times)) then
      platens%strain = difference(one, two)
      platens%strain%rates = platens%strain%rates / platens%length
    end if
    call move_frame(platens, first, second)
  end function new_platens

  !> The ends of the frame move as the supports at both ends prescribe.
  pure subroutine move_frame(platens, first, second)
    type(platens_t),  intent(inout) :: platens
    class(support_t), intent(in)    :: first, second      !! at the lower and the upper end
    type(table_t) :: one, two
    integer :: c

    do c = 1, 2
      one = first%common_velocity(c)
      two = second%common_velocity(c)
      if (.not. allocated(one%times)) one = two
      if (.not. allocated(one%times)) one = constant_table(0.0_wp)
      if (.not. allocated(two%times)) two = one
      platens%lower(c) = one
      platens%upper(c) = two
    end do
  end subroutine move_frame

  !> Nominal strain: relative approach of the platens over the extent of the body between them,
  !> compression positive; 0 where there are no platens.
  pure real(wp) function nominal_strain(platens, u) result(strain)
    type(platens_t), intent(in) :: platens
    real(wp),        intent(in) :: u(:, :)                !! (n,2) [m]

    strain = 0.0_wp
    if (platens%axis > 0) strain = (u(platens%points(1), platens%axis) &
      - u(platens%points(2), platens%axis)) / platens%length
  end function nominal_strain

  !> The first times at which the nominal strain reaches values; -1 where it never does, or where
  !> that is not known beforehand.
  pure function times_of_strains(platens, strains) result(times)
    type(platens_t), intent(in) :: platens
    real(wp),        intent(in) :: strains(:)
    real(wp) :: times(size(strains))

    times = -1.0_wp
    if (allocated(platens%strain%times)) times = platens%strain%first_times(strains)
  end function times_of_strains

  !> Velocity of the affine frame of the platens at both ends: the damping acts relative to it. Zero
  !> if there are no platens.
  pure subroutine reference_ends(platens, t, lower, upper)
    type(platens_t), intent(in)  :: platens
    real(wp),        intent(in)  :: t                     !! [s]
    real(wp),        intent(out) :: lower(2), upper(2)    !! [m/s]
    integer :: c

    lower = 0.0_wp
    upper = 0.0_wp
    if (platens%axis == 0) return
    do c = 1, 2
      lower(c) = platens%lower(c)%rate(t)
      upper(c) = platens%upper(c)%rate(t)
    end do
  end subroutine reference_ends

  !> Whether the platens come nearer or part at some time, as far as their motion is known: not
  !> where they only slide past each other, as in shear.
  pure logical function press_along(platens)
    type(platens_t), intent(in) :: platens

    press_along = platens%axis > 0
    if (allocated(platens%strain%rates)) &
      press_along = press_along .and. any(abs(platens%strain%rates) > 0.0_wp)
  end function press_along

end module pd_platens
