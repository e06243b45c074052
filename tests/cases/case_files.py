"""Small inputs for the cases, and readers of what the runs leave behind."""

import csv
import os
import re
import subprocess
import time

import numpy as np

# The bodies are so small that threads would only wait for each other. Where a case asks for
# threads, they must not keep the processor busy while they wait.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")


def uncontrolled(text):
    """Return an input with `method = 'none'` where it says nothing of a control.

    Cases about anything else than the control of zero-energy modes stay free of it: their closed
    forms, symmetries and comparisons are those of the plain operators.
    """
    whole = "&material" in text and text.rstrip().endswith("/")
    if not whole or "&stabilisation" in text:
        return text
    return text.rstrip("\n") + "\n&stabilisation method = 'none' /\n"


SPECIMEN = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration final_strain = 0.01, damping = 5.0e5, damping_frame = 'platens' /
&imperfection amplitude = 1.0e-3, x = 0.0, y = 0.3, radius = 0.11 /
&output frame_strains = 0.004, 0.01, history_count = 100 /
"""


# A sheet that is stretched or squeezed in both directions.
SHEET = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'elastic', strain_measure = '{measure}', density = 2000.0
  youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&boundary name = 'round', side = 'all', contact = 'affine'
  velocity_gradient = {rate}, 0.0, 0.0, {rate} /
&integration end_time = 3.0, safety = 0.9, damping = 5.0e4 /
&output history_count = 300, frame_count = 2 /
"""


def changed(text, **changes):
    """Return an input with values replaced: key='new value', None takes the key out."""
    for key, value in changes.items():
        pattern = re.compile(rf"\b{key} = ('[^']*'|[-+\w.]+(, *[-+\d.]+(?=[,\s]))*)(, )?")
        assert pattern.search(text), key
        new = "" if value is None else rf"{key} = {value}\3"
        text = pattern.sub(new, text, count=1)
    return text


def without_group(text, group):
    """Return an input without a group."""
    return re.sub(rf"&{group}\b[^/]*/\n", "", text)


def begin(program, folder, text, *options, **environment):
    """Start a run in the background."""
    (folder / "run.nml").write_text(uncontrolled(text))
    return subprocess.Popen(
        [program, "--quiet", "--threads", "1", *options, "run.nml"],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **environment},
    )


def stop(process, number, folder, rows):
    """Send a signal when the history has grown to some rows; return the exit status."""
    path = folder / "out" / "case_history.csv"
    while process.poll() is None:
        if path.exists() and path.read_bytes().count(b"\n") > rows:
            process.send_signal(number)
            break
        time.sleep(0.001)
    return process.wait(timeout=300)


def history(path):
    """Return the columns of a history by name."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    data = np.array(rows[1:], dtype=float)
    return {name: data[:, k] for k, name in enumerate(rows[0])}


def contents(folder):
    """Return all files of a folder with their bytes."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def groups_of(file, names):
    """Return all data sets and attributes of some groups of an HDF5 file by path."""
    found = {}

    def take(path, item):
        for name, value in item.attrs.items():
            found[f"{path}@{name}"] = np.asarray(value)
        if hasattr(item, "dtype"):
            found[path] = item[()]

    for name in names:
        take(name, file[name])
        file[name].visititems(lambda path, item, name=name: take(f"{name}/{path}", item))
    return found


def same_points_and_frames(one, other):
    """Assert that two result files hold the same bits in /points and /frames."""
    first, second = groups_of(one, ("points", "frames")), groups_of(other, ("points", "frames"))
    assert first.keys() == second.keys()
    for path, value in first.items():
        assert value.dtype == second[path].dtype, path
        assert value.tobytes() == second[path].tobytes(), path
