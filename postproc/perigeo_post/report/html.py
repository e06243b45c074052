"""HTML that cannot be broken by what it shows, and the looks of the report."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from typing import Union


class Html(str):
    """Text that is HTML already; all other text is escaped."""


Content = Union[str, Html, None]

_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_POWER = re.compile("10\\^(−?[0-9]+)")


def escape(text: str) -> Html:
    """Text as HTML; characters that no page may hold become a question mark in a box."""
    if isinstance(text, Html):
        return text
    return Html(html.escape(_CONTROL.sub("\ufffd", text), quote=True))


def join(parts: Iterable[Content], between: str = "") -> Html:
    """Parts one after the other, escaped where they are text."""
    return Html(between.join(escape(part) for part in parts if part is not None))


def el(name: str, /, *children: Content, **attributes: str | int | None) -> Html:
    """An element; `class_` and `data_label` stand for class and data-label, None leaves out."""
    words = [name]
    for key, value in attributes.items():
        if value is not None:
            words.append(f'{key.rstrip("_").replace("_", "-")}="{escape(str(value))}"')
    start = f"<{' '.join(words)}>"
    if name in ("img", "meta", "link", "br"):
        return Html(start)
    return Html(f"{start}{join(children)}</{name}>")


def number_html(text: str) -> Html:
    """A number with its power of ten raised."""
    return Html(_POWER.sub(r"10<sup>\1</sup>", escape(text)))


def paragraphs(text: str, class_: str | None = None) -> Html:
    """Text whose paragraphs are separated by empty lines."""
    parts = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text)]
    return join(el("p", part, class_=class_) for part in parts if part)


def facts_list(facts: Sequence[tuple[str, Content]]) -> Html:
    """Names and what belongs to them."""
    pairs = [part for name, value in facts for part in (el("dt", name), el("dd", value))]
    return el("dl", *pairs, class_="facts")


def box(table: Html, label: str) -> Html:
    """A table that scrolls inside its own box, by keyboard too."""
    return el("div", table, class_="box", role="region", tabindex=0, aria_label=label)


def notice(words: str, more: Html | None = None, mild: bool = False) -> Html:
    """Something that the reader should not miss."""
    return el("div", el("p", words), more, class_="notice mild" if mild else "notice")


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


STYLE = """
:root {
  color-scheme: light dark;
  --paper: #ffffff; --ink: #1b1d20; --soft: #5a6068; --line: #d9dce0; --panel: #f6f7f8;
  --link: #0b5394; --good: #1a7038; --part: #8a5a00; --bad: #b3261e; --none: #5a6068;
  --shade: #0003;
  --mono: ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #16181b; --ink: #e4e6e9; --soft: #a0a6ae; --line: #353a40; --panel: #1e2125;
    --link: #84b9f0; --good: #72cf92; --part: #e6b45c; --bad: #ff9389; --none: #a0a6ae;
    --shade: #0009;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; scroll-padding-top: 1rem; }
body {
  margin: 0; background: var(--paper); color: var(--ink); overflow-wrap: break-word;
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial,
    "Liberation Sans", sans-serif;
}
a { color: var(--link); text-decoration: none; }
a:hover, a:focus { text-decoration: underline; }
.skip { position: absolute; left: -100rem; }
.skip:focus { left: 0; padding: .5rem 1rem; background: var(--paper); }
.page { max-width: 78rem; margin: 0 auto; padding: 0 1.25rem 4rem; }
main { min-width: 0; max-width: 58rem; }
h1, h2, h3, h4 { line-height: 1.2; font-weight: 650; text-wrap: balance; }
h1 { font-size: 2rem; letter-spacing: -.02em; margin: 2.5rem 0 1rem; }
h2 { font-size: 1.45rem; letter-spacing: -.01em; margin: 0 0 .75rem; }
h3 { font-size: 1.05rem; margin: 2.25rem 0 .6rem; }
h4 { font-size: .95rem; margin: 1.5rem 0 .5rem; }
p, dl, ul, ol { margin: 0 0 1em; }
header p, section > p, .finding p, figcaption p { max-width: 44rem; }
section { margin-top: 3.5rem; border-top: 1px solid var(--line); padding-top: 1.75rem; }
.lead { font-size: 1.1rem; color: var(--soft); }
.soft, .unit { color: var(--soft); }
.small { font-size: .85rem; }

nav { font-size: .9rem; padding: 1rem 0 0; }
nav p { margin: 0 0 .3rem; font-weight: 650; }
nav ul { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 0 1.1rem; }
nav a { display: inline-block; padding: .3rem 0; }
@media (min-width: 64rem) {
  .page { display: grid; grid-template-columns: 13.5rem minmax(0, 1fr); column-gap: 3rem; }
  nav { position: sticky; top: 0; align-self: start; max-height: 100vh; overflow-y: auto;
    padding: 2.75rem 0 1rem; }
  nav ul { display: block; }
  nav a { padding: .2rem 0; line-height: 1.35; }
}

.facts { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: .25rem 1.25rem; }
.facts dt { color: var(--soft); }
.facts dd { margin: 0; }
.tally { display: grid; grid-template-columns: repeat(4, minmax(0, 1fr)); gap: 1px;
  padding: 1px; }
.tally div { box-shadow: 0 0 0 1px var(--line); padding: .7rem .9rem .8rem; }
.tally dt { font-size: .85rem; }
.tally dd { margin: 0; font-size: 1.6rem; line-height: 1.2; font-weight: 600;
  font-variant-numeric: tabular-nums; }
.tally small { display: block; font-size: .8rem; font-weight: 400; color: var(--soft); }
.notice { border-left: 3px solid var(--bad); background: var(--panel); padding: .75rem 1rem;
  margin: 0 0 1.25rem; }
.notice.mild { border-color: var(--part); }
.notice > :last-child { margin-bottom: 0; }
.notice p, .notice ul { margin-bottom: .4rem; }
.notice ul { padding-left: 1.2rem; }

.verdict { white-space: nowrap; font-weight: 600; }
.verdict::before { content: ""; display: inline-block; width: .6em; height: .6em;
  margin-right: .45em; border-radius: 50%; background: currentColor; }
.agrees { color: var(--good); }
.in-part { color: var(--part); }
.differs { color: var(--bad); }
.no-result { color: var(--none); }

.box { overflow-x: auto; margin: 0 0 1.25rem;
  background:
    linear-gradient(to right, var(--paper) 40%, transparent) left / 3rem 100%,
    linear-gradient(to left, var(--paper) 40%, transparent) right / 3rem 100%,
    linear-gradient(to right, var(--shade), transparent) left / .9rem 100%,
    linear-gradient(to left, var(--shade), transparent) right / .9rem 100%;
  background-repeat: no-repeat; background-attachment: local, local, scroll, scroll; }
.box:focus-visible, summary:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
table { border-collapse: collapse; font-size: .875rem; line-height: 1.4; }
caption { text-align: left; color: var(--soft); padding-bottom: .4rem; }
th, td { text-align: left; vertical-align: top; padding: .4rem .9rem .4rem 0;
  border-bottom: 1px solid var(--line); }
th { font-weight: 600; }
thead th { vertical-align: bottom; border-bottom-color: var(--soft); }
tbody th { font-weight: 400; min-width: 7.5rem; }
td code, .w { white-space: nowrap; }
.group th { font-weight: 600; padding-top: 1.1rem; }
.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
thead .n { white-space: normal; min-width: 5rem; max-width: 9rem; }
sup { line-height: 0; font-size: .75em; }
.values tbody th { position: sticky; left: 0; background: var(--paper); max-width: 13rem; }
.findings { width: 100%; }
.findings td { min-width: 9rem; }
.findings td:last-child { padding-right: 0; min-width: 0; }
@media (max-width: 44rem) {
  h1 { font-size: 1.65rem; margin-top: 1.5rem; }
  .findings thead { position: absolute; left: -100rem; }
  .findings, .findings tbody, .findings tr, .findings th, .findings td { display: block; }
  .findings tr { border-bottom: 1px solid var(--line); padding: .6rem 0; }
  .findings th, .findings td { border: 0; padding: .1rem 0; }
  .findings tbody tr:not(.group) th { font-weight: 600; }
  .findings .group { padding: 1rem 0 .3rem; }
  .findings .group th { font-size: 1rem; padding: 0; }
  .findings td[data-label]::before { content: attr(data-label) ": "; color: var(--soft); }
  .tally { grid-template-columns: repeat(2, minmax(0, 1fr)); }
  .facts { grid-template-columns: 1fr; gap: 0; }
  .facts dd { margin-bottom: .5rem; }
}

.finding { margin: 0 0 1.75rem; }
.finding h4 { margin: 0 0 .4rem; }
.finding p { margin-bottom: .5rem; }
.finding .facts { margin-bottom: .5rem; }
.finding dl dd { max-width: 38rem; }
figure { margin: 0 0 2rem; }
figure img { display: block; max-width: 100%; height: auto; background: #fff; }
@media (prefers-color-scheme: dark) { figure img { padding: .5rem; border-radius: 4px; } }
figcaption { margin-top: .6rem; font-size: .9rem; }
figcaption p { margin-bottom: .3rem; }
details { margin: 0 0 .5rem; }
details details { margin-left: 1rem; }
summary { cursor: pointer; color: var(--link); padding: .2rem 0; font-size: .9rem; }
details > .box, details > pre { margin-top: .4rem; }
pre { overflow-x: auto; background: var(--panel); padding: .75rem 1rem; margin: 0 0 .75rem;
  font: .8rem/1.45 var(--mono); }
.notice pre { white-space: pre-wrap; background: none; padding: 0; }
code { font: .88em var(--mono); overflow-wrap: anywhere; }
footer { margin-top: 3.5rem; border-top: 1px solid var(--line); padding-top: 1rem; }

@media print {
  :root { --paper: #fff; --ink: #000; --soft: #444; --line: #bbb; --panel: #f4f4f4; --shade: #fff;
    --link: #000; --good: #1a7038; --part: #8a5a00; --bad: #b3261e; --none: #444; }
  body { font-size: 9.5pt; }
  nav, .skip { display: none; }
  .page { display: block; max-width: none; padding: 0; }
  main { max-width: none; }
  .box { overflow: visible; background: none; }
  figure, .finding, .notice, tr { break-inside: avoid; }
  h2, h3, h4, caption, .group { break-after: avoid; }
  .values tbody th { position: static; }
}
"""
