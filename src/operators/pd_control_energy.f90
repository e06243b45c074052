!> The energy that the control of zero-energy modes stores.
!>
!> Source: doc/theory.md, section 5.
module pd_control_energy
  use pd_blocks, only: blocks_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_operator_rows, only: mean_displacement
  use pd_operators, only: operators_t
  implicit none
  private

  public :: control_energy

contains

  !> Energy of the control: with constant c it has a potential, (1/2) sum V c sum omega V_j |z|^2,
  !> which is the work of the control forces without the round-off of adding it up step by step. The
  !> force is linear in u, so this is half of the force times u:
  !>
  !>   -(1/2) sum_i V_i (u_i - u_mean) . Z[u]_i - (1/2) sum_i V_i c_i H_i : H_i K_i
  !>
  !> Where Z holds the affine part too there is no second sum. The mean adds nothing, because the
  !> forces are in balance; with u alone digits would be lost.
  subroutine control_energy(operators, volume, u, h, energy)
    class(operators_t), intent(in) :: operators
    real(wp), intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    real(wp), intent(in), contiguous :: u(:, :)     !! (n,2) [m]; as taken in
    real(wp), intent(in), contiguous :: h(:, :)     !! H (n,4) xx xy yx yy
    real(wp), intent(out) :: energy                 !! [J/m]; round-off does not make it negative
    type(blocks_t) :: blocks
    real(wp), allocatable :: parts(:), z(:, :)
    real(wp) :: mean(2)
    integer  :: block

    energy = 0.0_wp
    if (.not. allocated(operators%control)) return
    call operators%domain%make_room(operators%n, 2, z)
    blocks = operators%domain%blocks
    allocate (parts(blocks%count))
    mean = mean_displacement(blocks, volume, u)
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(operators, blocks, volume, u, h, mean, z, parts)
    do block = 1, blocks%count
      call operators%control_sums_block(blocks%lo(block), blocks%hi(block), u, z)
      parts(block) = control_energy_of_block(operators, block, volume, u, h, mean, z)
    end do
    !$omp end parallel do
    energy = blocks%total(parts)
    if (energy < 0.0_wp) energy = 0.0_wp   ! not max: it would hide what is not a number
  end subroutine control_energy

  !> Energy of the control in one block.
  pure real(wp) function control_energy_of_block(operators, block, volume, u, h, mean, z) &
    result(energy)
    class(operators_t), intent(in) :: operators
    integer,            intent(in) :: block
    real(wp), intent(in), contiguous :: volume(:), u(:, :), h(:, :), z(:, :)
    real(wp), intent(in) :: mean(2)   !! of u [m]
    real(wp) :: terms(n_block), determinant_of_k, kxx, kyy, kxy, affine
    integer  :: i, lo, hi

    lo = operators%domain%blocks%lo(block)
    hi = operators%domain%blocks%hi(block)
    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    affine = merge(0.0_wp, 1.0_wp, operators%sums_whole_control)
    associate (c => operators%control, inverse => operators%k_inverse)
      !$omp simd simdlen(8) private(determinant_of_k, kxx, kyy, kxy)
      do i = lo, hi
        ! rows without a point have K^-1 = 0 and c = 0: the quotients stay finite
        determinant_of_k = 1.0_wp &
          / max(inverse(i, 1) * inverse(i, 2) - inverse(i, 3)**2, tiny(1.0_wp))
        kxx = inverse(i, 2) * determinant_of_k
        kyy = inverse(i, 1) * determinant_of_k
        kxy = -inverse(i, 3) * determinant_of_k
        terms(i - lo + 1) = -0.5_wp * volume(i) * ((u(i, 1) - mean(1)) * z(i, 1) &
          + (u(i, 2) - mean(2)) * z(i, 2) + affine * c(i) * (kxx * (h(i, 1)**2 + h(i, 3)**2) &
          + kyy * (h(i, 2)**2 + h(i, 4)**2) + 2.0_wp * kxy * (h(i, 1) * h(i, 2) &
          + h(i, 3) * h(i, 4))))
      end do
    end associate
    energy = block_sum(terms)
  end function control_energy_of_block

end module pd_control_energy
