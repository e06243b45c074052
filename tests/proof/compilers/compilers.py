"""What other compilers make of the sources: those that are installed, beside the one of `make`.

    .venv/bin/python tests/proof/compilers/compilers.py [gfortran-11 ...] [flang]

gfortran-N  builds the program and the unit suites, and runs them; not the one that `make` takes
flang       compiles all modules that need no HDF5, whose modules are gfortran's; the newest there

`make compilers` calls this. What is not installed is skipped, and said.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from common import ROOT, Count, make, names_of_suites, run_suite

GFORTRANS = [f"gfortran-{n}" for n in range(11, 17)]
FLANGS = [name for n in range(25, 15, -1) for name in (f"flang-{n}", f"flang-new-{n}")] + ["flang"]
# Modules of HDF5 that sources use: gfortran wrote them, and only gfortran reads them.
FOREIGN = re.compile(r"^\s*use\s*(?:::)?\s*(?:hdf5|h5\w+)\b", re.I | re.M)


def gfortran(count, name):
    """The program and all suites, built without what depends on this machine's processor."""
    folder = f"compilers-{name}"
    built = make(folder, f"FC={name}", "FFLAGS=-O1", "unit_flags=-O0 -g", "program", "units")
    count.note(f"{name}: program and suites are built", built)
    if not built:
        return
    bad = []
    suites = names_of_suites(f"FC={name}")
    for suite in suites:
        status, said = run_suite(ROOT / "build" / folder / "unit" / suite, {"OMP_NUM_THREADS": "1"})
        if status != 0 or "\nfail" in said:
            bad.append(f"{suite}: exit status {status}\n{said[-1500:]}")
    count.note(f"{name}: {len(suites) - len(bad)} of {len(suites)} suites", not bad, "\n".join(bad))


def version_of(name):
    words = [*name.split(), "-dumpfullversion"]
    return subprocess.run(words, check=False, capture_output=True, text=True).stdout


def reads_hdf5(name):
    """Whether a gfortran reads the modules of the HDF5 library that is here."""
    asked = ["sh", "tools/hdf5_flags.sh", "compile", name]
    flags = subprocess.run(asked, cwd=ROOT, check=False, capture_output=True, text=True).stdout
    words = [name, "-fsyntax-only", *flags.split(), "-x", "f95", "-"]
    text = "use hdf5\nend\n"
    done = subprocess.run(words, cwd=ROOT, input=text, text=True, check=False, capture_output=True)
    return done.returncode == 0


def flang(count, name):
    """Objects of every module that needs no HDF5, in a folder of their own."""
    folder = ROOT / "build" / "compilers-flang"
    folder.mkdir(parents=True, exist_ok=True)
    names, total = without_hdf5(folder)
    words = ["make", "--no-print-directory", "-k", f"-j{os.cpu_count() or 1}"]
    done = subprocess.run(
        [*words, "-f", "tests/proof/compilers/flang.mk", f"FLANG={name}",
         f"OUT={folder.relative_to(ROOT)}", f"NAMES={' '.join(names)}"],
        cwd=ROOT, check=False, capture_output=True, text=True,
    )  # fmt: skip
    errors = "\n".join(line for line in done.stderr.splitlines() if "warning" not in line)
    made = sum((folder / f"{module}.o").exists() for module in names)
    what = f"{name}: {made} of {len(names)} modules without HDF5, of {total} in all"
    count.note(what, done.returncode == 0, errors)


def without_hdf5(folder):
    """Return the modules that use no HDF5, themselves or by others; and how many there are."""
    layers = subprocess.run(["make", "-s", "--no-print-directory", "layers"], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout.split()  # fmt: skip
    sources = [path for layer in layers for path in sorted((ROOT / "src" / layer).glob("*.f90"))]
    words = ["awk", "-f", "tools/depends.awk", "-v", f"build={folder.relative_to(ROOT)}",
             "-v", "unit=none", *(str(path.relative_to(ROOT)) for path in sources)]  # fmt: skip
    rules = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    left_out = {path.stem for path in sources if FOREIGN.search(path.read_text())} | {"pd_version"}
    pairs = [tuple(Path(name).stem for name in rule.split(": ")) for rule in rules.splitlines()]
    while more := {user for user, used in pairs if used in left_out} - left_out:
        left_out |= more
    names = [path.stem for path in sources if path.stem not in left_out]
    kept = [rule for rule, (user, _) in zip(rules.splitlines(), pairs) if user in names]
    (folder / "depends.mk").write_text("\n".join(kept) + "\n")
    return names, len(sources)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("compilers", nargs="*", choices=[*GFORTRANS, "flang", []], default=[])
    asked = parser.parse_args().compilers or [*GFORTRANS, "flang"]
    count = Count()
    for name in asked:
        there = [one for one in (FLANGS if name == "flang" else [name]) if shutil.which(one)]
        if not there:
            print(f"  skipped {name}: not installed")
        elif name == "flang":
            flang(count, there[0])
        elif version_of(name) == version_of(os.environ.get("FC", "gfortran")):
            print(f"  skipped {name}: it is the compiler of make")
        elif not reads_hdf5(name):
            print(f"  skipped {name}: it does not read the modules of the HDF5 that is here")
        else:
            gfortran(count, name)
    print(f"{count.passed} passed, {count.failed} failed")
    return 1 if count.failed else 0


if __name__ == "__main__":
    sys.exit(main())
