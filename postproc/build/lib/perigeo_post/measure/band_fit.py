"""The width of a band from a fit: what the values of points say, free of the spacing.

The plastic strain of a point stands for its cell, a square of one spacing: their sum over a strip
of the body is the slip of the band, however few points lie across it. So each value is taken as
the average of a smooth profile over its cell, seen at the angle of the band. At a number of places
along the band the profile is fitted by least squares to the points around,

    alpha(q, s) = A (1 + b s) f((q - c - d s) / h),  f(t) = (1 + g t^2)^(-1/k),  g = L^(-k) - 1,

q across and s along the band, h half the width at the part L of the peak. The exponent k is fitted
too: -1 is a parabola, 0 a Gaussian, above 0 the tails are long. So the width does not depend on a
shape chosen beforehand. The width of the band is the median over the places.

Reading a profile between points by interpolation instead makes it wider, by more the fewer points
there are (profile_width in `band`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..read.points import FloatArray, PointSet
from .band import LEVEL, NO_STRAIN, Band, FittedWidth

PLACE = 4.0  # least length of a place along the band, in spacings; a horizon where that is more
REACH = 1.2  # half widths on either side of the ridge that are fitted, and a spacing beyond
LEAST_POINTS = 10  # of a place, for six numbers
SHAPES = (-1.2, 0.6)  # range of k
SLOPE = 0.1  # largest angle between the ridge at a place and the line of the band
TURNS = 40  # of the search for the least squares, at most
WORST = 0.5  # rms of what the fit leaves over its peak; more is no band

# Abscissas and weights of the average over a cell of side 1, four by four.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_CELL = 0.5 * np.array([(a, b) for a in _NODES for b in _NODES])
_SHARE = 0.25 * np.array([a * b for a in _WEIGHTS for b in _WEIGHTS])


@dataclass(frozen=True)
class _Place:
    """Points around one place on the ridge."""

    across: FloatArray  # (k) distance from the ridge [m]
    along: FloatArray  # (k) from the place [m]
    values: FloatArray  # (k)
    cell: FloatArray  # (16) offsets of the abscissas of a cell, across the band [m]
    level: float

    def model(self, p: FloatArray) -> FloatArray:
        """Averages over the cells for p = (A, b, c, d, h, k)."""
        distance = (self.across - p[2] - p[3] * self.along)[:, None] + self.cell
        shape = profile_shape(distance / p[4], p[5], self.level)
        return np.asarray(p[0] * (1.0 + p[1] * self.along) * (shape @ _SHARE))


def profile_shape(t: FloatArray, k: float, level: float) -> FloatArray:
    """f(t): 1 at t = 0, `level` at t = 1; k below 0 ends, above 0 has long tails."""
    if abs(k) < 1.0e-6:
        return np.asarray(np.exp(np.log(level) * t**2))
    u = np.expm1(-k * np.log(level)) * t**2
    inside = u > -1.0 + 1.0e-12
    return np.where(inside, np.exp(-np.log1p(np.where(inside, u, 0.0)) / k), 0.0)


def fitted_width(
    points: PointSet,
    alpha: npt.ArrayLike,
    band: Band,
    horizon: float = float("nan"),
    level: float = LEVEL,
) -> FittedWidth:
    """Median of the widths fitted at places along a band, away from its ends and its crossing."""
    alpha = np.asarray(alpha, dtype=float)
    start, end = np.array(band.line[0]), np.array(band.line[1])
    tangent = (end - start) / np.hypot(*(end - start))
    normal = np.array([tangent[1], -tangent[0]])
    station, across = (points.points - start) @ tangent, (points.points - start) @ normal
    ridge = np.column_stack([band.ridge_x, band.ridge_y]) - start
    where, offset = ridge @ tangent, ridge @ normal
    cell = points.spacing * (_CELL @ normal)
    size = max(horizon if np.isfinite(horizon) else 0.0, PLACE * points.spacing)
    widths: list[float] = []
    for middle, length in _places(where[band.used], size):
        ridge_here = float(np.interp(middle, where, offset))
        near = np.abs(station - middle) <= 0.5 * length
        found = _width_at(
            _Place(across[near] - ridge_here, station[near] - middle, alpha[near], cell, level),
            band.width_interpolated,
            points.spacing,
        )
        if found is not None:
            widths.append(found)
    if not widths:
        return FittedWidth(float("nan"), float("nan"), 0, level)
    low, median, high = np.percentile(widths, [25, 50, 75])
    return FittedWidth(float(median), float(0.5 * (high - low)), len(widths), level)


def _places(stations: FloatArray, size: float) -> list[tuple[float, float]]:
    """Middles and lengths of places that hold nothing but used stations, each half over the next.

    A leg of the band that is shorter than a place is one place.
    """
    found: list[tuple[float, float]] = []
    if len(stations) < 2:
        return found
    step = float(np.diff(stations).min())
    for leg in np.split(stations, np.flatnonzero(np.diff(stations) > 1.5 * step) + 1):
        first, last = leg[0] - 0.5 * step, leg[-1] + 0.5 * step
        length = min(size, float(last - first))
        count = max(int(np.ceil(2.0 * (last - first) / length - 1.0e-9)) - 1, 1)
        ends = np.linspace(0.5 * length, last - first - 0.5 * length, count)
        found += [(float(first + away), length) for away in ends]
    return found


def _width_at(around: _Place, first: float, spacing: float) -> float | None:
    """Width at one place; fitted twice, the second time to the points within reach."""
    width = first if np.isfinite(first) else 4.0 * spacing
    for _ in range(2):
        near = np.abs(around.across) <= 0.5 * REACH * width + spacing
        place = _Place(
            around.across[near], around.along[near], around.values[near], around.cell, around.level
        )
        if len(place.values) < LEAST_POINTS or not place.values.max() > NO_STRAIN:
            return None
        fitted = _least_squares(place, 0.5 * width)
        if fitted is None:
            return None
        width = 2.0 * fitted
    return width


def _least_squares(place: _Place, half: float) -> float | None:
    """Half the width by Levenberg's and Marquardt's method; None where nothing fits."""
    top = float(place.values.max())
    scale = np.array([top, 1.0 / half, half, 0.1, half, 0.3])
    low = np.array([0.1 * top, -0.3 / half, -half, -SLOPE, 0.1 * half, SHAPES[0]])
    high = np.array([5.0 * top, 0.3 / half, half, SLOPE, 3.0 * half, SHAPES[1]])
    p = np.array([top, 0.0, 0.0, 0.0, half, 0.0])
    left = place.model(p) - place.values
    enough = 1.0e-12 * float(place.values @ place.values)
    damping = 1.0e-3
    for _ in range(TURNS):
        slopes = np.column_stack([_slope(place, p, left, j, scale[j]) for j in range(len(p))])
        square, pull = slopes.T @ slopes, slopes.T @ left
        before = float(left @ left)
        for _ in range(8):
            matrix = square + damping * np.diag(np.diag(square) + 1.0e-12 * np.trace(square))
            new = np.clip(p - scale * np.linalg.solve(matrix, pull), low, high)
            rest = place.model(new) - place.values
            if rest @ rest < before:
                break
            damping *= 4.0
        else:
            break
        p, left, damping = new, rest, max(damping / 5.0, 1.0e-9)
        after = float(left @ left)
        if after < enough or before - after < 1.0e-8 * before:
            break
    good = np.sqrt(np.mean(left**2)) < WORST * p[0] and low[4] < p[4] < high[4]
    return float(p[4]) if good else None


def _slope(place: _Place, p: FloatArray, left: FloatArray, j: int, scale: float) -> FloatArray:
    moved = p.copy()
    moved[j] += 1.0e-5 * scale
    return np.asarray((place.model(moved) - place.values - left) / 1.0e-5)
