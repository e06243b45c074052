"""The figure of a study that draws measures over parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from ..draw.legends import COMPARED, legend
from ..draw.style import new_figure, readable, style
from ..draw.text import fit_numbers
from ..read.errors import RequestError
from . import drawing as draw
from .drawing import AXES, COMMON, Look, Row
from .types import Column, Drawing, StudyRun

PLOT_OPTIONS = COMMON | AXES | {
    "x", "y", "by", "x_unit", "errors", "connect", "target", "target_label", "slope",
    "slope_label", "legend", "legend_title", "names",
}  # fmt: skip


MOST_LETTERS = 45  # of all names on an axis that stand level
MOST_TICKS = 8  # values that are written on a logarithmic axis


@dataclass(frozen=True)
class _Points:
    """The points of one line of a plot, in SI units."""

    label: str
    look: Look
    quantity: str
    unit: str
    runs: list[StudyRun]
    x: list[float]
    y: list[float]
    error: list[float]


def plot(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """One or several columns (`y`) over a parameter or column (`x`), a line for each series.

    Text on the x axis (names of cases) makes an axis of names. A column `<y>_uncertainty`
    or `<y>_spread` becomes error bars.
    """
    runs = draw.selected(runs, options)
    x, ys = draw.text(options, "x"), draw.texts(options, "y")
    if not x or not ys:
        raise RequestError("a plot needs the options x and y")
    by = draw.text(options, "by", "series")
    compared = [options.get(key) for key in ("target", "slope")]
    for name in (x, by, *ys, *(name for name in compared if isinstance(name, str))):
        draw.require_known(runs, name, columns)
    names = _names_on(runs, x)
    lines = [line for line in _lines(runs, options, columns, (x, by, ys), names) if len(line.x)]
    if not lines:
        raise RequestError(f"no run has both {x} and {' or '.join(ys)}")
    units = {line.unit for line in lines}
    if len(units) > 1:
        raise RequestError(f"columns with different units ({', '.join(sorted(units))}) in one plot")
    largest = max(max(map(abs, line.y)) for line in lines)
    factor, unit = draw.display_unit(lines[0].unit, draw.text(options, "scale"), largest)
    x_unit = columns[x].unit if x in columns else ""
    x_factor, x_shown = (1.0, "")
    if not names and x_unit:
        top = max(max(map(abs, line.x)) for line in lines)
        x_factor, x_shown = draw.display_unit(x_unit, draw.text(options, "x_unit"), top)
    place = draw.legend_place(options, _entries(lines, options), 3, bool(_entries(lines, options)))
    with style():
        height = (draw.number(options, "height") or 66.0) + place.extra
        figure = new_figure(place.width, height)
        ax = figure.subplots()
        for line in lines:
            _draw_points(ax, line, x_factor, factor, options, bool(names))
        _extra_lines(ax, lines, runs, options, (x_factor, factor))
        ax.set_xlabel(draw.axis_text(x, x_shown, draw.text(options, "x_label")))
        name = ys[0] if len(ys) == 1 else "value"
        ax.set_ylabel(draw.axis_text(name, unit, draw.text(options, "y_label")))
        draw.widen(ax)
        draw.set_ranges(ax, options)
        _x_ticks(ax, lines, names, x_factor, options)
        draw.finish(ax)
        legend(ax, place, draw.text(options, "legend_title"))
        fit_numbers(ax)
    return Drawing(figure, [row for line in lines for row in _point_rows(line, x, names)])


def _entries(lines: Sequence[_Points], options: Mapping[str, Any]) -> list[str]:
    """Labels of the legend; none for a single line with nothing to compare it with."""
    compared = [draw.text(options, f"{name}_label") for name in ("target", "slope")]
    extra = [label for label in compared if label]
    if len(lines) == 1 and not extra:
        return []
    return [*(line.label for line in lines), *extra]


def _x_ticks(
    ax: Axes,
    lines: Sequence[_Points],
    names: list[str],
    factor: float,
    options: Mapping[str, Any],
) -> None:
    """Names, whole numbers, or on a logarithmic axis the values themselves."""
    there = sorted({x * factor for line in lines for x in line.x})
    if names:
        ax.set_xticks(range(len(names)), names)
        ax.margins(x=0.12)
        if sum(len(name) for name in names) > MOST_LETTERS:
            for tick in ax.get_xticklabels():
                tick.set(rotation=30, horizontalalignment="right", rotation_mode="anchor")
    elif draw.flag(options, "x_log"):
        if len(there) <= MOST_TICKS:
            ax.xaxis.set_major_locator(FixedLocator(there))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            ax.xaxis.set_minor_locator(NullLocator())
    elif all(float(x).is_integer() for x in there):
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))


def _names_on(runs: Sequence[StudyRun], x: str) -> list[str]:
    """The names on an axis of names, in order of appearance; empty for an axis of numbers."""
    values = [draw.value_of(run, x) for run in runs]
    if not any(isinstance(v, (str, bool)) for v in values):
        return []
    return list(dict.fromkeys(draw.shown(v) for v in values if v is not None))


def _lines(
    runs: Sequence[StudyRun],
    options: Mapping[str, Any],
    columns: Mapping[str, Column],
    what: tuple[str, str, list[str]],
    names: list[str],
) -> list[_Points]:
    x, by, ys = what
    given = draw.texts(options, "names")
    if given and len(given) != len(ys):
        raise RequestError(f"{len(given)} names are given for {len(ys)} columns")
    groups = draw.grouped(runs, by, not draw.text(options, "legend_title"))
    found = []
    for i, (group, members) in enumerate(groups.items()):
        for j, y in enumerate(ys):
            words = given[j] if given else draw.words(y)
            label = words if len(ys) > 1 else group if len(groups) > 1 else "computed"
            if len(ys) > 1 and len(groups) > 1:
                label = f"{words}, {group}"
            look = draw.look(j, i) if len(ys) > 1 and len(groups) > 1 else draw.look(i + j)
            unit = columns[y].unit if y in columns else "1"
            found.append(_points(members, (x, y), (label, look, unit), names))
    return found


def _points(
    runs: Sequence[StudyRun],
    what: tuple[str, str],
    kind: tuple[str, Look, str],
    names: list[str],
) -> _Points:
    points = []
    for run in runs:
        x, y = (draw.value_of(run, name) for name in what)
        errors = (draw.value_of(run, f"{what[1]}_{name}") for name in ("uncertainty", "spread"))
        error = next((e for e in errors if e is not None), None)
        place = names.index(draw.shown(x)) if names and x is not None else x
        if isinstance(place, (int, float)) and isinstance(y, (int, float)):
            size = float(error) if isinstance(error, (int, float)) else float("nan")
            points.append((float(place), float(y), size, run))
    points.sort(key=lambda p: p[0])
    label, look, unit = kind
    return _Points(
        label, look, what[1], unit, [p[3] for p in points],
        [p[0] for p in points], [p[1] for p in points], [p[2] for p in points],
    )  # fmt: skip


def _draw_points(
    ax: Axes,
    line: _Points,
    x_factor: float,
    factor: float,
    options: Mapping[str, Any],
    by_name: bool,
) -> None:
    error = np.array(line.error) * factor
    bars = np.isfinite(error).any() and draw.flag(options, "errors", True)
    connected = draw.flag(options, "connect", not by_name)
    ax.errorbar(
        np.array(line.x) * x_factor, np.array(line.y) * factor,
        yerr=np.nan_to_num(error) if bars else None,
        color=line.look.colour, marker=line.look.marker,
        linestyle=line.look.dash if connected else "none",
        capsize=2.0, elinewidth=0.7, capthick=0.7, label=readable(line.label),
    )  # fmt: skip


def _extra_lines(
    ax: Axes,
    lines: Sequence[_Points],
    runs: Sequence[StudyRun],
    options: Mapping[str, Any],
    factors: tuple[float, float],
) -> None:
    """Lines to compare with: a level (a number, or a column in which all runs agree), y = slope x.

    The slope, in SI units, is a number or the mean of a column.
    """
    x_factor, factor = factors
    target = options.get("target")
    if isinstance(target, str):
        values = [v for v in (draw.value_of(run, target) for run in runs) if v is not None]
        target = values[0] if values and isinstance(values[0], (int, float)) else None
    elif target is not None:
        target = draw.number(options, "target")
    if target is not None:
        ax.axhline(
            float(target) * factor, color="black", linewidth=0.8, linestyle=(0, (4, 2)),
            label=readable(draw.text(options, "target_label")) or None, zorder=COMPARED,
        )  # fmt: skip
    slope = options.get("slope")
    if isinstance(slope, str):
        slope = _mean_of(runs, slope)
    elif slope is not None:
        slope = draw.number(options, "slope")
    if slope is not None:
        top = max(max(line.x) for line in lines)
        x = np.linspace(0.0, 1.05 * top, 2 if not draw.flag(options, "x_log") else 50)
        ax.plot(
            x * x_factor, slope * x * factor, color="black", linewidth=0.8, linestyle=":",
            label=readable(draw.text(options, "slope_label")) or None, zorder=COMPARED,
        )  # fmt: skip


def _mean_of(runs: Sequence[StudyRun], name: str) -> float | None:
    values = [draw.value_of(run, name) for run in runs]
    there = [float(v) for v in values if isinstance(v, (int, float))]
    return sum(there) / len(there) if there else None


def _point_rows(line: _Points, x: str, names: list[str]) -> list[Row]:
    return [
        {
            "series": run.series,
            "run": run.id,
            "label": run.label,
            x if x not in ("series", "run", "label") else "x": draw.value_of(run, x),
            "quantity": line.quantity,
            "value": y,
            "uncertainty": error if np.isfinite(error) else None,
            "unit": line.unit,
        }
        for run, y, error in zip(line.runs, line.y, line.error)
    ]
