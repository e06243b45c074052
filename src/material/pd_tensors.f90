!> Tensors in the plane and across it.
!>
!> Symmetric tensors have the components xx yy zz xy, gradients in the plane xx xy yx yy.
module pd_tensors
  use pd_kinds, only: wp
  implicit none
  private

  public :: deviator, norm, inner, von_mises, determinant

contains

  !> Deviatoric part.
  pure function deviator(tensor) result(s)
    real(wp), intent(in) :: tensor(4)
    real(wp) :: s(4)

    s = tensor
    s(1:3) = s(1:3) - (tensor(1) + tensor(2) + tensor(3)) / 3.0_wp
  end function deviator

  !> a : b of two symmetric tensors.
  pure real(wp) function inner(a, b)
    real(wp), intent(in) :: a(4), b(4)

    inner = a(1) * b(1) + a(2) * b(2) + a(3) * b(3) + 2.0_wp * a(4) * b(4)
  end function inner

  !> |a|.
  pure real(wp) function norm(a)
    real(wp), intent(in) :: a(4)

    norm = sqrt(inner(a, a))
  end function norm

  !> sqrt(3/2)|dev stress|.
  pure real(wp) function von_mises(stress)
    real(wp), intent(in) :: stress(4)

    von_mises = sqrt(1.5_wp) * norm(deviator(stress))
  end function von_mises

  !> det F of F = I + H.
  pure real(wp) function determinant(h)
    real(wp), intent(in) :: h(4)   !! H xx xy yx yy

    determinant = (1.0_wp + h(1)) * (1.0_wp + h(4)) - h(2) * h(3)
  end function determinant

end module pd_tensors
