"""What proofs share: their count, and how they build and run."""

import os
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class Count:
    passed = failed = 0

    def note(self, what, good, said=""):
        self.passed += good
        self.failed += not good
        print(f"  {'ok    ' if good else 'FAILED'}  {what}", flush=True)
        if not good:
            print("\n".join(f"          {line}" for line in said.splitlines()[-40:]), flush=True)


def make(folder, *words):
    """Build in a folder of its own with some settings and goals; return whether it worked."""
    words = [
        *os.environ.get("MAKE_COMMAND", "make").split(), "--no-print-directory", "BUILD=opt",
        "MARCH=", "PFUNIT_DIR=", f"build=build/{folder}", f"program=build/{folder}/perigeo", *words,
    ]  # fmt: skip
    if "-j" not in os.environ.get("MAKEFLAGS", ""):
        words.append(f"-j{os.cpu_count() or 1}")
    done = subprocess.run(words, cwd=ROOT, check=False, capture_output=True, text=True,
                          env={**os.environ, "MAKEFLAGS": ""})  # fmt: skip
    if done.returncode != 0:
        print(done.stdout[-2000:], done.stderr[-4000:])
    return done.returncode == 0


def names_of_suites(*settings):
    """Return the names of the unit suites that this machine can have."""
    asked = ["make", "-s", "--no-print-directory", *settings, "suites"]
    done = subprocess.run(asked, cwd=ROOT, check=True, capture_output=True, text=True,
                          env={**os.environ, "MAKEFLAGS": ""})  # fmt: skip
    return sorted(done.stdout.split())


def run_suite(program, environment):
    """Run a suite in a folder of its own; return exit status and what it said."""
    with tempfile.TemporaryDirectory(prefix="perigeo-proof-") as folder:
        record = Path(folder) / "record.txt"
        done = subprocess.run(
            [program, record, "1"], cwd=folder, check=False, text=True,
            capture_output=True, errors="replace", timeout=900, stdin=subprocess.DEVNULL,
            env={**os.environ, "PERIGEO_ROOT": str(ROOT), **environment},
        )  # fmt: skip
        told = record.read_text(errors="replace") if record.exists() else ""
    return done.returncode, done.stdout + done.stderr + told


def run(words, text, environment, limit=600):
    """Run a program on an input in a folder of its own; return exit status and what it said."""
    with tempfile.TemporaryDirectory(prefix="perigeo-proof-") as folder:
        (Path(folder) / "run.nml").write_text(text)
        done = subprocess.run(
            [*map(str, words), "run.nml"], cwd=folder, check=False, capture_output=True, text=True,
            errors="replace", timeout=limit, env={**os.environ, **environment},
        )  # fmt: skip
    return done.returncode, done.stdout + done.stderr
