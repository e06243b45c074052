"""`perigeo-post report`: one page with all studies, `results/report.html`.

The page holds everything itself: it opens without a network, on a phone too. It is a function of
the results alone, so the same results give the same page.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from ..read.errors import OutputError, RequestError, ResultError
from .check import LARGE, check_report
from .data import FAILED, MISSING, Material, gather
from .page import Page
from .publish import publish

__all__ = [
    "Report", "add_options", "carry_out", "check_report", "gather", "publish", "write_report",
]  # fmt: skip


STUDIES = Path("studies")  # where the study files are looked for
DOCUMENT = Path("doc/verification.md")


@dataclass(frozen=True)
class Report:
    """A report that was written: where it is, and what the user should know about it."""

    path: Path
    material: Material
    unreadable: list[str]  # what studies name and what is missing or broken
    faults: list[str]  # of the page itself
    size: int  # bytes

    def remarks(self) -> list[str]:
        """What is not there or not as it should be, one line each."""
        lines = [f"cannot be read: {problem}" for problem in self.unreadable]
        lines += [
            f"study {name} has not been computed: perigeo-post study {file}"
            for name, file in self.material.missing
        ]
        for study in self.material.studies:
            failed, missing = study.count(FAILED), study.count(MISSING)
            if failed:
                lines.append(f"study {study.name}: {failed} of {len(study.runs)} runs failed")
            if missing:
                lines.append(f"study {study.name}: {missing} of {len(study.runs)} runs missing")
            lines += [f"study {study.name}: {problem}" for problem in study.problems]
        if self.size > LARGE:
            lines.append(f"the page has {self.size / 1e6:.0f} MB: it may be slow to open")
        return lines + [f"the page is not as it should be: {fault}" for fault in self.faults]


def write_report(
    results: str | Path = "results",
    output: str | Path | None = None,
    studies: str | Path | None = None,
) -> Report:
    """Write the report of a folder of results and check it.

    `studies` is the folder of the study files: those without a result are named in the report.
    """
    results = Path(results)
    output = Path(output) if output is not None else results / "report.html"
    if not results.is_dir():
        raise RequestError(f"there is no folder {results}; 'make figures' makes the results")
    material = gather(results, Path(studies) if studies is not None else None)
    if not material.studies and not material.problems:
        raise RequestError(
            f"{results} holds no study; 'make figures' or 'perigeo-post study FILE' makes them"
        )
    page = Page(material)
    text = page.html()
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {output}: {error.strerror or error}") from error
    size = len(text.encode("utf-8"))
    return Report(output, material, page.problems, check_report(output), size)


# ---- the command ---------------------------------------------------------------------------------


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of `perigeo-post report`."""
    parser.add_argument("--results", metavar="DIR", type=Path, default=Path("results"),
                        help="folder of the results (default: results)")  # fmt: skip
    parser.add_argument("-o", "--output", metavar="FILE", type=Path,
                        help="page to write (default: report.html in that folder)")  # fmt: skip
    parser.add_argument(
        "--studies", metavar="DIR", type=Path,
        help="folder of the study files; those without results are named (default: studies, "
        "where it is there)",
    )  # fmt: skip
    parser.add_argument(
        "--publish", metavar="DOCUMENT", type=Path, nargs="?", const=DOCUMENT,
        help="also write the tables between the markers of this document (default: "
        "doc/verification.md)",
    )  # fmt: skip


def carry_out(args: argparse.Namespace) -> None:
    """Write the report, say what is missing; an error where something is broken."""
    studies = args.studies or (STUDIES if STUDIES.is_dir() else None)
    if studies is not None and not studies.is_dir():
        raise RequestError(f"there is no folder {studies}")
    report = write_report(args.results, args.output, studies)
    print(f"wrote {report.path}")
    for line in report.remarks():
        print(f"perigeo-post: {line}", file=sys.stderr)
    if report.faults:
        raise OutputError(f"{report.path} is not as it should be; see above")
    if report.unreadable:
        raise ResultError(f"{report.path} lacks what could not be read; see above")
    if args.publish is not None:
        print(f"wrote {publish(report.material, args.publish)}")
