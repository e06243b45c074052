"""Build one faulty program at a time and run the tests that could notice.

All modules are in a shared library, so a fault costs one compilation and one link. Each worker
has a folder of its own with its library; program and suites find it by LD_LIBRARY_PATH. The program
for several ranks has another library, which is built where all other checks have passed.
"""

from __future__ import annotations

import os
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from faults import Fault

ROOT = Path(__file__).resolve().parents[3]
BUILD = ROOT / "build" / "mutants"
RANKS_BUILD = ROOT / "build" / "mutants-mpi"
COMPILE_LIMIT = 120  # seconds


@dataclass
class Check:
    """A suite or a group of cases: a command, what it needs, and how long it takes."""

    name: str
    words: list[str]
    modules: frozenset[str] = frozenset()  # what it is linked with; empty: everything
    kind: str = "unit"
    seconds: float = 0.0  # of a processor

    @property
    def limit(self) -> int:
        """Seconds of a processor after which it counts as hanging."""
        return 5 + int(5.0 * self.seconds)


@dataclass
class Finding:
    """What became of one fault: `caught`, `alive`, `same` (object code) or `no compilation`."""

    fault: Fault
    verdict: str
    by: str = ""
    how: str = ""
    seconds: float = 0.0


def run_bounded(words: list[str], folder: Path, env: dict[str, str], limit: int):
    """Run a command with all that it starts; return its exit status (None: too long) and output.

    Each process gets so many seconds of a processor, all together 20 times as many by the clock.
    """
    with subprocess.Popen(
        ["sh", "-c", 'ulimit -t "$0" && exec "$@"', str(limit), *words],
        cwd=folder,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    ) as process:
        try:
            output, _ = process.communicate(timeout=60.0 + 20.0 * limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return None, process.communicate()[0]
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    return process.returncode, output


def children_seconds() -> float:
    """Return the seconds of a processor that commands have taken until now."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def first_failure(check: Check, status: int | None, output: str) -> str:
    """Return how a check noticed, or nothing if it passed."""
    if status in (None, -signal.SIGKILL, -signal.SIGXCPU):
        return f"no end within {check.limit} s"
    if status < 0:
        return f"signal {-status}"
    lines = output.splitlines()
    if check.kind == "unit":
        names = [line.split(" ", 1)[1] for line in lines if line.startswith("start ")]
        failed = [k for k, line in enumerate(lines) if line.startswith("fail")]
        if failed:
            begun = [line for line in lines[: failed[0]] if line.startswith("start ")]
            return begun[-1][6:]
        if status or "end" not in lines:
            return f"exit status {status} in {names[-1] if names else 'the beginning'}"
        return ""
    if status:
        told = [line for line in lines if line.startswith(("FAILED", "ERROR"))] or lines[-1:]
        return told[0][:160] if told else f"exit status {status}"
    return ""


def suites(folder: Path) -> list[Check]:
    """Return the unit suites with the modules that each is linked with."""
    found = []
    for line in (folder / "unit" / "depends.mk").read_text().splitlines():
        target, _, needed = line.partition(":")
        name = Path(target).name
        if name.startswith("test_") and not name.endswith(".o"):
            modules = frozenset(Path(word).stem for word in needed.split())
            found.append(Check(name, [str(ROOT / target)], modules))
    return found


def case_groups(groups: dict[str, list[str]], chosen: str, kind: str = "case") -> list[Check]:
    """Return groups of pytest cases that run the program, those that an expression chooses."""
    pytest = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--color=no"]
    return [
        Check(name, [*pytest, "-k", chosen, *(f"tests/cases/{f}" for f in files)], kind=kind)
        for name, files in groups.items()
    ]


class Library:
    """A library of all modules in the folder of a worker, one of which may have a fault."""

    def __init__(self, build: Path, name: str, folder: Path, env: dict[str, str]) -> None:
        self.build = build
        self.name = name
        self.folder = folder
        self.env = env
        (folder / build.name).mkdir()
        words = shlex.split((build / "flags").read_text())
        # the folder of the modules comes last for -J: what a fault compiles must not go there
        self.words = [w for w in words if w not in (f"-J{build.relative_to(ROOT)}", "-Wall")]
        self.objects = {o.stem: o for o in sorted(build.glob("*.o")) if o.stem != "perigeo"}
        self.healthy: dict[str, bytes] = {}

    def compile(self, path: str, text: str) -> bytes | None:
        """Compile a source file under its own name; return the object file, None if it fails."""
        source = self.folder / path
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text(text)
        target = self.object_of(path)
        target.unlink(missing_ok=True)
        words = [*self.words, f"-I{self.build}", f"-J{self.build.name}", "-w", "-c", path]
        words += ["-o", str(target)]
        status, _ = run_bounded(words, self.folder, self.env, COMPILE_LIMIT)
        return target.read_bytes() if status == 0 else None

    def object_of(self, path: str) -> Path:
        """Return the object file of a source with a fault."""
        return self.folder / self.build.name / f"{Path(path).stem}.o"

    def make(self, fault: Fault | None) -> str:
        """Make the library with a fault; return `no compilation` or `same` where there is none."""
        objects = dict(self.objects)
        if fault:
            text = (ROOT / fault.path).read_text()
            if fault.path not in self.healthy:
                self.healthy[fault.path] = self.compile(fault.path, text) or b""
            compiled = self.compile(fault.path, fault.plant(text))
            if compiled is None:
                return "no compilation"
            if compiled == self.healthy[fault.path]:
                return "same"
            objects[Path(fault.path).stem] = self.object_of(fault.path)
        library = self.folder / self.name
        library.unlink(missing_ok=True)
        words = [*self.words, "-shared", f"-Wl,-soname,{self.name}", "-o", str(library)]
        words += map(str, objects.values())
        # libraries stand at the end of a command
        words += [w for w in self.words if w.startswith(("-l", "-L"))]
        status, output = run_bounded(words, ROOT, self.env, COMPILE_LIMIT)
        if status:
            raise RuntimeError(f"the library cannot be linked:\n{output}")
        return ""


class Workshop:
    """The folder of one worker."""

    def __init__(self, number: int) -> None:
        self.folder = BUILD / f"worker-{os.getpid()}-{number}"
        (self.folder / "run").mkdir(parents=True)
        self.env = {
            **os.environ,
            "LD_LIBRARY_PATH": str(self.folder),
            "PERIGEO_ROOT": str(ROOT),
            "PERIGEO_BIN": str(BUILD / "perigeo"),
            "MALLOC_PERTURB_": "165",  # what is not set has no number that happens to be right
            "OMP_NUM_THREADS": "1",
            "OMP_WAIT_POLICY": "passive",
            "MPLBACKEND": "Agg",
            "TMPDIR": str(self.folder / "run"),
        }
        self.library = Library(BUILD, "libperigeo.so", self.folder, self.env)
        self.ranks = Library(RANKS_BUILD, "libperigeo-mpi.so", self.folder, self.env)

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def build(self) -> None:
        """Make both libraries, without a fault."""
        self.library.make(None)
        self.ranks.make(None)

    def run(self, check: Check) -> tuple[str, float]:
        """Run a check; return how it failed (nothing: it passed) and the processor's seconds."""
        scratch = self.folder / "run"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir()
        words = list(check.words)
        if check.kind != "unit":
            words.append(f"--basetemp={scratch / 'cases'}")
        begin = children_seconds()
        folder = scratch if check.kind == "unit" else ROOT
        status, output = run_bounded(words, folder, self.env, check.limit)
        return first_failure(check, status, output), children_seconds() - begin

    def judge(self, fault: Fault, checks: list[Check]) -> Finding:
        """Build with a fault and run the checks until one notices."""
        begin = time.monotonic()
        finding = Finding(fault, self.library.make(fault) or "alive")
        if finding.verdict == "alive":
            for check in in_order(Path(fault.path).stem, checks):
                if check.kind == "ranks" and self.ranks.make(fault):
                    continue  # not another program: the library is that of an earlier fault
                how, _ = self.run(check)
                if how:
                    finding.verdict, finding.by, finding.how = "caught", check.name, how
                    break
        finding.seconds = time.monotonic() - begin
        return finding


def in_order(module: str, checks: list[Check]) -> list[Check]:
    """Return the checks that a module can change: its own suite, the other suites, the cases."""
    concerned = [c for c in checks if not c.modules or module in c.modules]
    units = [c for c in concerned if c.kind == "unit"]
    units.sort(key=lambda c: (c.name != f"test_{module}", c.seconds))
    return units + [c for c in concerned if c.kind != "unit"]
