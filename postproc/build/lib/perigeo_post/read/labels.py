"""Labels of states: the strain where it tells them apart, else the time, else both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np


class State(Protocol):
    """What a label is made of."""

    @property
    def run(self) -> Any: ...

    @property
    def key(self) -> str: ...

    @property
    def time(self) -> float: ...

    @property
    def strain(self) -> float: ...

    @property
    def valid(self) -> bool: ...

    @property
    def number(self) -> int | None: ...


def labels_of(frames: Sequence[State]) -> list[str]:
    """A label for each of these frames of one or several runs: its strain, its time, or both.

    The time is told where the strain alone does not tell frames of a run apart, as in a cyclic
    test, or is 0 in a state that is not the first.
    """
    found: list[str] = []
    for frame in frames:
        others = [other for other in frames if other.run is frame.run]
        strains = [_strain_text(other.strain) for other in others]
        states = {other.key for other in others}
        apart = len(set(strains)) == len(states)
        nothing = any(s == _ZERO and other.time > 0.0 for s, other in zip(strains, others))
        text = _strain_text(frame.strain) if np.isfinite(frame.strain) else ""
        if not text or nothing or not apart:
            moves = text and set(strains) != {_ZERO}
            time = _time_text(frame.time, [other.time for other in others])
            text = f"{text}, {time}" if moves else time
        found.append(text if frame.valid else f"{text} (failing state)")
    return found


def _strain_text(strain: float) -> str:
    text = f"{100.0 * strain:.3g}"
    return f"ε = {0 if float(text) == 0.0 else text} %"


_ZERO = _strain_text(0.0)


def _time_text(time: float, times: Sequence[float]) -> str:
    """A time with as many digits as tell it from the others."""
    different = len(set(times))
    digits = next((d for d in range(4, 15) if len({f"{t:.{d}g}" for t in times}) == different), 15)
    return f"t = {time:.{digits}g} s"


def listed(frames: Sequence[State]) -> str:
    """The states that there are, for an error about one that is not."""
    if not frames:
        return "no frame is written yet"
    shown = [
        (f"{f.strain:.6g}" if np.isfinite(f.strain) else f"{f.time:.6g} s")
        + f" ({'failed' if f.number is None else f.number})"
        for f in frames
    ]
    if len(shown) > 16:
        shown = [*shown[:8], "...", *shown[-7:]]
    kind = "strain" if np.isfinite(frames[0].strain) else "time"
    return f"there are, by {kind} (number): {', '.join(shown)}"
