"""Measures of the control of zero-energy modes."""

from __future__ import annotations

from ..measure.noise import noise_of
from ..read.run import Run
from .parts import Values, frame_of, measure_group, value_or
from .types import Column, State

_NOISE = {
    "noise_outside": Column(
        "1", "amplitude of displacements that alternate over spacing, rms, away from flow"
    ),
    "noise_inside": Column("1", "the same where the material has flowed"),
    "zero_energy_outside": Column("1", "zero-energy measure, rms, away from flow"),
    "zero_energy_outside_largest": Column("1", "its largest value there"),
    "zero_energy_inside": Column("1", "zero-energy measure, rms, where the material has flowed"),
}
_SHARE = {
    "control_share": Column("1", "work of the control over all work, at the end"),
}


def _noise(run: Run, state: State) -> Values:
    found = noise_of(frame_of(run, state))
    nowhere = "there is no such place in this frame"
    return {
        "noise_outside": value_or(found.outside, nowhere),
        "noise_inside": value_or(found.inside, nowhere),
        "zero_energy_outside": value_or(found.zero_outside, nowhere),
        "zero_energy_outside_largest": value_or(found.zero_outside_largest, nowhere),
        "zero_energy_inside": value_or(found.zero_inside, nowhere),
    }


def _share(run: Run, state: State) -> Values:
    history = run.history()
    return {
        "control_share": float(history["stabilisation_energy"][-1] / history["external_work"][-1])
    }


CONTROL = measure_group({_noise: _NOISE, _share: _SHARE})
