!> Points whose stiffness is a multiple of that of their material.
!>
!> A law of J2 plasticity has no stress of its own: with all moduli and strengths times s, stress is
!> times s and strain the same. So a law of stiffness s E and strength sigma_y is
!>
!>   S = s law(E; sigma_y / s)
!>
!> with the moduli of hardening and the residual strength times s as well. What points remember is
!> that of the law: back stress is over s. Any law whose stresses are all proportional to its moduli
!> can be used like this.
!> Source: doc/theory.md, section 3.
module pd_graded
  use pd_flow, only: flow_t
  use pd_kinds, only: n_block, wp
  use pd_law, only: law_points_t, law_t
  implicit none
  private

  public :: graded_stress_block, graded_energy_block, graded_heat_block

contains

  !> Stress of rows lo to hi; the history goes from step n to n+1.
  pure subroutine graded_stress_block(law, stiffness, rows, strain, points, flow)
    class(law_t), intent(in) :: law
    real(wp),     intent(in), contiguous :: stiffness(:)   !! s (n)
    integer,      intent(in) :: rows(3)                    !! first, lo, hi
    real(wp),     intent(in), contiguous :: strain(:, :)   !! E xx yy zz xy; row 1 is row `first`
    type(law_points_t), intent(inout) :: points
    type(flow_t), intent(inout) :: flow
    real(wp) :: strength(n_block)
    integer  :: c, k, n

    n = rows(3) - rows(2) + 1
    associate (lo => rows(2), hi => rows(3), s => stiffness(rows(2):rows(3)))
      strength(:n) = points%strength(lo:hi)   ! not multiplied back: it must keep its bits
      points%strength(lo:hi) = strength(:n) / s
      do c = 1, 4
        points%stress(lo:hi, c) = points%stress(lo:hi, c) / s
      end do
      call law%stress_block(rows(1), lo, hi, strain, points, flow)
      do c = 1, 4
        points%stress(lo:hi, c) = s * points%stress(lo:hi, c)
      end do
      points%strength(lo:hi) = strength(:n)
    end associate
    do k = 1, flow%n
      flow%dissipated(k) = stiffness(flow%rows(k)) * flow%dissipated(k)
      flow%strength(k) = stiffness(flow%rows(k)) * flow%strength(k)
    end do
  end subroutine graded_stress_block

  !> Stored elastic energy of rows lo to hi: quadratic in the stress.
  pure subroutine graded_energy_block(law, stiffness, rows, points, energy)
    class(law_t), intent(in) :: law
    real(wp),     intent(in), contiguous :: stiffness(:)   !! s (n)
    integer,      intent(in) :: rows(3)                    !! first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp),     intent(inout), contiguous :: energy(:)   !! out: [J/m^3]; row 1 is row `first`

    call law%energy_block(rows(1), rows(2), rows(3), points, energy)
    associate (from => rows(2) - rows(1) + 1, to => rows(3) - rows(1) + 1)
      energy(from:to) = energy(from:to) / stiffness(rows(2):rows(3))
    end associate
  end subroutine graded_energy_block

  !> Heat so far of rows lo to hi.
  pure subroutine graded_heat_block(law, stiffness, rows, points, heat)
    class(law_t), intent(in) :: law
    real(wp),     intent(in), contiguous :: stiffness(:)   !! s (n)
    integer,      intent(in) :: rows(3)                    !! first, lo, hi
    type(law_points_t), intent(in) :: points
    real(wp),     intent(inout), contiguous :: heat(:)     !! out: [J/m^3]; row 1 is row `first`
    type(law_points_t) :: scaled
    integer :: from, to

    from = rows(2) - rows(1) + 1
    to = rows(3) - rows(1) + 1
    associate (s => stiffness(rows(2):rows(3)))
      allocate (scaled%stress(n_block, 4), scaled%strength(n_block), source=0.0_wp)
      allocate (scaled%history(n_block, size(points%history, 2)), source=0.0_wp)
      scaled%strength(from:to) = points%strength(rows(2):rows(3)) / s
      scaled%history(from:to, :) = points%history(rows(2):rows(3), :)
      call law%heat_block(1, from, to, scaled, heat)
      heat(from:to) = s * heat(from:to)
    end associate
  end subroutine graded_heat_block

end module pd_graded
