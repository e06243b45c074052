"""The templates of the page and their filters; all text that they show is escaped."""

from __future__ import annotations

import re
from collections.abc import Callable

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from ..study.record import (
    AGREES,
    DIFFERS,
    DONE,
    FAILED,
    HOLDS,
    HOLDS_IN_PART,
    HOLDS_NOT,
    IN_PART,
    MISSING,
    NO_RESULT,
)
from .study import machine_text
from .values import DASH, cell, duration, number, plural, readable

# How words are marked: the class of the style sheet.
MARKS = {
    AGREES: "agrees", IN_PART: "in-part", DIFFERS: "differs", NO_RESULT: "no-result",
    HOLDS: "agrees", HOLDS_IN_PART: "in-part", HOLDS_NOT: "differs",
    DONE: "agrees", FAILED: "differs", MISSING: "no-result", "ok": "agrees", "FAILED": "differs",
}  # fmt: skip

_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_POWER = re.compile("10\\^(−?[0-9]+)")


def shown(value: object) -> object:
    """Text for the page; characters that no page may hold become a question mark in a box."""
    if isinstance(value, Markup):
        return value
    return "" if value is None else _CONTROL.sub("\ufffd", str(value))


def power(text: str) -> Markup:
    """A number with its power of ten raised."""
    return Markup(_POWER.sub(r"10<sup>\1</sup>", str(escape(shown(text)))))


def csv_cell(text: str) -> str:
    """A number of a CSV file with fewer digits; other text as it is."""
    try:
        return power(number(float(text), 5))
    except ValueError:
        return text or DASH


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a text, which empty lines separate."""
    parts = (" ".join(part.split()) for part in re.split(r"\n\s*\n", text))
    return [part for part in parts if part]


def environment() -> Environment:
    """The templates with their filters; `style` is the style sheet, which the page holds itself."""
    loader = PackageLoader("perigeo_post.report")
    found = Environment(
        loader=loader,
        autoescape=True,
        finalize=shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters: tuple[Callable[..., str | list[str]], ...] = (
        power, csv_cell, paragraphs, machine_text, cell, duration, number, plural, readable
    )  # fmt: skip
    found.filters.update({one.__name__: one for one in filters})
    style = loader.get_source(found, "style.css")[0]
    found.globals.update(dash=DASH, marks=MARKS, style=Markup(style))
    return found


class Ids:
    """Names of places in the page, each used once."""

    def __init__(self) -> None:
        self.used: set[str] = set()

    def new(self, *parts: str) -> str:
        base = "-".join(re.sub("[^A-Za-z0-9]+", "-", part).strip("-") for part in parts)
        base = re.sub("^(?=[0-9])|^$", "x", base)
        name, k = base, 1
        while name in self.used:
            k += 1
            name = f"{base}-{k}"
        self.used.add(name)
        return name
