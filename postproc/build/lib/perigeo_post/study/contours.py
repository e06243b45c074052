"""The figure of a study that draws contours: several runs or states on one colour scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..draw.contours import Panel, Scale, common_extent, common_scale, panel_of
from ..draw.layout import TALLEST, Wishes, shared
from ..draw.panels import Cell, Rows, panel_figure
from ..draw.style import COLOURS, style
from ..measure.smooth import WORDS, smoothed_for
from ..read.errors import PostError, RequestError
from ..read.points import FloatArray
from ..read.run import Frame
from . import drawing as draw
from .drawing import COMMON, Row
from .measures import band_at
from .types import Column, Drawing, State, StudyRun

CONTOUR_OPTIONS = COMMON | {
    "by", "field", "strain", "rows", "same_scale", "low", "high", "deformed", "per_row",
    "show_line", "smooth", "panel_height",
}  # fmt: skip


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
            heading = draw.named(run, by) if by else run.label
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
        panel = panel_of(frame, field, deformed)
    except PostError as error:
        return _Cell(run, title, None, None, str(error))
    return _Cell(run, title, frame, panel)


def _contour_figure(
    rows: list[_Row], scale: Scale, field: str, options: Mapping[str, Any]
) -> Figure:
    extents = _extents(rows)
    line = draw.flag(options, "show_line")
    cells = [
        [
            Cell(cell.title, extent, cell.panel, partial(_draw_line, cell) if line else None)
            for cell, extent in zip(row.cells, in_row)
        ]
        for row, in_row in zip(rows, extents)
    ]
    wishes = Wishes(
        draw.width_of(options, "double"),
        draw.flag(options, "same_scale", True),
        draw.number(options, "panel_height") or TALLEST,
    )
    more = f"; displacements {WORDS}" if draw.flag(options, "smooth") else ""
    headings = [row.heading for row in rows]
    return panel_figure(Rows(cells, headings), wishes, scale, field, more)[0]


def _extents(rows: list[_Row]) -> list[list[FloatArray]]:
    """x0, y0, x1, y1 shown in each panel; one without a result has that of another."""
    cells = [cell for row in rows for cell in row.cells]
    there = [cell.panel for cell in cells if cell.panel is not None]
    all_extents = iter(shared([common_extent([cell.panel or there[0]]) for cell in cells]))
    return [[next(all_extents) for _ in row.cells] for row in rows]


def _draw_line(cell: _Cell, ax: Axes) -> None:
    assert cell.frame is not None
    try:
        found, _ = band_at(cell.run.run, State(cell.frame.strain, cell.run.state.line))
    except PostError:
        return
    x, y = zip(*found.profile.line)
    ax.plot(x, y, color=COLOURS[1], linewidth=0.9)


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
