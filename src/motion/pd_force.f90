!> From the deformation gradient to the force state: strain, radial return, first Piola stress,
!> A = P K^-1, and the affine part of the zero-energy control.
!>
!> Source: doc/theory.md, sections 2 to 5.
module pd_force
  use pd_j2, only: elastic_stress_block, j2_t, stress_block
  use pd_kinds, only: n_block, pi, wp
  use pd_kinematics, only: deformation_gradient_block
  use pd_operators, only: operators_t
  use pd_state, only: block_work_t, state_t
  use pd_strain, only: determinant, force_state_block, green_lagrange_block, small_strain_block
  use pd_timing, only: now, timing_t
  implicit none
  private

  public :: solid_t, force_state, internal_force, linear_force, control_stiffness

  !> What the points are made of; fixed after set-up.
  type :: solid_t
    type(j2_t) :: material
    real(wp) :: density = 0.0_wp                !! rho [kg/m^3]
    real(wp), allocatable :: k_inverse(:, :)    !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), allocatable :: yield_stress(:)    !! sigma_y0 (n) [Pa]
  end type solid_t

contains

  !> Stiffness of the zero-energy control, c_i = g C_0 / W_i with C_0 = 48 E / (5 pi delta^2).
  pure function control_stiffness(factor, youngs_modulus, delta, weight_sum) result(c)
    real(wp), intent(in) :: factor            !! g
    real(wp), intent(in) :: youngs_modulus    !! E [Pa]
    real(wp), intent(in) :: delta             !! horizon [m]
    real(wp), intent(in), contiguous :: weight_sum(:)     !! W (n) [m^2]
    real(wp) :: c(size(weight_sum))           !! (n) [N/m^6]

    c = factor * 48.0_wp * youngs_modulus / (5.0_wp * pi * delta**2) / weight_sum
  end function control_stiffness

  !> u gives F, F gives S (radial return; the history goes from step n to n+1) and A, one block of
  !> points after the other: what a block has written is in the cache where it is needed next.
  !>
  !> `blocks`: what each has dissipated in this step, work of S on dE^p by the trapezoidal rule.
  !> `failed`: 0, or the first point whose det F is not positive (NaN included).
  subroutine force_state(operators, solid, volume, state, a, blocks, timing, failed)
    class(operators_t), intent(inout) :: operators
    type(solid_t),  intent(in)    :: solid
    real(wp),       intent(in),    contiguous :: volume(:)   !! V (n) [m^2]
    type(state_t),  intent(inout) :: state
    real(wp),       intent(inout), contiguous :: a(:, :)     !! out: A (n,4), weighed [N/m^6]
    type(block_work_t), intent(inout) :: blocks
    type(timing_t), intent(inout) :: timing
    integer,        intent(out)   :: failed
    integer :: block, lo, hi

    call blocks%fit(operators%first_point, operators%last_point)
    call operators%weigh_displacement(state%displacement)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi) &
    !$omp shared(operators, solid, volume, state, a, blocks, timing)
    do block = 1, size(blocks%failed)
      lo = operators%first_point + (block - 1) * n_block
      hi = min(lo + n_block - 1, operators%last_point)
      if (timing%blocks) blocks%times(1, block) = now()
      call operators%gradient_block(lo, hi, state%displacement, state%deformation_gradient)
      if (timing%blocks) blocks%times(2, block) = now()
      call deformation_gradient_block(lo, hi, solid%k_inverse, state%deformation_gradient)
      call force_state_of_block(lo, hi, solid, volume, state, a, blocks%dissipated(block), &
        blocks%failed(block))
      if (allocated(operators%control)) call subtract_affine_control(lo, hi, &
        operators%control, state%deformation_gradient, a)
      call operators%weigh_block(lo, hi, a)
      if (timing%blocks) blocks%times(3, block) = now()
    end do
    !$omp end parallel do
    failed = 0
    do block = size(blocks%failed), 1, -1
      if (blocks%failed(block) > 0) failed = blocks%failed(block)
    end do
    call timing%lap_blocks(2, blocks%times)
  end subroutine force_state

  !> A gives f, with the zero-energy control.
  subroutine internal_force(operators, u, a, f, blocks, timing)
    class(operators_t), intent(in) :: operators
    real(wp),       intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp),       intent(in),    contiguous :: a(:, :)   !! A (n,4), weighed [N/m^6]
    real(wp),       intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    type(block_work_t), intent(inout) :: blocks
    type(timing_t), intent(inout) :: timing
    integer :: block, lo, hi

    call blocks%fit(operators%first_point, operators%last_point)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi) &
    !$omp shared(operators, u, a, f, blocks, timing)
    do block = 1, size(blocks%failed)
      lo = operators%first_point + (block - 1) * n_block
      hi = min(lo + n_block - 1, operators%last_point)
      if (timing%blocks) blocks%times(1, block) = now()
      call operators%divergence_block(lo, hi, a, f)
      if (timing%blocks) blocks%times(2, block) = now()
      if (allocated(operators%control)) call operators%control_block(lo, hi, u, f)
      if (timing%blocks) blocks%times(3, block) = now()
    end do
    !$omp end parallel do
    call timing%lap_blocks(4, blocks%times)
  end subroutine internal_force

  !> The same for points lo to hi.
  pure subroutine force_state_of_block(lo, hi, solid, volume, state, a, dissipated, failed)
    integer,       intent(in)    :: lo, hi
    type(solid_t), intent(in)    :: solid
    real(wp),      intent(in), contiguous :: volume(:)
    type(state_t), intent(inout) :: state
    real(wp),      intent(inout), contiguous :: a(:, :)
    real(wp),      intent(out)   :: dissipated
    integer,       intent(out)   :: failed
    real(wp) :: strain(n_block, 4)

    dissipated = 0.0_wp
    failed = first_inverted(lo, hi, state%deformation_gradient)
    if (failed > 0) return
    call green_lagrange_block(lo, hi, state%deformation_gradient, strain)
    call stress_block(solid%material, lo, hi, solid%yield_stress, volume, strain, state, &
      dissipated)
    call force_state_block(lo, hi, state%deformation_gradient, state%stress, solid%k_inverse, a)
  end subroutine force_state_of_block

  !> The first of the points lo to hi whose det F is not positive (NaN included); 0: none.
  pure integer function first_inverted(lo, hi, f) result(point)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: f(:, :)   !! F (n,4)
    integer :: i, n_bad

    n_bad = 0
    !$omp simd reduction(+:n_bad)
    do i = lo, hi
      if (.not. f(i, 1) * f(i, 4) - f(i, 2) * f(i, 3) > 0.0_wp) n_bad = n_bad + 1
    end do
    point = 0
    if (n_bad == 0) return
    do i = hi, lo, -1
      if (.not. determinant(f(i, :)) > 0.0_wp) point = i
    end do
  end function first_inverted

  !> A <- A - c (F - I) for points lo to hi.
  pure subroutine subtract_affine_control(lo, hi, c, f, a)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: c(:)      !! (n) [N/m^6]
    real(wp), intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp), intent(inout), contiguous :: a(:, :)   !! A (n,4) xx xy yx yy [N/m^6]
    integer :: i

    !$omp simd simdlen(8)
    do i = lo, hi
      a(i, 1) = a(i, 1) - c(i) * (f(i, 1) - 1.0_wp)
      a(i, 2) = a(i, 2) - c(i) * f(i, 2)
      a(i, 3) = a(i, 3) - c(i) * f(i, 3)
      a(i, 4) = a(i, 4) - c(i) * (f(i, 4) - 1.0_wp)
    end do
  end subroutine subtract_affine_control

  !> Internal force of a small displacement of the unloaded elastic body: the linearised
  !> operator, control included.
  subroutine linear_force(operators, solid, u, h, a, f)
    class(operators_t), intent(inout) :: operators
    type(solid_t),      intent(in)    :: solid
    real(wp), intent(in),    contiguous :: u(:, :)   !! (n,2) [m]
    real(wp), intent(inout), contiguous :: h(:, :)   !! work space (n,4)
    real(wp), intent(inout), contiguous :: a(:, :)   !! work space (n,4)
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    type(block_work_t) :: blocks
    type(timing_t) :: timing
    integer :: lo, hi

    call operators%weigh_displacement(u)
    !$omp parallel do schedule(static) default(none) private(lo, hi) &
    !$omp shared(operators, solid, u, h, a)
    do lo = operators%first_point, operators%last_point, n_block
      hi = min(lo + n_block - 1, operators%last_point)
      call operators%gradient_block(lo, hi, u, h)
      call deformation_gradient_block(lo, hi, solid%k_inverse, h)
      call linear_force_state_block(lo, hi, solid, h, a)
      if (allocated(operators%control)) &
        call subtract_affine_control(lo, hi, operators%control, h, a)
      call operators%weigh_block(lo, hi, a)
    end do
    !$omp end parallel do
    call internal_force(operators, u, a, f, blocks, timing)
  end subroutine linear_force

  !> A of a small displacement of points lo to hi, from F.
  pure subroutine linear_force_state_block(lo, hi, solid, f, a)
    integer,       intent(in) :: lo, hi
    type(solid_t), intent(in) :: solid
    real(wp),      intent(in),    contiguous :: f(:, :)   !! F (n,4) xx xy yx yy
    real(wp),      intent(inout), contiguous :: a(:, :)   !! A (n,4) xx xy yx yy [N/m^6]
    real(wp) :: strain(n_block, 4), stress(n_block, 4)
    integer  :: i, b

    call small_strain_block(lo, hi, f, strain)
    call elastic_stress_block(solid%material, hi - lo + 1, strain, stress)
    associate (k => solid%k_inverse)
      !$omp simd simdlen(8) private(b)
      do i = lo, hi
        b = i - lo + 1
        a(i, 1) = stress(b, 1) * k(i, 1) + stress(b, 4) * k(i, 3)
        a(i, 2) = stress(b, 1) * k(i, 3) + stress(b, 4) * k(i, 2)
        a(i, 3) = stress(b, 4) * k(i, 1) + stress(b, 2) * k(i, 3)
        a(i, 4) = stress(b, 4) * k(i, 3) + stress(b, 2) * k(i, 2)
      end do
    end associate
  end subroutine linear_force_state_block

end module pd_force
