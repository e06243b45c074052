"""Numbers of a report as text: rounding, prefixes of units, the table of measured values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..study.types import Value
from .data import DONE, RunRecord, Study

DIGITS = 4
DASH = "–"
# What the page shows at first sight and the documents print, where a study has it.
HEADLINE = (
    "modulus_platen", "modulus_gauge", "modulus_mean", "peak_stress", "strain_at_peak",
    "stress_at_state", "largest_alpha", "width", "width_spread",
    "width_over_horizon", "width_interpolated", "width_interpolated_uncertainty",
    "width_interpolated_over_horizon", "width_interpolated_median", "angle",
    "band_ratio", "pattern", "change_half", "band_ratio_1_0", "band_ratio_growing_1_0",
    "band_ratio_1_3", "first_yield_strain", "foot_over_centre", "lower_over_upper",
    "softening_slope", "brittleness", "dissipated_energy",
    "yield_stress_variation", "kinetic_ratio_largest", "reaction_gap_largest",
    "energy_error_largest", "noise_outside", "noise_inside", "zero_energy_outside",
    "control_share", "limit_load", "stress_1_0", "force_evaluations",
)  # fmt: skip
ENOUGH = 16  # up to so many quantities all are shown
# How good a run is: small numbers.
QUALITY = (
    "kinetic_ratio_largest", "reaction_gap_largest", "energy_error_largest", "zero_energy_largest"
)  # fmt: skip
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
_PREFIXED = ("Pa", "J/m", "N/m")


@dataclass(frozen=True)
class Line:
    """One quantity of some runs: a row of the table."""

    column: str  # its name in the CSV file
    name: str
    unit: str  # empty for pure numbers and texts
    description: str
    cells: Sequence[str]


@dataclass(frozen=True)
class Values:
    """Measured values of the runs of one series."""

    labels: Sequence[str]
    lines: Sequence[Line]
    without: Sequence[str]  # quantities that no run has


def prefixed(values: Sequence[float], unit: str) -> tuple[float, str]:
    """Factor and unit with a prefix for the largest value; lengths and times stay as they are."""
    largest = max((abs(v) for v in values), default=0.0)
    if unit in _PREFIXED:
        for size, letter in _PREFIXES:
            if largest >= size:
                return 1.0 / size, f"{letter}{unit}"
    return 1.0, "" if unit == "1" else unit


def number(value: float, digits: int = DIGITS) -> str:
    """A number with this many digits; whole numbers up to a million in full."""
    if not math.isfinite(value):
        return DASH
    whole = value == int(value) or abs(value) >= 10.0**digits
    if whole and abs(value) < 1e6:
        text = f"{value + 0.0:.0f}"
    else:
        text = f"{value:.{digits}g}" if abs(value) >= 1e-3 else f"{value:.{digits - 1}e}"
    mantissa, _, exponent = text.partition("e")
    if exponent:
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        power = str(int(exponent)).replace("-", "−")
        return f"{mantissa.replace('-', '−')} × 10^{power}"
    return mantissa.replace("-", "−")


def column_text(values: Sequence[float], digits: int = DIGITS) -> list[str]:
    """Numbers that stand side by side: the same number of decimals where they are of one size."""
    sizes = [abs(v) for v in values if v != 0.0 and math.isfinite(v)]
    finite = all(map(math.isfinite, values))
    if not sizes or not finite or not 1e-3 <= max(sizes) < 1e6 or max(sizes) > 1e2 * min(sizes):
        return [number(v, digits) for v in values]
    decimals = max(0, digits - 1 - math.floor(math.log10(max(sizes))))
    texts = [f"{v + 0.0:.{decimals}f}" for v in values]
    while "." in texts[0] and all(text[-1] in "0." for text in texts):
        texts = [text[:-1] for text in texts]
    return [text.replace("-", "−") for text in texts]


def cell(value: Value) -> str:
    """One value of a table."""
    if value is None:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value or DASH
    return number(value)


def duration(seconds: float | None) -> str:
    """A run time for people."""
    if seconds is None:
        return DASH
    if seconds < 59.5:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 10:
        return f"{minutes} min {rest:02d} s"
    if seconds < 3570.0:
        return f"{seconds / 60.0:.0f} min"
    hours, minutes = divmod(round(seconds / 60.0), 60)
    return f"{hours} h {minutes:02d} min"


def plural(count: int, word: str) -> str:
    """So many of something."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def readable(column: str) -> str:
    """The name of a column as words; what ends in a strain is measured at it."""
    at_strain = re.sub(r"_(\d)_(\d)$", r" at \1.\2 %", column)
    return at_strain.replace("_", " ")


def line_of(column: str, study: Study, rows: Sequence[Mapping[str, Value]]) -> Line:
    """One column of the study for some runs."""
    values = [row.get(column) for row in rows]
    numbers = {
        k: float(v)
        for k, v in enumerate(values)
        if isinstance(v, (int, float)) and not isinstance(v, bool)
    }
    factor, unit = prefixed(list(numbers.values()), study.units.get(column, "1"))
    texts = dict(zip(numbers, column_text([factor * v for v in numbers.values()])))
    return Line(
        column=column,
        name=readable(column),
        unit=unit,
        description=study.descriptions.get(column, ""),
        cells=[texts.get(k) or cell(value) for k, value in enumerate(values)],
    )


def values_of(study: Study, runs: Sequence[RunRecord]) -> Values:
    """Parameters and measures of the runs that are done, a line for each quantity."""
    done = [run for run in runs if run.status == DONE]
    rows = [{**run.parameters, **run.row} for run in done]
    columns = list(dict.fromkeys(name for run in done for name in (*run.parameters, *run.row)))
    full = [c for c in columns if any(row.get(c) is not None for row in rows)]
    # Where one label serves several runs, the name of the run tells them apart.
    labels = [run.label for run in done]
    labels = [run.id if labels.count(label) > 1 else label for run, label in zip(done, labels)]
    return Values(
        labels=labels,
        lines=[line_of(column, study, rows) for column in full],
        without=[readable(c) for c in columns if c not in full],
    )


def headline(values: Values, runs: Sequence[RunRecord]) -> Values:
    """The parameters and the most telling measures; all, where they are few."""
    kept = {*HEADLINE, *(name for run in runs for name in run.parameters)}
    lines = [line for line in values.lines if line.column in kept]
    if len(values.lines) <= ENOUGH or not any(line.column in HEADLINE for line in lines):
        return values
    return Values(values.labels, lines, ())


def worst(study: Study, column: str) -> float | None:
    """The largest magnitude of a measure over the runs that are done."""
    found = [run.row.get(column) for run in study.runs if run.status == DONE]
    return max((abs(v) for v in found if isinstance(v, (int, float))), default=None)
