!> The stages of a run: which bodies, boundaries and pressures of the input are there when.
!>
!> A run without stages has one, with everything in it.
module pd_stages
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: stage_t, stages_of, first_stage, stage_names, names_of_bodies, names_of_boundaries
  public :: names_of_pressures, named, there_at_first

  integer, parameter :: name_length = 80
  character(*), parameter :: no_names = 'none'

  type :: stage_t
    character(:), allocatable :: name               !! '' in a run without stages
    real(wp) :: start_time = 0.0_wp                 !! [s]
    real(wp) :: end_time = huge(1.0_wp)             !! [s]
    logical,  allocatable :: has_body(:)
    logical,  allocatable :: has_boundary(:)
    logical,  allocatable :: has_pressure(:)
    real(wp), allocatable :: boundary_since(:)      !! time from which it has been there [s]
    real(wp), allocatable :: pressure_since(:)      !! [s]
    integer,  allocatable :: material_of(:)         !! of every body
  end type stage_t

contains

  !> All stages, in their order; of an input that has been checked.
  pure function stages_of(input) result(stages)
    type(input_t), intent(in) :: input
    type(stage_t), allocatable :: stages(:)
    integer :: k

    allocate (stages(max(1, size(input%stages))))
    stages(1) = everything(input)
    do k = 1, size(input%stages)
      if (k > 1) then
        stages(k) = stages(k - 1)
        stages(k)%start_time = stages(k - 1)%end_time
      end if
      associate (given => input%stages(k), stage => stages(k))
        stage%name = given%name
        stage%end_time = given%end_time
        where (named(given%excavate, names_of_bodies(input))) stage%has_body = .false.
        where (named(given%fill, names_of_bodies(input))) stage%has_body = .true.
        call choose(given%boundaries, names_of_boundaries(input), stage%has_boundary)
        call choose(given%pressures, names_of_pressures(input), stage%has_pressure)
        call change_materials(given%materials, input, stage%material_of)
        if (k == 1) cycle
        where (stage%has_boundary .and. .not. stages(k - 1)%has_boundary) &
          stage%boundary_since = stage%start_time
        where (stage%has_pressure .and. .not. stages(k - 1)%has_pressure) &
          stage%pressure_since = stage%start_time
      end associate
    end do
  end function stages_of

  !> The first stage.
  pure type(stage_t) function first_stage(input) result(first)
    type(input_t), intent(in) :: input
    type(stage_t), allocatable :: stages(:)   ! what ASSOCIATE names gfortran does not free

    allocate (stages(0))   ! else gfortran warns of it, without reason
    stages = stages_of(input)
    first = stages(1)
  end function first_stage

  !> A stage with everything in it, from the beginning.
  pure type(stage_t) function everything(input) result(stage)
    type(input_t), intent(in) :: input
    integer :: j, k

    stage%name = ''
    allocate (stage%has_body(size(input%bodies)), source=there_at_first(input))
    allocate (stage%has_boundary(size(input%boundaries)), source=.true.)
    allocate (stage%has_pressure(size(input%pressures)), source=.true.)
    allocate (stage%boundary_since(size(input%boundaries)), source=0.0_wp)
    allocate (stage%pressure_since(size(input%pressures)), source=0.0_wp)
    allocate (stage%material_of(size(input%bodies)), source=1)
    do k = 1, size(input%bodies)
      do j = size(input%materials), 1, -1
        if (input%materials(j)%name == input%bodies(k)%material) stage%material_of(k) = j
      end do
    end do
  end function everything

  !> Bodies that are there at the beginning: those that nothing fills before it digs them away.
  pure function there_at_first(input) result(there)
    type(input_t), intent(in) :: input
    logical :: there(size(input%bodies))
    integer :: k

    there = .true.
    do k = size(input%stages), 1, -1
      where (named(input%stages(k)%fill, names_of_bodies(input))) there = .false.
      where (named(input%stages(k)%excavate, names_of_bodies(input))) there = .true.
    end do
  end function there_at_first

  !> Which of some names a text holds.
  pure function named(text, names) result(found)
    character(*), intent(in) :: text
    character(*), intent(in) :: names(:)
    logical :: found(size(names))
    integer :: k

    associate (words => stage_names(text))
      found = [(any(words == names(k)) .and. names(k) /= '', k=1, size(names))]
    end associate
  end function named

  !> Those that a text names; where it holds nothing, there is no change.
  pure subroutine choose(text, names, chosen)
    character(*), intent(in)    :: text
    character(*), intent(in)    :: names(:)
    logical,      intent(inout) :: chosen(:)

    if (text /= '') chosen = named(text, names)
  end subroutine choose

  !> Give bodies another material.
  pure subroutine change_materials(text, input, material_of)
    character(*),  intent(in)    :: text              !! 'body=material ...'
    type(input_t), intent(in)    :: input
    integer,       intent(inout) :: material_of(:)
    integer :: i, j, k

    associate (words => stage_names(text))
      do i = 1, size(words) - 1, 2
        do k = 1, size(input%bodies)
          if (input%bodies(k)%name /= words(i)) cycle
          do j = 1, size(input%materials)
            if (input%materials(j)%name == words(i + 1)) material_of(k) = j
          end do
        end do
      end do
    end associate
  end subroutine change_materials

  !> The names in a text, separated by blanks, commas or =; without names where it says none.
  pure function stage_names(text) result(names)
    character(*), intent(in) :: text
    character(name_length), allocatable :: names(:)
    character(name_length) :: name
    integer :: from, length

    allocate (names(0))
    if (text == no_names) return
    from = 1
    do while (from <= len_trim(text))
      length = scan(text(from:)//' ', ' ,=') - 1
      name = text(from:from + length - 1)
      if (length > 0) names = [names, name]
      from = from + length + 1
    end do
  end function stage_names

  pure function names_of_bodies(input) result(names)
    type(input_t), intent(in) :: input
    character(name_length) :: names(size(input%bodies))
    integer :: k

    do k = 1, size(names)
      names(k) = input%bodies(k)%name
    end do
  end function names_of_bodies

  pure function names_of_boundaries(input) result(names)
    type(input_t), intent(in) :: input
    character(name_length) :: names(size(input%boundaries))
    integer :: k

    do k = 1, size(names)
      names(k) = input%boundaries(k)%name
    end do
  end function names_of_boundaries

  pure function names_of_pressures(input) result(names)
    type(input_t), intent(in) :: input
    character(name_length) :: names(size(input%pressures))
    integer :: k

    do k = 1, size(names)
      names(k) = input%pressures(k)%name
    end do
  end function names_of_pressures

end module pd_stages
