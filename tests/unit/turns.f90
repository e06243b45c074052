!> The eight maps of a square lattice onto itself, for suites that turn and reflect bodies.
module turns
  use pd_kinds, only: wp
  implicit none
  private

  public :: turn_t, turn_number, turned, all_turned

  !> Axes change places, or are reflected about half of a width.
  type :: turn_t
    integer  :: axis(2)             !! where the axes go
    integer  :: direction(2)        !! -1: this axis is reflected
    real(wp) :: width = 20.0_wp     !! [spacings]
  end type turn_t

contains

  !> Turn number k, from 0 to 7; 0 changes nothing.
  pure type(turn_t) function turn_number(k) result(turn)
    integer, intent(in) :: k

    turn%axis = merge([2, 1], [1, 2], btest(k, 2))
    turn%direction = [merge(-1, 1, btest(k, 0)), merge(-1, 1, btest(k, 1))]
  end function turn_number

  !> Where a place goes.
  pure function turned(turn, x) result(y)
    type(turn_t), intent(in) :: turn
    real(wp),     intent(in) :: x(2)   !! [spacings]
    real(wp) :: y(2)

    y(turn%axis) = turn%direction * x + merge(turn%width, 0.0_wp, turn%direction < 0)
  end function turned

  !> Where the vertices of a polygon go.
  pure function all_turned(turn, vertices) result(images)
    type(turn_t), intent(in) :: turn
    real(wp),     intent(in) :: vertices(:, :)   !! (2,n) [spacings]
    real(wp) :: images(2, size(vertices, 2))
    integer  :: k

    do k = 1, size(vertices, 2)
      images(:, k) = turned(turn, vertices(:, k))
    end do
  end function all_turned

end module turns
