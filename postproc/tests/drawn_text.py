"""What text a figure shows and where: nothing beyond the canvas, nothing over something else."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

DOTS = 100.0  # per inch: letters are widest where there are few
TOUCH = 0.4  # [mm] by which boxes of texts may overlap: letters do not fill them


class _Recorder(RendererAgg):
    """A renderer that keeps what is written."""

    def __init__(self, width: float, height: float, dpi: float) -> None:
        super().__init__(width, height, dpi)
        self.texts: dict[int, Text] = {}

    def draw_text(self, *args: Any, **options: Any) -> None:
        text = options.get("mtext", args[7] if len(args) > 7 else None)
        if text is not None:
            self.texts[id(text)] = text
        super().draw_text(*args, **options)


def written(figure: Figure) -> list[tuple[str, Bbox, Any]]:
    """Every text that is drawn, its box in mm, and its axes."""
    FigureCanvasAgg(figure)
    figure.set_dpi(DOTS)
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()  # it settles
    size = figure.bbox.size
    renderer = _Recorder(*size, figure.dpi)
    figure.draw(renderer)
    scale = 25.4 / figure.dpi
    found = []
    for text in renderer.texts.values():
        box = text.get_window_extent(renderer)
        mm = Bbox.from_extents(*(scale * v for v in box.extents))
        found.append((text.get_text(), mm, text.axes))
    return found


def faults(figure: Figure) -> list[str]:
    """Texts that leave the canvas, that lie on each other, or on the axes of something else."""
    texts = written(figure)
    wide, high = (25.4 * v for v in figure.get_size_inches())
    said = []
    for words, box, _ in texts:
        if box.x0 < -TOUCH or box.y0 < -TOUCH or box.x1 > wide + TOUCH or box.y1 > high + TOUCH:
            said.append(f"{words!r} leaves the canvas: {box.extents.round(1)} of {wide} x {high}")
    for (one, a, _), (other, b, _) in combinations(texts, 2):
        if _overlap(a, b):
            said.append(f"{one!r} lies on {other!r}")
    scale = 25.4 / figure.dpi
    for ax in figure.axes:
        if not ax.get_visible():
            continue
        frame = Bbox.from_extents(*(scale * v for v in ax.get_window_extent().extents))
        said += [
            f"{words!r} lies on the axes {ax.get_title() or ax.get_ylabel()!r}"
            for words, box, home in texts
            if home is not ax and _overlap(box, frame)
        ]
        if min(frame.width, frame.height) < 1.0:
            said.append(f"axes of {frame.width:.1f} x {frame.height:.1f} mm")
    return said


def _overlap(one: Bbox, other: Bbox) -> bool:
    wide = min(one.x1, other.x1) - max(one.x0, other.x0)
    high = min(one.y1, other.y1) - max(one.y0, other.y0)
    return wide > TOUCH and high > TOUCH
