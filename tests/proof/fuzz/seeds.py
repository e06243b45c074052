"""What is mutated: the inputs that are shipped with coarser points, clouds, and small studies."""

import json
import subprocess

from namelists import decoded, read, written

FACTORS = (10, 8, 5, 4, 3, 2.5, 2, 1)
FEWEST, MOST = 12, 1000  # points of a body

CLOUD_INPUT = """\
&run name = 'cloud', output_dir = 'out' /
&discretisation spacing = 0.25, horizon = 0.6 /
&body shape = 'file', file = 'points.txt' /
&material model = 'j2', density = 2000.0, youngs_modulus = 5.0e7, poissons_ratio = 0.3
  yield_stress = 1.5e5, kinematic_modulus = -1.5e6, residual_strength = 1.5e4 /
&boundary name = 'bottom' /
&boundary name = 'top', velocity = 0.0, -0.01 /
&integration end_time = 0.02, damping = 5.0e5 /
&output frame_count = 2, history_count = 10, checkpoint_every = 1.0 /
"""

# Keys that no shipped input has, so that mutations begin near what is right.
OTHERS = (
    """\
&run name = 'sheet', title = 'Sheet, held ''all round''', output_dir = 'out', operators = 'list' /
&discretisation spacing = 0.25, horizon = 0.6, layout = 'cells', volumes = 'tributary'
  influence = 'conical', families = 'distance', fit = 'nearest' /
&body name = 'sheet', x_min = 0.0, x_max = 1.0, y_min = -1.0, y_max = 1.0 /
&body name = 'bore', role = 'hole', shape = 'circle', x = 0.5, y = 0.0, radius = 0.3 /
&material name = 'clay', model = 'elastic', density = 2000.0, youngs_modulus = 5.0e7
  poissons_ratio = 0.3, youngs_modulus_gradient = 1.0e5, reference_y = 1.0 /
&boundary name = 'round', side = 'all', contact = 'affine', velocity_gradient = 0.0, 0.1, 3*0.0
  times = 0.0, 1.0, factors = 0.0, 1.0 /
&integration end_time = 0.05, time_step_rule = 'courant', safety = 0.5, damping = 1.0e5 /
&output frame_times = 0.01, 0.03, history_count = 20 /
""".replace("0.1, 3*0.0", "0.1, 2*0.0"),
    """\
&run name = 'bar', output_dir = 'out' /
&discretisation spacing = 0.2, horizon = 0.5 /
&body name = 'bar', x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&cut x = 0.3, 0.7, y = 1.05, 1.05 /
&material name = 'clay', model = 'j2', density = 2000.0, youngs_modulus = 5.0e7
  poissons_ratio = 0.3, yield_stress = 1.0e5, isotropic_modulus = 1.0e6
  yield_stress_gradient = 1.0e3, strain_measure = 'small' /
&boundary name = 'base', side = 'bottom', span = 0.0, 0.6 /
&boundary name = 'cap', side = 'top', contact = 'smooth', traction = 0.0, -5.0e4
  ramp_time = 0.01 /
&pressure name = 'wall', side = 'left', span = 0.5, 1.5, value = 1.0e4, ramp_time = 0.01 /
&random_field coefficient_of_variation = 0.2, correlation_length = 0.5, seed = 7 /
&probe name = 'middle', x = 0.5, y = 1.5 /
&stabilisation method = 'silling', factor = 0.5 /
&integration end_time = 0.03, time_step_rule = 'fixed', time_step = 1.0e-3, damping = 1.0e5 /
&output frame_count = 2, history_count = 20, checkpoint_every = 1.0 /
""",
    """\
&run name = 'dig', output_dir = 'out' /
&discretisation spacing = 0.2, horizon = 0.6, layout = 'cells' /
&body name = 'left', x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&body name = 'right', shape = 'polygon', vertices = 1.0, 0.0, 2.0, 0.0, 2.0, 2.0, 1.0, 2.0 /
&material name = 'clay', model = 'j2', density = 2000.0, youngs_modulus = 5.0e7
  poissons_ratio = 0.3, yield_stress = 1.0e5 /
&material name = 'soft', model = 'j2', density = 2000.0, youngs_modulus = 5.0e7
  poissons_ratio = 0.3, yield_stress = 2.0e4 /
&boundary name = 'base', side = 'bottom', contact = 'smooth' /
&boundary name = 'sides', side = 'left', times = 0.0, 1.0, velocities_x = 0.0, 0.001 /
&gravity acceleration = 0.0, -9.81 /
&initial_stress surface_y = 2.0, unit_weight = 19620.0, k0 = 0.5, surcharge = 1.0e3 /
&stage name = 'press', end_time = 1.0 /
&stage name = 'dig', end_time = 2.0, excavate = 'right', materials = 'left=soft' /
&stabilisation method = 'relaxing', relaxing_stiffness = 0.5, relaxing_strain = 1.0e-4 /
&integration method = 'equilibrium', increments = 4, residual = 1.0e-3
  relaxation = 'accelerated' /
&output frame_count = 2 /
""",
)

STUDY = """\
name = "widths"
title = "Width of the band against the horizon"
question = "Does the horizon set the width of the shear band?"
base = "base.nml"
strain = 0.004
measures = ["curve", "band"]
label = "δ = {delta:g} m"

[parameters]
delta = [0.5, 0.6]

[units]
delta = "m"

[set]
"discretisation.horizon" = "=delta"

[block.slow]
set = { "boundary.top.velocity" = [0.0, -0.005] }

[[series]]
name = "one"
title = "One"
use = "slow"

[[series]]
name = "other"
title = "Other"
[[series.case]]
label = "denser"
values = { rho = 1900.0 }
set = { "material.density" = "=rho" }

[[figure]]
name = "width"
kind = "plot"
x = "delta"
y = "width"
title = "Width of the band over the horizon"
alt = "Points on a rising straight line."

[[finding]]
title = "Width against horizon"
paper = "The horizon is the length that regularises the band."
values = { ratio = "ratio(col('width') / col('delta'))" }
found = "width over horizon varies by a factor of {ratio:.2f}"
holds = ["ratio < 1.1"]
"""
STUDY_BASE = """\
&run name = 'case' /
&discretisation spacing = 0.25, horizon = 0.6 /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration final_strain = 0.01, damping = 5.0e5, damping_frame = 'platens' /
&output frame_strains = 0.004, 0.01, history_count = 100 /
"""


def cloud():
    """Return the lines of a cloud: 5 by 9 points, a little off their places."""
    lines = ["# x y volume boundary"]
    for i in range(5):
        for j in range(9):
            x, y = 0.25 * i, 0.25 * j
            if j not in (0, 8):
                x, y = x + 0.02 * ((7 * i + 3 * j) % 5 - 2), y + 0.02 * ((3 * i + 5 * j) % 5 - 2)
            name = {0: "bottom", 8: "top"}.get(j, "")
            lines.append(f"{x:.4f} {y:.4f} 0.0625 {name}".rstrip())
    return "\n".join(lines) + "\n"


def coarse(program, path, folder):
    """Return the text of an input with as few points as it can have, or None."""
    groups = read(decoded(path.read_bytes()))
    spaces = next(keys for name, keys in groups if name == "discretisation")
    spacing, horizon = spaces["spacing"][0], spaces["horizon"][0]
    for name, keys in groups:
        if name == "output":
            for key in ("frame_count", "history_count"):
                if key in keys:
                    keys[key] = [min(20, int(keys[key][0]))]
        if name == "integration" and "increments" in keys:
            keys["increments"] = [8]
    for factor in FACTORS:
        spaces["spacing"], spaces["horizon"] = [spacing * factor], [horizon * factor]
        text = written(groups)
        (folder / "seed.nml").write_text(text)
        done = subprocess.run(
            [program, "--check", "seed.nml"], cwd=folder, capture_output=True, text=True,
            check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        if done.returncode == 0 and FEWEST <= points(done.stdout) <= MOST:
            return text
    return None


def points(said):
    """Return the number of points that --check tells; 0 where it does not."""
    for line in said.splitlines():
        if line.startswith("  points "):
            return int(line.split()[1].strip(","))
    return 0


def inputs(program, root, folder):
    """Return the texts of all inputs to mutate."""
    shipped = sorted((root / "input").glob("**/*.nml"))
    texts = [coarse(program, path, folder) for path in shipped if path.stem != "hourglass"]
    # some bodies have parts so small that they cannot be coarse
    return [*(text for text in texts if text is not None), *OTHERS]


def reference(program, folder):
    """Return all keys that the program knows: {group: {key: what is allowed}}."""
    done = subprocess.run(
        [program, "--input-reference", "--json"], cwd=folder, capture_output=True, check=True
    )
    groups = json.loads(done.stdout)["groups"]
    return {group["name"]: {key["name"]: key for key in group["keys"]} for group in groups}
