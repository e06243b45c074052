"""Measures of whole results: the band of a frame, the comparison of runs, the facts of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ..read.errors import FieldNotFoundError, PostError, RequestError
from ..read.points import FloatArray, PointSet
from ..read.run import Frame, Run
from ..read.trust import doubts_of, quality_of
from .band import (
    LEVEL,
    BandMeasure,
    BandSystem,
    Line,
    Profile,
    line_across,
    profile_along,
    profile_width,
)
from .band_fit import fitted_width
from .band_search import find_bands, search_scale
from .curves import curve_numbers, modulus_numbers, peak, stress_strain
from .limit_load import limit_loads
from .sampling import interpolate


def frame_profile(frame: Frame, line: Line, field: str = "plastic_strain") -> Profile:
    """Any field with one number a point along a line through the body of a frame."""
    found = frame.scalar(field)
    body = frame.run.body
    return profile_along(
        frame.run.body_points, found.values[body], line, name=field, unit=found.unit
    )


def frame_bands(frame: Frame, axis: str | None = None, level: float = LEVEL) -> BandSystem:
    """The two bands of a frame; `axis` is that of loading, y where the run has no platens."""
    run = frame.run
    return find_bands(
        run.body_points,
        frame["plastic_strain"][run.body],
        axis or run.strain_axis or "y",
        run.horizon,
        level,
        (run.lower, run.upper),
    )


def measure_band(
    run: Run,
    strain: float | None = None,
    time: float | None = None,
    number: int | None = None,
    line: Line | None = None,
    level: float = LEVEL,
    axis: str | None = None,
    normal: bool = False,
    tolerance: float | None = None,
) -> BandMeasure:
    """Width, peak, angle, place of the prevailing band of a frame (the last by default).

    Without `line` the profile runs across the prevailing band at 45 degrees to the loading axis
    (at right angles to the band with `normal`) through a place on its ridge away from the ends and
    from the crossing with the other band (band.py says which).
    """
    frame = run.frame(strain, time, number, tolerance)
    alpha = frame["plastic_strain"][run.body]
    return _measured(frame, run.body_points, alpha, line, level, axis, normal)


def measure_sampled_band(
    frame: Frame, spacing: float, line: Line | None = None, level: float = LEVEL
) -> BandMeasure:
    """The same of the plastic strain read at the points of a lattice with another spacing [m].

    What a measure makes of one and the same field when there are fewer points to read it from.
    """
    points, alpha = sampled_plastic_strain(frame, spacing)
    return _measured(frame, points, alpha, line, level)


def sampled_plastic_strain(frame: Frame, spacing: float) -> tuple[PointSet, FloatArray]:
    """The plastic strain at the points of a lattice that begins in the lower corner of the body.

    Read between the points of the run, as everywhere (sampling.py); points outside are left out.
    """
    run = frame.run
    if not spacing > 0.0:
        raise RequestError(f"the spacing of a lattice must be above 0, not {spacing:g}")
    low, high = np.asarray(run.lower, dtype=float), np.asarray(run.upper, dtype=float)
    x, y = (
        low[k] + spacing * np.arange(int(np.floor((high[k] - low[k]) / spacing + 1e-6)) + 1)
        for k in (0, 1)
    )
    places = np.column_stack([part.ravel() for part in np.meshgrid(x, y)])
    alpha = frame["plastic_strain"][run.body]
    found = interpolate(run.body_points, alpha, places[:, 0], places[:, 1])
    inside = np.isfinite(found)
    return PointSet(places[inside], spacing=spacing), found[inside]


def _measured(
    frame: Frame,
    points: PointSet,
    alpha: FloatArray,
    line: Line | None,
    level: float,
    axis: str | None = None,
    normal: bool = False,
) -> BandMeasure:
    """What is to be measured of the bands in a field of alpha at these points of the body."""
    run = frame.run
    if not 0.0 < level < 1.0:
        raise RequestError(f"the level must lie between 0 and 1, not {level:g}")
    extents = (run.lower, run.upper)
    loading = axis or run.strain_axis or "y"
    bands = find_bands(points, alpha, loading, run.horizon, level, extents)
    near = None
    if line is None:
        line = line_across(bands.prevailing, points, bands.axis, normal, extents)
        near = (bands.prevailing.probe, 1.5 * search_scale(points, run.horizon))
    profile = profile_along(points, alpha, line)
    extent = profile_width(profile, points.spacing, level, near)
    there = [band for band in (bands.prevailing, bands.other) if band is not None]
    return BandMeasure(
        label=run.name,
        frame=frame.number,
        time=frame.time,
        strain=frame.strain,
        profile=profile,
        interpolated=extent,
        bands=bands,
        widths=tuple(fitted_width(points, alpha, b, run.horizon, level) for b in there),
        spacing=points.spacing,
        horizon=run.horizon,
        largest=float(alpha.max()),
    )


def largest_plastic_strain(frame: Frame) -> float:
    """Largest equivalent plastic strain of the body; NaN where the file has none."""
    try:
        values = frame["plastic_strain"][frame.run.body]
    except FieldNotFoundError:
        return float("nan")
    return float(values.max()) if len(values) else float("nan")


def compare_runs(
    runs: Sequence[Run],
    labels: Sequence[str] | None = None,
    strains: Sequence[float] = (),
    tension_positive: bool = False,
) -> list[dict[str, Any]]:
    """One row a run: peak stress, strain there, stress at given strains, largest alpha, E_app."""
    names = labels_for(runs, labels)
    rows = []
    for run, label in zip(runs, names):
        last = run.last_frame
        row: dict[str, Any] = {
            "run": label,
            "points": int(run.body.sum()),
            "spacing": run.spacing,
            "horizon": run.horizon,
            "complete": run.complete,
            "peak_stress": None,
            "strain_at_peak": None,
        }
        if run.platens is not None:
            curve = stress_strain(run, tension_positive)
            row["peak_stress"], row["strain_at_peak"] = peak(curve)
            for s in strains:
                row[f"stress_at_{s:g}"] = curve.at(curve.toward(s))
            row["apparent_modulus"] = modulus_numbers(run)["apparent_modulus"]
        for s in strains:
            try:
                row[f"alpha_at_{s:g}"] = largest_plastic_strain(run.frame(strain=s))
            except RequestError:
                row[f"alpha_at_{s:g}"] = None
        row["last_strain"] = last.strain
        row["largest_plastic_strain"] = largest_plastic_strain(last)
        rows.append(row)
    return rows


def labels_for(runs: Sequence[Run], labels: Sequence[str] | None = None) -> list[str]:
    """Given labels, or the names of the runs made distinct by their folders."""
    if labels:
        if len(labels) != len(runs):
            raise RequestError(f"{len(labels)} labels were given for {len(runs)} results")
        return list(labels)
    names = [run.name for run in runs]
    if len(set(names)) == len(names):
        return names
    names = [f"{run.path.resolve().parent.name}/{run.path.stem}" for run in runs]
    if len(set(names)) == len(names):
        return names
    return [f"{name} ({k + 1})" for k, name in enumerate(names)]


def run_facts(run: Run) -> dict[str, Any]:
    """What a run is and how far it has come."""
    frames = run.frames(include_invalid=True)
    good = [f for f in frames if f.valid]
    body = run.body
    facts: dict[str, Any] = {
        "file": str(run.path),
        "name": run.name,
        "title": run.title,
        "complete": run.complete,
        "points": len(body),
        "body_points": int(body.sum()),
        "fictitious_points": int((~body).sum()),
        "on_lattice": run.body_points.lattice is not None,
        "lower": run.lower,
        "upper": run.upper,
        "spacing": run.spacing,
        "horizon": run.horizon,
        "loading_axis": run.strain_axis,
        "boundaries": run.boundary_names,
        "time_step": run.attributes.get("time_step"),
        "steps": run.attributes.get("steps"),
        "frames_planned": run.attributes.get("n_frames"),
        "frames": [
            {
                "number": f.number,
                "step": f.step,
                "time": f.time,
                "strain": f.strain,
                "valid": f.valid,
                "largest_plastic_strain": largest_plastic_strain(f),
            }
            for f in frames
        ],
        "fields": run.field_names if good else [],
        "stored_fields": {k: asdict(v) for k, v in run.stored_fields.items()} if good else {},
        "provenance": run.provenance,
    }
    safety = run.factor_of_safety
    if safety:
        facts["factor_of_safety"] = {"borne": safety[0], "not_borne": safety[1]}
    facts["doubts"] = [asdict(one) | {"bound": one.bound} for one in doubts_of(run.path)]
    facts["quality"] = quality_of(run.path)
    facts["history"] = _history_facts(run)
    return facts


def _history_facts(run: Run) -> dict[str, Any]:
    try:
        history = run.history()
    except PostError as error:
        return {"missing": str(error)}
    facts: dict[str, Any] = {
        "file": str(history.path),
        "rows": history.rows,
        "columns": {name: history.unit(name) for name in history},
        "descriptions": {name: history.description(name) for name in history},
    }
    if run.platens and history.rows > 1 and "strain" in history and not history["strain"].any():
        facts["curve_missing"] = "the platens have not approached each other"
    elif run.platens is not None:
        try:
            facts.update({k: v for k, v in curve_numbers(run).items() if k not in ("run", "file")})
        except FieldNotFoundError as error:
            facts["curve_missing"] = str(error)
    if "time" in history:
        facts["limit_loads"] = [asdict(one) for one in limit_loads(run)]
    if "energy_error" in history and history.rows:
        facts["largest_energy_error"] = float(np.nanmax(np.abs(history["energy_error"])))
    return facts
