!> Sums over all neighbours on a lattice, by columns: for weights w and a field f
!>
!>   X[f]_i = sum_j w x f_j     Y[f]_i = sum_j w y f_j     L[f]_i = sum_j w f_j     (x, y) = xi
!>
!> are first summed up and down the columns of the family, which is R_k rows high k columns away,
!> and then across them:
!>
!>   P_k(i) = sum_{|r| <= R_k} w_kr f_{i+r}          X_i = sum_{k>0} x_k (P_k(i+k) - P_k(i-k))
!>   Q_k(i) = sum_{|r| <= R_k} w_kr y_r f_{i+r}      Y_i = Q_0(i) + sum_{k>0} (Q_k(i+k) + Q_k(i-k))
!>                                                   L_i = P_0(i) + sum_{k>0} (P_k(i+k) + P_k(i-k))
!>
!> L includes the point itself, as a bond of length zero.
!> Where the weights are products, w_kr = g_k g_r (Gaussian and constant influence), columns differ
!> only in height, and a high one continues where a lower one ends: the work grows with m, not
!> with its square. Other weights have sums of their own for every column, about as much work as
!> bond by bond.
module pd_columns
  use pd_kinds, only: n_block, wp
  implicit none
  private

  public :: columns_t, sums_t, new_columns, add_sums

  integer, parameter :: most = 4   !! columns per pass: their sums stay in registers
  !> Strands with at most so many numbers are kept on the stack, up to about m = 30; longer ones are
  !> allocated for every block.
  integer, parameter :: most_numbers = 8192

  !> One of the sums X, Y, L: what is added up and down, and across.
  type :: sums_t
    integer  :: n_strands = 0                    !! strands that its columns need
    real(wp) :: below = 1.0_wp                   !! sign of the rows below row 0
    real(wp) :: left = 1.0_wp                    !! sign of the columns to the left
    real(wp), allocatable :: rows(:, :)          !! weights of the rows of a strand (0:2,strands)
    integer,  allocatable :: parts(:)            !! columns in each pass: 2, 3 or 4
    !> Columns: where they are among the strands, and their weights.
    integer,  allocatable :: plus(:), minus(:)
    real(wp), allocatable :: weight(:)
  end type sums_t

  !> Strands are sums up and down a column; each begins with row 0, or continues another one and
  !> adds one or two rows.
  type :: columns_t
    integer :: reach = 0                         !! columns on either side
    integer :: n_strands = 0
    integer,  allocatable :: from(:)             !! strand that this one continues; 0: begins
    integer,  allocatable :: rows(:, :)          !! rows that it adds (2,strands); 0: none
    integer,  allocatable :: shift(:, :)         !! from row 0 to these, in the field (2,strands)
    integer :: width = 0                         !! numbers in a strand, one after the other
    type(sums_t) :: x, y, l
  end type columns_t

contains

  !> Columns of a radial weight.
  pure type(columns_t) function new_columns(weight, spacing, stride) result(columns)
    real(wp), intent(in) :: weight(0:, 0:)   !! w of (k,r), 0 beyond the horizon; (0,0) counts too
    real(wp), intent(in) :: spacing          !! dx [m]
    integer,  intent(in) :: stride           !! from a row to the next, in the field
    integer  :: height(0:ubound(weight, 1)), strand(0:ubound(weight, 1)), k, r, enough
    logical  :: product_form
    real(wp) :: along(0:ubound(weight, 1)), across(0:ubound(weight, 1))

    columns%reach = ubound(weight, 1)
    columns%width = n_block + 2 * columns%reach
    do k = 0, columns%reach
      height(k) = count(weight(k, 1:) > 0.0_wp)
    end do
    enough = sum(height / 2 + 2)
    allocate (columns%from(enough), columns%rows(2, enough), columns%shift(2, enough), source=0)
    allocate (columns%x%rows(0:2, enough), columns%y%rows(0:2, enough), source=0.0_wp)
    product_form = is_product(weight)
    strand = 0
    across = 1.0_wp
    if (product_form) across = weight(:, 0) / weight(0, 0)
    along = weight(0, :)
    do r = 0, columns%reach   ! low columns first: higher ones continue them
      do k = columns%reach, 0, -1
        if (height(k) /= r .or. .not. weight(k, 0) > 0.0_wp) cycle
        if (.not. product_form) along = weight(k, :)
        call add_strands(along, r, spacing, stride, product_form, columns)
        strand(k) = columns%n_strands
      end do
    end do
    columns%l%rows = columns%x%rows
    columns%x%left = -1.0_wp
    columns%y%below = -1.0_wp
    associate (distance => [(spacing * real(k, wp), k=0, columns%reach)])
      call list_columns(strand, distance * across, columns, columns%x)
    end associate
    call list_columns(merge(strand, 0, height > 0), across, columns, columns%y)
    call list_columns(strand, across, columns, columns%l)
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

  !> Add a strand up to a row: it continues the last one if `go_on` and there is one, else it begins
  !> with row 0.
  pure subroutine add_strands(along, top, spacing, stride, go_on, columns)
    real(wp),        intent(in)    :: along(0:)   !! weights of the rows
    integer,         intent(in)    :: top, stride
    real(wp),        intent(in)    :: spacing
    logical,         intent(in)    :: go_on
    type(columns_t), intent(inout) :: columns
    integer :: next, r

    associate (s => columns%n_strands)
      if (.not. go_on .or. s == 0) then
        s = s + 1
        columns%x%rows(0, s) = along(0)
      end if
      next = maxval(columns%rows(:, s))
      do while (next < top)
        s = s + 1
        columns%from(s) = s - 1
        do r = 1, min(2, top - next)
          next = next + 1
          columns%rows(r, s) = next
          columns%shift(r, s) = next * stride
          columns%x%rows(r, s) = along(next)
          columns%y%rows(r, s) = along(next) * spacing * real(next, wp)
        end do
      end do
    end associate
  end subroutine add_strands

  !> Which strands the columns of a sum are, and how many columns each pass takes.
  pure subroutine list_columns(strand, weight, columns, sums)
    integer,         intent(in)    :: strand(0:)   !! of column k; 0: the sum does not have it
    real(wp),        intent(in)    :: weight(0:)   !! of column k; 0: it does not matter
    type(columns_t), intent(in)    :: columns
    type(sums_t),    intent(inout) :: sums
    integer :: k, n, part, origin

    n = count(strand > 0 .and. weight > 0.0_wp)
    allocate (sums%parts(0))
    do while (n > 0)
      part = min(n, most)
      if (n == most + 1) part = most - 1   ! a column alone costs as much as two
      part = max(2, part)
      sums%parts = [sums%parts, part]
      n = n - part
    end do
    ! the last pass is filled up without weight, with what must be numbers: those of column 0
    n = sum(sums%parts)
    allocate (sums%plus(n), sums%minus(n), source=columns%reach)
    allocate (sums%weight(n), source=0.0_wp)
    n = 0
    do k = 0, columns%reach
      if (strand(k) == 0 .or. .not. weight(k) > 0.0_wp) cycle
      n = n + 1
      origin = (strand(k) - 1) * columns%width + columns%reach
      sums%plus(n) = origin + k
      sums%minus(n) = origin - k
      sums%weight(n) = merge(0.5_wp, 1.0_wp, k == 0) * weight(k)
      sums%n_strands = max(sums%n_strands, strand(k))
    end do
  end subroutine list_columns

  !> total <- total + X[f], Y[f] or L[f] for rows lo to hi.
  pure subroutine add_sums(columns, sums, lo, hi, f, total)
    type(columns_t), intent(in) :: columns
    type(sums_t),    intent(in) :: sums                     !! columns%x, y or l
    integer,         intent(in) :: lo, hi
    real(wp),        intent(in),    contiguous :: f(:)      !! (n)
    real(wp),        intent(inout), contiguous :: total(:)  !! (hi-lo+1); row 1 is row lo
    real(wp) :: strands(most_numbers)
    real(wp), allocatable :: many(:)

    if (columns%width * sums%n_strands <= most_numbers) then
      call sum_strands(columns, sums, lo, hi, f, strands)
      call add_columns(sums, hi - lo + 1, strands, total)
    else
      allocate (many(columns%width * sums%n_strands))
      call sum_strands(columns, sums, lo, hi, f, many)
      call add_columns(sums, hi - lo + 1, many, total)
    end if
  end subroutine add_sums

  !> All strands of rows lo to hi, and as far to either side as the family reaches.
  pure subroutine sum_strands(columns, sums, lo, hi, f, strands)
    type(columns_t), intent(in) :: columns
    type(sums_t),    intent(in) :: sums
    integer,         intent(in) :: lo, hi
    real(wp), intent(in),    contiguous :: f(:)         !! (n)
    real(wp), intent(inout), contiguous :: strands(:)   !! out: (width*strands)
    integer :: s, a, b, at, n

    at = lo - 1 - columns%reach
    n = hi - lo + 1 + 2 * columns%reach
    do s = 1, sums%n_strands
      a = (s - 1) * columns%width + 1
      b = (columns%from(s) - 1) * columns%width + 1
      if (columns%from(s) == 0) then
        call begin_strand(n, at, sums%rows(0, s), f, strands(a:a + n - 1))
      else if (columns%rows(2, s) == 0) then
        call go_on_with_row(n, at, columns%shift(1, s), sums%rows(1, s), sums%below, f, &
          strands(b:b + n - 1), strands(a:a + n - 1))
      else
        call go_on_with_rows(n, at, columns%shift(:, s), sums%rows(1:2, s), sums%below, f, &
          strands(b:b + n - 1), strands(a:a + n - 1))
      end if
    end do
  end subroutine sum_strands

  !> Row 0.
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

  !> One row more above and below, the latter with a sign.
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

  !> total <- total + the sum across the columns.
  pure subroutine add_columns(sums, n, strands, total)
    type(sums_t), intent(in) :: sums
    integer,      intent(in) :: n
    real(wp), intent(in),    contiguous :: strands(:)
    real(wp), intent(inout), contiguous :: total(:)     !! (n)
    integer :: k, part

    k = 1
    do part = 1, size(sums%parts)
      if (sums%parts(part) == 2) then
        call add_two(n, sums%plus(k:), sums%minus(k:), sums%weight(k:), sums%left, strands, total)
      else if (sums%parts(part) == 3) then
        call add_three(n, sums%plus(k:), sums%minus(k:), sums%weight(k:), sums%left, strands, total)
      else if (sums%parts(part) == 4) then
        call add_four(n, sums%plus(k:), sums%minus(k:), sums%weight(k:), sums%left, strands, total)
      end if
      k = k + sums%parts(part)
    end do
  end subroutine add_columns

  !> total <- total + two columns to the right and to the left, the latter with a sign.
  pure subroutine add_two(n, plus, minus, weight, side, strands, total)
    integer,  intent(in) :: n, plus(2), minus(2)
    real(wp), intent(in) :: weight(2), side
    real(wp), intent(in),    contiguous :: strands(:)
    real(wp), intent(inout) :: total(n)
    integer  :: i, p1, p2, m1, m2
    real(wp) :: w1, w2

    p1 = plus(1)
    p2 = plus(2)
    m1 = minus(1)
    m2 = minus(2)
    w1 = weight(1)
    w2 = weight(2)
    !$omp simd simdlen(8)
    do i = 1, n
      total(i) = (total(i) + w1 * (strands(i + p1) + side * strands(i + m1))) &
        + w2 * (strands(i + p2) + side * strands(i + m2))
    end do
  end subroutine add_two

  !> The same with three columns.
  pure subroutine add_three(n, plus, minus, weight, side, strands, total)
    integer,  intent(in) :: n, plus(3), minus(3)
    real(wp), intent(in) :: weight(3), side
    real(wp), intent(in),    contiguous :: strands(:)
    real(wp), intent(inout) :: total(n)
    integer  :: i, p1, p2, p3, m1, m2, m3
    real(wp) :: w1, w2, w3

    p1 = plus(1)
    p2 = plus(2)
    p3 = plus(3)
    m1 = minus(1)
    m2 = minus(2)
    m3 = minus(3)
    w1 = weight(1)
    w2 = weight(2)
    w3 = weight(3)
    !$omp simd simdlen(8)
    do i = 1, n
      total(i) = ((total(i) + w1 * (strands(i + p1) + side * strands(i + m1))) &
        + w2 * (strands(i + p2) + side * strands(i + m2))) &
        + w3 * (strands(i + p3) + side * strands(i + m3))
    end do
  end subroutine add_three

  !> The same with four columns.
  pure subroutine add_four(n, plus, minus, weight, side, strands, total)
    integer,  intent(in) :: n, plus(4), minus(4)
    real(wp), intent(in) :: weight(4), side
    real(wp), intent(in),    contiguous :: strands(:)
    real(wp), intent(inout) :: total(n)
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
      total(i) = ((total(i) + w1 * (strands(i + p1) + side * strands(i + m1))) &
        + w2 * (strands(i + p2) + side * strands(i + m2))) &
        + (w3 * (strands(i + p3) + side * strands(i + m3)) &
        + w4 * (strands(i + p4) + side * strands(i + m4)))
    end do
  end subroutine add_four

end module pd_columns
