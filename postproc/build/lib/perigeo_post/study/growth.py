"""Groups of columns that tell where bands begin, how they grow, and when one takes over."""

from __future__ import annotations

from ..measure.growth import change_of, first_yield, ridge_growth
from ..measure.pattern import Pattern, pattern_of
from ..read.run import Run
from .parts import Part, Values, frame_of, measure_group, value_or
from .types import Column, State

# Nominal strains between which growth along the bands is measured: from the peak of the reference
# case on, the first step, and until both bands are there.
PEAK, SOON, FORMED = 0.0035, 0.0040, 0.0060
STATES = {"1_0": 0.010, "1_3": 0.013}  # at which the two bands are compared
PARTS = {"change_begins": 0.9, "change_half": 0.5, "change_over": 0.1}

# Of the two bands of a state, here and in measures.py.
RATIO = "weaker over stronger band, plastic strain so far"
RATIO_GROWING = "the same of what was added since the frame before"
NOT_GROWN = "there is no earlier frame, or no band in what has grown since"

_YIELD = {
    "first_yield_strain": Column("1", "nominal strain of the first row with plastic strain"),
    "first_yield_x": Column("m", "place of the largest plastic strain in the first frame with any"),
    "first_yield_y": Column("m", "the same, second coordinate"),
}
_EARLY = {
    "foot_over_centre_early": Column(
        "1", "plastic strain added along the bands at their feet over that before the crossing, "
        "0.35 to 0.4 % nominal strain",
    ),
    "lower_over_upper_early": Column("1", "the same below over above the crossing"),
}  # fmt: skip
_GROWTH = {
    "foot_over_centre": Column("1", "as foot_over_centre_early, 0.35 to 0.6 %"),
    "lower_over_upper": Column("1", "as lower_over_upper_early, 0.35 to 0.6 %"),
}
_CHANGE = {
    name: Column("1", f"nominal strain at which the weaker band adds {part:g} of the stronger")
    for name, part in PARTS.items()
}
_RATIOS = {
    name: {
        f"band_ratio_{name}": Column("1", f"{RATIO}, at {100 * strain:g} %"),
        f"band_ratio_growing_{name}": Column("1", RATIO_GROWING),
    }
    for name, strain in STATES.items()
}


def band_ratios(found: Pattern, ending: str = "") -> Values:
    """Both ratios of the bands of a state, in columns with this ending."""
    return {
        f"band_ratio{ending}": value_or(found.ratio, f"the pattern is {found.name}"),
        f"band_ratio_growing{ending}": value_or(found.ratio_growing, NOT_GROWN),
    }


def _first_yield(run: Run, state: State) -> Values:
    found = first_yield(run)
    return {
        "first_yield_strain": found.strain,
        "first_yield_x": found.place[0],
        "first_yield_y": found.place[1],
    }


def _early(run: Run, state: State) -> Values:
    found = ridge_growth(run, PEAK, SOON)
    return {
        "foot_over_centre_early": found.foot / found.centre,
        "lower_over_upper_early": found.lower / found.upper,
    }


def _growth(run: Run, state: State) -> Values:
    found = ridge_growth(run, PEAK, FORMED)
    return {
        "foot_over_centre": found.foot / found.centre,
        "lower_over_upper": found.lower / found.upper,
    }


def _change(run: Run, state: State) -> Values:
    return dict(zip(PARTS, change_of(run, list(PARTS.values()))))


def _ratios(name: str) -> Part:
    def take(run: Run, state: State) -> Values:
        return band_ratios(pattern_of(frame_of(run, State(STATES[name]))), f"_{name}")

    return take


START = measure_group({_first_yield: _YIELD, _early: _EARLY, _growth: _GROWTH})
CHANGE = measure_group({_change: _CHANGE, **{_ratios(name): _RATIOS[name] for name in STATES}})
