"""`perigeo-post compare`: several runs side by side, with a table."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np

from ..measure import export, measures
from ..measure.curves import stress_strain
from ..read.numerals import fixed
from ..read.run import Run
from .options import (
    Arguments,
    add_colours,
    add_files,
    add_labels,
    add_output,
    add_signs,
    draw_figure,
    given_path,
    print_json,
    say,
    strain_value,
)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_output(parser, "write the stress-strain curves to a CSV file")
    parser.add_argument("--table", metavar="FILE", type=given_path,
                        help="write the table to a CSV file")  # fmt: skip
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--strain", metavar="S", type=strain_value,
                       help="strain of the contours, 0.01 or 1%% (default: last)")  # fmt: skip
    which.add_argument("--time", metavar="T", type=float, help="time of the contours [s]")
    parser.add_argument("--at", metavar="S", type=strain_value, nargs="+", default=[],
                        help="strains at which stress and alpha are tabulated")  # fmt: skip
    add_colours(parser)
    add_labels(parser)
    add_signs(parser)


def carry_out(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    strains = args.at or ([args.strain] if args.strain is not None else [])
    rows = measures.compare_runs(runs, names, strains, args.tension_positive)
    if args.table:
        units = dict(export.TABLE_UNITS, spacing="m", horizon="m", last_strain="1")
        units.update({f"stress_at_{s:g}": "Pa" for s in strains})
        units.update({f"alpha_at_{s:g}": "1" for s in strains})
        say(args, export.write_rows(args.table, rows, units))
    if args.csv:
        curves = [
            stress_strain(r, args.tension_positive, label=n)
            for r, n in zip(runs, names)
            if r.platens is not None
        ]
        say(args, export.write_curves(args.csv, curves))
    if args.json:
        print_json(rows)
    else:
        print(_table_text(rows))

    def draw() -> Any:
        from ..draw import figures

        return figures.compare_figure(
            runs, args.field, args.strain, args.time, names, args.deformed,
            args.tension_positive, args.min, args.max, args.smooth,
        )  # fmt: skip

    draw_figure(args, args.files[0], "compare", draw)


def _table_text(rows: list[dict[str, Any]]) -> str:
    heads: dict[str, tuple[str, Callable[[Any], str]]] = {
        "run": ("run", str),
        "points": ("points", str),
        "peak_stress": ("peak stress [kPa]", lambda v: fixed(v / 1e3, 2)),
        "strain_at_peak": ("at strain", lambda v: f"{v:.6f}"),
        "apparent_modulus": ("E_app [MPa]", lambda v: fixed(v / 1e6, 2)),
        "last_strain": ("last strain", lambda v: f"{v:.6f}"),
        "largest_plastic_strain": ("largest alpha", lambda v: f"{v:.4f}"),
    }
    for key in dict.fromkeys(key for row in rows for key in row):
        if key.startswith("stress_at_"):
            heads[key] = (f"kPa at {key[10:]}", lambda v: fixed(v / 1e3, 2))
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
