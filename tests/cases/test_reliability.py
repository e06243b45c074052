"""What is promised about files: nothing of the user's is destroyed, nothing of a run is lost."""

import platform
import signal
import subprocess
import time
from xml.etree import ElementTree

import h5py
import pytest
from case_files import SPECIMEN, begin, changed, contents, stop

LONG = changed(SPECIMEN, final_strain="0.02", history_count="400")
CLOUD = """\
&run name = 'case', output_dir = '.' /
&discretisation spacing = 0.1, horizon = 0.15 /
&body shape = 'file', file = 'case_history.csv' /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&integration end_time = 0.001 /
"""


@pytest.fixture(scope="module")
def straight(run_case, tmp_path_factory):
    """History of a run that was left alone."""
    folder = tmp_path_factory.mktemp("straight")
    done = run_case(LONG, folder, "--quiet")
    assert done.returncode == 0, done.stderr
    return (folder / "out" / "case_history.csv").read_bytes()


# ------------------------------------------------------------------------------ inputs are kept


@pytest.mark.parametrize("ending", [".log", ".xdmf", ".h5", "_history.csv", "_checkpoint.h5"])
def test_an_input_is_not_replaced_by_an_output(perigeo, tmp_path, ending):
    text = SPECIMEN.replace("output_dir = 'out'", "output_dir = '.'")
    (tmp_path / f"case{ending}").write_text(text)
    (tmp_path / "link.nml").symlink_to(f"case{ending}")
    for name in (f"case{ending}", "link.nml"):
        done = perigeo(["--force", name], tmp_path)
        assert done.returncode == 5
        assert f"case{ending}: is an input of this run" in done.stderr
        assert sorted(contents(tmp_path)) == sorted([f"case{ending}", "link.nml"])
        assert (tmp_path / f"case{ending}").read_text() == text


def test_a_cloud_is_not_replaced_by_an_output(run_case, tmp_path):
    cloud = "".join(f"{0.1 * (i % 5):.1f} {0.1 * (i // 5):.1f} 0.01\n" for i in range(25))
    (tmp_path / "case_history.csv").write_text(cloud)
    done = run_case(CLOUD, tmp_path, "--force")
    assert done.returncode == 5
    assert "case_history.csv: is an input of this run" in done.stderr
    assert (tmp_path / "case_history.csv").read_text() == cloud


def test_points_replace_points_only(run_case, tmp_path):
    for _ in range(2):
        assert run_case(SPECIMEN, tmp_path, "--check", "--points", "p.txt").returncode == 0
    (tmp_path / "notes.txt").write_text("a week of work\n")
    for name in ("run.nml", "notes.txt"):
        before = (tmp_path / name).read_bytes()
        done = run_case(SPECIMEN, tmp_path, "--check", "--points", name)
        assert done.returncode == 5
        assert f"{name}: is " in done.stderr
        assert (tmp_path / name).read_bytes().startswith(before)


# ------------------------------------------------------------------------------ one run at a time


def test_results_of_a_living_run_are_left_alone(program, run_case, tmp_path, straight):
    process = begin(program, tmp_path, changed(LONG, history_count="400"))
    path = tmp_path / "out" / "case_history.csv"
    while not path.exists() or path.read_bytes().count(b"\n") < 20:
        time.sleep(0.001)
    process.send_signal(signal.SIGSTOP)
    before = contents(tmp_path / "out")
    for options in ([], ["--force"], ["--restart"]):
        done = run_case(LONG, tmp_path, "--quiet", *options)
        assert done.returncode == 5, options
        assert f"process {process.pid} on {platform.node()}" in done.stderr
        assert contents(tmp_path / "out") == before
    process.send_signal(signal.SIGCONT)
    assert process.wait(timeout=300) == 0
    assert path.read_bytes() == straight
    assert not (tmp_path / "out" / "case.lock").exists()


def test_a_dead_run_holds_no_lock(program, run_case, tmp_path, straight):
    assert stop(begin(program, tmp_path, LONG), signal.SIGKILL, tmp_path, 20) == -signal.SIGKILL
    assert (tmp_path / "out" / "case.lock").exists()
    done = run_case(LONG, tmp_path, "--quiet", "--force")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight
    assert not (tmp_path / "out" / "case.lock").exists()


def test_of_runs_started_at_once_one_goes_on(program, tmp_path, straight):
    (tmp_path / "run.nml").write_text(LONG + "&stabilisation method = 'none' /\n")
    for _ in range(3):
        runs = [
            subprocess.Popen(
                [program, "--quiet", "--force", "--threads", "1", "run.nml"],
                cwd=tmp_path,
                stderr=subprocess.PIPE,
                text=True,
            )
            for _ in range(3)
        ]
        words = [run.communicate(timeout=300)[1] for run in runs]
        ends = sorted(run.returncode for run in runs)
        assert set(ends) <= {0, 5}, words
        assert ends[0] == 0, words
        assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight


def test_a_file_that_is_no_lock_is_left_alone(run_case, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "case.lock").write_text("of another program\n")
    done = run_case(SPECIMEN, tmp_path)
    assert done.returncode == 5
    assert "case.lock" in done.stderr
    assert (tmp_path / "out" / "case.lock").read_text() == "of another program\n"


# ------------------------------------------------------------------------------ cost of frames


def test_frames_are_added_to_the_xdmf_file_in_place(program, tmp_path):
    text = LONG.replace("frame_strains = 0.004, 0.01", "frame_count = 100")
    process = begin(program, tmp_path, text)
    path, result = tmp_path / "out" / "case.xdmf", tmp_path / "out" / "case.h5"
    seen = set()
    while process.poll() is None:
        if not path.exists():
            continue
        process.send_signal(signal.SIGSTOP)
        grids = list(ElementTree.parse(path).iter("Time"))  # a whole file at any moment
        with h5py.File(result, "r", locking=False) as file:
            written = sum(frame.attrs["written"] for frame in file["frames"].values())
        assert len(grids) in (written, written - 1)
        if process.poll() is None and 0 < written < 101:
            seen.add((path.stat().st_ino, path.stat().st_size))
        process.send_signal(signal.SIGCONT)
        time.sleep(0.01)
    assert process.returncode == 0
    assert len(seen) == 1
    assert path.stat().st_ino == seen.pop()[0]
    assert path.read_text().endswith("</Xdmf>\n")


def test_the_check_tells_what_frames_take_of_the_disk(run_case, tmp_path):
    sizes = []
    for count in (10, 110):
        text = SPECIMEN.replace("frame_strains = 0.004, 0.01", f"frame_count = {count}")
        told = run_case(text, tmp_path, "--check").stdout
        told = float(told.split("disk ")[1].split()[0]) * 1e6
        assert run_case(text, tmp_path, "--quiet", "--force").returncode == 0
        found = sum(path.stat().st_size for path in (tmp_path / "out").iterdir())
        assert told == pytest.approx(found, rel=0.2)
        sizes.append((told, found))
    more = [late - early for early, late in zip(*sizes)]
    assert more[0] == pytest.approx(more[1], rel=0.1)


# ------------------------------------------------------------------------------ signals


STOPPING = [signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU]


@pytest.mark.parametrize("number", STOPPING, ids=lambda number: number.name)
def test_signals_that_ask_a_run_to_stop_keep_its_state(
    program, run_case, tmp_path, straight, number
):
    assert stop(begin(program, tmp_path, LONG), number, tmp_path, 50) == 143
    assert (tmp_path / "out" / "case_checkpoint.h5").exists()
    assert "stopped by a signal (" in (tmp_path / "out" / "case.log").read_text()
    done = run_case(LONG, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight


def test_a_signal_that_the_parent_ignores_stays_ignored(program, tmp_path, straight):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        process = begin(program, tmp_path, LONG)
    finally:
        signal.signal(signal.SIGHUP, before)
    assert stop(process, signal.SIGHUP, tmp_path, 50) == 0
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight
