"""Wrong input: every mistake is named, the exit status is 2, and nothing is written."""

import json
import subprocess
import sys
from pathlib import Path

import h5py
import pytest
from case_files import uncontrolled

ROOT = Path(__file__).resolve().parents[2]

VALID = """\
&run name = 'case' /
&discretisation spacing = 0.1, horizon = 0.3 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', velocity = 0.0, -0.01 /
&integration final_strain = 0.001 /
&output frame_strains = 0.0005, 0.001 /
"""

# what is replaced in the valid file, by what, and what the message must hold
MISTAKES = {
    "misspelt group": ("&output", "&ouput", "&ouput: unknown group, did you mean 'output'?"),
    "misspelt key": ("spacing =", "spcing =", "unknown key, did you mean 'spacing'?"),
    "misspelt choice": ("'j2'", "'j3'", "unknown choice, did you mean 'j2'?"),
    "key of another group": ("x_min", "velocity", "it belongs to &boundary"),
    "text for a number": ("= 0.1,", "= 'abc',", "spacing: text where a number is due"),
    "word for a number": ("= 0.1,", "= abc,", "found: abc; allowed: > 0 [m]"),
    "not a number": ("= 0.1,", "= NaN,", "found: NaN; allowed: > 0 [m]"),
    "infinite number": ("= 0.1,", "= Infinity,", "found: Infinity; allowed: > 0 [m]"),
    "number too large": ("= 0.1,", "= 1e999,", "a number outside 1e-100 to 1e100 in magnitude"),
    "number out of range": ("= 0.3\n", "= 0.5\n", "found: 0.5; allowed: > -1 and < 0.5"),
    "negative spacing": ("= 0.1,", "= -0.1,", "line 2, &discretisation spacing: out of range"),
    "text without quotes": ("'j2'", "j2", "model: text must stand in quotes; found: j2"),
    "too many values": ("-0.01", "-0.01, 1.0", "velocity: too many values; found: 3 values"),
    "too few values": ("0.0, -0.01", "-0.01", "velocity: too few values; found: 1 value"),
    "decimal comma": ("= 0.1,", "= 0,1,", "the decimal sign is a point; found: 0,1; allowed: > 0"),
    "decimal comma in a list": ("= 0.0005,", "= 0,0005,", "the decimal sign is a point"),
    "decimal commas in a pair": ("0.0, -0.01", "0,5 -0,01", "the decimal sign is a point"),
    "long minus sign": ("-0.01", "\u22120.01", "a minus sign that is not that of the keyboard"),
    "curly quotes": ("'j2'", "\u2019j2\u2019", "a quotation mark that is not that of the keyboard"),
    "velocity that is no number": ("-0.01", "fast", "velocity: text where a number is due"),
    "missing slash": ("0.3 /\n&body", "0.3\n&body", "group &discretisation is not ended by /"),
    "last slash missing": ("0.001 /\n&output", "0.001 &output", "group &integration is not ended"),
    "missing quote": ("'case'", "'case", "a text without its closing quote"),
    "missing value": ("= 0.1,", "=", "&discretisation spacing has no value"),
    "missing key": ("spacing = 0.1, ", "", "spacing: the key is missing; allowed: > 0 [m]"),
    "missing group": ("&run name = 'case' /", "", "group &run is missing"),
    "key given twice": ("x_max", "x_min", "&body x_min is given twice"),
    "group given twice": ("&output", "&run name = 'b' /\n&output", "the group is given twice"),
    "value without a key": ("spacing = 0.1", "0.1", "a value without a key in &discretisation"),
    "text outside of groups": ("&output", "rubbish\n&output", "text outside of a group"),
    "name that is a path": ("'case'", "'../case'", "name: not a name; found: '../case'"),
    "later key": ("name = 'case'", "name = 'case', processes = 4", "processes: unknown key"),
    "extent off the lattice": ("x_max = 0.5", "x_max = 0.53", "allowed: nearest 0.5 or 0.6 [m]"),
    "horizon too small": ("= 0.3 /", "= 0.05 /", "the horizon is less than the spacing"),
    "no residual strength": (", residual_strength = 15.0e3", "", "residual_strength: the key is"),
    "two ends": ("final_strain", "end_time = 1, final_strain", "end of the run is given twice"),
    "platens apart": ("-0.01", "0.01", "the platens do not approach each other"),
    "strain in per cent": ("strain = 0.001", "strain = 1.6", "found: 1.6; allowed: > 0 and < 1"),
    "no platens": ("side = 'top'", "side = 'left'", "the key needs platens, and there are none"),
    "frame beyond the end": ("0.0005, 0.001", "0.002", "a frame beyond the end of the run"),
    "field without variation": (
        "&output",
        "&random_field coefficient_of_variation = 0.0, correlation_length = 0.3 / &output",
        "&random_field coefficient_of_variation: out of range; found: 0.0; allowed: > 0",
    ),
    "field of negative length": (
        "&output",
        "&random_field coefficient_of_variation = 0.2, correlation_length = -0.3 / &output",
        "&random_field correlation_length: out of range; found: -0.3; allowed: > 0 [m]",
    ),
    "field without a length": (
        "&output",
        "&random_field coefficient_of_variation = 0.2 / &output",
        "&random_field correlation_length: the key is missing; allowed: > 0 [m]",
    ),
    "seed that is no whole number": (
        "&output",
        "&random_field coefficient_of_variation=0.2, correlation_length=0.3, seed=1.5/ &output",
        "&random_field seed: not a whole number; found: 1.5; allowed: a whole number >= 0",
    ),
    "field for an elastic body": (
        "'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3\n",
        "'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /\n"
        "&random_field coefficient_of_variation = 0.2, correlation_length = 0.3 / ! ",
        "&random_field: a random field of the yield stress for a material that does not yield",
    ),
    "pressure on a platen": (
        "&output",
        "&pressure name = 'p', side = 'top', value = 1.0 /\n&output",
        "a pressure on a side with a boundary; found: 'top', where 'top' lies; allowed: a side",
    ),
    "pressure beyond its side": (
        "&output",
        "&pressure name = 'p', side = 'left', value = 1.0, span = 0.5, 1.2 /\n&output",
        "the span goes beyond the side; found: 0.5, 1.2; allowed: within 0.0 to 1.0 [m]",
    ),
    "pressure without a value": (
        "&output",
        "&pressure name = 'p', side = 'left' /\n&output",
        "&pressure value: the key is missing; allowed: any number [Pa]",
    ),
    "boundaries on parts of a side that overlap": (
        "&output",
        "&boundary name = 'one', side = 'left', span = 0.1, 0.5 /\n"
        "&boundary name = 'two', side = 'left', span = 0.4, 0.8 /\n&output",
        "two boundaries lie on the same side; found: 'left'; allowed: each side once, or spans",
    ),
    "boundary beyond its side": (
        "&output",
        "&boundary name = 'one', side = 'left', span = 0.5, 1.2 /\n&output",
        "the span goes beyond the side; found: 0.5, 1.2; allowed: within 0.0 to 1.0 [m]",
    ),
    "traction on a part of a side": (
        "&output",
        "&boundary name = 'one', side = 'left', span = 0.1, 0.5, traction = 1.0, 0.0 /\n&output",
        "a traction on a part of a side; found: both; allowed: a span or a traction",
    ),
    "gravity without an acceleration": (
        "&output",
        "&gravity acceleration = 0.0, 0.0 /\n&output",
        "&gravity acceleration: gravity without an acceleration; found: 0.0, 0.0; allowed: not 0",
    ),
    "initial stress without weight": (
        "&output",
        "&initial_stress unit_weight = 0.0, k0 = 0.5 /\n&output",
        "an initial stress without weight and surcharge; found: 0; allowed: unit_weight or",
    ),
    "initial stress without k0": (
        "&output",
        "&initial_stress unit_weight = 2.0e4 /\n&output",
        "&initial_stress k0: the key is missing; allowed: >= 0",
    ),
    "unit weight that is not that of gravity": (
        "&output",
        "&gravity acceleration = 0.0, -10.0 /\n"
        "&initial_stress unit_weight = 1.9e4, k0 = 0.5 /\n&output",
        "the unit weight is not that of gravity; found: 19000.0; allowed: 20000.0 [N/m^3], the den",
    ),
    "gravity that rises beside an initial stress": (
        "&output",
        "&gravity acceleration = 0.0, -10.0, ramp_time = 1.0 /\n"
        "&initial_stress unit_weight = 2.0e4, k0 = 0.5 /\n&output",
        "gravity that rises beside an initial stress that it makes; found: 1.0; allowed: 0: the",
    ),
    "gravity that does not point downwards": (
        "&output",
        "&gravity acceleration = 1.0, -10.0 /\n"
        "&initial_stress unit_weight = 2.0e4, k0 = 0.5 /\n&output",
        "an initial stress needs gravity that points downwards; found: 1.0, -10.0; allowed: 0 and",
    ),
    "surface below the body": (
        "&output",
        "&initial_stress unit_weight = 2.0e4, k0 = 0.5, surface_y = 0.5 /\n&output",
        "the body reaches above the surface of the ground; found: 0.5; allowed: at least the top",
    ),
    "pressure that is not that of the initial stress": (
        "&output",
        "&pressure name = 'p', side = 'left', value = 1.0e4 /\n"
        "&initial_stress unit_weight = 2.0e4, k0 = 0.5, surcharge = 1.0e4 /\n&output",
        "a load that acts from the start is not that of the initial stress; found: 10000.0; allow",
    ),
    "two probes of one name": (
        "&output",
        "&probe name = 'a', x = 0.1, y = 0.1 /\n&probe name = 'a', x = 0.2, y = 0.1 /\n&output",
        "&probe name: two probes have the same name; found: 'a'; allowed: each name once",
    ),
    "probe with the name of a boundary": (
        "&output",
        "&probe name = 'top', x = 0.1, y = 0.1 /\n&output",
        "&probe name: a probe has the name of a boundary; found: 'top'; allowed: each name once",
    ),
    "probe with the name of another column": (
        "&output",
        "&probe name = 'mean', x = 0.1, y = 0.1 /\n&output",
        "&probe name: a probe has the name of other columns; found: 'mean'",
    ),
    "height of a gradient that is not there": (
        "yield_stress = 0.15e6",
        "reference_y = 1.0, yield_stress = 0.15e6",
        "&material reference_y: the key has no effect without a gradient; allowed: leave it out",
    ),
    "motion and traction": (
        "velocity = 0.0, -0.01",
        "velocity = 0.0, -0.01, traction = 0.0, -1.0",
        "velocity: a motion beside a traction; found: both; allowed: a motion or a traction, or",
    ),
    "end of a load that is not there": (
        "-0.01 /",
        "-0.01, traction_until = 1 /",
        "traction_until: the key has no effect without traction",
    ),
    "end of a load before it is whole": (
        "velocity = 0.0, -0.01",
        "velocity = 0.0, -0.01, traction = 0.0, -1.0, ramp_time = 2.0, traction_until = 1.0",
        "traction_until: the traction ends before it is whole; found: 1.0; allowed: at least the",
    ),
    "traction along a smooth side": (
        "velocity = 0.0, -0.01",
        "contact = 'smooth', traction = 2.0, -1.0",
        "a smooth boundary carries no traction along its side; found: 2.0",
    ),
    "strain of a platen under a load": (
        "velocity = 0.0, -0.01",
        "traction = 0.0, -1.0",
        "&integration final_strain: a platen moves under a traction",
    ),
    "ramp without a load": ("-0.01 /", "-0.01, ramp_time = 1 /", "no effect without traction"),
    "weights of a cloud on a lattice": (
        "spacing = ",
        "cloud_weights = 'plain', spacing = ",
        "the key has no effect on a lattice",
    ),
    "material that is not there": (
        "y_max = 1.0",
        "y_max = 1.0, material = 'clay'",
        "&body material: unknown material; found: 'clay'; allowed: 'material'",
    ),
    "materials without names": (
        "&boundary",
        "&material model = 'elastic', density = 1.0, youngs_modulus = 1.0, poissons_ratio = 0.3 /\n"
        "&boundary",
        "&material name: the key is missing, it is needed where there are several materials",
    ),
    "cloud that is not there": (
        "x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0",
        "shape = 'file', file = 'none.txt'",
        "the file does not exist; found: 'none.txt'",
    ),
}


def everything_in(folder):
    """Return all paths under a folder with their contents."""
    return {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}


def assert_refused(done, folder, *parts):
    """Assert that a run was refused with these messages, and left nothing behind."""
    assert done.returncode == 2, done.stderr
    for part in parts:
        assert part in done.stderr
    for line in done.stderr.splitlines():
        assert line.startswith("perigeo: error: ")
    assert [path.name for path in folder.iterdir()] == ["run.nml"]


def test_the_valid_file_passes_the_check(run_case, tmp_path):
    done = run_case(VALID, tmp_path, "--check")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("options", [[], ["--check"]], ids=["run", "check"])
def test_a_mistake_is_named_and_nothing_is_written(run_case, tmp_path, mistake, options):
    old, new, part = MISTAKES[mistake]
    assert old in VALID
    done = run_case(VALID.replace(old, new, 1), tmp_path, *options)
    assert_refused(done, tmp_path, part)
    assert "run.nml" in done.stderr


def test_all_mistakes_are_listed_in_one_go(run_case, tmp_path):
    text = VALID
    names = ["misspelt group", "text for a number", "misspelt choice", "number out of range"]
    names += ["too many values", "name that is a path", "key given twice"]
    for name in names:
        text = text.replace(*MISTAKES[name][:2], 1)
    done = run_case(text, tmp_path)
    assert_refused(done, tmp_path, *(MISTAKES[name][2] for name in names))


def test_a_file_that_is_not_there_is_named(perigeo, tmp_path):
    done = perigeo(["none.nml"], tmp_path)
    assert done.returncode == 2
    assert "none.nml: the input file cannot be read" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_folder_is_not_an_input_file(perigeo, tmp_path):
    done = perigeo(["."], tmp_path)
    assert done.returncode == 2
    assert "the input file cannot be read" in done.stderr


@pytest.mark.parametrize("content", [b"", b"\0" * 5000, bytes(range(256)) * 5000, b"&" * 900000])
def test_a_file_that_is_no_namelist_is_refused(perigeo, tmp_path, content):
    (tmp_path / "run.nml").write_bytes(content)
    assert_refused(perigeo(["run.nml"], tmp_path, timeout=60), tmp_path)


def test_results_of_an_earlier_run_stay_when_the_input_is_wrong(run_case, tmp_path):
    results = tmp_path / "results" / "case"
    results.mkdir(parents=True)
    (results / "case.h5").write_text("earlier")
    (tmp_path / "run.nml").write_text(VALID.replace("'j2'", "'j3'"))
    before = everything_in(tmp_path)
    assert run_case(tmp_path / "run.nml", tmp_path, "--force").returncode == 2
    assert everything_in(tmp_path) == before


def test_the_reference_page_holds_the_tables_that_the_program_writes(program):
    page = ROOT / "doc" / "input.md"
    update = [sys.executable, ROOT / "tools" / "update_input_page.py", program, page, "--check"]
    done = subprocess.run(update, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_example_of_the_reference_page_is_right(run_case, tmp_path):
    page = (ROOT / "doc" / "input.md").read_text()
    example = page.split("## A complete example")[1].split("```fortran")[1].split("```")[0]
    done = run_case(example, tmp_path, "--check")
    assert done.returncode == 0, done.stderr


def test_the_reference_is_there_as_json(perigeo, tmp_path):
    done = perigeo(["--input-reference", "--json"], tmp_path)
    assert done.returncode == 0, done.stderr
    groups = {group["name"]: group for group in json.loads(done.stdout)["groups"]}
    assert groups["run"]["required"]
    assert not groups["run"]["repeats"]
    assert groups["material"]["repeats"]
    assert groups["material"]["sentence"]
    keys = {key["name"]: key for key in groups["discretisation"]["keys"]}
    assert keys["spacing"]["range"] == {
        "lower": 0.0, "lower_allowed": False, "upper": None, "upper_allowed": True,
    }  # fmt: skip
    assert keys["spacing"]["unit"] == "m"
    assert keys["spacing"]["required"]
    assert keys["layout"]["choices"] == ["nodes", "cells"]
    assert keys["layout"]["default"] == "nodes"
    names = {"name", "type", "count", "unit", "default", "default_means", "range", "choices"}
    for group in groups.values():
        for key in group["keys"]:
            assert set(key) == names | {"required", "sentence", "also"}
            assert key["sentence"]


def test_json_goes_with_the_reference(perigeo, run_case, tmp_path):
    done = run_case(VALID, tmp_path, "--json")
    assert done.returncode == 1
    assert "--json goes with --input-reference" in done.stderr


# --set, the part of the message
WRONG_SETTINGS = {
    "spacing=0.1": "--set spacing=0.1: no key with a value; allowed: group.key=value",
    "discretisation.spcing=0.1": "unknown key, did you mean 'spacing'?",
    "discretization.spacing=0.1": "unknown group, did you mean 'discretisation'?",
    "discretisation.spacing=abc": "--set discretisation.spacing=abc: text where a number is due",
    "material.density=-1": "--set material.density=-1: out of range; found: -1; allowed: > 0",
    "material.clay.density=1": "--set material.clay.density=1, &material model: the key is missing",
    "material.clay.density=": "the file has no such group; found: clay",
    "material.poissons_ratio=": "&material poissons_ratio: the key is missing",
    "boundary.top.contact=": "--set boundary.top.contact=: there is no such key to take out",
    "boundary.top=": "the key needs platens, and there are none; found: 1 boundaries",
    "boundary.velocity=0,1": "the file has several groups of this name; found: 2 groups",
    "boundary.top.velocity=1": "--set boundary.top.velocity=1: too few values",
    "material.density=1 /": "the value cannot be read; found: 1 /",
    "body.material=clay": "--set body.material=clay: unknown material; found: 'clay'",
}


@pytest.mark.parametrize("setting", WRONG_SETTINGS)
def test_a_wrong_setting_is_named(run_case, tmp_path, setting):
    done = run_case(VALID, tmp_path, "--set", setting)
    assert_refused(done, tmp_path, WRONG_SETTINGS[setting])


def test_a_setting_without_a_value_is_a_wrong_command_line(run_case, tmp_path):
    done = run_case(VALID, tmp_path, "--set", "--check")
    assert done.returncode == 1
    assert "a value is missing" in done.stderr


SETTINGS = ["run.title=it's soil", "boundary.top.velocity=0,-0.02", "body.1.x_max=1.0"]
SETTINGS += ["stabilisation.method=silling", "stabilisation.factor=0.5", "material.density=1800"]


def test_settings_take_out_keys_and_groups_and_add_groups(run_case, tmp_path):
    options = ["material.residual_strength=", "material.kinematic_modulus=", "output="]
    options += ["pressure.left.side=left", "pressure.left.value=5e4"]
    options = [word for setting in options for word in ("--set", setting)]
    done = run_case(VALID, tmp_path, *options, "--print-input")
    assert done.returncode == 0, done.stderr
    for line in ("kinematic_modulus = 0.0", "frame_count = 10", "name = 'left'", "value = 50000.0"):
        assert f"\n  {line}\n" in done.stdout
    assert "residual_strength" not in done.stdout
    assert "frame_strains" not in done.stdout


def test_what_is_printed_says_what_was_set_and_reads_back(run_case, tmp_path):
    options = [word for setting in SETTINGS for word in ("--set", setting)]
    done = run_case(VALID, tmp_path, *options, "--print-input")
    assert done.returncode == 0, done.stderr
    for line in ("title = 'it''s soil'", "velocity = 0.0, -0.02", "x_max = 1.0", "factor = 0.5"):
        assert f"\n  {line}\n" in done.stdout
    again = run_case(done.stdout, tmp_path, "--print-input")
    assert again.returncode == 0, again.stderr
    assert again.stdout == done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["run.nml"]


INPUTS = sorted((ROOT / "input").rglob("*.nml"))


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.stem)
def test_inputs_printed_read_back(perigeo, tmp_path, path):
    for cloud in path.parent.glob("*.txt"):
        (tmp_path / cloud.name).write_bytes(cloud.read_bytes())
    printed = perigeo(["--print-input", path], tmp_path)
    assert printed.returncode == 0, printed.stderr
    (tmp_path / "run.nml").write_text(printed.stdout)
    again = perigeo(["--print-input", "run.nml"], tmp_path)
    assert again.stdout == printed.stdout, again.stderr


def test_what_is_absent_is_the_control_that_lets_go(perigeo, tmp_path):
    (tmp_path / "run.nml").write_text(VALID)
    printed = perigeo(["--print-input", "run.nml"], tmp_path)
    assert "method = 'relaxing'" in printed.stdout


def test_an_input_of_equilibrium_printed_reads_back(perigeo, tmp_path):
    source = ROOT / "input" / "limit_loads" / "strip_footing.nml"
    options = ["--set", "integration.method=equilibrium", "--set", "integration.damping="]
    printed = perigeo(["--print-input", *options, source], tmp_path)
    assert printed.returncode == 0, printed.stderr
    (tmp_path / "run.nml").write_text(printed.stdout)
    again = perigeo(["--print-input", "run.nml"], tmp_path)
    assert again.stdout == printed.stdout, again.stderr


def test_a_run_with_settings_stores_them_beside_the_file(run_case, tmp_path):
    done = run_case(VALID, tmp_path, "--set", "material.density=1800", "--quiet")
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "results" / "case" / "case.h5") as results:
        assert results["input/namelist"][()] == uncontrolled(VALID).encode()
        values = [line.strip() for line in results["input/values"].asstr()[()]]
        assert "material.density = 1800.0" in values
        assert b"--set material.density=1800" in bytes(results.attrs["command_line"])
