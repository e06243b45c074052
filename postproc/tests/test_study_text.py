"""Study files of all editors."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_study_file import BASE, HEAD, KINDS

from perigeo_post.study.file import load_study
from perigeo_post.study.inputs import Inputs
from perigeo_post.study.program import find_program
from perigeo_post.study.toml import StudyError, read_toml


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1"])
@pytest.mark.parametrize("line_end", ["\r\n", "\r"])
def test_study_and_base_may_come_from_any_editor(
    encoding: str, line_end: str, tmp_path: Path
) -> None:
    def as_there(text: str) -> bytes:
        return text.replace(" = ", "\xa0=\xa0").replace("\n", line_end).encode(encoding)

    (tmp_path / "base.nml").write_bytes(as_there(BASE.replace("A base", "Böschung")))
    (tmp_path / "trial.toml").write_bytes(as_there(HEAD.replace("Trial", "Böschung")))
    study = load_study(
        tmp_path / "trial.toml", KINDS, Inputs(lambda: find_program(None, Path(__file__)))
    )
    assert study.title == "Böschung"
    assert study.runs[0].values.text().isascii() is False


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("set.discretisation.spacing = 0,05", "the decimal sign is a point"),
        ("title = \u201cA\u201d", "a quotation mark there is not that of the keyboard"),
        ("set.integration.damping = \u22125.0", "a minus sign there is not that of the keyboard"),
    ],
)
def test_what_was_meant_in_a_study_is_said(line: str, meant: str, tmp_path: Path) -> None:
    path = tmp_path / "trial.toml"
    path.write_text(HEAD.replace('title = "Trial"\n', "") + line + "\n", encoding="utf-8")
    with pytest.raises(StudyError, match=f"this is not TOML: .*{meant}$"):
        read_toml(path)
