"""The history of a run: one row per record, columns with units.

Results of schema 2 hold it in their group /history, with unit and description of each column. The
CSV beside them has the same numbers. The program fills the group in bunches, so while a run goes
on, or after it was killed, the CSV may have rows that the group has not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import FieldNotFoundError, ResultError
from .file import numbers_in, plain, read, text_attribute
from .first_schema import column_meaning

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """What a column of the history means."""

    unit: str  # "1" for a pure number, empty where the file does not say
    description: str


class History(Mapping[str, FloatArray]):
    """Columns of a history by name: ``history["time"]`` is an array of all its rows."""

    def __init__(
        self,
        columns: dict[str, FloatArray],
        path: Path | None = None,
        meanings: Mapping[str, Column] | None = None,
    ) -> None:
        self._columns = columns
        self._meanings = meanings or {}
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
        """Unit of a column ("1" for a pure number, empty where the file does not say)."""
        return self._meaning(name).unit

    def description(self, name: str) -> str:
        """What a column means, in a few words."""
        return self._meaning(name).description

    def _meaning(self, name: str) -> Column:
        self[name]  # the error for a column that is not there
        return self._meanings.get(name, Column("", ""))

    def with_meanings_of(self, other: History) -> History:
        """These rows, with the units and descriptions of another history."""
        return History(self._columns, self.path, other._meanings)

    def __repr__(self) -> str:
        names = list(self._columns)
        shown = names if len(names) <= 6 else [*names[:5], f"... {len(names) - 5} more"]
        return f"History({self.rows} rows: {', '.join(shown)})"


def read_history(path: str | Path) -> History:
    """Read a history file in CSV form. Units are known for the columns of schema 1.

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
    columns = {name: table[:, k].copy() for k, name in enumerate(names)}
    return History(columns, path, {name: Column(*column_meaning(name)) for name in names})


def _numbers(line: str, count: int) -> list[float] | None:
    cells = line.split(",")
    if len(cells) != count:
        return None
    try:
        return [float(cell.replace("D", "E").replace("d", "e")) for cell in cells]
    except ValueError:
        return None


@dataclass(frozen=True)
class StoredHistory:
    """The history as a result file holds it."""

    history: History
    places: int  # rows that have a place in the file; those behind the written ones hold nothing

    @property
    def waits(self) -> bool:
        """Whether rows are still missing: the run goes on, or it was killed, or it failed."""
        return self.history.rows < self.places


def stored_history(path: Path) -> StoredHistory | None:
    """The group /history of a result; None where it has none (schema 1)."""

    def find(file: Any) -> StoredHistory | None:
        if "history" not in file:
            return None
        group = file["history"]
        about = {key: plain(group.attrs[key]) for key in ("written", "rows", "columns")}
        written = int(about["written"])
        columns: dict[str, FloatArray] = {}
        meanings: dict[str, Column] = {}
        for name in str(about["columns"]).split():
            data = group[name]
            values = numbers_in(file, f"history/{name}", (None,))
            if not 0 <= written <= len(values):
                raise ValueError(f"/history/{name} has {len(values)} of {written} rows")
            columns[name] = values[:written].astype(float)
            meanings[name] = Column(
                text_attribute(data, "unit"), text_attribute(data, "description")
            )
        return StoredHistory(History(columns, path, meanings), int(about["rows"]))

    return read(path, find)


def with_later_rows(stored: StoredHistory, csv: Path) -> History:
    """The history of the file, with the rows that only the CSV has so far.

    They are taken where the CSV is that of the same run: the same columns, no more rows than the
    file has places, and in the rows that both have the same numbers to the last bit. Otherwise (a
    CSV left from another run, or a damaged one) the file alone counts.
    """
    history = stored.history
    try:
        longer = read_history(csv)
    except ResultError:
        return history
    written = history.rows
    if list(longer) != list(history) or not written < longer.rows <= stored.places:
        return history
    if not all(np.array_equal(longer[c][:written], history[c], equal_nan=True) for c in history):
        return history
    return longer.with_meanings_of(history)
