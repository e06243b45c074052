"""Where outputs may go: never over an input, a result, or anything else that is not theirs.

Everything in this package that writes a file on a user's word asks `check_output` first. A name
that was forgotten or mixed up must not cost a result of hours.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path

from .errors import OutputError

HDF5 = b"\x89HDF\r\n\x1a\n"
CHECKPOINT = b"perigeo checkpoint"  # in front of the HDF5 part
FIGURES = (b"\x89PNG\r\n\x1a\n", b"%PDF-", b"%!PS-Adobe", b"GIF87a", b"GIF89a")
_GROUP = re.compile(rb"^[ \t]*&[a-z_]+\b", re.MULTILINE | re.IGNORECASE)
_HEAD = 65536  # bytes of a file that are looked at

FIGURE = "figure"
TABLE = "table"
PAGE = "page"
FIELDS = "file of fields"  # for other programs: VTU and PVD of `export`


def check_output(path: str | Path, kind: str, inputs: Iterable[str | Path] = ()) -> Path:
    """The path, if a figure, table or page may be written there.

    What is there already may be replaced by its like: a figure by a figure, a table by a table, a
    page by a page. An input of the same command, a result, a history, a checkpoint and a namelist
    are refused in any case.
    """
    path = Path(path)
    if not path.exists():
        return path
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder")
    for given in inputs:
        if Path(given).exists() and path.samefile(given):
            raise OutputError(f"{path} is an input of this command: it is not overwritten")
    if not path.is_file():
        return path  # a pipe, a terminal, /dev/null
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    found = _kind_of(head, path)
    if found not in (kind, "empty file"):
        raise OutputError(
            f"{path} is not overwritten: it holds a {found}, not a {kind}; is a name missing "
            "before it? If it is not needed, remove it first"
        )
    return path


def _kind_of(head: bytes, path: Path) -> str:
    """What a file is by how it begins."""
    if not head.strip():
        return "empty file"
    if head.startswith(CHECKPOINT):
        return "checkpoint"
    if head.startswith(HDF5):
        return "result"
    if head.startswith(FIGURES) or head[4:8] == b"ftyp":  # the latter: MP4
        return FIGURE
    if head.lstrip().startswith(b"<?xml") and b"<svg" in head:
        return FIGURE
    if b"<VTKFile" in head:
        return FIELDS
    if head.lstrip().lower().startswith(b"<!doctype html"):
        return PAGE
    lines = head.splitlines()
    if lines[0].startswith(b"step,time,"):
        return "history"
    if path.suffix.lower() == ".nml" or _GROUP.search(head):
        return "namelist"
    return TABLE if _is_table(lines[:2]) else "file of another kind"


def _is_table(lines: list[bytes]) -> bool:
    """Whether lines begin a table as `write_rows` writes it: several names, then as many cells."""
    try:
        rows = list(csv.reader(line.decode() for line in lines))
    except (UnicodeDecodeError, csv.Error):
        return False
    return len({len(row) for row in rows}) == 1 and len(rows[0]) > 1 and rows[0][0].isidentifier()
