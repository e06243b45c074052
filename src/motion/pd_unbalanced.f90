!> How far a state is from equilibrium.
!>
!> The unbalanced force is the sum of the net forces on what is free to move, over that of the
!> forces that act from outside: reactions of prescribed points, and loads. Sums are taken of the
!> absolute values of both components at every point, V |f_x| + V |f_y|.
!> Source: doc/theory.md, section 6.
module pd_unbalanced
  use pd_blocks, only: blocks_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_model, only: damping_frame, damping_frame_t, model_t
  use pd_points, only: points_t
  use pd_state, only: state_t
  implicit none
  private

  public :: unbalanced_t, look_at_forces, find_loads, loads_at, over

  !> Sums over all points [N/m].
  type :: unbalanced_t
    real(wp) :: free = 0.0_wp       !! net force where it is free to move
    real(wp) :: outside = 0.0_wp    !! reactions of prescribed components, and loads
    real(wp) :: damping = 0.0_wp    !! force of the damping
  end type unbalanced_t

contains

  !> The sums of a state at time t.
  subroutine look_at_forces(model, state, t, sums)
    type(model_t),      intent(in)  :: model
    type(state_t),      intent(in)  :: state
    real(wp),           intent(in)  :: t   !! [s]
    type(unbalanced_t), intent(out) :: sums
    type(damping_frame_t) :: frame
    real(wp), allocatable :: parts(:, :)
    integer :: block

    allocate (parts(3, model%blocks%count))
    frame = damping_frame(model, t)
    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(model, state, frame, parts)
    do block = 1, model%blocks%count
      parts(:, block) = sums_of_block(model%blocks%lo(block), model%blocks%hi(block), &
        model%points, frame, state%force, state%velocity)
    end do
    !$omp end parallel do
    sums%free = model%blocks%total(parts(1, :))
    sums%outside = model%blocks%total(parts(2, :)) + loads_at(model, t)
    sums%damping = model%damping * model%blocks%total(parts(3, :))
  end subroutine look_at_forces

  !> Sums of rows lo to hi: free, held, and V |v - v_ref|.
  pure function sums_of_block(lo, hi, points, frame, f, v) result(sums)
    integer,               intent(in) :: lo, hi
    type(points_t),        intent(in) :: points
    type(damping_frame_t), intent(in) :: frame
    real(wp), intent(in), contiguous  :: f(:, :), v(:, :)   !! (n,2)
    real(wp) :: sums(3), terms(n_block, 3)
    integer  :: i, b

    if (hi - lo + 1 < n_block) terms = 0.0_wp   ! sums go over whole blocks
    associate (free => points%free, volume => points%volume, place => points%place)
      !$omp simd simdlen(8) private(b)
      do i = lo, hi
        b = i - lo + 1
        terms(b, 1) = volume(i) * (free(i, 1) * abs(f(i, 1)) + free(i, 2) * abs(f(i, 2)))
        terms(b, 2) = volume(i) * (abs(f(i, 1)) + abs(f(i, 2))) - terms(b, 1)
        terms(b, 3) = volume(i) * ( &
          free(i, 1) * abs(v(i, 1) - frame%lower(1) &
          - (frame%upper(1) - frame%lower(1)) * place(i)) + &
          free(i, 2) * abs(v(i, 2) - frame%lower(2) &
          - (frame%upper(2) - frame%lower(2)) * place(i)))
      end do
    end associate
    sums = [block_sum(terms(:, 1)), block_sum(terms(:, 2)), block_sum(terms(:, 3))]
  end function sums_of_block

  !> Force density of the loads at time t, those on supports included.
  subroutine find_loads(model, t, load)
    type(model_t),         intent(in)  :: model
    real(wp),              intent(in)  :: t            !! [s]
    real(wp), allocatable, intent(out) :: load(:, :)   !! (n,2) [N/m^3]
    real(wp) :: applied(2)
    integer  :: k, c

    call model%operators%domain%make_room(model%operators%n, 2, load)
    call model%loads%add_forces(model%points%volume, t, load)
    do k = 1, size(model%supports%items)
      associate (support => model%supports%items(k)%support)
        applied = support%applied(t)
        do c = 1, 2
          if (abs(applied(c)) > 0.0_wp) load(support%points, c) = load(support%points, c) &
            + applied(c) / sum(model%points%volume(support%points))
        end do
      end associate
    end do
  end subroutine find_loads

  !> Sum of the loads at time t, those on supports included [N/m].
  real(wp) function loads_at(model, t) result(sum_of_loads)
    type(model_t), intent(in) :: model
    real(wp),      intent(in) :: t   !! [s]
    real(wp), allocatable :: load(:, :)

    call find_loads(model, t, load)
    sum_of_loads = sum_of_absolute(model%blocks, model%points%volume, load)
  end function loads_at

  !> sum V (|f_x| + |f_y|), block by block: the same bits for any number of threads.
  real(wp) function sum_of_absolute(blocks, volume, f) result(whole)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in), contiguous :: volume(:), f(:, :)
    real(wp) :: parts(blocks%count)
    integer  :: block

    do block = 1, blocks%count
      associate (lo => blocks%lo(block), hi => blocks%hi(block))
        parts(block) = sum(volume(lo:hi) * (abs(f(lo:hi, 1)) + abs(f(lo:hi, 2))))
      end associate
    end do
    whole = blocks%total(parts)
  end function sum_of_absolute

  !> A force over that from outside, at most 1; 0 where there is no force.
  elemental real(wp) function over(force, outside)
    real(wp), intent(in) :: force, outside       !! [N/m]
    real(wp), parameter :: nothing = 1.0e-200_wp !! [N/m]; keeps the quotient finite

    over = force / max(outside, force, nothing)
  end function over

end module pd_unbalanced
