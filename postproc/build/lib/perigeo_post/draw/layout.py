"""Where the panels of a figure stand: sizes in mm, bodies drawn to one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..read.points import FloatArray
from .style import MAX_HEIGHT
from .text import LINE, axis_ticks, length_unit, text_width, wrapped

# [mm]
AXIS_NAME = 4.5  # the name of an axis and its distance from the numbers
HEADING = 4.0  # an upright heading on the left of a row
LEVEL = 26.0  # headings that are not upright are this wide at most
BOTTOM, TOP, RIGHT = 9.5, 2.0, 4.0
BAR = 14.0  # a colour bar beside the panels, without its numbers
BAR_BELOW = 15.0  # height of a colour bar below the panels
NOTE = 5.0  # a line above all panels
GAP = 3.5  # between panels that share their y axis
TICKS = 4.5  # for the numbers below a row
TALLEST = 80.0  # panel
NARROWEST = 17.0  # place for the title of a panel
LONGEST_BAR, SHORTEST_BAR = 70.0, 30.0

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
    left: float  # begin of the panels
    right: float  # and their end
    bar: Place  # the colour bar
    upright: bool  # it stands beside the panels; else it lies below them
    heading: float  # place for headings on the left

    @property
    def panels_end(self) -> float:
        """The height of the figure without a colour bar below the panels."""
        return max(place.y for place in self.rows[-1]) + BOTTOM

    def box(self, place: Place) -> tuple[float, float, float, float]:
        """A place in parts of the figure: lower left corner, width, height."""
        return (
            place.x / self.width, 1.0 - place.y / self.height,
            place.width / self.width, place.height / self.height,
        )  # fmt: skip

    def in_figure(self, width: float, height: float) -> Layout:
        """The same panels in a figure that goes on beside or below them."""
        return replace(self, width=width, height=height)


@dataclass(frozen=True)
class Wishes:
    """What a figure of panels should be."""

    limit: float  # width of the figure at most [mm]
    same_scale: bool = True  # bodies to one scale, else all panels of one height
    tallest: float = TALLEST  # panel [mm]
    heading: float = 0.0  # place for headings of the rows on their left [mm]
    note: bool = False  # there is a line above all panels
    size: float = 7.0  # of titles [points]
    narrowest: float = 0.0  # figure [mm]
    bar: float = 6.0  # numbers at the colour bar [mm]


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


def arranged(extents: list[list[FloatArray]], titles: list[list[str]], wishes: Wishes) -> Layout:
    """The largest panels that fit in width and on a page in height."""
    sizes = [[extent[2:] - extent[:2] for extent in row] for row in extents]
    numbers = _numbers(extents, wishes.size)
    gaps = [_gaps(row, numbers) for row in extents]
    left = numbers + AXIS_NAME + wishes.heading
    highest = max(float(size[1]) for row in sizes for size in row)
    free = _room(titles, sizes, highest if wishes.same_scale else None, wishes)
    boxes: list[list[FloatArray]] = []
    used = 0.0
    upright = True
    for height in np.arange(min(wishes.tallest, free), 3.0, -0.5):
        boxes = [
            [size * (height / (highest if wishes.same_scale else size[1])) for size in row]
            for row in sizes
        ]
        used = max(_row_width(row, gap) for row, gap in zip(boxes, gaps))
        upright = _total(boxes, titles, wishes) >= SHORTEST_BAR
        if left + used + (BAR + wishes.bar if upright else RIGHT) <= wishes.limit:
            break
    rows, y = _rows(boxes, gaps, titles, left, wishes)
    right = left + used
    width = max(right + (BAR + wishes.bar if upright else RIGHT), wishes.narrowest)
    low = rows[-1][0].y
    if upright:
        top = min(place.y - place.height for place in rows[0])
        tall = min(low - top, LONGEST_BAR)
        bar = Place(right + 3.0, 0.5 * (top + low + tall), 2.8, tall, "", True)
        return Layout(rows, width, y + BOTTOM, left, right, bar, upright, wishes.heading)
    width = max(width, left + LONGEST_BAR + RIGHT) if wishes.limit > LONGEST_BAR else width
    long = min(LONGEST_BAR, width - left - RIGHT)
    middle = min(max(0.5 * (left + right), 0.5 * long + 2.0), width - 0.5 * long - RIGHT)
    bar = Place(middle - 0.5 * long, y + BOTTOM + 3.0, long, 2.8, "", False)
    return Layout(
        rows, width, y + BOTTOM + BAR_BELOW, left, right, bar, upright, wishes.heading
    )  # fmt: skip


def _rows(
    boxes: list[list[FloatArray]],
    gaps: list[list[float]],
    titles: list[list[str]],
    left: float,
    wishes: Wishes,
) -> tuple[list[list[Place]], float]:
    """The places of all panels, and where the last row ends."""
    rows: list[list[Place]] = []
    y = TOP + (NOTE if wishes.note else 0.0)
    for row, gap, names in zip(boxes, gaps, titles):
        lines = _lines(names, row, wishes)
        y += max(map(len, lines)) * LINE * wishes.size + 1.5 + max(float(box[1]) for box in row)
        x = left
        places = []
        for k, box in enumerate(row):
            x += gap[k]
            shift = 0.5 * (_slot(box) - float(box[0]))
            numbered = k == 0 or gap[k] > GAP
            places.append(Place(
                x + shift, y, float(box[0]), float(box[1]), "\n".join(lines[k]), numbered
            ))  # fmt: skip
            x += _slot(box)
        rows.append(places)
        y += TICKS
    return rows, y - TICKS


def _total(boxes: list[list[FloatArray]], titles: list[list[str]], wishes: Wishes) -> float:
    """Height from the top of the first row to the bottom of the last."""
    rows, low = _rows(boxes, [[0.0] * len(row) for row in boxes], titles, 0.0, wishes)
    return low - min(place.y - place.height for place in rows[0])


def _numbers(extents: list[list[FloatArray]], size: float) -> float:
    """Width of the widest number on a y axis."""
    unit = length_unit([extent for row in extents for extent in row])
    words = [
        word
        for row in extents
        for extent in row
        for word in axis_ticks(float(extent[1]), float(extent[3]), 40.0, unit, size - 1.0)[1]
    ]
    return 2.0 + max(text_width(word, size - 1.0) for word in words)


def _room(
    titles: list[list[str]], sizes: list[list[FloatArray]], highest: float | None, wishes: Wishes
) -> float:
    """Height of the highest panel with which all rows fit on a page."""
    lines = sum(max(len(wrapped(name, 25.0, wishes.size)) for name in row) for row in titles)
    free = MAX_HEIGHT - TOP - BOTTOM - len(titles) * (1.5 + TICKS) - lines * LINE * wishes.size
    free -= NOTE if wishes.note else 0.0
    if highest is None:
        return free / len(sizes)
    return free / sum(max(float(size[1]) for size in row) / highest for row in sizes)


def _gaps(extents: Sequence[FloatArray], numbers: float) -> list[float]:
    """Distance of each panel from the one before; more where the y axis is another."""
    found = [0.0]
    for one, other in zip(extents, extents[1:]):
        found.append(GAP if np.allclose(one[[1, 3]], other[[1, 3]]) else GAP + numbers)
    return found


def _slot(box: FloatArray) -> float:
    return max(float(box[0]), NARROWEST)


def _row_width(boxes: Sequence[FloatArray], gaps: Sequence[float]) -> float:
    return sum(_slot(box) for box in boxes) + sum(gaps)


def _lines(titles: Sequence[str], row: Sequence[FloatArray], wishes: Wishes) -> list[list[str]]:
    """Titles in lines as wide as their panels, that of a panel alone as wide as the figure."""
    free = 0.9 * wishes.limit if len(row) == 1 else 0.0
    return [wrapped(name, max(_slot(box) + 0.5 * GAP, free), wishes.size)
            for name, box in zip(titles, row)]  # fmt: skip
