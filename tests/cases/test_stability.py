"""The default time step never lets a run diverge, whatever the body; a longer one does."""

import itertools
import math

import numpy as np
import pytest
from case_files import SPECIMEN, history

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


def test_a_row_with_a_wrong_energy_is_doubted_and_then_not_called_good(run_case, tmp_path):
    done = run_case(SQUEEZED, tmp_path, "--quiet")
    assert done.returncode == 4
    assert "the calculation failed: the energy balance is off by" in done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert log.count("warning: the energy balance is off by") == 1
    error = history(tmp_path / "out" / "case_history.csv")["energy_error"]
    assert np.abs(error).max() <= 0.1
    assert (np.abs(error[:-2]) < 0.01).all()


@pytest.mark.parametrize(("factor", "warned"), [("1.0", True), ("0.001", False)])
def test_a_control_that_carries_load_is_doubted(run_case, tmp_path, factor, warned):
    control = f"&stabilisation method = 'silling', factor = {factor} /\n"
    assert run_case(SPECIMEN + control, tmp_path, "--quiet").returncode == 0
    log = (tmp_path / "out" / "case.log").read_text()
    assert log.count("warning: the control of zero-energy modes has") == warned
