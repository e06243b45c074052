"""perigeo beside finite elements with the same material: `make finite_elements`.

Plane strain compression, a cyclic test and a strip footing, load against displacement; and a
specimen that softens, on three meshes of finite elements and at four spacings of one horizon. The
curves of CalculiX are those of tests/reference/finite_elements/data, which says how they were made;
CalculiX is not needed. Tables and figures go to results/finite_elements.

    finite_elements.py [CASE ...]   only these cases (names: --list); no figures
    finite_elements.py --publish    and into doc/verification.md and doc/figures
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import date

import numpy as np
import verify
from finite_elements_figures import Family, Panel, draw_comparison, draw_softening
from perigeo_post.draw.style import COLOURS
from verify import PROGRAM, ROOT, ROOT_3, Groups

sys.path.insert(0, str(ROOT / "tests" / "reference" / "finite_elements"))
import cases

RESULTS = ROOT / "results" / "finite_elements"
LIMIT = 0.03  # what curves may differ by, over the largest load
RATE = 0.01  # [m/s]; only the way counts at equilibrium
TURN = 1.0e-3  # time that a boundary takes to turn round [s]
FIGURES = ("finite_elements.png", "finite_elements_softening.png")
Points = tuple[float, float]  # spacing and horizon [m]


@dataclass
class Curve:
    """Load against displacement: both positive in compression [m, N/m]."""

    label: str
    way: np.ndarray
    load: np.ndarray

    @property
    def path(self) -> np.ndarray:
        """How far the boundary has gone, there and back [m]."""
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.way)))])

    @property
    def work(self) -> float:
        """[J/m]"""
        return float(np.sum(0.5 * (self.load[1:] + self.load[:-1]) * np.diff(self.way)))

    @property
    def peak(self) -> float:
        return float(np.max(np.abs(self.load)))

    @property
    def slope(self) -> float:
        """Load over way up to a third of the first load that is a third of the peak [N/m/m]."""
        last = int(np.argmax(np.abs(self.load) > self.peak / 3.0))
        return float(np.interp(self.peak / 3.0, self.load[: last + 1], self.load[: last + 1])) / (
            float(np.interp(self.peak / 3.0, self.load[: last + 1], self.way[: last + 1]))
        )


def finite_elements(name: str, label: str) -> Curve:
    way, load = cases.load(name)
    return Curve(label, -way, -load)


# -------------------------------------------------------------------------- perigeo's inputs


def body(points: Points, *extents: float) -> Groups:
    """Points are spacing and horizon."""
    keys = dict(zip(("x_min", "x_max", "y_min", "y_max"), extents))
    return [
        ("discretisation", {"spacing": points[0], "horizon": points[1], "layout": "cells"}),
        ("body", keys),
    ]


def material(measure: str, **keys: object) -> tuple[str, dict[str, object]]:
    return verify.material(strain_measure=measure, **keys)


def integration(increments: int, **end: float) -> Groups:
    return [
        ("integration", {"method": "equilibrium", "increments": increments, **end}),
        ("output", {"history_count": increments, "frame_count": 1}),
    ]


def specimen(points: Points, soil: tuple[str, dict[str, object]]) -> Groups:
    return [*body(points, 0.0, cases.WIDTH, 0.0, cases.HEIGHT), soil]


def compression(points: Points) -> Groups:
    return [
        *specimen(points, material("small")),
        *verify.platens(rate=RATE),
        *integration(60, final_strain=cases.STRAIN),
    ]


def finite(points: Points) -> Groups:
    soil = material("logarithmic", isotropic_modulus=cases.HARDENING_FINITE)
    return [
        *specimen(points, soil),
        *verify.platens(rate=RATE),
        *integration(100, final_strain=cases.STRAIN_FINITE),
    ]


def cyclic(points: Points) -> Groups:
    """Down by a, up by 2 a, down by 2 a: the velocity changes its sign within TURN."""
    top = {"name": "top", "side": "top", "contact": "smooth"}
    quarter, half = cases.STRAIN_CYCLIC * cases.HEIGHT / RATE, 0.5 * TURN
    turns = [quarter, 3.0 * quarter]
    times = [0.0, *(t + side for t in turns for side in (-half, half)), 5.0 * quarter]
    signs = [-1.0, -1.0, 1.0, 1.0, -1.0, -1.0]
    top |= {"times": times, "velocities_y": [RATE * sign for sign in signs]}
    soil = material("logarithmic", kinematic_modulus=cases.HARDENING_CYCLIC)
    return [
        *specimen(points, soil),
        ("boundary", {"name": "bottom", "side": "bottom", "contact": "rough"}),
        ("boundary", top),
        *integration(150, end_time=5.0 * quarter),
    ]


def footing(points: Points) -> Groups:
    wide = cases.GROUND
    clay = {"yield_stress": ROOT_3 * cases.CLAY_C, "youngs_modulus": cases.CLAY_E}
    pressed = {"name": "footing", "side": "top", "velocity": (0.0, -RATE)}
    pressed["span"] = (-0.5 * cases.FOOTING, 0.5 * cases.FOOTING)
    return [
        *body(points, -wide, wide, -wide, 0.0),
        material("small", **clay),
        ("boundary", {"name": "base", "side": "bottom"}),
        ("boundary", {"name": "left", "side": "left", "contact": "smooth"}),
        ("boundary", {"name": "right", "side": "right", "contact": "smooth"}),
        ("boundary", pressed),
        *integration(50, end_time=cases.SETTLEMENT / RATE),
    ]


def softening(points: Points) -> Groups:
    soil = material("small", isotropic_modulus=cases.SOFTENING, residual_strength=cases.RESIDUAL)
    x, y, radius = cases.WEAK
    return [
        *specimen(points, soil),
        *verify.platens(rate=RATE),
        *integration(200, final_strain=cases.STRAIN),
        ("imperfection", {"amplitude": cases.WEAKER, "x": x, "y": y, "radius": radius}),
    ]


def run(name: str, groups: Groups, label: str) -> Curve:
    """Run the program on one thread; displacement and load of the boundary that moves."""
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.nml"
    path.write_text(verify.namelist([("run", {"name": name, "output_dir": str(folder)}), *groups]))
    command = [str(PROGRAM), "--threads", "1", "--force", "--quiet", str(path)]
    history = verify.execute(name, folder, command).history()
    if "strain" in history:
        return Curve(label, cases.HEIGHT * history["strain"], -history["top_force_y"])
    return Curve(label, RATE * history["time"], -history["footing_force_y"])


# ----------------------------------------------------------------------------------- cases


@dataclass(frozen=True)
class Case:
    """One comparison: inputs of perigeo, its spacings and horizons, curves of CalculiX."""

    title: str
    short: str  # title of its panel
    groups: Callable[[Points], Groups]
    points: tuple[Points, ...]  # coarse to fine
    meshes: dict[str, str]  # curve -> label, the finest mesh of 8-node elements first


COMPARED = {
    "compression": Case(
        "compression, perfectly plastic, small strain",
        "compression, small strain",
        compression,
        ((0.04, 0.12), (0.02, 0.06)),
        {
            "compression_cpe8r_100": "8 nodes, h = 0.1 m",
            "compression_cpe8r_200": "8 nodes, h = 0.2 m",
            "compression_cpe4_100": "4 nodes, h = 0.1 m",
        },
    ),
    "finite": Case(
        "compression to 4 %, isotropic hardening, logarithmic strain",
        "compression to 4 %, hardening",
        finite,
        ((0.04, 0.12), (0.02, 0.06)),
        {
            "finite_cpe8r_050": "8 nodes, h = 0.05 m",
            "finite_cpe8r_100": "8 nodes, h = 0.1 m",
            "finite_cpe8r_200": "8 nodes, h = 0.2 m",
        },
    ),
    "cyclic": Case(
        "cyclic, kinematic hardening, logarithmic strain",
        "cyclic, kinematic hardening",
        cyclic,
        ((0.04, 0.12), (0.02, 0.06), (0.01, 0.03)),
        {"cyclic_cpe8r_100": "8 nodes, h = 0.1 m", "cyclic_cpe8r_200": "8 nodes, h = 0.2 m"},
    ),
    "footing": Case(
        "rough strip footing, perfectly plastic, small strain",
        "rough strip footing",
        footing,
        ((0.1, 0.3), (0.05, 0.15), (0.025, 0.075)),
        {
            "footing_cpe8r_010": "8 nodes, 0.01 B at the edge",
            "footing_cpe8r_020": "8 nodes, 0.02 B at the edge",
            "footing_cpe8r_050": "8 nodes, 0.05 B at the edge",
            "footing_cpe4_010": "4 nodes, 0.01 B at the edge",
            "footing_cpe4_050": "4 nodes, 0.05 B at the edge",
        },
    ),
}
SPACINGS = (0.04, 0.02, 0.04 / 3.0, 0.01)  # of the specimen that softens [m]
HORIZON = 0.08
LOCAL = {  # kinds of finite elements for it
    "dynamic": "8 nodes, dynamic",
    "cpe8r": "8 nodes, static",
    "cpe4": "4 nodes, static",
}


@dataclass
class Compared:
    """A curve against the reference: all differences as fractions."""

    curve: Curve
    slope: float
    peak: float
    worst: float  # difference of loads at one place of the path, over the largest load
    work: float

    @property
    def passed(self) -> bool:
        return abs(self.peak) <= LIMIT and abs(self.worst) <= LIMIT


def compare(curve: Curve, reference: Curve) -> Compared:
    end = min(curve.path[-1], reference.path[-1])
    places = np.linspace(0.0, end, 1000)
    off = np.interp(places, curve.path, curve.load) - np.interp(
        places, reference.path, reference.load
    )
    return Compared(
        curve,
        curve.slope / reference.slope - 1.0,
        curve.peak / reference.peak - 1.0,
        float(off[np.argmax(np.abs(off))]) / reference.peak,
        curve.work / reference.work - 1.0,
    )


def jobs(wanted: list[str]) -> dict[str, tuple[Groups, str]]:
    """Name of a run of perigeo -> its input and label; the longest first."""
    found: dict[str, tuple[Groups, str]] = {}
    if "softening" in wanted:
        for spacing in reversed(SPACINGS):
            points = (spacing, HORIZON)
            label = f"dx = {spacing:.3g} m, m = {HORIZON / spacing:.0f}"
            found[f"softening_{HORIZON / spacing:.0f}"] = (softening(points), label)
    for name in reversed([name for name in COMPARED if name in wanted]):
        case = COMPARED[name]
        for k in reversed(range(len(case.points))):
            spacing, horizon = case.points[k]
            label = f"perigeo, dx = {spacing:g} m, delta = {horizon:g} m"
            found[f"{name}_{k}"] = (case.groups(case.points[k]), label)
    return found


# ---------------------------------------------------------------------------------- tables


def percent(value: float) -> str:
    return f"{100.0 * value:+.2f} %"


def text_of(rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    lines.insert(1, "|" + "---|" * len(rows[0]))
    return "\n".join(lines)


def comparison(name: str, runs: dict[str, Curve]) -> list[Compared]:
    """The reference, other meshes, perigeo from coarse to fine."""
    case = COMPARED[name]
    meshes = [finite_elements(mesh, label) for mesh, label in case.meshes.items()]
    computed = [runs[f"{name}_{k}"] for k in range(len(case.points))]
    return [compare(curve, meshes[0]) for curve in [*meshes, *computed]]


def comparison_table(found: dict[str, list[Compared]]) -> list[list[str]]:
    rows = [["case", "calculation", "slope", "largest load", "along the curve", "work", ""]]
    for name, lines in found.items():
        for k, line in enumerate(lines):
            title = COMPARED[name].title if k == 0 else ""
            if k == 0:
                force = f"{line.curve.peak / 1e3:.2f} kN/m"
                work = f"{line.curve.work:.1f} J/m"
                slope = f"{line.curve.slope / 1e6:.2f} MPa"
                rows.append([title, line.curve.label, slope, force, "0", work, "reference"])
                continue
            verdict = ""
            if k == len(lines) - 1:
                verdict = "ok" if line.passed else "FAILED"
            values = [percent(v) for v in (line.slope, line.peak, line.worst, line.work)]
            rows.append([title, line.curve.label, *values, verdict])
    return rows


def local(kind: str) -> list[Curve]:
    """Finite elements for the specimen that softens, coarse to fine."""
    return [
        finite_elements(f"softening_{kind}_{1000 * size:03.0f}", f"h = {size:g} m")
        for size in cases.MESHES
    ]


def softening_table(runs: dict[str, Curve]) -> list[list[str]]:
    rows = [["calculation", "size", "largest load", "load at 0.6 %", "work to 1.2 %", "change"]]
    groups = {label: local(kind) for kind, label in LOCAL.items()}
    groups["perigeo, delta = 0.08 m"] = nonlocal_curves(runs)
    for group, curves in groups.items():
        before = None
        for curve in curves:
            ended = curve.way[-1] < 0.999 * cases.STRAIN * cases.HEIGHT
            middle = float(np.interp(0.006 * cases.HEIGHT, curve.way, curve.load)) / 1e3
            at = "-" if curve.way[-1] < 0.006 * cases.HEIGHT else f"{middle:.1f} kN/m"
            work = f"ends at {50.0 * curve.way[-1]:.2f} %" if ended else f"{curve.work:.0f} J/m"
            change = "" if before is None or ended else percent(curve.work / before - 1.0)
            before = None if ended else curve.work
            rows.append([group, curve.label, f"{curve.peak / 1e3:.1f} kN/m", at, work, change])
            group = ""
    return rows


def nonlocal_curves(runs: dict[str, Curve]) -> list[Curve]:
    return [runs[f"softening_{HORIZON / spacing:.0f}"] for spacing in SPACINGS]


def figures(found: dict[str, list[Compared]], runs: dict[str, Curve]) -> None:
    panels = [
        Panel(COMPARED[name].short, lines[0].curve, lines[-1].curve)
        for name, lines in found.items()
    ]
    draw_comparison(panels, RESULTS / FIGURES[0])
    families = []
    looks = zip(LOCAL.items(), "os^", COLOURS[1:], ("-", ":", "--"))
    for (kind, label), marker, colour, dash in looks:
        whole = [
            (size, curve)
            for size, curve in zip(cases.MESHES, local(kind))
            if curve.way[-1] > 0.999 * cases.STRAIN * cases.HEIGHT
        ]
        sizes, curves = [one[0] for one in whole], [one[1] for one in whole]
        families.append(Family(label, sizes, curves, marker, colour, dash))
    of_perigeo = Family(
        "perigeo, horizon 0.08 m", list(SPACINGS), nonlocal_curves(runs), "D", COLOURS[0]
    )
    draw_softening(families, of_perigeo, RESULTS / FIGURES[1])


def publish(text: str) -> None:
    """Put the tables between the marks of doc/verification.md, and the figures beside it."""
    page = ROOT / "doc" / "verification.md"
    begin, end = "<!-- finite elements: begin -->", "<!-- finite elements: end -->"
    before, rest = page.read_text().split(begin)
    page.write_text(f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}")
    for name in FIGURES:
        shutil.copy(RESULTS / name, ROOT / "doc" / "figures" / name)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help="only these, without figures")
    parser.add_argument("--publish", action="store_true", help="put them into doc/")
    parser.add_argument("--list", action="store_true", help="list the cases")
    asked = parser.parse_args()
    known = [*COMPARED, "softening"]
    if asked.list or set(asked.cases) - set(known):
        print("cases:", ", ".join(known))
        return 0 if asked.list else 1
    wanted = asked.cases or known
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        started = {
            name: pool.submit(run, name, groups, label)
            for name, (groups, label) in jobs(wanted).items()
        }
        runs = {name: job.result() for name, job in started.items()}
    found = {name: comparison(name, runs) for name in COMPARED if name in wanted}
    text = f"Printed by `make finite_elements`, {date.today().isoformat()}:\n\n"
    text += text_of(comparison_table(found)) if found else ""
    if "softening" in wanted:
        text += "\n\nThe specimen that softens:\n\n" + text_of(softening_table(runs))
    print(text)
    if not asked.cases:
        (RESULTS / "finite_elements.md").write_text(text + "\n")
        figures(found, runs)
        if asked.publish:
            publish(text)
    failed = [name for name, lines in found.items() if not lines[-1].passed]
    print("failed: " + ", ".join(failed) if failed else "all within 3 % on the finest grid")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
