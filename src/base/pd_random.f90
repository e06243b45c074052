!> Random numbers that are the same on every machine: the combined generator MRG32k3a.
!>
!> Whole numbers of 64 bits hold every product without overflow, whatever the compiler.
!> Source: L'Ecuyer (1999), Operations Research 47, 159-164.
module pd_random
  use pd_kinds, only: i8, wp
  implicit none
  private

  public :: random_t, new_random

  !> A stream of random numbers. The published start has 12345 in all six words.
  type :: random_t
    integer(i8) :: first(3) = 12345_i8    !! 0 to modulus_1 - 1, not all 0; the newest last
    integer(i8) :: second(3) = 12345_i8   !! 0 to modulus_2 - 1, not all 0
  contains
    procedure :: draw
  end type random_t

  integer(i8), parameter :: modulus_1 = 4294967087_i8, modulus_2 = 4294944443_i8
  integer(i8), parameter :: low_16 = 65535_i8, low_32 = 4294967295_i8

contains

  !> The stream of a seed. Streams of neighbouring seeds have nothing in common: each word of the
  !> state is scrambled from the seed and the number of the word.
  pure type(random_t) function new_random(seed) result(random)
    integer, intent(in) :: seed   !! >= 0
    integer(i8), parameter :: golden = 2654435769_i8   !! 2^32 over the golden ratio
    integer(i8) :: words(6)
    integer :: k

    do k = 1, 6
      words(k) = scrambled(iand(scrambled(int(seed, i8)) + golden * int(k, i8), low_32))
    end do
    random%first = modulo(words(:3), modulus_1)
    random%second = modulo(words(4:), modulus_2)
    if (all(random%first == 0_i8)) random%first(3) = 1_i8
    if (all(random%second == 0_i8)) random%second(3) = 1_i8
  end function new_random

  !> The next number, above 0 and below 1.
  pure subroutine draw(self, number)
    class(random_t), intent(inout) :: self
    real(wp),        intent(out)   :: number
    integer(i8) :: p1, p2, difference

    p1 = modulo(1403580_i8 * self%first(2) - 810728_i8 * self%first(1), modulus_1)
    p2 = modulo(527612_i8 * self%second(3) - 1370589_i8 * self%second(1), modulus_2)
    self%first = [self%first(2:), p1]
    self%second = [self%second(2:), p2]
    difference = p1 - p2
    if (difference <= 0_i8) difference = difference + modulus_1
    number = real(difference, wp) / real(modulus_1 + 1_i8, wp)
  end subroutine draw

  !> A word of 32 bits with its bits mixed up, one to one: the last steps of MurmurHash3 (Appleby).
  pure integer(i8) function scrambled(word) result(h)
    integer(i8), intent(in) :: word   !! 0 to 2^32 - 1

    h = ieor(word, ishft(word, -16))
    h = product_32(h, 2246822507_i8)
    h = ieor(h, ishft(h, -13))
    h = product_32(h, 3266489909_i8)
    h = ieor(h, ishft(h, -16))
  end function scrambled

  !> a b modulo 2^32, in two parts so that nothing overflows.
  pure integer(i8) function product_32(a, b) result(c)
    integer(i8), intent(in) :: a, b   !! 0 to 2^32 - 1

    c = iand(a * iand(b, low_16) + ishft(iand(a * ishft(b, -16), low_16), 16), low_32)
  end function product_32

end module pd_random
