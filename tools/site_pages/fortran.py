"""What a module of the program offers, read from its source: types, procedures, their comments.

The sources keep one form (CONTRIBUTING.md), so a few patterns are enough: `!>` lines before what
they describe, `!!` after a declaration, one module in each file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

PROCEDURE = re.compile(
    r"^\s*(?:(?:pure|elemental|impure|recursive|module|logical|integer|real|character|complex|type"
    r"|class)(?:\s*\([^!]*?\))?\s+)*(subroutine|function)\s+(\w+)\s*(?:\(([^)]*)\))?",
    re.IGNORECASE,
)
END = re.compile(r"^\s*end\s+(subroutine|function)\b", re.IGNORECASE)
TYPE = re.compile(r"^\s*type\b\s*(?:,[^:]*)?::\s*(\w+)\s*$|^\s*type\s+(\w+)\s*$", re.IGNORECASE)
DECLARED = re.compile(r"^\s*([^:!]*?)\s*::\s*([^!]*?)\s*(?:!!\s*(.*))?$")


@dataclass
class Item:
    """A type or procedure."""

    kind: str
    name: str
    line: int
    statement: str
    about: str = ""
    # name, declaration, comment: arguments of a procedure, components of a type
    parts: list[tuple[str, str, str]] = field(default_factory=list)
    bound: list[str] = field(default_factory=list)


@dataclass
class Module:
    name: str
    path: str
    layer: str
    about: str
    public: list[str]
    uses: list[str]
    items: list[Item]
    source: str


def statements(lines: list[str]) -> list[tuple[int, str]]:
    """Return the lines of code with the numbers of their first lines, continued ones joined."""
    joined, first, text = [], 0, ""
    for number, line in enumerate(lines, start=1):
        bare = line.rstrip()
        if text and bare.lstrip().startswith("!"):
            continue
        text = f"{text} {bare.strip().lstrip('&').strip()}" if text else bare
        first = first or number
        code = re.sub(r"\s*!.*$", "", text) if "'" not in text else text
        if code.endswith("&"):
            text = code[:-1].rstrip()
            continue
        joined.append((first, text))
        first, text = 0, ""
    return joined


def comment(words: list[str]) -> str:
    """Return the lines of a comment as Markdown: equations are set off by blanks."""
    made: list[str] = []
    for word in words:
        equation = word.startswith("   ")
        before = bool(made) and made[-1].startswith("    ")
        if made and made[-1] and equation != before:
            made.append("")
        made.append(f"    {word.strip()}" if equation else word.strip())
    return "\n".join(made)


def names_of(text: str) -> list[str]:
    """Return the names of a list, without what stands in brackets or after `=`."""
    bare = re.sub(r"\([^()]*(?:\([^()]*\)[^()]*)*\)", "", text)
    bare = re.sub(r"\[[^\]]*\]|'[^']*'", "", bare)
    return [part.partition("=")[0].strip() for part in bare.split(",") if part.strip()]


def declared(text: str) -> list[tuple[str, str, str]]:
    """Return name, declaration and comment of what a line declares."""
    found = DECLARED.match(text)
    if not found or re.match(r"\s*(use|public|private|import)\b", text):
        return []
    kind, names, words = found.groups()
    kind = re.sub(r"\s+", " ", kind)
    return [(name, kind, words or "") for name in names_of(names) if re.fullmatch(r"\w+", name)]


def read_module(path: Path, root: Path) -> Module:
    """Return the module of a file."""
    source = path.read_text(encoding="utf-8")
    module = Module(
        name=path.stem,
        path=path.relative_to(root).as_posix(),
        layer=path.parent.name,
        about="",
        public=[],
        uses=sorted(set(re.findall(r"^\s*use (pd_\w+)", source, re.MULTILINE)) - {path.stem}),
        items=[],
        source=source,
    )
    words: list[str] = []
    open_ones: list[Item] = []
    for number, text in statements(source.splitlines()):
        bare = text.strip()
        if bare.startswith("!>"):
            words.append(bare[2:].removeprefix(" ").rstrip() if bare != "!>" else "")
            continue
        if re.match(r"(module|program) \w+$", bare) and not module.about:
            module.about = comment(words)
        elif bare.startswith("public ::"):
            module.public += names_of(bare.partition("::")[2])
        else:
            take(number, text, comment(words), open_ones, module.items)
        words = []
    return module


def take(number: int, text: str, about: str, open_ones: list[Item], items: list[Item]) -> None:
    """Take in one statement: an item begins or ends, or its parts are declared."""
    procedure, kind = PROCEDURE.match(text), TYPE.match(text)
    if END.match(text) or re.match(r"\s*end type\b", text, re.IGNORECASE):
        if open_ones:
            open_ones.pop()
    elif procedure:
        statement = re.sub(r"\s+", " ", text.strip())
        item = Item(procedure[1].lower(), procedure[2], number, statement, about)
        wanted = names_of(procedure[3] or "")
        item.parts = [(name, "", "") for name in wanted]
        # Procedures within procedures are their own business.
        if not open_ones:
            items.append(item)
        open_ones.append(item)
    elif kind:
        name = kind[1] or kind[2]
        item = Item("type", name, number, re.sub(r"\s+", " ", text.strip()), about)
        if not open_ones:
            items.append(item)
        open_ones.append(item)
    elif open_ones:
        take_part(text, about, open_ones[-1])


def take_part(text: str, about: str, item: Item) -> None:
    """Take in a line of an item: a component, a bound procedure or an argument."""
    bound = re.match(r"\s*(?:procedure|generic|final)\b.*?::\s*([^!]*)", text)
    if item.kind == "type":
        if bound:
            item.bound += [name.strip() for name in bound[1].split(",")]
        else:
            item.parts += [(n, k, w or about) for n, k, w in declared(text)]
        return
    for name, kind, words in declared(text):
        item.parts = [
            (n, kind, words or about) if n == name and not k else (n, k, w)
            for n, k, w in item.parts
        ]
