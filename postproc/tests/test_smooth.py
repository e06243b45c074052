"""Displacements without zero-energy modes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic

from perigeo_post import Run, animate, compare_figure, contour_figure, smoothed
from perigeo_post.cli.command_line import main
from perigeo_post.measure.smooth import family_values, smoothed_for
from perigeo_post.read.errors import RequestError

SPACING = 0.04


def square(count: int = 21) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a square lattice; which stand away from the edges; number along x plus y."""
    k = np.arange(count)
    x, y = (part.ravel() for part in np.meshgrid(k, k))
    inner = (np.minimum(x, y) >= 6) & (np.maximum(x, y) <= count - 7)
    return SPACING * np.column_stack([x, y]).astype(float), inner, x + y


def affine(points: np.ndarray) -> np.ndarray:
    gradient = np.array([[0.3, -0.2], [0.15, -0.4]])
    return np.array([0.01, -2.0]) + points @ gradient.T


@pytest.mark.parametrize("m", [1.0, 2.0, 3.0, 4.0])
def test_affine_fields_stay_at_edges_too(m: float) -> None:
    points, _, _ = square(9)
    cloud, _ = synthetic.cloud(400)
    volumes = np.full(len(points), SPACING**2)
    volumes[:9] *= 0.5
    found = family_values(points, affine(points), volumes, m * SPACING)
    assert found == pytest.approx(affine(points), rel=1e-13)
    found = family_values(cloud, affine(cloud), np.full(len(cloud), 0.005), 0.07 * m)
    assert found == pytest.approx(affine(cloud), rel=1e-11)


@pytest.mark.parametrize(("m", "left"), [(2, 0.06), (3, 0.025), (4, 0.01), (5, 0.01), (6, 0.01)])
def test_what_alternates_is_taken_out(m: int, left: float) -> None:
    points, inner, number = square()
    volumes = np.full(len(points), SPACING**2)
    column = np.rint(points[:, 0] / SPACING)
    noise = np.column_stack([(-1.0) ** number, (-1.0) ** column])
    found = family_values(points, noise, volumes, m * SPACING)
    assert np.abs(found[inner]).max() < left
    middle = np.abs(points[:, 1] - 10 * SPACING) < 4.5 * SPACING  # of the edges left and right
    assert np.abs(found[middle, 0]).max() < 0.07
    # together with a field that is to be kept
    both = family_values(points, affine(points) + 0.1 * noise, volumes, m * SPACING)
    assert both == pytest.approx(affine(points) + 0.1 * found, abs=1e-12)


def test_a_point_of_its_own_and_points_on_a_line_keep_what_they_have() -> None:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [1.1, 1.1], [1.2, 1.2]])
    found = family_values(points, affine(points), np.ones(4), 0.3)
    assert found == pytest.approx(affine(points), rel=1e-12)


def alternate(path: Path) -> np.ndarray:
    """Put noise on the displacements of the body in the last frame; returns those without it."""
    with h5py.File(path, "r+") as file:
        data = file[f"frames/{sorted(file['frames'])[-1]}/displacement"]
        plain = data[...]
        x, y = np.rint(file["points/position"][...] / SPACING).T
        body = file["points/boundary"][...] == 0
        data[...] = plain + 0.02 * (body * (-1.0) ** (x + y))[:, None]
    return np.asarray(plain)


def test_a_frame_gives_smoothed_displacements_and_what_is_made_of_them(result: Path) -> None:
    plain = alternate(result)
    run = Run(result)
    frame = smoothed(run.last_frame)
    away = run.body & (np.abs(run.positions - [0.5, 1.0]) < [0.37, 0.87]).all(axis=1)
    found = frame["displacement"]
    assert np.abs(found - plain)[away].max() < 0.025 * 0.02
    assert (found[~run.body] == plain[~run.body]).all()
    assert (frame["displacement_y"] == found[:, 1]).all()
    assert frame["displacement_magnitude"] == pytest.approx(np.hypot(*found.T))
    assert "smoothed" in frame.field("displacement").description
    assert (frame["plastic_strain"] == run.last_frame["plastic_strain"]).all()
    assert (frame.label, frame.strain) == (run.last_frame.label, run.last_frame.strain)


def test_points_that_are_not_there_or_not_finite_take_no_part(result: Path) -> None:
    points = Run(result).positions
    gone = (points[:, 1] > 1.2) & (points[:, 1] < 1.5)
    broken = points[:, 1] > 1.7
    with h5py.File(result, "r+") as file:
        frame = file[f"frames/{sorted(file['frames'])[-1]}"]
        plain = frame["displacement"][...]
        frame["displacement"][...] = np.where(
            broken[:, None], np.nan, np.where(gone[:, None], 7.0, plain)
        )
        frame["active"] = np.where(gone, 0.0, 1.0)
        frame["active"].attrs["unit"] = np.bytes_("1")
        frame["active"].attrs["description"] = np.bytes_("1: there")
    found = smoothed(Run(result).last_frame)["displacement"]
    rest = ~gone & ~broken
    assert found[rest] == pytest.approx(plain[rest], abs=1e-15)
    assert (found[gone] == 7.0).all()
    assert np.isnan(found[broken]).all()


def test_pictures_say_that_they_are_smoothed(result: Path, tmp_path: Path) -> None:
    frame = Run(result).last_frame
    shape = contour_figure([smoothed(frame)], deformed=10.0)._suptitle.get_text()
    assert shape == "Deformed shape, displacements × 10, smoothed over families"
    field = contour_figure([smoothed(frame)], "displacement_y")._suptitle.get_text()
    assert field == "Displacements smoothed over families"
    assert contour_figure([frame], deformed=10.0)._suptitle.get_text() == shape.rpartition(",")[0]
    figure: Any = compare_figure([Run(result)], deformed=5.0, smooth=True)
    assert "smoothed" in figure._suptitle.get_text()
    assert animate([smoothed(frame)], tmp_path / "a.gif", deformed=5.0, dpi=50).exists()
    with pytest.raises(RequestError, match="no displacement to smooth in a picture of 'det_f'"):
        smoothed_for(frame, "det_f", None)


def test_the_option_smooth(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alternate(result)
    argv = ["contours", str(result), "--field", "displacement_x", "--frame", "3", "--json"]
    largest = []
    for options in ([], ["--smooth"]):
        assert main([*argv, *options]) == 0
        (found,) = json.loads(capsys.readouterr().out)
        assert found["smoothed"] is bool(options)
        largest.append(found["max"])
    assert largest[1] < largest[0] - 0.01
    figure = tmp_path / "a.gif"
    argv = ["animate", str(result), "--deformed", "--smooth", "-o", str(figure)]
    assert main(argv) == 0
    assert figure.exists()
    assert main(["contours", str(result), "--smooth"]) == 1
    assert "needs the deformed shape" in capsys.readouterr().err
