!> The body: reference points, their volumes, and the sets of fictitious points.
!>
!> A number per point is kept for a cloud, and for a lattice in a model that looks far around. Any
!> other lattice is kept in runs, and says what a point is when it is asked.
!> Source: doc/theory.md, sections 1 and 7.
module pd_body
  use pd_kinds, only: l1, wp
  use pd_point_sets, only: side_t
  use pd_runs, only: runs_of, runs_t
  use pd_sides, only: side_count
  implicit none
  private

  public :: body_t, grid_t

  !> Where the places of a lattice are.
  type :: grid_t
    real(wp) :: origin(2) = 0.0_wp              !! of lattice line 0, 0 [m]
    real(wp) :: offset = 0.0_wp                 !! of place 0 from there [spacings]
    real(wp) :: spacing = 0.0_wp                !! dx [m]
  contains
    procedure :: position => position_of_place
  end type grid_t

  !> Reference points in the order of the rows of the lattice (y slow, x fast), or of the file.
  !> Where the points are in runs no array with a number per point is allocated.
  type :: body_t
    integer :: n = 0                            !! points, fictitious ones included
    type(runs_t) :: runs                        !! n = 0: the points are in arrays
    type(grid_t) :: grid                        !! of a lattice
    real(wp), allocatable :: position(:, :)     !! X (n,2) [m]
    real(wp), allocatable :: volume(:)          !! V (n) per unit thickness [m^2]
    integer,  allocatable :: boundary(:)        !! 0: body, k: fictitious point of boundary k (n)
    integer,  allocatable :: part(:)            !! number of the shape that a point lies in, or
                                                !! that its layer continues (n)
    integer,  allocatable :: place(:, :)        !! column and row on the lattice (n,2); not
                                                !! allocated: no lattice
    integer,  allocatable :: box(:, :)          !! lowest and highest column and row of the points
                                                !! of all stages (2,2); not allocated: no stages
    real(wp) :: lower(2) = 0.0_wp               !! corners of the extent of the body without
    real(wp) :: upper(2) = 0.0_wp               !! fictitious points, as used [m]
    logical(l1), allocatable :: filled(:, :)    !! square above and right of the lattice line at a
                                                !! place is material, layers included (columns,
                                                !! rows of places, with a margin); not for a cloud,
                                                !! and not for points in runs
    type(side_t) :: sides(side_count)           !! by number (`pd_sides`); not for a cloud
  contains
    procedure :: on_lattice
    procedure :: boundary_of
    procedure :: part_of
    procedure :: volume_of
    procedure :: position_of
    procedure :: positions
    procedure :: boundaries
    procedure :: parts
    procedure :: volumes
    procedure :: points_of
    procedure :: points_beside
    procedure :: add_up
    procedure :: in_runs
    procedure :: keep_in_runs
  end type body_t

contains

  !> Reference position of a place [m].
  pure function position_of_place(self, place) result(position)
    class(grid_t), intent(in) :: self
    integer,       intent(in) :: place(2)   !! column and row
    real(wp) :: position(2)

    position = self%origin + (real(place, wp) + self%offset) * self%spacing
  end function position_of_place

  !> Whether the points are places of a lattice.
  pure logical function on_lattice(self)
    class(body_t), intent(in) :: self

    on_lattice = allocated(self%place) .or. self%runs%n > 0
  end function on_lattice

  !> The points in runs.
  pure type(runs_t) function in_runs(self) result(runs)
    class(body_t), intent(in) :: self   !! a lattice

    if (allocated(self%place)) then
      runs = runs_of(self%place, self%volume, self%boundary, self%part)
    else
      runs = self%runs
    end if
  end function in_runs

  !> Boundary of a point; 0: body.
  elemental integer function boundary_of(self, point) result(boundary)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: point

    if (allocated(self%boundary)) then
      boundary = self%boundary(point)
    else
      boundary = self%runs%boundary(self%runs%run_of(point))
    end if
  end function boundary_of

  !> Number of the shape of a point.
  elemental integer function part_of(self, point) result(part)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: point

    if (allocated(self%part)) then
      part = self%part(point)
    else
      part = self%runs%part(self%runs%run_of(point))
    end if
  end function part_of

  !> Volume of a point [m^2].
  elemental real(wp) function volume_of(self, point) result(volume)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: point

    if (allocated(self%volume)) then
      volume = self%volume(point)
    else
      volume = self%runs%volume(self%runs%run_of(point))
    end if
  end function volume_of

  !> Reference position of a point [m].
  pure function position_of(self, point) result(position)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: point
    real(wp) :: position(2)

    if (allocated(self%position)) then
      position = self%position(point, :)
    else
      position = self%grid%position(self%runs%place_of(point))
    end if
  end function position_of

  !> Reference positions of the points between two [m].
  pure function positions(self, ends)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: ends(2)   !! first and last point
    real(wp) :: positions(max(0, ends(2) - ends(1) + 1), 2)
    integer  :: i, k

    if (allocated(self%position)) then
      positions = self%position(ends(1):ends(2), :)
      return
    end if
    associate (runs => self%runs)
      do k = runs%run_of(ends(1)), runs%run_of(ends(2))
        do i = max(ends(1), runs%first(k)), min(ends(2), runs%first(k + 1) - 1)
          positions(i - ends(1) + 1, :) = self%grid%position(runs%place(:, k) &
            + [i - runs%first(k), 0])
        end do
      end do
    end associate
  end function positions

  !> Boundaries of the points between two.
  pure function boundaries(self, ends)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: ends(2)
    integer, allocatable :: boundaries(:)

    if (allocated(self%boundary)) then
      boundaries = self%boundary(ends(1):ends(2))
    else
      boundaries = of_points(self%runs, self%runs%boundary, ends)
    end if
  end function boundaries

  !> Numbers of the shapes of the points between two.
  pure function parts(self, ends)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: ends(2)
    integer, allocatable :: parts(:)

    if (allocated(self%part)) then
      parts = self%part(ends(1):ends(2))
    else
      parts = of_points(self%runs, self%runs%part, ends)
    end if
  end function parts

  !> Volumes of the points between two [m^2].
  pure function volumes(self, ends)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: ends(2)
    real(wp) :: volumes(max(0, ends(2) - ends(1) + 1))
    integer  :: k

    if (allocated(self%volume)) then
      volumes = self%volume(ends(1):ends(2))
      return
    end if
    associate (runs => self%runs)
      do k = runs%run_of(ends(1)), runs%run_of(ends(2))
        volumes(max(ends(1), runs%first(k)) - ends(1) + 1: &
          min(ends(2), runs%first(k + 1) - 1) - ends(1) + 1) = runs%volume(k)
      end do
    end associate
  end function volumes

  !> What the points between two have that their runs have.
  pure function of_points(runs, numbers, ends) result(values)
    type(runs_t), intent(in) :: runs
    integer,      intent(in) :: numbers(:)   !! of the runs
    integer,      intent(in) :: ends(2)
    integer :: values(max(0, ends(2) - ends(1) + 1)), k

    do k = runs%run_of(ends(1)), runs%run_of(ends(2))
      values(max(ends(1), runs%first(k)) - ends(1) + 1: &
        min(ends(2), runs%first(k + 1) - 1) - ends(1) + 1) = numbers(k)
    end do
  end function of_points

  !> The points of a boundary, ascending; 0: those of the body.
  pure function points_of(self, boundary) result(points)
    class(body_t), intent(in) :: self
    integer,       intent(in) :: boundary
    integer, allocatable :: points(:)
    integer :: i

    if (allocated(self%boundary)) then
      points = pack([(i, i=1, self%n)], self%boundary == boundary)
    else
      points = self%runs%points_of([boundary, boundary])
    end if
  end function points_of

  !> The points of all boundaries, ascending.
  pure function points_beside(self) result(points)
    class(body_t), intent(in) :: self
    integer, allocatable :: points(:)
    integer :: i

    if (allocated(self%boundary)) then
      points = pack([(i, i=1, self%n)], self%boundary > 0)
    else
      points = self%runs%points_of([1, huge(1)])
    end if
  end function points_beside

  !> Volume of all points, added one by one, and the largest of any.
  pure subroutine add_up(self, volume, largest)
    class(body_t), intent(in)  :: self
    real(wp),      intent(out) :: volume, largest   !! [m^2]
    integer :: i, k

    if (allocated(self%volume)) then
      volume = sum(self%volume)
      largest = maxval(self%volume)
      return
    end if
    volume = 0.0_wp
    associate (runs => self%runs)
      do k = 1, runs%count
        do i = runs%first(k), runs%first(k + 1) - 1
          volume = volume + runs%volume(k)
        end do
      end do
      largest = maxval(runs%volume(:runs%count))
    end associate
  end subroutine add_up

  !> Keep the points of a lattice in runs, and give back what had a number for each.
  pure subroutine keep_in_runs(self)
    class(body_t), intent(inout) :: self

    if (.not. allocated(self%place)) return
    self%runs = self%in_runs()
    deallocate (self%position, self%volume, self%boundary, self%part, self%place)
    if (allocated(self%filled)) deallocate (self%filled)
  end subroutine keep_in_runs

end module pd_body
