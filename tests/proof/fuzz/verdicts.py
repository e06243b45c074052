"""What must hold of a program that got an input, whatever the input is."""

import math
import os
import re
import resource
import signal
import subprocess
import tempfile

from namelists import NUMBER, NotPlain, decoded, read

LIMIT = 60.0  # seconds; longer is a hang
PATIENCE = 4.0  # seconds for a body that is large, and says so
MEMORY = 3 * 2**30
FILE_SIZE = 64 * 2**20
LARGE, MANY_BONDS = 20000, 2e6  # points and bonds of bodies that may take their time
STRAY = (
    "Backtrace", "backtrace", "Fortran runtime error", "SIG", "At line ", "malloc", "free()",
    "Traceback", "corrupt", "HDF5-DIAG", "core dumped", "IEEE",
)  # fmt: skip
NO_NUMBER = re.compile(r"\bNaN\b|\bInf(inity)?\b|\*\*\*|\d[+-]\d{3}\b", re.I)


class Wrong(Exception):  # noqa: N818 (the verdict, no error of this program)
    """What a program did that it must not do."""


class Slow(Exception):  # noqa: N818
    """A run that may take its time: no verdict."""


def limit_this_process():
    """Limit this process and all that it starts."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_SIZE, FILE_SIZE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def call(words, folder, stop_after=None, may_be_slow=False):
    """Run a program in a folder; return its exit status, and what it said on both channels."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "LC_ALL": "C"}
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:

        def said(file):
            file.seek(0)
            return file.read().decode(errors="replace")

        process = subprocess.Popen(
            words, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            env=environment,
        )  # fmt: skip
        for seconds in (PATIENCE if stop_after is None else stop_after, LIMIT):
            try:
                process.wait(timeout=seconds)
                break
            except subprocess.TimeoutExpired:
                if stop_after is not None:
                    process.send_signal(signal.SIGTERM)
                elif is_large(said(out)):
                    break
        if process.poll() is None:
            process.kill()
            process.wait()
            if may_be_slow or is_large(said(out)):
                raise Slow
            raise Wrong(f"no end within {LIMIT:.0f} s: {' '.join(words[1:])}")
        return process.returncode, said(out), said(err)


def is_large(said):
    """Whether the program has said that a body takes a while, before it sets it up."""
    count = re.search(r"^about (\S+) points", said)
    return count is not None and float(count.group(1)) > LARGE


def judge(words, folder, allowed, **options):
    """Run a program; return what `call` does; raise Wrong for an end that must not be."""
    status, out, err = call(words, folder, **options)
    what = " ".join(words[1:])
    if status not in allowed:
        raise Wrong(f"{what}: exit status {status}\n{out[-1000:]}\n{err[-3000:]}")
    for stray in STRAY:
        if any(stray in line for line in err.splitlines() if not line.startswith("perigeo: ")):
            raise Wrong(f"{what}: says {stray!r}\n{err[-3000:]}")
    if status == 0 and "perigeo: error" in err:
        raise Wrong(f"{what}: an error, and exit status 0\n{err[-2000:]}")
    for line in err.splitlines():
        if NO_NUMBER.search(re.sub(r"'[^']*'", "", line)) and "found: " not in line:
            raise Wrong(f"{what}: says no number: {line}")
    if status not in (0, 143, -15) and "perigeo: error: " not in err:
        raise Wrong(f"{what}: exit status {status} without a word\n{err[-2000:]}")
    return status, out, err


def contents(folder):
    return {path.relative_to(folder): path.stat().st_size for path in folder.rglob("*")}


# ------------------------------------------------------------------------------------ inputs


def bonds(printed):
    """About how many bonds the bodies of an input have."""
    groups = read(printed)
    keys = next(keys for name, keys in groups if name == "discretisation")
    spacing, horizon = keys["spacing"][0], keys["horizon"][0]
    area = 0.0
    for name, body in groups:
        if name == "body" and "x_max" in body:
            sides = [body[f"{axis}_max"][0] - body[f"{axis}_min"][0] for axis in "xy"]
            area += math.prod(side / spacing + 1.0 for side in sides)
    return area * math.pi * (horizon / spacing) ** 2


def check_namelist(program, folder, reference, thorough):
    """Look at run.nml by --print-input and --check; return whether both accept it.

    Of what is refused by the first the second is asked only if `thorough`.
    """
    before = contents(folder)
    printed_status, printed, _ = judge([program, "--print-input", "run.nml"], folder, (0, 2))
    if printed_status != 0 and not thorough:
        return False, "", ""
    many = printed_status == 0 and bonds(printed) > MANY_BONDS
    words = [program, "--check", "--threads", "1", "run.nml"]
    status, out, _ = judge(words, folder, (0, 2, 3, 5), may_be_slow=many)
    if contents(folder) != before:
        raise Wrong("--check or --print-input wrote something")
    if printed_status == 2 and status != 2:
        raise Wrong(f"--check ends with {status}, --print-input with {printed_status}")
    if status == 0:
        for line in out.splitlines():
            if NO_NUMBER.search(line) and not line.startswith(("run.nml", "  title")):
                raise Wrong(f"--check says no number: {line}")
    if printed_status == 0:
        same_as_said((folder / "run.nml").read_bytes(), printed, reference)
    return status == 0, printed, out


def same(one, other):
    if isinstance(one, str) and isinstance(other, str):
        return [c for c in one if c.isascii()] == [c for c in other if c.isascii()]
    if isinstance(one, str) or isinstance(other, str):
        return False
    return one == other or math.isclose(one, other, rel_tol=1e-15, abs_tol=0.0)


def same_as_said(data, printed, reference):
    """Compare the values as used with those of the file, and with the defaults."""
    try:
        asked = read(decoded(data))
    except NotPlain as why:
        raise Wrong(f"accepted, though the rules do not allow {why}") from None
    try:
        used = read(printed)
    except NotPlain as why:
        raise Wrong(f"--print-input prints no namelists: {why}") from None
    names = {name for name, _ in asked}
    moved = any(keys.get("fit") == ["nearest"] for _, keys in asked)
    for name in names:
        mine = [keys for group, keys in asked if group == name]
        theirs = [keys for group, keys in used if group == name]
        if len(mine) != len(theirs):
            raise Wrong(f"{len(mine)} groups &{name}, of which {len(theirs)} are used")
        for said, found in zip(mine, theirs):
            compare(
                name, said, found, reference[name], moved and name in ("body", "discretisation")
            )
    for name, keys in used:
        if name not in names:
            compare(name, {}, keys, reference[name], False)


def compare(name, said, found, known, moved):
    for key, values in said.items():
        if key not in found:
            raise Wrong(f"&{name} {key} = {values} is not used")
        right = len(values) == len(found[key]) and all(map(same, values, found[key]))
        if not right and not moved:
            raise Wrong(f"&{name} {key} = {values}, but {found[key]} is used")
    for key, values in found.items():
        default = known[key]["default"]
        if key in said or default is None:
            continue
        numbers = [word.strip() for word in default.split(",")]
        if all(NUMBER.fullmatch(word) for word in numbers):
            wanted = [float(word) for word in numbers]
        else:
            wanted = [default]
        if not all(map(same, wanted, values)):
            raise Wrong(f"&{name} {key} is absent, its default {default}, but {values} is used")


def check_printed(program, folder, printed, said):
    """What --print-input prints is an input that says the same, and stays as it is."""
    other = folder / "printed.nml"
    other.write_text(printed)
    many = bonds(printed) > MANY_BONDS
    try:
        _, again, _ = judge([program, "--print-input", "printed.nml"], folder, (0,))
        words = [program, "--check", "--threads", "1", "printed.nml"]
        _, out, _ = judge(words, folder, (0,), may_be_slow=many)
    finally:
        other.unlink()
    if again != printed:
        raise Wrong("--print-input of what it has printed prints something else")

    def figures(text):
        lines = text.replace("printed.nml", "run.nml").splitlines()
        return [line for line in lines if not line.startswith(("  run time", "  disk"))]

    if figures(out) != figures(said):
        raise Wrong(f"--check of what --print-input prints says something else:\n{said}\n{out}")


def check_run(program, folder, seconds):
    """Run run.nml for some seconds, and look at what it leaves behind."""
    import h5py
    import numpy as np

    words = [program, "--quiet", "--threads", "1", "--output", "out", "run.nml"]
    # an increment that finds no equilibrium takes its 20000 moves before a signal is looked at
    hard = b"equilibrium" in (folder / "run.nml").read_bytes()
    status, _, err = judge(
        words, folder, (0, 3, 4, 5, 143, -15), stop_after=seconds, may_be_slow=hard
    )
    if status == 5 and "full" not in err and "too large" not in err.lower():
        raise Wrong(f"a file fails without a reason\n{err}")
    results = list((folder / "out").glob("*.h5")) if (folder / "out").is_dir() else []
    results = [path for path in results if "checkpoint" not in path.name]
    if status in (0, 4) and len(results) != 1:
        raise Wrong(f"exit status {status} with {len(results)} result files")
    if status not in (0, 4):
        return status
    with h5py.File(results[0], "r", locking=False) as file:
        if file.attrs["complete"] != (status == 0):
            raise Wrong(f"complete is {file.attrs['complete']} with exit status {status}")
        kept = file["input/namelist"][()]
        if bytes(kept).rstrip(b"\0") != (folder / "run.nml").read_bytes().rstrip(b"\0"):
            raise Wrong("the input in the result is not that of the run")
        if status == 0:
            for name, data in file["history"].items():
                if data.dtype.kind == "f" and not np.isfinite(data[()]).all():
                    raise Wrong(f"history {name} has values that are no numbers")
            for frame in file["frames"].values():
                for name, data in frame.items():
                    if frame.attrs["valid"] == 1 and not np.isfinite(data[()]).all():
                        raise Wrong(f"{frame.name} {name} has values that are no numbers")
    return status


# ------------------------------------------------------------------------------------ clouds


def points_said(data):
    """Return the points that a cloud says, (x, y, volume) each."""
    found = []
    for line in re.split(r"\r\n|\n|\r", decoded(data)):
        words = re.split(r"[\s,\x00-\x1f]+", line.split("#")[0].strip(" ,\t"))
        if words == [""]:
            continue
        if len(words) not in (3, 4) or not all(NUMBER.fullmatch(word) for word in words[:3]):
            raise NotPlain(line)
        found.append(tuple(float(word.lower().replace("d", "e")) for word in words[:3]))
    return found


def check_cloud(program, folder):
    """Look at run.nml with its points.txt; the program has the points of the file."""
    words = [program, "--check", "--threads", "1", "--points", "seen.txt", "run.nml"]
    status, out, _ = judge(words, folder, (0, 2, 3, 5))
    seen = folder / "seen.txt"
    if status != 0:
        if seen.exists():
            raise Wrong("points of a cloud that was refused")
        return False
    for line in out.splitlines():
        if NO_NUMBER.search(line):
            raise Wrong(f"--check says no number: {line}")
    try:
        wanted = points_said((folder / "points.txt").read_bytes())
    except NotPlain as why:
        raise Wrong(f"a cloud was accepted with the line {why}") from None
    lines = [line.split() for line in seen.read_text().splitlines()]
    rows = [line[1:4] for line in lines if line[0] == "point"]
    if len(rows) != len(wanted):
        raise Wrong(f"{len(wanted)} points in the cloud, {len(rows)} seen")
    for row, point in zip(rows, wanted):
        if [float(word) for word in row] != list(point):
            raise Wrong(f"the point {point} is seen as {row}")
    return True
