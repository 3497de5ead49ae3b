! The heavy elastica of a strip whose gripper moves along x (docs/physics.md, section 4) as a boundary-value problem for
! AUTO-07p.  In units of L*.  Unknowns along the part off the floor, from the lift-off on: X, Z, theta, curvature.
! Parameters: 1 lambda, 2 free length, 3 F_x, 4 F_0, 5 height.

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: length
  ! The arc length itself is an unknown, so that the system does not depend on the place: it is the fifth.
  length = par(2)
  f(1) = length * cos(u(3))
  f(2) = length * sin(u(3))
  f(3) = length * u(4)
  f(4) = length * (par(3) * sin(u(3)) - (par(4) + u(5)) * cos(u(3)))
  f(5) = length
end subroutine func

subroutine stpnt(ndim, u, par, t)
  ! The state that is started from: rows of `start.dat`, the first the parameters, the others t and the unknowns.
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  integer, parameter :: most = 1000
  double precision, save :: rows(6, most), given(5)
  integer, save :: n = 0
  integer :: i, status
  double precision :: share
  if (n == 0) then
    open (unit=91, file='start.dat', status='old')
    read (91, *) given
    do
      read (91, *, iostat=status) rows(:, n + 1)
      if (status /= 0) exit
      n = n + 1
    end do
    close (91)
  end if
  par(1:5) = given
  i = 1
  do while (i < n - 1 .and. rows(1, i + 1) < t)
    i = i + 1
  end do
  share = (t - rows(1, i)) / (rows(1, i + 1) - rows(1, i))
  u = (1.0d0 - share) * rows(2:, i) + share * rows(2:, i + 1)
end subroutine stpnt

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  fb(1:5) = u0
  fb(6) = u1(4)
  fb(7) = u1(2) - par(5)
  fb(8) = par(1) - (par(2) - u1(1))
end subroutine bcnd

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  implicit none
  integer, intent(in) :: ndim, icp(*), nint, ijac
  double precision, intent(in) :: par(*), u(ndim), uold(ndim), udot(ndim), upold(ndim)
  double precision, intent(out) :: fi(nint)
  double precision, intent(inout) :: dint(nint, *)
end subroutine icnd

subroutine fopt(ndim, u, icp, par, ijac, fs, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: fs
  double precision, intent(inout) :: dfdu(ndim), dfdp(*)
  fs = 0.0d0
end subroutine fopt

subroutine pvls(ndim, u, par)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(in) :: u(ndim)
  double precision, intent(inout) :: par(*)
end subroutine pvls
