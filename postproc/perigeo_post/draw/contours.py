"""Contours of a field: cells as large as the spacing, without gaps, on one colour scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ..measure.smooth import WORDS, are_smoothed
from ..read.errors import RequestError
from ..read.fields import label_of
from ..read.points import FloatArray, Lattice, find_lattice
from ..read.run import Frame
from .style import (
    DIVERGING,
    DOUBLE,
    MAX_HEIGHT,
    SEQUENTIAL,
    SINGLE,
    new_figure,
    prefix_for,
    readable,
    style,
    with_unit,
)

# Points of a cloud are first drawn this much larger, which closes the gaps between them
UNDERLAY = 1.4
UNDERLAY_DEFORMED = 1.8


@dataclass(frozen=True)
class Panel:
    """What one panel of a row of contours shows."""

    title: str
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
    title: str | None = None,
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
    return Panel(
        frame.label if title is None else readable(title),
        points, shift, size, values[keep], lattice, outline,
    )  # fmt: skip


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


def fill_axes(panels: Sequence[Panel], axes: Sequence[Axes], scale: Scale, columns: int) -> Any:
    """Draw panels into a grid of axes with common limits; returns what a colour bar needs."""
    x0, y0, x1, y1 = common_extent(panels)
    drawn: Any = None
    for k, (ax, panel) in enumerate(zip(axes, panels)):
        drawn = draw_panel(ax, panel, scale)
        ax.set_xlim(x0, x1)
        ax.set_ylim(y0, y1)
        ax.locator_params(axis="x", nbins=3 if columns > 2 else 4 if columns > 1 else 6)
        ax.set_title(panel.title)
        if k % columns == 0:
            ax.set_ylabel("y [m]")
        else:
            ax.tick_params(labelleft=False)
        if k + columns >= len(panels):
            ax.set_xlabel("x [m]")
        else:
            ax.tick_params(labelbottom=False)
    return drawn


def grid_for(count: int, aspect: float, width: float) -> tuple[int, int, float]:
    """Columns, rows and width of a panel [mm] that make the panels largest; one row if legible."""
    best = (1, count, 0.0)
    for columns in range(1, count + 1):
        rows = -(-count // columns)
        wide = (width - 34.0) / columns - 3.0
        high = (MAX_HEIGHT - 14.0) / rows - 10.0
        size = min(wide, high / aspect, 110.0 / aspect)
        if rows == 1 and wide >= 17.0 and aspect > 0.8:
            return columns, rows, size
        if size > best[2]:
            best = (columns, rows, size)
    return best


def deformation_note(deformed: float | None, frames: Sequence[Frame] = ()) -> str | None:
    """The words that state the scale of the deformed shape, and that displacements are smoothed."""
    smooth = are_smoothed(frames)
    if deformed is None:
        return f"Displacements {WORDS}" if smooth else None
    note = f"Deformed shape, displacements × {deformed:g}"
    return f"{note}, {WORDS}" if smooth else note


def contour_figure(
    frames: Sequence[Frame],
    field: str = "plastic_strain",
    deformed: float | None = None,
    fictitious: bool = False,
    low: float | None = None,
    high: float | None = None,
    colours: str | None = None,
    titles: Sequence[str] | None = None,
    column: str | None = None,
) -> Figure:
    """A row of frames (of one or several runs) on one colour scale.

    field: any field with one number a point. deformed: scale of the displacements, None for the
    reference shape. low, high: ends of the colour scale in SI units. column: "single" (88 mm) or
    "double" (180 mm); by default single for one or two panels.
    """
    if not frames:
        raise RequestError("no frame to draw")
    names = titles if titles is not None else [None] * len(frames)
    panels = [panel_of(f, field, deformed, fictitious, t) for f, t in zip(frames, names)]
    unit = frames[0].scalar(field).unit
    scale = common_scale([p.values for p in panels], unit, low, high, colours)
    x0, y0, x1, y1 = common_extent(panels)
    aspect = float((y1 - y0) / (x1 - x0))
    width = _column_width(column, len(panels))
    columns, rows, size = grid_for(len(panels), aspect, width)
    note = deformation_note(deformed, frames)
    height = rows * (size * aspect + 10.0) + (18.0 if note else 12.0)
    used = min(width, max(columns * (size + 3.0) + 34.0, 60.0))
    with style():
        figure = new_figure(used, min(max(height, 45.0), MAX_HEIGHT), layout="compressed")
        grid = figure.subplots(rows, columns, squeeze=False)
        axes = list(grid.flat)
        for ax in axes[len(panels) :]:
            ax.set_visible(False)
        drawn = fill_axes(panels, axes, scale, columns)
        add_colour_bar(figure, drawn, axes[: len(panels)], field, scale)
        if note:
            figure.suptitle(note)
    return figure


def add_colour_bar(figure: Any, drawn: Any, axes: Sequence[Axes], field: str, scale: Scale) -> None:
    """A colour bar with the name and unit of the field beside the axes."""
    bar = figure.colorbar(drawn, ax=list(axes), extend=scale.extend, pad=0.02, aspect=25)
    bar.set_label(with_unit(label_of(field), scale.unit))
    bar.outline.set_linewidth(0.5)


def _column_width(column: str | None, count: int) -> float:
    if column is None:
        return SINGLE if count <= 2 else DOUBLE
    widths = {"single": SINGLE, "double": DOUBLE}
    if column not in widths:
        raise RequestError(f"the column must be single or double, not {column!r}")
    return widths[column]
