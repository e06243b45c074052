"""How figures look: sizes for print, fonts, colours, units with prefixes, saving."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser

from ..read.errors import OutputError, RequestError
from ..read.outputs import FIGURE, check_output

SINGLE = 88.0  # column width [mm]
DOUBLE = 180.0
MAX_HEIGHT = 220.0
DPI = 300
SCREEN = 120  # dots per inch in a notebook
FIGURES = (".png", ".pdf", ".svg", ".eps")  # what a file may end in
MM = 1.0 / 25.4

# Okabe and Ito: distinct for all kinds of colour vision
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
DASHES: list[Any] = ["-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1))]
SEQUENTIAL = "viridis"
DIVERGING = "RdBu_r"

STYLE: dict[str, Any] = {
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.0,
    "figure.titlesize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.0,
    "mathtext.default": "it",
    "pdf.fonttype": 42,
    "axes.formatter.use_mathtext": True,
    "axes.unicode_minus": True,
}

# Settings of matplotlib that say nothing of how a figure looks
_LEFT_ALONE = {
    "backend", "backend_fallback", "interactive", "toolbar", "timezone", "datapath",
    "date.epoch", "tk.window_focus", "webagg.port", "webagg.address", "webagg.open_in_browser",
    "webagg.port_retries", "docstring.hardcopy",
}  # fmt: skip

_LARGE = [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, "")]
_SMALL = [(1.0, ""), (1e-3, "m"), (1e-6, "µ")]
# Stresses have no small prefixes: mPa would be read as MPa.
_PREFIXED = {"Pa": _LARGE, "J/m": _LARGE, "J": _LARGE, "N/m": _LARGE, "N": _LARGE, "m": _SMALL,
             "m/s": _SMALL, "s": _SMALL}  # fmt: skip


@contextmanager
def style() -> Iterator[None]:
    """The settings of all figures, left again afterwards.

    They begin with those of matplotlib itself, so that a file of settings changes nothing: LaTeX
    for all text, or numbers as the language of the user writes them, which need what may not be
    there.
    """
    given: Any = matplotlib.rcParamsDefault
    settings: Any = {key: value for key, value in given.items() if key not in _LEFT_ALONE}
    settings.update(STYLE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", matplotlib.MatplotlibDeprecationWarning)
        with matplotlib.rc_context(settings):
            yield


def readable(label: str) -> str:
    """A label of the user as legends and titles show it.

    Legends leave out labels that begin with "_", unless something without width stands before
    it. A dollar sign begins mathematics for it: where that cannot be read, it is a dollar sign.
    """
    text = f"\u200b{label}" if label.startswith("_") else label
    if "$" in text:
        try:
            for line in text.splitlines():
                MathTextParser("path").parse(line)
        except ValueError:
            text = text.replace("$", r"\$")
    return text


class ShownFigure(Figure):
    """A figure that a notebook shows by itself, whatever its backend."""

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        with style():
            self.savefig(picture, format="png", dpi=SCREEN)
        return picture.getvalue()


def new_figure(width: float, height: float, layout: Any = "constrained") -> Figure:
    """An empty figure of this size in mm; needs no display."""
    figure = ShownFigure(figsize=(width * MM, height * MM), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def prefix_for(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit with an SI prefix, so that numbers stay between 1 and 1000.

    Pure numbers and unknown units keep factor 1.
    """
    prefixes = _PREFIXED.get(unit)
    if prefixes is None or not math.isfinite(largest) or largest <= 0.0:
        return 1.0, unit
    size, letter = next((p for p in prefixes if largest >= p[0]), prefixes[-1])
    return 1.0 / size, f"{letter}{unit}"


def with_unit(text: str, unit: str) -> str:
    """Text for an axis; a pure number shows a dash."""
    if not unit:
        return text
    return f"{text} [{'–' if unit == '1' else unit}]"


def check_figure_path(path: str | Path, endings: tuple[str, ...] = FIGURES) -> Path:
    """The path, if its ending is one that can be written."""
    path = Path(path)
    if path.suffix.lower() not in endings:
        allowed = f"{', '.join(endings[:-1])} or {endings[-1]}"
        raise RequestError(f"the figure {path} must end in {allowed}")
    return path


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG, PDF, SVG or EPS, by the ending of the name."""
    path = check_output(check_figure_path(path), FIGURE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with style():
            figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    return path
