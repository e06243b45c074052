"""The tables of the studies in Markdown, put between markers of a document."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ..read.errors import OutputError, RequestError, ResultError
from .data import DONE, FAILED, MISSING, Material, Study
from .study import origin
from .values import DASH, Line, headline, values_of

BEGIN, END = "<!-- studies: begin -->", "<!-- studies: end -->"


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


def tables(material: Material) -> str:
    """All tables: what the paper says and what is found, then the values of every study."""
    lines = [provenance(material), ""]
    rows = [
        list(map(markdown_cell, (study.title, f.title, f.statement, f.found, f.verdict)))
        for study in material.studies
        for f in study.findings
    ]
    if rows:
        lines += ["**What the paper says, what is found**", ""]
        lines += markdown_table(("study", "statement", "paper", "perigeo", "verdict"), rows)
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


def publish(material: Material, page: Path) -> Path:
    """Put the tables between the markers of a document."""
    if not material.studies:
        raise RequestError("there is no study to publish")
    try:
        text = page.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultError(f"{page}: cannot be read: {error.strerror or error}") from error
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise RequestError(f"{page} must have the lines {BEGIN} and {END} once each, in this order")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    try:
        page.write_text(f"{before}{BEGIN}\n{tables(material)}{END}{after}", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {page}: {error.strerror or error}") from error
    return page
