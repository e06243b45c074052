!> Whether a body fits into the memory of the machine: looked at before it is set up, and again
!> before anything is written.
module pd_size
  use, intrinsic :: iso_fortran_env, only: output_unit
  use pd_errors, only: error_list_t
  use pd_input_shapes, only: find_extents
  use pd_input_types, only: input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_room, only: has_room, machine_memory, stack_limit
  use pd_summary, only: memory_of_run
  use pd_text, only: short_number
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
  subroutine look_at_size(input, aloud, errors)
    type(input_t),      intent(in)    :: input
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
    if (aloud .and. places > takes_long) then
      write (output_unit, '(a)') 'about '//short_number(places)//' points, '// &
        short_number(bytes / gigabyte)//' GB of memory at least: setting them up takes a while'
      flush (output_unit)
    end if
    if (.not. has_room(bytes)) call errors%add('the body is too large for the memory of this '// &
      'machine', '&discretisation spacing', 'about '//short_number(places)//' points, at least '// &
      short_number(bytes / gigabyte)//' GB', machine_in_words())
  end subroutine look_at_size

  !> Before the state is allocated: the sum that --check prints, less what is there already.
  !>
  !> Errors: the machine has too little memory.
  subroutine look_at_memory(input, model, errors)
    type(input_t),      intent(in)    :: input
    type(model_t),      intent(in)    :: model
    type(error_list_t), intent(inout) :: errors

    associate (bytes => memory_of_run(input, model))
      if (bytes <= machine_memory()) then
        if (has_room(bytes - model%operators%memory())) return
      end if
      call errors%add(memory_in_words(bytes), '&discretisation spacing', allowed=machine_in_words())
    end associate
  end subroutine look_at_memory

  function memory_in_words(bytes) result(text)
    real(wp), intent(in) :: bytes
    character(:), allocatable :: text

    text = 'the run needs '//short_number(bytes / gigabyte)//' GB of memory: more than there is'
  end function memory_in_words

  function machine_in_words() result(text)
    character(:), allocatable :: text

    text = 'what the machine has and a limit of the user (ulimit -v) leaves'
    if (machine_memory() < huge(1.0_wp)) &
      text = 'the '//short_number(machine_memory() / gigabyte)// &
      ' GB of this machine, or less where a limit of the user (ulimit -v) says so'
  end function machine_in_words

end module pd_size
