"""Signals while an equilibrium is looked for: the run ends soon, and keeps the state before."""

import signal
import time

import h5py
import numpy as np
import pytest
from case_files import begin, changed, history, without_group
from test_equilibrium import CLAY, RESTING
from test_restart import assert_same
from test_stages import BAR, BLOCKS

# increments of hundreds or thousands of moves
SLOW = {
    "increments": changed(
        RESTING, spacing="0.025", horizon="0.0625", increments="4, residual = 1.0e-7",
        history_count="4", frame_strains=None, final_strain="0.006",
    ),
    "stages": changed(BLOCKS, increments="2", residual="1.0e-8", frame_count="2"),
}  # fmt: skip
SAFETY = changed(
    BAR, spacing="0.05", horizon="0.15", increments="1, residual = 1.0e-10", tolerance="1.0",
    first="2.19", last="3.0",
)  # fmt: skip


def interrupted(program, folder, text, words, *options):
    """Send SIGTERM soon after some words stand in the log; return the log after the end."""
    process = begin(program, folder, text, *options)
    log = folder / "out" / "case.log"
    while process.poll() is None and not (log.exists() and words in log.read_text()):
        time.sleep(0.002)
    time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 143
    return log.read_text()


@pytest.mark.parametrize(
    ("case", "words"),
    [("stages", "perigeo "), ("increments", "step 2/"), ("stages", "'dig' begins")],
)
def test_an_increment_is_taken_back(program, run_case, tmp_path, case, words):
    text = SLOW[case]
    log = interrupted(program, tmp_path, text, words)
    assert log.splitlines()[-1].startswith("stopped by a signal")
    assert "\nquality so far: energy error" in log
    out = tmp_path / "out"
    rows = len(history(out / "case_history.csv")["step"])
    (tmp_path / "straight").mkdir()
    for folder, options in ((tmp_path, ("--restart",)), (tmp_path / "straight", ())):
        done = run_case(text, folder, "--quiet", "--threads", "1", *options)
        assert done.returncode == 0, done.stderr
    assert_same(out, tmp_path / "straight" / "out")
    assert 1 <= rows < len(history(out / "case_history.csv")["step"])


def test_a_try_of_a_factor_of_safety_is_no_answer(program, run_case, tmp_path):
    log = interrupted(program, tmp_path, SAFETY, "step 2/2")
    assert "strength divided by" not in log
    assert "--restart looks for the factor of safety anew" in log.splitlines()[-1]
    done = run_case(SAFETY, tmp_path, "--quiet", "--restart")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "out" / "case.log").read_text()
    assert "factor of safety: 2.19 is borne, 3 is not" in log


def test_the_last_equilibrium_is_written_whole(run_case, tmp_path):
    """Not with the deformation of the increment beyond the limit load."""
    text = changed(CLAY, velocity=None, final_strain=None, frame_strains=None, history_count="7")
    text = without_group(text, "output") + "&output history_count = 7, frame_count = 1 /\n"
    text = text.replace("contact = 'smooth', ", "contact = 'smooth', traction = 0.0, -300.0e3, ", 1)
    text = text.replace("-300.0e3, ", "-300.0e3, ramp_time = 1.0, ").replace(", /", " /")
    text = text.replace("&integration ", "&integration end_time = 1.0, ")
    done = run_case(text, tmp_path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stderr
    assert "limit load: " in (tmp_path / "out" / "case.log").read_text()
    rows = history(tmp_path / "out" / "case_history.csv")
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        last = file["frames"]["000001"]
        strain, moved = last["strain"][()], last["displacement"][()]
        height = file["points/position"][:, 1]
        inside = file["points/boundary"][()] == 0
        assert rows["min_det_f"][-1] == last["det_f"][inside].min() > 0.0
    # the mean strain is that of the ends of the body
    way = [moved[inside & (height == edge), 1].mean() for edge in (0.0, 1.0)]
    assert strain[inside, 1].mean() == pytest.approx(way[1] - way[0], rel=0.1)
    assert np.isfinite(strain).all()
