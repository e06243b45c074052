"""Give the program mutated inputs; none may bring it down or be read as something else.

    .venv/bin/python tests/proof/fuzz/fuzz.py --count 10000 --seed 1 --workers 2

Every input is a function of seed and number: `--from 4711 --count 1` makes one again. What fails is
kept in results/fuzz/. `make fuzz` calls this.
"""

import argparse
import contextlib
import io
import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parent))

import mutate
import seeds
import verdicts

ROOT = Path(__file__).resolve().parents[3]
SHARES = (("input", 0.80), ("cloud", 0.12), ("study", 0.08))
RUNS = 0.12  # of the inputs that are accepted are run, too
STUDY_STATUS = {0, 1, 2, 3, 4, 5}
CHUNK = 20


class World:
    """What every input begins from: made once, by the process that starts the others."""

    def __init__(self, program):
        self.program = str(program)
        with tempfile.TemporaryDirectory() as folder:
            self.reference = seeds.reference(self.program, folder)
            self.texts = seeds.inputs(self.program, ROOT, Path(folder))


def kind_of(random):
    place = random.random()
    for kind, share in SHARES:
        place -= share
        if place < 0:
            return kind
    return SHARES[-1][0]


def try_input(world, random, folder):
    data = mutate.namelist(random, world.texts, world.reference)
    (folder / "run.nml").write_bytes(data)
    accepted, printed, said = verdicts.check_namelist(
        world.program, folder, world.reference, thorough=random.random() < 0.3
    )
    if not accepted:
        return "input refused"
    verdicts.check_printed(world.program, folder, printed, said)
    if random.random() > RUNS:
        return "input accepted"
    verdicts.check_run(world.program, folder, seconds=1.0)
    return "input run"


def try_cloud(world, random, folder):
    (folder / "run.nml").write_text(seeds.CLOUD_INPUT)
    (folder / "points.txt").write_bytes(mutate.cloud(random, seeds.cloud()))
    if not verdicts.check_cloud(world.program, folder):
        return "cloud refused"
    if random.random() > RUNS:
        return "cloud accepted"
    verdicts.check_run(world.program, folder, seconds=1.0)
    return "cloud run"


def try_study(world, random, folder):
    """In this process, for most of the time goes into starting Python otherwise."""
    from perigeo_post.cli.command_line import main

    base, study = seeds.STUDY_BASE.encode(), seeds.STUDY.encode()
    if random.random() < 0.2:
        base = mutate.as_text(random, seeds.STUDY_BASE)
    else:
        study = mutate.as_text(random, seeds.STUDY)
    (folder / "base.nml").write_bytes(base)
    (folder / "study.toml").write_bytes(study)
    said = io.StringIO()
    words = ["study", str(folder / "study.toml"), "--dry-run", "--program", world.program,
             "--output", str(folder / "out")]  # fmt: skip

    def late(*_):
        raise verdicts.Wrong("study: no end within a minute")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(60)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = main(words)
    except SystemExit as left:
        status = left.code
    except (verdicts.Wrong, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise verdicts.Wrong(f"study: {type(error).__name__}: {error}") from error
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    if status not in STUDY_STATUS:
        raise verdicts.Wrong(f"study: exit status {status}\n{said.getvalue()[-2000:]}")
    if "Traceback" in said.getvalue():
        raise verdicts.Wrong(f"study: a traceback\n{said.getvalue()[-2000:]}")
    if status and "error: " not in said.getvalue() and "  " not in said.getvalue():
        raise verdicts.Wrong(f"study: exit status {status} without a word\n{said.getvalue()}")
    return "study accepted" if status == 0 else "study refused"


TRIES = {"input": try_input, "cloud": try_cloud, "study": try_study}


def try_one(world, seed, number):
    """Try one input; return what became of it and, where something is wrong, what."""
    random = Random(f"{seed}:{number}")
    kind = kind_of(random)
    with tempfile.TemporaryDirectory(prefix="perigeo-fuzz-") as name:
        folder = Path(name)
        try:
            return TRIES[kind](world, random, folder), None
        except verdicts.Slow:
            return f"{kind} too large to wait for", None
        except verdicts.Wrong as wrong:
            kept = ROOT / "results" / "fuzz" / f"{seed}-{number}"
            shutil.rmtree(kept, ignore_errors=True)
            kept.mkdir(parents=True)
            for path in folder.iterdir():
                if path.suffix in (".nml", ".txt", ".toml"):
                    shutil.copy(path, kept)
            (kept / "verdict.txt").write_text(f"{wrong}\n")
            return f"{kind} failed", f"{wrong}"


def try_some(world, seed, numbers):
    os.environ.setdefault("MPLBACKEND", "Agg")
    return [(number, *try_one(world, seed, number)) for number in numbers]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--program", type=Path, default=ROOT / "bin" / "perigeo-debug")
    options = parser.parse_args()
    begin = time.monotonic()
    world = World(options.program.resolve())
    last = options.first + options.count
    chunks = [range(n, min(n + CHUNK, last)) for n in range(options.first, last, CHUNK)]
    counts, failed, done = Counter(), 0, 0
    print(
        f"{options.count} inputs, seed {options.seed}, {len(world.texts)} to begin from", flush=True
    )
    with ProcessPoolExecutor(options.workers, initializer=verdicts.limit_this_process) as pool:
        waiting = [pool.submit(try_some, world, options.seed, chunk) for chunk in chunks]
        for some in waiting:
            for number, what, wrong in some.result():
                counts[what] += 1
                done += 1
                if wrong is not None:
                    failed += 1
                    first = " | ".join(wrong.splitlines()[:2])
                    print(f"  {number}: {first[:200]}", flush=True)
                if done % 1000 == 0:
                    print(f"  {done} tried, {failed} failed", flush=True)
    for what, count in sorted(counts.items()):
        print(f"  {what:32} {count:6}")
    print(f"  {time.monotonic() - begin:.0f} s")
    if failed:
        print(f"  what failed is kept in results/fuzz/{options.seed}-*")
    print(f"{done - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
