"""A reader of namelist files of its own, written from doc/input.md and not from the program.

`read` is strict: a file that it refuses must not be accepted by the program either.
"""

import re

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ed][+-]?\d+)?", re.I)
NAME = re.compile(r"[a-z_][a-z0-9_]*", re.I)
BLANKS = re.compile("[\u00a0\u2000-\u200b\u202f]")  # of word processors
PIECE = re.compile(
    r"""(?P<blank>[ \t\r\n]+|![^\r\n]*)
      | (?P<text>'(?:[^'\r\n]|'')*'|"(?:[^"\r\n]|"")*")
      | &(?P<group>[A-Za-z_][A-Za-z0-9_]*)(?=[\s/!,]|$)
      | (?P<mark>[=,/])
      | (?P<repeat>\d+)\*(?=[-+.\d'"])
      | (?P<word>[^\s,/=!&'"*]+)""",
    re.X,
)


class NotPlain(Exception):  # noqa: N818 (no error: the text is not a plain namelist file)
    """What the rules of doc/input.md do not allow."""


def decoded(data):
    """Return the bytes of a file as text: UTF-8 with its mark or without, else Latin-1."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return BLANKS.sub(" ", text)


def pieces(text):
    """Return the pieces of a text as (kind, content), blanks and comments left out."""
    at, found = 0, []
    while at < len(text):
        piece = PIECE.match(text, at)
        if piece is None:
            raise NotPlain(f"{text[at : at + 20]!r}")
        if piece.lastgroup != "blank":
            found.append((piece.lastgroup, piece.group(piece.lastgroup)))
        at = piece.end()
    return found


def value_of(kind, content):
    """Return a value: a text, or a number as float."""
    if kind == "text":
        quote = content[0]
        return content[1:-1].replace(2 * quote, quote)
    if kind != "word" or not NUMBER.fullmatch(content):
        raise NotPlain(f"a value {content!r}")
    return float(content.lower().replace("d", "e"))


def read(text):
    """Return the groups of a text: (name, {key: [values]}) each, names in small letters."""
    found, groups, at = pieces(text), [], 0

    def kind(i):
        return found[i][0] if i < len(found) else ""

    def is_mark(i, which):
        return i < len(found) and found[i] == ("mark", which)

    while at < len(found):
        if kind(at) != "group":
            raise NotPlain("text outside of a group")
        keys = {}
        groups.append((found[at][1].lower(), keys))
        at += 1
        while not is_mark(at, "/"):
            while is_mark(at, ","):
                at += 1
            if is_mark(at, "/"):
                break
            if kind(at) != "word" or not is_mark(at + 1, "=") or not NAME.fullmatch(found[at][1]):
                raise NotPlain("a key was due")
            key, values = found[at][1].lower(), []
            if key in keys:
                raise NotPlain(f"{key} twice")
            keys[key] = values
            at += 2
            comma = True
            while not is_mark(at, "/") and not is_mark(at + 1, "="):
                if is_mark(at, ","):
                    if comma:
                        raise NotPlain("an empty value")
                    comma = True
                    at += 1
                    continue
                times = 1
                if kind(at) == "repeat":
                    times = int(found[at][1])
                    at += 1
                if kind(at) not in ("word", "text") or not 1 <= times <= 10000:
                    raise NotPlain("a value was due")
                values += times * [value_of(*found[at])]
                comma = False
                at += 1
            if not values:
                raise NotPlain(f"{key} has no value")
        at += 1
    return groups


def written(groups):
    """Return the text of groups."""

    def form(value):
        if isinstance(value, str):
            return "'" + value.replace("'", "''") + "'"
        return str(int(value)) if abs(value) < 1e15 and value == int(value) else str(value)

    lines = []
    for name, keys in groups:
        lines.append(f"&{name}")
        lines += [f"  {key} = {', '.join(map(form, values))}" for key, values in keys.items()]
        lines.append("/")
    return "\n".join(lines) + "\n"
