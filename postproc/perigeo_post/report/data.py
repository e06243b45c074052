"""What a report is made of: the studies below a folder of results, read and checked."""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter

from ..read.errors import ResultError
from ..study.record import (
    DONE,
    FAILED,
    MISSING,
    VERDICTS,
    FigureRecord,
    Needed,
    RunRecord,
    Text,
    read_json,
    read_record,
)
from ..study.record import FindingRecord as Finding
from ..study.record import StudyRecord as Study

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# What the pages need of a study stands in its record.
__all__ = [
    "DONE", "FAILED", "MISSING", "VERDICTS",
    "CheckRow", "FigureRecord", "Finding", "Material", "RunRecord", "Study", "gather",
    "known_studies", "rank", "read_checks", "read_table",
]  # fmt: skip

# The order of the paper; other studies follow by name.
ORDER = (
    "fig3a", "fig3b", "fig4", "fig5", "seeds", "horizon", "loading", "size", "softening",
    "influence", "heterogeneity", "zero_energy", "equilibrium", "footing",
)  # fmt: skip


class CheckRow(BaseModel):
    """A row of the comparison with closed forms; the error is relative."""

    model_config = ConfigDict(strict=True)

    case: Text = ""
    quantity: Needed
    unit: Text = ""
    exact: float
    computed: float
    error: float
    tolerance: float
    scale: float = 0.0  # what error and tolerance refer to; 0: the exact value
    source: Text = ""
    passed: bool = False

    @property
    def allowed(self) -> float:
        """The tolerance in the unit of the quantity."""
        return self.tolerance * abs(self.scale or self.exact)


@dataclass(frozen=True)
class Material:
    """Everything that a report is made of."""

    studies: Sequence[Study] = ()
    known: Sequence[tuple[str, str]] = ()  # names of the studies and their files
    checks: Sequence[CheckRow] = ()
    checks_from: str = ""  # with which program, where and when
    problems: Sequence[str] = ()  # what could not be read

    @property
    def missing(self) -> list[tuple[str, str]]:
        """The studies that have no result: names and files."""
        there = {study.name for study in self.studies}
        return [item for item in self.known if item[0] not in there]


# ---- what lies in the folders --------------------------------------------------------------------


def read_checks(folder: Path) -> tuple[list[CheckRow], str]:
    """The rows of verify.json and the line above the table of verify.md; empty without them."""
    if not (folder / "verify.json").exists():
        return [], ""
    rows = read_json(folder / "verify.json", TypeAdapter(list[CheckRow]))
    try:
        lines = (folder / "verify.md").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    head = lines[0].replace("`", "").strip().rstrip(":") if lines else ""
    return rows, head


def known_studies(folder: Path | None) -> list[tuple[str, str]]:
    """Names and paths of the study files in a folder; unreadable ones count by their file name."""
    found = []
    for path in sorted(folder.glob("*.toml")) if folder is not None else []:
        try:
            name = tomllib.loads(path.read_text(encoding="utf-8")).get("name")
        except (OSError, ValueError):
            name = None
        found.append((name if isinstance(name, str) and name else path.stem, path.as_posix()))
    return sorted(found, key=lambda item: rank(item[0]))


def rank(name: str) -> tuple[int, str]:
    """Sorts studies: as in the paper, then by name."""
    return (ORDER.index(name) if name in ORDER else len(ORDER), name)


def gather(results: Path, studies: Path | None = None) -> Material:
    """Everything in a folder of results, and which of the studies are not among it."""
    found: list[Study] = []
    problems: list[str] = []
    for path in sorted(results.glob("*/study.json")):
        try:
            found.append(read_record(path.parent))
        except ResultError as error:
            problems += str(error).splitlines()
    checks: list[CheckRow] = []
    checks_from = ""
    try:
        checks, checks_from = read_checks(results / "verify")
    except ResultError as error:
        problems += str(error).splitlines()
    return Material(
        studies=sorted(found, key=lambda study: rank(study.name)),
        known=known_studies(studies),
        checks=checks,
        checks_from=checks_from,
        problems=problems,
    )


def read_table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Head and rows of a CSV file."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            lines = [line for line in csv.reader(file) if line and not line[0].startswith("#")]
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path}: is not a table in CSV: {error}") from error
    if not lines:
        raise ResultError(f"{path}: the table is empty")
    return lines[0], lines[1:]
