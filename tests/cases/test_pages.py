"""What pages say agrees with the sources and with the tables that they take numbers from."""

import math
import re
import sys
from pathlib import Path

import pytest
from perigeo_post import Run, measure_band, stress_strain
from perigeo_post.measure.limit_load import limit_loads

ROOT = Path(__file__).resolve().parents[2]
DOC = ROOT / "doc"
sys.path.insert(0, str(ROOT / "tools"))

import first_footing  # noqa: E402


def code_lines(text):
    """Return the lines of a text that are not blank."""
    return [line for line in text.splitlines() if line.strip()]


def test_the_code_of_the_law_is_the_file_of_the_tests():
    page = (DOC / "material_law.md").read_text()
    blocks = re.findall(r"^```fortran\n(.*?)^```", page, re.M | re.S)
    assert len(blocks) > 5
    file = (ROOT / "tests" / "unit" / "damage_law.f90").read_text()
    assert code_lines("".join(blocks)) == code_lines(file)


def test_the_places_that_a_law_is_named_at_are_there():
    setup = (ROOT / "src" / "setup" / "pd_setup_materials.f90").read_text()
    keys = (ROOT / "src" / "input" / "pd_material_keys.f90").read_text()
    assert "    else if (given%model == 'j2') then" in setup
    assert "key_t('model', required=.true., choices='elastic j2'" in keys
    page = (DOC / "material_law.md").read_text()
    law = (ROOT / "src" / "material" / "pd_law.f90").read_text()
    deferred = re.findall(r"deferred(?:, nopass)? :: (\w+)", law)
    assert len(deferred) == 6
    assert "six procedures" in page
    assert all(f"procedure, nopass :: {name}" in page or f"procedure :: {name}" in page
               for name in deferred)  # fmt: skip


LIMITS = [line for line in (DOC / "limits.md").read_text().splitlines() if line[:3] == "| *"
          or line[:4] == "| th" or re.match(r"\| (a|two|what) ", line)]  # fmt: skip


@pytest.mark.parametrize("line", LIMITS, ids=lambda line: re.sub(r"\W+", "_", line[2:30]))
def test_the_numbers_of_a_limit_are_published(line):
    said = line.split(" | ")[2]
    pages = [
        "choices.md",
        "model.md",
        "verification.md",
        "verification_table.md",
        "study_tables.md",
        "tutorials/figure.md",
    ]
    text = "\n".join((DOC / name).read_text() for name in pages)
    numbers = re.findall(r"(?<![\w.-])\d+\.?\d*(?:e-\d+)?", re.sub(r"\]\([^)]*\)", "", said))
    missing = [n for n in numbers if not re.search(rf"(?<![\d.]){re.escape(n)}(?![\d])", text)]
    assert not missing


def test_the_warnings_of_the_limits_are_those_of_the_program():
    kinds = (ROOT / "src" / "base" / "pd_doubt_list.f90").read_text()
    named = {n for line in LIMITS for n in re.findall(r"`(\w+)`", line.split(" | ")[3])}
    assert len(named) > 6
    assert not [name for name in named if f"doubt_kind_t('{name}'" not in kinds]
    assert len(LIMITS) == 15


def glossary():
    """Return symbol, names in the code and modules of every row of the glossary."""
    text = (DOC / "theory.md").read_text().partition("## Glossary")[2].partition("\n## ")[0]
    rows = [line[1:-1].split(" | ") for line in text.splitlines() if line.startswith("| ")]
    rows = [[cell.strip() for cell in row] for row in rows if "in the code" not in row]
    return [
        (row[0], re.findall(r"`([\w%]+)`", row[2]), re.findall(r"`(\w+)`", row[3])) for row in rows
    ]


def test_the_glossary_names_the_code():
    modules = {path.stem: path.read_text() for path in (ROOT / "src").glob("*/*.f90")}
    rows = glossary()
    assert len(rows) > 60
    for symbol, names, places in rows:
        assert bool(places) == bool(names) or names == ["m"], symbol
        text = "\n".join(modules[place] for place in places)
        parts = {part for name in names for part in name.split("%") if name != "m"}
        # Components of tensors are put together by the program: plastic_strain_xx.
        parts = {re.sub(r"_xx$", "", part) for part in parts}
        assert not [part for part in parts if not re.search(rf"\b{part}|{part}\b", text)], symbol


def test_keys_that_other_programs_are_compared_with_exist():
    page = (DOC / "coming_from.md").read_text()
    keys = "\n".join(path.read_text() for path in (ROOT / "src" / "input").glob("pd_*_keys.f90"))
    groups = set(re.findall(r"&(\w+)", page))
    assert len(groups) > 8
    assert not [name for name in groups if f"group_key_t('{name}'" not in keys]
    used = set(re.findall(r"`(?:&\w+ )?(\w+) = '", page))
    used |= set(re.findall(r"`&\w+ (\w+)`", page))
    assert len(used) > 6
    assert not [key for key in used if f"key_t('{key}'" not in keys]


@pytest.fixture
def footing_folder(program, tmp_path):
    """Return a folder in which commands find both programs as in a clone."""
    folder = tmp_path / "perigeo"
    (folder / "bin").mkdir(parents=True)
    (folder / "bin" / "perigeo").symlink_to(program)
    (folder / ".venv").mkdir()
    (folder / ".venv" / "bin").symlink_to(Path(sys.executable).parent)
    return folder


def test_the_first_footing_is_typed_from_its_page(footing_folder, program, capfd, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # threads take cores from tests beside this one
    page = first_footing.PAGE.read_text()
    given = first_footing.commands(page)
    assert given[:4] == [
        "git clone ADDRESS perigeo", "cd perigeo", "sh tools/setup.sh run", "make",
    ]  # fmt: skip
    given = ["cd perigeo", *given[4:]]
    if program.name != "perigeo":  # with all checks the finer one takes long
        given = [command for command in given if "finer" not in command]
    files = first_footing.inputs(page)
    timed = first_footing.type_it(given, files, "", footing_folder.parent)
    assert [one.command for one in timed] == given[1:]
    said = re.search(r"`(limit load   footing: [^`]*)`", page)[1]
    out = capfd.readouterr().out
    assert re.search(r"^step .* footing y -0\.0\d+ m +-[\d.]+ kN/m", out, re.M)  # what it is about
    shown = re.search(r"^.*limit load .*footing: .*$", out, re.M)[0]
    number = r"(?<= )\d+\.?\d*"
    assert re.sub(number, "#", shown).split() == re.sub(number, "#", said).split()
    of_page = [float(n) for n in re.findall(number, said)]
    assert [float(n) for n in re.findall(number, shown)] == pytest.approx(of_page, rel=1e-4)
    drawn = [c for c in given if "perigeo-post" in c and " info " not in c]
    assert len(list(footing_folder.rglob("*.png"))) == len(drawn)
    exact = (2.0 + math.pi) * 25.0  # Prandtl, half of B [kN/m]
    errors = {"my_footing": 2.5e-3, "finer": 1e-4}
    for name, error in errors.items():
        path = footing_folder / "results" / name / f"{name}.h5"
        if path.exists():
            load = 1e-3 * limit_loads(Run(path))[0].load
            assert abs(load / exact - 1.0) == pytest.approx(error, abs=1e-4)


def test_the_page_of_an_own_test_is_typed_too(footing_folder, program, capfd, monkeypatch):
    if program.name != "perigeo":
        pytest.skip("takes long with all checks")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    given = first_footing.commands((DOC / "own_test.md").read_text())
    assert len(given) > 3
    typed = [
        command for command in given if "isotropic_modulus" not in command and "B =" not in command
    ]
    first_footing.type_it(typed, {}, "", footing_folder)
    assert "the input is right" in capfd.readouterr().out
    curve = stress_strain(Run(footing_folder / "results" / "own_test" / "own_test.h5"))
    assert curve.y.max() == pytest.approx(2.0 * 50e3, rel=0.02)


def test_the_first_case_of_the_readme_is_typed_too(footing_folder, program, monkeypatch):
    if program.name != "perigeo":
        pytest.skip("takes long with all checks")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    text = (ROOT / "README.md").read_text()
    text = text.partition("## A first case of your own")[2].partition("\n## ")[0]
    given = first_footing.commands(text)
    assert given[0] == "cp input/compression_quick.nml input/my_case.nml"
    (footing_folder / "input").mkdir()
    case = (ROOT / "input" / "compression_quick.nml").read_text()
    for line in re.search(r"^```fortran\n(.*?)^```", text, re.M | re.S)[1].splitlines():
        key = line.split("=")[0]
        case, count = re.subn(rf"^{key}=.*$", line, case, count=1, flags=re.M)
        assert count == 1
    (footing_folder / "input" / "my_case.nml").write_text(case)
    first_footing.type_it(given[1:], {}, "", footing_folder)
    run = Run(footing_folder / "results" / "my_case" / "my_case.h5")
    said = re.search(r"peak of (\d+) kPa and a band at (\d+) degrees .*\s.*about ([\d.]+) m", text)
    peak, angle, width = (float(number) for number in said.groups())
    assert 1e-3 * stress_strain(run).y.max() == pytest.approx(peak, abs=0.6)
    band = measure_band(run)
    assert band.bands.prevailing.angle == pytest.approx(angle, abs=0.6)
    assert band.width == pytest.approx(width, abs=0.006)


def test_the_times_of_the_first_footing_are_those_of_its_commands():
    page = first_footing.PAGE.read_text()
    timed = [
        first_footing.Timed(c, 61.0, 0.2) for c in first_footing.commands(page) if c[:3] != "cd "
    ]
    text = first_footing.table(timed, (0.0, 1.0))
    assert text.splitlines()[4].endswith("` | 1 min 1 s | 1 s |")
    new = first_footing.with_table(page, text)
    assert first_footing.with_table(new, text) == new
    firsts = re.compile(r"^\| (`.*`|all) \|", re.M)
    assert firsts.findall(page) == firsts.findall(new)  # the page's table has been renewed


@pytest.mark.parametrize("place", ["verify/verify.py", "verify/limits.py", "verify/clouds.py"])
def test_a_table_has_marks_on_the_page_that_it_is_written_to(place):
    source = (ROOT / "tests" / place).read_text()
    page = re.search(r'"doc" / "(\w+\.md)"', source)[1]
    marks = set(re.findall(r"<!-- \w+: (?:begin|end) -->", source))
    text = (DOC / page).read_text()
    assert len(marks) > 1
    assert all(text.count(mark) == 1 for mark in marks)
