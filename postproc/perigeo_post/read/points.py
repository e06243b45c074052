"""Values between points: bilinear on a lattice, linear on triangles for a point cloud."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

LATTICE_TOLERANCE = 1.0e-3  # of the spacing
MAX_EMPTY = 50  # a lattice with more cells than this per point is taken for a cloud


@dataclass(frozen=True)
class Lattice:
    """Square lattice on which a set of points lies; nodes may be empty."""

    origin: tuple[float, float]
    spacing: float
    shape: tuple[int, int]  # nodes along x, along y
    column: IntArray  # (n) node of each point along x
    row: IntArray  # (n) along y

    def grid(self, values: npt.ArrayLike, empty: float = np.nan) -> FloatArray:
        """Point values (n) or (n, c) as an array (ny, nx[, c]); empty nodes hold `empty`."""
        values = np.asarray(values, dtype=float)
        nx, ny = self.shape
        grid = np.full((ny, nx, *values.shape[1:]), empty)
        grid[self.row, self.column] = values
        return grid

    @property
    def present(self) -> BoolArray:
        """(ny, nx) where a node holds a point."""
        nx, ny = self.shape
        mask = np.zeros((ny, nx), dtype=bool)
        mask[self.row, self.column] = True
        return mask


def find_lattice(points: FloatArray, spacing: float) -> Lattice | None:
    """The lattice of this spacing that holds all points, one a node; None where there is none."""
    if len(points) == 0 or not (np.isfinite(spacing) and spacing > 0.0):
        return None
    origin = points.min(axis=0)
    scaled = (points - origin) / spacing
    node = np.rint(scaled).astype(np.int64)
    if np.abs(scaled - node).max() > LATTICE_TOLERANCE:
        return None
    nx, ny = (int(k) + 1 for k in node.max(axis=0))
    if nx * ny > MAX_EMPTY * len(points) or min(nx, ny) < 2:
        return None
    if len(np.unique(node[:, 1] * nx + node[:, 0])) < len(points):
        return None
    return Lattice(
        (float(origin[0]), float(origin[1])), float(spacing), (nx, ny), node[:, 0], node[:, 1]
    )


class PointSet:
    """Points with volumes, between which values can be interpolated."""

    def __init__(
        self,
        points: npt.ArrayLike,
        volumes: npt.ArrayLike | None = None,
        spacing: float = float("nan"),
    ) -> None:
        self.points: FloatArray = np.asarray(points, dtype=float).reshape(-1, 2)
        self.lattice = find_lattice(self.points, spacing)
        if volumes is None:
            size = spacing if np.isfinite(spacing) else self._mean_distance()
            volumes = np.full(len(self.points), size**2)
        self.volumes: FloatArray = np.asarray(volumes, dtype=float)
        self.spacing = (
            self.lattice.spacing
            if self.lattice is not None
            else float(np.sqrt(np.median(self.volumes)))
        )

    def _mean_distance(self) -> float:
        extent = np.ptp(self.points, axis=0)
        return float(np.sqrt(max(extent[0] * extent[1], 1e-300) / len(self.points)))

    def interpolate(self, values: npt.ArrayLike, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Values at the places x, y (any shape); NaN outside the points.

        On a lattice: bilinear, up to half a spacing beyond the outermost points (the half cells
        of the layout 'cells'), where the value of the edge goes on. On a cloud: linear on the
        Delaunay triangles whose sides are shorter than three spacings.
        """
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        values = np.asarray(values, dtype=float)
        if self.lattice is not None:
            return _bilinear(self.lattice, self._present, self.lattice.grid(values, 0.0), x, y)
        return self._on_triangles(values, x, y)

    @cached_property
    def _present(self) -> BoolArray:
        assert self.lattice is not None
        return self.lattice.present

    @cached_property
    def _triangles(self) -> Any:
        from matplotlib.tri import Triangulation

        triangles = Triangulation(self.points[:, 0], self.points[:, 1])
        corner = self.points[triangles.triangles]
        sides = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
        triangles.set_mask(sides.max(axis=1) > 3.0 * self.spacing)
        return triangles

    def _on_triangles(self, values: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        from matplotlib.tri import LinearTriInterpolator

        found = LinearTriInterpolator(self._triangles, values)(x, y)
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
