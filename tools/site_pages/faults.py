"""What is wrong with the pages, seen without a browser."""

from __future__ import annotations

import html
import os
import re
from collections import Counter
from pathlib import Path
from urllib.parse import unquote, urlparse

# The pages are our own: their text holds neither `<` nor quotes that are not escaped.
TAG = re.compile(r"<(a|link|script|img|iframe|source|video)\b([^>]*)>")
ADDRESS = re.compile(r"\b(?:href|src)=\"([^\"]*)\"")
ANCHOR = re.compile(r"<[a-z0-9]+\b[^>]*?\bid=\"([^\"]*)\"")


class Seen:
    """Links, anchors and what is loaded of one page."""

    def __init__(self, text: str) -> None:
        self.anchors = Counter(ANCHOR.findall(text))
        self.links: set[str] = set()
        self.loads: set[str] = set()
        self.without_words = 0
        for tag, attributes in TAG.findall(text):
            addresses = {html.unescape(url) for url in ADDRESS.findall(attributes)}
            (self.links if tag == "a" else self.loads).update(addresses)
            self.without_words += tag == "img" and not re.search(r'\balt="[^"]', attributes)


def faults(output: Path) -> list[str]:
    """Return a line for each dead link, missing picture or anchor, and address elsewhere."""
    files = {os.path.join(folder, name) for folder, _, names in os.walk(output) for name in names}
    pages = {f: Seen(Path(f).read_text(encoding="utf-8"))
             for f in sorted(files) if f.endswith(".html")}  # fmt: skip
    found = []
    for page, seen in pages.items():
        where = os.path.relpath(page, output)
        found += [f"{where} loads {url}" for url in seen.loads if re.match(r"(https?:)?//", url)]
        found += [f"{where} has the anchor {i} twice" for i, n in seen.anchors.items() if n > 1]
        if seen.without_words:
            found.append(f"{where} has {seen.without_words} pictures without words")
        for url in sorted(seen.links | seen.loads):
            place, _, anchor = url.partition("#")
            if urlparse(place).scheme or place.startswith("//"):
                continue
            target = page
            if place:
                target = os.path.normpath(os.path.join(os.path.dirname(page), unquote(place)))
            if target not in files:
                found.append(f"{where} links to {url}, which is not there")
            elif target in pages and anchor and unquote(anchor) not in pages[target].anchors:
                found.append(f"{where} links to {url}, which has no such anchor")
    for path in [*output.rglob("*.css"), output / "site.js"]:
        urls = re.findall(r"(?:https?:)?//[\w.-]+\.\w+/?", path.read_text(encoding="utf-8"))
        found += [f"{path.relative_to(output)} names {url}" for url in urls]
    return found
