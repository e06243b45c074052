"""Pressures and platens under a load: closed forms, balances, restart, threads, --check."""

import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from case_files import (
    SPECIMEN,
    changed,
    history,
    same_points_and_frames,
    uncontrolled,
    without_group,
)

YOUNGS, NU = 50.0e6, 0.3
P = 20.0e3

BODY = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.2, layout = 'nodes', volumes = 'tributary' /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&integration end_time = 0.6, damping = 2.0e5 /
&output history_count = 100, frame_count = 2 /
"""
BOTTOM = "&boundary name = 'bottom', side = 'bottom', contact = 'smooth' /\n"
TOP = "&boundary name = 'top', side = 'top', contact = 'smooth' /\n"


def pressed(*sides, keys=f"value = {P}, ramp_time = 0.2"):
    """Return pressures on some sides."""
    return "".join(f"&pressure name = '{side}', side = '{side}', {keys} /\n" for side in sides)


def under(traction, keys="contact = 'smooth', ramp_time = 0.3"):
    """Return a top platen under a traction."""
    return f"&boundary name = 'top', side = 'top', traction = {traction}, {keys} /\n"


def finer(text, spacing, m):
    """Return an input with another spacing and horizon."""
    return changed(text, spacing=repr(spacing), horizon=repr(round(m * spacing, 9)))


@pytest.fixture
def results(run_case, tmp_path):
    """Return a function that runs a case and returns its history and the fields at its end."""

    def run(text):
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
        assert done.returncode == 0, done.stderr
        rows = history(tmp_path / "out" / "case_history.csv")
        assert rows["energy_error"][0] == 0.0
        assert np.abs(rows["energy_error"][10:]).max() < 1e-4
        with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
            frame = file["frames"][list(file["frames"])[-1]]
            fields = {name: data[()] for name, data in frame.items()}
            fields |= {name: file["points"][name][()] for name in ("position", "boundary")}
        return rows, fields

    return run


# ------------------------------------------------------------------------------ pressure


@pytest.mark.parametrize("layout", ["nodes", "cells"])
def test_pressure_all_round_makes_a_homogeneous_stress(results, layout):
    text = changed(BODY, layout=f"'{layout}'") + pressed("left", "right", "bottom", "top")
    rows, fields = results(text)
    # dead loads: the first Piola stress, and of what is left of the motion less than 1e-5
    assert rows["mean_stress_xx"][-1] == pytest.approx(-P, rel=1e-5)
    assert rows["mean_stress_yy"][-1] == pytest.approx(-P, rel=1e-5)
    # Cauchy stress: divided by the stretch, 1 - 2e-4; every point has it, surfaces included
    stretch = 1 - P * (1 + NU) * (1 - 2 * NU) / YOUNGS
    assert fields["stress"][:, :2] == pytest.approx(-P / stretch, rel=2e-5)
    assert fields["stress"][:, 3] == pytest.approx(0.0, abs=2e-5 * P)


def test_uniform_volumes_make_the_body_larger_than_the_loads(results):
    # both extents are larger by a spacing, the load is not
    text = changed(BODY, volumes="'uniform'") + pressed("left", "right", "bottom", "top")
    rows, _ = results(text)
    assert rows["mean_stress_xx"][-1] == pytest.approx(-P * 2.0 / 2.1, rel=1e-3)
    assert rows["mean_stress_yy"][-1] == pytest.approx(-P * 1.0 / 1.1, rel=1e-3)


def test_lateral_pressure_between_smooth_platens_meets_its_closed_form(results):
    text = finer(BODY, 0.05, 2) + BOTTOM + TOP + pressed("left", "right")
    rows, fields = results(text)
    assert rows["mean_stress_xx"][-1] == pytest.approx(-P, rel=5e-3)
    # E_yy = E_zz = 0. The layers are cut off at their outer side, one horizon from the body: an
    # error of the order of horizon over height, 0.05
    exact = -NU / (1 - NU) * P
    assert rows["mean_stress_yy"][-1] == pytest.approx(exact, rel=0.03)
    middle = (fields["boundary"] == 0) & (abs(fields["position"][:, 1] - 1.0) < 0.3)
    assert fields["stress"][middle, 0].mean() == pytest.approx(-P, rel=5e-3)
    assert fields["stress"][middle, 1].mean() == pytest.approx(exact, rel=0.02)
    assert rows["top_force_y"][-1] == pytest.approx(-rows["bottom_force_y"][-1], rel=1e-5)
    assert rows["bottom_force_y"][-1] == pytest.approx(-exact, rel=0.03)


@pytest.mark.parametrize("volumes", ["uniform", "tributary"])
@pytest.mark.parametrize("layout", ["nodes", "cells"])
def test_rough_platens_take_the_whole_of_a_pressure(results, layout, volumes):
    text = changed(BODY, layout=f"'{layout}'", volumes=f"'{volumes}'")
    text += (BOTTOM + TOP).replace("smooth", "rough")
    rows, _ = results(text + pressed("left"))
    total = rows["bottom_force_x"] + rows["top_force_x"]
    assert total[-1] == pytest.approx(-2.0 * P, rel=1e-4)
    span = f"span = 0.44, 1.27, value = {P}, ramp_time = 0.2"
    rows, _ = results(text + pressed("right", keys=span))
    total = rows["bottom_force_x"] + rows["top_force_x"]
    assert total[-1] == pytest.approx(0.83 * P, rel=1e-4)
    assert rows["bottom_force_x"][-1] > rows["top_force_x"][-1]


def test_rough_platens_leave_the_pressure_in_the_middle(results):
    text = finer(BODY, 0.05, 2) + (BOTTOM + TOP).replace("smooth", "rough")
    rows, fields = results(text + pressed("left", "right"))
    x, stress = fields["position"], fields["stress"]
    row = (fields["boundary"] == 0) & (abs(x[:, 1] - 1.0) < 0.01)
    weight = np.where((x[row, 0] < 0.01) | (x[row, 0] > 0.99), 0.5, 1.0)
    # the platens are a width away
    assert np.average(stress[row, 0], weights=weight) == pytest.approx(-P, rel=0.02)
    assert abs(rows["bottom_force_x"][-1]) < 1e-6 * P


# ------------------------------------------------------------------------------ traction

MODULUS = YOUNGS / (1 - NU**2)


@pytest.mark.parametrize("layout", ["nodes", "cells"])
def test_a_traction_between_smooth_platens_meets_its_closed_form(results, layout):
    text = finer(changed(BODY, end_time="0.9", layout=f"'{layout}'"), 0.05, 2)
    rows, fields = results(text + BOTTOM + under(f"0.0, -{P}"))
    assert rows["mean_stress_yy"][-1] == pytest.approx(-P, rel=5e-3)
    assert rows["mean_strain_yy"][-1] == pytest.approx(-P / MODULUS, rel=0.01)
    assert rows["top_force_y"][-1] == pytest.approx(-P, rel=1e-5)
    assert rows["bottom_force_y"][-1] == pytest.approx(P, rel=1e-5)
    # between the platens lie the ends of the layers, which are softer than the body
    assert P / MODULUS < rows["strain"][-1] < 1.1 * P / MODULUS
    platen = fields["boundary"] == 2
    assert np.ptp(fields["displacement"][platen, 1]) < 1e-15
    assert np.ptp(fields["velocity"][platen, 1]) < 1e-15
    assert np.ptp(fields["displacement"][platen, 0]) > 1e-5  # it slides
    strain = -fields["displacement"][platen, 1][0] / 2.0
    assert rows["strain"][-1] == pytest.approx(strain, rel=1e-12)


def test_a_platen_under_load_is_where_one_that_is_moved_needs_that_load(results):
    text = changed(BODY, end_time="0.9")
    loaded, _ = results(text + BOTTOM + under(f"0.0, -{P}"))
    rate = 2.0 * float(loaded["strain"][-1]) / 0.4
    table = f"times = 0.0, 0.1, 0.4, 0.5, velocities_y = 0.0, -{rate!r}, -{rate!r}, 0.0"
    moved, _ = results(text + BOTTOM + TOP.replace("'smooth'", f"'smooth', {table}"))
    assert moved["strain"][-1] == pytest.approx(loaded["strain"][-1], rel=1e-9)
    assert moved["top_force_y"][-1] == pytest.approx(-P, rel=1e-4)


def test_a_rough_platen_under_a_slanted_traction_moves_as_one(results):
    text = changed(BODY, end_time="1.2", damping="4.0e5") + BOTTOM.replace("smooth", "rough")
    rows, fields = results(text + under(f"{0.1 * P}, -{P}", "ramp_time = 0.3"))
    assert rows["bottom_force_x"][-1] == pytest.approx(-0.1 * P, rel=0.01)
    assert rows["bottom_force_y"][-1] == pytest.approx(P, rel=0.01)
    moved = fields["displacement"][fields["boundary"] == 2]
    assert moved[0, 0] > 0 > moved[0, 1]
    assert np.ptp(moved, axis=0).max() < 1e-15


def test_walls_that_slide_bear_their_share_of_a_traction(results):
    # an oedometer: the layers of the walls continue the body, and stand under the platen too
    walls = "".join(
        f"&boundary name = '{side}', side = '{side}', contact = 'smooth' /\n"
        for side in ("left", "right")
    )
    rows, _ = results(BODY + walls + BOTTOM + under(f"0.0, -{P}"))
    assert "strain" not in rows
    assert rows["mean_stress_yy"][-1] == pytest.approx(-P, rel=0.03)


# ------------------------------------------------------------------------------ energy

SUDDEN = {
    "pressure": BOTTOM + TOP + pressed("left", "right", keys=f"value = {P}"),
    "smooth": BOTTOM + under(f"0.0, -{P}", "contact = 'smooth'"),
    "rough": BOTTOM.replace("smooth", "rough") + under(f"{P}, -{P}", "contact = 'rough'"),
    "both, ramped": BOTTOM
    + under(f"0.0, -{P}", "contact = 'smooth', ramp_time = 0.01")
    + pressed("left", keys=f"value = {P}, ramp_time = 0.02"),
}


@pytest.mark.parametrize("loads", SUDDEN)
def test_the_work_of_loads_balances_to_the_second_order(run_case, tmp_path, loads):
    # without damping: half the time step, a quarter of the error
    errors = []
    for step in (5.0e-4, 2.5e-4):
        text = changed(BODY, damping="0.0", end_time="0.15") + SUDDEN[loads]
        text = text.replace("end_time", f"time_step_rule = 'fixed', time_step = {step}, end_time")
        done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
        assert done.returncode == 0, done.stderr
        rows = history(tmp_path / "out" / "case_history.csv")
        surplus = rows["energy_error"] * np.abs(rows["external_work"])
        errors.append(np.abs(surplus).max() / np.abs(rows["external_work"]).max())
    assert errors[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert rows["kinetic_energy"].max() > 0.1 * rows["external_work"].max()
    # a load at once makes twice the stress of a slow one
    column = {"pressure": "mean_stress_xx", "smooth": "mean_stress_yy"}.get(loads)
    if column:
        assert rows[column].min() == pytest.approx(-2 * P, rel=0.1)


# ------------------------------------------------------------------------------ motion


def curve(results, text, axis="y", first="bottom"):
    rows, _ = results(text)
    return rows["strain"], rows[f"{first}_force_{axis}"], rows["max_plastic_strain"]


@pytest.mark.parametrize("damping_frame", ["platens", "rest"])
def test_both_platens_at_half_the_rate_do_what_one_does(results, damping_frame):
    # The same motion seen from a frame that moves: round-off apart, where the damping does too.
    # Against rest the damping drags differently: C v H / 2 = 2.5 kPa at the platens.
    one = changed(SPECIMEN, damping_frame=f"'{damping_frame}'")
    two = one.replace("side = 'bottom'", "side = 'bottom', velocity = 0.0, 0.005").replace(
        "0.0, -0.01", "0.0, -0.005"
    )
    assert two != one
    strain, force, plastic = curve(results, one)
    found = curve(results, two)
    assert found[0] == pytest.approx(strain, abs=1e-12)
    tolerance = 1e-6 if damping_frame == "platens" else 0.05
    assert found[1] == pytest.approx(force, abs=tolerance * force.max())
    if damping_frame == "platens":
        assert found[2] == pytest.approx(plastic, abs=1e-6 * plastic.max())


def specimen(fixed, moving):
    """Return the specimen with its rough platen at one side and its smooth one opposite."""
    upright = fixed in ("bottom", "top")
    rate = "0.01" if moving in ("bottom", "left") else "-0.01"
    centre = {"bottom": "0.0, 0.3", "top": "0.0, 0.7", "left": "0.3, 0.0", "right": "0.7, 0.0"}
    x, y = centre[fixed].split(", ")
    text = changed(SPECIMEN, velocity=f"0.0, {rate}" if upright else f"{rate}, 0.0", x=x, y=y)
    if not upright:
        text = changed(text, x_max="1.0", y_max="0.5")
    text = text.replace("name = 'bottom', side = 'bottom'", f"name = 'fixed', side = '{fixed}'")
    text = text.replace("name = 'top', side = 'top'", f"name = 'moving', side = '{moving}'")
    # the rule spectral finds another step in the fourth digit
    return text.replace("final_strain", "time_step_rule = 'fixed', time_step = 1e-3, final_strain")


@pytest.mark.parametrize(
    ("fixed", "moving"), [("left", "right"), ("right", "left"), ("top", "bottom")]
)
def test_platens_on_any_sides_do_the_same(results, fixed, moving):
    strain, force, plastic = curve(results, specimen("bottom", "top"), "y", "fixed")
    axis = "y" if fixed == "top" else "x"
    found = curve(results, specimen(fixed, moving), axis, "fixed")
    assert found[0] == pytest.approx(strain, abs=1e-12)
    # sums in another order; the imperfection decides where bands form
    assert abs(found[1]) == pytest.approx(abs(force), abs=1e-6 * abs(force).max())
    assert found[2] == pytest.approx(plastic, abs=1e-6 * plastic.max())


# ------------------------------------------------------------------------------ restart

PLASTIC = changed(
    without_group(SPECIMEN, "imperfection"), spacing="0.05", horizon="0.16", damping_frame="'rest'"
)
PLASTIC = PLASTIC.replace("final_strain = 0.01", "end_time = 0.8").replace(
    "frame_strains = 0.004, 0.01", "frame_count = 5"
)
PLASTIC = PLASTIC.replace("history_count = 100", "history_count = 400")
UNDER_LOADS = PLASTIC.replace("velocity = 0.0, -0.01", "traction = 0.0, -170.0e3, ramp_time = 0.7")
UNDER_LOADS += "&pressure name = 'cell', side = 'left', value = 5.0e3, ramp_time = 0.5 /\n"


@pytest.fixture(scope="module")
def straight(run_case, tmp_path_factory):
    """Results of a run under loads that was left alone."""
    folder = tmp_path_factory.mktemp("straight")
    done = run_case(UNDER_LOADS, folder, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert history(folder / "out" / "case_history.csv")["max_plastic_strain"][-1] > 1e-4
    return folder / "out"


def stopped(program, folder, text, rows):
    """Run until the history has some rows, and stop by a signal."""
    (folder / "run.nml").write_text(uncontrolled(text))
    process = subprocess.Popen(
        [program, "--quiet", "--threads", "1", "run.nml"],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    path = folder / "out" / "case_history.csv"
    while process.poll() is None:
        if path.exists() and path.read_bytes().count(b"\n") > rows:
            process.send_signal(signal.SIGTERM)
            break
        time.sleep(0.001)
    assert process.wait(timeout=300) == 143


def assert_same(folder, straight):
    assert (folder / "case_history.csv").read_bytes() == (
        straight / "case_history.csv"
    ).read_bytes()
    with (
        h5py.File(folder / "case.h5", locking=False) as one,
        h5py.File(straight / "case.h5", locking=False) as other,
    ):
        same_points_and_frames(one, other)


@pytest.mark.parametrize("rows", [30, 180])
def test_a_run_under_loads_goes_on_as_if_it_were_not_stopped(
    program, run_case, tmp_path, straight, rows
):
    stopped(program, tmp_path, UNDER_LOADS, rows)
    done = run_case(UNDER_LOADS, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight)


def test_a_restart_with_other_loads_is_refused_by_name(program, run_case, tmp_path):
    stopped(program, tmp_path, UNDER_LOADS, 30)
    for old, new, key in (
        ("-170.0e3", "-171.0e3", "boundary(top).traction"),
        ("ramp_time = 0.7", "ramp_time = 0.6", "boundary(top).ramp_time"),
        ("value = 5.0e3", "value = 4.0e3", "pressure(cell).value"),
        ("ramp_time = 0.5", "ramp_time = 0.6", "pressure(cell).ramp_time"),
        ("side = 'left'", "side = 'right'", "pressure(cell).side"),
        ("value = 5.0e3", "value = 5.0e3, span = 0.0, 0.5", "pressure(cell).span"),
    ):
        assert old in UNDER_LOADS
        done = run_case(UNDER_LOADS.replace(old, new), tmp_path, "--restart")
        assert done.returncode == 2, done.stdout
        assert f"{key}: differs from the run that is to go on" in done.stderr
    without = UNDER_LOADS[: UNDER_LOADS.index("&pressure")]
    done = run_case(without, tmp_path, "--restart")
    assert done.returncode == 2, done.stdout
    assert "pressure(cell).value: differs from the run that is to go on" in done.stderr


def test_loads_have_the_same_bits_on_any_number_of_threads(run_case, tmp_path, straight):
    for threads in (2, 3):
        options = ("--quiet", "--threads", threads, "--output", f"out{threads}")
        done = run_case(UNDER_LOADS, tmp_path, *options, OMP_WAIT_POLICY="passive")
        assert done.returncode == 0, done.stderr
        assert_same(tmp_path / f"out{threads}", straight)


def test_both_forms_of_the_operators_carry_the_same_loads(results):
    text = changed(BODY + "&body x_min = 1.0, x_max = 1.4, y_min = 0.0, y_max = 1.0 /\n")
    text = text.replace("damping", "time_step_rule = 'fixed', time_step = 5.0e-4, damping")
    text += BOTTOM + under(f"0.0, -{P}") + pressed("left", "right")
    found = [
        results(text.replace("&run ", f"&run operators = '{form}', "))[0]
        for form in ("lattice", "list")
    ]
    for column in ("mean_stress_xx", "mean_stress_yy", "external_work", "strain"):
        scale = np.abs(found[0][column]).max()
        assert found[1][column] == pytest.approx(found[0][column], abs=1e-9 * scale), column


# ------------------------------------------------------------------------------ --check


def test_the_check_shows_the_loads(run_case, tmp_path):
    done = run_case(
        BODY
        + BOTTOM
        + under("0.0, -1.0e5")
        + pressed("left", keys="value = 5.0e4, span = 0.5, 1.0"),
        tmp_path,
        "--check",
    )
    assert done.returncode == 0, done.stderr
    lines = " ".join(done.stdout.split())
    assert "traction 0, -100000 Pa on top: 0, -100000 N/m in all, whole from 0.3 s" in lines
    assert "pressure left: 50000 Pa on left, 0.5 m of the body, " in lines
    assert "points: 25000 N/m in all " in lines


def test_a_pressure_on_no_point_is_a_model_error(run_case, tmp_path):
    text = BODY + "&body x_min = 1.0, x_max = 1.4, y_min = 0.0, y_max = 1.0 /\n"
    text += pressed("right", keys="value = 1.0, span = 1.5, 1.8")
    done = run_case(text, tmp_path)
    assert done.returncode == 3
    assert "a pressure acts on no point" in done.stderr
    assert "&pressure name = right" in done.stderr


def test_a_row_in_every_step_finds_nothing_wrong_with_a_ramp(run_case, tmp_path):
    """In the first step loads give half a kick without any work: no energy from nowhere."""
    body = changed(BODY, end_time="0.02", history_count="1000")
    text = body + BOTTOM + pressed("top", keys="value = 1.0e4, ramp_time = 0.1")
    done = run_case(text, tmp_path, "--quiet", "--force", "--threads", "1")
    assert done.returncode == 0, done.stderr
    errors = np.abs(history(tmp_path / "out" / "case_history.csv")["energy_error"])
    assert len(errors) < 1000
    assert errors.max() <= 1.0
    assert errors[-1] < 1e-3


@pytest.mark.parametrize(("contact", "length"), [("smooth", 1.25), ("rough", 1.0)])
def test_only_walls_that_slide_lengthen_the_side_under_a_traction(
    run_case, tmp_path, contact, length
):
    """A smooth wall of two points, the outer one whole, continues the body; a rough one not."""
    text = BODY + BOTTOM + under("0.0, -1.0e3")
    text += f"&boundary name = 'wall', side = 'left', contact = '{contact}' /\n"
    done = run_case(text, tmp_path, "--check")
    assert done.returncode == 0, done.stderr
    assert f"-1000 Pa on top: 0, -{1000 * length:g} N/m in all" in done.stdout


def test_a_sudden_load_that_is_too_large_fails_as_any_run(run_case, tmp_path):
    text = changed(BODY, damping="0.0") + BOTTOM + under("0.0, -1.0e9", "contact = 'smooth'")
    done = run_case(text, tmp_path, "--quiet")
    assert done.returncode == 4
    assert "the calculation failed" in done.stderr
