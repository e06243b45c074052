"""Make the pictures of the gallery, for `make gallery`.

    .venv/bin/python tools/make_gallery.py [--publish] [--page]

Runs the cases of tools/gallery/entries.py into results/gallery and draws them there. --publish:
into doc/figures/gallery too, 1000 pixels wide with 64 colours, and the page doc/gallery.md;
--page: that page alone. A minute or two.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from pathlib import Path

from gallery.entries import POST, RUNS, SECTIONS, STUDY, Entry
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "results" / "gallery"
FIGURES = ROOT / "doc" / "figures" / "gallery"
PAGE = ROOT / "doc" / "gallery.md"

HEAD = """\
# Gallery

Every kind of figure that perigeo draws, with the input and the command that make it. `make gallery`
draws all but the last two sections, in a minute or two. The ending of the name behind `-o` makes
it a PDF, SVG or EPS. `make gallery PUBLISH=1` writes this page, from `tools/gallery/entries.py`.
"""


def result(run: str) -> str:
    """Return the result of a run, from the root."""
    name = RUNS[run][0].rsplit("/", 1)[-1].removesuffix(".nml")
    return f"results/gallery/{run}/{name}.h5"


def names() -> dict[str, str]:
    return {run: result(run) for run in RUNS} | {"study": "results/gallery/horizons"}


def execute(command: list[str]) -> None:
    print("  " + shlex.join(command), flush=True)
    done = subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.DEVNULL)
    if done.returncode != 0:
        sys.exit(f"make_gallery: exit status {done.returncode}")


def run_command(run: str) -> list[str]:
    """Return the command of a run; its results go to a folder of its own."""
    path, settings = RUNS[run]
    words = [word for text in settings for word in ("--set", text)]
    return ["bin/perigeo", *words, "--output", f"results/gallery/{run}", path]


def draw() -> None:
    """Make all runs, and the pictures beside them."""
    for run in RUNS:
        command = run_command(run)
        execute([command[0], "--quiet", "--force", *command[1:]])
    execute([POST, "study", STUDY, "--output", "results/gallery/horizons"])
    for entries in SECTIONS.values():
        for entry in entries:
            if entry.drawn and entry.command.startswith(POST):
                words = shlex.split(entry.command.format(**names()))
                ending = "gif" if words[1] == "animate" else "png"
                execute([*words, "-o", f"results/gallery/{entry.picture}.{ending}"])


def small(image: Image.Image) -> Image.Image:
    """Return a picture at most 1000 pixels wide, with 64 colours that cover all that it has."""
    image = image.convert("RGB")
    if image.width > 1000:
        size = (1000, round(1000 * image.height / image.width))
        image = image.resize(size, Image.Resampling.LANCZOS)
    cover = Image.Quantize.MAXCOVERAGE
    return image.quantize(64, method=cover, dither=Image.Dither.NONE)


def publish() -> None:
    """Put the pictures into the documents, small."""
    FIGURES.mkdir(exist_ok=True)
    for entries in SECTIONS.values():
        for entry in entries:
            if not entry.drawn:
                continue
            path = RESULTS / f"{entry.picture}.png"
            if entry.command.startswith("{study}"):
                path = ROOT / entry.command.format(**names())
            elif " animate " in entry.command:
                path = path.with_suffix(".gif")
            image = Image.open(path)
            if path.suffix == ".gif":
                image.seek(image.n_frames - 1)
            small(image).save(FIGURES / f"{entry.picture}.png", optimize=True)


def commands(entry: Entry) -> list[str]:
    """Return what a reader types for a picture."""
    lines = []
    if entry.drawn:
        used = [run for run in RUNS if "{" + run + "}" in entry.command]
        lines = [shlex.join(run_command(run)) for run in used]
        if entry.command.startswith("{study}"):
            return [f"{POST} study {entry.made_from}"]
    return [*lines, entry.command.format(**names())]


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for title, entries in SECTIONS.items():
        parts.append(f"## {title}\n")
        if any(entry.command.startswith("{study}") for entry in entries):
            parts.append(f"All of one study, `{STUDY}`, by\n\n    {commands(entries[0])[0]}\n")
        for entry in entries:
            place = f"figures/gallery/{entry.picture}.png".replace("gallery/../", "")
            words = entry.words.replace("`", "").rstrip(".")
            parts.append(f"![{words}]({place})\n")
            source = RUNS[entry.made_from][0] if entry.made_from in RUNS else entry.made_from
            if entry.command.startswith("{study}"):
                parts.append(f"{entry.words}\n")
                continue
            lines = "".join(f"    {line}\n" for line in commands(entry))
            parts.append(f"{entry.words} From `{source}`:\n\n{lines}")
    return "\n".join(parts).rstrip() + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description="Make the pictures of the gallery.")
    parser.add_argument("--publish", action="store_true", help="into doc/ too")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    arguments = parser.parse_args()
    if not arguments.page:
        draw()
    if arguments.publish:
        publish()
    if arguments.publish or arguments.page:
        PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
