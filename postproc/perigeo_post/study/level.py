"""What a study file varies and sets: at its top, and in each of its series."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .tables import CaseTable, LevelTable
from .toml import Key
from .types import Value

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
    sampled: Any
    base: str
    place: Key
    title: str

    def at(self, *key: Any) -> Key:
        """Place of a key in the study file."""
        return (*self.place, *key)

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
            sampled=top.sampled if self.sampled is None else self.sampled,
            base=self.base or top.base,
            place=self.place,
            title=self.title,
        )


def level_of(table: LevelTable, place: Key, name: str) -> Level:
    """The contents of a table of the study file; `name` stands for a title."""
    parameters = table.parameters.items()
    return Level(
        swept={key: value for key, value in parameters if isinstance(value, list)},
        fixed={key: value for key, value in parameters if not isinstance(value, list)},
        cases=[
            Case(case.label, dict(case.values), _edits(case, (*place, "case", number)))
            for number, case in enumerate(table.case)
        ],
        edits=_edits(table, place),
        measures=list(table.measures),
        label=table.label,
        strain=table.strain,
        line=table.line,
        sampled=table.sampled,
        base=table.base,
        place=place,
        title=table.title or name,
    )


def _edits(table: LevelTable | CaseTable, place: Key) -> list[Edit]:
    return [((*place, "set", key), key, value) for key, value in table.set.items()]
