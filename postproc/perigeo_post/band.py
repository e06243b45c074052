"""Shear bands: where they lie, how steep, how wide, and which of the two prevails.

Definitions (the README of this package has them in words):

* A *profile* is the equivalent plastic strain alpha along a straight line.
* The *width* is the extent of the profile around its peak within which alpha is at least `level`
  (10 %) of the peak; its uncertainty is one point spacing, half a spacing at each edge.
* Two *bands* are looked for, one in each diagonal direction: "rising" (the coordinate across the
  specimen grows with the one along the loading axis) and "falling". The ridge of a band is where
  profiles across it have their peak; a straight line fitted to it gives the angle and place.
* The *strength* of a band is the median of those peaks along the ridge, without a tenth of the
  length at each end and without the crossing of the two bands, where the strains of both add up.
* The *prevailing* band is the stronger one; `ratio` = weaker over stronger strength.
* The profile across a band is taken through its *probe*: the place on the ridge farthest from both
  ends and from the crossing, among those where the peak is at least 0.8 of the largest; of two
  such legs the one farther along the loading axis, unless the other is a tenth longer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import NoBandError, RequestError
from .sampling import BoolArray, FloatArray, PointSet

Line = tuple[tuple[float, float], tuple[float, float]]

LEVEL = 0.10  # of the peak, where the width is taken
END_ZONE = 0.10  # part of the length of a band left out at each end
CROSSING_ZONE = 1.5  # horizons on either side of the crossing that are left out
NO_STRAIN = 1.0e-12  # plastic strain below this is none
PROBE_LEVEL = 0.8  # of the largest peak on the ridge, which the place of the profile must reach
OTHER_LEG = 1.1  # how much farther from the rest a place on the first leg must be to be taken
LEAST_CONTRAST = 1.5  # mean along the band over mean of the body, below which there is no band
ANGLES = np.arange(20.0, 70.1, 2.0)  # searched, degrees from the loading axis


@dataclass(frozen=True)
class Profile:
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
    """Extent of a profile round its peak."""

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
class Band:
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
    width_median: float  # median width at the level over the same places, normal to the band [m]
    width_spread: float  # half the distance between the quartiles of those widths [m]
    ridge_distance: FloatArray = field(repr=False)  # (k) along the line from its first end [m]
    ridge_x: FloatArray = field(repr=False)
    ridge_y: FloatArray = field(repr=False)
    ridge_values: FloatArray = field(repr=False)  # (k) peak across the band
    used: BoolArray = field(repr=False)  # (k) False near ends and crossing


@dataclass(frozen=True)
class BandSystem:
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
    found = points.interpolate(values, x, y)
    if np.isnan(found).all():
        raise RequestError(
            f"the line from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m does not meet the body"
        )
    ends = ((float(x0), float(y0)), (float(x1), float(y1)))
    return Profile(ends, t * length, x, y, found, name, unit)


def profile_width(profile: Profile, spacing: float, level: float = LEVEL) -> Width:
    """Width of a profile at `level` of its peak, the edges interpolated linearly."""
    if not 0.0 < level < 1.0:
        raise RequestError(f"the level must lie between 0 and 1, not {level:g}")
    if not np.nanmax(profile.values) > NO_STRAIN:
        raise NoBandError("there is no plastic strain along this line")
    left, right, k, closed = _extent(profile.distance, profile.values, level)
    return Width(
        width=right - left,
        left=left,
        right=right,
        peak=float(profile.values[k]),
        peak_distance=float(profile.distance[k]),
        peak_position=(float(profile.x[k]), float(profile.y[k])),
        level=level,
        uncertainty=spacing,
        closed=closed,
    )


def _extent(s: FloatArray, a: FloatArray, level: float) -> tuple[float, float, int, bool]:
    k = int(np.nanargmax(a))
    target = level * a[k]
    below = np.flatnonzero(~(a >= target))  # NaN counts as outside
    before, after = below[below < k], below[below > k]
    i = int(before[-1]) if len(before) else -1
    j = int(after[0]) if len(after) else len(a)
    left, left_closed = _edge(s, a, i, i + 1, target)
    right, right_closed = _edge(s, a, j, j - 1, target)
    return left, right, k, left_closed and right_closed


def _edge(
    s: FloatArray, a: FloatArray, outer: int, inner: int, target: float
) -> tuple[float, bool]:
    if not 0 <= outer < len(a) or np.isnan(a[outer]):
        return float(s[inner]), False
    part = (target - a[outer]) / (a[inner] - a[outer])
    return float(s[outer] + part * (s[inner] - s[outer])), True


@dataclass(frozen=True)
class _Field:
    """alpha in the frame (t, a): a along the loading axis, t across it."""

    points: PointSet
    alpha: FloatArray
    t: FloatArray
    a: FloatArray
    swap: bool
    scale: float  # the horizon, or what stands for it [m]
    level: float
    lower: FloatArray  # extents (t, a)
    upper: FloatArray

    def at(self, t: FloatArray, a: FloatArray) -> FloatArray:
        x, y = (a, t) if self.swap else (t, a)
        found = self.points.interpolate(self.alpha, x, y)
        slack = 1e-9 * self.scale
        outside = (t < self.lower[0] - slack) | (t > self.upper[0] + slack)
        outside |= (a < self.lower[1] - slack) | (a > self.upper[1] + slack)
        return np.where(outside, np.nan, found)

    def xy(self, place: npt.ArrayLike) -> tuple[float, float]:
        t, a = np.asarray(place, dtype=float)
        return (float(a), float(t)) if self.swap else (float(t), float(a))


@dataclass(frozen=True)
class _Axis:
    """A straight line in (t, a): a point on it and its slope against the loading axis."""

    sign: int
    angle: float  # radians
    centre: FloatArray

    @property
    def along(self) -> FloatArray:
        return np.array([self.sign * np.sin(self.angle), np.cos(self.angle)])

    @property
    def normal(self) -> FloatArray:
        return np.array([np.cos(self.angle), -self.sign * np.sin(self.angle)])

    def distance(self, t: FloatArray, a: FloatArray) -> FloatArray:
        n = self.normal
        return np.asarray((t - self.centre[0]) * n[0] + (a - self.centre[1]) * n[1])


@dataclass(frozen=True)
class _Ridge:
    """Peaks across a band at stations along it."""

    station: FloatArray  # (k) distance along the axis from its centre
    offset: FloatArray  # (k) of the ridge from the axis, along the normal
    peak: FloatArray  # (k)
    width: FloatArray  # (k) NaN where the profile is not closed
    used: BoolArray  # (k)


def find_bands(
    points: PointSet,
    alpha: npt.ArrayLike,
    axis: str = "y",
    horizon: float = float("nan"),
    level: float = LEVEL,
    extents: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
) -> BandSystem:
    """Find the strongest band in each of the two diagonal directions.

    A coarse search over angles of 20 to 70 degrees takes the line with the largest integral of
    alpha; then the ridge near that line is followed and a straight line fitted to it, weighted
    with alpha. The band of the other direction is searched without the strip of the first.
    """
    if axis not in ("x", "y"):
        raise RequestError(f"the loading axis must be x or y, not {axis!r}")
    work = _work_field(points, alpha, axis, horizon, level, extents)
    everywhere = np.ones(len(work.alpha), dtype=bool)
    first, _ = _coarse(work, (1, -1), everywhere)
    first, ridge = _refine(work, first, None)
    strip = _strip(work, ridge)
    aside = np.abs(first.distance(work.t, work.a)) > strip
    second, second_score = _coarse(work, (-first.sign,), aside)
    other: Band | None = None
    crossing: tuple[float, float] | None = None
    place: FloatArray | None = None
    if second_score > 0.0:
        second, second_ridge = _refine(work, second, (first, strip))
        first, ridge = _refine(work, first, (second, _strip(work, second_ridge)))
        place = _crossing(work, first, second)
        other = _band(work, second, second_ridge, place)
        crossing = None if place is None else work.xy(place)
    prevailing = _band(work, first, ridge, place)
    _require_contrast(work, prevailing)
    if other is None or not other.strength > 0.0:
        return BandSystem(prevailing, None, 0.0, None, axis)
    if other.strength > prevailing.strength:
        prevailing, other = other, prevailing
    return BandSystem(prevailing, other, other.strength / prevailing.strength, crossing, axis)


def _work_field(
    points: PointSet,
    alpha: npt.ArrayLike,
    axis: str,
    horizon: float,
    level: float,
    extents: tuple[npt.ArrayLike, npt.ArrayLike] | None,
) -> _Field:
    alpha = np.asarray(alpha, dtype=float)
    if not np.isfinite(alpha).all():
        raise NoBandError("the plastic strain of this frame is not finite everywhere")
    if len(alpha) == 0 or not alpha.max() > NO_STRAIN:
        raise NoBandError("there is no plastic strain in this frame, so there is no band")
    swap = axis == "x"
    order = [1, 0] if swap else [0, 1]
    place = points.points[:, order]
    low, high = extents if extents is not None else (place.min(axis=0), place.max(axis=0))
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    if extents is not None:
        low, high = low[order], high[order]
    scale = max(horizon, 2.0 * points.spacing) if np.isfinite(horizon) else 4.0 * points.spacing
    return _Field(points, alpha, place[:, 0], place[:, 1], swap, scale, level, low, high)


def _coarse(work: _Field, signs: tuple[int, ...], keep: BoolArray) -> tuple[_Axis, float]:
    """The straight line with the largest integral of alpha, counted per strip of points."""
    best: tuple[float, _Axis] | None = None
    middle = 0.5 * (work.lower + work.upper)
    strip = max(2.0 * work.points.spacing, 0.5 * work.scale)
    weight = np.where(keep, work.alpha * work.points.volumes, 0.0)
    for sign in signs:
        for degrees in ANGLES:
            line = _Axis(sign, float(np.radians(degrees)), middle)
            offset = line.distance(work.t, work.a) / strip
            low = float(offset.min())
            place = offset - low
            cell = np.floor(place).astype(np.int64)
            part = place - cell
            count = int(cell.max()) + 2
            sums = np.bincount(cell, weight * (1.0 - part), count)
            sums += np.bincount(cell + 1, weight * part, count)
            k = int(sums.argmax())
            if best is None or sums[k] > best[0]:
                centre = middle + (low + k) * strip * line.normal
                best = (float(sums[k]), _Axis(sign, line.angle, centre))
    assert best is not None
    return best[1], best[0]


def _refine(work: _Field, line: _Axis, crossed: tuple[_Axis, float] | None) -> tuple[_Axis, _Ridge]:
    """Fit the line to the ridge near it, four times over."""
    for _ in range(4):
        ridge = _follow(work, line, crossed)
        line = _fitted(line, ridge)
    return line, _follow(work, line, crossed)


def _follow(work: _Field, line: _Axis, crossed: tuple[_Axis, float] | None) -> _Ridge:
    step = work.points.spacing
    reach = float(np.hypot(*(work.upper - work.lower)))
    station = np.arange(-reach, reach + step, step)
    t = line.centre[0] + station * line.along[0]
    a = line.centre[1] + station * line.along[1]
    inside = np.isfinite(work.at(t, a))
    if not inside.any():
        raise NoBandError("no band could be followed through the body")
    station, t, a = station[inside], t[inside], a[inside]

    near = max(work.scale, 3.0 * step)
    fine = max(step / 4.0, near / 50.0)
    far = np.arange(-4.0 * near, 4.0 * near + fine / 2, fine)
    around = work.at(
        t[:, None] + far[None, :] * line.normal[0], a[:, None] + far[None, :] * line.normal[1]
    )
    close = np.abs(far) <= near
    core = np.nan_to_num(around[:, close], nan=0.0)
    peak = core.max(axis=1)
    lifted = np.maximum(core - 0.5 * peak[:, None], 0.0)
    total = lifted.sum(axis=1)
    offset = (lifted * far[close]).sum(axis=1) / np.where(total > 0.0, total, 1.0)
    width = np.array(
        [_closed_width(far, around[k], close, work.level) for k in range(len(station))]
    )

    low, high = station[0], station[-1]
    used = (station >= low + END_ZONE * (high - low)) & (station <= high - END_ZONE * (high - low))
    if crossed is not None:
        away = np.abs(crossed[0].distance(t, a)) > crossed[1]
        if (used & away).sum() >= 4:
            used &= away
    return _Ridge(station, offset, peak, width, used)


def _closed_width(s: FloatArray, a: FloatArray, close: BoolArray, level: float) -> float:
    core = np.where(close, a, np.nan)
    if np.isnan(core).all() or not np.nanmax(core) > NO_STRAIN:
        return float("nan")
    # the peak is the one near the band, the edges may lie farther out
    k = int(np.nanargmax(core))
    clipped = np.minimum(a, a[k])
    clipped[k] = a[k] * (1.0 + 1e-12)
    left, right, _, closed = _extent(s, clipped, level)
    return right - left if closed else float("nan")


def _fitted(line: _Axis, ridge: _Ridge) -> _Axis:
    weight = np.where(ridge.used, ridge.peak, 0.0)
    if (weight > 0.0).sum() < 3:
        return line
    mean = np.average(ridge.station, weights=weight)
    away = ridge.station - mean
    slope = np.sum(weight * away * ridge.offset) / np.sum(weight * away**2)
    shift = np.average(ridge.offset, weights=weight)
    centre = line.centre + mean * line.along + shift * line.normal
    along = line.along + slope * line.normal
    angle = float(np.arctan2(line.sign * along[0], along[1]))
    if not np.radians(10.0) < angle < np.radians(80.0):
        return line
    return _Axis(line.sign, angle, centre)


def _strip(work: _Field, ridge: _Ridge) -> float:
    """Half the width of the strip along a band that is kept out of the other one."""
    widths = ridge.width[ridge.used & np.isfinite(ridge.width)]
    band = float(np.median(widths)) if len(widths) else 0.0
    return float(min(max(CROSSING_ZONE * work.scale, band), 4.0 * work.scale))


def _crossing(work: _Field, one: _Axis, two: _Axis) -> FloatArray | None:
    matrix = np.array([one.normal, two.normal])
    right = np.array([one.normal @ one.centre, two.normal @ two.centre])
    place = np.linalg.solve(matrix, right)
    inside = np.isfinite(work.at(place[:1], place[1:]))[0]
    return place if inside else None


def _probe(line: _Axis, ridge: _Ridge, used: BoolArray, crossing: FloatArray | None) -> int:
    """Station of the ridge at which the profile across the band is taken."""
    station = ridge.station
    peaks = np.where(used, ridge.peak, 0.0)
    good = used & (peaks >= PROBE_LEVEL * peaks.max())
    if not good.any():
        return len(station) // 2
    away = np.minimum(station - station[0], station[-1] - station)
    if crossing is not None:
        middle = float((crossing - line.centre) @ line.along)
        away = np.minimum(away, np.abs(station - middle))
        away = np.where(station > middle, OTHER_LEG * away, away)
    return int(np.where(good, away, -1.0).argmax())


def _band(work: _Field, line: _Axis, ridge: _Ridge, crossing: FloatArray | None) -> Band:
    ends = [
        line.centre + (s + _to_edge(work, line, s, way)) * line.along
        for s, way in ((ridge.station[0], -1.0), (ridge.station[-1], 1.0))
    ]
    length = float(ridge.station[-1] - ridge.station[0])
    used = ridge.used & (ridge.peak > NO_STRAIN)
    peaks = ridge.peak[used]
    widths = ridge.width[used & np.isfinite(ridge.width)]
    place = (
        line.centre[:, None]
        + ridge.station * line.along[:, None]
        + ridge.offset * line.normal[:, None]
    )
    x, y = (place[1], place[0]) if work.swap else (place[0], place[1])
    top = int(np.flatnonzero(used)[peaks.argmax()]) if len(peaks) else 0
    probe = _probe(line, ridge, used, crossing)
    quartiles = np.percentile(widths, [25, 75]) if len(widths) else np.array([np.nan, np.nan])
    fitted = np.ptp(ridge.station[used]) if len(peaks) > 1 else length
    return Band(
        direction="rising" if line.sign > 0 else "falling",
        angle=float(np.degrees(line.angle)),
        angle_uncertainty=float(np.degrees(np.arctan2(work.points.spacing, max(fitted, 1e-300)))),
        line=(work.xy(ends[0]), work.xy(ends[1])),
        length=length,
        middle=work.xy(0.5 * (ends[0] + ends[1])),
        strength=float(np.median(peaks)) if len(peaks) else 0.0,
        ridge_max=float(peaks.max()) if len(peaks) else 0.0,
        ridge_position=(float(x[top]), float(y[top])),
        probe=(float(x[probe]), float(y[probe])),
        width_median=float(np.median(widths)) if len(widths) else float("nan"),
        width_spread=float(0.5 * (quartiles[1] - quartiles[0])),
        ridge_distance=ridge.station - ridge.station[0],
        ridge_x=x,
        ridge_y=y,
        ridge_values=ridge.peak,
        used=ridge.used,
    )


def _to_edge(work: _Field, line: _Axis, station: float, way: float) -> float:
    """How far the line goes on inside the body beyond its last station."""
    steps = way * np.linspace(0.0, work.points.spacing, 21)
    t = line.centre[0] + (station + steps) * line.along[0]
    a = line.centre[1] + (station + steps) * line.along[1]
    return float(steps[np.flatnonzero(np.isfinite(work.at(t, a)))[-1]])


def _require_contrast(work: _Field, band: Band) -> None:
    mean = float(np.average(work.alpha, weights=work.points.volumes))
    if band.strength < LEAST_CONTRAST * mean:
        raise NoBandError(
            "the plastic strain is spread over the body, no band stands out: "
            f"{band.strength:.3g} along the strongest line, {mean:.3g} in the mean"
        )


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
        out = np.isnan(points.interpolate(np.zeros(len(points.points)), x, y))
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


@dataclass(frozen=True)
class BandMeasure:
    """All that is measured of the bands of one frame."""

    label: str
    frame: int | None
    time: float
    strain: float
    profile: Profile
    width: Width
    bands: BandSystem
    spacing: float
    horizon: float
    largest: float  # largest alpha of the body

    @property
    def width_normal(self) -> float:
        """The width at right angles to the prevailing band [m]."""
        angle = crossing_angle(self.profile.line, self.bands.prevailing.line)
        return self.width.width * float(np.sin(np.radians(angle)))

    def as_dict(self) -> dict[str, Any]:
        """The numbers, with the names of ``perigeo-post band --json``."""
        strong = self.bands.prevailing
        return {
            "run": self.label,
            "frame": self.frame,
            "time": self.time,
            "strain": self.strain,
            "width": self.width.width,
            "width_uncertainty": self.width.uncertainty,
            "width_closed": self.width.closed,
            "width_normal": self.width_normal,
            "width_median": strong.width_median,
            "width_spread": strong.width_spread,
            "level": self.width.level,
            "peak": self.width.peak,
            "position": list(self.width.peak_position),
            "position_on_line": self.width.peak_distance,
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
        for band in (self.bands.prevailing, self.bands.other):
            if band is None:
                continue
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
                    "width_median": band.width_median,
                    "width_spread": band.width_spread,
                }
            )
        return rows
