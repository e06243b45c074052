"""Open the report in a browser and check it there: `make report-view`.

    view_report.py [PAGE] [--output FOLDER]     default: results/report.html, beside the page

Uses Chromium or Chrome, else Firefox, without a window. At the width of a desktop and of two
phones it checks that the page asks for nothing outside itself, that all pictures are shown and
that nothing sticks out at the side, in the light and the dark scheme, and writes screenshots. Exit
status: 0 fine, 1 the page is not as it should be, 2 no page, 3 no browser or no driver for it.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Union

try:
    from selenium import webdriver
    from selenium.common.exceptions import NoSuchDriverException, WebDriverException
    from urllib3.exceptions import HTTPError
except ModuleNotFoundError:
    print("selenium is not installed; 'make report-view' installs it.", file=sys.stderr)
    sys.exit(3)

WAIT = 60.0  # seconds for loading the page
PIECE = 8000  # a longer page is photographed in pieces of this height [CSS pixels]
TALLEST = 30000  # Firefox makes one picture of at most this height

INSTALL = """\
To install a browser with the driver that selenium needs:
  Debian          apt-get install chromium chromium-driver
  Fedora          dnf install chromium chromedriver
  Arch            pacman -S chromium
  macOS           brew install --cask chromium chromedriver
A browser elsewhere: BROWSER_BIN=/path/to/program make report-view"""

# name, width, height, dark, screenshot
VIEWS = (
    ("desktop", 1200, 900, False, True),
    ("phone", 390, 844, False, True),
    ("narrow phone", 380, 800, False, False),
    ("desktop dark", 1200, 900, True, False),
    ("phone dark", 390, 844, True, True),
)

# What the page is like, as the browser sees it. All <details> are opened first: what is folded
# must fit too.
LOOK = """(() => {
  const folded = [...document.querySelectorAll('details:not([open])')];
  folded.forEach(d => { d.open = true; });
  const root = document.documentElement;
  const wide = [...document.querySelectorAll('body *')].filter(e => {
    if (e.closest('.box, pre, .skip') && !e.matches('.box, pre')) return false;
    return e.getBoundingClientRect().right > root.clientWidth + 0.5;
  }).slice(0, 5).map(e => e.tagName.toLowerCase() + (e.className ? '.' + e.className : ''));
  const seen = {
    title: document.title,
    width: root.clientWidth, content: root.scrollWidth,
    images: document.images.length,
    broken: [...document.images].filter(i => !i.complete || i.naturalWidth === 0)
      .map(i => i.alt || '(without a text)'),
    small: [...document.images].filter(i => i.getBoundingClientRect().width < 40).length,
    wide: wide,
    loaded: [...new Set(performance.getEntriesByType('resource').map(r => r.name).concat(
      [...document.querySelectorAll('[src]')].map(e => e.src)))]
      .filter(n => !n.startsWith('data:')),
    paper: getComputedStyle(document.body).backgroundColor,
  };
  folded.forEach(d => { d.open = false; });
  seen.height = root.scrollHeight;
  return JSON.stringify(seen);
})()"""


class Chromium:
    """Chromium or Chrome; its own protocol (CDP) makes a phone of it."""

    programs = (
        "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome",
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        "/Applications/Chromium.app/Contents/MacOS/Chromium",
    )  # fmt: skip
    drivers = ("chromedriver", "chromium.chromedriver")

    def __init__(self, program: str, driver: str | None, dark: bool) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = program
        for word in ("headless=new", "no-first-run", "disable-gpu", "disable-dev-shm-usage",
                     "hide-scrollbars", "disable-background-networking"):  # fmt: skip
            options.add_argument(f"--{word}")
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            options.add_argument("--no-sandbox")  # Chromium refuses to start as root with it
        # The log of performance holds the requests.
        options.set_capability("goog:loggingPrefs", {"performance": "ALL"})
        service = webdriver.ChromeService(executable_path=driver)
        self.browser = webdriver.Chrome(options=options, service=service)
        self.browser.set_page_load_timeout(WAIT)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.command("Emulation.setEmulatedMedia", features=[scheme])

    def command(self, name: str, **values: Any) -> Any:
        return self.browser.execute_cdp_cmd(name, values)

    def requests(self) -> set[str]:
        """What was asked for since the last call."""
        log = self.browser.get_log("performance")
        events = [json.loads(entry["message"])["message"] for entry in log]
        return {event["params"]["request"]["url"] for event in events
                if event["method"] == "Network.requestWillBeSent"}  # fmt: skip

    def open(self, address: str, width: int, height: int) -> dict[str, Any]:
        """Load the page at this size, anew; what it is like."""
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height,
                     deviceScaleFactor=2, mobile=width < 600)  # fmt: skip
        self.requests()
        self.browser.get(address)
        seen: dict[str, Any] = json.loads(self.browser.execute_script(f"return {LOOK}"))
        outside = {url for url in self.requests() if not url.startswith("data:")} - {address}
        seen["loaded"] = sorted({*seen["loaded"], *outside})
        return seen

    def pictures(self, seen: dict[str, Any]) -> Iterator[bytes]:
        """Screenshots of the whole page, from the top."""
        for top in range(0, seen["height"], PIECE):
            part = min(PIECE, seen["height"] - top)
            clip = {"x": 0, "y": top, "width": seen["width"], "height": part, "scale": 0.5}
            found = self.command(
                "Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip
            )
            yield base64.b64decode(found["data"])


class Firefox:
    """Firefox; its window cannot be as narrow as a phone, so the page stands in a frame."""

    programs = ("firefox", "firefox-esr", "/Applications/Firefox.app/Contents/MacOS/firefox")
    drivers = ("geckodriver",)

    def __init__(self, program: str, driver: str | None, dark: bool) -> None:
        options = webdriver.FirefoxOptions()
        options.binary_location = program
        options.add_argument("-headless")
        scheme = "layout.css.prefers-color-scheme.content-override"
        options.set_preference(scheme, 0 if dark else 1)
        options.set_preference("security.fileuri.strict_origin_policy", False)
        options.set_preference("ui.useOverlayScrollbars", 1)
        service = webdriver.FirefoxService(executable_path=driver)
        self.browser = webdriver.Firefox(options=options, service=service)
        self.browser.set_page_load_timeout(WAIT)
        self.browser.set_window_size(500, 1000)

    def open(self, address: str, width: int, height: int) -> dict[str, Any]:
        """Load the page at this size, anew; what it is like."""
        with tempfile.TemporaryDirectory(prefix="perigeo-view.") as folder:
            holder = Path(folder) / "holder.html"
            holder.write_text(
                f"<!doctype html><body style='margin:0'><iframe src='{address}' "
                f"style='border:0;width:{width}px;height:{height}px'></iframe></body>"
            )
            self.browser.get(holder.as_uri())
        self.browser.switch_to.frame(0)
        seen: dict[str, Any] = json.loads(self.browser.execute_script(f"return {LOOK}"))
        return seen

    def pictures(self, seen: dict[str, Any]) -> Iterator[bytes]:
        """A screenshot of the whole page."""
        self.browser.switch_to.default_content()
        height = min(seen["height"], TALLEST)
        style = "document.querySelector('iframe').style"
        self.browser.execute_script(f"{style}.height = '{height}px';")
        yield self.browser.get_full_page_screenshot_as_png()


Kind = Union[type[Chromium], type[Firefox]]


def find_browser() -> tuple[Kind, str, str | None] | None:
    """Kind, program and driver of the browser to use; $BROWSER_BIN goes first.

    A browser with its driver goes before one without, for which selenium gets one.
    """
    wanted = os.environ.get("BROWSER_BIN")
    found = []
    for kind in (Chromium, Firefox):
        if wanted and (kind is Firefox) != ("firefox" in wanted.lower()):
            continue
        program = first_of([wanted] if wanted else kind.programs)
        if program:
            found.append((kind, program, first_of(kind.drivers)))
    return min(found, key=lambda item: item[2] is None, default=None)


def first_of(names: Sequence[str]) -> str | None:
    """The first of these programs that is there."""
    return next((path for path in map(shutil.which, names) if path), None)


def faults(seen: dict[str, Any]) -> list[str]:
    """What is wrong in one view."""
    found = [f"the page asks for {address[:100]}" for address in seen["loaded"]]
    found += [f"a picture is not shown: {alt[:80]}" for alt in seen["broken"]]
    if seen["small"]:
        found.append(f"{seen['small']} pictures are less than 40 pixels wide")
    if seen["content"] > seen["width"]:
        found.append(f"the page is {seen['content']} pixels wide in {seen['width']}")
    if seen["wide"]:
        found.append("these stick out at the side: " + ", ".join(seen["wide"]))
    return found


def view(browser: Chromium | Firefox, page: Path, folder: Path, dark: bool) -> tuple[int, set[str]]:
    """The views of one scheme; returns how many faults there are, and the colours of the page."""
    count = 0
    papers = set()
    for name, width, height, scheme, photographed in VIEWS:
        if scheme != dark:
            continue
        seen = browser.open(page.resolve().as_uri(), width, height)
        papers.add(seen["paper"])
        found = faults(seen)
        count += len(found)
        print(f"  {'FAILED' if found else 'ok    '}  {name}, {width} pixels: "
              f"{seen['images']} pictures, {seen['height']} pixels high")  # fmt: skip
        for words in found:
            print(f"          {words}")
        if photographed:
            stem = f"{page.stem}_{name.replace(' ', '_')}"
            for old in folder.glob(f"{stem}*.png"):
                if old.stem == stem or old.stem[len(stem) + 1 :].isdigit():
                    old.unlink()
            for k, data in enumerate(browser.pictures(seen), start=1):
                path = folder / (f"{stem}.png" if k == 1 else f"{stem}_{k}.png")
                path.write_bytes(data)
                print(f"          wrote {path}")
    return count, papers


def view_all(kind: Kind, program: str, driver: str | None, page: Path, folder: Path) -> int:
    """All views of the page; returns how many faults there are."""
    count = 0
    papers = []
    for dark in (False, True):
        # Firefox reads the scheme when it starts.
        browser = kind(program, driver, dark)
        try:
            more, found = view(browser, page, folder, dark)
        finally:
            browser.browser.quit()
        count += more
        papers.append(found)
    if papers[0] & papers[1]:
        print("  FAILED  the dark scheme is as light as the other")
        count += 1
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description="Open the report in a browser and check it.")
    parser.add_argument("page", nargs="?", type=Path, default=Path("results/report.html"))
    parser.add_argument("--output", type=Path, metavar="FOLDER", help="for the screenshots")
    arguments = parser.parse_args()
    page: Path = arguments.page
    folder: Path = arguments.output or page.parent
    if not page.is_file():
        print(f"There is no {page}; 'make report' makes it.", file=sys.stderr)
        return 2
    found = find_browser()
    if found is None:
        print(f"No browser: neither Chromium (Chrome) nor Firefox is installed.\n{INSTALL}",
              file=sys.stderr)  # fmt: skip
        return 3
    kind, program, driver = found
    folder.mkdir(parents=True, exist_ok=True)
    print(f"{page} in {Path(program).name}")
    # Selenium may get a driver, but tells nobody of it.
    os.environ.setdefault("SE_AVOID_STATS", "true")
    if os.environ.get("NO_INSTALL") == "1":
        os.environ["SE_OFFLINE"] = "true"
    try:
        count = view_all(kind, program, driver, page, folder)
    except NoSuchDriverException:
        print(f"No driver for {program}: there is no {kind.drivers[0]}.\n{INSTALL}",
              file=sys.stderr)  # fmt: skip
        return 3
    except (WebDriverException, HTTPError, OSError) as error:
        words = str(getattr(error, "msg", None) or error) or type(error).__name__
        print(f"{program}: {words.splitlines()[0]}", file=sys.stderr)
        return 3
    print(f"report-view: {'all views are fine' if count == 0 else f'{count} faults'}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
