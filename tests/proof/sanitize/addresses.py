"""The sanitizers of addresses, leaks and undefined behaviour: suites, tiny runs, cases, faults.

The arrays of the program come straight from the sanitizer (`ALIGNED=0`), not from `pd_memory`: it
would cut off what lies around them. OpenMP is gfortran's own; one thread, for the sanitizer need
not know about its meetings, and `races` is there for those.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from common import ROOT, make, names_of_suites, run, run_suite

HERE = Path(__file__).resolve().parent
FOLDER = "sanitize-address"
CHECKS = "-g -fsanitize=address,undefined -fno-omit-frame-pointer"
# Of what each suite is linked with all modules are under the checks; a suite itself is quicker
# compiled than run.
FLAGS, SUITE_FLAGS = f"-O1 {CHECKS}", f"-O0 {CHECKS}"
FOUND = 66  # exit status of a program in which a sanitizer has found something
CASES = (
    "test_bodies.py", "test_exit_status.py", "test_loads.py", "test_result_files.py",
    "test_restart.py", "test_stability.py", "test_stages.py",
)  # fmt: skip
QUICK_SUITES = ("test_pd_cloud", "test_pd_geometry", "test_pd_lattice", "test_pd_result")
# What a fault of faults.f90 must be called.
FAULTS = {
    "beyond the end": "heap-buffer-overflow",
    "after its release": "heap-use-after-free",
    "lost": "detected memory leaks",
    "overflow": "signed integer overflow",
}


def settings(reports=None, leaks=True):
    """Environment under which a finding ends a program; with `reports` it is written there.

    Suites are not asked for leaks: gfortran does not free all that an expression in an assert has
    made, and it is the suite's, not the program's.
    """
    both = f"exitcode={FOUND}" + (f":log_path={reports}" if reports else "")
    return {
        "ASAN_OPTIONS": f"{both}:detect_leaks={int(leaks)}",
        "UBSAN_OPTIONS": f"{both}:halt_on_error=1:print_stacktrace=1",
        "OMP_NUM_THREADS": "1",
    }


def check(count, inputs, quick=False):
    """Build with the sanitizers, and run what there is."""
    plants(count)
    suites = QUICK_SUITES if quick else names_of_suites("ALIGNED=0")
    goals = ["program", *(f"build/{FOLDER}/unit/{name}" for name in suites)]
    settings_of_make = ("ALIGNED=0", f"FFLAGS={FLAGS}", f"unit_flags={SUITE_FLAGS}")
    built = make(FOLDER, *settings_of_make, *goals)
    count.note("build with the sanitizers of addresses and undefined behaviour", built)
    if not built:
        return
    folder = ROOT / "build" / FOLDER
    program = folder / "perigeo"
    for name, text in inputs.items():
        status, said = run([program, "--threads", "1"], text, settings())
        count.note(f"addresses: {name}", status == 0 and "Sanitizer" not in said, said)
    for name in suites:
        status, said = run_suite(folder / "unit" / name, settings(leaks=False))
        count.note(f"addresses: {name}", status == 0 and "Sanitizer" not in said, said)
    if not quick:
        for name in CASES:
            run_cases(count, program, name)


def plants(count):
    """Faults planted on purpose are found, each under its name; without one nothing is."""
    with tempfile.TemporaryDirectory(prefix="perigeo-plant-") as scratch:
        program = Path(scratch) / "faults"
        words = ["gfortran", *FLAGS.split(), "-o", program, HERE / "faults.f90"]
        subprocess.run(words, cwd=scratch, check=True)
        for fault, called in {"none": None, **FAULTS}.items():
            done = subprocess.run(
                [program, fault], check=False, capture_output=True, text=True,
                env={**os.environ, **settings()},
            )  # fmt: skip
            if called is None:
                count.note("no fault, nothing found", done.returncode == 0, done.stderr)
            else:
                good = done.returncode == FOUND and called in done.stderr
                count.note(f"a fault planted on purpose is found: {fault}", good, done.stderr)


def run_cases(count, program, name):
    """Run a file of cases; what a sanitizer finds counts also where a case does not look."""
    with tempfile.TemporaryDirectory(prefix="perigeo-sanitize-") as folder:
        reports = Path(folder) / "found"
        words = [sys.executable, "-m", "pytest", "-q", "--color=no", "-p", "no:cacheprovider",
                 f"tests/cases/{name}"]  # fmt: skip
        done = subprocess.run(
            words, cwd=ROOT, check=False, capture_output=True, text=True, errors="replace",
            env={**os.environ, "PERIGEO_BIN": str(program), **settings(reports)},
        )  # fmt: skip
        found = "".join(path.read_text() for path in Path(folder).glob("found.*"))
    good = done.returncode == 0 and not found
    count.note(f"addresses: cases of {name}", good, done.stdout + found)
