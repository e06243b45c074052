!> Work and dissipation, added up step by step.
!>
!> Work at the points is kept per block, and added over the blocks only when it is asked for: an
!> ordinary step takes no sum over all points.
!> Source: doc/theory.md, section 10.
module pd_ledger
  use pd_blocks, only: blocks_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: ledger_t, new_ledger

  type :: ledger_t
    real(wp) :: initial_kinetic_energy = 0.0_wp         !! [J/m]
    real(wp) :: initial_strain_energy = 0.0_wp          !! [J/m]
    real(wp) :: largest_work = 0.0_wp                   !! largest |W| that was noted [J/m]
    real(wp) :: outer_work = 0.0_wp                     !! of supports and loads [J/m]
    real(wp), allocatable :: plastic(:)                 !! dissipated by flow (blocks) [J/m]
    real(wp), allocatable :: control(:)                 !! dissipated by the relaxing control
    real(wp), allocatable :: damping(:)                 !! dissipated by damping (blocks) [J/m]
    real(wp), allocatable :: work_at_points(:)          !! from outside: by the frame of the damping
                                                        !! and loads on all points (blocks)
  contains
    procedure :: plastic_dissipation
    procedure :: control_dissipation
    procedure :: damping_dissipation
    procedure :: external_work
    procedure :: note_work
    procedure :: fit
    procedure :: gathered
  end type ledger_t

contains

  !> Nothing done yet.
  pure type(ledger_t) function new_ledger(blocks) result(ledger)
    type(blocks_t), intent(in) :: blocks

    allocate (ledger%plastic(blocks%count), ledger%control(blocks%count), &
      ledger%damping(blocks%count), ledger%work_at_points(blocks%count), source=0.0_wp)
  end function new_ledger

  !> Dissipated by plastic flow so far [J/m].
  real(wp) function plastic_dissipation(self, blocks)
    class(ledger_t), intent(in) :: self
    type(blocks_t),  intent(in) :: blocks

    plastic_dissipation = blocks%total(self%plastic)
  end function plastic_dissipation

  !> Dissipated by the relaxing control so far [J/m].
  real(wp) function control_dissipation(self, blocks)
    class(ledger_t), intent(in) :: self
    type(blocks_t),  intent(in) :: blocks

    control_dissipation = blocks%total(self%control)
  end function control_dissipation

  !> Dissipated by the damping so far [J/m].
  real(wp) function damping_dissipation(self, blocks)
    class(ledger_t), intent(in) :: self
    type(blocks_t),  intent(in) :: blocks

    damping_dissipation = blocks%total(self%damping)
  end function damping_dissipation

  !> Work from outside so far, W [J/m].
  real(wp) function external_work(self, blocks)
    class(ledger_t), intent(in) :: self
    type(blocks_t),  intent(in) :: blocks

    external_work = self%outer_work + blocks%total(self%work_at_points)
  end function external_work

  !> Fit the sums of all blocks to a division into blocks: each rank keeps those of its own. Those
  !> of another division go into the first block.
  pure subroutine fit(self, blocks)
    class(ledger_t), intent(inout) :: self   !! in: with the blocks of all ranks
    type(blocks_t),  intent(in)    :: blocks

    call fit_sums(self%plastic, blocks)
    call fit_sums(self%control, blocks)
    call fit_sums(self%damping, blocks)
    call fit_sums(self%work_at_points, blocks)
  end subroutine fit

  pure subroutine fit_sums(sums, blocks)
    real(wp), allocatable, intent(inout) :: sums(:)   !! (blocks)
    type(blocks_t),        intent(in)    :: blocks
    real(wp), allocatable :: fitting(:)

    if (size(sums) == blocks%count_of_all()) then
      fitting = sums(blocks%offset + 1:blocks%offset + blocks%count)
    else
      allocate (fitting(blocks%count), source=0.0_wp)
      if (blocks%has_first()) fitting(1) = sum(sums)
    end if
    call move_alloc(fitting, sums)
  end subroutine fit_sums

  !> The sums of the blocks of all ranks.
  function gathered(self, blocks) result(ledger)
    class(ledger_t), intent(in) :: self
    type(blocks_t),  intent(in) :: blocks
    type(ledger_t) :: ledger

    ledger%initial_kinetic_energy = self%initial_kinetic_energy
    ledger%initial_strain_energy = self%initial_strain_energy
    ledger%largest_work = self%largest_work
    ledger%outer_work = self%outer_work
    allocate (ledger%plastic, source=blocks%ranks%gathered(self%plastic))
    allocate (ledger%control, source=blocks%ranks%gathered(self%control))
    allocate (ledger%damping, source=blocks%ranks%gathered(self%damping))
    allocate (ledger%work_at_points, source=blocks%ranks%gathered(self%work_at_points))
  end function gathered

  !> Remember the largest work so far.
  subroutine note_work(self, blocks)
    class(ledger_t), intent(inout) :: self
    type(blocks_t),  intent(in)    :: blocks

    self%largest_work = max(self%largest_work, abs(self%external_work(blocks)))
  end subroutine note_work

end module pd_ledger
