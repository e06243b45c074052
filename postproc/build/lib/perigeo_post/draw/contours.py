"""Contours of a field: cells as large as the spacing, without gaps, on one colour scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

from ..measure.smooth import WORDS, are_smoothed
from ..read.errors import RequestError
from ..read.points import FloatArray, Lattice, find_lattice
from ..read.run import Frame
from .style import DIVERGING, MAX_HEIGHT, SEQUENTIAL, prefix_for

# Points of a cloud are first drawn this much larger, which closes the gaps between them
UNDERLAY = 1.4
UNDERLAY_DEFORMED = 1.8


@dataclass(frozen=True)
class Panel:
    """What one panel of a row of contours shows."""

    points: FloatArray  # (n, 2) reference places [m]
    shift: FloatArray  # (n, 2) displacement times its scale [m]
    size: FloatArray  # (n) side of the cell of each point [m]
    values: FloatArray  # (n)
    lattice: Lattice | None
    outline: tuple[float, float, float, float] | None  # x0 y0 x1 y1 of the undeformed body

    @property
    def extent(self) -> FloatArray:
        """x0, y0, x1, y1 of all cells [m]."""
        place = self.points + self.shift
        place = place[np.isfinite(place).all(axis=1)]
        half = 0.5 * float(self.size.max())
        if len(place) == 0:
            place = self.points
        return np.concatenate([place.min(axis=0) - half, place.max(axis=0) + half])


@dataclass(frozen=True)
class Scale:
    """One colour scale for all panels."""

    low: float  # in the unit shown
    high: float
    factor: float  # unit shown over SI unit
    unit: str
    colours: str
    extend: str

    def norm(self) -> Normalize:
        return Normalize(self.low, self.high)


def panel_of(
    frame: Frame,
    field: str = "plastic_strain",
    deformed: float | None = None,
    fictitious: bool = False,
) -> Panel:
    """The data of one panel; `deformed` is the scale of the displacements, None: reference."""
    run = frame.run
    values = frame.scalar(field).values
    keep = frame.there if fictitious else run.body & frame.there
    if not keep.any():
        raise RequestError(f"{run.path} holds no points of the body")
    points = run.positions[keep]
    shift = np.zeros_like(points)
    outline = None
    if deformed is not None:
        shift = deformed * frame["displacement"][keep]
        outline = (*run.lower.tolist(), *run.upper.tolist())
    lattice = find_lattice(points, run.spacing)
    volumes = np.abs(run.volumes[keep])
    size = np.full(len(points), run.spacing) if lattice is not None else np.sqrt(volumes)
    return Panel(points, shift, size, values[keep], lattice, outline)


def common_scale(
    values: Sequence[FloatArray],
    unit: str,
    low: float | None = None,
    high: float | None = None,
    colours: str | None = None,
) -> Scale:
    """One scale for all values: from 0 where nothing is negative, symmetric where signs mix."""
    finite = [v[np.isfinite(v)] for v in values]
    ranges = [(float(v.min()), float(v.max())) for v in finite if len(v)]
    least = min((r[0] for r in ranges), default=0.0)
    most = max((r[1] for r in ranges), default=0.0)
    size = max(abs(least), abs(most))
    mixed = least < -0.05 * size and most > 0.05 * size
    if mixed:
        auto = (-size, size)
    elif least >= -0.05 * size:
        auto = (0.0, most)
    else:
        auto = (least, 0.0 if most > -0.2 * size else most)
    start = auto[0] if low is None else low
    end = auto[1] if high is None else high
    if start > end or (start == end and low is not None and high is not None):
        raise RequestError(f"the colour scale must rise, not go from {start:g} to {end:g}")
    if start == end:
        end = start + (abs(start) if start else 1.0)
    factor, shown = prefix_for(max(abs(start), abs(end)), unit) if size else (1.0, unit)
    slack = 1e-9 * (end - start)
    under, over = least < start - slack, most > end + slack
    extend = "both" if under and over else "min" if under else "max" if over else "neither"
    if mixed and (low is not None or high is not None):
        mixed = start < 0.0 < end
    return Scale(
        start * factor, end * factor, factor, shown,
        colours or (DIVERGING if mixed else SEQUENTIAL), extend,
    )  # fmt: skip


def lattice_corners(panel: Panel) -> tuple[FloatArray, FloatArray]:
    """Corners (ny+1, nx+1) of the displaced cells of a lattice, shared by neighbours.

    Each corner is the mean of where the cells round it put it, so that no gaps open.
    """
    lattice = panel.lattice
    assert lattice is not None
    nx, ny = lattice.shape
    h = lattice.spacing
    sums = np.zeros((ny + 1, nx + 1, 2))
    count = np.zeros((ny + 1, nx + 1))
    place = np.nan_to_num(panel.points + panel.shift)
    for dj in (0, 1):
        for di in (0, 1):
            at = (lattice.row + dj, lattice.column + di)
            np.add.at(sums, at, place + h * np.array([di - 0.5, dj - 0.5]))
            np.add.at(count, at, 1.0)
    x = lattice.origin[0] + h * (np.arange(nx + 1) - 0.5)
    y = lattice.origin[1] + h * (np.arange(ny + 1) - 0.5)
    plain = np.stack(np.meshgrid(x, y), axis=-1)
    filled = np.where(count[..., None] > 0, sums / np.maximum(count, 1.0)[..., None], plain)
    return filled[..., 0], filled[..., 1]


def cloud_squares(panel: Panel, factor: float = 1.0) -> FloatArray:
    """Squares (n, 4, 2) as large as the points' volumes, at the displaced places."""
    corner = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    place = np.nan_to_num(panel.points + panel.shift)
    return np.asarray(place[:, None, :] + factor * panel.size[:, None, None] * corner)


def draw_panel(ax: Axes, panel: Panel, scale: Scale) -> Any:
    """Draw the cells of a panel; returns what a colour bar needs."""
    values = panel.values * scale.factor
    options: dict[str, Any] = {"norm": scale.norm(), "cmap": scale.colours}
    drawn: Any
    if panel.lattice is not None and not panel.shift.any():
        x0, y0 = (c - 0.5 * panel.lattice.spacing for c in panel.lattice.origin)
        nx, ny = panel.lattice.shape
        x1, y1 = x0 + nx * panel.lattice.spacing, y0 + ny * panel.lattice.spacing
        grid = np.ma.masked_invalid(panel.lattice.grid(values))
        drawn = ax.imshow(
            grid, origin="lower", extent=(x0, x1, y0, y1), interpolation="nearest", **options
        )
    elif panel.lattice is not None:
        x, y = lattice_corners(panel)
        grid = np.ma.masked_invalid(panel.lattice.grid(values))
        drawn = ax.pcolormesh(x, y, grid, antialiased=False, rasterized=True, **options)
    else:
        larger = UNDERLAY_DEFORMED if panel.shift.any() else UNDERLAY
        squares = np.concatenate([cloud_squares(panel, larger), cloud_squares(panel)])
        drawn = PolyCollection(
            list(squares), array=np.ma.masked_invalid(np.tile(values, 2)),
            linewidths=0.0, antialiaseds=False, rasterized=True, **options,
        )  # fmt: skip
        ax.add_collection(drawn)
    if panel.outline is not None:
        x0, y0, x1, y1 = panel.outline
        edge = Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor="0.5", linewidth=0.5)
        ax.add_patch(edge)
    ax.set_aspect("equal")
    return drawn


def common_extent(panels: Sequence[Panel]) -> FloatArray:
    """x0, y0, x1, y1 that hold all panels with a small margin."""
    all_extents = np.array([p.extent for p in panels])
    for p in panels:
        if p.outline is not None:
            all_extents = np.vstack([all_extents, p.outline])
    low, high = all_extents[:, :2].min(axis=0), all_extents[:, 2:].max(axis=0)
    margin = 0.02 * float((high - low).max())
    return np.concatenate([low - margin, high + margin])


def columns_for(count: int, aspect: float, width: float) -> int:
    """How many panels side by side make them largest; all in one row if that is legible."""
    best = (1, 0.0)
    for columns in range(1, count + 1):
        rows = -(-count // columns)
        wide = (width - 34.0) / columns - 3.0
        high = (MAX_HEIGHT - 14.0) / rows - 10.0
        size = min(wide, high / aspect, 110.0 / aspect)
        if rows == 1 and wide >= 17.0 and aspect > 0.8:
            return columns
        if size > best[1]:
            best = (columns, size)
    return best[0]


def deformation_note(deformed: float | None, frames: Sequence[Frame] = ()) -> str | None:
    """The words that state the scale of the deformed shape, and that displacements are smoothed."""
    smooth = are_smoothed(frames)
    if deformed is None:
        return f"Displacements {WORDS}" if smooth else None
    note = f"Deformed shape, displacements × {deformed:g}"
    return f"{note}, {WORDS}" if smooth else note
