!> The forces of a state: what every integrator asks for.
!>
!>   u gives H, H gives strain, stress and P; the operators turn P into f; loads and supports join
!>
!> Each kernel finds what the one before it wrote for the same block still in the cache.
!> Source: doc/theory.md, sections 2 to 5 and 7.
module pd_forces
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_materials, only: materials_t
  use pd_model, only: model_t
  use pd_operators, only: operators_t
  use pd_state, only: block_work_t, state_t
  use pd_timing, only: kernel_boundaries, kernel_force, kernel_gradient, now, timing_t
  implicit none
  private

  public :: forces, internal_forces, find_gradient, linear_forces, next_step_t, prepare_next_step

  !> Where a step leads a state, if the points go on as they move.
  type :: next_step_t
    real(wp), allocatable :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), allocatable :: p(:, :)   !! first Piola stress (n,4) xx xy yx yy [Pa]
  end type next_step_t

contains

  !> Forces at time t: internal ones, loads, and the reactions of the supports. Stress and history
  !> of the state go from step n to n+1. What supports and loads look at is then known to all ranks.
  !>
  !> `work`: what each block has dissipated in this step.
  !> `failed_row`: 0, or the first row whose det F is not positive (NaN included).
  subroutine forces(model, t, state, work, timing, failed_row)
    type(model_t),      intent(inout) :: model   !! its supports get their new forces
    real(wp),           intent(in)    :: t       !! [s]
    type(state_t),      intent(inout) :: state
    type(block_work_t), intent(inout) :: work
    type(timing_t),     intent(inout) :: timing
    integer,            intent(out)   :: failed_row

    call model%operators%mirror%move(t)
    associate (points => model%points)
      call internal_forces(model%operators, model%materials, points%volume, state, work, timing, &
        failed_row)
      call model%loads%add_forces(points%volume, t, state%force)
      call model%pushed%bring(state%velocity)
      call model%supports%balance(points%volume, t, state%force)
    end associate
    call timing%lap(kernel_boundaries)
  end subroutine forces

  !> H of the present displacement at time t, and nothing else.
  subroutine find_gradient(model, t, state)
    type(model_t), intent(inout) :: model
    real(wp),      intent(in)    :: t       !! [s]
    type(state_t), intent(inout) :: state
    integer :: block

    call model%operators%mirror%move(t)
    call model%operators%take_in(state%displacement, model%operators%mirror%place)
    do block = 1, model%blocks%count
      call model%operators%gradient_block(model%blocks%lo(block), model%blocks%hi(block), &
        state%displacement, state%displacement_gradient)
    end do
  end subroutine find_gradient

  !> Internal force density, the zero-energy control included.
  subroutine internal_forces(operators, materials, volume, state, work, timing, failed_row)
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp),           intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    type(state_t),      intent(inout) :: state
    type(block_work_t), intent(inout) :: work
    type(timing_t),     intent(inout) :: timing
    integer,            intent(out)   :: failed_row

    associate (domain => operators%domain)
      call work%fit(domain%blocks)
      call operators%begin_taking_in(state%displacement, operators%mirror%place)
      call stress_of_blocks(domain%inner, operators, materials, volume, state, work, timing%blocks)
      call operators%finish_taking_in(state%displacement)
      call stress_of_blocks(domain%outer, operators, materials, volume, state, work, timing%blocks)
      call timing%lap_blocks(kernel_gradient, work%times)
      call work%begin_telling(domain%blocks)
      call operators%begin_sharing()
      call force_of_blocks(domain%inner, operators, state)
      call operators%finish_sharing()
      call force_of_blocks(domain%outer, operators, state)
    end associate
    call work%hear(failed_row)
    call operators%mirror%hand_back(state%force)
    call timing%lap(kernel_force)
  end subroutine internal_forces

  !> H, stress and force tensor of some blocks, while the halo may be on its way.
  subroutine stress_of_blocks(blocks, operators, materials, volume, state, work, timed)
    integer,            intent(in)    :: blocks(:)
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp),           intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    type(state_t),      intent(inout) :: state
    type(block_work_t), intent(inout) :: work
    logical,            intent(in)    :: timed
    integer :: first, k, last, length

    length = operators%domain%halo%piece(size(blocks))
    do first = 1, size(blocks), length
      last = min(first + length - 1, size(blocks))
      !$omp parallel do schedule(static) default(none) private(k) &
      !$omp shared(first, last, blocks, operators, materials, volume, state, work, timed)
      do k = first, last
        call stress_of_block(blocks(k), operators, materials, volume, state, work, timed)
      end do
      !$omp end parallel do
      call operators%domain%halo%help()
    end do
  end subroutine stress_of_blocks

  !> The force density of some blocks, likewise.
  subroutine force_of_blocks(blocks, operators, state)
    integer,            intent(in)    :: blocks(:)
    class(operators_t), intent(inout) :: operators
    type(state_t),      intent(inout) :: state
    integer :: first, k, last, length

    length = operators%domain%halo%piece(size(blocks))
    do first = 1, size(blocks), length
      last = min(first + length - 1, size(blocks))
      !$omp parallel do schedule(static) default(none) private(k) &
      !$omp shared(first, last, blocks, operators, state)
      do k = first, last
        call operators%force_block(operators%domain%blocks%lo(blocks(k)), &
          operators%domain%blocks%hi(blocks(k)), state%displacement, state%force)
      end do
      !$omp end parallel do
      call operators%domain%halo%help()
    end do
  end subroutine force_of_blocks

  !> H, stress and force tensor of one block.
  subroutine stress_of_block(block, operators, materials, volume, state, work, timed)
    integer,            intent(in)    :: block
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp),           intent(in), contiguous :: volume(:)
    type(state_t),      intent(inout) :: state
    type(block_work_t), intent(inout) :: work
    logical,            intent(in)    :: timed
    type(flow_t) :: flow
    real(wp) :: p(n_block, 4)
    integer  :: lo, hi

    lo = operators%domain%blocks%lo(block)
    hi = operators%domain%blocks%hi(block)
    work%dissipated(block) = 0.0_wp
    work%relaxed(block) = 0.0_wp
    work%flowed(block) = 0
    if (timed) work%times(1, block) = now()
    call operators%gradient_block(lo, hi, state%displacement, state%displacement_gradient)
    if (timed) work%times(2, block) = now()
    work%failed(block) = first_inverted(lo, hi, state%displacement_gradient)
    if (work%failed(block) == 0) then
      call materials%stress_block(block, state%displacement_gradient, state%law_points_t, p, flow)
      work%dissipated(block) = flow%work(volume)
      work%flowed(block) = flow%n
      call operators%relax_block(block, state%displacement, state%displacement_gradient, flow, &
        state%control_memory, p, work%relaxed(block))
      call operators%hand_over_block(lo, hi, state%displacement_gradient, p)
    end if
    if (timed) work%times(3, block) = now()
  end subroutine stress_of_block

  !> The first of the rows lo to hi whose det F is not positive (NaN included); 0: none.
  pure integer function first_inverted(lo, hi, h) result(row)
    integer,  intent(in) :: lo, hi
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4)
    real(wp) :: n_bad   ! not an integer: comparisons of reals then stay in their registers
    integer  :: i

    n_bad = 0.0_wp
    !$omp simd simdlen(8) reduction(+:n_bad)
    do i = lo, hi
      n_bad = n_bad + merge(0.0_wp, 1.0_wp, &
        (1.0_wp + h(i, 1)) * (1.0_wp + h(i, 4)) - h(i, 2) * h(i, 3) > 0.0_wp)
    end do
    row = 0
    if (n_bad < 0.5_wp) return
    do i = hi, lo, -1
      if (.not. (1.0_wp + h(i, 1)) * (1.0_wp + h(i, 4)) - h(i, 2) * h(i, 3) > 0.0_wp) row = i
    end do
  end function first_inverted

  !> Prepare `linear_forces` of a state.
  subroutine prepare_next_step(operators, materials, time_step, state, next)
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp),           intent(in)    :: time_step   !! dt [s]
    type(state_t),      intent(inout) :: state       !! whole; its halo is brought up to date
    type(next_step_t),  intent(out)   :: next
    real(wp) :: p(n_block, 4)
    integer  :: block, lo, hi, n_blocks

    n_blocks = operators%domain%blocks%count
    call operators%domain%make_room(operators%n, 4, next%h)
    call operators%domain%make_room(operators%n, 4, next%p)
    call operators%take_in(state%velocity, operators%mirror%rate)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi, p) &
    !$omp shared(n_blocks, operators, materials, time_step, state, next)
    do block = 1, n_blocks
      lo = operators%domain%blocks%lo(block)
      hi = operators%domain%blocks%hi(block)
      call operators%gradient_block(lo, hi, state%velocity, next%h)
      next%h(lo:hi, :) = state%displacement_gradient(lo:hi, :) + time_step * next%h(lo:hi, :)
      call materials%next_stress_block(block, state%law_points_t, next%h, 0.0_wp, next%h, p)
      next%p(lo:hi, :) = p(:hi - lo + 1, :)
    end do
    !$omp end parallel do
  end subroutine prepare_next_step

  !> Internal force of a small displacement, control included: the linearised operator. Of the
  !> unloaded elastic body or, where a state is given, of the body after its next step, in which
  !> points that flow are softer. What the control holds turns with the points; that changes too
  !> little to matter. The difference is small against the strain of a step, and good to half of the
  !> digits.
  !>
  !> The operators have taken in u then: who goes on with a state has its displacement taken in.
  subroutine linear_forces(operators, materials, u, h, f, state, next)
    class(operators_t), intent(inout) :: operators
    type(materials_t),  intent(in)    :: materials
    real(wp), intent(inout), contiguous :: u(:, :)   !! (n,2) [m]; its halo is brought up to date
    real(wp), intent(inout), contiguous :: h(:, :)   !! work space (n,4)
    real(wp), intent(inout), contiguous :: f(:, :)   !! out: (n,2) [N/m^3]
    type(state_t),     intent(in), optional :: state
    type(next_step_t), intent(in), optional :: next
    real(wp), parameter :: part = 1.0e-10_wp
    real(wp) :: p(n_block, 4)
    integer  :: block, lo, hi, n_blocks

    n_blocks = operators%domain%blocks%count
    call operators%take_in(u)
    !$omp parallel do schedule(static) default(none) private(block, lo, hi, p) &
    !$omp shared(n_blocks, operators, materials, u, h, state, next)
    do block = 1, n_blocks
      lo = operators%domain%blocks%lo(block)
      hi = operators%domain%blocks%hi(block)
      call operators%gradient_block(lo, hi, u, h)
      if (present(state)) then
        call materials%next_stress_block(block, state%law_points_t, next%h, part, h, p)
        p(:hi - lo + 1, :) = (p(:hi - lo + 1, :) - next%p(lo:hi, :)) / part
      else
        call materials%linear_stress_block(block, h, p)
      end if
      call operators%hold_block(block, u, h, p)
      call operators%hand_over_block(lo, hi, h, p)
    end do
    !$omp end parallel do
    call operators%share()
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(n_blocks, operators, u, f)
    do block = 1, n_blocks
      call operators%force_block(operators%domain%blocks%lo(block), &
        operators%domain%blocks%hi(block), u, f)
    end do
    !$omp end parallel do
    call operators%mirror%hand_back(f)
  end subroutine linear_forces

end module pd_forces
