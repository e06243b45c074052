"""How far a run can be trusted, as its result file tells: doubts, and the quality at its end.

The program writes both (doc/doubts.md); a file of an earlier version has neither.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .file import plain, read, text_of


@dataclass(frozen=True)
class Doubt:
    """A doubt that was told, the first of its kind."""

    name: str
    step: int  # 0: at the start
    value: float  # that was found then
    lower: float  # doubtful below; -inf: no such bound
    upper: float  # doubtful above; inf: no such bound
    meaning: str  # what is looked at

    @property
    def bound(self) -> str:
        """The threshold that was passed, in words; empty for kinds without one."""
        if self.value > self.upper:
            return f"above {self.upper:g}"
        if self.value < self.lower:
            return f"below {self.lower:g}"
        return ""


def doubts_of(path: Path) -> list[Doubt]:
    """The doubts that were told so far, in the order of their steps."""

    def find(file: Any) -> list[Doubt]:
        if "doubts" not in file:
            return []
        names, meanings, *numbers = (
            np.atleast_1d(file["doubts"][key][()])
            for key in ("name", "meaning", "step", "value", "lower", "upper")
        )
        if any(len(other) != len(names) for other in (meanings, *numbers)):
            raise ValueError("the doubts have columns of different lengths")
        found = [
            Doubt(
                text_of(name).strip(),
                int(step),
                float(value),
                _bound(lower),
                _bound(upper),
                text_of(meaning).strip(),
            )
            for name, meaning, step, value, lower, upper in zip(names, meanings, *numbers)
            if step >= 0
        ]
        return sorted(found, key=lambda doubt: doubt.step)

    return read(path, find)


def _bound(value: float) -> float:
    return float(value) if abs(value) < 1.0e300 else math.copysign(math.inf, value)


def quality_of(path: Path) -> dict[str, float]:
    """The quality at the end of the run; empty before, without what does not apply."""

    def find(file: Any) -> dict[str, float]:
        if "quality" not in file:
            return {}
        values = {key: float(plain(value)) for key, value in file["quality"].attrs.items()}
        return {key: value for key, value in values.items() if math.isfinite(value)}

    return read(path, find)
