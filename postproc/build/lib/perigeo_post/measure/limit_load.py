"""Limit loads: whether the force of a boundary that moves has settled.

The force along its motion is looked at over the last fifth of its way: where it changes by less
than 1 %, the load is a limit. Only forces of the history and the prescribed motion are needed, so
that runs in time and runs at equilibrium are judged alike.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..read.errors import PostError, RequestError
from ..read.history import History
from ..read.points import FloatArray
from ..read.run import Run

LAST = 0.2  # part of the way that is looked at
CHANGE = 0.01  # by which the force may change there
ROUND_OFF = 1e-9
ROWS = 4  # of the history in that part, at the least
AXES = ("x", "y")


@dataclass(frozen=True)
class LimitLoad:
    """The force of a boundary on the body along its motion."""

    boundary: str
    way: float  # [m] how far it has moved
    load: float  # [N/m] mean of the last part of the way
    change: float  # largest less smallest of that part, over the mean
    reached: bool  # it changes by less than CHANGE
    peak: float  # [N/m] the one farthest from 0
    end: float  # [N/m] that of the last row
    time_at_peak: float  # [s]
    strain_at_peak: float  # nominal strain; NaN without platens
    missing: str = ""  # why it is not known whether the limit is reached


def limit_loads(run: Run) -> list[LimitLoad]:
    """One entry for each boundary whose motion is prescribed and not zero, in their order."""
    history = run.history()
    names = [name for name in run.boundary_names if f"{name}_force_x" in history]
    moving = {name: _way(run, name, history["time"]) for name in names}
    return [_limit_load(name, way, history) for name, way in moving.items() if way is not None]


def limit_load(run: Run, boundary: str | None = None) -> LimitLoad:
    """That of a boundary, by default of the first that moves."""
    found = limit_loads(run)
    for one in found:
        if boundary in (None, one.boundary):
            return one
    raise RequestError(
        f"{run.path} has no boundary {boundary or ''}".rstrip() + " with a motion of its own; "
        f"there are: {', '.join(one.boundary for one in found) or 'none'}"
    )


def _limit_load(name: str, way: tuple[FloatArray, FloatArray], history: History) -> LimitLoad:
    path, place = way
    # Rows after the boundary has come to rest do not count, however many there are.
    first, end = np.searchsorted(path, (np.array([1.0 - LAST, 1.0]) - ROUND_OFF) * path[-1])
    late = slice(int(first), int(end) + 1)
    direction = place[end] - place[first]
    length = float(np.hypot(*direction))
    size = len(path)
    force = np.column_stack([history[f"{name}_force_{axis}"][:size] for axis in AXES])
    along = force @ (direction / length) if length > 0.0 else np.full(size, np.nan)
    last = along[late]
    mean = float(last.mean())
    change = float(np.ptp(last)) / abs(mean) if mean != 0.0 else float("nan")
    missing = ""
    if len(last) < ROWS:
        missing = f"the last fifth of its way has fewer than {ROWS} rows of the history"
    elif not np.isfinite(change):
        missing = "it has no force along its motion"
    top = int(np.nanargmax(np.abs(along))) if np.isfinite(along).any() else 0
    return LimitLoad(
        boundary=name,
        way=float(path[-1]),
        load=mean,
        change=change,
        reached=not missing and change < CHANGE,
        peak=float(along[top]),
        end=float(along[-1]),
        time_at_peak=float(history["time"][top]),
        strain_at_peak=float(history["strain"][top]) if "strain" in history else float("nan"),
        missing=missing,
    )


def _way(run: Run, name: str, time: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Length of the way and displacement (rows, 2) [m] of a boundary; None where it is at rest.

    Velocities are linear between the times of a table and constant before and after it.
    """
    if len(time) < 2:
        return None
    times = _numbers(run, name, "times")
    given = [_numbers(run, name, f"velocities_{axis}") for axis in AXES]
    if not len(times) or not any(len(values) for values in given):
        velocity = _numbers(run, name, "velocity")
        if len(velocity) != len(AXES):
            return None  # affine, or under a load: there is no one motion
        times, given = np.zeros(1), [velocity[k : k + 1] for k in range(len(AXES))]
    # Corners of the table lie between rows, so that the integral is exact.
    all_times = np.union1d(time, times[(times > time[0]) & (times < time[-1])])
    rates = np.column_stack(
        [np.interp(all_times, times, v) if len(v) else 0.0 * all_times for v in given]
    )
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(all_times)[:, None]
    place = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    if path[-1] == 0.0:
        return None
    rows = np.searchsorted(all_times, time)
    return path[rows], place[rows]


def _numbers(run: Run, name: str, key: str) -> FloatArray:
    """Numbers of a key of a boundary as used; none where it has none."""
    if (run.values.get(f"boundary({name}).contact") or "").strip("' ") == "affine":
        return np.zeros(0)
    if not (run.values.get(f"boundary({name}).traction") or "none").startswith("none"):
        return np.zeros(0)
    text = run.values.get(f"boundary({name}).{key}") or "none"
    if text == "none":
        return np.zeros(0)
    try:
        parts = [re.sub("[dD]", "e", part) for part in re.split(r"[,\s]+", text) if part]
        return np.array([float(part) for part in parts])
    except ValueError:
        raise PostError(
            f"{run.path}: boundary({name}).{key} = {text} is no list of numbers"
        ) from None
