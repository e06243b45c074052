!> Visitor that lists groups and keys, for the checks of a file and for the reference.
module pd_key_list
  use pd_keys, only: find_group, group_key_t, key_t, key_visitor_t
  use pd_kinds, only: wp
  implicit none
  private

  public :: key_list_t

  type, extends(key_visitor_t) :: key_list_t
    type(group_key_t), allocatable :: groups(:)
    type(key_t),       allocatable :: keys(:)
    logical, private :: seen = .false.            !! the present group is listed already
  contains
    procedure :: group => begin_group
    procedure :: take_real => list_real
    procedure :: take_integer => list_integer
    procedure :: take_text => list_text
    procedure :: take_list => list_list
    procedure :: take_vector => list_vector
    procedure, private :: add
  end type key_list_t

contains

  subroutine begin_group(self, about)
    class(key_list_t), intent(inout) :: self
    type(group_key_t), intent(in)    :: about

    if (.not. allocated(self%groups)) allocate (self%groups(0), self%keys(0))
    self%seen = find_group(self%groups, trim(about%name)) > 0
    if (.not. self%seen) self%groups = [self%groups, about]
  end subroutine begin_group

  subroutine add(self, key)
    class(key_list_t), intent(inout) :: self
    type(key_t),       intent(in)    :: key

    if (self%seen) return
    self%keys = [self%keys, key]
    self%keys(size(self%keys))%group = self%groups(size(self%groups))%name
  end subroutine add

  subroutine list_real(self, key, x)
    class(key_list_t), intent(inout) :: self
    type(key_t), intent(in) :: key
    real(wp), intent(inout) :: x

    associate (unused => x)
      call self%add(key)
    end associate
  end subroutine list_real

  subroutine list_integer(self, key, i)
    class(key_list_t), intent(inout) :: self
    type(key_t), intent(in) :: key
    integer, intent(inout) :: i

    associate (unused => i)
      call self%add(key)
    end associate
  end subroutine list_integer

  subroutine list_text(self, key, text)
    class(key_list_t), intent(inout) :: self
    type(key_t), intent(in) :: key
    character(:), allocatable, intent(inout) :: text

    associate (unused => text)
      call self%add(key)
    end associate
  end subroutine list_text

  subroutine list_list(self, key, x)
    class(key_list_t), intent(inout) :: self
    type(key_t), intent(in) :: key
    real(wp), allocatable, intent(inout) :: x(:)

    associate (unused => x)
      call self%add(key)
    end associate
  end subroutine list_list

  subroutine list_vector(self, key, x)
    class(key_list_t), intent(inout) :: self
    type(key_t), intent(in) :: key
    real(wp), intent(inout) :: x(:)

    associate (unused => x)
      call self%add(key)
    end associate
  end subroutine list_vector

end module pd_key_list
