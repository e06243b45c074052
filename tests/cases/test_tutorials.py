"""The tutorials can be followed from their page alone, in an empty folder.

`make tutorials` types all of them in full, which takes minutes, and checks all their numbers.
"""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from perigeo_post import Run, measure_band, stress_strain
from perigeo_post.cli.command_line import main as perigeo_post
from perigeo_post.measure.limit_load import limit_loads

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "doc" / "tutorials"
SHIPPED = ROOT / "input" / "limit_loads"
PAGES = {path.stem: path.read_text() for path in FOLDER.glob("*.md") if path.stem != "README"}
OF_LIMIT_LOADS = sorted(name for name in PAGES if "`input/limit_loads/" in PAGES[name])

FULL = os.environ.get("TUTORIALS") == "full"
# Pages that run here as a student runs them, but with these settings, so that it takes a second;
# of the others only the inputs are checked.
COARSE = ("discretisation.spacing=0.1", "discretisation.horizon=0.3", "integration.residual=1e-2")
SHORT = {
    "footing": (*COARSE, "integration.increments=20"),
    "slope": COARSE,
    "excavation": (
        "integration.residual=1e-2",
        "integration.increments=1",
        "body.ground.x_min=-1.5",
        "body.ground.y_min=-2.5",
        "body.ground.x_max=0.8",
        "body.bank.x_min=-1.5",
        *(f"body.slice_{k}.x_max=0.8" for k in range(1, 10)),
    ),
    "specimen": ("integration.residual=1e-2", "integration.increments=50"),
    "cyclic_shear": ("integration.residual=1e-3", "integration.increments=50"),
    "cloud": ("integration.increments=10", "integration.residual=1e-2"),
    "study": (),
    "biaxial": ("integration.residual=1e-3",),
}
# Commands that take too long for a test, or draw what another one draws, by a word that they have.
LEFT_OUT = {
    "specimen": ("run.name=half", "specimen_fields.png"),
    "cyclic_shear": ("cyclic.png", "shear_box.png"),
    "cloud": ("cloud.png",),
    "footing": ("run.name=finer", "results/finer/finer.h5"),
    "study": ("--figures-only", "report"),
    "biaxial": ("biaxial_start.png",),
}
SAID = {  # what the page has its reader look for in a log, or in what a command prints
    "footing": ("limit load", "footing: "),
    "slope": ("limit load: the last equilibrium is at", "with gravity of", "factor of safety"),
    "excavation": ("stage 'to_100_cm' begins", "stage 'to_195_cm' begins"),
    "biaxial": ("motion in place of the traction from 0.5 s on",),
    "specimen": ("peak stress", "degrees from the loading axis"),
    "cyclic_shear": ("[few_points]", "[flow_reversal]"),
    "cloud": ("limit load", "[control_work]"),
    "study": ("6 of 6 runs to be made", "holds: Pressure over 2 c", "0.993, 1.225, 1.792"),
}


if FULL:
    SHORT = dict.fromkeys(PAGES, ())
    LEFT_OUT = {}


def inputs(page):
    """Return what a page has its reader type: the text of each file."""
    parts = re.split(r"^```(?:fortran|python|toml)\n(.*?)^```", page, flags=re.M | re.S)
    names = [re.findall(r"`(\w+\.(?:nml|py|toml))`", text)[-1] for text in parts[:-1:2]]
    return dict(zip(names, parts[1::2]))


def commands(page):
    """Return the words of every command of a page, in their order."""
    outside = re.sub(r"^```.*?^```", "", page, flags=re.M | re.S)
    lines = re.findall(r"^    (\S.*)$", outside, re.M)
    return [shlex.split(line) for line in lines]


def as_used(perigeo, path, *options):
    """Return the name of the run of an input, and all its values but for the title."""
    done = perigeo(["--print-input", *options, path], path.parent)
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if not line.startswith("  title = ")]
    return re.search(r"^  name = '(\w+)'", done.stdout, re.M).group(1), lines


@pytest.mark.parametrize("name", OF_LIMIT_LOADS)
def test_the_inputs_of_a_page_are_those_that_are_shipped(name, perigeo, tmp_path):
    for file, text in inputs(PAGES[name]).items():
        (tmp_path / file).write_text(text)
    runs = [words[1:] for words in commands(PAGES[name]) if words[0] == "bin/perigeo"]
    assert runs
    for file, *options in (words for words in runs if words[0] != "--check"):
        if "run.name=finer" in options:  # of no input that is shipped
            continue
        run, typed = as_used(perigeo, tmp_path / file, *options)
        assert f"input/limit_loads/{run}.nml" in PAGES[name]
        assert typed == as_used(perigeo, SHIPPED / f"{run}.nml")[1]


def test_pages_of_limit_loads_are_found():
    assert {"footing", "slope", "wall", "excavation", "hole"} <= set(OF_LIMIT_LOADS)


def follow(name, perigeo, capsys):
    """Type the files of a page and give its commands; return all that they say."""
    settings = [word for text in SHORT.get(name, ()) for word in ("--set", text)]
    typed = inputs(PAGES[name])
    for file, text in typed.items():
        Path(file).write_text(text)
    runs = re.findall(r"name = '(\w+)', title", "".join(typed.values()))
    results = {f"results/{run}/{run}.h5" for run in runs}
    said = ""
    for command, *words in commands(PAGES[name]):
        if set(words) & set(LEFT_OUT.get(name, ())):
            continue
        if command == "bin/perigeo":
            check = [] if name in SHORT else ["--check"]
            done = perigeo([*words, *check, *settings], Path.cwd())
            assert done.returncode == 0, done.stderr
            said += done.stdout
            continue
        if command == ".venv/bin/python":
            done = subprocess.run([sys.executable, *words], capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            said += done.stdout
            continue
        assert command == ".venv/bin/perigeo-post"
        if words[0] == "geometry":
            assert perigeo_post([*words, *settings]) == 0
        elif name in SHORT:
            assert perigeo_post(words) == 0
        else:
            assert words[1] in results
            continue
        said += capsys.readouterr().out
        assert all(Path(words[k + 1]).is_file() for k, word in enumerate(words) if word == "-o")
    return said


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_commands_of_a_page_run_in_an_empty_folder(
    name, program, perigeo, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PERIGEO_BIN", str(program))
    if FULL:
        monkeypatch.setenv("OMP_NUM_THREADS", "1")  # pages run side by side
    said = follow(name, perigeo, capsys)
    assert not [text for text in SAID.get(name, ()) if text not in said]
    if name in NUMBERS:
        NUMBERS[name]()


def run_of(name):
    return Run(f"results/{name}/{name}.h5")


def limit_load(name):
    """Return the largest force of the boundary that moves [kN/m]."""
    return 1e-3 * limit_loads(run_of(name))[0].peak


def specimen():
    """2 c_u, 45 degrees, and a width of 1.6 horizons."""
    assert max(stress_strain(run_of("specimen")).y) == pytest.approx(98.9e3, rel=5e-3)
    perfect = stress_strain(run_of("perfect"))
    assert perfect.y[abs(perfect.x - 0.003).argmin()] == pytest.approx(100.1e3, rel=5e-3)
    band = measure_band(run_of("specimen"), strain=0.02)
    assert band.bands.prevailing.angle == pytest.approx(45.0, abs=4.0)
    assert band.width == pytest.approx(0.024, rel=0.03)


def biaxial():
    """2 c_u at every cell pressure, from an isotropic stress; the slope of plane strain."""
    for cell in (50, 100, 200):
        history = run_of(f"cell_{cell}").history()
        start, yielded = (abs(history["time"] - time).argmin() for time in (0.5, 1.0))
        stress = -1e-3 * history["top_force_y"] / 0.05
        assert stress[start] == pytest.approx(cell, rel=2e-3)
        true = stress[yielded] / (1.0 + history["strain"][yielded])
        assert true - cell == pytest.approx(100.0, rel=0.01)
        slope = np.diff(stress)[start + 5] / np.diff(history["strain"])[start + 5]
        assert slope == pytest.approx(34.8e3, rel=0.01)


def cyclic_shear():
    """The loop of kinematic hardening, and what is left after softening."""

    def stress(name, time):
        history = run_of(name).history()
        return history["soil_stress_xy"][abs(history["time"] - time).argmin()]

    assert stress("cyclic", 0.2) == pytest.approx(20e3, rel=1e-4)
    for time, sign in ((1.0, 1.0), (3.0, -1.0), (5.0, 1.0)):
        assert stress("cyclic", time) == pytest.approx(sign * 27272.7, rel=1e-4)
    assert stress("cyclic", 1.4) == pytest.approx(-12727.3, rel=1e-3)
    history = run_of("cyclic").history()
    heat = (
        history["plastic_heat"][-1] - history["plastic_heat"][abs(history["time"] - 1.0).argmin()]
    )
    assert heat / (49 * 0.02**2) == pytest.approx(581.8, rel=1e-4)
    assert stress("isotropic", 1.0) == pytest.approx(11111.1, rel=1e-4)
    assert stress("isotropic", 3.0) == pytest.approx(-10e3, rel=1e-4)
    assert stress("kinematic", 1.4) == pytest.approx(-28888.9, rel=1e-3)
    box = run_of("shear_box").history()
    assert max(box["top_force_x"]) / 0.08 == pytest.approx(24.4e3, rel=0.02)


def cloud():
    """2 c times what is left beside the slot: exact without one, as far off with it as is said."""
    assert limit_load("whole") == pytest.approx(10.0, rel=0.01)
    assert limit_load("whole_lattice") == pytest.approx(10.0, rel=0.01)
    assert limit_load("lattice") == pytest.approx(5.78, rel=0.03)
    assert limit_load("cloud") == pytest.approx(6.45, rel=0.03)


def footing():
    """4.64 c, and 5.12 c from two spacings, in place of 2 + pi."""
    loads = [limit_load("smooth_footing"), limit_load("finer")]
    assert loads == pytest.approx([23.2, 24.4], abs=0.1)
    assert (2.0 * loads[1] - loads[0]) / 5.0 == pytest.approx(5.12, abs=0.03)


def slope():
    """The stability number, and a factor of safety at the real weight that goes with it."""
    number = run_of("slope").history()["gravity"][-1] * 2000.0 / 10e3
    assert number == pytest.approx(5.09, abs=0.01)
    with h5py.File(run_of("slope_safety").path, locking=False) as file:
        tries = file["strength_reduction"].attrs
        assert tries["borne"] < 1.02 * 5.13 / 2.0
        assert tries["not_borne"] > 0.98 * 5.13 / 2.0


def wall():
    """gamma h^2 / 2 +- 2 c h."""
    for name, load in (("wall_passive", 45.0), ("wall_active", 15.2)):
        (found,) = limit_loads(run_of(name))
        assert found.reached
        assert 1e-3 * abs(found.load) == pytest.approx(load, abs=0.1)


def hole():
    """The part of 20 kPa that is borne."""
    assert 20.0 * run_of("cylinder").history()["time"][-1] == pytest.approx(13.62, abs=0.02)


def excavation():
    """About half of stage 8, to 2 m: 1.95 m stands."""
    assert run_of("excavation").history()["time"][-1] == pytest.approx(7.5, abs=0.25)


# Of runs in full, which a short form does not have.
IN_FULL = {"footing": footing, "slope": slope, "wall": wall, "hole": hole, "excavation": excavation}
NUMBERS = {
    **(IN_FULL if FULL else {}),
    "biaxial": biaxial,
    "specimen": specimen,
    "cyclic_shear": cyclic_shear,
    "cloud": cloud,
}


def test_the_notebook_runs_and_is_kept_without_results(program, tmp_path, monkeypatch):
    cells = json.loads((FOLDER / "figure.ipynb").read_text())["cells"]
    written = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not [cell for cell in written if cell["outputs"] or cell["execution_count"]]
    needed = "not installed: pip install -e './postproc[notebook]'"
    nbformat = pytest.importorskip("nbformat", reason=needed)
    nbclient = pytest.importorskip("nbclient", reason=needed)
    pytest.importorskip("ipykernel", reason=needed)
    monkeypatch.setenv("PERIGEO_BIN", str(program))
    for name in ("TMPDIR", "IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR"):
        monkeypatch.setenv(name, str(tmp_path))
    page = nbformat.read(FOLDER / "figure.ipynb", as_version=4)
    nbclient.NotebookClient(page, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    assert list(tmp_path.glob("*/radius.png"))
    results = [cell["outputs"] for cell in page.cells if cell["cell_type"] == "code"]
    said = "".join(out.get("text", "") for outputs in results for out in outputs)
    assert "yielded out to r = 1.424 m" in said
    for name, points, rings in (("radial", 0.15, 0.04), ("hoop", 0.17, 0.09)):
        found = re.search(rf"^{name} +points ([\d.]+), rings ([\d.]+)$", said, re.M)
        assert [float(value) for value in found.groups()] == pytest.approx(
            [points, rings], abs=0.01
        )


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.nml")), ids=lambda path: path.stem)
def test_every_input_of_limit_loads_is_right(path, perigeo, tmp_path):
    done = perigeo(["--check", path], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "the input is right" in done.stdout
