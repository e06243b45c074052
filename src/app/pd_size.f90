!> Whether a body fits into the memory of the machine: looked at before it is set up, and again
!> before anything is written.
module pd_size
  use, intrinsic :: iso_fortran_env, only: output_unit
  use pd_errors, only: error_list_t
  use pd_input_shapes, only: find_extents
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_ranks, only: ranks_t
  use pd_room, only: has_room, machine_memory, stack_limit
  use pd_setup_reach, only: looks_near
  use pd_summary, only: memory_of_run
  use pd_text, only: integer_text, short_number
  implicit none
  private

  public :: look_at_size, look_at_memory, memory_in_words

  !> Memory that a point needs at least [bytes]: in a rectangle; to find out what lies in a body of
  !> another shape, per place in the box around it.
  real(wp), parameter :: of_point = 450.0_wp, of_place = 100.0_wp
  real(wp), parameter :: gigabyte = 1.0e9_wp, kilobyte = 1024.0_wp

  !> Kernels keep blocks of rows there, some 120 kB in all.
  real(wp), parameter :: least_stack = 256.0_wp * kilobyte

contains

  !> Before the body is set up. A body that takes long to set up is announced with `aloud`.
  !>
  !> Errors: the machine has too little memory, the stack has no room for a block of rows.
  subroutine look_at_size(input, ranks, aloud, errors)
    type(input_t),      intent(in)    :: input
    type(ranks_t),      intent(in)    :: ranks
    logical,            intent(in)    :: aloud
    type(error_list_t), intent(inout) :: errors
    real(wp), parameter :: takes_long = 5.0e5_wp   ! places
    real(wp) :: lower(2), upper(2), places, bytes
    logical  :: known, all_material

    if (stack_limit() < least_stack) then
      call errors%add('the limit of the stack (ulimit -s) is too small for any run', &
        found=short_number(stack_limit() / kilobyte)//' kB', &
        allowed=short_number(least_stack / kilobyte)//' kB or more')
      return
    end if
    call find_extents(input%bodies, input%discretisation%spacing, lower, upper, known)
    if (.not. known .or. input%bodies(1)%shape == 'file') return
    places = product((upper - lower) / input%discretisation%spacing + 1.0_wp)
    all_material = size(input%bodies) == 1 .and. input%bodies(1)%shape == 'rectangle'
    bytes = places * merge(of_point, of_place, all_material)
    if (looks_near(input)) bytes = bytes / real(ranks%count, wp)
    if (aloud .and. places > takes_long) then
      write (output_unit, '(a)') 'about '//short_number(places)//' points, '// &
        short_number(bytes / gigabyte)//' GB of memory at least'//of_each(ranks)// &
        ': setting them up takes a while'
      flush (output_unit)
    end if
    if (all_have_room(ranks, bytes, bytes)) return
    call errors%add('the body is too large for the memory of this machine', &
      '&discretisation spacing', 'about '//short_number(places)//' points, at least '// &
      short_number(bytes / gigabyte)//' GB'//of_each(ranks), machine_in_words())
  end subroutine look_at_size

  !> Before the state is allocated: the sum that --check prints, less what is there already; of
  !> several ranks the part of each.
  !>
  !> Errors: the machine has too little memory.
  subroutine look_at_memory(input, model, ranks, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(in)    :: model
    type(ranks_t),      intent(in)    :: ranks
    type(error_list_t), intent(inout) :: errors
    real(wp) :: bytes, part, there

    there = model%operators%memory()
    part = 1.0_wp / real(ranks%count, wp)   ! a model that is whole will be divided
    if (allocated(model%blocks%ranks%before)) then
      associate (kept => model%operators%storage%kept)
        part = real(kept(2) - kept(1) + 1, wp) / real(model%operators%n, wp)
      end associate
      there = part * there
    end if
    bytes = part * memory_of_run(input, model)
    if (all_have_room(ranks, bytes, max(0.0_wp, bytes - there))) return
    call errors%add(memory_in_words(bytes, ranks), '&discretisation spacing', &
      allowed=machine_in_words())
  end subroutine look_at_memory

  !> Whether the ranks of this machine have as much memory as each of them needs, together.
  logical function all_have_room(ranks, bytes, more) result(have)
    type(ranks_t), intent(in) :: ranks
    real(wp),      intent(in) :: bytes   !! that each needs
    real(wp),      intent(in) :: more    !! that it has not got yet

    have = real(ranks%on_machine, wp) * bytes <= machine_memory()
    if (have) have = has_room(more)
  end function all_have_room

  !> What to say behind an amount of memory.
  function of_each(ranks) result(text)
    type(ranks_t), intent(in) :: ranks
    character(:), allocatable :: text

    text = ''
    if (ranks%on_machine > 1) &
      text = ' for each of '//integer_text(ranks%on_machine)//' ranks on this machine'
  end function of_each

  function memory_in_words(bytes, ranks) result(text)
    real(wp),      intent(in) :: bytes   !! that each of the ranks needs
    type(ranks_t), intent(in) :: ranks
    character(:), allocatable :: text

    text = 'the run needs '//short_number(bytes / gigabyte)//' GB of memory'//of_each(ranks)// &
      ': more than there is'
  end function memory_in_words

  function machine_in_words() result(text)
    character(:), allocatable :: text

    text = 'what the machine has and a limit of the user (ulimit -v) leaves'
    if (machine_memory() < huge(1.0_wp)) &
      text = 'the '//short_number(machine_memory() / gigabyte)// &
      ' GB of this machine, or less where a limit of the user (ulimit -v) says so'
  end function machine_in_words

end module pd_size
