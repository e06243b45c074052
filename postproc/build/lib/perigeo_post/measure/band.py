"""Shear bands: where they lie, how steep, how wide, and which of the two prevails.

Definitions (the README of this package has them in words):

* A *profile* is the equivalent plastic strain alpha along a straight line.
* The *width* of a band is the extent across it within which alpha is at least `level` (10 %) of
  the peak. It is the median over places along the band, at each of which a profile is fitted to
  the points as averages over their cells (band_fit.py): this does not depend on the spacing.
* The *interpolated width* is the paper's measure: the same extent on one profile, read between
  the points by bilinear interpolation. It is too wide, by more the coarser the points; its
  uncertainty is one point spacing, half a spacing at each edge.
* Two *bands* are looked for, one in each diagonal direction: "rising" (the coordinate across the
  specimen grows with the one along the loading axis) and "falling". The ridge of a band is where
  profiles across it have their peak; a straight line fitted to it gives the angle and place.
* The *strength* of a band is the median of those peaks along the ridge, without a tenth of the
  length at each end and without the crossing of the two bands, where the strains of both add up.
* The *prevailing* band is the stronger one; `ratio` = weaker over stronger strength.
* The profile across a band is taken through its *probe*: the place on the ridge farthest from both
  ends and from the crossing, among those where the peak is at least 0.8 of the largest; of two
  such legs the one farther along the loading axis, unless the other is a tenth longer. Places
  where the profile does not end, or is 1.5 times as wide as the median, belong to a third band
  too and are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..read.errors import NoBandError, RequestError
from ..read.points import BoolArray, FloatArray, PointSet
from ..read.shown import Short
from .sampling import interpolate

Line = tuple[tuple[float, float], tuple[float, float]]

LEVEL = 0.10  # of the peak, where the width is taken
NO_STRAIN = 1.0e-12  # plastic strain below this is none


@dataclass(frozen=True, repr=False)
class Profile(Short):
    """Values along a straight line from `line[0]` to `line[1]`."""

    line: Line
    distance: FloatArray  # (k) from the first end [m]
    x: FloatArray  # (k) [m]
    y: FloatArray  # (k) [m]
    values: FloatArray  # (k), NaN outside the body
    name: str = "plastic_strain"
    unit: str = "1"


@dataclass(frozen=True)
class Width:
    """Extent of a profile round its peak, between points: the interpolated width."""

    width: float  # [m]; NaN where the profile has no peak
    left: float  # distances of the two edges from the start of the line [m]
    right: float
    peak: float
    peak_distance: float  # [m]
    peak_position: tuple[float, float]
    level: float
    uncertainty: float  # [m]
    closed: bool  # False: the profile ends before it falls below the level, width is a lower bound


@dataclass(frozen=True)
class FittedWidth:
    """The width of a band from fits at places along it, at right angles to it."""

    width: float  # median [m]; NaN where there is no place to fit
    spread: float  # half the distance between the quartiles [m]
    places: int
    level: float  # part of the peak


@dataclass(frozen=True, repr=False)
class Band(Short):
    """One band: the straight line fitted to its ridge, and what is found along it."""

    direction: str  # "rising" | "falling"
    angle: float  # between the band and the loading axis [degrees], 0 to 90
    angle_uncertainty: float  # [degrees], from the spacing over the length fitted
    line: Line  # both ends, on the edge of the body
    length: float  # [m]
    middle: tuple[float, float]  # of that line
    strength: float  # median of the peaks across the band along the ridge
    ridge_max: float  # largest of them
    ridge_position: tuple[float, float]  # where that is
    probe: tuple[float, float]  # where the profile across the band is taken
    width_interpolated: float  # median of the widths between points over the same places [m]
    ridge_distance: FloatArray = field(repr=False)  # (k) along the line from its first end [m]
    ridge_x: FloatArray = field(repr=False)
    ridge_y: FloatArray = field(repr=False)
    ridge_values: FloatArray = field(repr=False)  # (k) peak across the band
    used: BoolArray = field(repr=False)  # (k) False near ends and crossing


@dataclass(frozen=True, repr=False)
class BandSystem(Short):
    """The two bands of a field; `prevailing` is the stronger."""

    prevailing: Band
    other: Band | None
    ratio: float  # weaker over stronger strength, 0 where there is no second band
    crossing: tuple[float, float] | None
    axis: str  # loading axis


def profile_along(
    points: PointSet,
    values: npt.ArrayLike,
    line: Line,
    step: float | None = None,
    name: str = "plastic_strain",
    unit: str = "1",
) -> Profile:
    """Values along a line, every twentieth of the spacing (or `step` [m])."""
    (x0, y0), (x1, y1) = line
    length = float(np.hypot(x1 - x0, y1 - y0))
    if not length > 0.0:
        raise RequestError("the two ends of the line are the same point")
    count = int(np.ceil(length / (step or points.spacing / 20.0))) + 1
    t = np.linspace(0.0, 1.0, min(max(count, 3), 200_001))
    x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
    found = interpolate(points, values, x, y)
    if np.isnan(found).all():
        raise RequestError(
            f"the line from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m does not meet the body"
        )
    ends = ((float(x0), float(y0)), (float(x1), float(y1)))
    return Profile(ends, t * length, x, y, found, name, unit)


def profile_width(
    profile: Profile,
    spacing: float,
    level: float = LEVEL,
    near: tuple[tuple[float, float], float] | None = None,
) -> Width:
    """Interpolated width of a profile at `level` of its peak.

    With `near`, a place and a distance [m], the peak is the largest value within this distance of
    the place; a line that crosses several bands may be higher elsewhere.
    """
    if not 0.0 < level < 1.0:
        raise RequestError(f"the level must lie between 0 and 1, not {level:g}")
    values = profile.values
    if near is not None:
        (x, y), reach = near
        close = np.hypot(profile.x - x, profile.y - y) <= reach
        values = np.where(close, values, np.nan)
    if not np.isfinite(values).any() or not np.nanmax(values) > NO_STRAIN:
        raise NoBandError("there is no plastic strain along this line")
    top = int(np.nanargmax(values))
    left, right, closed = extent_around(profile.distance, profile.values, level, top)
    return Width(
        width=right - left,
        left=left,
        right=right,
        peak=float(profile.values[top]),
        peak_distance=float(profile.distance[top]),
        peak_position=(float(profile.x[top]), float(profile.y[top])),
        level=level,
        uncertainty=spacing,
        closed=closed,
    )


def extent_around(s: FloatArray, a: FloatArray, level: float, k: int) -> tuple[float, float, bool]:
    """Edges of the part round place k in which a is at least `level` of a[k], and if it ends."""
    target = level * a[k]
    below = np.flatnonzero(~(a >= target))  # NaN counts as outside
    before, after = below[below < k], below[below > k]
    i = int(before[-1]) if len(before) else -1
    j = int(after[0]) if len(after) else len(a)
    left, left_closed = _edge(s, a, i, i + 1, target)
    right, right_closed = _edge(s, a, j, j - 1, target)
    return left, right, left_closed and right_closed


def _edge(
    s: FloatArray, a: FloatArray, outer: int, inner: int, target: float
) -> tuple[float, bool]:
    if not 0 <= outer < len(a) or np.isnan(a[outer]):
        return float(s[inner]), False
    part = (target - a[outer]) / (a[inner] - a[outer])
    return float(s[outer] + part * (s[inner] - s[outer])), True


def line_across(
    band: Band,
    points: PointSet,
    axis: str = "y",
    normal: bool = False,
    extents: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
) -> Line:
    """The line across a band through its probe, from edge to edge of the body.

    It runs at 45 degrees to the loading axis, so that widths of different runs are taken in the
    same direction; with `normal` it stands at right angles to the band.
    """
    sign = -1.0 if band.direction == "rising" else 1.0
    angle = np.radians(90.0 - band.angle) if normal else np.radians(45.0)
    across, along = sign * np.sin(angle), np.cos(angle)
    step = np.array([along, across] if axis == "x" else [across, along])
    start = np.array(band.probe)
    reach = float(np.hypot(*np.ptp(points.points, axis=0))) + points.spacing
    fine = points.spacing / 20.0
    s = np.arange(0.0, reach, fine)
    ends = []
    for way in (-1.0, 1.0):
        x, y = start[0] + way * s * step[0], start[1] + way * s * step[1]
        out = np.isnan(interpolate(points, np.zeros(len(points.points)), x, y))
        if extents is not None:
            low, high = np.asarray(extents, dtype=float) + 1e-9 * points.spacing * np.array(
                [[-1.0], [1.0]]
            )
            out |= (x < low[0]) | (x > high[0]) | (y < low[1]) | (y > high[1])
        last = (int(out.argmax()) if out.any() else len(s)) - 1
        ends.append((float(x[max(last, 0)]), float(y[max(last, 0)])))
    return ends[0], ends[1]


def crossing_angle(one: Line, two: Line) -> float:
    """Smaller angle between two lines [degrees]."""
    a = np.array(one[1]) - np.array(one[0])
    b = np.array(two[1]) - np.array(two[0])
    cosine = abs(float(a @ b)) / float(np.hypot(*a) * np.hypot(*b))
    return float(np.degrees(np.arccos(min(cosine, 1.0))))


@dataclass(frozen=True, repr=False)
class BandMeasure(Short):
    """All that is measured of the bands of one frame."""

    label: str
    frame: int | None
    time: float
    strain: float
    profile: Profile
    interpolated: Width
    bands: BandSystem
    widths: tuple[FittedWidth, ...]  # of the prevailing band, and of the other where there is one
    spacing: float
    horizon: float
    largest: float  # largest alpha of the body

    @property
    def width(self) -> float:
        """The width of the prevailing band, at right angles to it [m]."""
        return self.widths[0].width

    @property
    def resolved(self) -> bool | None:
        """Whether the width is at least the horizon, which bounds it; None where not known."""
        if not (math.isfinite(self.width) and math.isfinite(self.horizon)):
            return None
        return self.width >= self.horizon

    @property
    def interpolated_normal(self) -> float:
        """The interpolated width, turned from the line to right angles to the band [m]."""
        angle = crossing_angle(self.profile.line, self.bands.prevailing.line)
        return self.interpolated.width * float(np.sin(np.radians(angle)))

    def as_dict(self) -> dict[str, Any]:
        """The numbers, with the names of ``perigeo-post band --json``."""
        strong = self.bands.prevailing
        return {
            "run": self.label,
            "frame": self.frame,
            "time": self.time,
            "strain": self.strain,
            "width": self.width,
            "width_spread": self.widths[0].spread,
            "width_places": self.widths[0].places,
            "resolved": self.resolved,
            "width_interpolated": self.interpolated.width,
            "width_interpolated_uncertainty": self.interpolated.uncertainty,
            "width_interpolated_closed": self.interpolated.closed,
            "width_interpolated_normal": self.interpolated_normal,
            "width_interpolated_median": strong.width_interpolated,
            "level": self.interpolated.level,
            "peak": self.interpolated.peak,
            "position": list(self.interpolated.peak_position),
            "position_on_line": self.interpolated.peak_distance,
            "line": [list(end) for end in self.profile.line],
            "angle": strong.angle,
            "angle_uncertainty": strong.angle_uncertainty,
            "direction": strong.direction,
            "band_line": [list(end) for end in strong.line],
            "ratio": self.bands.ratio,
            "crossing": None if self.bands.crossing is None else list(self.bands.crossing),
            "largest_plastic_strain": self.largest,
            "spacing": self.spacing,
            "horizon": self.horizon,
            "loading_axis": self.bands.axis,
            "bands": self.table(),
        }

    def table(self) -> list[dict[str, Any]]:
        """One row for each band, the prevailing one first."""
        rows = []
        bands = [b for b in (self.bands.prevailing, self.bands.other) if b is not None]
        for band, fitted in zip(bands, self.widths):
            rows.append(
                {
                    "direction": band.direction,
                    "prevailing": band is self.bands.prevailing,
                    "angle": band.angle,
                    "x0": band.line[0][0],
                    "y0": band.line[0][1],
                    "x1": band.line[1][0],
                    "y1": band.line[1][1],
                    "length": band.length,
                    "strength": band.strength,
                    "ridge_max": band.ridge_max,
                    "ridge_x": band.ridge_position[0],
                    "ridge_y": band.ridge_position[1],
                    "width": fitted.width,
                    "width_spread": fitted.spread,
                    "width_interpolated": band.width_interpolated,
                }
            )
        return rows
