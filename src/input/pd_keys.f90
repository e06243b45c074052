!> What a key of the input file is, and who visits it.
!>
!> A group of keys is a type with a procedure `visit`, which names each of its keys once: the
!> component of the value, unit, default, range, sentence. Everything that is done with all keys is
!> a visitor: reading, listing as used, printing, the reference.
module pd_keys
  use pd_kinds, only: is_set, unset, wp
  use pd_text, only: integer_text, number_text, quoted_list
  implicit none
  private

  public :: key_t, group_key_t, range_t, key_visitor_t
  public :: find_key, find_group, keys_of, allowed_values, words_of
  public :: kind_real, kind_integer, kind_text, any_count, positive, not_negative

  integer, parameter :: kind_real = 1, kind_integer = 2, kind_text = 3

  !> Numbers between two bounds; a bound that is `unset` does not exist.
  type :: range_t
    real(wp) :: lower = unset, upper = unset
    logical  :: above = .false.          !! the lower bound itself is excluded
    logical  :: below = .false.          !! the upper bound itself is excluded
  end type range_t

  type(range_t), parameter :: positive = range_t(lower=0.0_wp, above=.true.)
  type(range_t), parameter :: not_negative = range_t(lower=0.0_wp)

  integer, parameter :: any_count = 0
  integer, parameter :: length = 32, long = 240

  !> One key. Texts: `choices` are the words allowed, separated by blanks (none: any text),
  !> `is_name` asks for a-z, 0-9 and _. Numbers: `count` is how many are required (any_count: one or
  !> more).
  type :: key_t
    character(length) :: name = ''
    character(length) :: group = ''    !! filled by the list of keys
    integer           :: kind = kind_real
    integer           :: count = 1
    character(length) :: unit = ''
    character(long)   :: default = ''    !! as in the file, without quotes; empty: none
    character(long)   :: stands_for = '' !! what the reference says of a default that is computed
    logical           :: required = .false.
    type(range_t)     :: range = range_t()
    character(long)   :: choices = ''
    logical           :: is_name = .false.
    logical           :: needs_effect = .false.   !! refused where it would have none
    character(long)   :: also = ''       !! what else must hold, for the reference
    character(long)   :: meaning = ''
  end type key_t

  type :: group_key_t
    character(length) :: name = ''
    logical           :: required = .false.
    logical           :: repeats = .false.
    character(long)   :: meaning = ''
  end type group_key_t

  !> Something that is done with every key. The groups call `group`, then the `_key` procedures for
  !> their keys; a visitor says in the `take_` procedures what it does with each kind.
  type, abstract :: key_visitor_t
  contains
    procedure, non_overridable :: real_key
    procedure, non_overridable :: integer_key
    procedure, non_overridable :: text_key
    procedure, non_overridable :: list_key
    procedure, non_overridable :: vector_key
    procedure(group_i),   deferred :: group
    procedure(real_i),    deferred :: take_real
    procedure(integer_i), deferred :: take_integer
    procedure(text_i),    deferred :: take_text
    procedure(list_i),    deferred :: take_list
    procedure(vector_i),  deferred :: take_vector
  end type key_visitor_t

  abstract interface
    subroutine group_i(self, about)
      import :: group_key_t, key_visitor_t
      class(key_visitor_t), intent(inout) :: self
      type(group_key_t),    intent(in)    :: about
    end subroutine group_i

    subroutine real_i(self, key, x)
      import :: key_t, key_visitor_t, wp
      class(key_visitor_t), intent(inout) :: self
      type(key_t),          intent(in)    :: key
      real(wp),             intent(inout) :: x
    end subroutine real_i

    subroutine integer_i(self, key, i)
      import :: key_t, key_visitor_t
      class(key_visitor_t), intent(inout) :: self
      type(key_t),          intent(in)    :: key
      integer,              intent(inout) :: i
    end subroutine integer_i

    subroutine text_i(self, key, text)
      import :: key_t, key_visitor_t
      class(key_visitor_t),      intent(inout) :: self
      type(key_t),               intent(in)    :: key
      character(:), allocatable, intent(inout) :: text
    end subroutine text_i

    subroutine list_i(self, key, x)
      import :: key_t, key_visitor_t, wp
      class(key_visitor_t),  intent(inout) :: self
      type(key_t),           intent(in)    :: key
      real(wp), allocatable, intent(inout) :: x(:)
    end subroutine list_i

    subroutine vector_i(self, key, x)
      import :: key_t, key_visitor_t, wp
      class(key_visitor_t), intent(inout) :: self
      type(key_t),          intent(in)    :: key
      real(wp),             intent(inout) :: x(:)
    end subroutine vector_i
  end interface

contains

  !> A key that holds one real number.
  subroutine real_key(self, key, x)
    class(key_visitor_t), intent(inout) :: self
    type(key_t),          intent(in)    :: key
    real(wp),             intent(inout) :: x

    call self%take_real(key, x)
  end subroutine real_key

  !> A key that holds one whole number.
  subroutine integer_key(self, key, i)
    class(key_visitor_t), intent(inout) :: self
    type(key_t),          intent(in)    :: key
    integer,              intent(inout) :: i
    type(key_t) :: whole

    whole = key
    whole%kind = kind_integer
    call self%take_integer(whole, i)
  end subroutine integer_key

  !> A key that holds a text.
  subroutine text_key(self, key, text)
    class(key_visitor_t),      intent(inout) :: self
    type(key_t),               intent(in)    :: key
    character(:), allocatable, intent(inout) :: text
    type(key_t) :: worded

    worded = key
    worded%kind = kind_text
    call self%take_text(worded, text)
  end subroutine text_key

  !> A key that holds a list of numbers, of size 0 where it is not given.
  subroutine list_key(self, key, x)
    class(key_visitor_t),  intent(inout) :: self
    type(key_t),           intent(in)    :: key
    real(wp), allocatable, intent(inout) :: x(:)

    call self%take_list(key, x)
  end subroutine list_key

  !> A key that always holds as many numbers as `x`.
  subroutine vector_key(self, key, x)
    class(key_visitor_t), intent(inout) :: self
    type(key_t),          intent(in)    :: key
    real(wp),             intent(inout) :: x(:)

    call self%take_vector(key, x)
  end subroutine vector_key

  !> Index of a key in the table, 0 where there is none.
  pure integer function find_key(keys, group, name) result(i)
    type(key_t),  intent(in) :: keys(:)
    character(*), intent(in) :: group, name

    do i = 1, size(keys)
      if (keys(i)%group == group .and. keys(i)%name == name) return
    end do
    i = 0
  end function find_key

  !> Index of a group in the table, 0 where there is none.
  pure integer function find_group(groups, name) result(i)
    type(group_key_t), intent(in) :: groups(:)
    character(*),      intent(in) :: name

    do i = 1, size(groups)
      if (groups(i)%name == name) return
    end do
    i = 0
  end function find_group

  !> Names of the keys of a group.
  pure function keys_of(keys, group) result(names)
    type(key_t),  intent(in) :: keys(:)
    character(*), intent(in) :: group
    character(length), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, size(keys)
      if (keys(i)%group == group) names = [names, keys(i)%name]
    end do
  end function keys_of

  !> The words of a text that are separated by blanks.
  pure function words_of(text) result(words)
    character(*), intent(in) :: text
    character(length), allocatable :: words(:)
    character(length) :: word
    integer :: from, to

    allocate (words(0))
    from = 1
    do while (from <= len_trim(text))
      to = index(text(from:)//' ', ' ') + from - 2
      word = text(from:to)
      if (to >= from) words = [words, word]
      from = to + 2
    end do
  end function words_of

  !> What a key may hold by itself: choices, a range, or a number of values.
  pure function allowed_values(key) result(text)
    type(key_t), intent(in) :: key
    character(:), allocatable :: text

    if (key%kind == kind_text) then
      text = 'text'
      if (key%is_name) text = 'a name of a-z, 0-9 and _'
      if (key%choices /= '') text = quoted_list(words_of(key%choices))
      return
    end if
    text = range_text(key%range)
    if (key%kind == kind_integer) text = 'a whole number '//text
    if (key%count > 1) text = integer_text(key%count)//' numbers '//text
    if (key%count == any_count) text = 'one or more numbers '//text
    if (text == '') text = 'any number'
    text = trim(text)
  end function allowed_values

  !> A range in words, empty where every number is allowed.
  pure function range_text(range) result(text)
    type(range_t), intent(in) :: range
    character(:), allocatable :: text

    text = ''
    if (is_set(range%lower)) then
      text = '>= '
      if (range%above) text = '> '
      text = text//without_point(number_text(range%lower))
    end if
    if (is_set(range%upper)) then
      if (text /= '') text = text//' and '
      if (range%below) then
        text = text//'< '
      else
        text = text//'<= '
      end if
      text = text//without_point(number_text(range%upper))
    end if
  end function range_text

  !> A number without the .0 of a whole number.
  pure function without_point(number) result(text)
    character(*), intent(in) :: number
    character(:), allocatable :: text
    integer :: n

    n = len(number)
    text = number
    if (n > 2) then
      if (number(n - 1:n) == '.0') text = number(:n - 2)
    end if
  end function without_point

end module pd_keys
