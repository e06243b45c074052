!> The materials of a body: which rows of the fields belong to which material, and how its law and
!> strain measure apply to a block of rows.
!>
!> A block is divided into runs of rows of one material. If a body has one material, a block is
!> one run; where materials meet, each law works on its own runs.
!> Source: doc/theory.md, sections 2 and 3.
module pd_materials
  use pd_elastic, only: isotropic_stress_block
  use pd_flow, only: flow_t
  use pd_graded, only: graded_energy_block, graded_heat_block, graded_stress_block
  use pd_kinds, only: n_block, wp
  use pd_labels, only: label_t
  use pd_law, only: law_points_t
  use pd_material_rows, only: divide_into_runs, leave_out_gaps, material_rows_t, material_t, run_t
  use pd_measure, only: n_kept, small_strain_block
  use pd_tensors, only: determinant
  implicit none
  private

  public :: material_t, materials_t, run_t, divide_into_runs, leave_out_gaps

  type, extends(material_rows_t) :: materials_t
  contains
    procedure :: remembered
    procedure :: stress_block
    procedure :: linear_stress_block
    procedure :: next_stress_block
    procedure :: stiffening
    procedure :: strain_block
    procedure :: first_piola_block
    procedure :: cauchy_block
    procedure :: energy_block
    procedure :: heat_block
    procedure :: plastic_strain_block
    procedure, private :: law_block
  end type materials_t

contains

  !> Columns of the history: those of the law that remembers most. Where laws differ, a column
  !> has a meaning for each law, and carries both names.
  pure function remembered(self) result(columns)
    class(materials_t), intent(in) :: self
    type(label_t), allocatable :: columns(:), more(:)
    integer :: c, k

    columns = self%list(1)%law%remembers()
    do k = 2, size(self%list)
      more = self%list(k)%law%remembers()
      do c = 1, min(size(columns), size(more))
        if (columns(c)%name == more(c)%name) cycle
        columns(c) = label_t(trim(columns(c)%name)//'_or_'//trim(more(c)%name), '1', &
          trim(columns(c)%description)//', or '//trim(more(c)%description))
      end do
      if (size(more) > size(columns)) columns = [columns, more(size(columns) + 1:)]
    end do
  end function remembered

  !> From H to the first Piola stress of a block: strain, law, and the stress conjugate to it. The
  !> history goes from step n to n+1.
  pure subroutine stress_block(self, block, h, points, p, flow)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)     !! H (n,4) xx xy yx yy
    type(law_points_t), intent(inout) :: points
    real(wp), intent(inout) :: p(n_block, 4)        !! out: P xx xy yx yy [Pa]; holds the strain
                                                    !! first, to save room in the cache
    type(flow_t), intent(inout) :: flow             !! out: of all rows of the block
    type(flow_t) :: part
    real(wp)     :: kept(n_block, n_kept)
    integer      :: first, k

    first = self%runs(self%first_run(block))%lo
    flow%n = 0
    if (self%has_gaps) call self%clear_gaps(block, p)
    do k = self%first_part(self%first_run(block)), self%first_part(self%first_run(block + 1)) - 1
      associate (run => self%parts(k), material => self%list(self%parts(k)%material))
        call material%measure%strain_block(first, run%lo, run%hi, h, p, kept)
        if (allocated(points%initial_strain)) &
          call add_strain(first, run%lo, run%hi, points%initial_strain, p)
        if (k == self%first_part(self%first_run(block))) then
          call self%law_block(run, first, p, points, flow)
        else
          call self%law_block(run, first, p, points, part)
          call flow%append(part)
        end if
        call material%measure%first_piola_block(first, run%lo, run%hi, h, points%stress, kept, &
          p)
      end associate
    end do
  end subroutine stress_block

  !> The law of one run.
  pure subroutine law_block(self, run, first, strain, points, flow)
    class(materials_t), intent(in) :: self
    type(run_t),        intent(in) :: run
    integer,            intent(in) :: first
    real(wp), intent(in) :: strain(n_block, 4)   !! row 1 is row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t),       intent(inout) :: flow

    associate (law => self%list(run%material)%law)
      if (allocated(self%stiffness)) then
        call graded_stress_block(law, self%stiffness, [first, run%lo, run%hi], strain, points, flow)
      else
        call law%stress_block(first, run%lo, run%hi, strain, points, flow)
      end if
    end associate
  end subroutine law_block

  !> Add a field of strains in rows lo to hi to those of a block.
  pure subroutine add_strain(first, lo, hi, more, strain)
    integer,  intent(in) :: first, lo, hi
    real(wp), intent(in),    contiguous :: more(:, :)   !! xx yy zz xy (n,4)
    real(wp), intent(inout) :: strain(n_block, 4)       !! row 1 is row `first`
    integer :: c, i, shift

    shift = 1 - first
    do c = 1, 4
      !$omp simd simdlen(8)
      do i = lo, hi
        strain(i + shift, c) = strain(i + shift, c) + more(i, c)
      end do
    end do
  end subroutine add_strain

  !> First Piola stress of a small displacement of the unloaded elastic body.
  pure subroutine linear_stress_block(self, block, h, p)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout) :: p(n_block, 4)      !! out: P xx xy yx yy [Pa]
    real(wp) :: strain(n_block, 4), stress(n_block, 4), lambda, shear_modulus
    integer  :: first, from, to, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        call self%list(run%material)%law%lame_constants(lambda, shear_modulus)
        call small_strain_block(first, run%lo, run%hi, h, strain)
        call isotropic_stress_block(lambda, shear_modulus, first, run%lo, run%hi, strain, stress)
        from = run%lo - first + 1
        to = run%hi - first + 1
        if (allocated(self%stiffness)) stress(from:to, :) = stress(from:to, :) &
          * spread(self%stiffness(run%lo:run%hi), 2, 4)
        p(from:to, 1) = stress(from:to, 1)
        p(from:to, 2) = stress(from:to, 4)
        p(from:to, 3) = stress(from:to, 4)
        p(from:to, 4) = stress(from:to, 2)
      end associate
    end do
  end subroutine linear_stress_block

  !> First Piola stress of a block if its step leads it to H + part dH; the points stay as they are.
  pure subroutine next_stress_block(self, block, points, h, part, dh, p)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    type(law_points_t), intent(in) :: points             !! before the step
    real(wp), intent(in), contiguous :: h(:, :), dh(:, :)   !! (n,4) xx xy yx yy
    real(wp), intent(in)    :: part
    real(wp), intent(inout) :: p(n_block, 4)             !! out: P xx xy yx yy [Pa]
    type(law_points_t) :: after
    type(flow_t) :: flow
    real(wp) :: reached(n_block, 4), kept(n_block, n_kept)
    integer  :: first, from, to, k

    allocate (after%stress(n_block, 4), after%history(n_block, size(points%history, 2)), &
      after%strength(n_block))
    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k), material => self%list(self%runs(k)%material))
        from = run%lo - first + 1
        to = run%hi - first + 1
        after%stress(from:to, :) = points%stress(run%lo:run%hi, :)
        after%history(from:to, :) = points%history(run%lo:run%hi, :)
        after%strength(from:to) = points%strength(run%lo:run%hi)
        reached(from:to, :) = h(run%lo:run%hi, :) + part * dh(run%lo:run%hi, :)
        call material%measure%strain_block(1, from, to, reached, p, kept)
        if (allocated(points%initial_strain)) &
          p(from:to, :) = p(from:to, :) + points%initial_strain(run%lo:run%hi, :)
        if (allocated(self%stiffness)) then
          call graded_stress_block(material%law, self%stiffness(first:run%hi), [1, from, to], p, &
            after, flow)
        else
          call material%law%stress_block(1, from, to, p, after, flow)
        end if
        call material%measure%first_piola_block(1, from, to, reached, after%stress, kept, p)
      end associate
    end do
  end subroutine next_stress_block

  !> Largest modulus of a longitudinal wave in a block over that of the unloaded material.
  pure real(wp) function stiffening(self, block, h, stress) result(largest)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)        !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: stress(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
    real(wp) :: lambda, shear_modulus, factor
    integer  :: k

    largest = 0.0_wp
    factor = 1.0_wp
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k), material => self%list(self%runs(k)%material))
        call material%law%lame_constants(lambda, shear_modulus)
        if (allocated(self%stiffness)) factor = minval(self%stiffness(run%lo:run%hi))
        largest = max(largest, material%measure%stiffening(run%lo, run%hi, h, stress, &
          factor * (lambda + 2.0_wp * shear_modulus)))
      end associate
    end do
  end function stiffening

  !> Stored elastic energy per volume of the rows of a block.
  pure subroutine energy_block(self, block, points, energy)
    class(materials_t), intent(in) :: self
    integer,            intent(in) :: block
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout) :: energy(n_block)   !! out: [J/m^3]
    integer :: k

    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        associate (law => self%list(run%material)%law, &
          rows => [self%runs(self%first_run(block))%lo, run%lo, run%hi])
          if (allocated(self%stiffness)) then
            call graded_energy_block(law, self%stiffness, rows, points, energy)
          else
            call law%energy_block(rows(1), rows(2), rows(3), points, energy)
          end if
        end associate
      end associate
    end do
  end subroutine energy_block

  !> Heat per volume that the flow has made so far, of the rows of a block.
  pure subroutine heat_block(self, block, points, heat)
    class(materials_t), intent(in) :: self
    integer,            intent(in) :: block
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout) :: heat(n_block)   !! out: [J/m^3]
    integer :: k

    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        associate (law => self%list(run%material)%law, &
          rows => [self%runs(self%first_run(block))%lo, run%lo, run%hi])
          if (allocated(self%stiffness)) then
            call graded_heat_block(law, self%stiffness, rows, points, heat)
          else
            call law%heat_block(rows(1), rows(2), rows(3), points, heat)
          end if
        end associate
      end associate
    end do
  end subroutine heat_block

  !> Strain of the rows of a block.
  pure subroutine strain_block(self, block, h, strain)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)   !! H (n,4) xx xy yx yy
    real(wp), intent(inout) :: strain(n_block, 4) !! out: E xx yy zz xy
    real(wp) :: kept(n_block, n_kept)
    integer  :: first, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        call self%list(run%material)%measure%strain_block(first, run%lo, run%hi, h, strain, kept)
      end associate
    end do
  end subroutine strain_block

  !> Strain and first Piola stress of the rows of a block.
  pure subroutine first_piola_block(self, block, h, stress, strain, p)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)        !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: stress(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
    real(wp), intent(inout) :: strain(n_block, 4)      !! out: E xx yy zz xy
    real(wp), intent(inout) :: p(n_block, 4)           !! out: P xx xy yx yy [Pa]
    real(wp) :: kept(n_block, n_kept)
    integer  :: first, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k), measure => self%list(self%runs(k)%material)%measure)
        call measure%strain_block(first, run%lo, run%hi, h, strain, kept)
        call measure%first_piola_block(first, run%lo, run%hi, h, stress, kept, p)
      end associate
    end do
  end subroutine first_piola_block

  !> Cauchy stress of the rows of a block; 0 where det F is not positive.
  pure subroutine cauchy_block(self, block, h, stress, sigma)
    class(materials_t), intent(in) :: self
    integer,  intent(in) :: block
    real(wp), intent(in), contiguous :: h(:, :)        !! H (n,4) xx xy yx yy
    real(wp), intent(in), contiguous :: stress(:, :)   !! conjugate stress (n,4) xx yy zz xy [Pa]
    real(wp), intent(inout) :: sigma(n_block, 4)       !! out: xx yy zz xy [Pa]
    integer :: first, i, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k), measure => self%list(self%runs(k)%material)%measure)
        do i = run%lo, run%hi
          sigma(i - first + 1, :) = 0.0_wp
          if (determinant(h(i, :)) > 0.0_wp) &
            sigma(i - first + 1, :) = measure%cauchy(h(i, :), stress(i, :))
        end do
      end associate
    end do
  end subroutine cauchy_block

  !> Equivalent plastic strain of the rows of a block; 0 where a law has none.
  pure subroutine plastic_strain_block(self, block, points, values)
    class(materials_t), intent(in) :: self
    integer,            intent(in) :: block
    type(law_points_t), intent(in) :: points
    real(wp), intent(inout) :: values(n_block)   !! out
    integer :: column, first, k

    first = self%runs(self%first_run(block))%lo
    do k = self%first_run(block), self%first_run(block + 1) - 1
      associate (run => self%runs(k))
        column = self%list(run%material)%law%plastic_strain
        values(run%lo - first + 1:run%hi - first + 1) = 0.0_wp
        if (column > 0) values(run%lo - first + 1:run%hi - first + 1) = &
          points%history(run%lo:run%hi, column)
      end associate
    end do
  end subroutine plastic_strain_block

end module pd_materials
