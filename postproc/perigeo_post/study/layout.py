"""Where the panels of a figure of contours stand: sizes in mm, bodies drawn to one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from ..draw.style import MAX_HEIGHT
from ..read.points import FloatArray

# [mm]
LEFT, HEADED, BOTTOM, TOP, BAR = 11.0, 16.0, 9.5, 2.0, 20.0
GAP = 3.5  # between panels that share their y axis
LABELLED = 9.0  # before a panel with numbers on its y axis
TICKS = 4.5  # for the numbers below a row
TITLE_LINE = 3.3
TALLEST = 80.0  # panel
NARROWEST = 17.0  # place for the title of a panel
LETTER = 1.3  # mean width of a letter of a title

NEARLY = 0.06  # part of its size by which bodies may differ that share their axes


@dataclass(frozen=True)
class Place:
    """A panel: its lower left corner from the upper left of the figure, and its size [mm]."""

    x: float
    y: float
    width: float
    height: float
    title: str  # broken into lines
    numbered: bool  # numbers on the y axis


@dataclass(frozen=True)
class Layout:
    """All panels row by row, and the size of the figure [mm]."""

    rows: list[list[Place]]
    width: float
    height: float
    right: float  # end of the panels


def shared(extents: Sequence[FloatArray]) -> list[FloatArray]:
    """x0, y0, x1, y1 of each panel, the same for bodies of nearly the same size and place."""
    kinds: list[list[int]] = []
    for k, extent in enumerate(extents):
        size = NEARLY * float(np.max(extent[2:] - extent[:2]))
        for kind in kinds:
            if np.abs(extents[kind[0]] - extent).max() <= size:
                kind.append(k)
                break
        else:
            kinds.append([k])
    found = [np.asarray(extent) for extent in extents]
    for kind in kinds:
        members = np.array([extents[k] for k in kind])
        union = np.concatenate([members[:, :2].min(axis=0), members[:, 2:].max(axis=0)])
        for k in kind:
            found[k] = union
    return found


def arranged(
    extents: list[list[FloatArray]],
    titles: list[list[str]],
    limit: float,
    same_scale: bool,
    tallest: float | None,
    headed: bool,
) -> Layout:
    """The largest panels that fit `limit` [mm] in width and a page in height.

    same_scale: bodies to one scale, else all panels of one height. headed: rows have a heading.
    """
    sizes = [[extent[2:] - extent[:2] for extent in row] for row in extents]
    gaps = [_gaps(row) for row in extents]
    left = HEADED if headed else LEFT
    highest = max(float(size[1]) for row in sizes for size in row)
    unit = min(tallest or TALLEST, _room(titles, sizes, highest if same_scale else None))
    boxes: list[list[FloatArray]] = []
    used = 0.0
    for height in np.arange(unit, 4.0, -0.5):
        boxes = [
            [size * (height / (highest if same_scale else size[1])) for size in row]
            for row in sizes
        ]
        used = max(_row_width(row, gap) for row, gap in zip(boxes, gaps))
        if left + used + BAR <= limit:
            break
    rows: list[list[Place]] = []
    y = TOP
    for row, gap, names in zip(boxes, gaps, titles):
        lines = [_lines(name, _slot(box) + GAP) for name, box in zip(names, row)]
        y += max(map(len, lines)) * TITLE_LINE + 1.5 + max(float(box[1]) for box in row)
        x = left
        places = []
        for k, box in enumerate(row):
            x += gap[k]
            shift = 0.5 * (_slot(box) - float(box[0]))
            title = "\n".join(lines[k])
            numbered = k == 0 or gap[k] > GAP
            places.append(Place(x + shift, y, float(box[0]), float(box[1]), title, numbered))
            x += _slot(box)
        rows.append(places)
        y += TICKS
    return Layout(rows, left + used + BAR, y - TICKS + BOTTOM, left + used)


def _room(titles: list[list[str]], sizes: list[list[FloatArray]], highest: float | None) -> float:
    """Height of the highest panel with which all rows fit on a page."""
    lines = sum(max(len(_lines(name, 25.0)) for name in row) for row in titles)
    free = MAX_HEIGHT - TOP - BOTTOM - len(titles) * (1.5 + TICKS) - lines * TITLE_LINE
    if highest is None:
        return free / len(sizes)
    return free / sum(max(float(size[1]) for size in row) / highest for row in sizes)


def _gaps(extents: Sequence[FloatArray]) -> list[float]:
    """Distance of each panel from the one before; more where the y axis is another."""
    found = [0.0]
    for one, other in zip(extents, extents[1:]):
        found.append(GAP if np.allclose(one[[1, 3]], other[[1, 3]]) else LABELLED)
    return found


def _slot(box: FloatArray) -> float:
    return max(float(box[0]), NARROWEST)


def _row_width(boxes: Sequence[FloatArray], gaps: Sequence[float]) -> float:
    return sum(_slot(box) for box in boxes) + sum(gaps)


def _lines(title: str, width: float) -> list[str]:
    return wrap(title, max(6, int(width / LETTER)))
