"""The recipes in packaging/: what they name is there, and what they call is known."""

import os
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGING = ROOT / "packaging"
VERSION = (ROOT / "VERSION").read_text().strip()
MAKEFILE = (ROOT / "Makefile").read_text()


def needs():
    """Return the Python packages of perigeo-post with their least versions."""
    text = (ROOT / "postproc/pyproject.toml").read_text()
    wanted = re.search(r"^dependencies = \[(.*?)^\]", text, re.M | re.S).group(1)
    for extra in ("study", "report"):
        wanted += re.search(rf"^{extra} = \[(.*?)^\]", text, re.M | re.S).group(1)
    found = re.findall(r'"([a-z0-9-]+)>=([\d.]+)"', wanted)
    return {"matplotlib-base" if name == "matplotlib" else name: least for name, least in found}


def check_make(words):
    """Assert that make knows the targets and settings of a call."""
    for word in words:
        name, equals, _ = word.partition("=")
        if equals:
            assert re.search(rf"\b{name}\b", MAKEFILE), word
        else:
            assert re.search(rf"^{name}:", MAKEFILE, re.M), word


def test_the_container_file_names_what_is_there():
    text = (PACKAGING / "Containerfile").read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and line[0] not in "# "]
    assert {line.split()[0] for line in lines} <= {
        "FROM", "RUN", "WORKDIR", "COPY", "ENV", "USER", "CMD",
    }  # fmt: skip
    stages = [line.split()[-1] for line in lines if line.startswith("FROM") and " AS " in line]
    copied = []
    for line in lines:
        words = line.split()
        if words[0] == "COPY" and words[1].startswith("--from="):
            assert words[1].removeprefix("--from=") in stages
        elif words[0] == "COPY":
            copied += words[1:-1]
    assert [name for name in copied if not (ROOT / name).exists()] == []
    # all that building and installing reads is copied
    for name in (
        "src",
        "mpi",
        "tools",
        "Makefile",
        "VERSION",
        "input",
        "studies",
        "doc",
        "LICENSE",
    ):
        assert name in copied
    (call,) = (line for line in lines if line.startswith("RUN make"))
    check_make(call.split()[2:])
    # An image without perigeo-post, for want of a network, is none.
    assert lines.index("RUN test -x /opt/perigeo/bin/perigeo-post") > lines.index(call)
    last = [line.split()[1] for line in lines if line.startswith("USER")][-1]
    assert last != "root"
    assert f"useradd --create-home --uid 1000 {last}" in text


def test_the_conda_recipe_has_version_and_packages_of_the_project():
    text = (PACKAGING / "conda/meta.yaml").read_text()
    assert f'{{% set version = "{VERSION}" %}}' in text
    run = text.split("  run:\n")[1].split("\n\n")[0]
    found = dict(re.findall(r"- ([\w-]+) >=([\d.]+)", run))
    assert {name: found.get(name) for name in needs()} == needs()
    source = re.search(r"path: (\S+)", text).group(1)
    assert (PACKAGING / "conda" / source).resolve() == ROOT
    for name in re.findall(r"\$PREFIX/share/perigeo/(\S+)", text):
        assert (ROOT / name).is_file()


def test_the_conda_script_calls_make_and_pip(tmp_path):
    log = tmp_path / "log"
    for name in ("make", "python"):
        tool = tmp_path / name
        tool.write_text(f'#!/bin/sh\necho "{name} $*" >> "{log}"\n')
        tool.chmod(0o755)
    subprocess.run(
        ["sh", str(PACKAGING / "conda/build.sh")],
        cwd=ROOT,
        env={
            **os.environ,
            "PATH": f"{tmp_path}:/usr/bin:/bin",
            "PREFIX": "/opt/conda",
            "PYTHON": "python",
            "FC": "gfortran",
        },
        check=True,
    )
    first, second = log.read_text().splitlines()
    check_make(first.split()[1:])
    assert "PREFIX=/opt/conda" in first
    assert (ROOT / second.split()[-1]).is_dir()


class Anything:
    """Whatever Spack offers, as far as the recipe looks at it."""

    def __init__(self, path=""):
        self.path = path

    def __getattr__(self, name):
        return Anything(f"{self.path}/{name}")

    def __str__(self):
        return self.path

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None


class Spec:
    """A spec with some variants."""

    def __init__(self, *variants):
        self.variants = variants

    def satisfies(self, variant):
        return variant in self.variants

    def __getitem__(self, name):
        return Anything(f"/spack/{name}")


@pytest.mark.parametrize("variants", [("+mpi", "+post"), ()])
def test_the_spack_recipe_builds_and_installs(monkeypatch, variants):
    calls, versions, packages = [], [], []
    package = types.ModuleType("spack.package")
    package.__dict__.update(
        MakefilePackage=object,
        license=lambda name: None,
        version=versions.append,
        variant=lambda *_, **__: None,
        depends_on=lambda name, **_: packages.append(name),
        when=lambda _: Anything(),
        make=lambda *words: calls.append(words),
        install=lambda *words: None,
        spack_fc="/spack/gfortran",
    )
    monkeypatch.setitem(sys.modules, "spack", types.ModuleType("spack"))
    monkeypatch.setitem(sys.modules, "spack.package", package)
    space = {}
    exec((PACKAGING / "spack/package.py").read_text(), space)
    recipe, prefix = space["Perigeo"](), Anything("/opt/perigeo")
    recipe.build(Spec(*variants), prefix)
    recipe.install(Spec(*variants), prefix)
    assert versions == [VERSION]
    for words in calls:
        check_make(words)
    assert "PREFIX=/opt/perigeo" in calls[-1]
    assert ("POST=0" in calls[-1]) == (not variants)
    assert any("MPI=1" in words for words in calls) == bool(variants)
    for name in needs():
        assert any(p.startswith(f"py-{name.removesuffix('-base')}") for p in packages), name
