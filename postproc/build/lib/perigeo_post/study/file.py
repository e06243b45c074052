"""Study files: read, checked as a whole, and turned into runs, figures and findings.

doc/studies.md describes the file. Everything that is wrong is found here, before anything runs;
what is wrong with the inputs, the program says.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .expressions import nearest
from .findings import Finding, Known, checked_finding
from .inputs import Inputs
from .level import Blocks, Level, level_of
from .plan import PlannedRun, Planner, has_frame
from .tables import COUNTED, FIGURE_KEYS, FIXED, LAST, StudyTable, read_tables
from .toml import Key, Problems, StudyError, read_toml
from .types import Column, Draw, Measure


@dataclass(frozen=True)
class Kinds:
    """What a study file may ask for by name."""

    measures: Mapping[str, Measure]
    figures: Mapping[str, Draw]
    options: Mapping[str, Iterable[str]] = field(default_factory=dict)  # of a kind of figure
    needed: Mapping[str, Iterable[str]] = field(default_factory=dict)  # options without a default
    columns: Mapping[str, Iterable[str]] = field(default_factory=dict)  # options that name columns


@dataclass(frozen=True)
class FigureSpec:
    """A figure that the study asks for."""

    name: str
    kind: str
    title: str
    caption: str
    alt: str
    series: tuple[str, ...]
    options: dict[str, Any]


@dataclass(frozen=True)
class Study:
    """A study file without mistakes."""

    path: Path
    name: str
    title: str
    question: str
    base: Path
    series: tuple[tuple[str, str], ...]  # names and titles
    runs: tuple[PlannedRun, ...]
    figures: tuple[FigureSpec, ...]
    findings: tuple[Finding, ...]
    columns: dict[str, Column]  # of the table of runs, in their order
    parameters: tuple[str, ...]


def load_study(path: Path, kinds: Kinds, inputs: Inputs) -> Study:
    """Read a study file. Raises StudyError with everything that is wrong."""
    data, problems = read_toml(path)
    top = read_tables(data, problems)
    if top is None:
        raise StudyError(problems.list)
    levels = _levels(top, kinds, problems)
    inputs.begin(top.name)
    planner = Planner(path, inputs, problems)
    readable: dict[str, bool] = {}
    for name, level in levels.items():
        if level.base not in readable:
            place = level.at("base") if level.base != top.base else ("base",)
            readable[level.base] = _readable(level.base, path, place, problems)
        if readable[level.base]:
            planner.add_series(name, level, name if level.place else "", top.name)
    runs = planner.runs

    parameters = list(dict.fromkeys(name for level in levels.values() for name in level.parameters))
    columns = _columns(top, parameters, list(levels.values()), kinds, problems)
    complete = not problems.list  # otherwise there may be fewer runs than meant
    figures = _figures(top, list(levels), runs if complete else [], columns, kinds, problems)
    known = Known(list(levels), parameters, runs if complete else None, columns)
    findings = [
        found
        for k, table in enumerate(top.finding)
        if (found := checked_finding(table, ("finding", k), known, problems)) is not None
    ]
    problems.stop_if_any()
    return Study(
        path=path,
        name=top.name,
        title=top.title or top.name,
        question=top.question,
        base=path.parent / top.base,
        series=tuple((name, level.title) for name, level in levels.items()),
        runs=tuple(runs),
        figures=tuple(figures),
        findings=tuple(findings),
        columns=columns,
        parameters=tuple(parameters),
    )


def _readable(base: str, path: Path, place: Key, problems: Problems) -> bool:
    """Whether the file of a base can be read."""
    if not base:
        return False
    try:
        (path.parent / base).read_bytes()
    except OSError as error:
        what = f"the base cannot be read: {error.strerror}"
        problems.add(place, what, base, "relative to this file")
        return False
    return True


def _levels(top: StudyTable, kinds: Kinds, problems: Problems) -> dict[str, Level]:
    """Contents of the series by their names; the file itself is one where it names none."""
    blocks = Blocks(top.block, problems)
    whole = level_of(top, (), top.name, blocks)
    whole.measures = problems.known(("measures",), whole.measures, kinds.measures, "measure")
    if not top.series:
        blocks.check()
        return {top.name: whole}
    levels: dict[str, Level] = {}
    for k, table in enumerate(top.series):
        if table.name in levels:
            problems.add(("series", k, "name"), "two series have the same name", table.name)
        level = level_of(table, ("series", k), table.name, blocks)
        place = level.at("measures")
        level.measures = problems.known(place, level.measures, kinds.measures, "measure")
        levels[table.name] = level.below(whole)
    blocks.check()
    return levels


# ---- columns and figures ---------------------------------------------------------------------


def _columns(
    top: StudyTable,
    parameters: list[str],
    levels: Sequence[Level],
    kinds: Kinds,
    problems: Problems,
) -> dict[str, Column]:
    columns = dict(FIXED)
    for name in parameters:
        columns[name] = Column(top.units.get(name, ""), f"parameter {name}")
    for key in top.units:
        if key not in parameters:
            what = f"there is no such parameter{nearest(key, parameters)}"
            problems.add(("units", key), what, allowed=parameters)
    columns.update(COUNTED)
    for measure in dict.fromkeys(name for level in levels for name in level.measures):
        for name, column in kinds.measures[measure].columns.items():
            if name in parameters or name in FIXED:
                what = f"'{measure}' gives a column '{name}', which is there"
                problems.add(("measures",), what)
            columns.setdefault(name, column)
    columns.update(LAST)
    return columns


def _figures(
    top: StudyTable,
    series: list[str],
    runs: Sequence[PlannedRun],
    columns: Mapping[str, Column],
    kinds: Kinds,
    problems: Problems,
) -> list[FigureSpec]:
    found: list[FigureSpec] = []
    for k, table in enumerate(top.figure):
        place: Key = ("figure", k)
        if table.name in [top.name, *(other.name for other in found)]:
            problems.add((*place, "name"), "the name is taken", table.name)
        if table.kind:
            one = [table.kind]
            problems.known((*place, "kind"), one, sorted(kinds.figures), "kind of figure")
        options = table.options()
        _check_options(table.kind, options, place, columns, kinds, problems)
        if "tension_positive" in kinds.options.get(table.kind, ()):
            options.setdefault("tension_positive", top.tension_positive)
        chosen = problems.known((*place, "series"), table.series, series, "series") or series
        _check_strains(options, place, [run for run in runs if run.series in chosen], problems)
        found.append(
            FigureSpec(
                name=table.name,
                kind=table.kind,
                title=table.title,
                caption=table.caption,
                alt=table.alt,
                series=tuple(chosen),
                options=options,
            )
        )
    return found


def _check_options(
    kind: str,
    options: Mapping[str, Any],
    place: Key,
    columns: Mapping[str, Column],
    kinds: Kinds,
    problems: Problems,
) -> None:
    """Complain about options that the kind has not, needs, or that name columns not there."""
    if kind in kinds.options:
        known = [*FIGURE_KEYS, *sorted(kinds.options[kind])]
        for key in options:
            if key not in known:
                problems.add((*place, key), f"unknown key{nearest(key, known)}", allowed=known)
    for key in kinds.needed.get(kind, ()):
        if key not in options:
            problems.add(place, f"the key {key} is missing")
    for key in kinds.columns.get(kind, ()):
        value = options.get(key, [])
        names = [value] if isinstance(value, str) else value
        if isinstance(names, list):
            problems.known((*place, key), names, columns, "column")
    for key in options.get("only", {}):
        if key not in columns:
            what = f"unknown key{nearest(key, columns)}"
            problems.add((*place, "only", key), what, allowed=columns)


def _check_strains(
    options: Mapping[str, Any], place: Key, runs: Sequence[PlannedRun], problems: Problems
) -> None:
    """The option `strain` of a figure needs frames there."""
    strains = options.get("strain", [])
    for strain in strains if isinstance(strains, list) else [strains]:
        frames = [run.values.numbers("output", "frame_strains") for run in runs]
        if runs and not any(has_frame(one, strain) for one in frames):
            there = ", ".join(f"{one:g}" for one in sorted({f for one in frames for f in one}))
            what = "none of its runs has a frame at this strain"
            problems.add((*place, "strain"), what, strain, there)
