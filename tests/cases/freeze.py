"""Freeze the results of tests/cases/test_frozen.py anew, after a change that is meant.

    .venv/bin/python tests/cases/freeze.py [--program PROGRAM ...]

Prints what has changed and by how much. Name all programs in one call (bin/perigeo and
bin/perigeo-debug are the default, where they are there): where results of a known build change,
the checksums of builds that are not among them are dropped. The numbers are those of the first.
"""

import argparse
import tempfile
from pathlib import Path

from frozen_cases import CASES, changes, differences, read, run, write

ROOT = Path(__file__).resolve().parents[2]


def freeze(case, results):
    """Freeze a case; return lines that say what has changed."""
    frozen = read(case)
    old, reference = frozen["checksums"], frozen["numbers"]
    lines, changed = [], False
    for build, sums, numbers in results:
        if build not in old:
            lines.append(f"new build: {build}")
            continue
        found = changes(sums, old[build], numbers, reference)
        added = [f"{name}: new" for name in sorted(sums.keys() - old[build].keys())]
        changed = changed or bool(found)
        lines += [f"build: {build}"] * bool(found + added) + found + added
    new = {build: sums for build, sums, _ in results}
    kept = {} if changed else {build: sums for build, sums in old.items() if build not in new}
    lines += [f"dropped: {build}" for build in old if build not in kept | new]
    if lines:
        same = reference and not changed
        first = results[0][2]
        far = max(differences(first, reference).values()) if reference else 0.0
        lines.append(f"largest relative difference to the numbers before: {far:.1e}")
        numbers = {**first, **reference} if same else first
        write(case, {"checksums": kept | new, "numbers": numbers})
    return lines


def main():
    """Run all cases with all programs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", nargs="+", type=Path, help="programs to freeze")
    programs = parser.parse_args().program
    if programs is None:
        usual = (ROOT / "bin" / name for name in ("perigeo", "perigeo-debug"))
        programs = [path for path in usual if path.exists()]
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            results = [
                run(program.resolve(), case, Path(folder) / str(k), 1)
                for k, program in enumerate(programs)
            ]
        lines = freeze(case, results)
        print(f"{case}: {'nothing has changed' if not lines else ''}")
        for line in lines:
            print(f"  {line}")


if __name__ == "__main__":
    main()
