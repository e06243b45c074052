"""Numbers to files: CSV with units in the header, JSON without NaN."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..read.errors import OutputError
from ..read.outputs import TABLE, check_output
from ..read.run import Frame
from .band import BandMeasure, Profile
from .curves import Curve

TABLE_UNITS = {
    "angle": "degrees", "x0": "m", "y0": "m", "x1": "m", "y1": "m", "length": "m",
    "ridge_x": "m", "ridge_y": "m", "width_interpolated": "m", "width_spread": "m", "strength": "1",
    "ridge_max": "1", "strain": "1", "time": "s", "width": "m",
    "peak_stress": "Pa", "strain_at_peak": "1", "largest_plastic_strain": "1",
    "apparent_modulus": "Pa",
}  # fmt: skip


def plain(value: Any) -> Any:
    """The same value in JSON's own types; NaN and infinity become null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def to_json(value: Any, only_ascii: bool = False) -> str:
    """JSON text of numbers and tables."""
    return json.dumps(plain(value), indent=2, ensure_ascii=only_ascii, allow_nan=False)


def write_rows(
    path: str | Path, rows: Sequence[Mapping[str, Any]], units: Mapping[str, str] | None = None
) -> Path:
    """A table with one dictionary a row; names in the header carry their unit in brackets."""
    path = check_output(path, TABLE)
    units = TABLE_UNITS if units is None else units
    names = list(dict.fromkeys(name for row in rows for name in row))
    header = [f"{name} [{units[name]}]" if units.get(name) else name for name in names]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            for row in rows:
                writer.writerow([_cell(row.get(name)) for name in names])
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
    return path


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, (float, np.floating)):
        return f"{float(value):.12g}"
    return str(value)


def write_curves(path: str | Path, curves: Sequence[Curve]) -> Path:
    """All points of all curves: label, quantity, x, y, one row a point."""
    pairs = {(c.x_name, c.x_unit, c.y_name, c.y_unit) for c in curves}
    if len(pairs) == 1:
        x_name, x_unit, y_name, y_unit = pairs.pop()
        rows = [{"run": c.label, x_name: x, y_name: y} for c in curves for x, y in zip(c.x, c.y)]
        return write_rows(path, rows, {x_name: x_unit, y_name: y_unit})
    rows = [
        {"curve": c.label, "x_name": c.x_name, "x_unit": c.x_unit, "x": x, "y_name": c.y_name,
         "y_unit": c.y_unit, "y": y}
        for c in curves
        for x, y in zip(c.x, c.y)
    ]  # fmt: skip
    return write_rows(path, rows, {})


def write_profiles(path: str | Path, profiles: Sequence[tuple[str, Profile]]) -> Path:
    """Points of profiles: run, distance along the line, place, value."""
    rows = [
        {"run": label, "distance": s, "x": x, "y": y, p.name: value}
        for label, p in profiles
        for s, x, y, value in zip(p.distance, p.x, p.y, p.values)
    ]
    units = {"distance": "m", "x": "m", "y": "m"}
    units.update({p.name: p.unit for _, p in profiles})
    return write_rows(path, rows, units)


def write_bands(path: str | Path, measures: Sequence[BandMeasure]) -> Path:
    """Table of the bands of some frames, one row a band."""
    rows = [
        {"run": m.label, "strain": m.strain, "time": m.time, "ratio": m.bands.ratio, **row}
        for m in measures
        for row in m.table()
    ]
    return write_rows(path, rows)


def write_points(path: str | Path, frames: Sequence[Frame], name: str) -> Path:
    """Values of a field at all points of some frames."""
    rows = []
    unit = ""
    for frame in frames:
        field = frame.scalar(name)
        unit = field.unit
        rows += [
            {"run": frame.run.name, "strain": frame.strain, "time": frame.time, "x": x, "y": y,
             "boundary": int(b), name: value}
            for (x, y), b, value in zip(frame.run.positions, frame.run.boundary, field.values)
        ]  # fmt: skip
    return write_rows(path, rows, {"strain": "1", "time": "s", "x": "m", "y": "m", name: unit})


def write_frame(path: str | Path, frame: Frame, names: Sequence[str]) -> Path:
    """All points of a frame with these fields, components of their own columns; one row a point."""
    run = frame.run
    columns: dict[str, Any] = {"x": run.positions[:, 0], "y": run.positions[:, 1]}
    columns.update(volume=run.volumes, boundary=run.boundary.tolist())
    units = {"x": "m", "y": "m", "volume": "m^2"}
    for name in names:
        field = frame.field(name)
        parts = [field.component(c) for c in field.components] or [field]
        columns.update({part.name: part.values for part in parts})
        units.update({part.name: part.unit for part in parts})
    rows = [dict(zip(columns, values)) for values in zip(*columns.values())]
    return write_rows(path, rows, units)
