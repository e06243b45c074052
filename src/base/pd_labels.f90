!> Names, units and sentences: what every number that leaves the program carries.
module pd_labels
  implicit none
  private

  public :: label_t, field_label_t

  !> What a number is.
  type :: label_t
    character(80)  :: name = ''          !! as in files: [a-z0-9_]
    character(16)  :: unit = ''          !! SI; '1' where there is none
    character(200) :: description = ''   !! a sentence
  end type label_t

  !> The same of a field over the points.
  type, extends(label_t) :: field_label_t
    character(40) :: components = ''     !! their names, blank between; '' where there is one
  contains
    procedure :: width
    procedure :: component
  end type field_label_t

contains

  !> Number of components.
  pure integer function width(self)
    class(field_label_t), intent(in) :: self
    integer :: i

    width = 1
    do i = 1, len_trim(self%components)
      if (self%components(i:i) == ' ') width = width + 1
    end do
  end function width

  !> Name of component k, such as 'xx'; '' where there is only one.
  pure function component(self, k) result(name)
    class(field_label_t), intent(in) :: self
    integer,              intent(in) :: k
    character(:), allocatable :: name, rest
    integer :: i

    rest = trim(self%components)//' '
    do i = 2, k
      rest = rest(index(rest, ' ') + 1:)
    end do
    name = rest(:index(rest, ' ') - 1)
  end function component

end module pd_labels
