"""Several materials in one body, against closed forms."""

import h5py
import numpy as np
import pytest
from case_files import SPECIMEN, changed, history

# Two layers of 1 m between smooth walls, the upper one twice as stiff, under a load on top.
LOAD, LOWER, UPPER = 20.0e3, (25.0e6, 0.2), (50.0e6, 0.3)
SPACING, M = 0.01, 3
LAYERS = f"""
&run name = 'case', output_dir = 'out' /
&discretisation spacing = {SPACING}, horizon = {M * SPACING:.2f}, layout = 'cells' /
&body x_min = 0.0, x_max = 0.4, y_min = 0.0, y_max = 1.0, material = 'lower' /
&body x_min = 0.0, x_max = 0.4, y_min = 1.0, y_max = 2.0 /
&material name = 'upper', model = 'elastic', density = 2200.0
  youngs_modulus = {UPPER[0]}, poissons_ratio = {UPPER[1]} /
&material name = 'lower', model = 'elastic', density = 1800.0
  youngs_modulus = {LOWER[0]}, poissons_ratio = {LOWER[1]} /
&boundary name = 'bottom', side = 'bottom', contact = 'smooth' /
&boundary name = 'top', side = 'top', contact = 'smooth', traction = 0.0, {-LOAD}, ramp_time = 0.4 /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&boundary name = 'right', side = 'right', contact = 'smooth' /
&integration end_time = 1.0, damping = 5.0e5 /
&output frame_count = 1, history_count = 10 /
"""


def constrained_modulus(youngs_modulus, poissons_ratio):
    """Stress over strain where the sides do not move."""
    return (
        youngs_modulus
        * (1.0 - poissons_ratio)
        / ((1.0 + poissons_ratio) * (1.0 - 2.0 * poissons_ratio))
    )


def test_stress_is_continuous_across_the_layers_of_a_specimen(run_case, tmp_path):
    done = run_case(LAYERS, tmp_path)
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "out" / "case.h5") as file:
        position, boundary = file["points/position"][()], file["points/boundary"][()]
        frame = file["frames/000001"]
        stress, displacement = frame["stress"][()][:, 1], frame["displacement"][()][:, 1]
    columns = (boundary == 0) & (abs(position[:, 0] - 0.2) < 0.1)
    rows = np.round(position[columns, 1] / SPACING - 0.5).astype(int)
    height = (np.arange(rows.max() + 1) + 0.5) * SPACING
    stress = np.bincount(rows, stress[columns]) / np.bincount(rows)
    displacement = np.bincount(rows, displacement[columns]) / np.bincount(rows)

    # Modes without energy make the stress of single rows alternate; that of a family does not.
    # What is left falls with the spacing: 1.2 % at 0.02 m, 0.9 % at 0.01 m.
    window = np.ones(2 * M + 1) / (2 * M + 1)
    over_families = np.convolve(stress, window, mode="valid")
    assert over_families == pytest.approx(np.full(over_families.shape, -LOAD), rel=0.01)
    for layer, (start, end) in ((LOWER, (0.2, 0.8)), (UPPER, (1.2, 1.8))):
        inside = (height > start) & (height < end)
        strain = np.polyfit(height[inside], displacement[inside], 1)[0]
        assert strain == pytest.approx(-LOAD / constrained_modulus(*layer), rel=0.01)


# Two columns side by side under one platen, the right one denser.
COLUMNS = """
&run name = 'case', output_dir = 'out', operators = 'list' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&body x_min = 0.5, x_max = 1.0, y_min = 0.0, y_max = 1.0, material = 'dense' /
&material name = 'light', model = 'elastic', density = 1000.0, youngs_modulus = 2.5e7
  poissons_ratio = 0.2, yield_stress = 1.0e5 /
&material name = 'dense', model = 'elastic', density = 4000.0, youngs_modulus = 2.5e7
  poissons_ratio = 0.2 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', traction = 0.0, -2.0e4 /
&integration end_time = 0.01, damping = 5.0e5 /
&output frame_count = 1, history_count = 2 /
"""


def test_a_platen_under_a_traction_needs_points_of_one_density(run_case, tmp_path):
    # The same force and damping per volume would move points of different density apart.
    done = run_case(COLUMNS, tmp_path)
    assert done.returncode == 3
    assert "&boundary name = top: a platen under a traction" in done.stderr
    assert "points of different density; found: 1000.0 to 4000.0" in done.stderr
    one_density = COLUMNS.replace("4000.0", "1000.0")
    assert run_case(one_density, tmp_path).returncode == 0
    moved = COLUMNS.replace("traction = 0.0, -2.0e4", "velocity = 0.0, -0.01")
    assert run_case(moved, tmp_path, "--force").returncode == 0


def test_a_material_that_no_point_has_is_told(run_case, tmp_path):
    done = run_case(COLUMNS.replace(", material = 'dense'", ""), tmp_path, "--check")
    assert done.returncode == 0
    assert "no point has the material 'dense'; &body material chooses one" in done.stdout
    assert "no point has" not in run_case(COLUMNS, tmp_path, "--check").stdout


def test_the_memory_of_a_run_counts_what_the_laws_remember(run_case, tmp_path):
    def memory(case):
        """Memory that --check tells [bytes], and points."""
        done = run_case(case, tmp_path, "--check")
        assert done.returncode == 0, done.stderr
        lines = {line[:22].strip(): line[22:].split() for line in done.stdout.splitlines()}
        return float(lines["memory"][0]) * 1.0e6, int(lines["points"][0].rstrip(","))

    elastic, points = memory(COLUMNS.replace("4000.0", "1000.0"))
    plastic, _ = memory(COLUMNS.replace("4000.0", "1000.0").replace("'elastic'", "'j2'", 1))
    assert plastic - elastic == pytest.approx(points * 9 * 8.0, rel=0.02)


def test_the_statistics_of_a_random_field_are_those_of_each_material(run_case, tmp_path):
    weak = "model = 'j2', yield_stress = 2.0e4, isotropic_modulus = -1.0e5"
    weak += ", residual_strength = 1.9e4"
    case = COLUMNS.replace("4000.0", "1000.0").replace(
        "name = 'dense', model = 'elastic'", f"name = 'dense', {weak}"
    )
    case += "&random_field coefficient_of_variation = 0.2, correlation_length = 0.3 /\n"
    done = run_case(case, tmp_path, "--check")
    assert done.returncode == 0, done.stderr
    told = {line[:22].strip(): line[22:] for line in done.stdout.splitlines()}
    assert told["yield stress"].startswith("dense: mean ")
    assert float(told["yield stress"].split()[2]) == pytest.approx(2.0e4, rel=0.25)
    assert "from 0 to" not in told["yield stress"]
    assert told["no softening"].startswith("dense: at ")


def test_a_material_that_no_body_has_changes_nothing(run_case, tmp_path):
    one = COLUMNS.replace("4000.0", "1000.0").replace(", material = 'dense'", "")
    one = one.replace("damping", "time_step_rule = 'courant', safety = 0.5, damping")
    stiff = one.replace(
        "density = 1000.0, youngs_modulus = 2.5e7\n  poissons_ratio = 0.2 /",
        "density = 1000.0, youngs_modulus = 9.9e9\n  poissons_ratio = 0.2 /",
    )
    assert stiff != one
    told = [run_case(case, tmp_path, "--check").stdout.splitlines() for case in (one, stiff)]
    assert len(told[0]) > 10
    assert told[0][:-1] == told[1][:-1]


# A square that is sheared by 2 %, and then on or back.
SHEARED = """
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, {softening} = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'round', side = 'all', contact = 'affine'
  velocity_gradient = 0.0, 0.02, 0.0, 0.0
  times = 0.0, 1.0, 1.001, 2.0, factors = 1.0, 1.0, {then}, {then} /
&integration end_time = 2.0, damping = 5.0e4 /
&output history_count = 100 /
"""
TURNS_BACK = "warning: the flow turns back: at step "


@pytest.mark.parametrize(
    ("softening", "then", "warned"),
    [("kinematic_modulus", -1.0, 1), ("kinematic_modulus", 1.0, 0), ("isotropic_modulus", -1.0, 0)],
)
def test_flow_that_turns_back_is_warned_of(run_case, tmp_path, softening, then, warned):
    done = run_case(SHEARED.format(softening=softening, then=then), tmp_path, "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "case.log").read_text().count(TURNS_BACK) == warned


def test_bands_that_form_do_not_count_as_flow_that_turns_back(run_case, tmp_path):
    text = changed(SPECIMEN, spacing="0.05", horizon="0.16", final_strain="0.02")
    text = text.replace("frame_strains = 0.004, 0.01", "frame_count = 1")
    done = run_case(text, tmp_path, "--quiet")
    assert done.returncode == 0, done.stderr
    assert TURNS_BACK not in (tmp_path / "out" / "case.log").read_text()


@pytest.mark.parametrize("moduli", [(-1.5e6, 0.0), (-1.0e6, -0.5e6)])
def test_plasticity_knows_no_unit_of_stress(run_case, tmp_path, moduli):
    ends = []
    for unit in (1.0, 1.0e-26):  # of stress, and of density and damping with it
        kinematic, isotropic = (repr(unit * modulus) for modulus in moduli)
        text = changed(
            SPECIMEN,
            density=repr(unit * 2000.0),
            youngs_modulus=repr(unit * 50.0e6),
            yield_stress=repr(unit * 0.15e6),
            kinematic_modulus=f"{kinematic}, isotropic_modulus = {isotropic}",
            residual_strength=repr(unit * 15.0e3),
            damping=repr(unit * 5.0e5),
        )
        assert run_case(text, tmp_path, "--quiet", "--force").returncode == 0
        rows = history(tmp_path / "out" / "case_history.csv")
        ends.append((rows["max_plastic_strain"][-1], rows["top_force_y"][-1] / unit))
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
