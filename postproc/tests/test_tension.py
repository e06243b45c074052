"""A test in tension is measured as the same test in compression, signs turned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic
from conftest import x_bands

from perigeo_post import Run, compare_runs, curve_numbers, stress_strain
from perigeo_post.measure.pattern import earlier_frame, pattern_of
from perigeo_post.measure.softening import softening_branch
from perigeo_post.study.measures import MEASURES
from perigeo_post.study.types import Missing, State

# These change their sign with the strain; all other numbers are the same both ways.
SIGNED = {
    "peak_stress", "strain_at_peak", "last_strain", "last_stress", "stress_at_state",
    "state_strain", "strain_at_90", "strain_at_50", "stress_0_5", "stress_1_0", "stress_1_5",
    "strain_rate", "approach_velocity", "first_yield_strain", "change_begins", "change_half",
    "change_over",
}  # fmt: skip


def one_way(folder: Path, sign: float) -> Path:
    """A run with frames at 0, 0.5, 1 and 1.6 %; below 0 in tension."""
    folder.mkdir()
    points, boundary = synthetic.lattice()
    alpha = x_bands(points)
    grown = synthetic.gaussian_band(points, (0.5, 0.6), 45.0, True, 0.05, 0.3)
    states = [
        (sign * strain, synthetic.fields_of(points, values, sign * strain))
        for strain, values in (
            (0.0, 0.0 * alpha), (0.005, 0.3 * alpha), (0.01, 0.7 * alpha),
            (0.016, 0.7 * alpha + grown),
        )
    ]  # fmt: skip
    path = synthetic.write_result(folder / "made.h5", points, boundary, states)
    history = synthetic.write_history(folder / "made_history.csv")
    lines = [line.split(",") for line in history.read_text().splitlines()]
    columns = {n: np.array([float(r[k]) for r in lines[1:]]) for k, n in enumerate(lines[0])}
    for name in columns:
        if name == "strain" or "_force_" in name or name.startswith("mean_"):
            columns[name] *= sign
    synthetic.write_columns(history, columns)
    return path


@pytest.fixture
def both(tmp_path: Path) -> tuple[Path, Path]:
    return one_way(tmp_path / "compression", 1.0), one_way(tmp_path / "tension", -1.0)


@pytest.mark.parametrize("group", sorted(MEASURES))
def test_every_measure_of_a_study_is_there_in_tension(both: tuple[Path, Path], group: str) -> None:
    """A state is asked for without a sign in both."""
    one, other = (MEASURES[group].take(Run(path), State(0.016)) for path in both)
    for name, value in one.items():
        if isinstance(value, Missing):
            assert isinstance(other[name], Missing), name
        elif isinstance(value, (bool, str)):
            assert other[name] == value, name
        else:
            sign = -1.0 if name in SIGNED else 1.0
            assert other[name] == pytest.approx(sign * float(value), rel=1e-9), name


def test_the_branch_behind_the_peak_has_positive_slope_and_way(both: tuple[Path, Path]) -> None:
    found = softening_branch(Run(both[1]))
    assert found.slope == pytest.approx(2e7, rel=0.01)
    assert found.displacement == pytest.approx(0.4 * 50e6 / 0.91 * 0.0034 / 2e7 * 2.0, rel=0.02)
    assert (found.peak_stress, found.strain_at_peak) < (0.0, 0.0)


def test_what_grows_is_seen_in_tension(both: tuple[Path, Path]) -> None:
    last = Run(both[1]).last_frame
    before = earlier_frame(last)
    assert before is not None
    assert before.strain == -0.01
    found = pattern_of(last)
    assert (found.growing, found.ratio_growing) == ("single", pytest.approx(0.0, abs=0.05))
    first = Run(both[1]).frame(number=1)
    assert earlier_frame(first) is None  # the unloaded frame has less than half its strain


def test_strains_without_a_sign_lie_in_the_direction_of_loading(both: tuple[Path, Path]) -> None:
    down, up = (Run(path) for path in both)
    assert [run.frame(strain=0.01).number for run in (down, up)] == [2, 2]
    assert up.frame(strain=-0.01).number == 2
    numbers = [curve_numbers(run, strains=(0.01, 0.003)) for run in (down, up)]
    for key in ("0.01", "0.003"):
        assert numbers[1]["stress_at"][key] == pytest.approx(-numbers[0]["stress_at"][key])
        assert numbers[1]["stress_at"][key] < 0.0
    rows = compare_runs([down, up], ["down", "up"], [0.01])
    assert rows[1]["stress_at_0.01"] == pytest.approx(-rows[0]["stress_at_0.01"])
    assert rows[1]["alpha_at_0.01"] == rows[0]["alpha_at_0.01"] > 0.0


@pytest.mark.parametrize("tension_positive", [False, True])
def test_the_direction_of_a_curve(both: tuple[Path, Path], tension_positive: bool) -> None:
    turned = -1.0 if tension_positive else 1.0
    for path, way in zip(both, (1.0, -1.0)):
        curve = stress_strain(Run(path), tension_positive)
        assert curve.toward(0.01) == turned * way * 0.01
        assert curve.toward(-0.01) == -turned * 0.01  # with a sign: compression positive
        assert curve.toward(0.0) == 0.0
