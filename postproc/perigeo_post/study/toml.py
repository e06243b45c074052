"""TOML tables that are looked at key by key, so that every mistake is found with its place."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..read.errors import PostError
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
        self.lines = dict(lines or {})
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

    def where(self, place: Key) -> str:
        """File, line, table and key."""
        line = next(
            (self.lines[place[:n]] for n in range(len(place), 0, -1) if place[:n] in self.lines), 0
        )
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


def _short(value: object) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 80 else text[:77] + "..."


def read_toml(path: Path) -> tuple[dict[str, Any], Problems]:
    """The contents of a TOML file, and an empty list of mistakes that knows its lines."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise StudyError([f"{path}: the study file is not a text in UTF-8"]) from None
    except OSError as error:
        raise StudyError([f"{path}: the study file cannot be read: {error.strerror}"]) from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError([f"{path}: this is not TOML: {error}"]) from None
    return data, Problems(str(path), key_lines(text))


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


class Table:
    """A table of the file; complains about what is wrong and goes on with a default."""

    def __init__(self, data: Mapping[str, Any], place: Key, problems: Problems) -> None:
        self.data = data
        self.place = place
        self.problems = problems

    def at(self, *key: Any) -> Key:
        return (*self.place, *key)

    def complain(
        self, key: str, what: str, found: object = None, allowed: str | Iterable[str] = ""
    ) -> None:
        self.problems.add(self.at(key), what, found, allowed)

    def only(self, known: Iterable[str]) -> None:
        """Complain about keys that nobody knows."""
        names = list(known)
        for key in self.data:
            if key not in names:
                self.complain(key, f"unknown key{nearest(key, names)}", allowed=names)

    def text(self, key: str, default: str = "", required: bool = False) -> str:
        value = self.data.get(key)
        if value is None:
            if required:
                self.problems.add(self.place or (key,), f"the key {key} is missing")
            return default
        if not isinstance(value, str):
            self.complain(key, "must be a text", value)
            return default
        if required and not value.strip():
            self.complain(key, "must not be empty")
        return value

    def name(self, key: str) -> str:
        """A required text of a to z, 0 to 9 and _."""
        value = self.text(key, required=True)
        if value and not re.fullmatch(r"[a-z0-9_]{1,60}", value):
            self.complain(key, "is no name", value, "up to 60 of a to z, 0 to 9 and _")
        return value

    def boolean(self, key: str, default: bool) -> bool:
        value = self.data.get(key, default)
        if not isinstance(value, bool):
            self.complain(key, "must be true or false", value)
            return default
        return value

    def texts(self, key: str) -> list[str]:
        """A list of texts, or a single one."""
        value = self.data.get(key, [])
        items = [value] if isinstance(value, str) else value
        if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
            self.complain(key, "must be a list of texts", value)
            return []
        return list(items)

    def table(self, key: str) -> Table:
        value = self.data.get(key, {})
        if not isinstance(value, Mapping):
            self.complain(key, "must be a table", value, f"[{key}] with keys below it")
            value = {}
        return Table(value, self.at(key), self.problems)

    def tables(self, key: str) -> list[Table]:
        value = self.data.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
            self.complain(key, "must be a list of tables", allowed=f"[[{key}]] before each")
            return []
        return [Table(item, self.at(key, k), self.problems) for k, item in enumerate(value)]

    def choices(self, key: str, known: Iterable[str], what: str) -> list[str]:
        """A list of texts that must be among those known."""
        names = list(known)
        found = self.texts(key)
        for item in found:
            if item not in names:
                self.complain(key, f"unknown {what}{nearest(item, names)}", item, names)
        return [item for item in found if item in names]
