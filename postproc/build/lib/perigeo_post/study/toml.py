"""TOML files, and mistakes in them with their place."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..read.errors import PostError
from ..read.file import decoded
from .expressions import nearest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Key = tuple[Any, ...]  # names of tables, numbers within lists of tables, name of the key

_NAME = r"""(?:"[^"\n]*"|'[^'\n]*'|[\w-]+)"""
_HEADER = re.compile(rf"^\s*(\[\[?)\s*({_NAME}(?:\s*\.\s*{_NAME})*)\s*\]")
_ENTRY = re.compile(rf"^\s*({_NAME}(?:\s*\.\s*{_NAME})*)\s*=")


class StudyError(PostError):
    """What is wrong in a study file: one line a mistake."""

    exit_status = 2

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(self.problems))


class Problems:
    """The mistakes found so far: what is wrong, where, what was found, what is allowed."""

    def __init__(self, file: str, lines: Mapping[Key, int] | None = None) -> None:
        self.file = file
        self.lines = {_dotted(place): line for place, line in (lines or {}).items()}
        self.list: list[str] = []

    def add(
        self, place: Key, what: str, found: object = None, allowed: str | Iterable[str] = ""
    ) -> None:
        text = f"{self.where(place)}: {what}"
        if found is not None:
            text += f"; found: {_short(found)}"
        if not isinstance(allowed, str):
            allowed = ", ".join(allowed)
        if allowed:
            text += f"; allowed: {allowed}"
        if text not in self.list:
            self.list.append(text)

    def known(self, place: Key, found: Iterable[str], names: Iterable[str], what: str) -> list[str]:
        """Those of the names found that there are; complain about the others."""
        there = list(names)
        found = list(found)
        for name in found:
            if name not in there:
                self.add(place, f"unknown {what}{nearest(name, there)}", name, there)
        return [name for name in found if name in there]

    def where(self, place: Key) -> str:
        """File, line, table and key."""
        parts = _dotted(place).split(".")
        starts = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
        line = next((self.lines[start] for start in starts if start in self.lines), 0)
        words: list[str] = []
        for part in place:
            if isinstance(part, int):
                words[-1] += f" {part + 1}"
            else:
                words.append(f'"{part}"' if "." in part else part)
        return ", ".join([self.file, *([f"line {line}"] if line else []), *words])

    def stop_if_any(self) -> None:
        if self.list:
            raise StudyError(self.list)


def _dotted(place: Key) -> str:
    """The same whether the key is written as "a.b" or as b in the table a."""
    return ".".join(map(str, place))


def _short(value: object) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 80 else text[:77] + "..."


def read_toml(path: Path) -> tuple[dict[str, Any], Problems]:
    """The contents of a TOML file, and an empty list of mistakes that knows its lines."""
    try:
        text = plain_text(path.read_bytes())
    except OSError as error:
        raise StudyError([f"{path}: the study file cannot be read: {error.strerror}"]) from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError([f"{path}: this is not TOML: {error}{_meant(text, str(error))}"]) from None
    return data, Problems(str(path), key_lines(text))


def plain_text(data: bytes) -> str:
    """Text of an editor of any kind: UTF-8, with its mark or without, or Latin-1; any line ends.

    Blanks that do not break, and the like, are blanks.
    """
    text = decoded(data).replace("\r\n", "\n").replace("\r", "\n")
    return re.sub("[\u00a0\u2000-\u200b\u202f\ufeff]", " ", text)


def _meant(text: str, error: str) -> str:
    """What is probably meant at the place of an error: a comma, quotes or dashes of other kinds."""
    place = re.search(r"at line (\d+), column (\d+)", error)
    lines = text.splitlines()
    if place is None or not 0 < int(place.group(1)) <= len(lines):
        return ""
    line = lines[int(place.group(1)) - 1]
    bare = re.sub(r"\"[^\"]*\"|'[^']*'|#.*", "", line)  # without texts and comment
    if re.search("[\u2018-\u201f\x91-\x94]", bare):
        return "; a quotation mark there is not that of the keyboard"
    if re.search("[\u2010-\u2015\u2212\x96\x97]", bare):
        return "; a minus sign there is not that of the keyboard"
    if re.match(r",\d", line[int(place.group(2)) - 1 :]):
        return "; the decimal sign is a point"
    return ""


def key_lines(text: str) -> dict[Key, int]:
    """The line of every table and key of a TOML text."""
    found: dict[Key, int] = {}
    counts: dict[Key, int] = {}
    table: Key = ()
    for number, line in enumerate(text.splitlines(), 1):
        header = _HEADER.match(line)
        if header:
            table = ()
            names = _names(header.group(2))
            for k, name in enumerate(names):
                table += (name,)
                if k == len(names) - 1 and header.group(1) == "[[":
                    counts[table] = counts.get(table, -1) + 1
                if table in counts:
                    table += (counts[table],)
            found.setdefault(table, number)
            continue
        entry = _ENTRY.match(line)
        if entry:
            found.setdefault((*table, *_names(entry.group(1))), number)
    return found


def _names(text: str) -> list[str]:
    return [name.strip("\"'") for name in re.findall(_NAME, text)]
