"""Measure the speed of the program: `make bench`.

Runs the program itself and reads the seconds of its kernels from the end of its log. Prints tables,
writes results/bench.json, and with --publish the tables of doc/performance.md. All numbers of one
call come from one machine in one go; ratios mean more than times, which are noisy.

    bench.py [--quick] [--publish]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "bin" / "perigeo"
MACHINE = ROOT / "build" / "opt" / "bench" / "machine"
RESULTS = ROOT / "results" / "bench"
PAGE = ROOT / "doc" / "performance.md"

C_P = float(np.sqrt(50.0e6 * 0.7 / (1.3 * 0.4) / 2000.0))  # of the material below [m/s]
KERNELS = ("motion", "gradient", "stress", "divergence", "control", "boundaries", "output")

# What a kernel must move and compute for an elastic point of a lattice [bytes, flops];
# every array once; gradient and stress run in one loop and hand G over in the cache. Gradient and
# divergence each have two x sums of m - 1 rows and m columns, and two y sums of m rows and m
# columns, with 3 flops for a row or a column.
BYTES = {"motion": 192, "gradient": 32, "stress": 200, "divergence": 64}
FLOPS = {"motion": 44, "gradient": 8, "stress": 110, "divergence": 6}
SUMS = ("gradient", "divergence")


def flops_of_sums(m: int) -> int:
    """Of one of the operators, for the Gaussian influence function."""
    return 2 * 3 * (2 * m - 1) + 2 * 3 * (2 * m)


INPUT = """\
&run name = '{name}', output_dir = '{folder}', operators = '{operators}' /
&discretisation spacing = {dx}, horizon = {delta} /
&body x_max = {width}, x_min = 0.0, y_min = 0.0, y_max = {height} /
&material model = 'j2', density = 2000.0, youngs_modulus = 50e6, poissons_ratio = 0.3,
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration end_time = {end}, time_step_rule = 'fixed', time_step = {dt},
  damping = 5e5, damping_frame = 'platens' /
&output frame_count = 1, history_count = {rows} /
"""


def run(path: Path, folder: Path, name: str, threads: int) -> dict[str, float]:
    """Run the program; seconds by kernel, steps, points, bonds, peak memory."""
    command = [str(PROGRAM), "--quiet", "--force", "--threads", str(threads)]
    process = subprocess.Popen([*command, "--output", str(folder), str(path)])
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"bench: {path} ended with status {status}")
    log = (folder / f"{name}.log").read_text()
    found = {
        "loop": float(re.findall(r"time loop\s+(\S+) s", log)[-1]),
        "steps": float(re.findall(r"time loop.*steps (\d+)", log)[-1]),
        "points": float(re.findall(r"points\s+(\d+),", log)[-1]),
        "bonds": float(re.findall(r"bonds\s+([0-9.E+]+);", log)[-1]),
        "memory": 1024.0 * usage.ru_maxrss,
        "threads": float(threads),
    }
    line = re.findall(r"kernels \[s\](.*)", log)[-1]
    for kernel in KERNELS:
        found[kernel] = float(re.findall(rf"{kernel}\s+(\S+)", line)[-1])
    return found


def lattice_case(
    columns: int, rows: int, m: int, steps: int, threads: int = 1, operators: str = "lattice"
) -> dict[str, float]:
    """A specimen of columns x rows points, loaded for some steps."""
    name = f"{operators}_{columns}x{rows}_m{m}_t{threads}"
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
    path = folder / f"{name}.nml"
    path.write_text(text)
    return run(path, folder, name, threads)


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
    path.write_text(text)
    return run(path, folder, name, threads)


def whole_case(name: str, change: dict[str, str], threads: int) -> dict[str, float]:
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
    return run(path, folder, name, threads)


def step_ns(found: dict[str, float]) -> float:
    """Nanoseconds of a whole step for a point, times the threads: per core."""
    return 1e9 * found["loop"] * found["threads"] / found["steps"] / found["points"]


def bond_rate(found: dict[str, float]) -> float:
    """Millions of directed bonds per second and core, gradient and divergence together once."""
    seconds = (found["gradient"] + found["divergence"]) * found["threads"]
    return 1e-6 * found["bonds"] * found["steps"] / seconds


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table that reads well as text and as Markdown."""
    widths = [max(len(line[k]) for line in [head, *rows]) for k in range(len(head))]
    lines = [head, ["-" * width for width in widths], *rows]
    return "\n".join(
        "| " + " | ".join(c.ljust(w) for c, w in zip(line, widths)) + " |" for line in lines
    )


def machine() -> dict[str, float]:
    """Triad and multiply-adds of this machine."""
    words = subprocess.run(
        [str(MACHINE)], capture_output=True, text=True, check=True
    ).stdout.split()
    return {words[k]: float(words[k + 1]) for k in range(0, len(words), 2)}


def processor() -> str:
    """Name of the processor."""
    try:
        found = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text())
    except OSError:
        found = None
    return found.group(1) if found else platform.processor() or platform.machine()


def share_row(label: str, found: dict[str, float]) -> list[str]:
    shares = [f"{100.0 * found[kernel] / found['loop']:.1f}" for kernel in KERNELS]
    return [label, f"{step_ns(found):.1f}", f"{bond_rate(found):.0f}", *shares]


def roofline(found: dict[str, float], limits: dict[str, float], m: int) -> list[list[str]]:
    """Each kernel against what memory and arithmetic of one core allow."""
    rows = []
    for kernel in BYTES:
        measured = 1e9 * found[kernel] / found["steps"] / found["points"]
        memory = BYTES[kernel] / limits["triad_1"]
        flops = FLOPS[kernel] + (flops_of_sums(m) if kernel in SUMS else 0)
        arithmetic = flops / limits["flops_1"]
        bound = max(memory, arithmetic)
        rows.append(
            [
                kernel,
                f"{measured:.1f}",
                f"{memory:.1f}",
                f"{arithmetic:.1f}",
                f"{100.0 * bound / measured:.0f} %",
            ]
        )
    return rows


def measure(quick: bool) -> tuple[dict[str, object], list[tuple[str, str]]]:
    """All measurements, and the tables that show them."""
    limits = machine()
    cores = int(limits["cores"])
    few = 4 if quick else 1
    data: dict[str, object] = {"machine": limits, "processor": processor()}
    tables = []

    def case(name: str, found: dict[str, float]) -> dict[str, float]:
        data[name] = found
        return found

    a = case("a_lattice", whole_case("a_lattice", {}, 1))
    a_all = case("a_all", whole_case("a_all", {}, cores))
    old = {
        "time_step_rule = 'spectral'": "time_step_rule = 'courant'",
        "safety = 0.9": "safety = 0.5",
    }
    a_old = case(
        "a_list_courant",
        whole_case("a_list_courant", {**old, "&run": "&run operators = 'list'"}, 1),
    )
    a_list = case("a_list", whole_case("a_list", {"&run": "&run operators = 'list'"}, 1))
    m3 = {"horizon = 0.08": "horizon = 0.06"}
    a_m3 = case("a_m3", whole_case("a_m3", m3, 1))
    b = case("b_lattice", lattice_case(1000, 1000, 4, 100 // few))
    b_all = case("b_all", lattice_case(1000, 1000, 4, 100 // few, cores))
    b_list = case("b_list", lattice_case(1000, 1000, 4, 12 // few, 1, "list"))
    c = case("c_cloud", cloud_case(100_000, 200 // few, 1))
    c_all = case("c_all", cloud_case(100_000, 200 // few, cores))

    head = ["case", "ns/point-step", "10^6 bonds/s", *(f"{k} %" for k in KERNELS)]
    rows = [
        share_row("(a) reference 51 x 101, m = 4", a),
        share_row("(a) m = 3", a_m3),
        share_row("(a) list", a_list),
        share_row("(b) 1000 x 1000, m = 4", b),
        share_row("(b) list", b_list),
        share_row("(c) cloud, 100,000 points", c),
    ]
    tables.append(("One thread: a whole step, and where its time goes", table(head, rows)))

    ratios = [
        ["lattice over list, step, (b)", "4", f"{step_ns(b_list) / step_ns(b):.2f}"],
        ["lattice over list, step, (a)", "2.5", f"{step_ns(a_list) / step_ns(a):.2f}"],
        [f"{cores} threads over 1, (b)", "1.8", f"{cores * step_ns(b) / step_ns(b_all):.2f}"],
        [f"{cores} threads over 1, (a)", "1.6", f"{cores * step_ns(a) / step_ns(a_all):.2f}"],
        [f"{cores} threads over 1, (c)", "", f"{cores * step_ns(c) / step_ns(c_all):.2f}"],
        [
            "whole reference case over list with courant 0.5",
            "5",
            f"{a_old['loop'] / a['loop']:.1f}",
        ],
    ]
    tables.append(("Ratios", table(["ratio", "wanted", "found"], ratios)))

    small, large = lattice_case(317, 317, 4, 3), lattice_case(1000, 1000, 4, 3)
    case("memory_1e5", small)
    case("memory_1e6", large)
    per_point = (large["memory"] - small["memory"]) / (large["points"] - small["points"])
    data["bytes_per_point"] = per_point
    list_small, list_large = (lattice_case(k, k, 4, 2, 1, "list") for k in (317, 1000))
    per_point_list = (list_large["memory"] - list_small["memory"]) / (
        list_large["points"] - list_small["points"]
    )
    data["bytes_per_point_list"] = per_point_list
    tables.append(
        (
            "Memory at m = 4, (peak at 10^6 - peak at 10^5) / difference of points",
            table(
                ["form", "bytes/point"],
                [["lattice", f"{per_point:.0f}"], ["list", f"{per_point_list:.0f}"]],
            ),
        )
    )

    head = ["kernel", "measured ns", "memory allows", "arithmetic allows", "of the bound"]
    tables.append(
        ("Roofline of (b), one thread, per point-step", table(head, roofline(b, limits, 4)))
    )

    rows = []
    for m in range(2, 9):
        found = case(f"m_{m}", lattice_case(51, 101, m, 2000 // few))
        rows.append([str(m), f"{step_ns(found):.1f}", f"{bond_rate(found):.0f}"])
    tables.append(("Cost against m, 51 x 101", table(["m", "ns/point-step", "10^6 bonds/s"], rows)))
    rows = []
    sizes = [32, 100, 317, 1000] + ([] if quick else [3163])
    for side in sizes:
        steps = max(4, int(4.0e7 / few / side**2))
        found = case(f"n_{side**2}", lattice_case(side, side, 4, min(steps, 20000)))
        rows.append([f"{side**2:.2e}", f"{step_ns(found):.1f}", f"{found['memory'] / 1e6:.0f}"])
    tables.append(
        ("Cost against n, m = 4", table(["points", "ns/point-step", "peak memory MB"], rows))
    )
    return data, tables


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer steps, not the largest body")
    parser.add_argument("--publish", action="store_true", help="put the tables into the document")
    arguments = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    data, tables = measure(arguments.quick)
    (ROOT / "results" / "bench.json").write_text(json.dumps(data, indent=1) + "\n")
    version = subprocess.run(
        [str(PROGRAM), "--version"], capture_output=True, text=True, check=True
    )
    limits = data["machine"]
    text = [
        f"`make bench`, {version.stdout.strip()}, {date.today().isoformat()}, {data['processor']}, "
        f"{limits['cores']:.0f} cores: STREAM triad {limits['triad_1']:.1f} GB/s on one core, "
        f"{limits['triad_all']:.1f} GB/s on all; multiply-adds {limits['flops_1']:.0f} Gflop/s on "
        "one core.",
    ]
    for title, lines in tables:
        text += ["", f"**{title}**", "", lines]
    print("\n".join(text))
    if arguments.publish:
        page = PAGE.read_text()
        begin, end = "<!-- bench: begin -->", "<!-- bench: end -->"
        before, rest = page.split(begin)
        after = rest.split(end)[1]
        PAGE.write_text(f"{before}{begin}\n" + "\n".join(text) + f"\n{end}{after}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
