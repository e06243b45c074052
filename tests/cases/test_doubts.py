"""Every doubt: an input that raises it, a neighbour that does not, and where it is told."""

import math
import re
import signal
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from case_files import SHEET, SPECIMEN, begin, changed, stop, without_group

ROOT = Path(__file__).resolve().parents[2]
SHORT = changed(SPECIMEN, frame_strains=None).replace("history_count = 100", "frame_count = 1")
PUSHED = without_group(
    changed(SHORT, final_strain=None).replace("&integration ", "&integration end_time = 0.2, "),
    "imperfection",
)
PRESSED = "&pressure name = 'load', side = 'top', value = 1.0e3, ramp_time = 0.1 /\n"
HELD = re.sub(r"&boundary name = 'top'[^/]*/\n", "", PUSHED).replace(
    "damping = 5.0e5, damping_frame = 'platens'", "damping = 5.0e4"
)
CLOUD = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.2 /
&body shape = 'file', file = '{name}'{extents} /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', velocity = 0.0, -0.01 /
&integration end_time = 0.2, damping = 5.0e5 /
&stabilisation method = 'relaxing' /
"""
SQUEEZED = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'elastic', strain_measure = 'green_lagrange', density = 2000.0
  youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.1 /
&integration final_strain = 0.25, time_step_rule = 'fixed', time_step = 0.00114
  damping = 5.0e5, damping_frame = 'platens' /
&output history_count = 500, frame_count = 1 /
"""
SHEARED = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'round', side = 'all', contact = 'affine'
  velocity_gradient = 0.0, 0.02, 0.0, 0.0
  times = 0.0, 1.0, 1.001, 2.0, factors = 1.0, 1.0, -1.0, -1.0 /
&integration end_time = 2.0, damping = 5.0e4 /
&output history_count = 100, frame_count = 1 /
"""
RESTING = re.sub(r"&integration [^/]*/", "&integration {} /", without_group(SHORT, "imperfection"))
RESTING = changed(RESTING, x_max="0.2", y_max="0.2")
SQUARE = SHEET.format(measure="green_lagrange", rate="-0.02")
SQUARE = SQUARE.replace("'elastic'", "'j2'").replace(
    "poissons_ratio = 0.3 /",
    "poissons_ratio = 0.3\n  yield_stress = 0.15e6, isotropic_modulus = 5.0e6 /",
)
FIELD = "&random_field coefficient_of_variation = {}, correlation_length = {} /\n"
STILL = "method = 'equilibrium', final_strain = 0.002, increments = 1, residual = {}"
LATTICE = ", x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 1.0"

# doubt: an input with it, one without, both with --check
AT_START = {
    "few_points": (changed(PUSHED, y_max="0.4"), PUSHED),
    "horizon_ratio": (changed(PUSHED, horizon="0.19"), changed(PUSHED, horizon="0.2")),
    "wave_speed": (changed(PUSHED, density="2.0e9"), PUSHED),
    "density": (changed(PUSHED, density="2.0"), PUSHED),
    "yield_strain": (
        changed(PUSHED, yield_stress="150.0", residual_strength="15.0", kinematic_modulus="-1.5e3"),
        PUSHED,
    ),
    "perfect_plasticity": (
        changed(PUSHED, model="'j2', strain_measure = 'green_lagrange'", kinematic_modulus="0.0"),
        changed(PUSHED, model="'j2', strain_measure = 'green_lagrange'"),
    ),
    "variation": (PUSHED + FIELD.format(1.1, 0.3), PUSHED + FIELD.format(0.9, 0.3)),
    "field_resolution": (PUSHED + FIELD.format(0.3, 0.19), PUSHED + FIELD.format(0.3, 0.2)),
    "final_strain": (changed(SHORT, final_strain="0.31"), changed(SHORT, final_strain="0.3")),
    "few_steps": (
        PUSHED.replace("end_time = 0.2", "end_time = 0.05"),
        PUSHED.replace("end_time = 0.2", "end_time = 0.5"),
    ),
    "fast_boundary": (changed(PUSHED, velocity="0.0, -1.0"), changed(PUSHED, velocity="0.0, -0.1")),
    "unstable_step": (
        PUSHED.replace("damping =", "time_step_rule = 'fixed', time_step = 0.0016, damping ="),
        PUSHED.replace("damping =", "time_step_rule = 'fixed', time_step = 0.0010, damping ="),
    ),
    "unfinished_ramp": (HELD + PRESSED.replace("0.1", "0.3"), HELD + PRESSED),
    "body_adjusted": (
        PUSHED.replace("spacing = 0.1,", "spacing = 0.08, fit = 'nearest',"),
        PUSHED.replace("spacing = 0.1,", "spacing = 0.1, fit = 'nearest',"),
    ),
    "unused_material": (
        PUSHED.replace("&material model", "&material name = 'soil', model").replace(
            "&body ", "&body material = 'soil', "
        )
        + "&material name = 'rock', model = 'elastic', density = 2000.0\n"
        + "  youngs_modulus = 1.0e9, poissons_ratio = 0.3 /\n",
        PUSHED,
    ),
    "thin_body": (
        changed(HELD, y_max="0.2", x_max="2.0") + PRESSED,
        changed(HELD, y_max="0.6", x_max="2.0") + PRESSED,
    ),
    "free_wall": (
        HELD + "&initial_stress unit_weight = 1.0e3, k0 = 0.5 /\n",
        HELD
        + "&initial_stress unit_weight = 1.0e3, k0 = 0.5 /\n"
        + "&boundary name = 'left', side = 'left', contact = 'smooth' /\n"
        + "&boundary name = 'right', side = 'right', contact = 'smooth' /\n",
    ),
    "cloud_control": (
        CLOUD.format(name="uneven.txt", extents="").replace("'relaxing'", "'none'"),
        CLOUD.format(name="uneven.txt", extents=""),
    ),
    "cloud_weights": (
        changed(
            CLOUD.format(name="uneven.txt", extents=""), horizon="0.2, cloud_weights = 'plain'"
        ),
        CLOUD.format(name="uneven.txt", extents=""),
    ),
    "cloud_volume": (
        CLOUD.format(name="heavy.txt", extents=""),
        CLOUD.format(name="even.txt", extents=""),
    ),
    "cloud_extents": (
        CLOUD.format(name="even.txt", extents=LATTICE.replace("x_min = 0.0", "x_min = -0.2")),
        CLOUD.format(name="even.txt", extents=LATTICE),
    ),
}

# doubt: an input with it, one without, both run
IN_THE_RUN = {
    "energy_balance": (SQUEEZED, changed(SQUEEZED, final_strain="0.05")),
    "control_work": tuple(
        SHORT + f"&stabilisation method = 'silling', factor = {g} /\n" for g in (1.0, 0.001)
    ),
    "zero_energy": tuple(
        changed(SHORT, spacing="0.05", horizon="0.11", final_strain="0.016")
        + f"&stabilisation method = '{method}' /\n"
        for method in ("none", "relaxing")
    ),
    "damping_share": tuple(
        changed(SHORT, final_strain="0.002", velocity="0.0, -0.05", damping_frame="'rest'").replace(
            "5.0e5", damping
        )
        for damping in ("5.0e5", "2.0e4")
    ),
    "kinetic_ratio": tuple(
        changed(SHORT, velocity=f"0.0, -{v}", damping_frame="'rest'").replace("5.0e5", "1.0e4")
        for v in (0.5, 0.01)
    ),
    "reaction_gap": tuple(
        changed(SHORT, final_strain="0.003", velocity=f"0.0, -{v}", damping_frame="'rest'")
        for v in (0.1, 0.002)
    ),
    "stress_strain": (SQUARE, SQUARE.replace("'green_lagrange'", "'logarithmic'")),
    "flow_reversal": (SHEARED, SHEARED.replace("-1.0, -1.0", "1.0, 1.0")),
    "long_step": (SQUEEZED, changed(SQUEEZED, final_strain="0.05")),
    "overshoot": tuple(changed(SHORT, velocity=f"0.0, -{v}") for v in (2.0, 0.01)),
}


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    """Return a folder with clouds of 11 x 11 points between two boundaries."""
    folder = tmp_path_factory.mktemp("clouds")
    rng = np.random.default_rng(1)
    places = [(0.1 * i, 0.1 * j) for j in range(-2, 13) for i in range(11)]
    for name, volume, apart in (("even", 0.01, 0.0), ("uneven", 0.01, 0.03), ("heavy", 1.0, 0.0)):
        with open(folder / f"{name}.txt", "w") as file:
            for x, y in places:
                owner = "bottom" if y < -0.01 else "top" if y > 1.01 else ""
                dx, dy = rng.uniform(-apart, apart, 2)
                file.write(f"{x + dx:.6f} {y + dy:.6f} {volume} {owner}\n")
    return folder


def told(text):
    """Return the names of the doubts in what the program says."""
    lines = [line for line in text.splitlines() if "warning: " in line]
    return {re.search(r"\[(\w+)\]$", line)[1] for line in lines}


def doubts_of(path):
    """Return the doubts of a result file: name -> (step, value)."""
    with h5py.File(path) as file:
        group = file["doubts"]
        names = [name.decode().strip() for name in group["name"][()]]
        found = {
            name: (int(step), value)
            for name, step, value in zip(names, group["step"][()], group["value"][()])
            if step >= 0
        }
        assert file.attrs["doubts"] == len(found)
    return found


@pytest.mark.parametrize("doubt", AT_START)
def test_what_is_hardly_meant_is_told_at_the_start(run_case, clouds, tmp_path, doubt):
    for raised, text in zip((True, False), AT_START[doubt]):
        for cloud in clouds.iterdir():
            (tmp_path / cloud.name).write_bytes(cloud.read_bytes())
        done = run_case(text, tmp_path, "--check")
        assert done.returncode == 0, done.stderr
        assert (doubt in told(done.stdout)) == raised, done.stdout
        assert ("doc/limits.md" in done.stdout) == bool(told(done.stdout))


@pytest.mark.parametrize("doubt", IN_THE_RUN)
def test_what_goes_wrong_in_a_run_is_told_once(run_case, tmp_path, doubt):
    for raised, text in zip((True, False), IN_THE_RUN[doubt]):
        done = run_case(text, tmp_path, "--force")
        assert done.returncode in ((0, 4) if raised else (0,)), done.stderr
        log = (tmp_path / "out" / "case.log").read_text()
        assert log.count(f"[{doubt}]\n") == raised, log
        assert (doubt in told(done.stdout)) == raised
        found = doubts_of(tmp_path / "out" / "case.h5")
        assert (doubt in found) == raised
        assert told(log) == set(found)
        assert log.count("doc/limits.md") == bool(found)
        if raised:
            assert found[doubt][0] > 0
            assert math.isfinite(found[doubt][1])


def test_an_increment_that_is_not_at_rest_is_told(program, run_case, tmp_path):
    process = begin(program, tmp_path, RESTING.format(STILL.format("1.0e-20")))
    log = tmp_path / "out" / "case.log"
    while process.poll() is None and not (log.exists() and "[no_rest]" in log.read_text()):
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 143
    step, value = doubts_of(tmp_path / "out" / "case.h5")["no_rest"]
    assert step > 0
    assert 0 < value < 1e-2
    done = run_case(RESTING.format(STILL.format("1.0e-4")), tmp_path, "--force")
    assert done.returncode == 0
    assert "no_rest" not in told(done.stdout)


def test_a_boundary_that_passes_the_body_in_a_step_is_refused(run_case, tmp_path):
    for change in ({"velocity": "0.0, -1.0e3"}, {"density": "1.0e99"}):
        done = run_case(changed(PUSHED, **change), tmp_path, "--check")
        assert done.returncode == 2
        assert "name = top: the boundary passes the whole body in one step" in done.stderr


def test_a_damping_without_end_is_refused(run_case, tmp_path):
    for options in ([], ["--check"]):
        done = run_case(changed(PUSHED, damping="1.0e99"), tmp_path, *options)
        assert done.returncode == 2
        assert "&integration damping: the damping stops every motion within one" in done.stderr
    assert run_case(changed(PUSHED, damping="1.0e15"), tmp_path, "--check").returncode == 0


def test_places_have_the_digits_that_they_need(run_case, tmp_path):
    probe = "&probe name = 'p', x = 500000.26, y = 4649776.71 /\n"
    text = changed(SHORT, x_min="500000.0", x_max="500000.5", y_min="4649776.0", y_max="4649777.0")
    done = run_case(without_group(text, "imperfection") + probe, tmp_path, "--check")
    assert done.returncode == 0, done.stderr
    assert "at (500000.3, 4649776.7) m" in done.stdout
    assert "body                0.5 m x 1 m" in done.stdout


@pytest.mark.parametrize("length", ["2147483648", "214748364.8", "1.0e99"])
def test_a_body_beyond_counting_is_refused(run_case, tmp_path, length):
    done = run_case(changed(SHORT, y_max=length), tmp_path, "--check")
    assert done.returncode == 2
    assert "too many points" in done.stderr


def test_doubts_at_the_start_stand_in_log_and_result(run_case, tmp_path):
    text = changed(AT_START["few_points"][0], density="2.0e9")
    done = run_case(text, tmp_path)
    assert done.returncode == 0, done.stderr
    found = doubts_of(tmp_path / "out" / "case.h5")
    assert {name for name, (step, _) in found.items() if step == 0} >= {"few_points", "wave_speed"}
    assert told(done.stdout) == told((tmp_path / "out" / "case.log").read_text()) == set(found)
    assert found["few_points"][1] == 30


def test_doubts_go_through_a_restart(program, tmp_path):
    text = changed(IN_THE_RUN["control_work"][0], final_strain="0.4")
    text = text.replace("frame_count = 1", "frame_count = 20")

    def stopped(*options):
        path = tmp_path / "out" / "case_history.csv"
        rows = path.read_bytes().count(b"\n") if path.exists() else 0
        process = begin(program, tmp_path, text, *options)
        assert stop(process, signal.SIGTERM, tmp_path, rows + 10) == 143

    stopped()
    first = doubts_of(tmp_path / "out" / "case.h5")
    assert "control_work" in first
    stopped("--restart")
    second = doubts_of(tmp_path / "out" / "case.h5")
    assert second["control_work"] == first["control_work"]
    log = (tmp_path / "out" / "case.log").read_text()
    assert log.count("[control_work]") == 1
    # the checkpoint before the newest, where that is damaged
    (tmp_path / "out" / "case_checkpoint.h5").write_bytes(b"")
    assert "older_checkpoint" not in second
    stopped("--restart")
    assert "older_checkpoint" in doubts_of(tmp_path / "out" / "case.h5")


@pytest.mark.parametrize("path", sorted((ROOT / "input").rglob("*.nml")), ids=lambda p: p.stem)
def test_inputs_that_are_shipped_are_plausible(perigeo, tmp_path, path):
    done = perigeo(["--check", path], tmp_path)
    assert done.returncode == 0, done.stderr
    assert told(done.stdout) == set()


# Those that take a minute or more are tried by hand.
SLOW = {"hourglass", "cylinder", "excavation", "slope", "slope_safety", "smooth_footing",
        "softening_footing", "trapdoor", "vertical_cut", "vertical_cut_safety", "wall_active",
        "wall_passive", "wall_rotation"}  # fmt: skip


@pytest.mark.parametrize("path", sorted((ROOT / "input").rglob("*.nml")), ids=lambda p: p.stem)
def test_what_a_shipped_input_warns_of_stands_in_its_head(perigeo, tmp_path, path):
    names = set(re.findall(r"^ *\| `(\w+)` ", perigeo(["--doubts"], tmp_path).stdout, re.MULTILINE))
    head = path.read_text().split("\n&")[0]
    said = {name for name in names if f"({name})" in head}
    if path.stem in SLOW:
        assert "It warns" not in head.replace("\n!", "") or said
        return
    done = perigeo(["--output", tmp_path / "out", "--threads", "1", path], tmp_path)
    assert done.returncode == 0, done.stderr
    assert told(done.stdout) == said


def test_a_failure_tells_the_state_at_the_point_and_what_helps(run_case, tmp_path):
    control, steps = (
        "a control of zero-energy modes (&stabilisation",
        "a smaller safety or time step",
    )
    for method in ("none", "relaxing"):
        text = changed(SQUEEZED, time_step="0.0014") + f"&stabilisation method = '{method}' /\n"
        done = run_case(text, tmp_path, "--quiet", "--force")
        assert done.returncode == 4
        log = (tmp_path / "out" / "case.log").read_text()
        for words in (done.stderr, log):
            found = re.search(
                r"there strain is (\S+), (\S+), (\S+) \(xx, yy, xy\), det F (\S+), "
                r"zero_energy ([\d.E+-]+)[;\n]",
                words,
            )
            xx, yy, _, det_f, zero_energy = (float(x) for x in found.groups())
            assert det_f == pytest.approx((1 + xx) * (1 + yy), rel=0.01)
            assert zero_energy >= 0
        assert (control in done.stderr) == (method == "none")
        assert steps in done.stderr
        assert "quality when it was looked at last: energy error" in log
    with h5py.File(tmp_path / "out" / "case.h5") as file:
        assert math.isfinite(file["quality"].attrs["energy_error"])
        assert math.isnan(file["quality"].attrs["zero_energy"])


def test_every_run_ends_with_its_quality(run_case, tmp_path):
    control = "&stabilisation method = 'relaxing' /\n"
    still = re.sub(r"damping = [^/]*", "method = 'equilibrium' ", SHORT)
    sheared = changed(PUSHED.replace("contact = 'smooth', ", ""), velocity="0.01, 0.0")
    for text, left_out in (
        (SHORT, {"control_share"}),
        (PUSHED + control, set()),
        (still, {"kinetic_ratio", "damping_share", "control_share"}),
        (HELD + PRESSED, {"reaction_gap", "control_share"}),
        (sheared, {"reaction_gap", "control_share"}),
    ):
        done = run_case(text, tmp_path, "--quiet", "--force")
        assert done.returncode == 0, done.stderr
        log = (tmp_path / "out" / "case.log").read_text()
        assert re.search(r"^quality at the end: .*smallest det F 0\.9", log, re.MULTILINE)
        with h5py.File(tmp_path / "out" / "case.h5") as file:
            quality = dict(file["quality"].attrs)
            row = {name: file["history"][name][-1] for name in file["history"]}
        unknown = {name for name, value in quality.items() if math.isnan(value)}
        assert unknown - {"zero_energy"} == left_out
        assert quality["min_det_f"] == row["min_det_f"]
        if "kinetic_ratio" not in left_out:
            internal = row["strain_energy"] + row["plastic_dissipation"]
            assert quality["kinetic_ratio"] == pytest.approx(row["kinetic_energy"] / internal)
            assert quality["damping_share"] == row["damping_share"]
        assert ("zero_energy" in unknown) == (text in (SHORT, still))  # they flow everywhere


def test_every_doubt_is_tried_here_and_stands_in_the_documents(perigeo, tmp_path):
    table = perigeo(["--doubts"], tmp_path).stdout
    names = re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)
    assert set(names) == {*AT_START, *IN_THE_RUN, "no_rest", "older_checkpoint"}
    assert len(names) == len(set(names))
    page = (ROOT / "doc" / "doubts.md").read_text()
    assert table in page
