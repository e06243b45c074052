"""Open the site in a browser and check it there: `make site-view`.

    view_site.py [FOLDER] [--output FOLDER]     default: build/site, screenshots in build/site-view

Uses Chromium or Chrome, else Firefox, without a window, as tools/view_report.py does. In the light
and the dark scheme, at the width of a desktop and at 380 pixels, each document must fit, show its
pictures, ask for nothing from elsewhere, and be legible: text of at least 4.5 times the contrast.
The search must find what is looked for, and the switch must change the scheme. Exit status: 0 fine,
1 the site is not as it should be, 2 no site, 3 no browser or no driver for it.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import view_report
from selenium.common.exceptions import NoSuchDriverException, WebDriverException
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait
from urllib3.exceptions import HTTPError

# name, width, height
VIEWS = (("desktop", 1280, 900), ("phone", 380, 800))
PHOTOGRAPHED = {"index.html", "doc/gallery.html", "doc/tutorials/footing.html", "doc/input.html",
                "doc/limits.html", "modules/pd_law.html", "input/index.html",
                "doc/material_law.html", "doc/first_footing.html",
                "doc/coming_from.html"}  # fmt: skip
# Of the pages of modules these stand for all.
SAMPLES = ("modules/index.html", "modules/pd_law.html", "modules/pd_command_line.html",
           "python/index.html", "python/perigeo_post.read.run.html", "input/index.html",
           "input/limit_loads/index.html", "input/compression.nml.html")  # fmt: skip
# Words that are looked for, and a page that must be among the first three.
SEARCHES = {"shape tensor": "doc/theory.html", "yield_stress": "doc/input.html",
            "pd_lattice": "modules/pd_lattice.html"}  # fmt: skip

LOOK = """(() => {
  const root = document.documentElement;
  const channels = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = c => {
    const [r, g, b] = c.map(v => v / 255).map(v =>
      v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = e => {
    for (; e; e = e.parentElement) {
      const c = channels(getComputedStyle(e).backgroundColor);
      if (c.length === 3 || c[3] > 0.5) return c.slice(0, 3);
    }
    return [255, 255, 255];
  };
  const faint = new Set();
  const seen = new Set();  // of one kind of element in one place one is enough
  const wide = [];
  for (const e of document.querySelectorAll('body, body *')) {
    const box = e.getBoundingClientRect();
    if (!box.width) continue;
    if (box.right > root.clientWidth + 0.5 &&
        (!e.closest('.box, pre, .skip') || e.matches('.box, pre'))) wide.push(e);
    const place = e.parentElement;
    const kind = [e, place, place && place.parentElement].map(
      x => x ? x.tagName + '.' + x.className : '').join(' ');
    if (seen.has(kind)) continue;
    if (![...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim())) continue;
    seen.add(kind);
    const pair = [light(channels(getComputedStyle(e).color).slice(0, 3)), light(paper(e))];
    const ratio = (Math.max(...pair) + 0.05) / (Math.min(...pair) + 0.05);
    if (ratio < 4.5) faint.add(e.tagName + '.' + e.className + ' ' + ratio.toFixed(1));
  }
  return JSON.stringify({
    width: root.clientWidth, content: root.scrollWidth, height: root.scrollHeight,
    broken: [...document.images].filter(i => !i.complete || i.naturalWidth === 0).map(i => i.src),
    small: [...document.images].filter(i => i.getBoundingClientRect().width < 40).length,
    wide: wide.slice(0, 5).map(e =>
      e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 30)),
    faint: [...faint].slice(0, 5),
    loaded: performance.getEntriesByType('resource').map(r => r.name),
    paper: getComputedStyle(document.body).backgroundColor,
  });
})()"""


def documents(site: Path) -> list[str]:
    """Return the pages to look at: all that are no module, and some that are."""
    pages = [path.relative_to(site).as_posix() for path in sorted(site.rglob("*.html"))]
    made_of_code = ("modules/", "python/", "input/", "studies/", "src/", "tests/", "tools/")
    chosen = [p for p in pages if not p.startswith(made_of_code) and p.count(".") == 1]
    return chosen + [page for page in SAMPLES if page in pages]


def faults(seen: dict[str, Any], site: str) -> list[str]:
    """Return what is wrong in one view."""
    found = [f"asks for {url[:100]}" for url in seen["loaded"]
             if not url.startswith((site, "data:"))]  # fmt: skip
    found += [f"a picture is not shown: {url[-80:]}" for url in seen["broken"]]
    if seen["small"]:
        found.append(f"{seen['small']} pictures are less than 40 pixels wide")
    if seen["content"] > seen["width"]:
        found.append(f"is {seen['content']} pixels wide in {seen['width']}")
    found += [f"sticks out at the side: {words}" for words in seen["wide"]]
    return found + [f"is hard to read: {words}" for words in seen["faint"]]


class Viewer:
    """One browser in one scheme."""

    def __init__(self, browser: Any, site: Path, folder: Path, scheme: str) -> None:
        self.browser, self.site, self.folder, self.scheme = browser, site, folder, scheme
        self.address = site.resolve().as_uri()
        self.papers: set[str] = set()

    def size(self, width: int, height: int) -> None:
        if hasattr(self.browser, "command"):
            self.browser.command("Emulation.setDeviceMetricsOverride", width=width, height=height,
                                 deviceScaleFactor=1, mobile=width < 600)  # fmt: skip
        else:
            self.browser.browser.set_window_size(width, height)

    def look(self, page: str) -> dict[str, Any]:
        self.browser.browser.get(f"{self.address}/{page}")
        seen: dict[str, Any] = json.loads(self.browser.browser.execute_script(f"return {LOOK}"))
        self.papers.add(seen["paper"])
        return seen

    def pages(self) -> list[str]:
        """Look at all pages at all widths; returns the faults."""
        found = []
        for name, width, height in VIEWS:
            self.size(width, height)
            for page in documents(self.site):
                seen = self.look(page)
                found += [f"{page} ({name}, {self.scheme}) {words}"
                          for words in faults(seen, self.address)]  # fmt: skip
                if page in PHOTOGRAPHED:
                    self.photograph(page, name)
        return found

    def photograph(self, page: str, name: str) -> None:
        stem = page.removesuffix(".html").replace("/", "_")
        path = self.folder / f"{stem}_{name}_{self.scheme}.png"
        self.browser.browser.save_screenshot(str(path))

    def search(self) -> list[str]:
        """Look for some words; returns the faults."""
        found = []
        for words, page in SEARCHES.items():
            self.browser.browser.get(f"{self.address}/doc/results.html")
            field = self.browser.browser.find_element(By.ID, "site-search")
            field.send_keys(words)
            try:
                hits = WebDriverWait(self.browser.browser, 30).until(
                    lambda b: b.find_elements(By.CSS_SELECTOR, "#site-found a")
                )
            except WebDriverException:
                found.append(f"the search finds nothing for {words!r}")
                continue
            if words == "shape tensor":
                self.photograph("search.html", "desktop")
            first = [hit.get_attribute("href") for hit in hits[:3]]
            if not any(f"/{page}" in str(url) for url in first):
                found.append(f"the search for {words!r} does not show {page} first, but {first}")
        return found

    def switch(self) -> list[str]:
        """Use the switch of the scheme; returns the faults."""
        before = self.look("index.html")["paper"]
        self.browser.browser.find_element(By.ID, "site-theme").click()
        style = "return getComputedStyle(document.body).backgroundColor"
        after = self.browser.browser.execute_script(style)
        kept = self.look("doc/input.html")["paper"]
        self.browser.browser.execute_script("localStorage.clear()")
        if before == after:
            return ["the switch does not change the scheme"]
        return [] if kept == after else ["the next page has forgotten the scheme"]


def view(kind: view_report.Kind, program: str, driver: str | None, site: Path, folder: Path) -> int:
    """All views; returns the number of faults."""
    count, papers = 0, []
    for scheme in ("light", "dark"):
        browser = kind(program, driver, scheme == "dark")
        try:
            viewer = Viewer(browser, site, folder, scheme)
            found = viewer.pages()
            viewer.size(*VIEWS[0][1:])
            found += viewer.search() if scheme == "light" else []
            papers.append(set(viewer.papers))
            found += viewer.switch()
        finally:
            browser.browser.quit()
        print(f"  {'FAILED' if found else 'ok    '}  {scheme}: {len(documents(site))} pages, "
              f"{len(VIEWS)} widths")  # fmt: skip
        for words in found[:40]:
            print(f"          {words}")
        count += len(found)
    if papers[0] & papers[1]:
        print("  FAILED  the dark scheme is as light as the other")
        count += 1
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description="Open the site in a browser and check it.")
    parser.add_argument("site", nargs="?", type=Path, default=Path("build/site"))
    parser.add_argument("--output", type=Path, default=Path("build/site-view"), metavar="FOLDER")
    arguments = parser.parse_args()
    site: Path = arguments.site
    if not (site / "index.html").is_file():
        print(f"There is no {site}/index.html; 'make site' makes it.", file=sys.stderr)
        return 2
    found = view_report.find_browser()
    if found is None:
        print(f"No browser: neither Chromium (Chrome) nor Firefox is installed.\n"
              f"{view_report.INSTALL}", file=sys.stderr)  # fmt: skip
        return 3
    arguments.output.mkdir(parents=True, exist_ok=True)
    print(f"{site} in {Path(found[1]).name}; screenshots in {arguments.output}")
    os.environ.setdefault("SE_AVOID_STATS", "true")
    if os.environ.get("NO_INSTALL") == "1":
        os.environ["SE_OFFLINE"] = "true"
    try:
        count = view(*found, site, arguments.output)
    except NoSuchDriverException:
        print(f"No driver for {found[1]}.\n{view_report.INSTALL}", file=sys.stderr)
        return 3
    except (WebDriverException, HTTPError, OSError) as error:
        print(f"{found[1]}: {str(error).splitlines()[0]}", file=sys.stderr)
        return 3
    print(f"site-view: {'all pages are fine' if count == 0 else f'{count} faults'}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
