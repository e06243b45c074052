"""The command line ``perigeo-post``: reads options, calls the functions, prints.

Exit status: 0 done, 1 wrong command line or something asked for that the result does not hold,
2 a result that cannot be read or a study file that is wrong, 4 a study in which a run failed or a
figure could not be drawn, 5 a file that cannot be written, 130 and 143 stopped by a signal.
"""

from __future__ import annotations

import argparse
import os
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..draw import figures
from ..draw.animation import animate
from ..draw.contours import contour_figure
from ..draw.style import check_figure_path, save_figure
from ..measure import export, measures
from ..measure.band import LEVEL, BandMeasure
from ..measure.curves import Curve, curve_numbers, energy_curves, history_curve, stress_strain
from ..read.errors import PostError, RequestError
from ..read.run import Frame, Run
from ..report import write as report
from ..study import run as study
from ..version import __version__

Arguments = argparse.Namespace
MOST_PANELS = 6


class _Parser(argparse.ArgumentParser):
    """Exit status 1 for a wrong command line, as the program perigeo has it."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        print(f"{self.prog}: error: {message}", file=sys.stderr)
        raise SystemExit(1)


def strain_value(text: str) -> float:
    """A strain as a number (0.01) or in per cent (1%)."""
    try:
        return float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a strain; write 0.01 or 1%") from None


# ---- options shared by commands --------------------------------------------------------------


def _common(parser: argparse.ArgumentParser, csv: str | None = None) -> None:
    parser.add_argument(
        "-o", "--output", metavar="FIGURE", type=Path,
        help="file to write, .png or .pdf (default: beside the first result)",
    )  # fmt: skip
    _json(parser)
    if csv:
        parser.add_argument("--csv", metavar="FILE", type=Path, help=csv)


def _json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--json", action="store_true",
        help="print the numbers as JSON; draws only where -o is given too",
    )  # fmt: skip


def _files(parser: argparse.ArgumentParser, many: bool = True) -> None:
    if many:
        parser.add_argument("files", metavar="FILE.h5", nargs="+", type=Path, help="result file")
    else:
        parser.add_argument("file", metavar="FILE.h5", type=Path, help="result file")


def _state(parser: argparse.ArgumentParser, many: bool = False) -> None:
    number: dict[str, Any] = {"nargs": "+"} if many else {}
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--strain", metavar="S", type=strain_value, help="nominal strain, 0.01 or 1%%", **number
    )
    which.add_argument("--time", metavar="T", type=float, help="time [s]", **number)
    which.add_argument("--frame", metavar="N", type=int, help="number of the frame", **number)
    parser.add_argument(
        "--tolerance", metavar="D", type=float,
        help="largest distance of the frame from the strain or time asked for (default: 2 %%)",
    )  # fmt: skip


def _colours(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--field", default="plastic_strain", metavar="NAME", help="field to show "
                        "(default: plastic_strain); 'perigeo-post info' lists them")  # fmt: skip
    parser.add_argument(
        "--deformed", metavar="SCALE", type=float, nargs="?", const=1.0,
        help="deformed shape, displacements times SCALE (default 1)",
    )  # fmt: skip
    parser.add_argument("--min", metavar="V", type=float, help="low end of the colours, SI units")
    parser.add_argument("--max", metavar="V", type=float, help="high end of the colours, SI units")


def _signs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--tension-positive", action="store_true",
        help="tension positive in stress-strain curves (default: compression positive)",
    )  # fmt: skip


def _labels(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--labels", metavar="TEXT", nargs="+", help="labels of the runs (default: their names)"
    )


# ---- commands --------------------------------------------------------------------------------


def _add_info(parser: argparse.ArgumentParser) -> None:
    _files(parser)
    _json(parser)
    parser.add_argument("--input", action="store_true", help="print the namelist of the run")
    parser.add_argument("--values", action="store_true", help="print all input values as used")


def _info(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    if args.input or args.values:
        for run in runs:
            if args.input:
                print(run.input_text, end="" if run.input_text.endswith("\n") else "\n")
            if args.values:
                print("\n".join(f"{key} = {value}" for key, value in run.values.items()))
        return
    facts = [measures.run_facts(run) for run in runs]
    if args.json:
        print(export.to_json(facts[0] if len(facts) == 1 else facts))
        return
    print("\n\n".join(_info_text(f) for f in facts))


def _info_text(facts: dict[str, Any]) -> str:
    size = np.asarray(facts["upper"]) - np.asarray(facts["lower"])
    state = "complete" if facts["complete"] else "not complete: still running, or stopped early"
    layout = "lattice" if facts["on_lattice"] else "cloud"
    lines = [
        f"{facts['name']}: {facts['title']}",
        f"  file         {facts['file']} ({state})",
        f"  body         {size[0]:g} m x {size[1]:g} m, {facts['body_points']} points ({layout}), "
        f"{facts['fictitious_points']} fictitious",
        f"  spacing      {facts['spacing']:g} m, horizon {facts['horizon']:g} m",
        f"  loading axis {facts['loading_axis'] or 'none (no platens)'}"
        + (f", boundaries: {', '.join(facts['boundaries'])}" if facts["boundaries"] else ""),
        f"  fields       {', '.join(facts['fields']) or 'none written yet'}",
        "  frames       number    step       time [s]    strain    largest plastic strain",
    ]
    for f in facts["frames"]:
        number = "failed" if f["number"] is None else f["number"]
        strain = f"{f['strain']:9.6f}" if np.isfinite(f["strain"]) else "        -"
        note = "" if f["valid"] else "   (failing state, left out unless asked for)"
        lines.append(
            f"               {number:>6} {f['step']:>8} {f['time']:13.6g} {strain} "
            f"{f['largest_plastic_strain']:12.5g}{note}"
        )
    lines += _history_text(facts["history"])
    lines += [f"  {key:<14} {value}" for key, value in facts["provenance"].items()]
    return "\n".join(lines)


def _history_text(history: dict[str, Any]) -> list[str]:
    if "missing" in history:
        return [f"  history      {history['missing']}"]
    lines = [f"  history      {history['rows']} rows: {', '.join(history['columns'])}"]
    if history.get("peak_stress") is not None and history["rows"]:
        lines.append(
            f"  peak stress  {history['peak_stress'] / 1e3:.2f} kPa at a strain of "
            f"{history['strain_at_peak']:.6f} (compression positive)"
        )
        modulus = history.get("apparent_modulus")
        text = f"{modulus / 1e6:.2f} MPa" if modulus is not None else "not determined: "
        reason = history.get("apparent_modulus_missing", "")
        lines.append(f"  E_app        {text}{reason}")
    if "largest_energy_error" in history:
        lines.append(f"  energy error {history['largest_energy_error']:.2e} at most")
    return lines


def _add_curves(parser: argparse.ArgumentParser) -> None:
    _files(parser)
    _common(parser, "write every point of the curves to a CSV file")
    _labels(parser)
    _signs(parser)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--column", metavar="NAME", help="a history column instead of the stress")
    what.add_argument("--energies", action="store_true", help="all energies of one run")
    parser.add_argument(
        "--against", metavar="NAME", help="column on the horizontal axis (default: strain or time)"
    )
    parser.add_argument(
        "--platen", choices=["first", "second"], default="first",
        help="platen whose reaction is shown; first: bottom or left (default)",
    )  # fmt: skip
    parser.add_argument("--mark", metavar="S", type=strain_value, nargs="+", default=[],
                        help="strains marked on the first curve, and in --json")  # fmt: skip


def _curves(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    plain = not args.energies and not args.column
    curves: list[Curve] = []
    if args.energies:
        if len(runs) > 1:
            raise RequestError("--energies shows one run; name one file")
        curves = energy_curves(runs[0], args.against)
    elif args.column:
        curves = [history_curve(r, args.column, args.against, n) for r, n in zip(runs, names)]
    elif args.against:
        raise RequestError("--against goes with --column or --energies")
    else:
        curves = [
            stress_strain(r, args.tension_positive, args.platen, n) for r, n in zip(runs, names)
        ]
    if args.csv:
        _say(args, export.write_curves(args.csv, curves))
    if args.json:
        rows: list[dict[str, Any]] = []
        for k, curve in enumerate(curves):
            numbers: dict[str, Any] = {}
            if plain:
                numbers = curve_numbers(
                    runs[k], args.tension_positive, args.platen, tuple(args.mark)
                )
            numbers["run"] = curve.label
            numbers["x"] = {"name": curve.x_name, "unit": curve.x_unit, "values": curve.x}
            numbers["y"] = {"name": curve.y_name, "unit": curve.y_unit, "values": curve.y}
            rows.append(numbers)
        print(export.to_json(rows[0] if len(rows) == 1 else rows))

    def draw() -> Any:
        if plain:
            return figures.stress_strain_figure(
                runs, names, args.tension_positive, args.platen, args.mark
            )
        label = "Energy per unit thickness" if args.energies else None
        return figures.curve_figure(curves, label)

    kind = "energies" if args.energies else args.column or "curves"
    _draw(args, args.files[0], kind, draw)


def _add_contours(parser: argparse.ArgumentParser) -> None:
    _files(parser)
    _common(parser, "write the values at all points to a CSV file")
    _state(parser, many=True)
    _colours(parser)
    _labels(parser)
    parser.add_argument("--fictitious", action="store_true", help="show fictitious points as well")
    parser.add_argument("--include-invalid", action="store_true",
                        help="take frames of a failing state as well")  # fmt: skip
    parser.add_argument("--colours", metavar="MAP", help="matplotlib colour map")
    parser.add_argument("--column", choices=["single", "double"],
                        help="width of the figure: 88 or 180 mm")  # fmt: skip


def chosen_frames(
    run: Run,
    strains: Sequence[float] | None = None,
    times: Sequence[float] | None = None,
    numbers: Sequence[int] | None = None,
    tolerance: float | None = None,
    include_invalid: bool = False,
) -> list[Frame]:
    """The frames asked for; without any request all after the first, at most six of them."""
    if strains:
        return [run.frame(strain=s, tolerance=tolerance, include_invalid=include_invalid)
                for s in strains]  # fmt: skip
    if times:
        return [run.frame(time=t, tolerance=tolerance, include_invalid=include_invalid)
                for t in times]  # fmt: skip
    if numbers:
        return [run.frame(number=n, include_invalid=include_invalid) for n in numbers]
    frames = run.frames(include_invalid)
    if not frames:
        return [run.last_frame]
    later = [f for f in frames if f.number != 0] or frames
    if len(later) <= MOST_PANELS:
        return later
    picked = np.unique(np.rint(np.linspace(0, len(later) - 1, MOST_PANELS)).astype(int))
    return [later[k] for k in picked]


def _contours(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    frames: list[Frame] = []
    titles: list[str] = []
    for run, name in zip(runs, names):
        found = chosen_frames(
            run, args.strain, args.time, args.frame, args.tolerance, args.include_invalid
        )
        frames += found
        titles += [f.label if len(runs) == 1 else f"{name}\n{f.label}" for f in found]
    if args.csv:
        _say(args, export.write_points(args.csv, frames, args.field))
    if args.json:
        print(export.to_json([_frame_numbers(f, args.field, args.fictitious) for f in frames]))
    _draw(
        args, args.files[0], args.field,
        lambda: contour_figure(
            frames, args.field, args.deformed, args.fictitious, args.min, args.max,
            args.colours, titles, args.column,
        ),
    )  # fmt: skip


def _frame_numbers(frame: Frame, name: str, fictitious: bool = False) -> dict[str, Any]:
    field = frame.scalar(name)
    keep = np.ones(len(field.values), dtype=bool) if fictitious else frame.run.body
    values, places = field.values[keep], frame.run.positions[keep]
    numbers: dict[str, Any] = {
        "run": frame.run.name, "frame": frame.number, "step": frame.step, "time": frame.time,
        "strain": frame.strain, "valid": frame.valid, "field": name, "unit": field.unit,
        "min": None, "max": None, "mean": None, "position_of_max": None,
    }  # fmt: skip
    good = np.isfinite(values)
    if good.any():
        weights = frame.run.volumes[keep][good]
        top = int(np.nanargmax(np.where(good, values, np.nan)))
        numbers.update(
            min=values[good].min(), max=values[good].max(),
            mean=np.average(values[good], weights=weights), position_of_max=places[top],
        )  # fmt: skip
    return numbers


def _add_band(parser: argparse.ArgumentParser) -> None:
    _files(parser)
    _common(parser, "write the profile to a CSV file")
    _state(parser)
    parser.add_argument("--table", metavar="FILE", type=Path,
                        help="write the table of both bands to a CSV file")  # fmt: skip
    parser.add_argument("--line", metavar=("X0", "Y0", "X1", "Y1"), nargs=4, type=float,
                        help="line of the profile [m] (default: across the band)")  # fmt: skip
    parser.add_argument("--level", type=float, default=LEVEL, metavar="L",
                        help="part of the peak at which the width is taken (0.1)")  # fmt: skip
    parser.add_argument("--normal", action="store_true",
                        help="line at right angles to the band instead of 45 degrees")  # fmt: skip
    parser.add_argument("--axis", choices=["x", "y"],
                        help="loading axis (default: that of the run, y without one)")  # fmt: skip
    _labels(parser)


def _band(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    line = None if args.line is None else (tuple(args.line[:2]), tuple(args.line[2:]))
    found = [
        measures.measure_band(
            run, args.strain, args.time, args.frame, line, args.level, args.axis, args.normal,
            args.tolerance,
        )
        for run in runs
    ]  # fmt: skip
    if args.csv:
        profiles = [(name, m.profile) for name, m in zip(names, found)]
        _say(args, export.write_profiles(args.csv, profiles))
    if args.table:
        _say(args, export.write_bands(args.table, found))
    if args.json:
        tables = [m.as_dict() for m in found]
        print(export.to_json(tables[0] if len(tables) == 1 else tables))
    else:
        print("\n\n".join(_band_text(m) for m in found))

    def draw() -> Any:
        if len(found) == 1:
            return figures.band_figure(runs[0], found[0])
        return figures.profile_figure(found, names)

    _draw(args, args.files[0], "band", draw)


def _band_text(m: BandMeasure) -> str:
    w, b = m.width, m.bands
    (x0, y0), (x1, y1) = m.profile.line
    state = f"strain {m.strain:.6g}" if np.isfinite(m.strain) else f"time {m.time:.6g} s"
    more = "" if w.closed else " at least (the line ends before the level is reached)"
    lines = [
        f"{m.label} at {state}",
        f"  width {w.width:.4f} m +- {w.uncertainty:.3g} m{more}, at {100 * w.level:g} % of the "
        f"peak {w.peak:.4g}",
        f"  on the line ({x0:.4g}, {y0:.4g}) to ({x1:.4g}, {y1:.4g}) m, peak at "
        f"({w.peak_position[0]:.4g}, {w.peak_position[1]:.4g}) m",
        f"  {m.width_normal:.4f} m at right angles to the band; median along the band "
        f"{b.prevailing.width_median:.4f} m +- {b.prevailing.width_spread:.2g} m",
    ]
    for band in (b.prevailing, b.other):
        if band is not None:
            kind = "prevailing" if band is b.prevailing else "weaker"
            (x0, y0), (x1, y1) = band.line
            lines.append(
                f"  {kind} band, {band.direction}: {band.angle:.1f} +- "
                f"{band.angle_uncertainty:.1f} degrees from the loading axis ({b.axis}), from "
                f"({x0:.3g}, {y0:.3g}) to ({x1:.3g}, {y1:.3g}) m, strength {band.strength:.4g}"
            )
    lines.append(f"  weaker over stronger {b.ratio:.3f}, largest plastic strain {m.largest:.4g}")
    return "\n".join(lines)


def _add_compare(parser: argparse.ArgumentParser) -> None:
    _files(parser)
    _common(parser, "write the stress-strain curves to a CSV file")
    parser.add_argument("--table", metavar="FILE", type=Path,
                        help="write the table to a CSV file")  # fmt: skip
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--strain", metavar="S", type=strain_value,
                       help="strain of the contours, 0.01 or 1%% (default: last)")  # fmt: skip
    which.add_argument("--time", metavar="T", type=float, help="time of the contours [s]")
    parser.add_argument("--at", metavar="S", type=strain_value, nargs="+", default=[],
                        help="strains at which stress and alpha are tabulated")  # fmt: skip
    _colours(parser)
    _labels(parser)
    _signs(parser)


def _compare(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    strains = args.at or ([args.strain] if args.strain is not None else [])
    rows = measures.compare_runs(runs, names, strains, args.tension_positive)
    if args.table:
        units = dict(export.TABLE_UNITS, spacing="m", horizon="m", last_strain="1")
        units.update({f"stress_at_{s:g}": "Pa" for s in strains})
        units.update({f"alpha_at_{s:g}": "1" for s in strains})
        _say(args, export.write_rows(args.table, rows, units))
    if args.csv:
        curves = [
            stress_strain(r, args.tension_positive, label=n)
            for r, n in zip(runs, names)
            if r.platens is not None
        ]
        _say(args, export.write_curves(args.csv, curves))
    print(export.to_json(rows) if args.json else _table_text(rows))
    _draw(
        args, args.files[0], "compare",
        lambda: figures.compare_figure(
            runs, args.field, args.strain, args.time, names, args.deformed,
            args.tension_positive, args.min, args.max,
        ),
    )  # fmt: skip


def _table_text(rows: list[dict[str, Any]]) -> str:
    heads: dict[str, tuple[str, Callable[[Any], str]]] = {
        "run": ("run", str),
        "points": ("points", str),
        "peak_stress": ("peak stress [kPa]", lambda v: f"{v / 1e3:.2f}"),
        "strain_at_peak": ("at strain", lambda v: f"{v:.6f}"),
        "apparent_modulus": ("E_app [MPa]", lambda v: f"{v / 1e6:.2f}"),
        "last_strain": ("last strain", lambda v: f"{v:.6f}"),
        "largest_plastic_strain": ("largest alpha", lambda v: f"{v:.4f}"),
    }
    for key in dict.fromkeys(key for row in rows for key in row):
        if key.startswith("stress_at_"):
            heads[key] = (f"kPa at {key[10:]}", lambda v: f"{v / 1e3:.2f}")
        if key.startswith("alpha_at_"):
            heads[key] = (f"alpha at {key[9:]}", lambda v: f"{v:.4f}")
    table = [[head for head, _ in heads.values()]]
    for row in rows:
        cells = []
        for key, (_, shape) in heads.items():
            value = row.get(key)
            missing = value is None or (isinstance(value, float) and not np.isfinite(value))
            cells.append("-" if missing else shape(value))
        table.append(cells)
    widths = [max(len(line[k]) for line in table) for k in range(len(heads))]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if k == 0 else cell.rjust(w)
            for k, (cell, w) in enumerate(zip(line, widths))
        ).rstrip()
        for line in table
    )


def _add_animate(parser: argparse.ArgumentParser) -> None:
    _files(parser, many=False)
    parser.add_argument("-o", "--output", metavar="FILE", type=Path,
                        help="file to write, .gif or .mp4 (default: a GIF beside it)")  # fmt: skip
    _json(parser)
    _colours(parser)
    parser.add_argument("--fictitious", action="store_true", help="show fictitious points as well")
    parser.add_argument("--include-invalid", action="store_true",
                        help="show the failing state as well")  # fmt: skip
    parser.add_argument("--fps", type=float, default=5.0, help="frames a second (5)")


def _animate(args: Arguments) -> None:
    run = Run(args.file)
    frames = run.frames(args.include_invalid)
    if args.json:
        print(export.to_json([_frame_numbers(f, args.field, args.fictitious) for f in frames]))
        if args.output is None:
            return
    path = args.output or beside(args.file, args.field, ".gif")
    _say(args, animate(
        frames, path, args.field, args.deformed, args.fictitious, args.min, args.max, args.fps
    ))  # fmt: skip


def _add_study(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.toml", type=Path, help="study file")
    parser.add_argument("--output", metavar="DIR", type=Path,
                        help="folder for results (default: results/<its name>)")  # fmt: skip
    parser.add_argument("--jobs", metavar="N", type=_count,
                        help="runs at a time (default: as many as there are cores)")  # fmt: skip
    parser.add_argument(
        "--program", metavar="PATH", type=Path,
        help="the program perigeo (default: PERIGEO_BIN, bin/perigeo above FILE, or on PATH)",
    )  # fmt: skip
    parser.add_argument("--only", metavar="RUN", nargs="+", default=[],
                        help="make only these runs; patterns like 'm_*' are allowed")  # fmt: skip
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--dry-run", action="store_true",
                     help="check everything and say what would be run")  # fmt: skip
    how.add_argument("--redo", action="store_true", help="make runs anew that are done already")
    how.add_argument("--figures-only", action="store_true",
                     help="run nothing; measure and draw what is there")  # fmt: skip


def _count(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 on")
    return int(text)


def _study(args: Arguments) -> int:
    options = study.StudyOptions(
        args.output, args.jobs, args.program, args.dry_run, args.redo, args.only, args.figures_only
    )
    try:
        return study.run_study(args.file, options)
    except study.Stopped as stopped:
        print(f"perigeo-post: {stopped}", file=sys.stderr)
        return stopped.exit_status


# ---- the frame round the commands --------------------------------------------------------------


def beside(file: Path, kind: str, ending: str = ".png") -> Path:
    """Where a figure goes when no name is given: beside the result, named after it."""
    return file.with_name(f"{file.stem}_{kind}{ending}")


def _draw(args: Arguments, file: Path, kind: str, draw: Callable[[], Any]) -> None:
    if args.json and args.output is None:
        return
    path = args.output or beside(file, kind)
    check_figure_path(path)
    _say(args, save_figure(draw(), path))


def _say(args: Arguments, path: Path) -> None:
    """Name a file that was written; not among the numbers of --json."""
    print(f"wrote {path}", file=sys.stderr if args.json else sys.stdout)


_Setup = Callable[[argparse.ArgumentParser], None]
_Action = Callable[[Arguments], Any]  # gives the exit status; None: 0
COMMANDS: dict[str, tuple[_Setup, _Action, str, str]] = {
    "info": (
        _add_info, _info, "what a result holds and how far it has come",
        """\
        perigeo-post info results/compression/compression.h5
        perigeo-post info run.h5 --json
        perigeo-post info run.h5 --input > again.nml""",
    ),
    "curves": (
        _add_curves, _curves, "stress-strain curves, energies, any column of the history",
        """\
        perigeo-post curves run.h5 -o curve.pdf --mark 1% 1.3% 1.6%
        perigeo-post curves a.h5 b.h5 --labels "m = 3" "m = 4" --csv curves.csv
        perigeo-post curves run.h5 --energies --against time
        perigeo-post curves run.h5 --column max_plastic_strain""",
    ),
    "contours": (
        _add_contours, _contours, "a field at one or several states, on one colour scale",
        """\
        perigeo-post contours run.h5
        perigeo-post contours run.h5 --strain 1% 1.3% 1.6% -o bands.pdf
        perigeo-post contours run.h5 --field stress_yy --frame 3 --deformed 10""",
    ),
    "band": (
        _add_band, _band, "width, angle and place of the shear bands",
        """\
        perigeo-post band run.h5
        perigeo-post band run.h5 --strain 0.01 --json
        perigeo-post band run.h5 --line 0 0.5 1 1.5 --csv profile.csv --table bands.csv""",
    ),
    "compare": (
        _add_compare, _compare, "several runs side by side, with a table",
        """\
        perigeo-post compare a.h5 b.h5 --labels coarse fine --strain 1%
        perigeo-post compare a.h5 b.h5 --at 0.5% 1% --table table.csv""",
    ),
    "animate": (
        _add_animate, _animate, "GIF or MP4 of a field over all frames",
        """\
        perigeo-post animate run.h5
        perigeo-post animate run.h5 --field von_mises --deformed 5 -o run.mp4""",
    ),
    "study": (
        _add_study, _study, "many runs from one file: what to vary, to measure and to draw",
        """\
        perigeo-post study studies/horizon.toml
        perigeo-post study studies/horizon.toml --dry-run
        perigeo-post study my_study.toml --output results/trial --only 'm_*' --jobs 1
        perigeo-post study my_study.toml --figures-only""",
    ),
    "report": (
        report.add_options, report.carry_out, "one page with all studies: results/report.html",
        """        perigeo-post report
        perigeo-post report --results results -o page.html
        perigeo-post report --publish doc/verification.md""",
    ),
}  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = _Parser(
        prog="perigeo-post",
        description="Numbers and figures from the results of perigeo.",
        epilog="'perigeo-post COMMAND --help' explains a command and shows examples.",
    )
    top.add_argument("--version", action="version", version=f"perigeo-post {__version__}")
    commands = top.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=_Parser
    )
    for name, (setup, action, words, examples) in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=words,
            description=words[:1].upper() + words[1:] + ".",
            epilog="examples:\n" + textwrap.indent(textwrap.dedent(examples), "  "),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        setup(sub)
        sub.set_defaults(action=action)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    try:
        args = parser().parse_args(argv)
        status = args.action(args)
        sys.stdout.flush()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    except PostError as error:
        for line in str(error).splitlines():
            print(f"perigeo-post: error: {line}", file=sys.stderr)
        return error.exit_status
    except BrokenPipeError:  # the reader of a pipe has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return 130
    return status or 0


def main_entry() -> NoReturn:
    """The console script."""
    raise SystemExit(main())
