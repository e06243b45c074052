"""Runs that are stopped, killed and restarted end like a run that was left alone."""

import random
import signal
import time
from pathlib import Path

import h5py
import pytest
from case_files import (
    SHEET,
    SPECIMEN,
    begin,
    changed,
    contents,
    history,
    same_points_and_frames,
    stop,
)
from test_input import VALID

# Long enough to be hit in the middle by a signal, with many rows and frames.
LONG = changed(SPECIMEN, final_strain="0.04", history_count="400", spacing="0.05", horizon="0.16")
LONG = LONG.replace("frame_strains = 0.004, 0.01", "frame_count = 20")
# How many rows are written into the result file together: what the page on results says.
PAGE = (Path(__file__).resolve().parents[2] / "doc" / "results.md").read_text()
BUNCH = int(PAGE.split("in bunches: every ")[1].split()[0])
END = "final_strain = 0.04"


@pytest.fixture(scope="module")
def straight(run_case, tmp_path_factory):
    """Results of a run that was left alone."""
    folder = tmp_path_factory.mktemp("straight")
    done = run_case(LONG, folder, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    return folder / "out"


def assert_same(folder, straight):
    """Assert that history and frames are those of the run that was left alone."""
    assert (folder / "case_history.csv").read_bytes() == (
        straight / "case_history.csv"
    ).read_bytes()
    with (
        h5py.File(folder / "case.h5", locking=False) as one,
        h5py.File(straight / "case.h5", locking=False) as other,
    ):
        assert one.attrs["complete"] == 1
        same_points_and_frames(one, other)
        same_history(one, other)


def same_history(one, other):
    """Assert that two results hold the same history, every row of it."""
    assert dict(one["history"].attrs) == dict(other["history"].attrs)
    assert set(one["history"]) == set(other["history"])
    for name, data in other["history"].items():
        assert (one["history"][name][()] == data[()]).all(), name


def stored_rows(folder):
    """Return how many rows the result holds; assert that the CSV file has the same ones."""
    with h5py.File(folder / "case.h5", locking=False) as file:
        n = int(file["history"].attrs["written"])
        lines = (folder / "case_history.csv").read_text().splitlines()[: n + 1]
        rows = [[float(cell) for cell in line.split(",")] for line in lines[1:]]
        for k, name in enumerate(lines[0].split(",")):
            assert list(file["history"][name][:n]) == [row[k] for row in rows], name
    return n


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_run_that_was_stopped_goes_on_as_if_it_were_not(
    program, run_case, tmp_path, straight, number, status
):
    process = begin(program, tmp_path, LONG)
    assert stop(process, number, tmp_path, random.randint(2, 200)) == status
    assert (tmp_path / "out" / "case_checkpoint.h5").exists()
    rows = history(tmp_path / "out" / "case_history.csv")
    assert len(rows["step"]) < 401
    assert stored_rows(tmp_path / "out") == len(rows["step"])
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 0
    done = run_case(LONG, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight)


# Stretched until its time step has become shorter several times.
STRETCHED = changed(
    SHEET.format(measure="green_lagrange", rate=0.1),
    spacing="0.05", horizon="0.125", safety=None, history_count="3000", frame_count="10",
)  # fmt: skip


def test_a_run_goes_on_with_the_time_step_that_it_had(program, run_case, tmp_path):
    (tmp_path / "straight").mkdir()
    assert run_case(STRETCHED, tmp_path / "straight", "--quiet", "--threads", "1").returncode == 0
    straight = tmp_path / "straight" / "out"
    rows = history(straight / "case_history.csv")
    changes = (rows["time_step"][1:] < rows["time_step"][:-1]).nonzero()[0]
    assert len(changes) >= 3
    # after the first change, before the last; then between the ends
    for rows_before in (changes[0] + 20, changes[1] - 100, changes[-1] + 20):
        folder = tmp_path / str(rows_before)
        folder.mkdir()
        process = begin(program, folder, STRETCHED)
        assert stop(process, signal.SIGTERM, folder, int(rows_before)) == 143
        assert run_case(STRETCHED, folder, "--restart", "--quiet").returncode == 0
        assert_same(folder / "out", straight)
        with h5py.File(folder / "out" / "case.h5", locking=False) as file:
            assert file.attrs["time_step"] == rows["time_step"][-1]
            assert file.attrs["steps"] == rows["step"][-1]


def test_a_run_may_be_stopped_twice(program, run_case, tmp_path, straight):
    assert stop(begin(program, tmp_path, LONG), signal.SIGINT, tmp_path, 60) == 130
    process = begin(program, tmp_path, LONG, "--restart")
    assert stop(process, signal.SIGTERM, tmp_path, 200) == 143
    assert run_case(LONG, tmp_path, "--restart", "--quiet").returncode == 0
    assert_same(tmp_path / "out", straight)


def test_a_control_that_relaxes_goes_on_where_it_was(program, run_case, tmp_path):
    text = LONG + "&stabilisation method = 'relaxing' /\n"
    (tmp_path / "straight").mkdir()
    done = run_case(text, tmp_path / "straight", "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    rows = history(tmp_path / "straight" / "out" / "case_history.csv")
    assert rows["stabilisation_energy"][-1] > 0
    # late enough for points to flow, so that there is something to remember
    assert stop(begin(program, tmp_path, text), signal.SIGTERM, tmp_path, 200) == 143
    assert run_case(text, tmp_path, "--restart", "--quiet").returncode == 0
    assert_same(tmp_path / "out", tmp_path / "straight" / "out")


def test_a_run_that_was_killed_goes_on_from_its_last_checkpoint(
    program, run_case, tmp_path, straight
):
    text = LONG.replace("history_count", "checkpoint_every = 0.02, history_count")
    process = begin(program, tmp_path, text)
    checkpoint = tmp_path / "out" / "case_checkpoint_previous.h5"
    while process.poll() is None and not checkpoint.exists():
        time.sleep(0.001)
    assert stop(process, signal.SIGKILL, tmp_path, 100) == -9
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 0
        assert file["frames/000000"].attrs["written"] == 1
        assert file["frames/000000/displacement"].shape == file["points/position"].shape
        for frame in file["frames"].values():
            assert frame["stress"].shape[1] == 4
    lines = (tmp_path / "out" / "case_history.csv").read_bytes().count(b"\n")
    assert lines - 1 - BUNCH < stored_rows(tmp_path / "out") <= lines - 1
    done = run_case(LONG, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert_same(tmp_path / "out", straight)


def test_a_run_killed_between_checkpoints_keeps_the_rows_of_full_bunches(program, tmp_path):
    text = LONG.replace("frame_count = 20", "frame_count = 1")
    process = begin(program, tmp_path, text.replace("history_count = 400", "history_count = 1500"))
    assert stop(process, signal.SIGKILL, tmp_path, BUNCH + 20) == -9
    assert stored_rows(tmp_path / "out") >= BUNCH


def test_a_spoilt_checkpoint_is_passed_over(program, run_case, tmp_path, straight):
    assert stop(begin(program, tmp_path, LONG), signal.SIGTERM, tmp_path, 60) == 143
    process = begin(program, tmp_path, LONG, "--restart")
    assert stop(process, signal.SIGTERM, tmp_path, 200) == 143
    assert (tmp_path / "out" / "case_checkpoint_previous.h5").exists()
    newest = tmp_path / "out" / "case_checkpoint.h5"
    newest.write_bytes(newest.read_bytes()[:1000])
    done = run_case(LONG, tmp_path, "--restart")
    assert done.returncode == 0, done.stderr
    assert "checkpoint" in done.stdout
    assert_same(tmp_path / "out", straight)


@pytest.fixture(scope="module")
def stopped(program, tmp_path_factory):
    """Folder of a run that was stopped; not to be changed."""
    folder = tmp_path_factory.mktemp("stopped")
    assert stop(begin(program, folder, LONG), signal.SIGTERM, folder, 100) == 143
    return folder / "out"


@pytest.fixture
def copy(stopped, tmp_path):
    """A copy of the run that was stopped."""
    (tmp_path / "out").mkdir()
    for name, data in contents(stopped).items():
        (tmp_path / "out" / name).write_bytes(data)
    return tmp_path


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("youngs_modulus = 50.0e6", "youngs_modulus = 50.1e6", "material.youngs_modulus"),
        ("yield_stress = 0.15e6", "yield_stress = 0.14e6", "material.yield_stress"),
        ("horizon = 0.16", "horizon = 0.17", "discretisation.horizon"),
        ("x_max = 0.5", "x_max = 0.55", "x_max"),
        ("damping = 5.0e5", "damping = 4.0e5", "integration.damping"),
        ("velocity = 0.0, -0.01", "velocity = 0.0, -0.02", "velocity"),
        ("amplitude = 1.0e-3", "amplitude = 1.0e-2", "imperfection.amplitude"),
    ],
)
def test_a_restart_with_another_model_is_refused_by_name(run_case, copy, old, new, key):
    before = contents(copy / "out")
    assert old in LONG
    done = run_case(LONG.replace(old, new), copy, "--restart")
    assert done.returncode == 2, done.stdout
    assert key.split(".")[-1] in done.stderr
    assert contents(copy / "out") == before


def test_a_restart_may_end_later(run_case, copy):
    done = run_case(LONG.replace(END, "final_strain = 0.042"), copy, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    rows = history(copy / "out" / "case_history.csv")
    assert rows["strain"][-1] >= 0.042
    assert (rows["step"][1:] > rows["step"][:-1]).all()
    assert stored_rows(copy / "out") == len(rows["step"])


@pytest.mark.parametrize("count", [20, 3000])
def test_a_restart_may_ask_for_other_rows(run_case, copy, count):
    before = stored_rows(copy / "out")
    text = LONG.replace("history_count = 400", f"history_count = {count}")
    done = run_case(text, copy, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    rows = history(copy / "out" / "case_history.csv")
    assert len(rows["step"]) > before
    assert stored_rows(copy / "out") == len(rows["step"])
    with h5py.File(copy / "out" / "case.h5", locking=False) as file:
        assert file["history"].attrs["rows"] == len(rows["step"])


def test_a_restart_may_ask_for_other_frames(run_case, copy, straight):
    text = LONG.replace("frame_count = 20", "frame_times = 3.9, 4.0")
    done = run_case(text, copy, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    with (
        h5py.File(copy / "out" / "case.h5", locking=False) as one,
        h5py.File(straight / "case.h5", locking=False) as other,
    ):
        last = one["frames"][list(one["frames"])[-1]]
        end = other["frames"][list(other["frames"])[-1]]
        assert last.attrs["step"] == end.attrs["step"]
        assert (last["displacement"][()] == end["displacement"][()]).all()
        assert [frame.attrs["written"] for frame in one["frames"].values()] == [1] * len(
            one["frames"]
        )


def test_results_of_a_stopped_run_are_not_overwritten_unasked(run_case, copy):
    before = contents(copy / "out")
    assert run_case(LONG, copy).returncode == 5
    assert contents(copy / "out") == before


def sealed(path):
    """Renew the sum over all bytes that a checkpoint begins with."""
    data = path.read_bytes()
    body = data[512:] + bytes(-len(data) % 4)
    simple, weighted, modulus = 1, 0, 2**31 - 1
    for place in range(0, len(body), 4):
        simple = (simple + int.from_bytes(body[place : place + 4], "little")) % modulus
        weighted = (weighted + simple) % modulus
    total = f"{weighted << 32 | simple:016X}"
    head = f"perigeo checkpoint{len(data):20d}{total:>20}"
    path.write_bytes(head.ljust(511).encode() + b"\n" + data[512:])


def test_a_checkpoint_of_laws_that_remember_less_is_refused(run_case, tmp_path):
    text = SPECIMEN.replace("&output", "&output checkpoint_every = 1.0e-6,", 1)
    assert run_case(text, tmp_path, "--quiet").returncode == 0
    path = tmp_path / "out" / "case_checkpoint.h5"
    with h5py.File(path, "r+") as file:
        history = file["state/history"][()]
        del file["state/history"]
        file["state/history"] = history[:, :4]
    sealed(path)
    text = text.replace("final_strain = 0.01", "final_strain = 0.011")
    done = run_case(text, tmp_path, "--quiet", "--restart")
    assert done.returncode == 5
    assert "the laws remember something else than in the checkpoint" in done.stderr


def test_a_finished_run_is_not_computed_again(program, run_case, tmp_path):
    # interrupted once, and then finished: the checkpoint of the interruption is still there
    text = LONG.replace(END, "final_strain = 0.02")
    assert stop(begin(program, tmp_path, text), signal.SIGTERM, tmp_path, 60) == 143
    assert run_case(text, tmp_path, "--restart", "--quiet").returncode == 0
    before = contents(tmp_path / "out")
    done = run_case(text, tmp_path, "--restart")
    assert done.returncode == 0
    assert done.stdout == (
        "the run is finished: out/case.h5 is complete; a later end goes on from a checkpoint, "
        "--force begins anew\n"
    )
    assert run_case(text, tmp_path, "--restart", "--quiet").stdout == ""
    assert contents(tmp_path / "out") == before
    # another model is refused as before
    done = run_case(text.replace("50.0e6", "51.0e6"), tmp_path, "--restart")
    assert done.returncode == 2
    assert "youngs_modulus" in done.stderr
    later = text.replace("0.02", "0.021")
    assert run_case(later, tmp_path, "--restart", "--quiet").returncode == 0
    assert history(tmp_path / "out" / "case_history.csv")["strain"][-1] >= 0.021


def test_a_finished_run_without_a_state_says_so(run_case, tmp_path):
    assert run_case(SPECIMEN, tmp_path, "--quiet").returncode == 0
    later = SPECIMEN.replace("final_strain = 0.01", "final_strain = 0.011")
    done = run_case(later, tmp_path, "--restart")
    assert done.returncode == 5
    assert "the run is finished, and no state was kept" in done.stderr


def test_a_restart_asks_for_the_same_settings(run_case, tmp_path):
    case = VALID.replace("&output", "&output checkpoint_every = 1.0e-6,")
    settings = ["--set", "material.density=1800"]
    done = run_case(case, tmp_path, *settings, "--quiet")
    assert done.returncode == 0, done.stderr
    done = run_case(case, tmp_path, "--restart", "--quiet")
    assert done.returncode == 2
    assert "material.density: differs from the run that is to go on" in done.stderr
    assert "found: 2000.0; allowed: 1800.0" in done.stderr
    later = [*settings, "--set", "integration.final_strain=0.0011"]
    done = run_case(case, tmp_path, *later, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
