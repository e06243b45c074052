"""Study files: the runs that they give, and every mistake found with its place."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from perigeo_post.draw.style import new_figure
from perigeo_post.study.file import Kinds, Study, load_study
from perigeo_post.study.inputs import Inputs
from perigeo_post.study.program import Program, find_program
from perigeo_post.study.toml import StudyError
from perigeo_post.study.types import Column, Drawing, Measure

BASE = """\
! A base.
&run name = 'base', title = 'A base' /
&discretisation spacing = 0.1, horizon = 0.25 /
&body x_min = 0.0, x_max = 0.5, y_min = 0.0, y_max = 1.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3   ! [SI]
  yield_stress = 0.15e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&integration final_strain = 0.01, damping = 5.0e5, damping_frame = 'platens' /
&imperfection amplitude = 1.0e-3, x = 0.0, y = 0.3, radius = 0.11 /
&output frame_strains = 0.004, 0.01, history_count = 70 /
"""
KINDS = Kinds(
    measures={
        "band": Measure({"width": Column("m", "width of the band")}, lambda run, state: {}),
        "peak": Measure({"peak_stress": Column("Pa", "largest")}, lambda run, state: {}),
    },
    figures={"plot": lambda runs, options, columns: Drawing(new_figure(10, 10))},
    options={"plot": ["x", "y", "only", "x_range", "strain", "tension_positive"]},
    needed={"plot": ["x", "y"]},
    columns={"plot": ["x", "y"]},
)
HEAD = 'name = "trial"\ntitle = "Trial"\nbase = "base.nml"\nmeasures = ["band"]\n'


@pytest.fixture(scope="module")
def program() -> Program:
    return find_program(None, Path(__file__))


@pytest.fixture
def inputs(program: Program) -> Inputs:
    return Inputs(lambda: program)


@pytest.fixture
def load(tmp_path: Path, inputs: Inputs) -> Any:
    (tmp_path / "base.nml").write_text(BASE)

    def read(text: str, base: str | None = None, kinds: Kinds = KINDS) -> Study:
        path = tmp_path / "trial.toml"
        path.write_text(text)
        if base is not None:
            (tmp_path / "base.nml").write_text(base)
        return load_study(path, kinds, inputs)

    return read


@pytest.fixture
def wrong(load: Any) -> Any:
    """Return a function that gives the mistakes found, without the path of the file."""

    def read(text: str, base: str | None = None) -> list[str]:
        with pytest.raises(StudyError) as caught:
            load(text, base)
        return [line.partition("trial.toml")[2].lstrip(", :") for line in caught.value.problems]

    return read


# ---- runs ------------------------------------------------------------------------------------


def test_every_combination_of_parameters_is_a_run(load: Any) -> None:
    study = load(HEAD + "[parameters]\ndelta = [0.2, 0.25]\nm = [1, 2, 3]\n")
    assert [run.id for run in study.runs][:4] == [
        "delta_0p2_m_1", "delta_0p2_m_2", "delta_0p2_m_3", "delta_0p25_m_1",
    ]  # fmt: skip
    assert study.runs[3].parameters == {"delta": 0.25, "m": 1}
    assert study.runs[3].label == "delta = 0.25, m = 1"
    assert study.series == (("trial", "Trial"),)
    assert list(study.columns)[5:] == [
        "delta", "m", "points", "steps", "width", "reasons",
    ]  # fmt: skip


def test_expressions_set_values_of_the_namelist(load: Any) -> None:
    study = load(
        HEAD + '[parameters]\nm = [4]\nspeed = [-0.02]\nhalf = "=m / 2"\nrough = true\n'
        '[set]\n"discretisation.spacing" = "=0.2 / m"\n'
        '"boundary.top.velocity" = [0.0, "=speed * half"]\n'
        "\"boundary.top.contact\" = \"='rough' if rough else 'smooth'\"\n"
        '"output.history_count" = "unset"\nimperfection = false\n'
        '[set.discretisation]\nlayout = "cells"\n'
        '[set.pressure.left]\nside = "left"\nvalue = 1e5\n'
    )
    (run,) = study.runs
    assert run.parameters == {"m": 4, "speed": -0.02, "half": 2.0, "rough": True}
    text = run.input_text("trial", "Trial", "results/trial/runs/x")
    for line in (
        "spacing = 0.05", "horizon = 0.25", "layout = 'cells'", "velocity = 0.0, -0.04",
        "contact = 'rough'", "amplitude = 0.0", "name = 'm_4_speed_m0p02'",
        "title = 'Trial: m = 4, speed = -0.02'", "output_dir = 'results/trial/runs/x'",
        "checkpoint_every = 60.0",
    ):  # fmt: skip
        assert f"\n  {line}\n" in text, line
    assert "&pressure\n  name = 'left'\n  side = 'left'\n  value = 100000.0\n" in text
    assert "history_count = 70" not in text
    assert "A base" not in text


def test_a_series_may_start_from_a_base_of_its_own(load: Any, tmp_path: Path) -> None:
    (tmp_path / "other.nml").write_text(BASE.replace("spacing = 0.1", "spacing = 0.05"))
    study = load(HEAD + "[[series]]\nname = 'a'\n[[series]]\nname = 'b'\nbase = 'other.nml'\n")
    first, second = (run.input_text("trial", "Trial", "x") for run in study.runs)
    assert "\n  spacing = 0.1\n" in first
    assert "\n  spacing = 0.05\n" in second


def test_a_title_and_checkpoints_that_are_asked_for_are_kept(load: Any) -> None:
    changes = "[set]\n'output.checkpoint_every' = 0\n'run.title' = 'Mine'\n"
    text = load(HEAD + changes).runs[0].input_text("trial", "Trial", "x")
    assert "\n  checkpoint_every = 0.0\n" in text
    assert "\n  title = 'Mine'\n" in text
    base = BASE.replace("&output", "&output checkpoint_every = 5.0,")
    assert "checkpoint_every = 5.0" in load(HEAD, base).runs[0].input_text("trial", "Trial", "x")


def test_cases_are_combined_with_parameters(load: Any) -> None:
    study = load(
        HEAD + '[parameters]\nm = [1, 2]\n[[case]]\nlabel = "rough, both"\n'
        'values = { contact = "rough" }\nset = { "boundary.top.contact" = "rough" }\n'
        '[[case]]\nvalues = { contact = "smooth" }\n'
    )
    assert [run.id for run in study.runs] == [
        "rough_both_m_1", "rough_both_m_2", "contact_smooth_m_1", "contact_smooth_m_2",
    ]  # fmt: skip
    assert study.runs[0].label == "rough, both, m = 1"
    assert study.runs[2].label == "contact = smooth, m = 1"
    assert study.runs[0].parameters == {"m": 1, "contact": "rough"}
    assert study.runs[0].values.text().count("contact = 'rough'") == 2
    assert study.runs[2].values.text().count("contact = 'rough'") == 1


def test_series_add_to_what_stands_at_the_top(load: Any) -> None:
    study = load(
        HEAD + 'label = "{m} of {case}"\nstrain = 0.004\n[parameters]\nm = [1, 2]\nn = 0.5\n'
        '[set]\n"material.youngs_modulus" = 1.0e6\n"discretisation.horizon" = "=n"\n'
        '[[series]]\nname = "one"\n'
        '[[series]]\nname = "two"\ntitle = "Two"\nstrain = 0.01\nmeasures = ["peak"]\n'
        'line = [[0, 0.5], ["=m", 1.5]]\nlabel = "m = {m}"\nparameters = { m = [3], n = 0.7 }\n'
        'set = { "material.youngs_modulus" = 2.0e6 }\n'
    )
    assert [run.id for run in study.runs] == ["one_m_1", "one_m_2", "two_m_3"]
    assert [run.label for run in study.runs] == ["1 of ", "2 of ", "m = 3"]
    assert [run.state.strain for run in study.runs] == [0.004, 0.004, 0.01]
    assert study.runs[2].state.line == ((0.0, 0.5), (3.0, 1.5))
    flat = load(HEAD + "line = [0, 0.5, 1, 1.5]\n").runs[0].state.line
    assert flat == ((0.0, 0.5), (1.0, 1.5))
    assert study.runs[0].measures == ("band",)
    assert study.runs[2].measures == ("band", "peak")
    assert "youngs_modulus = 2000000.0" in study.runs[2].values.text()
    assert "horizon = 0.7" in study.runs[2].values.text()
    assert study.series == (("one", "one"), ("two", "Two"))


def test_a_series_that_only_reads_other_points_shares_the_run(load: Any) -> None:
    read = "[[series]]\nname = 'read'\nsampled = '=0.2 / n'\nparameters = { n = [1, 2] }\n"
    study = load(HEAD + "[[series]]\nname = 'own'\n" + read)
    assert [run.state.sampled for run in study.runs] == [None, 0.2, 0.1]
    assert len({run.identity for run in study.runs}) == 1


def test_a_study_without_anything_varied_is_one_run(load: Any) -> None:
    (run,) = load(HEAD).runs
    assert (run.id, run.label) == ("trial", "Trial")


def test_names_of_runs_are_names_of_the_program_and_differ(load: Any) -> None:
    study = load(HEAD + '[parameters]\nword = ["δ", "ε", "A b", "a-b", 1e-5, -2, true]\n')
    names = [run.id for run in study.runs]
    assert names == [
        "word", "word_2", "word_a_b", "word_a_b_2", "word_1em05", "word_m2", "word_true",
    ]  # fmt: skip
    long = load(HEAD + f'[parameters]\nword = ["{"x" * 90}", "{"x" * 91}"]\n')
    names = [run.id for run in long.runs]
    assert len(set(names)) == 2
    assert max(map(len, names)) == 48


def test_runs_with_the_same_model_have_the_same_identity(load: Any) -> None:
    one = load(HEAD + "[parameters]\nm = [1, 2]\n").runs
    assert one[0].identity == one[1].identity
    base = BASE.replace("! A base.", "! B\n\n").replace(
        "name = 'base', title = 'A base'", "name = 'b'"
    )
    base = base.replace("&output", "&output checkpoint_every = 5.0,")
    other = load(HEAD.replace("Trial", "Other"), base).runs
    assert other[0].identity == one[0].identity
    changed = load(HEAD + "[set]\n'material.density' = 1.0\n").runs
    assert changed[0].identity != one[0].identity


def test_a_figure_has_its_options(load: Any) -> None:
    text = HEAD + (
        'tension_positive = true\n[parameters]\nm = [1, 2]\n[units]\nm = "mm"\n[[figure]]\n'
        'name = "w"\nkind = "plot"\nx = "m"\ny = ["width", "points"]\ntitle = "W"\nalt = "A"\n'
        "only = { m = 1 }\n"
    )
    (figure,) = load(text).figures
    assert (figure.name, figure.kind, figure.series) == ("w", "plot", ("trial",))
    assert figure.options == {
        "x": "m", "y": ["width", "points"], "only": {"m": 1}, "tension_positive": True,
    }  # fmt: skip
    assert load(text).columns["m"].unit == "mm"


# ---- mistakes --------------------------------------------------------------------------------

FIGURE = (
    'name = "w"\nkind = "plot"\nx = "m"\ny = "width"\ntitle = "W"\nalt = "A"\n'  # lines 7 to 12
)
SWEPT = HEAD + "[parameters]\nm = [1, 2]\n"  # lines 1 to 6
FINDING = '[[finding]]\ntitle = "F"\nfound = "{a}"\n'


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (HEAD + "mesures = 1\n", "line 5, mesures: unknown key, did you mean 'measures'?"),
        (HEAD.replace("trial", "Trial"), 'line 1, name: is no name; found: "Trial"; allowed: up'),
        (HEAD.replace('name = "trial"\n', ""), "name: the key name is missing"),
        (HEAD.replace("base.nml", "bass.nml"), "line 3, base: the base cannot be read: No such"),
        (HEAD.replace("band", "bend"), "line 4, measures: unknown measure, did you mean 'band'?"),
        (HEAD + 'strain = "1 %"\n', 'line 5, strain: must be a number; found: "1 %"'),
        (HEAD + "strain = 0.006\n", "line 5, strain: the run 'Trial' has no frame at this strain"),
        (HEAD + "line = [0, 1]\n", "line 5, line: must be two points"),
        (HEAD + "sampled = 0\n", "line 5, sampled: must be a number above 0"),
        (HEAD + "sampled = true\n", "line 5, sampled: must be a number above 0"),
        ("sampled = '=1 - m'\n" + SWEPT, "sampled: must be above 0, not 0"),
        (HEAD + "[parameters]\nm = []\n", "line 6, parameters, m: must have one value at least"),
        (HEAD + "[parameters]\nm = [1, 1]\n", "line 6, parameters, m: has the same value twice"),
        (HEAD + "[parameters]\nm = [[1]]\n", "line 6, parameters, m: must be numbers"),
        (HEAD + "[parameters]\nm = 2020-01-01\n", "line 6, parameters, m: must be a number"),
        (HEAD + "[parameters]\nrun = [1]\n", "line 6, parameters, run: cannot be the name"),
        (HEAD + "[parameters]\n'a b' = [1]\n", "line 6, parameters, a b: is no name"),
        (HEAD + '[parameters]\nm = "=n"\n', "line 6, parameters, m: 'n': unknown name n"),
        (HEAD + "[parameters]\n" + "".join(f"p{k} = [1, 2]\n" for k in range(10)),
         "line 5, parameters: more than 1000 runs; found: 1024"),
        (SWEPT + "[units]\nn = 'm'\n", "line 8, units, n: there is no such parameter"),
        (SWEPT + 'label = "{m}"\n', "line 7, parameters, label: "),
        ('label = "{n}"\n' + SWEPT, "line 1, label: unknown name {n}"),
        ('label = "same"\n' + SWEPT, "line 1, label: the runs m_1 and m_2 have the same label"),
        ('label = "{m:%q}"\n' + SWEPT, "line 1, label: is no label"),
        (HEAD + "[[case]]\nlabel = 'a'\n", "line 5, case 1: a case needs values, use or set"),
        (SWEPT + "[[case]]\nvalues = { m = 1 }\n", "line 8, case 1, values, m: m is one of"),
        (HEAD + "[[case]]\nvalue = { m = 1 }\n", "line 6, case 1, value: unknown key, did you"),
        (HEAD + "[set]\n'run.name' = 'a'\n", 'line 6, set, "run.name": is set by the study'),
        (HEAD + "[set]\n'a.b.c.d' = 1\n", 'line 6, set, "a.b.c.d": must be group.key'),
        (HEAD + "[set]\n'boundary.side' = 1\n", 'line 6, set, "boundary.side": the file has '
         "several groups of this name; found: 2 groups &boundary; allowed: boundary.name.side"),
        (HEAD + "[set]\nimperfections = false\n", "line 6, set, imperfections: unknown group, "
         "did you mean 'imperfection'?; found: imperfections"),
        (HEAD + "[set]\nimperfection = 1\n", "set, imperfection: is a group: only false"),
        (HEAD + "[set]\n'body.x_mim' = 'unset'\n", 'line 6, set, "body.x_mim": the file has no '
         "such group; found: x_mim; allowed: a name of &body or 1 to 1"),
        (HEAD + "[set]\n'body.x_mim' = 1\n", "set, \"body.x_mim\": unknown key, did you mean"),
        (HEAD + "[parameters]\nrho = [1, -2]\n[set]\n'material.density' = '=rho'\n",
         'line 8, set, "material.density": out of range; found: -2; allowed: > 0'),
        (HEAD + "[set]\n'integration.final_strain' = 'unset'\n",
         "line 3, base: the base with the settings of a run: "),
        (HEAD + "[set]\n'body.x_min' = []\n", "an empty list is no value"),
        (HEAD + "[set]\n'body.x_min' = '=1 +'\n", "'1 +' is no expression"),
        (HEAD + "[set]\n'body.x_min' = '=1 / 0'\n", "'1 / 0': division by zero"),
        (HEAD + "[[series]]\nname = 'a'\n[[series]]\nname = 'a'\n", "line 8, series 2, name: two"),
        (HEAD + "[[series]]\nname = 'a'\nbas = 'b'\n", "line 7, series 1, bas: unknown key"),
        (HEAD + "[[series]]\nname = 'a'\nbase = 'b'\n",
         "line 7, series 1, base: the base cannot be read: No such"),
        (SWEPT + "[figure]\n" + FIGURE, "line 7, figure: must be a list of tables"),
        (SWEPT + "[[figure]]\n" + FIGURE.replace("plot", "polt"),
         "line 9, figure 1, kind: unknown kind of figure, did you mean 'plot'?"),
        (SWEPT + "[[figure]]\n" + FIGURE.replace("alt", "atl"), "figure 1: the key alt is missing"),
        (SWEPT + "[[figure]]\n" + FIGURE.replace("y =", "yy ="), "figure 1: the key y is missing"),
        (SWEPT + "[[figure]]\n" + FIGURE.replace("width", "wdith"),
         "line 11, figure 1, y: unknown column, did you mean 'width'?"),
        (SWEPT + "[[figure]]\n" + FIGURE + "only = { n = 1 }\n",
         "line 14, figure 1, only, n: unknown key"),
        (SWEPT + "[[figure]]\n" + FIGURE + "x_range = [1]\n",
         "line 14, figure 1, x_range: must be [low, high]; found: [1]"),
        (SWEPT + "[[figure]]\n" + FIGURE + "strain = [0.004, 0.02]\n",
         "strain: none of its runs has a frame at this strain; found: 0.02; allowed: 0.004, 0.01"),
        (SWEPT + "[[figure]]\n" + FIGURE + "series = ['a']\n",
         'line 14, figure 1, series: unknown series; found: "a"; allowed: trial'),
        (SWEPT + 2 * ("[[figure]]\n" + FIGURE), "line 15, figure 2, name: the name is taken"),
        (SWEPT + FINDING + "values = { a = 1 }\nholds = 'a > 0'\n", "values, a: must be an expr"),
        (SWEPT + FINDING + "values = { a = \"max(col('widht'))\" }\nholds = 'a > 0'\n",
         "unknown column widht, did you mean 'width'?"),
        (SWEPT + FINDING + "values = { a = \"val('width', n=1)\" }\nholds = 'a > 0'\n",
         "unknown parameter n; allowed: series, run, label, m"),
        (SWEPT + FINDING + "values = { a = \"val('width')\" }\nholds = 'a > 0'\n",
         "val needs one run, this means 2"),
        (SWEPT + FINDING + "values = { a = \"val('width', m=3)\" }\nholds = 'a > 0'\n",
         "no run of the study is meant by this val"),
        (SWEPT + FINDING + "values = { a = \"val(m, m=1)\" }\nholds = 'a > 0'\n",
         "unknown name m"),
        (SWEPT + FINDING + "values = { a = \"col(3)\" }\nholds = 'a > 0'\n", "column in quotes"),
        (SWEPT + FINDING + "values = { a = \"maxx(1)\" }\nholds = 'a > 0'\n",
         "unknown function maxx, did you mean 'max'?"),
        (SWEPT + FINDING + "values = { b = '1' }\nholds = 'b > 0'\n",
         "line 9, finding 1, found: unknown name {a}"),
        (SWEPT + FINDING + "values = { a = '1' }\nholds = 'c > 0'\n",
         "line 11, finding 1, holds: 'c > 0': unknown name c"),
        (SWEPT + FINDING + "values = { a = '1' }\n", "holds: a finding needs a test"),
        (SWEPT + FINDING + "paper = 'P'\nclaim = 'C'\nvalues = { a = '1' }\nholds = 'a > 0'\n",
         "claim: stands beside paper: a finding is about the paper or goes beyond it"),
    ],
)  # fmt: skip
def test_mistakes_are_named_with_their_place(wrong: Any, text: str, found: str) -> None:
    assert any(found in line for line in wrong(text)), wrong(text)


def test_all_mistakes_are_found_at_once(wrong: Any) -> None:
    text = SWEPT.replace("band", "bend").replace("Trial", "") + (
        "[set]\n'body.x_mim' = 'unset'\n'body.z' = '=n'\n"
        "[[figure]]\nname = 'w'\nkind = 'polt'\ntitle = 'W'\n" + FINDING
    )
    found = wrong(text)
    assert len(found) == 7, found
    for word in ("bend", "x_mim", "unknown name n", "polt", "alt is missing", "{a}", "a test"):
        assert any(word in line for line in found), word


def test_what_is_wrong_does_not_hide_what_else_is_wrong(wrong: Any) -> None:
    """A mistake of form in each table, and beside it one that only the rest of it shows."""
    text = HEAD.replace('["band"]', '[2, "bend", 3, "peek"]') + (
        'strain = "1 %"\nextra = 1\n[parameters]\nm = [1, 2]\nrun = 1\n'
        "[set.body]\nx_mim = 'unset'\nx_min = 2020-01-01\n"
        "[[case]]\nlabel = 3\nset = { 'body.y_mim' = 'unset' }\n"
        "[[figure]]\nname = 'W'\nkind = 'plot'\nx = 1\ny = 'wdith'\ntitle = ''\n"
        "[[finding]]\ntitle = 'F'\nfound = '{b}'\nvalues = { a = 1, c = 'n' }\n"
        "holds = ['1 +', 'd']\n"
    )
    expected = [
        "line 4, measures: must be a text; found: 3",
        "line 4, measures: unknown measure, did you mean 'band'?; found: \"bend\"",
        "line 4, measures: unknown measure, did you mean 'peak'?; found: \"peek\"",
        "line 5, strain: must be a number",
        "line 6, extra: unknown key",
        "line 9, parameters, run: cannot be the name",
        'line 11, set, "body.x_mim": the file has no such group',
        'line 12, set, "body.x_min": must be a number, a text or a list of them; found: 2020-01-01',
        "line 14, case 1, label: must be a text; found: 3",
        'line 15, case 1, set, "body.y_mim": the file has no such group',
        "line 17, figure 1, name: is no name",
        "line 19, figure 1, x: must be a text; found: 1",
        'line 20, figure 1, y: unknown column; found: "wdith"',
        "line 21, figure 1, title: must not be empty",
        "line 16, figure 1: the key alt is missing",
        "line 24, finding 1, found: unknown name {b}",
        "line 25, finding 1, values, a: must be an expression, a text; found: 1",
        "line 25, finding 1, values, c: 'n': unknown name n",
        "line 26, finding 1, holds: '1 +' is no expression",
        "line 26, finding 1, holds: 'd': unknown name d",
    ]
    found = wrong(text)
    for line in expected:
        assert any(one.startswith(line) for one in found), (line, found)


@pytest.mark.parametrize(
    ("base", "found"),
    [
        ("&run name = 'a'\n", "group &run is not ended by /"),
        ("run name = 'a' /\n", "line 1: text outside of a group; found: run name"),
        ("&run\n name 'a' /\n", "line 2: a key without = in &run; found: name 'a'"),
        ("&run\n name = 'a\n/\n", "line 2: name: a text without its closing quote"),
        ("&run a = 1\n a = 2 /\n", "line 2: &run a is given twice"),
        ("&run a = 1\n&body /\n", "line 1: group &run is not ended by /"),
    ],
)
def test_mistakes_of_the_base_are_named(wrong: Any, base: str, found: str) -> None:
    line = wrong(HEAD, base)[0]
    assert line.startswith("line 3, base: the base has a mistake: ")
    assert found in line


def test_a_file_of_points_must_be_there(wrong: Any) -> None:
    base = BASE.replace("&body ", "&body shape = 'file', file = 'points.txt', ")
    assert any(
        line.startswith("line 3, base: the base has a mistake: line 4, &body file: the file does")
        for line in wrong(HEAD, base)
    )


def test_a_file_of_points_may_lie_beside_the_study(load: Any, tmp_path: Path) -> None:
    points = [
        f"{0.1 * i} {0.1 * j} 0.01" + (" bottom" if j < 3 else " top" if j > 8 else "")
        for i in range(6)
        for j in range(12)
    ]
    (tmp_path / "points.txt").write_text("\n".join(points) + "\n")
    (tmp_path / "input").mkdir()
    base = BASE.replace("&body ", "&body shape = 'file', file = 'points.txt', ")
    (tmp_path / "input" / "base.nml").write_text(base)
    (run,) = load(HEAD.replace("base.nml", "input/base.nml")).runs
    assert run.files == {"points.txt": tmp_path / "points.txt"}


def test_what_is_no_toml_is_one_mistake(wrong: Any, inputs: Inputs, tmp_path: Path) -> None:
    (line,) = wrong(HEAD + "a = \n")
    assert "this is not TOML" in line
    assert "line 5" in line
    with pytest.raises(StudyError, match="cannot be read: No such file"):
        load_study(tmp_path / "nothing.toml", KINDS, inputs)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StudyError, match="this is not TOML"):
        load_study(tmp_path / "binary.toml", KINDS, inputs)


def test_measures_may_not_take_the_name_of_a_parameter(load: Any) -> None:
    measures = {"band": Measure({"m": Column("1", "?")}, lambda run, state: {})}
    with pytest.raises(StudyError, match="'band' gives a column 'm', which is there"):
        load(SWEPT, None, dataclasses.replace(KINDS, measures=measures))
