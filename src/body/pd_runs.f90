!> The points of a lattice in runs: pieces of its lines whose points lie side by side and are alike.
!>
!> A body has few runs per line, so every rank can know all of them where it has no memory for all
!> points.
module pd_runs
  use pd_kinds, only: wp
  implicit none
  private

  public :: runs_t, runs_of

  !> Runs in the order of their points: line by line, each from its lowest column.
  type :: runs_t
    integer :: n = 0                           !! points
    integer :: count = 0                       !! runs; there may be room for more
    integer,  allocatable :: first(:)          !! number of the first point (runs + 1): n + 1 last
    integer,  allocatable :: place(:, :)       !! column and row of the first point (2,runs)
    integer,  allocatable :: boundary(:)       !! 0: body, k: boundary k (runs)
    integer,  allocatable :: part(:)           !! number of the shape (runs)
    real(wp), allocatable :: volume(:)         !! V of each point (runs) [m^2]
  contains
    procedure :: append
    procedure :: run_of
    procedure :: place_of
    procedure :: points_of
    procedure :: lowest
    procedure :: highest
    procedure, private :: make_room
  end type runs_t

contains

  !> The runs of points that are given one by one, line by line.
  pure type(runs_t) function runs_of(place, volume, boundary, part) result(runs)
    integer,  intent(in) :: place(:, :)            !! column and row of every point (n,2)
    real(wp), intent(in) :: volume(:)              !! V (n) [m^2]
    integer, optional, intent(in) :: boundary(:)   !! absent: 0 (n)
    integer, optional, intent(in) :: part(:)       !! absent: 1 (n)
    integer :: i, kind(2)

    kind = [0, 1]
    do i = 1, size(volume)
      if (present(boundary)) kind(1) = boundary(i)
      if (present(part)) kind(2) = part(i)
      call runs%append(place(i, :), volume(i), kind(1), kind(2))
    end do
  end function runs_of

  !> One more point: of the last run, or of a new one.
  pure subroutine append(self, place, volume, boundary, part)
    class(runs_t), intent(inout) :: self
    integer,       intent(in)    :: place(2)         !! behind that of the last point
    real(wp),      intent(in)    :: volume           !! [m^2]
    integer,       intent(in)    :: boundary, part
    logical :: goes_on

    goes_on = .false.
    if (self%count > 0) then
      associate (k => self%count)
        goes_on = all(place == self%place(:, k) + [self%n + 1 - self%first(k), 0]) &
          .and. boundary == self%boundary(k) .and. part == self%part(k) &
          .and. .not. abs(volume - self%volume(k)) > 0.0_wp
      end associate
    end if
    if (.not. goes_on) then
      call self%make_room()
      self%count = self%count + 1
      self%first(self%count) = self%n + 1
      self%place(:, self%count) = place
      self%boundary(self%count) = boundary
      self%part(self%count) = part
      self%volume(self%count) = volume
    end if
    self%n = self%n + 1
    self%first(self%count + 1) = self%n + 1
  end subroutine append

  !> Make room for one more run, and for as many again as there are.
  pure subroutine make_room(self)
    class(runs_t), intent(inout) :: self
    integer :: room, k

    if (.not. allocated(self%first)) then
      allocate (self%first(2), self%place(2, 1), self%boundary(1), self%part(1), self%volume(1))
    else if (self%count == size(self%part)) then
      room = 2 * self%count
      self%place = reshape([self%place, self%place], [2, room])
      self%boundary = [self%boundary, self%boundary]
      self%part = [self%part, self%part]
      self%volume = [self%volume, self%volume]
      self%first = [self%first, (0, k=1, self%count)]
    end if
  end subroutine make_room

  !> Number of the run of a point.
  elemental integer function run_of(self, point) result(run)
    class(runs_t), intent(in) :: self
    integer,       intent(in) :: point
    integer :: behind, middle

    run = 1
    behind = self%count + 1
    do while (behind - run > 1)
      middle = (run + behind) / 2
      if (self%first(middle) <= point) then
        run = middle
      else
        behind = middle
      end if
    end do
  end function run_of

  !> Column and row of a point.
  pure function place_of(self, point) result(place)
    class(runs_t), intent(in) :: self
    integer,       intent(in) :: point
    integer :: place(2), run

    run = self%run_of(point)
    place = self%place(:, run) + [point - self%first(run), 0]
  end function place_of

  !> The points of some boundaries, in their order.
  pure function points_of(self, boundaries) result(points)
    class(runs_t), intent(in) :: self
    integer,       intent(in) :: boundaries(2)   !! first and last
    integer, allocatable :: points(:)
    integer :: i, k, n, pass

    do pass = 1, 2   ! count, then fill
      n = 0
      do k = 1, self%count
        if (self%boundary(k) < boundaries(1) .or. self%boundary(k) > boundaries(2)) cycle
        associate (a => self%first(k), b => self%first(k + 1) - 1)
          if (pass == 2) points(n + 1:n + b - a + 1) = [(i, i=a, b)]
          n = n + b - a + 1
        end associate
      end do
      if (pass == 1) allocate (points(n))
    end do
  end function points_of

  !> Lowest column and row of any point.
  pure function lowest(self)
    class(runs_t), intent(in) :: self
    integer :: lowest(2)

    lowest = minval(self%place(:, :self%count), dim=2)
  end function lowest

  !> Highest column and row of any point.
  pure function highest(self)
    class(runs_t), intent(in) :: self
    integer :: highest(2)

    associate (n => self%count)
      highest = maxval(self%place(:, :n), dim=2)
      highest(1) = maxval(self%place(1, :n) + self%first(2:n + 1) - self%first(:n)) - 1
    end associate
  end function highest

end module pd_runs
