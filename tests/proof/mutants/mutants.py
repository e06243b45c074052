"""Plant small faults in the physics, one at a time: how many do the tests catch? `make mutants`

    mutants.py [--count 120] [--seed 1] [--only MODULE] [--workers 2] [--again FILE]

Faults are drawn by a seed, as many from each module as its number of statements asks for. Beside
them all faults of earlier.txt are planted, which were alive once. A fault counts as caught where a
unit suite or a case that runs the program fails, crashes or does not end. What does not compile, or
gives the same object code, is replaced by another one. Faults of equivalent.txt change nothing that
a user could see, for the reason given there, and do not count.

Exit status 0: at least 95 % of the others that were drawn are caught, and all of earlier.txt. The
findings are in build/mutants/findings.txt.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from faults import Fault, faults_of, tidy
from workshop import BUILD, ROOT, Check, Finding, Workshop, case_groups, suites

LAYERS = ("body", "operators", "material", "motion", "loads")
HERE = Path(__file__).parent
WANTED = 0.95
# Cases that run the program, those that notice most first. Frozen numbers and several ranks, which
# must have the bits of one, come last: what only they notice is told apart.
CASES = {
    "bodies": ["test_bodies.py", "test_bearings.py", "test_sight.py", "test_thin_bodies.py"],
    "physics": ["test_physics.py", "test_materials.py"],
    "loads": ["test_loads.py", "test_ground.py", "test_random_field.py"],
    "equilibrium": ["test_equilibrium.py", "test_strain_control.py", "test_operators.py"],
    "stages": ["test_stages.py", "test_stability.py"],
    "frozen": ["test_frozen.py"],
}
SLOW = (
    "continuous_across or held_fails or shown_before or restart or goes_on or threads or bits or "
    "collapses or no_increment_rule"
)
# Of several ranks those that look at numbers.
OF_RANKS = "serial_run or changes_a_bit or without_blocks or any_number or taken_back or fails_ends"
Key = tuple[str, str, str]


def sources(only: str) -> list[Path]:
    """Return the source files of the physics, or of the module or folder that is named."""
    if only:
        return [*(ROOT / "src").glob(f"*/{only}.f90"), *sorted((ROOT / "src" / only).glob("*.f90"))]
    return [p for layer in LAYERS for p in sorted((ROOT / "src" / layer).glob("*.f90"))]


def all_faults(only: str) -> dict[str, list[list[Fault]]]:
    """Return the faults of each module by its path, a list for each statement."""
    found = {}
    for source in sources(only):
        path = str(source.relative_to(ROOT))
        found[path] = faults_of(path, source.read_text())
    return {path: lists for path, lists in found.items() if lists}


def shares(sizes: dict[str, int], count: int) -> dict[str, int]:
    """Divide a count in proportion to sizes; what is left over goes to the largest remainders."""
    total = sum(sizes.values())
    exact = {name: count * size / total for name, size in sizes.items()}
    parts = {name: int(value) for name, value in exact.items()}
    rest = sorted(exact, key=lambda name: (parts[name] - exact[name], name))
    for name in rest[: count - sum(parts.values())]:
        parts[name] += 1
    return parts


def queue_of(lists: list[list[Fault]], chance: random.Random) -> list[Fault]:
    """Return the faults of a module in the order of the draw: first one of each statement."""
    rounds = []
    for faults in lists:
        order = list(faults)
        chance.shuffle(order)
        rounds += [(k, chance.random(), fault) for k, fault in enumerate(order)]
    return [fault for *_, fault in sorted(rounds, key=lambda entry: entry[:2])]


def read_list(name: str) -> dict[Key, str]:
    """Read faults with what is said of each: blocks of path, `- old`, `+ new` and a text."""
    found = {}
    for block in (HERE / name).read_text().split("\n\n"):
        lines = [line for line in block.splitlines() if line.strip() and not line.startswith("#")]
        if lines:
            path, old, new, *said = lines
            if not (old.startswith("- ") and new.startswith("+ ")):
                raise ValueError(f"{name}: not a fault: {block}")
            found[path, old[2:], new[2:]] = tidy(" ".join(said))
    return found


class Search:
    """All that the workers share."""

    def __init__(self, checks: list[Check], equivalent: dict[Key, str]) -> None:
        self.checks = checks
        self.equivalent = equivalent
        self.findings: list[Finding] = []
        self.reasons: Counter[str] = Counter()
        self.lock = threading.Lock()
        self.free: list[Workshop] = []

    def take(self) -> Workshop:
        """Take a workshop that is free; there are as many as workers."""
        with self.lock:
            return self.free.pop()

    def give_back(self, workshop: Workshop) -> None:
        """Give a workshop back."""
        with self.lock:
            self.free.append(workshop)

    def judge(self, fault: Fault) -> Finding:
        """Judge one fault in a workshop that is free."""
        if fault.key in self.equivalent:
            return Finding(fault, "equivalent", how=self.equivalent[fault.key])
        workshop = self.take()
        try:
            return workshop.judge(fault, self.checks)
        finally:
            self.give_back(workshop)

    def draw(self, queue: list[Fault]) -> None:
        """Judge the next fault of a queue, and others in its place where it is none."""
        while True:
            with self.lock:
                if not queue:
                    return
                fault = queue.pop(0)
            finding = self.judge(fault)
            if finding.verdict in ("same", "no compilation"):
                with self.lock:
                    self.reasons[finding.verdict] += 1
                continue
            with self.lock:
                self.findings.append(finding)
                show(len(self.findings), finding)
            return


def show(number: int, finding: Finding) -> None:
    """Print one finding as it comes."""
    fault = finding.fault
    by = f" by {finding.by}: {finding.how}" if finding.verdict == "caught" else ""
    print(
        f"{number:4d}  {finding.verdict}{by}  [{fault.path}:{fault.line}, {finding.seconds:.0f} s]"
    )
    if finding.verdict == "alive":
        print("      " + str(fault).replace("\n", "\n      "))
    sys.stdout.flush()


def measure(search: Search) -> bool:
    """Run all checks on the program as it is: they must pass, and show how long they take."""

    def one(check: Check) -> bool:
        check.seconds = 100.0  # no limit that a slow machine reaches
        workshop = search.take()
        try:
            how, check.seconds = workshop.run(check)
        finally:
            search.give_back(workshop)
        if how:
            print(f"{check.name} fails without a fault: {how}")
        return not how

    with ThreadPoolExecutor(max_workers=len(search.free)) as pool:
        list(pool.map(Workshop.build, search.free))
        kinds = ("ranks", "case", "unit")  # those that take longest first
        longest_first = sorted(search.checks, key=lambda check: kinds.index(check.kind))
        return all(list(pool.map(one, longest_first)))


def find(names: dict[Key, str], faults: dict[str, list[list[Fault]]]) -> list[Fault]:
    """Return the listed faults that the sources still have."""
    known = {f.key: f for lists in faults.values() for here in lists for f in here}
    for key in names:
        if key not in known and key[0] in faults:
            print(f"no longer in the sources: {key[0]}: {key[1]}")
    return [known[key] for key in names if key in known]


def report(search: Search, earlier: dict[Key, str], seconds: float) -> int:
    """Print what was found; return the exit status."""
    verdicts = Counter(finding.verdict for finding in search.findings)
    alive = [f for f in search.findings if f.verdict == "alive"]
    caught = [f for f in search.findings if f.verdict == "caught"]
    lines = []
    for finding in sorted(search.findings, key=lambda f: (f.verdict, f.fault.path, f.fault.line)):
        lines += [f"{finding.verdict} {finding.by} {finding.how}".strip(), f"{finding.fault}", ""]
    (BUILD / "findings.txt").write_text("\n".join(lines))
    if alive:
        print("\nalive:\n")
    for finding in alive:
        print(f"{finding.fault}\n  line {finding.fault.line}\n")
    kinds = {"frozen": "frozen numbers alone", "ranks": "several ranks alone"}
    by = Counter(
        "unit suites" if f.by.startswith("test_") else kinds.get(f.by, "other cases")
        for f in caught
    )
    drawn = [f for f in alive + caught if f.fault.key not in earlier] or alive + caught
    share = sum(f.verdict == "caught" for f in drawn) / len(drawn) if drawn else 0.0
    print(
        f"caught by {', '.join(f'{name}: {number}' for name, number in by.most_common())}; "
        f"replaced: {search.reasons['no compilation']} that do not compile, "
        f"{search.reasons['same']} with the same object code; {seconds:.0f} s"
    )
    print(
        f"{len(caught)} caught, {len(alive)} alive, {verdicts['equivalent']} equivalent; "
        f"of {len(drawn)} that were drawn: {100.0 * share:.1f} % caught"
    )
    returned = [f for f in alive if f.fault.key in earlier]
    if returned:
        print(f"{len(returned)} of them are in earlier.txt: a test has been lost")
    return 0 if share >= WANTED and not returned else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=120, help="how many faults to draw")
    parser.add_argument("--seed", type=int, default=1, help="which ones")
    parser.add_argument("--only", default="", metavar="NAME", help="of this module or folder")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--again", metavar="FILE", help="the faults of a list, and no others")
    parser.add_argument("--without-cases", action="store_true", help="unit suites alone")
    options = parser.parse_args()

    begin = time.monotonic()
    checks = suites(BUILD)
    if not options.without_cases:
        checks += case_groups(CASES, f"not ({SLOW})")
        checks += case_groups({"ranks": ["test_ranks.py"]}, OF_RANKS, kind="ranks")
    faults = all_faults(options.only)
    search = Search(checks, read_list("equivalent.txt"))
    search.free = [Workshop(k + 1) for k in range(max(1, options.workers))]
    earlier = read_list("earlier.txt")
    physics = {Path(path).stem for path in faults}
    checks[:] = [c for c in checks if not c.modules or c.modules & physics]
    if not measure(search):
        return 1
    print(f"{len(checks)} checks pass, in {sum(c.seconds for c in checks):.0f} s; faults follow")
    sys.stdout.flush()

    chance = random.Random(options.seed)
    parts = shares({path: len(lists) for path, lists in faults.items()}, options.count)
    if options.again:
        queues = [[f] for f in find(read_list(options.again), faults)]
        jobs = queues
    else:
        jobs = [[fault] for fault in find(earlier, faults)]
        for path, lists in faults.items():
            queue = [f for f in queue_of(lists, chance) if f.key not in earlier]
            jobs += [queue] * parts[path]
        chance.shuffle(jobs)  # a run that is cut short has seen a fair sample
    with ThreadPoolExecutor(max_workers=len(search.free)) as pool:
        for job in [pool.submit(search.draw, queue) for queue in jobs]:
            job.result()
    for workshop in search.free:
        workshop.close()
    return report(search, earlier, time.monotonic() - begin)


if __name__ == "__main__":
    sys.exit(main())
