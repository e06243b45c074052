"""Where bands begin, how they grow along their ridges, when one takes over, from made-up fields."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import synthetic

from perigeo_post import PostError, Run
from perigeo_post.measure.growth import change_of, falls_below, first_yield, ridge_growth
from perigeo_post.measure.measures import (
    measure_band,
    measure_sampled_band,
    sampled_plastic_strain,
)
from perigeo_post.study.measures import MEASURES
from perigeo_post.study.types import Missing, State

CROSSING = (0.5, 0.6)
SIGMA = 0.04
FALL = [1.0, 1.0, 0.8, 0.4, 0.0, 0.0]  # what the falling band gains from frame to frame


def band(points: np.ndarray, rising: bool, peak: float = 0.1) -> np.ndarray:
    return synthetic.gaussian_band(points, CROSSING, 45.0, rising, SIGMA, peak)


def made(folder: Path, states: Sequence[tuple[float, np.ndarray]], dx: float = 0.02) -> Run:
    """A run with these states: strain and plastic strain of the points of `synthetic.lattice`."""
    points, boundary = synthetic.lattice(dx)
    frames = [(strain, synthetic.fields_of(points, alpha, strain)) for strain, alpha in states]
    path = synthetic.write_result(folder / "made.h5", points, boundary, frames, spacing=dx)
    synthetic.write_history(folder / "made_history.csv")
    return Run(path)


def growing(folder: Path, sign: float = 1.0) -> Run:
    """Frames every 0.05 % from 0.5 % on; the falling band stops, the rising one goes on."""
    points, _ = synthetic.lattice(0.02)
    weak, strong = band(points, False, 0.01), band(points, True, 0.01)
    alpha = 3.0 * (weak + strong)
    states = [(sign * 0.005, alpha)]
    for k, part in enumerate(FALL):
        alpha = alpha + strong + part * weak
        states.append((sign * (0.0055 + 0.0005 * k), alpha))
    return made(folder, states)


# ---- first yield and growth along the ridge --------------------------------------------------


def test_first_yield_has_the_strain_of_the_history_and_the_place_of_the_first_frame(
    tmp_path: Path,
) -> None:
    points, _ = synthetic.lattice(0.02)
    corner = np.hypot(points[:, 0] - 1.0, points[:, 1] - 0.04) < 1e-9
    later = band(points, True)  # larger elsewhere, but later
    run = made(tmp_path, [(0.0, 0.0 * later), (0.0036, 1e-5 * corner), (0.006, later)])
    found = first_yield(run)
    assert found.place == pytest.approx((1.0, 0.04))
    # The history of `synthetic` is plastic from 0.34 % on, in rows 0.004 % apart.
    assert 0.0034 < found.strain < 0.0034 + 0.016 / 399 + 1e-12


@pytest.mark.parametrize("slope", [0.0, 0.8, -0.8])
def test_growth_along_the_ridge_tells_the_foot_from_the_centre(
    tmp_path: Path, slope: float
) -> None:
    """Both bands gain 1 + slope (0.6 - y) along their ridges."""
    points, _ = synthetic.lattice(0.02)
    both = np.maximum(band(points, True), band(points, False))
    start = 0.01 * both
    added = 0.3 * both * (1.0 + slope * (0.6 - points[:, 1]))
    found = ridge_growth(made(tmp_path, [(0.0035, start), (0.006, start + added)]), 0.0035, 0.006)

    # The bands run from y = 0.1 to 1.1. A tenth at each end is left out, and 1.5 horizons of
    # 0.12 m on either side of the other band: to y = 0.6 -+ 0.18 / sqrt(2).
    low, high, away = 0.2, 0.6 - 0.18 / np.sqrt(2.0), 0.6 + 0.18 / np.sqrt(2.0)
    third = (high - low) / 3.0

    def mean(one: float, other: float) -> float:
        return 0.03 * (1.0 + slope * (0.6 - 0.5 * (one + other)))

    assert found.foot == pytest.approx(mean(low, low + third), rel=0.03)
    assert found.centre == pytest.approx(mean(high - third, high), rel=0.03)
    assert found.lower == pytest.approx(mean(low, high), rel=0.03)
    assert found.upper == pytest.approx(mean(away, 1.0), rel=0.03)


def test_one_band_alone_has_no_growth_of_two(tmp_path: Path) -> None:
    points, _ = synthetic.lattice(0.02)
    run = made(tmp_path, [(0.0035, band(points, True, 0.01)), (0.006, band(points, True))])
    with pytest.raises(PostError):
        ridge_growth(run, 0.0035, 0.006)


# ---- the change from two bands to one --------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_change_is_where_growth_of_the_weaker_band_falls(tmp_path: Path, sign: float) -> None:
    """Growth 1, 1, 0.8, 0.4, 0, 0 at the middles 0.525, 0.575 ... 0.775 %."""
    begins, half, over = change_of(growing(tmp_path, sign), [0.9, 0.5, 0.1])
    # A ratio measured in a field of crossing bands is not that of the two made to some per cent.
    assert sign * begins == pytest.approx(0.00575 + 0.5 * 0.0005, abs=5e-5)
    assert sign * half == pytest.approx(0.00625 + 0.75 * 0.0005, abs=5e-5)
    assert sign * over == pytest.approx(0.00675 + 0.75 * 0.0005, abs=5e-5)


def test_the_last_fall_counts_and_there_must_be_one() -> None:
    x = np.array([1.0, 2.0, 3.0, 4.0])
    assert falls_below(x, np.array([0.8, 0.4, 0.8, 0.2]), 0.5) == pytest.approx(3.5)
    with pytest.raises(PostError, match="one band prevails in all frames"):
        falls_below(x, np.array([0.4, 0.3, 0.2, 0.1]), 0.5)
    with pytest.raises(PostError, match="both bands still grow"):
        falls_below(x, np.array([0.4, 0.3, 0.2, 0.6]), 0.5)
    with pytest.raises(PostError, match="one band prevails in all frames"):
        falls_below(np.array([]), np.array([]), 0.5)


def test_frames_far_apart_do_not_tell_when_something_changed(result: Path) -> None:
    with pytest.raises(PostError):
        change_of(Run(result), [0.5])


def test_the_groups_of_a_study_give_these_numbers(tmp_path: Path) -> None:
    run = growing(tmp_path)
    found = MEASURES["change"].take(run, State())
    assert found["change_half"] == pytest.approx(change_of(run, [0.5])[0])
    assert isinstance(MEASURES["start"].take(run, State())["lower_over_upper"], Missing)


# ---- a field read at fewer points ------------------------------------------------------------


def test_a_sampled_field_is_measured_like_that_of_a_run_with_these_points(tmp_path: Path) -> None:
    """Read from points 1 cm apart, a smooth band has its own values at those 4 cm apart."""
    runs = {}
    for dx in (0.01, 0.04):
        folder = tmp_path / f"{dx:g}"
        folder.mkdir()
        points, _ = synthetic.lattice(dx)
        alpha = band(points, True) + band(points, False, 0.05)
        runs[dx] = made(folder, [(0.01, alpha)], dx)
    coarse = measure_band(runs[0.04])
    fine = measure_band(runs[0.01])
    sampled = measure_sampled_band(runs[0.01].last_frame, 0.04)
    assert sampled.spacing == 0.04
    for name in ("width", "largest"):
        assert getattr(sampled, name) == pytest.approx(getattr(coarse, name), rel=0.01)
    assert sampled.interpolated.width == pytest.approx(coarse.interpolated.width, rel=0.01)
    wider = sampled.bands.prevailing.width_interpolated
    assert wider == pytest.approx(coarse.bands.prevailing.width_interpolated, rel=0.01)
    assert wider > 1.05 * fine.bands.prevailing.width_interpolated


def test_points_of_a_lattice_that_does_not_fit_stay_inside_the_body(tmp_path: Path) -> None:
    points, _ = synthetic.lattice(0.02)
    run = made(tmp_path, [(0.01, points[:, 0] + 10.0 * points[:, 1])])
    there, values = sampled_plastic_strain(run.last_frame, 0.3)
    assert there.points.max(axis=0) == pytest.approx([0.9, 1.8])
    assert there.points.min(axis=0) == pytest.approx([0.0, 0.0])
    assert values == pytest.approx(there.points[:, 0] + 10.0 * there.points[:, 1])
    with pytest.raises(PostError, match="must be above 0"):
        sampled_plastic_strain(run.last_frame, 0.0)


def test_a_state_that_is_sampled_changes_the_width_and_not_the_pattern(tmp_path: Path) -> None:
    points, _ = synthetic.lattice(0.02)
    run = made(tmp_path, [(0.01, band(points, True) + band(points, False, 0.05))])
    own, read = (MEASURES["band"].take(run, State(0.01, None, s)) for s in (None, 0.05))
    assert read["width_interpolated_uncertainty"] == 0.05
    assert read["width_interpolated_median"] > 1.05 * own["width_interpolated_median"]
    assert read["band_ratio"] == own["band_ratio"]
