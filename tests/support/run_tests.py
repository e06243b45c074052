"""Run the whole test suite: unit tests, tests of perigeo-post, cases that run the program.

    .venv/bin/python tests/support/run_tests.py --build opt

The last line is the verdict on all of them, ``N passed, N failed``. What could not be built or
started counts as failed. `make test` calls this.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SUITE_LIMIT = 600.0  # seconds for one unit test program; it counts as hanging after that
# Folders of pytest, in how many parts each is run; parts run side by side where there are cores.
PYTEST_SUITES = {"tests/cases": 2, "postproc/tests": 2}
TEST_NAME = re.compile(r"^\s*@test\s*\n(?:\s*(?:!.*)?\n)*\s*subroutine\s+(\w+)", re.I | re.M)


@dataclass
class Count:
    """How many tests passed, failed and were skipped."""

    passed: int = 0
    failed: int = 0
    skipped: int = 0

    def add(self, other):
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped

    def __str__(self):
        text = f"{self.passed} passed, {self.failed} failed"
        return text + (f", {self.skipped} skipped" if self.skipped else "")


@dataclass
class Failure:
    """A failed unit test: its name, where it failed, and what it said."""

    test: str
    place: str = ""
    notes: list = field(default_factory=list)


def say(text=""):
    print(text, flush=True)


def call_make(command, build, *goals, **options):
    """Call make with the settings of this run."""
    # The jobserver of the make above is out of reach from here.
    flags = os.environ.get("MAKEFLAGS", "").split()
    kept = [flag for flag in flags if not flag.startswith(("-j", "--jobserver"))]
    words = [*command.split(), "--no-print-directory", f"-j{os.cpu_count() or 1}"]
    return subprocess.run(
        [*words, f"BUILD={build}", *goals],
        cwd=ROOT,
        env=dict(os.environ, MAKEFLAGS=" ".join(kept)),
        check=False,
        **options,
    )


def make(command, build, *goals):
    """Call make; return whether it succeeded."""
    return call_make(command, build, *goals).returncode == 0


# ------------------------------------------------------------------------------- unit tests


def ending(status):
    """Say how a program ended that did not end as it should."""
    if status is None:
        return f"no end within {SUITE_LIMIT:.0f} s"
    if status < 0:
        return f"killed by signal {-status}"
    return f"ended early with exit status {status}"


def run_program(words, folder):
    """Run one unit test program; return its exit status (None: out of time) and what it said."""
    environment = dict(os.environ, PERIGEO_ROOT=str(ROOT))
    try:
        done = subprocess.run(
            words,
            cwd=folder,
            env=environment,
            check=False,
            timeout=SUITE_LIMIT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
    except subprocess.TimeoutExpired as expired:
        return None, (expired.stdout or b"").decode(errors="replace")
    return done.returncode, done.stdout.decode(errors="replace")


def crash(test, status, output):
    """Return the failure of a test that took its program down."""
    return Failure(test, "", [ending(status), *output.strip().splitlines()[:12]])


def read_record(path):
    """Return what the small runner recorded: tests begun, those passed, failures, end reached."""
    begun, passed, failures, ended = [], [], [], False
    for line in path.read_text(errors="replace").splitlines() if path.exists() else []:
        word, _, rest = line.partition(" ")
        if word == "start":
            begun.append(rest)
        elif word == "pass":
            passed.append(rest)
        elif word == "fail":
            failures.append(Failure(begun[-1]))
        elif word == "at" and failures:
            failures[-1].place = rest
        elif word == "note" and failures:
            failures[-1].notes.append(rest)
        elif word == "end":
            ended = True
    return begun, passed, failures, ended


def run_own(program, tests, folder):
    """Run a suite built with the small runner; go on behind every test that crashes."""
    passed, failures, number = 0, [], 1
    while number <= len(tests):
        record = folder / f"record-{number}.txt"
        status, output = run_program([program, record, str(number)], folder)
        begun, good, bad, ended = read_record(record)
        passed += len(good)
        failures += bad
        if ended and status == 0:
            break
        finished = {*good, *(failure.test for failure in bad)}
        if not begun or begun[-1] in finished:
            # It broke before or between tests: the rest has not run.
            rest = tests[number - 1 + len(begun) :] or ["the end of the suite"]
            failures += [crash(test, status, output) for test in rest]
            break
        failures.append(crash(begun[-1], status, output))
        number += len(begun)
    return passed, failures


def pfunit_failures(output, suite):
    """Return the failures that pFUnit printed, the first of each test."""
    failures = {}
    lines = [line.strip() for line in output.splitlines()]
    for i, line in enumerate(lines):
        if line not in ("Failure", "Error") or i + 4 >= len(lines) or lines[i + 1] != "in:":
            continue
        test = lines[i + 2].rsplit(".", 1)[-1]
        place = lines[i + 4].strip("[]") if lines[i + 3] == "Location:" else ""
        notes = []
        for note in lines[i + 5 :]:
            if not note:
                break
            notes.append(note)
        failures.setdefault(test, Failure(test, place or suite, notes))
    return failures


def run_pfunit(program, tests, folder):
    """Run a suite built with pFUnit; one program a test where the suite crashes as a whole."""
    status, output = run_program([program], folder)
    if re.search(rf"^\s*\({len(tests)} tests?\)|^Tests run: {len(tests)},", output, re.M):
        failures = list(pfunit_failures(output, program.name).values())
        return len(tests) - len(failures), failures
    failures = []
    for test in tests:
        status, output = run_program([program, "-f", f".{test}"], folder)
        # The filter takes every name that begins like this one.
        found = pfunit_failures(output, program.name)
        if test in found:
            failures.append(found[test])
        elif not re.search(r"^\s*\(\d+ tests?\)|^Tests run: [1-9]", output, re.M):
            failures.append(crash(test, status, output))
    return len(tests) - len(failures), failures


def unit_folder(build):
    """Return where make puts the unit test programs."""
    return Path("build") / build / ("unit-pfunit" if os.environ.get("PFUNIT_DIR") else "unit")


def build_units(command, build):
    """Build every suite; return the names of those that could not be built."""
    # A suite that does not compile must not keep the others from running.
    if make(command, build, "-k", "units"):
        return set()
    # The program of an earlier build may still be there, so make is asked for each suite.
    names = [suite.stem for suite in unit_suites(command, build)]
    return {name for name in names if not make(command, build, "-q", unit_folder(build) / name)}


def unit_suites(command, build):
    """Return the suites in the order of their names; make knows what this machine cannot have."""
    found = call_make(command, build, "-s", "suites", stdout=subprocess.PIPE, text=True).stdout
    folder = ROOT / "tests" / "unit"
    return [next(folder.glob(f"*/{name}.pf")) for name in sorted(found.split())]


def run_units(command, build, with_pfunit, unbuilt):
    """Run every suite in tests/unit."""
    count = Count()
    folder = ROOT / unit_folder(build)
    suites = unit_suites(command, build)
    if not suites:
        say("tests/unit: no suites")
        return Count(failed=1)
    for suite in suites:
        tests = TEST_NAME.findall(suite.read_text())
        program, scratch = folder / suite.stem, folder / f"{suite.stem}.run"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        begin = time.monotonic()
        if suite.stem in unbuilt:
            say(f"  {suite.stem}: FAILED, not built; what the compiler said stands above")
            count.add(Count(failed=max(len(tests), 1)))
            continue
        run = run_pfunit if with_pfunit else run_own
        passed, failures = run(program, tests, scratch)
        taken = time.monotonic() - begin
        say(f"  {suite.stem}: {Count(passed, len(failures))} ({taken:.1f} s)")
        for failure in failures:
            say(f"    FAILED {failure.test}  {failure.place}")
            for note in failure.notes:
                say(f"      {note}")
        count.add(Count(passed, len(failures)))
    return count


# ------------------------------------------------------------------------------- pytest


def parts_of(path, count):
    """Return the test files of a folder in parts that take about as long."""
    files = sorted((ROOT / path).glob("**/test_*.py"))
    return [[str(file.relative_to(ROOT)) for file in files[k::count]] for k in range(count)]


def run_pytest(files, name, build):
    """Run test files with pytest, what they say into a file of that name; count from the report."""
    if not files:
        return Count(failed=1)
    program = ROOT / "bin" / ("perigeo-debug" if build == "debug" else "perigeo")
    environment = dict(os.environ, PERIGEO_BIN=str(program), PERIGEO_ROOT=str(ROOT))
    environment.setdefault("MPLBACKEND", "Agg")
    report = name.with_suffix(".xml")
    report.unlink(missing_ok=True)
    report.parent.mkdir(parents=True, exist_ok=True)
    words = [sys.executable, "-m", "pytest", "-q", "--color=no", *files, f"--junitxml={report}"]
    with name.open("w") as output:
        status = subprocess.run(
            words,
            cwd=ROOT,
            env=environment,
            check=False,
            stdout=output,
            stderr=subprocess.STDOUT,
        ).returncode
    if not report.exists():
        return Count(failed=1)
    suite = next(ElementTree.parse(report).getroot().iter("testsuite"))
    total, failures, errors, skipped = (
        int(suite.get(name, "0")) for name in ("tests", "failures", "errors", "skipped")
    )
    bad = min(failures + errors, total)
    if status != 0 and bad == 0:
        bad, total = 1, total + 1
    return Count(total - bad - skipped, bad, skipped)


def run_suites(build):
    """Run all folders of pytest, as many parts at a time as there are cores; return the counts."""
    folder = ROOT / "build" / build
    counts = {path: Count() for path in PYTEST_SUITES}
    say(f"\n{' and '.join(PYTEST_SUITES)}, side by side: some minutes")
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        running = []
        for path, count in PYTEST_SUITES.items():
            for k, files in enumerate(parts_of(path, count)):
                name = folder / f"{path.replace('/', '-')}-{k + 1}.log"
                running.append((path, name, pool.submit(run_pytest, files, name, build)))
        for path, name, part in running:
            counts[path].add(part.result())
            say(f"\nTests of {path}")
            say(name.read_text(errors="replace").rstrip() if name.exists() else "no tests")
    return counts


# ------------------------------------------------------------------------------- all


def main():
    """Build, run the three parts, print the verdict."""
    parser = argparse.ArgumentParser(description="Run the whole test suite.")
    parser.add_argument("--make", default="make", help="the make to call")
    parser.add_argument("--build", default="opt", choices=("opt", "debug"))
    options = parser.parse_args()
    with_pfunit = bool(os.environ.get("PFUNIT_DIR"))
    parts = {}

    say(f"Build ({options.build})")
    parts["build of the program"] = Count()
    if not make(options.make, options.build, "program"):
        parts["build of the program"] = Count(failed=1)
    unbuilt = build_units(options.make, options.build)

    say(f"\nUnit tests ({'pFUnit' if with_pfunit else 'the small runner'})")
    parts["tests/unit"] = run_units(options.make, options.build, with_pfunit, unbuilt)
    parts.update(run_suites(options.build))

    say()
    total = Count()
    for name, count in parts.items():
        total.add(count)
        if count != Count():
            say(f"{name}: {count}")
    say(str(total))
    return 1 if total.failed or not total.passed else 0


if __name__ == "__main__":
    sys.exit(main())
