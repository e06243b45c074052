"""Looks for the two shear bands of a field: a coarse search, then the ridge and a line through it.

The definitions stand in `band`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..read.errors import NoBandError, RequestError
from ..read.points import BoolArray, FloatArray, PointSet
from .band import LEVEL, NO_STRAIN, Band, BandSystem, extent_around
from .sampling import interpolate

END_ZONE = 0.10  # part of the length of a band left out at each end
CROSSING_ZONE = 1.5  # horizons on either side of the crossing that are left out
PROBE_LEVEL = 0.8  # of the largest peak on the ridge, which the place of the profile must reach
WIDER = 1.5  # times the median width: a place on the ridge that belongs to another band too
OTHER_LEG = 1.1  # how much farther from the rest a place on the first leg must be to be taken
LEAST_CONTRAST = 1.5  # mean along the band over mean of the body, below which there is no band
ANGLES = np.arange(20.0, 70.1, 2.0)  # searched, degrees from the loading axis


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
        found = interpolate(self.points, self.alpha, x, y)
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
    scale = search_scale(points, horizon)
    return _Field(points, alpha, place[:, 0], place[:, 1], swap, scale, level, low, high)


def search_scale(points: PointSet, horizon: float) -> float:
    """The horizon, or what stands for it where it is not known or too small [m]."""
    if np.isfinite(horizon):
        return max(horizon, 2.0 * points.spacing)
    return 4.0 * points.spacing


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
    left, right, closed = extent_around(s, a, level, k)
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


def _clear(ridge: _Ridge, used: BoolArray) -> BoolArray:
    """Without the places where a third band meets this one, if any are left then.

    There the profile across does not end, or is much wider than elsewhere.
    """
    known = used & np.isfinite(ridge.width)
    if not known.any():
        return used
    return np.asarray(known & (ridge.width <= WIDER * np.median(ridge.width[known])))


def _probe(line: _Axis, ridge: _Ridge, used: BoolArray, crossing: FloatArray | None) -> int:
    """Station of the ridge at which the profile across the band is taken."""
    station = ridge.station
    used = _clear(ridge, used)
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
        width_interpolated=float(np.median(widths)) if len(widths) else float("nan"),
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
