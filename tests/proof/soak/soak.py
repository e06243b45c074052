"""Kill runs at random, damage their checkpoints, fill their disks; the end must be the same.

    .venv/bin/python tests/proof/soak/soak.py --minutes 20 --seed 1

Every trial ends with a run that is brought to its end, and history, points and frames are compared
with those of a run that was left alone, bit for bit. What fails is kept in results/soak/.
`make soak` calls this.
"""

import argparse
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests" / "cases"))

import h5py  # noqa: E402
from case_files import groups_of  # noqa: E402

LIMIT = 120.0  # seconds for one run
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1)
TOLD = {signal.SIGTERM: 143, signal.SIGHUP: 143, signal.SIGUSR1: 143, signal.SIGINT: 130}

SPECIMEN = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.25, horizon = 0.6 /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.01 /
&stabilisation method = '{control}' /
&integration final_strain = 0.01, damping = 5.0e5, damping_frame = 'platens' /
&imperfection amplitude = 1.0e-3, x = 0.0, y = 0.5, radius = 0.3 /
&output frame_count = {frames}, history_count = {rows}, checkpoint_every = {every} /
"""
BLOCKS = """\
&run name = 'case', output_dir = 'out' /
&discretisation spacing = 0.2, horizon = 0.6, layout = 'cells' /
&body name = 'left', x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&body name = 'right', x_min = 1.0, x_max = 2.0, y_min = 0.0, y_max = 2.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 1.0e5 /
&boundary name = 'base', side = 'bottom', contact = 'smooth' /
&boundary name = 'cap', side = 'top', contact = 'smooth', velocity = 0.0, -0.001 /
&stage name = 'press', end_time = 1.0 /
&stage name = 'dig', end_time = 2.0, excavate = 'right' /
&integration method = 'equilibrium', increments = 10, residual = 1.0e-5 /
&output frame_count = 5, checkpoint_every = {every} /
"""
INPUTS = {
    "motion": SPECIMEN.format(control="none", frames=5, rows=200, every="0.01"),
    "motion, rare checkpoints": SPECIMEN.format(
        control="relaxing", frames=20, rows=500, every="0.05"
    ),
    "motion, no checkpoints": SPECIMEN.format(control="none", frames=5, rows=100, every="0.0"),
    "equilibrium in stages": BLOCKS.format(every="0.01"),
}


class Wrong(Exception):  # noqa: N818 (the verdict, no error of this program)
    """What must not be."""


class Case:
    """An input, and what a run of it that is left alone leaves behind."""

    def __init__(self, name, text, program, folder):
        self.name, self.text = name, text
        folder.mkdir()
        (folder / "run.nml").write_text(text)
        taken = []
        for _ in range(3):
            begin = time.monotonic()
            subprocess.run([program, "--quiet", "--force", "--threads", "1", "run.nml"], cwd=folder,
                           check=True, stderr=subprocess.DEVNULL)  # fmt: skip
            taken.append(time.monotonic() - begin)
        self.seconds = min(taken)
        self.history = (folder / "out" / "case_history.csv").read_bytes()
        self.result = state_of(folder / "out" / "case.h5")
        self.sizes = [path.stat().st_size for path in (folder / "out").iterdir()]


def state_of(path):
    """Return history, points and frames of a result, every number as bytes."""
    with h5py.File(path, "r", locking=False) as file:
        if file.attrs["complete"] != 1:
            raise Wrong("the result is not complete")
        found = groups_of(file, ("points", "frames", "history"))
    return {path: value.tobytes() for path, value in found.items()}


class Trial:
    """One folder in which runs are begun, killed and brought to an end."""

    def __init__(self, programs, case, folder, random, counts):
        self.programs, self.case, self.folder = programs, case, folder
        self.random, self.counts = random, counts
        self.story = [case.name]
        (folder / "run.nml").write_text(case.text)

    def begin(self, *options, size=None, program=None, threads=None):
        """Start the program; return its process."""

        def limits():
            if size is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        threads = threads or self.random.choice((1, 1, 2))
        words = [program or self.programs[0], "--quiet", *options]
        if program is None:
            words += ["--threads", str(threads)]
        self.story.append(" ".join(map(str, words[1:])) + (f" [{size} bytes]" if size else ""))
        return subprocess.Popen(
            [*words, "run.nml"], cwd=self.folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
            preexec_fn=limits, env={**os.environ, "OMP_WAIT_POLICY": "passive"},
        )  # fmt: skip

    def end(self, process, allowed):
        """Wait for a process; return its exit status and what it said."""
        try:
            _, said = process.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise Wrong("it hangs") from None
        self.story.append(f"  ends with {process.returncode} {said.strip()[-300:]}")
        if process.returncode not in allowed:
            raise Wrong(f"exit status {process.returncode}: {said[-2000:]}")
        if "Backtrace" in said:
            raise Wrong(f"a backtrace: {said[-2000:]}")
        return process.returncode, said

    def kill(self, process):
        """Send a random signal at a random moment; return whether it hit a living run."""
        number = self.random.choice(SIGNALS)
        wait = self.random.random() ** 1.5 * self.case.seconds
        time.sleep(wait)
        alive = process.poll() is None
        if alive:
            process.send_signal(number)
            self.counts[f"kills by {number.name}"] += 1
            self.counts["kills"] += 1
        self.story.append(f"  {number.name} after {wait:.3f} s, alive: {alive}")
        # before the run has its handlers the signal ends it by itself: nothing is written then
        self.end(process, {0, -number, TOLD.get(number, 0)})

    def go_on(self, **options):
        """Begin to bring the run to its end: --restart where there is a checkpoint."""
        there = list((self.folder / "out").glob("case_checkpoint*.h5"))
        return self.begin("--restart" if there else "--force", **options)

    def finish(self, allowed=(0,)):
        """Bring the run to its end and compare."""
        status, _ = self.end(self.go_on(), allowed)
        if status != 0:
            self.end(self.begin("--force"), {0})
        self.compare()

    def compare(self):
        out = self.folder / "out"
        if (out / "case_history.csv").read_bytes() != self.case.history:
            raise Wrong("another history")
        found = state_of(out / "case.h5")
        if found.keys() != self.case.result.keys():
            raise Wrong("other groups")
        for path, value in found.items():
            if value != self.case.result[path]:
                raise Wrong(f"{path} differs")
        ElementTree.parse(out / "case.xdmf")
        if (out / "case.lock").exists():
            raise Wrong("a lock is left behind")


# ------------------------------------------------------------------------------------ trials


def killed(trial):
    """Kill the run, its restart and the restart of that."""
    trial.kill(trial.begin())
    for _ in range(trial.random.choice((0, 1, 2, 3, 5, 8))):
        trial.kill(trial.go_on())
    trial.finish()


def damaged(trial):
    """Kill the run, and damage the newest checkpoint."""
    trial.kill(trial.begin())
    path = trial.folder / "out" / "case_checkpoint.h5"
    older = trial.folder / "out" / "case_checkpoint_previous.h5"
    if path.exists():
        data = bytearray(path.read_bytes())
        at = trial.random.randrange(max(1, len(data)))
        way = trial.random.choice(("cut", "a bit", "zeros", "empty", "text"))
        if way == "cut":
            data = data[:at]
        elif way == "a bit" and data:
            data[at] ^= 1 << trial.random.randrange(8)
        elif way == "zeros":
            data[at : at + 4096] = bytes(len(data[at : at + 4096]))
        elif way == "empty":
            data = bytearray()
        elif way == "text":
            data = bytearray(b"no checkpoint\n")
        path.write_bytes(data)
        trial.counts[f"checkpoints damaged: {way}"] += 1
        trial.story.append(f"  {way} at {at} of the checkpoint, one before it: {older.exists()}")
    # without one before it the damage may have taken the only state: the restart says so
    trial.finish(allowed=(0,) if older.exists() or not path.exists() else (0, 5))


def crowded(trial):
    """Start several runs at once."""
    first = trial.random.choice((["--force"], []))
    runs = [trial.begin(*first) for _ in range(trial.random.choice((2, 3)))]
    ends = [trial.end(run, {0, 5})[0] for run in runs]
    if 0 not in ends:
        raise Wrong(f"none of {len(runs)} runs at once has come to its end")
    trial.counts["runs at once"] += len(runs)
    trial.compare()


def crowded_restart(trial):
    """Kill a run, and restart it several times at once."""
    trial.kill(trial.begin())
    runs = [trial.go_on() for _ in range(2)]
    ends = [trial.end(run, {0, 5})[0] for run in runs]
    trial.counts["runs at once"] += len(runs)
    if 0 not in ends:
        raise Wrong("neither of two restarts at once has come to its end")
    trial.compare()


def full(trial):
    """A disk that is full at some moment, perhaps a kill of the restart, then room."""
    size = trial.random.randrange(500, int(1.05 * max(trial.case.sizes)))
    trial.end(trial.begin(size=size), {0, 5})
    trial.counts["full disks"] += 1
    if trial.random.random() < 0.3:
        trial.kill(trial.go_on())
    trial.finish()


def rank_killed(trial):
    """Kill one rank of several with SIGKILL, go on with another number of them."""
    words = ["mpirun", "--oversubscribe", "--allow-run-as-root", "-n", "2"]
    trial.story.append("2 ranks")
    process = subprocess.Popen(
        [*words, trial.programs[1], "--quiet", "--threads", "1", "run.nml"], cwd=trial.folder,
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        errors="replace",
    )  # fmt: skip
    time.sleep(0.3 + trial.random.random() * 3.0 * trial.case.seconds)
    ranks = children(process.pid)
    if ranks:
        os.kill(trial.random.choice(ranks), signal.SIGKILL)
        trial.counts["kills of a rank"] += 1
        trial.counts["kills"] += 1
    process.communicate(timeout=LIMIT)
    trial.finish()


def children(parent):
    """Return the processes that a process has started and that run the program."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, rest = path.read_text().rsplit(")", 1)
        except OSError:
            continue
        if int(rest.split()[1]) == parent and "perigeo" in name:
            found.append(int(path.parent.name))
    return found


TRIALS = ((killed, 0.5), (damaged, 0.2), (full, 0.12), (crowded, 0.06), (crowded_restart, 0.12))


def choose(random, case, with_ranks):
    if with_ranks and case.name.startswith("motion") and random.random() < 0.05:
        return rank_killed
    place = random.random()
    for trial, share in TRIALS:
        place -= share
        if place < 0:
            return trial
    return killed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--kills", type=int, help="end after so many kills, however long it takes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--program", type=Path, default=ROOT / "bin" / "perigeo")
    options = parser.parse_args()
    programs = [str(options.program.resolve()), str(ROOT / "bin" / "perigeo-mpi")]
    with_ranks = Path(programs[1]).exists() and shutil.which("mpirun") is not None
    random, counts = Random(options.seed), Counter()
    begin, passed, failed = time.monotonic(), 0, 0
    with tempfile.TemporaryDirectory(prefix="perigeo-soak-") as name:
        cases = [
            Case(title, text, programs[0], Path(name) / f"straight-{k}")
            for k, (title, text) in enumerate(INPUTS.items())
        ]
        for case in cases:
            print(f"  {case.name}: {case.seconds:.2f} s when left alone", flush=True)

        def goes_on():
            if options.kills is not None:
                return counts["kills"] < options.kills
            return time.monotonic() - begin < 60.0 * options.minutes

        while goes_on():
            folder = Path(name) / "trial"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            case = random.choice(cases)
            do = choose(random, case, with_ranks)
            trial = Trial(programs, case, folder, random, counts)
            counts[f"trials: {do.__name__.replace('_', ' ')}"] += 1
            try:
                do(trial)
                passed += 1
            except Wrong as wrong:
                failed += 1
                keep(folder, failed, trial.story, wrong)
                print(f"  FAILED {do.__name__}, {case.name}: {wrong}", flush=True)
            if (passed + failed) % 200 == 0:
                print(f"  {counts['kills']} kills, {passed} passed, {failed} failed", flush=True)
    for what in sorted(counts):
        print(f"  {what:32} {counts[what]:6}")
    print(f"  {time.monotonic() - begin:.0f} s, {counts['kills']} kills")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


def keep(folder, number, story, wrong):
    kept = ROOT / "results" / "soak" / str(number)
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(folder, kept)
    (kept / "story.txt").write_text("\n".join([*story, str(wrong), ""]))


if __name__ == "__main__":
    sys.exit(main())
