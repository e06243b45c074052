"""How far a study has come: one line that is rewritten on a terminal, a line now and then else."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from .jobs import Job

SECONDS_BETWEEN_REWRITES = 0.2
SECONDS_BETWEEN_LINES = 30.0
BAR = 24  # characters
_STEP = re.compile(r"^step (\d+)/(\d+) ", re.MULTILINE)


class Progress:
    """Writes to a stream; says as much as its reader can use."""

    def __init__(self, name: str, stream: TextIO, slots: int) -> None:
        self.name = name
        self.stream = stream
        self.slots = slots
        self.terminal = stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self._shown = False
        self._last = 0.0
        self._looked = 0.0
        self._rate: float | None = None  # seconds of a unit of work

    def say(self, text: str) -> None:
        """A line that stays."""
        self.clear()
        print(text, file=self.stream, flush=True)

    def clear(self) -> None:
        """Take the line that is rewritten off the screen."""
        if self._shown:
            print("\r\x1b[K", end="", file=self.stream, flush=True)
            self._shown = False

    def _rewrite(self, text: str) -> None:
        width = shutil.get_terminal_size().columns
        print(f"\r{text[: width - 1]}\x1b[K", end="", file=self.stream, flush=True)
        self._shown = True
        self._last = time.monotonic()

    def checking(self, jobs: Sequence[Job]) -> None:
        """While the program looks at the inputs."""
        if self.terminal and time.monotonic() - self._last >= SECONDS_BETWEEN_REWRITES:
            self._rewrite(f"{self.name}: looking at {len(jobs)} inputs")

    def running(self, jobs: Sequence[Job]) -> None:
        """While runs are being made."""
        now = time.monotonic()
        if self._last == 0.0:
            self._last = now if not self.terminal else 0.0
        between = SECONDS_BETWEEN_REWRITES if self.terminal else SECONDS_BETWEEN_LINES
        if now - self._last < between:
            return
        self._look(jobs, now)
        self._last = now
        if self.terminal:
            self._rewrite(self._line(jobs, now))
        else:
            print(self._line(jobs, now), file=self.stream, flush=True)

    def ended(self, job: Job) -> None:
        """A run has come to its end; a terminal shows that in the bar."""
        if self.terminal or job.record is None:
            return
        what = "done" if job.status == "done" else "FAILED"
        took = duration(job.record.seconds)
        print(f"{self.name}: {job.id} {what} after {took}", file=self.stream, flush=True)

    def stopping(self, count: int) -> None:
        """A signal has come."""
        if count:
            self.say(f"{self.name}: stopping; waiting for checkpoints")

    def busy(self, what: str) -> None:
        """While nothing runs; only a terminal shows that."""
        if self.terminal:
            self._rewrite(f"{self.name}: {what}")

    # ---- how far -----------------------------------------------------------------------------

    def _look(self, jobs: Sequence[Job], now: float) -> None:
        """Find out how far the runs are, and how long a unit of work takes."""
        spent = work = 0.0
        for job in jobs:
            if job.status == "running":
                told, ago = steps_done(job.folder / f"{job.id}.log")
                elapsed = now - job.started
                guess = elapsed / (self._rate * job.weight) if self._rate else 0.0
                job.fraction = max(job.fraction, told, min(guess, told + 0.1, 0.99))
                if told > 0.0 and not job.restart:
                    spent += max(0.0, elapsed - ago)
                    work += told * job.weight
            elif job.status == "done" and not job.restart and job.record is not None:
                spent += job.record.seconds
                work += job.weight
        if work > 0.0:
            self._rate = spent / work
        elif self._rate is None:
            estimate = sum(job.estimate for job in jobs)
            total = sum(job.weight for job in jobs)
            self._rate = estimate / total if estimate > 0.0 and total > 0.0 else None

    def _line(self, jobs: Sequence[Job], now: float) -> str:
        total = sum(job.weight for job in jobs)
        part = sum(job.weight * job.fraction for job in jobs) / total
        ended = sum(job.status in ("done", "failed") for job in jobs)
        filled = int(part * BAR)
        failed = sum(job.status == "failed" for job in jobs)
        text = f"{self.name} [{'#' * filled}{'.' * (BAR - filled)}] {100 * part:3.0f} %"
        text += f"  {ended} of {len(jobs)} runs"
        if failed:
            text += f", {failed} failed"
        left = self._left(jobs)
        return text if left is None else f"{text}  about {duration(left)} left"

    def _left(self, jobs: Sequence[Job]) -> float | None:
        if self._rate is None:
            return None
        left = [job.work_left for job in jobs if job.status in ("waiting", "running")]
        if not left:
            return 0.0
        return self._rate * max(sum(left) / self.slots, *left, 0.0)


def steps_done(log: Path) -> tuple[float, float]:
    """Part of the run that its log tells of, and how many seconds ago that was."""
    try:
        with log.open("rb") as file:
            file.seek(max(0, log.stat().st_size - 4000))
            text = file.read().decode("utf-8", "replace")
        ago = max(0.0, time.time() - log.stat().st_mtime)
    except OSError:
        return 0.0, 0.0
    found = _STEP.findall(text)
    return (int(found[-1][0]) / max(1, int(found[-1][1])) if found else 0.0), ago


def duration(seconds: float) -> str:
    """1 h 05 min, 12 min 30 s, 45 s."""
    whole = max(0, round(seconds))
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    if whole >= 60:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole} s"
