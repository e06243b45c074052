"""Several ranks: the bits of a serial run, restart with other numbers of ranks, ends of all kinds.

They run where `make MPI=1` has built bin/perigeo-mpi and mpirun is there. Ranks share cores here,
as they never should in a run that matters, so nothing is said of times.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import frozen_cases
import h5py
import pytest
from case_files import SPECIMEN, changed, groups_of, uncontrolled
from test_bearings import BOX, HALF, MOTION, REST
from test_equilibrium import RESTING
from test_ground import CLAY, COLUMN, EQUILIBRIUM, FOOTING, MOVING
from test_stages import BAR, BLOCKS
from test_strain_control import RESTING as LABORATORY

TIME_LIMIT = 300.0
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OMP_WAIT_POLICY": "passive",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}


@pytest.fixture(scope="session")
def ranked(program):
    """Return the program for several ranks, of the same build; skip where it cannot run."""
    path = program.with_name(program.name.replace("perigeo", "perigeo-mpi"))
    if not path.is_file():
        pytest.skip(f"{path.name} is not there; make MPI=1 builds it")
    if not shutil.which("mpirun"):
        pytest.skip("mpirun is not there")
    versions = [
        subprocess.run([file, "--version"], capture_output=True, check=False).stdout
        for file in (program, path)
    ]
    if versions[0] != versions[1]:
        pytest.skip(f"{path.name} is of another version than {program.name}; make MPI=1 builds it")
    return path


def command(path, ranks, *options):
    """Return the words that start a run with some ranks; 0: the serial program."""
    words = ["mpirun", "-n", str(ranks)] if ranks else []
    return [*words, str(path), "--quiet", *map(str, options), "run.nml"]


@pytest.fixture
def start(program, ranked, tmp_path):
    """Return a function that starts a run of a case in a folder; none outlives the test."""
    started = []

    def begin(text, folder, ranks, *options):
        place = tmp_path / folder
        place.mkdir(exist_ok=True)
        (place / "run.nml").write_text(uncontrolled(text))
        (place / "cloud.txt").write_text(cloud())
        process = subprocess.Popen(
            command(ranked if ranks else program, ranks, *options),
            cwd=place,
            env={**os.environ, **ENVIRONMENT},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            process.terminate()  # mpirun ends its ranks
            process.wait(timeout=TIME_LIMIT)


@pytest.fixture
def run(start, tmp_path):
    """Return a function that runs a case; it returns exit status, errors, and the results."""

    def to_the_end(text, folder, ranks, *options):
        process = start(text, folder, ranks, *options)
        _, said = process.communicate(timeout=TIME_LIMIT)
        return process.returncode, said, tmp_path / folder / "out"

    return to_the_end


def cloud():
    """Return the text of a point cloud off a lattice, in an order that scatters it over ranks."""
    lines = []
    for j in range(-3, 44):
        for i in range(20):
            k = 17 * i + 29 * j
            x = 0.025 * i + 0.00025 * (k * k % 23 - 11)
            y = 0.025 * j + 0.00025 * (k * k % 19 - 9)
            name = "bottom" if j < 0 else "top" if j > 40 else ""
            lines.append(f"{x:.5f} {y:.5f} {6.25e-4 + 1e-6 * (k % 37):.8f} {name}\n")
    return "".join(lines[7 * k % len(lines)] for k in range(len(lines)))


def same_file(one, other, groups):
    """Assert that two HDF5 files hold the same bits in some groups."""
    with (
        h5py.File(one, locking=False) as first,
        h5py.File(other, locking=False) as second,
    ):
        left, right = groups_of(first, groups), groups_of(second, groups)
        assert left.keys() == right.keys()
        for path, value in left.items():
            assert value.tobytes() == right[path].tobytes(), path


def same_results(one, other):
    """Assert that history, frames and the last checkpoint are the same, bit by bit."""
    for name in ("case_history.csv", "case.xdmf"):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    groups = ("points", "frames", "history", "doubts", "quality")
    same_file(one / "case.h5", other / "case.h5", groups)
    same_file(one / "case_checkpoint.h5", other / "case_checkpoint.h5", ("/",))


def finer(text):
    """Return a case on a finer lattice, so that there are blocks for several ranks."""
    text = re.sub(r"horizon = [\d.]+", "horizon = 0.08", text)
    text = re.sub(r"spacing = [\d.]+", "spacing = 0.025", text)
    text = re.sub(r"end_time = ([\d.]+)", lambda m: f"end_time = {0.25 * float(m[1])}", text)
    return text.replace("final_strain = 0.008", "final_strain = 0.004")


def keeping(text):
    """Return a case that leaves a checkpoint of its end."""
    return text.replace("&output", "&output checkpoint_every = 1.0e9,")


FROZEN = frozen_cases.CASES
PROBES = "&probe name = 'a', x = 3.0, y = -1.0 /\n&probe name = 'b', x = 5.8, y = -0.3 /\n"
FINE_CLAY = CLAY.replace("spacing = 0.25, horizon = 0.5", "spacing = 0.125, horizon = 0.375")
FINE_BOX = BOX.replace("spacing = 0.1, horizon = 0.3", "spacing = 0.05, horizon = 0.15")
FINE_COLUMN = COLUMN.replace("spacing = 0.25, horizon = 0.5", "spacing = 0.125, horizon = 0.375")
CASES = {
    "lattice": finer(FROZEN["lattice"]),
    "list and control": finer(FROZEN["list_control"]),
    "tributary": finer(FROZEN["tributary"]),
    "control and materials": finer(FROZEN["materials"]),
    "loads": finer(FROZEN["loaded"]),
    "cut and relaxing control": finer(FROZEN["sight"]),
    "cloud": finer(FROZEN["cloud"]),
    "polygons": FROZEN["polygon"],
    "gravity": FINE_COLUMN.replace(EQUILIBRIUM, MOVING) + PROBES,
    "equilibrium": FINE_CLAY + PROBES + FOOTING,
    "softening at equilibrium": changed(
        RESTING, spacing="0.05", horizon="0.16", final_strain="0.005"
    ).replace("increments = 100", "increments = 20").replace("= 0.004, 0.01", "= 0.004"),
    "stages": BLOCKS,
    "from load to motion": LABORATORY.replace(
        "spacing = 0.01, horizon = 0.025", "spacing = 0.0025, horizon = 0.0075"
    ).replace("increments = 40", "increments = 10"),
    "bearings": FINE_BOX.replace("-8.0e-5", "-0.05") + MOTION.replace("0.4", "0.1"),
    "bearings in a list": FINE_BOX.replace("'case',", "'case', operators = 'list',")
    + MOTION.replace("0.4", "0.05"),
    "bearings at equilibrium": HALF + REST.replace("1.0e-11", "1.0e-3"),
    "factor of safety": BAR.replace("tolerance = 0.01", "tolerance = 0.5"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_results_have_the_bits_of_a_serial_run(run, name):
    text = keeping(CASES[name])
    status, said, serial = run(text, "serial", 0)
    assert status == 0, said
    for ranks, threads in ((2, 2), (3, 1)):
        status, said, results = run(text, f"ranks{ranks}", ranks, "--threads", threads)
        assert status == 0, said
        same_results(serial, results)


def test_no_number_of_ranks_and_threads_changes_a_bit(run):
    # five blocks, so that four ranks have different numbers of them
    text = keeping(finer(FROZEN["lattice_control"]))
    status, said, serial = run(text, "serial", 0)
    assert status == 0, said
    for ranks in (1, 2, 3, 4):
        for threads in (1, 2):
            status, said, results = run(text, f"{ranks}x{threads}", ranks, "--threads", threads)
            assert status == 0, said
            same_results(serial, results)


def test_ranks_without_blocks_wait_for_the_others(run):
    text = keeping(FROZEN["lattice"])  # a single block
    status, said, serial = run(text, "serial", 0)
    assert status == 0, said
    status, said, results = run(text, "ranks", 4)
    assert status == 0, said
    same_results(serial, results)


# ------------------------------------------------------------------------------- restart

LONG = changed(SPECIMEN, final_strain="0.04", history_count="400", spacing="0.05", horizon="0.16")
LONG = keeping(LONG.replace("frame_strains = 0.004, 0.01", "frame_count = 20"))


def rows_written(folder):
    """Return how many lines the history has."""
    path = folder / "case_history.csv"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def wait_for_rows(process, folder, rows):
    """Wait until the history has so many lines."""
    end = time.monotonic() + TIME_LIMIT
    while process.poll() is None and rows_written(folder) < rows:
        assert time.monotonic() < end
        time.sleep(0.002)


def test_a_run_goes_on_with_any_number_of_ranks(start, run, tmp_path):
    status, said, serial = run(LONG, "serial", 0)
    assert status == 0, said
    out = tmp_path / "ranks" / "out"
    for ranks, rows, options in ((4, 80, ()), (1, 200, ("--restart",))):
        process = start(LONG, "ranks", ranks, *options)
        wait_for_rows(process, out, rows)
        process.send_signal(signal.SIGUSR1)  # mpirun passes it on
        assert process.wait(TIME_LIMIT) == 143
        assert rows <= rows_written(out) < 401
    status, said, _ = run(LONG, "ranks", 3, "--restart")
    assert status == 0, said
    same_results(serial, out)


def test_a_rank_that_dies_ends_all_and_the_last_checkpoint_is_good(start, run, tmp_path):
    text = LONG.replace("checkpoint_every = 1.0e9", "checkpoint_every = 0.05")
    out = tmp_path / "ranks" / "out"
    process = start(text, "ranks", 3)
    wait_for_rows(process, out, 40)
    while not (out / "case_checkpoint.h5").exists():
        time.sleep(0.002)
    os.kill(ranks_of(process.pid)[1], signal.SIGKILL)
    assert process.wait(TIME_LIMIT) not in (0, None)
    assert rows_written(out) < 401
    status, said, _ = run(LONG, "ranks", 2, "--restart")
    assert status == 0, said
    status, said, serial = run(LONG, "serial", 0)
    assert status == 0, said
    same_results(serial, out)


def ranks_of(parent):
    """Return the processes that mpirun has started itself, in the order of their ranks."""
    children = Path(f"/proc/{parent}/task").glob("*/children")
    found = sorted({int(word) for path in children for word in path.read_text().split()})
    return [n for n in found if "perigeo" in Path(f"/proc/{n}/comm").read_text()]


# ------------------------------------------------------------------------------- check


def test_the_check_tells_what_ranks_would_have(start):
    process = start(finer(FROZEN["lattice"]), "check", 3, "--check")
    told, said = process.communicate(timeout=TIME_LIMIT)
    assert process.returncode == 0, said
    assert told.count("the input is right") == 1
    points = int(re.search(r"points +(\d+),", told)[1])
    fewest, most = map(int, re.search(r"ranks +3: (\d+) to (\d+) points", told).groups())
    assert 3 * fewest <= points <= 3 * most
    assert fewest >= 0.5 * most
    halo = int(re.search(r"halo +(\d+) rows", told)[1])
    assert 0 < halo < points


def peak_memory(process, ranks):
    """Return the largest resident memory of each rank of a run, until it ends [kB]."""
    peaks = {}
    while process.poll() is None:
        numbers = [process.pid]
        if ranks:
            with contextlib.suppress(OSError):
                children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
                numbers = [int(word) for word in children.read_text().split()]
        for number in numbers:
            with contextlib.suppress(OSError):
                told = Path(f"/proc/{number}/status").read_text()
                if match := re.search(r"VmHWM:\s+(\d+) kB", told):
                    peaks[number] = int(match[1])
        time.sleep(0.01)
    assert process.returncode == 0, process.stderr.read()
    return sorted(peaks.values())[-max(1, ranks) :]


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="memory is read from /proc")
def test_a_rank_has_memory_for_its_own_points_only(start):
    brief = "final_strain = 8.0e-8, time_step_rule = 'fixed', time_step = 4.0e-6"
    text = SPECIMEN.replace("final_strain = 0.01", brief).replace("0.004, 0.01", "8.0e-8")
    fine = changed(text, spacing="0.00125", horizon="0.003125")  # 330 000 points
    peaks = [
        peak_memory(start(case, f"{name}{ranks}", ranks), ranks)
        for name, case in (("small", text), ("fine", fine))
        for ranks in (0, 4)
    ]
    small, small_ranks, serial, ranks = (max(peak) for peak in peaks)
    assert len(peaks[3]) == 4
    # a quarter and the halo, beside what a run needs that has hardly any points
    assert ranks - small_ranks < 0.33 * (serial - small), peaks


@pytest.mark.parametrize(
    ("name", "whole"), [("lattice", False), ("gravity", False), ("loads", True), ("cloud", True)]
)
def test_the_check_tells_what_every_rank_sets_up_whole(start, name, whole):
    process = start(CASES[name], "check", 2, "--check")
    told, said = process.communicate(timeout=TIME_LIMIT)
    assert process.returncode == 0, said
    assert ("that of the whole body" in told) == whole


# ------------------------------------------------------------------------------- errors


def test_an_error_of_the_input_is_told_once(run):
    status, said, _ = run(changed(SPECIMEN, spacing="-0.1"), "wrong", 3)
    assert status == 2
    assert said.count("perigeo: error:") == 1
    assert "spacing" in said


def test_memory_is_asked_for_all_ranks_of_the_machine(run):
    if os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") > 40e9:
        pytest.skip("this machine has room for it")
    text = changed(SPECIMEN, spacing="1.0e-4", horizon="3.0e-4", x_max="0.9999", y_max="0.9999")
    status, said, _ = run(text, "huge", 3)  # 1e8 points, of which each rank has a third
    assert status == 3
    assert "15 GB for each of 3 ranks on this machine" in said


def test_a_calculation_that_fails_ends_all_ranks_at_the_same_state(run):
    text = finer(FROZEN["affine"]).replace("3.7e-4", "3.7e-3")
    status, told, serial = run(text, "serial", 0)
    assert status == 4
    status, said, results = run(text, "ranks", 3)
    assert status == 4
    assert said.startswith(told.strip())
    assert said.count("perigeo: error:") == 1
    same_file(serial / "case.h5", results / "case.h5", ("frames", "failed_frame", "history"))


def test_a_file_that_cannot_be_written_ends_all_ranks(run, tmp_path):
    (tmp_path / "ranks").mkdir()
    (tmp_path / "ranks" / "out").write_text("in the way")
    status, said, _ = run(LONG, "ranks", 3)
    assert status == 5
    assert said.count("perigeo: error:") == 1


def test_a_disk_that_fills_up_ends_all_ranks_and_costs_no_step(ranked, run, tmp_path):
    text = changed(SPECIMEN, history_count="5000", final_strain="0.05")
    text = text.replace("frame_strains = 0.004, 0.01", "frame_strains = 1.0e-4, 0.05")
    folder = tmp_path / "ranks"
    folder.mkdir()
    (folder / "run.nml").write_text(uncontrolled(text))
    # a limit on the size of files: the .h5 has its space from the start, the .csv grows beyond it
    limited = f"trap '' XFSZ; ulimit -f 2560; exec '{ranked}' --quiet run.nml"  # of 512 bytes
    done = subprocess.run(
        ["mpirun", "-n", "3", "sh", "-c", limited],
        cwd=folder,
        env={**os.environ, **ENVIRONMENT, "OMPI_MCA_btl": "self,tcp"},
        check=False,
        capture_output=True,
        text=True,
        timeout=TIME_LIMIT,
    )
    assert done.returncode == 5, done.stderr
    assert done.stderr.count("case_history.csv") == 1
    assert done.stderr.count("--restart goes on from it") == 1
    assert rows_written(folder / "out") > 100
    with h5py.File(folder / "out" / "case.h5", locking=False) as file:
        assert file["frames/000001"].attrs["written"] == 1
    # the checkpoint of all ranks is written although one of them alone knew of the disk
    status, said, results = run(text, "ranks", 2, "--restart")
    assert status == 0, said
    status, said, serial = run(text, "serial", 0)
    assert status == 0, said
    name = "case_history.csv"
    assert (results / name).read_bytes() == (serial / name).read_bytes()
    same_file(results / "case.h5", serial / "case.h5", ("points", "frames", "history"))


def test_a_run_that_goes_on_or_is_finished_is_left_alone(start, run, tmp_path):
    out = tmp_path / "ranks" / "out"
    process = start(LONG, "ranks", 2)
    wait_for_rows(process, out, 10)
    waiting = ranks_of(process.pid)[1]
    os.kill(waiting, signal.SIGSTOP)
    for ranks, options in ((2, ("--force",)), (3, ("--restart",)), (0, ("--restart",))):
        status, said, _ = run(LONG, "ranks", ranks, *options)
        assert status == 5
        assert said.count("another run writes these results") == 1
    os.kill(waiting, signal.SIGCONT)
    assert process.wait(TIME_LIMIT) == 0
    before = (out / "case.h5").read_bytes()
    assert run(LONG, "ranks", 3, "--restart")[0] == 0
    assert (out / "case.h5").read_bytes() == before
    assert not (out / "case.lock").exists()
