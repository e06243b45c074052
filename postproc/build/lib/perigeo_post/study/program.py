"""The program perigeo as studies need it: found, asked for its version, asked about an input."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..read.errors import RequestError

NAME = "perigeo"
BUILT = Path("bin") / NAME


@dataclass(frozen=True)
class Program:
    """The program and what tells one version of it from another."""

    path: Path
    version: str  # as --version prints it
    identity: str  # with a checksum where the version does not say which program it is


@dataclass(frozen=True)
class Check:
    """What `perigeo --check` says about an input."""

    points: int
    steps: int
    bonds: float
    seconds: float  # estimated, one thread


def find_program(given: Path | None, study: Path) -> Program:
    """The program: the one given, $PERIGEO_BIN, bin/perigeo above the study file, or on PATH."""
    environment = os.environ.get("PERIGEO_BIN")
    if given is not None or environment:
        path = given if given is not None else Path(str(environment))
        origin = "--program" if given is not None else "PERIGEO_BIN"
        if not path.is_file():
            raise RequestError(f"the program is not there: {path} ({origin})")
        return _asked(path)
    for folder in study.resolve().parents:
        if (folder / BUILT).is_file():
            return _asked(folder / BUILT)
    on_path = shutil.which(NAME)
    if on_path:
        return _asked(Path(on_path))
    raise RequestError(
        f"the program {NAME} is not there: neither {BUILT} in a folder above {study}, nor on PATH; "
        "build it with make, or name it with --program or PERIGEO_BIN"
    )


def _asked(path: Path) -> Program:
    path = path.resolve()
    try:
        done = subprocess.run(
            [str(path), "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RequestError(f"{path} cannot be run: {error}") from error
    version = done.stdout.decode("utf-8", "replace").strip()
    if done.returncode != 0 or not version.startswith(f"{NAME} "):
        raise RequestError(f"{path} is not {NAME}: its --version says '{version[:80]}'")
    version = version.splitlines()[0]
    identity = version
    # A version that names a commit is that commit; one with changes, or outside git, may be any.
    if "dirty" in version or "unknown" in version:
        identity += f", sha256 {hashlib.sha256(path.read_bytes()).hexdigest()[:16]}"
    return Program(path, version, identity)


def read_check(text: str) -> Check | None:
    """The figures in the output of --check; None where they are not there."""

    def first(pattern: str) -> str | None:
        match = re.search(rf"^  {pattern}", text, re.MULTILINE)
        return match.group(1) if match else None

    points, steps = first(r"points +(\d+)"), first(r"(?:steps|increments) +(\d+)")
    if points is None or steps is None:
        return None
    bonds = first(r"bonds +([\d.Ee+]+)")
    time = re.search(r"^  run time +about ([\d.]+) (s|min|h)\b", text, re.MULTILINE)
    factor = {"s": 1.0, "min": 60.0, "h": 3600.0}
    return Check(
        points=int(points),
        steps=int(steps),
        bonds=float(bonds) if bonds else 0.0,
        seconds=float(time.group(1)) * factor[time.group(2)] if time else 0.0,
    )


def message_of(text: str, paths: Iterable[str] = ()) -> str:
    """What the program wrote to standard error, in one line, without its own name and paths."""
    lines = []
    for line in text.splitlines():
        line = re.sub(rf"^{NAME}: (?:error: )?", "", line.strip())
        for path in paths:
            line = line.replace(f"{path}, ", "").replace(f"{path}: ", "").replace(path, "")
        if line:
            lines.append(line)
    if len(lines) > 6:
        lines = [*lines[:5], f"and {len(lines) - 5} more"]
    return "; ".join(lines)


def ending(status: int) -> str:
    """Words for the way a run ended that gave no message."""
    if status < 0:
        hint = ", perhaps for want of memory" if status == -9 else ""
        return f"ended by signal {-status}{hint}"
    return f"exit status {status} without a message"
