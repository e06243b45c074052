"""The points of a body, and the lattice on which they may lie."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .shown import Short

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

LATTICE_TOLERANCE = 1.0e-3  # of the spacing
MAX_EMPTY = 50  # a lattice with more cells than this per point is taken for a cloud


@dataclass(frozen=True, repr=False)
class Lattice(Short):
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

    @cached_property
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
    """Points with volumes; measure.sampling interpolates between them."""

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

    def __repr__(self) -> str:
        return f"PointSet({len(self.points)} points)"

    def _mean_distance(self) -> float:
        extent = np.ptp(self.points, axis=0)
        return float(np.sqrt(max(extent[0] * extent[1], 1e-300) / len(self.points)))
