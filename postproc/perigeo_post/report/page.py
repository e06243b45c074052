"""The report as one HTML page that needs nothing outside itself; its text is in the templates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ..version import __version__
from .data import DONE, FAILED, MISSING, VERDICTS, Material
from .html import Ids, environment
from .study import Section, origin
from .values import DASH, QUALITY, number, readable, worst


def page_html(material: Material) -> tuple[str, list[str]]:
    """The page, and what was named by a study and could not be read."""
    ids = Ids()
    for fixed in ("main", "summary", "findings", "quality", "verification"):
        ids.new(fixed)
    files = dict(material.known)
    studies = material.studies
    sections = [
        Section(s, ids.new("study", s.name), files.get(s.name) or s.file or s.name) for s in studies
    ]
    failures = {
        (s.name, run.id): ids.new("failed", s.name, run.id)
        for s in studies for run in s.runs if run.status == FAILED
    }  # fmt: skip
    problems = [*material.problems, *(words for one in sections for words in one.problems)]
    counts = Counter((f.of_the_paper, f.verdict) for study in studies for f in study.findings)
    tallies = [
        (
            title,
            [
                (verdict, counts[(paper, verdict)])
                for verdict in VERDICTS
                if counts[(paper, verdict)]
            ],
        )
        for title, paper in (("Statements of the paper", True), ("Own checks", False))
    ]
    runs = {state: sum(s.count(state) for s in studies) for state in (DONE, FAILED, MISSING)}
    template = environment().get_template("page.html")
    text = template.render(
        version=__version__,
        material=material,
        sections=sections,
        failures=failures,
        problems=problems,
        origin=origin(material),
        tallies=[(title, sum(n for _, n in found), found) for title, found in tallies if found],
        runs=runs,
        lacking=[f"{n} {state}" for state, n in runs.items() if state != DONE and n],
        seconds=sum(study.seconds or 0.0 for study in studies),
        quality=quality(material),
    )
    return text, problems


@dataclass(frozen=True)
class Quality:
    """How good the runs are: a column for each measure, a line for each study."""

    columns: Sequence[str]
    lines: Sequence[tuple[str, Sequence[str]]]
    meanings: Sequence[tuple[str, str]]


def quality(material: Material) -> Quality:
    """The largest magnitudes over the runs of each study."""
    studies = material.studies
    columns = [c for c in QUALITY if any(worst(study, c) is not None for study in studies)]
    lines: list[tuple[str, list[str]]] = []
    described: dict[str, str] = {}
    for study in studies:
        found = [worst(study, column) for column in columns]
        cells = [DASH if value is None else number(value, 3) for value in found]
        if set(cells) != {DASH}:
            lines.append((study.title, cells))
            described |= {c: study.descriptions[c] for c in columns if c in study.descriptions}
    return Quality(
        [readable(column) for column in columns],
        lines,
        [(readable(name), text) for name, text in described.items()],
    )
