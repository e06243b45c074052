"""Measure the speed of the program: `make bench`.

Runs the program itself and reads the seconds of its kernels from the end of its log. Prints tables,
writes results/bench.json, and with --publish the tables of doc/performance.md. All numbers of one
call come from one machine in one go; ratios mean more than times, which are noisy.

    bench.py [--quick] [--publish]
    bench.py --alignment             only what arrays at whole lines of the cache gain
    bench.py --slot                  only what a body with a slot costs, and a polygon
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np
from bench_cases import (
    CONTROL,
    KERNELS,
    PLAIN,
    PROGRAM,
    RESULTS,
    ROOT,
    UNALIGNED,
    best,
    bond_rate,
    cloud_case,
    curve_difference,
    flowing_case,
    lattice_case,
    loop_seconds,
    set_up_seconds,
    step_ns,
    whole_case,
)

MACHINE = ROOT / "build" / "opt" / "bench" / "machine"
PAGE = ROOT / "doc" / "performance.md"

ALIGNMENT = "Arrays at whole lines of the cache"
SLOT = "A slot over half of the height of a specimen, m = 4"
POLYGON = "Polygons within a box of 201 x 201 places, m = 3"
IN_CONTROL = {"method = 'none'": "method = 'silling', factor = 0.0125"}
IN_RELAXING = {"method = 'none'": "method = 'relaxing'"}

# What a kernel must move and compute for an elastic point of a lattice [bytes, flops]; every array
# once. Gradient and stress run in one loop and hand H over in the cache, the sums of the force f;
# motion is one pass from step to step. Rows and columns of the sums come on top.
WITH_CONTROL = "force with control"
BYTES = {"motion": 112, "gradient": 32, "stress": 200, "force": 64, WITH_CONTROL: 112}
FLOPS = {"motion": 44, "gradient": 8, "stress": 110, "force": 6, WITH_CONTROL: 16}


def flops_of_sums(kernel: str, m: int) -> int:
    """Rows and columns of the sums of a kernel, 3 flops each, for Gaussian influence.

    Gradient and divergence each have two x sums of m - 1 rows and m columns, and two y sums of m
    rows and m columns; control has four sums of m + 1 rows and m columns.
    """
    count = {"gradient": 8 * m - 2, "force": 8 * m - 2, WITH_CONTROL: 16 * m + 2}
    return 3 * count.get(kernel, 0)


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


def roofline(runs: dict[str, dict[str, float]], limits: dict[str, float]) -> list[list[str]]:
    """Each kernel of (b), and the step, against what memory and arithmetic of one core allow."""
    rows, m = [], 4
    whole = np.zeros(4)
    for kernel in BYTES:
        found = runs["b_control" if kernel == WITH_CONTROL else "b_lattice"]
        seconds = found["force" if kernel == WITH_CONTROL else kernel]
        measured = 1e9 * seconds / found["steps"] / found["points"]
        memory = BYTES[kernel] / limits["triad_1"]
        arithmetic = (FLOPS[kernel] + flops_of_sums(kernel, m)) / limits["flops_1"]
        numbers = [measured, memory, arithmetic, max(memory, arithmetic)]
        rows.append(roofline_row(kernel, numbers))
        if kernel != WITH_CONTROL:
            whole += numbers
    whole[0] = step_ns(runs["b_lattice"])
    return [*rows, roofline_row("whole step, no control", whole)]


def roofline_row(label: str, numbers: Sequence[float]) -> list[str]:
    """Nanoseconds: measured, by memory, by arithmetic, the bound."""
    return [label, *(f"{x:.1f}" for x in numbers[:3]), f"{100.0 * numbers[3] / numbers[0]:.0f} %"]


def bytes_per_point(operators: str, more: str = "") -> float:
    """Peak memory at 10^6 less that at 10^5 points, over the difference of the points."""
    small, large = (lattice_case(side, side, 4, 3, 1, operators, more) for side in (317, 1000))
    return (large["memory"] - small["memory"]) / (large["points"] - small["points"])


def measure_cases(cores: int, few: int, turns: int) -> dict[str, dict[str, float]]:
    """Run the cases (a), (b) and (c); those that are compared by turns."""
    in_list = {"&run": "&run operators = 'list'"}
    half = {
        "time_step_rule = 'spectral'": "time_step_rule = 'courant'",
        "safety = 0.9": "safety = 0.5",
    }
    m3 = {"horizon = 0.08": "horizon = 0.06"}
    runs = {}
    measures = {
        name: {"strain_measure = 'green_lagrange'": f"strain_measure = '{name}'"}
        for name in ("logarithmic", "small")
    }
    cases = (
        "a_lattice",
        "a_m3",
        "a_control",
        "a_relaxing",
        "a_all",
        "a_relaxing_all",
        "a_logarithmic",
        "a_small",
    )
    found = best(
        turns,
        lambda: whole_case("a_lattice", {}, 1),
        lambda: whole_case("a_m3", m3, 1),
        lambda: whole_case("a_control", IN_CONTROL, 1),
        lambda: whole_case("a_relaxing", IN_RELAXING, 1),
        lambda: whole_case("a_all", {}, cores),
        lambda: whole_case("a_relaxing_all", IN_RELAXING, cores),
        lambda: whole_case("a_logarithmic", measures["logarithmic"], 1),
        lambda: whole_case("a_small", measures["small"], 1),
    )
    runs.update(zip(cases, found))
    runs["a_list"] = whole_case("a_list", in_list, 1)
    runs["a_control_list"] = whole_case("a_control_list", {**in_list, **IN_CONTROL}, 1)
    runs["a_list_courant"] = whole_case("a_list_courant", {**in_list, **half}, 1)
    runs["b_lattice"], runs["b_control"], runs["b_all"] = best(
        turns,
        lambda: lattice_case(1000, 1000, 4, 100 // few),
        lambda: lattice_case(1000, 1000, 4, 40 // few, more=CONTROL),
        lambda: lattice_case(1000, 1000, 4, 100 // few, cores),
    )
    runs["a_flowing"], runs["b_flowing"] = best(
        turns,
        lambda: flowing_case(51, 101, 4, 4000 // few),
        lambda: flowing_case(1000, 1000, 4, 100 // few),
    )
    runs["b_list"] = lattice_case(1000, 1000, 4, 12 // few, 1, "list")
    runs["c_cloud"], runs["c_all"] = best(
        1,
        lambda: cloud_case(100_000, 200 // few, 1),
        lambda: cloud_case(100_000, 200 // few, cores),
    )
    return runs


def table_of_cases(runs: dict[str, dict[str, float]]) -> str:
    labels = {
        "a_lattice": "(a) reference 51 x 101, m = 4",
        "a_m3": "(a) m = 3",
        "a_control": "(a) with control",
        "a_relaxing": "(a) with relaxing control",
        "a_logarithmic": "(a) logarithmic strain",
        "a_small": "(a) small strain",
        "a_flowing": "(a) all points flow",
        "a_list": "(a) list",
        "a_control_list": "(a) list with control",
        "b_lattice": "(b) 1000 x 1000, m = 4",
        "b_control": "(b) with control",
        "b_flowing": "(b) all points flow",
        "b_list": "(b) list",
        "c_cloud": "(c) cloud, 100,000 points",
    }
    head = ["case", "ns/point-step", "10^6 bonds/s", *(f"{k} %" for k in KERNELS[:-1])]
    return table(head, [share_row(label, runs[name]) for name, label in labels.items()])


def rows_of_ratios(runs: dict[str, dict[str, float]], cores: int) -> list[list[str]]:
    """Figures that are wanted: forms of the operators and threads against each other."""

    def ratio(one: str, other: str, factor: float = 1.0) -> str:
        return f"{factor * step_ns(runs[one]) / step_ns(runs[other]):.2f}"

    whole = loop_seconds(runs["a_list_courant"]) / loop_seconds(runs["a_lattice"])
    difference = curve_difference("a_lattice", "a_list_courant", 0.009)
    return [
        [
            "step with relaxing control over none, (a)",
            "at most 1.25",
            ratio("a_relaxing", "a_lattice"),
        ],
        [
            f"the same, {cores} threads",
            "at most 1.25",
            ratio("a_relaxing_all", "a_all"),
        ],
        ["lattice over list, step, (b)", "at least 4", ratio("b_list", "b_lattice")],
        ["lattice over list, step, (a)", "at least 2.5", ratio("a_list", "a_lattice")],
        ["lattice over list, step, (a) with control", "", ratio("a_control_list", "a_control")],
        ["all points flow, (b) over (a)", "at most 1.6", ratio("b_flowing", "a_flowing")],
        [f"{cores} threads over 1, (b)", "at least 1.8", ratio("b_lattice", "b_all", cores)],
        [f"{cores} threads over 1, (a)", "at least 1.6", ratio("a_lattice", "a_all", cores)],
        [f"{cores} threads over 1, (c)", "", ratio("c_cloud", "c_all", cores)],
        ["list with courant 0.5 over lattice, whole (a)", "at least 5", f"{whole:.1f}"],
        [
            "difference of these curves up to 0.9 % strain, % of the peak",
            "at most 0.5",
            f"{difference:.3f}",
        ],
    ]


def rows_of_times(runs: dict[str, dict[str, float]]) -> list[list[str]]:
    """Figures that are wanted: times of the reference case."""
    a = runs["a_lattice"]
    measures = [
        [
            f"stress kernel of (a), {name} over Green-Lagrange strain",
            limit,
            f"{runs[f'a_{name}']['stress'] / a['stress']:.2f}",
        ]
        for name, limit in (("logarithmic", "at most 1.5"), ("small", ""))
    ]
    pointwise = 100.0 * (a["motion"] + a["stress"]) / loop_seconds(a)
    history = 100.0 * a["history"] / loop_seconds(a)
    return [
        ["ns/point-step, (a) with m = 3", "at most 40", f"{step_ns(runs['a_m3']):.1f}"],
        ["ns/point-step, (a)", "at most 60", f"{step_ns(a):.1f}"],
        ["10^6 bond updates/s of the operators, (a)", "at least 1200", f"{bond_rate(a):.0f}"],
        ["motion and stress in a step of (a), %", "at most 50", f"{pointwise:.1f}"],
        ["history, energies, progress in (a), %", "at most 3", f"{history:.1f}"],
        *measures,
    ]


def rows_of_size(data: dict[str, object], cores: int) -> list[list[str]]:
    """Figures that are wanted: time of set-up and memory."""
    seconds = set_up_seconds(1000, 4, cores)
    data["set_up_seconds"] = seconds
    rows = [[f"set-up of 10^6 points, {cores} threads, s", "at most 2", f"{seconds:.2f}"]]
    wanted = {"lattice": "at most 450", "with control": "at most 550", "list": ""}
    for form, limit in wanted.items():
        found = bytes_per_point(
            "list" if form == "list" else "lattice", CONTROL if form == "with control" else ""
        )
        data[f"bytes_per_point_{form}"] = found
        rows.append([f"bytes per point, m = 4, {form}", limit, f"{found:.0f}"])
    return rows


def table_of_m(data: dict[str, object], few: int, turns: int) -> str:
    rows = []
    for m in range(2, 9):
        (found,) = best(turns, lambda m=m: lattice_case(51, 101, m, 2000 // few))
        data[f"m_{m}"] = found
        rows.append([str(m), f"{step_ns(found):.1f}", f"{bond_rate(found):.0f}"])
    return table(["m", "ns/point-step", "10^6 bonds/s"], rows)


def table_of_n(data: dict[str, object], few: int) -> str:
    rows = []
    for side in [32, 100, 317, 1000] + ([] if few > 1 else [3163]):
        steps = min(20000, max(10, int(4.0e7 / few / side**2)))
        found = lattice_case(side, side, 4, steps)
        data[f"n_{side**2}"] = found
        rows.append([f"{side**2:.2e}", f"{step_ns(found):.1f}", f"{found['memory'] / 1e6:.0f}"])
    return table(["points", "ns/point-step", "peak memory MB"], rows)


def table_of_alignment(data: dict[str, object], few: int) -> str:
    """Arrays at whole lines of the cache, and where malloc puts them: runs by turns."""
    cases = {
        "(a) reference 51 x 101, m = 4": lambda program: whole_case("a_lattice", {}, 1, program),
        "(a) with control": lambda program: whole_case("a_control", IN_CONTROL, 1, program),
        "(a) m = 8": lambda program: lattice_case(51, 101, 8, 8000 // few, program=program),
        "(b) 1000 x 1000, m = 4": lambda program: lattice_case(
            1000, 1000, 4, 100 // few, program=program
        ),
    }
    rows = []
    for label, case in cases.items():
        turns = 5 if few == 1 else 2
        aligned, as_they_come = best(turns, lambda c=case: c(PROGRAM), lambda c=case: c(UNALIGNED))
        data[f"aligned {label}"], data[f"unaligned {label}"] = aligned, as_they_come
        gain = 100.0 * (step_ns(as_they_come) / step_ns(aligned) - 1.0)
        rows.append(
            [label, f"{step_ns(aligned):.1f}", f"{step_ns(as_they_come):.1f}", f"{gain:.1f}"]
        )
    return table(["case", "ns/point-step", "with ALIGNED=0", "gain %"], rows)


def table_of_slots(data: dict[str, object], few: int, turns: int) -> str:
    """Specimens with a slot, whose bonds are blocked, and without: runs by turns."""
    controls = {
        "none": PLAIN,
        "Silling": CONTROL,
        "relaxing": "&stabilisation method = 'relaxing' /\n",
    }
    rows = []
    for columns, lines, steps in ((51, 101, 1200), (201, 401, 80)):
        middle = 0.5 + 0.5 / (columns - 1)
        slot = f"&cut x = {middle!r}, {middle!r}, y = 0.5, 1.5 /\n"
        case = partial(lattice_case, columns, lines, 4, steps // few)
        for name, control in controls.items():
            whole, slotted = best(
                turns, partial(case, more=control), partial(case, more=slot + control)
            )
            label = f"{columns} x {lines}, control {name}"
            data[f"slot {label}"] = slotted
            share = 100.0 * (1.0 - slotted["bonds"] / whole["bonds"])
            rows.append(
                [
                    label,
                    f"{share:.2f}",
                    f"{step_ns(whole):.1f}",
                    f"{step_ns(slotted):.1f}",
                    f"{step_ns(slotted) / step_ns(whole):.2f}",
                ]
            )
    return table(["case", "bonds missing %", "ns/point-step", "with the slot", "ratio"], rows)


def table_of_polygons(data: dict[str, object], few: int, turns: int) -> str:
    """Polygons, whose box has places without a point, against the rectangle: runs by turns."""
    shapes = {
        "trapezium": "0.0, 0.0, 1.0, 0.0, 0.8, 1.0, 0.2, 1.0",
        "slope": "0.0, 0.0, 1.0, 0.0, 1.0, 0.4, 0.7, 0.4, 0.3, 1.0, 0.0, 1.0",
        "strip": "0.0, 0.0, 0.3, 0.0, 1.0, 1.0, 0.7, 1.0",
    }
    rows = []
    for name, control in {"none": PLAIN, "relaxing": "&stabilisation /\n"}.items():
        case = partial(lattice_case, 201, 201, 3, 160 // few, more=control)
        whole, *others = best(turns, case, *(partial(case, vertices=v) for v in shapes.values()))
        for shape, found in zip(shapes, others):
            label = f"{shape}, control {name}"
            data[f"polygon {label}"] = found
            rows.append(
                [
                    label,
                    f"{found['points'] / whole['points']:.2f}",
                    f"{step_ns(whole):.1f}",
                    f"{step_ns(found):.1f}",
                    f"{step_ns(found) / step_ns(whole):.2f}",
                ]
            )
    return table(["case", "part of the box", "ns/point-step, rectangle", "polygon", "ratio"], rows)


def measure(quick: bool) -> tuple[dict[str, object], list[tuple[str, str]]]:
    """All measurements, and the tables that show them."""
    limits = machine()
    cores = int(limits["cores"])
    few = 4 if quick else 1
    turns = 1 if quick else 3
    runs = measure_cases(cores, few, turns)
    data: dict[str, object] = {"machine": limits, "processor": processor(), **runs}
    wanted = [*rows_of_ratios(runs, cores), *rows_of_times(runs), *rows_of_size(data, cores)]
    head = ["kernel", "measured ns", "memory allows", "arithmetic allows", "of the bound"]
    tables = [
        ("One thread: a whole step, and where its time goes", table_of_cases(runs)),
        ("What is wanted, and what is found", table(["figure", "wanted", "found"], wanted)),
        ("Roofline of (b), one thread, per point-step", table(head, roofline(runs, limits))),
        ("Cost against m, 51 x 101", table_of_m(data, few, turns)),
        ("Cost against n, m = 4", table_of_n(data, few)),
        (ALIGNMENT, table_of_alignment(data, few)),
        (SLOT, table_of_slots(data, few, 2 * turns)),
        (POLYGON, table_of_polygons(data, few, 2 * turns)),
    ]
    return data, tables


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer steps, not the largest body")
    parser.add_argument("--publish", action="store_true", help="put the tables into the document")
    parser.add_argument("--alignment", action="store_true", help="only the table of aligned arrays")
    parser.add_argument("--slot", action="store_true", help="only the table of slots")
    arguments = parser.parse_args()
    RESULTS.mkdir(parents=True, exist_ok=True)
    if arguments.alignment:
        print(f"**{ALIGNMENT}**\n\n{table_of_alignment({}, 4 if arguments.quick else 1)}")
        return 0
    if arguments.slot:
        few = 4 if arguments.quick else 1
        print(f"**{SLOT}**\n\n{table_of_slots({}, few, 15)}\n")
        print(f"**{POLYGON}**\n\n{table_of_polygons({}, few, 15)}")
        return 0
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
