"""`perigeo-post study`: many runs from one file."""

from __future__ import annotations

import argparse
import sys

from .options import Arguments, extra, given_path


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.toml", type=given_path, help="study file")
    parser.add_argument("--output", metavar="DIR", type=given_path,
                        help="folder for results (default: results/<its name>)")  # fmt: skip
    parser.add_argument("--jobs", metavar="N", type=_count,
                        help="runs at a time (default: as many as there are cores)")  # fmt: skip
    parser.add_argument(
        "--program", metavar="PATH", type=given_path,
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


def carry_out(args: Arguments) -> int:
    with extra("study"):
        from ..study import run as study

    options = study.StudyOptions(
        args.output, args.jobs, args.program, args.dry_run, args.redo, args.only, args.figures_only
    )
    try:
        return study.run_study(args.file, options)
    except study.Stopped as stopped:
        print(f"perigeo-post: {stopped}", file=sys.stderr)
        return stopped.exit_status
