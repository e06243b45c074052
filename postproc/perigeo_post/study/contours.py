"""The figure of a study that draws contours: several runs or states on one colour scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..draw.contours import Panel, Scale, common_extent, common_scale, draw_panel, panel_of
from ..draw.style import COLOURS, new_figure, readable, style, with_unit
from ..measure.smooth import WORDS, smoothed_for
from ..read.errors import PostError, RequestError
from ..read.fields import label_of
from ..read.points import FloatArray
from ..read.run import Frame
from . import drawing as draw
from .drawing import COMMON, Row
from .layout import Layout, Place, arranged, shared
from .measures import band_at
from .types import Column, Drawing, State, StudyRun

CONTOUR_OPTIONS = COMMON | {
    "by", "field", "strain", "rows", "same_scale", "low", "high", "deformed", "per_row",
    "show_line", "smooth", "panel_height",
}  # fmt: skip

LONGEST_BAR = 70.0  # [mm]


@dataclass(frozen=True)
class _Cell:
    """One panel of a figure of contours."""

    run: StudyRun
    title: str
    frame: Frame | None  # None: there is no such state
    panel: Panel | None
    reason: str = ""  # why there is none


@dataclass(frozen=True)
class _Row:
    """Panels side by side, with a heading on their left."""

    heading: str
    cells: list[_Cell]


def contours(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """A field of several runs, of several states, or of both, on one colour scale.

    `strain` one number: all runs at that strain, `rows` = "series" a row for each series. Several
    numbers: a row for each run, with its label or its value of `by` beside it. Bodies are drawn to
    one scale unless `same_scale` is false.
    """
    runs = draw.selected(runs, options)
    field = draw.text(options, "field", "plastic_strain")
    rows = _rows(runs, options, field)
    cells = [cell for row in rows for cell in row.cells]
    panels = [cell.panel for cell in cells if cell.panel is not None]
    frames = [cell.frame for cell in cells if cell.frame is not None]
    if not panels:
        raise RequestError(f"there is nothing to draw: {cells[0].reason}")
    unit = frames[0].scalar(field).unit
    scale = common_scale(
        [p.values for p in panels], unit, draw.number(options, "low"), draw.number(options, "high")
    )
    with style():
        figure = _contour_figure(rows, scale, field, options)
    return Drawing(figure, [_contour_row(cell, field) for cell in cells])


def _rows(runs: Sequence[StudyRun], options: Mapping[str, Any], field: str) -> list[_Row]:
    strains = draw.numbers(options, "strain")
    by = draw.text(options, "by")
    by_series = draw.choice(options, "rows", ("runs", "series")) == "series"
    if len(strains) > 1:
        found = []
        for run in runs:
            titles = [f"ε = {100.0 * s:g} %" if run is runs[0] else "" for s in strains]
            cells = [_cell(run, s, t, options, field) for s, t in zip(strains, titles)]
            heading = draw.shown(draw.value_of(run, by)) if by else run.label
            found.append(_Row(heading if len(runs) > 1 else "", cells))
        return found
    strain = strains[0] if strains else None
    cells = [_cell(run, strain, run.label, options, field) for run in runs]
    if by_series:
        names = dict.fromkeys(run.series for run in runs)
        return [_Row("", [c for c in cells if c.run.series == name]) for name in names]
    count = int(draw.number(options, "per_row") or _per_row(len(cells)))
    if count < 1:
        raise RequestError(f"the option per_row must be at least 1, not {count}")
    return [_Row("", cells[k : k + count]) for k in range(0, len(cells), count)]


def _per_row(count: int) -> int:
    rows = -(-count // 7)
    return -(-count // rows)


def _cell(
    run: StudyRun, strain: float | None, title: str, options: Mapping[str, Any], field: str
) -> _Cell:
    wanted = run.state.strain if strain is None else strain
    deformed = draw.number(options, "deformed")
    try:
        frame = run.run.frame(wanted)
        if draw.flag(options, "smooth"):
            frame = smoothed_for(frame, field, deformed)
        panel = panel_of(frame, field, deformed, title=title)
    except PostError as error:
        return _Cell(run, title, None, None, str(error))
    return _Cell(run, title, frame, panel)


def _contour_figure(
    rows: list[_Row], scale: Scale, field: str, options: Mapping[str, Any]
) -> Figure:
    extents = _extents(rows)
    layout = arranged(
        extents,
        [[cell.title for cell in row.cells] for row in rows],
        draw.width_of(options, "double"),
        draw.flag(options, "same_scale", True),
        draw.number(options, "panel_height"),
        any(row.heading for row in rows),
    )
    figure = new_figure(layout.width, layout.height, layout=None)
    drawn: Any = None
    for i, row in enumerate(rows):
        below = len(rows[i + 1].cells) if i + 1 < len(rows) else 0
        for j, (cell, place) in enumerate(zip(row.cells, layout.rows[i])):
            ax = figure.add_axes(_box(layout, place.x, place.y, place.width, place.height))
            drawn = _draw_cell(ax, cell, extents[i][j], scale, options) or drawn
            _label_axes(ax, place, row.heading, j == 0, j >= below)
    top = min(place.y - place.height for place in layout.rows[0])
    low = max(place.y for place in layout.rows[-1])
    tall = min(low - top, LONGEST_BAR)
    bar_axes = figure.add_axes(
        _box(layout, layout.right + 3.0, 0.5 * (top + low + tall), 2.8, tall)
    )
    bar: Any = figure.colorbar(drawn, cax=bar_axes, extend=scale.extend)
    name = with_unit(label_of(field), scale.unit)
    smooth = draw.flag(options, "smooth")
    bar.set_label(f"{name}; displacements {WORDS}" if smooth else name)
    bar.outline.set_linewidth(0.5)
    return figure


def _box(
    layout: Layout, x: float, y: float, width: float, height: float
) -> tuple[float, float, float, float]:
    """Axes by their lower left corner from the upper left of the figure, and size [mm]."""
    wide, high = layout.width, layout.height
    return (x / wide, 1.0 - y / high, width / wide, height / high)


def _extents(rows: list[_Row]) -> list[list[FloatArray]]:
    """x0, y0, x1, y1 shown in each panel; one without a result has that of another."""
    cells = [cell for row in rows for cell in row.cells]
    there = [cell.panel for cell in cells if cell.panel is not None]
    all_extents = iter(shared([common_extent([cell.panel or there[0]]) for cell in cells]))
    return [[next(all_extents) for _ in row.cells] for row in rows]


def _draw_cell(ax: Axes, cell: _Cell, extent: Any, scale: Scale, options: Mapping[str, Any]) -> Any:
    drawn = None
    if cell.panel is not None:
        drawn = draw_panel(ax, cell.panel, scale)
        if draw.flag(options, "show_line"):
            _draw_line(ax, cell)
    else:
        ax.text(0.5, 0.5, "no result", transform=ax.transAxes, ha="center", va="center",
                fontsize=7, rotation=90, color="0.4")  # fmt: skip
    ax.set(xlim=(extent[0], extent[2]), ylim=(extent[1], extent[3]))
    ax.set_aspect("auto")  # the axes have the shape of the extent already
    return drawn


def _draw_line(ax: Axes, cell: _Cell) -> None:
    assert cell.frame is not None
    try:
        found, _ = band_at(cell.run.run, State(cell.frame.strain, cell.run.state.line))
    except PostError:
        return
    x, y = zip(*found.profile.line)
    ax.plot(x, y, color=COLOURS[1], linewidth=0.9)


def _label_axes(ax: Axes, place: Place, heading: str, first: bool, lowest: bool) -> None:
    ax.set_title(readable(place.title), fontsize=7, pad=2.5, linespacing=1.1)
    ax.tick_params(labelsize=6, pad=1.5, labelleft=place.numbered)
    ax.locator_params(axis="x", nbins=2 if place.width < 16.0 else 4)
    ax.locator_params(axis="y", nbins=3 if place.height < 20.0 else 5)
    if first:
        ax.set_ylabel(f"{heading}\ny [m]" if heading else "y [m]", fontsize=7, labelpad=1.5)
    if lowest:
        ax.set_xlabel("x [m]", fontsize=7, labelpad=1.5)


def _contour_row(cell: _Cell, field: str) -> Row:
    row: Row = {"series": cell.run.series, "run": cell.run.id, "label": cell.run.label,
                "title": cell.title, "field": field}  # fmt: skip
    names = ("strain [1]", "smallest", "largest", "mean", "unit")
    if cell.frame is None or cell.panel is None:
        return {**row, **dict.fromkeys(names)}
    values, run = cell.panel.values, cell.frame.run
    mean = float(np.average(values, weights=run.volumes[run.body]))
    unit = cell.frame.scalar(field).unit
    found = (cell.frame.strain, float(values.min()), float(values.max()), mean, unit)
    return {**row, **dict(zip(names, found))}
