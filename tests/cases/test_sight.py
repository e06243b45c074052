"""Bonds cross neither air nor cuts."""

import re

import h5py
import numpy as np
import pytest
from case_files import changed, history, same_points_and_frames

# A bar between rough platens that are pulled apart, until waves have died out.
BAR = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3 /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'elastic', strain_measure = 'small', density = 2000.0
  youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', velocity = 0.0, 0.05 /
&integration end_time = 0.2, damping = 5.0e5 /
&output frame_count = 1, history_count = 1 /
"""
WHOLE = "y_min = 0.0, y_max = 2.0 /\n"
APART = BAR.replace(
    WHOLE,
    "y_min = 0.0, y_max = 0.9 /\n&body x_min = 0.0, x_max = 1.0, y_min = 1.1, y_max = 2.0 /\n",
)
BY_DISTANCE = {"horizon": "0.3, families = 'distance'"}
LISTED = {"name": "'case', operators = 'list'"}
ACROSS = "&cut x = -0.1, 1.1, y = {0}, {0} /\n"
STIFFNESS = 50.0e6 * 0.01 / 2.0  # E u / L [N/m], of a bar 1 m wide without Poisson's ratio


def force(run_case, folder, text):
    """Return the force at the lower platen, which rests, in the end."""
    done = run_case(text, folder, "--quiet", "--force")
    assert done.returncode == 0, done.stderr
    return -history(folder / "out" / "case_history.csv")["bottom_force_y"][-1]


def test_two_blocks_a_gap_apart_carry_no_force(run_case, tmp_path):
    whole = force(run_case, tmp_path, BAR)
    assert abs(force(run_case, tmp_path, APART)) < 1e-10 * whole
    assert abs(force(run_case, tmp_path, changed(APART, **LISTED))) < 1e-10 * whole
    # by distance alone the gap of two spacings is tied together by bonds of up to three
    tied = force(run_case, tmp_path, changed(APART, **BY_DISTANCE))
    assert tied > 0.5 * whole


@pytest.mark.parametrize("height", [0.95, 1.0, 1.0321], ids=["between", "through points", "any"])
def test_a_bar_that_is_cut_through_carries_no_force(run_case, tmp_path, height):
    whole = force(run_case, tmp_path, BAR)
    assert whole > STIFFNESS
    for form in ({}, LISTED):
        text = changed(BAR, **form) + ACROSS.format(height)
        assert abs(force(run_case, tmp_path, text)) < 1e-10 * whole


def test_a_slot_along_the_bar_carries_almost_all_and_one_across_it_less(run_case, tmp_path):
    whole = force(run_case, tmp_path, BAR)
    along = force(run_case, tmp_path, BAR + "&cut x = 0.55, 0.55, y = 0.5, 1.5 /\n")
    across = force(run_case, tmp_path, BAR + "&cut x = 0.25, 0.75, y = 1.05, 1.05 /\n")
    assert 0.95 * whole < along < whole
    assert 0.5 * whole < across < 0.9 * whole


# A slot of the body, one spacing wide, and a cut beside it; the time step is the same for all.
SLOTTED = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.6 /
&body x_min = 0.5, x_max = 0.6, y_min = 0.0, y_max = 0.8 /
&body x_min = 0.6, x_max = 1.1, y_min = 0.0, y_max = 1.6 /
&cut x = 0.0, 0.34, y = 0.4, 0.57 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, isotropic_modulus = 2.0e6 /
&boundary name = 'low', side = 'bottom' /
&boundary name = 'high', side = 'top', velocity = 0.01, 0.03 /
&integration end_time = 0.25, time_step_rule = 'fixed', time_step = 5.0e-4, damping = 2.0e4 /
&output frame_count = 3, history_count = 50 /
"""
CONTROLS = {
    "none": "&stabilisation method = 'none' /\n",
    "silling": "&stabilisation method = 'silling', factor = 0.05 /\n",
    "relaxing": "&stabilisation method = 'relaxing', relaxing_strain = 1.0e-2 /\n",
}


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("volumes", ["uniform", "tributary"])
def test_list_and_lattice_agree_on_a_body_with_a_slot(run_case, tmp_path, control, volumes):
    text = changed(SLOTTED, layout=f"'nodes', volumes = '{volumes}'") + CONTROLS[control]
    columns = []
    for form in ("list", "lattice"):
        folder = tmp_path / form
        folder.mkdir()
        done = run_case(changed(text, name=f"'case', operators = '{form}'"), folder, "--quiet")
        assert done.returncode == 0, done.stderr
        columns.append(history(folder / "out" / "case_history.csv"))
    one, other = columns
    assert one["max_plastic_strain"][-1] > 1e-3
    for name in one:
        if name in ("energy_error", "unbalanced_force"):
            continue  # differences of what nearly cancels
        scale = np.abs(one[name]).max()
        assert np.allclose(one[name], other[name], rtol=0, atol=1e-9 * scale), name


def test_threads_keep_the_bits_of_a_body_with_a_slot(run_case, tmp_path):
    text = SLOTTED + CONTROLS["relaxing"]
    for folder, options in (("one", ("--threads", 1)), ("three", ("--threads", 3))):
        done = run_case(text, tmp_path, "--quiet", "--output", folder, *options)
        assert done.returncode == 0, done.stderr
    one, three = (tmp_path / folder / "case_history.csv" for folder in ("one", "three"))
    assert one.read_bytes() == three.read_bytes()
    with (
        h5py.File(tmp_path / "one" / "case.h5", locking=False) as first,
        h5py.File(tmp_path / "three" / "case.h5", locking=False) as second,
    ):
        same_points_and_frames(first, second)


def test_the_summary_tells_how_many_bonds_are_missing(run_case, tmp_path):
    # spacing 0.1, bonds up to the diagonal: one pair sees past the corner of an L
    angle = """\
&run name = 'case' /
&discretisation spacing = 0.1, horizon = 0.15 /
&body x_min = 0.0, x_max = 0.4, y_min = 0.0, y_max = 0.2 /
&body x_min = 0.0, x_max = 0.2, y_min = 0.0, y_max = 0.4 /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&integration end_time = 0.1 /
"""
    shown = [
        run_case(text, tmp_path, "--check").stdout
        for text in (angle, changed(angle, horizon="0.15, families = 'distance'"))
    ]
    assert re.search(r"no bonds +2 that would cross air or a cut\n", shown[0])
    assert "no bonds" not in shown[1]


def cloud(folder):
    """Write a cloud of 11 x 21 points with layers that are called bottom and top."""
    random = np.random.default_rng(4)
    with open(folder / "cloud.txt", "w") as file:
        for j in range(-3, 24):
            for i in range(11):
                x, y = 0.1 * np.array([i, j]) + 0.02 * random.uniform(-1, 1, 2)
                name = "bottom" if j < 0 else "top" if j > 20 else ""
                file.write(f"{x:.5f} {y:.5f} 0.01 {name}\n")


CLOUD = (
    BAR.replace("&body", "&body shape = 'file', file = 'cloud.txt',")
    .replace(", side = 'bottom'", "")
    .replace(", side = 'top'", "")
)


def test_a_cloud_that_is_cut_through_carries_no_force(run_case, tmp_path):
    cloud(tmp_path)
    whole = force(run_case, tmp_path, CLOUD)
    assert whole > 0.9 * STIFFNESS
    assert abs(force(run_case, tmp_path, CLOUD + ACROSS.format(0.95))) < 1e-10 * whole


REFUSED = {
    "a cut beside the body": (
        BAR + "&cut x = 1.1, 1.5, y = 1.0, 1.0 /\n",
        3,
        "&cut 1: no bond crosses the cut; found: from (1.1, 1.0) to (1.5, 1.0); allowed: ",
    ),
    "a cut in a gap": (
        APART + ACROSS.format(1.0),
        3,
        "&cut 1: no bond crosses the cut; found: from (-0.1, 1.0) to (1.1, 1.0); allowed: ",
    ),
    "a cut that is a point": (
        BAR + "&cut x = 0.5, 0.5, y = 1.0, 1.0 /\n",
        2,
        "the cut has no length; found: both ends at (0.5, 1.0); allowed: two ends that differ",
    ),
    "a cut by distance": (
        changed(BAR, **BY_DISTANCE) + ACROSS.format(0.95),
        2,
        "a cut has no effect where families go by distance alone; found: families = 'distance'; "
        "allowed: families = 'line_of_sight'",
    ),
    "a cut without an end": (
        BAR + "&cut x = 0.5, y = 1.0, 1.0 /\n",
        2,
        "&cut x",
    ),
    "families of a cloud": (
        changed(CLOUD, horizon="0.3, families = 'line_of_sight'"),
        2,
        "the key has no effect on a point cloud without a &cut: nothing says where its air is; "
        "allowed: leave it out",
    ),
    "a point alone": (
        BAR.replace(", side = 'bottom'", ", side = 'left'")
        .replace("0.0, 0.05", "0.05, 0.0")
        .replace(", side = 'top'", ", side = 'right'")
        + "&cut x = 0.46, 0.54, y = 2.1, 1.85 /\n&cut x = 0.46, 0.56, y = 1.85, 1.85 /\n"
        + "&cut x = 0.56, 0.54, y = 1.8, 2.1 /\n",
        3,
        "point 349 at (0.5, 2) m: the shape tensor is singular: the family is too "
        "small or lies on one line; allowed: ",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_its_place(run_case, tmp_path, case):
    text, status, message = REFUSED[case]
    cloud(tmp_path)
    done = run_case(text, tmp_path, "--check")
    assert done.returncode == status, done.stdout + done.stderr
    assert message in done.stderr
