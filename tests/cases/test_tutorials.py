"""The tutorials can be followed from their page alone, in an empty folder."""

import re
import shlex
from pathlib import Path

import pytest
from perigeo_post.cli.command_line import main as perigeo_post

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "input" / "limit_loads"
PAGES = {path.stem: path.read_text() for path in (ROOT / "doc" / "tutorials").glob("*.md")}

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
}
SAID = {  # what the page has its reader look for in a log, or in what a command prints
    "footing": ("limit load", "footing: "),
    "slope": ("limit load: the last equilibrium is at", "with gravity of", "factor of safety"),
    "excavation": ("stage 'to_100_cm' begins", "stage 'to_195_cm' begins"),
}


def inputs(page):
    """Return what a page has its reader type: the text of each file."""
    parts = re.split(r"^```fortran\n(.*?)^```", page, flags=re.M | re.S)
    names = [re.findall(r"`(\w+\.nml)`", text)[-1] for text in parts[:-1:2]]
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


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_inputs_of_a_page_are_those_that_are_shipped(name, perigeo, tmp_path):
    for file, text in inputs(PAGES[name]).items():
        (tmp_path / file).write_text(text)
    runs = [words[1:] for words in commands(PAGES[name]) if words[0] == "bin/perigeo"]
    assert runs
    for file, *options in (words for words in runs if words[0] != "--check"):
        run, typed = as_used(perigeo, tmp_path / file, *options)
        assert f"input/limit_loads/{run}.nml" in PAGES[name]
        assert typed == as_used(perigeo, SHIPPED / f"{run}.nml")[1]


@pytest.mark.parametrize("name", sorted(PAGES))
def test_the_commands_of_a_page_run_in_an_empty_folder(
    name, program, perigeo, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PERIGEO_BIN", str(program))
    settings = [word for text in SHORT.get(name, ()) for word in ("--set", text)]
    typed = inputs(PAGES[name])
    for file, text in typed.items():
        Path(file).write_text(text)
    runs = re.findall(r"name = '(\w+)', title", "".join(typed.values()))
    results = {f"results/{run}/{run}.h5" for run in runs}
    said = ""
    for command, *words in commands(PAGES[name]):
        if command == "bin/perigeo":
            check = [] if settings else ["--check"]
            done = perigeo([*words, *check, *settings], tmp_path)
            assert done.returncode == 0, done.stderr
            said += done.stdout
            continue
        assert command == ".venv/bin/perigeo-post"
        if words[0] == "geometry":
            assert perigeo_post([*words, *settings]) == 0
        elif settings:
            assert perigeo_post(words) == 0
        else:
            assert words[1] in results
            continue
        said += capsys.readouterr().out
        assert all(Path(words[k + 1]).is_file() for k, word in enumerate(words) if word == "-o")
    assert not [text for text in SAID.get(name, ()) if text not in said]


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.nml")), ids=lambda path: path.stem)
def test_every_input_of_limit_loads_is_right(path, perigeo, tmp_path):
    done = perigeo(["--check", path], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "the input is right" in done.stdout
