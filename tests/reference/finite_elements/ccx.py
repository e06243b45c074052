"""Decks for CalculiX (ccx) in plane strain, runs of it, and what it prints.

CalculiX expands elements of plane strain to one layer of bricks: CPE8R to C3D20R, with reduced
integration, and CPE4 to C3D8, whose eight points take the mean volume change of the element.
Forces are those of a thickness of 1 m. https://www.calculix.de, G. Dhondt and K. Wittig.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

Nodes = dict[int, tuple[float, float]]
EPSILON = 1.0e-9


@dataclass
class Grid:
    """A rectangle of quadrilaterals between lines x and y; order 1 (4 nodes) or 2 (8 nodes)."""

    x: np.ndarray
    y: np.ndarray
    order: int
    nodes: Nodes = field(default_factory=dict)
    elements: list[list[int]] = field(default_factory=list)
    centres: list[tuple[float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        across, up = (self._with_middles(values) for values in (self.x, self.y))
        step = self.order
        number: dict[tuple[int, int], int] = {}
        for j, y in enumerate(up):
            for i, x in enumerate(across):
                if step == 2 and i % 2 and j % 2:
                    continue  # eight nodes: none in the middle
                number[i, j] = len(number) + 1
                self.nodes[number[i, j]] = (float(x), float(y))
        corners = [(0, 0), (step, 0), (step, step), (0, step)]
        middles = [(1, 0), (2, 1), (1, 2), (0, 1)] if step == 2 else []
        for j in range(0, len(up) - 1, step):
            for i in range(0, len(across) - 1, step):
                places = [(i + a, j + b) for a, b in corners + middles]
                self.elements.append([number[place] for place in places])
                centre = (across[i] + across[i + step], up[j] + up[j + step])
                self.centres.append((0.5 * float(centre[0]), 0.5 * float(centre[1])))

    def _with_middles(self, lines: np.ndarray) -> np.ndarray:
        if self.order == 1:
            return lines
        every = np.empty(2 * len(lines) - 1)
        every[::2] = lines
        every[1::2] = 0.5 * (lines[1:] + lines[:-1])
        return every

    def on(self, side: str, span: tuple[float, float] = (-np.inf, np.inf)) -> list[int]:
        """Nodes on a side, or on a part of it, its ends included."""
        axis = 0 if side in ("left", "right") else 1
        lines = (self.x, self.y)[axis]
        place = lines[0] if side in ("left", "bottom") else lines[-1]
        return [
            number
            for number, point in self.nodes.items()
            if abs(point[axis] - place) < EPSILON
            and span[0] - EPSILON <= point[1 - axis] <= span[1] + EPSILON
        ]


@dataclass
class Soil:
    """J2 plasticity: stress against equivalent plastic strain in a table."""

    young: float
    poisson: float
    table: list[tuple[float, float]]  # stress [Pa], plastic strain
    kinematic: bool = False

    def deck(self, name: str, factor: float = 1.0) -> list[str]:
        """`factor` on the initial strength; a residual one stays as it is."""
        rows = list(self.table)
        if factor != 1.0:
            (first, _), (second, strain) = rows[0], rows[1]
            falls = second < first
            # the line keeps its slope, so that it ends at another plastic strain
            end = strain * (factor * first - second) / (first - second) if falls else strain
            rows[:2] = [(factor * first, 0.0), (second if falls else factor * second, end)]
            if len(rows) > 2:
                rows[2] = (rows[2][0], max(rows[2][1], end + 1.0))
        lines = [f"*MATERIAL, NAME={name}", "*ELASTIC", f"{self.young:.10g}, {self.poisson:.10g}"]
        lines.append("*PLASTIC" + (", HARDENING=KINEMATIC" if self.kinematic else ""))
        return lines + [f"{stress:.10g}, {strain:.10g}" for stress, strain in rows]


@dataclass
class Model:
    """All that a deck says."""

    title: str
    grid: Grid
    element: str
    soil: Soil
    fixed: list[tuple[str, list[int], tuple[int, ...]]]  # name, nodes, directions held
    driven: list[int]  # nodes that are moved along y, in the set DRIVEN
    way: list[tuple[float, float]]  # time, displacement [m]
    increments: float  # over a unit of time
    finite: bool = False  # large deformation
    weak: tuple[float, float, float] | None = None  # centre x, y and radius of a weak patch
    weak_factor: float = 1.0
    dynamic: bool = False  # inertia, where no equilibrium is found
    density: float = 2000.0


def _set(kind: str, name: str, members: list[int]) -> list[str]:
    rows = [members[k : k + 12] for k in range(0, len(members), 12)]
    return [f"*{kind}, {kind}={name}", *(", ".join(map(str, row)) + "," for row in rows)]


def deck(model: Model) -> str:
    """The text of an input file of CalculiX."""
    grid = model.grid
    weak = [False] * len(grid.elements)
    if model.weak:
        x, y, radius = model.weak
        weak = [(a - x) ** 2 + (b - y) ** 2 <= radius**2 for a, b in grid.centres]
    lines = ["*HEADING", model.title, "*NODE, NSET=ALL"]
    lines += [f"{n}, {x:.10g}, {y:.10g}, 0." for n, (x, y) in grid.nodes.items()]
    for name, wanted in (("SOUND", False), ("WEAK", True)):
        chosen = [k for k, is_weak in enumerate(weak) if is_weak == wanted]
        if chosen:
            lines.append(f"*ELEMENT, TYPE={model.element}, ELSET={name}")
            lines += [f"{k + 1}, " + ", ".join(map(str, grid.elements[k])) for k in chosen]
            lines += model.soil.deck(name, model.weak_factor if wanted else 1.0)
            if model.dynamic:
                lines += ["*DENSITY", f"{model.density:.10g}"]
            lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", "1."]
    for name, members, _ in model.fixed:
        lines += _set("NSET", name, members)
    lines += _set("NSET", "DRIVEN", model.driven)
    lines += ["*BOUNDARY"]
    lines += [f"{name}, {d}, {d}" for name, _, held in model.fixed for d in held]
    lines += ["*AMPLITUDE, NAME=WAY"]
    lines += [f"{time:.10g}, {way:.10g}" for time, way in model.way]
    if len(model.way) > 2:
        lines += ["*TIME POINTS, NAME=PRINTED, GENERATE"]
        lines += [
            f"{1.0 / model.increments:.10g}, {model.way[-1][0]:.10g}, {1.0 / model.increments:.10g}"
        ]
    return "\n".join([*lines, *_step(model)]) + "\n"


def _step(model: Model) -> list[str]:
    end, step = model.way[-1][0], 1.0 / model.increments
    large = ", NLGEOM" if model.finite else ""
    turns = len(model.way) > 2  # increments have to end where the way turns round
    at = ", TIME POINTS=PRINTED" if turns else ", FREQUENCY=1"
    kind = "*DYNAMIC, ALPHA=-0.3" if model.dynamic else "*STATIC"
    return [
        f"*STEP, INC=100000{large}",
        kind,
        f"{step:.10g}, {end:.10g}, {step * 1.0e-6:.10g}, {step:.10g}",
        "*CONTROLS, PARAMETERS=TIME INCREMENTATION",
        "8, 16, 9, 60, 20, 4, , 20, ,",
        "0.25, 0.5, 0.75, 0.85, , , 1.5, ",
        "*BOUNDARY, AMPLITUDE=WAY",
        "DRIVEN, 2, 2, 1.",
        f"*NODE PRINT, NSET=DRIVEN, TOTALS=ONLY{at}",
        "RF",
        "*END STEP",
    ]


def digest(text: str) -> str:
    """Says which deck a result belongs to."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


FORCE = re.compile(r"total force \(fx,fy,fz\) for set DRIVEN and time +(\S+)\s+(\S+) +(\S+) +\S+")


def run(model: Model, folder: Path, name: str) -> np.ndarray:
    """Rows of time, displacement [m] and force [N/m] along y, as far as CalculiX came."""
    program = shutil.which("ccx")
    if program is None:
        raise RuntimeError("CalculiX (ccx) is not installed: apt-get install calculix-ccx")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.inp").write_text(deck(model))
    with (folder / f"{name}.out").open("w") as log:
        subprocess.run([program, "-i", name], cwd=folder, stdout=log, stderr=log, check=False)
    found = FORCE.findall((folder / f"{name}.dat").read_text())
    times = np.array([0.0, *(float(row[0]) for row in found)])
    force = np.array([0.0, *(float(row[2]) for row in found)])
    way = np.interp(times, *np.array(model.way).T)
    return np.column_stack([times, way, force])
