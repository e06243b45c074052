"""The tools of `make compilers`, `make pythons` and `make fuzz`: what they take for what."""

import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROOFS = ROOT / "tests" / "proof"
sys.path[:0] = [str(PROOFS / name) for name in ("compilers", "fuzz", "pythons", "sanitize")]
sys.path.insert(0, str(PROOFS))  # what they share
import addresses  # noqa: E402
import compilers  # noqa: E402
import pythons  # noqa: E402
import sanitize  # noqa: E402
import verdicts  # noqa: E402

FOOTING = """\
&discretisation spacing = 0.125, horizon = 0.375 /
&body x_min = 0.0, x_max = {width}, y_min = -1.0, y_max = 0.0 /
"""


def test_modules_without_hdf5_are_told_from_those_that_need_it(tmp_path, monkeypatch):
    (tmp_path / "flang").mkdir()
    monkeypatch.setattr(compilers, "ROOT", tmp_path)
    for name in ("Makefile", "src", "tools"):
        (tmp_path / name).symlink_to(ROOT / name)
    names, total = compilers.without_hdf5(tmp_path / "flang")
    assert total == len(list((ROOT / "src").glob("*/*.f90")))
    assert {"pd_kinds", "pd_lattice", "pd_increment", "pd_memory"} <= set(names)
    assert not {"pd_hdf5", "pd_hdf5_file", "pd_result", "perigeo"} & set(names)
    rules = (tmp_path / "flang" / "depends.mk").read_text()
    assert "flang/pd_lattice.o: flang/pd_storage.o\n" in rules
    assert "hdf5" not in rules


def test_a_compiler_that_is_not_there_is_skipped(capsys, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["compilers.py", "gfortran-14", "flang"])
    assert compilers.main() == 0
    said = capsys.readouterr().out
    assert "skipped gfortran-14: not installed" in said
    assert "skipped flang: not installed" in said
    assert said.endswith("0 passed, 0 failed\n")


def test_the_least_versions_are_those_of_pyproject():
    pins = pythons.least_versions()
    assert "numpy==1.22.*" in pins
    assert "pytest==7.0.*" in pins
    assert "tomli==1.1.*; python_version < '3.11'" in pins
    assert "vtk" not in " ".join(pins)  # of any version


def test_a_large_printed_input_may_take_its_time(monkeypatch, tmp_path):
    """The first look at a large body may be slow; so may the second, at what was printed."""
    patience = []

    def judge(words, folder, allowed, may_be_slow=False, **options):
        if "--check" in words:
            patience.append(may_be_slow)
        return 0, text, ""

    monkeypatch.setattr(verdicts, "judge", judge)
    for width in (1.5, 1500.0):
        text = FOOTING.format(width=width)
        verdicts.check_printed("perigeo", tmp_path, text, text)
    assert patience == [False, True]


def test_the_quick_form_of_addresses_names_suites_that_are_there():
    for name in addresses.QUICK_SUITES:
        assert list((ROOT / "tests" / "unit").glob(f"*/{name}.pf")), name
    for name in addresses.CASES:
        assert (ROOT / "tests" / "cases" / name).is_file(), name


@pytest.mark.parametrize("name", ["compilers", "pythons", "fuzz", "soak", "sanitize", "mutants"])
def test_every_proof_has_a_target(name):
    assert f"\n{name}:" in (ROOT / "Makefile").read_text()


@pytest.mark.parametrize("name", sanitize.PLANTS)
def test_races_can_be_planted(name):
    path, text, _ = sanitize.PLANTS[name]
    assert (ROOT / path).read_text().count(text) == 1
