"""What comes out of a study: measures, the table of runs, figures, findings, study.json."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from ..draw.style import save_figure
from ..measure.export import plain, write_rows
from ..read.errors import PostError, ResultError
from ..read.run import Run
from .file import FigureSpec, Kinds, Study
from .findings import TableRow, evaluate
from .jobs import Job, cores, write_whole
from .plan import PlannedRun
from .record import (
    DONE,
    FAILED,
    FILE,
    MISSING,
    SCHEMA,
    SCHEMA_VERSION,
    FigureRecord,
    RunRecord,
    SeriesRecord,
    StudyRecord,
    read_record,
)
from .record import State as Status
from .types import Missing, StudyRun, Value

# What the numbers and verdicts of a study come from.
MEASURING = (
    "read/*.py",
    "measure/*.py",
    "study/parts.py",
    "study/measures.py",
    "study/growth.py",
    "study/control.py",
    "study/loads.py",
    "study/expressions.py",
    "study/findings.py",
)


@dataclass
class Outcome:
    """A study with its runs, and what went wrong on the way."""

    study: Study
    jobs: Mapping[str, Job]  # by the name of the run; runs that compute the same share one
    program_version: str
    rows: dict[str, dict[str, Value]] = field(default_factory=dict)  # measured, by run
    reasons: dict[str, dict[str, str]] = field(default_factory=dict)  # why not, by run
    runs: list[StudyRun] = field(default_factory=list)
    drawn: list[FigureSpec] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.study.name

    def status(self, run: PlannedRun) -> Status:
        found = self.jobs[run.id].status
        return found if found in (DONE, FAILED) else MISSING

    @property
    def distinct(self) -> list[Job]:
        """Every job once."""
        return list({id(job): job for job in self.jobs.values()}.values())


# ---- measures --------------------------------------------------------------------------------


def measure(outcome: Outcome, kinds: Kinds) -> None:
    """Take the measures of all runs that are done."""
    titles = dict(outcome.study.series)
    for planned in outcome.study.runs:
        job = outcome.jobs[planned.id]
        row: dict[str, Value] = {}
        if job.record is not None:
            row.update(points=job.record.points, steps=job.record.steps)
        outcome.rows[planned.id] = row
        if job.status != "done":
            continue
        run = Run(job.result)
        reasons: dict[str, str] = {}
        for name in planned.measures:
            one = kinds.measures[name]
            found: Mapping[str, Value | Missing] = {}
            reason = f"{name} does not give it"
            try:
                found = one.take(run, planned.state)
            except Exception as error:  # one measure must not cost the others
                reason = failure(error)
                outcome.problems.append(f"{planned.id}: {name} cannot be measured: {reason}")
            for column in one.columns:
                value = found.get(column, Missing(reason))
                row[column] = None if isinstance(value, Missing) else plain(value)
                if isinstance(value, Missing):
                    reasons[column] = value.reason.replace(f"{job.folder}{os.sep}", "")
        outcome.reasons[planned.id] = reasons
        outcome.runs.append(
            StudyRun(
                id=planned.id,
                label=planned.label,
                series=planned.series,
                parameters=planned.parameters,
                row=row,
                run=run,
                state=planned.state,
                series_title=titles.get(planned.series, ""),
            )
        )


def failure(error: Exception) -> str:
    """Why something could not be done; one that is not meant for users says its kind too."""
    return str(error) if isinstance(error, PostError) else f"{type(error).__name__}: {error}"


def _cells(outcome: Outcome, run: PlannedRun) -> dict[str, Value]:
    """A row of the table, without what has no value."""
    return {
        "study": outcome.name,
        "series": run.series,
        "run": run.id,
        "label": run.label,
        "status": outcome.status(run),
        **run.parameters,
        **outcome.rows.get(run.id, {}),
        "reasons": "; ".join(f"{k}: {v}" for k, v in outcome.reasons.get(run.id, {}).items()),
    }


def write_tables(outcome: Outcome, folder: Path) -> None:
    """NAME.csv, one row a run, and NAME_columns.csv, which says what its columns hold."""
    columns = outcome.study.columns
    rows = []
    for run in outcome.study.runs:
        cells = _cells(outcome, run)
        rows.append({name: cells.get(name) for name in columns})
    _write_csv(folder / f"{outcome.name}.csv", rows)
    about = [
        {"column": name, "unit": column.unit, "description": column.description}
        for name, column in columns.items()
    ]
    _write_csv(folder / f"{outcome.name}_columns.csv", about)


def _write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    new = path.with_name(path.name + ".new")
    write_rows(new, rows, {})
    os.replace(new, path)


# ---- figures ---------------------------------------------------------------------------------


def draw(outcome: Outcome, kinds: Kinds, folder: Path) -> None:
    """Every figure as PNG, PDF and CSV; one that cannot be drawn does not stop the others."""
    for spec in outcome.study.figures:
        runs = [run for run in outcome.runs if run.series in spec.series]
        try:
            if not runs:
                raise PostError("none of its runs is done")
            drawing = kinds.figures[spec.kind](runs, spec.options, outcome.study.columns)
            save_figure(drawing.figure, folder / f"{spec.name}.png")
            save_figure(drawing.figure, folder / f"{spec.name}.pdf")
            _write_csv(folder / f"{spec.name}.csv", drawing.rows)
            outcome.drawn.append(spec)
        except Exception as error:  # one figure must not cost the others
            outcome.problems.append(f"figure {spec.name} cannot be drawn: {failure(error)}")


# ---- study.json ------------------------------------------------------------------------------


def report(outcome: Outcome, fingerprint: str) -> StudyRecord:
    """The record of a study."""
    study = outcome.study
    rows = [
        TableRow(run.id, run.label, run.series, run.parameters, _cells(outcome, run))
        for run in study.runs
    ]
    complete = all(outcome.status(run) == DONE for run in study.runs)
    return StudyRecord(
        kind=SCHEMA,
        schema_version=SCHEMA_VERSION,
        name=study.name,
        title=study.title,
        question=study.question,
        file=study.path.name,
        base=study.base.name,
        created=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        fingerprint=fingerprint,
        program_version=outcome.program_version,
        machine=machine(),
        complete=complete and len(outcome.drawn) == len(study.figures),
        seconds=sum(job.record.seconds for job in outcome.distinct if job.record),
        series_listed=[SeriesRecord(name=name, title=title) for name, title in study.series],
        runs=[_run_entry(outcome, run) for run in study.runs],
        units={name: column.unit for name, column in study.columns.items()},
        descriptions={name: column.description for name, column in study.columns.items()},
        figures=[
            FigureRecord(
                name=spec.name,
                png=f"{spec.name}.png",
                pdf=f"{spec.name}.pdf",
                csv=f"{spec.name}.csv",
                title=spec.title,
                caption=spec.caption,
                alt=spec.alt,
            )
            for spec in outcome.drawn
        ],
        findings=[evaluate(finding, rows) for finding in study.findings],
        problems=list(outcome.problems),
        csv=f"{study.name}.csv",
    )


def _run_entry(outcome: Outcome, run: PlannedRun) -> RunRecord:
    job = outcome.jobs[run.id]
    place = f"runs/{job.id}/{job.id}"
    found = RunRecord(
        id=run.id,
        series=run.series,
        label=run.label,
        parameters=run.parameters,
        status=outcome.status(run),
        input=f"{place}.nml",
        result=f"{place}.h5",
        row=outcome.rows.get(run.id, {}),
        reasons=outcome.reasons.get(run.id, {}),
    )
    if job.record is not None:
        for name in ("exit_status", "message", "program_version", "input_sha256", "seconds",
                     "threads", "points", "steps"):  # fmt: skip
            setattr(found, name, getattr(job.record, name))
    return found


def write_report(record: StudyRecord, folder: Path) -> None:
    """Write study.json."""
    write_whole(folder / FILE, record.text())


def read_report(folder: Path) -> StudyRecord | None:
    """The record of an earlier call, None where it is not there or not ours."""
    try:
        return read_record(folder)
    except ResultError:
        return None


def machine() -> dict[str, Value]:
    """The processor, its cores and the system."""
    return {
        "processor": _processor(),
        "cores": cores(),
        "system": f"{platform.system()} {platform.machine()}".strip(),
    }


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        names = [line.partition(":")[2] for line in text.splitlines() if "model name" in line]
        if names:
            return names[0].strip()
    except OSError:
        pass
    try:
        done = subprocess.run(
            ["sysctl", "-n", "machdep.cpu.brand_string"],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode == 0 and done.stdout.strip():
            return done.stdout.strip()
    except OSError:
        pass
    return platform.processor() or platform.machine() or "unknown"


def measuring_files() -> list[Path]:
    """The sources from which the numbers of a study come."""
    package = Path(__file__).parents[1]
    return sorted(path for pattern in MEASURING for path in package.glob(pattern))


def fingerprint(outcome: Outcome) -> str:
    """Changes with anything that the tables depend on: the study, its results, what measures them.

    Not with how figures are drawn or what the command line says: --figures-only draws anew.
    """
    digest = hashlib.sha256(outcome.study.path.read_bytes())
    digest.update(f"{np.__version__} {matplotlib.__version__}".encode())
    for path in measuring_files():
        digest.update(path.read_bytes())
    for run in outcome.study.runs:
        job = outcome.jobs[run.id]
        record = job.record
        seen = [run.id, run.label, job.identity, job.status]
        if record is not None:
            seen += [record.program, record.message, record.input_sha256]
            seen += [f"{record.seconds}"]
        digest.update("\0".join(seen).encode())
    return digest.hexdigest()


def is_up_to_date(record: StudyRecord | None, mark: str, folder: Path) -> bool:
    """Whether tables and figures of an earlier call still hold."""
    if record is None or record.fingerprint != mark or record.problems:
        return False
    files = [record.csv, f"{record.name}_columns.csv"]
    files += [name for one in record.figures for name in (one.png, one.pdf, one.csv)]
    return all((folder / name).is_file() for name in files)
