!> Where a cloud of points ends, found from its families alone; fields smoothed along its surface.
!>
!> A point is bare if a third of the directions around it holds no bond. What is within a horizon,
!> less half the distance of points, of a bare point has a family that is cut off.
!> Source: doc/theory.md, section 4.
module pd_surface
  use pd_bond_list, only: bond_list_t
  use pd_kinds, only: i8, pi, wp
  implicit none
  private

  public :: find_bare_points, find_near, find_two_families_near, smooth_along_surface

contains

  !> Which points are bare.
  subroutine find_bare_points(list, bare)
    type(bond_list_t), intent(in) :: list
    logical, intent(out) :: bare(:)   !! (n)
    integer, parameter :: sectors = 72
    logical     :: held(2 * sectors)
    real(wp)    :: turn
    integer     :: i, j, sector, empty, longest
    integer(i8) :: b

    !$omp parallel do schedule(static) default(none) shared(list, bare) &
    !$omp private(i, j, b, held, turn, sector, empty, longest)
    do i = 1, list%n
      held = .false.
      do b = list%first(i), list%first(i + 1) - 1
        j = list%neighbour(b)
        turn = atan2(list%position(j, 2) - list%position(i, 2), &
          list%position(j, 1) - list%position(i, 1)) / (2.0_wp * pi)
        sector = 1 + modulo(floor(real(sectors, wp) * turn), sectors)
        held(sector) = .true.
        held(sector + sectors) = .true.   ! once round and back to where it began
      end do
      longest = 0
      empty = 0
      do sector = 1, 2 * sectors
        empty = merge(0, empty + 1, held(sector))
        longest = max(longest, empty)
      end do
      bare(i) = 3 * (longest + 1) >= sectors
    end do
    !$omp end parallel do
  end subroutine find_bare_points

  !> Points that are marked, or have a marked point so near that their family ends there.
  subroutine find_near(list, volume, delta, marked, near)
    type(bond_list_t), intent(in) :: list
    real(wp), intent(in)  :: volume(:)   !! V (n) [m^2]
    real(wp), intent(in)  :: delta       !! horizon [m]
    logical,  intent(in)  :: marked(:)   !! (n)
    logical,  intent(out) :: near(:)     !! (n)
    integer     :: i, j
    integer(i8) :: b

    do i = 1, list%n
      near(i) = marked(i)
      do b = list%first(i), list%first(i + 1) - 1
        j = list%neighbour(b)
        if (marked(j)) near(i) = near(i) .or. norm2(list%position(j, :) - list%position(i, :)) &
          <= delta - 0.5_wp * sqrt(volume(i))
      end do
    end do
  end subroutine find_near

  !> Points that are marked, or whose family or the family of one of its members holds a marked one.
  subroutine find_two_families_near(list, marked, near)
    type(bond_list_t), intent(in) :: list
    logical, intent(in)  :: marked(:)   !! (n)
    logical, intent(out) :: near(:)     !! (n)
    logical, allocatable :: once(:)
    integer :: i

    allocate (once(list%n))
    do i = 1, list%n
      once(i) = marked(i) .or. any(marked(list%neighbour(list%first(i):list%first(i + 1) - 1)))
    end do
    do i = 1, list%n
      near(i) = once(i) .or. any(once(list%neighbour(list%first(i):list%first(i + 1) - 1)))
    end do
  end subroutine find_two_families_near

  !> Spread what each point of a zone has over its family in the zone. Every giver keeps the sum and
  !> the first moments of what it gives; a giver whose family in the zone lies on a line keeps all.
  !>
  !>   N_i <- sum_j omega V_j s_j (1 - mu_j . C_j^-1 (d - mu_j)) N_j     d = X_i - X_j, j = i too
  !>
  !> with the weight 1 / s_j, the mean mu_j of d and its covariance C_j over that family.
  subroutine smooth_along_surface(list, volume, delta, zone, field)
    type(bond_list_t), intent(in) :: list
    real(wp), intent(in)    :: volume(:)     !! V (n) [m^2]
    real(wp), intent(in)    :: delta         !! horizon [m]
    logical,  intent(in)    :: zone(:)       !! (n)
    real(wp), intent(inout) :: field(:, :)   !! per volume; 0 outside of the zone (n,2)
    real(wp), allocatable :: tilt(:, :), before(:, :)
    real(wp)    :: part, d(2)
    integer     :: i, j
    integer(i8) :: b

    allocate (tilt(list%n, 3), before(list%n, 2))
    call find_tilts(list, volume, delta, zone, tilt)
    before = field
    do i = 1, list%n
      if (.not. zone(i)) cycle
      field(i, :) = merge(volume(i) * tilt(i, 1), 1.0_wp, tilt(i, 1) > 0.0_wp) * before(i, :)
      do b = list%first(i), list%first(i + 1) - 1
        j = list%neighbour(b)
        if (.not. zone(j)) cycle
        d = list%position(i, :) - list%position(j, :)
        part = list%weight(b) * (tilt(j, 1) + tilt(j, 2) * d(1) + tilt(j, 3) * d(2))
        field(i, :) = field(i, :) + part * before(j, :)
      end do
    end do
  end subroutine smooth_along_surface

  !> What a giver gives at the distance d, per omega V: tilt(1) + tilt(2:3) . d; 0: it keeps all.
  subroutine find_tilts(list, volume, delta, zone, tilt)
    type(bond_list_t), intent(in) :: list
    real(wp), intent(in)  :: volume(:), delta
    logical,  intent(in)  :: zone(:)
    real(wp), intent(out) :: tilt(:, :)   !! (n,3)
    !> Least variance across a line of points, over delta^2.
    real(wp), parameter :: flat = 1.0e-3_wp
    real(wp)    :: weight, mu(2), c(3), d(2), w, determinant, slope(2)
    integer     :: i, j
    integer(i8) :: b

    tilt = 0.0_wp
    do j = 1, list%n
      if (.not. zone(j)) cycle
      weight = volume(j)   ! the giver is in its own family, omega = 1
      mu = 0.0_wp
      c = 0.0_wp
      do b = list%first(j), list%first(j + 1) - 1
        i = list%neighbour(b)
        if (.not. zone(i)) cycle
        d = list%position(i, :) - list%position(j, :)
        w = list%weight(b)   ! omega V_i
        weight = weight + w
        mu = mu + w * d
        c = c + w * [d(1)**2, d(2)**2, d(1) * d(2)]
      end do
      mu = mu / weight
      c = c / weight - [mu(1)**2, mu(2)**2, mu(1) * mu(2)]
      determinant = c(1) * c(2) - c(3)**2
      ! the smaller eigenvalue is at least determinant / trace
      if (determinant <= flat * delta**2 * (c(1) + c(2))) cycle
      slope = [c(2) * mu(1) - c(3) * mu(2), c(1) * mu(2) - c(3) * mu(1)] / determinant
      tilt(j, 1) = (1.0_wp + dot_product(mu, slope)) / weight
      tilt(j, 2:3) = -slope / weight
    end do
  end subroutine find_tilts

end module pd_surface
