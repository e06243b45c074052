"""Limit loads of foundations, walls and slopes against exact solutions: `make limit_loads`.

Each case is an input of input/limit_loads, run on several grids with the defaults of the program.
Its limit is read by the program's own rule: a load that no equilibrium bears ends the run, a load
of a motion has settled where `perigeo-post info` says so, a factor of safety is found by the
program. The table goes to results/limit_loads/limit_loads.md, a picture of every case beside it.

    limits.py [CASE ...]   only these cases (names: limits.py --list)
    limits.py --quick      the coarsest grid of every case
    limits.py --publish    the table into doc/verification.md, pictures into doc/figures
"""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from matplotlib.figure import Figure
from perigeo_post import PostError, Run
from perigeo_post.draw.style import new_figure, style
from perigeo_post.measure.limit_load import limit_load
from verify import PROGRAM, ROOT, execute

sys.path.append(str(ROOT / "tests" / "reference"))
exact = importlib.import_module("limit_loads")
critical_toe_circle = importlib.import_module("slip_circles").critical_toe_circle

RESULTS = ROOT / "results" / "limit_loads"
FIGURES = ROOT / "doc" / "figures"
PAGE = ROOT / "doc" / "verification.md"
C = 10.0e3  # cohesion of all inputs [Pa]
MARKS = "<!-- limit_loads: begin -->", "<!-- limit_loads: end -->"

Lines = list[np.ndarray]


@dataclass(frozen=True)
class Variant:
    """One way to run a case."""

    title: str
    input: str  # below input/limit_loads
    measure: Callable[[Run], float]
    low: float  # exact value, or its bounds
    high: float
    tolerance: float  # of the finest grid
    settings: tuple[str, ...] = ()


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

    @property
    def error(self) -> float:
        """Distance from the exact value, or from the nearer bound; 0 within the bounds."""
        low, high = self.variant.low, self.variant.high
        if not np.isfinite(low):
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
    """Depth of an excavation at its last equilibrium: whole stages and a part of one [m]."""
    log = run.path.with_suffix(".log").read_text(encoding="utf-8")
    if "limit load:" not in log:
        raise PostError(f"{run.path}: the excavation has not collapsed")
    begun = re.findall(r"stage 'to_(\d+)_cm' begins at (\S+) s", log)
    depth, start = float(begun[-1][0]) / 100.0, float(begun[-1][1])
    before = float(begun[-2][0]) / 100.0 if len(begun) > 1 else 0.0
    return before + (depth - before) * (float(run.history()["time"][-1]) - start)


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


def hill() -> Lines:
    """Two wedges, each half as wide as the footing, moving apart."""
    wedge = np.array([[0.0, 0.0], [0.25, -0.25], [0.5, 0.0]])
    fan = arc([0.5, 0.0], np.sqrt(0.125), -135.0, -45.0)
    return both_sides([wedge, fan, np.array([[0.75, -0.25], [1.0, 0.0]])])


def wedge_behind_wall() -> Lines:
    return [np.array([[0.0, 0.0], [1.0, 1.0]])]


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
HEIGHT = (("h/10", 0.1), ("h/20", 0.05), ("h/40", 0.025))
AROUND = (-2.5, 2.5, -1.6, 0.3)
EQUILIBRIUM = ("integration.method=equilibrium", "integration.damping=")
PRANDTL = (2.0 + np.pi) * C / 1e3
ROUGH, SMOOTH = (exact.footing(4.0, rough) * C / 1e3 for rough in (True, False))


CASES: dict[str, Case] = {
    "footing": Case(
        "Rough strip footing",
        "kN/m",
        (
            Variant("default control", "strip_footing", settled("footing"), PRANDTL,
                    PRANDTL, 1.5e-2, (*EQUILIBRIUM, "stabilisation.method=relaxing")),
            Variant("no control", "strip_footing", settled("footing"), PRANDTL, PRANDTL,
                    1.0e-2, EQUILIBRIUM),
        ),
        FOOTING, prandtl, "Prandtl", AROUND,
    ),
    "smooth_footing": Case(
        "Smooth strip footing",
        "kN/m",
        (Variant("", "smooth_footing", settled("footing"), PRANDTL, PRANDTL, 1.5e-2),),
        FOOTING, hill, "Hill", AROUND,
    ),
    "growing_strength": Case(
        "Strip footing, strength grows with depth, k B / c0 = 4",
        "kN/m",
        (
            Variant("rough", "growing_strength_rough", settled("footing"), ROUGH, ROUGH,
                    3.0e-2),
            Variant("smooth", "growing_strength_smooth", settled("footing"), SMOOTH, SMOOTH,
                    3.0e-2),
        ),
        FOOTING, box=AROUND,
    ),
    "vertical_cut": Case(
        "Vertical cut, gamma h / c",
        "1",
        (
            Variant("by growing weight", "vertical_cut", weight_at_collapse, *exact.VERTICAL_CUT,
                    3.0e-2),
            Variant("by strength reduction", "vertical_cut_safety",
                    lambda run: 2.0 * factor_of_safety(run), *exact.VERTICAL_CUT, 3.0e-2),
        ),
        HEIGHT, slip_circle(90.0), "slip circle, 3.83 c", (-1.6, 0.8, -0.4, 1.1),
    ),
    "slope": Case(
        "Slope of 60 degrees, gamma h / c",
        "1",
        (
            Variant("by growing weight", "slope", weight_at_collapse, *exact.slope(60), 3.0e-2),
            Variant("by strength reduction", "slope_safety",
                    lambda run: 2.0 * factor_of_safety(run), *exact.slope(60), 3.0e-2),
        ),
        HEIGHT, slip_circle(60.0), "toe circle, 5.25 c", (-2.2, 0.8, -0.4, 1.1),
    ),
    "wall": Case(
        "Smooth wall, gamma h^2 / 2 -+ 2 c h",
        "kN/m",
        (
            Variant("active", "wall_active", settled("wall"), 15.0, 15.0, 2.0e-2),
            Variant("passive", "wall_passive", settled("wall"), 45.0, 45.0, 2.0e-2),
        ),
        HEIGHT, wedge_behind_wall, "45 degrees", (-0.3, 2.5, -0.3, 1.1),
    ),
    "cylinder": Case(
        "Thick cylinder, 2 c ln(b / a)",
        "kPa",
        (Variant("", "cylinder", pressure_at_collapse, 2.0 * C * np.log(2.0) / 1e3,
                 2.0 * C * np.log(2.0) / 1e3, 3.0e-2),),
        (("a/10", 0.1), ("a/20", 0.05), ("a/40", 0.025)), rims, "rims",
    ),
    "trapdoor": Case(
        "Trapdoor below clay, H = 2 B",
        "kN/m",
        (Variant("", "trapdoor", settled("door"), *(n * C / 1e3 for n in exact.trapdoor(2)),
                 0.0),),
        FOOTING, box=(-2.0, 2.0, -0.2, 2.1),
    ),
    "excavation": Case(
        "Excavation in stages, depth at collapse",
        "m",
        (Variant("", "excavation", depth_at_collapse, *(n / 2.0 for n in exact.VERTICAL_CUT),
                 3.0e-2),),
        (("0.1 m", 0.1), ("0.05 m", 0.05)), box=(-3.0, 2.0, -3.0, 0.2),
    ),
    "softening_footing": Case(
        "Strip footing on softening clay, peak",
        "kN/m",
        (Variant("", "softening_footing", peak("footing"), float("nan"), float("nan"), 3.0e-2),),
        (("B/20", 0.05), ("B/30", 1.0 / 30.0), ("B/40", 0.025)), box=AROUND,
    ),
}


# ------------------------------------------------------------------------------------------ runs


def carry_out(case: str, variant: Variant, grid: int) -> Found:
    """One run."""
    about = CASES[case]
    label, spacing = about.grids[grid]
    name = f"{variant.input}_{grid}" + ("_none" if variant.title == "no control" else "")
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    horizon = 0.15 if case == "softening_footing" else 3.0 * spacing
    settings = [
        f"run.name={name}",
        f"discretisation.spacing={spacing!r}",
        f"discretisation.horizon={horizon!r}",
        *variant.settings,
    ]
    command = [str(PROGRAM), "--threads", "1", "--force", "--quiet", "--output", str(folder)]
    for setting in settings:
        command += ["--set", setting]
    path = ROOT / "input" / "limit_loads" / f"{variant.input}.nml"
    run = execute(name, folder, [*command, str(path)])
    log = run.path.with_suffix(".log").read_text(encoding="utf-8")
    seconds = float(re.findall(r"^time loop +(\S+) s", log, re.MULTILINE)[-1])
    return Found(
        about, variant, label, len(run.positions), seconds, variant.measure(run),
        grid == len(about.grids) - 1, run.path,
    )


def draw(found: Found) -> Figure:
    """Plastic strain, how the soil moves at last, and the exact mechanism."""
    run = Run(found.path)
    frame = run.last_frame
    body = run.body & (frame["active"] > 0.0 if "active" in run.field_names else True)
    place = run.positions[body]
    alpha = frame["plastic_strain"][body]
    moving = np.column_stack([frame["velocity_x"][body], frame["velocity_y"][body]])
    x0, x1, y0, y1 = found.case.box or (*np.sort(place[:, 0])[[0, -1]], *np.sort(place[:, 1])[[0, -1]])
    with style():
        figure = new_figure(140.0, 30.0 + 110.0 * (y1 - y0) / (x1 - x0))
        axes = figure.add_subplot()
        size = 110.0 / 25.4 * 72.0 * run.spacing / (x1 - x0)
        drawn = axes.scatter(*place.T, c=100.0 * alpha, s=(1.05 * size) ** 2, marker="s",
                             linewidths=0.0, cmap="viridis", vmin=0.0,
                             vmax=100.0 * float(np.quantile(alpha, 0.995)) or 1.0)
        every = max(1, round((x1 - x0) / 40.0 / run.spacing))
        cells = np.rint(place / run.spacing - 0.25).astype(int)
        shown = (cells % every == 0).all(axis=1)
        length = np.hypot(*moving.T)
        axes.quiver(*place[shown].T, *(moving[shown] / max(1e-300, np.quantile(length, 0.99))).T,
                    color="white", angles="xy", scale_units="xy", scale=0.9 / (every * run.spacing)
                    / 1.6, width=1.6e-3)
        for k, line in enumerate(found.case.mechanism()):
            axes.plot(*line.T, color="#D55E00", linewidth=1.2,
                      label=found.case.label if k == 0 else None)
        if found.case.label:
            axes.legend(loc="lower left", labelcolor="#D55E00")
        axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x in m", ylabel="y in m",
                 title=f"{run.title}, {found.grid}")
        figure.colorbar(drawn, ax=axes, label="equivalent plastic strain in %", shrink=0.8,
                        extend="max")
    return figure


def table(rows: list[Found]) -> list[list[str]]:
    """The rows as text."""
    lines = [["case", "grid", "points", "time", "found", "exact", "error", "verdict"]]
    for row in rows:
        low, high = row.variant.low, row.variant.high
        known = "none" if not np.isfinite(low) else f"{low:.4g}"
        if high != low and np.isfinite(low):
            known += f" to {high:.4g}"
        title = row.case.title + (f", {row.variant.title}" if row.variant.title else "")
        verdict = ("holds" if row.holds else "does not hold") if row.finest else ""
        error = "" if not np.isfinite(row.error) else f"{100.0 * row.error:+.2f} %"
        lines.append([title, row.grid, str(row.points), f"{row.seconds:.0f} s",
                      f"{row.value:.4g} {row.case.unit if row.case.unit != '1' else ''}".strip(),
                      known, error, verdict])
    return lines


def compare_with_finest(rows: list[Found]) -> None:
    """Where nothing exact is known, the finest grid is what the others are compared with."""
    for name, case in CASES.items():
        if np.isfinite(case.variants[0].low):
            continue
        those = [row for row in rows if row.case is case]
        if len(those) < 2:
            continue
        values = [row.value for row in those]
        middle = 0.5 * (min(values) + max(values))
        spread = (max(values) - min(values)) / middle / 2.0
        print(f"{name}: {spread:.2%} about the middle of all grids")
        for row in those:
            low = min(values) if spread <= row.variant.tolerance else middle
            high = max(values) if spread <= row.variant.tolerance else middle
            row.variant = Variant(**{**vars(row.variant), "low": low, "high": high})


def write(rows: list[Found]) -> None:
    RESULTS.mkdir(parents=True, exist_ok=True)
    lines = table(rows)
    lines.insert(1, ["---"] * len(lines[0]))
    version = subprocess.run([str(PROGRAM), "--version"], capture_output=True, text=True, check=True)
    text = [f"Printed by `make limit_loads`, {version.stdout.strip()}, {platform.machine()}, "
            f"one thread a run, {date.today().isoformat()}:\n"]
    text += ["| " + " | ".join(line) + " |" for line in lines]
    (RESULTS / "limit_loads.md").write_text("\n".join(text) + "\n")


def publish(pictures: list[Path]) -> None:
    """Put the table between its marks, and the pictures beside the others."""
    before, rest = PAGE.read_text().split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    content = (RESULTS / "limit_loads.md").read_text()
    PAGE.write_text(f"{before}{MARKS[0]}\n{content}{MARKS[1]}{after}")
    for picture in pictures:
        shutil.copy(picture, FIGURES / f"limit_load_{picture.name}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help="only these cases")
    parser.add_argument("--quick", action="store_true", help="only the coarsest grids")
    parser.add_argument("--publish", action="store_true", help="into doc/")
    parser.add_argument("--list", action="store_true", help="list the cases")
    options = parser.parse_args()
    unknown = set(options.cases) - set(CASES)
    if options.list or unknown:
        print("cases:", ", ".join(CASES))
        return 1 if unknown else 0
    wanted = options.cases or list(CASES)
    jobs: list[tuple[str, Variant, int, Any]] = []
    rows: list[Found] = []
    failures: list[str] = []
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for name in wanted:
            for variant in CASES[name].variants:
                for grid in range(1 if options.quick else len(CASES[name].grids)):
                    jobs.append((name, variant, grid, pool.submit(carry_out, name, variant, grid)))
        for name, variant, grid, job in jobs:
            try:
                rows.append(job.result())
            except (PostError, RuntimeError, KeyError) as problem:
                failures.append(f"{name} {variant.title} {CASES[name].grids[grid][0]}: {problem}")
    compare_with_finest(rows)
    lines = table(rows)
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    for line in lines:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip())
    pictures = []
    for row in rows:
        if row.finest or options.quick:
            pictures.append(RESULTS / f"{row.variant.input}.png")
            draw(row).savefig(pictures[-1], dpi=200)
    if not options.cases and not options.quick:
        write(rows)
        if options.publish and not failures:
            publish(pictures)
    for failure in failures:
        print("could not run:", failure, file=sys.stderr)
    failed = len(failures) + sum(not row.holds for row in rows if row.finest)
    print(f"{sum(row.holds for row in rows if row.finest)} hold, {failed} do not")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
