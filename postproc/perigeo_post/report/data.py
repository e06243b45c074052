"""What a report is made of: the studies below a folder of results, read and checked."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..read.errors import ResultError
from ..study.types import Value

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SCHEMA = "perigeo study"
SCHEMA_VERSION = 1

AGREES, IN_PART, DIFFERS, NO_RESULT = "agrees", "agrees in part", "differs", "no result"
VERDICTS = (AGREES, IN_PART, DIFFERS, NO_RESULT)
DONE, FAILED, MISSING = "done", "failed", "missing"
STATES = (DONE, FAILED, MISSING)

# The order of the paper; other studies follow by name.
ORDER = (
    "fig3a", "fig3b", "fig4", "fig5", "horizon", "loading", "size", "softening", "influence",
    "heterogeneity",
)  # fmt: skip


@dataclass(frozen=True)
class RunRecord:
    """One run of a study, as study.json has it."""

    id: str
    label: str
    series: str
    status: str  # one of STATES
    parameters: Mapping[str, Value] = field(default_factory=dict)
    row: Mapping[str, Value] = field(default_factory=dict)  # what was measured, SI units
    exit_status: int | None = None
    message: str = ""
    input: str = ""
    program_version: str = ""
    input_sha256: str = ""
    seconds: float | None = None
    threads: int | None = None
    points: int | None = None
    steps: int | None = None


@dataclass(frozen=True)
class FigureRecord:
    """One figure: its files, relative to the study, and its texts."""

    name: str
    png: str
    alt: str
    csv: str = ""
    title: str = ""
    caption: str = ""


@dataclass(frozen=True)
class Finding:
    """One line of the table 'the paper says, we find, verdict'."""

    title: str
    paper: str
    found: str
    verdict: str  # one of VERDICTS
    note: str = ""
    holds: Sequence[tuple[str, bool | None]] = ()  # criterion, whether it holds; None: no data


@dataclass(frozen=True)
class Study:
    """A study that has been computed, in whole or in part."""

    folder: Path
    name: str
    title: str
    question: str
    file: str
    base: str
    created: str
    program_version: str
    machine: Mapping[str, Value]
    complete: bool
    seconds: float | None
    series: Sequence[tuple[str, str]]  # name, title
    runs: Sequence[RunRecord]
    units: Mapping[str, str]
    descriptions: Mapping[str, str]
    figures: Sequence[FigureRecord]
    findings: Sequence[Finding]
    csv: str
    problems: Sequence[str] = ()  # what could not be measured or drawn

    def runs_of(self, series: str) -> list[RunRecord]:
        """The runs of one series, in the order of the file."""
        return [run for run in self.runs if run.series == series]

    def count(self, status: str) -> int:
        return sum(run.status == status for run in self.runs)

    @property
    def versions(self) -> list[str]:
        """The versions of the program that its runs were made with."""
        found = {run.program_version for run in self.runs if run.program_version}
        return sorted(found) or ([self.program_version] if self.program_version else [])

    def inside(self, relative: str) -> Path:
        """A file of the study; a path that leads out of its folder is refused."""
        path = self.folder / relative
        if self.folder.resolve() not in path.resolve().parents:
            raise ResultError(f"{self.folder / 'study.json'}: '{relative}' lies outside the study")
        return path


@dataclass(frozen=True)
class CheckRow:
    """A row of the comparison with closed forms; the error is relative."""

    case: str
    quantity: str
    unit: str
    exact: float
    computed: float
    error: float
    tolerance: float
    source: str
    passed: bool


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


# ---- JSON with checks ----------------------------------------------------------------------------


class _Reader:
    """Values out of JSON, with the place of what is wrong."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def wrong(self, place: str, value: object, due: str) -> ResultError:
        found = "missing" if value is None else f"{json.dumps(value)[:60]}"
        return ResultError(f"{self.path}: '{place}' is {found}; it must be {due}")

    def load(self) -> Any:
        try:
            return json.loads(self.path.read_text(encoding="utf-8"))
        except OSError as error:
            raise ResultError(f"{self.path}: cannot be read: {error.strerror or error}") from error
        except UnicodeDecodeError as error:
            raise ResultError(f"{self.path}: is not text in UTF-8 ({error.reason})") from error
        except ValueError as error:
            raise ResultError(f"{self.path}: is not JSON: {error}") from error

    def mapping(self, value: object, place: str, needed: bool = False) -> dict[str, Any]:
        if value is None and not needed:
            return {}
        if not isinstance(value, dict):
            raise self.wrong(place, value, "an object")
        return value

    def items(self, data: Mapping[str, Any], key: str, place: str = "") -> list[dict[str, Any]]:
        value = data.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise self.wrong(place + key, value, "a list")
        return [
            self.mapping(item, f"{place}{key}[{k}]", needed=True) for k, item in enumerate(value)
        ]

    def text(self, data: Mapping[str, Any], key: str, place: str = "", needed: bool = False) -> str:
        value = data.get(key)
        if value is None and not needed:
            return ""
        if not isinstance(value, str) or (needed and not value.strip()):
            raise self.wrong(place + key, value, "text")
        return value

    def lines(self, data: Mapping[str, Any], key: str) -> list[str]:
        value = data.get(key) or []
        if not isinstance(value, list) or not all(isinstance(line, str) for line in value):
            raise self.wrong(key, value, "a list of texts")
        return value

    def number(self, data: Mapping[str, Any], key: str, place: str = "") -> float | None:
        value = data.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.wrong(place + key, value, "a number")
        return float(value) if math.isfinite(value) else None

    def due(self, data: Mapping[str, Any], key: str, place: str) -> float:
        value = self.number(data, key, place)
        if value is None:
            raise self.wrong(place + key, None, "a number")
        return value

    def whole(self, data: Mapping[str, Any], key: str, place: str = "") -> int | None:
        value = self.number(data, key, place)
        return None if value is None else int(value)

    def choice(self, data: Mapping[str, Any], key: str, place: str, allowed: Sequence[str]) -> str:
        value = data.get(key)
        if not isinstance(value, str) or value not in allowed:
            raise self.wrong(place + key, value, "one of " + ", ".join(allowed))
        return value

    def values(self, data: Mapping[str, Any], key: str, place: str = "") -> dict[str, Value]:
        """Numbers, texts and logicals by name; NaN becomes None."""
        found: dict[str, Value] = {}
        for name, value in self.mapping(data.get(key), place + key).items():
            if value is not None and not isinstance(value, (str, bool, int, float)):
                raise self.wrong(f"{place}{key}.{name}", value, "a number or text")
            bad = isinstance(value, float) and not math.isfinite(value)
            found[name] = None if bad else value
        return found

    def texts(self, data: Mapping[str, Any], key: str) -> dict[str, str]:
        found = self.mapping(data.get(key), key)
        for name, value in found.items():
            if not isinstance(value, str):
                raise self.wrong(f"{key}.{name}", value, "text")
        return found


def read_study(folder: Path) -> Study:
    """The study in a folder; ResultError names the file and what is wrong in it."""
    reader = _Reader(folder / "study.json")
    data = reader.mapping(reader.load(), "the file", needed=True)
    if data.get("schema") != SCHEMA:
        raise reader.wrong("schema", data.get("schema"), f'"{SCHEMA}"')
    if data.get("schema_version") != SCHEMA_VERSION:
        raise reader.wrong("schema_version", data.get("schema_version"), f"{SCHEMA_VERSION}")
    runs = [_run(reader, item, f"runs[{k}].") for k, item in enumerate(reader.items(data, "runs"))]
    series = [
        (reader.text(item, "name", f"series[{k}]."), reader.text(item, "title", f"series[{k}]."))
        for k, item in enumerate(reader.items(data, "series"))
    ]
    named = {name for name, _ in series}
    series += [(name, "") for name in dict.fromkeys(run.series for run in runs)
               if name not in named]  # fmt: skip
    complete = data.get("complete")
    return Study(
        folder=folder,
        name=reader.text(data, "name", needed=True),
        title=reader.text(data, "title") or reader.text(data, "name"),
        question=reader.text(data, "question"),
        file=reader.text(data, "file"),
        base=reader.text(data, "base"),
        created=reader.text(data, "created"),
        program_version=reader.text(data, "program_version"),
        machine=reader.values(data, "machine"),
        complete=complete is True,
        seconds=reader.number(data, "seconds"),
        series=series,
        runs=runs,
        units=reader.texts(data, "units"),
        descriptions=reader.texts(data, "descriptions"),
        figures=[
            _figure(reader, item, f"figures[{k}].")
            for k, item in enumerate(reader.items(data, "figures"))
        ],
        findings=[
            _finding(reader, item, f"findings[{k}].")
            for k, item in enumerate(reader.items(data, "findings"))
        ],
        csv=reader.text(data, "csv"),
        problems=reader.lines(data, "problems"),
    )


def _run(reader: _Reader, item: dict[str, Any], place: str) -> RunRecord:
    name = reader.text(item, "id", place, needed=True)
    return RunRecord(
        id=name,
        label=reader.text(item, "label", place) or name,
        series=reader.text(item, "series", place),
        status=reader.choice(item, "status", place, STATES),
        parameters=reader.values(item, "parameters", place),
        row=reader.values(item, "row", place),
        exit_status=reader.whole(item, "exit_status", place),
        message=reader.text(item, "message", place),
        input=reader.text(item, "input", place),
        program_version=reader.text(item, "program_version", place),
        input_sha256=reader.text(item, "input_sha256", place),
        seconds=reader.number(item, "seconds", place),
        threads=reader.whole(item, "threads", place),
        points=reader.whole(item, "points", place),
        steps=reader.whole(item, "steps", place),
    )


def _figure(reader: _Reader, item: dict[str, Any], place: str) -> FigureRecord:
    return FigureRecord(
        name=reader.text(item, "name", place, needed=True),
        png=reader.text(item, "png", place, needed=True),
        alt=reader.text(item, "alt", place, needed=True),
        csv=reader.text(item, "csv", place),
        title=reader.text(item, "title", place),
        caption=reader.text(item, "caption", place),
    )


def _finding(reader: _Reader, item: dict[str, Any], place: str) -> Finding:
    holds: list[tuple[str, bool | None]] = []
    for k, pair in enumerate(item.get("holds") or []):
        good = isinstance(pair, list) and len(pair) == 2 and isinstance(pair[0], str)
        if not good or not (pair[1] is None or isinstance(pair[1], bool)):
            raise reader.wrong(f"{place}holds[{k}]", pair, "an expression and true or false")
        holds.append((pair[0], pair[1]))
    return Finding(
        title=reader.text(item, "title", place, needed=True),
        paper=reader.text(item, "paper", place),
        found=reader.text(item, "found", place),
        verdict=reader.choice(item, "verdict", place, VERDICTS),
        note=reader.text(item, "note", place),
        holds=holds,
    )


# ---- what lies in the folders --------------------------------------------------------------------


def read_checks(folder: Path) -> tuple[list[CheckRow], str]:
    """The rows of verify.json and the line above the table of verify.md; empty without them."""
    if not (folder / "verify.json").exists():
        return [], ""
    reader = _Reader(folder / "verify.json")
    data = reader.load()
    rows = []
    for k, item in enumerate(reader.items({"rows": data}, "rows")):
        place = f"rows[{k}]."
        rows.append(
            CheckRow(
                case=reader.text(item, "case", place),
                quantity=reader.text(item, "quantity", place, needed=True),
                unit=reader.text(item, "unit", place),
                exact=reader.due(item, "exact", place),
                computed=reader.due(item, "computed", place),
                error=reader.due(item, "error", place),
                tolerance=reader.due(item, "tolerance", place),
                source=reader.text(item, "source", place),
                passed=item.get("passed") is True,
            )
        )
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
            found.append(read_study(path.parent))
        except ResultError as error:
            problems.append(str(error))
    checks: list[CheckRow] = []
    checks_from = ""
    try:
        checks, checks_from = read_checks(results / "verify")
    except ResultError as error:
        problems.append(str(error))
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
