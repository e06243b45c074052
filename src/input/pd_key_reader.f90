!> Visitor that fetches the values of a scanned file: as given, else the default, else nothing.
!>
!> `check_groups` has reported what is wrong with a value, and marked it as damaged; a damaged
!> value is read as if it were not given and had no default.
module pd_key_reader
  use pd_input_values, only: group_named
  use pd_keys, only: group_key_t, key_t, key_visitor_t
  use pd_kinds, only: unset, wp
  use pd_namelist_groups, only: namelist_group_t
  use pd_text, only: read_integer, read_number
  implicit none
  private

  public :: key_reader_t

  type, extends(key_visitor_t) :: key_reader_t
    private
    type(namelist_group_t), allocatable :: groups(:)
    type(namelist_group_t) :: present
    integer :: k = 0                              !! the present group is the k-th of its name
  contains
    procedure :: open => open_groups
    procedure :: group => begin_group
    procedure :: take_real => read_real
    procedure :: take_integer => read_whole
    procedure :: take_text => read_words
    procedure :: take_list => read_list
    procedure :: take_vector => read_vector
  end type key_reader_t

contains

  !> Read these groups of a file. Groups of one name must be visited in their order.
  subroutine open_groups(self, groups, path)
    class(key_reader_t),    intent(inout) :: self
    type(namelist_group_t), intent(in)    :: groups(:)
    character(*),           intent(in)    :: path

    allocate (self%groups, source=groups)
    self%present%file = path
    self%present%name = ''
  end subroutine open_groups

  subroutine begin_group(self, about)
    class(key_reader_t), intent(inout) :: self
    type(group_key_t),   intent(in)    :: about

    if (self%present%name /= about%name) self%k = 0
    self%k = self%k + 1
    self%present = group_named(self%groups, trim(about%name), self%k, self%present%file)
  end subroutine begin_group

  subroutine read_real(self, key, x)
    class(key_reader_t), intent(inout) :: self
    type(key_t),         intent(in)    :: key
    real(wp),            intent(inout) :: x
    character(:), allocatable :: problem, text

    x = unset
    text = first_value(self%present, key)
    if (text == '') return
    call read_number(text, x, problem)
    if (problem /= '') x = unset
  end subroutine read_real

  subroutine read_whole(self, key, i)
    class(key_reader_t), intent(inout) :: self
    type(key_t),         intent(in)    :: key
    integer,             intent(inout) :: i
    character(:), allocatable :: problem

    call read_integer(first_value(self%present, key), i, problem)
    if (problem /= '') i = 0
  end subroutine read_whole

  subroutine read_words(self, key, text)
    class(key_reader_t),       intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: text

    text = first_value(self%present, key)
  end subroutine read_words

  subroutine read_list(self, key, x)
    class(key_reader_t),   intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: x(:)
    character(:), allocatable :: problem
    integer :: i, n, v

    n = 0
    i = self%present%find(trim(key%name))
    if (i > 0) then
      if (.not. self%present%entries(i)%damaged) n = size(self%present%entries(i)%values)
    end if
    if (allocated(x)) deallocate (x)
    allocate (x(n))
    do v = 1, n
      call read_number(self%present%entries(i)%values(v)%text, x(v), problem)
    end do
  end subroutine read_list

  !> The numbers stay as they are where the key is not given.
  subroutine read_vector(self, key, x)
    class(key_reader_t), intent(inout) :: self
    type(key_t),         intent(in)    :: key
    real(wp),            intent(inout) :: x(:)
    real(wp), allocatable :: given(:)

    call read_list(self, key, given)
    if (size(given) == size(x)) x = given
  end subroutine read_vector

  !> The first value of a key as text, else its default; empty where it is damaged.
  pure function first_value(group, key) result(text)
    type(namelist_group_t), intent(in) :: group
    type(key_t),            intent(in) :: key
    character(:), allocatable :: text
    integer :: i

    text = ''
    i = group%find(trim(key%name))
    if (i == 0) then
      text = trim(key%default)
    else if (.not. group%entries(i)%damaged) then
      text = group%entries(i)%values(1)%text
    end if
  end function first_value

end module pd_key_reader
