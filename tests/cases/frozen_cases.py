"""Small inputs whose results are frozen, and what is compared: values, not the form of files."""

import functools
import hashlib
import json
import math
import os
import platform
import re
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
from case_files import changed, uncontrolled

FOLDER = Path(__file__).parent / "frozen"
DIGITS = 12
POINTS = ("position", "volume", "boundary")

# Quantities of one kind are compared with the largest of their kind: a force that is zero but for
# round-off has no digits of its own.
KINDS = {
    "force": r".*_force_[xy]|.*mean_stress.*|.*/(stress|von_mises)",
    "strain": r".*mean_strain.*|strain|.*plastic_strain|.*/strain",
    "length": r".*/(displacement|zero_energy)",
    "energy": r".*(_energy|_dissipation|_work)",
}
TOLERANCE = 1e-6

# No body is symmetric, and each is strained into yielding but not so far that bands amplify
# round-off.
BODY = """\
&run name = 'case', output_dir = 'out', operators = 'lattice' /
&discretisation spacing = 0.1, horizon = 0.25, layout = 'nodes', volumes = 'uniform' /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', strain_measure = 'green_lagrange', density = 2000.0
  youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&output frame_count = 2, history_count = 8 /
"""
ACROSS_AIR = BODY.replace("horizon", "families = 'distance', horizon")
L_SHAPE = ACROSS_AIR.replace(
    "&material",
    "&body x_min = 0.5, x_max = 0.8, y_min = 0.0, y_max = 0.4 /\n&material",
)
CUT = """\
&cut x = 0.25, 0.25, y = 0.65, 1.0 /
&stabilisation method = 'relaxing', relaxing_strain = 1.0e-2 /
"""
PLATENS = """\
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration final_strain = 0.008, damping = 5.0e5, damping_frame = 'platens' /
"""
SIDEWAYS = """\
&boundary name = 'left', side = 'left' /
&boundary name = 'right', side = 'right', contact = 'smooth', velocity = -0.01, 0.0 /
&integration final_strain = 0.008, damping = 5.0e5, damping_frame = 'platens' /
"""
LAYERS = """\
&body x_min = 0.5, x_max = 0.8, y_min = 0.0, y_max = 0.4, material = 'rock' /
&body x_min = 0.0, x_max = 0.5, y_min = 0.6, y_max = 1.0, material = 'rock' /
&material name = 'rock', model = 'elastic', strain_measure = 'green_lagrange'
  density = 2500.0, youngs_modulus = 80.0e6
  poissons_ratio = 0.2 /
"""
PATCH = "&imperfection amplitude = 0.1, x = 0.0, y = 0.3, radius = 0.15 /\n"
CONTROL = "&stabilisation method = 'silling', factor = 0.02 /\n"
FIELD = "&random_field coefficient_of_variation = 0.2, correlation_length = 0.3, seed = 3 /\n"
TABLES = """\
&boundary name = 'low', side = 'bottom' /
&boundary name = 'high', side = 'top', times = 0.0, 0.05, 0.15, velocities_x = 0.0, 0.02, -0.02
  velocities_y = 0.0, -0.08, 0.05 /
&boundary name = 'wall', side = 'right', contact = 'smooth' /
&integration end_time = 0.3, time_step_rule = 'courant', safety = 0.8, damping = 2.0e4 /
"""
AFFINE = """\
&boundary name = 'around', side = 'all', contact = 'affine', times = 0.0, 0.1, 0.3
  velocity_gradient = 0.03, 0.05, -0.01, -0.06, factors = 0.0, 1.0, -0.5 /
&integration end_time = 0.37, time_step_rule = 'fixed', time_step = 3.7e-4, damping = 1.0e5 /
"""
LOADED = """\
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', traction = 0.0, -1.7e5
  ramp_time = 0.2 /
&pressure name = 'left', side = 'left', value = 3.0e4, ramp_time = 0.1 /
&pressure name = 'right', side = 'right', span = 0.23, 0.71, value = 2.0e4, ramp_time = 0.05 /
&integration end_time = 0.4, damping = 2.0e5 /
"""
SUDDEN = """\
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', traction = 1.0e4, -1.0e5 /
&pressure name = 'left', side = 'left', span = 0.0, 0.4, value = 4.0e4 /
&pressure name = 'more', side = 'left', value = 1.0e4, ramp_time = 0.1 /
&integration end_time = 0.3, damping = 2.0e5 /
"""
LISTED = {"operators": "'list'"}
CLOUD = changed(BODY, operators="'auto'", horizon="0.26", layout=None, volumes=None).replace(
    "&body", "&body shape = 'file', file = 'cloud.txt',"
)
BOTH = changed(BODY, kinematic_modulus="-1.0e6").replace(
    "kinematic_modulus", "isotropic_modulus = -0.8e6, kinematic_modulus"
)

# A slope with a tunnel: a footing that slides, a wall on an inclined edge, a rim that moves.
POLYGON = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, volumes = 'tributary' /
&body name = 'ground', shape = 'polygon'
  vertices = 0.0, 0.0, 2.6, 0.0, 2.6, 0.77, 1.5, 1.2, 0.7, 1.2, 0.0, 0.9 /
&body name = 'tunnel', shape = 'circle', x = 1.1, y = 0.5, radius = 0.21, role = 'hole' /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 5.0e3, isotropic_modulus = 1.0e5 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'footing', body = 'ground', edge = 4, contact = 'smooth', velocity = 0.0, -0.02 /
&boundary name = 'wall', body = 'ground', edge = 5, velocity = 0.004, -0.01 /
&boundary name = 'rim', body = 'tunnel', contact = 'affine'
  velocity_gradient = 0.0, 0.0, 0.0, 0.01 /
&integration end_time = 0.1, damping = 2.0e4 /
&output history_count = 40, frame_count = 2 /
"""

# What builds by stages, rests on planes of symmetry, is in equilibrium, fails: most parts of the
# program that the cases above leave out, in bodies without a symmetry of their own.
SOIL = """\
  density = 2000.0, youngs_modulus = 20.0e6, poissons_ratio = 0.3, yield_stress = 2.0e4
"""
AT_REST = "&integration method = 'equilibrium', residual = 1.0e-6, increments = 3"
SHORT = "&output frame_count = 2, history_count = 12 /\n"
RESTING = (
    changed(L_SHAPE, strain_measure=None, families=None, horizon="0.3")
    .replace("yield_stress = 0.15e6", "yield_stress = 0.06e6")
    .replace("kinematic_modulus = -1.5e6", "kinematic_modulus = 2.0e6")
    .replace(", residual_strength = 15.0e3", "")
    + PLATENS.split("&integration", maxsplit=1)[0]
    + AT_REST
    + ", end_time = 0.4 /\n&probe name = 'corner', x = 0.52, y = 0.37 /\n"
)
STAGES = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body name = 'ground', x_min = -0.2, x_max = 2.2, y_min = -0.6, y_max = 0.2 /
&body name = 'bank', x_min = -0.2, x_max = 0.9, y_min = 0.2, y_max = 0.9 /
&body name = 'pit', x_min = 0.9, x_max = 2.2, y_min = 0.2, y_max = 0.6, material = 'stiff' /
&body name = 'dam', x_min = -0.2, x_max = 0.4, y_min = 0.9, y_max = 1.3 /
&material name = 'clay', model = 'j2',{SOIL}  yield_stress_gradient = -5.0e3, reference_y = 0.9 /
&material name = 'stiff', model = 'j2', strain_measure = 'small',{SOIL}  isotropic_modulus = 1.0e6 /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&boundary name = 'right', side = 'right', span = -0.6, 0.2, contact = 'smooth' /
&pressure name = 'load', body = 'bank', edge = 3, span = 0.05, 0.45, value = 4.0e3
  ramp_time = 1.5 /
&pressure name = 'more', body = 'bank', edge = 2, span = 0.45, 0.7, value = 2.0e3, ramp_time = 0.5 /
&gravity acceleration = 0.0, -10.0 /
&initial_stress surface_y = 1.1, unit_weight = 20.0e3, k0 = 0.7, surcharge = 500.0 /
&stage name = 'rest', end_time = 1.0, boundaries = 'base left right', pressures = 'more' /
&stage name = 'dig', end_time = 2.0, excavate = 'pit', materials = 'ground=stiff' /
&stage name = 'fill', end_time = 2.7, fill = 'dam', pressures = 'load' /
&probe name = 'edge', x = 0.85, y = 0.3 /
{AT_REST} /
&output frame_count = 3 /
"""
CYLINDER = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells', volumes = 'tributary' /
&body name = 'quarter', shape = 'polygon'
  vertices = 0.0, 0.0, 1.3, 0.0, 1.2, 0.7, 0.6, 1.4, 0.0, 1.5 /
&body name = 'bore', shape = 'circle', role = 'hole', x = 0.0, y = 0.0, radius = 0.57 /
&material model = 'j2',{SOIL}  kinematic_modulus = 3.0e6, isotropic_modulus = 1.0e6
  youngs_modulus_gradient = 2.0e6, reference_y = 0.3 /
&boundary name = 'left', side = 'left', span = 0.0, 1.5, contact = 'smooth' /
&boundary name = 'bottom', side = 'bottom', span = 0.0, 1.3, contact = 'smooth' /
&pressure name = 'inside', body = 'bore', value = 14.0e3, ramp_time = 1.0 /
&random_field coefficient_of_variation = 0.1, correlation_length = 0.4, seed = 5 /
{AT_REST}, end_time = 1.0 /
"""
FOOTING = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = -0.3, x_max = 1.4, y_min = -0.9, y_max = 0.1 /
&cut x = 0.3, 0.75, y = -0.3, -0.3 /
&material model = 'j2',{SOIL}  strain_measure = 'green_lagrange', isotropic_modulus = 1.0e6
  yield_stress_gradient = 1.0e4 /
&boundary name = 'base', side = 'bottom', span = -0.3, 0.5, contact = 'smooth' /
&boundary name = 'door', side = 'bottom', span = 0.5, 1.4, velocity = 0.001, -0.002 /
&boundary name = 'wall', side = 'left', contact = 'affine', span = -0.9, 0.1
  velocity_gradient = 0.0, 0.004, -0.004, 0.0, times = 0.0, 0.2, 0.4, factors = 0.0, 0.0, 1.0 /
&boundary name = 'footing', side = 'top', span = 0.1, 0.7, velocity = 0.0, -0.004 /
&gravity acceleration = 0.5, -9.0, ramp_time = 0.3 /
&stabilisation method = 'relaxing', relaxing_stiffness = 0.3, relaxing_strain = 1.0e-3 /
{AT_REST.replace("'equilibrium'", "'equilibrium', relaxation = 'accelerated'")}, end_time = 0.6 /
"""
FALLING = f"""\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.3, layout = 'cells' /
&body shape = 'polygon', vertices = 0.0, 0.0, 1.6, 0.0, 1.1, 0.9, 0.0, 1.0 /
&material model = 'j2',{SOIL}  strain_measure = 'small' /
&boundary name = 'base', side = 'bottom' /
&boundary name = 'left', side = 'left', contact = 'smooth' /
&gravity acceleration = 0.0, -20.0, ramp_time = 1.0 /
{AT_REST.replace("-6", "-5")}, end_time = 1.0 /
&strength_reduction first = 1.0, last = 3.5, tolerance = 0.4 /
"""
UNTIL = """\
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', traction = 0.0, -1.0e5, ramp_time = 0.1
  traction_until = 0.2, velocity = 0.0, -0.01 /
&stabilisation method = 'relaxing' /
&integration end_time = 0.4, damping = 2.0e5 /
"""

CASES = {
    "polygon": POLYGON,
    "lattice": BODY + PLATENS + PATCH,
    "list": changed(BODY, **LISTED) + PLATENS + PATCH,
    "lattice_control": L_SHAPE + TABLES + CONTROL,
    "list_control": changed(L_SHAPE, **LISTED) + TABLES + CONTROL,
    "tributary": changed(BODY, volumes="'tributary'") + TABLES,
    "cells": changed(BODY, layout="'cells'") + PLATENS + PATCH + CONTROL,
    "affine": BODY + AFFINE,
    "affine_list": changed(BODY, **LISTED) + AFFINE + CONTROL,
    "loaded": changed(BODY, volumes="'tributary'", kinematic_modulus="2.0e6") + LOADED,
    "sudden_list": changed(BODY, **LISTED, kinematic_modulus="2.0e6") + SUDDEN,
    "field": changed(BODY, spacing="0.05", horizon="0.16") + PLATENS + FIELD + PATCH,
    "both_moduli": BOTH + PLATENS + PATCH,
    "both_moduli_list": changed(BOTH, **LISTED) + PLATENS + FIELD + CONTROL,
    "elastic": changed(BODY, model="'elastic'") + LOADED,
    "constant": BODY.replace("horizon =", "influence = 'constant', horizon =") + PLATENS + PATCH,
    "conical": BODY.replace("horizon =", "influence = 'conical', horizon =") + PLATENS + PATCH,
    "cloud": CLOUD + PLATENS + PATCH + CONTROL,
    "sideways": BODY + SIDEWAYS + PATCH,
    "materials": ACROSS_AIR.replace("&material", "&material name = 'soil',")
    + LAYERS
    + TABLES
    + CONTROL,
    "sight": L_SHAPE.replace("'distance'", "'line_of_sight'") + CUT + TABLES,
    "resting": RESTING,
    "resting_list": changed(RESTING, **LISTED),
    "stages": STAGES,
    "cylinder": CYLINDER + SHORT,
    "footing": FOOTING + SHORT,
    "falling": FALLING + SHORT,
    "until": changed(L_SHAPE, strain_measure="'logarithmic'", volumes="'tributary'") + UNTIL,
}
RESTARTED = ("field", "loaded", "cloud", "materials", "polygon", "sight")


def cloud():
    """Return the text of a point cloud whose points stand off a lattice by a formula."""
    lines = []
    for j in range(-3, 13):
        for i in range(6):
            k = 17 * i + 29 * j
            x = 0.1 * i + 0.001 * (k * k % 23 - 11)
            y = 0.1 * j + 0.001 * (k * k % 19 - 9)
            name = "bottom" if j < 0 else "top" if j > 10 else ""
            lines.append(f"{x:.4f} {y:.4f} {0.01 + 1e-5 * (k % 37):.6f} {name}\n")
    return "".join(lines)


def environment():
    """Return an environment in which waiting threads leave the processor to others."""
    return {**os.environ, "OMP_WAIT_POLICY": "passive"}


def run(program, case, folder, threads):
    """Run a case and return its quantities."""
    folder.mkdir(parents=True)
    (folder / "cloud.txt").write_text(cloud())
    (folder / "run.nml").write_text(uncontrolled(CASES[case]))
    done = subprocess.run(
        [str(program), "--quiet", "--threads", str(threads), "run.nml"],
        cwd=folder,
        env=environment(),
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=600,
    )
    if done.returncode:
        raise RuntimeError(f"{case}: exit status {done.returncode}\n{done.stderr}")
    return quantities(folder / "out")


def run_until_stopped(command, folder):
    """Run a case and stop it by a signal after its second row; return its exit status."""
    rows = folder / "out" / "case_history.csv"
    process = subprocess.Popen(
        command, cwd=folder, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    while process.poll() is None:
        if rows.exists() and rows.read_bytes().count(b"\n") > 2:
            process.send_signal(signal.SIGTERM)
            break
        time.sleep(0.0005)
    process.communicate(timeout=600)
    return process.returncode


def run_in_two(program, case, folder):
    """Run a case that is stopped by a signal and goes on; return its quantities."""
    folder.mkdir(parents=True)
    (folder / "cloud.txt").write_text(cloud())
    (folder / "run.nml").write_text(uncontrolled(CASES[case]))
    command = [str(program), "--quiet", "--threads", "1", "run.nml"]
    for _ in range(10):  # on a busy machine a run may end before the signal is sent
        status = run_until_stopped([*command, "--force"], folder)
        if status != 0:
            break
    if status != 128 + signal.SIGTERM:
        raise RuntimeError(f"{case}: not stopped, {status}")
    command.insert(1, "--restart")
    done = subprocess.run(
        command, cwd=folder, env=environment(), check=False, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"{case}: exit status {done.returncode}\n{done.stderr}")
    return quantities(folder / "out")


def checksum(data):
    """Return the first digits of a checksum."""
    return hashlib.sha256(data).hexdigest()[:DIGITS]


def quantities(folder):
    """Return the identity of the build, checksums, and numbers of a run, by name."""
    lines = (folder / "case_history.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    sums, numbers = {}, {}
    for k, name in enumerate(rows[0]):
        values = [row[k] for row in rows[1:]]
        sums[name] = checksum("\n".join(values).encode())
        numbers[name] = [float(value) for value in values]
    with h5py.File(folder / "case.h5", locking=False) as file:
        build = identity(text(file.attrs["compiler"]), text(file.attrs["flags"]))
        for name in POINTS:
            data = file["points"][name][()].astype("<f8")
            sums[f"points/{name}"] = checksum(data.tobytes())
            numbers[f"points/{name}"] = norms(data)
        frames = list(file["frames"])
        for frame in frames:
            for name, item in file["frames"][frame].items():
                data = item[()].astype("<f8")
                sums[f"{frame}/{name}"] = checksum(data.tobytes())
                if frame == frames[-1]:
                    numbers[f"last/{name}"] = norms(data)
    return build, sums, numbers


def norms(data):
    """Return the largest magnitude of an array and the mean magnitude."""
    return [float(np.abs(data).max()), math.fsum(np.abs(data).ravel()) / data.size]


def text(value):
    """Return a text attribute."""
    return value.decode() if isinstance(value, bytes) else str(value)


@functools.cache
def identity(compiler, flags):
    """Return what the bits of results depend on: compiler, flags, processor, C library."""
    try:
        target = subprocess.run(
            ["gfortran", "-march=native", "-Q", "--help=target"],
            check=False,
            capture_output=True,
            text=True,
        ).stdout
    except OSError:
        target = ""
    found = re.search(r"^\s*-march=\s+(\S+)", target, re.M)
    return "; ".join(
        [compiler, flags, found[1] if found else "unknown", *filter(None, platform.libc_ver())]
    )


def read(case):
    """Return what is frozen of a case."""
    path = FOLDER / f"{case}.json"
    if not path.exists():
        return {"checksums": {}, "numbers": {}}
    return json.loads(path.read_text())


def write(case, frozen):
    """Write what is frozen of a case, one quantity on a line."""
    FOLDER.mkdir(exist_ok=True)
    out = json.dumps(frozen, indent=1, sort_keys=True)
    out = re.sub(r"\[\s+([^]]*?)\s+\]", lambda m: "[" + re.sub(r"\s+", " ", m[1]) + "]", out)
    (FOLDER / f"{case}.json").write_text(out + "\n")


def kind(name):
    """Return the kind of a quantity; one without a kind is its own."""
    for key, pattern in KINDS.items():
        if re.fullmatch(pattern, name):
            return key
    return name


def differences(numbers, reference):
    """Return by how much quantities differ, relative to the largest of their kind."""
    scale = {}
    for name, values in reference.items():
        largest = max(map(abs, values))
        scale[kind(name)] = max(scale.get(kind(name), 0.0), largest)
    scale["energy_error"] = 1.0  # a ratio already
    found = {}
    for name, values in reference.items():
        new = numbers.get(name)
        if new is None or len(new) != len(values):
            found[name] = math.inf
            continue
        most = max(abs(a - b) for a, b in zip(new, values))
        found[name] = most / (scale[kind(name)] or 1.0)
    return found


def changes(sums, frozen, numbers, reference):
    """Return a line for each quantity whose checksum is missing or another one."""
    apart = differences(numbers, reference)
    lines = []
    for name, value in sorted(frozen.items()):
        if name not in sums:
            lines.append(f"{name}: missing")
        elif sums[name] != value:
            last = re.sub(r"^\d+/", "last/", name)
            lines.append(f"{name}: changed, by {apart.get(last, math.nan):.1e} ({last})")
    return lines
