"""What a study file may hold: a model for each of its tables, checked by pydantic.

Names that stand for something (measures, columns, series, frames) are looked up later, in file.py.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Optional, Union

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from .checked import due, mistakes, wrong
from .expressions import Expression, ExpressionError, nearest
from .toml import Problems
from .types import Column

# Columns of the table of runs that are always there; parameters and measures stand in between.
FIXED = {
    "study": Column("", "name of the study"),
    "series": Column("", "series of runs within the study"),
    "run": Column("", "name of the run and of its folder in runs/"),
    "label": Column("", "what the run is called in figures"),
    "status": Column("", "done, failed or missing"),
}
COUNTED = {
    "points": Column("1", "points of the model, fictitious ones included"),
    "steps": Column("1", "time steps of the run"),
}
LAST = {"reasons": Column("", "what has no value in this row, and why")}
OF_THE_STUDY = ("run.name", "run.output_dir")  # what `set` may not touch
_RESERVED = (
    *FIXED, *COUNTED, *LAST, "case", "pi", "and", "or", "not", "if", "else", "in", "is",
)  # fmt: skip


# ---- values ----------------------------------------------------------------------------------


def _name(value: str, info: ValidationInfo) -> str:
    if not re.fullmatch(r"[a-z0-9_]{1,60}", value) and not info.context:
        raise wrong("is no name", "up to 60 of a to z, 0 to 9 and _")
    return value


def _filled(value: str, info: ValidationInfo) -> str:
    if not value.strip() and not info.context:
        raise wrong("must not be empty", bare=True)
    return value


def _parameter_name(key: str) -> str:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", key):
        raise wrong("is no name of a parameter", "letters, digits and _", bare=True)
    if key in _RESERVED:
        what = "cannot be the name of a parameter: it has a meaning of its own"
        raise wrong(what, bare=True)
    return key


def _target(key: str) -> str:
    if key.lower() in OF_THE_STUDY:
        raise wrong("is set by the study itself", bare=True)
    return key


def _expression(text: Any) -> Expression:
    if not isinstance(text, str):
        raise wrong("must be an expression, a text")
    try:
        return Expression(text)
    except ExpressionError as error:
        raise wrong(str(error), bare=True) from None


def _is_formula(value: Any) -> bool:
    return isinstance(value, str) and value.startswith("=")


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str))


def _computed(value: Any) -> Any:
    """A value, an expression in place of a text that begins with =, or a list of such."""
    if isinstance(value, list):
        return [_computed(item) for item in value]
    if _is_formula(value):
        return _expression(value[1:])
    if not _is_plain(value):
        raise wrong("must be a number, a text or a list of them")
    return value


def _parameter(value: Any) -> Any:
    if not isinstance(value, list):
        if not _is_plain(value):
            raise wrong("must be a number or a text, or a list of them")
        return _computed(value)
    if not value:
        raise wrong("must have one value at least")
    if len(set(map(repr, value))) < len(value):
        raise wrong("has the same value twice")
    if not all(_is_plain(item) for item in value):
        what = "must be numbers, texts, true or false"
        raise wrong(what, "for several values that go together: [[case]]")
    return value


def _strain(value: Any) -> Any:
    if _is_formula(value):
        return _expression(value[1:])
    if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
        raise wrong("must be a number", "a nominal strain: 0.01")
    return value


def _spacing(value: Any) -> Any:
    if _is_formula(value):
        return _expression(value[1:])
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if value is not None and (not number or value <= 0):
        raise wrong("must be a number above 0", "a spacing in m: 0.02")
    return value


def _line(value: Any) -> Any:
    if isinstance(value, list) and len(value) == 4:
        value = [value[:2], value[2:]]
    points = value if isinstance(value, list) else []
    if len(points) != 2 or not all(isinstance(p, list) and len(p) == 2 for p in points):
        raise wrong("must be two points", "[[x, y], [x, y]] or [x, y, x, y]")
    return _computed(value)


def _flat(value: Any) -> Any:
    """Tables within tables, as of unquoted keys, joined: "group.name.key"."""
    if not isinstance(value, Mapping):
        return value
    found: dict[str, Any] = {}
    for key, item in value.items():
        inner = _flat(item)
        if isinstance(inner, dict):
            found.update({f"{key}.{name}": one for name, one in inner.items()})
        else:
            found[key] = item
    return found


def _tests(tests: list[Expression], info: ValidationInfo) -> list[Expression]:
    if not tests and not info.context:
        raise wrong("a finding needs a test", 'holds = ["ratio < 1.1"]', bare=True)
    return tests


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


Text = Annotated[str, due("a text")]
Needed = Annotated[Text, AfterValidator(_filled)]
Name = Annotated[Text, AfterValidator(_name)]
Texts = Annotated[list[Text], BeforeValidator(_listed)]
Flag = Annotated[bool, due("true or false")]
Plain = Annotated[Union[bool, int, float, str], due("a number, a text, true or false")]
ParameterName = Annotated[str, AfterValidator(_parameter_name)]
Settings = Annotated[
    dict[Annotated[str, AfterValidator(_target)], Annotated[Any, AfterValidator(_computed)]],
    BeforeValidator(_flat),
]
Formula = Annotated[Expression, BeforeValidator(_expression)]

# Options of figures.
_Number = Union[int, float]
_Pair = Annotated[list[_Number], Field(min_length=2, max_length=2)]
_Two = Annotated[list[_Pair], Field(min_length=2, max_length=2)]
_Four = Annotated[list[_Number], Field(min_length=4, max_length=4)]
Number = Annotated[Optional[_Number], due("a number")]
Numbers = Annotated[Union[_Number, list[_Number], None], due("a number or a list of them")]
Range = Annotated[Optional[_Pair], due("[low, high]")]
Word = Annotated[Optional[str], due("a text")]
Words = Annotated[Union[str, list[str], None], due("a text or a list of them")]
Target = Annotated[Union[_Number, str, None], due("a number, or the name of a column")]
Switch = Annotated[Optional[bool], due("true or false")]


# ---- tables ----------------------------------------------------------------------------------


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, arbitrary_types_allowed=True)


class CaseTable(_Table):
    """Values that belong together."""

    label: Text = ""
    values: dict[ParameterName, Plain] = {}
    use: Texts = []
    set: Settings = {}

    @model_validator(mode="after")
    def _says_something(self, info: ValidationInfo) -> CaseTable:
        if not (self.values or self.use or self.set or info.context):
            raise wrong("a case needs values, use or set", bare=True)
        return self


class LevelTable(_Table):
    """What may stand at the top of the file and in each series."""

    title: Text = ""
    base: Text = ""
    strain: Annotated[Any, AfterValidator(_strain)] = None
    line: Annotated[Any, AfterValidator(_line)] = None
    sampled: Annotated[Any, AfterValidator(_spacing)] = None
    measures: Texts = []
    label: Text = ""
    parameters: dict[ParameterName, Annotated[Any, AfterValidator(_parameter)]] = {}
    use: Texts = []
    set: Settings = {}
    case: list[CaseTable] = []


class SeriesTable(LevelTable):
    """A sweep of its own."""

    name: Name


class FigureOptions(_Table):
    """The options of all kinds of figures; which kind has which stands in figures.py.

    doc/studies.md says what they mean.
    """

    by: Word = None
    centred: Switch = None
    column: Annotated[Literal["single", "double"] | None, due('"single" or "double"')] = None
    connect: Switch = None
    deformed: Number = None
    errors: Switch = None
    field: Word = None
    height: Number = None
    high: Number = None
    inset: Annotated[_Four | None, due("[x0, x1, y0, y1]")] = None
    inset_place: Annotated[_Four | None, due("[left, bottom, width, height]")] = None
    legend: Annotated[
        bool | Literal["inside", "above", "aside"] | None,
        due('true, false, "inside", "above" or "aside"'),
    ] = None
    legend_title: Word = None
    level: Number = None
    line: Annotated[_Two | None, due("[[x, y], [x, y]]")] = None
    low: Number = None
    marks: Numbers = None
    names: Words = None
    normalised: Switch = None
    only: Annotated[dict[str, Any] | None, due("a table of parameters")] = None
    panel_height: Number = None
    per_row: Number = None
    platen: Annotated[Literal["first", "second"] | None, due('"first" or "second"')] = None
    rows: Annotated[Literal["runs", "series"] | None, due('"runs" or "series"')] = None
    same_scale: Switch = None
    scale: Word = None
    show_line: Switch = None
    slope: Target = None
    slope_label: Word = None
    smooth: Switch = None
    strain: Numbers = None
    target: Target = None
    target_label: Word = None
    tension_positive: Switch = None
    x: Word = None
    x_label: Word = None
    x_log: Switch = None
    x_range: Range = None
    x_unit: Word = None
    y: Words = None
    y_label: Word = None
    y_log: Switch = None
    y_range: Range = None


class FigureTable(FigureOptions):
    """A figure that the study asks for."""

    name: Name
    kind: Needed
    title: Needed
    caption: Text = ""
    alt: Needed
    series: Texts = []

    def options(self) -> dict[str, Any]:
        """The options that are given."""
        return self.model_dump(include=set(OPTIONS), exclude_unset=True)


class FindingTable(_Table):
    """A statement of the paper, or a claim beyond it, and what decides about it."""

    title: Needed
    paper: Text = ""
    claim: Text = ""
    values: dict[str, Formula] = {}
    found: Needed
    holds: Annotated[list[Formula], BeforeValidator(_listed), AfterValidator(_tests)] = Field(
        [], validate_default=True
    )
    note: Text = ""


class StudyTable(LevelTable):
    """The whole file."""

    name: Name
    question: Text = ""
    base: Needed
    tension_positive: Flag = False
    units: dict[str, Text] = {}
    block: dict[Name, Settings] = {}
    series: list[SeriesTable] = []
    figure: list[FigureTable] = []
    finding: list[FindingTable] = []


OPTIONS = FigureOptions.model_fields
FIGURE_KEYS = tuple(name for name in FigureTable.model_fields if name not in OPTIONS)
_LISTS: dict[str, type[_Table]] = {
    "case": CaseTable,
    "series": SeriesTable,
    "figure": FigureTable,
    "finding": FindingTable,
}


# ---- the file as a whole ---------------------------------------------------------------------


def read_tables(data: dict[str, Any], problems: Problems) -> StudyTable | None:
    """The file without what is wrong in it; all that is wrong goes into `problems`.

    What is wrong is taken out, or an empty text put in its place, so that the rest can be looked
    at further. None where nothing is left to look at.
    """
    for attempt in range(10):
        try:
            return StudyTable.model_validate(data, context=attempt or None)
        except ValidationError as error:
            if attempt == 0:
                _complain(error, problems)
            _repair(data, error)
    return None


def _complain(error: ValidationError, problems: Problems) -> None:
    for one in mistakes(error):
        place = tuple(part for part in one.place if part != "[key]")
        parent = next((part for part in reversed(place[:-1]) if isinstance(part, str)), "")
        what, found, allowed = one.what, one.found, list(one.allowed)
        if one.kind == "missing":
            place = place[:-1] or place
        elif one.kind == "unknown":
            allowed = list(_LISTS.get(parent, StudyTable).model_fields)
            what += nearest(place[-1], allowed)
        elif place[-1] in _LISTS:
            what, found, allowed = (
                "must be a list of tables",
                None,
                [f"[[{place[-1]}]] before each"],
            )
        elif isinstance(place[-1], int) and parent not in _LISTS:
            place = place[:-1]
        problems.add(place, what, found, allowed)


def _repair(data: dict[str, Any], error: ValidationError) -> None:
    """Take out what is wrong; put an empty text in place of what is missing."""
    # From behind, so that the numbers of what stands before in a list stay right.
    for one in reversed(error.errors(include_url=False)):
        place = [part for part in one["loc"] if part != "[key]"]
        if place[-2:-1] and place[-2] in _LISTS and isinstance(one["input"], dict):
            continue  # a table as a whole: it may stay
        parent: Any = data
        for k, part in enumerate(place[:-1]):
            if isinstance(parent, dict) and isinstance(parent.get(part), str):
                place = place[: k + 1]  # one text in place of a list of them
                break
            parent = parent[part] if isinstance(part, int) else parent.get(part, {})
        if one["type"] == "missing":
            parent[place[-1]] = ""
        elif isinstance(place[-1], int):
            del parent[place[-1]]
        else:
            _take_out(parent, place[-1])


def _take_out(table: dict[str, Any], name: Any) -> None:
    """A key, also one that has been joined from tables within tables."""
    if name in table:
        del table[name]
        return
    first, _, rest = str(name).partition(".")
    if rest and isinstance(table.get(first), dict):
        _take_out(table[first], rest)
