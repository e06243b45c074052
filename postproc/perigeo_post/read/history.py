"""The history of a run: one row a record, columns with units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import FieldNotFoundError, ResultError

FloatArray = npt.NDArray[np.float64]

# First match wins: (pattern, unit, description)
_COLUMNS: list[tuple[str, str, str]] = [
    (r"step$", "1", "number of the time step"),
    (r"time$", "s", "time"),
    (r"strain$", "1", "nominal strain between the platens, compression positive"),
    (r"(?P<b>\w+)_force_(?P<c>[xyz])$", "N/m", "force of boundary '{b}' on the body, along {c}"),
    (r"mean_stress_(?P<c>\w+)$", "Pa", "mean first Piola stress {c} of the body"),
    (r"mean_strain_(?P<c>\w+)$", "1", "mean strain {c} of the body"),
    (r"max_plastic_strain$", "1", "largest equivalent plastic strain in the body"),
    (r"kinetic_energy$", "J/m", "kinetic energy"),
    (r"strain_energy$", "J/m", "stored elastic energy"),
    (r"plastic_dissipation$", "J/m", "plastic work, accumulated"),
    (r"damping_dissipation$", "J/m", "work of the damping, accumulated"),
    (r"stabilisation_energy$", "J/m", "work of the zero-energy control, accumulated"),
    (r"external_work$", "J/m", "work of reactions and loads, accumulated"),
    (r"energy_error$", "1", "relative error of the energy balance"),
    # columns that may come later
    (r".*displacement_\w$|.*position_\w$", "m", ""),
    (r".*velocity_\w$", "m/s", ""),
    (r".*stress.*|.*pressure$|.*traction.*", "Pa", ""),
    (r".*strain.*", "1", ""),
    (r".*force.*", "N/m", ""),
    (r".*energy$|.*dissipation$|.*work$", "J/m", ""),
]


def column_meaning(name: str) -> tuple[str, str]:
    """Unit and description of a history column (empty where the name is not known)."""
    for pattern, unit, text in _COLUMNS:
        match = re.match(pattern, name)
        if match:
            return unit, text.format(**match.groupdict())
    return "", ""


class History(Mapping[str, FloatArray]):
    """Columns of a history file by name: ``history["time"]`` is an array of all its rows."""

    def __init__(self, columns: dict[str, FloatArray], path: Path | None = None) -> None:
        self._columns = columns
        self.path = path

    def __getitem__(self, name: str) -> FloatArray:
        try:
            return self._columns[name]
        except KeyError:
            raise FieldNotFoundError(
                f"the history has no column '{name}'; it has: {', '.join(self._columns)}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """Number of complete rows."""
        return len(next(iter(self._columns.values()))) if self._columns else 0

    def unit(self, name: str) -> str:
        """Unit of a column ("1" for a pure number)."""
        self[name]
        return column_meaning(name)[0]

    def description(self, name: str) -> str:
        """What a column means, in a few words."""
        self[name]
        return column_meaning(name)[1]

    def __repr__(self) -> str:
        return f"History({self.rows} rows: {', '.join(self._columns)})"


def read_history(path: str | Path) -> History:
    """Read a history file.

    A last line without its line end is one that is still being written (or was cut off): it is
    left out, even where it looks whole, because its last number may have lost digits.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ResultError(f"cannot read the history {path}: {error.strerror}") from error
    lines = text.split("\n")[:-1]
    if not lines:
        raise ResultError(f"the history {path} is empty (no complete line)")
    names = [name.strip() for name in lines[0].split(",")]
    if len(set(names)) != len(names) or not all(names):
        raise ResultError(f"the header of the history {path} is damaged: {lines[0][:80]!r}")
    rows: list[list[float]] = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        row = _numbers(line, len(names))
        if row is None:
            if number == len(lines):
                break
            raise ResultError(f"the history {path} is damaged at line {number}: {line[:60]!r}")
        rows.append(row)
    table: npt.NDArray[Any] = np.array(rows, dtype=float).reshape(len(rows), len(names))
    return History({name: table[:, k].copy() for k, name in enumerate(names)}, path)


def _numbers(line: str, count: int) -> list[float] | None:
    cells = line.split(",")
    if len(cells) != count:
        return None
    try:
        return [float(cell.replace("D", "E").replace("d", "e")) for cell in cells]
    except ValueError:
        return None
