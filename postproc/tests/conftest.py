"""Made-up results that the tests share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic


def x_bands(points: np.ndarray, strong: float = 0.2, weak: float = 0.1) -> np.ndarray:
    """A rising band with its peak at `strong` and a falling one at `weak`, crossing at (.5, .6)."""
    return synthetic.gaussian_band(
        points, (0.5, 0.6), 45.0, True, 0.05, strong
    ) + synthetic.gaussian_band(points, (0.5, 0.6), 45.0, False, 0.05, weak)


@pytest.fixture
def result(tmp_path: Path) -> Path:
    """Complete run with platens: frames at 0, 0.5, 1, 1.6 % and a history."""
    points, boundary = synthetic.lattice()
    alpha = x_bands(points)
    states = [
        (strain, synthetic.fields_of(points, part * alpha, strain))
        for strain, part in ((0.0, 0.0), (0.005, 0.3), (0.01, 0.7), (0.016, 1.0))
    ]
    path = synthetic.write_result(tmp_path / "made.h5", points, boundary, states)
    synthetic.write_history(tmp_path / "made_history.csv")
    return path


@pytest.fixture
def cut_off(tmp_path: Path) -> Path:
    """A run that was cut off: two of five frames written, a broken last row in the history."""
    points, boundary = synthetic.lattice()
    states = [
        (0.0, synthetic.fields_of(points, 0.0 * points[:, 0], 0.0)),
        (0.008, synthetic.fields_of(points, x_bands(points), 0.008)),
    ]
    path = synthetic.write_result(
        tmp_path / "cut.h5", points, boundary, states, planned=5, complete=0
    )
    history = synthetic.write_history(tmp_path / "cut_history.csv", rows=50)
    history.write_text(history.read_text()[:-90])
    return path


@pytest.fixture
def failed(tmp_path: Path) -> Path:
    """A run that failed: the failing state, full of NaN, stands in /failed_frame."""
    points, boundary = synthetic.lattice()
    bad = synthetic.fields_of(points, x_bands(points), 0.009)
    for values in bad.values():
        values[::7] = np.nan
    states = [
        (0.0, synthetic.fields_of(points, 0.0 * points[:, 0], 0.0)),
        (0.008, synthetic.fields_of(points, x_bands(points), 0.008)),
    ]
    path = synthetic.write_result(
        tmp_path / "failed.h5", points, boundary, states, planned=4, failed=bad, complete=0
    )
    synthetic.write_history(tmp_path / "failed_history.csv")
    return path


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    """A point cloud without platens, one rising band."""
    points, boundary = synthetic.cloud()
    alpha = synthetic.gaussian_band(points, (0.5, 0.9), 45.0, True, 0.06, 0.2)
    states = [
        (0.0, synthetic.fields_of(points, 0.0 * alpha, 0.0)),
        (0.01, synthetic.fields_of(points, alpha, 0.01)),
    ]
    return synthetic.write_result(
        tmp_path / "cloud.h5", points, boundary, states, spacing=float("nan"), horizon=0.12,
        volume=2.0 / len(points), platens=False,
    )  # fmt: skip
