"""The cases of the bench: bodies that the program is run on, and what their logs tell.

Every run gives a dictionary: seconds of the time loop and of each kernel, steps, points, bonds,
peak memory in bytes, threads.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "bin" / "perigeo"
UNALIGNED = ROOT / "build" / "unaligned" / "perigeo"  # the same with ALIGNED=0
RESULTS = ROOT / "results" / "bench"

C_P = float(np.sqrt(50.0e6 * 0.7 / (1.3 * 0.4) / 2000.0))  # of the material below [m/s]
KERNELS = (
    "motion",
    "gradient",
    "stress",
    "force",
    "boundaries",
    "history",
    "frames",
)

INPUT = """\
&run name = '{name}', output_dir = '{folder}', operators = '{operators}' /
&discretisation spacing = {dx}, horizon = {delta} /
&body x_max = {width}, x_min = 0.0, y_min = 0.0, y_max = {height} /
&material model = 'j2', strain_measure = 'green_lagrange', density = 2000.0,
  youngs_modulus = 50e6, poissons_ratio = 0.3,
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration end_time = {end}, time_step_rule = 'fixed', time_step = {dt},
  damping = 5e5, damping_frame = 'platens' /
&output frame_count = 1, history_count = {rows} /
"""
PLAIN = "&stabilisation method = 'none' /\n"
CONTROL = "&stabilisation method = 'silling', factor = 0.0125 /\n"


def run(
    path: Path, folder: Path, name: str, threads: int, program: Path = PROGRAM
) -> dict[str, float]:
    """Run the program; return what its log tells."""
    command = [str(program), "--quiet", "--force", "--threads", str(threads)]
    process = subprocess.Popen([*command, "--output", str(folder), str(path)])
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"bench: {path} ended with status {status}")
    log = (folder / f"{name}.log").read_text()
    found = {
        "loop": float(re.findall(r"time loop\s+(\S+) s", log)[-1]),
        "steps": float(re.findall(r"time loop.*steps (\d+)", log)[-1]),
        "points": float(re.findall(r"points\s+(\d+),", log)[-1]),
        "bonds": float(re.findall(r"bonds\s+([0-9.eE+-]+);", log)[-1]),
        "memory": 1024.0 * usage.ru_maxrss,
        "threads": float(threads),
    }
    line = re.findall(r"kernels \[s\](.*)", log)[-1]
    for kernel in KERNELS:
        found[kernel] = float(re.findall(rf"{kernel}\s+(\S+)", line)[-1])
    return found


def lattice_case(
    columns: int,
    rows: int,
    m: int,
    steps: int,
    threads: int = 1,
    operators: str = "lattice",
    more: str = "",
    program: Path = PROGRAM,
    vertices: str = "",
) -> dict[str, float]:
    """A specimen of columns x rows points, or a polygon within it, loaded for some steps."""
    name = f"{operators}_{columns}x{rows}_m{m}_t{threads}" + ("_more" if more else "")
    name += "_polygon" if vertices else ""
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    dx = 1.0 / (columns - 1)
    dt = 0.8 * dx / C_P
    text = INPUT.format(
        name=name,
        folder=folder,
        operators=operators,
        dx=repr(dx),
        delta=repr(m * dx),
        width=1.0,
        height=repr((rows - 1) * dx),
        end=repr(steps * dt),
        dt=repr(dt),
        rows=max(1, steps // 10),
    )
    if vertices:
        text = re.sub(
            r"&body [^/]*/", f"&body shape = 'polygon', vertices = {vertices} /", text, count=1
        )
    path = folder / f"{name}.nml"
    path.write_text(text + (more or PLAIN))
    return run(path, folder, name, threads, program)


def flowing_case(columns: int, rows: int, m: int, steps: int) -> dict[str, float]:
    """The last steps of a specimen of which every point flows: two runs, and the difference.

    Both ends move towards each other. The yield stress is so small that points flow as soon as the
    waves from the ends have passed, and the material hardens, so that they do not cease to.
    """
    name = f"flowing_{columns}x{rows}"
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    dx = 1.0 / (columns - 1)
    dt = 2.4 * dx / C_P
    runs = []
    for count in (rows // 3, rows // 3 + steps):
        text = INPUT.format(
            name=name,
            folder=folder,
            operators="lattice",
            dx=repr(dx),
            delta=repr(m * dx),
            width=1.0,
            height=repr((rows - 1) * dx),
            end=repr(count * dt),
            dt=repr(dt),
            rows=2,
        )
        text = re.sub(
            r"yield_stress = .*", "yield_stress = 1.0, kinematic_modulus = 1.5e6 /", text, count=1
        ).replace("side = 'bottom'", "side = 'bottom', velocity = 0.0, 0.01")
        path = folder / f"{name}.nml"
        path.write_text(text + PLAIN)
        runs.append(run(path, folder, name, 1))
    with h5py.File(folder / f"{name}.h5", locking=False) as file:
        last = file["frames"][sorted(file["frames"])[-1]]
        if not (last["plastic_strain"][()] > 0.0).all():
            sys.exit(f"bench: not every point of {name} flows")
    early, late = runs
    differences = {key: late[key] - early[key] for key in ("loop", "steps", *KERNELS)}
    return {**late, **differences}


def set_up_seconds(side: int, m: int, threads: int) -> float:
    """Wall-clock time of --check with the stable step of a square of so many points, all in all."""
    dx = 1.0 / (side - 1)
    text = INPUT.format(
        name="set_up",
        folder=RESULTS / "set_up",
        operators="lattice",
        dx=repr(dx),
        delta=repr(m * dx),
        width=1.0,
        height=1.0,
        end=1.0,
        dt=0.0,
        rows=1,
    ).replace("time_step_rule = 'fixed', time_step = 0.0,", "time_step_rule = 'spectral',")
    path = RESULTS / "set_up.nml"
    path.write_text(text + PLAIN)
    start = time.perf_counter()
    command = [str(PROGRAM), "--check", "--threads", str(threads), str(path)]
    if subprocess.run(command, stdout=subprocess.DEVNULL).returncode != 0:
        sys.exit(f"bench: {path} is refused")
    return time.perf_counter() - start


def cloud_case(points: int, steps: int, threads: int) -> dict[str, float]:
    """A square of random points (a jittered lattice) with about 48 bonds each."""
    name = f"cloud_t{threads}"
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    side = int(np.sqrt(points))
    dx = 1.0 / side
    random = np.random.default_rng(1)
    x, y = (g.ravel() for g in np.meshgrid(*(2 * [(np.arange(side) + 0.5) * dx])))
    x = x + random.uniform(-0.3, 0.3, side**2) * dx
    y = y + random.uniform(-0.3, 0.3, side**2) * dx
    with (folder / "points.txt").open("w") as file:
        for px, py in zip(x, y):
            word = "bottom" if py < 4 * dx else "top" if py > 1.0 - 4 * dx else ""
            file.write(f"{px:.9f} {py:.9f} {dx * dx:.9e} {word}\n")
    dt = 0.3 * dx / C_P
    text = INPUT.format(
        name=name,
        folder=folder,
        operators="auto",
        dx=repr(dx),
        delta=repr(3.95 * dx),
        width=1.0,
        height=1.0,
        end=repr(steps * dt),
        dt=repr(dt),
        rows=max(1, steps // 10),
    )
    text = text.replace("&body ", "&body shape = 'file', file = 'points.txt', ")
    path = folder / f"{name}.nml"
    path.write_text(text + PLAIN)
    return run(path, folder, name, threads)


def whole_case(
    name: str, change: dict[str, str], threads: int, program: Path = PROGRAM
) -> dict[str, float]:
    """The reference case, with some lines of its input changed."""
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    text = (ROOT / "input" / "compression.nml").read_text()
    for old, new in {"name = 'compression'": f"name = '{name}'", **change}.items():
        if old not in text:
            sys.exit(f"bench: no '{old}' in input/compression.nml")
        text = text.replace(old, new)
    path = folder / f"{name}.nml"
    path.write_text(text)
    return run(path, folder, name, threads, program)


def best(times: int, *cases: Callable[[], dict[str, float]]) -> list[dict[str, float]]:
    """Run cases by turns, and keep the fastest run of each: other work on the machine only adds."""
    found = [[case() for case in cases] for _ in range(times)]
    return [min(runs, key=step_ns) for runs in zip(*found)]


def loop_seconds(found: dict[str, float]) -> float:
    """Seconds of the time loop; frames aside, whose number is the user's choice."""
    return found["loop"] - found["frames"]


def step_ns(found: dict[str, float]) -> float:
    """Nanoseconds of a whole step for a point, times the threads: per core."""
    return 1e9 * loop_seconds(found) * found["threads"] / found["steps"] / found["points"]


def bond_rate(found: dict[str, float]) -> float:
    """Millions of directed bonds per second and core, gradient and force together once."""
    seconds = (found["gradient"] + found["force"]) * found["threads"]
    return 1e-6 * found["bonds"] * found["steps"] / seconds


def curve_difference(one: str, other: str, last_strain: float) -> float:
    """Largest difference of two stress-strain curves up to a strain, in per cent of the peak."""
    curves = []
    for name in (one, other):
        rows = np.genfromtxt(RESULTS / name / f"{name}_history.csv", delimiter=",", names=True)
        curves.append((rows["strain"], rows["bottom_force_y"]))
    (strain, force), (strains, forces) = curves
    kept = strain <= last_strain
    difference = np.abs(force[kept] - np.interp(strain[kept], strains, forces))
    return float(100.0 * difference.max() / np.abs(force).max())
