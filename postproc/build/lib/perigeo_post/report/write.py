"""One page with all studies, `results/report.html`.

The page holds everything itself: it opens without a network, on a phone too. It is a function of
the results alone, so the same results give the same page.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..read.errors import OutputError, RequestError
from ..read.outputs import PAGE, check_output
from .check import LARGE, check_report
from .data import FAILED, MISSING, Material, gather
from .page import page_html


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
    check_output(output, PAGE)
    text, unreadable = page_html(material)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {output}: {error.strerror or error}") from error
    size = len(text.encode("utf-8"))
    return Report(output, material, unreadable, check_report(output), size)
