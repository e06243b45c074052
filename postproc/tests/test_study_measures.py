"""The groups of columns that a study measures."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from perigeo_post import Run
from perigeo_post.measure.noise import alternating, flow_threshold
from perigeo_post.study.measures import MEASURES, line_meeting
from perigeo_post.study.types import Missing, State, Value

AT_ONE = State(0.01)
PAPER = ((0.0, 0.5), (1.0, 1.5))


def take(path: Path, group: str, state: State = AT_ONE) -> dict[str, Value]:
    """The values of a group, None where there is a reason in place of a value."""
    found = MEASURES[group].take(Run(path), state)
    return {k: None if isinstance(v, Missing) else v for k, v in found.items()}


def reasons(path: Path, group: str, state: State = AT_ONE) -> dict[str, str]:
    found = MEASURES[group].take(Run(path), state)
    return {k: v.reason for k, v in found.items() if isinstance(v, Missing)}


@pytest.mark.parametrize("group", sorted(MEASURES))
@pytest.mark.parametrize("kind", ["result", "cut_off", "failed", "cloud"])
@pytest.mark.parametrize("state", [State(), AT_ONE, State(0.5)])
def test_every_column_is_there_and_nothing_is_raised(
    group: str, kind: str, state: State, request: pytest.FixtureRequest
) -> None:
    found = take(request.getfixturevalue(kind), group, state)
    assert list(found) == list(MEASURES[group].columns)
    for value in found.values():
        assert value is None or isinstance(value, (bool, str)) or np.isfinite(value)


def test_a_value_that_is_not_there_has_a_reason(result: Path, cloud: Path) -> None:
    assert "frames" in reasons(result, "modulus")["modulus_gauge"]
    assert set(reasons(result, "field").values()) == {
        "the result holds no field of the yield stress"
    }
    for group in MEASURES:
        assert all(reasons(cloud, group).values())


def test_columns_have_units_and_sentences_and_one_group_each() -> None:
    names = [name for measure in MEASURES.values() for name in measure.columns]
    assert len(names) == len(set(names))
    for measure in MEASURES.values():
        for column in measure.columns.values():
            assert column.unit
            assert column.description[-1] != "."


def test_the_curve_and_its_state(result: Path) -> None:
    found = take(result, "curve")
    assert found["peak_stress"] == pytest.approx(50e6 / 0.91 * 0.0034, rel=0.01)
    assert found["strain_at_peak"] == pytest.approx(0.0034, abs=5e-5)
    assert found["state_strain"] == 0.01
    top = 50e6 / 0.91 * 0.0034
    assert found["stress_at_state"] == pytest.approx(top - 2e7 * 0.0066, rel=0.01)
    assert found["last_stress"] == pytest.approx(3e4)
    assert found["largest_alpha"] == pytest.approx(0.7 * 0.3, rel=0.05)
    assert take(result, "curve", State())["state_strain"] == 0.016


def test_the_moduli_that_a_run_has(result: Path) -> None:
    found = take(result, "modulus")
    assert found["modulus_platen"] == pytest.approx(50e6)
    assert found["modulus_gauge"] is None  # there are no frames in the range
    assert found["modulus_mean"] == pytest.approx(0.91 * 50e6 / 0.91)
    assert found["modulus_target"] == 50e6


def test_the_band_and_its_pattern(result: Path) -> None:
    found = take(result, "band")
    true = 2 * 0.05 * np.sqrt(2 * np.log(10))
    for name, error in (("width", 0.01), ("width_interpolated", 0.03)):
        assert found[name] == pytest.approx(true, abs=error)
        assert found[f"{name}_over_horizon"] == pytest.approx(float(str(found[name])) / 0.12)
    assert found["width_over_spacing"] == pytest.approx(float(str(found["width"])) / 0.04)
    assert 0.0 < float(str(found["width_spread"])) < 0.01
    assert found["width_interpolated_uncertainty"] == 0.04
    assert found["width_interpolated_over_horizon_uncertainty"] == pytest.approx(0.04 / 0.12)
    assert found["width_interpolated_closed"] is True
    assert found["width_interpolated_median"] == pytest.approx(true, abs=0.03)
    assert (found["direction"], found["pattern"]) == ("rising", "X")
    assert found["band_ratio"] == pytest.approx(0.5, abs=0.03)
    assert found["profile_mirrored"] is False


def test_the_line_of_the_paper_is_mirrored_to_cross_the_band(result: Path) -> None:
    """The prevailing band rises, as the line does, so the line must fall."""
    found = take(result, "band", State(0.01, PAPER))
    assert found["profile_mirrored"] is True
    assert found["peak_alpha"] == pytest.approx(0.7 * 0.2, rel=0.1)
    run = Run(result)
    assert line_meeting(PAPER, run, ((0.0, 0.0), (1.0, 1.0))) == (((1.0, 0.5), (0.0, 1.5)), True)
    assert line_meeting(PAPER, run, ((0.0, 1.0), (1.0, 0.0))) == (PAPER, False)


def test_the_quality_of_a_run(result: Path) -> None:
    found = take(result, "quality")
    assert found["reaction_gap_largest"] == pytest.approx(0.01 / 1.01, rel=1e-6)
    assert found["energy_error_largest"] == pytest.approx(1e-5)
    assert found["zero_energy_largest"] == pytest.approx(1e-3)


def test_noise_is_the_amplitude_of_what_alternates_and_tells_flow_from_the_rest() -> None:
    x, y = np.meshgrid(np.arange(20.0), np.arange(30.0))
    u = np.stack([0.3 * (-1.0) ** x + x**3, 2.0 * x - y], axis=2)
    along_y, along_x = alternating(u)
    inner = along_x[:, 2:-2]
    assert np.abs(inner[..., 0]) == pytest.approx(0.3)  # the cubic part is not seen
    assert along_y[2:-2] == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(along_x[:, :2]).all()
    assert np.isnan(along_y[-2:]).all()


@pytest.mark.parametrize(
    ("strength", "threshold"), [("0.15e6", 1e-6), ("500.0", 1e-8), (None, 1e-6)]
)
def test_soft_soil_has_flowed_at_smaller_strains(
    result: Path, strength: str | None, threshold: float
) -> None:
    with h5py.File(result, "r+") as file:
        del file["input/values"]
        values = ["material.youngs_modulus=50.0e6"]
        values += [f"material.yield_stress={strength}"] if strength else []
        file["input/values"] = values
    assert flow_threshold(Run(result)) == pytest.approx(threshold)


def test_noise_outside_and_inside_of_the_flow(result: Path) -> None:
    run = Run(result)
    alpha = np.where(run.positions[:, 1] > 1.2, 0.01, 0.0)
    layer = np.rint(run.positions[:, 0] / 0.04)
    # the horizon reaches 0.12 m from the flow: noise there belongs to neither
    amplitude = np.where(run.positions[:, 1] > 1.09, 0.004, 0.0004)
    with h5py.File(result, "r+") as file:
        frame = file[f"frames/{sorted(file['frames'])[-1]}"]
        frame["plastic_strain"][...] = alpha
        frame["displacement"][:, 0] = amplitude * (-1.0) ** layer
        frame["displacement"][:, 1] = 0.0
        frame["zero_energy"][...] = np.where(alpha > 0.0, 0.1, 0.001)
    found = take(result, "control", State())
    # of four parts, two directions and two components, one alternates: x along x; edges lack it
    assert found["zero_energy_inside"] == pytest.approx(0.1)
    assert found["zero_energy_outside"] == pytest.approx(0.001)
    assert found["noise_inside"] == pytest.approx(0.5 * 0.1, rel=0.15)
    assert found["noise_outside"] == pytest.approx(0.5 * 0.01, rel=0.15)


def test_the_softening_branch_and_what_it_dissipates(result: Path) -> None:
    found = take(result, "softening")
    assert found["softening_slope"] == pytest.approx(2e7, rel=0.01)
    assert found["brittleness"] == pytest.approx(2e7 / (50e6 / 0.91), rel=0.01)
    assert found["dissipated_energy"] == pytest.approx(5.0)
    area = Run(result).volumes[Run(result).body].sum()
    assert found["dissipated_density"] == pytest.approx(5.0 / area)
    assert found["stress_0_5"] == pytest.approx(50e6 / 0.91 * 0.0034 - 2e7 * 0.0016, rel=0.01)
    assert found["approach_velocity"] == pytest.approx(0.01)


def test_a_field_of_the_yield_stress_is_described(result: Path) -> None:
    assert set(take(result, "field").values()) == {None}
    run = Run(result)
    inside = np.flatnonzero(run.body)
    values = np.full(len(run.body), 9e9)  # fictitious points do not count
    values[inside] = np.where(np.arange(len(inside)) % 2 == 0, 1.2e5, 1.8e5)
    with h5py.File(result, "r+") as file:
        file["points/yield_stress"] = values
    found = take(result, "field")
    assert found["yield_stress_mean"] == pytest.approx(1.5e5, rel=1e-3)
    assert found["yield_stress_variation"] == pytest.approx(0.2, rel=1e-2)
    assert found["yield_stress_least"] == 1.2e5
    assert found["yield_stress_band"] == pytest.approx(1.5e5, rel=0.05)
