"""Stages of construction and the factor of safety: what stays, what goes, bits, and refusals."""

import re
import signal

import h5py
import numpy as np
import pytest
from case_files import begin, changed, history, stop
from test_restart import assert_same

# Two blocks side by side under a pressure; the right one is dug away.
BLOCKS = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.05, horizon = 0.15, layout = 'cells' /
&body name = 'left', x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&body name = 'right', x_min = 1.0, x_max = 2.0, y_min = 0.0, y_max = 2.0 /
&material name = 'clay', model = 'j2', density = 2000.0, youngs_modulus = 50.0e6
  poissons_ratio = 0.3, yield_stress = 1.0e5 /
&material name = 'soft', model = 'j2', density = 2000.0, youngs_modulus = 50.0e6
  poissons_ratio = 0.3, yield_stress = 2.0e4 /
&boundary name = 'base', side = 'bottom', contact = 'smooth' /
&boundary name = 'cap', side = 'top', contact = 'smooth', velocity = 0.0, -0.001 /
&stage name = 'press', end_time = 1.0 /
&stage name = 'dig', end_time = 2.0, excavate = 'right' /
&integration method = 'equilibrium', increments = 5, residual = 1.0e-6 /
&stabilisation method = 'relaxing' /
&output frame_count = 4 /
"""
PRESS, DIG = "end_time = 1.0", "excavate = 'right'"
BAR = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body name = 'bar', x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 1.0e5, strain_measure = 'small' /
&boundary name = 'base', side = 'bottom', contact = 'smooth' /
&boundary name = 'cap', side = 'top', contact = 'smooth', traction = 0.0, -5.0e4, ramp_time = 1.0 /
&strength_reduction first = 1.0, last = 4.0, tolerance = 0.01 /
&integration method = 'equilibrium', increments = 5, end_time = 1.0 /
&stabilisation method = 'relaxing' /
&output frame_count = 2 /
"""


@pytest.fixture
def run(run_case, tmp_path):
    """Return a function that runs a case and returns its history and last frame."""

    def run(text, *options):
        done = run_case(text, tmp_path, "--force", "--threads", "1", *options)
        assert done.returncode == 0, done.stderr
        with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
            frames = [file["frames"][k] for k in sorted(file["frames"])]
            last = {name: data[()] for name, data in frames[-1].items()}
            last["position"] = file["points/position"][()]
            last["boundary"] = file["points/boundary"][()]
        return history(tmp_path / "out" / "case_history.csv"), last, done.stdout

    return run


def test_what_is_dug_away_leaves_the_rest_as_if_it_had_never_been_there(run):
    staged, last, _ = run(BLOCKS)
    there = last["active"] == 1.0
    assert there.sum() == 20 * 46
    assert (last["position"][there, 0] < 1.0).all()
    assert not last["stress"][~there].any()
    # a surface is softer than the inside, but what is dug free had its load before
    direct, only, _ = run(BLOCKS.replace(DIG, "").replace(PRESS, f"{PRESS}, {DIG}"))
    assert staged["base_force_y"][-1] == pytest.approx(direct["base_force_y"][-1], rel=3e-2)
    assert (last["position"][there] == only["position"]).all()
    inside = (np.abs(only["position"] - [0.5, 1.0]) < [0.3, 0.5]).all(axis=1)
    gap = (last["stress"][there] - only["stress"])[inside]
    assert np.abs(gap).max() < 4e-2 * np.abs(only["stress"]).max()


def test_the_balance_of_energy_holds_through_the_stages(run):
    rows, _, _ = run(BLOCKS)
    assert rows["time"][-1] == pytest.approx(2.0)
    # the first guess of an increment moves the layers alone, and their strain is not small
    assert np.abs(rows["energy_error"]).max() < 1e-2
    assert np.abs(rows["energy_error"][-1]) < 2e-4
    assert rows["unbalanced_force"][1:].max() <= 1e-6


def test_a_boundary_moves_from_its_first_stage_on(run):
    text = BLOCKS.replace(PRESS, f"{PRESS}, boundaries = 'base'")
    text = text.replace(DIG, "boundaries = 'base cap', excavate = 'right'")
    rows, last, _ = run(text)
    cap = last["boundary"] == 2
    there = cap & (last["active"] == 1.0)
    assert last["displacement"][there, 1] == pytest.approx(-0.001)
    half = rows["time"] <= 1.0
    assert not rows["cap_force_y"][half].any()
    assert rows["cap_force_y"][-1] == pytest.approx(-50e6 / 0.91 * 0.001 / 2.0, rel=0.1)


def test_a_stage_can_change_the_material_of_a_body(run):
    text = BLOCKS.replace(DIG, "materials = 'right=soft'")
    _, last, _ = run(text)
    right = (last["position"][:, 0] > 1.0) & (last["boundary"] == 0)
    left = (last["position"][:, 0] < 1.0) & (last["boundary"] == 0)
    assert last["plastic_strain"][right].min() > 0.0
    assert not last["plastic_strain"][left & (last["position"][:, 0] < 0.6)].any()
    assert last["von_mises"][right].max() < 2.002e4


def test_new_soil_is_placed_without_stress(run):
    """Beside a block that has been squeezed before, and stays so."""
    text = changed(BLOCKS.replace(DIG, "fill = 'right'"), velocity=None)
    text = text.replace(
        "side = 'top'",
        "side = 'top', span = 0.0, 1.0, times = 0.9, 1.0, velocities_y = -0.001, 0.0",
    )
    text = text.replace("side = 'bottom', contact = 'smooth'", "side = 'bottom'")
    _, last, _ = run(text)
    right = (last["position"][:, 0] > 1.0) & (last["boundary"] == 0)
    left = (last["position"][:, 0] < 1.0) & (last["boundary"] == 0)
    assert np.median(last["stress"][left, 1]) < -2.0e4
    assert (
        np.abs(last["displacement"][left, 1]).max()
        > 10.0 * np.abs(last["displacement"][right, 1]).mean()
    )
    assert np.abs(last["stress"][right]).mean() < 1.0e3
    assert np.abs(last["stress"][right]).max() < 2.0e4


@pytest.mark.parametrize("rows", [30, 140])
def test_a_restart_in_any_stage_gives_the_same_bits(program, run_case, tmp_path, rows):
    text = changed(BLOCKS, increments="100", residual="1.0e-8")
    straight = tmp_path / "straight"
    straight.mkdir()
    done = run_case(text, straight, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    process = begin(program, tmp_path, text)
    assert stop(process, signal.SIGTERM, tmp_path, rows) == 143
    done = run_case(text, tmp_path, "--restart", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight / "out")


def step_of(path):
    """The step of a checkpoint; -1 where there is none, or it is being written."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            return int(file.attrs["step"])
    except (OSError, KeyError):
        return -1


def test_a_run_killed_just_before_a_stage_begins_gives_the_same_bits(program, run_case, tmp_path):
    """Its checkpoint is of the last step of a stage: the next one begins with the restart."""
    text = changed(BLOCKS, spacing="0.2", horizon="0.6", increments="10", residual="1.0e-5")
    text = text.replace("frame_count", "checkpoint_every = 1.0e-9, frame_count")
    straight = tmp_path / "straight"
    straight.mkdir()
    done = run_case(text, straight, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    newest = tmp_path / "out" / "case_checkpoint.h5"
    for _ in range(50):  # until it is killed within the step that follows
        process = begin(program, tmp_path, text, "--force")
        while process.poll() is None and step_of(newest) != 10:
            pass
        process.kill()
        process.wait()
        if step_of(newest) == 10:
            break
    assert step_of(newest) == 10
    done = run_case(text, tmp_path, "--restart", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight / "out")


def test_the_factor_of_safety_of_a_bar_is_that_of_its_strength(run, tmp_path):
    _, _, log = run(BAR)
    borne, not_borne = map(float, re.search(r"safety: (\S+) is borne, (\S+) is not", log).groups())
    exact = 2.0e5 / np.sqrt(3.0) / 5.0e4
    assert not_borne - borne <= 0.01
    assert 0.5 * (borne + not_borne) == pytest.approx(exact, rel=8e-3)
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        group = file["strength_reduction"]
        assert group.attrs["borne"] == pytest.approx(borne, rel=1e-4)
        held = group["held"][()] == 1.0
        assert (group["factor"][()][held] <= group.attrs["borne"]).all()
        assert (group["factor"][()][~held] >= group.attrs["not_borne"]).all()
        assert group["displacement"].attrs["unit"] == b"m"
        frames = sorted(file["frames"])
        assert len(frames) == 5
        moved = [np.abs(file["frames"][k]["displacement"][()]).max() for k in frames[-2:]]
        assert moved[1] > 5.0 * moved[0]


def test_a_first_factor_that_is_not_borne_is_a_failure(run_case, tmp_path):
    done = run_case(changed(BAR, first="3.0"), tmp_path, "--quiet", "--force")
    assert done.returncode == 4
    assert "does not bear the first factor" in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "status", "message"),
    [
        (DIG, "excavate = 'middle'", 2, "there is no body of this name"),
        (DIG, "pressures = 'p'", 2, "there is no pressure of this name"),
        (DIG, "boundaries = 'wall'", 2, "there is no boundary of this name"),
        (DIG, "materials = 'left'", 2, "a body without a material"),
        (DIG, "materials = 'left=rock'", 2, "there is no material of this name"),
        ("end_time = 2.0", "end_time = 0.5", 2, "a stage ends before the one before it"),
        ("name = 'dig'", "name = 'press'", 2, "two stages have the same name"),
        (DIG, "excavate = 'left right'", 3, "a stage has no body"),
        (
            DIG,
            "fill = 'left' /\n&stage name = 'again', end_time = 3.0, fill = 'left'",
            2,
            "the body is there already",
        ),
        (PRESS, f"{PRESS}, {DIG}", 2, "the body is not there"),
        (
            "method = 'equilibrium', increments = 5, residual = 1.0e-6",
            "damping = 1.0",
            2,
            "stages go from equilibrium to equilibrium",
        ),
        ("increments = 5", "increments = 5, end_time = soon", 2, "text where a number is due"),
        (
            "increments = 5",
            "increments = 5, end_time = 3.0",
            2,
            "the end of the run is not that of the last stage",
        ),
    ],
)
def test_what_stages_cannot_be_is_refused(run_case, tmp_path, old, new, status, message):
    assert old in BLOCKS
    done = run_case(BLOCKS.replace(old, new), tmp_path, "--check")
    assert done.returncode == status, done.stderr
    assert message in done.stderr


GROUND = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body name = 'ground', x_min = 0.0, x_max = 2.0, y_min = 0.0, y_max = 1.0 /
&body name = 'bank', x_min = 0.0, x_max = 2.0, y_min = 1.0, y_max = 1.5 /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&boundary name = 'right', side = 'right', contact = 'smooth' /
&gravity acceleration = 0.0, -10.0 /
&initial_stress surface_y = 1.0, unit_weight = 20.0e3, k0 = 0.5 /
&stage name = 'rest', end_time = 1.0 /
&stage name = 'fill', end_time = 2.0, fill = 'bank' /
&stage name = 'dig', end_time = 3.0, excavate = 'bank' /
&integration method = 'equilibrium', increments = 5, residual = 1.0e-6 /
&stabilisation method = 'relaxing' /
&output frame_count = 3 /
"""


def test_fill_brings_its_weight_and_takes_it_away_again(run):
    rows, last, _ = run(GROUND)
    at = {k: rows["base_force_y"][np.abs(rows["time"] - k).argmin()] for k in (1.0, 2.0, 3.0)}
    assert np.abs(rows["base_displacement_y"]).max() == 0.0
    # the fill, and the layers beside it that slide
    assert at[2.0] - at[1.0] == pytest.approx(20.0e3 * 0.5 * 2.6, rel=0.1)
    assert at[3.0] == pytest.approx(at[1.0], rel=1e-3)
    there = (last["boundary"] == 0) & (last["active"] == 1.0)
    # near the surface families change twice; what they leave is small against 0.15 mm of the fill
    assert np.abs(last["displacement"][there]).max() < 2e-5
    deep = there & (np.abs(last["position"] - [1.0, 0.3]) < [0.5, 0.2]).all(axis=1)
    depth = 1.0 - last["position"][deep, 1]
    assert last["stress"][deep, 1] == pytest.approx(-20.0e3 * depth, rel=5e-2)


def test_digging_in_ground_under_its_stress_lets_it_rise(run):
    text = GROUND.replace("fill = 'bank'", "excavate = 'bank'")
    text = text.replace("&stage name = 'dig', end_time = 3.0, excavate = 'bank' /\n", "")
    rows, last, _ = run(text.replace("surface_y = 1.0", "surface_y = 1.5"))
    there = (last["boundary"] == 0) & (last["active"] == 1.0)
    deep = there & (np.abs(last["position"] - [1.0, 0.3]) < [0.5, 0.2]).all(axis=1)
    depth = 1.0 - last["position"][deep, 1]
    assert last["stress"][deep, 1] == pytest.approx(-20.0e3 * depth, rel=5e-2)
    modulus = 50.0e6 * 0.7 / (1.3 * 0.4)  # constrained
    top = there & (last["position"][:, 1] > 0.9)
    rise = last["displacement"][top, 1].mean()
    assert rise == pytest.approx(10.0e3 * 0.95 / modulus, rel=0.15)
    assert np.abs(rows["energy_error"]).max() < 1e-2


def test_a_collapse_tells_how_far_its_stage_has_come(run):
    """A pit of half a metre in clay that bears a third of it."""
    text = GROUND.replace("model = 'elastic'", "model = 'j2', yield_stress = 3.0e3")
    text = text.replace("k0 = 0.5", "k0 = 1.0").replace("surface_y = 1.0", "surface_y = 1.5")
    text = text.replace("'bank', x_min = 0.0, x_max = 2.0", "'bank', x_min = 0.0, x_max = 1.0")
    pit = "&body name = 'pit', x_min = 1.0, x_max = 2.0, y_min = 1.0, y_max = 1.5 /\n"
    text = text.replace("&material", pit + "&material").replace("fill = 'bank'", "excavate = 'pit'")
    text = text.replace("&stage name = 'dig', end_time = 3.0, excavate = 'bank' /\n", "")
    rows, _, log = run(text + "&strength_reduction first = 1.0, last = 2.0 /\n")
    part = re.search(r"limit load: .* (\S+) % of the way through stage 'fill'", log)
    assert part
    assert float(part[1]) == pytest.approx(100.0 * (rows["time"][-1] - 1.0), abs=0.1)
    assert "no factor of safety" in log


def test_a_stage_that_changes_no_point_is_refused(run_case, tmp_path):
    inner = "&body name = 'inner', x_min = 0.5, x_max = 1.0, y_min = 0.0, y_max = 0.5 /\n"
    text = GROUND.replace("&material", inner + "&material").replace(
        "fill = 'bank'", "excavate = 'inner'"
    )
    text = text.replace("&stage name = 'dig', end_time = 3.0, excavate = 'bank' /\n", "")
    done = run_case(text.replace("surface_y = 1.0", "surface_y = 1.5"), tmp_path, "--check")
    assert done.returncode == 3, done.stderr
    assert "changes no point" in done.stderr
