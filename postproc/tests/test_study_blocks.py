"""Blocks of study files: settings that several places share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_study_file import BASE, HEAD, KINDS

from perigeo_post.study.file import Study, load_study
from perigeo_post.study.inputs import Inputs
from perigeo_post.study.program import find_program
from perigeo_post.study.toml import StudyError


@pytest.fixture
def load(tmp_path: Path) -> Any:
    (tmp_path / "base.nml").write_text(BASE)

    def read(text: str) -> Study:
        (tmp_path / "trial.toml").write_text(text)
        inputs = Inputs(lambda: find_program(None, Path(__file__)))
        return load_study(tmp_path / "trial.toml", KINDS, inputs)

    return read


def test_blocks_are_put_in_where_they_are_used_and_set_prevails(load: Any) -> None:
    block = "[block.short]\n'body.y_max' = '=height'\n'integration.damping' = 1.0e5\n"
    cases = (
        "[[case]]\nvalues = { height = 0.7 }\nuse = 'short'\n"
        "[[case]]\nvalues = { height = 0.8 }\nuse = ['short']\nset = { 'body.y_max' = 0.9 }\n"
        "[[case]]\nvalues = { height = 0.6 }\n"
    )
    found = [
        [run.values.numbers(*key)[0] for key in (("body", "y_max"), ("integration", "damping"))]
        for run in load(HEAD + block + cases).runs
    ]
    assert found == [[0.7, 1.0e5], [0.9, 1.0e5], [1.0, 5.0e5]]
    at_top = load("use = 'short'\n" + HEAD + "[parameters]\nheight = 0.5\n" + block).runs
    assert at_top[0].values.numbers("body", "y_max") == [0.5]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (HEAD + "use = 'b'\n[block.a]\n'body.x_min' = 1\n",
         'line 5, use: unknown block; found: "b"; allowed: a'),
        (HEAD + "use = 'a'\n[block.a]\n'body.x_mim' = 1\n",
         "line 7, block, a, \"body.x_mim\": unknown key, did you mean"),
        (HEAD + "[block.a]\n'body.x_min' = 0.1\n", 'line 5, block, a: nothing says use = "a"'),
        (HEAD + "[block.a]\n'run.name' = 'a'\n",
         "line 6, block, a, \"run.name\": is set by the study"),
    ],
)  # fmt: skip
def test_mistakes_with_blocks_are_found_with_their_place(load: Any, text: str, found: str) -> None:
    with pytest.raises(StudyError) as error:
        load(text)
    assert found in "\n".join(error.value.problems)
