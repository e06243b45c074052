"""The runs that a study file asks for: parameters and cases combined, and applied to the base."""

from __future__ import annotations

import copy
import hashlib
import itertools
import re
import string
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .expressions import Expression, ExpressionError, nearest
from .inputs import InputError, Inputs, Values, said_of, setting_of, unquoted, written
from .level import Case, Edit, Level
from .tables import OF_THE_STUDY
from .toml import Key, Problems
from .types import State, Value

MOST_RUNS = 1000
LONGEST_ID = 48  # of the program too
CHECKPOINT_SECONDS = 60.0  # between checkpoints, where neither base nor study says

_NOT_THE_MODEL = (*OF_THE_STUDY, "run.title", "output.checkpoint_every")


@dataclass(frozen=True)
class PlannedRun:
    """A run that the study asks for."""

    id: str
    label: str
    series: str
    parameters: dict[str, Value]
    values: Values  # as used
    given: frozenset[str]  # the keys that the study sets
    files: dict[str, Path]  # of points: name beside the input -> where it comes from
    state: State
    measures: tuple[str, ...]

    @property
    def identity(self) -> str:
        """The same for runs that compute the same: of the input without names and titles."""
        digest = hashlib.sha256(self.values.text(leave_out=_NOT_THE_MODEL).encode())
        for name, path in sorted(self.files.items()):
            digest.update(name.encode() + hashlib.sha256(path.read_bytes()).digest())
        return digest.hexdigest()

    def input_text(self, study: str, title: str, folder: str) -> str:
        """The input file of the run, with results in `folder`."""
        values = copy.deepcopy(self.values)
        every = values.numbers("output", "checkpoint_every")
        if "output.checkpoint_every" not in self.given and not any(every):
            values.put("output", "checkpoint_every", CHECKPOINT_SECONDS)
        values.put("run", "name", self.id)
        values.put("run", "output_dir", folder)
        if "run.title" not in self.given:
            values.put("run", "title", f"{title}: {self.label}"[:200])
        return f"! Run {self.id} of the study {study}.\n{values.text()}"


class Planner:
    """Makes the runs of a study from its levels."""

    def __init__(self, study: Path, inputs: Inputs, problems: Problems) -> None:
        self.folder = study.parent
        self.inputs = inputs
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
        edits = [*level.edits, *case.edits]
        base = self.folder / level.base
        values = self._values(base, edits, parameters)
        state = self._state(level, parameters, values, label or _slug(case, number, swept))
        if values is None or label is None:
            return None
        return PlannedRun(
            id=_slug(case, number, swept),
            label=label,
            series=series,
            parameters=parameters,
            values=values,
            given=frozenset(key.lower() for _, key, _ in edits),
            files=self._take_files(base, values),
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

    def _values(
        self, base: Path, edits: list[Edit], parameters: Mapping[str, Value]
    ) -> Values | None:
        """The values of the base with all changes; None where there are mistakes."""
        # A base without a name is none that the program takes; each run gets its own later.
        settings: list[tuple[str, Key]] = [("run.name=run", ())]
        good = True
        for place, key, raw in edits:
            try:
                value = _valued(raw, parameters)
                if value is not None:
                    settings.append((setting_of(key, value), place))
            except (ExpressionError, InputError) as error:
                self.problems.add(place, str(error))
                good = False
        try:
            values = self.inputs.values(base, self.folder, [text for text, _ in settings])
        except InputError as error:
            self._blame(error.lines, settings, good)
            return None
        return values if good else None

    def _blame(self, lines: list[str], settings: list[tuple[str, Key]], complete: bool) -> None:
        """Say what the program found at the places of the study file that it is about.

        Where not all settings are known, what it says of the rest may come of that.
        """
        whose = "with the settings of a run" if len(settings) > 1 else "has a mistake"
        for line in lines:
            for text, place in reversed(settings):
                what = said_of(text, line)
                if what is not None and place:
                    self.problems.add(place, what)
                    break
            else:
                if complete:
                    self.problems.add(("base",), f"the base {whose}: {line}")

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
        self, level: Level, parameters: Mapping[str, Value], values: Values | None, label: str
    ) -> State:
        """Where measures are taken. Those at a strain need a frame there."""
        at = level.at
        try:
            strain = _number(_valued(level.strain, parameters))
        except ExpressionError as error:
            self.problems.add(at("strain"), str(error))
            strain = None
        frames = values.numbers("output", "frame_strains") if values is not None else []
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
        sampled = None
        try:
            sampled = _number(_valued(level.sampled, parameters))
            if sampled is not None and sampled <= 0.0:
                raise ExpressionError(f"must be above 0, not {sampled:g}")
        except ExpressionError as error:
            self.problems.add(at("sampled"), str(error))
        return State(strain=strain, line=line, sampled=sampled)

    def _take_files(self, base: Path, values: Values) -> dict[str, Path]:
        """Files of points go beside the input of the run."""
        found: dict[str, Path] = {}
        for _, entries in (group for group in values.groups if "file" in group[1]):
            name = unquoted(entries["file"])
            folders = (base.parent, self.folder)
            source = next((f / name for f in folders if (f / name).is_file()), None)
            if source is None:
                self.problems.add(("base",), "the file of points is not there", name)
                continue
            entries["file"] = written(source.name)
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
