!> Sums over all neighbours on a lattice with weights that depend on the distance alone:
!>
!>   E[f]_i = sum_{|k| <= m} sum_{|r| <= m} w_|k||r| f_{i + k + r stride}     w_kr = w_rk
!>
!> First up and down every column k, then across:
!>
!>   T_k(i) = w_k0 f_i + sum_{r>0} w_kr (f_{i + r stride} + f_{i - r stride})
!>   E_i = T_0(i) + sum_{k>0} (T_k(i+k) + T_k(i-k))
!>
!> `wide` columns and `high` rows are summed at a time: what is read once then serves all columns,
!> and stays in registers. Where m is a whole number, the outermost column and row hold one point on
!> either side, which are added directly; up to m = 4 the rest is one group. Weights may have either
!> sign and need not be products, unlike those for which `pd_columns` is at its best.
module pd_radial_sums
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  use pd_kinds, only: n_block, n_line, wp
  implicit none
  private

  public :: radial_sums_t, new_radial_sums, add_radial_sums

  integer, parameter :: wide = 4   !! columns at a time
  integer, parameter :: high = 3   !! rows at a time, beside row 0
  !> Strands T with at most so many numbers are kept on the stack; longer ones are allocated.
  integer, parameter :: most_numbers = wide * (n_block + 16 * n_line)

  !> Weights, filled up with zeros to whole groups of columns and rows.
  type :: radial_sums_t
    integer  :: reach = 0                    !! columns on either side, m
    integer  :: margin = 0                   !! rows on either side of a strand, whole cache lines
    integer  :: up = 0                       !! from row 0 to row m, in the field
    real(wp) :: outermost = 0.0_wp           !! w_m0 where column and row m hold one point, else 0
    real(wp), allocatable :: weight(:, :)    !! w of the others (0:rows,0:columns)
    integer,  allocatable :: shift(:)        !! from row 0 to row r, in the field (rows)
  end type radial_sums_t

contains

  !> Sums with these weights.
  pure type(radial_sums_t) function new_radial_sums(weight, stride) result(sums)
    real(wp), intent(in) :: weight(0:, 0:)   !! w of (k,r), symmetric
    integer,  intent(in) :: stride           !! from a row to the next, in the field
    integer :: last, r

    sums%reach = ubound(weight, 1)
    sums%margin = n_line * ((sums%reach + n_line - 1) / n_line)
    last = sums%reach
    if (last > 0 .and. .not. any(abs(weight(last, 1:)) > 0.0_wp)) then
      sums%outermost = weight(last, 0)
      last = last - 1
    end if
    sums%up = sums%reach * stride
    allocate (sums%weight(0:high * max(1, (last + high - 1) / high), &
      0:wide * (last / wide + 1) - 1), source=0.0_wp)
    sums%weight(:last, :last) = weight(:last, :last)
    ! rows without weight are read nevertheless, where there is something
    allocate (sums%shift(ubound(sums%weight, 1)), source=0)
    sums%shift(:last) = [(r * stride, r=1, last)]
  end function new_radial_sums

  !> total <- total + E[f] - own f for rows lo to hi. Fields reach m rows of the lattice beyond
  !> these, and a margin of whole cache lines.
  pure subroutine add_radial_sums(sums, lo, hi, own, f, total)
    type(radial_sums_t), intent(in) :: sums
    integer,  intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: own(:)    !! (n)
    real(wp), intent(in),    contiguous :: f(:)      !! (n)
    real(wp), intent(inout), contiguous :: total(:)  !! (hi-lo+1); row 1 is row lo
    real(wp), target :: strands(most_numbers + n_line)
    real(wp), allocatable :: many(:)
    integer  :: n, before

    n = hi - lo + 1 + 2 * sums%margin
    if (wide * n <= most_numbers) then
      ! strands begin at a line of the cache, as fields do: a sixth of the time
      before = int(modulo(-transfer(c_loc(strands), 0_c_intptr_t) / 8_c_intptr_t, &
        int(n_line, c_intptr_t)))
      call add_groups(sums, lo, n, own, f, strands(before + 1:), total)
    else
      allocate (many(wide * n))
      call add_groups(sums, lo, n, own, f, many, total)
    end if
  end subroutine add_radial_sums

  !> Group of columns by group of columns.
  pure subroutine add_groups(sums, lo, n, own, f, strands, total)
    type(radial_sums_t), intent(in) :: sums
    integer,  intent(in) :: lo, n                       !! first row; numbers in a strand
    real(wp), intent(in),    contiguous :: own(:), f(:)
    real(wp), intent(inout) :: strands(n, wide)         !! work space
    real(wp), intent(inout), contiguous :: total(:)
    integer :: k, r, at

    at = lo - 1 - sums%margin
    do k = 0, ubound(sums%weight, 2), wide
      call first_rows(n, at, sums%shift, sums%weight(0:high, k:k + wide - 1), f, strands)
      do r = high + 1, ubound(sums%weight, 1), high
        call more_rows(n, at, sums%shift(r:), sums%weight(r:r + high - 1, k:k + wide - 1), f, &
          strands)
      end do
      if (k == 0) then
        call add_middle(sums, lo, n, own, f, strands, total)
      else
        call add_more(n, sums%margin, k, strands, total)
      end if
    end do
  end subroutine add_groups

  !> Row 0 and the first rows above and below.
  pure subroutine first_rows(n, at, shift, w, f, strands)
    integer,  intent(in)  :: n, at, shift(high)
    real(wp), intent(in)  :: w(0:high, wide)
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(out) :: strands(n, wide)
    integer  :: i, j
    real(wp) :: f0, f1, f2, f3

    !$omp simd simdlen(8) private(j, f0, f1, f2, f3)
    do i = 1, n
      j = at + i
      f0 = f(j)
      f1 = f(j + shift(1)) + f(j - shift(1))
      f2 = f(j + shift(2)) + f(j - shift(2))
      f3 = f(j + shift(3)) + f(j - shift(3))
      strands(i, 1) = w(0, 1) * f0 + w(1, 1) * f1 + w(2, 1) * f2 + w(3, 1) * f3
      strands(i, 2) = w(0, 2) * f0 + w(1, 2) * f1 + w(2, 2) * f2 + w(3, 2) * f3
      strands(i, 3) = w(0, 3) * f0 + w(1, 3) * f1 + w(2, 3) * f2 + w(3, 3) * f3
      strands(i, 4) = w(0, 4) * f0 + w(1, 4) * f1 + w(2, 4) * f2 + w(3, 4) * f3
    end do
  end subroutine first_rows

  !> More rows above and below.
  pure subroutine more_rows(n, at, shift, w, f, strands)
    integer,  intent(in) :: n, at, shift(high)
    real(wp), intent(in) :: w(high, wide)
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(inout) :: strands(n, wide)
    integer  :: i, j
    real(wp) :: f1, f2, f3

    !$omp simd simdlen(8) private(j, f1, f2, f3)
    do i = 1, n
      j = at + i
      f1 = f(j + shift(1)) + f(j - shift(1))
      f2 = f(j + shift(2)) + f(j - shift(2))
      f3 = f(j + shift(3)) + f(j - shift(3))
      strands(i, 1) = strands(i, 1) + w(1, 1) * f1 + w(2, 1) * f2 + w(3, 1) * f3
      strands(i, 2) = strands(i, 2) + w(1, 2) * f1 + w(2, 2) * f2 + w(3, 2) * f3
      strands(i, 3) = strands(i, 3) + w(1, 3) * f1 + w(2, 3) * f2 + w(3, 3) * f3
      strands(i, 4) = strands(i, 4) + w(1, 4) * f1 + w(2, 4) * f2 + w(3, 4) * f3
    end do
  end subroutine more_rows

  !> total <- total - own f + columns 0 to `wide` - 1 + the outermost points. Columns beyond the
  !> margin have no weight; they are read within it.
  pure subroutine add_middle(sums, lo, n, own, f, strands, total)
    type(radial_sums_t), intent(in) :: sums
    integer,  intent(in) :: lo, n
    real(wp), intent(in),    contiguous :: own(:), f(:)
    real(wp), intent(in) :: strands(n, wide)
    real(wp), intent(inout), contiguous :: total(:)   !! (n-2*margin)
    integer  :: i, j, b, margin, m, up, k1, k2, k3
    real(wp) :: outermost

    margin = sums%margin
    m = sums%reach
    up = sums%up
    outermost = sums%outermost
    k1 = min(1, margin)
    k2 = min(2, margin)
    k3 = min(3, margin)
    !$omp simd simdlen(8) private(j, b)
    do i = margin + 1, n - margin
      b = i - margin
      j = lo - 1 + b
      total(b) = (total(b) + (strands(i, 1) - own(j) * f(j))) &
        + (((strands(i + k1, 2) + strands(i - k1, 2)) &
        + (strands(i + k2, 3) + strands(i - k2, 3))) &
        + ((strands(i + k3, 4) + strands(i - k3, 4)) &
        + outermost * ((f(j + m) + f(j - m)) + (f(j + up) + f(j - up)))))
    end do
  end subroutine add_middle

  !> total <- total + columns k to k + wide - 1, to the right and to the left.
  pure subroutine add_more(n, margin, k, strands, total)
    integer,  intent(in) :: n, margin, k
    real(wp), intent(in) :: strands(n, wide)
    real(wp), intent(inout), contiguous :: total(:)   !! (n-2*margin)
    integer :: i, k1, k2, k3, k4

    k1 = min(k, margin)
    k2 = min(k + 1, margin)
    k3 = min(k + 2, margin)
    k4 = min(k + 3, margin)
    !$omp simd simdlen(8)
    do i = margin + 1, n - margin
      total(i - margin) = total(i - margin) &
        + ((strands(i + k1, 1) + strands(i - k1, 1)) + (strands(i + k2, 2) + strands(i - k2, 2))) &
        + ((strands(i + k3, 3) + strands(i - k3, 3)) + (strands(i + k4, 4) + strands(i - k4, 4)))
    end do
  end subroutine add_more

end module pd_radial_sums
