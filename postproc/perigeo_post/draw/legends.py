"""Legends: inside the axes where there is room, else above or beside them.

Above is below where the numbers of the horizontal axis stand above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from .style import DOUBLE, SINGLE
from .text import text_width, wrapped

NO_LEGEND_OVER = 16  # entries in one column of a legend
ASIDE_FROM = 9  # entries from which the legend stands beside the axes
COMPARED = 1.0  # order of drawing of lines that others are compared with: below these
LONGEST = 62.0  # line of words in a legend [mm]
ROW = 3.8  # height of an entry [mm]
_SIZE = 7.0  # of the words [points]
_HANDLE = 10.0  # width of the sample of a line [mm]
_MARGIN = 16.0  # of the axes on the left, with numbers and name [mm]


@dataclass(frozen=True)
class LegendPlace:
    """Where the legend stands, and what that means for the size of the figure."""

    where: str  # "inside" | "above" | "aside" | "none"
    width: float  # of the figure [mm]
    extra: float  # height that it needs above the axes [mm]
    columns: int = 2  # of a legend above
    longest: float = LONGEST  # line of its words [mm]


def best_place(labels: Sequence[str], most_inside: int) -> str:
    """Inside the axes up to `most_inside` entries, above a few more that are short, else aside."""
    if len(labels) <= most_inside and _widest(labels) <= 0.6 * SINGLE:
        return "inside"
    narrow = _columns(labels) == 2 or (_columns(labels) == 1 and len(labels) <= 3)
    return "above" if narrow and len(labels) < ASIDE_FROM else "aside"


def placed(
    labels: Sequence[str], where: str, width: float = SINGLE, title: str = ""
) -> LegendPlace:
    """What a legend there means for the figure, which is `width` wide [mm] unless it is aside."""
    columns = _columns(labels, width) or 1
    rows = -(-len(labels) // columns) + bool(title)
    if where == "aside":
        width = max(width, DOUBLE)
    return LegendPlace(where, width, ROW * rows if where == "above" else 0.0, columns)


def legend(ax: Axes, place: LegendPlace, title: str = "") -> None:
    """Draw the legend; lines to compare with stand last."""
    handles, labels = ax.get_legend_handles_labels()
    if place.where == "none" or not handles:
        return
    compared = [isinstance(h, Line2D) and h.get_zorder() <= COMPARED for h in handles]
    order = sorted(range(len(handles)), key=compared.__getitem__)
    common: dict[str, Any] = {
        "handles": [handles[k] for k in order],
        "labels": ["\n".join(wrapped(labels[k], place.longest, _SIZE)) for k in order],
        "title": title or None, "title_fontsize": 7, "handlelength": 2.4,
    }  # fmt: skip
    columns = place.columns if place.where == "above" else _columns(labels, place.width) or 1
    outside = ("lower center", (0.5, 1.0))
    if ax.xaxis.get_label_position() == "top":
        outside = ("upper center", (0.5, 0.0))
    above: dict[str, Any] = {"loc": outside[0], "bbox_to_anchor": outside[1], "ncols": columns}
    if place.where == "aside":
        columns = 2 if len(labels) > NO_LEGEND_OVER else 1
        ax.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0.0,
            ncols=columns, **common,
        )  # fmt: skip
        return
    drawn = ax.legend(**(above if place.where == "above" else {"loc": "best"}), **common)
    if place.where == "inside" and _covers(ax, drawn):
        ax.legend(**above, **common)


def _widest(labels: Sequence[str]) -> float:
    longest = max((text_width(label, _SIZE) for label in labels), default=0.0)
    return min(longest, LONGEST) + _HANDLE


def _columns(labels: Sequence[str], width: float = SINGLE) -> int:
    """Columns of a legend above axes in a figure of that width; 0 where not even one fits."""
    return min(2, int((width - _MARGIN) / _widest(labels)), max(len(labels), 1))


def _covers(ax: Axes, drawn: Legend) -> bool:
    """Whether a legend lies on a line, as it does where there is no room in the axes."""
    figure: Any = ax.figure
    figure.draw_without_rendering()
    box = drawn.get_window_extent()
    paths: list[Any] = [line.get_path().transformed(line.get_transform()) for line in ax.lines]
    return any(len(p.vertices) and p.intersects_bbox(box, filled=False) for p in paths)
