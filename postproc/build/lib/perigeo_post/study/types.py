"""What a study consists of: its runs as measures and figures see them, and what they give back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Callable, Union

from matplotlib.figure import Figure

from ..measure.band import Line
from ..read.run import Run

Value = Union[float, int, str, bool, None]


@dataclass(frozen=True)
class State:
    """Where the measures of a run are taken."""

    strain: float | None = None  # nominal strain; None: the last frame
    line: Line | None = None  # of the profile; None: across the prevailing band
    sampled: float | None = (
        None  # spacing of the lattice at which bands are read [m]; None: its own
    )


@dataclass(frozen=True)
class Column:
    """What a column of the table of runs holds."""

    unit: str  # "1" where there is none
    description: str


@dataclass(frozen=True)
class Missing:
    """Stands for a value that cannot be had."""

    reason: str


@dataclass(frozen=True)
class Measure:
    """A group of columns measured together; `columns` has an entry for each key it returns."""

    columns: Mapping[str, Column]
    take: Callable[[Run, State], Mapping[str, Value | Missing]]


@dataclass(frozen=True)
class StudyRun:
    """One run of a study that has a result."""

    id: str
    label: str
    series: str
    parameters: Mapping[str, Value]
    row: Mapping[str, Value]  # what was measured
    run: Run
    state: State = State()
    series_title: str = ""


@dataclass(frozen=True)
class Drawing:
    """A figure and the numbers in it, as rows with the same keys."""

    figure: Figure
    rows: Sequence[Mapping[str, Value]] = field(default_factory=list)


# A kind of figure: the runs, its options from the study file, the columns of the table.
Draw = Callable[[Sequence[StudyRun], Mapping[str, Any], Mapping[str, Column]], Drawing]
