"""perigeo-post with the oldest and the newest packages that postproc/pyproject.toml allows.

    python3 tests/proof/pythons/pythons.py [oldest] [newest]

oldest  the least version of every package, in the oldest Python from 3.9 on that is here
newest  what pip takes, in the newest Python that is here

The environments are in build/pythons/, and .venv stays as it is. Pythons are looked for in PATH and
among those of pyenv. `make pythons` calls this.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from common import ROOT, Count

LEAST = (3, 9)  # requires-python
EXTRAS = ("study", "report", "test")
SHOWN = ("numpy", "matplotlib", "h5py", "pydantic")


def pythons():
    """Return the Pythons that are here, by version, each with a path."""
    folders = os.environ.get("PATH", "").split(os.pathsep)
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    named = [Path(folder) / f"python3.{n}" for folder in folders for n in range(9, 30)]
    named += sorted(root.glob("versions/3.*/bin/python3"))
    found = {}
    tell = "import sys, ensurepip, venv; print(*sys.version_info[:2])"
    for path in named:
        if path.is_file():
            done = subprocess.run([path, "-c", tell], check=False, capture_output=True, text=True)
            version = tuple(map(int, done.stdout.split())) if done.returncode == 0 else (0, 0)
            if version >= LEAST:
                found.setdefault(version, path)
    return found


def least_versions():
    """Return the packages of perigeo-post, each with the least version that is allowed."""
    text = (ROOT / "postproc" / "pyproject.toml").read_text()
    pins = []
    for name in ("dependencies", *EXTRAS):
        listed = re.search(rf"^{name} = \[(.*?)\]$", text, re.M | re.S).group(1)
        for package, version, marker in re.findall(r'"([\w-]+)>=([\d.]+)(;[^"]*)?"', listed):
            # 7 stands for 7.0, and 3.6 for the last of its kind
            pins.append(f"{package}=={version if '.' in version else version + '.0'}.*{marker}")
    return sorted(set(pins))


def environment(folder, python, pins):
    """Make an environment with perigeo-post; return what kept it from being made."""
    package = f"./postproc[{','.join(EXTRAS)}]"
    for words in (
        [python, "-m", "venv", folder],
        [folder / "bin" / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check",
         *pins, "-e", package],
    ):  # fmt: skip
        done = subprocess.run(words, cwd=ROOT, check=False, capture_output=True, text=True)
        if done.returncode != 0:
            return done.stderr[-3000:]
    return ""


def versions_in(python):
    tell = "import sys; from importlib.metadata import version as v; " + (
        f"print('Python', sys.version.split()[0], *(n + ' ' + v(n) for n in {SHOWN}), sep=', ')"
    )
    done = subprocess.run([python, "-c", tell], check=False, capture_output=True, text=True)
    return done.stdout.strip().replace("Python,", "Python", 1)


def look(count, name, python):
    folder = ROOT / "build" / "pythons" / name
    wrong = environment(folder, python, least_versions() if name == "oldest" else ["--upgrade"])
    if wrong:
        count.note(f"{name}: the environment", False, wrong)
        return
    inside = folder / "bin" / "python"
    done = subprocess.run(
        [inside, "-m", "pytest", "-q", "--color=no", "-p", "no:cacheprovider", "postproc/tests"],
        cwd=ROOT, check=False, capture_output=True, text=True,
        env={**os.environ, "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    last = (done.stdout.strip().splitlines() or [""])[-1]
    count.note(f"{name}: {versions_in(inside)}: {last}", done.returncode == 0, done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("which", nargs="*", choices=["oldest", "newest", []], default=[])
    found = pythons()
    if not found:
        sys.exit("no Python from 3.9 on that makes environments")
    count = Count()
    for name in parser.parse_args().which or ("oldest", "newest"):
        look(count, name, found[(min if name == "oldest" else max)(found)])
    print(f"{count.passed} passed, {count.failed} failed")
    return 1 if count.failed else 0


if __name__ == "__main__":
    sys.exit(main())
