"""Small mechanical faults in Fortran source: where they can be planted, and what they change.

A fault belongs to one statement. Declarations, texts, comments, directives, messages, estimates
of the memory and times of kernels have none. Calls without an influence on numbers
(`WITHOUT_NUMBERS`), or with one only where there are several ranks, are not dropped:
`make test MPI=1` looks at these.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

WITHOUT_NUMBERS = re.compile(
    r"forget_rows|lap|lap_blocks|begin|move_alloc|add|complain|exchange|bring|share_rows|"
    r"begin_swap|help|await",
    re.I,
)
NOT_EXECUTED = re.compile(
    r"(use|implicit|private|public|module|submodule|contains|end|type|interface|abstract|import|"
    r"procedure|generic|final|sequence|program|integer|real|logical|character|class|complex|"
    r"select|allocate|deallocate|write|print|read|open|close|inquire|format|error|stop|continue|"
    r"((pure|impure|elemental|recursive)\s+)*(subroutine|function))\b",
    re.I,
)
REAL = re.compile(r"(?<![\w%.])\d+\.\d*(?:[ed][+-]?\d+)?(?:_\w+)?", re.I)
INTEGER = re.compile(r"(?<![\w%.])\d+(?![\w.])")
SWAPPED = {
    "min": "max",
    "max": "min",
    "minval": "maxval",
    "maxval": "minval",
    "any": "all",
    "all": "any",
    "floor": "ceiling",
    "ceiling": "floor",
    "sin": "cos",
    "cos": "sin",
    "sqrt": "",
    "abs": "",
    "transpose": "",
}
# of the bytes that arrays take; times of kernels
ESTIMATE = re.compile(r"(if\s*\(.*\)\s*)?memory\s*=|if\s*\(timed\)", re.I)
CALLED = re.compile(rf"(?<![\w%])({'|'.join(SWAPPED)})(?=\()", re.I)
WORDS = {
    ".and.": (".or.",),
    ".or.": (".and.",),
    ".not.": ("",),
    ".true.": (".false.",),
    ".false.": (".true.",),
}
RELATIONS = {
    "<": ("<=", ">"),
    "<=": ("<", ">="),
    ">": (">=", "<"),
    ">=": (">", "<="),
    "==": ("/=",),
    "/=": ("==",),
}
SYMBOL = re.compile(r"\*\*|//|=>|\(/|/\)|<=|>=|==|/=|[-+*/<>]")


@dataclass(frozen=True)
class Statement:
    """One statement of a source file: offsets of its text, and what is code in it."""

    begin: int
    end: int
    line: int
    code: str  # as long as the text; texts and comments are blanked out


@dataclass(frozen=True)
class Fault:
    """One change of one statement."""

    path: str
    line: int
    begin: int
    end: int
    new: str
    old_statement: str
    new_statement: str

    def plant(self, text: str) -> str:
        """Return the source with the fault in it; lines keep their numbers."""
        lost = text[self.begin : self.end].count("\n") - self.new.count("\n")
        rest = text[self.end :]
        head, newline, tail = rest.partition("\n")
        return text[: self.begin] + self.new + head + newline + "\n" * lost + tail

    @property
    def key(self) -> tuple[str, str, str]:
        return self.path, self.old_statement, self.new_statement

    def __str__(self) -> str:
        return f"{self.path}\n- {self.old_statement}\n+ {self.new_statement}"


def blank_texts(line: str) -> str:
    """Return a line with texts replaced by `"` and comments by blanks, of the same length."""
    out, quote = [], ""
    for k, c in enumerate(line):
        if quote:
            out.append('"')
            if c == quote:
                quote = ""
        elif c in "'\"":
            quote = c
            out.append('"')
        elif c == "!":
            return "".join(out) + " " * (len(line) - k)
        else:
            out.append(c)
    return "".join(out)


def statements(text: str) -> Iterator[Statement]:
    """Return the statements of a source file in their order."""
    offset, begin, first, code = 0, 0, 0, ""
    for number, line in enumerate(text.splitlines(keepends=True), start=1):
        clean = blank_texts(line.rstrip("\n"))
        clean += " " * (len(line) - len(clean))
        if not code:
            begin, first = offset, number
        offset += len(line)
        if code and clean.lstrip().startswith("&"):
            clean = clean.replace("&", " ", 1)
        going_on = clean.rstrip().endswith("&")
        if going_on:
            at = clean.rindex("&")
            clean = clean[:at] + " " + clean[at + 1 :]
        code += clean
        # a comment between lines that belong together ends nothing
        if going_on or (code.strip() and not clean.strip()):
            continue
        if code.strip():
            skip = len(code) - len(code.lstrip())
            kept = code.strip()
            yield Statement(begin + skip, begin + skip + len(kept), first, kept)
        code = ""


def closing(code: str, opening: int) -> int:
    """Return the position of the parenthesis that closes the one at a position."""
    depth = 0
    for k in range(opening, len(code)):
        depth += {"(": 1, ")": -1}.get(code[k], 0)
        if depth == 0:
            return k
    return len(code)


def action_of(code: str) -> tuple[int, int]:
    """Return where the condition of `if (...) action` ends, and where the action begins."""
    found = re.match(r"(?:else\s+)?if\s*\(|where\s*\(", code, re.I)
    if not found:
        return 0, 0
    end = closing(code, found.end() - 1)
    action = end + 1 + len(code[end + 1 :]) - len(code[end + 1 :].lstrip())
    return end, action


def changes(code: str) -> Iterator[tuple[int, int, str]]:
    """Return all changes of a statement: begin, end, new text."""
    head = re.match(r"(?:\w+\s*:\s*)?do\b", code, re.I)
    condition_end, action = action_of(code)
    if code.lower().startswith("if") and condition_end:
        opening = code.index("(")
        yield opening, condition_end + 1, f"(.not. {code[opening : condition_end + 1]})"
    call = re.match(r"call\s+(?:[\w%]*%)?(\w+)", code[action:], re.I)
    silent = call is not None and WITHOUT_NUMBERS.fullmatch(call[1]) is not None
    if '"' in code or silent:  # a message and the like: only the condition before it
        if '"' in code[:condition_end]:
            return
        code = code[:condition_end]
    elif not head:
        yield from dropped(code, action)
    yield from expression_changes(code)


def dropped(code: str, action: int) -> Iterator[tuple[int, int, str]]:
    """Return the change that leaves out what a statement does, if it can be left out."""
    what = code[action:]
    if re.match(r"(call|return|exit|cycle)\b", what, re.I) or (
        re.match(r"[\w%]+(\([^=]*\)[\w%]*)*\s*=(?!=|>)", what) and not code.startswith("forall")
    ):
        yield action, len(code), "continue"


def expression_changes(code: str) -> Iterator[tuple[int, int, str]]:
    """Return the changes of operators, numbers and functions of a statement."""
    reals = [(m.start(), m.end()) for m in REAL.finditer(code)]
    for match in SYMBOL.finditer(code):
        if not any(a <= match.start() < b for a, b in reals):
            yield from operator_changes(code, match)
    for a, b in reals:
        yield a, b, other_real(code[a:b])
    for match in INTEGER.finditer(code):
        if not any(a <= match.start() < b for a, b in reals):
            yield match.start(), match.end(), other_integer(code, match)
    for match in CALLED.finditer(code):
        yield match.start(), match.end(), SWAPPED[match[1].lower()]
    for match in re.finditer(r"\.(and|or|not|true|false)\.", code, re.I):
        for new in WORDS[match[0].lower()]:
            yield match.start(), match.end(), new


def operator_changes(code: str, match: re.Match[str]) -> Iterator[tuple[int, int, str]]:
    """Return the changes of one operator."""
    a, b, symbol = match.start(), match.end(), match[0]
    if symbol in RELATIONS:
        for new in RELATIONS[symbol]:
            yield a, b, new
    elif symbol in "+-":
        before = code[:a].rstrip()
        if not before or before[-1] in "(,=*/+-<>:[" or before.lower().endswith((".and.", ".or.")):
            yield a, b, "+" if symbol == "-" else "-"
        else:
            yield a, b, "-" if symbol == "+" else "+"
    elif symbol in "*/" and code[:a].rstrip()[-1:] not in ("(", ",", ""):  # not as in `x(*)`
        yield a, b, "/" if symbol == "*" else "*"


def other_real(text: str) -> str:
    """Return another number: 0 -> 1, 1 -> 2, 0.5 -> 0.25, small ones a thousand times as large."""
    number, _, kind = text.partition("_")
    value = float(number.lower().replace("d", "e"))
    if 0.0 < value < 1e-2:
        new = 1000.0 * value
    elif value == int(value) and value < 1e6:
        new = value + 1.0
    else:
        new = 0.5 * value
    return repr(new) + (f"_{kind}" if kind else "")


def other_integer(code: str, match: re.Match[str]) -> str:
    """Return another number: the other component where it is one, else the next."""
    value, before = int(match[0]), code[: match.start()].rstrip()[-1:]
    after = code[match.end() :].lstrip()[:1]
    if value in (1, 2) and before in "(," and after in "),":
        return str(3 - value)
    return str(value + 1)


def tidy(code: str) -> str:
    """Return a statement on one line with single blanks."""
    return re.sub(r"\s+", " ", code).strip()


def without_marks(text: str) -> str:
    """Return the text of a statement as it is listed: no comments, no marks of continuation."""
    out = []
    for line in text.split("\n"):
        clean = blank_texts(line)
        cut = re.sub(r"&\s*$", "", line[: len(clean.rstrip())])
        out.append(re.sub(r"^\s*&", "", cut))
    return tidy(" ".join(out))


def faults_of(path: str, text: str) -> list[list[Fault]]:
    """Return the faults of a source file, a list for each statement that can have one."""
    found = []
    for s in statements(text):
        if NOT_EXECUTED.match(s.code) or ESTIMATE.match(s.code) or "::" in s.code:
            continue
        whole = text[s.begin : s.end]
        old = without_marks(whole)
        here, seen = [], set()
        for a, b, new in changes(s.code):
            # a change that goes over lines takes their marks of continuation along
            replaced = whole[:a] + new + whole[b:]
            if new.startswith("(.not."):
                new = "(.not. " + whole[a:b] + ")"
                replaced = whole[:a] + new + whole[b:]
            changed = without_marks(replaced)
            if changed == old or changed in seen:
                continue
            seen.add(changed)
            line = s.line + whole[:a].count("\n")
            here.append(Fault(path, line, s.begin + a, s.begin + b, new, old, changed))
        if here:
            found.append(here)
    return found
