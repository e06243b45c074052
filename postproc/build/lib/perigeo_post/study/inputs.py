"""Inputs of runs: what the program makes of the base of a study and the settings of a run.

The program reads the base, puts the settings in, checks all, and prints the values as used. Only
that one regular form is read here; what else a namelist may look like is the program's business.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from ..read.errors import RequestError
from ..read.file import decoded
from .jobs import write_whole
from .program import NAME, Program, ending

UNSET = "unset"  # as the value of a key: it is taken out
KEPT = "inputs.json"  # beside the results: figures are drawn anew without the program

_TEXTS = TypeAdapter(dict[str, str])
_LONGEST = 60  # bytes of a setting that a message of the program shows


class InputError(RequestError):
    """Settings that cannot be made, or what the program says about an input: a line a mistake."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = list(lines)
        super().__init__("\n".join(self.lines))


# ---- the printed form ------------------------------------------------------------------------


@dataclass
class Values:
    """An input as the program prints it: the groups in their order, values as written.

    A key that begins with ! says a default that has no effect, as a comment.
    """

    groups: list[tuple[str, dict[str, str]]]

    def text(self, leave_out: tuple[str, ...] = ()) -> str:
        """The file; without the "group.key" named."""
        lines = []
        for name, entries in self.groups:
            lines.append(f"&{name}")
            lines += [
                f"  {key} = {value}"
                for key, value in entries.items()
                if f"{name}.{key}" not in leave_out
            ]
            lines.append("/")
        return "\n".join(lines) + "\n"

    def numbers(self, group: str, key: str) -> list[float]:
        """The numbers of a key; empty where there are none."""
        found = [entries[key] for name, entries in self.groups if name == group and key in entries]
        return [float(word) for value in found for word in value.split(",")]

    def put(self, group: str, key: str, value: Any) -> None:
        """Replace a value in the first group of this name, or add it."""
        entries = next((entries for name, entries in self.groups if name == group), None)
        if entries is None:
            entries = {}
            self.groups.append((group, entries))
        entries[key] = written(value)


def read_values(text: str) -> Values:
    """Take apart what the program prints."""
    found = Values([])
    for line in text.splitlines():
        key, equals, value = line.strip().partition(" = ")
        if line.startswith("&"):
            found.groups.append((line[1:].strip(), {}))
        elif equals:
            found.groups[-1][1][key] = value
    return found


def written(value: Any) -> str:
    """A value as the program reads it."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        if re.search(r"[\n\r]", value):
            raise InputError(["a text must stand on one line"])
        return "'" + value.replace("'", "''") + "'"
    raise InputError([f"is neither a number nor a text: {value!r}"])


def unquoted(word: str) -> str:
    """The text that stands in quotes."""
    return word[1:-1].replace(word[0] * 2, word[0])


# ---- settings --------------------------------------------------------------------------------


def setting_of(place: str, value: Any) -> str:
    """What --set is given for "group.key" or "group.NAME.key" of a study file.

    A group: False takes it out, a key: "unset" does.
    """
    parts = place.lower().split(".")
    if not 1 <= len(parts) <= 3 or not all(re.fullmatch(r"[a-z0-9_]+", p) for p in parts):
        raise InputError(["must be group.key, group.NAME.key, or a group to take out"])
    name = ".".join(parts)
    if value is False and len(parts) < 3:
        return f"{name}="
    if len(parts) == 1:
        raise InputError([f"is a group: only false, which takes it out; found: {value!r}"])
    if value == UNSET:
        return f"{name}="
    values = list(value) if isinstance(value, (list, tuple)) else [value]
    if not values:
        raise InputError(["an empty list is no value"])
    return f"{name}={', '.join(written(item) for item in values)}"


def said_of(setting: str, line: str) -> str | None:
    """What a message of the program says of a setting; None where it is about something else."""
    shown = setting.encode()[:_LONGEST].decode("latin-1").rstrip(" ")
    shown = re.sub(r"[^ -~]", "?", shown) + ("..." if len(setting.encode()) > _LONGEST else "")
    start = f"--set {shown}: "
    return line[len(start) :] if line.startswith(start) else None


# ---- the program -----------------------------------------------------------------------------


class Inputs:
    """Asks the program for inputs, each once.

    `find` gives the program when it is needed first. `kept_in`, where it is given, tells for the
    name of a study the folder where inputs of earlier times are kept: for those it is not needed.
    """

    def __init__(
        self, find: Callable[[], Program], kept_in: Callable[[str], Path] | None = None
    ) -> None:
        self._find = find
        self._kept_in = kept_in
        self._program: Program | None = None
        self._texts: dict[str, str] = {}

    @property
    def program(self) -> Program:
        if self._program is None:
            self._program = self._find()
        return self._program

    def begin(self, study: str) -> None:
        """Take up what is kept of this study."""
        if self._kept_in is not None:
            try:
                self._texts = _TEXTS.validate_json((self._kept_in(study) / KEPT).read_bytes())
            except (OSError, ValidationError):
                self._texts = {}

    def keep(self, folder: Path) -> None:
        """Write the inputs for a later time."""
        text = json.dumps(self._texts, indent=1) + "\n"
        path = folder / KEPT
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_whole(path, text)

    def values(self, base: Path, folder: Path, settings: Sequence[str]) -> Values:
        """The values as used; files of points are looked for beside the base and in `folder`.

        Raises InputError with what the program says, a line a mistake, without the path of `base`.
        """
        digest = hashlib.sha256(base.read_bytes())
        digest.update("\0".join(["", *settings]).encode())
        key = digest.hexdigest()
        if key not in self._texts:
            self._texts[key] = self._printed(base.resolve(), folder, settings)
        return read_values(self._texts[key])

    def _printed(self, base: Path, folder: Path, settings: Sequence[str]) -> str:
        path = self.program.path
        words = [word for setting in settings for word in ("--set", setting)]
        try:
            done = subprocess.run(
                [str(path), "--print-input", *words, str(base)],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=60,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RequestError(f"{path} cannot be run: {error}") from error
        if done.returncode != 0:
            text = done.stderr.decode("utf-8", "replace")
            lines = [re.sub(rf"^{NAME}: (?:error: )?", "", one) for one in text.splitlines()]
            lines = [one.replace(f"{base}, ", "").replace(f"{base}: ", "") for one in lines if one]
            raise InputError(lines or [ending(done.returncode)])
        return decoded(done.stdout)
