"""How figures look: sizes for print, fonts, colours, units with prefixes, saving."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..read.errors import OutputError, RequestError
from ..read.outputs import FIGURE, check_output

SINGLE = 88.0  # column width [mm]
DOUBLE = 180.0
MAX_HEIGHT = 220.0
DPI = 300
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

_PREFIXES = [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ")]
_PREFIXED = {"Pa", "J/m", "N/m", "m", "m/s"}


@contextmanager
def style() -> Iterator[None]:
    """The settings of all figures, left again afterwards."""
    settings: Any = STYLE
    with matplotlib.rc_context(settings):
        yield


def new_figure(width: float, height: float, layout: Any = "constrained") -> Figure:
    """An empty figure of this size in mm; needs no display."""
    figure = Figure(figsize=(width * MM, height * MM), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def prefix_for(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit with an SI prefix, so that numbers stay between 1 and 1000.

    Pure numbers and unknown units keep factor 1.
    """
    if unit not in _PREFIXED or not math.isfinite(largest) or largest <= 0.0:
        return 1.0, unit
    for size, letter in _PREFIXES:
        if largest >= size:
            return 1.0 / size, f"{letter}{unit}"
    return 1.0 / _PREFIXES[-1][0], f"{_PREFIXES[-1][1]}{unit}"


def with_unit(text: str, unit: str) -> str:
    """Text for an axis; a pure number shows a dash."""
    if not unit:
        return text
    return f"{text} [{'–' if unit == '1' else unit}]"


def check_figure_path(path: str | Path, endings: tuple[str, ...] = (".png", ".pdf")) -> Path:
    """The path, if its ending is one that can be written."""
    path = Path(path)
    if path.suffix.lower() not in endings:
        allowed = " or ".join(endings)
        raise RequestError(f"the figure {path} must end in {allowed}")
    return path


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG or PDF, by the ending of the name."""
    path = check_output(check_figure_path(path), FIGURE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with style():
            figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    return path
