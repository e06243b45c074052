"""What the groups of columns of a study are made of: parts that may fail each by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Union

import numpy as np

from ..read.errors import PostError
from ..read.run import Frame, Run
from .types import Column, Measure, Missing, State, Value

Values = dict[str, Union[Value, Missing]]
Part = Callable[[Run, State], Values]


def measure_group(parts: Mapping[Part, Mapping[str, Column]]) -> Measure:
    """A group of columns: what gives values, each with its columns, may fail by itself."""

    def take(run: Run, state: State) -> Values:
        found: Values = {}
        for part, columns in parts.items():
            try:
                values = part(run, state)
            except (PostError, ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
                reason = str(error) if isinstance(error, PostError) else type(error).__name__
                found.update(dict.fromkeys(columns, Missing(reason)))
            else:
                found.update({name: plain_value(values[name]) for name in columns})
        return found

    return Measure({k: v for columns in parts.values() for k, v in columns.items()}, take)


def plain_value(value: Value | Missing) -> Value | Missing:
    """Python's own numbers, a reason for what is not finite."""
    if isinstance(value, (bool, str, int, Missing)):
        return value
    number = float("nan") if value is None else float(value)
    return number if np.isfinite(number) else Missing("it has no finite value in this run")


def value_or(value: Value, reason: str) -> Value | Missing:
    """A value; the reason where it is none or not finite."""
    found = plain_value(value)
    return Missing(reason) if isinstance(found, Missing) else found


def frame_of(run: Run, state: State) -> Frame:
    """The frame of a state: the nearest to its strain, or the last."""
    return run.frame(state.strain)
