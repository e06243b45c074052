"""What a study file varies and sets: at its top, and in each of its series."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .expressions import Expression, ExpressionError
from .toml import Key, Problems, Table
from .types import Column, Value

# Columns of the table of runs that are always there; parameters and measures follow.
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
_RESERVED = (*FIXED, *COUNTED, *LAST, "case", "pi", "and", "or", "not", "if", "else", "in", "is")

Edit = tuple[Key, str, Any]  # place in the study file, key of the namelist, value


@dataclass
class Case:
    """A named set of values."""

    label: str = ""
    values: dict[str, Value] = field(default_factory=dict)
    edits: list[Edit] = field(default_factory=list)


@dataclass
class Level:
    """What stands at the top of the file, or in a series."""

    swept: dict[str, list[Value]]
    fixed: dict[str, Any]  # values, and expressions of the other parameters
    cases: list[Case]
    edits: list[Edit]
    measures: list[str]
    label: str
    strain: Any
    line: Any
    table: Table

    @property
    def parameters(self) -> list[str]:
        """Names of all parameters of its runs."""
        of_cases = [name for case in self.cases for name in case.values]
        return list(dict.fromkeys([*self.swept, *of_cases, *self.fixed]))

    def below(self, top: Level) -> Level:
        """This level, that of a series, with what stands at the top of the file."""
        own = {*self.swept, *self.fixed}
        return Level(
            swept={**{k: v for k, v in top.swept.items() if k not in own}, **self.swept},
            fixed={**{k: v for k, v in top.fixed.items() if k not in own}, **self.fixed},
            cases=self.cases or top.cases,
            edits=[*top.edits, *self.edits],
            measures=list(dict.fromkeys([*top.measures, *self.measures])),
            label=self.label or top.label,
            strain=top.strain if self.strain is None else self.strain,
            line=top.line if self.line is None else self.line,
            table=self.table,
        )


# ---- reading a level -------------------------------------------------------------------------


def read_level(table: Table, measures: Mapping[str, Any]) -> Level:
    """Parameters, cases and changes of a table of the study file."""
    swept: dict[str, list[Value]] = {}
    fixed: dict[str, Any] = {}
    parameters = table.table("parameters")
    for key, value in parameters.data.items():
        if not _good_parameter(parameters, key):
            continue
        if isinstance(value, list):
            if not value:
                parameters.complain(key, "must have one value at least", value)
            elif len(set(map(repr, value))) < len(value):
                parameters.complain(key, "has the same value twice", value)
            elif all(_is_plain(item) for item in value):
                swept[key] = value
            else:
                parameters.complain(
                    key, "must be numbers, texts, true or false", value,
                    "for several values that go together: [[case]]",
                )  # fmt: skip
        elif isinstance(value, str) and value.startswith("="):
            fixed[key] = _expression(parameters, key, value)
        elif _is_plain(value):
            fixed[key] = value
        else:
            parameters.complain(key, "must be a number or a text, or a list of them", value)
    return Level(
        swept=swept,
        fixed=fixed,
        cases=[_case(item) for item in table.tables("case")],
        edits=_edits(table.table("set")),
        measures=table.choices("measures", measures, "measure"),
        label=table.text("label"),
        strain=_strain(table),
        line=_line(table),
        table=table,
    )


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str))


def _good_parameter(table: Table, key: str) -> bool:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", key):
        table.complain(key, "is no name of a parameter", allowed="letters, digits and _")
        return False
    if key in _RESERVED:
        table.complain(key, "cannot be the name of a parameter: it has a meaning of its own")
        return False
    return True


def _expression(table: Table, key: str, text: str) -> Expression | None:
    try:
        return Expression(text[1:])
    except ExpressionError as error:
        table.complain(key, str(error))
        return None


def _case(table: Table) -> Case:
    table.only(("label", "values", "set"))
    values = table.table("values")
    good = {}
    for key, value in values.data.items():
        if not _good_parameter(values, key):
            continue
        if _is_plain(value):
            good[key] = value
        else:
            values.complain(key, "must be a number, a text, true or false", value)
    if not table.data.get("values") and not table.data.get("set"):
        table.problems.add(table.place, "a case needs values or set")
    return Case(table.text("label"), good, _edits(table.table("set")))


def _edits(table: Table) -> list[Edit]:
    """The changes of [set]; tables within tables, as of unquoted keys, are joined."""
    found: list[Edit] = []

    def walk(data: Mapping[str, Any], names: tuple[str, ...]) -> None:
        for key, value in data.items():
            if isinstance(value, Mapping):
                walk(value, (*names, key))
                continue
            place = table.at(*names, key)
            target = ".".join((*names, key))
            if target.lower() in OF_THE_STUDY:
                table.problems.add(place, "is set by the study itself")
                continue
            found.append((place, target, _prepared(table.problems, place, value)))

    walk(table.data, ())
    return found


def _prepared(problems: Problems, place: Key, value: Any) -> Any:
    """A value with its expressions parsed; None where one is wrong."""
    if isinstance(value, list):
        return [_prepared(problems, place, item) for item in value]
    if isinstance(value, str) and value.startswith("="):
        try:
            return Expression(value[1:])
        except ExpressionError as error:
            problems.add(place, str(error))
            return None
    if not _is_plain(value):
        problems.add(place, "must be a number, a text or a list of them", value)
        return None
    return value


def _strain(table: Table) -> Any:
    value = table.data.get("strain")
    if isinstance(value, str) and value.startswith("="):
        return _expression(table, "strain", value)
    if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
        table.complain("strain", "must be a number", value, "a nominal strain: 0.01")
        return None
    return value


def _line(table: Table) -> Any:
    value = table.data.get("line")
    if value is None:
        return None
    if isinstance(value, list) and len(value) == 4:
        value = [value[:2], value[2:]]
    points = value if isinstance(value, list) else []
    if len(points) != 2 or not all(isinstance(p, list) and len(p) == 2 for p in points):
        table.complain("line", "must be two points", value, "[[x, y], [x, y]] or [x, y, x, y]")
        return None
    return _prepared(table.problems, table.at("line"), value)
