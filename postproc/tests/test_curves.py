"""Curves and numbers from the history."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import synthetic

from perigeo_post import (
    Curve,
    RequestError,
    Run,
    apparent_modulus,
    axial_stress,
    compare_runs,
    curve_figure,
    energy_curves,
    history_curve,
    peak,
    settlement_curves,
    stress_strain,
    write_curves,
)


def test_axial_stress_is_the_reaction_over_the_width(result: Path) -> None:
    run = Run(result)
    history = run.history()
    assert axial_stress(run) == pytest.approx(history["bottom_force_y"] / 1.0)
    assert axial_stress(run, "second") == pytest.approx(-history["top_force_y"] / 1.0)
    assert axial_stress(run).max() > 0.0


def test_the_apparent_modulus_is_that_of_the_curve(result: Path) -> None:
    found = apparent_modulus(Run(result))
    assert found.value == pytest.approx(50e6, rel=1e-9)
    assert found.slope == pytest.approx(50e6 / 0.91, rel=1e-9)
    assert found.rows == 20
    with pytest.raises(RequestError, match="rows of the history lie between"):
        apparent_modulus(Run(result), (1e-7, 2e-7))


def test_the_peak_is_found_and_the_sign_can_be_turned(result: Path) -> None:
    run = Run(result)
    stress, strain = peak(stress_strain(run))
    assert stress == pytest.approx(50e6 / 0.91 * 0.0034, rel=0.01)
    assert strain == pytest.approx(0.0034, abs=5e-5)
    turned = stress_strain(run, tension_positive=True)
    assert peak(turned) == pytest.approx((-stress, -strain))
    assert turned.at(-0.002) == pytest.approx(-50e6 / 0.91 * 0.002)


def test_a_value_is_read_where_the_curve_first_reaches_it() -> None:
    curve = Curve("", np.array([0.0, 2.0, 0.0]), np.array([0.0, 4.0, 9.0]), "a", "1", "b", "1")
    assert curve.at(1.0) == 2.0
    assert curve.at(2.0) == 4.0
    assert np.isnan(curve.at(3.0))


def test_any_column_goes_against_any_other(result: Path) -> None:
    curve = history_curve(Run(result), "max_plastic_strain", "time")
    assert (curve.x_unit, curve.y_unit) == ("s", "1")
    assert history_curve(Run(result), "external_work").x_name == "strain"
    assert len(energy_curves(Run(result))) == 6


def test_a_settlement_goes_down_with_the_load(result: Path) -> None:
    path = result.with_name("made_history.csv")
    rows = [line.split(",") for line in path.read_text().splitlines()]
    rows[0].append("top_displacement_y")
    for k, row in enumerate(rows[1:]):
        row.append(f"{-1e-3 * k:.6g}")
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")
    run = Run(result)
    (curve,) = settlement_curves([run], "top")
    assert (curve.x_name, curve.y_name) == ("top_load", "top_settlement")
    assert curve.x == pytest.approx(-run.history()["top_force_y"])
    assert curve.y == pytest.approx(1e-3 * np.arange(len(curve.y)))
    (axes,) = curve_figure([curve]).axes
    low, high = axes.get_ylim()
    assert low > high  # downwards
    assert axes.xaxis.get_label_position() == "top"
    with pytest.raises(RequestError, match="no boundary 'tip': bottom, top"):
        settlement_curves([run], "tip")


def test_without_platens_there_is_no_axial_stress(cloud: Path) -> None:
    with pytest.raises(RequestError, match="no platens"):
        axial_stress(Run(cloud))


def test_runs_are_compared_in_a_table(result: Path, cloud: Path) -> None:
    rows = compare_runs([Run(result), Run(cloud)], ["a", "b"], [0.01])
    assert rows[0]["apparent_modulus"] == pytest.approx(50e6)
    assert rows[0]["alpha_at_0.01"] == pytest.approx(0.7 * 0.3, rel=0.05)
    assert rows[0]["stress_at_0.01"] > 0.0
    assert rows[1]["peak_stress"] is None
    assert rows[1]["alpha_at_0.01"] is None


def test_curves_are_written_with_units(result: Path, tmp_path: Path) -> None:
    path = write_curves(tmp_path / "c.csv", [stress_strain(Run(result))])
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["run", "strain [1]", "axial_stress [Pa]"]
    assert len(rows) == 401
    assert float(rows[-1][1]) == pytest.approx(0.016)


def test_energies_are_known_by_their_units(result: Path) -> None:
    first = [curve.y_name for curve in energy_curves(Run(result))]
    assert first == [
        "kinetic_energy", "strain_energy", "plastic_dissipation", "damping_dissipation",
        "stabilisation_energy", "external_work",
    ]  # fmt: skip
    synthetic.to_second_schema(result, extra={"surface": ("J/m", "energy of cracks", None)})
    curves = energy_curves(Run(result))
    assert [(c.y_name, c.y_unit) for c in curves] == [("surface", "J/m")]


def test_curves_of_the_second_schema_are_the_same(result: Path) -> None:
    before = stress_strain(Run(result))
    synthetic.to_second_schema(result, written=100)
    after = stress_strain(Run(result))
    assert np.array_equal(before.x, after.x)
    assert np.array_equal(before.y, after.y)
    assert (after.x_unit, after.y_unit) == ("1", "Pa")
    curve = history_curve(Run(result), "top_force_y", "time")
    assert (curve.x_unit, curve.y_unit) == ("s", "N/m")
