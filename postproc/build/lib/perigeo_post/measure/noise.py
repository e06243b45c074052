"""Noise of the displacement.

Zero-energy modes alternate from point to point, so a fourth difference shows them and hardly sees
the smooth part: u_{-2} - 4 u_{-1} + 6 u_0 - 4 u_1 + u_2 is 16 a for a field that alternates with
amplitude a. It is taken along both directions of the lattice, for both components.

Material that flows is told from the rest, because a control of zero-energy modes lets go there:
*inside* are points that have flowed, *outside* those with no such point within a horizon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..read.errors import RequestError
from ..read.points import BoolArray, FloatArray
from ..read.run import Frame, Run

FLOWS = 1.0e-6  # equivalent plastic strain from which on a point has flowed,
FLOWS_OF_YIELD = 1.0e-3  # or this part of the strain at yield, where that is less


@dataclass(frozen=True)
class Noise:
    """Of one frame; NaN where there is no such place."""

    outside: float  # rms amplitude of what alternates, over the spacing
    inside: float
    zero_outside: float  # rms of the field zero_energy
    zero_outside_largest: float
    zero_inside: float


def noise_of(frame: Frame) -> Noise:
    """Noise of a frame of a body on a lattice."""
    run = frame.run
    lattice = run.body_points.lattice
    if lattice is None:
        raise RequestError(f"{run.path} is no lattice, along which differences could be taken")
    body = run.body
    flowed = np.nan_to_num(lattice.grid(frame["plastic_strain"][body])) > flow_threshold(run)
    far = ~_spread(flowed, int(run.horizon / lattice.spacing * (1.0 + 1e-6)))
    found = alternating(lattice.grid(frame["displacement"][body])) / lattice.spacing
    zero = lattice.grid(frame["zero_energy"][body])
    there = np.isfinite(zero)
    return Noise(
        _rms(found[:, far]),
        _rms(found[:, flowed]),
        _rms(zero[far]),
        float(zero[far & there].max()) if (far & there).any() else float("nan"),
        _rms(zero[flowed]),
    )


def flow_threshold(run: Run) -> float:
    """Plastic strain above which a point counts as flowed; soft soils yield at small strains."""
    strength, modulus = run.number("material.yield_stress"), run.number("material.youngs_modulus")
    if not strength or not modulus:
        return FLOWS
    return min(FLOWS, FLOWS_OF_YIELD * strength / modulus)


def alternating(u: FloatArray) -> FloatArray:
    """Amplitude of what alternates, (2, ny, nx, c) along y and x; NaN where points are missing."""
    found = np.full((2, *u.shape), np.nan)
    for axis in (0, 1):
        v = np.moveaxis(u, axis, 0)
        if len(v) < 5:
            continue
        part = np.moveaxis(found[axis], axis, 0)
        part[2:-2] = (v[:-4] - 4.0 * v[1:-3] + 6.0 * v[2:-2] - 4.0 * v[3:-1] + v[4:]) / 16.0
    return found


def _spread(mask: BoolArray, reach: int) -> BoolArray:
    """Where the mask holds within so many places along either direction."""
    found = mask
    for axis in (0, 1):
        part = found.copy()
        for k in range(1, reach + 1):
            for ahead in (found, np.flip(found, axis)):
                moved = np.zeros_like(found)
                np.moveaxis(moved, axis, 0)[k:] = np.moveaxis(ahead, axis, 0)[:-k]
                part |= moved if ahead is found else np.flip(moved, axis)
        found = part
    return found


def _rms(values: FloatArray) -> float:
    """Root mean square of the finite values; NaN where there are none."""
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else float("nan")
