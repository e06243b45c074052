"""make, and make install: into an empty folder, used without the repository, taken away again."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def install(action, prefix, program, **settings):
    """Call tools/install.sh; return what it says."""
    done = subprocess.run(
        ["sh", str(ROOT / "tools/install.sh"), action, str(program)],
        env={**os.environ, "PYTHON": sys.executable, **settings, "PREFIX": str(prefix)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def make(*words):
    """Call make as a user does; return the finished process."""
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS"))}
    return subprocess.run(
        ["make", *words], cwd=ROOT, env=plain, capture_output=True, text=True, check=False
    )


def test_plain_make_compiles_on_all_cores_unless_told():
    assert f"-j{os.cpu_count()} program post" in make("-n").stdout
    for told in ("-j1", "-j3"):
        assert "-j" not in make("-n", told).stdout


def test_make_without_a_compiler_names_the_set_up():
    done = make("FC=no-such-compiler")
    assert done.returncode == 2
    assert "no Fortran compiler (no-such-compiler): `make setup` installs or names" in done.stderr


def test_the_set_up_names_what_needs_no_root_first(tmp_path):
    for name, text in (("id", "echo 1000"), ("sudo", "exit 1")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    surroundings = {k: v for k, v in os.environ.items() if not k.startswith("CONDA")}
    surroundings |= {"PATH": f"{tmp_path}:/usr/bin:/bin", "FC": "no-such-compiler"}
    done = subprocess.run(
        ["sh", "tools/setup.sh", "run"],
        cwd=ROOT, env=surroundings, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "Missing: compiler" in done.stdout
    places = [done.stdout.find(words) for words in ("conda create", "module load", "or, as root:")]
    assert -1 not in places
    assert places == sorted(places)
    assert "sudo" not in done.stdout[: places[-1]]


def test_the_wheel_in_a_fresh_environment(tmp_path):
    """Its needs are those of this environment, behind what is installed from the wheel."""
    pytest.importorskip("setuptools", "70.1", reason="makes no wheel by itself before 70.1")
    source, made = tmp_path / "source", tmp_path / "made"
    shutil.copytree(ROOT / "postproc", source, ignore=shutil.ignore_patterns("*.egg-info"))
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", str(made)]
    subprocess.run([*pip, "wheel", *options, str(source)], check=True)
    (wheel,) = made.glob("perigeo_post-*-py3-none-any.whl")
    fresh = tmp_path / "fresh"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(fresh)], check=True)
    (packages,) = fresh.glob("lib/python*/site-packages")
    into = ["--python", str(fresh / "bin/python"), "install", "--no-deps", "--no-index"]
    subprocess.run([*pip, *into, str(wheel)], check=True)
    (packages / "needs.pth").write_text(sysconfig.get_path("purelib") + "\n")
    ask = "import perigeo_post.report as r; print(r.__file__, len(list(r.__path__)))"

    def run(*words):
        done = subprocess.run(
            words, cwd=tmp_path, capture_output=True, text=True, check=True,
            env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
        )  # fmt: skip
        return done.stdout

    assert str(fresh) in run(str(fresh / "bin/python"), "-c", ask)
    command = str(fresh / "bin/perigeo-post")
    assert "yield_stress" in run(command, "advise", "--cu", "5e4", "--size", "0.05", "0.1")
    assert "usage: perigeo-post" in run(command, "report", "--help")
    assert list(packages.glob("perigeo_post/report/templates/*.html*"))
    about = next(packages.glob("perigeo_post-*.dist-info/METADATA")).read_text()
    extras = set(re.findall(r"^Provides-Extra: (\w+)$", about, re.M))
    assert extras >= {"study", "report", "xarray", "notebook"}


def files(folder):
    """Return all files below a folder, by name."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def prefix(program, tmp_path_factory):
    """Return a folder in which perigeo is installed."""
    if program.name != "perigeo":
        pytest.skip("the program with all checks is not installed")
    folder = tmp_path_factory.mktemp("installed") / "with a blank"
    install("install", folder, program)
    return folder


@pytest.fixture
def use(prefix, tmp_path):
    """Return a function that runs an installed command in a folder far from the repository."""
    shutil.copytree(prefix / "share/perigeo/input", tmp_path / "input")

    def run(*words):
        path = os.pathsep.join([str(prefix / "bin"), "/usr/bin", "/bin"])
        return subprocess.run(
            [str(prefix / "bin" / words[0]), *words[1:]],
            cwd=tmp_path,
            env={"PATH": path, "HOME": str(tmp_path), "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def test_a_run_and_a_figure_far_from_the_repository(use, prefix, tmp_path):
    done = use("perigeo", "--quiet", "input/biaxial_isotropic.nml")
    assert done.returncode == 0, done.stderr
    result = "results/biaxial_isotropic/biaxial_isotropic.h5"
    done = use("perigeo-post", "curves", result, "-o", "curve.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
    study = prefix / "share/perigeo/studies/fig3a.toml"
    done = use("perigeo-post", "study", str(study), "--dry-run")
    assert done.returncode == 0, done.stderr
    launcher = (prefix / "bin/perigeo-post").read_text()
    assert str(ROOT / "postproc") not in launcher


def test_all_that_belongs_to_it_is_there(prefix):
    there = set(files(prefix))
    for name in (
        "bin/perigeo",
        "bin/perigeo-post",
        "share/perigeo/LICENSE",
        "share/perigeo/input/limit_loads/slope.nml",
        "share/perigeo/studies/fig5.toml",
        "share/perigeo/doc/input.md",
        "share/man/man1/perigeo.1",
        "share/man/man1/perigeo-post.1",
        "share/zsh/site-functions/_perigeo",
        "share/fish/vendor_completions.d/perigeo-post.fish",
    ):
        assert name in there, name


def test_pages_say_what_help_says(prefix, perigeo, tmp_path):
    page = (prefix / "share/man/man1/perigeo.1").read_text().replace("\\-", "-")
    words = perigeo(["--help"], tmp_path).stdout
    options = [line.split()[0].rstrip(",") for line in words.splitlines() if line[:4] == "  --"]
    assert len(options) > 10
    for place in ("share/bash-completion/completions/perigeo", "share/zsh/site-functions/_perigeo"):
        text = (prefix / place).read_text()
        assert [name for name in options if name not in text] == []
    for name in options:
        assert f"\\fB{name}\\fR" in page
    post = (prefix / "share/man/man1/perigeo-post.1").read_text().replace("\\-", "-")
    for words in ("perigeo-post advise", "--platen", "perigeo-post study studies/horizon.toml"):
        assert words in post


@pytest.mark.skipif(not shutil.which("man"), reason="no man")
@pytest.mark.parametrize("name", ["perigeo", "perigeo-post"])
def test_man_has_nothing_to_say_against_a_page(prefix, name):
    page = prefix / f"share/man/man1/{name}.1"
    done = subprocess.run(
        ["man", "--warnings", "-l", str(page)], capture_output=True, text=True, check=True,
        env={**os.environ, "MANPAGER": "cat", "LC_ALL": "C.UTF-8", "MANWIDTH": "120"},
    )  # fmt: skip
    assert "EXAMPLES" in done.stdout or "examples" in done.stdout or "exit status" in done.stdout
    assert done.stderr == ""


def test_nothing_is_left_but_what_was_there(program, tmp_path):
    prefix = tmp_path / "usr"
    foreign = prefix / "share/man/man1/other.1"
    foreign.parent.mkdir(parents=True)
    foreign.touch()
    install("install", prefix, program, POST="0")
    assert not (prefix / "bin/perigeo-post").exists()
    assert "gone" not in install("install", prefix, program)  # over the one before
    (prefix / "lib/perigeo/python/perigeo_post/__pycache__").mkdir()
    assert "is gone from" in install("uninstall", prefix, program)
    assert files(prefix) == ["share/man/man1/other.1"]
    assert sorted(path.name for path in prefix.iterdir()) == ["share"]
    assert "there is no perigeo" in install("uninstall", prefix, program)


def test_a_package_is_made_below_destdir(program, tmp_path):
    install("install", "/opt/soil", program, DESTDIR=str(tmp_path))
    root = tmp_path / "opt/soil"
    launcher = (root / "bin/perigeo-post").read_text()
    assert "/opt/soil/lib/perigeo/python" in launcher
    assert str(tmp_path) not in launcher
    pages = [name for name in files(root) if name.startswith("share/") and ".png" not in name]
    assert not any(str(tmp_path) in (root / name).read_text() for name in pages)


def test_without_a_python_that_fits_the_program_is_installed_all_the_same(program, tmp_path):
    said = install("install", tmp_path, program, PYTHON="false")
    assert "perigeo-post is not installed" in said
    assert "pip install" in said
    assert Path(tmp_path, "bin", program.name).is_file()
    assert not Path(tmp_path, "bin/perigeo-post").exists()
