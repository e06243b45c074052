"""What is promised about files: nothing of the user's is destroyed, nothing of a run is lost."""

import os
import platform
import resource
import signal
import subprocess
import time
from xml.etree import ElementTree

import h5py
import pytest
from case_files import (
    SPECIMEN,
    begin,
    changed,
    contents,
    history,
    same_points_and_frames,
    stop,
    uncontrolled,
)

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


# ------------------------------------------------------------------------------ files that change


def halted(program, folder, text, rows=20, **environment):
    """Start a run, and halt it when its history has some rows."""
    process = begin(program, folder, text, **environment)
    path = folder / "out" / "case_history.csv"
    while not path.exists() or path.read_bytes().count(b"\n") < rows:
        time.sleep(0.001)
    process.send_signal(signal.SIGSTOP)
    return process


def ended(process):
    """Let a halted run go on; return its exit status."""
    process.send_signal(signal.SIGCONT)
    return process.wait(timeout=300)


def attributes(path):
    with h5py.File(path, "r", locking=False) as file:
        return dict(file.attrs)


@pytest.mark.parametrize("how", ["removed", "replaced", "cut"])
def test_a_history_that_changes_hands_is_noticed(program, run_case, tmp_path, how):
    process = halted(program, tmp_path, LONG)
    path = tmp_path / "out" / "case_history.csv"
    if how == "cut":
        path.write_bytes(path.read_bytes()[:-5])
    else:
        path.rename(tmp_path / "moved.csv")
    if how == "replaced":
        path.write_text("of another program\n")
    assert ended(process) == 5
    assert attributes(tmp_path / "out" / "case.h5")["complete"] == 0
    log = (tmp_path / "out" / "case.log").read_text()
    assert "a checkpoint of step" in log
    if how == "removed":
        (tmp_path / "moved.csv").rename(path)
        assert run_case(LONG, tmp_path, "--restart", "--quiet").returncode == 0


@pytest.mark.parametrize("how", ["removed", "replaced"])
def test_a_result_that_changes_hands_is_noticed(program, run_case, tmp_path, how):
    other = tmp_path / "other"
    other.mkdir()
    assert run_case(LONG, other, "--quiet").returncode == 0
    process = halted(program, tmp_path, LONG)
    path = tmp_path / "out" / "case.h5"
    path.unlink()
    if how == "replaced":
        path.write_bytes((other / "out" / "case.h5").read_bytes())
        (tmp_path / "out" / "case_checkpoint.h5").write_bytes(b"of the other run")
    assert ended(process) == 5
    if how == "replaced":
        assert path.read_bytes() == (other / "out" / "case.h5").read_bytes()
        assert (tmp_path / "out" / "case_checkpoint.h5").read_bytes() == b"of the other run"


def test_a_full_disk_costs_no_step(program, run_case, tmp_path):
    text = uncontrolled(changed(SPECIMEN, history_count="5000", final_strain="0.05"))
    text = text.replace("frame_strains = 0.004, 0.01", "frame_strains = 1.0e-4, 0.05")
    (tmp_path / "run.nml").write_text(text)
    done = subprocess.run(
        [program, "--quiet", "run.nml"], cwd=tmp_path, check=False, capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1_300_000, 1_300_000)),
    )  # fmt: skip
    assert done.returncode == 5
    assert "--restart goes on from it" in done.stderr
    with h5py.File(tmp_path / "out" / "case_checkpoint.h5", "r", locking=False) as file:
        assert file.attrs["rows_owed"] == 1
        step = file.attrs["step"]
    assert run_case(text, tmp_path, "--restart", "--quiet").returncode == 0
    (tmp_path / "straight").mkdir()
    assert run_case(text, tmp_path / "straight", "--quiet").returncode == 0
    found, wanted = tmp_path / "out", tmp_path / "straight" / "out"
    assert (found / "case_history.csv").read_bytes() == (wanted / "case_history.csv").read_bytes()
    assert step in history(wanted / "case_history.csv")["step"]
    with (
        h5py.File(found / "case.h5", locking=False) as one,
        h5py.File(wanted / "case.h5", locking=False) as other,
    ):
        same_points_and_frames(one, other)


def test_a_log_that_cannot_be_written_costs_no_step(program, run_case, tmp_path, straight):
    (tmp_path / "out").mkdir()
    log = tmp_path / "out" / "case.log"
    os.mkfifo(log)
    process = begin(program, tmp_path, LONG)
    path = tmp_path / "out" / "case_history.csv"
    with log.open("rb"):
        while not path.exists() or path.read_bytes().count(b"\n") < 20:
            time.sleep(0.001)
    assert process.wait(timeout=30) == 5
    log.unlink()
    done = run_case(LONG, tmp_path, "--restart", "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight


def opened_with_a_lock(path, process):
    """Open a result of a halted run as a reader that locks it does; let the run go on."""
    while True:
        try:
            file = h5py.File(path, "r", locking=True)
        except BlockingIOError:  # it was halted while it wrote
            process.send_signal(signal.SIGCONT)
            time.sleep(0.001)
            process.send_signal(signal.SIGSTOP)
        else:
            process.send_signal(signal.SIGCONT)
            return file


@pytest.mark.parametrize("long", [False, True], ids=["a moment", "for good"])
def test_a_reader_with_a_lock_costs_no_work(program, run_case, tmp_path, straight, long):
    text = LONG.replace("frame_strains = 0.004, 0.01", "frame_count = 50")
    process = halted(program, tmp_path, text, rows=40, HDF5_USE_FILE_LOCKING="TRUE")
    path = tmp_path / "out" / "case.h5"
    with opened_with_a_lock(path, process):
        if long:
            assert process.wait(timeout=300) == 5
        else:
            time.sleep(0.5)
    if long:
        with h5py.File(tmp_path / "out" / "case_checkpoint.h5", "r", locking=False) as file:
            assert file.attrs["frames_owed"] == 1
        assert run_case(text, tmp_path, "--restart", "--quiet").returncode == 0
    else:
        assert process.wait(timeout=300) == 0
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == straight
    with h5py.File(path, "r", locking=False) as file:
        assert file.attrs["complete"] == 1
        assert [frame.attrs["written"] for frame in file["frames"].values()] == [1] * 51
        steps = [frame.attrs["step"] for frame in file["frames"].values()]
        assert steps == sorted(set(steps))


@pytest.mark.parametrize("which", ["case_history.csv", "case.h5"])
def test_damaged_rows_are_noticed_by_a_restart(program, run_case, tmp_path, which):
    assert stop(begin(program, tmp_path, LONG), signal.SIGTERM, tmp_path, 50) == 143
    path = tmp_path / "out" / which
    if which == "case.h5":
        with h5py.File(path, "r+", locking=False) as file:
            file["history/strain_energy"][20] *= 1.0 + 1e-15
    else:
        lines = path.read_bytes().split(b"\n")
        lines[21] = lines[21].replace(b"1E", b"2E").replace(b"3E", b"4E")
        path.write_bytes(b"\n".join(lines))
    before = contents(tmp_path / "out")
    done = run_case(LONG, tmp_path, "--restart", "--quiet")
    assert done.returncode == 5
    assert f"{which}: row 21 " in done.stderr or "row 21 of" in done.stderr
    assert contents(tmp_path / "out") == before


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


# ------------------------------------------------------------------------------ memory


MEGABYTE = 2**20


@pytest.mark.parametrize("operators", ["lattice", "list"])
def test_a_body_without_memory_is_status_3_with_the_figure(program, tmp_path, operators):
    text = changed(SPECIMEN, spacing="0.0025", horizon="0.005", final_strain=None)
    text = text.replace("&integration", "&integration end_time = 1.0e-9,")
    text = text.replace("&run", f"&run operators = '{operators}',")
    text = text.replace("frame_strains = 0.004, 0.01, ", "frame_count = 1, ")
    (tmp_path / "run.nml").write_text(text)
    status = 3
    for megabytes in range(60, 400, 10):
        limit = megabytes * MEGABYTE
        done = subprocess.run(
            [program, "--threads", "1", "run.nml"], cwd=tmp_path, check=False, timeout=60,
            capture_output=True, text=True,
            preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
        )  # fmt: skip
        if done.returncode == 127 or "shared libraries" in done.stderr:
            continue  # not even the libraries have room
        status = done.returncode
        if status == 0:
            break
        assert status == 3, (megabytes, done.stderr)
        assert " GB" in done.stderr or " MB more were asked for" in done.stderr
        assert "race" not in done.stderr
        assert list(contents(tmp_path)) == ["run.nml"]
    assert status == 0


def test_a_body_too_large_for_the_machine_is_refused_at_once(run_case, tmp_path):
    text = changed(SPECIMEN, spacing="1.0e-4", horizon="3.0e-4", frame_strains=None)
    text = changed(text, x_max="0.9999", y_max="0.9999")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if memory > 40e9:
        pytest.skip("this machine has room for it")
    for options in ([], ["--check"]):
        done = run_case(text, tmp_path, *options)
        assert done.returncode == 3
        assert "too large for the memory of this machine" in done.stderr
        assert list(contents(tmp_path)) == ["run.nml"]


def test_a_check_of_a_large_body_speaks_first(program, tmp_path):
    text = changed(SPECIMEN, spacing="2.0e-4", horizon="6.0e-4", frame_strains=None)
    (tmp_path / "run.nml").write_text(text)
    process = subprocess.Popen(
        [program, "--check", "run.nml"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    with process.stdout:
        assert "points, " in process.stdout.readline()
        assert process.poll() is None
    process.kill()
    process.wait()


# ------------------------------------------------------------------------------ threads


def test_a_small_body_takes_one_thread_unless_the_user_says_more(program, tmp_path):
    text = changed(SPECIMEN, final_strain=None).replace("frame_strains = 0.004, 0.01, ", "")
    (tmp_path / "run.nml").write_text(
        text.replace("&integration", "&integration end_time = 0.01, time_step_rule = 'courant',")
    )
    free = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    two = {**free, "OMP_NUM_THREADS": "2"}
    for options, environment, threads in (
        ([], free, 1),
        ([], two, 2),
        (["--threads", "2"], free, 2),
    ):
        subprocess.run(
            [program, "--quiet", "--force", *options, "run.nml"], cwd=tmp_path, env=environment,
            check=True,
        )  # fmt: skip
        assert attributes(tmp_path / "out" / "case.h5")["threads"] == threads
