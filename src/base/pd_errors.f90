!> Problems as values, exit statuses, and the outcome of a run.
module pd_errors
  use pd_ranks, only: ranks_t
  implicit none
  private

  public :: error_list_t, outcome_t
  public :: exit_ok, exit_command_line, exit_input, exit_model, exit_calculation, exit_file
  public :: exit_interrupted, exit_terminated

  integer, parameter :: exit_ok = 0            !! finished
  integer, parameter :: exit_command_line = 1  !! wrong command line
  integer, parameter :: exit_input = 2         !! the input file cannot be read or is wrong
  integer, parameter :: exit_model = 3         !! the model cannot be set up
  integer, parameter :: exit_calculation = 4   !! the calculation failed
  integer, parameter :: exit_file = 5          !! a file cannot be written or read
  integer, parameter :: exit_interrupted = 130 !! stopped by SIGINT
  integer, parameter :: exit_terminated = 143  !! stopped by SIGTERM

  type :: message_t
    character(:), allocatable :: text
  end type message_t

  !> Problems in the order in which they were found.
  type :: error_list_t
    private
    type(message_t), allocatable :: messages(:)
  contains
    procedure :: add
    procedure :: count => message_count
    procedure :: message
    procedure :: print => print_messages
  end type error_list_t

  !> Whether the program goes on; if not, why, and with which exit status it ends.
  type :: outcome_t
    logical :: done = .false.
    integer :: status = exit_ok
    type(error_list_t) :: errors
    logical :: agreed = .false.   !! all ranks end with this status
    integer :: teller = 0         !! the rank that prints the errors
  contains
    procedure :: end_if_any
    procedure :: end_with
    procedure :: agree
  end type outcome_t

contains

  !> Append a problem. The four parts of a message: what is wrong, where, what was found, what is
  !> allowed; parts that do not apply are left out.
  pure subroutine add(self, what, where, found, allowed)
    class(error_list_t), intent(inout)        :: self
    character(*),        intent(in)           :: what
    character(*),        intent(in), optional :: where, found, allowed
    type(message_t), allocatable :: longer(:)
    character(:),    allocatable :: text
    integer :: n

    text = ''
    if (present(where)) text = trim(where)//': '
    text = text//trim(what)
    if (present(found)) text = text//'; found: '//trim(found)
    if (present(allowed)) text = text//'; allowed: '//trim(allowed)

    n = self%count()
    allocate (longer(n + 1))
    if (n > 0) longer(:n) = self%messages
    longer(n + 1)%text = text
    call move_alloc(longer, self%messages)
  end subroutine add

  !> Number of problems so far.
  pure integer function message_count(self)
    class(error_list_t), intent(in) :: self

    message_count = 0
    if (allocated(self%messages)) message_count = size(self%messages)
  end function message_count

  !> Text of problem i, 1 <= i <= count.
  pure function message(self, i) result(text)
    class(error_list_t), intent(in) :: self
    integer,             intent(in) :: i
    character(:), allocatable :: text

    text = self%messages(i)%text
  end function message

  !> Print one problem per line: 'perigeo: error: ...', or with another label.
  subroutine print_messages(self, unit, label)
    class(error_list_t), intent(in)           :: self
    integer,             intent(in)           :: unit
    character(*),        intent(in), optional :: label
    character(:), allocatable :: start
    integer :: i

    start = 'perigeo: error: '
    if (present(label)) start = 'perigeo: '//label//': '
    do i = 1, self%count()
      write (unit, '(a)') start//self%message(i)
    end do
  end subroutine print_messages

  !> End with a status if there are problems, unless the run has ended already.
  subroutine end_if_any(self, errors, status)
    class(outcome_t),   intent(inout) :: self
    type(error_list_t), intent(in)    :: errors
    integer,            intent(in)    :: status

    if (self%done .or. errors%count() == 0) return
    self%errors = errors
    call self%end_with(status)
  end subroutine end_if_any

  !> End with a status.
  subroutine end_with(self, status)
    class(outcome_t), intent(inout) :: self
    integer,          intent(in)    :: status

    self%done = .true.
    self%status = status
  end subroutine end_with

  !> End on all ranks if one of them has ended. One rank tells: the first one that has something to
  !> tell. Every rank must come here.
  subroutine agree(self, ranks)
    class(outcome_t), intent(inout) :: self
    type(ranks_t),    intent(in)    :: ranks
    integer :: numbers(2)

    if (ranks%count == 1 .or. self%agreed) return
    numbers(1) = merge(self%status + 1, 0, self%done)
    numbers(2) = merge(ranks%count - ranks%mine, 0, self%errors%count() > 0)
    call ranks%largest_numbers(numbers)
    if (numbers(1) == 0) return
    self%agreed = .true.
    if (numbers(2) > 0) self%teller = ranks%count - numbers(2)
    call self%end_with(numbers(1) - 1)
  end subroutine agree

end module pd_errors
