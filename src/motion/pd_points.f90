!> What does not change at the points, in the rows of the fields.
module pd_points
  use pd_kinds, only: wp
  implicit none
  private

  public :: points_t, probe_t

  !> A row without a point has volume 0, is not free, and does not belong to the body.
  type :: points_t
    real(wp), allocatable :: position(:, :)   !! X (n,2) [m]
    real(wp), allocatable :: volume(:)        !! V (n) [m^2]
    real(wp), allocatable :: free(:, :)       !! 1: moves freely, 0: prescribed component (n,2)
    real(wp), allocatable :: place(:)         !! between the ends of the damping's frame, 0 to 1 (n)
    real(wp), allocatable :: in_body(:)       !! 1: body, 0: fictitious point (n)
    real(wp) :: all_volume = 0.0_wp           !! of all points, on any rank [m^2]
    real(wp) :: largest_volume = 0.0_wp       !! of any of them [m^2]
  end type points_t

  !> A point whose displacement and stress the history follows.
  type :: probe_t
    character(:), allocatable :: name
    integer  :: row = 0                       !! of the fields
    integer  :: material = 0                  !! its number
    real(wp) :: distance = 0.0_wp             !! from where it was asked for [m]
  end type probe_t

end module pd_points
