"""What the parts of `make sanitize` share: their count, and how they build and run."""

import os
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
HERE = Path(__file__).resolve().parent


class Count:
    passed = failed = 0

    def note(self, what, good, said=""):
        self.passed += good
        self.failed += not good
        print(f"  {'ok    ' if good else 'FAILED'}  {what}", flush=True)
        if not good:
            print("\n".join(f"          {line}" for line in said.splitlines()[-40:]), flush=True)


def make(folder, flags, *goals, more=()):
    """Build with some flags in a folder of its own; return whether it worked."""
    words = [
        *os.environ.get("MAKE_COMMAND", "make").split(), "--no-print-directory", "BUILD=opt",
        "MARCH=", "ALIGNED=0", f"FFLAGS={flags}", f"unit_flags={flags}", f"build=build/{folder}",
        f"program=build/{folder}/perigeo", *more, *goals,
    ]  # fmt: skip
    if "-j" not in os.environ.get("MAKEFLAGS", ""):
        words.append(f"-j{os.cpu_count() or 1}")
    done = subprocess.run(words, cwd=ROOT, check=False, capture_output=True, text=True,
                          env={**os.environ, "MAKEFLAGS": ""})  # fmt: skip
    if done.returncode != 0:
        print(done.stdout[-2000:], done.stderr[-4000:])
    return done.returncode == 0


def run(words, text, environment, limit=600):
    """Run a program on an input in a folder of its own; return exit status and what it said."""
    with tempfile.TemporaryDirectory(prefix="perigeo-sanitize-") as folder:
        (Path(folder) / "run.nml").write_text(text)
        done = subprocess.run(
            [*map(str, words), "run.nml"], cwd=folder, check=False, capture_output=True, text=True,
            errors="replace", timeout=limit, env={**os.environ, **environment},
        )  # fmt: skip
    return done.returncode, done.stdout + done.stderr
