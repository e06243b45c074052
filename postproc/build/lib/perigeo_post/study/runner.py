"""Makes the runs of a study, as many at a time as cores allow."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence

from ..read.errors import PostError, RequestError
from .jobs import POLL, Job, Record, cores, locked
from .program import Check, Program, ending, message_of, read_check
from .progress import Progress

BIG = 200_000  # points above which a run gets all cores, and runs alone
POINTS_A_THREAD = 3000  # fewer than these are not worth a thread of their own
LOCAL_WORK = 30.0  # work at a point, in bonds
SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]


class Stopped(PostError):
    """The study was stopped by a signal; what was done is kept."""

    def __init__(self, number: int, message: str) -> None:
        super().__init__(message)
        self.exit_status = 128 + number


class Runner:
    """Makes the runs that are not there, and stops them in good order when a signal comes."""

    def __init__(self, program: Program, jobs: int | None, progress: Progress) -> None:
        self.program = program
        self.cores = cores()
        self.slots = max(1, jobs or self.cores)
        self.progress = progress
        self.signal: int | None = None
        self._signals = 0

    @contextlib.contextmanager
    def _catching(self) -> Iterator[None]:
        old = {number: signal.signal(number, self._note) for number in SIGNALS}
        try:
            yield
        finally:
            for number, handler in old.items():
                signal.signal(number, handler)

    def _note(self, number: int, _frame: object) -> None:
        self.signal = number
        self._signals += 1

    # ---- checks ------------------------------------------------------------------------------

    def check(self, jobs: Sequence[Job]) -> None:
        """Let the program look at the inputs; a run whose input is wrong has failed."""
        checking = [job for job in jobs if job.status == "waiting"]
        for job in checking:
            if job.record is None or not job.restart:
                job.record = Record(
                    job.identity, self.program.identity, self.program.version, "", "failed"
                )
            job.record.input_sha256 = job.write_input()
        with self._catching():
            self._all(
                sorted(checking, key=lambda job: job.id),
                lambda job, _others: self._start(job, ["--check"], 1),
                self._checked,
                lambda: self.progress.checking(checking),
            )
        self._stop_if_asked(checking, "nothing was run")
        self.progress.clear()

    def _checked(self, job: Job, status: int, words: str) -> None:
        assert job.record is not None
        assert job.output is not None
        job.output.seek(0)
        found = read_check(job.output.read().decode("utf-8", "replace"))
        job.output.close()
        if self.signal is not None:
            job.status = "waiting"
        elif status != 0 or found is None:
            message = message_of(words, [str(job.input)]) or ending(status)
            self._failed(job, status, message)
        else:
            job.status = "waiting"
            job.record.points, job.record.steps = found.points, found.steps
            job.weight = weight(found)
            job.estimate = found.seconds

    # ---- runs --------------------------------------------------------------------------------

    def run(self, jobs: Sequence[Job]) -> None:
        """Make all runs that wait, the longest first. Raises Stopped."""
        todo = sorted((job for job in jobs if job.status == "waiting"), key=lambda job: -job.weight)
        if not todo:
            return
        with self._catching():
            self._all(todo, self._begin, self._ended, lambda: self.progress.running(todo))
        self.progress.clear()
        done = sum(job.status == "done" for job in jobs)
        self._stop_if_asked(todo, f"{done} of {len(jobs)} runs are done")

    def _begin(self, job: Job, others: Sequence[Job]) -> bool:
        """Start a run if there is room for it beside the others."""
        assert job.record is not None
        if job.points > BIG:
            if any(other.status == "running" for other in others):
                return False
            threads = self.cores
        else:
            waiting = sum(other.status in ("waiting", "running") for other in others)
            # Cores are spare only where there are fewer runs than cores.
            spare = self.cores // min(max(1, waiting), self.slots)
            threads = max(1, min(spare, job.points // POINTS_A_THREAD))
        if not job.restart:
            job.remove_results()
        job.keep(
            status="running", threads=threads, exit_status=None, message="", seconds=job.before
        )
        return self._start(job, ["--quiet", "--restart" if job.restart else "--force"], threads)

    def _start(self, job: Job, arguments: list[str], threads: int) -> bool:
        job.errors = tempfile.TemporaryFile()  # noqa: SIM115
        job.output = tempfile.TemporaryFile()  # noqa: SIM115
        command = [str(self.program.path), *arguments, "--threads", str(threads), str(job.input)]
        job.lock.unlink(missing_ok=True)
        lock = locked(job.lock)
        assert lock is not None
        place = lock.fileno()

        def name_itself() -> None:  # in the run, so that it never holds the lock without a name
            os.write(place, f"{os.getpid()}\n".encode())

        try:
            job.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=job.output,
                stderr=job.errors,
                env={**os.environ, "OMP_WAIT_POLICY": "passive"},
                pass_fds=[place],
                preexec_fn=name_itself,
            )
        except OSError as error:
            raise RequestError(f"{self.program.path} cannot be run: {error.strerror}") from error
        finally:
            lock.close()
        job.status, job.started = "running", time.monotonic()
        return True

    def _ended(self, job: Job, status: int, words: str) -> None:
        assert job.record is not None
        if job.output is not None:
            job.output.close()
        seconds = job.before + time.monotonic() - job.started
        if status == 0 and job.is_complete():
            job.status, job.fraction = "done", 1.0
            job.keep(status="done", exit_status=0, message="", seconds=seconds)
            for path in job.checkpoints():
                path.unlink()
            self.progress.ended(job)
        elif self.signal is not None and (status < 0 or status in (130, 143)):
            job.status = "interrupted"
            job.keep(status="interrupted", exit_status=status, seconds=seconds)
        elif job.restart and status in (2, 5):
            # The checkpoint cannot be used: from the beginning.
            job.restart, job.before, job.status = False, 0.0, "waiting"
        else:
            message = message_of(words, [str(job.input)]) or ending(status)
            job.record.seconds = seconds
            self._failed(job, status, message)
            self.progress.ended(job)

    def _failed(self, job: Job, status: int, message: str) -> None:
        job.status, job.fraction = "failed", 1.0
        job.keep(status="failed", exit_status=status, message=message)

    # ---- the pool ----------------------------------------------------------------------------

    def _all(
        self,
        jobs: Sequence[Job],
        begin: Callable[[Job, Sequence[Job]], bool],
        ended: Callable[[Job, int, str], None],
        show: Callable[[], None],
    ) -> None:
        """Begin the jobs in their order, as many at a time as there is room for, and wait."""
        asked = 0
        waiting = list(jobs)
        running: list[Job] = []
        try:
            while running or (waiting and self.signal is None):
                while waiting and self.signal is None and len(running) < self.slots:
                    if any(job.points > BIG for job in running):
                        break
                    if not begin(waiting[0], jobs):
                        break
                    running.append(waiting.pop(0))
                if self._signals > asked:
                    asked = self._signals
                    self.progress.stopping(len(running))
                    for job in running:
                        if job.process is not None and job.process.poll() is None:
                            job.process.send_signal(
                                signal.SIGTERM if asked == 1 else signal.SIGKILL
                            )
                show()
                time.sleep(POLL)
                for job in [one for one in running if _exit_of(one) is not None]:
                    running.remove(job)
                    self._take(job, ended)
                    if job.status == "waiting" and ended == self._ended:
                        waiting.insert(0, job)
        except BaseException:
            for job in running:
                if job.process is not None and job.process.poll() is None:
                    job.process.terminate()
            for job in running:
                if job.process is not None:
                    job.process.wait()
            raise

    def _take(self, job: Job, ended: Callable[[Job, int, str], None]) -> None:
        assert job.errors is not None
        job.errors.seek(0)
        words = job.errors.read(100_000).decode("utf-8", "replace")
        job.errors.close()
        status = _exit_of(job)
        job.process = None
        job.lock.unlink(missing_ok=True)
        ended(job, 0 if status is None else status, words)

    def _stop_if_asked(self, jobs: Sequence[Job], where: str) -> None:
        if self.signal is None:
            return
        self.progress.clear()
        raise Stopped(self.signal, f"stopped; {where}; the same command goes on from here")


def _exit_of(job: Job) -> int | None:
    return None if job.process is None else job.process.poll()


def weight(check: Check) -> float:
    """Work of a run: bonds and points times steps."""
    return max(1.0, (check.bonds + LOCAL_WORK * check.points) * check.steps)
