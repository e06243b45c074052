"""The record of a study, study.json: one model for those who write it and those who read it.

Paths in it are relative to its folder. What a record lacks is empty; keys that are not known are
passed over, so that a later version may add some.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal, Optional, TypeVar, Union, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    StrictBool,
    StrictStr,
    StringConstraints,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from ..read.errors import ResultError
from .checked import due, mistakes

T = TypeVar("T")

FILE = "study.json"
SCHEMA: Literal["perigeo study"] = "perigeo study"
SCHEMA_VERSION: Literal[1] = 1

# The first three are about the paper, the next three about what goes beyond it.
Verdict = Literal[
    "agrees", "agrees in part", "differs", "holds", "holds in part", "does not hold", "no result"
]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
AGREES, IN_PART, DIFFERS, HOLDS, HOLDS_IN_PART, HOLDS_NOT, NO_RESULT = VERDICTS
State = Literal["done", "failed", "missing"]
STATES: tuple[State, ...] = get_args(State)
DONE, FAILED, MISSING = STATES


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _filled(value: Any) -> Any:
    return "" if value is None else value


Text = Annotated[str, BeforeValidator(_filled), due("text")]
Needed = Annotated[str, StringConstraints(pattern=r"\S"), due("text")]
Number = Annotated[Optional[float], BeforeValidator(_finite), due("a number")]
Count = Annotated[Optional[int], due("a whole number")]
Scalar = Annotated[
    Union[bool, int, float, str, None], BeforeValidator(_finite), due("a number or text")
]
# JSON has no tuples.
Test = Annotated[
    tuple[StrictStr, Optional[StrictBool]], Strict(False), due("an expression and true or false")
]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, populate_by_name=True)


class SeriesRecord(_Part):
    """A series of runs."""

    name: Text = ""
    title: Text = ""


class RunRecord(_Part):
    """One run of a study."""

    id: Needed
    series: Text = ""
    label: Text = ""
    parameters: dict[str, Scalar] = {}
    status: Annotated[State, due("one of " + ", ".join(STATES))]
    exit_status: Count = None
    message: Text = ""
    input: Text = ""
    result: Text = ""
    program_version: Text = ""
    input_sha256: Text = ""
    seconds: Number = None
    threads: Count = None
    points: Count = None
    steps: Count = None
    row: dict[str, Scalar] = {}  # what was measured, SI units
    reasons: dict[str, Text] = {}  # why there is no value: by the column of `row`

    @model_validator(mode="after")
    def _has_a_label(self) -> RunRecord:
        self.label = self.label or self.id
        return self


class FigureRecord(_Part):
    """One figure: its files and its texts."""

    name: Needed
    png: Needed
    pdf: Text = ""
    csv: Text = ""
    title: Text = ""
    caption: Text = ""
    alt: Needed


class FindingRecord(_Part):
    """One line of the table 'the paper says, we find, verdict'."""

    title: Needed
    paper: Text = ""
    claim: Text = ""  # beyond the paper
    found: Text = ""
    verdict: Annotated[Verdict, due("one of " + ", ".join(VERDICTS))]
    note: Text = ""
    values: dict[str, Any] = {}
    holds: list[Test] = []  # criterion, whether it holds; None: no data

    @property
    def of_the_paper(self) -> bool:
        """Whether the paper says it; what it does not say is a check of our own."""
        return bool(self.paper) or not self.claim

    @property
    def statement(self) -> str:
        """What the tests are about: the words of the paper, or what goes beyond it."""
        return self.paper or self.claim


class StudyRecord(_Part):
    """A study that has been computed, in whole or in part."""

    kind: Annotated[Literal["perigeo study"], due(f'"{SCHEMA}"')] = Field(alias="schema")
    schema_version: Annotated[Literal[1], due(f"{SCHEMA_VERSION}")]
    name: Needed
    title: Text = ""
    question: Text = ""
    file: Text = ""
    base: Text = ""
    created: Text = ""
    fingerprint: Text = ""
    program_version: Text = ""
    machine: dict[str, Scalar] = {}
    complete: bool = False
    seconds: Number = None
    series_listed: list[SeriesRecord] = Field([], alias="series")
    runs: list[RunRecord] = []
    units: dict[str, Text] = {}
    descriptions: dict[str, Text] = {}
    figures: list[FigureRecord] = []
    findings: list[FindingRecord] = []
    problems: Annotated[list[str], due("a list of texts")] = []  # not measured, or not drawn
    csv: Text = ""
    folder: Path = Field(Path(), exclude=True)  # where the record lies

    @model_validator(mode="after")
    def _has_a_title(self) -> StudyRecord:
        self.title = self.title or self.name
        return self

    @property
    def series(self) -> list[tuple[str, str]]:
        """Names and titles of the series, also of one that only its runs name."""
        named = {one.name: one.title for one in self.series_listed}
        return list({**named, **{r.series: "" for r in self.runs if r.series not in named}}.items())

    @property
    def versions(self) -> list[str]:
        """The versions of the program that its runs were made with."""
        found = {run.program_version for run in self.runs if run.program_version}
        return sorted(found) or ([self.program_version] if self.program_version else [])

    def runs_of(self, series: str) -> list[RunRecord]:
        """The runs of one series, in the order of the file."""
        return [run for run in self.runs if run.series == series]

    def count(self, status: str) -> int:
        """How many runs are done, failed or missing."""
        return sum(run.status == status for run in self.runs)

    def inside(self, relative: str) -> Path:
        """A file of the study; a path that leads out of its folder is refused."""
        path = self.folder / relative
        if self.folder.resolve() not in path.resolve().parents:
            raise ResultError(f"{self.folder / FILE}: '{relative}' lies outside the study")
        return path

    def reasons(self) -> list[tuple[str, str]]:
        """What has no value, in words ("width, angle: a, b"), and why; alike ones together."""
        columns: dict[tuple[str, str], list[str]] = {}  # of a run and a reason
        for run in self.runs:
            for column, reason in run.reasons.items():
                columns.setdefault((run.id, reason), []).append(column)
        runs: dict[tuple[str, str], list[str]] = {}  # of the columns and a reason
        for (run_id, reason), names in columns.items():
            runs.setdefault((", ".join(names), reason), []).append(run_id)
        return [(f"{names}: {', '.join(ids)}", why) for (names, why), ids in runs.items()]

    def text(self) -> str:
        """What study.json holds."""
        return self.model_dump_json(by_alias=True, indent=1) + "\n"


def read_record(folder: Path) -> StudyRecord:
    """The record in a folder; ResultError names the file and everything that is wrong in it."""
    record = read_json(folder / FILE, TypeAdapter(StudyRecord))
    record.folder = folder
    return record


def read_json(path: Path, adapter: TypeAdapter[T]) -> T:
    """What a JSON file holds; ResultError names it and everything that is wrong in it."""
    try:
        return adapter.validate_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ResultError(f"{path}: is not text in UTF-8 ({error.reason})") from error
    except ValidationError as error:
        raise ResultError("\n".join(f"{path}: {line}" for line in _lines(error))) from error


def _lines(error: ValidationError) -> list[str]:
    """What is wrong; of another schema nothing but that."""
    if error.errors()[0]["type"] == "json_invalid":
        return [f"is not JSON: {error.errors()[0]['msg']}"]
    found = []
    for one in mistakes(error):
        words = one.what.replace("a table", "an object")
        place = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in one.place)
        value = "missing" if one.kind == "missing" else json.dumps(one.found)[:60]
        due_words = "" if one.kind == "missing" else f"; it {words}"
        found.append(f"'{place.lstrip('.') or 'the file'}' is {value}{due_words}")
        if one.place[:1] == ("schema",):
            break
    return found
