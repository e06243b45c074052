"""Inputs of all editors are read, and one mistake makes one message."""

import pytest
from case_files import SPECIMEN, changed
from test_input import MISTAKES, VALID

ALONE = {
    "decimal comma", "decimal commas in a pair", "long minus sign", "curly quotes",
    "velocity that is no number", "text for a number", "misspelt choice", "number out of range",
    "text without quotes", "too many values", "missing key", "negative spacing",
}  # fmt: skip


@pytest.mark.parametrize("mistake", sorted(ALONE))
def test_one_mistake_makes_one_message(run_case, tmp_path, mistake):
    old, new, _ = MISTAKES[mistake]
    done = run_case(VALID.replace(old, new, 1), tmp_path)
    assert done.stderr.count("error: ") == 1, done.stderr


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("velocity = 0.0, -0.01", "velocity = 0.0, 0.01"),  # apart
        ("&boundary name = 'bottom', side = 'bottom' /\n", ""),  # no platens
    ],
)
def test_platens_that_do_not_press_are_told_once(run_case, tmp_path, old, new):
    """Although final_strain, frame_strains and damping_frame all need them."""
    assert old in SPECIMEN
    done = run_case(SPECIMEN.replace(old, new), tmp_path, "--check")
    assert done.returncode == 2
    assert done.stderr.count("error: ") == 1, done.stderr


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_inputs_of_all_editors_are_read(run_case, tmp_path, encoding, line_end):
    text = VALID.replace("&run name", "&run title = 'Böschung', name").replace(" = ", "\xa0=\xa0")
    path = tmp_path / "run.nml"
    path.write_bytes(text.replace("\n", line_end).encode(encoding))
    done = run_case(path, tmp_path, "--check")
    assert done.returncode == 0, done.stderr


def test_a_blank_that_does_not_break_is_one_blank_in_a_text(run_case, tmp_path):
    text = VALID.replace("&run name", "&run title = 'Slope\xa0in\u202fclay', name")
    path = tmp_path / "run.nml"
    path.write_bytes(text.encode())
    done = run_case(path, tmp_path, "--print-input")
    assert "title = 'Slope in clay'" in done.stdout, done.stdout + done.stderr


SHORT = changed(SPECIMEN, final_strain="0.001", frame_strains=None)
SHORT = SHORT.replace("history_count = 100", "frame_count = 1")


@pytest.mark.parametrize("blanks", ["out ", " out", "out\xa0"])
def test_blanks_around_a_folder_do_not_belong_to_it(run_case, tmp_path, blanks):
    done = run_case(SHORT.replace("'out'", f"'{blanks}'"), tmp_path, "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "case.h5").exists()
    done = run_case(SHORT, tmp_path, "--quiet", "--output", "there ")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "there" / "case.h5").exists()


def test_a_tilde_is_the_home_folder(run_case, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    own = SHORT.replace("'out'", "'~/out'")
    assert run_case(own, tmp_path, "--quiet", HOME=home).returncode == 0
    assert (home / "out" / "case.h5").exists()
    options = ["--quiet", "--output=~/there"]
    assert run_case(SHORT, tmp_path, *options, HOME=home).returncode == 0
    assert (home / "there" / "case.h5").exists()
    options = ["--check", "--points=~/points.txt"]
    assert run_case(SHORT, tmp_path, *options, HOME=home).returncode == 0
    assert (home / "points.txt").exists()
    for text, known in ((own, ""), (own.replace("~/", "~nobody/"), home)):
        done = run_case(text, tmp_path, HOME=known)
        assert done.returncode == 5
        assert "the home folder is not known" in done.stderr
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("~")]


def test_a_single_row_of_points_gets_advice_that_helps(run_case, tmp_path):
    """A larger horizon does not: the whole body is on one line."""
    text = changed(SHORT, amplitude="0.0").replace(
        "horizon = 0.25", "horizon = 0.25, layout = 'cells'"
    )
    done = run_case(changed(text, x_max="0.1"), tmp_path, "--check")
    assert done.returncode == 3
    assert "point 1 at (0.05, -0.25) m: " in done.stderr
    assert "a smaller spacing where the body is a single row of points" in done.stderr
    finer = changed(text, x_max="0.1", spacing="0.05")
    assert run_case(finer, tmp_path, "--check").returncode == 0
