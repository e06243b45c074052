"""What works without matplotlib, and what the parts of the package load."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import perigeo_post
from perigeo_post.study.results import measuring_files

FOLDERS = ("measure", "draw", "study", "report", "cli")
# An entry of None makes every import of that name fail.
WITHOUT = "import sys; sys.modules.update(matplotlib=None, PIL=None)\n"


def python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WITHOUT + code, *arguments], capture_output=True, text=True
    )


def test_the_reader_loads_no_other_folder_and_no_matplotlib() -> None:
    done = python(
        "import perigeo_post.read\n"
        "from perigeo_post import Run\n"
        f"print([f for f in {FOLDERS} if f'perigeo_post.{{f}}' in sys.modules])"
    )
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


@pytest.mark.parametrize("options", [["info"], ["curves", "--json"], ["band", "--json"]])
def test_commands_that_draw_nothing_work_without_matplotlib(
    result: Path, options: list[str]
) -> None:
    code = "from perigeo_post.cli.command_line import main\nsys.exit(main(sys.argv[1:]))"
    done = python(code, *options, str(result))
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_without_matplotlib_a_figure_cannot_be_drawn() -> None:
    """The tests above would pass for nothing if matplotlib could be imported there."""
    assert python("import perigeo_post.draw.style").returncode == 1
    assert python("from perigeo_post import save_figure").returncode == 1


@pytest.mark.parametrize(
    ("command", "gone"),
    [(["study", "a.toml"], "simpleeval"), (["study", "a.toml"], "pydantic"),
     (["report"], "pydantic")],
)  # fmt: skip
def test_a_command_without_its_extra_says_how_to_install_it(command: list[str], gone: str) -> None:
    code = (
        f"import sys; sys.modules[{gone!r}] = None\n"
        "from perigeo_post.cli.command_line import main\nsys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"perigeo-post: error: perigeo-post {command[0]} needs {gone}, which is")
    assert line.endswith(f"-m pip install './postproc[{command[0]}]'")


def test_every_public_name_is_found() -> None:
    assert {"Run", "measure_band", "save_figure", "run_study"} <= set(perigeo_post.__all__)
    for name in perigeo_post.__all__:
        assert getattr(perigeo_post, name) is not None
    assert not hasattr(perigeo_post, "nothing_of_this_name")


def test_a_study_is_measured_anew_after_changes_in_what_measures_only() -> None:
    package = Path(perigeo_post.__file__).parent
    found = {path.relative_to(package).as_posix() for path in measuring_files()}
    assert {"read/run.py", "measure/band.py", "study/measures.py"} <= found
    assert not [name for name in found if name.startswith(("draw/", "cli/", "report/"))]
