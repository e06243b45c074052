"""Band measures against made-up bands of known width, angle and place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic

from perigeo_post import (
    NoBandError,
    PointSet,
    RequestError,
    Run,
    find_bands,
    interpolate,
    line_across,
    measure_band,
    profile_along,
    profile_width,
)

DX = 0.02
SIGMA = 0.04
FULL_WIDTH = 2.0 * SIGMA * np.sqrt(2.0 * np.log(10.0))  # of a Gaussian at 10 %


def body() -> np.ndarray:
    points, boundary = synthetic.lattice(DX, layers=0)
    assert (boundary == 0).all()
    return points


def measured(points: PointSet, alpha: np.ndarray, axis: str = "y"):  # type: ignore[no-untyped-def]
    bands = find_bands(points, alpha, axis, 4 * DX)
    line = line_across(bands.prevailing, points, axis, normal=True)
    return bands, profile_width(profile_along(points, alpha, line), DX)


def distance_to(place: tuple[float, float], line: object) -> float:
    (x0, y0), (x1, y1) = line  # type: ignore[misc]
    length = np.hypot(x1 - x0, y1 - y0)
    return abs((x1 - x0) * (place[1] - y0) - (y1 - y0) * (place[0] - x0)) / length


def test_bilinear_interpolation_is_exact_for_linear_fields() -> None:
    points = PointSet(body(), None, DX)
    values = 2.0 + 3.0 * points.points[:, 0] - 1.5 * points.points[:, 1]
    x, y = np.random.default_rng(1).uniform((0, 0), (1, 2), (200, 2)).T
    assert interpolate(points, values, x, y) == pytest.approx(2.0 + 3.0 * x - 1.5 * y)
    assert np.isnan(interpolate(points, values, [1.02, 0.5], [1.0, -0.02])).all()


def test_interpolation_on_a_cloud_is_exact_for_linear_fields() -> None:
    place, _ = synthetic.cloud()
    points = PointSet(place, np.full(len(place), 2.0 / len(place)))
    assert points.lattice is None
    x, y = np.random.default_rng(1).uniform((0.1, 0.1), (0.9, 1.9), (200, 2)).T
    values = 1.0 - place[:, 0] + 4.0 * place[:, 1]
    assert interpolate(points, values, x, y) == pytest.approx(1.0 - x + 4.0 * y)


def test_holes_of_a_lattice_hold_no_values() -> None:
    place = body()
    place = place[np.hypot(place[:, 0] - 0.5, place[:, 1] - 1.0) > 0.2]
    points = PointSet(place, None, DX)
    assert points.lattice is not None
    found = interpolate(points, np.ones(len(place)), [0.5, 0.1], [1.0, 1.0])
    assert np.isnan(found[0])
    assert found[1] == 1.0


def test_the_width_of_a_triangle_is_exact() -> None:
    points = PointSet(body(), None, DX)
    alpha = np.maximum(0.0, 1.0 - np.abs(points.points[:, 1] - 1.0) / 0.2)
    width = profile_width(profile_along(points, alpha, ((0.5, 0.0), (0.5, 2.0))), DX)
    assert width.width == pytest.approx(2 * 0.9 * 0.2, abs=1e-12)
    assert (width.left, width.right) == pytest.approx((0.82, 1.18))
    assert width.peak == 1.0
    assert width.peak_position == pytest.approx((0.5, 1.0))
    assert width.closed
    assert width.uncertainty == DX


def test_a_profile_that_ends_inside_the_band_gives_a_lower_bound() -> None:
    points = PointSet(body(), None, DX)
    alpha = np.maximum(0.0, 1.0 - np.abs(points.points[:, 1] - 1.0) / 0.2)
    width = profile_width(profile_along(points, alpha, ((0.5, 1.0), (0.5, 2.0))), DX)
    assert not width.closed
    assert width.width == pytest.approx(0.18)


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize("angle", [35.0, 45.0, 52.5])
@pytest.mark.parametrize("through", [(0.5, 0.7), (0.4, 1.23)])
def test_one_band_is_found_where_it_lies(
    rising: bool, angle: float, through: tuple[float, float]
) -> None:
    points = PointSet(body(), None, DX)
    alpha = synthetic.gaussian_band(points.points, through, angle, rising, SIGMA, 0.3)
    bands, width = measured(points, alpha)
    band = bands.prevailing
    assert band.direction == ("rising" if rising else "falling")
    assert band.angle == pytest.approx(angle, abs=0.3)
    assert distance_to(through, band.line) < 0.2 * DX
    assert distance_to(width.peak_position, band.line) < DX
    # bilinear interpolation cuts the crest by up to (dx / sigma)^2 / 8 in each direction
    assert band.strength == pytest.approx(0.3, rel=0.25 * (DX / SIGMA) ** 2)
    assert width.peak == pytest.approx(0.3, rel=0.25 * (DX / SIGMA) ** 2)
    assert width.width == pytest.approx(FULL_WIDTH, abs=0.5 * DX)
    assert band.width_interpolated == pytest.approx(FULL_WIDTH, abs=0.5 * DX)
    assert bands.ratio < 0.02


@pytest.mark.parametrize(("strong", "weak"), [(0.2, 0.1), (0.2, 0.06), (0.1, 0.2), (0.2, 0.19)])
def test_both_bands_of_an_x_are_measured_away_from_their_crossing(
    strong: float, weak: float
) -> None:
    points = PointSet(body(), None, DX)
    where = (0.5, 0.6)
    alpha = synthetic.gaussian_band(points.points, where, 46.0, True, SIGMA, strong)
    alpha += synthetic.gaussian_band(points.points, where, 44.0, False, SIGMA, weak)
    bands, width = measured(points, alpha)
    assert bands.other is not None
    assert bands.prevailing.direction == ("rising" if strong > weak else "falling")
    assert bands.ratio == pytest.approx(min(strong, weak) / max(strong, weak), rel=0.05)
    assert bands.crossing == pytest.approx(where, abs=0.5 * DX)
    angles = {b.direction: b.angle for b in (bands.prevailing, bands.other)}
    assert angles["rising"] == pytest.approx(46.0, abs=0.6)
    assert angles["falling"] == pytest.approx(44.0, abs=0.6)
    assert width.width == pytest.approx(FULL_WIDTH, abs=DX)
    assert width.peak == pytest.approx(max(strong, weak), rel=0.05)


def test_the_profile_avoids_the_crossing_with_a_third_band() -> None:
    """Four bands round a diamond, as between two platens that are alike."""
    points = PointSet(body(), None, DX)
    alpha = sum(
        synthetic.gaussian_band(points.points, (0.5, y), 45.0, rising, SIGMA, peak)
        for y, rising, peak in (
            (0.7, True, 0.10), (1.3, True, 0.12), (0.7, False, 0.11), (1.3, False, 0.10),
        )
    )  # fmt: skip
    bands, width = measured(points, alpha)
    assert width.closed
    assert width.width == pytest.approx(FULL_WIDTH, abs=1.5 * DX)
    assert bands.prevailing.width_interpolated == pytest.approx(FULL_WIDTH, abs=1.5 * DX)


def test_the_peak_is_looked_for_near_a_place() -> None:
    points = PointSet(body(), None, DX)
    alpha = synthetic.gaussian_band(points.points, (0.5, 0.5), 45.0, True, SIGMA, 0.1)
    alpha += synthetic.gaussian_band(points.points, (0.5, 1.3), 45.0, True, SIGMA, 0.2)
    profile = profile_along(points, alpha, ((0.5, 0.0), (0.5, 2.0)))
    assert profile_width(profile, DX).peak_distance == pytest.approx(1.3, abs=DX)
    near = profile_width(profile, DX, near=((0.5, 0.5), 0.2))
    assert near.peak_distance == pytest.approx(0.5, abs=DX)
    assert near.width == pytest.approx(np.sqrt(2.0) * FULL_WIDTH, abs=DX)
    with pytest.raises(NoBandError):
        profile_width(profile, DX, near=((5.0, 0.5), 0.2))


def test_noise_moves_the_measures_little() -> None:
    points = PointSet(body(), None, DX)
    random = np.random.default_rng(7)
    alpha = synthetic.gaussian_band(points.points, (0.5, 0.6), 45.0, True, SIGMA, 0.2)
    alpha += synthetic.gaussian_band(points.points, (0.5, 0.6), 45.0, False, SIGMA, 0.06)
    alpha *= 1.0 + 0.1 * random.standard_normal(len(alpha))
    alpha += 0.001 * random.random(len(alpha))
    bands, width = measured(points, alpha)
    assert bands.prevailing.angle == pytest.approx(45.0, abs=1.0)
    assert bands.ratio == pytest.approx(0.3, abs=0.05)
    assert width.width == pytest.approx(FULL_WIDTH, abs=1.5 * DX)


def test_loading_along_x_turns_everything() -> None:
    place = body()[:, ::-1]
    points = PointSet(place, None, DX)
    alpha = synthetic.gaussian_band(place[:, ::-1], (0.5, 0.7), 40.0, True, SIGMA, 0.3)
    bands, width = measured(points, alpha, "x")
    assert bands.prevailing.direction == "rising"
    assert bands.prevailing.angle == pytest.approx(40.0, abs=0.3)
    assert distance_to((0.7, 0.5), bands.prevailing.line) < 0.2 * DX
    assert width.width == pytest.approx(FULL_WIDTH, abs=0.5 * DX)


def test_no_plastic_strain_is_no_band() -> None:
    points = PointSet(body(), None, DX)
    with pytest.raises(NoBandError, match="no plastic strain"):
        find_bands(points, np.zeros(len(points.points)))
    with pytest.raises(NoBandError, match="spread over the body"):
        find_bands(points, np.full(len(points.points), 0.01))
    with pytest.raises(NoBandError, match="not finite"):
        find_bands(points, np.full(len(points.points), np.nan))


def test_a_frame_is_measured_with_one_call(result: Path) -> None:
    run = Run(result)
    numbers = measure_band(run).as_dict()
    assert numbers["strain"] == 0.016
    assert numbers["angle"] == pytest.approx(45.0, abs=0.5)
    assert numbers["ratio"] == pytest.approx(0.5, abs=0.03)
    true = 2 * 0.05 * np.sqrt(2 * np.log(10))
    assert numbers["width_interpolated"] == pytest.approx(true, abs=0.03)
    assert numbers["peak"] == pytest.approx(0.2, rel=0.05)
    assert numbers["direction"] == "rising"
    (x0, y0), (x1, y1) = numbers["line"]
    assert abs((x1 - x0) / (y1 - y0)) == pytest.approx(1.0, abs=0.01)
    assert measure_band(run, strain=0.005).interpolated.peak == pytest.approx(0.06, rel=0.05)
    with pytest.raises(NoBandError):
        measure_band(run, number=0)


def test_a_given_line_is_used(result: Path) -> None:
    found = measure_band(Run(result), line=((1.0, 0.5), (0.0, 1.5)))
    assert found.profile.line == ((1.0, 0.5), (0.0, 1.5))
    assert found.interpolated.peak_position == pytest.approx((0.7, 0.8), abs=0.02)
    with pytest.raises(RequestError, match="does not meet the body"):
        measure_band(Run(result), line=((3.0, 0.5), (4.0, 1.5)))
    with pytest.raises(RequestError, match="same point"):
        measure_band(Run(result), line=((0.5, 0.5), (0.5, 0.5)))
    with pytest.raises(RequestError, match="level"):
        measure_band(Run(result), level=2.0)


def test_the_band_of_a_cloud_is_measured(cloud: Path) -> None:
    found = measure_band(Run(cloud))
    assert found.bands.prevailing.angle == pytest.approx(45.0, abs=1.5)
    assert distance_to((0.5, 0.9), found.bands.prevailing.line) < 0.02
    expected = 2 * 0.06 * np.sqrt(2 * np.log(10))
    assert found.interpolated.width == pytest.approx(expected, abs=found.interpolated.uncertainty)
    # the points are no lattice; their cells are taken for squares of the mean size
    assert found.width == pytest.approx(expected, rel=0.1)
