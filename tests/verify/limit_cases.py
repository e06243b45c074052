"""The cases of `make limit_loads`: what is run, what is measured, what is exact."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from cylinder_radius import exact_radius, radius_at
from perigeo_post import PostError, Run
from perigeo_post.measure.limit_load import limit_load
from verify import ROOT

sys.path.append(str(ROOT / "tests" / "reference"))
exact = importlib.import_module("limit_loads")
critical_toe_circle = importlib.import_module("slip_circles").critical_toe_circle

C = 10.0e3  # cohesion of all inputs [Pa]

Lines = list[np.ndarray]


@dataclass(frozen=True)
class Variant:
    """One way to run a case."""

    title: str
    input: str  # below input/limit_loads
    measure: Callable[[Run], float]
    low: float | None  # exact value, or its bounds; None: nothing exact is known
    high: float | None
    tolerance: float  # of the finest grid
    settings: tuple[str, ...] = ()
    unit: str = ""  # absent: that of the case
    also: tuple[Variant, ...] = ()  # what else is measured in the same runs


@dataclass(frozen=True)
class Case:
    """Variants of one problem, and what to draw above the field of the finest grid."""

    title: str
    unit: str
    variants: tuple[Variant, ...]
    grids: tuple[tuple[str, float], ...]  # what it is called, spacing [m]
    mechanism: Callable[[], Lines] = list
    label: str = ""  # of the mechanism
    box: tuple[float, float, float, float] | None = None  # x0 x1 y0 y1 of the picture [m]


@dataclass
class Found:
    """A line of the table."""

    case: Case
    variant: Variant
    grid: str
    points: int
    seconds: float
    value: float
    finest: bool
    path: Path = field(default_factory=Path)
    #: Values to compare with where nothing exact is known: the finest, of the finest all others.
    among: list[float] = field(default_factory=list)

    @property
    def error(self) -> float:
        """Distance from the exact value, the nearer bound or the farthest other; 0 within."""
        low, high = self.variant.low, self.variant.high
        if self.among:
            return max(((self.value - other) / abs(other) for other in self.among), key=abs)
        if low is None or high is None:
            return float("nan")
        nearest = min(max(self.value, low), high)
        return (self.value - nearest) / abs(nearest)

    @property
    def holds(self) -> bool:
        return not self.finest or abs(self.error) <= self.variant.tolerance


# ------------------------------------------------------------------------------------ measures


def settled(boundary: str, axis: float = 1.0) -> Callable[[Run], float]:
    """Force of a boundary that has settled [kN/m]; it must have, or there is no limit."""

    def measure(run: Run) -> float:
        found = limit_load(run, boundary)
        if not found.reached:
            raise PostError(f"{run.path}: the load of {boundary} has not settled {found.missing}")
        return axis * found.load / 1e3

    return measure


def of_half(boundary: str) -> Callable[[Run], float]:
    """The same where the body is one half of a symmetric one."""
    half = settled(boundary)
    return lambda run: 2.0 * half(run)


def weight_at_collapse(run: Run) -> float:
    """Unit weight of the last equilibrium, times the height of 1 m, over c."""
    if "limit load:" not in run.path.with_suffix(".log").read_text(encoding="utf-8"):
        raise PostError(f"{run.path}: the run has not come to its limit")
    gravity = float(run.history()["gravity"][-1])
    return (run.number("material.density") or 0.0) * gravity / C


def factor_of_safety(run: Run) -> float:
    """The middle of the interval in which the factor of safety lies."""
    with h5py.File(run.path, "r", locking=False) as file:
        group = file["strength_reduction"]
        return float(0.5 * (group.attrs["borne"] + group.attrs["not_borne"]))


def pressure_at_collapse(run: Run) -> float:
    """Pressure of the last equilibrium [kPa]."""
    log = run.path.with_suffix(".log").read_text(encoding="utf-8")
    if "limit load:" not in log:
        raise PostError(f"{run.path}: the run has not come to its limit")
    ramp = run.number("pressure(inside).ramp_time") or 0.0
    return (run.number("pressure(inside).value") or 0.0) * run.history()["time"][-1] / ramp / 1e3


def depth_at_collapse(run: Run) -> float:
    """Middle between the depth that stood and that of the stage which did not end [m]."""
    log = run.path.with_suffix(".log").read_text(encoding="utf-8")
    if "limit load:" not in log:
        raise PostError(f"{run.path}: the excavation has not collapsed")
    begun = [float(cm) / 100.0 for cm in re.findall(r"stage 'to_(\d+)_cm' begins", log)]
    if len(begun) < 2:
        raise PostError(f"{run.path}: it has collapsed in its first slice")
    return 0.5 * sum(begun[-2:])


def peak(boundary: str) -> Callable[[Run], float]:
    """Largest force of a boundary [kN/m]."""
    return lambda run: abs(limit_load(run, boundary).peak) / 1e3


# ----------------------------------------------------------------------------------- mechanisms


def arc(centre: Sequence[float], radius: float, first: float, last: float) -> np.ndarray:
    """Points of an arc between two angles [degrees]."""
    angle = np.radians(np.linspace(first, last, 60))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius + np.asarray(centre)


def both_sides(lines: Lines) -> Lines:
    return lines + [line * np.array([-1.0, 1.0]) for line in lines]


def prandtl() -> Lines:
    """A wedge as wide as the footing, fans at its edges, wedges beside it."""
    wedge = np.array([[-0.5, 0.0], [0.0, -0.5]])
    fan = arc([0.5, 0.0], np.sqrt(0.5), -135.0, -45.0)
    return both_sides([wedge, fan, np.array([[1.0, -0.5], [1.5, 0.0]])])


def slip_circle(angle: float) -> Callable[[], Lines]:
    """The critical circle through the toe of a slope of height 1 m."""

    def lines() -> Lines:
        _, crest, half = critical_toe_circle(angle)
        chord = np.hypot(crest, 1.0)
        radius = chord / (2.0 * np.sin(half))
        away = np.array([1.0, crest]) / chord  # from the chord to the centre, out of the soil
        centre = 0.5 * np.array([-crest, 1.0]) + radius * np.cos(half) * away
        inwards = np.degrees(np.arctan2(-away[1], -away[0]))
        return [arc(centre, radius, inwards - np.degrees(half), inwards + np.degrees(half))]

    return lines


def rims() -> Lines:
    return [arc([0.0, 0.0], radius, 0.0, 360.0) for radius in (1.0, 2.0)]


# ---------------------------------------------------------------------------------------- cases

FOOTING = (("B/10", 0.1), ("B/20", 0.05), ("B/40", 0.025))
FINE = (("B/40", 0.025), ("B/80", 0.0125), ("B/160", 0.00625))
HEIGHT = (("h/10", 0.1), ("h/20", 0.05), ("h/40", 0.025))
AROUND = (-2.5, 2.5, -1.6, 0.3)
BESIDE_AXIS = (0.0, 1.5, -0.8, 0.1)
SHALLOW = (0.0, 1.0, -0.4, 0.05)
EQUILIBRIUM = ("integration.method=equilibrium", "integration.damping=")
PRANDTL = (2.0 + np.pi) * C / 1e3
ROUGH, SMOOTH = (exact.footing(4.0, rough) * C / 1e3 for rough in (True, False))
RADIUS = exact_radius(12.0, C / 1e3)
CYLINDER_RADIUS = Variant(
    "radius of the plastic part at 12 kPa",
    "cylinder",
    partial(radius_at, 12.0),
    RADIUS,
    RADIUS,
    3.0e-2,
    unit="m",
)


CASES: dict[str, Case] = {
    "footing": Case(
        "Rough strip footing",
        "kN/m",
        (
            Variant(
                "default control",
                "strip_footing",
                settled("footing"),
                PRANDTL,
                PRANDTL,
                1.5e-2,
                (*EQUILIBRIUM, "stabilisation.method=relaxing"),
            ),
            Variant(
                "no control",
                "strip_footing",
                settled("footing"),
                PRANDTL,
                PRANDTL,
                1.0e-2,
                EQUILIBRIUM,
            ),
        ),
        FOOTING,
        prandtl,
        "Prandtl",
        AROUND,
    ),
    "smooth_footing": Case(
        "Smooth strip footing",
        "kN/m",
        (Variant("", "smooth_footing", of_half("footing"), PRANDTL, PRANDTL, 1.5e-2),),
        FINE,
        prandtl,
        "Prandtl",
        BESIDE_AXIS,
    ),
    "growing_strength_rough": Case(
        "Rough footing, strength grows with depth, k B / c0 = 4",
        "kN/m",
        (Variant("", "growing_strength_rough", of_half("footing"), ROUGH, ROUGH, 3.0e-2),),
        (("B/20", 0.05), ("B/40", 0.025), ("B/80", 0.0125)),
        box=SHALLOW,
    ),
    "growing_strength_smooth": Case(
        "Smooth footing, strength grows with depth, k B / c0 = 4",
        "kN/m",
        (Variant("", "growing_strength_smooth", of_half("footing"), SMOOTH, SMOOTH, 3.0e-2),),
        FINE,
        box=SHALLOW,
    ),
    "vertical_cut": Case(
        "Vertical cut, gamma h / c",
        "1",
        (
            Variant(
                "by growing weight", "vertical_cut", weight_at_collapse, *exact.VERTICAL_CUT, 3.0e-2
            ),
            Variant(
                "by strength reduction",
                "vertical_cut_safety",
                lambda run: 2.0 * factor_of_safety(run),
                *exact.VERTICAL_CUT,
                3.0e-2,
            ),
        ),
        HEIGHT,
        slip_circle(90.0),
        "slip circle, 3.83 c",
        (-1.6, 0.8, -0.4, 1.1),
    ),
    "slope": Case(
        "Slope of 60 degrees, gamma h / c",
        "1",
        (
            Variant("by growing weight", "slope", weight_at_collapse, *exact.slope(60), 3.0e-2),
            Variant(
                "by strength reduction",
                "slope_safety",
                lambda run: 2.0 * factor_of_safety(run),
                *exact.slope(60),
                3.0e-2,
            ),
        ),
        HEIGHT,
        slip_circle(60.0),
        "toe circle, 5.25 c",
        (-2.2, 0.8, -0.4, 1.1),
    ),
    "wall": Case(
        "Smooth wall, gamma h^2 / 2 -+ 2 c h",
        "kN/m",
        (
            Variant("active", "wall_active", settled("wall", -1.0), 15.0, 15.0, 2.0e-2),
            Variant("passive", "wall_passive", settled("wall"), 45.0, 45.0, 2.0e-2),
        ),
        HEIGHT[1:],
        box=(-0.3, 2.5, -0.3, 1.1),
    ),
    "cylinder": Case(
        "Thick cylinder, 2 c ln(b / a)",
        "kPa",
        (
            Variant(
                "",
                "cylinder",
                pressure_at_collapse,
                2.0 * C * np.log(2.0) / 1e3,
                2.0 * C * np.log(2.0) / 1e3,
                3.0e-2,
                ("output.frame_count=50",),
                also=(CYLINDER_RADIUS,),
            ),
        ),
        (("a/10", 0.1), ("a/20", 0.05), ("a/40", 0.025)),
        rims,
        "rims",
    ),
    "trapdoor": Case(
        "Trapdoor below clay, H = 2 B",
        "kN/m",
        (Variant("", "trapdoor", settled("door"), *(n * C / 1e3 for n in exact.trapdoor(2)), 0.0),),
        FOOTING,
        box=(-2.0, 2.0, -0.2, 2.1),
    ),
    "excavation": Case(
        "Excavation in stages, depth at collapse",
        "m",
        (
            Variant(
                "default control",
                "excavation",
                depth_at_collapse,
                *(n / 2.0 for n in exact.VERTICAL_CUT),
                3.0e-2,
            ),
            Variant(
                "no control",
                "excavation",
                depth_at_collapse,
                *(n / 2.0 for n in exact.VERTICAL_CUT),
                3.0e-2,
                ("stabilisation.method=none",),
            ),
        ),
        (("0.05 m", 0.05),),
        box=(-3.0, 2.0, -3.0, 0.2),
    ),
    "softening_footing": Case(
        "Strip footing on softening clay, peak",
        "kN/m",
        (Variant("", "softening_footing", peak("footing"), None, None, 3.0e-2),),
        (("B/20", 0.05), ("B/30", 1.0 / 30.0), ("B/40", 0.025)),
        box=AROUND,
    ),
}
