"""Figures of curves, bands and comparisons. All return a matplotlib Figure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..measure.band import BandMeasure
from ..measure.curves import Curve, energy_curves, history_curve, peak, stress_strain
from ..measure.measures import labels_for, measure_band
from ..measure.smooth import smoothed_for
from ..read.errors import RequestError
from ..read.fields import label_of
from ..read.numerals import fixed, place
from ..read.run import Frame, Run
from .contours import columns_for, common_extent, common_scale, deformation_note, panel_of
from .layout import Place
from .legends import LegendPlace, best_place, legend, placed
from .panels import Cell, fill, in_rows, wishes_for
from .style import (
    COLOURS,
    DASHES,
    DOUBLE,
    SINGLE,
    new_figure,
    prefix_for,
    readable,
    style,
    with_unit,
)
from .text import LINE, fit_numbers, unit_for, wrapped

# [mm]
PROFILE, PROFILE_LEFT = 50.0, 17.0  # height of the axes of a profile, and what is left of them
CURVES, CURVES_LEFT, CURVES_WIDE = 52.0, 17.0, 120.0  # axes of curves below panels
ASIDE = LegendPlace("aside", DOUBLE, 0.0, longest=34.0)  # of them
CURVE_BELOW = 11.0  # numbers and name of an axis below
AXIS_WORDS = 60.0  # longest line of the name of an upright axis

_WORDS = {"strain": "Nominal strain", "axial_stress": "Axial stress", "time": "Time"}


def _words(name: str) -> str:
    words = name.replace("_", " ")
    return _WORDS.get(name, words[:1].upper() + words[1:])


def _shared(curves: Sequence[Curve]) -> str:
    """The words that the names of all columns share, else "Value"."""
    names = [curve.y_name.split("_") for curve in curves]
    return _words("_".join(w for w in names[0] if all(w in name for name in names)) or "value")


def draw_curves(
    ax: Axes,
    curves: Sequence[Curve],
    y_label: str | None = None,
    place: LegendPlace | None = None,
) -> None:
    """Curves into given axes, with units, prefixes and a sign convention on the axes."""
    if not curves:
        raise RequestError("no curve to draw")
    first = curves[0]
    sizes = [float(np.nanmax(np.abs(c.y))) for c in curves if np.isfinite(c.y).any()]
    factor, unit = prefix_for(max(sizes, default=0.0), first.y_unit)
    percent = first.x_name == "strain"
    wide = [float(np.nanmax(np.abs(c.x))) for c in curves if np.isfinite(c.x).any()]
    x_factor, x_unit = (100.0, "%") if percent else prefix_for(max(wide, default=0.0), first.x_unit)
    for k, curve in enumerate(curves):
        ax.plot(
            curve.x * x_factor, curve.y * factor, label=readable(curve.label),
            color=COLOURS[k % len(COLOURS)], linestyle=DASHES[k % len(DASHES)],
        )  # fmt: skip
    signed = first.y_name == "axial_stress"
    sense = "tension" if first.tension_positive else "compression"
    note = f", {sense} positive" if signed else ""
    strain_note = note if signed else ", compression positive"
    ax.set_xlabel(
        with_unit(_words(first.x_name) + (strain_note if percent else ""), x_unit)
    )  # fmt: skip
    several = len({c.y_name for c in curves}) > 1
    name = with_unit((y_label or (_shared(curves) if several else _words(first.y_name))) + note,
                     unit)  # fmt: skip
    ax.set_ylabel("\n".join(wrapped(name, AXIS_WORDS, 8.0)))
    ax.grid(True, linewidth=0.3, color="0.85")
    ax.set_axisbelow(True)
    if first.downwards:
        ax.invert_yaxis()
        ax.xaxis.tick_top()
        ax.xaxis.set_label_position("top")
    if place is not None:
        legend(ax, place)


def curve_figure(
    curves: Sequence[Curve],
    y_label: str | None = None,
    marks: Sequence[float] = (),
    column: str = "single",
) -> Figure:
    """Curves of one kind in one figure; `marks` puts symbols on the first at these strains."""
    if not curves:
        raise RequestError("no curve to draw")
    with style():
        labels = [curve.label for curve in curves]
        wide = SINGLE if column == "single" else DOUBLE
        place = placed(labels, best_place(labels, 4), wide) if len(labels) > 1 else None
        width, extra = (place.width, place.extra) if place is not None else (wide, 0.0)
        figure = new_figure(width, (66.0 if column == "single" else 90.0) + extra)
        ax = figure.subplots()
        draw_curves(ax, curves, y_label, place)
        _mark(ax, curves[0], marks)
        fit_numbers(ax)
    return figure


def _mark(ax: Axes, curve: Curve, marks: Sequence[float]) -> None:
    factor, _ = prefix_for(
        float(np.nanmax(np.abs(curve.y))) if np.isfinite(curve.y).any() else 0.0, curve.y_unit
    )
    if marks:
        ax.margins(x=0.16)  # room for the words of a mark at the end
    for strain in marks:
        x = curve.toward(strain)
        y = curve.at(x) * factor
        ax.plot([100.0 * x], [y], "o", color="black", zorder=5)
        ax.annotate(
            f"{100.0 * strain:g} %", (100.0 * x, y), xytext=(3, 3),
            textcoords="offset points", fontsize=7,
        )  # fmt: skip


def stress_strain_figure(
    runs: Sequence[Run],
    labels: Sequence[str] | None = None,
    tension_positive: bool = False,
    platen: str = "first",
    marks: Sequence[float] = (),
    column: str = "single",
) -> Figure:
    """Stress-strain curves of one or many runs; the peak of a single run is marked."""
    names = labels_for(runs, labels)
    curves = [stress_strain(r, tension_positive, platen, n) for r, n in zip(runs, names)]
    figure = curve_figure(curves, None, marks, column)
    if len(curves) == 1 and not marks:
        stress, strain = peak(curves[0])
        if np.isfinite(stress) and stress != 0.0:
            with style():
                ax = figure.axes[0]
                factor, unit = prefix_for(abs(stress), curves[0].y_unit)
                ax.plot([100.0 * strain], [stress * factor], "o", color=COLOURS[1])
                ax.annotate(
                    f"peak {fixed(stress * factor, 1)} {unit} at {100.0 * strain:.3f} %",
                    (100.0 * strain, stress * factor), xytext=(5, 3 if stress > 0.0 else -3),
                    textcoords="offset points", fontsize=7,
                    va="bottom" if stress > 0.0 else "top",
                )  # fmt: skip
                ax.margins(y=0.12)
    return figure


def energy_figure(run: Run, against: str | None = None, column: str = "single") -> Figure:
    """All energies of a run against strain or time."""
    curves = energy_curves(run, against)
    return curve_figure(curves, "Energy per unit thickness", column=column)


def column_figure(
    runs: Sequence[Run],
    name: str,
    against: str | None = None,
    labels: Sequence[str] | None = None,
    column: str = "single",
) -> Figure:
    """One history column of one or many runs against strain, time or another column."""
    names = labels_for(runs, labels)
    curves = [history_curve(r, name, against, n) for r, n in zip(runs, names)]
    return curve_figure(curves, column=column)


def draw_profile(ax: Axes, measure: BandMeasure) -> None:
    """A profile with its peak, level and width into given axes."""
    profile, width = measure.profile, measure.interpolated
    factor, unit = unit_for(float(profile.distance[-1]))
    ax.plot(factor * profile.distance, profile.values, color=COLOURS[0])
    target = width.level * width.peak
    ax.axhline(target, color="0.5", linewidth=0.6, linestyle=":")
    ends = [factor * width.left, factor * width.right]
    ax.plot(ends, [target, target], color=COLOURS[1], marker="|", ms=7)
    ax.plot([factor * width.peak_distance], [width.peak], "o", color=COLOURS[1], ms=3)
    ax.set_xlabel(f"Distance along the line [{unit}]")
    ax.set_ylabel(with_unit(label_of(profile.name), profile.unit))
    ax.set_xlim(0.0, factor * float(profile.distance[-1]))
    highest = np.nanmax(profile.values)
    ax.set_ylim(0.0, 1.06 * highest if highest > 0.0 else None)


def band_words(measure: BandMeasure) -> str:
    """The numbers of a band in short lines."""
    width, strong = measure.interpolated, measure.bands.prevailing
    factor, unit = unit_for(float(measure.profile.distance[-1]))
    between, fitted = factor * width.width, factor * measure.width
    sign = "" if width.closed else "≥ "
    size = factor * float(measure.profile.distance[-1])
    ends = [place(factor * x, factor * y, size) for x, y in measure.profile.line]
    return (
        f"Prevailing band, {strong.angle:.1f}° ± {strong.angle_uncertainty:.1f}° to the loading "
        f"axis\nweaker over stronger band {measure.bands.ratio:.2f}\n"
        f"width at {100.0 * width.level:g} % of the peak of {width.peak:.3g}:\n"
        f"between points {sign}{between:.4g} {unit} ± {factor * width.uncertainty:.2g} {unit},\n"
        f"fitted along the band {fitted:.4g} {unit}\n"
        f"line from {ends[0]} {unit} to {ends[1]} {unit}"
    )


def band_figure(run: Run, measure: BandMeasure) -> Figure:
    """Where the bands lie, and the profile across the prevailing one beside or below it."""
    frame = run.frame(number=measure.frame)
    panel = panel_of(frame)
    scale = common_scale([panel.values], frame.scalar("plastic_strain").unit)
    extent = common_extent([panel])
    beside = extent[3] - extent[1] > 0.6 * (extent[2] - extent[0])
    cell = Cell(frame.label, extent, panel, lambda ax: _draw_bands(ax, measure))
    with style():
        rows = in_rows([cell], 1)
        wishes = wishes_for(rows, SINGLE if beside else DOUBLE, 95.0)
        layout = rows.layout(wishes, scale)
        words = band_words(measure).splitlines()
        wide = DOUBLE - layout.width - PROFILE_LEFT if beside else 0.5 * DOUBLE
        lines = [part for line in words for part in wrapped(line, wide - 2.0, 7.0)]
        head = len(lines) * LINE * 7.0 + 4.0
        start = 2.0 if beside else layout.height + 3.0
        tall = max(PROFILE, layout.height - head - start - CURVE_BELOW if beside else 0.0)
        height = max(layout.height, start + head + tall + CURVE_BELOW)
        layout = layout.in_figure(DOUBLE, height)
        figure = new_figure(DOUBLE, height, layout=None)
        fill(figure, layout, rows, wishes, scale, "plastic_strain")
        left = DOUBLE - wide - 3.0 if beside else PROFILE_LEFT
        figure.text(left / DOUBLE, 1.0 - start / height, "\n".join(lines), fontsize=7, va="top",
                    linespacing=1.2)  # fmt: skip
        place = Place(left, start + head + tall, wide, tall, "", True)
        ax = figure.add_axes(layout.box(place))
        draw_profile(ax, measure)
        fit_numbers(ax)
    return figure


def _draw_bands(ax: Axes, measure: BandMeasure) -> None:
    bands = [measure.bands.prevailing, measure.bands.other]
    for band, dash in zip(bands, ("--", ":")):
        if band is not None:
            x, y = zip(*band.line)
            ax.plot(x, y, color="white", linestyle=dash, linewidth=0.9)
    x, y = zip(*measure.profile.line)
    ax.plot(x, y, color=COLOURS[1], linewidth=1.0)


def profile_figure(measures: Sequence[BandMeasure], labels: Sequence[str] | None = None) -> Figure:
    """Profiles of several frames or runs over the distance from their peaks."""
    names = labels or [m.label for m in measures]
    first = measures[0].profile
    factor, unit = unit_for(max(float(np.ptp(m.profile.distance)) for m in measures))
    words = [
        f"{name}: {factor * m.interpolated.width:.4g} {unit}" for m, name in zip(measures, names)
    ]
    title = f"width between points at {100.0 * measures[0].interpolated.level:g} % of the peak"
    with style():
        place = placed(words, best_place(words, 4), title=title)
        figure = new_figure(place.width, 66.0 + place.extra)
        ax = figure.subplots()
        for k, m in enumerate(measures):
            ax.plot(
                factor * (m.profile.distance - m.interpolated.peak_distance), m.profile.values,
                color=COLOURS[k % len(COLOURS)], linestyle=DASHES[k % len(DASHES)],
                label=readable(words[k]),
            )  # fmt: skip
        ax.set_xlabel(f"Distance from the peak along the line [{unit}]")
        ax.set_ylabel(with_unit(label_of(first.name), first.unit))
        ax.set_ylim(bottom=0.0)
        ax.locator_params(axis="x", nbins=7)
        legend(ax, place, title)
        fit_numbers(ax)
    return figure


def compare_figure(
    runs: Sequence[Run],
    field: str = "plastic_strain",
    strain: float | None = None,
    time: float | None = None,
    labels: Sequence[str] | None = None,
    deformed: float | None = None,
    tension_positive: bool = False,
    low: float | None = None,
    high: float | None = None,
    smooth: bool = False,
) -> Figure:
    """Contours of several runs side by side on one scale, and their stress-strain curves."""
    names = labels_for(runs, labels)
    frames: list[Frame] = [run.frame(strain, time) for run in runs]
    if smooth:
        frames = [smoothed_for(frame, field, deformed) for frame in frames]
    titles = [f"{n}\n{f.label}" for n, f in zip(names, frames)]
    panels = [panel_of(f, field, deformed) for f in frames]
    scale = common_scale([p.values for p in panels], frames[0].scalar(field).unit, low, high)
    curves = [
        stress_strain(r, tension_positive, label=n)
        for r, n in zip(runs, names)
        if r.platens is not None and r.has_history
    ]
    extent = common_extent(panels)
    cells = [Cell(title, extent, panel) for title, panel in zip(titles, panels)]
    with style():
        aspect = float((extent[3] - extent[1]) / (extent[2] - extent[0]))
        columns = columns_for(len(cells), aspect, DOUBLE)
        rows = in_rows(cells, columns, deformation_note(deformed, frames))
        wishes = wishes_for(rows, DOUBLE, 80.0 if columns == len(cells) else 60.0)
        layout = rows.layout(wishes, scale)
        top = layout.height
        if curves:
            layout = layout.in_figure(DOUBLE, top + 4.0 + CURVES + CURVE_BELOW)
        figure = new_figure(layout.width, layout.height, layout=None)
        fill(figure, layout, rows, wishes, scale, field)
        if curves:
            place = Place(CURVES_LEFT, top + 4.0 + CURVES, CURVES_WIDE, CURVES, "", True)
            ax = figure.add_axes(layout.box(place))
            draw_curves(ax, curves, None, ASIDE)
            fit_numbers(ax)
    return figure


def bands_of(
    runs: Sequence[Run], strain: float | None = None, time: float | None = None
) -> list[BandMeasure]:
    """The band of each run at a strain or time, the last frame by default."""
    return [measure_band(run, strain, time) for run in runs]
