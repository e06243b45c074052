"""Values between points: bilinear on a lattice, linear on triangles for a point cloud."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from ..read.points import BoolArray, FloatArray, Lattice, PointSet
from ..surroundings import import_matplotlib


def interpolate(
    points: PointSet, values: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike
) -> FloatArray:
    """Values at the places x, y (any shape); NaN outside the points.

    On a lattice: bilinear, up to half a spacing beyond the outermost points (the half cells
    of the layout 'cells'), where the value of the edge goes on. On a cloud: linear on the
    Delaunay triangles whose sides are shorter than three spacings.
    """
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    values = np.asarray(values, dtype=float)
    if points.lattice is not None:
        lattice = points.lattice
        return _bilinear(lattice, lattice.present, lattice.grid(values, 0.0), x, y)
    return _on_triangles(points, values, x, y)


@lru_cache(maxsize=4)  # a band is searched with many lines over the same points
def _triangles(points: PointSet) -> Any:
    # Only a cloud needs matplotlib here: what measures a lattice works without it.
    import_matplotlib()
    from matplotlib.tri import Triangulation

    triangles = Triangulation(points.points[:, 0], points.points[:, 1])
    corner = points.points[triangles.triangles]
    sides = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
    triangles.set_mask(sides.max(axis=1) > 3.0 * points.spacing)
    return triangles


def _on_triangles(points: PointSet, values: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    from matplotlib.tri import LinearTriInterpolator

    found = LinearTriInterpolator(_triangles(points), values)(x, y)
    return np.asarray(np.ma.filled(found.astype(float), np.nan), dtype=float)


def _bilinear(
    lattice: Lattice, present: BoolArray, grid: FloatArray, x: FloatArray, y: FloatArray
) -> FloatArray:
    nx, ny = lattice.shape
    fx = (x - lattice.origin[0]) / lattice.spacing
    fy = (y - lattice.origin[1]) / lattice.spacing
    column = np.floor(fx).astype(np.int64)
    row = np.floor(fy).astype(np.int64)
    total = np.zeros(x.shape)
    weights = np.zeros(x.shape)
    inside = np.zeros(x.shape, dtype=bool)
    for dj in (0, 1):
        for di in (0, 1):
            i, j = column + di, row + dj
            there = (i >= 0) & (i < nx) & (j >= 0) & (j < ny)
            ci, cj = np.clip(i, 0, nx - 1), np.clip(j, 0, ny - 1)
            there &= present[cj, ci]
            away_x, away_y = np.abs(fx - i), np.abs(fy - j)
            weight = np.where(there, (1.0 - away_x) * (1.0 - away_y), 0.0)
            total += weight * grid[cj, ci]
            weights += weight
            inside |= there & (away_x <= 0.5 + 1e-9) & (away_y <= 0.5 + 1e-9)
    good = inside & (weights > 0.0)
    return np.where(good, total / np.where(good, weights, 1.0), np.nan)
