"""The comparison with finite elements: kept curves, what is compared, a coarse specimen."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tests" / "reference" / "finite_elements"


@pytest.fixture(scope="module")
def comparison():
    """Return the module of `make finite_elements`."""
    sys.path[:0] = [str(ROOT / "tests" / "verify"), str(REFERENCE)]
    import finite_elements

    yield finite_elements
    del sys.path[:2]


def test_every_kept_curve_belongs_to_the_deck_that_is_written_now(comparison):
    import ccx

    models = comparison.cases.all_cases()
    kept = {path.stem: path for path in (REFERENCE / "data").glob("*.csv")}
    assert set(kept) == set(models)
    for name, model in models.items():
        head = kept[name].read_text().splitlines()[0]
        assert head.endswith(f"deck {ccx.digest(ccx.deck(model()))}"), name


def test_a_mesh_of_eight_nodes_has_none_in_the_middle(comparison):
    grid = comparison.cases.Grid(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0]), 2)
    assert len(grid.nodes) == 13
    first = [grid.nodes[node] for node in grid.elements[0]]
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)]
    assert first == [*corners, (0.5, 0.0), (1.0, 1.0), (0.5, 2.0), (0.0, 1.0)]
    assert grid.centres == [(0.5, 1.0), (2.0, 1.0)]
    assert [grid.nodes[node] for node in grid.on("top", (0.0, 1.0))] == [
        (0.0, 2.0),
        (0.5, 2.0),
        (1.0, 2.0),
    ]


def test_a_curve_that_is_five_per_cent_off_is_not_passed(comparison):
    way = np.linspace(0.0, 1.0, 11)
    exact = comparison.Curve("exact", way, np.minimum(way, 0.5))
    assert exact.work == pytest.approx(0.375)
    assert exact.slope == pytest.approx(1.0)
    same = comparison.compare(exact, exact)
    assert same.passed
    assert same.worst == same.peak == same.work == 0.0
    off = comparison.compare(comparison.Curve("off", way, 1.05 * exact.load), exact)
    assert not off.passed
    assert [off.slope, off.peak, off.worst, off.work] == pytest.approx([0.05] * 4)


def test_loads_are_compared_along_the_way_there_and_back(comparison):
    there_and_back = np.array([0.0, 1.0, 0.0])
    loop = comparison.Curve("loop", there_and_back, np.array([0.0, 1.0, -1.0]))
    other = comparison.Curve("other", there_and_back, np.array([0.0, 1.0, -0.9]))
    assert loop.path.tolist() == [0.0, 1.0, 2.0]
    assert comparison.compare(other, loop).worst == pytest.approx(0.1)


def test_a_coarse_specimen_carries_what_finite_elements_carry(
    comparison, program, tmp_path, monkeypatch
):
    monkeypatch.setattr(comparison, "PROGRAM", program)
    monkeypatch.setattr(comparison, "RESULTS", tmp_path)
    name, case = "compression", comparison.COMPARED["compression"]
    computed = comparison.run(name, case.groups((0.1, 0.2)), "coarse")
    exact = comparison.finite_elements("compression_cpe8r_100", "8 nodes")
    found = comparison.compare(computed, exact)
    assert found.peak == pytest.approx(0.0, abs=3e-3)  # the plateau
    assert -0.09 < found.slope < -0.05  # the ends are soft: 0.93 delta + 0.4 dx of 2 m
