!> The model: everything about a run that does not change while it runs.
module pd_model
  use pd_blocks, only: blocks_t
  use pd_body, only: body_t
  use pd_kinds, only: wp
  use pd_loads, only: loads_t
  use pd_materials, only: materials_t
  use pd_operators, only: operators_t
  use pd_pages, only: clear_rows
  use pd_platens, only: platens_t, reference_ends
  use pd_points, only: points_t, probe_t
  use pd_shared_rows, only: shared_rows_t
  use pd_state, only: state_t
  use pd_storage, only: storage_t
  use pd_supports, only: supports_t
  implicit none
  private

  public :: model_t, damping_frame_t, initial_t, start, damping_frame, release_set_up
  public :: release_points
  public :: top_of

  !> Strain, stress and internal forces of a body with an initial stress, before any motion.
  type :: initial_t
    real(wp), allocatable :: strain(:, :)    !! xx yy zz xy (n,4)
    real(wp), allocatable :: stress(:, :)    !! likewise [Pa]
    real(wp), allocatable :: force(:, :)     !! x y (n,2) [N/m^3]
  end type initial_t

  !> Everything about a run that does not change while it runs, and the supports with the forces of
  !> the present step.
  type :: model_t
    type(body_t)      :: body
    type(body_t)      :: whole               !! points of all stages; n = 0: there are no stages
    type(storage_t)   :: shown               !! rows of the points that results show
    class(operators_t), allocatable :: operators
    type(materials_t) :: materials
    type(blocks_t)    :: blocks              !! of the rows of all fields; those of this rank
    type(shared_rows_t) :: shared            !! rows of the supports
    type(shared_rows_t) :: pushed            !! rows whose velocity loads look at
    type(shared_rows_t) :: probed            !! those of the probes
    type(points_t)    :: points
    type(platens_t)   :: platens
    type(supports_t)  :: supports
    type(loads_t)     :: loads
    type(initial_t), allocatable :: initial  !! to begin with; not allocated: unloaded
    type(probe_t),   allocatable :: probes(:)
    real(wp), allocatable :: strength(:)     !! initial strength of the rows (n) [Pa]
    real(wp), allocatable :: shown_strength(:)   !! of the points of all stages [Pa]
    real(wp) :: spacing = 0.0_wp             !! dx [m]
    real(wp) :: delta = 0.0_wp               !! horizon [m]
    real(wp) :: damping = 0.0_wp             !! C [kg/(m^3 s)]
    logical  :: releases = .false.           !! a stage lets in what it has changed
    logical  :: at_equilibrium = .false.     !! time only tells how far loads and supports are
    logical  :: damped_in_frame = .false.    !! damping acts in the frame of the platens
    real(wp) :: highest_frequency = 0.0_wp   !! of the linearised operator [1/s]; 0: not asked for
    real(wp) :: unbalanced(2) = -1.0_wp      !! what a stress of 1 leaves inside a cloud of points
                                             !! with plain and with balanced weights, at most;
                                             !! below 0: a lattice, nothing inside, not balanced
  end type model_t

  !> Velocity against which the damping acts: linear between two ends, constant beyond them.
  type :: damping_frame_t
    real(wp) :: lower(2) = 0.0_wp, upper(2) = 0.0_wp   !! [m/s]
  end type damping_frame_t

contains

  !> Give back the memory of what only the set-up needs: points keep it, in rows.
  subroutine release_set_up(model)
    type(model_t), intent(inout) :: model

    call release_points(model%body)
    if (allocated(model%initial)) deallocate (model%initial)
  end subroutine release_set_up

  !> Give back the memory of the points of a body, but for the boundaries that they belong to.
  subroutine release_points(body)
    type(body_t), intent(inout) :: body

    if (body%on_lattice()) call body%keep_in_runs()
    if (allocated(body%position)) deallocate (body%position, body%volume, body%part)
  end subroutine release_points

  !> Height of the top of the body before any stage has dug into it [m].
  pure real(wp) function top_of(model) result(top)
    type(model_t), intent(in) :: model

    top = model%body%upper(2)
    if (model%whole%n > 0) top = model%whole%upper(2)
  end function top_of

  !> Velocity at both ends of the frame in which the damping acts, at time t.
  pure type(damping_frame_t) function damping_frame(model, t) result(frame)
    type(model_t), intent(in) :: model
    real(wp),      intent(in) :: t   !! [s]

    if (model%damped_in_frame) &
      call reference_ends(model%platens, t, frame%lower, frame%upper)
  end function damping_frame

  !> State at t = 0: undeformed, with the initial stress where there is one, moving with the frame
  !> of the damping, supports with their own velocity; loads without a ramp act already.
  subroutine start(model, state)
    type(model_t), intent(inout) :: model
    type(state_t), intent(out)   :: state
    type(damping_frame_t) :: frame
    integer :: k, kept(2)

    kept = model%operators%domain%kept(size(model%points%volume))
    state%in_stages = model%whole%n > 0
    state%has_initial_strain = allocated(model%initial) .or. state%in_stages
    call state%allocate(size(model%points%volume), model%materials%remembered(), kept)
    ! it stays zero: no memory for it
    if (.not. allocated(model%operators%relaxing)) call clear_rows(state%control_memory, [1, 0])
    frame = damping_frame(model, 0.0_wp)
    associate (a => kept(1), b => kept(2))
      if (allocated(model%initial)) then
        state%initial_strain(a:b, :) = model%initial%strain(a:b, :)
        state%stress(a:b, :) = model%initial%stress(a:b, :)
        state%force(a:b, :) = model%initial%force(a:b, :)
      end if
      state%strength(a:b) = model%strength(a:b)
      do k = 1, 2
        state%velocity(a:b, k) = frame%lower(k) + (frame%upper(k) - frame%lower(k)) &
          * model%points%place(a:b)
        where (model%points%volume(a:b) <= 0.0_wp) state%velocity(a:b, k) = 0.0_wp
      end do
    end associate
    call model%supports%prescribe(0.0_wp, state%displacement, state%velocity)
    call model%loads%add_forces(model%points%volume, 0.0_wp, state%force)
    call model%supports%share_forces(model%points%volume, 0.0_wp, state%force)
    if (allocated(model%initial)) &   ! the body leans on them from the start
      call model%supports%take_reactions(model%points%volume, 0.0_wp, state%force)
    call model%operators%mirror%move(0.0_wp)
    call model%operators%take_in(state%displacement, model%operators%mirror%place)
  end subroutine start

end module pd_model
