"""Limit load of a strip footing on clay whose strength grows with depth, by slip lines.

Undrained strength c(z) = c0 + k z below a surface without surcharge; phi = 0, so that unit weight
changes nothing. Compression is positive, x points to the right, z down. The state at a point is
s, the mean stress in the plane without that of the unit weight, and psi, the angle from the
vertical to the larger principal stress:

    sigma_zz = s + c cos 2 psi,  sigma_xx = s - c cos 2 psi,  tau_xz = c sin 2 psi.

Equilibrium in the plane then reads, along two families of lines,

    + lines  dx = tan(psi + pi/4) dz :  ds + 2 c dpsi + k dx = 0
    - lines  dx = tan(psi - pi/4) dz :  ds - 2 c dpsi - k dx = 0.

The footing lies to the left of the origin, its edge there. + lines come from the free surface
(psi = pi/2, s = c0), turn through a fan of - lines that start from the edge (s = c0 (1 + pi - 2
psi) there), and end

- smooth footing: on its base, where psi = 0. The pressure at a distance from the edge does not
  depend on the width;
- rough footing: on a last - line, which starts from the edge, meets the axis of symmetry with
  psi = 0 and bounds soil that moves as a part of the footing. If the fan needs more room than the
  base leaves, psi = -pi/4 at the edge, the soil slides along an outer part of the base (tau = c0
  there) and the last - line starts where that part ends.

Construction as in Martin, C.M. (2003), User guide for ABC, OUEL report 2261/03, section 2.5, after
Davis, E.H. & Booker, J.R. (1973), The effect of increasing strength with depth on the bearing
capacity of clays, Geotechnique 23(4), 551-563. Derivatives along lines are taken between two
points, with what belongs to the middle between them: errors fall with the square of the spacing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import cos, pi, sin, tan

PRANDTL = 2.0 + pi
LARGEST = 10.0  # k B / c0
Point = tuple  # x, z [c0 / k], s [c0], psi [rad]


@dataclass
class Solution:
    """What `smooth` and `rough` return; lengths in c0 / k, with k = 0 in half widths."""

    load: float  # mean pressure [c0]
    fan: float  # psi of the last line of the fan at the edge [rad]
    sliding: float  # part of the base along which soil slides with tau = c0
    lines: list  # + lines from the surface on, each a list of points


def check(ratio: float) -> None:
    """Refuse what the even spacing of lines on the surface does not resolve."""
    if not 0.0 <= ratio <= LARGEST:
        raise ValueError(f"k B / c0 = {ratio:g}: it must be from 0 to {LARGEST:g}")


def crossing(a: Point, b: Point, k: float) -> Point:
    """Return where the + line through a meets the - line through b."""
    (xa, za, sa, pa), (xb, zb, sb, pb) = a, b
    x, z, p = xa, za, 0.5 * (pa + pb)
    for _ in range(100):
        plus, minus = 0.5 * (pa + p) + 0.25 * pi, 0.5 * (pb + p) - 0.25 * pi
        ux, uz, vx, vz = sin(plus), cos(plus), sin(minus), cos(minus)
        along = (vx * (zb - za) - vz * (xb - xa)) / (vx * uz - vz * ux)
        new_x, new_z = xa + along * ux, za + along * uz
        ca, cb = 1.0 + 0.5 * k * (za + new_z), 1.0 + 0.5 * k * (zb + new_z)
        rest = sa - sb - k * (2.0 * new_x - xa - xb)
        new_p = (rest + 2.0 * (ca * pa + cb * pb)) / (2.0 * (ca + cb))
        change = abs(new_x - x) + abs(new_z - z) + abs(new_p - p)
        x, z, p = new_x, new_z, new_p
        if change < 1e-13:
            return x, z, sa - 2.0 * ca * (p - pa) - k * (x - xa), p
    raise ArithmeticError("two slip lines do not find their crossing")


def base_point(a: Point, psi: float, k: float) -> Point:
    """Return where the + line through a meets the base, on which psi is given."""
    xa, za, sa, pa = a
    x = xa - za * tan(0.5 * (pa + psi) + 0.25 * pi)
    return x, 0.0, sa - (2.0 + k * za) * (psi - pa) - k * (x - xa), psi


def edge_fan(last: float, parts: int) -> list[Point]:
    """Return the states at the edge, from the free surface to the last line of the fan."""
    angles = [0.5 * pi + (last - 0.5 * pi) * i / parts for i in range(parts + 1)]
    return [(0.0, 0.0, 1.0 + pi - 2.0 * psi, psi) for psi in angles]


def next_line(line: list[Point], x: float, k: float) -> list[Point]:
    """Return the + line from the surface at x to the last - line that crosses the line before."""
    points = [(x, 0.0, 1.0, 0.5 * pi)]
    for point in line:
        points.append(crossing(points[-1], point, k))
    return points


def cut(a: Point, b: Point, part: float) -> Point:
    """Return the state between a and b."""
    return tuple(u + part * (v - u) for u, v in zip(a, b))


def force_above(points: list[Point], k: float) -> float:
    """Return the downward force that soil below a line passes to what is above it."""
    total = 0.0
    for a, b in zip(points, points[1:]):
        (_, za, sa, pa), (_, zb, sb, pb) = a, b
        ca, cb = 1.0 + k * za, 1.0 + k * zb
        normal = 0.5 * (sa + ca * cos(2.0 * pa) + sb + cb * cos(2.0 * pb))
        shear = 0.5 * (ca * sin(2.0 * pa) + cb * sin(2.0 * pb))
        total += normal * (a[0] - b[0]) + shear * (zb - za)
    return total


def smooth(ratio: float, lines: int = 40) -> Solution:
    """Return the limit load of a smooth footing for ratio = k B / c0."""
    check(ratio)
    k, half = (1.0, 0.5 * ratio) if ratio > 0.0 else (0.0, 1.0)
    line = edge_fan(0.0, lines)
    base, net = [line[-1]], [line]
    while base[-1][0] > -half:
        line = next_line(line, half * len(net) / lines, k)
        line.append(base_point(line[-1], 0.0, k))
        net.append(line)
        base.append(line[-1])
    part = (base[-2][0] + half) / (base[-2][0] - base[-1][0])
    base[-1] = cut(base[-2], base[-1], part)
    return Solution(force_above(base, k) / half, 0.0, 0.0, net)


def rough_net(fan: float, reach: float, sliding: int, spacing: float, parts: int, k: float = 1.0):
    """Return half the width and the solution of a rough footing.

    The fan ends at psi = fan. `sliding` + lines end on the base; on the surface they lie within
    `reach` of the edge, the others `spacing` apart. Lines are added until psi = 0 on the last -
    line (k = 0: psi is 0 all along it, and the width is 2).
    """
    line = edge_fan(fan, parts)
    net, base = [line], [line[-1]]
    for i in range(sliding):
        line = next_line(line, reach * (i + 1) / sliding, k)
        line.append(base_point(line[-1], -0.25 * pi, k))
        net.append(line)
        base.append(line[-1])
    last = [line[-1]]
    while last[-1][3] < 0.0 if k > 0.0 else last[-1][0] > -1.0:
        line = next_line(line, reach + spacing * len(last), k)
        net.append(line)
        last.append(line[-1])
    (xa, _, _, pa), (xb, _, _, pb) = last[-2:]
    last[-1] = cut(last[-2], last[-1], pa / (pa - pb) if k > 0.0 else (xa + 1.0) / (xa - xb))
    half = -last[-1][0]
    load = (force_above(base, k) + force_above(last, k)) / half
    return half, Solution(load, fan, -base[-1][0] / half, net)


def width_met(half: float, net, first: float, second: float):
    """Return the solution of the net(value) whose half width is the one given, and its value."""
    a, b = first, second
    width_a, width_b = net(a)[0], net(b)[0]
    for _ in range(60):
        c = b - (width_b - half) * (b - a) / (width_b - width_a)
        width, solution = net(c)
        if abs(width - half) < 1e-10 * half:
            return solution, c
        a, width_a, b, width_b = b, width_b, c, width
    raise ArithmeticError("no net of slip lines has the width that was asked for")


def rough(ratio: float, lines: int = 40) -> Solution:
    """Return the limit load of a rough footing for ratio = k B / c0."""
    check(ratio)
    parts = lines + lines // 2
    if ratio == 0.0:
        return rough_net(0.0, 0.0, 0, 1.0 / lines, parts, k=0.0)[1]
    half = 0.5 * ratio
    spacing = half / lines
    widest = rough_net(-0.25 * pi, 0.0, 0, 0.6 / lines, parts)[0]
    if half <= widest:
        guess = 0.25 * pi * half / widest
        net = partial(rough_net, reach=0.0, sliding=0, spacing=spacing, parts=parts)
        return width_met(half, lambda angle: net(-angle), guess, 1.1 * guess)[0]
    # The more the base slides, the more of the surface belongs to it: first coarse, then fine.
    reach = 0.5 * (half - widest)
    for sliding, step, count in ((2, 0.1 * half, 12), (0, spacing, parts)):
        net = partial(rough_net, -0.25 * pi, sliding=sliding or max(1, round(reach / step)))
        net = partial(net, spacing=step, parts=count)
        solution, reach = width_met(half, net, 0.95 * reach, reach)
    return solution


def factor(load: float, ratio: float) -> float:
    """Return F of Davis and Booker: q = F ((2 + pi) c0 + k B / 4)."""
    return load / (PRANDTL + 0.25 * ratio)


def extrapolated(values: list[float]) -> float:
    """Return the limit of values whose error falls to a quarter from one to the next."""
    return values[-1] + (values[-1] - values[-2]) / 3.0
