"""Words and numbers in figures: how wide they are, in which unit, how many fit an axis."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import MaxNLocator

from ..read.points import FloatArray

LINE = 0.47  # height of a line of text [mm], for each point of its size
APART = 2.0  # distance of numbers on an axis [mm]
_MM = 25.4 / 72.0
_HINTED = 1.07  # letters of pictures with few dots are up to this much wider
_FONT = "DejaVu Sans"  # that of the style
# Units of lengths on the axes of bodies: for bodies smaller than this [m], factor, name
_LENGTHS = [(2e-5, 1e6, "µm"), (0.02, 1e3, "mm"), (5e3, 1.0, "m"), (np.inf, 1e-3, "km")]

Unit = tuple[float, str]


@lru_cache(maxsize=4096)
def text_width(words: str, size: float) -> float:
    """Width of the widest line of a text [mm]."""
    font = FontProperties(family=_FONT, size=size)
    widths = [0.0]
    for line in words.splitlines():
        mathematics = line.count("$") - line.count(r"\$") >= 2
        try:
            found = text_to_path.get_text_width_height_descent(line, font, ismath=mathematics)
        except ValueError:  # dollars that begin no mathematics
            found = text_to_path.get_text_width_height_descent(line, font, ismath=False)
        widths.append(_HINTED * _MM * float(found[0]))
    return max(widths)


def wrapped(words: str, width: float, size: float) -> list[str]:
    """The lines of a text that fit a width [mm]; a word that does not fit is broken."""
    lines: list[str] = []
    for given in words.splitlines():
        line = ""
        for word in given.split():
            longer = f"{line} {word}".strip()
            if text_width(longer, size) <= width:
                line = longer
                continue
            if line:
                lines.append(line)
            while text_width(word, size) > width and len(word) > 3 and "$" not in word:
                fits = [k for k in range(1, len(word)) if text_width(word[:k], size) <= width]
                cut = max(fits, default=3)
                lines.append(word[:cut])
                word = word[cut:]
            line = word
        if line:
            lines.append(line)
    return lines


def length_unit(extents: Sequence[FloatArray]) -> Unit:
    """Factor and name of the unit in which bodies (x0, y0, x1, y1) of these sizes are shown."""
    return unit_for(max(float(np.max(extent[2:] - extent[:2])) for extent in extents))


def unit_for(length: float) -> Unit:
    """Factor and name of the unit in which a length [m] is shown."""
    return next((factor, name) for limit, factor, name in _LENGTHS if length < limit)


def axis_ticks(
    low: float,
    high: float,
    length: float,
    unit: Unit,
    size: float,
    upright: bool = True,
    most: int = 6,
) -> tuple[list[float], list[str]]:
    """Places and numbers that fit an axis from low to high [m] of some length [mm].

    `most`: steps between them.
    """
    factor = unit[0]
    start, end = factor * low, factor * high
    for count in range(most, 0, -1):
        ticks = MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]).tick_values(start, end)
        slack = 1e-9 * (end - start)
        inside = [float(t) + 0.0 for t in ticks if start - slack <= t <= end + slack]
        words = [_number(t, end - start) for t in inside]
        step = length / (end - start) * (inside[1] - inside[0]) if len(inside) > 1 else length
        room = LINE * size if upright else max((text_width(w, size) for w in words), default=0.0)
        if len(inside) < 2 or step >= room + (0.5 if upright else APART):
            break
    return [t / factor for t in inside], words


def _number(value: float, size: float) -> str:
    """A number with the digits that it needs on an axis of this size, without a power of ten."""
    decimals = max(0, 2 - int(np.floor(np.log10(size))))
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text.replace("-", "−")


def fit_numbers(ax: Axes) -> None:
    """Take numbers from a horizontal axis of curves until none lies on another."""
    locator = ax.xaxis.get_major_locator()
    if not isinstance(locator, MaxNLocator):
        return
    figure: Any = ax.figure
    for count in range(6, 1, -1):
        figure.draw_without_rendering()
        low, high = sorted(ax.get_xlim())
        labels = [
            label.get_window_extent()
            for place, label in zip(ax.get_xticks(), ax.get_xticklabels())
            if low <= place <= high and label.get_text()
        ]
        room = APART / 25.4 * figure.dpi
        if all(one.x1 + room <= other.x0 for one, other in zip(labels, labels[1:])):
            return
        locator.set_params(nbins=count)
