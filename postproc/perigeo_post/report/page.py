"""The report as one HTML page that needs nothing outside itself."""

from __future__ import annotations

from ..version import __version__
from .data import (
    DONE,
    FAILED,
    MISSING,
    VERDICTS,
    Material,
)
from .html import (
    STYLE,
    Content,
    Html,
    Ids,
    box,
    el,
    escape,
    facts_list,
    join,
    notice,
    number_html,
)
from .study import CLASSES, StudySection, machine_text, run_name, verdict_mark
from .values import (
    DASH,
    QUALITY,
    duration,
    number,
    readable,
    worst,
)

TITLE = "perigeo: the studies and what they show"
PAPER = (
    "S. Nandwal, S. K. Sinha: Optimizing peridynamic microparameters for accurate representation "
    "of elasticity, plasticity and shear localization in geomaterials. PARTICLES 2025."
)
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


class Page:
    """Builds the page; `problems` holds what was named by a study and could not be read."""

    def __init__(self, material: Material) -> None:
        self.material = material
        self.problems: list[str] = list(material.problems)
        self.files = dict(material.known)
        self.ids = Ids()
        fixed = ("main", "summary", "findings", "quality", "verification")
        self.fixed = {name: self.ids.new(name) for name in fixed}
        self.places = [self.ids.new("study", study.name) for study in material.studies]
        self.failures = {
            (s.name, r.id): self.ids.new("failed", s.name, r.id)
            for s in material.studies
            for r in s.runs
            if r.status == FAILED
        }

    def html(self) -> str:
        """The whole page."""
        # The studies come first: what they lack is told in the summary.
        studies = [
            StudySection(study, self.failures, self.problems, self.files).html(place)
            for study, place in zip(self.material.studies, self.places)
        ]
        closing = [self.quality(), self.verification()]
        main = el(
            "main", self.opening(), self.summary(), self.findings(), *studies, *closing,
            el("footer", el("p", f"Made by perigeo-post {__version__}.", class_="small soft")),
            id="main",
        )  # fmt: skip
        body = el("div", self.contents(), main, class_="page")
        head = el(
            "head",
            el("meta", charset="utf-8"),
            el("meta", name="viewport", content="width=device-width, initial-scale=1"),
            el("meta", http_equiv="Content-Security-Policy", content=POLICY),
            el("meta", name="color-scheme", content="light dark"),
            el("link", rel="icon", href="data:,"),
            el("title", TITLE),
            el("style", Html(STYLE)),
        )
        skip = el("a", "Skip to the text", class_="skip", href="#main")
        return f"<!doctype html>\n{el('html', head, el('body', skip, body), lang='en')}\n"

    # ---- the frame --------------------------------------------------------------------------

    def contents(self) -> Html:
        links = [("summary", "Summary")]
        if any(study.findings for study in self.material.studies):
            links.append(("findings", "The paper and perigeo"))
        links += [(p, s.title) for p, s in zip(self.places, self.material.studies)]
        if self.measured_quality():
            links.append(("quality", "Quality of the runs"))
        if self.material.checks:
            links.append(("verification", "Verification"))
        items = [el("li", el("a", text, href=f"#{place}")) for place, text in links]
        return el("nav", el("p", "Contents"), el("ul", *items), aria_label="Contents")

    def opening(self) -> Html:
        studies = self.material.studies
        lead = (
            "perigeo computes shear bands in soil by non-ordinary state-based peridynamics. This "
            "page sets what the paper says against what perigeo finds, study by study: every "
            "figure, the values measured, and the input, the version and the time of each run."
        )
        versions = sorted({version for study in studies for version in study.versions})
        dates = sorted(study.created[:10] for study in studies if study.created)
        period = " to ".join(dict.fromkeys((dates[0], dates[-1]))) if dates else DASH
        machines = sorted({machine_text(study.machine) for study in studies} - {""})
        facts = [
            ("Paper", PAPER),
            ("Program", "; ".join(versions) or DASH),
            ("Computed", period),
            ("Machine", "; ".join(machines) or DASH),
        ]
        return el("header", el("h1", TITLE), el("p", lead, class_="lead"), facts_list(facts))

    def summary(self) -> Html:
        studies = self.material.studies
        findings = [finding for study in studies for finding in study.findings]
        tally = [
            (
                el("span", verdict, class_=f"verdict {CLASSES[verdict]}"),
                str(sum(finding.verdict == verdict for finding in findings)),
                "",
            )
            for verdict in VERDICTS
            if findings
        ]
        total = len(studies) + len(self.material.missing)
        runs = {state: sum(s.count(state) for s in studies) for state in (DONE, FAILED, MISSING)}
        lacking = [f"{n} {state}" for state, n in runs.items() if state != DONE and n]
        tally += [
            (escape("studies"), str(len(studies)), f"of {total}"),
            (escape("runs done"), str(runs[DONE]), ", ".join(lacking) or "all of them"),
            (
                escape("time of all runs"),
                duration(sum(s.seconds or 0.0 for s in studies)),
                "added up over the runs",
            ),
        ]
        checks = self.material.checks
        if checks:
            good = sum(check.passed for check in checks)
            tally.append((escape("checks"), str(good), f"of {len(checks)} within tolerance"))
        tiles = [
            el("div", el("dt", name), el("dd", value, el("small", more) if more else None))
            for name, value, more in tally
        ]
        return el(
            "section", el("h2", "Summary"), el("dl", *tiles, class_="tally"), self.notices(),
            id="summary",
        )  # fmt: skip

    def notices(self) -> Html:
        parts: list[Content] = []
        if self.problems:
            items = [el("li", problem) for problem in self.problems]
            parts.append(notice("These could not be read:", el("ul", *items)))
        failed = [
            el("li", el("a", f"{study.title}: {run_name(study, run)}",
                        href=f"#{self.failures[study.name, run.id]}"))
            for study in self.material.studies
            for run in study.runs
            if run.status == FAILED
        ]  # fmt: skip
        if failed:
            parts.append(notice("These runs failed:", el("ul", *failed)))
        unfinished = [
            el("li", f"{study.title}: {study.count(MISSING)} of {len(study.runs)} runs missing")
            for study in self.material.studies
            if study.count(MISSING)
        ]  # fmt: skip
        if unfinished:
            parts.append(notice("These studies are not finished:", el("ul", *unfinished), True))
        missing = [
            el("li", el("code", f"perigeo-post study {file}")) for _, file in self.material.missing
        ]
        if missing:
            parts.append(notice("Studies not computed yet (make figures makes all of them):",
                                el("ul", *missing), True))  # fmt: skip
        versions = {version for study in self.material.studies for version in study.versions}
        if len(versions) > 1:
            words = "The runs were made with different versions of the program; each study says "
            parts.append(notice(words + "which."))
        return join(parts)

    def findings(self) -> Html | None:
        groups = []
        for study, place in zip(self.material.studies, self.places):
            if not study.findings:
                continue
            link = el("a", study.title, href=f"#{place}")
            head = el("tr", el("th", link, colspan=4, scope="rowgroup", role="rowheader"),
                      class_="group", role="row")  # fmt: skip
            rows = [
                el(
                    "tr",
                    el("th", f.title, scope="row", role="rowheader"),
                    el("td", f.paper or DASH, data_label="The paper says", role="cell"),
                    el("td", f.found or DASH, data_label="We find", role="cell"),
                    el("td", verdict_mark(f), data_label="Verdict", role="cell"),
                    role="row",
                )
                for f in study.findings
            ]
            groups.append(el("tbody", head, *rows, role="rowgroup"))
        if not groups:
            return None
        names = ("Statement", "The paper says", "We find", "Verdict")
        heads = [el("th", name, scope="col", role="columnheader") for name in names]
        # On a phone the rows become blocks, which drops their roles unless they are written out.
        head = el("thead", el("tr", *heads, role="row"), role="rowgroup")
        table = el("table", head, *groups, class_="findings", role="table")
        title = el("h2", "What the paper says, what we find")
        return el("section", title, table, id="findings")

    # ---- after the studies ------------------------------------------------------------------

    def measured_quality(self) -> list[str]:
        """The quality measures that at least one study has."""
        studies = self.material.studies
        return [c for c in QUALITY if any(worst(study, c) is not None for study in studies)]

    def quality(self) -> Html | None:
        columns = self.measured_quality()
        if not columns:
            return None
        heads = [el("th", "Study", scope="col")]
        heads += [el("th", readable(name), scope="col", class_="n") for name in columns]
        lines = []
        described: dict[str, str] = {}
        for study in self.material.studies:
            found = [worst(study, column) for column in columns]
            cells = [DASH if value is None else number(value, 3) for value in found]
            if set(cells) == {DASH}:
                continue
            lines.append(
                el("tr", el("th", study.title, scope="row"),
                   *[el("td", number_html(text), class_="n") for text in cells])
            )  # fmt: skip
            described.update({c: study.descriptions[c] for c in columns if c in study.descriptions})
        table = el("table", el("thead", el("tr", *heads)), el("tbody", *lines))
        words = (
            "Quasi-static loading and a closed balance of energies make these small. The largest "
            "magnitude over the runs of each study:"
        )
        meanings = facts_list([(readable(name), text) for name, text in described.items()])
        return el("section", el("h2", "Quality of the runs"), el("p", words),
                  box(table, "Quality of the runs"), meanings if described else None,
                  id="quality")  # fmt: skip

    def verification(self) -> Html | None:
        checks = self.material.checks
        if not checks:
            return None
        names = ("Quantity", "Unit", "Exact", "Computed", "Error", "Tolerance", "Verdict", "From")
        numeric = names[2:6]
        heads = [el("th", n, scope="col", class_="n" if n in numeric else None) for n in names]
        lines = []
        for check in checks:
            shape, word = ("agrees", "ok") if check.passed else ("differs", "FAILED")
            lines.append(
                el(
                    "tr",
                    el("th", check.quantity, scope="row"),
                    el("td", check.unit),
                    el("td", number_html(number(check.exact, 5)), class_="n"),
                    el("td", number_html(number(check.computed, 5)), class_="n"),
                    el("td", f"{100.0 * check.error:+.3f} %".replace("-", "−"), class_="n"),
                    el("td", f"{100.0 * check.tolerance:.2g} %", class_="n"),
                    el("td", el("span", word, class_=f"verdict {shape}")),
                    el("td", check.source),
                )
            )
        table = el("table", el("thead", el("tr", *heads)), el("tbody", *lines))
        words = (
            "Computed values against closed forms, against an independent calculation and against "
            "the paper. Errors are relative to the exact value, or to a scale where that is 0."
        )
        return el(
            "section", el("h2", "Verification"), el("p", words),
            el("p", f"{self.material.checks_from}.", class_="small soft")
            if self.material.checks_from else None,
            box(table, "Verification"), id="verification",
        )  # fmt: skip
