"""Inputs of all editors are read, and one mistake makes one message."""

import pytest
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
