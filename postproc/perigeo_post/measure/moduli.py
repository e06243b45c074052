"""The apparent Young's modulus of a plane strain compression test, measured in three ways.

All are (1 - nu^2) times a slope of axial stress against axial strain, fitted by least squares
between 0.02 and 0.1 % nominal strain on first loading (doc/theory.md, section 10):

* *platen* (`curves.apparent_modulus`): reaction over the width of the body, against nominal strain;
* *gauge*: the same stress, against the strain between two lines inside the body, at 1/4 and 3/4 of
  the extent between the platens, as a virtual extensometer sees it;
* *mean*: mean stress of the body against its mean strain.

A line of the gauge is *thick*: its displacement is the mean over the points near it, weighted with
their volumes and exp(-(d/horizon)^2), d the distance from the line, up to two horizons. Single rows
of points carry zero-energy modes, motions that cause no stress, of a size that matters here. With
`thick` = False the line is that: the row of points on it, or between the two rows next to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..read.errors import FieldNotFoundError, RequestError
from ..read.points import FloatArray
from ..read.run import Frame, Run
from .curves import (
    MODULUS_RANGE,
    Modulus,
    axial_stress,
    first_loading,
    poissons_ratio,
    refuse_growing_loads,
)

GAUGE = (0.25, 0.75)  # where the lines of the gauge lie, as parts of the extent
CUT = 2.0  # horizons from the line, beyond which a point does not count
RANGE_SLACK = 0.01  # of the range of the fit: a frame is taken a little after its strain
SAME_ROW = 1.0e-3  # spacings between points of one row


@dataclass(frozen=True)
class GaugeLine:
    """Where a line of the gauge lies and how far it has moved."""

    place: float  # mean reference coordinate along the loading axis [m]
    displacement: float  # mean displacement along it [m]


def gauge_line(frame: Frame, part: float, thick: bool = True) -> GaugeLine:
    """A line across the body, at this part of its extent between the platens."""
    run = frame.run
    if run.strain_axis is None:
        raise RequestError(f"{run.path} has no platens, so no axis for a gauge")
    if not 0.0 <= part <= 1.0:
        raise RequestError(f"a line of the gauge must lie in the body, at 0 to 1, not {part:g}")
    k = 0 if run.strain_axis == "x" else 1
    place = run.positions[run.body, k]
    moved = frame["displacement"][run.body, k]
    volume = run.volumes[run.body]
    away = place - (run.lower[k] + part * run.length)
    weight = _thick_weight(run, away) if thick else _row_weight(run, away)
    weight = weight * volume
    if not weight.sum() > 0.0:
        raise RequestError(f"{run.path} has no points near a line of the gauge")
    return GaugeLine(
        float(np.average(place, weights=weight)), float(np.average(moved, weights=weight))
    )


def _thick_weight(run: Run, away: FloatArray) -> FloatArray:
    scale = run.horizon if np.isfinite(run.horizon) else 4.0 * run.body_points.spacing
    near = np.abs(away) <= CUT * scale * (1.0 + 1e-6)
    return np.asarray(np.where(near, np.exp(-((away / scale) ** 2)), 0.0))


def _row_weight(run: Run, away: FloatArray) -> FloatArray:
    """1 on a row that lies on the line; else linear between the two rows next to it."""
    if run.body_points.lattice is None:
        raise RequestError(f"{run.path} has no rows of points: its points lie on no lattice")
    weight = np.maximum(0.0, 1.0 - np.abs(away) / run.body_points.spacing)
    return np.asarray(np.where(weight < SAME_ROW, 0.0, weight))


def gauge_strain(frame: Frame, lines: tuple[float, float] = GAUGE, thick: bool = True) -> float:
    """Strain between two lines across the body, compression positive: shortening over distance."""
    low, high = (gauge_line(frame, part, thick) for part in lines)
    if not high.place > low.place:
        raise RequestError(f"the lines of the gauge at {lines[0]:g} and {lines[1]:g} are one line")
    return (low.displacement - high.displacement) / (high.place - low.place)


def gauge_modulus(
    run: Run,
    lines: tuple[float, float] = GAUGE,
    thick: bool = True,
    strain_range: tuple[float, float] = MODULUS_RANGE,
    nu: float | None = None,
) -> Modulus:
    """(1 - nu^2) times the slope of axial stress against the strain of a gauge inside the body.

    From the frames with a nominal strain in the range, at least two; the stress at the time of
    each is interpolated in the history.
    """
    ratio = poissons_ratio(run, nu)
    stress, time = axial_stress(run), run.history()["time"]
    frames = _frames_in(run, strain_range)
    if len(frames) < 2:
        low, high = strain_range
        raise RequestError(
            f"{run.path}: {len(frames)} frames lie between {low:g} and {high:g} strain, at least "
            "2 are needed for the gauge (add some to frame_strains)"
        )
    refuse_growing_loads(run, frames[0].time)
    x = np.array([gauge_strain(frame, lines, thick) for frame in frames])
    y = np.interp([frame.time for frame in frames], time[: len(stress)], stress)
    slope = float(np.polyfit(x, y, 1)[0])
    return Modulus((1.0 - ratio**2) * slope, slope, ratio, len(frames), strain_range)


def _frames_in(run: Run, strain_range: tuple[float, float]) -> list[Frame]:
    low, high = strain_range
    slack = RANGE_SLACK * (high - low)
    found: list[Frame] = []
    for frame in run.frames():
        size = abs(frame.strain)
        if size > high + slack:
            break
        if size >= low - slack:
            found.append(frame)
    return found


def mean_modulus(
    run: Run,
    corrected: bool = False,
    strain_range: tuple[float, float] = MODULUS_RANGE,
    nu: float | None = None,
) -> Modulus:
    """(1 - nu^2) times the slope of the mean stress of the body against its mean strain.

    With `corrected` the part of the axial stress that the mean lateral stress causes,
    nu / (1 - nu) of it, is taken off first. It is there where a rough platen hinders the sides.
    """
    ratio = poissons_ratio(run, nu)
    axis = run.strain_axis
    if axis is None:
        raise RequestError(f"{run.path} has no platens, so no nominal strain")
    history = run.history()
    name = f"mean_strain_{axis * 2}"
    if name not in history:
        raise FieldNotFoundError(f"the history of {run.path} has no column {name}")
    stress = -history[f"mean_stress_{axis * 2}"]
    if corrected:
        across = "yy" if axis == "x" else "xx"
        stress = stress + ratio / (1.0 - ratio) * history[f"mean_stress_{across}"]
    nominal = np.abs(history["strain"])
    inside = first_loading(nominal, strain_range)
    if inside.sum() < 3:
        raise RequestError(
            f"{run.path}: {inside.sum()} rows of the history lie in the range of the modulus, at "
            "least 3 are needed (raise history_count)"
        )
    if not corrected:
        refuse_growing_loads(run, float(history["time"][np.flatnonzero(inside)[0]]))
    slope = float(np.polyfit(-history[name][inside], stress[inside], 1)[0])
    return Modulus((1.0 - ratio**2) * slope, slope, ratio, int(inside.sum()), strain_range)
