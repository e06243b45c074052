"""The runs that a study file asks for: parameters and cases combined, and applied to the base."""

from __future__ import annotations

import hashlib
import itertools
import re
import string
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .expressions import Expression, ExpressionError, nearest
from .level import Case, Edit, Level
from .namelist import Namelist, NamelistError, file_names
from .tables import OF_THE_STUDY
from .toml import Problems
from .types import State, Value

MOST_RUNS = 1000
LONGEST_ID = 60
CHECKPOINT_SECONDS = 60.0  # between checkpoints, where neither base nor study says

_NOT_THE_MODEL = (*OF_THE_STUDY, "run.title", "output.checkpoint_every")


@dataclass(frozen=True)
class PlannedRun:
    """A run that the study asks for."""

    id: str
    label: str
    series: str
    parameters: dict[str, Value]
    namelist: Namelist
    files: dict[str, Path]  # of points: name beside the namelist -> where it comes from
    state: State
    measures: tuple[str, ...]

    @property
    def identity(self) -> str:
        """The same for runs that compute the same: of the input without names and titles."""
        digest = hashlib.sha256(self.namelist.text(leave_out=_NOT_THE_MODEL).encode())
        for name, path in sorted(self.files.items()):
            digest.update(name.encode() + hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()

    def input_text(self, study: str, title: str, folder: str) -> str:
        """The input file of the run, with results in `folder`."""
        namelist = self.namelist.copy()
        if not namelist.numbers("output", "checkpoint_every"):
            namelist.change("output.checkpoint_every", CHECKPOINT_SECONDS)
        namelist.change("run.name", self.id)
        namelist.change("run.output_dir", folder)
        if "title" not in namelist.named("run")[0].entries:
            namelist.change("run.title", f"{title}: {self.label}"[:200])
        return f"! Run {self.id} of the study {study}.\n{namelist.text()}"


class Planner:
    """Makes the runs of a study from its levels."""

    def __init__(self, base: Namelist, folders: list[Path], problems: Problems) -> None:
        self.base = base
        self.folders = folders  # where files of points are looked for
        self.problems = problems
        self.runs: list[PlannedRun] = []

    def add_series(self, series: str, level: Level, prefix: str, alone: str) -> None:
        """Every combination of cases and parameters, in the order of the file.

        Names of runs begin with `prefix`; a run with nothing varied is called `alone`.
        """
        count = max(1, len(level.cases))
        for values in level.swept.values():
            count *= len(values)
        if len(self.runs) + count > MOST_RUNS:
            self.problems.add(level.at("parameters"), f"more than {MOST_RUNS} runs", count)
            return
        labels: dict[str, str] = {}
        for number, case in enumerate(level.cases or [Case()]):
            clash = [key for key in case.values if key in level.swept]
            if clash:
                place = level.at("case", number, "values", clash[0])
                self.problems.add(place, f"{clash[0]} is one of the parameters too")
                continue
            for combination in itertools.product(*level.swept.values()):
                swept = dict(zip(level.swept, combination))
                run = self._run(series, level, case, number, swept)
                if run is None:
                    continue
                run = self._with_id(run, prefix, alone)
                if run.label in labels:
                    what = f"the runs {labels[run.label]} and {run.id} have the same label"
                    self.problems.add(level.at("label"), what, run.label)
                labels[run.label] = run.id
                self.runs.append(run)

    def _run(
        self, series: str, level: Level, case: Case, number: int, swept: dict[str, Value]
    ) -> PlannedRun | None:
        parameters = self._parameters(level, case, swept)
        if parameters is None:
            return None
        label = self._label(level, case, number, swept, parameters)
        namelist, good = self._namelist([*level.edits, *case.edits], parameters)
        state = self._state(level, parameters, namelist, label or _slug(case, number, swept))
        if not good or label is None:
            return None
        return PlannedRun(
            id=_slug(case, number, swept),
            label=label,
            series=series,
            parameters=parameters,
            namelist=namelist,
            files=self._take_files(namelist),
            state=state,
            measures=tuple(level.measures),
        )

    def _parameters(
        self, level: Level, case: Case, swept: dict[str, Value]
    ) -> dict[str, Value] | None:
        """All parameters of a run; those that depend on others are computed last."""
        found: dict[str, Value] = dict(swept)
        later: dict[str, Expression] = {}
        for key, value in level.fixed.items():
            if isinstance(value, Expression):
                later[key] = value
            elif value is not None:
                found[key] = value
        found.update(case.values)
        for key, expression in later.items():
            if key in case.values:
                continue
            try:
                found[key] = expression.value(found)
            except ExpressionError as error:
                self.problems.add(level.at("parameters", key), str(error))
                return None
        return found

    def _namelist(
        self, edits: list[Edit], parameters: Mapping[str, Value]
    ) -> tuple[Namelist, bool]:
        """The base with all changes, and whether all could be made."""
        namelist = self.base.copy()
        for group in namelist.named("run"):
            group.entries.pop("title", None)
        if not namelist.named("run"):
            namelist.change("run.name", "run")
            namelist.groups.insert(0, namelist.groups.pop())
        good = True
        for place, key, raw in edits:
            try:
                value = _valued(raw, parameters)
                if value is not None:
                    namelist.change(key, value)
            except (ExpressionError, NamelistError) as error:
                self.problems.add(place, str(error))
                good = False
        return namelist, good

    def _label(
        self,
        level: Level,
        case: Case,
        number: int,
        swept: dict[str, Value],
        parameters: dict[str, Value],
    ) -> str | None:
        """The template of the file filled in, or the label of the case and what is varied."""
        own = case.label or ", ".join(f"{k} = {_plain(v)}" for k, v in case.values.items())
        if not own and level.cases:
            own = f"case {number + 1}"
        if not level.label:
            parts = [own] if own else []
            parts += [f"{key} = {_plain(value)}" for key, value in swept.items()]
            return ", ".join(parts) or level.title
        known = {**parameters, "case": own}
        place = level.at("label")
        try:
            for _, name, _, _ in string.Formatter().parse(level.label):
                if name is not None and name not in known:
                    what = f"unknown name {{{name}}}{nearest(name, known)}"
                    self.problems.add(place, what, level.label, known)
                    return None
            return level.label.format(**known)
        except (ValueError, IndexError, KeyError) as error:
            self.problems.add(place, f"is no label: {error}", level.label)
            return None

    def _state(
        self, level: Level, parameters: Mapping[str, Value], namelist: Namelist, label: str
    ) -> State:
        """Where measures are taken. Those at a strain need a frame there."""
        at = level.at
        try:
            strain = _number(_valued(level.strain, parameters))
        except ExpressionError as error:
            self.problems.add(at("strain"), str(error))
            strain = None
        frames = namelist.numbers("output", "frame_strains")
        if strain is not None and not has_frame(frames, strain):
            self.problems.add(
                at("strain"), f"the run '{label}' has no frame at this strain", strain,
                "output.frame_strains: " + ", ".join(f"{frame:g}" for frame in frames),
            )  # fmt: skip
        line = None
        try:
            if level.line is not None:
                first, second = (
                    (_number(x) or 0.0, _number(y) or 0.0)
                    for x, y in _valued(level.line, parameters)
                )
                line = (first, second)
        except ExpressionError as error:
            self.problems.add(at("line"), str(error))
        return State(strain=strain, line=line)

    def _take_files(self, namelist: Namelist) -> dict[str, Path]:
        """Files of points go beside the namelist of the run."""
        found: dict[str, Path] = {}
        for group, name in file_names(namelist):
            source = next((f / name for f in self.folders if (f / name).is_file()), None)
            if source is None:
                self.problems.add(("base",), "the file of points is not there", name)
                continue
            group.entries["file"] = [f"'{source.name}'"]
            found[source.name] = source
        return found

    def _with_id(self, run: PlannedRun, prefix: str, alone: str) -> PlannedRun:
        """The run with a name that no other has."""
        name = "_".join(part for part in (prefix, run.id) if part) or alone
        if len(name) > LONGEST_ID:
            name = f"{name[: LONGEST_ID - 9]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
        taken = {other.id for other in self.runs}
        names = itertools.chain([name], (f"{name}_{k}" for k in itertools.count(2)))
        return replace(run, id=next(one for one in names if one not in taken))


def has_frame(frames: list[float], strain: float) -> bool:
    """Whether one of the strains asked for is this one; true where none were asked for."""
    return not frames or min(abs(frame - strain) for frame in frames) <= 0.02 * abs(strain)


def _valued(raw: Any, parameters: Mapping[str, Value]) -> Any:
    if isinstance(raw, Expression):
        return raw.value(parameters)
    if isinstance(raw, list):
        return [_valued(item, parameters) for item in raw]
    return raw


def _number(value: Any) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ExpressionError(f"must be a number, not {value!r}")
    return float(value)


def _plain(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else f"{value}"


def _slug(case: Case, number: int, swept: dict[str, Value]) -> str:
    """A name made of what is varied; it stays when further values are added to the study."""
    parts = []
    if case.label or case.values or case.edits:
        words = case.label or "_".join(f"{k}_{_plain(v)}" for k, v in case.values.items())
        parts.append(_name_of(words) or f"case{number + 1}")
    parts += [_name_of(f"{key}_{_plain(value)}") for key, value in swept.items()]
    return "_".join(parts)


def _name_of(text: str) -> str:
    text = re.sub(r"(?<=\d)\.(?=\d)", "p", text.lower())
    text = re.sub(r"(?:(?<=[_\s])|(?<=\de))-(?=\d)", "m", text)
    return re.sub(r"[^a-z0-9]+", "_", text).strip("_")
