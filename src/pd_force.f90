!> From the deformation gradient to the force state: strain, radial return, first Piola stress,
!> A = P K^-1, and the affine part of the zero-energy control.
!>
!> Source: doc/theory.md, sections 2 to 5.
module pd_force
  use pd_j2, only: elastic_stress, inner, j2_history_t, j2_t, radial_return
  use pd_kinds, only: n_block, pi, wp
  use pd_kinematics, only: deformation_gradient
  use pd_operators, only: operators_t
  use pd_state, only: state_t
  use pd_strain, only: determinant, first_piola, green_lagrange
  implicit none
  private

  public :: solid_t, force_state, linear_force, control_stiffness

  !> What the points are made of; fixed after set-up.
  type :: solid_t
    type(j2_t) :: material
    real(wp) :: density = 0.0_wp                !! rho [kg/m^3]
    real(wp), allocatable :: k_inverse(:, :)    !! K^-1 (n,3) xx yy xy [1/m^4]
    real(wp), allocatable :: yield_stress(:)    !! sigma_y0 (n) [Pa]
    real(wp), allocatable :: control(:)         !! c (n) [N/m^6]; not allocated: no control
  end type solid_t

contains

  !> Stiffness of the zero-energy control, c_i = g C_0 / W_i with C_0 = 48 E / (5 pi delta^2).
  pure function control_stiffness(factor, youngs_modulus, delta, weight_sum) result(c)
    real(wp), intent(in) :: factor            !! g
    real(wp), intent(in) :: youngs_modulus    !! E [Pa]
    real(wp), intent(in) :: delta             !! horizon [m]
    real(wp), intent(in) :: weight_sum(:)     !! W (n) [m^2]
    real(wp) :: c(size(weight_sum))           !! (n) [N/m^6]

    c = factor * 48.0_wp * youngs_modulus / (5.0_wp * pi * delta**2) / weight_sum
  end function control_stiffness

  !> F gives S (radial return; the history goes from step n to n+1) and A.
  !>
  !> `dissipated`: work of S on dE^p of this step, by the trapezoidal rule, over all points.
  !> `failed`: 0, or the first point whose det F is not positive (NaN included).
  subroutine force_state(solid, volume, state, a, dissipated, failed)
    type(solid_t), intent(in)    :: solid
    real(wp),      intent(in)    :: volume(:)    !! V (n) [m^2]
    type(state_t), intent(inout) :: state
    real(wp),      intent(out)   :: a(:, :)      !! A (n,4) xx xy yx yy [N/m^6]
    real(wp),      intent(out)   :: dissipated   !! [J/m]
    integer,       intent(out)   :: failed
    real(wp), allocatable :: dissipated_in(:)
    integer,  allocatable :: failed_in(:)
    integer :: block, n, n_blocks

    n = size(volume)
    n_blocks = (n + n_block - 1) / n_block
    allocate (dissipated_in(n_blocks), failed_in(n_blocks))
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n, n_blocks, solid, volume, state, a, dissipated_in, failed_in)
    do block = 1, n_blocks
      call force_state_of_block((block - 1) * n_block + 1, min(block * n_block, n), solid, &
        volume, state, a, dissipated_in(block), failed_in(block))
    end do
    !$omp end parallel do
    dissipated = sum(dissipated_in)
    failed = 0
    do block = n_blocks, 1, -1
      if (failed_in(block) > 0) failed = failed_in(block)
    end do
  end subroutine force_state

  !> The same for points lo to hi.
  pure subroutine force_state_of_block(lo, hi, solid, volume, state, a, dissipated, failed)
    integer,       intent(in)    :: lo, hi
    type(solid_t), intent(in)    :: solid
    real(wp),      intent(in)    :: volume(:)
    type(state_t), intent(inout) :: state
    real(wp),      intent(inout) :: a(:, :)
    real(wp),      intent(out)   :: dissipated
    integer,       intent(out)   :: failed
    type(j2_history_t) :: history
    real(wp) :: f(4), stress(4), stress_n(4), alpha_n, plastic_strain_n(4)
    integer  :: i

    dissipated = 0.0_wp
    failed = 0
    do i = lo, hi
      f = state%deformation_gradient(i, :)
      if (.not. determinant(f) > 0.0_wp) then
        if (failed == 0) failed = i
        a(i, :) = 0.0_wp
        cycle
      end if
      history%plastic_strain = state%plastic_strain(i, :)
      history%back_stress = state%back_stress(i, :)
      history%alpha = state%alpha(i)
      alpha_n = history%alpha
      call radial_return(solid%material, solid%yield_stress(i), green_lagrange(f), history, stress)
      if (history%alpha > alpha_n) then
        stress_n = state%stress(i, :)
        plastic_strain_n = state%plastic_strain(i, :)
        dissipated = dissipated + volume(i) * 0.5_wp &
          * inner(stress_n + stress, history%plastic_strain - plastic_strain_n)
        state%plastic_strain(i, :) = history%plastic_strain
        state%back_stress(i, :) = history%back_stress
        state%alpha(i) = history%alpha
      end if
      state%stress(i, :) = stress
      a(i, :) = times_inverse(first_piola(f, stress), solid%k_inverse(i, :))
    end do
    if (.not. allocated(solid%control)) return
    do i = lo, hi
      call subtract_affine_control(solid%control(i), state%deformation_gradient(i, :), a(i, :))
    end do
  end subroutine force_state_of_block

  !> P K^-1 with K^-1 as xx yy xy.
  pure function times_inverse(p, k) result(a)
    real(wp), intent(in) :: p(4), k(3)
    real(wp) :: a(4)

    a(1) = p(1) * k(1) + p(2) * k(3)
    a(2) = p(1) * k(3) + p(2) * k(2)
    a(3) = p(3) * k(1) + p(4) * k(3)
    a(4) = p(3) * k(3) + p(4) * k(2)
  end function times_inverse

  !> A <- A - c (F - I).
  pure subroutine subtract_affine_control(c, f, a)
    real(wp), intent(in)    :: c, f(4)
    real(wp), intent(inout) :: a(4)

    a = a - c * f
    a(1) = a(1) + c
    a(4) = a(4) + c
  end subroutine subtract_affine_control

  !> Internal force of a small displacement of the unloaded elastic body: the linearised
  !> operator, control included.
  subroutine linear_force(operators, solid, u, h, a, f)
    type(operators_t), intent(in)    :: operators
    type(solid_t),     intent(in)    :: solid
    real(wp),          intent(in)    :: u(:, :)   !! (n,2) [m]
    real(wp),          intent(inout) :: h(:, :)   !! work space (n,4)
    real(wp),          intent(inout) :: a(:, :)   !! work space (n,4)
    real(wp),          intent(out)   :: f(:, :)   !! (n,2) [N/m^3]
    integer  :: i, lo, n
    real(wp) :: strain(4), stress(4)

    n = operators%n
    call operators%gradient(u, h)
    call deformation_gradient(solid%k_inverse, h)
    !$omp parallel do schedule(static) default(none) shared(n, solid, h, a) &
    !$omp private(i, lo, strain, stress)
    do lo = 1, n, n_block
      do i = lo, min(lo + n_block - 1, n)
        strain = [h(i, 1) - 1.0_wp, h(i, 4) - 1.0_wp, 0.0_wp, 0.5_wp * (h(i, 2) + h(i, 3))]
        stress = elastic_stress(solid%material, strain)
        a(i, :) = times_inverse([stress(1), stress(4), stress(4), stress(2)], &
          solid%k_inverse(i, :))
        if (allocated(solid%control)) &
          call subtract_affine_control(solid%control(i), h(i, :), a(i, :))
      end do
    end do
    !$omp end parallel do
    call operators%divergence(a, f)
    if (allocated(solid%control)) call operators%add_control(solid%control, u, f)
  end subroutine linear_force

end module pd_force
