!> The values of an input file, as checked: what `pd_input` fills and `pd_setup` translates.
!>
!> Every component carries the name of its key. Numbers without a default hold `unset` until the
!> file gives them; `doc/input.md` says what each means.
module pd_input_types
  use pd_kinds, only: unset, wp
  implicit none
  private

  public :: input_t, run_input_t, discretisation_input_t, body_input_t, material_input_t
  public :: boundary_input_t, stabilisation_input_t, integration_input_t, imperfection_input_t
  public :: random_field_input_t, output_input_t, pressure_input_t

  type :: run_input_t
    character(:), allocatable :: title, name, output_dir
    character(:), allocatable :: operators              !! auto, lattice or list
  end type run_input_t

  type :: discretisation_input_t
    real(wp) :: spacing = unset                        !! [m]
    real(wp) :: horizon = unset                        !! [m]
    character(:), allocatable :: layout, volumes, influence, fit
  end type discretisation_input_t

  type :: body_input_t
    character(:), allocatable :: shape, file           !! file: as in the input, relative to it
    real(wp) :: x_min = unset, x_max = unset, y_min = unset, y_max = unset   !! [m]
  end type body_input_t

  type :: material_input_t
    character(:), allocatable :: model, strain_measure
    real(wp) :: density = unset                        !! [kg/m^3]
    real(wp) :: youngs_modulus = unset                 !! [Pa]
    real(wp) :: poissons_ratio = unset
    real(wp) :: yield_stress = unset                   !! [Pa]
    real(wp) :: kinematic_modulus = 0.0_wp             !! H_k [Pa]
    real(wp) :: isotropic_modulus = 0.0_wp             !! H_i [Pa]
    real(wp) :: residual_strength = unset              !! sigma_r [Pa]
  end type material_input_t

  type :: boundary_input_t
    character(:), allocatable :: name, side, contact   !! side: '' where a point cloud names it
    real(wp) :: velocity(2) = 0.0_wp                   !! [m/s]
    real(wp), allocatable :: times(:)                  !! [s]; size 0: no table
    real(wp), allocatable :: velocities_x(:), velocities_y(:)   !! [m/s]; size 0: zero
    real(wp) :: velocity_gradient(4) = 0.0_wp          !! xx, xy, yx, yy [1/s]
    real(wp), allocatable :: factors(:)                !! size 0: 1 at all times
    real(wp), allocatable :: traction(:)               !! x, y [Pa]; size 0: motion prescribed
    real(wp) :: ramp_time = 0.0_wp                     !! of the traction [s]
  end type boundary_input_t

  type :: pressure_input_t
    character(:), allocatable :: name, side
    real(wp), allocatable :: span(:)                   !! from, to [m]; size 0: the whole side
    real(wp) :: value = unset                          !! [Pa]
    real(wp) :: ramp_time = 0.0_wp                     !! [s]
  end type pressure_input_t

  type :: stabilisation_input_t
    character(:), allocatable :: method
    real(wp) :: factor = 0.0_wp
  end type stabilisation_input_t

  type :: integration_input_t
    real(wp) :: end_time = unset                       !! [s]
    real(wp) :: final_strain = unset
    character(:), allocatable :: time_step_rule
    real(wp) :: time_step = unset                      !! [s]
    real(wp) :: safety = 0.9_wp
    real(wp) :: damping = 0.0_wp                       !! C [kg/(m^3 s)]
    character(:), allocatable :: damping_frame
  end type integration_input_t

  type :: imperfection_input_t
    real(wp) :: amplitude = 0.0_wp
    real(wp) :: x = 0.0_wp, y = 0.0_wp, radius = 0.0_wp   !! [m]
  end type imperfection_input_t

  type :: random_field_input_t
    real(wp) :: coefficient_of_variation = unset       !! unset: no field
    real(wp) :: correlation_length = unset             !! [m]
    integer  :: seed = 1
  end type random_field_input_t

  type :: output_input_t
    real(wp), allocatable :: frame_strains(:)          !! size 0: not given
    real(wp), allocatable :: frame_times(:)            !! [s]; size 0: not given
    integer  :: frame_count = 0                        !! 0: not given
    integer  :: history_count = 1000
    real(wp) :: checkpoint_every = 0.0_wp              !! wall seconds
  end type output_input_t

  type :: input_t
    character(:), allocatable    :: path               !! of the input file
    character(:), allocatable    :: text               !! the input file, byte for byte
    type(run_input_t)            :: run
    type(discretisation_input_t) :: discretisation
    type(body_input_t),     allocatable :: bodies(:)
    type(material_input_t)       :: material
    type(boundary_input_t), allocatable :: boundaries(:)
    type(pressure_input_t), allocatable :: pressures(:)
    type(stabilisation_input_t)  :: stabilisation
    type(integration_input_t)    :: integration
    type(imperfection_input_t)   :: imperfection
    type(random_field_input_t)   :: random_field
    type(output_input_t)         :: output
    !> Index into `boundaries` of the platens: two boundaries that cover opposite sides whole, with
    !> none on the other two sides; 0, 0 where there are none. The first is 'bottom' or 'left'.
    integer :: platens(2) = 0
  end type input_t

end module pd_input_types
