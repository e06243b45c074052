"""How nearly a run was in equilibrium at all times, as a quasi-static test should be.

Two numbers, both small in a good run (doc/measures.md):

* *kinetic ratio*: kinetic energy of v - v_ref over internal energy, which is strain energy and
  plastic dissipation. v_ref is the frame of the damping: linear between the platens, or 0 at rest.
* *reaction gap*: |first + second|, the sum of the normal forces of the two platens, which should
  balance, over the largest reaction of either so far.

Velocities are known at the frames, and only there is the kinetic ratio exact. From the history,
which holds the kinetic energy of v, follows a bound (`kinetic_bound`): by the triangle inequality
sqrt(T) <= sqrt(T_v) + sqrt(T_ref), with T_ref the kinetic energy of v_ref.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..read.errors import RequestError
from ..read.history import History
from ..read.points import FloatArray
from ..read.run import Frame, Run
from .curves import Curve, label_of_run

START = 5.0e-4  # nominal strain before which the internal energy is too small to divide by
KINETIC = "kinetic_ratio"
GAP = "reaction_gap"


@dataclass(frozen=True)
class KineticState:
    """Energies of one frame [J/m]."""

    strain: float
    relative: float  # of v - v_ref
    reference: float  # of v_ref
    internal: float  # strain energy and plastic dissipation

    @property
    def ratio(self) -> float:
        """Kinetic energy of v - v_ref over internal energy; NaN where there is none."""
        return self.relative / self.internal if self.internal > 0.0 else float("nan")


def damping_frame(run: Run) -> str:
    """The frame of the damping, "platens" or "rest"."""
    return (run.value("integration.damping_frame") or "rest").strip("'\" ")


def reference_velocity(frame: Frame) -> FloatArray:
    """v_ref at all points of a frame (n, 2) [m/s]; 0 where the damping is against rest."""
    run = frame.run
    found = np.zeros((len(run.positions), 2))
    if damping_frame(run) != "platens" or run.platens is None:
        return found
    k = 0 if run.strain_axis == "x" else 1
    ends = np.array([_platen_velocity(frame, name, k) for name in run.platens])
    part = np.clip((run.positions[:, k] - run.lower[k]) / run.length, 0.0, 1.0)
    return np.asarray(ends[0] + part[:, None] * (ends[1] - ends[0]))


def _platen_velocity(frame: Frame, name: str, k: int) -> FloatArray:
    """Prescribed velocity of a platen; along a smooth one nothing is prescribed, v_ref is 0."""
    run = frame.run
    points = run.boundary == run.boundary_names.index(name) + 1
    if not points.any():
        raise RequestError(f"{run.path} holds no points of the platen {name}")
    velocity = frame["velocity"][points].mean(axis=0)
    contact = (run.values.get(f"boundary({name}).contact") or "rough").strip("'\" ")
    if contact == "smooth":
        velocity[1 - k] = 0.0
    return np.asarray(velocity)


def kinetic_state(frame: Frame, history: History | None = None) -> KineticState:
    """Energies of one frame: kinetic from its velocities, internal from the history."""
    run = frame.run
    density = run.number("material.density")
    if density is None:
        raise RequestError(f"{run.path} does not say the density of its material")
    history = history or run.history()
    internal = history["strain_energy"] + history["plastic_dissipation"]
    mass = density * run.volumes
    reference = reference_velocity(frame)
    relative = frame["velocity"] - reference
    return KineticState(
        frame.strain,
        float(0.5 * np.sum(mass * np.sum(relative**2, axis=1))),
        float(0.5 * np.sum(mass * np.sum(reference**2, axis=1))),
        float(np.interp(frame.time, history["time"], internal)),
    )


def kinetic_curve(run: Run, label: str | None = None) -> Curve:
    """Kinetic energy of v - v_ref over internal energy at the frames, over nominal strain."""
    history = run.history()
    states = [kinetic_state(frame, history) for frame in run.frames()]
    states = [state for state in states if state.internal > 0.0]  # not the unloaded one
    return Curve(
        label or label_of_run(run),
        np.array([state.strain for state in states]),
        np.array([state.ratio for state in states]),
        "strain", "1", KINETIC, "1",
    )  # fmt: skip


def kinetic_bound(run: Run, label: str | None = None) -> Curve:
    """Upper bound of the kinetic ratio at every row of the history.

    The kinetic energy of v_ref is interpolated between frames; platens of constant velocity keep
    it. Where the damping is against rest the bound is the ratio itself.
    """
    history = run.history()
    frames = run.frames()
    if not frames or run.strain_axis is None:
        raise RequestError(f"{run.path} has no frame or no platens")
    there = [kinetic_state(frame, history).reference for frame in frames]
    reference = np.interp(history["time"], [frame.time for frame in frames], there)
    kinetic = (np.sqrt(np.abs(history["kinetic_energy"])) + np.sqrt(reference)) ** 2
    internal = history["strain_energy"] + history["plastic_dissipation"]
    good = internal > 0.0
    return Curve(
        label or label_of_run(run), history["strain"][good], kinetic[good] / internal[good],
        "strain", "1", KINETIC, "1",
    )  # fmt: skip


def reaction_gap(run: Run, label: str | None = None) -> Curve:
    """Sum of the normal forces of the platens over the largest so far, over nominal strain."""
    if run.platens is None or run.strain_axis is None:
        raise RequestError(f"{run.path} has no platens, so there are no reactions to compare")
    history = run.history()
    first, second = (history[f"{name}_force_{run.strain_axis}"] for name in run.platens)
    largest = np.maximum.accumulate(np.maximum(np.abs(first), np.abs(second)))
    gap = np.abs(first + second)
    good = largest > 0.0
    return Curve(
        label or label_of_run(run), history["strain"][good], gap[good] / largest[good],
        "strain", "1", GAP, "1",
    )  # fmt: skip


def largest_after(curve: Curve, start: float = START) -> float:
    """Largest value of a curve beyond a strain; NaN where the curve ends before."""
    late = curve.y[np.abs(curve.x) >= start * (1.0 - 1e-6)]
    return float(np.nanmax(late)) if len(late) and np.isfinite(late).any() else float("nan")
