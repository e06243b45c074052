"""The part of the report that shows one study."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping

from PIL import Image

from ..read.errors import ResultError
from ..study.types import Value
from .data import (
    AGREES,
    DIFFERS,
    DONE,
    FAILED,
    IN_PART,
    MISSING,
    NO_RESULT,
    FigureRecord,
    Finding,
    RunRecord,
    Study,
    read_table,
)
from .html import (
    Content,
    Html,
    box,
    el,
    escape,
    facts_list,
    join,
    notice,
    number_html,
    paragraphs,
)
from .values import DASH, Values, cell, duration, headline, number, readable, values_of

CLASSES = {AGREES: "agrees", IN_PART: "in-part", DIFFERS: "differs", NO_RESULT: "no-result"}
PIXELS_PER_INCH = 135.0  # on the screen: a figure of one column takes about half the text
LONGEST_TABLE = 60  # rows of the numbers of a figure that the page shows
WIDEST_TABLE = 12


class StudySection:
    """Builds the section; what a study names and cannot be read goes into `problems`."""

    def __init__(
        self,
        study: Study,
        failures: Mapping[tuple[str, str], str],
        problems: list[str],
        files: Mapping[str, str],
    ) -> None:
        self.study = study
        self.failures = failures  # places in the page, by study and run
        self.problems = problems
        self.files = files  # of the studies, by their names

    def html(self, place: str) -> Html:
        """The whole section, to be found at this place."""
        study = self.study
        source = el("code", study.file or study.name)
        facts = [
            ("Study", join([source, f" on {study.base}" if study.base else None])),
            ("Program", "; ".join(study.versions) or DASH),
            ("Computed", join_words(study.created[:10], machine_text(study.machine)) or DASH),
            ("Time", f"{duration(study.seconds)} for {plural(len(study.runs), 'run')}"),
        ]
        parts: list[Content] = [
            el("h2", study.title),
            paragraphs(study.question, "lead"),
            facts_list(facts),
            *self.notices(),
        ]
        if study.findings:
            parts.append(el("h3", "Findings"))
            parts += [self.finding(finding) for finding in study.findings]
        if study.figures:
            parts.append(el("h3", "Figures"))
            parts += [self.figure(figure) for figure in study.figures]
        parts += [self.values(), self.runs()]
        return el("section", *parts, id=place)

    def notices(self) -> list[Html]:
        """What is missing, and what went wrong when the study was put together."""
        found = []
        missing = self.study.count(MISSING)
        if missing:
            more = el("p", "To go on: ", self.again())
            words = f"{missing} of {plural(len(self.study.runs), 'run')} missing."
            found.append(notice(words, more, True))
        if self.study.problems:
            items = [el("li", problem) for problem in self.study.problems]
            found.append(notice("Not everything could be measured or drawn:", el("ul", *items)))
        return found

    def again(self) -> Html:
        """The command that goes on with the study."""
        file = self.files.get(self.study.name) or self.study.file or self.study.name
        return el("code", f"perigeo-post study {file}")

    def finding(self, finding: Finding) -> Html:
        facts: list[tuple[str, Content]] = [
            ("The paper says", finding.paper or DASH),
            ("We find", finding.found or DASH),
            ("Verdict", verdict_mark(finding)),
        ]
        words = {True: "holds", False: "does not hold", None: "no data"}
        criteria = [join([el("code", text), f" {words[holds]}"]) for text, holds in finding.holds]
        if criteria:
            facts.append(("Criteria", join(criteria, "; ")))
        return el("div", el("h4", finding.title), facts_list(facts), paragraphs(finding.note),
                  class_="finding")  # fmt: skip

    def figure(self, figure: FigureRecord) -> Html:
        title = figure.title or readable(figure.name)
        caption: list[Content] = [el("p", el("b", title))]
        caption.append(paragraphs(figure.caption))
        picture = self.picture(figure)
        if figure.csv:
            caption.append(self.numbers(figure, title))
        return el("figure", picture, el("figcaption", *caption))

    def picture(self, figure: FigureRecord) -> Html:
        try:
            path = self.study.inside(figure.png)
            try:
                data = path.read_bytes()
                with Image.open(io.BytesIO(data)) as image:
                    width, height = image.size
                    density = float(image.info.get("dpi", (300.0, 300.0))[0]) or 300.0
                    if image.format != "PNG":
                        raise ResultError(f"{path}: is not a picture in PNG")
                    image.load()
            except (OSError, SyntaxError) as error:
                reason = getattr(error, "strerror", None) or "is not a picture that can be read"
                raise ResultError(f"{path}: {reason}") from error
        except ResultError as error:
            self.problems.append(str(error))
            return notice(f"The figure {figure.png} is missing or cannot be read.", None, True)
        scale = PIXELS_PER_INCH / density
        source = "data:image/png;base64," + base64.b64encode(data).decode("ascii")
        return el("img", src=source, alt=" ".join(figure.alt.split()),
                  width=max(1, round(width * scale)),
                  height=max(1, round(height * scale)))  # fmt: skip

    def numbers(self, figure: FigureRecord, title: str) -> Html:
        """The numbers drawn, where they are few; else the name of their file."""
        try:
            head, rows = read_table(self.study.inside(figure.csv))
        except ResultError as error:
            self.problems.append(str(error))
            return el("p", f"The numbers, {figure.csv}, are missing or cannot be read.",
                      class_="small soft")  # fmt: skip
        if len(rows) > LONGEST_TABLE or len(head) > WIDEST_TABLE:
            words = f"The numbers in it: {figure.csv} ({plural(len(rows), 'row')})."
            return el("p", words, class_="small soft")
        heads = [el("th", readable(name), scope="col", class_="n") for name in head]
        lines = [el("tr", *[el("td", csv_cell(text), class_="n") for text in row]) for row in rows]
        table = el("table", el("thead", el("tr", *heads)), el("tbody", *lines))
        return el("details", el("summary", "Numbers in this figure"),
                  box(table, f"Numbers in the figure {title}"))  # fmt: skip

    def values(self) -> Html | None:
        parts: list[Content] = []
        described: dict[str, str] = {}
        for name, title in self.study.series:
            values = values_of(self.study, self.study.runs_of(name))
            if not values.lines:
                continue
            if len(self.study.series) > 1:
                parts.append(el("h4", title or readable(name) or "Runs"))
            label = f"Measured values: {title or self.study.title}"
            first = headline(values, self.study.runs)
            parts.append(box(values_table(first), label))
            if len(first.lines) < len(values.lines):
                words = f"All {len(values.lines)} quantities"
                parts.append(el("details", el("summary", words),
                                box(values_table(values), label + ", all")))  # fmt: skip
            if values.without:
                words = "Without a value in these runs: " + ", ".join(values.without) + "."
                parts.append(el("p", words, class_="small soft"))
            described.update({line.name: line.description for line in values.lines})
        if not parts:
            return None
        if self.study.reasons():
            parts.append(el("details", el("summary", "Why values are missing"),
                            facts_list(self.study.reasons())))  # fmt: skip
        items = [(name, text) for name, text in described.items() if text]
        if items:
            parts.append(el("details", el("summary", "What the quantities mean"),
                            facts_list(items)))  # fmt: skip
        if self.study.csv:
            words = f"All values in SI units: {self.study.csv}."
            parts.append(el("p", words, class_="small soft"))
        return join([el("h3", "Measured values"), *parts])

    # ---- the runs of a study ----------------------------------------------------------------

    def runs(self) -> Html | None:
        if not self.study.runs:
            return None
        names = ("Run", "State", "Points", "Steps", "Threads", "Time", "Program", "Input")
        numeric = ("Points", "Steps", "Threads", "Time")
        heads = [el("th", n, scope="col", class_="n" if n in numeric else None) for n in names]
        bodies = []
        for name, title in self.study.series:
            lines = []
            if len(self.study.series) > 1:
                head = el("th", title or readable(name), colspan=len(names), scope="rowgroup")
                lines.append(el("tr", head, class_="group"))
            lines += [run_line(run) for run in self.study.runs_of(name)]
            bodies.append(el("tbody", *lines))
        table = el("table", el("thead", el("tr", *heads)), *bodies)
        failures = [self.failure(run) for run in self.study.runs if run.status == FAILED]
        return join(
            [el("h3", "Runs"), *failures, box(table, f"Runs: {self.study.title}"), self.inputs()]
        )

    def failure(self, run: RunRecord) -> Html:
        status = f" with exit status {run.exit_status}" if run.exit_status is not None else ""
        message = el("pre", run.message.strip() or "No message.")
        return el("div", el("p", f"{run_name(self.study, run)}: failed{status}."), message,
                  class_="notice", id=self.failures[self.study.name, run.id])  # fmt: skip

    def inputs(self) -> Html | None:
        """The namelists of the runs, folded; one that several runs share stands there once."""
        texts: dict[str, Html] = {}
        names: dict[str, list[str]] = {}
        for run in self.study.runs:
            text = texts.get(run.input) or self.input(run)
            if text is not None:
                texts[run.input] = text
                names.setdefault(run.input, []).append(run_name(self.study, run))
        if not texts:
            return None
        parts = [
            el("details", el("summary", "; ".join(names[path])), text)
            for path, text in texts.items()
        ]
        return el("details", el("summary", f"Inputs of the runs ({len(parts)})"), *parts)

    def input(self, run: RunRecord) -> Html | None:
        if not run.input:
            return None
        try:
            return el("pre", self.study.inside(run.input).read_text(encoding="utf-8").rstrip())
        except FileNotFoundError:
            # A run that was never started may have no input yet.
            if run.status != MISSING:
                self.problems.append(f"{self.study.folder / run.input}: not found")
        except (OSError, UnicodeDecodeError) as error:
            self.problems.append(f"{self.study.folder / run.input}: cannot be read ({error})")
        except ResultError as error:
            self.problems.append(str(error))
        return None


def verdict_mark(finding: Finding) -> Html:
    return el("span", finding.verdict, class_=f"verdict {CLASSES[finding.verdict]}")


def state_mark(run: RunRecord) -> Html:
    shape = {DONE: "agrees", FAILED: "differs", MISSING: "no-result"}[run.status]
    return el("span", run.status, class_=f"verdict {shape}")


def run_line(run: RunRecord) -> Html:
    """A run in the table of runs."""
    counts = (cell(run.points), cell(run.steps), cell(run.threads), duration(run.seconds))
    return el(
        "tr",
        el("th", run.label, scope="row"),
        el("td", state_mark(run)),
        *[el("td", text, class_="n") for text in counts],
        el("td", run.program_version or DASH, class_="w"),
        el("td", el("code", run.input_sha256[:12]) if run.input_sha256 else DASH),
    )


def run_name(study: Study, run: RunRecord) -> str:
    """The label of a run, after its series where there are several."""
    title = dict(study.series).get(run.series) or readable(run.series)
    return f"{title}: {run.label}" if len(study.series) > 1 else run.label


def values_table(values: Values) -> Html:
    """Quantities down, runs across."""
    heads = [el("th", "Quantity", scope="col")]
    heads += [el("th", label, scope="col", class_="n") for label in values.labels]
    lines = []
    for line in values.lines:
        unit = el("span", f" {line.unit}", class_="unit") if line.unit else None
        cells = [el("td", number_html(text), class_="n") for text in line.cells]
        lines.append(el("tr", el("th", line.name, unit, scope="row"), *cells))
    return el("table", el("thead", el("tr", *heads)), el("tbody", *lines), class_="values")


def csv_cell(text: str) -> Html:
    """A number of a CSV file with fewer digits; other text as it is."""
    try:
        return number_html(number(float(text), 5))
    except ValueError:
        return escape(text or DASH)


def machine_text(machine: Mapping[str, Value]) -> str:
    """Processor, cores and system in one line."""
    cores = machine.get("cores")
    words = [
        str(machine.get("processor") or ""),
        plural(int(cores), "core") if isinstance(cores, (int, float)) else "",
        str(machine.get("system") or ""),
    ]
    return ", ".join(word for word in words if word)


def join_words(*words: str) -> str:
    return ", ".join(word for word in words if word)


def plural(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
