"""Increments that are brought to equilibrium: rest, energy, limits, bits, and what is refused."""

import signal

import h5py
import numpy as np
import pytest
from case_files import SPECIMEN, begin, changed, history, same_points_and_frames, stop

CONTROL = "&stabilisation method = 'relaxing' /\n"
RESTING = SPECIMEN.replace(
    "damping = 5.0e5, damping_frame = 'platens'", "method = 'equilibrium', increments = 100"
)
RESTING += CONTROL
CLAY = changed(RESTING, kinematic_modulus="0.0", residual_strength="0.0", amplitude="0.0")
CLAY = CLAY.replace(CONTROL, "").replace(
    "side = 'bottom' /", "side = 'bottom', contact = 'smooth' /"
)
CLAY = CLAY.replace("model = 'j2'", "model = 'j2', strain_measure = 'small'")
WIDTH, YIELD = 0.5, 0.15e6


@pytest.fixture
def rows(run_case, tmp_path):
    """Return a function that runs a case and returns its history."""

    def run(text, *options):
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1", *options)
        assert done.returncode == 0, done.stderr
        return history(tmp_path / "out" / "case_history.csv")

    return run


def at(rows, strain):
    """Return the axial stress at a strain [Pa]."""
    return np.interp(strain, rows["strain"], rows["bottom_force_y"]) / WIDTH


def test_every_row_is_at_rest_and_has_its_energy(rows):
    run = rows(RESTING)
    assert run["max_plastic_strain"][-1] > 0.015
    assert run["unbalanced_force"][1:].max() <= 1e-4
    assert np.abs(run["energy_error"]).max() < 2e-3
    gap = run["bottom_force_y"] + run["top_force_y"]
    assert np.abs(gap).max() < 5e-4 * run["bottom_force_y"].max()
    assert not run["kinetic_energy"].any()
    assert not run["damping_share"].any()


def test_a_load_that_grows_does_the_work_that_is_stored(rows):
    run = rows("""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25, volumes = 'tributary' /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'elastic', strain_measure = 'small', density = 2000.0, youngs_modulus = 50.0e6
  poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&pressure name = 'top', side = 'top', value = 1.0e4, ramp_time = 1.0 /
&integration method = 'equilibrium', end_time = 1.0, increments = 4, residual = 1.0e-8 /
&output history_count = 4, frame_count = 1 /
""")
    # Clapeyron: half of the load times the displacement, about F^2 height (1 - nu^2) / (2 E width)
    about = 5.0e3**2 * 1.0 * (1.0 - 0.3**2) / (2.0 * 50.0e6 * WIDTH)
    assert run["external_work"][-1] == pytest.approx(about, rel=0.2)  # a coarse body is softer
    assert run["strain_energy"] == pytest.approx(run["external_work"], rel=1e-5)


def test_frames_lie_where_they_were_asked_for(rows, tmp_path):
    rows(RESTING)
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        strains = [file["frames"][k].attrs["strain"] for k in sorted(file["frames"])]
    assert strains == pytest.approx([0.0, 0.004, 0.01], rel=1e-9)


def test_the_elastic_slope_is_that_of_a_slow_motion(rows):
    elastic = changed(
        RESTING, yield_stress="15.0e6", final_strain="0.001", amplitude="0.0"
    ).replace("frame_strains = 0.004, 0.01", "frame_count = 1")
    motion = elastic.replace("method = 'equilibrium', increments = 100", "damping = 1.0e5")
    at_rest = at(rows(elastic), 0.001)
    moving = changed(motion, velocity="0.0, -0.001")
    assert at(rows(moving), 0.001) == pytest.approx(at_rest, rel=2e-3)


def test_the_plateau_is_that_of_the_closed_form(rows):
    run = rows(CLAY)
    # the first and last column of points stand for half a spacing beyond the sides
    plateau = 2.0 * YIELD / np.sqrt(3.0) * (1.0 + 0.1 / WIDTH)
    assert at(run, 0.01) == pytest.approx(plateau, rel=0.02)
    assert abs(at(run, 0.01) - at(run, 0.008)) < 2e-3 * plateau


def test_stress_depends_on_no_increment_rule_or_density(rows):
    reference = at(rows(RESTING), 0.008)
    assert at(rows(changed(RESTING, increments="200")), 0.008) == pytest.approx(reference, rel=0.02)
    assert at(rows(changed(RESTING, density="300.0")), 0.008) == pytest.approx(reference, rel=5e-3)
    for rule in ("kinetic", "local", "accelerated"):
        text = RESTING.replace("increments = 100", f"increments = 100, relaxation = '{rule}'")
        assert at(rows(text), 0.008) == pytest.approx(reference, rel=5e-3), rule


def test_the_control_lets_go_once_per_increment_not_per_move(rows):
    """The ways of two rules differ in their moves; what has flowed at their ends does not."""
    text = changed(RESTING, final_strain="0.004").replace(
        "frame_strains = 0.004, 0.01", "frame_count = 1"
    )
    runs = [
        rows(text.replace("increments = 100", f"increments = 40, relaxation = '{rule}'"))
        for rule in ("adaptive", "local")
    ]
    assert runs[0]["stabilisation_energy"][-1] > 0.5
    flowed = [run["plastic_dissipation"][-1] for run in runs]
    assert flowed[1] == pytest.approx(flowed[0], rel=0.01)


def test_a_rate_of_the_platens_changes_nothing(rows):
    slow, fast = rows(RESTING), rows(changed(RESTING, velocity="0.0, -10.0"))
    assert fast["bottom_force_y"] == pytest.approx(slow["bottom_force_y"], rel=1e-6)


def test_the_limit_of_a_load_ends_the_run(run_case, tmp_path):
    text = changed(CLAY, velocity=None, final_strain=None).replace(
        "contact = 'smooth', ", "contact = 'smooth', traction = 0.0, -300.0e3, ramp_time = 1.0"
    )
    text = text.replace("&integration ", "&integration end_time = 1.0, ").replace(
        "frame_strains = 0.004, 0.01", "frame_count = 2"
    )
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert "limit load: the last equilibrium is at" in log
    run = history(tmp_path / "out" / "case_history.csv")
    elastic = run["max_plastic_strain"] == 0.0
    assert np.abs(run["energy_error"][elastic]).max() < 1e-10
    assert np.abs(run["damping_dissipation"][elastic]).max() < 1e-3 * run["external_work"].max()
    assert np.abs(run["energy_error"]).max() < 5e-3
    limit = 2.0 * YIELD / np.sqrt(3.0) * (1.0 + 0.1 / WIDTH)
    assert run["bottom_force_y"][-1] / WIDTH == pytest.approx(limit, rel=0.03)
    assert run["step"][-1] != run["step"][-2]


def test_a_body_that_is_not_held_fails(run_case, tmp_path):
    text = CLAY.replace("velocity = 0.0, -0.01", "velocity = 0.0, 0.0")
    text = changed(text, final_strain="1.0").replace("final_strain", "end_time")
    text = text.replace("frame_strains = 0.004, 0.01", "frame_count = 1")
    text += "&pressure name = 'cell', side = 'left', value = 1.0e4, ramp_time = 1.0 /\n"
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 4
    assert "is the body held" in done.stderr


def test_a_jump_is_followed_and_told(run_case, tmp_path):
    text = changed(RESTING, kinematic_modulus="-2.0e7", amplitude="1.0e-2")
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert "a jump at step" in log
    run = history(tmp_path / "out" / "case_history.csv")
    assert run["unbalanced_force"][1:].max() <= 1e-4
    fall = -np.diff(run["bottom_force_y"]).min()
    assert fall > 0.2 * run["bottom_force_y"].max()
    assert np.diff(run["damping_dissipation"]).max() > 0.01 * run["external_work"].max()


def test_threads_change_no_bit(run_case, tmp_path):
    for threads in (1, 3):
        done = run_case(
            RESTING,
            tmp_path,
            *("--quiet", "--threads", threads, "--output", f"out{threads}"),
            OMP_WAIT_POLICY="passive",
        )
        assert done.returncode == 0, done.stderr
    one, other = (tmp_path / f"out{n}" / "case_history.csv" for n in (1, 3))
    assert one.read_bytes() == other.read_bytes()


def test_a_restart_changes_no_bit(program, run_case, tmp_path):
    text = changed(RESTING, increments="400", history_count="400")
    (tmp_path / "whole").mkdir()
    (tmp_path / "parts").mkdir()
    done = run_case(text, tmp_path / "whole", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "parts"
    status = stop(begin(program, folder, text), signal.SIGTERM, folder, 50)
    assert status == 143
    done = run_case(text, folder, "--quiet", "--threads", "1", "--restart")
    assert done.returncode == 0, done.stderr
    straight = tmp_path / "whole" / "out"
    assert (folder / "out" / "case_history.csv").read_bytes() == (
        straight / "case_history.csv"
    ).read_bytes()
    with (
        h5py.File(folder / "out" / "case.h5", locking=False) as one,
        h5py.File(straight / "case.h5", locking=False) as other,
    ):
        same_points_and_frames(one, other)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("increments = 100", "increments = 100, damping = 1.0e5", "damping"),
        ("increments = 100", "increments = 100, safety = 0.5", "safety"),
        ("increments = 100", "increments = 0", "increments"),
        ("method = 'equilibrium', increments = 100", "increments = 100", "increments"),
        ("method = 'equilibrium', increments = 100", "residual = 1.0e-3", "residual"),
    ],
)
def test_keys_without_effect_are_refused(run_case, tmp_path, old, new, key):
    done = run_case(RESTING.replace(old, new), tmp_path, "--check")
    assert done.returncode == 2
    assert f"&integration {key}" in done.stderr


def test_a_damping_that_carries_load_is_told(run_case, tmp_path):
    for damping, told in (("5.0e5", True), ("2.0e4", False)):
        text = changed(SPECIMEN, damping=damping, final_strain="0.002").replace(
            "frame_strains = 0.004, 0.01", "frame_count = 1"
        )
        text = changed(text, damping_frame="'rest'", velocity="0.0, -0.05")
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
        assert done.returncode == 0, done.stderr
        log = (tmp_path / "out" / "case.log").read_text()
        assert ("forces of the damping are" in log) == told, damping
