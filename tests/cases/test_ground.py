"""Gravity, initial stress, gradients, probes: closed forms, rest, restart, bits, what is said."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from case_files import history, same_points_and_frames
from test_loads import stopped

ROOT = Path(__file__).resolve().parents[2]

GAMMA, K0 = 2.0e4, 0.5
COLUMN = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.25, horizon = 0.5, layout = 'cells' /
&body x_min = 0.0, x_max = 6.0, y_min = -3.0, y_max = 0.0 /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  strain_measure = 'small' /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&boundary name = 'right', side = 'right', contact = 'smooth' /
&gravity acceleration = 0.0, -10.0 /
&integration method = 'equilibrium', end_time = 1.0, increments = 4 /
&output frame_count = 1 /
&stabilisation method = 'relaxing' /
"""
AREA, LAYERS = 6.0 * 3.0, 2 * 0.5 * 3.0
GROWING = COLUMN.replace("0.0, -10.0", "0.0, -10.0, ramp_time = 1.0").replace(
    "increments = 4", "increments = 4, residual = 1.0e-9"
)
CLAY = COLUMN.replace("model = 'elastic'", "model = 'j2', yield_stress = 60.0e3").replace(
    "&output", f"&initial_stress unit_weight = {GAMMA}, k0 = {K0} /\n&output"
)
MOVING = "end_time = 0.05, damping = 1.0e5"
EQUILIBRIUM = "method = 'equilibrium', end_time = 1.0, increments = 4"
FOOTING = "&pressure name = 'foot', side = 'top', span = 2.0, 4.0, value = 1.6e5, ramp_time = 1.0 /"


@pytest.fixture
def results(run_case, tmp_path):
    """Return a function that runs a case and returns its history and the fields at its end."""

    def run(text):
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
        assert done.returncode == 0, done.stderr
        rows = history(tmp_path / "out" / "case_history.csv")
        with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
            frame = file["frames"][list(file["frames"])[-1]]
            fields = {name: data[()] for name, data in frame.items()}
            fields |= {name: data[()] for name, data in file["points"].items()}
        return rows, fields

    return run


# ------------------------------------------------------------------------------- gravity


@pytest.mark.parametrize("operators", ["auto", "list"])
def test_a_column_under_its_weight_meets_its_closed_form(results, operators):
    rows, fields = results(GROWING.replace("'case',", f"'case', operators = '{operators}',"))
    x, stress = fields["position"], fields["stress"]
    middle = (fields["boundary"] == 0) & (np.abs(x[:, 0] - 3.0) < 1.5)
    inside = middle & (x[:, 1] < -0.75) & (x[:, 1] > -2.0)
    assert inside.sum() == 60
    overburden = -GAMMA * np.abs(x[inside, 1])
    # forces near layers are off: that moves the walls by a part of the horizon, 0.5 m of 6 m
    assert stress[inside, 1] == pytest.approx(overburden, abs=0.01 * GAMMA * 3.0)
    for c in (0, 2):
        lateral = 0.3 / 0.7 * overburden
        assert stress[inside, c] == pytest.approx(lateral, abs=0.02 * GAMMA * 3.0)
    assert np.abs(stress[inside, 3]).max() < 0.01 * GAMMA * 3.0
    # bottom carries the body and the layers that slide; the walls are smooth
    assert rows["bottom_force_y"][-1] == pytest.approx(GAMMA * (AREA + LAYERS), rel=1e-8)
    assert rows["left_force_x"][-1] == pytest.approx(-rows["right_force_x"][-1], rel=1e-8)
    assert not rows["left_force_y"].any()
    assert rows["gravity"] == pytest.approx(10.0 * rows["time"], rel=1e-12)
    assert np.abs(rows["energy_error"]).max() < 1e-9


def test_gravity_turns_with_the_body(results):
    walls = [line for line in GROWING.splitlines(keepends=True) if "contact = 'smooth'" in line]
    free = GROWING.replace("".join(walls), "").replace("x_max = 6.0", "x_max = 2.0")
    turned = free.replace("x_max = 2.0, y_min = -3.0", "x_max = 3.0, y_min = -2.0")
    turned = turned.replace("side = 'bottom'", "side = 'left'").replace("0.0, -10.0", "-10.0, 0.0")
    upright, _ = results(free)
    lying, _ = results(turned)
    assert upright["bottom_force_y"][-1] == pytest.approx(GAMMA * 6.0, rel=1e-8)
    for one, other in (("bottom_force_y", "bottom_force_x"), ("mean_stress_xx", "mean_stress_yy")):
        assert lying[other] == pytest.approx(upright[one], rel=1e-7)


def test_a_cut_collapses_under_growing_weight(run_case, tmp_path):
    cut = GROWING.replace("x_max = 6.0, y_min = -3.0", "x_max = 2.0, y_min = -1.0").replace(
        "&boundary name = 'right', side = 'right', contact = 'smooth' /\n", ""
    )
    cut = cut.replace("model = 'elastic'", "model = 'j2', yield_stress = 8.66e3")
    cut = cut.replace("increments = 4, residual = 1.0e-9", "increments = 8")
    cut = cut.replace("-10.0", "-20.0")
    done = run_case(cut, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert "limit load: the last equilibrium is at" in log
    rows = history(tmp_path / "out" / "case_history.csv")
    # exact: gamma h = 3.78 c, with c = 5 kPa and h = 1 m; four points are too strong
    assert 3.78 * 5.0e3 < 2000.0 * rows["gravity"][-1] < 2.0 * 3.78 * 5.0e3
    assert f"with gravity of {rows['gravity'][-1]:.5g} m/s^2" in log


# ------------------------------------------------------------------------ initial stress


@pytest.mark.parametrize("method", [MOVING, EQUILIBRIUM])
@pytest.mark.parametrize("operators", ["auto", "list"])
@pytest.mark.parametrize("gravity", [True, False])
def test_an_initial_stress_stays_at_rest(results, method, operators, gravity):
    text = CLAY.replace(EQUILIBRIUM, method).replace("strain_measure = 'small'", "")
    text = text.replace("'case',", f"'case', operators = '{operators}',")
    if not gravity:
        text = text.replace("&gravity acceleration = 0.0, -10.0 /\n", "")
    rows, fields = results(text)
    x, body = fields["position"], fields["boundary"] == 0
    assert len(rows["step"]) > 4
    assert rows["unbalanced_force"].max() < 1e-12
    assert np.abs(fields["displacement"]).max() < 1e-15
    assert np.abs(rows["energy_error"]).max() < 1e-6
    assert fields["stress"][body, 1] == pytest.approx(GAMMA * x[body, 1], abs=1e-8 * GAMMA)
    assert fields["stress"][body, 0] == pytest.approx(K0 * GAMMA * x[body, 1], abs=1e-8 * GAMMA)
    thrust = K0 * GAMMA * 3.0**2 / 2
    assert rows["left_force_x"] == pytest.approx(thrust, rel=5e-3)
    assert rows["left_force_x"] == pytest.approx(-rows["right_force_x"], rel=1e-12)
    assert rows["bottom_force_y"] == pytest.approx(rows["bottom_force_y"][0], rel=1e-12)
    assert GAMMA * AREA < rows["bottom_force_y"][0] < GAMMA * (AREA + LAYERS)


def test_a_free_side_under_stress_is_told(run_case, tmp_path):
    open_side = CLAY.replace("&boundary name = 'right', side = 'right', contact = 'smooth' /\n", "")
    done = run_case(open_side, tmp_path, "--check")
    assert done.returncode == 0, done.stderr
    assert "warning: &initial_stress k0: the right side has no boundary" in done.stdout
    assert "the left side" not in done.stdout
    assert "side has no boundary" not in run_case(CLAY, tmp_path, "--check").stdout


def test_a_footing_on_ground_under_stress_keeps_the_balance_of_energy(results):
    text = CLAY.replace("increments = 4", "increments = 40") + FOOTING + "\n"
    loaded, fields = results(text)
    assert loaded["max_plastic_strain"][-1] > 1e-4
    assert loaded["strain_energy"][0] > 0.0
    assert loaded["energy_error"][0] == 0.0
    assert np.abs(loaded["energy_error"]).max() < 2e-3
    more = loaded["bottom_force_y"][-1] - loaded["bottom_force_y"][0]
    assert more == pytest.approx(1.6e5 * 2.0, rel=1e-3)
    assert fields["displacement"][:, 1].min() < -1e-3


def test_an_elastic_body_does_not_feel_its_initial_stress(results):
    ground = CLAY.replace("model = 'j2', yield_stress = 60.0e3", "model = 'elastic'")
    ground = ground.replace("increments = 4", "increments = 4, residual = 1.0e-9")
    weightless = ground.replace("&gravity acceleration = 0.0, -10.0 /\n", "")
    weightless = weightless.replace(f"&initial_stress unit_weight = {GAMMA}, k0 = {K0} /\n", "")
    _, stressed = results(ground + FOOTING + "\n")
    _, plain = results(weightless + FOOTING + "\n")
    largest = np.abs(plain["displacement"]).max()
    assert stressed["displacement"] == pytest.approx(plain["displacement"], abs=1e-6 * largest)
    body = plain["boundary"] == 0
    added = stressed["stress"][body, 1] - GAMMA * plain["position"][body, 1]
    assert added == pytest.approx(plain["stress"][body, 1], abs=1.0)


def test_a_restart_keeps_the_initial_stress(program, run_case, tmp_path):
    text = CLAY + FOOTING.replace("1.6e5, ramp_time = 1.0", "1.6e5, ramp_time = 0.2") + "\n"
    text = text.replace(EQUILIBRIUM, "end_time = 1.0, damping = 1.0e5").replace(
        "frame_count = 1", "frame_count = 4, history_count = 200"
    )
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    done = run_case(text, tmp_path / "one", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert history(tmp_path / "one/out/case_history.csv")["max_plastic_strain"][-1] > 1e-4
    stopped(program, tmp_path / "two", text, 30)
    with h5py.File(tmp_path / "two/out/case_checkpoint.h5", locking=False) as file:
        strain = file["state/initial_strain"]
        assert strain.attrs["unit"] in (b"1", "1")
        assert strain.shape[1] == 4
        assert strain[()].any()
    done = run_case(text, tmp_path / "two", "--restart", "--quiet", "--threads", "3")
    assert done.returncode == 0, done.stderr
    names = ("case_history.csv", "case.h5")
    one, two = ([tmp_path / folder / "out" / name for name in names] for folder in ("one", "two"))
    assert one[0].read_bytes() == two[0].read_bytes()
    with h5py.File(one[1], locking=False) as first, h5py.File(two[1], locking=False) as second:
        same_points_and_frames(first, second)


# ------------------------------------------------------------------- gradients and probes

DEEP = COLUMN.replace("&gravity acceleration = 0.0, -10.0 /\n", "").replace(
    "model = 'elastic'",
    "model = 'j2', yield_stress = 10.0e3, yield_stress_gradient = 8.0e3, reference_y = -1.0"
    " youngs_modulus_gradient = 2.0e7",
)
DEEP = DEEP.replace("side = 'left', contact", "side = 'left', velocity = 0.02, 0.0, contact")
DEEP = DEEP.replace("frame_count = 1", "frame_count = 4")
PROBES = """\
&probe name = 'high', x = 3.1, y = -0.6 /
&probe name = 'low', x = 3.1, y = -2.4 /
"""


def test_soil_yields_where_its_strength_says(results):
    _, fields = results(DEEP)
    depth = np.maximum(0.0, -1.0 - fields["position"][:, 1])
    assert fields["yield_stress"] == pytest.approx(10.0e3 + 8.0e3 * depth, rel=1e-12)
    assert fields["youngs_modulus"] == pytest.approx(50.0e6 + 2.0e7 * depth, rel=1e-12)
    flows = (fields["boundary"] == 0) & (fields["plastic_strain"] > 1e-4)
    assert fields["position"][flows, 1].min() < -2.0
    assert fields["position"][flows, 1].max() > -0.5
    used = fields["von_mises"][flows] / fields["yield_stress"][flows]
    assert used.max() == pytest.approx(1.0, rel=1e-9)
    assert np.mean(used > 1.0 - 1e-9) > 0.9  # the rest has come to rest again


def test_a_boundary_that_turns_tells_by_how_much(perigeo, tmp_path):
    wall = ROOT / "input" / "limit_loads" / "wall_rotation.nml"
    coarse = ("spacing=0.1", "horizon=0.3")
    settings = [f"discretisation.{word}" for word in coarse]
    settings += ["integration.increments=10", "integration.residual=1e-2", "run.name=case"]
    words = [word for text in settings for word in ("--set", text)]
    done = perigeo(["--quiet", "--output", "out", *words, wall], tmp_path)
    assert done.returncode == 0, done.stderr
    rows = history(tmp_path / "out" / "case_history.csv")
    gone = 0.01 * np.maximum(rows["time"] - 1.0, 0.0)  # of the tangent, clockwise
    assert rows["wall_rotation"] == pytest.approx(-np.arctan(gone), abs=1e-8)
    assert rows["wall_rotation"][-1] < -0.03
    assert [name for name in rows if name.endswith("_rotation")] == ["wall_rotation"]


def test_probes_tell_what_frames_hold(results, run_case, tmp_path):
    rows, fields = results(DEEP + PROBES)
    x = fields["position"]
    for name, place in (("high", [3.125, -0.625]), ("low", [3.125, -2.375])):
        point = np.flatnonzero((np.abs(x - place) < 1e-9).all(axis=1))[0]
        for c, axis in enumerate("xy"):
            found = rows[f"{name}_displacement_{axis}"]
            assert found[0] == 0.0
            assert found[-1] == fields["displacement"][point, c]
        for c, axes in enumerate(("xx", "yy", "zz", "xy")):
            assert rows[f"{name}_stress_{axes}"][-1] == fields["stress"][point, c]
        assert rows[f"{name}_plastic_strain"][-1] == fields["plastic_strain"][point]
    assert rows["left_displacement_x"] == pytest.approx(0.02 * rows["time"], rel=1e-9)
    left = fields["boundary"] == 2
    assert rows["left_displacement_y"][-1] == pytest.approx(
        fields["displacement"][left, 1].mean(), rel=1e-9
    )
    done = run_case(DEEP + PROBES, tmp_path, "--check")
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert "stiffness E from 5e7 to 8.75e7 Pa" in lines
    assert any(line.startswith("yield stress mean ") for line in lines)
    assert any(
        line.startswith("probe high: point ")
        and line.endswith("at (3.125, -0.625) m, 0.035355 m from where it was asked for")
        for line in lines
    )


def test_threads_change_no_bit(run_case, tmp_path):
    text = CLAY.replace("poissons_ratio", "youngs_modulus_gradient = 1.0e6, poissons_ratio")
    text += PROBES + FOOTING + "\n"
    for threads in ("1", "3"):
        (tmp_path / threads).mkdir()
        done = run_case(text, tmp_path / threads, "--quiet", "--threads", threads)
        assert done.returncode == 0, done.stderr
    one, other = ((tmp_path / k / "out/case_history.csv").read_bytes() for k in ("1", "3"))
    assert one == other
