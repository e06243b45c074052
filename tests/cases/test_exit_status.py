"""Every exit status with its message, and what is left on the disk."""

import resource
import subprocess

import h5py
import pytest
from case_files import SPECIMEN, changed, contents, history

CLOUD = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.1, horizon = 0.15 /
&body shape = 'file', file = 'cloud.txt' /
&material model = 'elastic', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3 /
&integration end_time = 0.001 /
"""
GRID = [f"{0.1 * (i % 5):.1f} {0.1 * (i // 5):.1f} 0.01" for i in range(25)]


@pytest.fixture(scope="module")
def finished(run_case, tmp_path_factory):
    """Folder of a run that has come to its end."""
    folder = tmp_path_factory.mktemp("finished")
    done = run_case(SPECIMEN, folder)
    assert done.returncode == 0, done.stderr
    return folder


# ------------------------------------------------------------------------------ 0 and 1


def test_a_finished_run_leaves_its_four_files(finished):
    assert sorted(contents(finished / "out")) == [
        "case.h5",
        "case.log",
        "case.xdmf",
        "case_history.csv",
    ]
    with h5py.File(finished / "out" / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 1
        assert list(file["frames"]) == ["000000", "000001", "000002"]
        assert [frame.attrs["written"] for frame in file["frames"].values()] == [1, 1, 1]
        assert file["failed_frame"].attrs["written"] == 0


def test_quiet_runs_say_nothing(run_case, tmp_path):
    done = run_case(SPECIMEN, tmp_path, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_help_and_version_need_no_input(perigeo, tmp_path):
    done = perigeo(["--help"], tmp_path)
    assert done.returncode == 0
    for word in ("--check", "--restart", "--force", "--threads", "--output", "--quiet", "130"):
        assert word in done.stdout
    done = perigeo(["--version"], tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith("perigeo ")
    assert contents(tmp_path) == {}


def test_a_check_runs_nothing(run_case, tmp_path):
    done = run_case(SPECIMEN, tmp_path, "--check")
    assert done.returncode == 0
    for word in ("points", "bonds", "time step", "spectral", "steps", "memory", "run time", "c_p"):
        assert word in done.stdout
    assert list(contents(tmp_path)) == ["run.nml"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "no input file is given"),
        (["--chek", "run.nml"], "unknown option --chek; did you mean --check?"),
        (["--force", "--restart", "run.nml"], "use one of them"),
        (["one.nml", "two.nml"], "more than one input file"),
        (["--threads", "0", "run.nml"], "number of threads is wrong"),
        (["--threads", "two", "run.nml"], "number of threads is wrong"),
        (["--threads"], "--threads: a value is missing"),
        (["run.nml", "--output"], "--output: a value is missing"),
        (["run.nml", "--output="], "--output: a value is missing"),
        (["--threads=two", "run.nml"], "number of threads is wrong"),
        (["--check=yes", "run.nml"], "--check: the option takes no value"),
        (["--thread=2", "run.nml"], "unknown option --thread; did you mean --threads?"),
    ],
)
def test_a_wrong_command_line_is_status_1(perigeo, tmp_path, arguments, message):
    (tmp_path / "run.nml").write_text(SPECIMEN)
    done = perigeo(arguments, tmp_path)
    assert done.returncode == 1
    assert message in done.stderr
    assert list(contents(tmp_path)) == ["run.nml"]


def test_a_value_may_stand_behind_an_equals_sign(perigeo, tmp_path):
    (tmp_path / "run.nml").write_text(SPECIMEN)
    options = ["--threads=1", "--output=there", "--set=run.title='a = b'", "--quiet"]
    done = perigeo([*options, "run.nml"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert "title               a = b" in (tmp_path / "there" / "case.log").read_text()
    done = perigeo(["--check", "--points=points.txt", "run.nml"], tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "points.txt").is_file()


# ------------------------------------------------------------------------------ 2 and 3


def test_wrong_input_is_status_2_also_with_force(run_case, tmp_path):
    assert run_case(SPECIMEN, tmp_path, "--quiet").returncode == 0
    before = contents(tmp_path / "out")
    done = run_case(changed(SPECIMEN, spacing="-0.1"), tmp_path, "--force")
    assert done.returncode == 2
    assert "&discretisation spacing" in done.stderr
    assert contents(tmp_path / "out") == before


def test_input_that_is_not_there_is_status_2(perigeo, tmp_path):
    done = perigeo(["none.nml"], tmp_path)
    assert done.returncode == 2
    assert "none.nml" in done.stderr


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("0.1 0.2 0.01", "points 12 and 26 coincide at ("),
        ("2.0 2.0 0.01", "the shape tensor is singular"),
    ],
)
def test_a_model_that_cannot_be_set_up_is_status_3(run_case, tmp_path, line, message):
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID, line, ""]))
    done = run_case(CLOUD, tmp_path)
    assert done.returncode == 3
    assert message in done.stderr
    assert sorted(contents(tmp_path)) == ["cloud.txt", "run.nml"]


def test_the_singular_point_is_named(run_case, tmp_path):
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID, "2.0 3.0 0.01", ""]))
    done = run_case(CLOUD, tmp_path)
    assert "point 26 at (2, 3) m" in done.stderr


def test_a_boundary_without_points_cannot_be_set_up(run_case, tmp_path):
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID, ""]))
    done = run_case(CLOUD + "&boundary name = 'low', side = 'bottom' /\n", tmp_path)
    assert done.returncode in (2, 3)
    assert "a boundary holds no point" in done.stderr
    assert sorted(contents(tmp_path)) == ["cloud.txt", "run.nml"]


def test_a_cloud_without_a_fourth_column_is_told(run_case, tmp_path):
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID, ""]))
    done = run_case(CLOUD + "&boundary name = 'low', side = 'bottom' /\n", tmp_path)
    assert "found: no column 4 with names of boundaries in cloud.txt" in done.stderr
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID[:-1], f"{GRID[-1]} low", ""]))
    text = CLOUD + "&boundary name = 'low' /\n&boundary name = 'high' /\n"
    done = run_case(text, tmp_path)
    assert "found: no such name in column 4 of cloud.txt" in done.stderr


def test_a_wrong_line_of_a_point_cloud_is_named(run_case, tmp_path):
    (tmp_path / "cloud.txt").write_text("\n".join([*GRID, "1 2", ""]))
    done = run_case(CLOUD, tmp_path)
    assert done.returncode == 2
    assert "cloud.txt, line 26: a point has no volume in column 3; found: 1 2" in done.stderr


# ------------------------------------------------------------------------------ 4


@pytest.fixture(scope="module")
def failed(run_case, tmp_path_factory):
    """A run whose time step is three times too large, and its folder."""
    folder = tmp_path_factory.mktemp("failed")
    check = run_case(SPECIMEN, folder, "--check")
    limit = float(check.stdout.split("2/omega_max = ")[1].split()[0])
    text = SPECIMEN.replace(
        "final_strain = 0.01", f"end_time = 1.0, time_step_rule = 'fixed', time_step = {3 * limit}"
    ).replace("frame_strains = 0.004, 0.01", f"frame_times = {2.9 * limit}, 1.0")
    return run_case(text, folder), folder / "out"


def test_a_run_that_fails_is_status_4_and_says_where(failed):
    done, folder = failed
    assert done.returncode == 4
    assert "the calculation failed: " in done.stderr
    for word in ("step ", ", time ", " s, point ", " at ("):
        assert word in done.stderr
    assert "the calculation failed" in (folder / "case.log").read_text()


def test_a_run_that_fails_keeps_its_last_good_frame(failed):
    _, folder = failed
    with h5py.File(folder / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 0
        frames = file["frames"]
        assert [frames[k].attrs["written"] for k in frames] == [1, 1, 0]
        assert [frames[k].attrs["valid"] for k in ("000000", "000001")] == [1, 1]
        assert abs(frames["000001/displacement"][()]).max() > 0
        bad = file["failed_frame"].attrs
        assert (bad["written"], bad["valid"]) == (1, 0)
        assert bad["step"] > frames["000001"].attrs["step"]
        good = abs(frames["000001/displacement"][()]).max()
        assert abs(file["failed_frame/displacement"][()]).max() > good


def test_a_run_that_fails_keeps_its_history(failed):
    done, folder = failed
    rows = history(folder / "case_history.csv")
    step = int(done.stderr.split("step ")[1].split(",")[0])
    assert rows["step"][0] == 0
    assert rows["step"][-1] <= step


# ------------------------------------------------------------------------------ 5


def test_results_in_the_way_are_left_alone(finished, run_case):
    before = contents(finished / "out")
    done = run_case(SPECIMEN, finished)
    assert done.returncode == 5
    for word in ("--force", "--restart", "--output"):
        assert word in done.stderr
    assert contents(finished / "out") == before


def test_force_overwrites_and_gives_the_same_results(run_case, tmp_path):
    assert (
        run_case(
            changed(SPECIMEN, final_strain="0.005", frame_strains="0.004"), tmp_path
        ).returncode
        == 0
    )
    done = run_case(SPECIMEN, tmp_path, "--force")
    assert done.returncode == 0
    straight = tmp_path / "straight"
    straight.mkdir()
    assert run_case(SPECIMEN, straight).returncode == 0
    assert (tmp_path / "out" / "case_history.csv").read_bytes() == (
        straight / "out" / "case_history.csv"
    ).read_bytes()


def test_another_folder_is_taken_where_asked_for(finished, run_case, tmp_path):
    done = run_case(SPECIMEN, tmp_path, "--output", "a/b c")
    assert done.returncode == 0
    assert (
        contents(tmp_path / "a" / "b c")["case_history.csv"]
        == (finished / "out" / "case_history.csv").read_bytes()
    )


def test_a_restart_without_a_checkpoint_is_status_5(run_case, tmp_path):
    done = run_case(SPECIMEN, tmp_path, "--restart")
    assert done.returncode == 5
    assert "checkpoint" in done.stderr
    assert list(contents(tmp_path)) == ["run.nml"]


def test_a_restart_of_a_finished_run_leaves_it_alone(finished, run_case):
    before = contents(finished / "out")
    done = run_case(SPECIMEN, finished, "--restart")
    assert done.returncode == 0
    assert "the run is finished" in done.stdout
    assert contents(finished / "out") == before


def test_a_file_in_place_of_the_folder_is_status_5(run_case, tmp_path):
    (tmp_path / "out").write_text("in the way")
    done = run_case(SPECIMEN, tmp_path)
    assert done.returncode == 5
    assert "out" in done.stderr
    assert (tmp_path / "out").read_text() == "in the way"


def test_a_folder_in_place_of_a_file_is_status_5(run_case, tmp_path):
    (tmp_path / "out" / "case_history.csv").mkdir(parents=True)
    done = run_case(SPECIMEN, tmp_path, "--force")
    assert done.returncode == 5
    assert "case_history.csv" in done.stderr


def run_with_little_space(program, folder, text, limit):
    """Run with a limit on the size of files: writing beyond it fails as on a full disk."""
    (folder / "run.nml").write_text(text)
    return subprocess.run(
        [program, "run.nml"],
        cwd=folder,
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
        restore_signals=False,  # SIGXFSZ stays ignored, so that the write returns an error
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )


def test_a_disk_too_small_for_the_frames_shows_at_the_start(program, tmp_path):
    text = SPECIMEN.replace("frame_strains = 0.004, 0.01", "frame_count = 200")
    done = run_with_little_space(program, tmp_path, text, 500_000)
    assert done.returncode == 5, done.stderr
    assert "case.h5" in done.stderr
    assert "step" not in done.stdout.replace("time step", "").replace("steps", "")


def test_a_disk_that_fills_up_keeps_what_was_written(program, tmp_path):
    text = changed(SPECIMEN, history_count="5000", final_strain="0.05")
    text = text.replace("frame_strains = 0.004, 0.01", "frame_strains = 1.0e-4, 0.05")
    # the .h5 has all its space from the start, 0.96 MB; the .csv grows to 2.4 MB
    done = run_with_little_space(program, tmp_path, text, 1_300_000)
    assert done.returncode == 5, done.stderr
    assert "case_history.csv" in done.stderr
    lines = (tmp_path / "out" / "case_history.csv").read_text().splitlines()
    assert len(lines) > 100
    assert len({line.count(",") for line in lines[:-1]}) == 1
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file["frames/000001"].attrs["written"] == 1
        assert abs(file["frames/000001/displacement"][()]).max() > 0
        assert 100 < file["history"].attrs["written"] <= len(lines)
