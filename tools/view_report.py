"""Open the report in a browser and check it there: `make report-view`.

    view_report.py [PAGE] [--output FOLDER]     default: results/report.html, beside the page

Uses Chromium or Chrome, else Firefox, without a window. At the width of a desktop and of two
phones it checks that the page asks for nothing outside itself, that all pictures are shown and
that nothing sticks out at the side, in the light and the dark scheme, and writes screenshots. Exit
status: 0 fine, 1 the page is not as it should be, 2 no page, 3 no browser.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FIREFOX = ("firefox", "firefox-esr")
APPLICATIONS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Firefox.app/Contents/MacOS/firefox",
)
WAIT = 60.0  # seconds for one answer of the browser
PIECE = 8000  # a longer page is photographed in pieces of this height [CSS pixels]
TALLEST = 30000  # Firefox makes one picture of at most this height

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


class BrowserError(Exception):
    """The browser does not do what it was asked."""


class Chromium:
    """Chromium by its own protocol: JSON, each message ended by a zero byte, over two pipes."""

    def __init__(self, program: str, profile: Path) -> None:
        command = [
            program, "--headless=new", "--remote-debugging-pipe", "--no-first-run",
            "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
            "--disable-background-networking", f"--user-data-dir={profile}",
        ]  # fmt: skip
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.append("--no-sandbox")  # Chromium refuses to start as root with it
        to_read, self.to_browser = os.pipe()
        self.from_browser, to_write = os.pipe()

        def connect() -> None:  # the browser reads from 3 and writes to 4
            first, second = os.dup(to_read), os.dup(to_write)
            os.dup2(first, 3)
            os.dup2(second, 4)

        self.process = subprocess.Popen(
            command, preexec_fn=connect, close_fds=False, start_new_session=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_read)
        os.close(to_write)
        self.count = 0
        self.left = b""
        self.requests: list[str] = []
        self.loaded = False
        target = self.ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        attach = {"targetId": target, "flatten": True}
        self.session = self.ask("Target.attachToTarget", attach)["sessionId"]
        for domain in ("Page", "Network", "Runtime"):
            self.page(f"{domain}.enable")

    def message(self) -> dict[str, Any]:
        """The next message of the browser; requests and the end of loading are noted."""
        while b"\0" not in self.left:
            chunk = os.read(self.from_browser, 1 << 20)
            if not chunk:
                raise BrowserError("the browser has ended")
            self.left += chunk
        text, _, self.left = self.left.partition(b"\0")
        found: dict[str, Any] = json.loads(text)
        if found.get("method") == "Network.requestWillBeSent":
            self.requests.append(found["params"]["request"]["url"])
        if found.get("method") == "Page.loadEventFired":
            self.loaded = True
        return found

    def ask(self, method: str, params: dict[str, Any] | None = None, **more: Any) -> Any:
        """Send a command and wait for its answer."""
        self.count += 1
        words = {"id": self.count, "method": method, "params": params or {}, **more}
        os.write(self.to_browser, json.dumps(words).encode() + b"\0")
        while True:
            answer = self.message()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def page(self, method: str, params: dict[str, Any] | None = None) -> Any:
        return self.ask(method, params, sessionId=self.session)

    def open(self, address: str, width: int, height: int, dark: bool) -> dict[str, Any]:
        """Load the page at this size, anew; what it is like."""
        size = {"width": width, "height": height, "deviceScaleFactor": 2, "mobile": width < 600}
        self.page("Emulation.setDeviceMetricsOverride", size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.page("Emulation.setEmulatedMedia", {"features": [scheme]})
        self.requests, self.loaded = [], False
        self.page("Page.navigate", {"url": address})
        while not self.loaded:
            self.message()
        found = self.page("Runtime.evaluate", {"expression": LOOK, "returnByValue": True})
        if "exceptionDetails" in found:
            raise BrowserError(f"the check did not run: {found['exceptionDetails']}")
        seen: dict[str, Any] = json.loads(found["result"]["value"])
        outside = [u for u in self.requests if not u.startswith("data:") and u != address]
        seen["loaded"] = sorted({*seen["loaded"], *outside})
        return seen

    def pictures(self, seen: dict[str, Any]) -> Iterator[bytes]:
        """Screenshots of the whole page, from the top."""
        top = 0
        while top < seen["height"]:
            part = min(PIECE, seen["height"] - top)
            clip = {"x": 0, "y": top, "width": seen["width"], "height": part, "scale": 0.5}
            found = self.page(
                "Page.captureScreenshot",
                {"format": "png", "captureBeyondViewport": True, "clip": clip},
            )
            yield base64.b64decode(found["data"])
            top += part

    def close(self) -> None:
        with contextlib.suppress(BrowserError, OSError):
            self.ask("Browser.close")
        os.close(self.to_browser)
        os.close(self.from_browser)
        end(self.process)


class Firefox:
    """Firefox by Marionette: JSON over a socket, each message after its length and a colon.

    Its window cannot be as narrow as a phone, so the page stands in a frame of the width asked for.
    """

    def __init__(self, program: str, profile: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.profile = profile
        settings = {
            "marionette.port": port, "browser.shell.checkDefaultBrowser": False,
            "datareporting.policy.dataSubmissionEnabled": False, "app.update.enabled": False,
            "network.captive-portal-service.enabled": False,
            "security.fileuri.strict_origin_policy": False,
            "ui.useOverlayScrollbars": 1, "ui.systemUsesDarkTheme": 0,
            "layout.css.prefers-color-scheme.content-override": 1,
        }  # fmt: skip
        lines = [f'user_pref("{key}", {json.dumps(value)});' for key, value in settings.items()]
        (profile / "user.js").write_text("\n".join(lines) + "\n")
        self.process = subprocess.Popen(
            [
                program, "--headless", "--marionette", "--remote-allow-system-access",
                "--no-remote", "--profile", str(profile),
            ],
            start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.line = self.connect(port)
        self.left = b""
        self.count = 0
        self.message()  # its greeting
        self.ask("WebDriver:NewSession")
        self.ask("WebDriver:SetWindowRect", {"width": 500, "height": 1000})

    def connect(self, port: int) -> socket.socket:
        until = time.monotonic() + WAIT
        while time.monotonic() < until and self.process.poll() is None:
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=WAIT)
            except OSError:
                time.sleep(0.2)
        end(self.process)
        raise BrowserError("Firefox does not answer")

    def message(self) -> Any:
        while b":" not in self.left:
            self.receive()
        length, _, self.left = self.left.partition(b":")
        while len(self.left) < int(length):
            self.receive()
        text, self.left = self.left[: int(length)], self.left[int(length) :]
        return json.loads(text)

    def receive(self) -> None:
        try:
            chunk = self.line.recv(1 << 20)
        except OSError as error:
            raise BrowserError(f"Firefox does not answer ({error})") from error
        if not chunk:
            raise BrowserError("the browser has ended")
        self.left += chunk

    def ask(self, method: str, params: dict[str, Any] | None = None) -> Any:
        self.count += 1
        text = json.dumps([0, self.count, method, params or {}]).encode()
        self.line.sendall(b"%d:%s" % (len(text), text))
        while True:
            answer = self.message()
            if answer[1] == self.count:
                if answer[2]:
                    raise BrowserError(f"{method}: {answer[2].get('message')}")
                return answer[3]

    def run(self, script: str) -> Any:
        return self.ask("WebDriver:ExecuteScript", {"script": script, "args": []})["value"]

    def open(self, address: str, width: int, height: int, dark: bool) -> dict[str, Any]:
        name, value = "layout.css.prefers-color-scheme.content-override", 0 if dark else 1
        self.ask("Marionette:SetContext", {"value": "chrome"})
        self.run(f"Services.prefs.setIntPref('{name}', {value});")
        self.ask("Marionette:SetContext", {"value": "content"})
        holder = self.profile / "holder.html"
        style = f"border:0;width:{width}px;height:{height}px"
        holder.write_text(
            "<!doctype html><body style='margin:0'>"
            f"<iframe src='{address}' style='{style}'></iframe></body>"
        )
        self.ask("WebDriver:Navigate", {"url": holder.as_uri()})
        self.ask("WebDriver:SwitchToFrame", {"id": 0})
        seen: dict[str, Any] = json.loads(self.run(f"return {LOOK}"))
        return seen

    def pictures(self, seen: dict[str, Any]) -> Iterator[bytes]:
        self.ask("WebDriver:SwitchToFrame", {"id": None})
        height = min(seen["height"], TALLEST)
        self.run(f"document.querySelector('iframe').style.height = '{height}px';")
        found = self.ask("WebDriver:TakeScreenshot", {"full": True, "hash": False})
        yield base64.b64decode(found["value"])

    def close(self) -> None:
        with contextlib.suppress(BrowserError, OSError):
            self.ask("Marionette:Quit", {"flags": ["eForceQuit"]})
        self.line.close()
        end(self.process)


def end(process: subprocess.Popen[bytes]) -> None:
    """End a browser and the processes that it has started."""
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def find_browser() -> tuple[type[Chromium] | type[Firefox], str] | None:
    """Kind and program of the browser to use; $BROWSER_BIN goes first."""
    wanted = os.environ.get("BROWSER_BIN")
    for name in [wanted] if wanted else [*CHROMIUM, *FIREFOX, *APPLICATIONS]:
        program = shutil.which(name)
        if program:
            return (Firefox if "firefox" in name.lower() else Chromium), program
    return None


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


def too_late(*_: object) -> None:
    raise BrowserError(f"the browser does not answer within {WAIT:g} s")


def view(browser: Chromium | Firefox, page: Path, folder: Path) -> int:
    """All views of the page; returns how many faults there are."""
    count = 0
    papers = set()
    for name, width, height, dark, photographed in VIEWS:
        signal.alarm(int(WAIT))
        seen = browser.open(page.resolve().as_uri(), width, height, dark)
        papers.add((dark, seen["paper"]))
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
    signal.alarm(0)
    if {paper for dark, paper in papers if dark} & {paper for dark, paper in papers if not dark}:
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
        print(
            "No browser: neither Chromium (Chrome) nor Firefox is installed. To install one:\n"
            "  Debian, Ubuntu   apt-get install chromium   (or firefox-esr)\n"
            "  Fedora           dnf install chromium\n"
            "  Arch             pacman -S chromium\n"
            "  macOS            brew install --cask chromium\n"
            "A browser elsewhere: BROWSER_BIN=/path/to/program make report-view",
            file=sys.stderr,
        )
        return 3
    kind, program = found
    folder.mkdir(parents=True, exist_ok=True)
    print(f"{page} in {Path(program).name}")
    signal.signal(signal.SIGALRM, too_late)
    profile = tempfile.mkdtemp(prefix="perigeo-view.")
    browser = None
    try:
        signal.alarm(int(WAIT))
        browser = kind(program, Path(profile))
        count = view(browser, page, folder)
    except (BrowserError, OSError) as error:
        print(f"{program}: {error}", file=sys.stderr)
        return 3
    finally:
        signal.alarm(0)
        if browser is not None:
            browser.close()
        shutil.rmtree(profile, ignore_errors=True)
    print(f"report-view: {'all views are fine' if count == 0 else f'{count} faults'}")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
