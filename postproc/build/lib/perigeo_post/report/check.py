"""Checks of a finished report: that it needs nothing outside itself and that nothing is broken."""

from __future__ import annotations

import base64
import binascii
import io
import re
from html.parser import HTMLParser
from pathlib import Path

from PIL import Image, ImageStat

from ..read.errors import ResultError

LARGE = 20_000_000  # bytes from which on a page is slow to open on a phone
PLAIN = 1.0  # standard deviation of the grey values (0 to 255) below which a picture is blank

_ELEMENTS = frozenset(
    (
        "html", "head", "meta", "link", "title", "style", "body", "a", "nav", "main", "header",
        "footer", "section", "p", "h1", "h2", "h3", "h4", "div", "span", "dl", "dt", "dd", "ul",
        "li", "figure", "figcaption", "img", "table", "caption", "thead", "tbody", "tr", "th",
        "td", "details", "summary", "pre", "code", "small", "b", "sup",
    )
)  # fmt: skip
_VOID = frozenset(("meta", "link", "img"))
# Attributes whose value a browser may follow or load.
_ADDRESSES = frozenset(
    (
        "src", "href", "srcset", "poster", "data", "action", "formaction", "background", "cite",
        "longdesc", "manifest", "ping", "xlink:href", "usemap", "codebase", "archive", "classid",
        "profile", "imagesrcset",
    )
)  # fmt: skip
_REFERENCES = ("aria-labelledby", "aria-describedby", "for", "headers")
_URL = re.compile(r"url\(\s*['\"]?\s*(?!data:)([^)'\"]*)", re.I)
_PNG = "data:image/png;base64,"


class _Checker(HTMLParser):
    """Collects what is wrong while it reads."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.problems: list[str] = []
        self.open: list[str] = []
        self.ids: list[str] = []
        self.wanted: list[str] = []
        self.levels: list[int] = []
        self.seen: list[str] = []
        self.pictures = 0
        self.title = ""
        self.language = ""
        self.viewport = False
        self.characters = ""

    def wrong(self, words: str) -> None:
        self.problems.append(f"line {self.getpos()[0]}: {words}")

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.seen.append(tag)
        if tag not in _ELEMENTS:
            self.wrong(f"<{tag}> does not belong in a report")
        if tag not in _VOID:
            self.open.append(tag)
        if len(values) != len(attrs):
            self.wrong(f"<{tag}> has an attribute twice")
        for name, value in values.items():
            self.attribute(tag, name, value)
        if tag == "html":
            self.language = values.get("lang", "")
        elif tag == "meta":
            self.characters = values.get("charset", self.characters)
            self.viewport |= values.get("name") == "viewport"
            if values.get("http-equiv", "").lower() == "refresh":
                self.wrong("the page leads to another one")
        elif tag == "img":
            self.picture(values)
        elif re.fullmatch("h[1-6]", tag):
            self.heading(int(tag[1]))

    def attribute(self, tag: str, name: str, value: str) -> None:
        if name == "id":
            self.ids.append(value)
        elif name in _REFERENCES:
            self.wanted += value.split()
        elif name == "style":
            self.styles(value)
        elif name.startswith("on"):
            self.wrong(f"<{tag}> has a script in {name}")
        elif name in _ADDRESSES:
            address = value.strip()
            if address.startswith("#"):
                self.wanted.append(address[1:])
            elif not address.startswith("data:"):
                self.wrong(f"<{tag}> has the external address {name}={address[:80]!r}")

    def styles(self, text: str) -> None:
        for address in _URL.findall(text):
            self.wrong(f"a style has the external address {address[:80]!r}")
        if "@import" in text.lower():
            self.wrong("a style imports another one")

    def heading(self, level: int) -> None:
        before = self.levels[-1] if self.levels else 0
        if level > before + 1:
            self.wrong(f"a heading of level {level} follows one of level {before}")
        self.levels.append(level)

    def picture(self, values: dict[str, str]) -> None:
        self.pictures += 1
        name = f"picture {self.pictures}"
        if not values.get("alt", "").strip():
            self.wrong(f"{name} has no text alternative")
        source = values.get("src", "")
        if not source.startswith(_PNG):
            self.wrong(f"{name} is not embedded as PNG")
            return
        reason = picture_problem(source[len(_PNG) :])
        if reason:
            self.wrong(f"{name} {reason}")

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open[-1] != tag:
            self.wrong(f"</{tag}> closes nothing that is open there")
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        inside = self.open[-1] if self.open else ""
        if inside == "title":
            self.title += data
        elif inside == "style":
            self.styles(data)

    def handle_comment(self, data: str) -> None:
        self.wrong("a comment")

    def finish(self) -> list[str]:
        """What only the whole page shows."""
        if self.open:
            self.wrong(f"<{self.open[-1]}> is not closed")
        found = self.problems
        found += [f"the id {x!r} stands twice" for x in sorted(set(self.ids))
                  if self.ids.count(x) > 1]  # fmt: skip
        found += [f"the anchor #{x} leads nowhere" for x in sorted(set(self.wanted))
                  if x not in self.ids]  # fmt: skip
        if not self.language:
            found.append("the language of the page is not given")
        if not self.title.strip():
            found.append("the page has no title")
        if not self.viewport:
            found.append("the page has no viewport, so that a phone shows it too small")
        if self.characters.lower() != "utf-8":
            found.append("the page does not say that it is in UTF-8")
        if self.levels.count(1) != 1:
            found.append(f"{self.levels.count(1)} headings of level 1; there must be one")
        if self.seen.count("main") != 1:
            found.append("the page needs one <main>")
        return found


def picture_problem(encoded: str) -> str:
    """What is wrong with a picture in base64; empty if nothing is."""
    try:
        data = base64.b64decode(encoded, validate=True)
    except (binascii.Error, ValueError):
        return "is not in base64"
    try:
        with Image.open(io.BytesIO(data)) as image:
            # Over white, as the page shows it: transparent pixels have colours of their own.
            seen = Image.new("RGBA", image.size, "white")
            seen.alpha_composite(image.convert("RGBA"))
            spread = ImageStat.Stat(seen.convert("L")).stddev[0]
    except (OSError, SyntaxError, ValueError) as error:
        return f"does not decode ({error})"
    return "" if spread >= PLAIN else "is blank"


def check_text(text: str) -> list[str]:
    """What is wrong with the text of a report; nothing if it is fine."""
    checker = _Checker()
    checker.feed(text)
    checker.close()
    found = checker.finish()
    if not text.lower().startswith("<!doctype html>"):
        found.insert(0, "line 1: the page does not begin with <!doctype html>")
    return found


def check_report(path: str | Path) -> list[str]:
    """What is wrong with a report; nothing if it is fine.

    No external address, every picture decodes, is not blank and has a text alternative, every
    anchor has its target, ids stand once, headings are in order, elements are closed and are of
    the kinds that a report has (text that was not escaped shows up there).
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ResultError(f"{path}: is not text in UTF-8 ({error.reason})") from error
    return check_text(text)
