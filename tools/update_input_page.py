#!/usr/bin/env python3
"""Bring the tables of doc/input.md up to date: each section of `perigeo --input-reference`.

usage: update_input_page.py PROGRAM PAGE [--check]

A section is a heading `## &group: ...` with what follows it up to the end of its table. The prose
behind the table stays. With --check nothing is written; exit status 1 where a section differs.
"""

import re
import subprocess
import sys
from pathlib import Path

SECTION = re.compile(r"^## &(\w+):[^\n]*\n(?:(?![#|])[^\n]*\n)+(?:\|[^\n]*\n)+", re.MULTILINE)


def updated(page: str, reference: str) -> str:
    """Return the page with the sections of the reference, new ones behind the one before them."""
    new = {section[1]: section[0] for section in SECTION.finditer(reference)}
    old = {section[1]: section[0] for section in SECTION.finditer(page)}
    if len(old) < len(SECTION.findall(page)):
        raise SystemExit("a section stands twice on the page")
    for name in set(old) - set(new):
        raise SystemExit(f"the page has a section &{name}, the program has no such group")
    end = len(page)
    for name, section in reversed(new.items()):
        if name in old:
            end = page.index(old[name])
            page = page[:end] + section + page[end + len(old[name]) :]
        else:
            page = f"{page[:end]}{section}\n{page[end:]}"
    return page


def main() -> None:
    """Update or check a page."""
    program, path = sys.argv[1], Path(sys.argv[2])
    done = subprocess.run(
        [program, "--input-reference"], check=True, capture_output=True, text=True
    )
    page = path.read_text(encoding="utf-8")
    new = updated(page, done.stdout)
    if "--check" in sys.argv and new != page:
        raise SystemExit(f"{path}: differs from --input-reference; run tools/update_input_page.py")
    path.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
