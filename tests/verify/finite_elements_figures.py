"""Figures of `make finite_elements`: perigeo beside finite elements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from perigeo_post.draw.style import COLOURS, DOUBLE, new_figure, style


@dataclass
class Panel:
    """One comparison: the reference, and perigeo at its finest grid."""

    title: str
    reference: Any  # curves have label, way [m], load [N/m]
    computed: Any


@dataclass
class Family:
    """Curves of one method, coarse to fine, with the sizes that they belong to [m]."""

    label: str
    sizes: list[float]
    curves: list[Any]
    marker: str
    colour: str
    dash: str = "-"


def draw_comparison(panels: list[Panel], path: Path) -> None:
    """Load against displacement, four panels."""
    with style():
        figure = new_figure(DOUBLE, 125.0)
        for axes, letter, panel in zip(figure.subplots(2, 2).flat, "abcd", panels):
            reference, computed = panel.reference, panel.computed
            axes.plot(
                1e3 * reference.way,
                reference.load / 1e3,
                color="0.6",
                linewidth=2.8,
                label=f"finite elements, {reference.label}",
            )
            axes.plot(
                1e3 * computed.way,
                computed.load / 1e3,
                color=COLOURS[1],
                linewidth=0.9,
                label=computed.label,
            )
            axes.set_title(f"({letter}) {panel.title}", loc="left")
            axes.set_xlabel("displacement [mm]")
            axes.set_ylabel("load [kN/m]")
            low, high = float(np.min(reference.load)), float(np.max(reference.load))
            room = 0.35 * (high - low) if low < 0.0 else 0.0  # for the legend
            axes.set_ylim(1.05e-3 * low - 1e-3 * room, 1.08e-3 * high)
            axes.legend(loc="lower right")
        figure.savefig(path, dpi=150)


def draw_softening(families: list[Family], nonlocal_family: Family, path: Path) -> None:
    """Curves of finite elements, curves of perigeo, work against size."""
    with style():
        figure = new_figure(DOUBLE, 84.0)
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.9))
        for axes, shown in ((left, families), (middle, [nonlocal_family])):
            for family in shown:
                for k, curve in enumerate(family.curves):
                    axes.plot(
                        1e3 * curve.way,
                        curve.load / 1e3,
                        family.dash,
                        color=COLOURS[k],
                        linewidth=0.7 + 0.3 * (family.dash == "-"),
                        label=curve.label if family is shown[0] else None,
                    )
            axes.set_xlabel("displacement [mm]")
            axes.set_ylabel("load [kN/m]")
            axes.set_xlim(0.0, 24.0)
        left.set_title("(a) finite elements, lines as in (c)", loc="left")
        middle.set_title("(b) perigeo, horizon 0.08 m", loc="left")
        for axes in (left, middle):
            axes.set_ylim(0.0, 235.0)  # room for the legend
            axes.legend(loc="upper right")
        for family in (*families, nonlocal_family):
            work = [curve.work / 1e3 for curve in family.curves]
            right.plot(
                family.sizes,
                work,
                family.dash,
                marker=family.marker,
                color=family.colour,
                label=family.label,
            )
        sizes = sorted({size for one in (*families, nonlocal_family) for size in one.sizes})
        right.set_xscale("log", base=2)
        right.set_xticks(sizes, [f"{size:.3g}" for size in sizes], rotation=60)
        right.minorticks_off()
        right.set_ylim(0.0, 1.45 * np.max(right.get_ylim()))
        right.set_xlabel("size of elements or spacing [m]")
        right.set_ylabel("work to 1.2 % [kJ/m]")
        right.set_title("(c) work, all of them", loc="left")
        right.legend(loc="upper left")
        figure.savefig(path, dpi=150)
