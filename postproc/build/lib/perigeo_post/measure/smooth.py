"""Displacements without zero-energy modes, to be shown.

Where the material flows, displacements alternate from point to point: the modes cost no energy and
mean nothing. At every point of the body an affine field is fitted by weighted least squares to the
displacements of its family, itself included,

    sum_j w_ij |u_j - a_i - B_i xi_ij|^2 -> min      w_ij = V_j exp(-|xi|^2 / (2 s^2))

and a_i, its value at the point, is shown. It is exact for affine fields, at edges too. s is
horizon / sqrt(8), or 0.85 spacings where that is more, which takes alternating fields out.

Fictitious points keep their displacements: they are given, and take no part in the fits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from ..read.errors import RequestError
from ..read.fields import DERIVED, Field
from ..read.points import FloatArray
from ..read.run import Frame

IntArray = npt.NDArray[np.int64]

REACH = 1.0 + 1.0e-6  # of a family, in horizons: as in the program
WIDTH = 8.0**-0.5  # s over horizon
LEAST_WIDTH = 0.85  # s over spacing
SINGULAR = 1.0e-9  # of the fit: a family on a line says nothing across it
SOURCE = "displacement"
WORDS = "smoothed over families"


@dataclass(frozen=True)
class SmoothedFrame(Frame):
    """A frame that gives smoothed displacements, and what is derived from them."""

    def _stored(self, name: str) -> Field | None:
        found = super()._stored(name)
        if found is None or name != SOURCE:
            return found
        run = self.run
        keep = run.body & self.there & np.isfinite(found.values).all(axis=1)
        values = np.array(found.values, dtype=float)
        values[keep] = family_values(
            run.positions[keep], values[keep], np.abs(run.volumes[keep]), run.horizon
        )
        return replace(found, values=values, description=f"{found.description}, {WORDS}")


def smoothed(frame: Frame) -> SmoothedFrame:
    """The frame with its displacements smoothed."""
    if not np.isfinite(frame.run.horizon):
        raise RequestError(f"{frame.run.path} names no horizon, over which could be smoothed")
    return SmoothedFrame(**{one.name: getattr(frame, one.name) for one in fields(Frame)})


def smoothed_for(frame: Frame, field: str, deformed: float | None) -> Frame:
    """The same for a picture; an error where it shows no displacement."""
    if deformed is None and not shows_displacement(field):
        raise RequestError(
            f"there is no displacement to smooth in a picture of '{field}'; smoothing needs the "
            f"deformed shape or a field of the {SOURCE}"
        )
    return smoothed(frame)


def shows_displacement(field: str) -> bool:
    """Whether a field is made of displacements."""
    source = DERIVED[field].source if field in DERIVED else field.rpartition("_")[0]
    return source == SOURCE


def are_smoothed(frames: Sequence[Frame]) -> bool:
    """Whether any of the frames gives smoothed displacements."""
    return any(isinstance(frame, SmoothedFrame) for frame in frames)


def family_values(
    points: FloatArray, values: FloatArray, volumes: FloatArray, horizon: float
) -> FloatArray:
    """Values (n, c) of the affine fits over the families of n points."""
    if len(points) == 0:
        return values.copy()
    width = max(WIDTH * horizon, LEAST_WIDTH * float(np.sqrt(np.median(volumes))))
    scale = -0.5 / width**2
    found = np.empty_like(values)
    for own, near in _families(points, horizon * REACH):
        xi = points[near][None, :, :] - points[own][:, None, :]
        square = (xi**2).sum(axis=2)
        weight = volumes[near] * np.exp(scale * square)
        weight[square > (horizon * REACH) ** 2] = 0.0
        basis = np.concatenate([np.ones((*square.shape, 1)), xi / horizon], axis=2)
        weighed = (weight[:, :, None] * basis).transpose(0, 2, 1)
        inverse = np.linalg.pinv(weighed @ basis, rcond=SINGULAR, hermitian=True)
        # differences: a value that all have comes out to the last digit
        ahead = values[near][None, :, :] - values[own][:, None, :]
        found[own] = values[own] + (inverse[:, :1, :] @ (weighed @ ahead))[:, 0, :]
    return found


def _families(points: FloatArray, reach: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Points of a square of the plane, and all that may lie within reach of them."""
    squares: dict[tuple[int, int], list[int]] = {}
    for k, place in enumerate(np.floor(points / reach).astype(np.int64).tolist()):
        squares.setdefault((place[0], place[1]), []).append(k)
    around = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    for (x, y), own in squares.items():
        near = [k for dx, dy in around for k in squares.get((x + dx, y + dy), [])]
        yield np.array(own), np.array(near)
