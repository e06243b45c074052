"""Result files made up for the tests, after the schema of the program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

UNITS = {
    "displacement": ("m", "displacement", "x y"),
    "velocity": ("m/s", "velocity", "x y"),
    "stress": ("Pa", "Cauchy stress, tension positive", "xx yy zz xy"),
    "strain": ("1", "Green-Lagrange strain", "xx yy zz xy"),
    "plastic_strain": ("1", "equivalent plastic strain", ""),
    "von_mises": ("Pa", "von Mises stress", ""),
    "zero_energy": ("1", "zero-energy measure", ""),
}
NAMELIST = "&run\n  title = 'made up'\n/\n&material\n  poissons_ratio = 0.3\n/\n"
HEADER = (
    "step,time,strain,bottom_force_x,bottom_force_y,top_force_x,top_force_y,mean_stress_xx,"
    "mean_stress_yy,mean_strain_yy,max_plastic_strain,kinetic_energy,strain_energy,"
    "plastic_dissipation,damping_dissipation,stabilisation_energy,external_work,energy_error"
)


def lattice(
    dx: float = 0.04, width: float = 1.0, height: float = 2.0, layers: int = 2
) -> tuple[np.ndarray, np.ndarray]:
    """Points of a specimen with fictitious layers below (1) and above (2); boundary index."""
    x = np.arange(round(width / dx) + 1) * dx
    y = np.arange(-layers, round(height / dx) + 1 + layers) * dx
    grid = np.array([(a, b) for b in y for a in x])
    boundary = np.where(grid[:, 1] < -dx / 2, 1, np.where(grid[:, 1] > height + dx / 2, 2, 0))
    return grid, boundary


def cloud(count: int = 900, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Points of a jittered cloud in 1 m x 2 m."""
    random = np.random.default_rng(seed)
    nx = round(np.sqrt(count / 2))
    ny = 2 * nx
    h = 1.0 / nx
    x, y = np.meshgrid((np.arange(nx) + 0.5) * h, (np.arange(ny) + 0.5) * h)
    points = np.c_[x.ravel(), y.ravel()] + random.uniform(-0.2, 0.2, (nx * ny, 2)) * h
    return points, np.zeros(nx * ny, dtype=int)


def gaussian_band(
    points: np.ndarray,
    through: tuple[float, float],
    angle: float,
    rising: bool,
    sigma: float,
    peak: float,
) -> np.ndarray:
    """peak exp(-q^2 / (2 sigma^2)), q the distance from a line at `angle` degrees from y."""
    a = np.radians(angle)
    normal = np.array([np.cos(a), -np.sin(a) if rising else np.sin(a)])
    q = (points - np.array(through)) @ normal
    return peak * np.exp(-(q**2) / (2.0 * sigma**2))


def fields_of(points: np.ndarray, alpha: np.ndarray, strain: float) -> dict[str, np.ndarray]:
    """Fields with all tensor components different, so that a mix-up shows."""
    n = len(points)
    one = np.ones(n)
    stress = np.c_[-1e3 * one, -170e3 * one, -50e3 * one, 20e3 * (points[:, 0] - 0.5)]
    return {
        "displacement": np.c_[0.3 * strain * points[:, 0], -strain * points[:, 1]],
        "velocity": np.c_[0.001 * points[:, 0], -0.01 * points[:, 1]],
        "stress": stress,
        "strain": np.c_[0.3 * strain * one, -strain * one, 0.01 * one, 0.002 * one],
        "plastic_strain": alpha,
        "von_mises": 1e5 * one,
        "zero_energy": 1e-3 * one,
    }


def write_result(
    path: Path,
    points: np.ndarray,
    boundary: np.ndarray,
    states: list[tuple[float, dict[str, np.ndarray]]],
    spacing: float = 0.04,
    horizon: float = 0.12,
    planned: int | None = None,
    failed: dict[str, np.ndarray] | None = None,
    platens: bool = True,
    version: int = 1,
    schema: str = "perigeo result",
    complete: int = 1,
    extents: tuple[Any, Any] = ((0.0, 0.0), (1.0, 2.0)),
    axis: str = "y",
    name: str | None = None,
    volume: float | None = None,
) -> Path:
    """Write a result; `states` are (strain, fields); `planned` frames are made, the rest empty."""
    n = len(points)
    with h5py.File(path, "w") as file:
        for key, value in {
            "schema": schema, "code_version": "0.1.0", "git_hash": "abc", "compiler": "made up",
            "flags": "-O3", "command_line": "perigeo run.nml", "host": "nowhere",
            "created": "2025-01-01T00:00:00Z", "title": "Made up", "name": name or path.stem,
            "strain_axis": axis if platens else "none",
        }.items():  # fmt: skip
            file.attrs[key] = np.bytes_(value.ljust(40))
        file.attrs["schema_version"] = np.int32(version)
        file.attrs["threads"] = np.int32(2)
        file.attrs["complete"] = np.int32(complete)
        file.attrs["spacing"], file.attrs["horizon"] = spacing, horizon
        file.attrs["lower"], file.attrs["upper"] = extents
        file.attrs["time_step"], file.attrs["steps"] = 1e-4, np.int32(1000)
        file.attrs["n_frames"] = np.int32(planned or len(states))
        file["input/namelist"] = np.bytes_(NAMELIST)
        file["input/values"] = np.array(
            [
                b"run.title = 'made up'",
                b"material.poissons_ratio = 0.3",
                b"material.youngs_modulus = 5.0e7",
                b"material.density = 2000.0",
                b"integration.damping_frame = platens",
                b"boundary(bottom).contact = rough",
                b"boundary(top).contact = smooth",
            ]
        )
        _dataset(file, "points/position", points, "m", "reference position", "x y")
        _dataset(file, "points/volume", np.full(n, volume or spacing**2), "m^2", "volume", "")
        _dataset(file, "points/boundary", boundary.astype(np.int32), "1", "boundary", "")
        if platens:
            file["points/boundary_names"] = np.array([b"bottom  ", b"top     "])
        for k in range(planned or len(states)):
            strain, fields = states[k] if k < len(states) else (float("nan"), None)
            _frame(file, f"frames/{k:06d}", strain, fields, n, 1, platens)
        _frame(file, "failed_frame", 0.02, failed, n, 0, platens)
    return path


def _dataset(file: Any, key: str, data: np.ndarray, unit: str, text: str, parts: str) -> None:
    file[key] = data
    file[key].attrs["unit"] = np.bytes_(unit)
    file[key].attrs["description"] = np.bytes_(text)
    if parts:
        file[key].attrs["components"] = np.bytes_(parts)


def _frame(
    file: Any,
    key: str,
    strain: float,
    fields: dict[str, np.ndarray] | None,
    n: int,
    valid: int,
    platens: bool,
) -> None:
    group = file.create_group(key)
    group.attrs["step"] = np.int32(0 if fields is None else round(1e5 * abs(strain)))
    group.attrs["time"] = 0.0 if fields is None else 200.0 * abs(strain)
    group.attrs["strain"] = strain if platens else float("nan")
    group.attrs["valid"] = np.int32(valid)
    group.attrs["written"] = np.int32(fields is not None)
    for name, (unit, text, parts) in UNITS.items():
        shape = (n, len(parts.split())) if parts else (n,)
        data = np.zeros(shape) if fields is None else fields[name]
        _dataset(file, f"{key}/{name}", data, unit, text, parts)


def add_yield_stress(path: Path) -> np.ndarray:
    """Give the points of a result a yield stress, every one another."""
    with h5py.File(path, "a") as file:
        values = 1e5 + np.arange(len(file["points/volume"]), dtype=float)
        _dataset(file, "points/yield_stress", values, "Pa", "initial yield stress", "")
    return values


def add_field(path: Path, name: str, unit: str, text: str, parts: str) -> np.ndarray:
    """Give every frame a field of its own, as a law does; all its numbers differ."""
    with h5py.File(path, "a") as file:
        n = len(file["points/volume"])
        count = len(parts.split())
        values = np.arange(n * max(count, 1), dtype=float)
        values = values.reshape(n, count) if count else values
        for frame in file["frames"]:
            _dataset(file, f"frames/{frame}/{name}", values, unit, text, parts)
    return values


def to_second_schema(
    path: Path,
    written: int | None = None,
    places: int | None = None,
    extra: dict[str, tuple[str, str, np.ndarray | None]] | None = None,
) -> int:
    """Put the history of the CSV beside a result into its /history; returns the rows written.

    `written`: rows that the file has, all by default; `places`: rows with a place in the file.
    `extra`: further columns (unit, description, values) of file and CSV.
    """
    csv = path.with_name(f"{path.stem}_history.csv")
    lines = [line.split(",") for line in csv.read_text().splitlines()]
    columns = {name: np.array([float(r[k]) for r in lines[1:]]) for k, name in enumerate(lines[0])}
    rows = len(lines) - 1
    meanings = {name: ("parsec", f"sentence of {name}") for name in columns}
    meanings.update(step=("1", "step"), time=("s", "time"), strain=("1", "nominal strain"))
    meanings.update({n: ("N/m", f"force {n}") for n in columns if "_force_" in n})
    for name, (unit, text, values) in (extra or {}).items():
        meanings[name] = (unit, text)
        columns[name] = np.arange(rows) / 7.0 if values is None else values
    table = zip(*columns.values())
    text_lines = [",".join(columns), *(",".join(f"{v:.17g}" for v in row) for row in table)]
    csv.write_text("\n".join(text_lines) + "\n")
    written = rows if written is None else written
    with h5py.File(path, "a") as file:
        file.attrs["schema_version"] = np.int32(2)
        group = file.create_group("history")
        group.attrs["written"] = np.int32(written)
        group.attrs["rows"] = np.int32(places or rows)
        group.attrs["columns"] = np.bytes_(" ".join(columns))
        for name, values in columns.items():
            data = np.zeros(places or rows, dtype=np.int32 if name == "step" else float)
            data[:written] = values[:written]
            _dataset(file, f"history/{name}", data, *meanings[name], "")
    return written


def write_columns(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """A history with these columns."""
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns), *(",".join(f"{v:.12g}" for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_history(path: Path, modulus: float = 50e6, nu: float = 0.3, rows: int = 400) -> Path:
    """Linear up to 0.34 % strain, then softening; modulus and peak known."""
    strain = np.linspace(0.0, 0.016, rows)
    slope = modulus / (1.0 - nu**2)
    top = slope * 0.0034
    softened = np.maximum(top - 2e7 * (strain - 0.0034), 3e4)
    stress = np.where(strain <= 0.0034, slope * strain, softened)
    lines = [HEADER]
    for k, (e, s) in enumerate(zip(strain, stress)):
        row = [k, 200.0 * e, e, 12.0, s, 0.0, -1.01 * s, -1e3, -s, -e, 10.0 * max(e - 0.0034, 0.0),
               0.1, 100.0 * e, 500.0 * e, 5.0 * e, 0.0, 605.0 * e, 1e-5]  # fmt: skip
        lines.append(",".join(f"{v:.12g}" for v in row))
    path.write_text("\n".join(lines) + "\n")
    return path
