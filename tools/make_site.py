"""Make the site, for `make site`:  .venv/bin/python tools/make_site.py FOLDER [--quick]

Documents, tutorials, gallery and a page for every module, in one theme (tools/site_pages/theme).
The pages link to each other as the documents do, are searched and read from the file system, and
load nothing from elsewhere. Ends with 1 where a link, an anchor or a picture leads nowhere.
--quick leaves the syntax of sources unmarked.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from site_pages.build import Site
from site_pages.faults import faults


def main() -> int:
    parser = argparse.ArgumentParser(description="Make the site.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--quick", action="store_true", help="leave the syntax unmarked")
    arguments = parser.parse_args()
    site = Site(arguments.folder.resolve(), quick=arguments.quick)
    pages = site.build()
    problems = [*site.dead, *faults(site.output)]
    for problem in problems[:40]:
        print(problem, file=sys.stderr)
    if problems:
        print(f"make_site: {len(problems)} faults", file=sys.stderr)
        return 1
    print(f"{pages} pages; begin with {arguments.folder}/index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
