"""The tables of the studies in Markdown, put between markers of a document."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ..read.errors import OutputError, RequestError, ResultError
from ..study.record import VERDICTS
from .data import DONE, FAILED, MISSING, Material, Study
from .study import origin
from .values import DASH, Line, headline, values_of

BEGIN, END = "<!-- studies: begin -->", "<!-- studies: end -->"
APPENDIX = "study_tables.md"  # beside the document: where the values go, if it is there


def markdown_cell(text: str) -> str:
    """Text for a cell of a table: one line, nothing in it that Markdown or HTML would take."""
    text = re.sub(r"10\^(−?[0-9]+)", "10<sup>\\1</sup>", _plain(text))
    return text.replace("|", "\\|") or DASH


def _plain(text: str) -> str:
    words = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_\[\]])", r"\\\1", words)


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def provenance(material: Material) -> str:
    """With which program, on which machine and when, in one line."""
    known = origin(material)
    words = [*known.versions, *known.machines, known.period]
    return "Printed by `make report`, " + ", ".join(word for word in words if word) + ":"


def findings(material: Material) -> str:
    """What the paper says and what is found; then what goes beyond the paper."""
    lines = [provenance(material)]
    for of_the_paper, title, says in (
        (True, "What the paper says, what is found", "paper"),
        (False, "Own checks, beyond the paper", "claim"),
    ):
        found = [(s, f) for s in material.studies for f in s.findings]
        found = [(s, f) for s, f in found if f.of_the_paper == of_the_paper]
        if not found:
            continue
        counts = Counter(f.verdict for _, f in found)
        words = ", ".join(f"{counts[v]} {v}" for v in VERDICTS if counts[v])
        lines += ["", f"**{title}** ({len(found)}: {words})", ""]
        rows = [
            list(map(markdown_cell, (s.title, f.title, f.statement, f.found, f.verdict)))
            for s, f in found
        ]
        lines += markdown_table(("study", "statement", says, "perigeo", "verdict"), rows)
    return "\n".join(lines) + "\n"


def tables(material: Material) -> str:
    """The values of every study."""
    lines = [provenance(material)]
    for study in material.studies:
        lines += study_tables(study)
    if material.missing:
        names = ", ".join(_plain(name) for name, _ in material.missing)
        lines += ["", f"Not computed: {names}."]
    return "\n".join(lines) + "\n"


def study_tables(study: Study) -> list[str]:
    """The values measured, a table for each series, quantities down and runs across."""
    lines: list[str] = []
    for name, title in study.series:
        values = headline(values_of(study, study.runs_of(name)), study.runs)
        if not values.lines:
            continue
        words = study.title if len(study.series) < 2 else f"{study.title}: {title or name}"
        head = ["quantity", "unit", *map(markdown_cell, values.labels)]
        rows = [_row(line) for line in values.lines]
        lines += ["", f"**{_plain(words)}** (study `{study.name}`)", ""]
        lines += markdown_table(head, rows)
    lacking = [f"{study.count(s)} {s}" for s in (FAILED, MISSING) if study.count(s)]
    if lacking:
        lines += ["", f"Of the {len(study.runs)} runs of `{study.name}`, {study.count(DONE)} are "
                  f"done, {' and '.join(lacking)}."]  # fmt: skip
    return lines


def _row(line: Line) -> list[str]:
    return [markdown_cell(line.name), line.unit or "1", *map(markdown_cell, line.cells)]


def publish(material: Material, page: Path) -> list[Path]:
    """Put the findings between the markers of a document, and the values of the studies between
    those of the appendix beside it; without one below the findings."""
    if not material.studies:
        raise RequestError("there is no study to publish")
    appendix = page.with_name(APPENDIX)
    if not appendix.exists():
        return [put(f"{findings(material)}\n{tables(material)}", page)]
    return [put(findings(material), page), put(tables(material), appendix)]


def put(words: str, page: Path) -> Path:
    """Put a text between the markers of a document."""
    try:
        text = page.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultError(f"{page}: cannot be read: {error.strerror or error}") from error
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise RequestError(f"{page} must have the lines {BEGIN} and {END} once each, in this order")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    try:
        page.write_text(f"{before}{BEGIN}\n{words}{END}{after}", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {page}: {error.strerror or error}") from error
    return page
