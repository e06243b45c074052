"""The default time step never lets a run diverge, whatever the body; a longer one does."""

import itertools
import math
import re

import h5py
import numpy as np
import pytest
from case_files import SHEET, SPECIMEN, changed, history

SPACING, DENSITY, YOUNGS = 0.1, 2000.0, 50.0e6
STEPS = 300  # about

# 10 x 12 points, pushed suddenly at one end, without damping: all frequencies are in the motion,
# and nothing takes energy out of it. The rule of the time step is left to its default.
PUSHED = """\
&run name = 'case', output_dir = 'out', operators = '{form}' /
&discretisation spacing = 0.1, horizon = {horizon}, layout = '{layout}', volumes = '{volumes}'
  influence = '{influence}' /
&body x_min = 0.0, x_max = {width}, y_min = 0.0, y_max = {height} /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = {nu} /
&boundary name = 'low', side = 'bottom' /
&boundary name = 'high', side = 'top', velocity = {velocity}, -{velocity} /
&integration end_time = {end} {step} /
&output frame_count = 1, history_count = 100 /
"""
CONTROLS = (0.0, 0.01, 1.0, "relaxing")
# One ring of neighbours: a cone has no weight there, and nothing is left beside an affine field.
IMPOSSIBLE = ((1, "conical"), (1, "relaxing"))
INFLUENCES = ("gaussian", "constant", "conical")
RATIOS = (0.0, 0.3, 0.49)
LAYOUTS = ("nodes", "cells")
VOLUMES = ("uniform", "tributary")
FORMS = ("lattice", "list")


def wave_speed(nu):
    """Return the speed of compression waves."""
    return math.sqrt(YOUNGS * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * DENSITY))


def pushed(m, influence, control, nu, layout, volumes, form="lattice", step=None):
    """Return the input of a run of some hundreds of steps, by the default rule or a fixed step."""
    c_p = wave_speed(nu)
    extra = 1 if layout == "nodes" else 0
    text = PUSHED.format(
        form=form,
        horizon=repr(m * SPACING),
        layout=layout,
        volumes=volumes,
        influence=influence,
        width=repr(round((10 - extra) * SPACING, 6)),
        height=repr(round((12 - extra) * SPACING, 6)),
        nu=nu,
        velocity=repr(1e-6 * c_p),
        end=repr(STEPS * (step or 0.8 * m * SPACING / c_p)),
        step=f", time_step_rule = 'fixed', time_step = {step!r}" if step else "",
    )
    if control == "relaxing":
        text += "&stabilisation method = 'relaxing' /\n"
    elif control:
        text += f"&stabilisation method = 'silling', factor = {control} /\n"
    return text


def grid():
    """Return every m with every influence function and control; the rest takes turns."""
    rest = list(itertools.product(RATIOS, LAYOUTS, VOLUMES, FORMS))
    cases = []
    for m, influence, control in itertools.product(range(1, 9), INFLUENCES, CONTROLS):
        if (m, influence) in IMPOSSIBLE or (m, control) in IMPOSSIBLE:
            continue
        turn = 7 * len(cases) + len(cases) // len(CONTROLS)
        cases.append((m, influence, control, *rest[turn % len(rest)]))
    return cases


def test_the_grid_holds_every_pair_of_values():
    columns = list(zip(*grid()))
    for one, other in itertools.combinations(range(len(columns)), 2):
        pairs = set(zip(columns[one], columns[other]))
        expected = set(itertools.product(set(columns[one]), set(columns[other])))
        assert pairs >= expected - set(IMPOSSIBLE), (one, other)


@pytest.mark.parametrize("case", grid(), ids=lambda case: "-".join(map(str, case)))
def test_no_run_diverges_with_the_default_time_step(run_case, tmp_path, case):
    done = run_case(pushed(*case), tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    rows = history(tmp_path / "out" / "case_history.csv")
    assert rows["step"][-1] > 100
    # a sudden start leaves an error in the first rows, when there is hardly any work
    error = np.abs(rows["energy_error"])
    assert error.max() < 0.2
    assert error[20:].max() < 0.02
    assert error[-1] < 2e-3


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("m", [1, 2, 4, 8])
def test_a_step_one_tenth_beyond_the_limit_diverges(run_case, tmp_path, m, control):
    if (m, control) in IMPOSSIBLE:
        pytest.skip("no such control")
    case = (m, "gaussian", control, 0.3, "nodes", "uniform")
    checked = run_case(pushed(*case), tmp_path, "--check")
    assert checked.returncode == 0, checked.stderr
    limit = float(checked.stdout.split("2/omega_max = ")[1].split()[0])
    for factor, status in ((0.99, 0), (1.1, 4)):
        text = pushed(*case, step=factor * limit)
        done = run_case(text, tmp_path, "--force", "--quiet", "--threads", "1")
        assert done.returncode == status, (factor, done.stderr)


# An elastic specimen squeezed fast: points come closer, and frequencies rise with the strain.
SQUEEZED = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'elastic', strain_measure = 'green_lagrange', density = 2000.0
  youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.1 /
&integration final_strain = 0.3, safety = 0.99, damping = 5.0e5, damping_frame = 'platens' /
&output history_count = 500 /
"""


def fixed_step(text, step):
    """Return an input whose rule is to take this time step."""
    return re.sub(r"safety = [\d.]+", f"time_step_rule = 'fixed', time_step = {step!r}", text)


def stable_step(run_case, folder, text):
    """Return 2 / omega_max of the unloaded body."""
    checked = run_case(text, folder, "--check")
    assert checked.returncode == 0, checked.stderr
    return float(checked.stdout.split("2/omega_max = ")[1].split()[0])


def test_a_row_with_a_wrong_energy_is_doubted_and_then_not_called_good(run_case, tmp_path):
    text = fixed_step(SQUEEZED, 0.99 * stable_step(run_case, tmp_path, SQUEEZED))
    done = run_case(text, tmp_path, "--quiet")
    assert done.returncode == 4
    assert "the calculation failed: the energy balance is off by" in done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert log.count("warning: the energy balance is off by") == 1
    assert log.count("warning: the time step is too long for the deformed body at step") == 1
    assert log.index("too long for the deformed body") < log.index("the calculation failed")
    error = history(tmp_path / "out" / "case_history.csv")["energy_error"]
    assert np.abs(error).max() <= 0.1
    assert (np.abs(error[:-2]) < 0.01).all()


STIFFENING = (("green_lagrange", 0.1), ("logarithmic", -0.1))
SHORTENED = "time step shortened to "


@pytest.mark.parametrize(("measure", "rate"), STIFFENING)
def test_the_time_step_becomes_shorter_as_the_body_stiffens(run_case, tmp_path, measure, rate):
    text = SHEET.format(measure=measure, rate=rate)
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    rows = history(tmp_path / "out" / "case_history.csv")
    steps = rows["time_step"]
    assert log.count(SHORTENED) == len(set(steps)) - 1 >= 3
    assert (np.diff(steps) <= 0).all()
    # rows stand at the first step past their times, up to the end
    assert len(steps) == 301
    wanted = 3.0 * np.arange(301) / 300
    late = rows["time"] - wanted
    assert (late > -1e-9).all()
    assert (late[1:] < steps[1:] * (1 + 1e-9)).all()
    assert np.abs(rows["energy_error"][20:]).max() < 1e-3
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 1
        assert file.attrs["steps"] == rows["step"][-1]
        assert file.attrs["time_step"] == steps[-1]
        assert file["frames/000002"].attrs["time"] == rows["time"][-1]
    # the same stress as with a step that is short enough from the start
    text_short = text.replace("safety = 0.9", "safety = 0.4")
    assert run_case(text_short, tmp_path, "--quiet", "--force", "--threads", "1").returncode == 0
    short = history(tmp_path / "out" / "case_history.csv")
    assert len(set(short["time_step"])) == 1
    expected = np.interp(rows["time"], short["time"], short["mean_stress_xx"])
    assert rows["mean_stress_xx"][100:] == pytest.approx(expected[100:], rel=2e-3)
    # the step with which it began is too long for that
    fixed = fixed_step(text, float(steps[0]))
    assert run_case(fixed, tmp_path, "--quiet", "--force", "--threads", "1").returncode == 4


@pytest.mark.parametrize(("measure", "rate"), STIFFENING)
def test_output_and_threads_do_not_touch_the_shortened_step(run_case, tmp_path, measure, rate):
    text = SHEET.format(measure=measure, rate=rate)
    ends = []
    for threads, rows in ((1, 300), (2, 300), (1, 7)):
        asked = text.replace("history_count = 300", f"history_count = {rows}")
        options = ("--quiet", "--force", "--threads", threads)
        assert run_case(asked, tmp_path, *options).returncode == 0
        ends.append((tmp_path / "out" / "case_history.csv").read_text().splitlines()[-1])
    assert ends[0] == ends[1] == ends[2]


def test_the_forms_of_the_operators_shorten_the_step_alike(run_case, tmp_path):
    text = SHEET.format(measure="green_lagrange", rate=0.1)
    ends = []
    for form in ("lattice", "list"):
        asked = text.replace("output_dir", f"operators = '{form}', output_dir")
        assert run_case(asked, tmp_path, "--quiet", "--force").returncode == 0
        ends.append(history(tmp_path / "out" / "case_history.csv"))
    assert ends[0]["time_step"] == pytest.approx(ends[1]["time_step"], rel=1e-6)
    assert ends[0]["round_force_x"][-1] == pytest.approx(ends[1]["round_force_x"][-1], abs=1.0)


def test_a_safety_close_to_one_lasts_as_well(run_case, tmp_path):
    forces = []
    for safety in ("0.99", "0.5"):
        text = SQUEEZED.replace("0.99", safety)
        assert run_case(text, tmp_path, "--quiet", "--force").returncode == 0
        rows = history(tmp_path / "out" / "case_history.csv")
        assert np.abs(rows["energy_error"][20:]).max() < 2e-3
        forces.append(np.interp(0.2999, rows["strain"], rows["top_force_y"]))
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)


# The plastic specimen squeezed by a third and more.
CRUSHED = changed(SPECIMEN, final_strain="0.36", velocity="0.0, -0.05")
CRUSHED = CRUSHED.replace("frame_strains = 0.004, 0.01", "frame_count = 3")
CRUSHED = CRUSHED.replace("density", "strain_measure = '{measure}', density")
CRUSHED = CRUSHED.replace("&integration", "&integration safety = {safety},")


def crushed(run_case, folder, measure, safety):
    """Return exit status, message and history of the specimen."""
    text = CRUSHED.format(measure=measure, safety=safety)
    done = run_case(text, folder, "--quiet", "--force", "--threads", "1")
    return done.returncode, done.stderr, history(folder / "out" / "case_history.csv")


def test_a_specimen_may_be_squeezed_by_a_third(run_case, tmp_path):
    results = [crushed(run_case, tmp_path, "logarithmic", safety) for safety in (0.9, 0.5)]
    for status, message, rows in results:
        assert status == 0, message
        assert rows["strain"][-1] >= 0.36
        assert np.abs(rows["energy_error"][20:]).max() < 1e-3
        assert (rows["top_force_y"][1:] < 0).all()
    forces = [np.interp(0.3599, rows["strain"], rows["top_force_y"]) for _, _, rows in results]
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)


def test_a_specimen_that_collapses_ends_so_with_any_step(run_case, tmp_path):
    # With Green-Lagrange strain volume vanishes in the flow until det F is 0: that is the model.
    results = [crushed(run_case, tmp_path, "green_lagrange", safety) for safety in (0.9, 0.5)]
    for status, message, _ in results:
        assert status == 4
        assert "det F is not positive" in message
    ends = [rows["strain"][-1] for _, _, rows in results]
    assert ends[0] == pytest.approx(ends[1], abs=0.005)
    common = np.linspace(0.05, 0.3, 11)
    forces = [np.interp(common, rows["strain"], rows["top_force_y"]) for _, _, rows in results]
    assert forces[0] == pytest.approx(forces[1], rel=5e-3)


@pytest.mark.parametrize(("factor", "warned"), [("1.0", True), ("0.001", False)])
def test_a_control_that_carries_load_is_doubted(run_case, tmp_path, factor, warned):
    control = f"&stabilisation method = 'silling', factor = {factor} /\n"
    assert run_case(SPECIMEN + control, tmp_path, "--quiet").returncode == 0
    log = (tmp_path / "out" / "case.log").read_text()
    assert log.count("warning: the control of zero-energy modes has") == warned
