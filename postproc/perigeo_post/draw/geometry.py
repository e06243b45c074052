"""The body of an input before it is run: points, fictitious points, loads, what is marked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from ..read.points import FloatArray
from ..read.points_file import BODY, ModelPoints
from .layout import BAR, NARROWEST, Wishes, arranged
from .panels import number_axes
from .style import COLOURS, DOUBLE, MAX_HEIGHT, MM, new_figure, readable, style
from .text import LINE, length_unit, text_width, wrapped

SOIL = ["#C9B79C", "#8C7B65", "#E3D5B8", "#A89078", "#6E6257", "#D9C2A0"]
BESIDE = 40.0  # longest line of words in the legend [mm]
POINT_ROOM = 400.0  # size of the body on paper [points], about
ARROWS = 25  # of a load, at most


def geometry_figure(model: ModelPoints, title: str = "") -> Figure:
    """Points by material, fictitious points by boundary, loads, patches, probes, cuts, by name."""
    low = model.positions.min(axis=0) - model.spacing
    high = model.positions.max(axis=0) + model.spacing
    extent = np.concatenate([low, high])
    with style():
        figure = new_figure(DOUBLE, MAX_HEIGHT, layout=None)
        axes = figure.add_subplot()
        axes.set_aspect("equal")
        entries = _draw_points(axes, model, POINT_ROOM / float((high - low).max()))
        for kind, draw in THINGS.items():
            for k, (name, rows) in enumerate(model.things.get(kind, {}).items()):
                entries.append(draw(axes, name, rows, k, float((high - low).max())))
        words = ["\n".join(wrapped(str(entry.get_label()), BESIDE, 7.0)) for entry in entries]
        beside = max(text_width(text, 7.0) for text in words) + 9.0
        wishes = Wishes(DOUBLE - beside + BAR, bar=0.0, tallest=MAX_HEIGHT, size=8.0)
        layout = arranged([[extent]], [[readable(title)]], wishes)
        right = max(layout.right, layout.left + NARROWEST) + 3.0
        rows_high = sum(text.count("\n") + 1.6 for text in words) * LINE * 7.0
        layout = layout.in_figure(right + beside, max(layout.panels_end, rows_high + 6.0))
        figure.set_size_inches(layout.width * MM, layout.height * MM)
        place = layout.rows[0][0]
        axes.set_position(layout.box(place))
        unit = length_unit([extent])
        number_axes(axes, extent, place, unit, 7.0)
        axes.set_aspect("equal")
        axes.set_xlabel(f"x [{unit[1]}]", labelpad=1.5)
        axes.set_ylabel(f"y [{unit[1]}]", labelpad=1.5)
        axes.set_title(place.title, fontsize=8.0, pad=2.5)
        figure.legend(
            handles=entries, labels=words, loc="upper left", borderaxespad=0.0, borderpad=0.2,
            bbox_to_anchor=(right / layout.width, 1.0 - 2.0 / layout.height),
        )  # fmt: skip
    return figure


def _draw_points(axes: Axes, model: ModelPoints, scale: float) -> list[Line2D]:
    """Draw points as discs as large as their volume; returns the entries of the legend."""
    entries = []
    materials, boundaries = np.array(model.materials), np.array(model.boundaries)
    size = np.sqrt(model.volumes)
    thin = 0.3 if scale * model.spacing > 4.0 else 0.0
    body = boundaries == BODY
    for k, name in enumerate(dict.fromkeys(model.materials)):
        entries.append(_discs(
            axes, model.positions[body & (materials == name)], size[body & (materials == name)],
            SOIL[k % len(SOIL)], name, thin,
        ))  # fmt: skip
    names = [name for name in dict.fromkeys(model.boundaries) if name != BODY]
    for k, name in enumerate(names):
        here = boundaries == name
        entries.append(_discs(axes, model.positions[here], 0.6 * size[here],
                              COLOURS[k % len(COLOURS)], f"boundary {name}", thin))  # fmt: skip
    return entries


def _discs(
    axes: Axes, places: FloatArray, size: FloatArray, colour: str, name: str, thin: float
) -> Line2D:
    axes.add_collection(EllipseCollection(
        size, size, np.zeros(len(size)), units="x", offsets=places,
        offset_transform=axes.transData, facecolors=colour, edgecolors="0.3", linewidths=thin,
    ))  # fmt: skip
    return Line2D([], [], marker="o", linestyle="none", color=colour,
                  label=readable(f"{name}, {len(size)} points"))  # fmt: skip


def _draw_load(axes: Axes, name: str, rows: FloatArray, k: int, extent: float) -> Line2D:
    """Arrows that end where the load acts, as long as the force of the points in their place."""
    places, forces = rows[:, :2], rows[:, 2:]
    whole = forces.sum(axis=0)
    # the points that carry most of it: one in each line across the surface
    size = np.hypot(*forces.T)
    chosen = np.flatnonzero(size >= 0.5 * size.max())
    chosen = chosen[np.linspace(0, len(chosen) - 1, min(ARROWS, len(chosen))).round().astype(int)]
    arrows = 0.06 * extent * forces[chosen] / size.max()
    colour = COLOURS[-1 - k % len(COLOURS)]
    axes.quiver(
        *(places[chosen] - arrows).T, *arrows.T, angles="xy", scale_units="xy", scale=1.0,
        width=0.003, color=colour, zorder=4,
    )  # fmt: skip
    total = float(np.hypot(*whole)) / 1e3
    return Line2D([], [], marker=r"$\downarrow$", linestyle="none", color=colour,
                  label=f"load {name}, {total:.4g} kN/m")  # fmt: skip


def _draw_patch(axes: Axes, name: str, rows: FloatArray, k: int, extent: float) -> Line2D:
    """A circle about a patch."""
    for x, y, radius in rows:
        axes.add_patch(Circle((x, y), max(radius, 0.004 * extent), fill=False, linestyle="--",
                              linewidth=1.0, color=COLOURS[1 + k], zorder=5))  # fmt: skip
    return Line2D([], [], linestyle="--", color=COLOURS[1 + k], label=readable(name))


def _draw_probe(axes: Axes, name: str, rows: FloatArray, k: int, extent: float) -> Line2D:
    """A cross at a probe."""
    (line,) = axes.plot(
        *rows.T, marker="x", markersize=7, markeredgewidth=1.6, linestyle="none", zorder=6,
        color=COLOURS[(2 + k) % len(COLOURS)], label=readable(f"probe {name}"),
    )  # fmt: skip
    return line


def _draw_cut(axes: Axes, name: str, rows: FloatArray, k: int, extent: float) -> Line2D:
    """The line of a cut."""
    (line,) = axes.plot(rows[0, [0, 2]], rows[0, [1, 3]], color="black", linewidth=2.0, zorder=5,
                        label=f"cut {name}")  # fmt: skip
    return line


# How each kind of line of the file is drawn: name, its rows, number of the name, extent [m].
# A new kind is an entry here and in read.points_file.NUMBERS.
THINGS: dict[str, Callable[[Axes, str, FloatArray, int, float], Line2D]] = {
    "load": _draw_load,
    "patch": _draw_patch,
    "probe": _draw_probe,
    "cut": _draw_cut,
}
