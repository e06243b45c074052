"""Namelist texts of the program: taken apart, changed, put together again.

The scanner follows that of the program (src/input/pd_namelist.f90). Comments are left out, values
stay as they are written. What groups and keys mean is the program's business.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ..read.errors import RequestError
from .expressions import nearest

UNSET = "unset"  # as the value of a key: it is taken out

_TOKEN = re.compile(
    r"""(?P<blank>[\s,]+|![^\n\r]*)
    | (?P<text>'(?:[^'\n\r]|'')*'|"(?:[^"\n\r]|"")*")
    | (?P<group>&[^\s,/!=&'"]*)
    | (?P<end>/)
    | (?P<equals>=)
    | (?P<word>[^\s,/!=&'"]+)""",
    re.VERBOSE,
)


class NamelistError(RequestError):
    """A namelist that cannot be taken apart, or a change that it does not allow."""


@dataclass
class Group:
    """&name key = values ... /; keys in small letters, values as written."""

    name: str
    entries: dict[str, list[str]] = field(default_factory=dict)

    @property
    def label(self) -> str | None:
        """The value of its key `name`."""
        values = self.entries.get("name")
        return _unquoted(values[0]).strip() if values else None


@dataclass
class Namelist:
    """The groups of a file in their order."""

    groups: list[Group] = field(default_factory=list)

    def copy(self) -> Namelist:
        return copy.deepcopy(self)

    def text(self, leave_out: tuple[str, ...] = ()) -> str:
        """The file; without the "group.key" named."""
        lines = []
        for group in self.groups:
            lines.append(f"&{group.name}")
            lines += [
                f"  {key} = {', '.join(values)}"
                for key, values in group.entries.items()
                if f"{group.name}.{key}" not in leave_out
            ]
            lines.append("/")
        return "\n".join(lines) + "\n"

    def named(self, name: str) -> list[Group]:
        """All groups of this name."""
        return [group for group in self.groups if group.name == name]

    def numbers(self, group: str, key: str) -> list[float]:
        """The numbers of a key; empty where there are none."""
        found: list[float] = []
        for one in self.named(group):
            for word in one.entries.get(key, []):
                repeats, star, number = word.rpartition("*")
                try:
                    value = float(re.sub("[dD]", "e", number))
                    found += [value] * (int(repeats) if star else 1)
                except ValueError:
                    return []
        return found

    # ---- changes -------------------------------------------------------------------------

    def change(self, place: str, value: Any) -> None:
        """Set "group.key" or "group.NAME.key"; a group: False takes it out, a key: "unset" does.

        A group or key that is not there is added.
        """
        parts = place.lower().split(".")
        if not 1 <= len(parts) <= 3 or not all(re.fullmatch(r"[a-z0-9_]+", p) for p in parts):
            raise NamelistError("must be group.key, group.NAME.key, or a group to take out")
        if value is False and (len(parts) == 1 or self._is_group(parts)):
            self._remove(parts)
            return
        if len(parts) == 1:
            raise NamelistError(f"is a group: only false, which takes it out; found: {value!r}")
        group = self._group(parts[0], parts[1] if len(parts) == 3 else None, value == UNSET)
        key = parts[-1]
        if value == UNSET:
            if key not in group.entries:
                raise NamelistError(
                    f"there is no {key} to take out{nearest(key, group.entries)}; "
                    f"&{group.name} has: {', '.join(group.entries)}"
                )
            del group.entries[key]
            return
        values = list(value) if isinstance(value, (list, tuple)) else [value]
        if not values:
            raise NamelistError("an empty list is no value")
        group.entries[key] = [_written(item) for item in values]

    def _is_group(self, parts: list[str]) -> bool:
        """Whether "boundary.top" means a group with a name rather than a key."""
        return len(parts) == 2 and any(g.label == parts[1] for g in self.named(parts[0]))

    def _remove(self, parts: list[str]) -> None:
        wanted = [g for g in self.named(parts[0]) if len(parts) == 1 or g.label == parts[1]]
        if not wanted:
            known = {group.name for group in self.groups}
            raise NamelistError(
                f"there is no group to take out{nearest(parts[0], known)}; "
                f"the base has: {', '.join(sorted(known))}"
            )
        self.groups = [g for g in self.groups if all(g is not gone for gone in wanted)]

    def _group(self, name: str, label: str | None, must_exist: bool = False) -> Group:
        """The group that a change means; a new one where there is none."""
        there = self.named(name)
        if label is not None:
            found = [group for group in there if group.label == label]
            if not found and label.isdigit() and 1 <= int(label) <= len(there):
                found = [there[int(label) - 1]]
        else:
            found = there
        if len(found) > 1:
            names = [f"{name}.{g.label or k + 1}" for k, g in enumerate(there)]
            raise NamelistError(f"&{name} stands several times; say which: {', '.join(names)}")
        if found:
            return found[0]
        if must_exist:
            raise NamelistError(f"the base has no such group &{name}")
        group = Group(name)
        if label is not None:
            group.entries["name"] = [_written(label)]
        last = max((k for k, g in enumerate(self.groups) if g.name == name), default=None)
        self.groups.insert(len(self.groups) if last is None else last + 1, group)
        return group


def _written(value: Any) -> str:
    """A value as the program reads it."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        if re.search(r"[\n\r]", value):
            raise NamelistError("a text must stand on one line")
        return "'" + value.replace("'", "''") + "'"
    raise NamelistError(f"is neither a number nor a text: {value!r}")


def _unquoted(word: str) -> str:
    if word[:1] in ("'", '"'):
        return word[1:-1].replace(word[0] * 2, word[0])
    return word


def file_names(namelist: Namelist) -> list[tuple[Group, str]]:
    """The groups that name a file of points, with the name."""
    return [
        (group, _unquoted(group.entries["file"][0]))
        for group in namelist.named("body")
        if group.entries.get("file")
    ]


def _tokens(text: str) -> Iterator[tuple[str, str, int]]:
    """(kind, text, line) of everything but blanks and comments."""
    at, line = 0, 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise NamelistError(f"line {line}: a text without its closing quote")
        kind = str(match.lastgroup)
        if kind != "blank":
            yield kind, match.group(), line
        line += match.group().count("\n")
        at = match.end()


def parse_namelist(text: str) -> Namelist:
    """Take a namelist file apart.

    Raises NamelistError, with the line, for what the program would not read either.
    """
    found = Namelist()
    group: Group | None = None
    key: str | None = None
    tokens = list(_tokens(text.lstrip("\ufeff")))
    for number, (kind, word, line) in enumerate(tokens):
        following = tokens[number + 1][0] if number + 1 < len(tokens) else "end"
        if group is None:
            if kind != "group" or len(word) < 2:
                raise NamelistError(f"line {line}: text outside of a group: {word}")
            group, key = Group(word[1:].lower()), None
            found.groups.append(group)
        elif kind == "end":
            group = None
        elif kind == "group":
            raise NamelistError(f"line {line}: group &{group.name} is not ended by /")
        elif kind == "word" and following == "equals":
            key = word.lower()
            if key in group.entries:
                raise NamelistError(f"line {line}: &{group.name} {key} is given twice")
            group.entries[key] = []
        elif kind == "equals":
            if key is None or group.entries[key]:
                raise NamelistError(f"line {line}: an = without a key in &{group.name}")
        elif key is None:
            raise NamelistError(f"line {line}: a value without a key in &{group.name}: {word}")
        else:
            group.entries[key].append(word)
    if group is not None:
        raise NamelistError(f"group &{group.name} is not ended by /")
    return found
