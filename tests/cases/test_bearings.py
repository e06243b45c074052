"""Smooth bearings, the mirror images of a body: closed forms, symmetry, energy, restart, limits."""

import h5py
import numpy as np
import pytest
from case_files import begin, history, stop
from test_restart import assert_same

E, NU, C = 50.0e6, 0.3, 10.0e3
LAMBDA, G = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 * (1.0 + NU))
HEAD = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&material model = 'j2', strain_measure = 'small', density = 2000.0, youngs_modulus = {E}
  poissons_ratio = {NU}, yield_stress = {np.sqrt(3.0) * C} /
"""
REST = "&integration method = 'equilibrium', end_time = 1.0, increments = 4, residual = 1.0e-11 /\n"
MOTION = "&integration end_time = 0.4, damping = 2.0e4 /\n"
BOX = (
    HEAD
    + """\
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 0.8 /
&boundary name = 'bottom', side = 'bottom', span = 0.0, 1.0, contact = 'smooth' /
&boundary name = 'left', side = 'left', span = 0.0, 0.8, contact = 'smooth' /
&boundary name = 'right', side = 'right', span = 0.0, 0.8, contact = 'smooth' /
&boundary name = 'top', side = 'top', span = 0.0, 1.0, contact = 'smooth'
  velocity = 0.0, -8.0e-5 /
&output history_count = 4, frame_count = 1 /
"""
)
PUNCH = (
    HEAD
    + """\
&body x_min = {left}, x_max = 1.0, y_min = -0.8, y_max = 0.0 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'right', side = 'right', contact = 'smooth' /
{axis}
&boundary name = 'footing', side = 'top', span = {from_x}, 0.4, velocity = 0.0, -2.0e-3 /
&output history_count = 4, frame_count = 1 /
"""
)
WHOLE = PUNCH.format(
    left=-1.0, from_x=-0.4, axis="&boundary name = 'left', side = 'left', contact = 'smooth' /"
)
HALF = PUNCH.format(
    left=0.0,
    from_x=0.0,
    axis="&boundary name = 'axis', side = 'left', span = -0.8, 0.0, contact = 'smooth' /",
)


@pytest.fixture
def fields(run_case, tmp_path):
    """Return a function that runs a case and returns its body at the end, and its history."""

    def run(text):
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
        assert done.returncode == 0, done.stderr
        rows = history(tmp_path / "out" / "case_history.csv")
        with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
            frame = file["frames"][list(file["frames"])[-1]]
            body = file["points/boundary"][()] == 0
            found = {name: data[()][body] for name, data in frame.items()}
            found["position"] = file["points/position"][()][body]
        return found, rows

    return run


@pytest.mark.parametrize("operators", ["lattice", "list"])
@pytest.mark.parametrize("control", ["none", "relaxing"])
def test_a_box_of_bearings_keeps_a_homogeneous_strain_into_its_corners(fields, operators, control):
    text = BOX.replace("'case',", f"'case', operators = '{operators}',")
    found, rows = fields(text + REST + f"&stabilisation method = '{control}' /\n")
    strain = -8.0e-5 / 0.8
    right = [LAMBDA * strain, (LAMBDA + 2.0 * G) * strain, LAMBDA * strain, 0.0]
    assert np.abs(found["stress"] - right).max() < 1e-8 * abs(right[1])
    assert rows["top_force_y"][-1] == pytest.approx(right[1] * 1.0, rel=1e-8)
    assert rows["left_force_x"][-1] == pytest.approx(-right[0] * 0.8, rel=1e-8)
    assert rows["top_displacement_y"][-1] == pytest.approx(-8.0e-5)
    # half of force times way is in the body; the images have none of it
    assert rows["strain_energy"][-1] == pytest.approx(0.5 * right[1] * -8.0e-5, rel=1e-8)
    assert np.abs(rows["energy_error"]).max() < 1e-8


@pytest.mark.parametrize("operators", ["lattice", "list"])
def test_a_pressure_between_bearings_is_the_stress_into_the_corners(fields, operators):
    """Points beside a plane carry the pressure as those before a body that goes on."""
    text = BOX.replace("'case',", f"'case', operators = '{operators}',").replace("0.8", "1.0")
    text = text[: text.index("&boundary name = 'top'")] + text[text.index("&output") :]
    pressed = "&pressure name = 'load', side = 'top', value = 1.0e4 /\n"
    found, rows = fields(text + pressed + REST)
    assert np.abs(found["stress"][:, 1] + 1.0e4).max() < 1e-3
    assert np.abs(found["stress"][:, 0] + 1.0e4 * NU / (1.0 - NU)).max() < 1e-3
    assert rows["bottom_force_y"][-1] == pytest.approx(1.0e4, rel=1e-8)


def test_half_of_a_symmetric_body_is_as_good_as_all_of_it(fields):
    """Footing and base have images beyond the plane too; the body yields."""
    one, whole = fields(WHOLE + REST.replace("1.0e-11", "1.0e-8"))
    other, half = fields(HALF + REST.replace("1.0e-11", "1.0e-8"))
    assert one["plastic_strain"].max() > 1e-3
    assert half["footing_force_y"] == pytest.approx(0.5 * whole["footing_force_y"], rel=1e-5)
    right = one["position"][:, 0] > 0.0
    order = np.lexsort(np.floor(one["position"][right] / 0.1).T)
    mine = np.lexsort(np.floor(other["position"] / 0.1).T)
    for name in ("displacement", "stress"):
        scale = np.abs(one[name]).max()
        assert np.abs(one[name][right][order] - other[name][mine]).max() < 1e-4 * scale, name


def test_energies_balance_while_a_plane_moves(fields):
    text = BOX.replace("-8.0e-5", "-0.05").replace("history_count = 4", "history_count = 100")
    rows = fields(text + MOTION)[1]
    assert rows["plastic_dissipation"][-1] > 100.0
    assert np.abs(rows["energy_error"][10:]).max() < 2e-3


def test_a_smooth_footing_bears_what_is_left_of_its_width(fields):
    """(2 + pi) c (B - 2 dx): the soil flows where families reach beyond the edges. No rise."""
    text = (
        HEAD.replace("spacing = 0.1, horizon = 0.3", "spacing = 0.05, horizon = 0.15")
        + """\
&body x_min = 0.0, x_max = 1.2, y_min = -0.6, y_max = 0.0 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'axis', side = 'left', span = -0.6, 0.0, contact = 'smooth' /
&boundary name = 'right', side = 'right', span = -0.6, 0.0, contact = 'smooth' /
&boundary name = 'footing', side = 'top', span = 0.0, 0.5, contact = 'smooth'
  velocity = 0.0, -0.01 /
&integration method = 'equilibrium', end_time = 1.5, increments = 30, residual = 1.0e-3 /
&output history_count = 30, frame_count = 1 /
"""
    )
    found, rows = fields(text)
    load = -rows["footing_force_y"]
    assert load[-1] / C == pytest.approx((2.0 + np.pi) * (0.5 - 0.05), rel=0.02)
    assert load[-1] == pytest.approx(load[15], rel=0.01)
    # the soil slides out below it
    under = (found["position"][:, 1] > -0.15) & (found["position"][:, 0] < 0.5)
    assert np.mean(found["displacement"][under, 0]) > 0.2 * 0.015


def test_a_restart_with_bearings_gives_the_same_bits(program, run_case, tmp_path):
    text = BOX.replace("-8.0e-5", "-0.05").replace("history_count = 4", "history_count = 400")
    text = text.replace("frame_count = 1", "frame_count = 1, checkpoint_every = 7") + MOTION
    (tmp_path / "straight").mkdir()
    done = run_case(text, tmp_path / "straight", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    process = begin(program, tmp_path, text, "--threads", "1")
    stop(process, 15, tmp_path / "out", 100)
    done = run_case(text, tmp_path, "--restart", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "straight" / "out", tmp_path / "out")


def test_a_bearing_needs_a_body_as_thick_as_its_layer(run_case, tmp_path):
    text = BOX[: BOX.index("&boundary name = 'left'")].replace("y_max = 0.8", "y_max = 0.2")
    done = run_case(text + REST, tmp_path, "--check")
    assert done.returncode == 3
    assert "thinner than its layer" in done.stderr
    assert "&boundary name = bottom" in done.stderr
