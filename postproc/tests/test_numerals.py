"""Numbers in words: units and places of all sizes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic

from perigeo_post import Run, measure_band
from perigeo_post.cli.command_line import main
from perigeo_post.draw.figures import band_words
from perigeo_post.read.numerals import fixed, place

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("value", "places", "text"),
    [
        (203.0612, 2, "203.06"),
        (0.25, 2, "0.25"),
        (4.0771e-6, 2, "4.0771e-06"),
        (4.0611230e9, 2, "4.0611e+09"),
        (6.98e-7, 4, "6.98e-07"),
        (0.0, 2, "0.00"),
        (float("nan"), 4, "not known"),
    ],
)
def test_a_number_keeps_two_digits_at_least(value: float, places: int, text: str) -> None:
    assert fixed(value, places) == text


def test_a_place_is_told_far_from_the_origin_too() -> None:
    assert place(0.41984, 0.61783, 0.7) == "(0.4198, 0.6178)"
    assert place(500000.002, 4649776.0053, 0.007) == "(500000.002, 4649776.0053)"
    assert place(500000.26, 4649776.71, 0.7) == "(500000.26, 4649776.71)"
    assert place(2.6e-9, 2.33e-7, 7e-7, 3) == "(2.6e-09, 2.33e-07)"


def test_a_band_far_from_the_origin_is_told_with_its_places(result: Path, capsys: Capture) -> None:
    far = (500000.0, 4649776.0)
    with h5py.File(result, "a") as file:
        file["points/position"][...] += far
        for name in ("lower", "upper"):
            file.attrs[name] = file.attrs[name] + far
    assert main(["band", str(result)]) == 0
    text = capsys.readouterr().out
    assert "e+0" not in text
    assert "nan" not in text
    words = band_words(measure_band(Run(result)))
    assert "e+0" not in words


def change_history(result: Path, change: Callable[[str], float]) -> None:
    """Multiply each column of the history of a result by a number."""
    table = result.with_name("made_history.csv")
    names = table.read_text().splitlines()[0].split(",")
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    columns = {name: change(name) * rows[:, k] for k, name in enumerate(names)}
    synthetic.write_columns(table, columns)


@pytest.mark.parametrize(("unit", "peak"), [(1e-8, "e-06 kPa"), (1e8, "e+10 kPa")])
def test_stresses_of_all_units_are_told(
    unit: float, peak: str, result: Path, capsys: Capture
) -> None:
    change_history(result, lambda name: unit if "force" in name else 1.0)
    assert main(["info", str(result)]) == 0
    text = capsys.readouterr().out
    assert f"{peak} at a strain" in text
    assert "0.00 MPa" not in text
    assert main(["compare", str(result)]) == 0
    assert " 0.00 " not in capsys.readouterr().out


def test_platens_that_slide_have_no_axial_stress(result: Path, capsys: Capture) -> None:
    change_history(result, lambda name: 0.0 if name == "strain" else 1.0)
    assert main(["info", str(result)]) == 0
    text = capsys.readouterr().out
    assert "axial stress not shown: the platens have not approached each other" in text
    assert "peak stress" not in text


def test_no_modulus_is_told_while_loads_grow(result: Path, capsys: Capture) -> None:
    """As in a test that begins with a pressure all round: strain of 2e-4 is at 0.04 s."""
    for ramp, told in (("0.03", True), ("0.05", False)):
        with h5py.File(result, "a") as file:
            values = [*file["input/values"][()], f"pressure(cell).ramp_time = {ramp}".encode()]
            del file["input/values"]
            file["input/values"] = np.array(values[:8] if told else [*values[:7], values[-1]])
        assert main(["info", str(result)]) == 0
        text = capsys.readouterr().out
        assert ("E_app        50.00 MPa" in text) == told
        assert ("loads grow until 0.05 s" in text) != told
