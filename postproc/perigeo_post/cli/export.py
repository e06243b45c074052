"""`perigeo-post export`: frames for other programs, as VTU or CSV."""

from __future__ import annotations

import argparse

from ..measure import export, vtk_files
from ..read.errors import RequestError
from ..read.run import Frame, Run
from .options import Arguments, add_files, add_state, given_path


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser, many=False)
    parser.add_argument(
        "--format", choices=["vtu", "csv"], default="vtu",
        help="vtu: a file for each frame and a .pvd that ParaView opens (default); csv: a table "
        "for each frame",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="DIR", type=given_path,
                        help="folder to write to (default: NAME_export beside it)")  # fmt: skip
    parser.add_argument("--field", metavar="NAME", nargs="+",
                        help="fields (default: all that the file holds)")  # fmt: skip
    parser.add_argument("--include-invalid", action="store_true",
                        help="take frames of a failing state as well")  # fmt: skip
    add_state(parser, many=True)


def carry_out(args: Arguments) -> None:
    run = Run(args.file)
    frames = _frames(args, run)
    folder = args.output or args.file.with_name(f"{args.file.stem}_export")
    names = args.field or list(run.stored_fields)
    if folder.exists() and not folder.is_dir():
        raise RequestError(f"{folder} is no folder")
    if args.format == "csv":
        paths = [
            export.write_frame(folder / f"{run.name}_{frame.number or 0:06d}.csv", frame, names)
            for frame in frames
        ]
    else:
        paths = vtk_files.write_vtu(folder, run, frames, names)
    print(f"wrote {paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))


def _frames(args: Arguments, run: Run) -> list[Frame]:
    """The frames asked for, all without a request."""
    invalid = args.include_invalid
    if args.strain:
        return [run.frame(strain=s, tolerance=args.tolerance) for s in args.strain]
    if args.time:
        return [run.frame(time=t, tolerance=args.tolerance) for t in args.time]
    if args.frame:
        return [run.frame(number=n, include_invalid=invalid) for n in args.frame]
    return run.frames(invalid) or [run.last_frame]
