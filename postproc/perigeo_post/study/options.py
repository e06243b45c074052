"""The options of figures in study files: what each means and what it may be.

The kinds of figures read them when they draw; they are checked here before anything runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from .toml import Table


@dataclass(frozen=True)
class Form:
    """What a value may be."""

    words: str
    fits: Callable[[Any], bool]


@dataclass(frozen=True)
class Option:
    """An option of one or several kinds of figures."""

    form: Form
    meaning: str


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_list(value: Any, fits: Callable[[Any], bool], count: int | None = None) -> bool:
    if not isinstance(value, list) or (count is not None and len(value) != count):
        return False
    return all(fits(item) for item in value)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _words(*known: str) -> Form:
    return Form(" or ".join(f'"{word}"' for word in known), lambda value: value in known)


NUMBER = Form("a number", _is_number)
NUMBERS = Form("a number or a list of them", lambda v: _is_number(v) or _is_list(v, _is_number))
RANGE = Form("[low, high]", lambda v: _is_list(v, _is_number, 2))
WINDOW = Form("[x0, x1, y0, y1]", lambda v: _is_list(v, _is_number, 4))
PLACE = Form("[left, bottom, width, height]", lambda v: _is_list(v, _is_number, 4))
LINE = Form(
    "[[x, y], [x, y]]", lambda v: _is_list(v, lambda p: _is_list(p, _is_number, 2), 2)
)  # fmt: skip
FLAG = Form("true or false", lambda v: isinstance(v, bool))
TEXT = Form("a text", _is_text)
TEXTS = Form("a text or a list of them", lambda v: _is_text(v) or _is_list(v, _is_text))
TARGET = Form("a number, or the name of a column", lambda v: _is_number(v) or _is_text(v))
LEGEND = Form(
    'true, false, "inside", "above" or "aside"',
    lambda v: isinstance(v, bool) or v in ("inside", "above", "aside"),
)
RUNS = Form("a table of parameters", lambda v: isinstance(v, Mapping))

OPTIONS: dict[str, Option] = {
    "by": Option(
        TEXT, "parameter or column that gives runs their colour (contours: that names their rows)"
    ),
    "centred": Option(FLAG, "distance from the peak"),
    "column": Option(_words("single", "double"), "width of the figure, in columns of a page"),
    "connect": Option(FLAG, "a line through the points"),
    "deformed": Option(NUMBER, "deformed shape, displacements times this"),
    "errors": Option(FLAG, "error bars, where there is a column `<y>_uncertainty`"),
    "field": Option(TEXT, "field of the results (default `plastic_strain`)"),
    "height": Option(NUMBER, "height of the figure [mm]"),
    "high": Option(NUMBER, "high end of the colours, SI units"),
    "inset": Option(WINDOW, "part of the curves shown enlarged, in the units of the axes"),
    "inset_place": Option(PLACE, "where it stands, in parts of the axes"),
    "legend": Option(LEGEND, "whether there is a legend, and where"),
    "legend_title": Option(TEXT, "text above the legend"),
    "level": Option(NUMBER, "part of the peak at which the width is taken (default 0.1)"),
    "line": Option(LINE, "line of the profile"),
    "low": Option(NUMBER, "low end of the colours, SI units"),
    "marks": Option(NUMBERS, "strains marked on the curves"),
    "names": Option(TEXTS, "names of the columns `y` in the legend"),
    "normalised": Option(FLAG, "values over their peak"),
    "only": Option(RUNS, "the runs with these parameters: `only = { m = [3, 4] }`"),
    "panel_height": Option(NUMBER, "height of the tallest panel [mm]"),
    "per_row": Option(NUMBER, "panels side by side"),
    "platen": Option(_words("first", "second"), "whose reaction is shown; first: bottom or left"),
    "rows": Option(_words("runs", "series"), "series: a row of panels for each"),
    "same_scale": Option(FLAG, "all bodies drawn to one scale"),
    "scale": Option(TEXT, "unit of the y axis: `kPa`, `%`, `mm`"),
    "show_line": Option(FLAG, "the line of the profile is drawn"),
    "slope": Option(TARGET, "a line y = slope x to compare with"),
    "slope_label": Option(TEXT, "what it is called"),
    "strain": Option(NUMBERS, "nominal strain, left out: that of the study"),
    "target": Option(TARGET, "a level to compare with"),
    "target_label": Option(TEXT, "what it is called"),
    "tension_positive": Option(FLAG, "signs of stresses and strains turned"),
    "x": Option(TEXT, "parameter or column (`history`: column of the history)"),
    "x_label": Option(TEXT, "text of the axis"),
    "x_log": Option(FLAG, "logarithmic axis"),
    "x_range": Option(RANGE, "ends of the axis, in the units shown"),
    "x_unit": Option(TEXT, "unit of the x axis"),
    "y": Option(TEXTS, "as `x`; `plot` takes a list too"),
    "y_label": Option(TEXT, "text of the axis"),
    "y_log": Option(FLAG, "logarithmic axis"),
    "y_range": Option(RANGE, "ends of the axis, in the units shown"),
}


def check_options(table: Table, options: Mapping[str, Any]) -> None:
    """Complain about values of a form that the figure cannot use."""
    for key, value in options.items():
        known = OPTIONS.get(key)
        if known is not None and not known.form.fits(value):
            table.complain(key, "the option cannot be this", value, known.form.words)
