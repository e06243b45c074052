"""What the shear bands of a state look like: two that cross, one, or none; and which still grow.

* `band_ratio` compares the two bands by all plastic strain so far: what a contour plot shows. A
  band that has stopped growing stays visible, so this ratio falls slowly.
* `band_ratio_growing` compares them by what has been added since an earlier frame. It falls from
  nearly 1 to nearly 0 within 0.2 % strain when one band takes over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..read.errors import NoBandError
from ..read.points import FloatArray
from ..read.run import Frame
from .band import BandSystem
from .band_search import find_bands
from .measures import frame_bands

X_RATIO = 0.25  # weaker over stronger band, from which on two are seen
X_GROWING = 0.5  # the same of what grows; real bands pass by this value quickly
LEAST_STEP = 5.0e-4  # strain to the earlier frame
LEAST_PART = 0.5  # of the strain of the state that the earlier frame must have reached

CROSSING, SINGLE, DIFFUSE, ELASTIC = "X", "single", "diffuse", "none"


@dataclass(frozen=True)
class Pattern:
    """The bands of one state; None where the results do not tell."""

    name: str  # "X" | "single" | "diffuse" | "none" (no plastic strain)
    growing: str | None
    ratio: float | None  # weaker over stronger band, all plastic strain so far
    ratio_growing: float | None  # the same of what has been added since the frame before


def pattern_of(frame: Frame) -> Pattern:
    """Pattern of a frame and of its growth since an earlier frame of the run."""
    alpha = frame["plastic_strain"][frame.run.body]
    if not alpha.max(initial=0.0) > 0.0:
        return Pattern(ELASTIC, None, None, None)
    system = _found(lambda: frame_bands(frame))
    before = earlier_frame(frame)
    name = DIFFUSE if system is None else _name(system.ratio, X_RATIO)
    ratio = None if system is None else system.ratio
    if before is None:
        return Pattern(name, None, ratio, None)
    added = _added(frame, before)
    if not added.max() > 0.0:
        return Pattern(name, ELASTIC, ratio, None)
    grown = _found(lambda: _bands_of(frame, added))
    if grown is None:
        return Pattern(name, DIFFUSE, ratio, None)
    return Pattern(name, _name(grown.ratio, X_GROWING), ratio, grown.ratio)


def growth_ratio(frame: Frame, before: Frame) -> float | None:
    """Weaker over stronger band in what has been added since a frame; None without a band."""
    added = _added(frame, before)
    grown = _found(lambda: _bands_of(frame, added))
    return None if grown is None else grown.ratio


def _added(frame: Frame, before: Frame) -> FloatArray:
    body = frame.run.body
    return np.maximum(frame["plastic_strain"][body] - before["plastic_strain"][body], 0.0)


def earlier_frame(frame: Frame) -> Frame | None:
    """The last frame before this one with less strain by 0.05 %, if it has at least half of it.

    In tension, where strains are negative, as in compression.
    """
    way = -1.0 if frame.strain < 0.0 else 1.0
    there = [
        other
        for other in frame.run.frames()
        if other.number is not None
        and frame.number is not None
        and other.number < frame.number
        and way * other.strain <= way * frame.strain - LEAST_STEP
        and way * other.strain >= LEAST_PART * way * frame.strain
    ]
    return there[-1] if there else None


def _name(ratio: float, least: float) -> str:
    return CROSSING if ratio >= least else SINGLE


def _bands_of(frame: Frame, alpha: FloatArray) -> BandSystem:
    run = frame.run
    return find_bands(
        run.body_points, alpha, run.strain_axis or "y", run.horizon,
        extents=(run.lower, run.upper),
    )  # fmt: skip


def _found(find: Callable[[], BandSystem]) -> BandSystem | None:
    try:
        return find()
    except NoBandError:
        return None
