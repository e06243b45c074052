"""In the surroundings of others: notebooks, settings of matplotlib, terminals, damaged files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import synthetic

from perigeo_post import Run, curve_figure, history_curve, profile_figure, save_figure
from perigeo_post.cli.command_line import main
from perigeo_post.draw.style import readable
from perigeo_post.measure.measures import measure_band

Capture = pytest.CaptureFixture[str]
SETTINGS = """\
text.usetex: True
axes.formatter.use_locale: True
axes.facecolor: black
savefig.bbox: tight
image.origin: upper
font.size: 30
"""


def in_process(argv: list[object], **environment: str) -> subprocess.CompletedProcess[bytes]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("MPL", "LC_", "LANG"))}
    return subprocess.run(
        [sys.executable, *map(str, argv)], env={**kept, **environment},
        capture_output=True, check=False,
    )  # fmt: skip


def test_settings_of_others_change_no_figure(result: Path, tmp_path: Path) -> None:
    """A backend that is not there, LaTeX, another language, no home: the same bytes."""
    save_figure(curve_figure([history_curve(Run(result), "strain_energy")]), tmp_path / "one.png")
    (tmp_path / "matplotlibrc").write_text(SETTINGS)
    words = ["-m", "perigeo_post", "curves", result, "--column", "strain_energy"]
    done = in_process(
        [*words, "-o", tmp_path / "two.png"],
        MPLBACKEND="module://matplotlib_inline.backend_of_a_notebook",
        MATPLOTLIBRC=str(tmp_path), HOME="/dev/null", LC_ALL="C", PYTHONIOENCODING="ascii",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    assert (tmp_path / "two.png").read_bytes() == (tmp_path / "one.png").read_bytes()


def test_matplotlib_keeps_the_backend_of_the_user() -> None:
    """Also where the study engine, which draws, is imported first."""
    program = (
        "import perigeo_post.study, os, sys; assert 'matplotlib' in sys.modules; "
        "import matplotlib.pyplot as plt; print(plt.get_backend(), os.environ['MPLBACKEND'])"
    )
    done = in_process(["-c", program], MPLBACKEND="svg")
    assert done.stdout.decode().lower().split() == ["svg", "svg"], done.stderr.decode()


def test_a_terminal_without_the_letters_is_no_error(result: Path) -> None:
    title = "Böschung σ".encode()
    with h5py.File(result, "a") as file:
        file.attrs["title"] = np.bytes_(title)
        del file["input/namelist"]
        file["input/namelist"] = np.bytes_("&run title = 'Böschung' /\r\n".encode("latin-1"))
    argv = ["-m", "perigeo_post", "info", result]
    text = in_process(argv, PYTHONIOENCODING="ascii")
    assert text.returncode == 0, text.stderr.decode()
    assert b"made: B\\xf6schung \\u03c3" in text.stdout
    numbers = in_process([*argv, "--json"], PYTHONIOENCODING="latin-1")
    assert json.loads(numbers.stdout)["title"] == "Böschung σ"
    given = in_process([*argv, "--input"], PYTHONIOENCODING="ascii")
    assert given.stdout == b"&run title = 'B\xf6schung' /\r\n"
    assert Run(result).input_text == "&run title = 'Böschung' /\r\n"


def test_every_label_is_in_the_legend(result: Path, tmp_path: Path) -> None:
    """Also one that begins with "_", or has a "$" that begins no mathematics."""
    run = Run(result)
    labels = ["_old", "$\\frac$", "$m = 3$"]
    curves = [history_curve(run, "strain_energy", label=label) for label in labels]
    figure = curve_figure(curves)
    shown = [text.get_text().lstrip("\u200b") for text in figure.axes[0].get_legend().get_texts()]
    assert shown == ["_old", r"\$\frac\$", "$m = 3$"]
    save_figure(figure, tmp_path / "labels.png")
    found = measure_band(run)
    texts = profile_figure([found, found], labels[:2]).axes[0].get_legend().get_texts()
    assert len(texts) == 2
    assert readable("plain") == "plain"


DAMAGES: dict[str, Callable[[Any], None]] = {
    "points/position": lambda file: _put(file, "points/position", np.bytes_("text")),
    "places": lambda file: _put(file, "points/position", np.full((26 * 55, 2), np.nan)),
    "points/volume": lambda file: _put(file, "points/volume", np.zeros(7)),
    "points/boundary": lambda file: _put(file, "points/boundary", np.zeros((4, 2))),
    "plastic_strain": lambda file: _put(file, "frames/000003/plastic_strain", np.zeros(7)),
    "time": lambda file: file["frames/000003"].attrs.create("time", np.bytes_("late")),
    "history/strain": lambda file: _put(file, "history/strain", np.array([b"a", b"b"])),
    "history/time": lambda file: _put(file, "history/time", np.zeros(3)),
    "history": lambda file: _put(file, "history", np.zeros(3)),
    "input/namelist": lambda file: _put(file, "input/namelist", np.zeros(3)),
}


def _put(file: Any, key: str, value: Any) -> None:
    del file[key]
    file[key] = value


@pytest.mark.parametrize("what", DAMAGES)
def test_damage_gets_a_sentence(what: str, result: Path, capsys: Capture) -> None:
    synthetic.to_second_schema(result)
    with h5py.File(result, "a") as file:
        DAMAGES[what](file)
    said = []
    for words in (["band"], ["curves"], ["contours"], ["info"], ["info", "--input"]):
        status = main([words[0], str(result), *(words[1:] or ["--json"])])
        said += [line for line in capsys.readouterr().err.splitlines() if status != 0]
        assert status in (0, 2)
    assert all(line.startswith(f"perigeo-post: error: {result} is ") for line in said)
    assert said or what == "input/namelist"  # which is shown as it is


def test_the_history_beside_the_target_of_a_link_is_found(result: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    for name, target in (("made.h5", result), ("short.h5", Path("made.h5"))):
        (other / name).symlink_to(target)
        assert Run(other / name).history().rows == 400
    nearer = synthetic.write_history(other / "short_history.csv", rows=20)
    assert Run(other / "short.h5").history_path == nearer


@pytest.mark.parametrize("value", ["-2e5", "-.5", "-200000"])
def test_a_negative_number_is_a_value(value: str, result: Path, capsys: Capture) -> None:
    argv = ["contours", str(result), "--field", "stress_yy", "--frame", "1", "--min", value]
    assert main([*argv, "--json"]) == 0
    capsys.readouterr()
    assert main(["band", str(result), "--line", "-0.1", "5e-1", "1.1", "1.7", "--json"]) == 0
    assert main(["curves", str(result), "--json", "--mark", "-0.5%", "1%"]) == 0


def test_a_notebook_draws(result: Path) -> None:
    """In a kernel with the backend of notebooks, where the extras for it are installed."""
    nbformat = pytest.importorskip("nbformat")
    client = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    cell = nbformat.v4.new_code_cell(
        f"from perigeo_post import Run, stress_strain_figure\n"
        f"stress_strain_figure([Run({str(result)!r})])"
    )
    book = nbformat.v4.new_notebook(cells=[cell])
    client.NotebookClient(book, timeout=60).execute()
    assert "image/png" in book.cells[0].outputs[0].data
