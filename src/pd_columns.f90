!> Sums over all neighbours on a lattice, by columns: for weights w and a field f
!>
!>   X[f]_i = sum_j w x f_j     Y[f]_i = sum_j w y f_j     with (x, y) = xi
!>
!> are first summed up and down the columns of the family, R_k rows high at k columns aside, and
!> then across them:
!>
!>   P_k(i) = sum_{|r| <= R_k} w_kr f_{i+r}          X_i = sum_{k>0} x_k (P_k(i+k) - P_k(i-k))
!>   Q_k(i) = sum_{|r| <= R_k} w_kr y_r f_{i+r}      Y_i = Q_0(i) + sum_{k>0} (Q_k(i+k) + Q_k(i-k))
!>
!> Where the weights are products, w_kr = g_k g_r (Gaussian and constant influence), columns differ
!> in their height only and a high one goes on where a lower one ends: the work grows with m, not
!> with its square. Other weights have sums of their own for every column, about as much work as
!> bond by bond.
module pd_columns
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: columns_t, sums_t, new_columns, add_sums

  integer, parameter :: group = 4   !! columns to a pass: their sums stay in registers
  !> Numbers in all strands that are kept on the stack, up to about m = 30; more are allocated for
  !> every block.
  integer, parameter :: most_numbers = 8192

  !> One of the sums, X or Y: what is added up and down, and across.
  type :: sums_t
    real(wp) :: below = 1.0_wp                   !! sign of the rows below row 0
    real(wp) :: left = 1.0_wp                    !! sign of the columns to the left
    real(wp), allocatable :: rows(:, :)          !! weights of the rows of a strand (0:2,strands)
    !> Columns, padded to whole groups: where they are among the strands, and their weights.
    integer,  allocatable :: plus(:), minus(:)
    real(wp), allocatable :: weight(:)
  end type sums_t

  !> Strands are sums up and down a column; each goes on from another one, or begins, and takes up
  !> to two rows more.
  type :: columns_t
    integer :: reach = 0                         !! columns on either side
    integer :: n_strands = 0
    integer,  allocatable :: from(:)             !! strand that this one goes on from; 0: begins
    integer,  allocatable :: rows(:, :)          !! rows that it takes (2,strands); 0: none
    integer,  allocatable :: shift(:, :)         !! places from row 0 to these (2,strands)
    integer :: width = 0                         !! numbers of a strand, which lie side by side
    type(sums_t) :: x, y
  end type columns_t

contains

  !> Columns of a radial weight.
  pure type(columns_t) function new_columns(weight, spacing, stride) result(columns)
    real(wp), intent(in) :: weight(0:, 0:)   !! w of (k,r), 0 beyond the horizon; (0,0) counts too
    real(wp), intent(in) :: spacing          !! dx [m]
    integer,  intent(in) :: stride           !! places from a row to the next
    integer  :: height(0:ubound(weight, 1)), strand(0:ubound(weight, 1)), k, r, most
    logical  :: product_form
    real(wp) :: along(0:ubound(weight, 1)), across(0:ubound(weight, 1))

    columns%reach = ubound(weight, 1)
    columns%width = n_block + 2 * columns%reach
    do k = 0, columns%reach
      height(k) = count(weight(k, 1:) > 0.0_wp)
    end do
    most = sum(height / 2 + 1)
    allocate (columns%from(most), columns%rows(2, most), columns%shift(2, most), source=0)
    allocate (columns%x%rows(0:2, most), columns%y%rows(0:2, most), source=0.0_wp)
    columns%x%left = -1.0_wp
    columns%y%below = -1.0_wp
    product_form = is_product(weight)
    strand = 0
    across = 1.0_wp
    if (product_form) across = weight(:, 0) / weight(0, 0)
    along = weight(0, :)
    do r = 0, columns%reach   ! low columns first: higher ones go on from them
      do k = columns%reach, 0, -1
        if (height(k) /= r .or. .not. weight(k, 0) > 0.0_wp) cycle
        if (.not. product_form) along = weight(k, :)
        if (product_form .and. columns%n_strands > 0) then
          strand(k) = columns%n_strands
          if (highest_row(columns, columns%n_strands) == r) cycle
        end if
        call add_strands(along, r, spacing, stride, product_form, columns)
        strand(k) = columns%n_strands
      end do
    end do
    call list_columns(strand, height, across, spacing, columns)
  end function new_columns

  !> Whether w_kr = g_k g_r within the horizon.
  pure logical function is_product(weight)
    real(wp), intent(in) :: weight(0:, 0:)
    integer :: k, r

    is_product = .true.
    do r = 0, ubound(weight, 1)
      do k = 0, ubound(weight, 1)
        if (weight(k, r) > 0.0_wp) is_product = is_product .and. &
          abs(weight(k, r) * weight(0, 0) - weight(k, 0) * weight(0, r)) &
          <= 1.0e-14_wp * weight(0, 0)**2
      end do
    end do
  end function is_product

  !> The highest row in a strand.
  pure integer function highest_row(columns, strand)
    type(columns_t), intent(in) :: columns
    integer,         intent(in) :: strand

    highest_row = maxval(columns%rows(:, strand))
    if (highest_row == 0 .and. columns%from(strand) > 0) &
      highest_row = maxval(columns%rows(:, columns%from(strand)))
  end function highest_row

  !> Strands up to a row: going on from the last one where `go_on`, else from row 0.
  pure subroutine add_strands(along, top, spacing, stride, go_on, columns)
    real(wp),        intent(in)    :: along(0:)   !! weights of the rows
    integer,         intent(in)    :: top, stride
    real(wp),        intent(in)    :: spacing
    logical,         intent(in)    :: go_on
    type(columns_t), intent(inout) :: columns
    integer :: next, r, k

    next = 0
    k = 0
    if (go_on .and. columns%n_strands > 0) then
      k = columns%n_strands
      next = highest_row(columns, k)
    end if
    do
      columns%n_strands = columns%n_strands + 1
      associate (s => columns%n_strands)
        columns%from(s) = k
        if (k == 0) columns%x%rows(0, s) = along(0)
        do r = 1, 2
          if (next == top) exit
          next = next + 1
          columns%rows(r, s) = next
          columns%shift(r, s) = next * stride
          columns%x%rows(r, s) = along(next)
          columns%y%rows(r, s) = along(next) * spacing * real(next, wp)
        end do
        k = s
      end associate
      if (next == top) exit
    end do
  end subroutine add_strands

  !> Where the columns of X and Y are among the strands, and what weight they have.
  pure subroutine list_columns(strand, height, across, spacing, columns)
    integer,         intent(in)    :: strand(0:), height(0:)   !! of column k; strand 0: none
    real(wp),        intent(in)    :: across(0:)               !! g_k
    real(wp),        intent(in)    :: spacing
    type(columns_t), intent(inout) :: columns
    integer :: k, n_x, n_y, origin

    n_x = count(strand(1:) > 0)
    n_y = count(strand > 0 .and. height > 0)
    n_x = group * ((n_x + group - 1) / group)
    n_y = group * ((n_y + group - 1) / group)
    ! what pads a group has no weight, but must be a number: that of column 0
    origin = (strand(0) - 1) * columns%width + columns%reach
    allocate (columns%x%plus(n_x), columns%x%minus(n_x), columns%y%plus(n_y), &
      columns%y%minus(n_y), source=origin)
    allocate (columns%x%weight(n_x), columns%y%weight(n_y), source=0.0_wp)
    n_x = 0
    n_y = 0
    do k = 0, columns%reach
      if (strand(k) == 0) cycle
      origin = (strand(k) - 1) * columns%width + columns%reach
      if (k > 0) then
        n_x = n_x + 1
        columns%x%plus(n_x) = origin + k
        columns%x%minus(n_x) = origin - k
        columns%x%weight(n_x) = across(k) * spacing * real(k, wp)
      end if
      if (height(k) == 0) cycle
      n_y = n_y + 1
      columns%y%plus(n_y) = origin + k
      columns%y%minus(n_y) = origin - k
      columns%y%weight(n_y) = merge(0.5_wp, 1.0_wp, k == 0) * across(k)
    end do
  end subroutine list_columns

  !> total <- total + X[f] or Y[f] for points lo to hi.
  pure subroutine add_sums(columns, sums, lo, hi, f, total)
    type(columns_t), intent(in) :: columns
    type(sums_t),    intent(in) :: sums                     !! columns%x or columns%y
    integer,         intent(in) :: lo, hi
    real(wp),        intent(in),    contiguous :: f(:)      !! (n)
    real(wp),        intent(inout), contiguous :: total(:)  !! (hi-lo+1); row 1 is point lo
    real(wp) :: strands(most_numbers)
    real(wp), allocatable :: many(:)

    if (columns%width * columns%n_strands <= most_numbers) then
      call add_by_strands(columns, sums, lo, hi, f, strands, total)
    else
      allocate (many(columns%width * columns%n_strands))
      call add_by_strands(columns, sums, lo, hi, f, many, total)
    end if
  end subroutine add_sums

  !> The same with given work space.
  pure subroutine add_by_strands(columns, sums, lo, hi, f, strands, total)
    type(columns_t), intent(in) :: columns
    type(sums_t),    intent(in) :: sums
    integer,         intent(in) :: lo, hi
    real(wp),        intent(in),    contiguous :: f(:)
    real(wp),        intent(inout), contiguous :: strands(:)   !! work space
    real(wp),        intent(inout), contiguous :: total(:)
    integer :: g

    call sum_strands(columns, lo, hi, sums%rows, sums%below, f, strands)
    do g = 1, size(sums%plus), group
      call add_columns(hi - lo + 1, sums%plus(g:g + group - 1), sums%minus(g:g + group - 1), &
        sums%weight(g:g + group - 1), sums%left, strands, total)
    end do
  end subroutine add_by_strands

  !> All strands at points lo to hi and as far to either side as the family goes.
  pure subroutine sum_strands(columns, lo, hi, weight, side, f, strands)
    type(columns_t), intent(in) :: columns
    integer,         intent(in) :: lo, hi
    real(wp),        intent(in) :: weight(0:, :)        !! of the rows (0:2,strands)
    real(wp),        intent(in) :: side                 !! 1: rows below count as those above;
                                                        !! -1: with the opposite sign
    real(wp), intent(in),    contiguous :: f(:)         !! (n)
    real(wp), intent(inout), contiguous :: strands(:)   !! out: (width*strands)
    integer :: s, a, b, at, n

    at = lo - 1 - columns%reach
    n = hi - lo + 1 + 2 * columns%reach
    do s = 1, columns%n_strands
      a = (s - 1) * columns%width + 1
      b = (columns%from(s) - 1) * columns%width + 1
      if (columns%from(s) == 0 .and. columns%rows(1, s) == 0) then
        call begin_strand(n, at, weight(0, s), f, strands(a:a + n - 1))
      else if (columns%from(s) == 0) then
        call begin_with_rows(n, at, columns%shift(:, s), weight(:, s), side, f, &
          strands(a:a + n - 1))
      else if (columns%rows(2, s) == 0) then
        call go_on_with_row(n, at, columns%shift(1, s), weight(1, s), side, f, &
          strands(b:b + n - 1), strands(a:a + n - 1))
      else
        call go_on_with_rows(n, at, columns%shift(:, s), weight(1:2, s), side, f, &
          strands(b:b + n - 1), strands(a:a + n - 1))
      end if
    end do
  end subroutine sum_strands

  !> Row 0 alone.
  pure subroutine begin_strand(n, at, w, f, strand)
    integer,  intent(in)  :: n, at
    real(wp), intent(in)  :: w
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(out) :: strand(n)
    integer :: i

    !$omp simd simdlen(8)
    do i = 1, n
      strand(i) = w * f(at + i)
    end do
  end subroutine begin_strand

  !> Row 0 and two rows above and below it.
  pure subroutine begin_with_rows(n, at, shift, w, side, f, strand)
    integer,  intent(in)  :: n, at, shift(2)
    real(wp), intent(in)  :: w(0:2), side
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(out) :: strand(n)
    integer  :: i, s1, s2
    real(wp) :: w0, w1, w2

    w0 = w(0)
    w1 = w(1)
    w2 = w(2)
    s1 = shift(1)
    s2 = shift(2)
    !$omp simd simdlen(8)
    do i = at + 1, at + n
      strand(i - at) = (w0 * f(i) + w1 * (f(i + s1) + side * f(i - s1))) &
        + w2 * (f(i + s2) + side * f(i - s2))
    end do
  end subroutine begin_with_rows

  !> One row more above and below.
  pure subroutine go_on_with_row(n, at, shift, w, side, f, from, strand)
    integer,  intent(in)  :: n, at, shift
    real(wp), intent(in)  :: w, side, from(n)
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(out) :: strand(n)
    integer :: i

    !$omp simd simdlen(8)
    do i = at + 1, at + n
      strand(i - at) = from(i - at) + w * (f(i + shift) + side * f(i - shift))
    end do
  end subroutine go_on_with_row

  !> Two rows more above and below.
  pure subroutine go_on_with_rows(n, at, shift, w, side, f, from, strand)
    integer,  intent(in)  :: n, at, shift(2)
    real(wp), intent(in)  :: w(2), side, from(n)
    real(wp), intent(in), contiguous :: f(:)
    real(wp), intent(out) :: strand(n)
    integer  :: i, s1, s2
    real(wp) :: w1, w2

    w1 = w(1)
    w2 = w(2)
    s1 = shift(1)
    s2 = shift(2)
    !$omp simd simdlen(8)
    do i = at + 1, at + n
      strand(i - at) = (from(i - at) + w1 * (f(i + s1) + side * f(i - s1))) &
        + w2 * (f(i + s2) + side * f(i - s2))
    end do
  end subroutine go_on_with_rows

  !> sums <- sums + four columns to the right and to the left, the latter with a sign.
  pure subroutine add_columns(n, plus, minus, weight, side, strands, sums)
    integer,  intent(in) :: n, plus(group), minus(group)
    real(wp), intent(in) :: weight(group), side
    real(wp), intent(in),    contiguous :: strands(:)
    real(wp), intent(inout) :: sums(n)
    integer  :: i, p1, p2, p3, p4, m1, m2, m3, m4
    real(wp) :: w1, w2, w3, w4

    p1 = plus(1)
    p2 = plus(2)
    p3 = plus(3)
    p4 = plus(4)
    m1 = minus(1)
    m2 = minus(2)
    m3 = minus(3)
    m4 = minus(4)
    w1 = weight(1)
    w2 = weight(2)
    w3 = weight(3)
    w4 = weight(4)
    !$omp simd simdlen(8)
    do i = 1, n
      sums(i) = ((sums(i) + w1 * (strands(i + p1) + side * strands(i + m1))) &
        + w2 * (strands(i + p2) + side * strands(i + m2))) &
        + (w3 * (strands(i + p3) + side * strands(i + m3)) &
        + w4 * (strands(i + p4) + side * strands(i + m4)))
    end do
  end subroutine add_columns

end module pd_columns
