"""Several materials in one body, against closed forms."""

import h5py
import numpy as np
import pytest

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
