"""The reference solutions of tests/reference agree with each other and with what is known."""

import sys
from math import pi
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "reference"))

import limit_loads
import slip_lines
import thick_cylinder
from slip_circles import critical_toe_circle

SOLVERS = {"smooth": slip_lines.smooth, "rough": slip_lines.rough}
both = pytest.mark.parametrize("kind", SOLVERS)


@both
def test_slip_lines_give_prandtls_load_where_the_strength_is_constant(kind):
    assert SOLVERS[kind](0.0, 10).load == pytest.approx(2.0 + pi, rel=1e-12)


@both
@pytest.mark.parametrize("ratio", [0.5, 1.3, 4.0])
def test_slip_lines_converge_with_the_square_of_their_spacing(kind, ratio):
    coarse, middle, fine = (SOLVERS[kind](ratio, n).load for n in (10, 20, 40))
    assert fine - middle == pytest.approx((middle - coarse) / 4.0, rel=0.1)
    assert abs(fine - middle) < 4e-4 * fine


@both
@pytest.mark.parametrize("ratio", [0.0, 1.0, 4.0])
def test_slip_lines_are_in_equilibrium(kind, ratio):
    # What base and last - line pass down crosses the last + line: the surface bears nothing.
    k = min(ratio, 1.0)
    net = SOLVERS[kind](ratio, 20).lines
    above = slip_lines.force_above([line[-1] for line in net], k)
    assert slip_lines.force_above(net[-1], k) == pytest.approx(above, rel=1e-3)


def test_a_wide_rough_footing_slides_at_its_edges_only():
    narrow, wide = slip_lines.rough(1.0, 20), slip_lines.rough(4.0, 20)
    assert -0.25 * pi < narrow.fan < 0.0
    assert narrow.sliding == 0.0
    assert wide.fan == pytest.approx(-0.25 * pi)
    assert 0.3 < wide.sliding < 0.7


FOOTINGS = [case for case in limit_loads.BOUNDS if case.startswith("footing")]


@pytest.mark.parametrize("case", FOOTINGS)
def test_finite_element_bounds_enclose_the_slip_lines(case):
    _, ratio, kind = case.split()
    low, high = limit_loads.bounds(case)
    assert low < limit_loads.footing(float(ratio.split("=")[1]), kind == "rough", 20) < high


def test_there_are_bounds_of_footings():
    assert len(FOOTINGS) >= 3


@both
def test_the_fit_of_api_lies_within_its_scatter(kind):
    for ratio in (1.0, 2.0, 4.0, 8.0):
        load = limit_loads.footing(ratio, kind == "rough", 20)
        assert limit_loads.footing_api(ratio, kind == "rough") == pytest.approx(load, rel=0.016)


def test_slip_lines_refuse_what_they_do_not_resolve():
    with pytest.raises(ValueError, match="it must be from 0 to 10"):
        slip_lines.smooth(50.0)


def test_bounds_close_in_on_finer_meshes():
    for case, rows in limit_loads.BOUNDS.items():
        lower, upper = ([row[name] for row in rows] for name in ("lower", "upper"))
        assert lower == sorted(lower), case
        assert upper == sorted(upper, reverse=True), case
        assert lower[-1] < upper[-1], case
        assert upper[-1] - lower[-1] < 0.05 * upper[-1], case


def test_bounds_enclose_what_is_known():
    low, high = limit_loads.slope(90)
    assert low < limit_loads.VERTICAL_CUT[0] < limit_loads.VERTICAL_CUT[1] < high
    low, high = limit_loads.bounds("footing kB/c0=0 rough")
    assert low < limit_loads.PRANDTL < high


@pytest.mark.parametrize("cover", [1, 2, 3])
def test_a_trapdoor_needs_less_than_its_block(cover):
    assert limit_loads.trapdoor(cover)[0] < limit_loads.trapdoor_block(cover)


@pytest.mark.parametrize(("degrees", "number"), [(90, 0.261), (75, 0.219), (60, 0.191)])
def test_toe_circles_have_taylors_stability_numbers(degrees, number):
    assert 1.0 / critical_toe_circle(degrees)[0] == pytest.approx(number, abs=6e-4)


@pytest.mark.parametrize("degrees", [60, 90])
def test_circles_are_no_better_than_the_mechanisms_of_finite_elements(degrees):
    assert critical_toe_circle(degrees)[0] > limit_loads.slope(degrees)[0]


def test_walls_follow_rankine():
    assert limit_loads.wall_force(4.0, 20.0, 40.0) == pytest.approx(-160.0)
    assert limit_loads.wall_force(4.0, 20.0, 40.0, passive=True) == pytest.approx(480.0)


C, A, B, YOUNG = 2.0, 1.0, 3.0, 500.0


def test_the_wall_of_a_cylinder_flows_from_the_inner_rim_to_the_outer():
    ends = [thick_cylinder.plastic_radius_pressure(r, C, A, B) for r in (A, B)]
    assert ends[0] == pytest.approx(thick_cylinder.yield_pressure(C, A, B, 0.5))
    assert ends[1] == pytest.approx(thick_cylinder.limit_pressure(C, A, B))
    half = thick_cylinder.plastic_radius_pressure(2.0, C, A, B)
    assert thick_cylinder.plastic_radius(half, C, A, B) == pytest.approx(2.0)


@pytest.mark.parametrize("p", [1.0, 2.5, 4.0])
def test_stresses_of_the_cylinder_are_in_equilibrium(p):
    r = np.linspace(A, B, 2001)
    radial, hoop = thick_cylinder.stresses(r, p, C, A, B)
    assert radial[0] == pytest.approx(-p)
    assert radial[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.gradient(r * radial, r)[1:-1] == pytest.approx(hoop[1:-1], abs=5e-3 * C)
    assert (hoop - radial).max() <= 2.0 * C * (1.0 + 1e-9)


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_the_rim_moves_on_without_a_jump_at_first_yield(nu):
    first = thick_cylinder.plastic_radius_pressure(A, C, A, B)
    before, after = (
        thick_cylinder.displacement(p, C, A, B, YOUNG, nu)
        for p in (first * (1.0 - 1e-9), first * (1.0 + 1e-9))
    )
    assert after == pytest.approx(before, rel=1e-7)


# Tresca is von Mises at nu = 0.5; elsewhere the axial stress takes part: 0.3 % at nu = 0.3.
@pytest.mark.parametrize(("nu", "tolerance"), [(0.49, 5e-4), (0.3, 4e-3)])
def test_radial_return_follows_the_closed_form_of_the_cylinder(nu, tolerance):
    pressures = np.array([0.5, 1.0, 2.0, 3.0, 4.0])
    moves = [thick_cylinder.displacement(p, C, A, B, YOUNG, nu) for p in pressures]
    found = thick_cylinder.von_mises_curve(moves, C, A, B, YOUNG, nu, 80, 160)
    assert found == pytest.approx(pressures, rel=tolerance)


def test_the_bounds_can_be_computed_anew():
    pytest.importorskip("clarabel")
    pytest.importorskip("scipy")
    import bounds

    _, low, high = bounds.footing(0, "rough", *bounds.MESHES[0])
    row = limit_loads.BOUNDS["footing kB/c0=0 rough"][0]
    assert (low, high) == pytest.approx((row["lower"], row["upper"]), abs=1e-3)
