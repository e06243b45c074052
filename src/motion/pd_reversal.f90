!> Flow against the flow before it, where softening is kinematic.
!>
!> The back stress beta of kinematic softening points against the flow that has made it, so that
!> beta : dE^p < 0 as long as the flow goes on. It is positive where the flow has turned back: the
!> strength there is above sigma_y, up to 2 sigma_y - sigma_r. beta : dE^p is what the plastic work
!> has beyond the heat, and both are known per block.
!> Source: doc/theory.md, section 3.
module pd_reversal
  use pd_blocks, only: blocks_t
  use pd_kinds, only: block_sum, n_block, wp
  use pd_materials, only: materials_t
  use pd_state, only: state_t
  implicit none
  private

  public :: reversal_t, new_reversal

  !> Plastic heat so far [J/m], and the part of it that was made in flow that has turned back.
  type :: reversal_t
    real(wp) :: flowed = 0.0_wp, turned = 0.0_wp
    logical, private :: possible = .false.               !! some block softens
    logical,  allocatable, private :: softens(:)         !! of the blocks: all that flows in it does
    real(wp), allocatable, private :: work(:), heat(:)   !! of the blocks, at the last look [J/m]
  contains
    procedure :: is_possible
    procedure :: look
    procedure :: part
  end type reversal_t

contains

  !> Nothing seen yet. `kinematic`: of the materials of the input, whether
  !> their softening is.
  type(reversal_t) function new_reversal(materials, kinematic, blocks) result(reversal)
    type(materials_t), intent(in) :: materials
    logical,           intent(in) :: kinematic(:)
    type(blocks_t),    intent(in) :: blocks
    logical, dimension(size(materials%list)) :: flows, turns_back
    integer, allocatable :: here(:)
    integer :: block, k

    flows = [(materials%list(k)%law%plastic_strain > 0, k=1, size(flows))]
    turns_back = .false.   ! what follows those of the input does not flow
    turns_back(:size(kinematic)) = kinematic
    allocate (reversal%softens(blocks%count))
    do block = 1, blocks%count
      here = materials%runs(materials%first_run(block):materials%first_run(block + 1) - 1)%material
      reversal%softens(block) = any(turns_back(here)) .and. all(turns_back(here) &
        .or. .not. flows(here))
    end do
    reversal%possible = blocks%lowest_number(merge(1, 0, reversal%softens)) > 0
  end function new_reversal

  !> Whether there is anything to look at.
  pure logical function is_possible(self)
    class(reversal_t), intent(in) :: self

    is_possible = self%possible
  end function is_possible

  !> Look at the flow since the last look. A block counts with all of its flow, or not.
  subroutine look(self, materials, blocks, volume, state, work)
    class(reversal_t), intent(inout) :: self
    type(materials_t), intent(in)    :: materials
    type(blocks_t),    intent(in)    :: blocks
    real(wp),          intent(in), contiguous :: volume(:)   !! V (n) [m^2]
    type(state_t),     intent(in)    :: state
    real(wp),          intent(in)    :: work(:)   !! plastic work so far (blocks) [J/m]
    real(wp), parameter :: enough = 0.01_wp       !! of the heat; below it is round-off
    real(wp) :: heat(size(work)), made(size(work))
    integer  :: block

    !$omp parallel do schedule(static) default(none) private(block) &
    !$omp shared(self, materials, blocks, volume, state, heat)
    do block = 1, blocks%count
      heat(block) = 0.0_wp
      if (self%softens(block)) heat(block) = heat_of_block(block)
    end do
    !$omp end parallel do
    if (allocated(self%heat)) then
      made = heat - self%heat
      self%flowed = self%flowed + blocks%total(made)
      self%turned = self%turned + blocks%total(merge(made, 0.0_wp, self%softens &
        .and. (work - self%work) - made > enough * made))
    end if
    self%work = work
    self%heat = heat

  contains

    pure real(wp) function heat_of_block(block) result(heat)
      integer, intent(in) :: block
      real(wp) :: terms(n_block)
      integer  :: last

      terms = 0.0_wp
      last = blocks%hi(block) - blocks%lo(block) + 1
      call materials%heat_block(block, state%law_points_t, terms)
      terms(:last) = volume(blocks%lo(block):blocks%hi(block)) * terms(:last)
      heat = block_sum(terms)
    end function heat_of_block

  end subroutine look

  !> Part of the heat that was made in flow that has turned back; 0 without heat.
  pure real(wp) function part(self)
    class(reversal_t), intent(in) :: self

    part = 0.0_wp
    if (self%flowed > 0.0_wp) part = self%turned / self%flowed
  end function part

end module pd_reversal
