"""The figure of a study that draws the plastic strain along lines across the bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..draw.legends import legend
from ..draw.style import new_figure, readable, style, with_unit
from ..draw.text import fit_numbers
from ..measure.band import LEVEL, BandMeasure, Line
from ..measure.measures import frame_profile
from ..read.errors import PostError, RequestError
from ..read.fields import label_of
from ..read.numerals import fixed
from ..read.points import FloatArray
from . import drawing as draw
from .drawing import COMMON, Row
from .measures import band_at
from .types import Column, Drawing, State, StudyRun

PROFILE_OPTIONS = COMMON | {
    "field", "strain", "line", "centred", "normalised", "level", "x_range", "y_range", "legend",
    "legend_title",
}  # fmt: skip

AROUND = 1.5  # widths on either side of the peak that are shown


@dataclass(frozen=True)
class _Curve:
    run: StudyRun
    found: BandMeasure
    values: FloatArray  # along the line of the profile
    unit: str


def profiles(
    runs: Sequence[StudyRun], options: Mapping[str, Any], columns: Mapping[str, Column]
) -> Drawing:
    """The plastic strain along the line of each run, with its interpolated width.

    `line` = [[x, y], [x, y]]: along it (mirrored where it would run along the band, not across);
    else along that of the study, or across the prevailing band. `centred`: distance from the peak.
    """
    runs = draw.selected(runs, options)
    field = draw.text(options, "field", "plastic_strain")
    there: list[_Curve] = []
    reason: PostError | None = None
    for run in runs:
        for state in _states(run, options):
            try:
                there.append(_profile(run, state, options, field))
            except PostError as error:
                reason = error
    if not there:
        raise RequestError(f"there is nothing to draw: {reason}") from reason
    several = len(draw.numbers(options, "strain")) > 1
    with style():
        centred, share = draw.flag(options, "centred"), draw.flag(options, "normalised")
        labels = [_label(curve, several) for curve in there]
        level = there[0].found.interpolated.level
        inside = 0 if share or centred else 4
        title = draw.text(options, "legend_title", f"width between points at {100.0 * level:g} %")
        place = draw.legend_place({"legend_title": title, **options}, labels, inside)
        figure = new_figure(place.width, (draw.number(options, "height") or 74.0) + place.extra)
        ax = figure.subplots()
        for k, curve in enumerate(there):
            _draw_profile(ax, curve, draw.look(k), labels[k], options)
        name, start = label_of(field), " from the peak" if centred else ""
        ax.set_xlabel(f"Distance{start} along the line [m]")
        ax.set_ylabel(f"{name} over its peak [–]" if share else with_unit(name, there[0].unit))
        if share:
            ax.axhline(level, color="0.4", linewidth=0.6, linestyle=":")
        if all(np.nanmin(curve.values) >= 0.0 for curve in there):
            ax.set_ylim(bottom=0.0)
        if centred:
            reach = AROUND * max(curve.found.interpolated.width for curve in there)
            ax.set_xlim(-reach, reach)
        else:
            ax.set_xlim(0.0, max(float(c.found.profile.distance[-1]) for c in there))
        draw.set_ranges(ax, options)
        draw.finish(ax)
        legend(ax, place, title)
        fit_numbers(ax)
    return Drawing(figure, [row for curve in there for row in _profile_rows(curve, field)])


def _states(run: StudyRun, options: Mapping[str, Any]) -> list[State]:
    line = _line(options) or run.state.line
    strains: list[float | None] = [*draw.numbers(options, "strain")]
    return [State(s, line, run.state.sampled) for s in strains or [run.state.strain]]


def _profile(run: StudyRun, state: State, options: Mapping[str, Any], field: str) -> _Curve:
    measured, _ = band_at(run.run, state, draw.number(options, "level") or LEVEL)
    frame = run.run.frame(number=measured.frame)
    along = measured.profile  # of a field that was sampled, the samples
    if state.sampled is None or field != along.name:
        along = frame_profile(frame, measured.profile.line, field)
    return _Curve(run, measured, along.values, along.unit)


def _line(options: Mapping[str, Any]) -> Line | None:
    given = options.get("line")
    if given is None:
        return None
    ends = np.asarray(given, dtype=object)
    if ends.shape != (2, 2) or not all(isinstance(v, (int, float)) for v in ends.ravel()):
        raise RequestError(f"the option line must be [[x, y], [x, y]], not {given!r}")
    (x0, y0), (x1, y1) = given
    return ((float(x0), float(y0)), (float(x1), float(y1)))


def _label(curve: _Curve, several: bool) -> str:
    width = curve.found.interpolated
    strain = f", {100.0 * curve.found.strain:.3g} %" if several else ""
    return f"{curve.run.label}{strain}: {'' if width.closed else '≥ '}{fixed(width.width, 3)} m"


def _draw_profile(
    ax: Axes, curve: _Curve, look: draw.Look, label: str, options: Mapping[str, Any]
) -> None:
    """A profile and, where it is the plastic strain, its interpolated width at the level."""
    profile, width = curve.found.profile, curve.found.interpolated
    start = width.peak_distance if draw.flag(options, "centred") else 0.0
    plastic = draw.text(options, "field", "plastic_strain") == "plastic_strain"
    factor = 1.0
    if draw.flag(options, "normalised"):
        factor = 1.0 / (width.peak if plastic else float(np.nanmax(np.abs(curve.values))))
    ax.plot(
        profile.distance - start, curve.values * factor, color=look.colour, linestyle=look.dash,
        label=readable(label),
    )  # fmt: skip
    if plastic:
        target = width.level * width.peak * factor
        ax.plot(
            [width.left - start, width.right - start], [target, target], color=look.colour,
            linewidth=0.6, marker="|", ms=5,
        )  # fmt: skip


def _profile_rows(curve: _Curve, field: str) -> list[Row]:
    run, found = curve.run, curve.found
    profile = found.profile
    known: Row = {"series": run.series, "run": run.id, "label": run.label}
    known["strain [1]"] = found.strain
    names = ("distance [m]", "from_peak [m]", "x [m]", "y [m]", f"{field} [{curve.unit}]")
    from_peak = profile.distance - found.interpolated.peak_distance
    columns = (profile.distance, from_peak, profile.x, profile.y)
    return [
        {**known, **dict(zip(names, map(float, values)))}
        for values in zip(*columns, curve.values)
        if np.isfinite(values[-1])
    ]
