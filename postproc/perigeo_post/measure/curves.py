"""Curves and numbers from the history: stress-strain, peak, apparent modulus, energies."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..read.errors import RequestError
from ..read.points import BoolArray, FloatArray
from ..read.run import Run
from ..read.shown import Short

MODULUS_RANGE = (2.0e-4, 1.0e-3)  # nominal strain, between which the modulus is fitted
ENERGY_UNITS = ("J/m", "J")


@dataclass(frozen=True, repr=False)
class Curve(Short):
    """One quantity against another."""

    label: str
    x: FloatArray
    y: FloatArray
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    tension_positive: bool = False
    downwards: bool = False  # y is drawn downwards

    def toward(self, strain: float) -> float:
        """The x of a strain that is given without a sign: in the direction of loading.

        That is the side of 0 on which the curve goes farther, so that 1 % means 1 % of tension
        in a test in tension. A strain below 0 is taken as it is, compression positive.
        """
        turned = -1.0 if self.tension_positive else 1.0
        if strain < 0.0 or len(self.x) == 0:
            return turned * strain
        back = np.nanmax(-turned * self.x) > np.nanmax(turned * self.x)
        return -turned * strain if back else turned * strain

    def at(self, x: float) -> float:
        """y where the curve first reaches x, linearly interpolated; NaN where it never does."""
        ahead = self.x - x
        exact = np.flatnonzero(ahead == 0.0)
        passed = np.flatnonzero(ahead[:-1] * ahead[1:] < 0.0)
        if len(exact) and (not len(passed) or exact[0] <= passed[0]):
            return float(self.y[exact[0]])
        if not len(passed):
            return float("nan")
        k = int(passed[0])
        part = ahead[k] / (ahead[k] - ahead[k + 1])
        return float(self.y[k] + part * (self.y[k + 1] - self.y[k]))


@dataclass(frozen=True)
class Modulus:
    """Apparent modulus of the plane strain compression test."""

    value: float  # [Pa] = (1 - nu^2) slope
    slope: float  # [Pa] of stress against strain
    poissons_ratio: float
    rows: int  # of the history in the range of the fit
    strain_range: tuple[float, float]


def label_of_run(run: Run) -> str:
    """Text for legends."""
    return run.name


def axial_stress(run: Run, platen: str = "first") -> FloatArray:
    """Normal reaction of a platen over the width of the body [Pa], compression positive.

    "first" is the platen at the lower coordinate (the bottom one), "second" the other.
    """
    if platen not in ("first", "second"):
        raise RequestError(f"the platen must be first or second, not {platen!r}")
    if run.platens is None or run.strain_axis is None:
        raise RequestError(
            f"{run.path} has no platens, so there is no axial stress; columns of the history are "
            "drawn with --y, 'perigeo-post info' lists them"
        )
    first = platen == "first"
    name = run.platens[0 if first else 1]
    force = run.history()[f"{name}_force_{run.strain_axis}"]
    return np.asarray((force if first else -force) / run.width)


def stress_strain(
    run: Run, tension_positive: bool = False, platen: str = "first", label: str | None = None
) -> Curve:
    """Axial stress against nominal strain, compression positive unless asked otherwise."""
    sign = -1.0 if tension_positive else 1.0
    stress = axial_stress(run, platen)
    history = run.history()
    strain = history["strain"]
    count = min(len(stress), len(strain))  # a row may have been added between the two readings
    return Curve(
        label or label_of_run(run),
        sign * strain[:count],
        sign * stress[:count],
        "strain",
        history.unit("strain"),
        "axial_stress",
        "Pa",  # a force per thickness over a width
        tension_positive,
    )


def history_curve(
    run: Run, column: str, against: str | None = None, label: str | None = None
) -> Curve:
    """A history column against another, by default the strain, or time without platens."""
    history = run.history()
    against = against or ("strain" if "strain" in history else "time")
    return Curve(
        label or label_of_run(run),
        history[against],
        history[column],
        against,
        history.unit(against),
        column,
        history.unit(column),
    )


def column_curves(
    runs: Sequence[Run],
    columns: Sequence[str],
    against: str | None = None,
    labels: Sequence[str] | None = None,
) -> list[Curve]:
    """Columns of one unit of the histories of some runs, against another column."""
    names = labels or [label_of_run(run) for run in runs]
    found = []
    for run, name in zip(runs, names):
        for column in columns:
            words = column.replace("_", " ")
            label = name if len(columns) == 1 else words if len(runs) == 1 else f"{name}, {words}"
            found.append(history_curve(run, column, against, label))
    units = dict.fromkeys(f"{c.y_name} [{c.y_unit}]" for c in found)
    if len({c.y_unit for c in found}) > 1:
        raise RequestError(f"columns of different units in one figure: {', '.join(units)}")
    if len({c.x_name for c in found}) > 1:
        raise RequestError("some runs have a strain and some have none: say --x time")
    return found


def settlement_curves(
    runs: Sequence[Run], boundary: str, labels: Sequence[str] | None = None
) -> list[Curve]:
    """Settlement of a boundary against the load on it, both positive downwards."""
    found = []
    for run, name in zip(runs, labels or [label_of_run(run) for run in runs]):
        history = run.history()
        force, way = f"{boundary}_force_y", f"{boundary}_displacement_y"
        there = [column[: -len("_force_y")] for column in history if column.endswith("_force_y")]
        if boundary not in there:
            raise RequestError(f"{run.path} has no boundary {boundary!r}: {', '.join(there)}")
        found.append(
            Curve(
                name,
                0.0 - history[force],
                0.0 - history[way],
                f"{boundary}_load",
                history.unit(force),
                f"{boundary}_settlement",
                history.unit(way),
                downwards=True,
            )
        )
    return found


def energy_curves(run: Run, against: str | None = None) -> list[Curve]:
    """All columns of the history that are energies by their units."""
    history = run.history()
    there = [name for name in history if history.unit(name) in ENERGY_UNITS]
    if not there:
        raise RequestError(f"the history {history.path} has no energy columns")
    return [history_curve(run, name, against, name.replace("_", " ")) for name in there]


def peak(curve: Curve) -> tuple[float, float]:
    """Largest stress in magnitude and the strain there, with the signs of the curve."""
    if len(curve.y) == 0 or np.isnan(curve.y).all():
        return float("nan"), float("nan")
    k = int(np.nanargmax(np.abs(curve.y)))
    return float(curve.y[k]), float(curve.x[k])


def apparent_modulus(
    run: Run, strain_range: tuple[float, float] = MODULUS_RANGE, nu: float | None = None
) -> Modulus:
    """(1 - nu^2) times the slope of axial stress against nominal strain in a range of strain.

    A straight line is fitted by least squares to the rows of the history in the range; `nu` is
    taken from the input of the run.
    """
    curve = stress_strain(run)
    ratio = poissons_ratio(run, nu)
    low, high = strain_range
    inside = first_loading(np.abs(curve.x), strain_range)
    rows = int(inside.sum())
    if rows:
        refuse_growing_loads(run, float(run.history()["time"][np.flatnonzero(inside)[0]]))
    if rows < 3:
        raise RequestError(
            f"{run.path}: {rows} rows of the history lie between {low:g} and {high:g} strain, "
            "at least 3 are needed for the modulus (raise history_count)"
        )
    slope = float(np.polyfit(curve.x[inside], curve.y[inside], 1)[0])
    return Modulus((1.0 - ratio**2) * slope, slope, ratio, rows, (low, high))


def poissons_ratio(run: Run, nu: float | None = None) -> float:
    """Poisson's ratio of the material, from the input of the run where none is given."""
    ratio = nu if nu is not None else run.number("material.poissons_ratio")
    if ratio is None:
        raise RequestError(f"{run.path} does not say Poisson's ratio of its material")
    return ratio


def refuse_growing_loads(run: Run, time: float) -> None:
    """Refuse a modulus from this time on while pressures or gravity grow: the slope is none."""
    grow = [key for key in run.values if re.match(r"(pressure|gravity)\b.*\.ramp_time$", key)]
    end = max((run.number(key) or 0.0 for key in grow), default=0.0)
    if time < end * (1.0 - 1e-9):
        raise RequestError(
            f"{run.path}: loads grow until {end:g} s while the platens approach each other: the "
            "slope of stress against strain is no modulus then"
        )


def first_loading(strain: FloatArray, strain_range: tuple[float, float]) -> BoolArray:
    """The rows with a strain (in magnitude) in the range, before it is first exceeded."""
    low, high = strain_range
    slack = 1e-9 * high
    turned = np.flatnonzero(strain > high + slack)
    loading = np.arange(len(strain)) < (turned[0] if len(turned) else len(strain))
    return np.asarray(loading & (strain >= low - slack))


def curve_numbers(
    run: Run, tension_positive: bool = False, platen: str = "first", strains: tuple[float, ...] = ()
) -> dict[str, Any]:
    """Peak stress, strain there, last stress, stress at given strains, modulus of one run."""
    curve = stress_strain(run, tension_positive, platen)
    stress, strain = peak(curve)
    numbers: dict[str, Any] = {
        "run": label_of_run(run),
        "file": str(run.path),
        "peak_stress": stress,
        "strain_at_peak": strain,
        "last_strain": float(curve.x[-1]) if len(curve.x) else None,
        "last_stress": float(curve.y[-1]) if len(curve.y) else None,
        "positive": "tension" if tension_positive else "compression",
        "platen": platen,
        "width": run.width,
    }
    numbers["stress_at"] = {f"{s:g}": curve.at(curve.toward(s)) for s in strains}
    numbers.update(modulus_numbers(run))
    return numbers


def modulus_numbers(run: Run) -> dict[str, Any]:
    """The apparent modulus for a table: null with the reason where it cannot be had."""
    try:
        found = apparent_modulus(run)
    except RequestError as error:
        return {"apparent_modulus": None, "apparent_modulus_missing": str(error)}
    return {
        "apparent_modulus": found.value,
        "apparent_modulus_rows": found.rows,
        "apparent_modulus_strain_range": list(found.strain_range),
    }
