"""Measures of loads, of what a run costs, and of how far it is from equilibrium."""

from __future__ import annotations

import re

import numpy as np

from ..measure.limit_load import limit_load
from ..read.errors import RequestError
from ..read.run import Run
from .parts import Values, measure_group, value_or
from .types import Column, Missing, State

_LOAD = {
    "limit_load": Column(
        "N/m", "mean force of the first boundary that moves, along its motion, over the last fifth"
    ),
    "limit_load_change": Column("1", "its largest less its smallest there, over the mean"),
    "limit_load_reached": Column("1", "true: it changes by less than 1 %"),
    "load_peak": Column("N/m", "largest force of that boundary along its motion"),
    "load_end": Column("N/m", "the same at the end of the run"),
}
_EVALUATIONS = {
    "force_evaluations": Column("1", "evaluations of the forces: one a step, or a move"),
}
_BALANCES = {
    "unbalanced_force_largest": Column(
        "1", "largest sum of unbalanced forces over reactions and loads in the second half"
    ),
    "damping_share_largest": Column(
        "1", "largest part of reactions and loads that damping carries in the second half"
    ),
}


def _load(run: Run, state: State) -> Values:
    found = limit_load(run)
    reason = found.missing or "its force has no finite value"
    return {
        "limit_load": value_or(found.load, reason),
        "limit_load_change": value_or(found.change, reason),
        "limit_load_reached": Missing(reason) if found.missing else found.reached,
        "load_peak": value_or(found.peak, reason),
        "load_end": value_or(found.end, reason),
    }


def _evaluations(run: Run, state: State) -> Values:
    """From the log where the run is at equilibrium; a run that was continued tells a part only."""
    if run.value("integration.method") != "equilibrium":
        return {"force_evaluations": int(run.history()["step"][-1])}
    log = run.path.with_suffix(".log")
    try:
        text = log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        raise RequestError(f"there is no log {log}, which tells the evaluations") from None
    found = re.findall(
        r"^time loop .*, steps +(\d+), evaluations of the forces +(\d+)", text, re.MULTILINE
    )
    if not found or int(found[-1][0]) != int(run.history()["step"][-1]):
        raise RequestError(f"the log {log} does not tell the evaluations of the whole run")
    return {"force_evaluations": int(found[-1][1])}


def _balances(run: Run, state: State) -> Values:
    history = run.history()
    late = history["time"] >= 0.5 * history["time"][-1]
    return {
        f"{name}_largest": float(np.nanmax(history[name][late]))
        for name in ("unbalanced_force", "damping_share")
    }


LOAD = measure_group({_load: _LOAD})
COST = measure_group({_evaluations: _EVALUATIONS, _balances: _BALANCES})
