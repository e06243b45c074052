"""The pages of `make site`: links, anchors, pictures, and what they say of the sources."""

import json
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import make_gallery  # noqa: E402
from site_pages.build import Site  # noqa: E402
from site_pages.faults import faults  # noqa: E402
from site_pages.fortran import read_module  # noqa: E402
from site_pages.markup import Renderer  # noqa: E402
from site_pages.order import GROUPS, documents  # noqa: E402


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Return the site with all documents and the modules of one folder of each kind."""
    made = Site(tmp_path_factory.mktemp("site"), quick=True, only=("base", "read"))
    made.build()
    return made


def test_every_link_of_a_document_leads_somewhere(site):
    assert not site.dead


def test_no_link_anchor_or_picture_is_missing_and_nothing_is_loaded_from_elsewhere(site):
    assert not faults(site.output)


def test_every_page_fits_on_a_phone_and_the_limits_on_a_screen(site, tmp_path, monkeypatch):
    """In a browser without a window; `make site-view` looks at more."""
    pytest.importorskip("selenium", reason="make site-view installs selenium")
    monkeypatch.setenv("SE_OFFLINE", "true")
    import view_report
    import view_site
    from selenium.common.exceptions import NoSuchDriverException

    found = view_report.find_browser()
    if found is None:
        pytest.skip("no browser")
    kind, *programs = found
    try:
        browser = kind(*programs, False)
    except NoSuchDriverException:
        pytest.skip("no driver for the browser")
    try:
        viewer = view_site.Viewer(browser, site.output, tmp_path, "light")
        viewer.size(380, 800)
        pages = [page for page in view_site.documents(site.output) if "/pd_" not in page]
        seen = {page: view_site.faults(viewer.look(page), viewer.address) for page in pages}
        viewer.size(1280, 900)
        viewer.look("doc/limits.html")
        bottom = "return document.querySelector('table').getBoundingClientRect().bottom"
        end = browser.browser.execute_script(bottom)
    finally:
        browser.browser.quit()
    assert len(seen) > 35
    assert not {page: words for page, words in seen.items() if words}
    assert end < 900  # what matters most


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('<a href="none.html">x</a>', "not there"),
        ('<a href="#none">x</a>', "no such anchor"),
        ('<img alt="x" src="none.png">', "not there"),
        ('<img src="style.css">', "without words"),
        ('<script src="https://example.org/x.js"></script>', "loads https:"),
        ('<p id="x"></p><p id="x"></p>', "twice"),
    ],
)
def test_a_fault_is_seen(tmp_path, text, words):
    for name in ("style.css", "site.js"):
        (tmp_path / name).write_text("")
    (tmp_path / "index.html").write_text(text)
    found = faults(tmp_path)
    assert len(found) == 1
    assert words in found[0]


def test_every_document_is_in_the_navigation_and_no_other():
    named = {name for group in documents().values() for name in group}
    written = {p.relative_to(ROOT).as_posix() for p in ROOT.glob("doc/**/*.md")}
    assert written <= named
    assert {"README.md", "CONTRIBUTING.md"} <= named
    assert all((ROOT / name).is_file() for name in named)


def test_a_document_that_no_list_names_is_found(tmp_path):
    for name in ("README.md", "doc/new.md", "doc/tutorials/new.md", "doc/tutorials/new.ipynb"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("# New\n")
    groups = documents(tmp_path)
    assert groups["Tutorials"] == ["doc/tutorials/new.ipynb", "doc/tutorials/new.md"]
    assert groups["More"] == ["doc/new.md"]
    assert "Start" in GROUPS


def test_the_search_knows_the_sections(site):
    text = (site.output / "search.js").read_text()
    entries = json.loads(text.removeprefix("window.perigeoSearch=").rstrip(";\n"))
    found = [e for e in entries if "shape tensor" in e[3].lower()]
    assert any(e[0].startswith("doc/theory.html#") for e in found)
    for address, _, title, _ in entries:
        page, _, anchor = address.partition("#")
        if anchor and not page.startswith(("modules", "python")):
            assert f'id="{anchor}"' in (site.output / page).read_text(), title


def test_a_module_shows_what_it_offers():
    module = read_module(ROOT / "src" / "material" / "pd_law.f90", ROOT)
    assert module.public == ["law_t", "law_points_t"]
    assert module.uses == ["pd_flow", "pd_kinds", "pd_labels"]
    assert module.about.startswith("A material law")
    stress = next(item for item in module.items if item.name == "stress_of")
    assert [name for name, _, _ in stress.parts] == [
        "self",
        "first",
        "lo",
        "hi",
        "strain",
        "points",
        "flow",
    ]
    assert stress.parts[4] == (
        "strain", "real(wp), intent(in), contiguous", "E xx yy zz xy; row 1: row `first`"
    )  # fmt: skip


def test_every_public_procedure_is_found():
    for path in sorted(ROOT.glob("src/*/*.f90")):
        module = read_module(path, ROOT)
        source = re.sub(r"&\n\s*", "", module.source)
        names = {item.name for item in module.items}
        begun = set(re.findall(r"^  (?!end).*\b(?:subroutine|function) (\w+)", source, re.M))
        assert {n for n in module.public if n in begun} <= names, path.name
        assert all(item.line for item in module.items)


def test_a_notebook_shows_its_text_code_and_figures():
    cells = [
        {"cell_type": "markdown", "source": ["# A title\n", "and [words](doc/a.md)"]},
        {
            "cell_type": "code",
            "source": ["print(1 < 2)"],
            "outputs": [{"text": ["True\n"]}, {"data": {"image/png": "AAAA"}}],
        },
    ]
    made = Renderer(lambda link: "b.html", lambda words: None).notebook(
        json.dumps({"cells": cells})
    )
    assert made.title == "A title"
    assert '<a href="b.html">words</a>' in made.body
    assert "True" in made.body
    assert "data:image/png;base64,AAAA" in made.body


def test_the_gallery_is_the_one_of_its_list():
    assert make_gallery.PAGE.read_text() == make_gallery.page()
    inputs = {e.made_from for entries in make_gallery.SECTIONS.values() for e in entries}
    inputs = {make_gallery.RUNS[name][0] if name in make_gallery.RUNS else name for name in inputs}
    assert not [name for name in inputs if not (ROOT / name).is_file()]
    shown = re.findall(r"\]\((figures/[^)]*)\)", make_gallery.page())
    assert len(shown) > 25
    assert not [name for name in shown if not (ROOT / "doc" / name).is_file()]
    pictures = {f"figures/gallery/{path.name}" for path in make_gallery.FIGURES.glob("*")}
    assert pictures <= set(shown)


def test_the_gallery_has_every_kind_of_figure():
    page = make_gallery.page()
    table = (ROOT / "doc" / "studies.md").read_text().partition("## What to draw")[2]
    kinds = re.findall(r"^\| `(\w+)` \|", table.partition("| option |")[0], re.M)
    assert len(kinds) == 6
    commands = ("curves", "contours", "band", "compare", "animate", "geometry", "study")
    assert not [name for name in commands if f"perigeo-post {name} " not in page]
    assert not [kind for kind in kinds if f"`{kind}`:" not in page]
