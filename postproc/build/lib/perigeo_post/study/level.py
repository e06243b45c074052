"""What a study file varies and sets: at its top, and in each of its series."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .tables import CaseTable, LevelTable
from .toml import Key, Problems
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


@dataclass(frozen=True)
class Blocks:
    """Settings that stand once in the file, and are put in where `use` names them."""

    settings: Mapping[str, Mapping[str, Any]]
    problems: Problems
    used: set[str] = field(default_factory=set)

    def edits(self, table: LevelTable | CaseTable, place: Key) -> list[Edit]:
        """The changes of a table: those of its blocks first, so that its own prevail."""
        names = self.problems.known((*place, "use"), table.use, self.settings, "block")
        self.used.update(names)
        theirs = [
            (("block", name, key), key, value)
            for name in names
            for key, value in self.settings[name].items()
        ]
        own = [((*place, "set", key), key, value) for key, value in table.set.items()]
        return [*theirs, *own]

    def check(self) -> None:
        """Complain about blocks that nothing uses."""
        for name in self.settings:
            if name not in self.used:
                self.problems.add(("block", name), f'nothing says use = "{name}"')


def level_of(table: LevelTable, place: Key, name: str, blocks: Blocks) -> Level:
    """The contents of a table of the study file; `name` stands for a title."""
    parameters = table.parameters.items()
    return Level(
        swept={key: value for key, value in parameters if isinstance(value, list)},
        fixed={key: value for key, value in parameters if not isinstance(value, list)},
        cases=[
            Case(case.label, dict(case.values), blocks.edits(case, (*place, "case", number)))
            for number, case in enumerate(table.case)
        ],
        edits=blocks.edits(table, place),
        measures=list(table.measures),
        label=table.label,
        strain=table.strain,
        line=table.line,
        sampled=table.sampled,
        base=table.base,
        place=place,
        title=table.title or name,
    )
