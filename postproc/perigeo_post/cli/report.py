"""`perigeo-post report`: one page with all studies."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..read.errors import OutputError, RequestError, ResultError
from .options import extra, given_path

STUDIES = Path("studies")  # where the study files are looked for
DOCUMENT = Path("doc/verification.md")


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `perigeo-post report`."""
    parser.add_argument("--results", metavar="DIR", type=given_path, default=Path("results"),
                        help="folder of the results (default: results)")  # fmt: skip
    parser.add_argument("-o", "--output", metavar="FILE", type=given_path,
                        help="page to write (default: report.html in that folder)")  # fmt: skip
    parser.add_argument(
        "--studies", metavar="DIR", type=given_path,
        help="folder of the study files; those without results are named (default: studies, "
        "where it is there)",
    )  # fmt: skip
    parser.add_argument(
        "--publish", metavar="DOCUMENT", type=given_path, nargs="?", const=DOCUMENT,
        help="also write the findings between the markers of this document (default: "
        "doc/verification.md), the values into study_tables.md beside it",
    )  # fmt: skip


def carry_out(args: argparse.Namespace) -> None:
    """Write the report, say what is missing; an error where something is broken."""
    studies = args.studies or (STUDIES if STUDIES.is_dir() else None)
    if studies is not None and not studies.is_dir():
        raise RequestError(f"there is no folder {studies}")
    with extra("report"):
        from ..report.publish import publish
        from ..report.write import write_report

    report = write_report(args.results, args.output, studies)
    print(f"wrote {report.path}")
    for line in report.remarks():
        print(f"perigeo-post: {line}", file=sys.stderr)
    if report.faults:
        raise OutputError(f"{report.path} is not as it should be; see above")
    if report.unreadable:
        raise ResultError(f"{report.path} lacks what could not be read; see above")
    if args.publish is not None:
        for path in publish(report.material, args.publish):
            print(f"wrote {path}")
