"""Doubts and quality of a run as info tells them, and bands that no horizon can show."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from perigeo_post import measure_band
from perigeo_post.cli.command_line import main
from perigeo_post.cli.info import _trust_text
from perigeo_post.read.errors import ResultError
from perigeo_post.read.run import Run
from perigeo_post.read.trust import doubts_of, quality_of

HUGE = float(np.finfo(float).max)


def with_trust(path: Path) -> None:
    """Put doubts and a quality into a result, as the program does."""
    with h5py.File(path, "a") as file:
        group = file.create_group("doubts")
        group["name"] = np.array([b"zero_energy  ", b"few_points", b"horizon_ratio", b"no_rest"])
        group["meaning"] = np.array([b"noise", b"points of the body", b"m", b"an increment"])
        group["step"] = [2.0, 0.0, -1.0, 1.0]
        group["value"] = [5.0, 30.0, 0.0, 1e-3]
        group["lower"] = [-HUGE, 50.0, 2.0, -HUGE]
        group["upper"] = [2.0, HUGE, HUGE, HUGE]
        quality = file.create_group("quality")
        quality.attrs["energy_error"] = 1.25e-6
        quality.attrs["reaction_gap"] = float("nan")


def test_doubts_and_quality_are_read_and_shown(
    result: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert doubts_of(result) == []
    assert quality_of(result) == {}
    with_trust(result)
    assert [(one.name, one.step) for one in doubts_of(result)] == [
        ("few_points", 0),
        ("no_rest", 1),
        ("zero_energy", 2),
    ]
    assert quality_of(result) == {"energy_error": 1.25e-6}
    assert main(["info", str(result)]) == 0
    text = capsys.readouterr().out
    assert "warning      few_points at the start: 30 (below 50): points of the body" in text
    assert "warning      no_rest at step 1: an increment" in text
    assert "warning      zero_energy at step 2: 5 (above 2): noise" in text
    assert "horizon_ratio" not in text
    assert "3 of the frames come at or after step 1" in text
    assert "quality      energy_error 1.25e-06" in text
    assert main(["info", "--json", str(result)]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["doubts"][0]["bound"] == "below 50"
    assert facts["doubts"][1]["upper"] is None


def test_doubts_with_columns_of_different_lengths_are_damaged(result: Path) -> None:
    with_trust(result)
    with h5py.File(result, "a") as file:
        del file["doubts/value"]
        file["doubts/value"] = [5.0, 30.0]
    with pytest.raises(ResultError, match="is damaged: the doubts have columns of different"):
        doubts_of(result)


def test_nothing_is_said_where_nothing_is_known() -> None:
    assert _trust_text({"doubts": [], "quality": {}, "frames": []}) == []


def test_a_band_narrower_than_the_horizon_is_told(
    result: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    width = measure_band(Run(result)).width
    for part, told in ((1.1, True), (0.9, False)):
        with h5py.File(result, "a") as file:
            file.attrs["horizon"] = part * width
        assert measure_band(Run(result)).resolved is not told
        assert main(["band", str(result), "-o", str(result.with_suffix(".png"))]) == 0
        assert ("narrower than the horizon" in capsys.readouterr().out) == told
