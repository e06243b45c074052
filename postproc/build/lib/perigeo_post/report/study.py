"""What the page shows of one study, with the files that the study names."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PIL import Image

from ..read.errors import ResultError
from ..study.types import Value
from .data import FAILED, MISSING, FigureRecord, Material, RunRecord, Study, read_table
from .values import Values, headline, plural, readable, values_of

PIXELS_PER_INCH = 135.0  # on the screen: a figure of one column takes about half the text
LONGEST_TABLE = 60  # rows of the numbers of a figure that the page shows
WIDEST_TABLE = 12


@dataclass(frozen=True)
class Picture:
    """A figure as an address that holds it, and its size in the page [CSS pixels]."""

    source: str
    width: int
    height: int


@dataclass(frozen=True)
class ShownFigure:
    """A figure with what could be read of it: the numbers themselves or a remark about them."""

    record: FigureRecord
    title: str
    picture: Picture | None
    head: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    remark: str = ""


@dataclass(frozen=True)
class ShownValues:
    """Measured values of one series: those of the first sight, and all."""

    name: str
    title: str
    first: Values
    all: Values


class Section:
    """One study; what it names and cannot be read is in `problems`."""

    def __init__(self, study: Study, place: str, file: str) -> None:
        self.study = study
        self.place = place
        self.file = file  # of the study, to go on with it
        self.problems: list[str] = []
        self.figures = [self.figure(record) for record in study.figures]
        self.values = [
            values for name, title in study.series for values in self.series(name, title)
        ]
        self.inputs = self.shared_inputs()
        self.failed = [run for run in study.runs if run.status == FAILED]

    def name(self, run: RunRecord) -> str:
        """The label of a run, after its series where there are several."""
        title = dict(self.study.series).get(run.series) or readable(run.series)
        return f"{title}: {run.label}" if len(self.study.series) > 1 else run.label

    def meanings(self) -> list[tuple[str, str]]:
        """What the measured quantities mean."""
        found = {line.name: line.description for one in self.values for line in one.all.lines}
        return [(name, text) for name, text in found.items() if text]

    def figure(self, record: FigureRecord) -> ShownFigure:
        title = record.title or readable(record.name)
        picture = self.picture(record)
        if not record.csv:
            return ShownFigure(record, title, picture)
        try:
            head, rows = read_table(self.study.inside(record.csv))
        except ResultError as error:
            self.problems.append(str(error))
            remark = f"The numbers, {record.csv}, are missing or cannot be read."
            return ShownFigure(record, title, picture, remark=remark)
        if len(rows) > LONGEST_TABLE or len(head) > WIDEST_TABLE:
            remark = f"The numbers in it: {record.csv} ({plural(len(rows), 'row')})."
            return ShownFigure(record, title, picture, remark=remark)
        return ShownFigure(record, title, picture, [readable(name) for name in head], rows)

    def picture(self, record: FigureRecord) -> Picture | None:
        try:
            path = self.study.inside(record.png)
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
            return None
        scale = PIXELS_PER_INCH / density
        return Picture(
            "data:image/png;base64," + base64.b64encode(data).decode("ascii"),
            max(1, round(width * scale)),
            max(1, round(height * scale)),
        )

    def series(self, name: str, title: str) -> list[ShownValues]:
        """The values of a series; nothing where there are none."""
        values = values_of(self.study, self.study.runs_of(name))
        first = headline(values, self.study.runs)
        return [ShownValues(name, title, first, values)] if values.lines else []

    def shared_inputs(self) -> list[tuple[list[str], str]]:
        """The namelists of the runs, each once, with the names of the runs that share it."""
        texts: dict[str, str] = {}
        names: dict[str, list[str]] = {}
        for run in self.study.runs:
            text = texts[run.input] if run.input in texts else self.input(run)
            if text is not None:
                texts[run.input] = text
                names.setdefault(run.input, []).append(self.name(run))
        return [(names[path], text) for path, text in texts.items()]

    def input(self, run: RunRecord) -> str | None:
        if not run.input:
            return None
        try:
            return self.study.inside(run.input).read_text(encoding="utf-8").rstrip()
        except FileNotFoundError:
            # A run that was never started may have no input yet.
            if run.status != MISSING:
                self.problems.append(f"{self.study.folder / run.input}: not found")
        except (OSError, UnicodeDecodeError) as error:
            self.problems.append(f"{self.study.folder / run.input}: cannot be read ({error})")
        except ResultError as error:
            self.problems.append(str(error))
        return None


@dataclass(frozen=True)
class Origin:
    """With which versions of the program, on which machines and when all was computed."""

    versions: Sequence[str]
    machines: Sequence[str]
    period: str  # empty where it is not known


def origin(material: Material) -> Origin:
    """Where the results come from."""
    studies = material.studies
    dates = sorted(study.created[:10] for study in studies if study.created)
    return Origin(
        versions=sorted({version for study in studies for version in study.versions}),
        machines=sorted({machine_text(study.machine) for study in studies} - {""}),
        period=" to ".join(dict.fromkeys((dates[0], dates[-1]))) if dates else "",
    )


def machine_text(machine: Mapping[str, Value]) -> str:
    """Processor, cores and system in one line."""
    cores = machine.get("cores")
    words = [
        str(machine.get("processor") or ""),
        plural(int(cores), "core") if isinstance(cores, (int, float)) else "",
        str(machine.get("system") or ""),
    ]
    return ", ".join(word for word in words if word)
