!> How large the zero-energy part of the deformation is, as one number.
!>
!> Points far from all flow show it best: in a band and beside it the displacement bends within a
!> family, and a part of z is true. z over the horizon is a strain, so that their strain is the
!> measure.
!> Source: doc/theory.md, sections 5 and 10.
module pd_zero_energy
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use pd_kinds, only: n_block, wp
  use pd_model, only: model_t
  use pd_pages, only: clear_rows
  use pd_state, only: state_t
  implicit none
  private

  public :: zero_energy_ratio

contains

  !> Root of sum V z^2 over sum V |E|^2, over the points of the body in whose family, themselves
  !> included, nothing has flowed; z is the field `zero_energy`, |E| the norm of the strain. Not a
  !> number where such points are a hundredth of the body or less, or hardly strained.
  real(wp) function zero_energy_ratio(model, state) result(ratio)
    type(model_t), intent(inout) :: model   !! its halo is a work space
    type(state_t), intent(in)    :: state
    real(wp), parameter :: tiny_strain = 1.0e-9_wp, enough = 0.01_wp
    real(wp), allocatable :: z2(:), flowed(:), parts(:, :)
    real(wp) :: sums(4)
    integer  :: block

    allocate (z2(model%operators%n), parts(4, model%blocks%count))
    call look_for_flow(model, state, flowed)
    call model%operators%zero_energy_squared(state%displacement, state%displacement_gradient, z2)
    do block = 1, model%blocks%count
      parts(:, block) = sums_of_block(block, model, state, z2, flowed)
    end do
    sums = model%blocks%totals(parts)
    ratio = ieee_value(1.0_wp, ieee_quiet_nan)
    if (sums(2) > tiny_strain**2 * sums(3) .and. sums(3) > enough * sums(4)) &
      ratio = sqrt(sums(1) / sums(2)) / model%delta
  end function zero_energy_ratio

  !> How much of the family of every row has flowed, itself included: 0 where nothing has.
  !>
  !> A field that is 1 where a point has flowed has a zero-energy part, over H = 0, of exactly the
  !> weight of those neighbours that differ.
  subroutine look_for_flow(model, state, flowed)
    type(model_t), intent(inout) :: model
    type(state_t), intent(in)    :: state
    real(wp), allocatable, intent(out) :: flowed(:)   !! 0 to 2 (n)
    real(wp), allocatable :: mark(:, :), h(:, :)
    real(wp) :: alpha(n_block)
    integer  :: block

    allocate (flowed(model%operators%n))
    call clear_rows(flowed, model%operators%storage%kept)
    call model%operators%domain%make_room(model%operators%n, 2, mark)
    call model%operators%domain%make_room(model%operators%n, 4, h)
    do block = 1, model%blocks%count
      associate (lo => model%blocks%lo(block), hi => model%blocks%hi(block))
        call model%materials%plastic_strain_block(block, state%law_points_t, alpha)
        where (alpha(:hi - lo + 1) > 0.0_wp) mark(lo:hi, 1) = 1.0_wp
      end associate
    end do
    call model%operators%domain%halo%exchange(mark)
    call model%operators%zero_energy_squared(mark, h, flowed)
    associate (a => model%blocks%first, b => model%blocks%last, &
      weight => model%operators%weight_sum)
      where (weight(a:b) > 0.0_wp) flowed(a:b) = flowed(a:b) / weight(a:b)
      flowed(a:b) = flowed(a:b) + mark(a:b, 1)
    end associate
  end subroutine look_for_flow

  !> sum V delta^2 z^2, sum V |E|^2 and sum V of the points far from flow, and sum V of all, of a
  !> block.
  pure function sums_of_block(block, model, state, z2, flowed) result(sums)
    integer,       intent(in) :: block
    type(model_t), intent(in) :: model
    type(state_t), intent(in) :: state
    real(wp),      intent(in) :: z2(:)       !! sum_j omega V_j |z|^2 (n) [m^4]
    real(wp),      intent(in) :: flowed(:)   !! (n)
    real(wp), parameter :: round_off = 1.0e-12_wp
    real(wp) :: sums(4), strain(n_block, 4), volume
    integer  :: b, i

    call model%materials%strain_block(block, state%displacement_gradient, strain)
    sums = 0.0_wp
    do i = model%blocks%lo(block), model%blocks%hi(block)
      b = i - model%blocks%lo(block) + 1
      volume = model%points%in_body(i) * model%points%volume(i)
      if (volume <= 0.0_wp) cycle
      sums(4) = sums(4) + volume
      if (flowed(i) <= round_off) sums(:3) = sums(:3) + volume * [z2(i) &
        / model%operators%weight_sum(i), sum(strain(b, :3)**2) + 2.0_wp * strain(b, 4)**2, 1.0_wp]
    end do
  end function sums_of_block

end module pd_zero_energy
