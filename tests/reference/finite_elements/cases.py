"""The cases that are calculated with CalculiX and with perigeo, as CalculiX gets them.

    cases.py [NAME ...]   run CalculiX and write data/NAME.csv (all, or these); --list lists them
    cases.py --decks      write the decks to results/finite_elements/decks and run nothing

Only this needs CalculiX (`apt-get install calculix-ccx`); `make finite_elements` compares perigeo
with the curves that are kept in data/.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import ccx
import numpy as np
from ccx import Grid, Model, Soil

HERE = Path(__file__).resolve().parent
DATA = HERE / "data"
WORK = HERE.parents[2] / "results" / "finite_elements" / "decks"

E, NU, SIGMA_Y = 50.0e6, 0.3, 0.15e6  # the soil of the paper [Pa, 1, Pa]
SOFTENING, RESIDUAL = -1.5e6, 15.0e3  # isotropic modulus, residual strength [Pa]
HARDENING_FINITE, HARDENING_CYCLIC = 1.5e6, 5.0e6  # isotropic and kinematic [Pa]
WIDTH, HEIGHT = 1.0, 2.0  # of the specimen [m]
STRAIN, STRAIN_FINITE, STRAIN_CYCLIC = 0.012, 0.04, 0.005  # to which it is compressed
WEAK = (0.0, 0.5, 0.1)  # centre and radius of the weak patch [m]
DURATION = 24.0  # of a dynamic calculation [s]
WEAKER = 0.01  # by which its strength is smaller

CLAY_E, CLAY_C = 10.0e6, 10.0e3  # of the footing: modulus and cohesion [Pa]
FOOTING, SETTLEMENT = 1.0, 0.05  # width B, and how far it is pressed down [m]
GROUND = 3.0  # half the width and the depth of the ground [m]

MESHES = (0.1, 0.05, 0.025)  # size of the elements [m]
EDGES = (0.05, 0.02, 0.01)  # of those at the edge of the footing [m]


def hardening(modulus: float, far: float = 1.0) -> list[tuple[float, float]]:
    return [(SIGMA_Y, 0.0), (SIGMA_Y + far * modulus, far)]


def specimen(element: str, size: float, soil: Soil, **keys: object) -> Model:
    """1 m x 2 m between a rough bottom and a smooth top that moves."""
    grid = Grid(
        np.linspace(0.0, WIDTH, round(WIDTH / size) + 1),
        np.linspace(0.0, HEIGHT, round(HEIGHT / size) + 1),
        2 if element.startswith("CPE8") else 1,
    )
    values: dict[str, object] = {"increments": 100, "way": [(0.0, 0.0), (1.0, -STRAIN * HEIGHT)]}
    return Model(
        title=f"1 m x 2 m, {element}, h = {size:g} m",
        grid=grid,
        element=element,
        soil=soil,
        fixed=[("BOTTOM", grid.on("bottom"), (1, 2))],
        driven=grid.on("top"),
        **(values | keys),
    )


def compression(size: float, element: str = "CPE8R") -> Model:
    """Small strain, perfectly plastic."""
    return specimen(element, size, Soil(E, NU, [(SIGMA_Y, 0.0)]), increments=60)


def finite(size: float) -> Model:
    """Large deformation, isotropic hardening."""
    soil = Soil(E, NU, hardening(HARDENING_FINITE))
    way = [(0.0, 0.0), (1.0, -STRAIN_FINITE * HEIGHT)]
    return specimen("CPE8R", size, soil, way=way, finite=True, increments=100)


def cyclic(size: float) -> Model:
    """Down, up and down again; kinematic hardening, large deformation.

    With small strain CalculiX 2.20 moves the yield surface against the flow: one element softens
    where its table rises.
    """
    soil = Soil(E, NU, hardening(HARDENING_CYCLIC), kinematic=True)
    a = STRAIN_CYCLIC * HEIGHT
    way = [(0.0, 0.0), (1.0, -a), (3.0, a), (5.0, -a)]
    return specimen("CPE8R", size, soil, way=way, finite=True, increments=25)


def softening(size: float, element: str, dynamic: bool = False) -> Model:
    """Small strain, isotropic softening down to a residual strength, from a weak patch.

    Fine meshes of 8 nodes set free more energy at once than their bands take, and a static
    calculation finds no equilibrium beyond the peak. Loaded within DURATION, with inertia, they get
    through.
    """
    end = (RESIDUAL - SIGMA_Y) / SOFTENING
    soil = Soil(E, NU, [(SIGMA_Y, 0.0), (RESIDUAL, end), (RESIDUAL, end + 10.0)])
    keys: dict[str, object] = {"weak": WEAK, "weak_factor": 1.0 - WEAKER}
    if dynamic:
        way = [(0.0, 0.0), (DURATION, -STRAIN * HEIGHT)]
        increments = 100 if size > 0.03 else 60  # the finest mesh takes long
        keys |= {"dynamic": True, "way": way, "increments": increments / DURATION}
    return specimen(element, size, soil, **keys)


def growing(first: float, largest: float, length: float) -> np.ndarray:
    """Places from 0 to a length whose distances grow by a quarter from one to the next."""
    sizes = [first]
    while sum(sizes) < length:
        sizes.append(min(1.25 * sizes[-1], largest))
    places = np.concatenate([[0.0], np.cumsum(sizes)])
    return places * length / places[-1]


def footing(size: float, element: str = "CPE8R") -> Model:
    """The right half of the ground; elements of about `size` at the edge of the footing.

    They grow away from it: to 0.05 B below the footing, 0.1 B beside and below it, 0.25 B farther
    off. With elements of one size the footing would be wider by about one of them.
    """
    half = 0.5 * FOOTING
    under = half - growing(size, 0.05 * FOOTING, half)[::-1]
    beside = half + growing(size, 0.1 * FOOTING, FOOTING)[1:]
    depth = growing(size, 0.1 * FOOTING, 1.5 * FOOTING)
    far = growing(0.1 * FOOTING, 0.25 * FOOTING, GROUND - 1.5 * FOOTING)[1:]
    across = np.concatenate([under, beside, beside[-1] + far])
    down = np.concatenate([depth, depth[-1] + far])
    grid = Grid(across, -down[::-1], 2 if element.startswith("CPE8") else 1)
    rigid = grid.on("top", (0.0, 0.5 * FOOTING))
    return Model(
        title=f"half of a rough strip footing, {element}, h = {size:g} m",
        grid=grid,
        element=element,
        soil=Soil(CLAY_E, NU, [(np.sqrt(3.0) * CLAY_C, 0.0)]),
        fixed=[
            ("BASE", grid.on("bottom"), (1, 2)),
            ("SIDES", grid.on("left") + grid.on("right"), (1,)),
            ("ROUGH", rigid, (1,)),
        ],
        driven=rigid,
        way=[(0.0, 0.0), (1.0, -SETTLEMENT)],
        increments=50,
    )


def all_cases() -> dict[str, Callable[[], Model]]:
    """Name of a curve -> its model."""
    cases: dict[str, Callable[[], Model]] = {}
    for size in (0.2, 0.1):
        stem = f"{1000 * size:03.0f}"
        cases[f"compression_cpe8r_{stem}"] = lambda size=size: compression(size)
        cases[f"compression_cpe4_{stem}"] = lambda size=size: compression(size, "CPE4")
        cases[f"finite_cpe8r_{stem}"] = lambda size=size: finite(size)
        cases[f"cyclic_cpe8r_{stem}"] = lambda size=size: cyclic(size)
    cases["finite_cpe8r_050"] = lambda: finite(0.05)
    for size in MESHES:
        stem = f"{1000 * size:03.0f}"
        cases[f"softening_dynamic_{stem}"] = lambda size=size: softening(size, "CPE8R", True)
        cases[f"softening_cpe8r_{stem}"] = lambda size=size: softening(size, "CPE8R")
        cases[f"softening_cpe4_{stem}"] = lambda size=size: softening(size, "CPE4")
    for size in EDGES:
        stem = f"{1000 * size:03.0f}"
        cases[f"footing_cpe8r_{stem}"] = lambda size=size: footing(size)
        cases[f"footing_cpe4_{stem}"] = lambda size=size: footing(size, "CPE4")
    return cases


def version() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"Version (\S+)", said)
    return found[1] if found else "unknown"


def store(name: str, model: Model, rows: np.ndarray) -> None:
    """Write data/NAME.csv: what it is, which deck, displacement and force."""
    rows = rows if name[:7] != "footing" else rows * [1.0, 1.0, 2.0]  # both halves
    DATA.mkdir(exist_ok=True)
    head = [
        f"# {model.title}; CalculiX {version()}; deck {ccx.digest(ccx.deck(model))}",
        "displacement [m],force [N/m]",
    ]
    text = [f"{row[1]:.7g},{row[2]:.7g}" for row in rows]
    (DATA / f"{name}.csv").write_text("\n".join([*head, *text]) + "\n")


def load(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] and force [N/m], positive upwards, of a stored curve."""
    values = np.loadtxt(DATA / f"{name}.csv", delimiter=",", comments="#", skiprows=2, ndmin=2)
    return values[:, 0], values[:, 1]


def main() -> int:
    cases = all_cases()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--list", action="store_true", help="list the names")
    parser.add_argument("--decks", action="store_true", help="write decks, run nothing")
    asked = parser.parse_args()
    unknown = set(asked.names) - set(cases)
    if asked.list or unknown:
        print("cases:", *cases)
        return 1 if unknown else 0
    for name in asked.names or cases:
        model = cases[name]()
        if asked.decks:
            WORK.mkdir(parents=True, exist_ok=True)
            (WORK / f"{name}.inp").write_text(ccx.deck(model))
            continue
        start = time.perf_counter()
        rows = ccx.run(model, WORK, name)
        store(name, model, rows)
        came = f"{len(rows) - 1} increments, time {rows[-1, 0]:g} of {model.way[-1][0]:g}"
        print(f"{name}: {came}, {time.perf_counter() - start:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
