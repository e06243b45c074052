"""The measures that a study can ask for: groups of columns of its table of runs.

Each group takes one run at one state. Nothing is raised for what a run cannot tell: in place of the
value stands why there is none. doc/measures.md defines the quantities.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..measure.band import LEVEL, BandMeasure, Line
from ..measure.curves import apparent_modulus, peak, stress_strain
from ..measure.measures import (
    frame_bands,
    largest_plastic_strain,
    measure_band,
    measure_sampled_band,
)
from ..measure.moduli import gauge_modulus, mean_modulus
from ..measure.pattern import pattern_of
from ..measure.quality import (
    kinetic_bound,
    kinetic_curve,
    kinetic_state,
    largest_after,
    reaction_gap,
)
from ..measure.softening import softening_branch, strain_rate
from ..read.errors import FieldNotFoundError, RequestError
from ..read.points import FloatArray
from ..read.run import Run
from .control import CONTROL
from .growth import CHANGE, NOT_GROWN, RATIO, RATIO_GROWING, START, band_ratios
from .loads import COST, LOAD
from .parts import Part, Values, frame_of, measure_group, value_or
from .types import Column, Measure, State

STRAINS = {"0_5": 0.005, "1_0": 0.010, "1_5": 0.015}  # at which the stress is listed

# ---- curve ---------------------------------------------------------------------------------

_CURVE = {
    "peak_stress": Column("Pa", "largest axial stress (reaction of the first platen over width)"),
    "strain_at_peak": Column("1", "nominal strain at the peak stress"),
    "last_strain": Column("1", "nominal strain at the end of the run"),
    "last_stress": Column("Pa", "axial stress at the end of the run"),
}
_AT_STATE = {
    "stress_at_state": Column("Pa", "axial stress at the time of the frame of the state"),
}
_FRAME = {
    "state_strain": Column("1", "nominal strain of the frame at which fields are measured"),
    "largest_alpha": Column("1", "largest equivalent plastic strain of the body in that frame"),
}


def _curve(run: Run, state: State) -> Values:
    curve = stress_strain(run)
    stress, strain = peak(curve)
    last = (float(curve.x[-1]), float(curve.y[-1])) if len(curve.x) else (None, None)
    none = "the history has no row with a stress"
    return {
        "peak_stress": value_or(stress, none),
        "strain_at_peak": value_or(strain, none),
        "last_strain": value_or(last[0], none),
        "last_stress": value_or(last[1], none),
    }


def _curve_at_state(run: Run, state: State) -> Values:
    frame = frame_of(run, state)
    stress = stress_strain(run).y
    time = run.history()["time"][: len(stress)]
    return {"stress_at_state": float(np.interp(frame.time, time, stress))}


def _frame_numbers(run: Run, state: State) -> Values:
    frame = frame_of(run, state)
    return {"state_strain": frame.strain, "largest_alpha": largest_plastic_strain(frame)}


# ---- modulus -------------------------------------------------------------------------------

_NU = "times 1 - nu^2, from 0.02 to 0.1 % strain"
_MODULUS: dict[str, tuple[Column, Callable[[Run], float | None]]] = {
    "modulus_platen": (
        Column("Pa", f"slope of platen reaction over width against strain, {_NU}"),
        lambda run: apparent_modulus(run).value,
    ),
    "modulus_gauge": (
        Column(
            "Pa", f"slope of the same stress against the strain between two lines inside, {_NU}"
        ),
        lambda run: gauge_modulus(run).value,
    ),
    "modulus_gauge_rows": (
        Column(
            "Pa", "as modulus_gauge, but from single rows of points, which carry zero-energy modes"
        ),
        lambda run: gauge_modulus(run, thick=False).value,
    ),
    "modulus_mean": (
        Column("Pa", f"slope of mean stress against mean strain of the body, {_NU}"),
        lambda run: mean_modulus(run).value,
    ),
    "modulus_mean_corrected": (
        Column(
            "Pa", "as modulus_mean, without what the mean lateral stress adds to the axial stress"
        ),
        lambda run: mean_modulus(run, True).value,
    ),
    "modulus_target": (
        Column("Pa", "Young's modulus of the input"),
        lambda run: run.number("material.youngs_modulus"),
    ),
}


def _modulus(name: str) -> Part:
    return lambda run, state: {name: _MODULUS[name][1](run)}


# ---- band ----------------------------------------------------------------------------------

_BAND = {
    "width": Column("m", "width of the band at 10 % of its peak: median of fits along the band"),
    "width_spread": Column("m", "half the distance of the quartiles of those fits"),
    "width_over_horizon": Column("1", "width over horizon"),
    "width_over_horizon_spread": Column("1", "width_spread over horizon"),
    "width_over_spacing": Column("1", "width over spacing"),
    "width_interpolated": Column("m", "width between points along the line of the profile"),
    "width_interpolated_uncertainty": Column("m", "half a spacing at each edge"),
    "width_interpolated_closed": Column("1", "false: the profile ends before 10 %, a lower bound"),
    "width_interpolated_over_horizon": Column("1", "width_interpolated over horizon"),
    "width_interpolated_over_horizon_uncertainty": Column("1", "its uncertainty over horizon"),
    "width_interpolated_median": Column("m", "median of such widths along and across the band"),
    "peak_alpha": Column("1", "peak of the profile"),
    "angle": Column("degrees", "angle between the prevailing band and the loading axis"),
    "angle_uncertainty": Column("degrees", "one spacing over the length fitted"),
    "direction": Column("1", "diagonal of the prevailing band, rising or falling"),
    "profile_mirrored": Column("1", "true: the given line was mirrored to cross the band"),
}
_PATTERN = {
    "band_ratio": Column("1", RATIO),
    "band_ratio_growing": Column("1", RATIO_GROWING),
    "pattern": Column("1", "X: weaker band from 0.25 of the stronger on; single; diffuse; none"),
    "pattern_growing": Column("1", "the same of what was added, X from 0.5 on"),
}


def line_meeting(line: Line, run: Run, along: Line) -> tuple[Line, bool]:
    """The line, or its mirror image in the body where the line runs along the band, not across.

    Mirrored is the coordinate across the loading axis. The second value says whether it was.
    """
    ends, band = np.array(line), np.array(along)
    one, other = ends[1] - ends[0], band[1] - band[0]
    cosine = abs(float(one @ other)) / float(np.hypot(*one) * np.hypot(*other))
    if cosine <= np.sqrt(0.5):
        return line, False
    k = 1 if run.strain_axis == "x" else 0
    ends[:, k] = run.lower[k] + run.upper[k] - ends[:, k]
    return ((float(ends[0, 0]), float(ends[0, 1])), (float(ends[1, 0]), float(ends[1, 1]))), True


def band_at(run: Run, state: State, level: float = LEVEL) -> tuple[BandMeasure, bool]:
    """The prevailing band of a state, along its line; and whether the line was mirrored."""
    frame = frame_of(run, state)
    line, mirrored = state.line, False
    if line is not None:
        line, mirrored = line_meeting(line, run, frame_bands(frame).prevailing.line)
    if state.sampled is not None:
        return measure_sampled_band(frame, state.sampled, line, level), mirrored
    return measure_band(run, number=frame.number, line=line, level=level), mirrored


def _band(run: Run, state: State) -> Values:
    found, mirrored = band_at(run, state)
    fitted, read, strong = found.widths[0], found.interpolated, found.bands.prevailing
    none = "no profile could be fitted along the band"
    return {
        "width": value_or(fitted.width, none),
        "width_spread": value_or(fitted.spread, none),
        "width_over_horizon": value_or(fitted.width / found.horizon, none),
        "width_over_horizon_spread": value_or(fitted.spread / found.horizon, none),
        "width_over_spacing": value_or(fitted.width / found.spacing, none),
        "width_interpolated": read.width,
        "width_interpolated_uncertainty": read.uncertainty,
        "width_interpolated_closed": read.closed,
        "width_interpolated_over_horizon": read.width / found.horizon,
        "width_interpolated_over_horizon_uncertainty": read.uncertainty / found.horizon,
        "width_interpolated_median": strong.width_interpolated,
        "peak_alpha": read.peak,
        "angle": strong.angle,
        "angle_uncertainty": strong.angle_uncertainty,
        "direction": strong.direction,
        "profile_mirrored": mirrored,
    }


def _pattern(run: Run, state: State) -> Values:
    found = pattern_of(frame_of(run, state))
    return {
        **band_ratios(found),
        "pattern": found.name,
        "pattern_growing": value_or(found.growing, NOT_GROWN),
    }


# ---- quality -------------------------------------------------------------------------------

_KINETIC = {
    "kinetic_ratio": Column("1", "kinetic energy of v - v_ref over internal energy at the state"),
    "kinetic_ratio_largest": Column("1", "largest of the frames from 0.05 % strain on"),
}
_KINETIC_BOUND = {
    "kinetic_bound_peak": Column("1", "upper bound of that ratio at the peak stress"),
    "kinetic_bound_largest": Column("1", "largest upper bound from 0.05 % strain on"),
}
_GAP = {
    "reaction_gap": Column(
        "1", "difference of the platen reactions over the largest, at the state"
    ),
    "reaction_gap_peak": Column("1", "the same at the peak stress"),
    "reaction_gap_largest": Column("1", "largest from 0.05 % strain on"),
}
_BALANCE = {
    "energy_error_largest": Column("1", "largest error of the energy balance of the program"),
}
_ZERO_ENERGY = {
    "zero_energy_largest": Column("1", "largest zero-energy measure of the body at the state"),
}


def _kinetic(run: Run, state: State) -> Values:
    return {
        "kinetic_ratio": kinetic_state(frame_of(run, state)).ratio,
        "kinetic_ratio_largest": largest_after(kinetic_curve(run)),
    }


def _bound(run: Run, state: State) -> Values:
    curve = kinetic_bound(run)
    _, at = peak(stress_strain(run))
    return {"kinetic_bound_peak": curve.at(at), "kinetic_bound_largest": largest_after(curve)}


def _gap(run: Run, state: State) -> Values:
    curve = reaction_gap(run)
    _, at = peak(stress_strain(run))
    return {
        "reaction_gap": curve.at(frame_of(run, state).strain),
        "reaction_gap_peak": curve.at(at),
        "reaction_gap_largest": largest_after(curve),
    }


def _balance(run: Run, state: State) -> Values:
    return {"energy_error_largest": float(np.nanmax(np.abs(run.history()["energy_error"])))}


def _zero_energy(run: Run, state: State) -> Values:
    return {"zero_energy_largest": float(frame_of(run, state)["zero_energy"][run.body].max())}


# ---- softening -----------------------------------------------------------------------------

_BRANCH = {
    "strain_at_90": Column("1", "nominal strain where the stress has fallen to 90 % of its peak"),
    "strain_at_50": Column("1", "nominal strain where it has fallen to 50 %"),
    "softening_slope": Column("Pa", "fall of stress over strain between 90 and 50 % of the peak"),
    "softening_displacement": Column("m", "motion of the platens between 90 and 50 %"),
}
_BRITTLENESS = {
    "brittleness": Column("1", "softening_slope over the elastic slope"),
}
_STRESS_RATIO = {
    "stress_ratio": Column("1", "axial stress at the state over its peak"),
}
_STRESSES = {
    f"stress_{name}": Column(
        "Pa", f"axial stress at {100.0 * s:g} % nominal strain, in tension at minus that"
    )
    for name, s in STRAINS.items()
}
_DISSIPATION = {
    "dissipated_energy": Column("J/m", "plastic work up to the state"),
    "dissipated_density": Column("J/m^3", "the same over the area of the body"),
}
_RATE = {
    "strain_rate": Column("1/s", "mean rate of the nominal strain"),
    "approach_velocity": Column(
        "m/s", "mean velocity at which the platens approach, negative in tension"
    ),
}


def _branch(run: Run, state: State) -> Values:
    found = softening_branch(run)
    early = "the run ends before the stress has fallen that far"
    return {
        "strain_at_90": value_or(found.strain_upper, early),
        "strain_at_50": value_or(found.strain_lower, early),
        "softening_slope": value_or(found.slope, early),
        "softening_displacement": value_or(found.displacement, early),
    }


def _brittleness(run: Run, state: State) -> Values:
    slope = softening_branch(run).slope / apparent_modulus(run).slope
    return {"brittleness": value_or(slope, "the run ends before the stress has fallen to 50 %")}


def _stresses(run: Run, state: State) -> Values:
    curve = stress_strain(run)
    return {
        f"stress_{name}": value_or(
            curve.at(curve.toward(strain)), "the run does not reach this strain"
        )
        for name, strain in STRAINS.items()
    }


def _stress_ratio(run: Run, state: State) -> Values:
    stress = _curve_at_state(run, state)["stress_at_state"]
    assert isinstance(stress, float)
    return {"stress_ratio": stress / peak(stress_strain(run))[0]}


def _dissipation(run: Run, state: State) -> Values:
    history = run.history()
    work = np.interp(frame_of(run, state).time, history["time"], history["plastic_dissipation"])
    area = float(run.volumes[run.body].sum())
    return {"dissipated_energy": float(work), "dissipated_density": float(work) / area}


def _rate(run: Run, state: State) -> Values:
    rate = strain_rate(run)
    return {"strain_rate": rate, "approach_velocity": rate * run.length}


# ---- field ---------------------------------------------------------------------------------

_FIELD = {
    "yield_stress_mean": Column("Pa", "mean initial yield stress of the body, over its volume"),
    "yield_stress_variation": Column("1", "its coefficient of variation"),
    "yield_stress_least": Column("Pa", "its smallest value"),
}
_FIELD_IN_BAND = {
    "yield_stress_band": Column("Pa", "its mean where the plastic strain exceeds half the peak"),
}


def _strength(run: Run) -> FloatArray:
    """Initial yield stress of the points of the body."""
    try:
        return run.last_frame["yield_stress"][run.body]
    except FieldNotFoundError:
        raise RequestError("the result holds no field of the yield stress") from None


def _field(run: Run, state: State) -> Values:
    values = _strength(run)
    volumes = run.volumes[run.body]
    mean = float(np.average(values, weights=volumes))
    spread = float(np.sqrt(np.average((values - mean) ** 2, weights=volumes)))
    return {
        "yield_stress_mean": mean,
        "yield_stress_variation": spread / mean,
        "yield_stress_least": float(values.min()),
    }


def _field_in_band(run: Run, state: State) -> Values:
    values = _strength(run)
    alpha = frame_of(run, state)["plastic_strain"][run.body]
    inside = alpha > 0.5 * measure_band(run, number=frame_of(run, state).number).interpolated.peak
    return {
        "yield_stress_band": float(
            np.average(values[inside], weights=run.volumes[run.body][inside])
        )
    }


MEASURES: dict[str, Measure] = {
    "curve": measure_group({_curve: _CURVE, _curve_at_state: _AT_STATE, _frame_numbers: _FRAME}),
    "modulus": measure_group(
        {_modulus(name): {name: about} for name, (about, _) in _MODULUS.items()}
    ),
    "band": measure_group({_band: _BAND, _pattern: _PATTERN}),
    "quality": measure_group(
        {
            _kinetic: _KINETIC,
            _bound: _KINETIC_BOUND,
            _gap: _GAP,
            _balance: _BALANCE,
            _zero_energy: _ZERO_ENERGY,
        }
    ),
    "softening": measure_group(
        {
            _branch: _BRANCH,
            _brittleness: _BRITTLENESS,
            _stress_ratio: _STRESS_RATIO,
            _stresses: _STRESSES,
            _dissipation: _DISSIPATION,
            _rate: _RATE,
        }
    ),
    "start": START,
    "change": CHANGE,
    "control": CONTROL,
    "load": LOAD,
    "cost": COST,
    "field": measure_group({_field: _FIELD, _field_in_band: _FIELD_IN_BAND}),
}
