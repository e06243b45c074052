"""Type doc/first_footing.md in a fresh clone, as its reader does, and time every command.

    .venv/bin/python tools/first_footing.py [--publish]

for `make first-footing`. Nothing but the page says what is typed: its input goes into the file
that it names, its commands are given in their order. --publish puts the table between the marks
of the page. What is cloned is what is committed.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from time import monotonic

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "doc" / "first_footing.md"
BEGIN, END = "<!-- first-footing: begin -->", "<!-- first-footing: end -->"
WIDEST = 58  # letters of a command in the table


@dataclass
class Timed:
    """A command with what it took [s]."""

    command: str
    clock: float
    processor: float


def inputs(page: str) -> dict[str, str]:
    """Return what the page has its reader save: the text of each file, by name."""
    found = {}
    parts = re.split(r"^```fortran\n(.*?)^```", page, flags=re.M | re.S)
    for before, text in zip(parts[::2], parts[1::2]):
        found[re.findall(r"`(\w+\.nml)`", before)[-1]] = text
    return found


def commands(page: str) -> list[str]:
    """Return the commands of the page, in their order."""
    outside = re.sub(r"^```.*?^```", "", page, flags=re.M | re.S)
    return re.findall(r"^    (\S.*)$", outside, re.M)


def type_it(given: list[str], files: dict[str, str], address: str, folder: Path) -> list[Timed]:
    """Give commands in a folder, with an address for ADDRESS; return what each took.

    A `cd` counts for those behind it. A file is saved before the first command that names it.
    """
    timed = []
    # A make around this one is nothing to that of the reader. Packages come from where they are
    # published, as on a fresh machine.
    surroundings = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL")}
    surroundings["PIP_NO_CACHE_DIR"] = "1"
    for command in given:
        if command.startswith("cd "):
            folder = folder / command.removeprefix("cd ")
            continue
        for name, text in files.items():
            if name in command:
                (folder / name).write_text(text, encoding="utf-8")
        print("  " + command, flush=True)
        begin, before = monotonic(), os.times()
        typed = command.replace("ADDRESS", address)
        done = subprocess.run(typed, shell=True, cwd=folder, env=surroundings)
        after = os.times()
        if done.returncode != 0:
            sys.exit(f"first_footing: exit status {done.returncode}: {command}")
        processor = sum(after[2:4]) - sum(before[2:4])  # of children: user and system
        timed.append(Timed(command, monotonic() - begin, processor))
    return timed


def spelled(seconds: float) -> str:
    """Return a time in words."""
    whole = max(1, round(seconds))
    return f"{whole // 60} min {whole % 60} s" if whole >= 60 else f"{whole} s"


def machine(load: tuple[float, float]) -> str:
    """Return the system, its cores, the date, and how busy they were before and after."""
    release = Path("/etc/os-release")
    text = release.read_text(encoding="utf-8") if release.exists() else ""
    named = re.search(r'^PRETTY_NAME="?([^"\n]+)', text, re.M)
    system = named[1] if named else platform.system()
    cores = os.cpu_count()
    words = f"{system}, {cores} cores, {date.today().isoformat()}; programs that wanted a core"
    return f"{words}: {load[0]:.0f} before, {load[1]:.0f} at the end."


def table(timed: list[Timed], load: tuple[float, float]) -> str:
    """Return what stands between the marks."""
    rows = [f"Timed by `make first-footing` in a fresh clone: {machine(load)}", ""]
    rows += ["| command | on the clock | processor |", "|---|---|---|"]
    for one in timed:
        name = one.command if len(one.command) <= WIDEST else one.command[: WIDEST - 4] + " ..."
        rows.append(f"| `{name}` | {spelled(one.clock)} | {spelled(one.processor)} |")
    clock, processor = (sum(getattr(t, name) for t in timed) for name in ("clock", "processor"))
    rows.append(f"| all | {spelled(clock)} | {spelled(processor)} |")
    return "\n".join(rows)


def with_table(page: str, text: str) -> str:
    """Return the page with another table between its marks."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}"


def main() -> None:
    """Type, time, print, and publish where that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--publish", action="store_true", help="put the table into the page")
    publish = parser.parse_args().publish
    page = PAGE.read_text(encoding="utf-8")
    before = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="perigeo-first-") as folder:
        timed = type_it(commands(page), inputs(page), str(ROOT), Path(folder))
    text = table(timed, (before, os.getloadavg()[0]))
    print("\n" + text)
    if publish:
        PAGE.write_text(with_table(page, text), encoding="utf-8")


if __name__ == "__main__":
    main()
