"""Clouds of points with plain and with balanced weights: `make clouds`.

Three tables: a cloud at rest in homogeneous shear (the patch test), a specimen in compression from
a cloud and from a lattice, and what balanced weights cost. With --publish they are put into
doc/model.md too. The points are those of a square lattice, each moved at random within `jitter`
spacings along both axes; results are in results/clouds.
"""

from __future__ import annotations

import argparse
import platform
import re
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

import numpy as np
import verify
from perigeo_post import Run, apparent_modulus, stress_strain
from verify import PROGRAM, ROOT, ROOT_3, SIGMA_Y, E, G, Groups

RESULTS = ROOT / "results" / "clouds"
SHEAR = 1.0e-3
CONTROLS: dict[str, dict[str, object]] = {
    "none": {"method": "none"},
    "silling, 0.0125": {"method": "silling", "factor": 0.0125},
    "relaxing, 0.5, 1e-4": {
        "method": "relaxing",
        "relaxing_stiffness": 0.5,
        "relaxing_strain": 1.0e-4,
    },
}


def cloud(path: Path, columns: int, rows: int, layers: tuple[int, int], jitter: float) -> None:
    """Write a cloud over columns x rows cells of a unit width, with layers at sides and ends.

    Layers at the sides and ends make one boundary, `rim`; those at the ends alone two, `bottom` and
    `top`.
    """
    beside, beyond = layers
    spacing = 1.0 / columns
    shape = (rows + 2 * beyond, columns + 2 * beside, 2)
    way = jitter * np.random.default_rng(1).uniform(-1.0, 1.0, shape)
    lines = []
    for j in range(-beyond, rows + beyond):
        for i in range(-beside, columns + beside):
            x, y = (np.array([i, j]) + 0.5 + way[j + beyond, i + beside]) * spacing
            name = ""
            if beside and not (0 <= i < columns and 0 <= j < rows):
                name = "rim"
            elif not 0 <= j < rows:
                name = "bottom" if j < 0 else "top"
            lines.append(f"{x:.10f} {y:.10f} {spacing**2:.12g} {name}".rstrip())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*lines, ""]))


def run(name: str, groups: Groups) -> Run:
    """Run the program on one thread in results/clouds and open its result."""
    folder = RESULTS / name
    path = write(name, groups)
    return verify.execute(
        name, folder, [str(PROGRAM), "--threads", "1", "--force", "--quiet", str(path)]
    )


def write(name: str, groups: Groups) -> Path:
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.nml"
    head = ("run", {"name": name, "output_dir": str(folder)})
    path.write_text(verify.namelist([head, *groups]))
    return path


def discretisation(n: int, m: float, weights: str) -> tuple[str, dict[str, object]]:
    # a little more than m spacings, so that round-off of the input decides about no bond
    keys: dict[str, object] = {"spacing": 1.0 / n, "horizon": 1.0001 * m / n}
    if weights:
        keys["cloud_weights"] = weights
    return ("discretisation", keys)


def patch(n: int, m: int, jitter: float, weights: str, control: str = "none") -> float:
    """Mean shear stress of n x n points at rest within a rim sheared homogeneously, over G gamma.

    The rim is m rows of points thick. It takes 1 ms to its place; damping then brings the body to
    rest.
    """
    name = f"patch_{n}_{m}_{100.0 * jitter:.0f}_{weights}_{control.split(',')[0]}"
    cloud(RESULTS / name / "points.txt", n, n, (m, m), jitter)
    result = run(
        name,
        [
            discretisation(n, m, weights),
            ("body", {"shape": "file", "file": "points.txt"}),
            verify.material("elastic", strain_measure="small"),
            (
                "boundary",
                {
                    "name": "rim",
                    "side": "bottom",
                    "contact": "affine",
                    "velocity_gradient": (0.0, 2.0 * SHEAR * 1000.0, 0.0, 0.0),
                    "times": (0.0, 0.001),
                    "factors": (1.0, 0.0),
                },
            ),
            ("integration", {"end_time": 0.4, "damping": 1.2e6}),
            ("stabilisation", CONTROLS[control]),
            ("output", {"history_count": 10, "frame_count": 1}),
        ],
    )
    *_, frame = result.frames()
    volume = result.volumes[result.body]
    stress = frame["stress_xy"][result.body]
    return float(volume @ stress / volume.sum()) / (G * SHEAR)


def specimen(n: int, jitter: float | None, weights: str) -> Groups:
    """1 m x 2 m of n x 2 n cells, m = 3; jitter None: on a lattice."""
    name, keys = discretisation(n, 3, weights)
    body: dict[str, object] = {"x_min": 0.0, "x_max": 1.0, "y_min": 0.0, "y_max": 2.0}
    if jitter is None:
        keys |= {"layout": "cells"}
    else:
        body |= {"shape": "file", "file": "points.txt"}
    return [(name, keys), ("body", body), *verify.platens()]


def compression(n: int, jitter: float | None, weights: str, control: str) -> tuple[float, ...]:
    """E_app over E, plateau over 2 sigma_y / sqrt(3), largest z / delta, control over work."""
    place = "lattice" if jitter is None else f"{100.0 * jitter:.0f}_{weights}"
    name = f"compression_{n}_{place}_{control.split(',')[0]}"
    if jitter is not None:
        cloud(RESULTS / name / "points.txt", n, 2 * n, (0, 3), jitter)
    result = run(
        name,
        [
            *specimen(n, jitter, weights),
            verify.material(),
            (
                "integration",
                {"final_strain": 0.01, "damping": 5.0e5, "damping_frame": "platens"},
            ),
            ("stabilisation", CONTROLS[control]),
            ("output", {"history_count": 400, "frame_count": 1}),
        ],
    )
    curve = stress_strain(result)
    plateau = float(curve.y[curve.x > 0.007].mean()) / (2.0 * SIGMA_Y / ROOT_3)
    *_, frame = result.frames()
    history = result.history()
    work = float(history["stabilisation_energy"][-1] / history["external_work"][-1])
    return (
        apparent_modulus(result).value / E,
        plateau,
        float(frame["zero_energy"][result.body].max()),
        work,
    )


def cost(n: int, weights: str) -> tuple[float, float, float]:
    """Seconds of a set-up (best of three), stable step [s], what is left unbalanced."""
    name = f"cost_{n}_{weights}"
    cloud(RESULTS / name / "points.txt", n, 2 * n, (0, 3), 0.2)
    end = ("integration", {"end_time": 1.0e-3, "time_step_rule": "courant"})
    groups = [*specimen(n, 0.2, weights), verify.material("elastic"), end]
    groups.append(("stabilisation", CONTROLS["none"]))
    path = write(name, groups)
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        done = subprocess.run(
            [str(PROGRAM), "--check", "--threads", "1", str(path)],
            capture_output=True,
            text=True,
            check=True,
        )
        best = min(best, time.perf_counter() - start)
    stable = re.search(r"2/omega_max = (\S+)", done.stdout)
    left = re.search(r"imbalance +([^:,]+)", done.stdout)
    if stable is None or left is None:
        raise RuntimeError(f"{name}: --check does not say what it should")
    return best, float(stable[1]), float(left[1])


def step(weights: str, control: str) -> float:
    """Milliseconds of one of 1000 steps of the elastic specimen of 40 x 80 cells."""
    name = f"step_{weights}_{control.split(',')[0]}"
    cloud(RESULTS / name / "points.txt", 40, 80, (0, 3), 0.2)
    result = run(
        name,
        [
            *specimen(40, 0.2, weights),
            verify.material("elastic"),
            ("stabilisation", CONTROLS[control]),
            ("integration", {"end_time": 0.1, "time_step_rule": "fixed", "time_step": 1.0e-4}),
            ("output", {"history_count": 1, "frame_count": 1}),
        ],
    )
    log = (RESULTS / name / f"{name}.log").read_text()
    found = re.search(r"time loop +(\S+) s", log)
    if found is None or not result.complete:
        raise RuntimeError(f"{name}: the log does not say how long the steps took")
    return float(found[1])


def percent(value: float) -> str:
    """A deviation from 1; round-off is 0."""
    off = 100.0 * (value - 1.0)
    return "0.00 %" if abs(off) < 5e-3 else f"{off:+.2f} %"


def patch_table() -> list[list[str]]:
    rows = [["points", "m", "jitter", "plain", "plain, silling", "balanced", "balanced, silling"]]
    cases = [(20, 3, 0.0), (20, 3, 0.05), (20, 3, 0.2), (20, 3, 0.4), (10, 3, 0.4), (40, 3, 0.4)]
    for n, m, jitter in [*cases, (20, 2, 0.4), (20, 4, 0.4)]:
        values = [
            percent(patch(n, m, jitter, weights, control))
            for weights in ("plain", "balanced")
            for control in ("none", "silling, 0.0125")
        ]
        rows.append([f"{n} x {n}", str(m), f"{jitter:g} dx", *values])
    return rows


def compression_table() -> list[list[str]]:
    head = ["points", "weights", "control", "E_app / E", "plateau", "largest z", "control / work"]
    rows = [head]
    cases: list[tuple[int, float | None, str]] = [
        (n, jitter, weights)
        for n in (20, 40)
        for jitter, weights in ((None, ""), (0.2, "plain"), (0.2, "balanced"), (0.4, "balanced"))
    ]
    for n, jitter, weights in cases:
        for control in CONTROLS:
            modulus, plateau, z, work = compression(n, jitter, weights, control)
            where = "lattice" if jitter is None else f"jitter {jitter:g} dx"
            rows.append(
                [
                    f"{n} x {2 * n}, {where}",
                    weights or "-",
                    control,
                    f"{modulus:.3f}",
                    f"{plateau:.3f}",
                    f"{z:.3f}",
                    f"{100.0 * work:.1f} %",
                ]
            )
    return rows


def cost_table() -> list[list[str]]:
    rows = [["points", "set-up, plain", "balanced", "stable step, over plain", "imbalance"]]
    for n in (20, 40, 80, 160):
        plain, balanced = cost(n, "plain"), cost(n, "balanced")
        rows.append(
            [
                str(n * (2 * n + 6)),
                f"{plain[0]:.2f} s",
                f"{balanced[0]:.2f} s",
                f"{balanced[1] / plain[1]:.3f}",
                f"{plain[2]:.2f} -> {balanced[2]:.0e}",
            ]
        )
    return rows


def step_table() -> list[list[str]]:
    """The best of five runs, by turns."""
    rows = [["control", "step, plain", "balanced"]]
    for control in CONTROLS:
        plain, balanced = np.inf, np.inf
        for _ in range(5):
            plain = min(plain, step("plain", control))
            balanced = min(balanced, step("balanced", control))
        rows.append([control, f"{plain:.2f} ms", f"{balanced:.2f} ms"])
    return rows


def text_of(rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    lines.insert(1, "|" + "---|" * len(rows[0]))
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--publish", action="store_true", help="put them into doc/model.md")
    arguments = parser.parse_args()
    cpuinfo = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", cpuinfo.read_text() if cpuinfo.exists() else "")
    cpu = names[0] if names else platform.machine()
    text = "\n\n".join(
        [
            f"{date.today().isoformat()}, {cpu}, one thread.",
            "Mean shear stress of a cloud at rest in homogeneous shear, against G gamma:",
            text_of(patch_table()),
            "Compression of 1 m x 2 m, perfectly plastic, m = 3 (plateau over 2 sigma_y / sqrt(3), "
            "0.7 to 1 % strain; z over the horizon):",
            text_of(compression_table()),
            "Set-up (`--check`, best of three), m = 3, jitter 0.2 dx:",
            text_of(cost_table()),
            "A step of 3440 points, elastic, m = 3 (best of five, by turns):",
            text_of(step_table()),
        ]
    )
    print(text)
    if arguments.publish:
        page = ROOT / "doc" / "model.md"
        begin, end = "<!-- clouds: begin -->", "<!-- clouds: end -->"
        before, rest = page.read_text().split(begin)
        page.write_text(f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
