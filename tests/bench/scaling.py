"""Predict how a run scales to many ranks: `make scaling`.

The counts are exact: `--check` of a small body on three ranks tells the halo of a slab between two
others, the messages and the reductions. From there they follow: a halo is as many lines as the
horizon has spacings on either side, and supports give three numbers for each of their blocks of
rows. Rows that need nothing of the halo are worked on while it is on its way.
Latency, bandwidth and the speed of a core are given, or measured with --measure, which also
compares the prediction with real runs on one and two ranks of this machine.

    scaling.py [--latency S] [--bandwidth BYTES_PER_S] [--speed NS] [--measure] [--publish]
"""

from __future__ import annotations

import argparse
import math
import os
import re
import shutil
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "bin" / "perigeo-mpi"
INPUT = ROOT / "input" / "compression.nml"
PAGE = ROOT / "doc" / "parallel.md"
MARKS = ("<!-- scaling: begin -->", "<!-- scaling: end -->")
BLOCK = 256
LINE = 8  # rows in a line of the cache: lines of the lattice are whole ones
M = 4  # horizon over spacing
RANKS = (4, 16, 64, 256, 1024, 4096)
SUMS = 3  # numbers that a support gives for a block
DURING = (0.6, 0.25)  # of a step: gradient and stress, force; see the kernels of a log
GOALS = {100_000: 0.90, 1_000_000: 0.97}


@dataclass(frozen=True)
class Machine:
    """What a step costs on it."""

    latency: float = 2.0e-6  # of a message [s]
    bandwidth: float = 1.0e10  # of a rank [bytes/s]
    speed: float = 40.0e-9  # of a point and step on one core [s]


@dataclass(frozen=True)
class Counts:
    """What `--check` tells of three ranks: the one in the middle has two neighbours."""

    columns: int
    halo: int
    messages: int
    bytes: int
    reductions: int
    reduced: int

    @property
    def of_row(self) -> int:
        """Bytes per row of the halo."""
        return self.bytes // self.halo


def environment() -> dict[str, str]:
    """Return the surroundings in which three ranks run anywhere."""
    return {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
    }


def run(ranks: int, spacing: float, *options: str) -> str:
    """Run the program and return what it prints."""
    sizes = [f"discretisation.spacing={spacing}", f"discretisation.horizon={M * spacing}"]
    words = ["mpirun", "-n", str(ranks), str(PROGRAM), *options]
    for size in sizes:
        words += ["--set", size]
    done = subprocess.run(
        [*words, str(INPUT)],
        cwd=ROOT,
        env=environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


def count(columns: int) -> Counts:
    """Return the counts of a body of 1 m x 2 m with so many columns of points."""
    told = run(3, 1.0 / (columns - 1), "--check")
    halo = re.search(r"halo +(\d+) rows", told)
    sent = re.search(
        r"messages +(\d+) per .* (\d+) bytes beside .*; reductions (\d+) with (\d+)", told
    )
    if not halo or not sent:
        sys.exit(f"--check tells no counts:\n{told}")
    return Counts(columns, int(halo[1]), *map(int, sent.groups()))


def stride(columns: int) -> int:
    """Return the rows of a line of the lattice."""
    return LINE * math.ceil((columns + M) / LINE)


def halo_rows(columns: int) -> int:
    """Return the rows of the halo of a slab between two others."""
    return 2 * M * (stride(columns) + 1)


def reduced_bytes(columns: int) -> int:
    """Return the most bytes of the sums of two supports, as many lines as the horizon has."""
    return 2 * SUMS * 8 * (math.ceil(M * stride(columns) / BLOCK) + 1)


@dataclass(frozen=True)
class Step:
    """Times of one step of the rank with most points [s]."""

    alone: float  # its share, if all ranks had equal ones
    work: float
    inner: float  # the part of the work that needs no halo
    exchanges: tuple[float, ...]  # before the gradient, and before the divergence
    reduce: float

    @property
    def waited(self) -> float:
        """Time with exchanges beside the work that needs no halo."""
        late = (max(0.0, e - d * self.inner) for e, d in zip(self.exchanges, DURING))
        return self.work + sum(late) + self.reduce

    @property
    def plain(self) -> float:
        """Efficiency of messages that nothing hides."""
        return self.alone / (self.work + sum(self.exchanges) + self.reduce)

    @property
    def hidden(self) -> float:
        """Efficiency as it is."""
        return self.alone / self.waited


def step(points: float, ranks: int, counts: Counts, machine: Machine) -> Step:
    """Predict a step of a square body of so many points per rank."""
    columns = round(math.sqrt(points * ranks))
    lines = points / columns
    largest = BLOCK * math.ceil(points / BLOCK)
    # a slab thinner than the horizon has its halo from more ranks
    neighbours = min(ranks - 1, 2 * math.ceil(M / lines))
    hops = math.ceil(math.log2(ranks))
    work = largest * machine.speed
    if ranks == 1:
        return Step(points * machine.speed, work, 0.0, (0.0, 0.0), 0.0)
    halo = (0.5 if neighbours == 1 else 1.0) * halo_rows(columns)
    sent = (16, counts.of_row - 16)
    return Step(
        alone=points * machine.speed,
        work=work,
        inner=work * max(0.0, 1.0 - (1 if neighbours == 1 else 2) * M / lines),
        exchanges=tuple(
            neighbours * machine.latency + halo * size / machine.bandwidth for size in sent
        ),
        reduce=2 * hops * counts.reductions * machine.latency
        + 2 * reduced_bytes(columns) * (1 - 1 / ranks) / machine.bandwidth,
    )


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Return the lines of a table."""
    widths = [max(len(line[k]) for line in [head, *rows]) for k in range(len(head))]
    lines = [head, ["-" * width for width in widths], *rows]
    return ["| " + " | ".join(c.ljust(w) for c, w in zip(line, widths)) + " |" for line in lines]


def efficiencies(counts: Counts, machine: Machine) -> list[str]:
    """Return the tables of weak and of strong scaling."""
    weak = []
    for points in GOALS:
        for kind in ("hidden", "plain"):
            found = [getattr(step(points, ranks, counts, machine), kind) for ranks in RANKS]
            weak.append([f"{points:.0e}", kind, *(f"{value:.2f}" for value in found)])
    strong = []
    for points in (10_000_000, 100_000_000):
        for kind in ("hidden", "plain"):
            found = [getattr(step(points / ranks, ranks, counts, machine), kind) for ranks in RANKS]
            strong.append([f"{points:.0e}", kind, *(f"{value:.2f}" for value in found)])
    names = {"plain": "waited for", "hidden": "beside work"}
    for row in weak + strong:
        row[1] = names[row[1]]
    ranks = [str(n) for n in RANKS]
    return [
        "Efficiency with so many points per rank, by the number of ranks:",
        "",
        *table(["points", "exchange", *ranks], weak),
        "",
        "With so many points in all:",
        "",
        *table(["points", "exchange", *ranks], strong),
    ]


def seconds_of_step(ranks: int, spacing: float, folder: str) -> tuple[float, int]:
    """Return the time of a step of a real run, and the points."""
    few = ["integration.final_strain=1e-5", "output.history_count=2", "output.frame_strains="]
    options = ["--quiet", "--force", "--output", folder]
    for value in [*few, "output.frame_count=1"]:
        options += ["--set", value]
    run(ranks, spacing, *options)
    log = (Path(folder) / "compression.log").read_text()
    loop = re.search(r"time loop +([\d.]+) s, steps (\d+)", log)
    points = re.search(r"points +(\d+)", log)
    if not loop or not points:
        sys.exit("the log tells no times")
    return float(loop[1]) / int(loop[2]), int(points[1])


def measure(spacing: float, turns: int) -> tuple[float, float, int]:
    """Return the times of a step on one and on two ranks by turns (medians), and the points."""
    folder = str(ROOT / "results" / "scaling")
    times: dict[int, list[float]] = {1: [], 2: []}
    points = 0
    for _ in range(turns):
        for ranks, found in times.items():
            seconds, points = seconds_of_step(ranks, spacing, folder)
            found.append(seconds)
    shutil.rmtree(folder)
    return statistics.median(times[1]), statistics.median(times[2]), points


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    given = Machine()
    parser.add_argument("--latency", type=float, default=given.latency, help="of a message [s]")
    parser.add_argument("--bandwidth", type=float, default=given.bandwidth, help="[bytes/s]")
    parser.add_argument("--speed", type=float, default=1.0e9 * given.speed, help="[ns/point-step]")
    parser.add_argument("--measure", action="store_true", help="compare with 1 and 2 ranks here")
    parser.add_argument("--spacing", type=float, default=0.004, help="of the body measured [m]")
    parser.add_argument("--publish", action="store_true", help="into doc/parallel.md")
    arguments = parser.parse_args()
    machine = Machine(arguments.latency, arguments.bandwidth, 1.0e-9 * arguments.speed)
    counts = count(51)
    for columns in (51, 101):
        found = count(columns)
        if found.halo != halo_rows(columns) or found.of_row != counts.of_row:
            sys.exit(f"{columns} columns: the halo does not follow that of 51 columns")
        if not 0 < found.reduced <= reduced_bytes(columns):
            sys.exit(f"{columns} columns: supports reduce {found.reduced} bytes")
    text = [
        f"`make scaling`: a square body, m = {M}, {counts.of_row} bytes per row of the halo, "
        f"{counts.messages} messages per rank and step beside the work of inner rows, "
        f"{counts.reductions} reduction that is waited for; {1e6 * machine.latency:g} us and "
        f"{1e-9 * machine.bandwidth:g} GB/s per message, {1e9 * machine.speed:g} ns "
        "per point-step.",
        "",
        *efficiencies(counts, machine),
    ]
    print("\n".join(text))
    for points, goal in GOALS.items():
        found = step(points, 1024, counts, machine)
        print(
            f"\n{points:.0e} points on each of 1024 ranks: wanted {goal:.2f}, "
            f"found {found.hidden:.3f}, if exchanges were waited for {found.plain:.3f}"
        )
    if arguments.measure:
        one, two, points = measure(arguments.spacing, 5)
        speed = one / points
        here = Machine(arguments.latency, arguments.bandwidth, speed)
        predicted = step(points / 2, 2, counts, here)
        seconds = predicted.waited
        print(
            f"\n{points} points here: {1e9 * speed:.1f} ns per point-step on one rank; two ranks "
            f"{1e3 * two:.2f} ms, predicted {1e3 * seconds:.2f} ms, ratio {two / seconds:.2f}"
        )
    if arguments.publish:
        before, rest = PAGE.read_text().split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        PAGE.write_text(f"{before}{MARKS[0]}\n" + "\n".join(text) + f"\n{MARKS[1]}{after}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
