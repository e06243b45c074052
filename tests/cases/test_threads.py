"""The number of threads changes nothing but the time that a run takes."""

import h5py
import pytest
from case_files import SPECIMEN, changed, same_points_and_frames

CONTROL = "&stabilisation method = 'silling', factor = 0.01 /\n"
RELAXING = "&stabilisation method = 'relaxing' /\n"
TEXT = changed(
    SPECIMEN, spacing="0.05", horizon="0.16", x_max="1.0", y_max="2.0", final_strain="0.005"
).replace("frame_strains = 0.004, 0.01", "frame_count = 3")


FIELD = "&random_field coefficient_of_variation = 0.2, correlation_length = 0.2 /\n"


@pytest.mark.parametrize(
    "more",
    ["", CONTROL, RELAXING, FIELD],
    ids=["plain", "with control", "with relaxing control", "with field"],
)
def test_history_and_frames_have_the_same_bits(run_case, tmp_path, more):
    results = []
    for threads in (1, 2, 3):
        done = run_case(
            TEXT + more,
            tmp_path,
            *("--quiet", "--threads", threads, "--output", f"out{threads}"),
            OMP_WAIT_POLICY="passive",
        )
        assert done.returncode == 0, done.stderr
        results.append(tmp_path / f"out{threads}")
    first = results[0]
    for other in results[1:]:
        assert (other / "case_history.csv").read_bytes() == (
            first / "case_history.csv"
        ).read_bytes()
        with (
            h5py.File(first / "case.h5", locking=False) as one,
            h5py.File(other / "case.h5", locking=False) as two,
        ):
            same_points_and_frames(one, two)
    with h5py.File(results[2] / "case.h5", locking=False) as file:
        assert file.attrs["threads"] == 3
        assert file["frames/000003/plastic_strain"][()].max() > 1e-3


def test_the_environment_sets_the_number_of_threads(run_case, tmp_path):
    done = run_case(SPECIMEN, tmp_path, "--quiet", OMP_NUM_THREADS="2", OMP_WAIT_POLICY="passive")
    assert done.returncode == 0
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file.attrs["threads"] == 2
