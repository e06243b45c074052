!> Which rows of the fields belong to which material, and what the materials are.
!>
!> A block is divided into runs of rows of one material. If a body has one material, a block is one
!> run.
module pd_material_rows
  use pd_blocks, only: blocks_t
  use pd_kinds, only: n_block, wp
  use pd_law, only: law_t
  use pd_measure, only: measure_t
  use pd_stretches, only: stretches_t
  implicit none
  private

  public :: material_t, material_rows_t, run_t, divide_into_runs, leave_out_gaps

  !> One material. Its strength belongs to the points.
  type :: material_t
    character(:), allocatable :: name
    class(law_t), allocatable :: law
    class(measure_t), allocatable :: measure
    real(wp) :: density = 0.0_wp          !! rho [kg/m^3]
    real(wp) :: youngs_modulus = 0.0_wp   !! E [Pa]
  end type material_t

  !> Rows of one block that have one material.
  type :: run_t
    integer :: lo = 1, hi = 0
    integer :: material = 1
  end type run_t

  type :: material_rows_t
    type(material_t), allocatable :: list(:)
    type(run_t),      allocatable :: runs(:)
    integer,          allocatable :: first_run(:)   !! of each block, one past the last (blocks+1)
    type(run_t),      allocatable :: parts(:)       !! of the runs, where they hold points
    integer,          allocatable :: first_part(:)  !! of each run, one past the last (runs+1)
    logical,          allocatable :: used(:)        !! which materials any rank has; not
                                                    !! allocated: those of the runs
    logical :: has_gaps = .false.                   !! parts are less than the runs
    !> Stiffness of the rows over that of their material (n); not allocated: 1 everywhere.
    real(wp),         allocatable :: stiffness(:)
  contains
    procedure :: clear_gaps
    procedure :: density_block
    procedure :: is_used
    procedure :: wave_speed
    procedure :: density_of
    procedure :: rows_of
    procedure :: material_of
    procedure :: youngs_modulus_of
  end type material_rows_t

contains

  !> Divide the blocks into runs.
  subroutine divide_into_runs(blocks, material_of, materials)
    type(blocks_t), intent(in) :: blocks
    integer,        intent(in) :: material_of(:)     !! (n)
    class(material_rows_t), intent(inout) :: materials
    integer :: block, i, n, pass

    allocate (materials%first_run(blocks%count + 1))
    do pass = 1, 2   ! count, then fill
      n = 0
      do block = 1, blocks%count
        materials%first_run(block) = n + 1
        do i = blocks%lo(block), blocks%hi(block)
          if (i == blocks%lo(block)) then
            n = n + 1
          else if (material_of(i) /= material_of(i - 1)) then
            n = n + 1
          else if (pass == 2) then
            materials%runs(n)%hi = i
          end if
          if (pass == 1) cycle
          if (materials%runs(n)%hi < i) materials%runs(n) = run_t(i, i, material_of(i))
        end do
      end do
      materials%first_run(blocks%count + 1) = n + 1
      if (pass == 1) allocate (materials%runs(n))
    end do
    allocate (materials%parts(n), source=materials%runs)
    allocate (materials%first_part(n + 1), source=[(i, i=1, n + 1)])
  end subroutine divide_into_runs

  !> Kernels pass over what lies between the stretches of rows that hold points.
  subroutine leave_out_gaps(stretches, materials)
    type(stretches_t), intent(in) :: stretches
    class(material_rows_t), intent(inout) :: materials
    integer :: k, n, pass, r

    materials%has_gaps = stretches%has_gaps
    if (.not. stretches%has_gaps) return
    deallocate (materials%parts)
    do pass = 1, 2   ! count, then fill
      n = 0
      do r = 1, size(materials%runs)
        materials%first_part(r) = n + 1
        associate (run => materials%runs(r))
          do k = stretches%from(run%lo), stretches%to(run%hi)
            if (stretches%hi(k) < run%lo .or. stretches%lo(k) > run%hi) cycle
            n = n + 1
            if (pass == 2) materials%parts(n) = run_t(max(run%lo, stretches%lo(k)), &
              min(run%hi, stretches%hi(k)), run%material)
          end do
        end associate
      end do
      materials%first_part(size(materials%runs) + 1) = n + 1
      if (pass == 1) allocate (materials%parts(n))
    end do
  end subroutine leave_out_gaps

  !> Zero in those rows of a block that no part has.
  pure subroutine clear_gaps(self, block, p)
    class(material_rows_t), intent(in) :: self
    integer,  intent(in)    :: block
    real(wp), intent(inout) :: p(n_block, 4)   !! row 1 is the first row of the block
    integer :: c, k, next, shift

    shift = 1 - self%runs(self%first_run(block))%lo
    do c = 1, 4
      next = 1
      do k = self%first_part(self%first_run(block)), self%first_part(self%first_run(block + 1)) - 1
        p(next:self%parts(k)%lo + shift - 1, c) = 0.0_wp
        next = self%parts(k)%hi + shift + 1
      end do
      p(next:, c) = 0.0_wp
    end do
  end subroutine clear_gaps

  !> Density of the rows of a block.
  pure subroutine density_block(self, block, density)
    class(material_rows_t), intent(in) :: self
    integer,  intent(in)    :: block
    real(wp), intent(inout) :: density(n_block)   !! out: rho [kg/m^3]
    integer :: first, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        density(run%lo - first + 1:run%hi - first + 1) = self%list(run%material)%density
      end associate
    end do
  end subroutine density_block

  !> Whether the body has material k anywhere.
  pure logical function is_used(self, k)
    class(material_rows_t), intent(in) :: self
    integer,            intent(in) :: k

    is_used = any(self%runs%material == k)
    if (allocated(self%used)) is_used = self%used(k)
  end function is_used

  !> Largest c_p = sqrt((lambda + 2 G) / rho) of any material that the body has [m/s].
  pure real(wp) function wave_speed(self) result(fastest)
    class(material_rows_t), intent(in) :: self
    real(wp) :: lambda, shear_modulus, factor
    integer  :: k, r

    fastest = 0.0_wp
    do k = 1, size(self%list)
      if (.not. self%is_used(k)) cycle
      call self%list(k)%law%lame_constants(lambda, shear_modulus)
      factor = 1.0_wp
      if (allocated(self%stiffness)) factor = maxval([(maxval(self%stiffness( &
        self%runs(r)%lo:self%runs(r)%hi)), r=1, size(self%runs))], self%runs%material == k)
      fastest = max(fastest, sqrt(factor * (lambda + 2.0_wp * shear_modulus) &
        / self%list(k)%density))
    end do
  end function wave_speed

  !> Density of every row; that of the first material outside of the blocks.
  pure function density_of(self, n) result(density)
    class(material_rows_t), intent(in) :: self
    integer,            intent(in) :: n
    real(wp) :: density(n)   !! rho [kg/m^3]
    integer  :: k

    density = self%list(1)%density
    do k = 1, size(self%runs)
      density(self%runs(k)%lo:self%runs(k)%hi) = self%list(self%runs(k)%material)%density
    end do
  end function density_of

  !> Which of n rows have material k.
  pure function rows_of(self, k, n) result(rows)
    class(material_rows_t), intent(in) :: self
    integer,            intent(in) :: k, n
    logical :: rows(n)
    integer :: r

    rows = .false.
    do r = 1, size(self%runs)
      if (self%runs(r)%material == k) rows(self%runs(r)%lo:self%runs(r)%hi) = .true.
    end do
  end function rows_of

  !> E of some rows.
  pure function youngs_modulus_of(self, rows) result(youngs_modulus)
    class(material_rows_t), intent(in) :: self
    integer,            intent(in) :: rows(:)
    real(wp) :: youngs_modulus(size(rows))   !! [Pa]
    integer  :: i, k

    do i = 1, size(rows)
      k = self%material_of(rows(i))
      youngs_modulus(i) = self%list(k)%youngs_modulus
      if (allocated(self%stiffness)) youngs_modulus(i) = youngs_modulus(i) &
        * self%stiffness(rows(i))
    end do
  end function youngs_modulus_of

  !> The material of a row; runs are in ascending order.
  pure integer function material_of(self, row) result(k)
    class(material_rows_t), intent(in) :: self
    integer,            intent(in) :: row
    integer :: low, high, middle

    low = 1
    high = size(self%runs)
    do while (low < high)
      middle = (low + high + 1) / 2
      if (self%runs(middle)%lo <= row) then
        low = middle
      else
        high = middle - 1
      end if
    end do
    k = self%runs(low)%material
  end function material_of

end module pd_material_rows
