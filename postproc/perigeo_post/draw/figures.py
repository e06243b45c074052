"""Figures of curves, bands and comparisons. All return a matplotlib Figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..measure.band import BandMeasure
from ..measure.curves import Curve, energy_curves, history_curve, peak, stress_strain
from ..measure.measures import labels_for, measure_band
from ..measure.smooth import smoothed_for
from ..read.errors import RequestError
from ..read.fields import label_of
from ..read.run import Frame, Run
from .contours import (
    add_colour_bar,
    common_extent,
    common_scale,
    deformation_note,
    draw_panel,
    fill_axes,
    panel_of,
)
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

_WORDS = {"strain": "Nominal strain", "axial_stress": "Axial stress", "time": "Time"}


def _words(name: str) -> str:
    words = name.replace("_", " ")
    return _WORDS.get(name, words[:1].upper() + words[1:])


def draw_curves(
    ax: Axes, curves: Sequence[Curve], y_label: str | None = None, legend: bool = True
) -> None:
    """Curves into given axes, with units, prefixes and a sign convention on the axes."""
    if not curves:
        raise RequestError("no curve to draw")
    first = curves[0]
    sizes = [float(np.nanmax(np.abs(c.y))) for c in curves if np.isfinite(c.y).any()]
    factor, unit = prefix_for(max(sizes, default=0.0), first.y_unit)
    percent = first.x_name == "strain"
    for k, curve in enumerate(curves):
        ax.plot(
            curve.x * (100.0 if percent else 1.0), curve.y * factor, label=readable(curve.label),
            color=COLOURS[k % len(COLOURS)], linestyle=DASHES[k % len(DASHES)],
        )  # fmt: skip
    signed = first.y_name == "axial_stress"
    sense = "tension" if first.tension_positive else "compression"
    note = f", {sense} positive" if signed else ""
    strain_note = note if signed else ", compression positive"
    ax.set_xlabel(
        with_unit(_words(first.x_name) + (strain_note if percent else ""),
                  "%" if percent else first.x_unit)
    )  # fmt: skip
    ax.set_ylabel(with_unit((y_label or _words(first.y_name)) + note, unit))
    ax.grid(True, linewidth=0.3, color="0.85")
    ax.set_axisbelow(True)
    if legend:
        ax.legend(ncols=2 if len(curves) > 8 else 1)


def curve_figure(
    curves: Sequence[Curve],
    y_label: str | None = None,
    marks: Sequence[float] = (),
    column: str = "single",
) -> Figure:
    """Curves of one kind in one figure; `marks` puts symbols on the first at these strains."""
    with style():
        wide = SINGLE if column == "single" else DOUBLE
        figure = new_figure(wide, 66.0 if column == "single" else 90.0)
        ax = figure.subplots()
        draw_curves(ax, curves, y_label, legend=len(curves) > 1)
        _mark(ax, curves[0], marks)
    return figure


def _mark(ax: Axes, curve: Curve, marks: Sequence[float]) -> None:
    factor, _ = prefix_for(
        float(np.nanmax(np.abs(curve.y))) if np.isfinite(curve.y).any() else 0.0, curve.y_unit
    )
    for strain in marks:
        x = curve.toward(strain)
        y = curve.at(x) * factor
        ax.plot([100.0 * x], [y], "o", color="black", zorder=5)
        ax.annotate(
            f"{100.0 * strain:g} %", (100.0 * x, y), xytext=(0, 5),
            textcoords="offset points", fontsize=7, ha="center",
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
                    f"peak {stress * factor:.1f} {unit} at {100.0 * strain:.3f} %",
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
    ax.plot(profile.distance, profile.values, color=COLOURS[0])
    target = width.level * width.peak
    ax.axhline(target, color="0.5", linewidth=0.6, linestyle=":")
    ax.plot([width.left, width.right], [target, target], color=COLOURS[1], marker="|", ms=7)
    ax.plot([width.peak_distance], [width.peak], "o", color=COLOURS[1], ms=3)
    sign = "" if width.closed else "≥ "
    text = (
        f"width at {100.0 * width.level:g} % of the peak\n"
        f"between points {sign}{width.width:.3f} m ± {width.uncertainty:.2g} m\n"
        f"fitted along the band {measure.width:.3f} m\n"
        f"peak {width.peak:.3g}"
    )
    right = width.peak_distance < 0.5 * profile.distance[-1]
    ax.annotate(
        text, (0.97 if right else 0.03, 0.96), xycoords="axes fraction",
        ha="right" if right else "left", va="top", fontsize=7,
    )  # fmt: skip
    (x0, y0), (x1, y1) = profile.line
    ax.set_xlabel(
        "Distance along the line [m]\n"
        f"from ({x0 + 0.0:.3f}, {y0 + 0.0:.3f}) m\nto ({x1 + 0.0:.3f}, {y1 + 0.0:.3f}) m"
    )
    ax.set_ylabel(with_unit(label_of(profile.name), profile.unit))
    ax.set_xlim(0.0, float(profile.distance[-1]))
    highest = np.nanmax(profile.values)
    ax.set_ylim(0.0, 1.3 * highest if highest > 0.0 else None)  # room for the text above the peak


def band_figure(run: Run, measure: BandMeasure) -> Figure:
    """Where the bands lie (left) and the profile across the prevailing one (right)."""
    frame = run.frame(number=measure.frame)
    panel = panel_of(frame)
    scale = common_scale([panel.values], frame.scalar("plastic_strain").unit)
    x0, y0, x1, y1 = common_extent([panel])
    aspect = float((y1 - y0) / (x1 - x0))
    tall = min(95.0, 70.0 * aspect)
    with style():
        figure = new_figure(DOUBLE, tall + 18.0)
        left_width = tall / aspect + 45.0
        parts: Any = figure.subfigures(1, 2, width_ratios=[left_width, DOUBLE - left_width])
        left, right = parts[0].subplots(), parts[1].subplots()
        drawn = draw_panel(left, panel, scale)
        add_colour_bar(parts[0], drawn, [left], "plastic_strain", scale)
        _draw_bands(left, measure)
        left.set_xlim(x0, x1)
        left.set_ylim(y0, y1)
        left.set_xlabel("x [m]")
        left.set_ylabel("y [m]")
        left.locator_params(axis="x", nbins=4)
        left.set_title(panel.title)
        draw_profile(right, measure)
        strong = measure.bands.prevailing
        right.set_title(
            f"Prevailing band\n{strong.angle:.1f}° ± {strong.angle_uncertainty:.1f}° to the "
            f"loading axis\nweaker over stronger band {measure.bands.ratio:.2f}"
        )
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
    with style():
        figure = new_figure(SINGLE, 66.0)
        ax = figure.subplots()
        for k, (m, name) in enumerate(zip(measures, names)):
            ax.plot(
                m.profile.distance - m.interpolated.peak_distance, m.profile.values,
                color=COLOURS[k % len(COLOURS)], linestyle=DASHES[k % len(DASHES)],
                label=readable(f"{name}: {m.interpolated.width:.3f} m"),
            )  # fmt: skip
        ax.set_xlabel("Distance from the peak along the line [m]")
        ax.set_ylabel(with_unit(label_of(first.name), first.unit))
        ax.set_ylim(bottom=0.0)
        level = 100.0 * measures[0].interpolated.level
        ax.legend(title=f"width between points at {level:g} % of the peak",
                  title_fontsize=7)  # fmt: skip
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
    panels = [panel_of(f, field, deformed, False, t) for f, t in zip(frames, titles)]
    scale = common_scale([p.values for p in panels], frames[0].scalar(field).unit, low, high)
    curves = [
        stress_strain(r, tension_positive, label=n)
        for r, n in zip(runs, names)
        if r.platens is not None and r.has_history
    ]
    x0, y0, x1, y1 = common_extent(panels)
    aspect = float((y1 - y0) / (x1 - x0))
    columns = min(len(panels), 6)
    rows = -(-len(panels) // columns)
    size = min((DOUBLE - 34.0) / columns - 3.0, 80.0 / aspect if rows == 1 else 60.0 / aspect)
    top = rows * (size * aspect + 15.0) + 14.0
    low_part = 66.0 if curves else 0.0
    with style():
        figure = new_figure(DOUBLE, top + low_part)
        parts: Any = [figure]
        if curves:
            parts = figure.subfigures(2, 1, height_ratios=[top, low_part])
        axes = list(parts[0].subplots(rows, columns, squeeze=False).flat)
        for ax in axes[len(panels) :]:
            ax.set_visible(False)
        drawn = fill_axes(panels, axes, scale, columns)
        add_colour_bar(parts[0], drawn, axes[: len(panels)], field, scale)
        note = deformation_note(deformed, frames)
        if note:
            parts[0].suptitle(note)
        if curves:
            draw_curves(parts[1].subplots(), curves)
    return figure


def bands_of(
    runs: Sequence[Run], strain: float | None = None, time: float | None = None
) -> list[BandMeasure]:
    """The band of each run at a strain or time, the last frame by default."""
    return [measure_band(run, strain, time) for run in runs]
