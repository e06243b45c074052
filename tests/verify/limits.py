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
import os
import platform
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from cylinder_radius import radius_figure
from limit_cases import CASES, CYLINDER_RADIUS, C, Found, Variant
from matplotlib.figure import Figure
from perigeo_post import PostError, Run
from perigeo_post.draw.style import new_figure, style
from PIL import Image
from verify import PROGRAM, ROOT, execute

RESULTS = ROOT / "results" / "limit_loads"
FIGURES = ROOT / "doc" / "figures"
PAGE = ROOT / "doc" / "verification.md"
MARKS = "<!-- limit_loads: begin -->", "<!-- limit_loads: end -->"


def carry_out(case: str, variant: Variant, grid: int) -> list[Found]:
    """One run, and what is measured in it."""
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
    finest = grid == len(about.grids) - 1
    return [
        Found(about, one, label, len(run.positions), seconds, one.measure(run), finest, run.path)
        for one in (variant, *variant.also)
    ]


def draw(found: Found) -> Figure:
    """Plastic strain, how the soil moves at last, and the exact mechanism."""
    run = Run(found.path)
    frame = run.last_frame
    body = run.body & frame.there
    place = run.positions[body]
    alpha = frame["plastic_strain"][body]
    moving = np.column_stack([frame["velocity_x"][body], frame["velocity_y"][body]])
    x0, x1, y0, y1 = found.case.box or (
        *np.sort(place[:, 0])[[0, -1]],
        *np.sort(place[:, 1])[[0, -1]],
    )
    with style():
        figure = new_figure(140.0, 30.0 + 110.0 * (y1 - y0) / (x1 - x0))
        axes = figure.add_subplot()
        size = 110.0 / 25.4 * 72.0 * run.spacing / (x1 - x0)
        drawn = axes.scatter(
            *place.T,
            c=100.0 * alpha,
            s=(1.05 * size) ** 2,
            marker="s",
            linewidths=0.0,
            cmap="viridis",
            vmin=0.0,
            vmax=100.0 * float(np.quantile(alpha, 0.995)) or 1.0,
        )
        every = max(1, round((x1 - x0) / 40.0 / run.spacing))
        cells = np.rint(place / run.spacing - 0.25).astype(int)
        shown = (cells % every == 0).all(axis=1)
        length = np.hypot(*moving.T)
        axes.quiver(
            *place[shown].T,
            *(moving[shown] / max(1e-300, np.quantile(length, 0.99))).T,
            color="white",
            angles="xy",
            scale_units="xy",
            scale=0.9 / (every * run.spacing) / 1.6,
            width=1.6e-3,
        )
        for k, line in enumerate(found.case.mechanism()):
            axes.plot(
                *line.T, color="#D55E00", linewidth=1.2, label=found.case.label if k == 0 else None
            )
        if found.case.label:
            axes.legend(loc="lower left", labelcolor="#D55E00")
        axes.set(
            xlim=(x0, x1),
            ylim=(y0, y1),
            aspect="equal",
            xlabel="x in m",
            ylabel="y in m",
            title=f"{run.title}, {found.grid}",
        )
        figure.colorbar(
            drawn, ax=axes, label="equivalent plastic strain in %", shrink=0.8, extend="max"
        )
    return figure


def table(rows: list[Found]) -> list[list[str]]:
    """The rows as text."""
    lines = [["case", "grid", "points", "time", "found", "exact", "error", "verdict"]]
    for row in rows:
        low, high = row.variant.low, row.variant.high
        known = "other grids"
        if low is not None:
            known = f"{low:.4g}" if high == low else f"{low:.4g} to {high:.4g}"
        unit = row.variant.unit or row.case.unit
        title = row.case.title + (f", {row.variant.title}" if row.variant.title else "")
        verdict = ("holds" if row.holds else "does not hold") if row.finest else ""
        error = "" if not np.isfinite(row.error) else f"{100.0 * row.error:+.2f} %"
        lines.append(
            [
                title,
                row.grid,
                str(row.points),
                f"{row.seconds:.0f} s",
                f"{row.value:.4g} {unit if unit != '1' else ''}".strip(),
                known,
                error,
                verdict,
            ]
        )
    return lines


def compare_with_finest(rows: list[Found]) -> None:
    """Where nothing exact is known, the finest grid is what the others are compared with."""
    for case in CASES.values():
        those = [row for row in rows if row.case is case]
        if case.variants[0].low is None:
            for row in those:
                row.among = [one.value for one in those if one.finest]
                if row.finest:
                    row.among = [one.value for one in those]


def write(rows: list[Found], failures: list[str]) -> None:
    """The table for the page, and what is not in it."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    lines = table(rows)
    lines.insert(1, ["---"] * len(lines[0]))
    version = subprocess.run(
        [str(PROGRAM), "--version"], capture_output=True, text=True, check=True
    )
    text = [
        f"Printed by `make limit_loads`, {version.stdout.strip()}, {platform.machine()}, "
        f"one thread a run, {date.today().isoformat()}:\n"
    ]
    text += ["| " + " | ".join(line) + " |" for line in lines]
    text += ["", *(f"- No limit: {failure}." for failure in failures)] if failures else []
    (RESULTS / "limit_loads.md").write_text("\n".join(text) + "\n")


def publish(pictures: list[Path]) -> None:
    """Put the table between its marks, and the pictures beside the others."""
    before, rest = PAGE.read_text().split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    content = (RESULTS / "limit_loads.md").read_text()
    PAGE.write_text(f"{before}{MARKS[0]}\n{content}{MARKS[1]}{after}")
    for picture in pictures:
        shown = FIGURES / f"limit_load_{picture.name}"
        if shown.name in before + after:  # a palette, to keep the repository small
            Image.open(picture).convert("RGB").quantize(128).save(shown, optimize=True)


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
                rows.extend(job.result())
            except (PostError, RuntimeError, KeyError) as problem:
                case = CASES[name]
                what = ", ".join(filter(None, (case.title, variant.title, case.grids[grid][0])))
                words = str(problem).replace(f"{ROOT}/", "").strip().splitlines()
                failures.append(f"{what}: {words[0]}")
    compare_with_finest(rows)
    lines = table(rows)
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    for line in lines:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip())
    shown: dict[str, Found] = {}
    for row in rows:
        if row.finest or options.quick:
            shown.setdefault(row.variant.input, row)
    pictures = [RESULTS / f"{name}.png" for name in shown]
    for row, picture in zip(shown.values(), pictures):
        draw(row).savefig(picture, dpi=110)
    if cylinders := [row for row in rows if row.variant is CYLINDER_RADIUS]:
        pictures.append(RESULTS / "cylinder_radius.png")
        radius_figure(cylinders, C / 1e3).savefig(pictures[-1], dpi=110)
    if not options.cases and not options.quick:
        write(rows, failures)
        if options.publish:
            publish(pictures)
    for failure in failures:
        print("could not run:", failure, file=sys.stderr)
    failed = len(failures) + sum(not row.holds for row in rows if row.finest)
    print(f"{sum(row.holds for row in rows if row.finest)} hold, {failed} do not")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
