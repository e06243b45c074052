"""`perigeo-post curves`: stress-strain curves, settlements, energies, columns of the history."""

from __future__ import annotations

import argparse
from typing import Any

from ..measure import export, measures
from ..measure.curves import (
    Curve,
    column_curves,
    curve_numbers,
    energy_curves,
    settlement_curves,
    stress_strain,
)
from ..read.errors import RequestError
from ..read.run import Run
from .options import (
    Arguments,
    add_files,
    add_labels,
    add_output,
    add_signs,
    draw_figure,
    print_json,
    say,
    strain_value,
)


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_output(parser, "write every point of the curves to a CSV file")
    add_labels(parser)
    add_signs(parser)
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--y", metavar="NAME", nargs="+", default=[],
        help="columns of the history instead of the stress, of one unit; 'perigeo-post info' lists "
        "them",
    )  # fmt: skip
    what.add_argument("--column", metavar="NAME", help="the same, one column")
    what.add_argument(
        "--settlement", metavar="BOUNDARY",
        help="settlement of a boundary, downwards, against the load on it, as of a footing",
    )  # fmt: skip
    what.add_argument("--energies", action="store_true", help="all energies of one run")
    parser.add_argument(
        "--x", "--against", metavar="NAME", dest="x",
        help="column on the horizontal axis (default: strain or time)",
    )  # fmt: skip
    parser.add_argument(
        "--platen", choices=["first", "second"], default="first",
        help="platen whose reaction is shown; first: bottom or left (default)",
    )  # fmt: skip
    parser.add_argument("--mark", metavar="S", type=strain_value, nargs="+", default=[],
                        help="strains marked on the first curve, and in --json")  # fmt: skip


def carry_out(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    columns = [args.column] if args.column else args.y
    plain = not args.energies and not columns and not args.settlement
    curves: list[Curve] = []
    if args.energies:
        if len(runs) > 1:
            raise RequestError("--energies shows one run; name one file")
        curves = energy_curves(runs[0], args.x)
    elif columns:
        curves = column_curves(runs, columns, args.x, names)
    elif args.x:
        raise RequestError("--x goes with --y or --energies")
    elif args.settlement:
        curves = settlement_curves(runs, args.settlement, names)
    else:
        curves = [
            stress_strain(r, args.tension_positive, args.platen, n) for r, n in zip(runs, names)
        ]
    if args.csv:
        say(args, export.write_curves(args.csv, curves))
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
        print_json(rows[0] if len(rows) == 1 else rows)

    def draw() -> Any:
        from ..draw import figures

        if plain:
            return figures.stress_strain_figure(
                runs, names, args.tension_positive, args.platen, args.mark
            )
        label = "Energy per unit thickness" if args.energies else None
        return figures.curve_figure(curves, label)

    kind = "energies" if args.energies else columns[0] if columns else "curves"
    if args.settlement:
        kind = f"{args.settlement}_settlement"
    draw_figure(args, args.files[0], kind, draw)
