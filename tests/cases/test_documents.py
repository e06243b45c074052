"""What the documents name exists: links, files, make targets, options, commands, sections."""

import re
from pathlib import Path

import h5py
import perigeo_post.version
import pytest
from case_files import SPECIMEN

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "doc").glob("*.md"))]
DOCUMENTS += [*sorted((ROOT / "doc" / "tutorials").glob("*.md")), ROOT / "postproc" / "README.md"]
# What the README and the page on laws have their readers make.
OF_THE_READER = {"input/my_case.nml", "src/material/pd_damage.f90"}
LAW_OF_THE_READER = "pd_damage"
FOLDERS = "src|doc|input|tests|tools|postproc"


def code_of(text):
    """Return the code blocks and the code between backquotes of a Markdown text."""
    fenced = re.findall(r"^```.*?$(.*?)^```", text, re.M | re.S)
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    indented = re.findall(r"^    .*$", rest, re.M)
    return "\n".join([*fenced, *indented, *re.findall(r"`([^`\n]+)`", rest)])


def named(pattern):
    """Return (document, name) for everything in code that a pattern finds, each once."""
    found = set()
    for path in DOCUMENTS:
        for match in re.finditer(pattern, code_of(path.read_text()), re.M):
            found.add((str(path.relative_to(ROOT)), match.group(1)))
    assert found, f"no document has {pattern}: the pattern is out of date"
    return sorted(found)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_relative_links_lead_somewhere(path):
    links = re.findall(r"\]\(([^)\s]+)\)", path.read_text())
    local = [link.partition("#")[0] for link in links if "://" not in link]
    missing = [link for link in local if link and not (path.parent / link).exists()]
    assert not missing


def test_files_that_are_named_exist():
    files = named(rf"(?<![\w./])((?:{FOLDERS})/[\w./-]*\w)")
    missing = [(doc, name) for doc, name in files if not (ROOT / name).exists()]
    assert not [item for item in missing if item[1] not in OF_THE_READER]


def test_modules_that_are_named_exist():
    modules = {path.stem for path in (ROOT / "src").glob("*/*.f90")}
    modules |= {"pd_version", LAW_OF_THE_READER}
    assert not [item for item in named(r"\b(pd_\w+)") if item[1] not in modules]


def test_make_targets_that_are_named_exist():
    targets = set(re.findall(r"^([a-z0-9_-]+):(?!=)", (ROOT / "Makefile").read_text(), re.M))
    for document, words in named(r"^ *make\b((?: +[\w./=-]+)*)"):
        asked = [word for word in words.split() if "=" not in word and word[0] != "-"]
        assert set(asked) <= targets, document


def test_post_processing_commands_that_are_named_exist():
    source = (ROOT / "postproc" / "perigeo_post" / "cli" / "command_line.py").read_text()
    table = re.search(r"^COMMANDS\b.*?^\}", source, re.M | re.S).group()
    commands = set(re.findall(r'^    "(\w+)":', table, re.M))
    assert "contours" in commands
    for document, command in named(r"perigeo-post +(\w+)"):
        assert command in commands, document


def test_options_of_the_program_that_are_named_exist():
    source = (ROOT / "src" / "app" / "pd_command_line.f90").read_text()
    for document, words in named(r"(?:^|/)perigeo((?: +[-\w./]+)*)"):
        for option in re.findall(r"--[\w-]+", words):
            assert f"'{option}'" in source, document


def test_sections_of_the_theory_that_the_sources_name_exist():
    theory = (ROOT / "doc" / "theory.md").read_text()
    sections = set(re.findall(r"^## (\d+)\. ", theory, re.M))
    for path in sorted((ROOT / "src").glob("*/*.f90")):
        for reference in re.findall(r"theory\.md, sections? ([\d, toand]+)", path.read_text()):
            assert set(re.findall(r"\d+", reference)) <= sections, path.name


@pytest.fixture(scope="module")
def result(run_case, tmp_path_factory):
    """Return the result file of a small run, which knows what it holds."""
    folder = tmp_path_factory.mktemp("documents")
    done = run_case(SPECIMEN, folder, "--quiet")
    assert done.returncode == 0, done.stderr
    return folder / "out" / "case.h5"


def test_the_results_page_lists_every_column_and_field(result):
    page = (ROOT / "doc" / "results.md").read_text()
    with h5py.File(result, locking=False) as file:
        columns = [re.sub("^(top|bottom)_", "<boundary>_", name) for name in file["history"]]
        fields = [*file["frames/000000"], *(f"/points/{name}" for name in file["points"])]
    assert len(columns) > 15
    assert len(fields) > 10
    assert not [name for name in [*columns, *fields] if f"`{name}`" not in page]


def test_the_results_page_lists_every_attribute_of_the_file(result):
    page = (ROOT / "doc" / "results.md").read_text()
    with h5py.File(result, locking=False) as file:
        attributes = [*file.attrs, *file["history"].attrs, *file["frames/000000"].attrs]
    assert len(attributes) > 20
    assert not [name for name in attributes if f"`{name}`" not in page]


def mistakes_of_releases(changelog):
    """Return what is wrong with the list of releases: versions, dates, steps of the number."""
    found = []
    rows = re.findall(
        r"^\| ([\d.]+|next) \| ([\d-]+|not yet) \| (change|stay|first version) \|$", changelog, re.M
    )
    sections = dict(re.findall(r"^## (\S+)\n\n(Results (?:change|stay)[^\n]*)", changelog, re.M))
    named = ["next" if name == "Unreleased" else name for name in sections]
    if [row[0] for row in rows] != named:
        found.append(f"the list has {[row[0] for row in rows]}, the sections are {named}")
    for name, words in zip(named, sections.values()):
        said = next((row[2] for row in rows if row[0] == name), "nothing")
        if said.split()[0] not in words:
            found.append(f"{name}: the list says {said!r}, the section {words[:20]!r}")
    released = [row for row in rows if row[0] != "next"]
    dates = [row[1] for row in released]
    if "" in dates or dates != sorted(dates, reverse=True):
        found.append(f"dates: {dates}")
    for (new, _, results), (old, _, _) in zip(released, released[1:]):
        new_parts, old_parts = ([int(n) for n in v.split(".")] for v in (new, old))
        changed = new_parts[:2] != old_parts[:2]
        if new_parts <= old_parts or changed != (results == "change"):
            found.append(f"{old} to {new}: results {results}")
    return found


RELEASES = """\
| next | not yet | stay |
| 0.2.0 | 2027-02-01 | change |
| 0.1.0 | 2027-01-01 | first version |

## Unreleased

Results stay.

## 0.2.0

Results change: all of them.

## 0.1.0

Results change: first version.
"""


def test_the_releases_are_listed_and_numbered_by_their_results():
    assert not mistakes_of_releases((ROOT / "CHANGELOG.md").read_text())
    assert not mistakes_of_releases(RELEASES)
    for right, wrong in (
        ("| 0.2.0 |", "| 0.3.0 |"),
        ("2027-02-01", "2026-02-01"),
        ("| 2027-02-01 | change |", "| 2027-02-01 | stay |"),
        ("0.2.0", "0.1.1"),
    ):
        assert mistakes_of_releases(RELEASES.replace(right, wrong)), wrong


def test_the_version_is_the_same_everywhere():
    version = (ROOT / "VERSION").read_text().strip()
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {version}\n" in (ROOT / "CHANGELOG.md").read_text()
    assert f'\nversion = "{version}"\n' in (ROOT / "postproc/pyproject.toml").read_text()
    assert perigeo_post.version.__version__ == version
    text = (ROOT / "packaging/README.md").read_text()
    assert set(re.findall(r"\d+\.\d+\.\d+", text)) == {version}


def test_every_picture_of_the_gallery_has_an_input_or_command():
    gallery = (ROOT / "README.md").read_text().partition("\n## Gallery\n")[2].partition("\n## ")[0]
    rows = [re.split(r" *\| *", line)[1:-1] for line in gallery.splitlines() if line[:1] == "|"]
    assert len(rows) > 4
    cases = (ROOT / "tests" / "verify" / "limit_cases.py").read_text()
    for pictures, texts in zip(rows[2::2], rows[3::2]):
        assert all("](doc/figures/" in cell for cell in pictures)
        for text in texts:
            assert re.search(r"`make |`\.venv/bin/", text), text
            assert all(
                f'"{case}": Case(' in cases for case in re.findall(r"limits\.py (\w+)", text)
            )


def test_pictures_are_small():
    sizes = {path.name: path.stat().st_size for path in (ROOT / "doc" / "figures").glob("*")}
    assert sizes
    assert max(sizes.values()) < 150_000, sizes
