"""Findings: what the table of runs says about a claim of the paper."""

from __future__ import annotations

import ast
import math
import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..measure.export import plain
from .expressions import (
    TABLE_FUNCTIONS,
    Expression,
    ExpressionError,
    MissingValueError,
    Numbers,
    nearest,
)
from .plan import PlannedRun
from .record import (
    AGREES,
    DIFFERS,
    HOLDS,
    HOLDS_IN_PART,
    HOLDS_NOT,
    IN_PART,
    NO_RESULT,
    FindingRecord,
    Verdict,
)
from .tables import FindingTable
from .toml import Key, Problems
from .types import Column, Value

_FILTERS = ("series", "run", "label")


@dataclass(frozen=True)
class Finding:
    """A row of the table "paper says / we find / verdict", before the runs are there."""

    title: str
    paper: str
    claim: str
    found: str
    note: str
    values: dict[str, Expression]
    holds: tuple[Expression, ...]


@dataclass(frozen=True)
class TableRow:
    """A run in the table: what it is, and its numbers."""

    id: str
    label: str
    series: str
    parameters: Mapping[str, Value]
    cells: Mapping[str, Value]  # parameters and measures


# ---- reading ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Known:
    """What expressions may name.

    `runs` is None where other mistakes have kept runs from being planned; what depends on them is
    not looked at then.
    """

    series: Sequence[str]
    parameters: Sequence[str]
    runs: Sequence[PlannedRun] | None
    columns: Mapping[str, Column]

    def check_call(self, text: str, call: ast.Call) -> None:
        """col('column', series='name', parameter=value): raise unless all of these exist."""
        first = call.args[0] if len(call.args) == 1 else None
        if not isinstance(first, ast.Constant) or not isinstance(first.value, str):
            raise ExpressionError(f"'{text}': col and val need the name of one column in quotes")
        self._one_of(text, "column", first.value, self.columns)
        wanted: dict[str, Any] = {}
        for keyword in call.keywords:
            name = str(keyword.arg)
            self._one_of(text, "parameter", name, [*_FILTERS, *self.parameters])
            try:
                wanted[name] = ast.literal_eval(keyword.value)
            except ValueError:
                return  # an expression: what it gives is known only later
        for one in _as_list(wanted.get("series", [])):
            self._one_of(text, "series", str(one), self.series)
        if self.runs is not None:
            count = sum(matches(run, wanted) for run in self.runs)
            name = call.func.id if isinstance(call.func, ast.Name) else ""
            if count == 0:
                raise ExpressionError(f"'{text}': no run of the study is meant by this {name}")
            if name == "val" and count > 1:
                raise ExpressionError(f"'{text}': val needs one run, this means {count}")

    def _one_of(self, text: str, what: str, name: str, known: Iterable[str]) -> None:
        names = list(known)
        if name not in names:
            raise ExpressionError(
                f"'{text}': unknown {what} {name}{nearest(name, names)}; "
                f"allowed: {', '.join(names)}"
            )


def _as_list(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else [value]


def checked_finding(
    table: FindingTable, place: Key, known: Known, problems: Problems
) -> Finding | None:
    """A [[finding]] of the study file; None where it is not right."""
    before = len(problems.list)
    names: list[str] = []
    if table.paper and table.claim:
        what = "stands beside paper: a finding is about the paper or goes beyond it"
        problems.add((*place, "claim"), what)
    for name, expression in table.values.items():
        _check((*place, "values", name), expression, names, known, problems)
        names.append(name)
    for expression in table.holds:
        _check((*place, "holds"), expression, names, known, problems)
    try:
        for _, part, _, _ in string.Formatter().parse(table.found):
            if part is not None and part not in names:
                what = f"unknown name {{{part}}}{nearest(part, names)}"
                problems.add((*place, "found"), what, table.found, names)
    except ValueError as error:
        problems.add((*place, "found"), f"is no text to fill in: {error}", table.found)
    if before < len(problems.list):
        return None
    return Finding(
        title=table.title,
        paper=table.paper,
        claim=table.claim,
        found=table.found,
        note=table.note,
        values=dict(table.values),
        holds=tuple(table.holds),
    )


def _check(
    place: Key, expression: Expression, names: Iterable[str], known: Known, problems: Problems
) -> None:
    """Complain about an expression that names what will not be there."""
    try:
        expression.check_names(names, [*TABLE_FUNCTIONS, "col", "val"])
        for call in expression.calls:
            if isinstance(call.func, ast.Name) and call.func.id in ("col", "val"):
                known.check_call(expression.text, call)
    except ExpressionError as error:
        problems.add(place, str(error))


def matches(run: PlannedRun | TableRow, wanted: Mapping[str, Any]) -> bool:
    """Whether a run has these parameters, series, name or label; a list allows any of its items."""
    own = {**run.parameters, "series": run.series, "run": run.id, "label": run.label}
    for key, value in wanted.items():
        if key not in own or not any(_same(own[key], one) for one in _as_list(value)):
            return False
    return True


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, (int, float)) and isinstance(other, (int, float)):
        return isinstance(one, bool) == isinstance(other, bool) and math.isclose(
            one, other, rel_tol=1e-9, abs_tol=1e-300
        )
    return bool(one == other)


# ---- evaluation ------------------------------------------------------------------------------


def evaluate(finding: Finding, rows: Sequence[TableRow]) -> FindingRecord:
    """The finding as it stands in study.json."""
    functions = {**TABLE_FUNCTIONS, **_table_functions(rows)}
    values: dict[str, Any] = {}
    missing: list[str] = []

    def of(expression: Expression) -> Any:
        try:
            return expression.value(values, functions)
        except (ExpressionError, MissingValueError) as error:
            missing.append(str(error))
            return None

    for name, expression in finding.values.items():
        if missing:
            break
        values[name] = of(expression)
    tests: list[tuple[str, bool | None]] = []
    if not missing:
        tests = [(one.text, _truth(of(one))) for one in finding.holds]
    found = ""
    if not missing:
        try:
            found = finding.found.format(**{k: _listed(v) for k, v in values.items()})
        except (ValueError, TypeError) as error:
            missing.append(f"the text cannot be filled in: {error}")
    if missing:
        found = f"no result: {missing[0]}"
    return FindingRecord(
        title=finding.title,
        paper=finding.paper,
        claim=finding.claim,
        found=found,
        verdict=NO_RESULT
        if missing
        else verdict([bool(truth) for _, truth in tests], beyond=not finding.paper),
        note=finding.note,
        values=plain({name: _listed(value) for name, value in values.items()}),
        holds=tests,
    )


def verdict(tests: Sequence[bool], beyond: bool = False) -> Verdict:
    """In one word or three; what goes `beyond` the paper cannot agree with it."""
    if all(tests):
        return HOLDS if beyond else AGREES
    if any(tests):
        return HOLDS_IN_PART if beyond else IN_PART
    return HOLDS_NOT if beyond else DIFFERS


def _truth(value: Any) -> bool | None:
    if value is None:
        return None
    return all(value) if isinstance(value, (Numbers, list)) else bool(value)


def _listed(value: Any) -> Any:
    return value.values if isinstance(value, Numbers) else value


def _table_functions(rows: Sequence[TableRow]) -> dict[str, Callable[..., Any]]:
    def col(column: str, **wanted: Any) -> Numbers:
        found = {
            row.id: row.cells.get(column)
            for row in rows
            if matches(row, {k: _listed(v) for k, v in wanted.items()})
        }
        numbers = {run: value for run, value in found.items() if not _is_missing(value)}
        if not numbers:
            raise MissingValueError(f"no run has a '{column}'")
        return Numbers(numbers)

    def val(column: str, **wanted: Any) -> Any:
        found = col(column, **wanted).values
        if len(found) != 1:
            raise ExpressionError(f"{len(found)} runs have a '{column}', val needs one")
        return found[0]

    return {"col": col, "val": val}


def _is_missing(value: Value) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))
