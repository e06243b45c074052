"""What the figures of studies share: their options, groups of runs, words and units for axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes

from ..draw.legends import LegendPlace, best_place, placed
from ..draw.style import COLOURS, DASHES, DOUBLE, SINGLE, prefix_for, with_unit
from ..read.errors import RequestError
from .types import Column, StudyRun, Value

MARKERS = ["o", "s", "^", "D", "v", "P", "X"]
COMMON = frozenset({"only", "column", "height"})  # options of every kind of figure
AXES = frozenset({"x_label", "y_label", "x_log", "y_log", "x_range", "y_range", "scale"})
LEAST_RANGE = 0.04  # of the largest value: a y axis shows at least this much

Row = dict[str, Value]

# Display units: factor from the SI unit
_SCALES: dict[str, dict[str, float]] = {
    "Pa": {"Pa": 1.0, "kPa": 1e-3, "MPa": 1e-6, "GPa": 1e-9},
    "m": {"m": 1.0, "cm": 1e2, "mm": 1e3},
    "m/s": {"m/s": 1.0, "cm/s": 1e2, "mm/s": 1e3},
    "J/m": {"J/m": 1.0, "kJ/m": 1e-3},
    "J/m^3": {"J/m^3": 1.0, "kJ/m^3": 1e-3},
    "N/m": {"N/m": 1.0, "kN/m": 1e-3, "MN/m": 1e-6},
    "1": {"1": 1.0, "%": 1e2},
}

_WORDS = {
    "delta": "Horizon δ [m]",
    "horizon": "Horizon δ [m]",
    "dx": "Spacing Δx [m]",
    "spacing": "Spacing Δx [m]",
    "m": "m = δ/Δx [–]",
    "strain": "Nominal strain",
    "width": "Width of the band",
    "width_interpolated": "Width of the band between points",
    "width_over_horizon": "Width of the band over horizon",
    "width_interpolated_over_horizon": "Width between points over horizon",
    "width_over_spacing": "Width of the band over spacing",
    "largest_alpha": "Largest plastic strain",
    "max_plastic_strain": "Largest plastic strain",
    "peak_alpha": "Peak of the plastic strain",
    "angle": "Angle to the loading axis",
    "peak_stress": "Peak stress",
    "stress_at_state": "Axial stress",
    "modulus_platen": "Platen",
    "modulus_gauge": "Gauge",
    "modulus_gauge_rows": "Gauge, single rows",
    "modulus_mean": "Mean stress and strain",
    "modulus_mean_corrected": "The same, corrected",
    "reaction_gap": "Difference of the reactions",
    "kinetic_ratio": "Kinetic over internal energy",
}


@dataclass(frozen=True)
class Look:
    """How a line is drawn."""

    colour: str
    dash: Any
    marker: str


def look(k: int, dash: int | None = None) -> Look:
    """Colour, dash and marker of the k-th line; `dash` chooses the latter two apart from colour."""
    j = k if dash is None else dash
    return Look(COLOURS[k % len(COLOURS)], DASHES[j % len(DASHES)], MARKERS[j % len(MARKERS)])


# ---- options -------------------------------------------------------------------------------


def number(options: Mapping[str, Any], name: str, default: float | None = None) -> float | None:
    """An option that is one number."""
    value = options.get(name, default)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RequestError(f"the option {name} must be a number, not {value!r}")
    return float(value)


def numbers(options: Mapping[str, Any], name: str, count: int | None = None) -> list[float]:
    """An option that is one number or a list of them; empty where it is not given."""
    value = options.get(name, [])
    items = list(value) if isinstance(value, (list, tuple)) else [value]
    if any(isinstance(v, bool) or not isinstance(v, (int, float)) for v in items):
        raise RequestError(f"the option {name} must be numbers, not {value!r}")
    if count is not None and items and len(items) != count:
        raise RequestError(f"the option {name} must be {count} numbers, not {len(items)}")
    return [float(v) for v in items]


def text(options: Mapping[str, Any], name: str, default: str = "") -> str:
    """An option that is text."""
    value = options.get(name, default)
    if not isinstance(value, str):
        raise RequestError(f"the option {name} must be text, not {value!r}")
    return value


def texts(options: Mapping[str, Any], name: str) -> list[str]:
    """An option that is text or a list of texts; empty where it is not given."""
    value = options.get(name, [])
    items = list(value) if isinstance(value, (list, tuple)) else [value]
    if not all(isinstance(v, str) for v in items):
        raise RequestError(f"the option {name} must be text, not {value!r}")
    return items


def flag(options: Mapping[str, Any], name: str, default: bool = False) -> bool:
    """An option that is true or false."""
    value = options.get(name, default)
    if not isinstance(value, bool):
        raise RequestError(f"the option {name} must be true or false, not {value!r}")
    return value


def choice(options: Mapping[str, Any], name: str, allowed: Sequence[str]) -> str:
    """An option with one of several words, the first by default."""
    value = text(options, name, allowed[0])
    if value not in allowed:
        raise RequestError(f"the option {name} must be {' or '.join(allowed)}, not {value!r}")
    return value


def width_of(options: Mapping[str, Any], default: str = "single") -> float:
    """Width of the figure [mm] from the option `column`."""
    names = ["single", "double"] if default == "single" else ["double", "single"]
    return {"single": SINGLE, "double": DOUBLE}[choice(options, "column", names)]


def selected(runs: Sequence[StudyRun], options: Mapping[str, Any]) -> list[StudyRun]:
    """The runs with the parameters of the option `only`: one value each, or a list of them."""
    only = options.get("only", {})
    if not isinstance(only, Mapping):
        raise RequestError(f"the option only must be a table of parameters, not {only!r}")
    found = [run for run in runs if all(_agrees(run, key, v) for key, v in only.items())]
    if not found:
        raise RequestError("no run with a result to draw")
    return found


def _agrees(run: StudyRun, key: str, wanted: Any) -> bool:
    there = value_of(run, key)
    allowed = wanted if isinstance(wanted, (list, tuple)) else [wanted]
    return any(_same(there, value) for value in allowed)


def _same(one: Any, other: Any) -> bool:
    both = (one, other)
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in both):
        return abs(float(one) - float(other)) <= 1e-9 * max(abs(float(one)), abs(float(other)))
    return bool(one == other)


# ---- runs ----------------------------------------------------------------------------------


def value_of(run: StudyRun, name: str) -> Value:
    """A parameter, a column of the table, or "series" or "label"; None where there is none."""
    if name in run.parameters:
        return run.parameters[name]
    if name in run.row:
        return run.row[name]
    return {"series": run.series, "label": run.label, "run": run.id}.get(name)


def require_known(runs: Sequence[StudyRun], name: str, columns: Mapping[str, Column]) -> None:
    """An error for a name that is neither a parameter nor a column of any run."""
    there = {*columns, "series", "label", "run"}
    there = there.union(*(run.parameters for run in runs), *(run.row for run in runs))
    if name not in there:
        raise RequestError(f"there is no '{name}'; there are: {', '.join(sorted(there))}")


def shown(value: Value) -> str:
    """A value for legends and ticks."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def grouped(
    runs: Sequence[StudyRun], by: str, with_name: bool = False
) -> dict[str, list[StudyRun]]:
    """Runs by the value of a parameter or column, in order of appearance; series by their titles.

    `with_name`: numbers stand behind the name of their parameter, where no title tells it.

    Two series with the same title would be one: they keep their names.
    """
    groups: dict[str, list[StudyRun]] = {}
    for run in runs:
        groups.setdefault(named(run, by) if with_name else shown(value_of(run, by)), []).append(run)
    titles = [members[0].series_title or name for name, members in groups.items()]
    if by == "series" and len(set(titles)) == len(groups):
        return dict(zip(titles, groups.values()))
    return groups


def named(run: StudyRun, by: str) -> str:
    """A value with the name of its parameter, unless it is a word."""
    value = value_of(run, by)
    if value is None or isinstance(value, str):
        return shown(value)
    return f"{by.replace('_', ' ')} = {shown(value)}"


# ---- axes ----------------------------------------------------------------------------------


def words(name: str) -> str:
    """Text for a quantity, without unit; a symbol stays as it is: p is not P."""
    plain = name.replace("_", " ")
    symbol = len(plain) <= 2 or plain != plain.lower()
    return _WORDS.get(name, plain if symbol else plain[:1].upper() + plain[1:])


def display_unit(unit: str, wanted: str, largest: float) -> tuple[float, str]:
    """Factor and unit shown: the wanted one, or one that keeps numbers short."""
    if wanted:
        known = _SCALES.get(unit, {unit: 1.0})
        if wanted not in known:
            raise RequestError(f"the unit {wanted!r} does not fit; allowed: {', '.join(known)}")
        return known[wanted], wanted
    if unit == "m":  # lengths of soil specimens read best in metres
        return 1.0, unit
    return prefix_for(largest, unit)


def axis_text(name: str, unit: str, given: str = "") -> str:
    """Text of an axis: the given one, or words and unit; words may hold their unit already."""
    found = given or words(name)
    return found if "[" in found else with_unit(found, unit.replace("^3", "³"))


def set_ranges(ax: Axes, options: Mapping[str, Any]) -> None:
    """Logarithmic axes, and ranges in the units shown."""
    for axis in ("x", "y"):
        if flag(options, f"{axis}_log"):
            ax.set(**{f"{axis}scale": "log"})
        limits = numbers(options, f"{axis}_range", 2)
        if limits:
            ax.set(**{f"{axis}lim": (limits[0], limits[1])})


def widen(ax: Axes) -> None:
    """Show at least a small part of the values, so that nearly equal ones look nearly equal."""
    if ax.get_yscale() == "log":
        return
    low, high = ax.get_ylim()
    least = LEAST_RANGE * max(abs(low), abs(high))
    if high - low < least:
        middle = 0.5 * (low + high)
        ax.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def finish(ax: Axes) -> None:
    """A light grid behind the lines."""
    ax.grid(True, linewidth=0.3, color="0.85")
    ax.set_axisbelow(True)


def legend_place(
    options: Mapping[str, Any], labels: Sequence[str], most_inside: int, wanted: bool = True
) -> LegendPlace:
    """Where a legend with these labels fits: inside the axes up to `most_inside` entries.

    Else above them in two columns where that fits a single column of a page, else beside them. The
    option `legend` (true, false, "inside", "above", "aside") overrides this.
    """
    given = options.get("legend", wanted)
    places = ("inside", "above", "aside")
    if not isinstance(given, bool) and given not in places:
        raise RequestError(f"the option legend must be true, false, {' or '.join(places)}")
    if given is False:
        where = "none"
    elif isinstance(given, str):
        where = given
    else:
        where = best_place(labels, most_inside)
    width = width_of(options, "double" if where == "aside" else "single")
    return placed(labels, where, width, text(options, "legend_title"))
