"""Study files: read, checked as a whole, and turned into runs, figures and findings.

doc/studies.md describes the file. Everything that is wrong is found here, before anything runs,
except what only the program can tell about a namelist.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .expressions import nearest
from .findings import Finding, read_finding
from .level import COUNTED, FIXED, LAST, Level, read_level
from .namelist import Namelist, NamelistError, parse_namelist
from .options import check_options
from .plan import PlannedRun, Planner, has_frame
from .toml import Table, read_toml
from .types import Column, Draw, Measure

_TOP = (
    "name", "title", "question", "base", "strain", "line", "measures", "label",
    "tension_positive", "units", "parameters", "set", "case", "series", "figure", "finding",
)  # fmt: skip
_SERIES = (
    "name", "title", "strain", "line", "measures", "label", "parameters", "set", "case",
)  # fmt: skip
_FIGURE = ("name", "kind", "title", "caption", "alt", "series")


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


def load_study(path: Path, kinds: Kinds) -> Study:
    """Read a study file. Raises StudyError with everything that is wrong."""
    data, problems = read_toml(path)
    top = Table(data, (), problems)
    top.only(_TOP)
    name = top.name("name")
    title = top.text("title", name)
    base_path, base = _base(top, path)
    series, levels = _all_series(top, kinds, name, title)
    planner = Planner(base or Namelist(), [base_path.parent, path.parent, Path()], problems)
    if base is not None:
        for (one, _), level in zip(series, levels):
            planner.add_series(one, level, one if level.table.place else "", name)
    runs = planner.runs

    parameters = list(dict.fromkeys(name for level in levels for name in level.parameters))
    columns = _columns(top, parameters, levels, kinds)
    names = [one for one, _ in series]
    complete = not problems.list  # otherwise there may be fewer runs than meant
    figures = _figures(top, names, runs if complete else [], columns, kinds)
    findings = [
        found
        for table in top.tables("finding")
        if (found := read_finding(table, names, parameters, runs if complete else None, columns))
        is not None
    ]
    problems.stop_if_any()
    return Study(
        path=path,
        name=name,
        title=title,
        question=top.text("question"),
        base=base_path,
        series=tuple(series),
        runs=tuple(runs),
        figures=tuple(figures),
        findings=tuple(findings),
        columns=columns,
        parameters=tuple(parameters),
    )


def _base(top: Table, path: Path) -> tuple[Path, Namelist | None]:
    name = top.text("base", required=True)
    base = path.parent / name
    if not name:
        return base, None
    try:
        return base, parse_namelist(base.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a text"
        top.complain("base", f"the base cannot be read: {reason}", name, "relative to this file")
    except NamelistError as error:
        top.complain("base", f"the base has a mistake: {error}", name)
    return base, None


def _all_series(
    top: Table, kinds: Kinds, name: str, title: str
) -> tuple[list[tuple[str, str]], list[Level]]:
    """Names, titles and contents of the series; the file itself is one where it names none."""
    level = read_level(top, kinds.measures)
    tables = top.tables("series")
    if not tables:
        return [(name, title)], [level]
    series: list[tuple[str, str]] = []
    levels: list[Level] = []
    for table in tables:
        table.only(_SERIES)
        one = table.name("name")
        if one in [other for other, _ in series]:
            table.complain("name", "two series have the same name", one)
        series.append((one, table.text("title", one)))
        levels.append(read_level(table, kinds.measures).below(level))
    return series, levels


# ---- columns and figures ------- --------------------------------------------------------------


def _columns(
    top: Table, parameters: list[str], levels: Sequence[Level], kinds: Kinds
) -> dict[str, Column]:
    units = top.table("units")
    columns = dict(FIXED)
    for name in parameters:
        columns[name] = Column(units.text(name), f"parameter {name}")
    for key in units.data:
        if key not in parameters:
            units.complain(key, f"there is no such parameter{nearest(key, parameters)}",
                           allowed=parameters)  # fmt: skip
    columns.update(COUNTED)
    for measure in dict.fromkeys(name for level in levels for name in level.measures):
        for name, column in kinds.measures[measure].columns.items():
            if name in parameters or name in FIXED:
                top.complain("measures", f"'{measure}' gives a column '{name}', which is there")
            columns.setdefault(name, column)
    columns.update(LAST)
    return columns


def _figures(
    top: Table,
    series: list[str],
    runs: Sequence[PlannedRun],
    columns: Mapping[str, Column],
    kinds: Kinds,
) -> list[FigureSpec]:
    found: list[FigureSpec] = []
    turned = top.boolean("tension_positive", False)
    for table in top.tables("figure"):
        name = table.name("name")
        if name in [other.name for other in found] or name == top.data.get("name"):
            table.complain("name", "the name is taken", name)
        kind = table.text("kind", required=True)
        if kind and kind not in kinds.figures:
            table.complain(
                "kind", f"unknown kind of figure{nearest(kind, kinds.figures)}", kind,
                sorted(kinds.figures),
            )  # fmt: skip
        options = {key: value for key, value in table.data.items() if key not in _FIGURE}
        known = kinds.options.get(kind)
        if known is not None:
            table.only([*_FIGURE, *sorted(known)])
            if "tension_positive" in known:
                options.setdefault("tension_positive", turned)
        check_options(table, options)
        for key in kinds.needed.get(kind, ()):
            if key not in options:
                table.problems.add(table.place, f"the key {key} is missing")
        for key in kinds.columns.get(kind, ()):
            if isinstance(options.get(key), (str, list)):
                table.choices(key, columns, "column")
        if isinstance(options.get("only"), Mapping):
            table.table("only").only(columns)
        chosen = table.choices("series", series, "series") or series
        _check_strains(table, [run for run in runs if run.series in chosen])
        found.append(
            FigureSpec(
                name=name,
                kind=kind,
                title=table.text("title", required=True),
                caption=table.text("caption"),
                alt=table.text("alt", required=True),
                series=tuple(chosen),
                options=options,
            )
        )
    return found


def _check_strains(table: Table, runs: Sequence[PlannedRun]) -> None:
    """The option `strain` of a figure needs frames there."""
    strains = table.data.get("strain", [])
    for strain in strains if isinstance(strains, list) else [strains]:
        if isinstance(strain, bool) or not isinstance(strain, (int, float)) or not runs:
            continue
        frames = [run.namelist.numbers("output", "frame_strains") for run in runs]
        if not any(has_frame(one, strain) for one in frames):
            there = ", ".join(f"{one:g}" for one in sorted({f for one in frames for f in one}))
            table.complain("strain", "none of its runs has a frame at this strain", strain, there)
