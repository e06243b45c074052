"""Fixtures of the cases that run the program."""

import os
import subprocess
from pathlib import Path

import pytest
from case_files import uncontrolled

ROOT = Path(__file__).resolve().parents[2]
TIME_LIMIT = 600.0  # seconds for one run of the program


@pytest.fixture(scope="session")
def program():
    """Path of the program: $PERIGEO_BIN, else bin/perigeo of this repository."""
    path = Path(os.environ.get("PERIGEO_BIN", ROOT / "bin" / "perigeo")).resolve()
    if not path.is_file():
        pytest.fail(f"the program is not there: {path}; build it with make")
    return path


@pytest.fixture(scope="session")
def perigeo(program):
    """Return a function run(args, cwd, **environment): the program's CompletedProcess."""

    def run(args, cwd, timeout=TIME_LIMIT, **environment):
        return subprocess.run(
            [str(program), *map(str, args)],
            cwd=cwd,
            env={**os.environ, **environment},
            check=False,
            timeout=timeout,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
        )

    return run


@pytest.fixture(scope="session")
def run_case(perigeo):
    """Return a function run_case(case, folder, *options) that runs a case in a folder.

    `case` is the text of an input file, written to `folder`/run.nml, or the path of one.
    """

    def run(case, folder, *options, **environment):
        path = Path(case) if isinstance(case, Path) or "&" not in case else None
        if path is None:
            path = Path(folder) / "run.nml"
            path.write_text(uncontrolled(case))
        return perigeo([*options, path], folder, **environment)

    return run
