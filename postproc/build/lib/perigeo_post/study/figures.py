"""The kinds of figures that a study can ask for, and the options of each (doc/studies.md)."""

from __future__ import annotations

from .contours import CONTOUR_OPTIONS, contours
from .curves import (
    CURVE_OPTIONS,
    HISTORY_OPTIONS,
    QUALITY_OPTIONS,
    curves,
    history,
    quality,
)
from .plots import PLOT_OPTIONS, plot
from .profiles import PROFILE_OPTIONS, profiles
from .types import Draw

FIGURES: dict[str, Draw] = {
    "plot": plot,
    "curves": curves,
    "contours": contours,
    "profiles": profiles,
    "history": history,
    "quality": quality,
}

FIGURE_OPTIONS: dict[str, frozenset[str]] = {
    "plot": PLOT_OPTIONS,
    "curves": CURVE_OPTIONS,
    "contours": CONTOUR_OPTIONS,
    "profiles": PROFILE_OPTIONS,
    "history": HISTORY_OPTIONS,
    "quality": QUALITY_OPTIONS,
}
