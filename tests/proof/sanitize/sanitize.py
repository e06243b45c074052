"""Races and memory: the program under checkers.

    .venv/bin/python tests/proof/sanitize/sanitize.py [races] [address] [quick] [valgrind]

races     ThreadSanitizer with an OpenMP that it understands; races planted on purpose are found
address   AddressSanitizer and the sanitizer of undefined behaviour over the unit suites, tiny runs
          and cases that run the program; faults planted on purpose are found
quick     the same over the tiny runs and a few suites: an eighth of the time. Only on demand
valgrind  a tiny run of the checking build

`make sanitize` calls this.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addresses
from common import ROOT, Count, make, run

HERE = Path(__file__).resolve().parent

TWO_BLOCKS = 0.05  # spacing of bodies with several blocks of 256 rows
BODY = """\
&run name = 'case', output_dir = 'out', operators = '{operators}' /
&discretisation spacing = {spacing}, horizon = {horizon} /
&body x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 2.0 /
&material model = 'j2', density = 2000.0, youngs_modulus = 50.0e6, poissons_ratio = 0.3
  yield_stress = 0.15e6, kinematic_modulus = -1.5e6, residual_strength = 15.0e3 /
&boundary name = 'bottom', side = 'bottom' /
&boundary name = 'top', side = 'top', contact = 'smooth', velocity = 0.0, -0.1 /
&pressure name = 'wall', side = 'left', value = 1.0e4, ramp_time = 0.01 /
&stabilisation method = '{control}' /
&integration end_time = {end}, damping = 5.0e5{more} /
&imperfection amplitude = 1.0e-3, x = 0.0, y = 0.5, radius = 0.3 /
&output frame_count = 2, history_count = 10, checkpoint_every = 1.0e-3 /
"""


def body(operators, control, more="", spacing=0.25, end=0.03):
    return BODY.format(
        operators=operators, control=control, more=more, spacing=spacing, horizon=3.01 * spacing,
        end=end,
    )  # fmt: skip


EQUILIBRIUM = ", method = 'equilibrium', increments = 2, residual = 1.0e-2"
TINY = {
    "lattice": body("lattice", "none"),
    "list, relaxing control": body("list", "relaxing"),
    "Silling's control": body("list", "silling").replace("'silling'", "'silling', factor = 0.5"),
    "equilibrium": body("auto", "relaxing", EQUILIBRIUM.replace("method", "\n  method")),
}
TINY["equilibrium"] = TINY["equilibrium"].replace(", damping = 5.0e5", "")
RACING = {
    "lattice": body("lattice", "none", spacing=TWO_BLOCKS, end=0.004),
    "list": body("list", "relaxing", spacing=TWO_BLOCKS, end=0.004),
}

# Races as they happen: a variable that is not private, a range one row too long. The text is in
# the file once.
PLANTS = {
    "a variable is not private": (
        "src/motion/pd_forces.f90",
        "    !$omp parallel do schedule(static) default(none) private(block, lo, hi, p) &\n"
        "    !$omp shared(n_blocks, operators, materials, u, h, state, next)\n",
        "    !$omp parallel do schedule(static) default(none) private(block, hi, p) &\n"
        "    !$omp shared(lo, n_blocks, operators, materials, u, h, state, next)\n",
    ),
    "blocks overlap by a row": (
        "src/motion/pd_forces.f90",
        "          operators%domain%blocks%hi(blocks(k)), state%displacement, state%force)\n",
        "          min(operators%domain%blocks%hi(blocks(k)) + 1, size(state%force, 1)), &\n"
        "          state%displacement, state%force)\n",
    ),
}


# ------------------------------------------------------------------------------------ parts


def races(count):
    """ThreadSanitizer, with regions that start and join threads."""
    flags = "-O1 -g -fsanitize=thread"
    folder = ROOT / "build" / "sanitize-races"
    folder.mkdir(parents=True, exist_ok=True)
    shim = folder / "threads.o"
    subprocess.run(
        ["gcc", "-O1", "-g", "-Wall", "-Wextra", "-fsanitize=thread", "-c", HERE / "threads.c",
         "-o", shim], check=True,
    )  # fmt: skip
    settings = ("ALIGNED=0", f"FFLAGS={flags}", f"aligned={shim} -lpthread")
    built = make("sanitize-races", *settings, "program")
    count.note("build with the sanitizer of threads", built)
    if not built:
        return
    program = folder / "perigeo"
    for name, text in RACING.items():
        status, said = race_run(program, text)
        count.note(f"no race: {name}", status == 0 and "ThreadSanitizer" not in said, said)
    for name, plant in PLANTS.items():
        planted = plant_in(plant, folder, flags, shim)
        found = False
        said = "it could not be built"
        if planted is not None:
            status, said = race_run(planted, RACING["list"])
            found = "ThreadSanitizer: data race" in said and status == 66
        count.note(f"a race planted on purpose is found: {name}", found, said)


def race_run(program, text):
    # addresses drawn at random may lie where this sanitizer has its own memory
    still = ["setarch", os.uname().machine, "-R"]
    if subprocess.run([*still, "true"], check=False, capture_output=True).returncode != 0:
        still = []
    # the library of gfortran takes its locks in several orders: no deadlock of one thread
    options = {"TSAN_OPTIONS": "exitcode=66:detect_deadlocks=0"}
    return run([*still, program, "--threads", "2"], text, options)


def plant_in(plant, folder, flags, shim):
    """Compile one source with a fault, and link it with the others; return the program."""
    name, old, new = plant
    text = (ROOT / name).read_text()
    if text.count(old) != 1:
        print(f"  {name} no longer has the text to change")
        return None
    with tempfile.TemporaryDirectory(prefix="perigeo-plant-") as scratch:
        source = Path(scratch) / Path(name).name
        source.write_text(text.replace(old, new))
        objects = [path for path in sorted(folder.glob("*.o"))
                   if path.stem != source.stem and path != shim]  # fmt: skip
        compile_ = ["gfortran", "-std=f2008", *flags.split(), "-fopenmp", f"-I{folder}",
                    f"-J{scratch}"]  # fmt: skip
        planted = folder / "planted"
        faulty = Path(scratch) / "faulty.o"
        words = ["sh", "tools/hdf5_flags.sh", "link", "gfortran"]
        asked = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
        link = asked.stdout.split()
        for words in (
            [*compile_, "-c", source, "-o", faulty],
            [*compile_, "-o", planted, faulty, *objects, shim, *link, "-lpthread"],
        ):
            done = subprocess.run(words, check=False, capture_output=True, text=True)
            if done.returncode != 0:
                print(done.stderr[-3000:])
                return None
    return planted


def valgrind(count):
    """Memory of a tiny run, every load and store."""
    if shutil.which("valgrind") is None:
        count.note("valgrind is not there: apt-get install valgrind", False)
        return
    program = ROOT / "bin" / "perigeo-debug"
    words = ["valgrind", "--error-exitcode=99", "--quiet", program, "--threads", "1"]
    for name in ("lattice", "equilibrium"):
        text = TINY[name].replace("end_time = 0.03", "end_time = 0.01")
        status, said = run(words, text, {})
        count.note(f"valgrind: {name}", status == 0 and "== " not in said, said)


PARTS = {
    "races": races,
    "address": lambda count: addresses.check(count, TINY),
    "quick": lambda count: addresses.check(count, TINY, quick=True),
    "valgrind": valgrind,
}
ALL = ("races", "address", "valgrind")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], default=[])
    options = parser.parse_args()
    count = Count()
    for part in options.parts or ALL:
        PARTS[part](count)
    print(f"{count.passed} passed, {count.failed} failed")
    return 1 if count.failed or not count.passed else 0


if __name__ == "__main__":
    sys.exit(main())
