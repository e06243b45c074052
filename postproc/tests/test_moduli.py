"""The three apparent moduli against made-up specimens whose strains are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic

from perigeo_post import FieldNotFoundError, RequestError, Run
from perigeo_post.measure.moduli import gauge_line, gauge_modulus, gauge_strain, mean_modulus

E, NU = 50e6, 0.3
SLOPE = E / (1.0 - NU**2)
INSIDE = 0.96  # strain inside over nominal strain
STRAINS = (0.0, 0.0002, 0.0004, 0.0006, 0.0008, 0.001)


def specimen(
    folder: Path,
    noise: float = 0.0,
    axis: str = "y",
    strains: tuple[float, ...] = STRAINS,
    lateral: float = 0.0,
    dx: float = 0.02,
) -> Run:
    """Softer ends, 0.96 of the nominal strain inside; `noise` moves every other row by this
    many spacings times the strain. `lateral`: mean lateral over mean axial stress."""
    place, boundary = synthetic.lattice(dx, layers=4)
    row = np.rint(place[:, 1] / dx).astype(int)
    states = []
    for strain in strains:
        moved = -strain * (1.0 + INSIDE * (place[:, 1] - 1.0))
        moved = moved + noise * dx * strain * np.where(row % 2 == 0, 1.0, -1.0)
        fields = synthetic.fields_of(place, 0.0 * moved, strain)
        fields["displacement"] = np.c_[0.0 * moved, moved]
        if axis == "x":
            fields["displacement"] = fields["displacement"][:, ::-1]
        states.append((strain, fields))
    points, corner = (place, (1.0, 2.0)) if axis == "y" else (place[:, ::-1], (2.0, 1.0))
    path = synthetic.write_result(
        folder / f"gauge_{axis}.h5", points, boundary, states, dx, 4 * dx, axis=axis,
        extents=((0.0, 0.0), corner),
    )  # fmt: skip
    e = np.linspace(0.0, 0.0012, 241)
    columns = {
        "time": 200.0 * e, "strain": e, f"bottom_force_{axis}": SLOPE * e,
        f"top_force_{axis}": -SLOPE * e, "mean_stress_yy": -SLOPE * e,
        "mean_stress_xx": -lateral * SLOPE * e, "mean_strain_yy": -e,
    }  # fmt: skip
    synthetic.write_columns(folder / f"gauge_{axis}_history.csv", columns)
    return Run(path)


@pytest.mark.parametrize("axis", ["y", "x"])
@pytest.mark.parametrize("thick", [True, False])
def test_the_gauge_sees_the_strain_inside(tmp_path: Path, axis: str, thick: bool) -> None:
    run = specimen(tmp_path, axis=axis)
    assert gauge_strain(run.last_frame, thick=thick) == pytest.approx(INSIDE * 0.001, rel=1e-9)
    found = gauge_modulus(run, thick=thick)
    assert found.value == pytest.approx(E / INSIDE, rel=1e-6)
    assert found.rows == 5


def test_a_line_between_rows_is_interpolated(tmp_path: Path) -> None:
    frame = specimen(tmp_path).last_frame
    line = gauge_line(frame, 0.503, thick=False)  # between the rows at 1.00 and 1.02
    assert line.place == pytest.approx(1.006)
    assert line.displacement == pytest.approx(-0.001 * (1.0 + INSIDE * 0.006))


def test_a_thick_line_does_not_see_what_single_rows_do(tmp_path: Path) -> None:
    """Rows that move to and fro by 2 spacings times the strain, as zero-energy modes do."""
    frame = specimen(tmp_path, noise=2.0).last_frame
    lines = (0.25, 0.76)  # on rows 25 and 76, which move in opposite directions
    rows = gauge_strain(frame, lines, thick=False) / 0.001
    assert abs(rows - INSIDE) > 0.05
    assert gauge_strain(frame, lines) / 0.001 == pytest.approx(INSIDE, rel=1e-3)


def test_the_gauge_needs_two_frames_in_the_range(tmp_path: Path) -> None:
    run = specimen(tmp_path, strains=(0.0, 0.0005, 0.004))
    with pytest.raises(RequestError, match="1 frames lie between"):
        gauge_modulus(run)
    with pytest.raises(RequestError, match="must lie in the body"):
        gauge_line(run.last_frame, 1.5)
    with pytest.raises(RequestError, match="one line"):
        gauge_strain(run.last_frame, (0.5, 0.5))


def test_frames_a_little_behind_their_strain_count(tmp_path: Path) -> None:
    run = specimen(tmp_path, strains=(0.0, 0.0002001, 0.0010009))
    assert gauge_modulus(run).rows == 2


def test_mean_stress_over_mean_strain(tmp_path: Path) -> None:
    run = specimen(tmp_path)
    assert mean_modulus(run).value == pytest.approx(E, rel=1e-9)
    assert mean_modulus(run, corrected=True).value == pytest.approx(E, rel=1e-9)


def test_the_corrected_mean_takes_off_the_lateral_stress(tmp_path: Path) -> None:
    run = specimen(tmp_path, lateral=0.1)
    assert mean_modulus(run).value == pytest.approx(E, rel=1e-9)
    expected = E * (1.0 - NU / (1.0 - NU) * 0.1)
    assert mean_modulus(run, corrected=True).value == pytest.approx(expected, rel=1e-9)


def test_there_is_no_mean_strain_along_x(tmp_path: Path) -> None:
    with pytest.raises(FieldNotFoundError, match="mean_strain_xx"):
        mean_modulus(specimen(tmp_path, axis="x"))


def test_without_platens_there_is_no_gauge(cloud: Path) -> None:
    with pytest.raises(RequestError, match="no platens"):
        gauge_line(Run(cloud).last_frame, 0.5)
    with pytest.raises(RequestError, match="no platens"):
        mean_modulus(Run(cloud))
