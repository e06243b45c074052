"""Markdown, sources and notebooks as HTML, with links from one file to another."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound

LEXERS = {"nml": "fortran", "f90": "fortran", "pf": "fortran", "sh": "bash", "py": "python"}

# Leads a link (or None where it leads nowhere): from a path of the repository to an address.
Leader = Callable[[str], "str | None"]


@dataclass
class Section:
    """A heading with the text below it, as the search sees it."""

    anchor: str
    level: int
    title: str
    words: list[str] = field(default_factory=list)


@dataclass
class Text:
    """A document as HTML."""

    title: str
    body: str
    sections: list[Section]


def coloured(code: str, language: str, quick: bool = False) -> str:
    """Return code with its syntax marked up; quick: without."""
    code = code.rstrip("\n")
    if not quick and language not in ("", "text"):
        try:
            lexer = get_lexer_by_name(LEXERS.get(language, language), stripnl=False)
            return highlight(code, lexer, HtmlFormatter(nowrap=True)).rstrip("\n")
        except ClassNotFound:
            pass
    return html.escape(code)


def plain(tokens: Sequence[Token]) -> str:
    """Return the words of a line without markup."""
    return "".join(
        " " if t.type in ("softbreak", "hardbreak") else t.content
        for t in tokens
        if t.type in ("text", "code_inline", "softbreak", "hardbreak", "image")
    )


def anchor_of(title: str, taken: set[str]) -> str:
    """Return the anchor that the usual hosts of git give to a heading."""
    base = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
    name, number = base, 0
    while name in taken:
        number += 1
        name = f"{base}-{number}"
    taken.add(name)
    return name


class Renderer:
    """Turns Markdown into HTML. A code span that is a file or module becomes a link too."""

    def __init__(self, lead: Leader, named: Leader, quick: bool = False) -> None:
        self.lead, self.named, self.quick = lead, named, quick
        self.dead: list[str] = []
        self.parser = MarkdownIt("commonmark", {"html": True}).enable("table")
        rules: Any = self.parser.renderer.rules
        rules["fence"] = self.fence
        rules["code_block"] = self.fence
        rules["table_open"] = lambda *_: '<div class="box" tabindex="0"><table>\n'
        rules["table_close"] = lambda *_: "</table></div>\n"
        rules["html_block"] = rules["html_inline"] = self.no_comment

    def fence(self, tokens: Sequence[Token], k: int, *_: Any) -> str:
        code = coloured(tokens[k].content, tokens[k].info.strip(), self.quick)
        return f'<pre tabindex="0"><code>{code}</code></pre>\n'

    @staticmethod
    def no_comment(tokens: Sequence[Token], k: int, *_: Any) -> str:
        text = tokens[k].content
        return "" if text.lstrip().startswith("<!--") else text

    def links(self, children: list[Token]) -> list[Token]:
        """Return the tokens of a line with its links led to the pages of the site."""
        made: list[Token] = []
        inside = False
        for token in children:
            if token.type in ("link_open", "image"):
                name = "href" if token.type == "link_open" else "src"
                asked = str(token.attrs[name])
                to = self.lead(asked)
                if to is None:
                    self.dead.append(asked)
                token.attrs[name] = to or asked
            inside = token.type == "link_open" or (inside and token.type != "link_close")
            address = self.named(token.content) if token.type == "code_inline" else None
            if address and not inside:
                made.append(Token("link_open", "a", 1, attrs={"href": address}))
                made += [token, Token("link_close", "a", -1)]
            else:
                made.append(token)
        return made

    def render(self, text: str) -> Text:
        """Return a document: its first heading is its title and not part of the body."""
        tokens = self.parser.parse(text)
        sections: list[Section] = [Section("", 1, "")]
        taken: set[str] = set()
        kept: list[Token] = []
        title = ""
        skip = 0
        for k, token in enumerate(tokens):
            if token.type == "heading_open":
                words = plain(tokens[k + 1].children or [])
                token.attrs["id"] = anchor_of(words, taken)
                if token.tag == "h1" and not title:
                    title, skip = words, 3
                    sections[0].title = words
                else:
                    level = int(token.tag[1])
                    sections.append(Section(str(token.attrs["id"]), level, words))
            if token.type == "inline":
                if not skip and tokens[k - 1].type != "heading_open":
                    sections[-1].words.append(plain(token.children or []))
                token.children = self.links(token.children or [])
            elif token.type in ("fence", "code_block"):
                sections[-1].words.append(token.content)
            if skip:
                skip -= 1
            else:
                kept.append(token)
        body = self.parser.renderer.render(kept, self.parser.options, {})
        return Text(title, body, sections)

    def notebook(self, text: str) -> Text:
        """Return a notebook: its texts, and its code with what it printed and drew."""
        parts, sections, title = [], [], ""
        for cell in json.loads(text)["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] == "markdown":
                made = self.render(source)
                title = title or made.title
                parts.append(made.body)
                sections += made.sections
            elif cell["cell_type"] == "code":
                code = coloured(source, "python", self.quick)
                parts.append(f'<pre tabindex="0"><code>{code}</code></pre>')
                parts += [shown(output) for output in cell.get("outputs", [])]
        return Text(title, "\n".join(parts), sections)


def shown(output: dict[str, Any]) -> str:
    """Return what a cell of a notebook gave: a picture, or else its text."""
    data = output.get("data", {})
    if "image/png" in data:
        picture = "".join(data["image/png"]).replace("\n", "")
        return f'<p><img alt="Figure of the cell above" src="data:image/png;base64,{picture}"></p>'
    lines = "".join(output.get("text") or data.get("text/plain") or output.get("traceback") or [])
    return f'<pre class="printed" tabindex="0">{html.escape(lines)}</pre>' if lines else ""
