"""The runs of a study on disk: what was run, how it ended, and where it stands now.

Each run has a folder runs/<id> with its input, its results and `run.json`, which says what was run
and how it ended. That file is written before a run starts and after it ends, so that a study that
was cut off at any moment finds out where every run stands.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from ..read.errors import OutputError, PostError, RequestError
from ..read.run import Run
from .program import Program

POLL = 0.03  # seconds between looks at the runs
PATIENCE = 120.0  # seconds that a run has for its checkpoint before it is killed
CALCULATION_FAILED = 4  # exit status of the program that another try would give again


@dataclass
class Record:
    """What run.json holds."""

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")

    identity: str
    program: str
    program_version: str
    input_sha256: str
    status: str  # running, done, failed, interrupted
    exit_status: int | None = None
    message: str = ""
    seconds: float = 0.0
    threads: int = 1
    points: int | None = None
    steps: int | None = None


_RECORD = TypeAdapter(Record)


@dataclass
class Job:
    """A run of the program; runs of the study that compute the same share one."""

    id: str
    folder: Path
    text: str  # of the input
    identity: str
    files: dict[str, Path]
    status: str = "waiting"  # then running, done, failed, interrupted
    reused: bool = False  # its results were there already
    restart: bool = False
    weight: float = 1.0
    estimate: float = 0.0  # seconds, as the program thinks
    record: Record | None = None
    process: subprocess.Popen[bytes] | None = None
    errors: IO[bytes] | None = None
    output: IO[bytes] | None = None
    started: float = 0.0
    before: float = 0.0  # seconds spent before it was interrupted
    fraction: float = 0.0  # done

    @property
    def input(self) -> Path:
        return self.folder / f"{self.id}.nml"

    @property
    def result(self) -> Path:
        return self.folder / f"{self.id}.h5"

    @property
    def lock(self) -> Path:
        """Held by the program that computes this run; its number stands in it."""
        return self.folder / ".lock"

    @property
    def record_path(self) -> Path:
        return self.folder / "run.json"

    @property
    def points(self) -> int:
        return (self.record.points if self.record else None) or 0

    @property
    def work_left(self) -> float:
        return self.weight * (1.0 - self.fraction)

    def read_record(self) -> Record | None:
        try:
            return _RECORD.validate_json(self.record_path.read_bytes())
        except (OSError, ValidationError):
            return None

    def keep(self, **changes: Any) -> None:
        """Write the record, with changes."""
        assert self.record is not None
        for key, value in changes.items():
            setattr(self.record, key, value)
        text = _RECORD.dump_json(self.record, indent=1).decode()
        write_whole(self.record_path, text + "\n")

    def write_input(self) -> str:
        """Put the input and its files into the folder; return the checksum of the input."""
        if not self.record_path.exists() and any(self.folder.glob(f"{self.id}*.h5")):
            raise OutputError(
                f"{self.folder} holds results that no study has made; choose another --output"
            )
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for name, source in self.files.items():
                (self.folder / name).write_bytes(source.read_bytes())
        except OSError as error:
            raise OutputError(f"cannot write {self.folder}: {error.strerror}") from error
        write_whole(self.input, self.text)
        return hashlib.sha256(self.text.encode()).hexdigest()

    def is_complete(self) -> bool:
        try:
            return self.result.is_file() and Run(self.result).complete
        except PostError:
            return False

    def remove_results(self) -> None:
        """Results of another input must not be taken for those of this one."""
        for path in self.folder.glob(f"{self.id}*"):
            if path != self.input and path.name not in self.files and path.is_file():
                path.unlink()

    def checkpoints(self) -> list[Path]:
        return sorted(self.folder.glob(f"{self.id}_checkpoint*.h5"))


def write_whole(path: Path, text: str) -> None:
    """Write a file so that it is never there in part."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_name(path.name + ".new")
        new.write_text(text, encoding="utf-8")
        os.replace(new, path)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error


def locked(path: Path) -> IO[str] | None:
    """Open a file and lock it; None where another process holds the lock.

    The lock goes with the processes that have the file open, however they end. On a system or a
    disk without locks there is no protection.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        return None
    except (ImportError, OSError):
        pass
    return file


@contextlib.contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Keep a second study out of the folder."""
    file = locked(folder / ".lock")
    if file is None:
        raise RequestError(f"another study is at work in {folder}")
    with file:
        yield


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


# ---- what is there already -------------------------------------------------------------------


def look(job: Job, program: Program | None, redo: bool = False) -> None:
    """Find out where a run stands: done, failed for good, to be continued, to be made.

    Without a program its version does not matter.
    """
    if program is not None and job.lock.exists():
        _stop_orphan(job)
    record = job.read_record()
    if record is None or record.identity != job.identity:
        return
    if program is not None and (redo or record.program != program.identity):
        return
    job.record = record
    # A run that was left alone when its study was killed may have come to its end.
    if record.status in ("done", "running", "interrupted") and job.is_complete():
        if record.status != "done":
            took = job.result.stat().st_mtime - job.record_path.stat().st_mtime
            job.keep(status="done", exit_status=0, seconds=record.seconds + max(0.0, took))
        job.status, job.reused, job.fraction = "done", True, 1.0
    elif record.status == "failed" and record.exit_status == CALCULATION_FAILED:
        job.status, job.reused, job.fraction = "failed", True, 1.0
    else:
        job.restart = bool(job.checkpoints()) and record.status != "failed"
        job.before = record.seconds if job.restart else 0.0


def _stop_orphan(job: Job) -> None:
    """End a run that was left behind by a study that was killed: it writes a checkpoint first."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        begun = time.monotonic()
        while time.monotonic() - begun < PATIENCE:
            file = locked(job.lock)
            if file is not None:
                file.close()
                return
            words = job.lock.read_text().split()
            if words and words[-1].isdigit():
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.kill(int(words[-1]), number)
            time.sleep(POLL)
    raise RequestError(f"the run in {job.folder} is still going and cannot be stopped")
