"""Where bands begin, how plastic strain grows along them, and when one of two takes over.

* `first_yield`: the nominal strain at which a point yields first, and the place of the largest
  plastic strain in the first frame with any.
* `ridge_growth`: what is added between two frames along the ridges of both bands, on the parts
  that profiles are taken from (without the ends and the crossing): near the first platen (the
  foot), before the crossing, and on either side of it. A band that spreads from its foot grows
  there first.
* `change_of`: the nominal strain at which what is added to the weaker band falls to given parts of
  what is added to the stronger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..read.errors import NoBandError, RequestError
from ..read.points import FloatArray
from ..read.run import Frame, Run
from .band import Band
from .measures import frame_bands
from .pattern import X_RATIO, growth_ratio
from .sampling import interpolate

FOOT = (
    1.0 / 3.0
)  # part of the lower leg of a band that is its foot, and as much before the crossing
LONGEST_STEP = 2.0e-3  # strain between two frames whose difference tells when something changed


@dataclass(frozen=True)
class FirstYield:
    """When and where a body yields first."""

    strain: float  # nominal, of the first row of the history with plastic strain
    place: tuple[float, float]  # of the largest plastic strain in the first frame with any [m]


@dataclass(frozen=True)
class RidgeGrowth:
    """Plastic strain added along the ridges of two bands, means over their parts."""

    foot: float  # the third of the lower legs nearest to the first platen
    centre: float  # the third nearest to the crossing
    lower: float  # the whole of the lower legs
    upper: float  # beyond the crossing


def first_yield(run: Run) -> FirstYield:
    """The first plastic strain of a run."""
    history = run.history()
    plastic = np.flatnonzero(history["max_plastic_strain"] > 0.0)
    for frame in run.frames():
        alpha = frame["plastic_strain"][run.body]
        if len(plastic) and alpha.max(initial=0.0) > 0.0:
            place = run.positions[run.body][int(alpha.argmax())]
            strain = float(history["strain"][plastic[0]])
            return FirstYield(strain, (float(place[0]), float(place[1])))
    raise NoBandError("there is no plastic strain in this run")


def ridge_growth(run: Run, start: float, end: float) -> RidgeGrowth:
    """What both bands gain between the frames at two strains, along the ridges of the later one."""
    before, after = run.frame(strain=start), run.frame(strain=end)
    bands = frame_bands(after)
    if bands.other is None or bands.crossing is None or bands.ratio < X_RATIO:
        raise NoBandError("there are no two bands that cross in the later frame")
    added = (after["plastic_strain"] - before["plastic_strain"])[run.body]
    legs = [_legs(run, band, bands.crossing, added) for band in (bands.prevailing, bands.other)]
    foot, centre, lower, upper = (
        np.concatenate([np.atleast_1d(leg[k]) for leg in legs]) for k in range(4)
    )
    if not min(len(foot), len(centre), len(upper)):
        raise NoBandError("a leg of the bands is too short to tell its parts apart")
    return RidgeGrowth(*(float(part.mean()) for part in (foot, centre, lower, upper)))


def _legs(
    run: Run, band: Band, crossing: tuple[float, float], added: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """What is added along one band: foot, before the crossing, lower leg, upper leg."""
    k = 0 if run.strain_axis == "x" else 1
    along = (band.ridge_x, band.ridge_y)[k]
    values = interpolate(run.body_points, added, band.ridge_x, band.ridge_y)
    good = band.used & np.isfinite(values)
    lower, upper = good & (along < crossing[k]), good & (along > crossing[k])
    if not lower.any():
        return (np.array([]),) * 4
    low, high = along[lower].min(), along[lower].max()
    foot = lower & (along <= low + FOOT * (high - low))
    centre = lower & (along >= high - FOOT * (high - low))
    return values[foot], values[centre], values[lower], values[upper]


def growth_curve(run: Run) -> tuple[FloatArray, FloatArray]:
    """Ratio of growth of the two bands between frames next to each other, at the middle strain."""
    frames = run.frames()
    strains, ratios = [], []
    for before, after in zip(frames, frames[1:]):
        if not _near(before, after):
            continue
        ratio = growth_ratio(after, before)
        if ratio is not None:
            strains.append(0.5 * (before.strain + after.strain))
            ratios.append(ratio)
    return np.array(strains), np.array(ratios)


def _near(before: Frame, after: Frame) -> bool:
    return 0.0 < abs(after.strain) - abs(before.strain) <= LONGEST_STEP


def change_of(run: Run, parts: Sequence[float]) -> list[float]:
    """Strains at which the ratio of growth falls below these parts for good."""
    strains, ratios = growth_curve(run)
    return [falls_below(strains, ratios, part) for part in parts]


def falls_below(x: FloatArray, y: FloatArray, level: float) -> float:
    """The last place at which y falls below a level, linear between its values."""
    above = np.flatnonzero(y >= level)
    if not len(above):
        raise RequestError("one band prevails in all frames that are near enough to each other")
    k = int(above[-1])
    if k + 1 == len(y):
        raise RequestError("both bands still grow in the last frames")
    return float(x[k] + (y[k] - level) / (y[k] - y[k + 1]) * (x[k + 1] - x[k]))
