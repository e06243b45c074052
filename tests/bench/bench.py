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
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "bin" / "perigeo"
MACHINE = ROOT / "build" / "opt" / "bench" / "machine"
RESULTS = ROOT / "results" / "bench"
PAGE = ROOT / "doc" / "performance.md"

C_P = float(np.sqrt(50.0e6 * 0.7 / (1.3 * 0.4) / 2000.0))  # of the material below [m/s]
KERNELS = (
    "motion",
    "gradient",
    "stress",
    "divergence",
    "control",
    "boundaries",
    "history",
    "frames",
)

# What a kernel must move and compute for an elastic point of a lattice [bytes, flops]; every array
# once. Gradient and stress run in one loop and hand G over in the cache, divergence and control
# f; motion is one pass from step to step. Rows and columns of the sums come on top.
BYTES = {"motion": 112, "gradient": 32, "stress": 200, "divergence": 64, "control": 48}
FLOPS = {"motion": 44, "gradient": 8, "stress": 110, "divergence": 6, "control": 10}


def flops_of_sums(kernel: str, m: int) -> int:
    """Rows and columns of the sums of a kernel, 3 flops each, for Gaussian influence.

    Gradient and divergence each have two x sums of m - 1 rows and m columns, and two y sums of m
    rows and m columns; control has four sums of m + 1 rows and m columns.
    """
    count = {"gradient": 8 * m - 2, "divergence": 8 * m - 2, "control": 8 * m + 4}
    return 3 * count.get(kernel, 0)


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
CONTROL = "&stabilisation method = 'silling', factor = 0.0125 /\n"


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
    columns: int,
    rows: int,
    m: int,
    steps: int,
    threads: int = 1,
    operators: str = "lattice",
    more: str = "",
) -> dict[str, float]:
    """A specimen of columns x rows points, loaded for some steps."""
    name = f"{operators}_{columns}x{rows}_m{m}_t{threads}" + ("_more" if more else "")
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
    path.write_text(text + more)
    return run(path, folder, name, threads)


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
    path.write_text(text)
    start = time.perf_counter()
    command = [str(PROGRAM), "--check", "--threads", str(threads), str(path)]
    if subprocess.run(command, stdout=subprocess.DEVNULL).returncode != 0:
        sys.exit(f"bench: {path} is refused")
    return time.perf_counter() - start


def best(times: int, *cases: Callable[[], dict[str, float]]) -> list[dict[str, float]]:
    """Run cases by turns, and keep the fastest run of each: other work on the machine only adds."""
    found = [[case() for case in cases] for _ in range(times)]
    return [min(runs, key=step_ns) for runs in zip(*found)]


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


def loop_seconds(found: dict[str, float]) -> float:
    """Seconds of the time loop; frames aside, whose number is the user's choice."""
    return found["loop"] - found["frames"]


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


def step_ns(found: dict[str, float]) -> float:
    """Nanoseconds of a whole step for a point, times the threads: per core."""
    return 1e9 * loop_seconds(found) * found["threads"] / found["steps"] / found["points"]


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
    shares = [f"{100.0 * found[kernel] / loop_seconds(found):.1f}" for kernel in KERNELS[:-1]]
    return [label, f"{step_ns(found):.1f}", f"{bond_rate(found):.0f}", *shares]


def roofline(found: dict[str, float], limits: dict[str, float], m: int) -> list[list[str]]:
    """Each kernel against what memory and arithmetic of one core allow."""
    rows = []
    for kernel in BYTES:
        measured = 1e9 * found[kernel] / found["steps"] / found["points"]
        memory = BYTES[kernel] / limits["triad_1"]
        arithmetic = (FLOPS[kernel] + flops_of_sums(kernel, m)) / limits["flops_1"]
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


def bytes_per_point(operators: str, more: str = "") -> float:
    """Peak memory at 10^6 less that at 10^5 points, over the difference of the points."""
    small, large = (lattice_case(side, side, 4, 3, 1, operators, more) for side in (317, 1000))
    return (large["memory"] - small["memory"]) / (large["points"] - small["points"])


def measure(quick: bool) -> tuple[dict[str, object], list[tuple[str, str]]]:
    """All measurements, and the tables that show them."""
    limits = machine()
    cores = int(limits["cores"])
    few = 4 if quick else 1
    turns = 1 if quick else 3
    data: dict[str, object] = {"machine": limits, "processor": processor()}
    tables = []

    in_list = {"&run": "&run operators = 'list'"}
    half = {
        "time_step_rule = 'spectral'": "time_step_rule = 'courant'",
        "safety = 0.9": "safety = 0.5",
    }
    m3 = {"horizon = 0.08": "horizon = 0.06"}
    control = {"&imperfection": CONTROL + "&imperfection"}
    a, a_m3, a_control, a_all = best(
        turns,
        lambda: whole_case("a_lattice", {}, 1),
        lambda: whole_case("a_m3", m3, 1),
        lambda: whole_case("a_control", control, 1),
        lambda: whole_case("a_all", {}, cores),
    )
    a_list = whole_case("a_list", in_list, 1)
    a_control_list = whole_case("a_control_list", {**in_list, **control}, 1)
    a_half = whole_case("a_list_courant", {**in_list, **half}, 1)
    b, b_control, b_all = best(
        turns,
        lambda: lattice_case(1000, 1000, 4, 100 // few),
        lambda: lattice_case(1000, 1000, 4, 40 // few, more=CONTROL),
        lambda: lattice_case(1000, 1000, 4, 100 // few, cores),
    )
    b_list = lattice_case(1000, 1000, 4, 12 // few, 1, "list")
    c, c_all = best(
        1,
        lambda: cloud_case(100_000, 200 // few, 1),
        lambda: cloud_case(100_000, 200 // few, cores),
    )
    data |= {"a_lattice": a, "a_m3": a_m3, "a_control": a_control, "a_all": a_all}
    data |= {"a_list": a_list, "a_control_list": a_control_list, "a_list_courant": a_half}
    data |= {"b_lattice": b, "b_control": b_control, "b_all": b_all, "b_list": b_list}
    data |= {"c_cloud": c, "c_all": c_all}

    head = ["case", "ns/point-step", "10^6 bonds/s", *(f"{k} %" for k in KERNELS[:-1])]
    rows = [
        share_row("(a) reference 51 x 101, m = 4", a),
        share_row("(a) m = 3", a_m3),
        share_row("(a) with control", a_control),
        share_row("(a) list", a_list),
        share_row("(a) list with control", a_control_list),
        share_row("(b) 1000 x 1000, m = 4", b),
        share_row("(b) with control", b_control),
        share_row("(b) list", b_list),
        share_row("(c) cloud, 100,000 points", c),
    ]
    tables.append(("One thread: a whole step, and where its time goes", table(head, rows)))

    def threads_gain(one: dict[str, float], all_: dict[str, float]) -> str:
        return f"{cores * step_ns(one) / step_ns(all_):.2f}"

    whole = loop_seconds(a_half) / loop_seconds(a)
    pointwise = 100.0 * (a["motion"] + a["stress"]) / loop_seconds(a)
    lines = [
        ["lattice over list, step, (b)", "at least 4", f"{step_ns(b_list) / step_ns(b):.2f}"],
        ["lattice over list, step, (a)", "at least 2.5", f"{step_ns(a_list) / step_ns(a):.2f}"],
        [
            "lattice over list, step, (a) with control",
            "",
            f"{step_ns(a_control_list) / step_ns(a_control):.2f}",
        ],
        [f"{cores} threads over 1, (b)", "at least 1.8", threads_gain(b, b_all)],
        [f"{cores} threads over 1, (a)", "at least 1.6", threads_gain(a, a_all)],
        [f"{cores} threads over 1, (c)", "", threads_gain(c, c_all)],
        ["list with courant 0.5 over lattice, whole (a)", "at least 5", f"{whole:.1f}"],
        [
            "difference of these curves up to 0.9 % strain, % of the peak",
            "at most 0.5",
            f"{curve_difference('a_lattice', 'a_list_courant', 0.009):.3f}",
        ],
        ["ns/point-step, (a) with m = 3", "at most 40", f"{step_ns(a_m3):.1f}"],
        ["ns/point-step, (a)", "at most 60", f"{step_ns(a):.1f}"],
        ["10^6 bond updates/s of the operators, (a)", "at least 1200", f"{bond_rate(a):.0f}"],
        ["motion and stress in a step of (a), %", "at most 50", f"{pointwise:.1f}"],
        [
            "history, energies, progress in (a), %",
            "at most 3",
            f"{100.0 * a['history'] / loop_seconds(a):.1f}",
        ],
    ]
    data["set_up_seconds"] = set_up_seconds(1000, 4, cores)
    lines.append(
        [f"set-up of 10^6 points, {cores} threads, s", "at most 2", f"{data['set_up_seconds']:.2f}"]
    )
    wanted = {"lattice": "at most 450", "with control": "at most 550", "list": ""}
    for form, limit in wanted.items():
        found = bytes_per_point(
            "list" if form == "list" else "lattice", CONTROL if form == "with control" else ""
        )
        data[f"bytes_per_point_{form}"] = found
        lines.append([f"bytes per point, m = 4, {form}", limit, f"{found:.0f}"])
    tables.append(
        ("What is wanted, and what is found", table(["figure", "wanted", "found"], lines))
    )

    head = ["kernel", "measured ns", "memory allows", "arithmetic allows", "of the bound"]
    rows = roofline(b, limits, 4)[:-1] + roofline(b_control, limits, 4)[-1:]
    tables.append(("Roofline of (b), one thread, per point-step", table(head, rows)))

    rows = []
    for m in range(2, 9):
        (found,) = best(turns, lambda m=m: lattice_case(51, 101, m, 2000 // few))
        data[f"m_{m}"] = found
        rows.append([str(m), f"{step_ns(found):.1f}", f"{bond_rate(found):.0f}"])
    tables.append(("Cost against m, 51 x 101", table(["m", "ns/point-step", "10^6 bonds/s"], rows)))
    rows = []
    sizes = [32, 100, 317, 1000] + ([] if quick else [3163])
    for side in sizes:
        steps = min(20000, max(10, int(4.0e7 / few / side**2)))
        found = lattice_case(side, side, 4, steps)
        data[f"n_{side**2}"] = found
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
