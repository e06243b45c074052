"""Closed forms that whole runs must meet: energy balance, wave speed, homogeneous motions."""

import h5py
import numpy as np
import pytest
from case_files import SPECIMEN, changed, history, without_group

YOUNGS, NU, DENSITY, SIGMA_Y = 50.0e6, 0.3, 2000.0, 0.15e6
SHEAR = YOUNGS / (2 * (1 + NU))
LAMBDA = YOUNGS * NU / ((1 + NU) * (1 - 2 * NU))
ELASTIC = "model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3"

# ------------------------------------------------------------------------------ energy

CYCLIC = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25, layout = 'cells' /
&body x_min = 0.0, x_max = 0.8, y_min = 0.0, y_max = 0.8 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = 3.0e6 /
&boundary name = 'around', side = 'all', contact = 'affine', velocity_gradient = 0.0, 0.1, 0.0, 0.0
  times = 0.0, 0.05, 0.15, 0.25, 0.35, 0.4, factors = 0.0, 1.0, 1.0, -1.0, -1.0, 0.0 /
&integration end_time = 0.4, damping = 2.0e4 /
&output history_count = 200 /
"""
AT_REST = changed(without_group(SPECIMEN, "imperfection"), damping_frame="'rest'")
RAMPED = AT_REST.replace(
    "velocity = 0.0, -0.01", "times = 0.0, 0.3, 0.8, velocities_y = 0.0, -0.02, -0.005"
)
STOPPED = AT_REST.replace(
    "velocity = 0.0, -0.01", "times = 0.0, 0.2, 0.4, velocities_y = 0.0, -0.05, 0.0"
).replace("final_strain = 0.01", "end_time = 1.0")
SIDEWAYS = (
    SPECIMEN.replace("'bottom'", "'left'")
    .replace("'top'", "'right'")
    .replace("0.0, -0.01", "-0.01, 0.0")
)
BALANCED = {
    "platens": SPECIMEN,
    "from rest": AT_REST,
    "table": RAMPED,
    "table that stops": STOPPED.replace("frame_strains = 0.004, 0.01, ", ""),
    "along x": SIDEWAYS,
    "with control": SPECIMEN + "&stabilisation method = 'silling', factor = 0.05 /\n",
    "with relaxing control": SPECIMEN + "&stabilisation method = 'relaxing' /\n",
    "isotropic softening": SPECIMEN.replace("kinematic_modulus", "isotropic_modulus"),
    "cells, tributary, both moduli": changed(SPECIMEN, kinematic_modulus="-1.0e6").replace(
        "horizon = 0.25", "horizon = 0.25, volumes = 'tributary'"
    )
    + "",
    "elastic without damping": changed(AT_REST, model="'elastic'", damping="0.0"),
    "cyclic shear": CYCLIC,
}


@pytest.mark.parametrize("name", BALANCED)
def test_energy_is_balanced(run_case, tmp_path, name):
    done = run_case(BALANCED[name], tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    rows = history(tmp_path / "out" / "case_history.csv")
    assert rows["energy_error"][0] == 0.0
    if name == "platens":
        assert np.abs(rows["energy_error"]).max() < 1e-3
    # a sudden start leaves an error in the first rows, when there is hardly any work
    assert np.abs(rows["energy_error"][20:]).max() < 1e-4
    stored = ("kinetic_energy", "strain_energy", "stabilisation_energy")
    lost = ("plastic_dissipation", "damping_dissipation")
    start, work = rows["kinetic_energy"][0], rows["external_work"]
    surplus = sum(rows[column] for column in stored + lost) - start - work
    assert np.abs(surplus).max() < 1e-3 * np.abs(work).max()
    scale = np.maximum(np.abs(work), start)
    assert surplus[1:] / scale[1:] == pytest.approx(rows["energy_error"][1:], abs=1e-9)
    for column in lost:
        assert (np.diff(rows[column]) >= -1e-12 * abs(rows[column]).max()).all(), column
    if "elastic" not in name:
        assert rows["max_plastic_strain"][-1] > 1e-3
        assert rows["plastic_dissipation"][-1] > 0
    if "control" in name:
        assert rows["stabilisation_energy"][-1] > 0


def test_external_work_is_reaction_times_motion(run_case, tmp_path):
    # slow loading: the reaction of the moving platen does nearly all of the work
    text = changed(AT_REST, damping="0.0").replace(
        "velocity = 0.0, -0.01", "times = 0.0, 1.0, velocities_y = 0.0, -0.01"
    )
    assert run_case(text, tmp_path, "--quiet", "--threads", "1").returncode == 0
    rows = history(tmp_path / "out" / "case_history.csv")
    travel = -rows["strain"] * 1.0
    force = 0.5 * (rows["top_force_y"][1:] + rows["top_force_y"][:-1])
    work = np.append(0.0, np.cumsum(force * np.diff(travel)))
    assert abs(work - rows["external_work"]).max() < 0.01 * rows["external_work"].max()


def test_reactions_and_mean_stress_agree_when_loading_is_slow(run_case, tmp_path):
    text = changed(SPECIMEN, spacing="0.05", horizon="0.1").replace("-0.01 /", "-0.002 /")
    text = changed(text, model="'elastic'", final_strain="0.001", frame_strains="0.001")
    assert run_case(text, tmp_path, "--quiet", "--threads", "1").returncode == 0
    rows = history(tmp_path / "out" / "case_history.csv")
    assert rows["bottom_force_y"][-1] > 0 > rows["top_force_y"][-1]
    assert rows["bottom_force_y"][-1] == pytest.approx(-rows["top_force_y"][-1], rel=0.01)
    assert rows["top_force_x"] == pytest.approx(0.0, abs=1e-9)
    # between rough and smooth platens the stress is near E / (1 - nu^2) times the strain
    modulus = rows["bottom_force_y"][-1] / 0.5 / rows["strain"][-1]
    assert modulus == pytest.approx(YOUNGS / (1 - NU**2), rel=0.1)
    assert -rows["mean_stress_yy"][-1] / rows["strain"][-1] == pytest.approx(modulus, rel=0.1)


# ------------------------------------------------------------------------------ waves

PULSE = 0.008  # duration of the push [s]
SIDES = """\
&boundary name = 'low', side = 'bottom', contact = 'smooth' /
&boundary name = 'high', side = 'top', contact = 'smooth' /
"""


def bar(material, sides):
    """Return a bar that is pushed at its left end."""
    times = np.linspace(0, PULSE, 33)
    push = 1e-3 * np.sin(np.pi * times / PULSE) ** 2
    return f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.05, horizon = 0.101 /
&body x_min = 0.0, x_max = 6.0, y_min = 0.0, y_max = 0.2 /
&material {material} /
{sides}
&boundary name = 'push', side = 'left', contact = 'smooth'
  times = {", ".join(f"{t:.6f}" for t in times)}
  velocities_x = {", ".join(f"{v:.6e}" for v in push)} /
&integration end_time = 0.026, safety = 0.5 /
&output frame_times = 0.014, 0.026 /
"""


@pytest.mark.parametrize(
    ("material", "sides", "exact"),
    [
        (ELASTIC, SIDES, np.sqrt((LAMBDA + 2 * SHEAR) / DENSITY)),
        (ELASTIC.replace("0.3", "0.0"), "", np.sqrt(YOUNGS / DENSITY)),
    ],
    ids=["constrained", "free sides, nu = 0"],
)
def test_a_pulse_travels_at_the_wave_speed(run_case, tmp_path, material, sides, exact):
    done = run_case(bar(material, sides), tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        position = file["points/position"][()]
        row = (file["points/boundary"][()] == 0) & (abs(position[:, 1] - 0.1) < 1e-9)
        x = position[row, 0]
        centres, times = [], []
        for name in ("000001", "000002"):
            frame = file["frames"][name]
            times.append(frame.attrs["time"])
            # behind the pulse the loose corner of two layers goes on trembling
            velocity = frame["velocity"][row, 0] * (x > exact * (times[-1] - PULSE) - 0.5)
            centres.append((velocity**2 * x).sum() / (velocity**2).sum())
            assert velocity.max() > 0.5e-3
    speed = (centres[1] - centres[0]) / (times[1] - times[0])
    assert speed == pytest.approx(exact, rel=0.02)


# ------------------------------------------------------------------------------ homogeneous


def affine(gradient, material, end="0.4"):
    """Return a body that follows v = L x all round and comes to rest."""
    return f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 1.2, y_min = 0.0, y_max = 1.2 /
&material {material} /
&boundary name = 'around', side = 'all', contact = 'affine'
  velocity_gradient = {", ".join(map(str, gradient))}
  times = 0.0, 0.1, 0.2, factors = 0.0, 1.0, 0.0 /
&integration end_time = {end}, damping = 2.0e5 /
&stabilisation method = 'silling', factor = 0.1 /
&output frame_times = {end} /
"""


def inside(x):
    """Return which points of the body of `affine` lie well away from its sides."""
    return (x.min(axis=1) > 0.34) & (x.max(axis=1) < 0.86)


def test_an_unsymmetric_motion_shows_in_the_right_components(run_case, tmp_path):
    gradient = np.array([[0.1, 0.3], [-0.2, 0.05]])
    done = run_case(affine(gradient.ravel(), ELASTIC), tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    travel = 0.1 * gradient  # the factor has the integral 0.1 s
    f = np.eye(2) + travel
    strain = 0.5 * (f.T @ f - np.eye(2))
    second = LAMBDA * np.trace(strain) * np.eye(2) + 2 * SHEAR * strain
    cauchy = f @ second @ f.T / np.linalg.det(f)
    cauchy_zz = LAMBDA * np.trace(strain) / np.linalg.det(f)
    rows = history(tmp_path / "out" / "case_history.csv")
    assert "strain" not in rows
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        frame = file["frames/000001"]
        x, boundary = file["points/position"][()], file["points/boundary"][()]
        fields = {name: data[()] for name, data in frame.items()}
        components = frame["stress"].attrs["components"]
    assert components in ("xx yy zz xy", b"xx yy zz xy")
    moved = fields["displacement"]
    assert moved[boundary == 1] == pytest.approx(x[boundary == 1] @ travel.T, abs=1e-12)
    # the motion of the body itself: not quite homogeneous near the layers, which end too
    inner = inside(x)
    assert moved[inner] == pytest.approx(x[inner] @ travel.T, abs=2e-4)
    expected = np.array([strain[0, 0], strain[1, 1], 0.0, strain[0, 1]])
    n = inner.sum()
    assert fields["strain"][inner] == pytest.approx(np.tile(expected, (n, 1)), abs=8e-4)
    expected = np.array([cauchy[0, 0], cauchy[1, 1], cauchy_zz, cauchy[0, 1]])
    near = 0.06 * abs(expected).max()
    assert fields["stress"][inner] == pytest.approx(np.tile(expected, (n, 1)), abs=near)
    deviator = np.diag([*np.diag(cauchy), cauchy_zz])
    deviator[0, 1] = deviator[1, 0] = cauchy[0, 1]
    deviator -= np.trace(deviator) / 3 * np.eye(3)
    mises = np.sqrt(1.5 * (deviator**2).sum())
    assert fields["von_mises"][inner] == pytest.approx(mises, rel=0.1)
    assert fields["velocity"] == pytest.approx(0.0, abs=1e-4)
    first = f @ second
    assert rows["mean_stress_xx"][-1] == pytest.approx(first[0, 0], rel=0.06)
    assert rows["mean_stress_yy"][-1] == pytest.approx(first[1, 1], rel=0.06)
    assert rows["mean_strain_yy"][-1] == pytest.approx(strain[1, 1], rel=0.05)


def test_plastic_shear_ends_at_its_closed_form(run_case, tmp_path):
    hardening = 3.0e6
    material = ELASTIC.replace("elastic", "j2") + (
        f", yield_stress = {SIGMA_Y}, kinematic_modulus = {hardening}"
    )
    text = affine((0.0, 0.1, 0.0, 0.0), material)
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    gamma = 0.01
    # terms of the second order in gamma are left out here
    alpha = (3 * SHEAR * gamma / np.sqrt(3) - SIGMA_Y) / (3 * SHEAR + hardening)
    tau = (SIGMA_Y + hardening * alpha) / np.sqrt(3)
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        frame = file["frames/000001"]
        inner = inside(file["points/position"][()])
        assert frame["plastic_strain"][()][inner] == pytest.approx(alpha, rel=0.07)
        assert frame["stress"][()][inner, 3] == pytest.approx(tau, rel=0.03)
        assert frame["displacement"][()][inner, 1] == pytest.approx(0.0, abs=1e-4)


# -------------------------------------------------------------------------- similar bodies


def scaled(k, density):
    """Return the specimen k times as large, strained at the same rate, with drag in proportion.

    Stresses are the same where C and rho fall with the square of the size: the body feels
    rho a + C v per volume, which grows with the size, and divergences of stress fall with it.
    """
    return changed(
        SPECIMEN,
        spacing=f"{0.1 * k!r}",
        horizon=f"{0.25 * k!r}",
        x_max=f"{0.5 * k!r}",
        y_max=f"{1.0 * k!r}",
        velocity=f"0.0, {-0.01 * k!r}",
        damping=f"{5.0e5 / k**2!r}",
        density=f"{density!r}",
        y=f"{0.3 * k!r}",
        radius=f"{0.11 * k!r}",
    )


@pytest.mark.parametrize(("k", "tolerance"), [(2.0, 1e-14), (3.0, 1e-12)])
def test_similar_bodies_behave_alike_where_the_density_is_in_proportion(
    run_case, tmp_path, k, tolerance
):
    """Powers of two change no digit, other factors the last ones."""
    found = {}
    for name, size, density in (
        ("one", 1.0, 2000.0), ("large", k, 2000.0 / k**2), ("heavy", k, 2000.0),
    ):  # fmt: skip
        folder = tmp_path / name
        folder.mkdir()
        done = run_case(scaled(size, density), folder, "--quiet", "--threads", "1")
        assert done.returncode == 0, done.stderr
        rows = history(folder / "out" / "case_history.csv")
        strain, force = rows["strain"], rows["bottom_force_y"] / size
        found[name] = np.interp(np.linspace(0.0, 0.0099, 200), strain, force)
        assert rows["max_plastic_strain"][-1] > 0.01
    scale = np.abs(found["one"]).max()
    assert np.abs(found["large"] - found["one"]).max() < tolerance * scale
    assert np.abs(found["heavy"] - found["one"]).max() > 1e-5 * scale
