!> Visitors of fields over the points: a state names its fields once, in one procedure that shows
!> them to a visitor; everything that is done with all fields is a visitor.
!>
!> The visitors here need nothing but arrays: they allocate, scatter some rows over more rows,
!> and count. Those that read and write are in `pd_checkpoint`.
module pd_fields
  use pd_kinds, only: wp
  use pd_labels, only: field_label_t, label_t
  implicit none
  private

  public :: field_visitor_t, state_field_t
  public :: allocating_t, scattering_t, clearing_t, counting_t

  !> A field of a state: named components, or columns that each have a name, a unit and a sentence
  !> of their own (what a law remembers).
  type, extends(field_label_t) :: state_field_t
    logical :: kept = .true.             !! needed to go on after a restart
    logical :: by_neighbours = .false.   !! read by other points than its own
    real(wp),      allocatable :: rest(:)      !! values of an unloaded point; absent: 0
    type(label_t), allocatable :: columns(:)   !! in place of components
  contains
    procedure :: width
    procedure :: unloaded
  end type state_field_t

  !> Sees every field of a state, in the order in which the state shows them.
  type, abstract :: field_visitor_t
  contains
    generic :: field => one_number, several_numbers
    procedure(visit_1), deferred :: one_number
    procedure(visit_2), deferred :: several_numbers
  end type field_visitor_t

  abstract interface
    !> A field with one number per point.
    subroutine visit_1(self, about, values)
      import :: field_visitor_t, state_field_t, wp
      class(field_visitor_t), intent(inout) :: self
      type(state_field_t),    intent(in)    :: about
      real(wp), allocatable,  intent(inout) :: values(:)      !! (n)
    end subroutine visit_1
    !> A field with several numbers per point.
    subroutine visit_2(self, about, values)
      import :: field_visitor_t, state_field_t, wp
      class(field_visitor_t), intent(inout) :: self
      type(state_field_t),    intent(in)    :: about
      real(wp), allocatable,  intent(inout) :: values(:, :)   !! (n,width)
    end subroutine visit_2
  end interface

  !> Make room for n unloaded points.
  type, extends(field_visitor_t) :: allocating_t
    integer :: n = 0
  contains
    procedure :: one_number => allocate_1
    procedure :: several_numbers => allocate_2
  end type allocating_t

  !> Put the values of the fields that are kept into some of n rows; all other values are those of
  !> an unloaded point.
  type, extends(field_visitor_t) :: scattering_t
    integer, allocatable :: rows(:)
    integer :: n = 0
  contains
    procedure :: one_number => scatter_1
    procedure :: several_numbers => scatter_2
  end type scattering_t

  !> Make some rows those of unloaded points.
  type, extends(field_visitor_t) :: clearing_t
    integer, allocatable :: rows(:)
  contains
    procedure :: one_number => clear_1
    procedure :: several_numbers => clear_2
  end type clearing_t

  !> Count the numbers per point, allocated or not.
  type, extends(field_visitor_t) :: counting_t
    integer :: numbers = 0
  contains
    procedure :: one_number => count_1
    procedure :: several_numbers => count_2
  end type counting_t

contains

  !> Numbers per point.
  pure integer function width(self)
    class(state_field_t), intent(in) :: self

    if (allocated(self%columns)) then
      width = size(self%columns)
    else
      width = self%field_label_t%width()
    end if
  end function width

  !> Number k of an unloaded point.
  pure real(wp) function unloaded(self, k)
    class(state_field_t), intent(in) :: self
    integer,              intent(in) :: k

    unloaded = 0.0_wp
    if (allocated(self%rest)) unloaded = self%rest(k)
  end function unloaded

  subroutine allocate_1(self, about, values)
    class(allocating_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    if (allocated(values)) deallocate (values)
    allocate (values(self%n), source=about%unloaded(1))
  end subroutine allocate_1

  subroutine allocate_2(self, about, values)
    class(allocating_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)
    integer :: k

    if (allocated(values)) deallocate (values)
    allocate (values(self%n, about%width()))
    do k = 1, about%width()
      values(:, k) = about%unloaded(k)
    end do
  end subroutine allocate_2

  subroutine scatter_1(self, about, values)
    class(scattering_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)
    real(wp), allocatable :: all_rows(:)
    type(allocating_t) :: room

    room%n = self%n
    call room%field(about, all_rows)
    if (about%kept) all_rows(self%rows) = values
    call move_alloc(all_rows, values)
  end subroutine scatter_1

  subroutine scatter_2(self, about, values)
    class(scattering_t),   intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)
    real(wp), allocatable :: all_rows(:, :)
    type(allocating_t) :: room

    room%n = self%n
    call room%field(about, all_rows)
    if (about%kept) all_rows(self%rows, :) = values
    call move_alloc(all_rows, values)
  end subroutine scatter_2

  subroutine clear_1(self, about, values)
    class(clearing_t),     intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    values(self%rows) = about%unloaded(1)
  end subroutine clear_1

  subroutine clear_2(self, about, values)
    class(clearing_t),     intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)
    integer :: k

    do k = 1, about%width()
      values(self%rows, k) = about%unloaded(k)
    end do
  end subroutine clear_2

  subroutine count_1(self, about, values)
    class(counting_t),     intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:)

    self%numbers = self%numbers + merge(1, about%width(), allocated(values))
  end subroutine count_1

  subroutine count_2(self, about, values)
    class(counting_t),     intent(inout) :: self
    type(state_field_t),   intent(in)    :: about
    real(wp), allocatable, intent(inout) :: values(:, :)

    if (allocated(values)) then
      self%numbers = self%numbers + size(values, 2)
    else
      self%numbers = self%numbers + about%width()
    end if
  end subroutine count_2

end module pd_fields
