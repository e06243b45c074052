"""A boundary that changes from load to motion: closed form, energy, restart, stages, bearings."""

import signal
from pathlib import Path

import h5py
import numpy as np
import pytest
from case_files import begin, history, same_points_and_frames, stop

ROOT = Path(__file__).resolve().parents[2]
CELL, C_U, YOUNGS, NU = 100.0e3, 50.0e3, 30.0e6, 0.45
CHANGE = 0.5

# Isotropic 100 kPa until 0.5 s, then the top comes down.
TEST = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.01, horizon = 0.025, layout = 'cells' /
&body x_min = 0.0, x_max = 0.05, y_min = 0.0, y_max = 0.1 /
&material model = 'j2', density = 2.0e6, youngs_modulus = {YOUNGS}, poissons_ratio = {NU}
  yield_stress = {np.sqrt(3.0) * C_U} /
&boundary name = 'bottom', side = 'bottom', contact = 'smooth' /
&boundary name = 'top', side = 'top', contact = 'smooth', traction = 0.0, {-CELL}
  ramp_time = 0.4, traction_until = {CHANGE}, times = 0.6, 0.7, velocities_y = 0.0, -0.001 /
&pressure name = 'left', side = 'left', value = {CELL}, ramp_time = 0.4 /
&pressure name = 'right', side = 'right', value = {CELL}, ramp_time = 0.4 /
&stabilisation method = 'relaxing' /
&integration end_time = 1.25, damping = 1.0e8, damping_frame = 'platens' /
&output frame_count = 3, history_count = 200 /
"""
RESTING = TEST.replace(
    "damping = 1.0e8, damping_frame = 'platens'", "method = 'equilibrium', increments = 40"
)


def results(run_case, folder, text, *options):
    """Run a case; return its history."""
    done = run_case(text, folder, "--quiet", "--force", *options)
    assert done.returncode == 0, done.stderr
    return history(folder / "out" / "case_history.csv")


def assert_same(one, other):
    """Assert that two folders hold the same history and frames, bit by bit."""
    name = "case_history.csv"
    assert (one / name).read_bytes() == (other / name).read_bytes()
    with (
        h5py.File(one / "case.h5", locking=False) as first,
        h5py.File(other / "case.h5", locking=False) as second,
    ):
        same_points_and_frames(first, second)


@pytest.fixture(scope="module")
def straight(run_case, tmp_path_factory):
    """Return the folder of an undisturbed run in motion."""
    folder = tmp_path_factory.mktemp("straight")
    results(run_case, folder, TEST)
    return folder / "out"


def first_flow(rows):
    """Return the number of the first row with plastic strain."""
    return int(np.argmax(rows["max_plastic_strain"] > 0.0))


def assert_laboratory(rows):
    """Assert an isotropic state, the elastic modulus, and the limit 2 c_u."""
    t = rows["time"]
    at = int(np.searchsorted(t, CHANGE - 1e-6))
    for name in ("xx", "yy"):
        assert rows[f"mean_stress_{name}"][at] == pytest.approx(-CELL, rel=0.03)
    assert rows["top_force_y"][at] == pytest.approx(-0.05 * CELL, rel=1e-3)
    assert rows["max_plastic_strain"][at] == 0.0
    later = int(np.searchsorted(t, t[at] + 0.6 * (t[first_flow(rows)] - t[at])))
    stress = rows["mean_stress_yy"][later] - rows["mean_stress_yy"][at]
    lateral = rows["mean_stress_xx"][later] - rows["mean_stress_xx"][at]
    strain = rows["mean_strain_yy"][later] - rows["mean_strain_yy"][at]
    slope = stress - NU / (1.0 - NU) * lateral  # plane strain with a small change of sigma_3
    assert slope / strain == pytest.approx(YOUNGS / (1.0 - NU**2), rel=0.02)
    deviator = rows["mean_stress_xx"][-1] - rows["mean_stress_yy"][-1]
    assert deviator == pytest.approx(2.0 * C_U, rel=0.02)


def test_in_motion_it_meets_the_closed_form_and_keeps_the_energy(straight):
    rows = history(straight / "case_history.csv")
    assert_laboratory(rows)
    assert np.abs(rows["energy_error"][rows["time"] > 0.45]).max() < 1e-5
    resting = rows["time"] < 0.59
    after = ~resting & (rows["time"] > 0.72)
    rate = np.diff(rows["strain"][after]) / np.diff(rows["time"][after])
    assert rate == pytest.approx(0.01, rel=1e-6)  # velocity over height, to the digits of the file
    held = rows["strain"][resting & (rows["time"] > 0.51)]
    assert np.ptp(held) < 1e-12  # the table begins at rest


def test_at_equilibrium_it_meets_the_closed_form(run_case, tmp_path):
    rows = results(run_case, tmp_path, RESTING)
    assert_laboratory(rows)
    assert np.abs(rows["energy_error"][5:]).max() < 0.02


def test_a_sudden_velocity_is_work_of_the_platen(run_case, tmp_path):
    table = "times = 0.6, 0.7, velocities_y = 0.0, -0.001"
    text = TEST.replace(table, "velocity = 0.0, -0.001").replace("1.25", "0.6")
    rows = results(run_case, tmp_path, text)
    assert np.abs(rows["energy_error"][rows["time"] > 0.4]).max() < 5e-4


def test_the_example_meets_the_closed_form_as_its_head_says(run_case, tmp_path):
    example = ROOT / "input/biaxial_isotropic.nml"
    done = run_case(example, tmp_path, "--output", "out")
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stdout
    assert "top: motion in place of the traction from 0.5 s on" in done.stdout
    rows = history(tmp_path / "out" / "biaxial_isotropic_history.csv")
    assert_laboratory(rows)
    assert "motion from 0.5 s on" in done.stdout
    head = " ".join(example.read_text().partition("&run")[0].replace("!", " ").split())
    with h5py.File(tmp_path / "out" / "biaxial_isotropic.h5", locking=False) as file:
        body = file["points/boundary"][()] == 0
        stress = file["frames/000001/stress"][()][body, 1]
        height = file["points/position"][()][body, 1]
    found = -1e-3 * stress
    assert f"{found.min():.0f} to {found.max():.0f} within" in head
    middle = found[abs(height - 0.05) < 0.02]
    assert f"{middle.min():.0f} to {middle.max():.0f} kPa in the middle" in head
    at = int(np.searchsorted(rows["time"], CHANGE - 1e-6)) + 5
    slope = -np.diff(rows["top_force_y"])[at] / 0.05 / np.diff(rows["strain"])[at]
    assert f"a slope of {1e-6 * slope:.1f} MPa" in head
    true = -rows["top_force_y"] / 0.05 / (1.0 + rows["strain"]) - CELL
    assert true[rows["time"] > 0.8] == pytest.approx(2.0 * C_U, rel=0.025)


@pytest.mark.parametrize("rows", [20, 140])
def test_it_goes_on_as_if_it_were_not_stopped(program, run_case, tmp_path, straight, rows):
    assert stop(begin(program, tmp_path, TEST), signal.SIGTERM, tmp_path, rows) == 143
    done = run_case(TEST, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight)


def test_at_equilibrium_it_goes_on_too(program, run_case, tmp_path):
    text = RESTING.replace("increments = 40", "increments = 400")
    (tmp_path / "straight").mkdir()
    results(run_case, tmp_path / "straight", text)
    assert stop(begin(program, tmp_path, text), signal.SIGTERM, tmp_path, 85) == 143
    done = run_case(text, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", tmp_path / "straight" / "out")


def test_it_goes_on_from_the_very_step_of_the_change(run_case, tmp_path):
    step = 1.0e-3
    ended = {}
    for name, ends in (("straight", [0.6]), ("again", [0.5 - 0.3 * step, 0.6])):
        folder = tmp_path / name
        folder.mkdir()
        for k, end in enumerate(ends):
            text = TEST.replace("end_time = 1.25", f"end_time = {end}, time_step = {step}")
            text = text.replace("damping =", "time_step_rule = 'fixed', damping =")
            text = text.replace("until = 0.5", f"until = {0.5 - 0.7 * step}")
            text = text.replace(
                "times = 0.6, 0.7, velocities_y = 0.0, -0.001", "velocity = 0, -1e-3"
            )
            text = text.replace("frame_count = 3", f"frame_times = {end}, checkpoint_every = 1e9")
            done = run_case(text, folder, "--quiet", *(["--restart"] if k else []))
            assert done.returncode == 0, done.stderr
        lines = (folder / "out" / "case_history.csv").read_text().splitlines()
        with h5py.File(folder / "out" / "case.h5", locking=False) as file:
            last = sorted(file["frames"])[-1]
            fields = {key: file[f"frames/{last}/{key}"][()] for key in file[f"frames/{last}"]}
        ended[name] = lines[-1], fields
    assert ended["again"][0] == ended["straight"][0]
    for key, field in ended["straight"][1].items():
        assert field.tobytes() == ended["again"][1][key].tobytes(), key


def test_the_change_may_fall_on_a_stage(run_case, tmp_path):
    stages = (
        "&stage name = 'consolidate', end_time = 0.5 /\n&stage name = 'shear', end_time = 1.25 /"
    )
    text = RESTING.replace("end_time = 1.25, ", "") + stages
    rows = results(run_case, tmp_path, text)
    plain = tmp_path / "plain"
    plain.mkdir()
    straight = results(run_case, plain, RESTING)
    for name in ("top_force_y", "mean_stress_xx", "mean_strain_yy"):
        assert rows[name][-1] == pytest.approx(straight[name][-1], rel=5e-3)


def test_a_stage_after_the_change_leaves_the_platen_where_it_is(run_case, tmp_path):
    stages = "&stage name = 'one', end_time = 0.8 /\n&stage name = 'two', end_time = 1.25 /"
    rows = results(run_case, tmp_path, RESTING.replace("end_time = 1.25, ", "") + stages)
    assert np.diff(rows["mean_strain_yy"][rows["time"] > 0.75]).max() < 0.0
    deviator = rows["mean_stress_xx"][-1] - rows["mean_stress_yy"][-1]
    assert deviator == pytest.approx(2.0 * C_U, rel=0.02)


def test_a_specimen_may_stand_on_a_mirror(run_case, tmp_path):
    text = TEST.replace("side = 'bottom', contact", "side = 'bottom', span = 0.0, 0.05, contact")
    rows = results(run_case, tmp_path, text.replace(", damping_frame = 'platens'", ""))
    assert_laboratory(rows | {"strain": rows["mean_strain_yy"]})


def test_a_start_with_k0_needs_no_ramp(run_case, tmp_path):
    """Vertical stress of the surcharge, k0 of it across; then the top is moved."""
    text = TEST[: TEST.index("&pressure")].replace("ramp_time = 0.4, traction_until = 0.5", "")
    text = text.replace("traction = 0.0, -100000.0", "traction = 0.0, -60e3, traction_until = 0.1")
    text += "&initial_stress unit_weight = 0.0, k0 = 0.5, surcharge = 60.0e3 /\n"
    text += TEST[TEST.index("&stabilisation") :]
    rows = results(run_case, tmp_path, text)
    early = rows["time"] < 0.59
    assert rows["mean_stress_yy"][early] == pytest.approx(-60e3, rel=1e-6)
    assert rows["mean_stress_xx"][early] == pytest.approx(-30e3, rel=1e-6)
    deviator = rows["mean_stress_xx"][-1] - rows["mean_stress_yy"][-1]
    assert deviator == pytest.approx(2.0 * C_U, rel=0.02)
