"""How far the wall of a thick cylinder flows under a pressure, and the figure of it.

In each of 18 directions the radius is that of the outermost point that has flowed; the mean over
them is set against Tresca's closed form (tests/reference/thick_cylinder.py). Von Mises with a
Poisson's ratio of 0.3 is 0.4 % farther out at 12 kPa, and 1 % at 13.2 kPa.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from perigeo_post import PostError, Run
from perigeo_post.draw.style import new_figure, style
from verify import ROOT

if TYPE_CHECKING:
    from limit_cases import Found

sys.path.append(str(ROOT / "tests" / "reference"))
exact = importlib.import_module("thick_cylinder")

INNER, OUTER = 1.0, 2.0  # radii [m]
DIRECTIONS = 18
FLOWED = 1.0e-7  # equivalent plastic strain of a point that has flowed


def exact_radius(pressure: float, cohesion: float) -> float:
    """Radius out to which the wall flows [m]; pressure and cohesion in one unit."""
    return float(exact.plastic_radius(pressure, cohesion, INNER, OUTER))


def radii(run: Run) -> np.ndarray:
    """Pressure [kPa] of every frame, and radius [m]: mean, smallest, largest direction."""
    value = (run.number("pressure(inside).value") or 0.0) / 1e3
    ramp = run.number("pressure(inside).ramp_time") or 1.0
    place = run.positions[run.body]
    distance = np.hypot(*place.T)
    direction = np.arctan2(place[:, 1], place[:, 0]) / (0.5 * np.pi / DIRECTIONS)
    direction = np.clip(direction.astype(int), 0, DIRECTIONS - 1)
    rows = []
    for frame in run.frames():
        flows = frame["plastic_strain"][run.body] > FLOWED
        out_to = [distance[flows & (direction == k)].max(initial=INNER) for k in range(DIRECTIONS)]
        rows.append([value * frame.time / ramp, np.mean(out_to), min(out_to), max(out_to)])
    return np.array(rows)


def radius_at(pressure: float, run: Run) -> float:
    """Mean radius at a pressure [kPa], between the frames beside it."""
    found = radii(run)
    if found[-1, 0] < pressure:
        raise PostError(f"{run.path}: the wall does not bear {pressure:g} kPa")
    return float(np.interp(pressure, found[:, 0], found[:, 1]))


def radius_figure(rows: list[Found], cohesion: float) -> Figure:
    """Radius against pressure on all grids, beside the closed form; cohesion in kPa."""
    limit = exact.limit_pressure(cohesion, INNER, OUTER)
    first = exact.plastic_radius_pressure(INNER, cohesion, INNER, OUTER)
    with style():
        figure = new_figure(120.0, 80.0)
        axes = figure.add_subplot()
        curve = np.linspace(first, limit, 200)
        axes.plot(
            curve, [exact_radius(p, cohesion) for p in curve], color="black", label="closed form"
        )
        axes.axvline(limit, color="black", linestyle=":", linewidth=0.8, label="limit, 2 c ln(b/a)")
        for row, mark in zip(rows, ("^", "s", "o")):
            found = radii(Run(row.path))
            there = found[:, 0] > first - 0.5
            line = axes.plot(*found[there, :2].T, mark, markersize=3.5, label=row.grid)[0]
            if row.finest:
                axes.fill_between(
                    found[there, 0],
                    *found[there, 2:].T,
                    color=line.get_color(),
                    alpha=0.2,
                    linewidth=0.0,
                    label=f"{row.grid}, all directions",
                )
        axes.set(
            xlabel="pressure in kPa",
            ylabel="radius out to which the wall flows, in m",
            xlim=(first - 0.5, limit + 0.2),
            ylim=(INNER - 0.02, OUTER + 0.02),
            title="Thick cylinder: elastic and plastic part of the wall",
        )
        axes.legend(loc="upper left")
    return figure
