"""Parts of the engine of studies: expressions, namelists, findings, progress, the program."""

from __future__ import annotations

import io
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perigeo_post.read.errors import RequestError
from perigeo_post.study.expressions import (
    TABLE_FUNCTIONS,
    Expression,
    ExpressionError,
    MissingValueError,
    Numbers,
)
from perigeo_post.study.findings import Finding, TableRow, evaluate
from perigeo_post.study.inputs import InputError, read_values, said_of, setting_of
from perigeo_post.study.jobs import Job, Record
from perigeo_post.study.program import Check, find_program, message_of, read_check
from perigeo_post.study.progress import Progress, duration, steps_done
from perigeo_post.study.runner import weight

# ---- expressions -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("m", 4),
        ("0.08 / m", 0.02),
        ("-m + 2 * 3 ** 2 // 4 % 3", -3),
        ("+m", 4),
        ("round(0.08 / 3, 3)", 0.027),
        ("round(2.5 * m)", 10),
        ("max(1, m, 2) - min([3, m])", 1),
        ("sqrt(m) + abs(-1) + floor(1.7) + ceil(1.2) + int(2.9)", 8.0),
        ("pi", math.pi),
        ("1 < m <= 4", True),
        ("not m == 4 or m != 4", False),
        ("0 and m", 0),
        ("'rough' if name == 'a' else 'smooth'", "rough"),
        ("name in ['a', 'b'] and name not in ('c',)", True),
        ("[m, 2 * m][-1]", 8),
        ("1e3", 1000.0),
        ("  m  ", 4),
    ],
)
def test_expressions_have_the_values_of_arithmetic(text: str, value: object) -> None:
    found = Expression(text).value({"m": 4, "name": "a"})
    assert found == (pytest.approx(value) if isinstance(value, float) else value)
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no expression"),
        ("1 +", "no expression"),
        ("a b", "no expression"),
        ("m.real", "not allowed in an expression: Attribute"),
        ("().__class__", "Attribute"),
        ("[x for x in [1]]", "ListComp"),
        ("lambda: 1", "Lambda"),
        ("(y := 1)", "NamedExpr"),
        ("f'{m}'", "JoinedStr"),
        ("m[0:1]", "Slice"),
        ("{1: 2}", "Dict"),
        ("1j", "not allowed in an expression: 1j"),
        ("b'a'", "not allowed"),
        ("max(*[1])", "Starred"),
        ("max(**a)", "only plain calls"),
        ("max(1)(2)", "only plain calls"),
        ("__import__('os')", "unknown function __import__"),
        ("maxx(1)", "unknown function maxx, did you mean 'max'?"),
        ("n", "unknown name n"),
        ("max", "unknown name max"),
        ("m / 0", "division by zero"),
        ("0.0 ** -1", "division by zero"),
        ("m % 0", "division by zero"),
        ("9 ** 9 ** 9", "don't want to evaluate 9 ** 387420489"),
        ("10.0 ** 400", "a number is too large"),
        ("1e308 * 10", "no finite number"),
        ("(-8) ** 0.5", "is no real number"),
        ("'a' * 1000", "'a' is no number"),
        ("'a' + 'b'", "'a' is no number"),
        ("[1] + [2]", "is no number"),
        ("sqrt(-1)", "'sqrt(-1)'"),
        ("sqrt('a')", "'sqrt"),
        ("1 < 'a'", "'1 < 'a''"),
        ("max([])", "there are no values"),
        ("m['a']", "'int' object is not subscriptable"),
        ("[1]['a']", "list indices must be integers"),
        ("[1][1]", "list index out of range"),
        ("m[0]", "not subscriptable"),
        ("(" * 500 + "1" + ")" * 500, "no expression"),
        ("-" * 1500 + "1", "expression"),
        ("1" * 2001, "more than 2000 characters"),
    ],
)
def test_what_is_not_arithmetic_is_refused(text: str, message: str) -> None:
    with pytest.raises(RequestError) as caught:
        Expression(text).value({"m": 4})
    assert message in str(caught.value)


def table_value(text: str, **names: Any) -> Any:
    return Expression(text).value(names, TABLE_FUNCTIONS)


def test_columns_are_joined_run_by_run() -> None:
    width = Numbers({"a": 2.0, "b": 6.0, "c": 5.0})
    delta = Numbers({"c": 1.0, "a": 1.0})
    assert table_value("w / d", w=width, d=delta).by_run == {"a": 2.0, "c": 5.0}
    assert table_value("(2 * w - 1)[1]", w=width) == 11.0
    assert table_value("all(1 < w < 7)", w=width) is True
    assert table_value("all(3 < w < 7)", w=width) is False
    assert table_value("all(w < d)", w=width, d=delta) is False
    assert table_value("ratio(w) + mean(w) + median(w) + len(w) + sum(w)", w=width) == (
        pytest.approx(3 + 13 / 3 + 5 + 3 + 13)
    )
    assert table_value("sorted(w)", w=width) == [2.0, 5.0, 6.0]
    assert table_value("abs(-w)[0]", w=width) == 2.0
    assert table_value("slope([1, 2, 3], [2, 4, 6])") == pytest.approx(2.0)
    assert table_value("deviation(w)", w=width) == pytest.approx(np.std([2, 6, 5], ddof=1))
    error = table_value("standard_error(w)", w=width)
    assert error == pytest.approx(np.std([2, 6, 5], ddof=1) / np.sqrt(3))
    with pytest.raises(MissingValueError, match="two values"):
        table_value("standard_error(w)", w=Numbers({"a": 2.0}))
    assert table_value("slope(d, w)", w=width, d=Numbers({"a": 0.0, "c": 2.0})) == 1.5
    with pytest.raises(MissingValueError, match="no run in common"):
        table_value("w / d", w=width, d=Numbers({"x": 1.0}))
    with pytest.raises(MissingValueError, match="two different x"):
        table_value("slope([1, 1], [2, 3])")
    with pytest.raises(ExpressionError, match="needs values above 0"):
        table_value("ratio([0, 1])")


# ---- findings --------------------------------------------------------------------------------


def finding(values: dict[str, str], found: str, *holds: str) -> Finding:
    return Finding(
        title="Title",
        paper="Paper",
        claim="",
        found=found,
        note="Note",
        values={name: Expression(text) for name, text in values.items()},
        holds=tuple(Expression(text) for text in holds),
    )


ROWS = [
    TableRow(f"{s}{m}", f"m = {m}", s, {"m": m, "t": s}, {"m": m, "w": w, "n": None})
    for s, m, w in [("a", 1, 3.0), ("a", 2, 2.0), ("b", 1, 5.0), ("b", 2, math.nan)]
]


def test_a_finding_compares_numbers_of_the_table() -> None:
    one = finding(
        {"most": "max(col('w', series='a'))", "b": "val('w', series='b', m=1)", "all": "col('w')"},
        "{most:.1f} and {b:g}, {all}",
        "most < b", "most > 2", "len(col('w', m=[1, 3])) == 2", "all > 1",
        "val('w', run='a2') == 2",
    )  # fmt: skip
    assert evaluate(one, ROWS).model_dump() == {
        "title": "Title",
        "paper": "Paper",
        "claim": "",
        "found": "3.0 and 5, [3.0, 2.0, 5.0]",
        "verdict": "agrees",
        "note": "Note",
        "values": {"most": 3.0, "b": 5.0, "all": [3.0, 2.0, 5.0]},
        "holds": [(test.text, True) for test in one.holds],
    }


@pytest.mark.parametrize(
    ("holds", "verdict"),
    [
        (["w > 2", "w < 4"], "agrees"),
        (["w > 2", "w > 4"], "agrees in part"),
        (["w > 4"], "differs"),
        (["col('w') > 2.5"], "differs"),
        (["w > 2", "max(col('n')) > 1"], "no result"),
        (["val('w', series='b', m=2) > 1"], "no result"),
        (["val('w', m=1) > 1"], "no result"),
    ],
)
def test_the_verdict_follows_from_the_tests(holds: list[str], verdict: str) -> None:
    found = evaluate(finding({"w": "val('w', series='a', m=1)"}, "{w}", *holds), ROWS)
    assert found.verdict == verdict
    assert found.found.startswith("no result: " if verdict == "no result" else "3.0")


def test_what_goes_beyond_the_paper_holds_or_not() -> None:
    for holds, word in (
        (["w > 2"], "holds"), (["w > 2", "w > 4"], "holds in part"), (["w > 4"], "does not hold"),
        (["max(col('n')) > 1"], "no result"),
    ):  # fmt: skip
        one = finding({"w": "val('w', series='a', m=1)"}, "{w}", *holds)
        found = evaluate(replace(one, paper="", claim="It is so."), ROWS)
        assert found.verdict == word
        assert found.statement == "It is so."
    assert evaluate(one, ROWS).statement == "Paper"


def test_numbers_that_are_missing_are_no_result() -> None:
    found = evaluate(finding({"n": "max(col('n'))"}, "{n:.1f}", "n > 1"), ROWS)
    assert found.verdict == "no result"
    assert "no run has a 'n'" in found.found
    assert found.holds == []
    assert evaluate(finding({"n": "'text'"}, "{n:.1f}", "1 > 0"), ROWS).verdict == "no result"


# ---- inputs ----------------------------------------------------------------------------------

PRINTED = """\
&run
  name = 'it''s = b'
/
&output
  frame_strains = 0.5, 1.0e-2
  ! ramp_time = 0.0
/
"""


def test_what_the_program_prints_is_read_and_written() -> None:
    found = read_values(PRINTED)
    assert found.text() == PRINTED
    assert found.numbers("output", "frame_strains") == [0.5, 0.01]
    assert found.numbers("output", "nothing") == []
    found.put("run", "name", "a'b")
    found.put("run", "title", "T")
    found.put("body", "x_min", 1)
    text = found.text(leave_out=("output.frame_strains",))
    assert text.startswith("&run\n  name = 'a''b'\n  title = 'T'\n/\n&output\n  ! ramp_time")
    assert text.endswith("&body\n  x_min = 1\n/\n")
    assert "frame_strains" not in text


@pytest.mark.parametrize(
    ("place", "value", "setting"),
    [
        ("Body.x_min", 1, "body.x_min=1"),
        ("boundary.top.velocity", [0, -0.02], "boundary.top.velocity=0, -0.02"),
        ("run.title", "it's", "run.title='it''s'"),
        ("body.x_min", "unset", "body.x_min="),
        ("imperfection", False, "imperfection="),
        ("boundary.top", False, "boundary.top="),
        ("body.a.flag", True, "body.a.flag=.true."),
    ],
)
def test_a_change_becomes_a_setting_of_the_program(place: str, value: Any, setting: str) -> None:
    assert setting_of(place, value) == setting


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        ("run.title", "a\nb", "on one line"),
        ("body", 1, "is a group: only false"),
        ("body.x_min", [], "an empty list"),
        ("body.x_min", None, "neither a number nor a text"),
        ("a.b.c.d", 1, "must be group.key"),
        ("a b.c", 1, "must be group.key"),
    ],
)
def test_a_change_that_cannot_be_made_is_refused(place: str, value: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        setting_of(place, value)


def test_a_message_of_the_program_is_told_to_be_about_a_setting() -> None:
    assert said_of("a.b=1", "--set a.b=1: out of range") == "out of range"
    assert said_of("a.b=1", "--set a.b=12: out of range") is None
    assert said_of("a.b=1", "line 2: a.b=1: what") is None
    assert said_of("a.b=" + "x" * 80, f"--set a.b={'x' * 56}...: no") == "no"


# ---- the program -----------------------------------------------------------------------------

CHECKED = """\
a.nml: the input is right
  title               steps 3 to 4 points
  points              5559, of which fictitious 408
  bonds               1.2345E+07; per point 45.717 on average, 16 at least
  steps               9154 to 3.2 s
  run time            about 2.5 min, threads: 1
"""


def test_the_figures_of_a_check_are_read() -> None:
    assert read_check(CHECKED) == Check(5559, 9154, 1.2345e7, 150.0)
    assert read_check(CHECKED.replace("steps  ", "increments")) == read_check(CHECKED)
    assert read_check("nothing") is None
    assert weight(Check(100, 10, 1000.0, 0.0)) == pytest.approx(40000.0)


def test_messages_of_the_program_lose_its_name_and_paths() -> None:
    text = "perigeo: error: a/b.nml, line 2, &body x: wrong\nperigeo: error: a/b.nml: missing\n\n"
    assert message_of(text, ["a/b.nml"]) == "line 2, &body x: wrong; missing"
    assert message_of("\n".join(f"line {k}" for k in range(9))).endswith("line 4; and 4 more")


def program_at(path: Path, version: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\necho '{version}'\n")
    path.chmod(0o755)
    return path


def test_the_program_is_found_above_the_study_or_on_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PERIGEO_BIN", raising=False)
    monkeypatch.setenv("PATH", f"{tmp_path / 'path'}:/usr/bin:/bin")
    study = tmp_path / "project" / "studies" / "a.toml"
    with pytest.raises(RequestError, match="is not there: neither"):
        find_program(None, study)
    program_at(tmp_path / "path" / "perigeo", "perigeo 1 (a)")
    assert find_program(None, study).version == "perigeo 1 (a)"
    program_at(tmp_path / "project" / "bin" / "perigeo", "perigeo 2 (a)")
    assert find_program(None, study).version == "perigeo 2 (a)"
    third = program_at(tmp_path / "third", "perigeo 3 (a)")
    monkeypatch.setenv("PERIGEO_BIN", str(third))
    assert find_program(None, study).version == "perigeo 3 (a)"
    fourth = program_at(tmp_path / "fourth", "perigeo 4 (unknown)")
    found = find_program(fourth, study)
    assert found.version == "perigeo 4 (unknown)"
    assert found.identity.startswith("perigeo 4 (unknown), sha256 ")
    monkeypatch.setenv("PERIGEO_BIN", str(tmp_path / "gone"))
    with pytest.raises(RequestError, match=r"gone \(PERIGEO_BIN\)"):
        find_program(None, study)
    with pytest.raises(RequestError, match="is not perigeo: its --version says 'ls'"):
        find_program(program_at(tmp_path / "ls", "ls"), study)


# ---- progress --------------------------------------------------------------------------------


class Screen(io.StringIO):
    def isatty(self) -> bool:
        return True


def a_job(folder: Path, name: str, status: str, work: float, seconds: float = 0.0) -> Job:
    job = Job(name, folder / name, "", "", {}, status=status, weight=work)
    job.record = Record("", "", "", "", status, seconds=seconds)
    job.fraction = 1.0 if status == "done" else 0.0
    return job


def test_progress_weighs_runs_by_their_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    now = [1000.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr("time.time", lambda: 2e9)
    screen = Screen()
    progress = Progress("trial", screen, 2)
    running = a_job(tmp_path, "b", "running", 40.0)
    running.started = 996.0
    running.folder.mkdir()
    log = running.folder / "b.log"
    log.write_text("step 10/100 (10 %)\nstep 20/100 (20 %)  time\n")
    os.utime(log, (2e9 - 1.0, 2e9 - 1.0))
    jobs = [
        a_job(tmp_path, "a", "done", 20.0, 11.0),
        running,
        a_job(tmp_path, "c", "waiting", 40.0),
    ]
    progress.running(jobs)
    # 28 of 100 done; half a second for each of 72 left, on two cores, but 40 of them in one run.
    assert "\rtrial [######..................]  28 %  1 of 3 runs  about 20 s left" in (
        screen.getvalue()
    )
    shown = len(screen.getvalue())
    now[0] += 0.1
    progress.running(jobs)
    assert len(screen.getvalue()) == shown
    progress.clear()
    assert screen.getvalue().endswith("\r\x1b[K")


def test_progress_without_a_terminal_is_plain_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [1000.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    stream = io.StringIO()
    progress = Progress("trial", stream, 2)
    jobs = [a_job(tmp_path, "a", "done", 1.0, 61.0), a_job(tmp_path, "b", "waiting", 1.0)]
    progress.running(jobs)
    now[0] += 20.0
    progress.running(jobs)
    assert stream.getvalue() == ""
    progress.ended(jobs[0])
    now[0] += 11.0
    progress.running(jobs)
    lines = stream.getvalue().splitlines()
    assert lines[0] == "trial: a done after 1 min 01 s"
    assert lines[1].endswith(" 50 %  1 of 2 runs  about 1 min 01 s left")
    assert "\x1b" not in stream.getvalue()
    assert "\r" not in stream.getvalue()


def test_times_are_given_in_words(tmp_path: Path) -> None:
    assert [duration(s) for s in (0.2, 59.6, 3599, 3660)] == [
        "0 s", "1 min 00 s", "59 min 59 s", "1 h 01 min",
    ]  # fmt: skip
    assert steps_done(tmp_path / "nothing.log") == (0.0, 0.0)


def test_the_records_of_runs_survive_what_is_no_record(tmp_path: Path) -> None:
    job = a_job(tmp_path, "a", "running", 1.0)
    job.keep(message="ä")
    assert job.read_record() == job.record
    for text in ("", "{}", "[1]", '{"identity": 1, "other": 2}'):
        job.record_path.write_text(text)
        assert job.read_record() is None
