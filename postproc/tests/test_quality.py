"""Kinetic energy, balance of the reactions, softening branch and pattern, with known answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic
from conftest import x_bands

from perigeo_post import RequestError, Run
from perigeo_post.measure.pattern import earlier_frame, pattern_of
from perigeo_post.measure.quality import (
    kinetic_bound,
    kinetic_curve,
    kinetic_state,
    largest_after,
    reaction_gap,
    reference_velocity,
)
from perigeo_post.measure.softening import softening_branch, strain_rate

DX = 0.04
EXTRA = 0.003  # [m/s] velocity beside that of the frame


@pytest.fixture
def moving(tmp_path: Path) -> Run:
    """Velocities of the frame of the platens, and EXTRA along x at all points of the body."""
    place, boundary = synthetic.lattice(DX)
    fields = synthetic.fields_of(place, 0.0 * place[:, 0], 0.002)
    part = np.clip(place[:, 1] / 2.0, 0.0, 1.0)
    fields["velocity"] = np.c_[np.where(boundary == 0, EXTRA, 0.0), 0.001 - 0.011 * part]
    fields["velocity"][boundary == 2, 0] = 0.02  # free along the smooth platen
    path = synthetic.write_result(
        tmp_path / "moving.h5", place, boundary, [(0.002, fields), (0.004, fields)]
    )
    e = np.linspace(0.0, 0.005, 51)
    synthetic.write_columns(
        tmp_path / "moving_history.csv",
        {
            "time": 200.0 * e, "strain": e, "bottom_force_y": 1e6 * e,
            "top_force_y": -1.02e6 * e, "kinetic_energy": 0.0 * e + 0.2,
            "strain_energy": 1e3 * e, "plastic_dissipation": 4e3 * e,
        },
    )  # fmt: skip
    return Run(path)


def test_the_frame_is_linear_between_the_platens_and_at_rest_along_a_smooth_one(
    moving: Run,
) -> None:
    found = reference_velocity(moving.last_frame)
    y = moving.positions[:, 1]
    assert found[:, 1] == pytest.approx(0.001 - 0.011 * np.clip(y / 2.0, 0.0, 1.0))
    assert found[:, 0] == pytest.approx(0.0)


def test_the_kinetic_ratio_is_that_of_the_motion_beside_the_frame(moving: Run) -> None:
    state = kinetic_state(moving.frame(strain=0.002))
    body = 0.5 * 2000.0 * moving.volumes[moving.body].sum() * EXTRA**2
    sliding = 0.5 * 2000.0 * moving.volumes[moving.boundary == 2].sum() * 0.02**2
    assert state.relative == pytest.approx(body + sliding)
    assert state.internal == pytest.approx(10.0)
    assert kinetic_curve(moving).y == pytest.approx([state.ratio, 0.5 * state.ratio])


def test_the_bound_lies_above_the_ratio(moving: Run) -> None:
    bound = kinetic_bound(moving)
    reference = kinetic_state(moving.last_frame).reference
    expected = (np.sqrt(0.2) + np.sqrt(reference)) ** 2 / 20.0
    assert bound.at(0.004) == pytest.approx(expected)
    assert bound.at(0.004) > kinetic_curve(moving).y[-1]


def test_the_reactions_are_compared_with_the_largest_so_far(moving: Run) -> None:
    gap = reaction_gap(moving)
    assert gap.y == pytest.approx(0.02 / 1.02)
    assert len(gap.y) == 50  # not the unloaded state
    assert largest_after(gap, 0.1) != largest_after(gap, 0.1)  # NaN: beyond the end


def test_a_falling_reaction_keeps_the_largest_one(result: Path) -> None:
    run = Run(result)
    force = run.history()["top_force_y"]
    gap = reaction_gap(run)
    expected = abs(force[-1]) * (1.0 - 1.0 / 1.01) / np.abs(force).max()
    assert gap.y[-1] == pytest.approx(expected, rel=1e-6)
    assert largest_after(gap) == pytest.approx(0.01 / 1.01, rel=1e-6)


def test_the_softening_branch_is_a_straight_line(result: Path) -> None:
    found = softening_branch(Run(result))
    top = found.peak_stress
    assert found.slope == pytest.approx(2e7, rel=0.01)
    assert found.strain_upper - found.strain_lower == pytest.approx(-0.4 * top / 2e7, rel=0.01)
    assert found.displacement == pytest.approx(2.0 * 0.4 * top / 2e7, rel=0.01)
    assert strain_rate(Run(result)) == pytest.approx(0.005)


def test_a_run_that_ends_early_has_no_slope(tmp_path: Path, result: Path) -> None:
    history = result.with_name("made_history.csv")
    history.write_text("".join(history.read_text().splitlines(keepends=True)[:130]))
    found = softening_branch(Run(result))
    assert np.isfinite(found.strain_upper)
    assert np.isnan(found.strain_lower)
    assert np.isnan(found.slope)


def states_of(folder: Path, alphas: list[tuple[float, np.ndarray]]) -> Run:
    place, boundary = synthetic.lattice(DX)
    states = [(s, synthetic.fields_of(place, a, s)) for s, a in alphas]
    return Run(synthetic.write_result(folder / "bands.h5", place, boundary, states))


def test_a_band_that_stopped_is_seen_but_does_not_grow(tmp_path: Path) -> None:
    place, _ = synthetic.lattice(DX)
    both, more = x_bands(place, 0.1, 0.09), x_bands(place, 0.1, 0.0)
    run = states_of(tmp_path, [(0.0, 0.0 * both), (0.008, both), (0.01, both + more),
                               (0.013, both + 5.0 * more)])  # fmt: skip
    first, second, third = (pattern_of(f) for f in run.frames()[1:])
    assert (first.name, first.growing) == ("X", None)
    assert first.ratio == pytest.approx(0.9, abs=0.03)
    assert (second.name, second.growing) == ("X", "single")
    assert second.ratio == pytest.approx(0.45, abs=0.03)
    assert second.ratio_growing is not None
    assert second.ratio_growing < 0.05
    assert (third.name, third.growing) == ("single", "single")
    assert third.ratio == pytest.approx(0.15, abs=0.03)


def test_even_strain_is_diffuse_and_none_is_none(tmp_path: Path) -> None:
    place, _ = synthetic.lattice(DX)
    run = states_of(tmp_path, [(0.001, 0.0 * place[:, 0]), (0.006, 0.01 + 0.0 * place[:, 0])])
    assert [pattern_of(f).name for f in run.frames()] == ["none", "diffuse"]


def test_the_earlier_frame_is_neither_too_near_nor_too_far(tmp_path: Path) -> None:
    place, _ = synthetic.lattice(DX)
    alpha = 0.0 * place[:, 0]
    run = states_of(tmp_path, [(s, alpha) for s in (0.0, 0.004, 0.0097, 0.01, 0.0105)])
    assert earlier_frame(run.frame(strain=0.004)) is None
    assert earlier_frame(run.frame(number=2)) is None  # 0.004 is less than half of it
    found = earlier_frame(run.frame(number=4))
    assert found is not None
    assert found.strain == 0.01


def test_without_platens_nothing_is_compared(cloud: Path) -> None:
    with pytest.raises(RequestError, match="no platens"):
        reaction_gap(Run(cloud))
    assert not reference_velocity(Run(cloud).last_frame).any()
