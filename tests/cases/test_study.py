"""Studies from end to end: runs made, skipped, stopped, continued, failed, made anew."""

import csv
import dataclasses
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from case_files import SPECIMEN
from conftest import ROOT
from perigeo_post import RequestError, StudyError, StudyOptions, run_study
from perigeo_post.cli.command_line import main
from perigeo_post.draw.style import new_figure
from perigeo_post.measure import curves
from perigeo_post.study.checked import mistakes
from perigeo_post.study.figures import FIGURE_OPTIONS
from perigeo_post.study.file import Kinds
from perigeo_post.study.jobs import only_one
from perigeo_post.study.measures import MEASURES
from perigeo_post.study.tables import OPTIONS, FigureOptions
from perigeo_post.study.types import Column, Drawing, Measure, Missing
from pydantic import ValidationError

BASE = SPECIMEN.replace("output_dir = 'out'", "title = 'a specimen'")
STUDY = """\
name = "trial"
title = "Young's modulus"
base = "base.nml"
measures = ["peak"]
label = "E = {E:g} MPa"
[parameters]
E = [40.0, 50.0, 60.0]
[units]
E = "MPa"
[set]
"material.youngs_modulus" = "=E * 1e6"
[[figure]]
name = "peaks"
kind = "blank"
title = "Peak stress"
alt = "Nothing to be seen."
[[finding]]
title = "Peak"
paper = "The peak does not depend on the modulus."
values = { ratio = "ratio(col('peak_stress'))" }
found = "it varies by a factor of {ratio:.2f}"
holds = ["ratio < 1.2", "len(col('peak_stress')) == 3"]
"""
# Slow enough to be stopped half way.
SLOW = (
    STUDY
    + """\
[set.boundary.top]
velocity = [0.0, -0.0006]
[set.discretisation]
spacing = 0.05
horizon = 0.16
"""
)


def peak_stress(run, state):
    stress, strain = curves.peak(curves.stress_strain(run))
    return {"peak_stress": stress, "strain_at_peak": strain}


def blank(runs, options, columns):
    return Drawing(new_figure(20, 20), [{"run": run.id, **run.row} for run in runs])


KINDS = Kinds(
    measures={
        "peak": Measure(
            {"peak_stress": Column("Pa", "largest"), "strain_at_peak": Column("1", "there")},
            peak_stress,
        )
    },
    figures={"blank": blank},
    options={"blank": ["x"]},
)


@pytest.fixture
def do(program, tmp_path, monkeypatch):
    """Return a function do(text): does a study in a fresh folder; gives its status and words."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "base.nml").write_text(BASE)

    def run(text=STUDY, kinds=KINDS, **options):
        Path("trial.toml").write_text(text)
        words = io.StringIO()
        given = StudyOptions(**{"program": program, **options})
        status = run_study(Path("trial.toml"), given, kinds, words)
        return status, words.getvalue()

    return run


def rows(folder="results/trial"):
    with open(Path(folder, "trial.csv"), newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def report(folder="results/trial"):
    return json.loads(Path(folder, "study.json").read_text(encoding="utf-8"))


def made(folder="results/trial"):
    """When the result of every run was written."""
    paths = sorted(Path(folder, "runs").glob("*/*.h5"))
    return {path.stem: path.stat().st_mtime_ns for path in paths if "checkpoint" not in path.stem}


def stand_in(path, program, version="9.9 (abc)", before="", after=""):
    """A program of another version that lets the real one do the work."""
    path.write_text(
        f'#!/bin/sh\nif [ "$1" = --version ]; then echo "perigeo {version}"; exit; fi\n'
        f'{before}\nexec "{program}" "$@"\n{after}'
    )
    path.chmod(0o755)
    return path


def without_times(data):
    return {k: v for k, v in data.items() if k not in ("created", "seconds", "fingerprint", "runs")}


# ---- from end to end -------------------------------------------------------------------------


def test_a_study_gives_a_table_figures_findings_and_a_report(do):
    status, words = do()
    assert status == 0, words
    assert [row["E"] for row in rows()] == ["40", "50", "60"]
    assert [row["run"] for row in rows()] == ["e_40", "e_50", "e_60"]
    assert {row["status"] for row in rows()} == {"done"}
    assert all(150e3 < float(row["peak_stress"]) < 260e3 for row in rows())
    assert float(rows()[0]["strain_at_peak"]) > float(rows()[2]["strain_at_peak"])
    with open("results/trial/trial_columns.csv", newline="") as file:
        about = {row["column"]: row["unit"] for row in csv.DictReader(file)}
    assert list(about) == list(rows()[0])
    assert (about["E"], about["peak_stress"]) == ("MPa", "Pa")
    for ending in ("png", "pdf", "csv"):
        assert Path("results/trial", f"peaks.{ending}").stat().st_size > 100

    data = report()
    assert data["complete"] is True
    assert [run["label"] for run in data["runs"]] == ["E = 40 MPa", "E = 50 MPa", "E = 60 MPa"]
    assert data["findings"][0]["verdict"] == "agrees"
    assert data["findings"][0]["holds"][1] == ["len(col('peak_stress')) == 3", True]
    assert data["units"]["peak_stress"] == "Pa"
    assert "agrees: Peak" in words
    assert "3 computed" in words
    for run in data["runs"]:
        text = Path("results/trial", run["input"]).read_text()
        assert "output_dir = 'results/trial/runs/" in text
        assert f"youngs_modulus = {run['parameters']['E'] / 10:.1f}e7\n" in text
        assert run["points"] > 50
        assert run["steps"] > 100
        assert run["seconds"] > 0.0
        assert run["input_sha256"]
        assert not list(Path("results/trial/runs", run["id"]).glob("*checkpoint*"))


def test_the_report_has_no_absolute_path(do, tmp_path):
    do(output=tmp_path / "elsewhere")
    text = (tmp_path / "elsewhere" / "study.json").read_text()
    assert str(tmp_path) not in text
    assert not re.search(r'"/', text)


def test_what_is_done_is_not_done_again(do):
    do()
    before, files = made(), {p: p.stat().st_mtime_ns for p in Path("results").rglob("*.*")}
    status, words = do()
    assert status == 0
    assert made() == before
    assert "3 there already" in words
    assert "computed" not in words
    after = {p: p.stat().st_mtime_ns for p in Path("results").rglob("*.*")}
    assert {p.name for p in after if after[p] != files.get(p)} <= {".lock"}


def test_a_new_label_draws_anew_but_runs_nothing(do):
    do()
    before = made()
    do(STUDY.replace("E = {E:g} MPa", "{E:g} MPa"))
    assert made() == before
    assert rows()[0]["label"] == "40 MPa"


def test_only_the_run_whose_input_has_changed_is_made_anew(do):
    do()
    before = made()
    status, words = do(STUDY.replace('= "=E * 1e6"', '= "=E * 1e6 if E != 50 else 51e6"'))
    assert status == 0
    assert {"e_40", "e_60"} == {run for run in before if before[run] == made()[run]}
    assert "1 computed" in words
    assert "youngs_modulus = 5.1e7" in Path("results/trial/runs/e_50/e_50.nml").read_text()


def test_a_new_value_leaves_the_other_runs_alone(do):
    do()
    before = made()
    do(STUDY.replace("50.0", "45.0, 50.0").replace("== 3", "== 4"))
    assert before.items() <= made().items()
    assert [row["run"] for row in rows()] == ["e_40", "e_45", "e_50", "e_60"]


def test_another_version_of_the_program_makes_all_anew(do, program, tmp_path):
    do()
    before = made()
    other = stand_in(tmp_path / "other", program)
    _, words = do(program=other)
    assert "3 computed" in words
    assert not {run for run in before if before[run] == made()[run]}
    assert report()["program_version"] == "perigeo 9.9 (abc)"
    _, words = do(program=other)
    assert "3 there already" in words


def test_a_program_of_an_unknown_version_is_known_by_its_contents(do, program, tmp_path):
    for after, expected in (("", "3 computed"), ("", "3 there already"), ("# new", "3 computed")):
        other = stand_in(tmp_path / "other", program, "9.9 (abc-dirty)", after=after)
        assert expected in do(program=other)[1]


def test_runs_that_compute_the_same_are_made_once(do):
    text = STUDY.replace('label = "E = {E:g} MPa"', "").replace("== 3", "== 4")
    text = text.replace("[parameters]\nE = [40.0, 50.0, 60.0]", "")
    text += """
[[series]]
name = "first"
parameters = { E = [40.0, 50.0] }
[[series]]
name = "second"
title = "The second"
parameters = { E = [50.0, 60.0] }
"""
    status, words = do(text)
    assert status == 0, words
    assert "3 computed" in words
    assert [row["run"] for row in rows()] == [
        "first_e_40", "first_e_50", "second_e_50", "second_e_60",
    ]  # fmt: skip
    assert rows()[1]["peak_stress"] == rows()[2]["peak_stress"]
    assert report()["runs"][2]["result"] == "runs/first_e_50/first_e_50.h5"
    assert report()["series"][1] == {"name": "second", "title": "The second"}


# ---- runs that fail --------------------------------------------------------------------------

UNSTABLE = (
    STUDY.replace("E = [40.0, 50.0, 60.0]", "E = 50.0\nsafety = [2.0, 10.0]").replace(
        "E = {E:g} MPa", "safety {safety:g}"
    )
    + """
[set.integration]
time_step_rule = "courant"
safety = "=safety"
"""
)


def test_one_failing_run_does_not_stop_the_others(do):
    status, words = do(UNSTABLE)
    assert status == 4
    assert [row["status"] for row in rows()] == ["done", "failed"]
    assert rows()[1]["peak_stress"] == ""
    failed = report()["runs"][1]
    assert failed["exit_status"] == 4
    assert "the calculation failed" in failed["message"]
    assert "point" in failed["message"]
    assert "FAILED    safety_10" in words
    assert report()["complete"] is False
    assert report()["figures"]
    # It would fail again: not tried, but not forgotten either.
    before = made()
    status, words = do(UNSTABLE)
    assert status == 4
    assert made() == before
    assert "--redo" in words
    assert "FAILED    safety_10" in words
    do(UNSTABLE, redo=True, only=["safety_10"])
    assert made()["safety_2"] == before["safety_2"]
    assert made()["safety_10"] > before["safety_10"]


def test_a_wrong_input_is_reported_with_its_place_and_the_words_of_the_program(do):
    with pytest.raises(StudyError) as caught:
        do(STUDY.replace('= "=E * 1e6"', "= \"=E * 1e6 if E > 45 else 'soft'\""))
    assert caught.value.problems == [
        'trial.toml, line 11, set, "material.youngs_modulus": text where a number is due; '
        "found: 'soft'; allowed: > 0 [Pa]"
    ]
    assert not Path("results").exists()


def test_a_run_whose_model_is_refused_is_reported_with_the_words_of_the_program(
    do, program, tmp_path
):
    no = 'case "$*" in --check*/e_40.nml) echo "perigeo: error: no such thing" >&2; exit 3 ;; esac'
    status, words = do(program=stand_in(tmp_path / "other", program, before=no))
    assert status == 4
    assert [row["status"] for row in rows()] == ["failed", "done", "done"]
    failed = report()["runs"][0]
    assert failed["exit_status"] == 3
    assert failed["message"] == "no such thing"
    assert "FAILED" in words
    # Missing numbers make no verdict out of two of three.
    assert report()["findings"][0]["verdict"] == "agrees in part"


def test_a_measure_or_figure_that_breaks_does_not_cost_the_others(do):
    def broken(*_):
        raise ZeroDivisionError("nothing there")

    peak = KINDS.measures["peak"]
    other = Measure({"other": Column("1", "never there")}, broken)
    kinds = dataclasses.replace(
        KINDS,
        measures={"peak": peak, "other": other},
        figures={"blank": blank, "broken": broken},
    )
    text = STUDY.replace('["peak"]', '["other", "peak"]')
    text += '[[figure]]\nname = "b"\nkind = "broken"\ntitle = "B"\nalt = "B"\n'
    status, words = do(text, kinds)
    assert status == 4
    assert rows()[0]["other"] == ""
    assert rows()[0]["peak_stress"] != ""
    assert [figure["name"] for figure in report()["figures"]] == ["peaks"]
    assert "figure b cannot be drawn: ZeroDivisionError: nothing there" in " ".join(words.split())
    assert "other cannot be measured" in words


def test_a_value_that_is_missing_has_its_reason_wherever_it_is_shown(do, tmp_path):
    def far(run, state):
        return {"slope": Missing(f"{run.path} ends too early"), "size": 1.0, "void": Missing("?")}

    columns = {name: Column("1", name) for name in ("slope", "size", "void", "forgotten")}
    text = STUDY.replace('["peak"]', '["peak", "far"]')
    kinds = dataclasses.replace(KINDS, measures={**KINDS.measures, "far": Measure(columns, far)})
    status, words = do(text, kinds, output=tmp_path / "elsewhere")
    assert status == 0, words
    first = report(tmp_path / "elsewhere")["runs"][0]
    assert first["row"]["slope"] is None
    assert first["reasons"] == {
        "slope": "e_40.h5 ends too early", "void": "?", "forgotten": "far does not give it",
    }  # fmt: skip
    row = rows(tmp_path / "elsewhere")[0]
    assert (row["slope"], row["size"]) == ("", "1")
    assert row["reasons"] == (
        "slope: e_40.h5 ends too early; void: ?; forgotten: far does not give it"
    )
    assert "  no value\n    slope: e_40: e_40.h5 ends too early\n" in words
    assert "    void: e_40, e_50, e_60: ?\n" in words
    page = tmp_path / "report.html"
    main(["report", "--results", str(tmp_path), "-o", str(page)])
    assert "e_40.h5 ends too early" in page.read_text()


def test_a_program_that_is_killed_counts_as_failed_and_is_tried_again(do, program, tmp_path):
    killed = 'case "$*" in --quiet*e_50*) kill -9 $$ ;; esac'
    status, words = do(program=stand_in(tmp_path / "other", program, before=killed))
    assert status == 4
    assert "ended by signal 9" in words
    status, words = do(program=stand_in(tmp_path / "other", program))
    assert status == 0
    assert "1 computed, 2 there already" in re.sub(r" \([^)]*\)", "", words)


# ---- options ---------------------------------------------------------------------------------


def test_a_dry_run_says_what_would_be_done_and_runs_nothing(do):
    status, words = do(dry_run=True)
    assert status == 0
    assert "3 of 3 runs to be made" in words
    assert re.search(r"e_40 +E = 40 MPa\n +\d+ points, \d+ steps: to be run", words)
    assert not made()
    assert not Path("results/trial/trial.csv").exists()
    do()
    assert "0 of 3 runs to be made" in do(dry_run=True)[1]


def test_single_runs_can_be_chosen(do):
    status, words = do(only=["e_4*"])
    assert status == 0
    assert list(made()) == ["e_40"]
    assert [row["status"] for row in rows()] == ["done", "missing", "missing"]
    assert "2 missing" in words
    with pytest.raises(RequestError, match="no run is called 'e_41', did you mean 'e_40'"):
        do(only=["e_41"])


def test_figures_alone_need_no_program(do, tmp_path):
    do()
    Path("results/trial/peaks.png").unlink()
    before = made()
    status, words = do(figures_only=True, program=tmp_path / "gone")
    assert status == 0
    assert made() == before
    assert Path("results/trial/peaks.png").exists()
    assert "3 there already" in words
    with pytest.raises(RequestError, match="the program is not there: "):
        do(STUDY.replace("60.0", "70.0"), figures_only=True, program=tmp_path / "gone")


def test_two_studies_do_not_work_in_one_folder(do):
    with only_one(Path("results/trial")), pytest.raises(RequestError, match="another study"):
        do()
    assert do(only=["e_40"])[0] == 0


def test_a_wrong_study_runs_nothing(do):
    with pytest.raises(StudyError):
        do(STUDY.replace('kind = "blank"', 'kind = "blanc"'))
    assert not Path("results").exists()


def test_a_cloud_of_points_goes_with_its_runs(do, tmp_path):
    lines = [
        f"{0.05 + 0.1 * i:.2f} {0.05 + 0.1 * j:.2f} 0.01"
        + (" bottom" if j < 0 else " top" if j > 5 else "")
        for i in range(6)
        for j in range(-3, 9)
    ]
    (tmp_path / "points.txt").write_text("\n".join(lines) + "\n")
    extents = "x_min = 0, x_max = 0.6, y_min = 0, y_max = 0.6"
    body = f"&body shape = 'file', file = 'points.txt', {extents} /"
    (tmp_path / "base.nml").write_text(re.sub(r"&body[^/]*/", body, BASE))
    status, words = do()
    assert status == 0, words
    assert Path("results/trial/runs/e_40/points.txt").is_file()
    assert "3 there already" in do()[1]
    (tmp_path / "points.txt").write_text("\n".join(lines).replace("0.15", "0.16") + "\n")
    assert "3 computed" in do()[1]


# ---- stopped and continued -------------------------------------------------------------------


def start(program, folder, jobs=2):
    """Do the slow study in a process group of its own."""
    (folder / "base.nml").write_text(BASE)
    (folder / "trial.toml").write_text(SLOW)
    code = (
        "import sys, test_study\n"
        "from pathlib import Path\n"
        "from perigeo_post.study.run import Stopped, StudyOptions, run_study\n"
        "try:\n"
        f"    options = StudyOptions(program=Path({str(program)!r}), jobs={jobs})\n"
        "    sys.exit(run_study(Path('trial.toml'), options, test_study.KINDS))\n"
        "except Stopped as stopped:\n"
        "    print(stopped)\n"
        "    sys.exit(stopped.exit_status)\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def states(folder):
    """How run.json says that the runs stand."""
    found = {}
    for path in folder.glob("results/trial/runs/*/run.json"):
        found[path.parent.name] = json.loads(path.read_text())["status"]
    return found


def half_way(process, folder):
    """Wait until one run is done and another is under way, far from its end."""
    while process.poll() is None:
        there = states(folder)
        begun = [
            run
            for run, state in there.items()
            if state == "running"
            and (path := folder / f"results/trial/runs/{run}/{run}_history.csv").exists()
            and 10 < path.read_bytes().count(b"\n") < 45
        ]
        if "done" in there.values() and begun:
            return begun
        time.sleep(0.002)
    pytest.fail(f"the study was done before it could be stopped: {process.stdout.read()}")


@pytest.fixture(scope="module")
def undisturbed(program, tmp_path_factory):
    """The folder of the slow study, done without a break."""
    folder = tmp_path_factory.mktemp("undisturbed")
    words, _ = start(program, folder).communicate(timeout=120)
    assert "3 computed" in words
    return folder / "results" / "trial"


@pytest.mark.parametrize("how", ["ctrl-c", "terminate", "kill"])
def test_a_study_that_was_stopped_goes_on_as_if_it_were_not(
    program, do, tmp_path, undisturbed, how
):
    process = start(program, tmp_path)
    begun = half_way(process, tmp_path)
    if how == "ctrl-c":
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGTERM if how == "terminate" else signal.SIGKILL)
    words, _ = process.communicate(timeout=60)
    assert process.returncode == {"ctrl-c": 130, "terminate": 143, "kill": -9}[how], words
    there = states(tmp_path)
    done = [run for run, state in there.items() if state == "done"]
    if how != "kill":
        assert "the same command goes on" in words
        assert "running" not in there.values()
        assert "interrupted" in there.values()
    before = made()

    status, words = do(SLOW, jobs=2)
    assert status == 0, words
    computed = int(re.search(r"(\d) computed", words).group(1))
    # A run that nobody stopped may have come to its end by itself.
    assert computed == 3 - len(done) if how != "kill" else 1 <= computed <= 3 - len(done)
    assert {run: made()[run] for run in done} == {run: before[run] for run in done}
    log = Path(f"results/trial/runs/{begun[0]}/{begun[0]}.log").read_text()
    assert "going on from a checkpoint" in log
    assert Path("results/trial/trial.csv").read_bytes() == (undisturbed / "trial.csv").read_bytes()
    assert without_times(report()) == without_times(report(undisturbed))


# ---- the command -----------------------------------------------------------------------------


def test_the_command_line_does_a_study(program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("base.nml").write_text(BASE)
    text = STUDY.replace('["peak"]', '["curve"]').replace('"blank"', '"plot"\nx = "E"\ny = "width"')
    Path("trial.toml").write_text(text)
    words = ["study", "trial.toml", "--program", str(program), "--jobs", "2"]
    assert main(words) == 2
    errors = capsys.readouterr().err
    assert 'trial.toml, line 16, figure 1, y: unknown column; found: "width"' in errors
    Path("trial.toml").write_text(text.replace('"width"', '"peak_stress"'))
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "results/trial/peaks.png, .pdf, .csv" in out
    assert main([*words, "--only", "nothing"]) == 1
    assert main(["study", "missing.toml"]) == 2
    assert main(["study", "trial.toml", "--program", "missing"]) == 1


def test_the_page_on_studies_names_every_measure_column_kind_and_option():
    page = (ROOT / "doc" / "studies.md").read_text()
    measures, kinds, options = page.split("## What to measure")[1].split("\n\n| ")[1:4]
    for name, measure in MEASURES.items():
        columns = ", ".join(f"`{column}`" for column in measure.columns)
        assert f"| `{name}` | {columns} |" in measures
    of_all = {"column", "height", "only", "legend", "legend_title"}
    of_all |= {f"{axis}_{what}" for axis in "xy" for what in ("label", "log", "range")}
    for kind, own in FIGURE_OPTIONS.items():
        row = re.search(rf"^\| `{kind}` .*$", kinds, re.M).group()
        assert set(re.findall(r"`(\w+)`", row)) == {kind} | (set(own) - of_all)
    forms = dict(re.findall(r"^\| `(\w+)` \| (.*?) \|", options, re.M))
    assert set(forms) == set(OPTIONS)
    for name, form in forms.items():
        with pytest.raises(ValidationError) as caught:
            FigureOptions.model_validate({name: object()})
        assert [one.what for one in mistakes(caught.value)] == [f"must be {form}"], name


def test_the_example_of_the_page_on_studies_works(program, tmp_path, monkeypatch, capsys):
    page = (ROOT / "doc" / "studies.md").read_text()
    text = next(t for t in re.findall(r"^```toml\n(.*?)^```", page, re.M | re.S) if "base =" in t)
    folder = tmp_path / "studies"
    folder.mkdir()
    (tmp_path / "input").mkdir()
    for name in ("compression_quick.nml",):
        (tmp_path / "input" / name).write_bytes((ROOT / "input" / name).read_bytes())
    (folder / "my_study.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert main(["study", "studies/my_study.toml", "--program", str(program)]) == 0
    out = capsys.readouterr().out
    name = re.search(r'^name = "(\w+)"', text, re.M).group(1)
    data = report(f"results/{name}")
    assert data["complete"]
    assert {finding["verdict"] for finding in data["findings"]} == {"agrees"}
    assert f"{len(data['runs'])} computed" in out
    # What the page shows of the output is what comes out.
    for line in re.search(r"^    \S*: Width.*?\n\n", page, re.M | re.S).group().splitlines():
        if "(" not in line and line.strip():
            assert line[4:] in out
