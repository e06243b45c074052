!> Faults of memory and of arithmetic, each planted on purpose: `make sanitize` must find them.
!>
!> The name of a fault is the first argument. What is wrong hides behind interfaces that a compiler
!> cannot look through, as it would in the program.
program faults
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none
  character(32) :: name

  call get_command_argument(1, name)
  call commit(name, command_argument_count())

contains

  !> Commit a fault; `one` is 1, which the compiler does not know.
  subroutine commit(fault, one)
    character(*), intent(in) :: fault
    integer,      intent(in) :: one
    integer, allocatable :: list(:)
    integer :: n

    allocate (list(8), source=one)
    n = 0
    select case (fault)
    case ('none')
      n = sum_of(list, 8 * one)
    case ('beyond the end')
      n = sum_of(list, 8 + one)
    case ('after its release')
      n = released(list)
    case ('lost')
      n = lost(one)
    case ('overflow')
      n = grown(huge(n) - one, 2 * one)
    case default
      error stop 'there is no such fault'
    end select
    write (error_unit, '(a, i0)') trim(fault)//' got by with ', n
  end subroutine commit

  integer function sum_of(values, count) result(total)
    integer, intent(in) :: count
    integer, intent(in) :: values(count)
    integer :: k

    total = 0
    do k = 1, count
      total = total + values(k)
    end do
  end function sum_of

  integer function released(values) result(total)
    integer, intent(inout), allocatable, target :: values(:)
    integer, pointer :: left(:)

    left => values
    deallocate (values)
    total = sum(left)
  end function released

  integer function lost(count)
    integer, intent(in) :: count
    integer, pointer :: nobody(:)

    allocate (nobody(count + 100), source=count)
    lost = sum(nobody)
    nullify (nobody)
  end function lost

  integer function grown(count, by)
    integer, intent(in) :: count, by

    grown = count + by
  end function grown

end program faults
