"""A figure of panels: bodies row by row with one colour scale, and a bar that shows it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..read.errors import RequestError
from ..read.fields import label_of
from ..read.labels import labels_of
from ..read.points import FloatArray
from ..read.run import Frame
from .contours import (
    Panel,
    Scale,
    columns_for,
    common_extent,
    common_scale,
    deformation_note,
    draw_panel,
    panel_of,
)
from .layout import HEADING, LEVEL, LONGEST_BAR, Layout, Place, Wishes, arranged
from .style import DOUBLE, SINGLE, new_figure, readable, style, with_unit
from .text import axis_ticks, length_unit, text_width, wrapped

BAR_SIZE = 6.5  # of the numbers at a colour bar [points]


@dataclass(frozen=True)
class Cell:
    """What one place of the figure shows."""

    title: str
    extent: FloatArray  # x0, y0, x1, y1 shown [m]
    panel: Panel | None  # None: there is no result
    draw_more: Callable[[Axes], None] | None = None


@dataclass(frozen=True)
class Rows:
    """Cells row by row, with headings on the left of the rows where there are some."""

    cells: list[list[Cell]]
    headings: list[str]
    note: str = ""  # above all

    def layout(self, wishes: Wishes, scale: Scale) -> Layout:
        """Where they stand, with a bar of the colours."""
        extents = [[cell.extent for cell in row] for row in self.cells]
        titles = [[readable(cell.title) for cell in row] for row in self.cells]
        bar = max(text_width(word, BAR_SIZE) for word in _bar_numbers(scale, LONGEST_BAR, True)[1])
        longest = max(text_width(readable(heading), wishes.size) for heading in self.headings)
        upright = HEADING if longest > 0.0 else 0.0
        layout = arranged(extents, titles, replace(wishes, bar=bar, heading=upright))
        if longest <= min(place.height for row in layout.rows for place in row):
            return layout
        level = min(longest, LEVEL) + 2.0
        return arranged(extents, titles, replace(wishes, bar=bar, heading=level))


def in_rows(cells: Sequence[Cell], columns: int, note: str | None = None) -> Rows:
    """Cells without headings, so many in a row."""
    rows = [list(cells[k : k + columns]) for k in range(0, len(cells), columns)]
    return Rows(rows, [""] * len(rows), note or "")


def panel_figure(
    rows: Rows, wishes: Wishes, scale: Scale, field: str, more: str = ""
) -> tuple[Figure, Layout]:
    """The figure of these rows; `more` goes on behind the name of the field at the bar."""
    layout = rows.layout(wishes, scale)
    figure = new_figure(layout.width, layout.height, layout=None)
    fill(figure, layout, rows, wishes, scale, field, more)
    return figure, layout


def fill(
    figure: Figure, layout: Layout, rows: Rows, wishes: Wishes, scale: Scale, field: str,
    more: str = "",
) -> list[Axes]:  # fmt: skip
    """Draw the rows into a figure of the size of a layout; returns their axes."""
    drawn: Any = None
    unit = length_unit([cell.extent for row in rows.cells for cell in row])
    axes = []
    for i, row in enumerate(rows.cells):
        below = len(rows.cells[i + 1]) if i + 1 < len(rows.cells) else 0
        heading = readable(rows.headings[i])
        for j, (cell, place) in enumerate(zip(row, layout.rows[i])):
            ax = figure.add_axes(layout.box(place))
            drawn = _draw_cell(ax, cell, scale) or drawn
            ax.set_title(place.title, fontsize=wishes.size, pad=2.5, linespacing=1.1)
            number_axes(ax, cell.extent, place, unit, wishes.size - 1.0)
            if j == 0:
                upright = f"{heading}\n" if heading and layout.heading <= HEADING else ""
                ax.set_ylabel(f"{upright}y [{unit[1]}]", fontsize=wishes.size, labelpad=1.5)
                if heading and not upright:
                    figure.text(
                        1.0 / layout.width, 1.0 - (place.y - 0.5 * place.height) / layout.height,
                        "\n".join(wrapped(heading, LEVEL, wishes.size)), fontsize=wishes.size,
                        va="center",
                    )  # fmt: skip
            if j >= below:
                ax.set_xlabel(f"x [{unit[1]}]", fontsize=wishes.size, labelpad=1.5)
            axes.append(ax)
    if rows.note:
        figure.suptitle(rows.note, y=1.0 - 1.5 / layout.height, va="top", fontsize=wishes.size)
    if drawn is not None:
        _add_bar(figure, layout, drawn, with_unit(label_of(field), scale.unit) + more, scale)
    return axes


def _draw_cell(ax: Axes, cell: Cell, scale: Scale) -> Any:
    drawn = None
    if cell.panel is not None:
        drawn = draw_panel(ax, cell.panel, scale)
        if cell.draw_more is not None:
            cell.draw_more(ax)
    else:
        ax.text(0.5, 0.5, "no result", transform=ax.transAxes, ha="center", va="center",
                fontsize=7, rotation=90, color="0.4")  # fmt: skip
    return drawn


def number_axes(
    ax: Axes, extent: FloatArray, place: Place, unit: tuple[float, str], size: float
) -> None:
    """Limits of the axes of a body, and as many numbers as there is room for."""
    x0, y0, x1, y1 = map(float, extent)
    ax.set(xlim=(x0, x1), ylim=(y0, y1))
    ax.set_aspect("auto")  # the axes have the shape of the extent already
    places, words = axis_ticks(x0, x1, place.width, unit, size, upright=False)
    ax.set_xticks(places, words)
    places, words = axis_ticks(y0, y1, place.height, unit, size)
    ax.set_yticks(places, words)
    ax.tick_params(labelsize=size, pad=1.5, labelleft=place.numbered)


def _add_bar(figure: Figure, layout: Layout, drawn: Any, name: str, scale: Scale) -> None:
    place = layout.bar
    bar_axes = figure.add_axes(layout.box(place))
    way = "vertical" if layout.upright else "horizontal"
    bar: Any = figure.colorbar(drawn, cax=bar_axes, extend=scale.extend, orientation=way)
    long = place.height if layout.upright else place.width
    places, words = _bar_numbers(scale, long, layout.upright)
    bar.set_ticks(places, labels=words)
    bar.ax.minorticks_off()
    lines = wrapped(name, max(long, 40.0) if layout.upright else layout.width - 4.0, 7.5)
    bar.set_label("\n".join(lines), fontsize=7.5)
    bar.ax.tick_params(labelsize=BAR_SIZE)
    bar.outline.set_linewidth(0.5)


def _bar_numbers(scale: Scale, length: float, upright: bool) -> tuple[list[float], list[str]]:
    """Places and numbers of a colour bar of some length [mm]."""
    return axis_ticks(scale.low, scale.high, 0.6 * length, (1.0, ""), BAR_SIZE, upright, 8)


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
    names = labels_of(frames) if titles is None else titles
    panels = [panel_of(f, field, deformed, fictitious) for f in frames]
    unit = frames[0].scalar(field).unit
    scale = common_scale([p.values for p in panels], unit, low, high, colours)
    extent = common_extent(panels)
    width = _column_width(column, len(panels))
    aspect = float((extent[3] - extent[1]) / (extent[2] - extent[0]))
    columns = columns_for(len(panels), aspect, width)
    cells = [Cell(name, extent, panel) for name, panel in zip(names, panels)]
    with style():
        rows = in_rows(cells, columns, deformation_note(deformed, frames))
        return panel_figure(rows, wishes_for(rows, width), scale, field)[0]


def wishes_for(rows: Rows, limit: float, tallest: float = 110.0) -> Wishes:
    """What a figure of these rows should be."""
    needed = text_width(rows.note, 8.0) + 4.0 if rows.note else 0.0
    return Wishes(limit, tallest=tallest, note=bool(rows.note), size=8.0,
                  narrowest=min(needed, limit))  # fmt: skip


def _column_width(column: str | None, count: int) -> float:
    if column is None:
        return SINGLE if count <= 2 else DOUBLE
    widths = {"single": SINGLE, "double": DOUBLE}
    if column not in widths:
        raise RequestError(f"the column must be single or double, not {column!r}")
    return widths[column]
