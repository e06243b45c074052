"""The library for the Fortran Package Manager: fpm.toml and what it names."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PUBLIC = re.compile(r"parameter, public :: (\w+)")


def manifest(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


def test_what_the_manifest_names_is_there():
    library = manifest(ROOT / "fpm.toml")
    assert (ROOT / library["version"]).is_file()
    assert list((ROOT / library["library"]["source-dir"]).glob("*/pd_*.f90"))
    for name, place in library["dependencies"].items():
        if place != "*":
            assert manifest(ROOT / place["path"] / "fpm.toml")["name"] == name


def test_the_version_is_that_of_the_program():
    version = (ROOT / "VERSION").read_text(encoding="utf-8").strip()
    folder = ROOT / manifest(ROOT / "fpm.toml")["dependencies"]["perigeo-version"]["path"]
    source = (folder / "src" / "pd_version.f90").read_text(encoding="utf-8")
    assert f"code_version = '{version}'" in source
    assert manifest(folder / "fpm.toml")["version"] == version
    made = (ROOT / "tools" / "version.f90.in").read_text(encoding="utf-8")
    assert PUBLIC.findall(source) == PUBLIC.findall(made)


@pytest.mark.skipif(shutil.which("fpm") is None, reason="there is no fpm")
def test_fpm_builds_the_library(tmp_path):
    for name in ("src", "tools/version"):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name in ("fpm.toml", "VERSION"):
        shutil.copy(ROOT / name, tmp_path / name)
    done = subprocess.run(
        ["fpm", "build"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
