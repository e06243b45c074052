"""The branch of a stress-strain curve behind its peak: how steep it is, what it dissipates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..read.errors import RequestError
from ..read.points import FloatArray
from ..read.run import Run
from .curves import peak, stress_strain

UPPER, LOWER = 0.9, 0.5  # of the peak stress, between which the slope is taken


@dataclass(frozen=True)
class Softening:
    """Numbers of the softening branch; NaN where the run ends before."""

    peak_stress: float  # [Pa]
    strain_at_peak: float
    strain_upper: float  # where the stress has fallen to UPPER of the peak
    strain_lower: float  # to LOWER
    slope: float  # [Pa] fall of stress over strain between the two, positive
    displacement: float  # [m] motion of the platens between the two, positive in tension too


def softening_branch(run: Run) -> Softening:
    """The straight line between the first falls to 90 % and to 50 % of the peak stress."""
    curve = stress_strain(run)
    top, at = peak(curve)
    if not np.isfinite(top) or top == 0.0:
        raise RequestError(f"{run.path} has no peak stress")
    start = int(np.nanargmax(np.abs(curve.y)))
    upper = _first_below(curve.x[start:], curve.y[start:] / top, UPPER)
    lower = _first_below(curve.x[start:], curve.y[start:] / top, LOWER)
    way = (lower - upper) * (-1.0 if at < 0.0 else 1.0)  # in tension strains are negative
    slope = (UPPER - LOWER) * abs(top) / way if way > 0.0 else float("nan")
    return Softening(top, at, upper, lower, slope, way * run.length)


def _first_below(strain: FloatArray, part: FloatArray, level: float) -> float:
    """Strain at which the stress, as a part of its peak, first falls to a level."""
    below = np.flatnonzero(part <= level)
    if not len(below) or below[0] == 0:
        return float("nan")
    k = int(below[0])
    share = (part[k - 1] - level) / (part[k - 1] - part[k])
    return float(strain[k - 1] + share * (strain[k] - strain[k - 1]))


def strain_rate(run: Run) -> float:
    """Mean rate of the nominal strain over the run [1/s]."""
    history = run.history()
    if "strain" not in history or history.rows < 2:
        raise RequestError(f"{run.path} has no rate of strain")
    return float(history["strain"][-1] / history["time"][-1])
