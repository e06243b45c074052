"""Figures of studies with curves: stress-strain, histories, and how quasi-static a run was."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..draw.legends import LegendPlace, legend
from ..draw.style import new_figure, readable, style, with_unit
from ..draw.text import fit_numbers
from ..measure.curves import Curve, history_curve, stress_strain
from ..measure.quality import START, kinetic_bound, kinetic_curve, reaction_gap
from ..read.errors import PostError, RequestError
from . import drawing as draw
from .drawing import AXES, COMMON, Look, Row
from .types import Column, Drawing, StudyRun

CURVE_OPTIONS = COMMON | AXES | {
    "by", "marks", "tension_positive", "platen", "inset", "inset_place", "legend", "legend_title",
}  # fmt: skip
HISTORY_OPTIONS = COMMON | AXES | {"x", "y", "by", "legend", "legend_title"}
QUALITY_OPTIONS = COMMON | {"legend", "legend_title", "x_range"}


@dataclass(frozen=True)
class _Styled:
    run: StudyRun
    curve: Curve
    look: Look
    label: str | None


def curves(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """Stress-strain curves of all runs, with symbols at the strains `marks`."""
    runs = draw.selected(runs, options)
    turned = draw.flag(options, "tension_positive")
    platen = draw.choice(options, "platen", ("first", "second"))
    styled = _styled(
        runs, options, columns, lambda run: stress_strain(run.run, turned, platen, run.label)
    )
    marks = draw.numbers(options, "marks")
    sense = "tension" if turned else "compression"
    with style():
        figure, ax, place = _curve_axes(styled, options)
        factor, unit = _draw_curves(ax, styled, options)
        _mark(ax, styled, marks, factor)
        note = f", {sense} positive"
        ax.set_xlabel(draw.text(options, "x_label") or f"Nominal strain{note} [%]")
        ax.set_ylabel(draw.text(options, "y_label") or with_unit(f"Axial stress{note}", unit))
        draw.set_ranges(ax, options)
        draw.finish(ax)
        _inset(ax, styled, options, factor)
        legend(ax, place, draw.text(options, "legend_title"))
        fit_numbers(ax)
    rows = [row for s in styled for row in _curve_rows(s)]
    return Drawing(figure, rows)


def history(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """A column of the histories (`y`) over strain, time or another column (`x`)."""
    runs = draw.selected(runs, options)
    name, against = draw.text(options, "y"), draw.text(options, "x")
    if not name:
        raise RequestError("a history figure needs the option y, a column of the history")
    styled = _styled(
        runs, options, columns,
        lambda run: history_curve(run.run, name, against or None, run.label),
    )  # fmt: skip
    with style():
        figure, ax, place = _curve_axes(styled, options)
        _, unit = _draw_curves(ax, styled, options)
        first = styled[0].curve
        strain = first.x_name == "strain"
        text = "Nominal strain, compression positive [%]"
        ax.set_xlabel(
            draw.text(options, "x_label")
            or (text if strain else draw.axis_text(first.x_name, first.x_unit))
        )
        ax.set_ylabel(draw.axis_text(name, unit, draw.text(options, "y_label")))
        draw.set_ranges(ax, options)
        draw.finish(ax)
        legend(ax, place, draw.text(options, "legend_title"))
        fit_numbers(ax)
    return Drawing(figure, [row for s in styled for row in _curve_rows(s)])


def _styled(
    runs: Sequence[StudyRun],
    options: Mapping[str, Any],
    columns: Mapping[str, Column],
    read: Callable[[StudyRun], Curve],
) -> list[_Styled]:
    """The curves that can be had, with colours by run or by the value of the option `by`."""
    by = draw.text(options, "by")
    if by:
        draw.require_known(runs, by, columns)
    groups = draw.grouped(runs, by, not draw.text(options, "legend_title")) if by else {}
    group_of = {run.id: name for name, members in groups.items() for run in members}
    found: list[_Styled] = []
    used: dict[str, int] = {}
    reason: PostError | None = None
    for k, run in enumerate(runs):
        try:
            curve = read(run)
        except PostError as error:
            reason = error
            continue
        if not by:
            found.append(_Styled(run, curve, draw.look(k), run.label))
            continue
        group = group_of[run.id]
        count = used.get(group, 0)
        used[group] = count + 1
        look = draw.look(list(groups).index(group), count)
        found.append(_Styled(run, curve, look, group if count == 0 else None))
    if not found:
        raise RequestError("no curve to draw") from reason
    return found


def _curve_axes(
    styled: Sequence[_Styled], options: Mapping[str, Any]
) -> tuple[Figure, Axes, LegendPlace]:
    labels = [s.label for s in styled if s.label is not None]
    inside = 0 if options.get("inset") else 4
    place = draw.legend_place(options, labels, inside, len(styled) > 1)
    height = (draw.number(options, "height") or 70.0) + place.extra
    figure = new_figure(place.width, height)
    return figure, figure.subplots(), place


def _draw_curves(
    ax: Axes, styled: Sequence[_Styled], options: Mapping[str, Any]
) -> tuple[float, str]:
    sizes = [float(np.nanmax(np.abs(s.curve.y))) for s in styled if np.isfinite(s.curve.y).any()]
    first = styled[0].curve
    factor, unit = draw.display_unit(
        first.y_unit or "1", draw.text(options, "scale"), max(sizes, default=0.0)
    )
    _lines_into(ax, styled, factor)
    return factor, unit


def _lines_into(ax: Axes, styled: Sequence[_Styled], factor: float) -> None:
    for s in styled:
        ax.plot(
            s.curve.x * _x_factor(s.curve), s.curve.y * factor, color=s.look.colour,
            linestyle=s.look.dash, label=None if s.label is None else readable(s.label),
        )  # fmt: skip


def _x_factor(curve: Curve) -> float:
    return 100.0 if curve.x_name == "strain" else 1.0


def _mark(ax: Axes, styled: Sequence[_Styled], marks: Sequence[float], factor: float) -> None:
    """Symbols on every curve at these strains; the strain is written at a single curve."""
    if len(styled) == 1 and marks:
        ax.margins(x=0.08)
    for s in styled:
        for strain in marks:
            x = s.curve.toward(strain)
            y = s.curve.at(x) * factor
            ax.plot([100.0 * x], [y], "o", color=s.look.colour, markeredgecolor="black",
                    markeredgewidth=0.5, zorder=5)  # fmt: skip
            if len(styled) == 1:
                ax.annotate(f"{100.0 * strain:g} %", (100.0 * x, y), xytext=(0, 5),
                            textcoords="offset points", fontsize=7, ha="center")  # fmt: skip


def _inset(ax: Axes, styled: Sequence[_Styled], options: Mapping[str, Any], factor: float) -> None:
    """A part of the curves enlarged: `inset` = [x0, x1, y0, y1] in the units shown."""
    window = draw.numbers(options, "inset", 4)
    if not window:
        return
    place = draw.numbers(options, "inset_place", 4) or [0.52, 0.5, 0.45, 0.46]
    small: Any = ax.inset_axes((place[0], place[1], place[2], place[3]))
    _lines_into(small, styled, factor)
    small.set(xlim=window[:2], ylim=window[2:])
    small.tick_params(labelsize=6)
    small.locator_params(nbins=4)
    draw.finish(small)
    ax.indicate_inset_zoom(small, edgecolor="0.4")


def _curve_rows(styled: _Styled) -> list[Row]:
    run, curve = styled.run, styled.curve
    x_name = f"{curve.x_name} [{curve.x_unit}]"
    y_name = f"{curve.y_name} [{curve.y_unit}]"
    known: Row = {"series": run.series, "run": run.id, "label": run.label}
    return [{**known, x_name: float(x), y_name: float(y)} for x, y in zip(curve.x, curve.y)]


# ---- quality -------------------------------------------------------------------------------


def quality(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """Kinetic over internal energy (points: exact, lines: upper bound), and the reaction gap."""
    runs = draw.selected(runs, options)
    rows: list[Row] = []
    with style():
        place = draw.legend_place(options, [run.label for run in runs], 0, len(runs) > 1)
        height = (draw.number(options, "height") or 100.0) + place.extra
        figure = new_figure(place.width, height)
        upper, lower = figure.subplots(2, 1, sharex=True)
        for k, run in enumerate(runs):
            rows += _draw_quality(upper, lower, run, draw.look(k))
        if not rows:
            raise RequestError("no run has a history and frames from which the quality follows")
        upper.set_yscale("log")
        upper.set_ylabel("Kinetic energy of v − v$_{ref}$\nover internal energy [–]")
        lower.set_ylabel("Difference of the reactions\nover the largest [%]")
        lower.set_xlabel("Nominal strain, compression positive [%]")
        lower.set_ylim(bottom=0.0)
        limits = draw.numbers(options, "x_range", 2)
        lower.set_xlim(*(limits or (0.0, None)))
        for ax in (upper, lower):
            draw.finish(ax)
        note = "points: exact, from the frames; thin lines: upper bound"
        upper.annotate(
            note, (0.98, 0.96), xycoords="axes fraction", ha="right", va="top", fontsize=6
        )
        legend(upper, place, draw.text(options, "legend_title"))
        fit_numbers(lower)
    return Drawing(figure, rows)


def _draw_quality(upper: Axes, lower: Axes, run: StudyRun, look: Look) -> list[Row]:
    parts = []
    for name, read in (("exact", kinetic_curve), ("bound", kinetic_bound), ("gap", reaction_gap)):
        try:
            curve = read(run.run)
        except PostError:
            continue
        late = np.abs(curve.x) >= START * (1.0 - 1e-6)
        x, y = curve.x[late], curve.y[late]
        if name == "exact":
            upper.plot(100.0 * x, y, look.marker, color=look.colour, ms=3.0)
        elif name == "bound":
            upper.plot(100.0 * x, y, color=look.colour, linestyle=look.dash, linewidth=0.6)
        else:
            lower.plot(100.0 * x, 100.0 * y, color=look.colour, linestyle=look.dash)
        parts.append((name, x, y))
    if parts:  # a sample for the legend: both the points and the lines
        upper.plot([], [], color=look.colour, marker=look.marker, ms=3.0, linestyle=look.dash,
                   label=readable(run.label))  # fmt: skip
    words = {"exact": "kinetic_ratio", "bound": "kinetic_bound", "gap": "reaction_gap"}
    return [
        {"series": run.series, "run": run.id, "label": run.label, "quantity": words[name],
         "strain [1]": float(a), "value [1]": float(b)}
        for name, x, y in parts
        for a, b in zip(x, y)
    ]  # fmt: skip
