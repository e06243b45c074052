"""Studies: a small file says what to vary, what to measure and what to draw; this does it.

doc/studies.md shows how to write one.
"""

from __future__ import annotations

import difflib
import fnmatch
import os
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from ..read.errors import RequestError
from .file import Kinds, Study, load_study
from .inputs import Inputs
from .jobs import Job, cores, look, only_one
from .program import Program, find_program
from .progress import Progress, duration
from .record import StudyRecord
from .results import (
    Outcome,
    draw,
    fingerprint,
    is_up_to_date,
    measure,
    read_report,
    report,
    write_report,
    write_tables,
)
from .runner import Runner, Stopped
from .toml import StudyError

__all__ = ["Stopped", "StudyError", "StudyOptions", "known_kinds", "run_study"]

RUN_FAILED = 4  # exit status, as the program has it for a calculation that failed
WIDTH = 96

# Options of figures that are needed, and those that name columns of the table of runs.
_NEEDED = {"plot": ("x", "y"), "history": ("y",)}
_NAMING_COLUMNS = {
    "plot": ("x", "y", "by", "target", "slope"),
    "curves": ("by",),
    "history": ("by",),
}


@dataclass(frozen=True)
class StudyOptions:
    """How a study is to be done."""

    output: Path | None = None  # default: results/<name>
    jobs: int | None = None  # runs at a time; default: as many as there are cores
    program: Path | None = None
    dry_run: bool = False
    redo: bool = False
    only: Sequence[str] = ()
    figures_only: bool = False


def known_kinds() -> Kinds:
    """The measures and kinds of figures that a study file may name."""
    from . import figures as study_figures
    from . import measures as study_measures

    return Kinds(
        measures=study_measures.MEASURES,
        figures=study_figures.FIGURES,
        options=study_figures.FIGURE_OPTIONS,
        needed=_NEEDED,
        columns=_NAMING_COLUMNS,
    )


def run_study(
    path: Path,
    options: StudyOptions | None = None,
    kinds: Kinds | None = None,
    stream: TextIO | None = None,
) -> int:
    """Do a study and say what came out; returns the exit status: 0, or 4 where a run failed.

    Raises StudyError for mistakes in the file, Stopped after a signal.
    """
    options = options or StudyOptions()
    stream = stream or sys.stdout
    kinds = kinds or known_kinds()

    def folder_of(name: str) -> Path:
        return options.output or Path("results") / name

    inputs = Inputs(
        lambda: find_program(options.program, path), folder_of if options.figures_only else None
    )
    study = load_study(path, kinds, inputs)
    chosen = _chosen(study, options.only)
    program = None if options.figures_only else inputs.program
    folder = folder_of(study.name)
    with only_one(folder):
        inputs.keep(folder)
        return _do(study, kinds, options, chosen, program, folder, stream)


def _do(
    study: Study,
    kinds: Kinds,
    options: StudyOptions,
    chosen: set[str],
    program: Program | None,
    folder: Path,
    stream: TextIO,
) -> int:
    jobs = make_jobs(study, folder)
    distinct = list({id(job): job for job in jobs.values()}.values())
    wanted = [job for job in distinct if any(jobs[one] is job for one in chosen)]
    for job in distinct:
        look(job, program, redo=options.redo and job in wanted)
    progress = Progress(study.name, stream, options.jobs or cores())
    if program is not None:
        runner = Runner(program, options.jobs, progress)
        runner.check(wanted)
        if options.dry_run:
            _tell_plan(study, jobs, progress)
            return RUN_FAILED if any(job.status == "failed" for job in wanted) else 0
        runner.run(wanted)

    outcome = Outcome(study, jobs, _version(program, distinct))
    mark = fingerprint(outcome)
    data = read_report(folder)
    if data is None or options.redo or options.figures_only or not is_up_to_date(
        data, mark, folder
    ):  # fmt: skip
        progress.busy("measuring")
        measure(outcome, kinds)
        write_tables(outcome, folder)
        progress.busy("drawing")
        draw(outcome, kinds, folder)
        data = report(outcome, mark)
        write_report(data, folder)
    _tell(data, distinct, folder, progress)
    bad = any(job.status == "failed" for job in wanted) or bool(data.problems)
    return RUN_FAILED if bad else 0


def _chosen(study: Study, only: Sequence[str]) -> set[str]:
    """Names of the runs to be made; names and patterns like m_* are given."""
    names = [run.id for run in study.runs]
    if not only:
        return set(names)
    found: set[str] = set()
    for pattern in only:
        matching = fnmatch.filter(names, pattern)
        if not matching:
            near = difflib.get_close_matches(pattern, names, n=1)
            hint = f", did you mean '{near[0]}'?" if near else ""
            raise RequestError(f"no run is called '{pattern}'{hint}; there are: {', '.join(names)}")
        found.update(matching)
    return found


def make_jobs(study: Study, folder: Path) -> dict[str, Job]:
    """A job for every run; runs that would compute the same share the first one's."""
    first: dict[str, Job] = {}
    jobs: dict[str, Job] = {}
    for run in study.runs:
        identity = run.identity
        if identity not in first:
            place = folder / "runs" / run.id
            text = run.input_text(study.name, study.title, place.as_posix())
            first[identity] = Job(run.id, place, text, identity, run.files)
        jobs[run.id] = first[identity]
    return jobs


def _version(program: Program | None, jobs: Sequence[Job]) -> str:
    if program is not None:
        return program.version
    versions = sorted({job.record.program_version for job in jobs if job.record is not None})
    return ", ".join(versions) or "unknown"


# ---- words -----------------------------------------------------------------------------------


def _tell_plan(study: Study, jobs: Mapping[str, Job], progress: Progress) -> None:
    """What would be done."""
    progress.say(f"{study.name}: {study.title}")
    seen: set[int] = set()
    todo: list[Job] = []
    for run in study.runs:
        job = jobs[run.id]
        record = job.record
        size = f"{record.points} points, {record.steps} steps" if record and record.points else ""
        if id(job) in seen:
            words = f"the same as {job.id}"
        elif job.status == "done":
            words = f"{size}: done"
        elif job.status == "failed":
            words = f"failed: {record.message if record else ''}"
        else:
            todo.append(job)
            words = f"{size}: to be {'continued' if job.restart else 'run'}"
            words += f", about {job.estimate:.1f} s"
        seen.add(id(job))
        progress.say(f"  {run.id:<24} {run.label}\n{'':27}{words}")
    total = sum(job.estimate for job in todo)
    longest = max((job.estimate for job in todo), default=0.0)
    left = max(longest, total / progress.slots)
    progress.say(f"  {len(todo)} of {len(seen)} runs to be made, about {duration(left)}")


def _tell(data: StudyRecord, jobs: Sequence[Job], folder: Path, progress: Progress) -> None:
    """What came out of the study, where it is, and what did not work."""
    say = progress.say
    say(f"{data.name}: {data.title}")
    made = [job for job in jobs if job.status == "done" and not job.reused]
    reused = sum(job.status == "done" and job.reused for job in jobs)
    seconds = sum(job.record.seconds - job.before for job in made if job.record is not None)
    words = [f"{len(made)} computed ({duration(seconds)} of one core)"] if made else []
    words += [f"{reused} there already"] if reused else []
    failed = sum(job.status == "failed" for job in jobs)
    words += [f"{failed} failed"] if failed else []
    missing = len(jobs) - len(made) - reused - failed
    words += [f"{missing} missing"] if missing else []
    say(f"  runs      {', '.join(words) or 'none'}")
    for number, figure in enumerate(data.figures):
        place = os.path.join(folder, figure.png)
        say(f"  {'figures' if number == 0 else '':<9} {place}, .pdf, .csv")
    say(f"  table     {os.path.join(folder, data.csv)}")
    if data.findings:
        say("  findings")
    for finding in data.findings:
        say(f"    {finding.verdict}: {finding.title}")
        says = (("paper", finding.paper), ("claim", finding.claim), ("here", finding.found))
        for name, text in says:
            if text:
                say(_wrapped(f"      {name:<6}", text))
    reasons = data.reasons()
    if reasons:
        say("  no value")
    for what, why in reasons:
        say(_wrapped("    ", f"{what}: {why}"))
    for run in data.runs:
        if run.status == "failed":
            say(_wrapped("  FAILED    ", f"{run.id} ({run.label}): {run.message}"))
    for problem in data.problems:
        say(_wrapped("  PROBLEM   ", problem))
    if any(job.status == "failed" and job.reused for job in jobs):
        say("  A run that failed is not tried again with the same input; --redo does so.")


def _wrapped(start: str, text: str) -> str:
    return textwrap.fill(
        text, WIDTH, initial_indent=start, subsequent_indent=" " * len(start),
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
