"""`perigeo-post band`: width, angle and place of the shear bands."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..measure import export, measures
from ..measure.band import LEVEL, BandMeasure
from ..read.numerals import fixed, place
from ..read.run import Run
from .options import (
    Arguments,
    add_files,
    add_labels,
    add_output,
    add_state,
    draw_figure,
    given_path,
    print_json,
    say,
)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_output(parser, "write the profile to a CSV file")
    add_state(parser)
    parser.add_argument("--table", metavar="FILE", type=given_path,
                        help="write the table of both bands to a CSV file")  # fmt: skip
    parser.add_argument("--line", metavar=("X0", "Y0", "X1", "Y1"), nargs=4, type=float,
                        help="line of the profile [m] (default: across the band)")  # fmt: skip
    parser.add_argument("--level", type=float, default=LEVEL, metavar="L",
                        help="part of the peak at which the width is taken (0.1)")  # fmt: skip
    parser.add_argument("--normal", action="store_true",
                        help="line at right angles to the band instead of 45 degrees")  # fmt: skip
    parser.add_argument("--axis", choices=["x", "y"],
                        help="loading axis (default: that of the run, y without one)")  # fmt: skip
    add_labels(parser)


def carry_out(args: Arguments) -> None:
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
        say(args, export.write_profiles(args.csv, profiles))
    if args.table:
        say(args, export.write_bands(args.table, found))
    if args.json:
        tables = [m.as_dict() for m in found]
        print_json(tables[0] if len(tables) == 1 else tables)
    else:
        print("\n\n".join(_band_text(m) for m in found))

    def draw() -> Any:
        from ..draw import figures

        if len(found) == 1:
            return figures.band_figure(runs[0], found[0])
        return figures.profile_figure(found, names)

    draw_figure(args, args.files[0], "band", draw)


def _fitted_text(m: BandMeasure) -> str:
    fitted = m.widths[0]
    if not fitted.places:
        return "unknown: no profile could be fitted along the band"
    return (
        f"{fixed(fitted.width, 4)} m, median of fits at {fitted.places} places along the band; "
        f"half the distance of the quartiles {fitted.spread:.2g} m"
    )


def _length(value: float) -> str:
    return f"{fixed(value, 4)} m" if np.isfinite(value) else "not known"


def _band_text(m: BandMeasure) -> str:
    w, b = m.interpolated, m.bands
    (x0, y0), (x1, y1) = m.profile.line
    size = float(m.profile.distance[-1])
    state = f"strain {m.strain:.6g}" if np.isfinite(m.strain) else f"time {m.time:.6g} s"
    more = "" if w.closed else " at least (the line ends before the level is reached)"
    lines = [
        f"{m.label} at {state}",
        f"  width at {100 * w.level:g} % of the peak {_fitted_text(m)}",
        f"  between points {fixed(w.width, 4)} m +- {w.uncertainty:.3g} m{more}, peak "
        f"{w.peak:.4g},",
        f"  on the line {place(x0, y0, size)} to {place(x1, y1, size)} m, peak at "
        f"{place(*w.peak_position, size)} m",
        f"  {fixed(m.interpolated_normal, 4)} m at right angles to the band; median along the band "
        f"{_length(b.prevailing.width_interpolated)}",
    ]
    for band in (b.prevailing, b.other):
        if band is not None:
            kind = "prevailing" if band is b.prevailing else "weaker"
            (x0, y0), (x1, y1) = band.line
            lines.append(
                f"  {kind} band, {band.direction}: {band.angle:.1f} +- "
                f"{band.angle_uncertainty:.1f} degrees from the loading axis ({b.axis}), from "
                f"{place(x0, y0, size, 3)} to {place(x1, y1, size, 3)} m, strength "
                f"{band.strength:.4g}"
            )
    if m.resolved is False:
        lines.append(
            f"  warning: the band is narrower than the horizon, {m.horizon:.4g} m: no model "
            "of this horizon can show it; zero-energy modes, or one row of points, may look so"
        )
    lines.append(f"  weaker over stronger {b.ratio:.3f}, largest plastic strain {m.largest:.4g}")
    return "\n".join(lines)
