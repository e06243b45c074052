"""Limit loads that perigeo is compared with, computed without it.

    python tests/reference/limit_loads.py

prints all numbers with how they were found and how sure they are; the functions are to import.
Loads have no dimension: they are divided by the undrained strength c (c0 at the surface where it
grows), and lengths by B, H or h. Only numpy is needed; README.md says more on every row.
"""

from __future__ import annotations

import json
import sys
from math import pi, sqrt
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import slip_lines
import thick_cylinder
from slip_circles import critical_toe_circle

PRANDTL = slip_lines.PRANDTL
LINES = (20, 40, 80)  # + lines below half a footing, for the table
VERTICAL_CUT = (3.776, 3.778)  # bounds of the literature, see README.md
TAYLOR_60 = 1.0 / 0.191  # stability number in Taylor's chart
BOUNDS = json.loads(Path(__file__).with_name("bounds.json").read_text())


def footing(ratio, rough, lines=40):
    """Return q / c0 of a strip footing on c = c0 + k z, ratio = k B / c0 up to 10."""
    solve = slip_lines.rough if rough else slip_lines.smooth
    return slip_lines.extrapolated([solve(ratio, n).load for n in (lines // 2, lines)])


def footing_api(ratio, rough):
    """Return q / c0 by the fit of API RP 2GEO (2011), annex A, to Davis and Booker (1973)."""
    a, b, c, d = (2.56, 0.457, 0.713, 1.38) if rough else (1.372, 0.07, -0.128, 0.342)
    factor = a + b * ratio - sqrt((c + b * ratio) ** 2 + d**2)
    return factor * (PRANDTL + 0.25 * ratio)


def bounds(case):
    """Return the best lower and upper bound of a case of bounds.json."""
    return max(row["lower"] for row in BOUNDS[case]), min(row["upper"] for row in BOUNDS[case])


def trapdoor(cover):
    """Return bounds of N = (sigma_s + gamma H - sigma_t) / c, for H / B = 1, 2 or 3."""
    return bounds(f"trapdoor H/B={cover} rough")


def trapdoor_block(cover):
    """Return an upper bound of N: the block above the trapdoor slides down between its sides."""
    return 2.0 * cover


def slope(degrees):
    """Return bounds of gamma h / c, for 60 or 90 degrees."""
    return bounds(f"slope {degrees} degrees")


def wall_force(height, unit_weight, c, passive=False):
    """Return the force on a smooth wall that moves without turning (Rankine; tension counts)."""
    sign = 1.0 if passive else -1.0
    return 0.5 * unit_weight * height**2 + sign * 2.0 * c * height


def footing_rows():
    """Return the rows of the strip footing."""
    for ratio in (0, 1, 2, 4, 8):
        for rough in (False, True):
            solve = slip_lines.rough if rough else slip_lines.smooth
            loads = [solve(ratio, n).load for n in LINES]
            best = slip_lines.extrapolated(loads)
            kind = "rough" if rough else "smooth"
            fine = " ".join(f"{load:.4f}" for load in loads)
            case = f"footing kB/c0={ratio} {kind}"
            held = "; bounds {:.3f} {:.3f}".format(*bounds(case)) if case in BOUNDS else ""
            note = (
                f"F {slip_lines.factor(best, ratio):.4f}, API {footing_api(ratio, rough):.3f}{held}"
            )
            yield case, "q/c0", f"{best:.4f}", f"slip lines, {LINES}: {fine}", note


def bound_rows():
    """Return the rows of trapdoor, cut, slope and block."""
    for case, rows in BOUNDS.items():
        if case.startswith("footing"):
            continue
        low, high = bounds(case)
        by_mesh = ", ".join(f"{r['triangles']}: {r['lower']:.3f} {r['upper']:.3f}" for r in rows)
        name = {"trapdoor": "N", "block": "p/2c"}.get(case.split()[0], "gamma h/c")
        note = f"half the gap is {100.0 * (high - low) / (high + low):.2f} % of the mean"
        yield case, name, f"{low:.3f} {high:.3f}", f"finite elements, {by_mesh}", note
    for degrees, published in ((90, 3.83), (60, TAYLOR_60)):
        value, exit_at, half = critical_toe_circle(degrees)
        place = (
            f"meets the crest {exit_at:.3f} h from the toe, angle {np.degrees(2 * half):.1f} deg"
        )
        note = f"published: {published:.2f}; an upper bound"
        yield f"slope {degrees} degrees, circle", "gamma h/c", f"{value:.4f}", place, note


def cylinder_rows(a=1.0, b=2.0):
    """Return the rows of the thick cylinder."""
    case = f"thick cylinder b/a = {b / a:g}"
    yield case, "p/c limit", f"{thick_cylinder.limit_pressure(1, a, b):.4f}", "2 ln(b/a)", "any nu"
    first = [f"{thick_cylinder.yield_pressure(1.0, a, b, nu):.4f}" for nu in (0.5, 0.3)]
    yield case, "p/c first yield", " ".join(first), "von Mises, nu = 0.5, 0.3", "Lame"
    half_way = thick_cylinder.plastic_radius_pressure(0.5 * (a + b), 1.0, a, b)
    yield case, "p/c half plastic", f"{half_way:.4f}", "c (2 ln(r/a) + 1 - r^2/b^2)", "nu = 0.5"
    young = 1000.0
    for nu in (0.49, 0.3):
        moves = [thick_cylinder.displacement(p, 1.0, a, b, young, nu) for p in (0.7, 1.0, 1.3)]
        values = [
            thick_cylinder.von_mises_curve(moves, 1.0, a, b, young, nu, n, 2 * n) for n in (50, 100)
        ]
        fine = " / ".join(" ".join(f"{v:.4f}" for v in row) for row in values)
        note = f"von Mises, 50 and 100 elements: {fine}"
        at = " ".join(f"{1e3 * move:.4f}" for move in moves)
        yield f"{case}, nu = {nu}", "1000 u/a at p/c = .7 1 1.3", at, "closed form (Tresca)", note


def main():
    """Print the table."""
    print(f"{'case':29s}{'quantity':28s}{'value':22s}how; convergence | compared with")
    for rows in (footing_rows(), bound_rows(), cylinder_rows()):
        for case, quantity, value, how, note in rows:
            print(f"{case:29s}{quantity:28s}{value:22s}{how} | {note}")
    print(f"{'strip footing, c constant':29s}{'q/c':28s}{2.0 + pi:<22.4f}2 + pi | Prandtl 1921")


if __name__ == "__main__":
    main()
