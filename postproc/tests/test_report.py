"""The report: what it shows, that it needs nothing outside itself, and what it says is missing."""

from __future__ import annotations

import base64
import io
import json
import re
import subprocess
import sys
from fnmatch import fnmatch
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from perigeo_post import OutputError, RequestError, ResultError
from perigeo_post.cli.command_line import main
from perigeo_post.report.check import LARGE, check_report, check_text
from perigeo_post.report.publish import APPENDIX, BEGIN, END, findings, publish, tables
from perigeo_post.report.values import (
    HEADLINE,
    QUALITY,
    column_text,
    duration,
    number,
    prefixed,
    readable,
)
from perigeo_post.report.write import gather, write_report
from perigeo_post.study.measures import MEASURES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Capture = pytest.CaptureFixture[str]
SHA = "0123456789abcdef" * 4
VERSION = "perigeo 0.1.0 (0123456789ab)"
WILD = '<b>&"\'</td><script src="https://example.org/x.js"></script>'


# ---- made-up studies -----------------------------------------------------------------------------


def draw(path: Path, wide: bool = False) -> None:
    figure = Figure(figsize=(7.0 if wide else 3.5, 2.5), dpi=100)
    FigureCanvasAgg(figure)
    figure.add_subplot().plot([1, 2, 3], [3, 1, 2], "o-")
    figure.savefig(path, dpi=100)


def run_entry(name: str, number: int, **changes: Any) -> dict[str, Any]:
    entry = {
        "id": f"{name}_{number}",
        "series": "runs",
        "label": f"m = {number}",
        "parameters": {"m": number},
        "status": "done",
        "exit_status": 0,
        "message": "",
        "input": f"runs/{name}_{number}/{name}_{number}.nml",
        "result": f"runs/{name}_{number}/{name}_{number}.h5",
        "program_version": VERSION,
        "input_sha256": SHA,
        "seconds": 12.3 * number,
        "threads": 1,
        "points": 5151,
        "steps": 4000,
        "row": {
            "modulus_platen": 51.44e6 - 0.4e6 * number,
            "width": 0.1221 + 0.001 * number,
            "pattern": "X",
            "angle": None,
            "kinetic_ratio_largest": 4.2e-5 * number,
        },
    }
    return entry | changes


def make_study(results: Path, name: str, **changes: Any) -> Path:
    """A folder as `perigeo-post study` leaves it."""
    folder = results / name
    folder.mkdir(parents=True)
    data: dict[str, Any] = {
        "schema": "perigeo study",
        "schema_version": 1,
        "name": name,
        "title": f"Title of {name}",
        "question": f"Question of {name}?",
        "file": f"{name}.toml",
        "base": "compression.nml",
        "created": "2026-03-04T05:06:07+00:00",
        "program_version": VERSION,
        "machine": {"processor": "Processor X", "cores": 2, "system": "Linux x86_64"},
        "complete": True,
        "seconds": 73.8,
        "series": [{"name": "runs", "title": ""}],
        "runs": [run_entry(name, k) for k in (1, 2, 3)],
        "units": {"modulus_platen": "Pa", "width": "m", "m": "1", "kinetic_ratio_largest": "1"},
        "descriptions": {"width": "how wide the band is"},
        "figures": [
            {
                "name": "modulus",
                "png": "modulus.png",
                "pdf": "modulus.pdf",
                "csv": "modulus.csv",
                "title": "Modulus against m",
                "caption": "What the figure shows.",
                "alt": "The modulus falls with m.",
            }
        ],
        "findings": [
            {
                "title": "Convergence",
                "paper": "It converges.",
                "found": "It does.",
                "verdict": "agrees",
                "note": "First part.\n\nSecond part.",
                "values": {"ratio": 1.05},
                "holds": [["ratio < 1.1", True]],
            }
        ],
        "csv": f"{name}.csv",
    } | changes
    for run in data["runs"]:
        path = folder / run["input"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"&run\n  name = '{run['id']}'\n/\n")
    for figure in data["figures"]:
        draw(folder / figure["png"])
        if figure["csv"]:
            (folder / figure["csv"]).write_text("m,E [Pa]\n1,51440000\n2,51040000\n")
    (folder / "study.json").write_text(json.dumps(data))
    return folder


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Two studies, and the rows of make verify."""
    folder = tmp_path / "results"
    make_study(folder, "horizon")
    make_study(folder, "fig3a")
    rows = [
        {"case": "a", "quantity": "slope <E>", "unit": "MPa", "exact": 50.0, "computed": 50.2,
         "tolerance": 0.01, "source": "closed form", "scale": 0.0, "error": 0.004, "passed": True},
        {"case": "b", "quantity": "peak", "unit": "kPa", "exact": 100.0, "computed": 90.0,
         "tolerance": 0.01, "source": "paper", "scale": 0.0, "error": -0.1, "passed": False},
    ]  # fmt: skip
    (folder / "verify").mkdir()
    (folder / "verify" / "verify.json").write_text(json.dumps(rows))
    (folder / "verify" / "verify.md").write_text("Printed by `make verify`, today:\n\n| a |\n")
    return folder


class Reader(HTMLParser):
    """Tags, texts and pictures of a page; knows nothing of the checks of the package."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.styles = ""
        self.words: list[str] = []
        self.place: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        self.place.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("th", "td"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        while self.place and self.place.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "style" in self.place:
            self.styles += data
            return
        self.words.append(data)
        if "td" in self.place or "th" in self.place:
            self.rows[-1][-1] += data

    @property
    def text(self) -> str:
        return " ".join("".join(self.words).split())

    def every(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.tags if name == tag]

    def row(self, head: str) -> list[str]:
        return next(row for row in self.rows if len(row) > 1 and row[0] == head)


def page_of(results: Path, **options: Any) -> Reader:
    report = write_report(results, **options)
    assert report.faults == []
    return Reader(report.path)


def change(folder: Path, **changes: Any) -> None:
    path = folder / "study.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


# ---- the page ------------------------------------------------------------------------------------


def test_a_column_that_ends_in_a_strain_is_measured_at_it():
    assert readable("band_ratio_1_3") == "band ratio at 1.3 %"
    assert readable("largest_alpha") == "largest alpha"


def test_page_needs_nothing_outside_itself(results: Path) -> None:
    page = page_of(results)
    addresses = [
        value
        for _, attributes in page.tags
        for name, value in attributes.items()
        if name in ("src", "href", "srcset", "action", "data", "poster", "background")
    ]
    assert len(addresses) > 6
    assert all(address.startswith(("#", "data:")) for address in addresses)
    assert "http" not in page.styles
    assert "//" not in page.styles
    assert "@import" not in page.styles
    assert not re.search(r"url\((?!data:)", page.styles)
    names = {tag for tag, _ in page.tags}
    assert not names & {"script", "iframe", "object", "embed", "form", "base", "video", "audio"}
    # The browser is told to refuse any request.
    policy = [m["content"] for m in page.every("meta") if "http-equiv" in m]
    assert policy == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


def test_every_picture_decodes_and_has_a_text(results: Path) -> None:
    pictures = page_of(results).every("img")
    assert len(pictures) == 2
    for picture in pictures:
        kind, _, data = picture["src"].partition(",")
        assert kind == "data:image/png;base64"
        with Image.open(io.BytesIO(base64.b64decode(data, validate=True))) as image:
            assert image.size == (350, 250)
            assert np.asarray(image.convert("L")).std() > 5.0
        assert picture["alt"] == "The modulus falls with m."
        # 100 dots an inch in the file become 135 on the screen.
        assert (picture["width"], picture["height"]) == ("473", "338")


def test_anchors_ids_headings_and_language(results: Path) -> None:
    page = page_of(results)
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = {a["href"][1:] for a in page.every("a")}
    assert targets <= set(ids)
    assert {"study-fig3a", "study-horizon", "summary", "findings", "verification"} <= targets
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b <= a + 1 for a, b in zip(levels, levels[1:]))
    assert page.every("html")[0]["lang"] == "en"
    assert len(page.every("nav")) == len(page.every("main")) == len(page.every("title")) == 1
    assert "prefers-color-scheme: dark" in page.styles
    assert "@media print" in page.styles


def test_page_holds_findings_values_runs_and_checks(results: Path) -> None:
    page = page_of(results)
    assert page.row("Convergence") == ["Convergence", "It converges.", "It does.", "agrees"]
    assert "ratio < 1.1 holds" in page.text
    assert "First part." in page.text
    assert page.row("modulus platen MPa")[1:] == ["51.04", "50.64", "50.24"]
    assert page.row("width m")[1:] == ["0.1231", "0.1241", "0.1251"]
    assert page.row("pattern")[1:] == ["X", "X", "X"]
    assert "Without a value in these runs: angle." in page.text
    assert "how wide the band is" in page.text
    line = page.row("m = 2")
    assert line == ["m = 2", "done", "5151", "4000", "1", "25 s", VERSION, SHA[:12]]
    assert "name = 'fig3a_1'" in page.text
    assert "Processor X, 2 cores, Linux x86_64" in page.text
    assert "2026-03-04" in page.text
    assert page.row("slope <E>")[2:8] == ["50", "50.2", "+0.2", "0.5", "+0.400 %", "ok"]
    assert page.row("peak")[7] == "FAILED"
    assert "Printed by make verify, today." in page.text
    assert page.row("Title of fig3a")[1] == "1.26 × 10−4"  # the largest kinetic ratio
    assert page.row("1") == ["1", "5.144 × 107"]  # of the figure


def test_verdicts_are_counted(results: Path) -> None:
    finding = json.loads((results / "fig3a" / "study.json").read_text())["findings"][0]
    verdicts = ("agrees", "agrees in part", "differs", "differs", "no result")
    beyond = {"paper": "", "claim": "It is blue.", "verdict": "does not hold"}
    findings = [finding | {"verdict": v} for v in verdicts] + [finding | beyond]
    change(results / "fig3a", findings=findings)
    text = page_of(results).text
    assert text.count("We claim") == 2
    assert text.count("It is blue.") == 2
    close = text.replace(" ", "")
    assert "Statementsofthepaper:6agrees2agreesinpart1differs2noresult1Ownchecks" in close
    assert "Ownchecks:1doesnothold1Runs" in close


def test_order_is_that_of_the_paper_and_the_page_is_reproducible(results: Path) -> None:
    make_study(results, "a_study_of_mine")
    first = write_report(results).path.read_bytes()
    titles = re.findall(r"<h2>Title of (\w+)</h2>", first.decode())
    assert titles == ["fig3a", "horizon", "a_study_of_mine"]
    assert write_report(results).path.read_bytes() == first


def test_text_stays_text(results: Path) -> None:
    study = json.loads((results / "fig3a" / "study.json").read_text())
    study["runs"] = [
        run_entry("fig3a", 1, label=WILD, parameters={WILD: WILD}),
        run_entry("fig3a", 2, status="failed", message=WILD + "\x00\x1b", exit_status=3, row={}),
    ]
    study["findings"][0].update(title=WILD, paper=WILD, found=WILD, note=WILD)
    study["findings"][0]["holds"] = [[WILD, False]]
    study["figures"][0].update(title=WILD, caption=WILD, alt=WILD)
    texts = dict.fromkeys(("title", "question", "file", "base"), WILD)
    texts |= {"machine": {"processor": WILD}, "descriptions": {"width": WILD}}
    texts |= {"series": [{"name": "runs", "title": WILD}]}
    change(results / "fig3a", **study | texts)
    (results / "fig3a" / "runs" / "fig3a_1" / "fig3a_1.nml").write_text(WILD)
    (results / "fig3a" / "modulus.csv").write_text(f"<i>x</i>,y\n<u>&,{WILD.replace(',', '')}\n")
    page = page_of(results)
    names = {tag for tag, _ in page.tags}
    assert not names & {"script", "i", "u"}
    assert page.text.count(WILD) > 10
    assert page.every("img")[0]["alt"] == WILD
    assert "\x00" not in page.text
    assert "\x1b" not in page.text
    assert [a for _, a in page.tags if a.get("data-label")]


def test_numbers_of_a_figure_are_shown_only_if_few(results: Path) -> None:
    table = "m,E\n" + "".join(f"{k},{k}\n" for k in range(61))
    (results / "fig3a" / "modulus.csv").write_text(table)
    page = page_of(results)
    assert "The numbers in it: modulus.csv (61 rows)." in page.text
    assert page.text.count("Numbers in this figure") == 1  # that of the other study


def test_many_quantities_are_folded(results: Path) -> None:
    more = {f"extra_{k}": 1.5 * k for k in range(20)}
    runs = json.loads((results / "fig3a" / "study.json").read_text())["runs"]
    change(results / "fig3a", runs=[run | {"row": run["row"] | more} for run in runs])
    page = page_of(results)
    assert "All 25 quantities" in page.text
    assert sum(row[0] == "extra 3" for row in page.rows if row) == 1
    assert sum(row[0] == "width m" for row in page.rows if row) == 3
    # The document prints those of the first sight only.
    assert "extra" not in tables(gather(results))


def test_names_of_measures_are_those_of_the_package() -> None:
    columns = {name for measure in MEASURES.values() for name in measure.columns}
    assert set(HEADLINE) <= columns
    assert set(QUALITY) <= columns


# ---- what is missing or broken -------------------------------------------------------------------


def test_failed_and_missing_runs_appear(results: Path) -> None:
    runs = [
        run_entry("fig3a", 1),
        run_entry("fig3a", 2, status="failed", exit_status=3, message="It blew up.\nin step 7",
                  row={}, seconds=None),
        run_entry("fig3a", 3, status="missing", exit_status=None, message=None, row={},
                  program_version=None, input_sha256=None),
    ]  # fmt: skip
    change(results / "fig3a", runs=runs, complete=False)
    (results / "fig3a" / "runs" / "fig3a_3" / "fig3a_3.nml").unlink()
    report = write_report(results)
    assert (report.faults, report.unreadable) == ([], [])
    page = Reader(report.path)
    assert "m = 2: failed with exit status 3." in page.text
    assert "It blew up. in step 7" in page.text
    assert "#failed-fig3a-fig3a-2" in [a["href"] for a in page.every("a")]
    assert "1 of 3 runs missing" in page.text
    assert "perigeo-post study fig3a.toml" in page.text
    assert page.row("m = 3")[1] == "missing"
    assert "runs done41 failed, 1 missing" in page.text
    remarks = "\n".join(report.remarks())
    assert "study fig3a: 1 of 3 runs failed" in remarks
    assert "study fig3a: 1 of 3 runs missing" in remarks


def test_problems_of_a_study_appear(results: Path) -> None:
    change(results / "fig3a", problems=["figure width cannot be drawn: no band"])
    report = write_report(results)
    assert "figure width cannot be drawn: no band" in Reader(report.path).text
    assert "study fig3a: figure width cannot be drawn: no band" in report.remarks()


def test_studies_without_results_are_named(results: Path, tmp_path: Path) -> None:
    studies = tmp_path / "studies"
    studies.mkdir()
    (studies / "size.toml").write_text('name = "size"\n')
    (studies / "first.toml").write_text('name = "fig3a"\n')
    (studies / "broken.toml").write_text("name = \n")
    report = write_report(results, studies=studies)
    assert [name for name, _ in report.material.missing] == ["size", "broken"]
    page = Reader(report.path)
    assert f"perigeo-post study {(studies / 'size.toml').as_posix()}" in page.text
    assert "studies2of 4" in page.text
    assert any("study size has not been computed" in line for line in report.remarks())


@pytest.mark.parametrize(
    ("broken", "reason"),
    [
        ("{", "is not JSON"),
        ("[]", "'the file' is []; it must be an object"),
        ('{"schema": "other"}', '\'schema\' is "other"; it must be "perigeo study"'),
        ({"schema_version": 2}, "'schema_version' is 2; it must be 1"),
        ({"name": ""}, "'name' is \"\"; it must be text"),
        ({"title": 3}, "'title' is 3; it must be text"),
        ({"runs": {}}, "'runs' is {}; it must be a list"),
        ({"runs": [{"id": "a", "status": "dead"}]}, "'runs[0].status' is \"dead\""),
        ({"runs": [{"status": "done"}]}, "'runs[0].id' is missing"),
        ({"runs": [{"id": "a", "status": "done", "row": {"x": []}}]}, "'runs[0].row.x' is []"),
        ({"runs": [{"id": "a", "status": "done", "points": "4"}]}, "'runs[0].points' is \"4\""),
        ({"figures": [{"name": "a", "png": "a.png", "alt": " "}]}, "'figures[0].alt' is \" \""),
        ({"findings": [{"title": "a", "verdict": "yes"}]}, "'findings[0].verdict' is \"yes\""),
        ({"findings": [{"title": "a", "verdict": "agrees", "holds": ["a"]}]}, "holds[0]"),
        ({"units": {"a": 1}}, "'units.a' is 1; it must be text"),
        ({"problems": "a"}, "'problems' is \"a\"; it must be a list of texts"),
        ({"title": 3, "csv": 4}, "'title' is 3; it must be text"),
        ({"title": 3, "csv": 4}, "'csv' is 4; it must be text"),
    ],
)
def test_a_broken_study_is_named_with_the_reason(
    results: Path, broken: Any, reason: str, capsys: Capture
) -> None:
    path = results / "fig3a" / "study.json"
    if isinstance(broken, str):
        path.write_text(broken)
    else:
        change(results / "fig3a", **broken)
    assert main(["report", "--results", str(results)]) == 2
    words = capsys.readouterr()
    assert f"{path}: " in words.err
    assert reason in words.err
    assert "Traceback" not in words.err
    # The other study is there, and the page says what is wrong with this one.
    page = Reader(results / "report.html")
    assert f"{path}: " in page.text
    assert page.row("Convergence")
    assert check_report(results / "report.html") == []


@pytest.mark.parametrize(
    ("name", "contents", "words"),
    [
        ("modulus.png", None, "No such file"),
        ("modulus.png", b"\x89PNG\r\n\x1a\n", "not a picture"),
        ("modulus.csv", None, "No such file"),
        ("modulus.csv", b"", "the table is empty"),
        ("modulus.csv", b"\xff\xfe\x00", "not a table"),
        ("runs/fig3a_1/fig3a_1.nml", None, "not found"),
        ("runs/fig3a_1/fig3a_1.nml", b"\xff\xfe", "cannot be read"),
    ],
)
def test_a_missing_or_broken_file_is_named(
    results: Path, name: str, contents: bytes | None, words: str
) -> None:
    path = results / "fig3a" / name
    if contents is None:
        path.unlink()
    else:
        path.write_bytes(contents)
    report = write_report(results)
    assert len(report.unreadable) == 1
    assert str(path) in report.unreadable[0]
    assert words in report.unreadable[0]
    assert report.faults == []
    page = Reader(report.path)
    assert str(path) in page.text
    assert len(page.every("img")) == (1 if name.endswith("png") else 2)


def test_a_truncated_picture_is_named(results: Path) -> None:
    path = results / "fig3a" / "modulus.png"
    path.write_bytes(path.read_bytes()[:2000])
    assert "not a picture" in write_report(results).unreadable[0]


def test_files_outside_the_study_are_refused(results: Path) -> None:
    figures = json.loads((results / "fig3a" / "study.json").read_text())["figures"]
    change(results / "fig3a", figures=[figures[0] | {"png": "../horizon/modulus.png"}])
    report = write_report(results)
    assert "lies outside the study" in report.unreadable[0]


def test_a_broken_verification_does_not_stop_the_report(results: Path) -> None:
    (results / "verify" / "verify.json").write_text('[{"quantity": "a"}]')
    report = write_report(results)
    assert "'[0].exact' is missing" in report.unreadable[0]
    assert "Verification" not in Reader(report.path).text


def test_without_verification_it_is_left_out(results: Path) -> None:
    for path in (results / "verify").iterdir():
        path.unlink()
    page = page_of(results)
    assert "Verification" not in page.text
    assert "#verification" not in [a["href"] for a in page.every("a")]


def test_nothing_to_report_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="make figures"):
        write_report(tmp_path)
    with pytest.raises(RequestError, match="there is no folder"):
        write_report(tmp_path / "nowhere")


def test_not_writable_is_an_error(results: Path) -> None:
    with pytest.raises(OutputError, match="cannot write"):
        write_report(results, output=results)


# ---- the checks of a page ------------------------------------------------------------------------


def check_changed(results: Path, old: str, new: str) -> str:
    """Faults of a page in which something was replaced."""
    text = write_report(results).path.read_text()
    assert old in text
    return "\n".join(check_text(text.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("<h2>Summary", '<img src="https://example.org/a.png" alt="a"><h2>Summary', "not embedded"),
        ("<h2>Summary", '<a href="https://example.org">x</a><h2>Summary', "external address href"),
        ("<h2>Summary", '<a href="//example.org">x</a><h2>Summary', "external address href"),
        ("<h2>Summary", '<a href="other.html">x</a><h2>Summary', "external address href"),
        ("<h2>Summary", '<p onclick="x">a</p><h2>Summary', "a script in onclick"),
        ("<h2>Summary", "<script>x</script><h2>Summary", "<script> does not belong"),
        ("<h2>Summary", "<u>x</u><h2>Summary", "<u> does not belong"),
        ("<h2>Summary", "<h4>x</h4><h2>Summary", "a heading of level 4 follows one of level 1"),
        ("<h2>Summary", "<h1>x</h1><h2>Summary", "2 headings of level 1"),
        ("<h2>Summary", '<p id="summary">x</p><h2>Summary', "the id 'summary' stands twice"),
        ("<h2>Summary", '<a href="#nowhere">x</a><h2>Summary', "the anchor #nowhere leads nowhere"),
        ("<h2>Summary", "<p><h2>Summary", "closes nothing that is open there"),
        ("<h2>Summary", "</p><h2>Summary", "</p> closes nothing"),
        ("<h2>Summary", "<!-- x --><h2>Summary", "a comment"),
        ("<h2>Summary", '<p style="background: url(//a.b/c)">x</p><h2>Summary', "a style has"),
        ("</style>", "p { background: url('http://a.b/c.png') }</style>", "a style has"),
        ("</style>", '@import "a.css";</style>', "a style imports"),
        ('alt="The modulus falls with m."', 'alt=" "', "no text alternative"),
        ('lang="en"', "", "the language"),
        ("<title>perigeo", "<title></title><p>", "the page has no title"),
        ('name="viewport"', 'name="other"', "no viewport"),
        ('charset="utf-8"', 'charset="latin-1"', "not say that it is in UTF-8"),
        ("<!doctype html>", "", "does not begin with <!doctype html>"),
        ("base64,iVBOR", "base64,!!!!!", "is not in base64"),
        ("base64,iVBOR", "base64,AAAAA", "does not decode"),
        ("</html>", "", "<html> is not closed"),
    ],
)
def test_check_finds_what_is_wrong(results: Path, old: str, new: str, fault: str) -> None:
    assert fault in check_changed(results, old, new)


def test_check_finds_blank_pictures(results: Path) -> None:
    for image in (
        Image.new("RGB", (300, 200), "white"),
        Image.new("L", (300, 200), 90),
        Image.new("RGBA", (300, 200), (0, 0, 0, 0)),
    ):
        image.save(results / "fig3a" / "modulus.png")
        report = write_report(results)
        assert [fault.partition(": ")[2] for fault in report.faults] == ["picture 1 is blank"]


def test_a_faulty_page_has_exit_status_5(results: Path, capsys: Capture) -> None:
    Image.new("RGB", (300, 200), "white").save(results / "fig3a" / "modulus.png")
    assert main(["report", "--results", str(results)]) == 5
    assert "picture 1 is blank" in capsys.readouterr().err


def test_check_reads_only_text(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="cannot be read"):
        check_report(tmp_path / "nowhere.html")
    (tmp_path / "binary.html").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ResultError, match="UTF-8"):
        check_report(tmp_path / "binary.html")


def test_a_large_page_is_remarked(results: Path) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (2400, 2200, 3), dtype=np.uint8)
    Image.fromarray(noise).save(results / "fig3a" / "modulus.png", compress_level=1)
    report = write_report(results)
    assert report.size > LARGE
    assert any("MB: it may be slow to open" in line for line in report.remarks())


# ---- command line and document -------------------------------------------------------------------


def test_command_writes_the_page_and_the_document(
    results: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "doc").mkdir()
    document = tmp_path / "doc" / "verification.md"
    document.write_text(f"Before.\n\n{BEGIN}\nold\n{END}\n\nAfter.\n")
    assert main(["report", "--publish"]) == 0
    words = capsys.readouterr()
    assert words.out.splitlines() == [
        f"wrote {Path('results/report.html')}", f"wrote {Path('doc/verification.md')}",
    ]  # fmt: skip
    assert words.err == ""
    text = document.read_text()
    assert text.startswith(f"Before.\n\n{BEGIN}\nPrinted by `make report`, {VERSION}, Processor X")
    assert text.endswith(f"{END}\n\nAfter.\n")
    assert "old" not in text
    assert "| Title of fig3a | Convergence | It converges. | It does. | agrees |" in text
    assert "| modulus platen | MPa | 51.04 | 50.64 | 50.24 |" in text
    assert main(["report", "--publish"]) == 0
    assert document.read_text() == text
    appendix = document.with_name(APPENDIX)
    appendix.write_text(f"Values.\n\n{BEGIN}\n{END}\n")
    assert main(["report", "--publish"]) == 0
    assert capsys.readouterr().out.endswith(f"wrote {Path('doc') / APPENDIX}\n")
    assert "| modulus platen |" not in document.read_text()
    assert "| modulus platen | MPa | 51.04 | 50.64 | 50.24 |" in appendix.read_text()
    assert "It converges." not in appendix.read_text()


def test_own_checks_are_published_apart(results: Path) -> None:
    finding = json.loads((results / "fig3a" / "study.json").read_text())["findings"][0]
    claim = {"paper": "", "claim": "It is blue.", "verdict": "holds"}
    change(results / "fig3a", findings=[finding, finding | claim, finding | claim])
    paper, own = findings(gather(results)).split("**Own checks")
    assert "It is blue." not in paper
    assert own.startswith(", beyond the paper** (2: 2 holds)")
    assert own.count("It is blue.") == 2


def test_published_text_stays_text(results: Path) -> None:
    finding = json.loads((results / "fig3a" / "study.json").read_text())["findings"][0]
    wild = "a | <b>&\n*b* `c` [d](e)"
    change(results / "fig3a", findings=[finding | {"found": wild}], title="T | <i>")
    text = findings(gather(results))
    assert "a \\| &lt;b&gt;&amp; \\*b\\* \\`c\\` \\[d\\](e)" in text
    rows = [line for line in text.splitlines() if "Convergence" in line]
    assert len(rows) == 2
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 6 for row in rows)


def test_published_text_says_what_is_missing(results: Path, tmp_path: Path) -> None:
    runs = [run_entry("fig3a", 1), run_entry("fig3a", 2, status="failed")]
    change(results / "fig3a", runs=runs)
    studies = tmp_path / "studies"
    studies.mkdir()
    (studies / "size.toml").write_text('name = "size"\n')
    text = tables(gather(results, studies))
    assert "Of the 2 runs of `fig3a`, 1 are done, 1 failed." in text
    assert "Not computed: size." in text


@pytest.mark.parametrize("text", ["nothing", BEGIN, f"{END}\n{BEGIN}", f"{BEGIN}{END}{BEGIN}"])
def test_a_document_without_markers_is_left_alone(results: Path, tmp_path: Path, text: str) -> None:
    document = tmp_path / "page.md"
    document.write_text(text)
    with pytest.raises(RequestError, match="studies: begin"):
        publish(gather(results), document)
    assert document.read_text() == text


def test_without_jinja2_the_command_says_what_to_install(results: Path) -> None:
    code = (
        "import sys; sys.modules['jinja2'] = None\n"  # makes every import of it fail
        "from perigeo_post.cli.command_line import main\nsys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, "report", "--results", str(results)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("perigeo-post: error: perigeo-post report needs jinja2, which is not ")
    assert line.endswith("-m pip install './postproc[report]'")
    assert not (results / "report.html").exists()


def test_an_installed_package_holds_every_file() -> None:
    """Templates and the style sheet; in a checkout they are found in any case."""
    root = Path(__file__).parents[1]
    package = root / "perigeo_post"
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]["perigeo_post"]
    files = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc")
    }
    assert {f"report/templates/{name}" for name in ("page.html", "style.css")} <= files
    assert not [f for f in files if not any(fnmatch(f, pattern) for pattern in patterns)]


# ---- numbers -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (5151, "5151"),
        (172194.3, "172194"),
        (0.122149, "0.1221"),
        (-0.0861, "−0.0861"),
        (4.1827e-5, "4.183 × 10^−5"),
        (5e-4, "5 × 10^−4"),
        (51.44e6, "5.144 × 10^7"),
        (float("nan"), "–"),
    ],
)
def test_numbers_are_rounded(value: float, text: str) -> None:
    assert number(value) == text


def test_numbers_of_a_row_have_the_same_decimals() -> None:
    assert column_text([51.4, 49.96947, 50.0]) == ["51.40", "49.97", "50.00"]
    assert column_text([0.02, 0.02]) == ["0.02", "0.02"]
    assert column_text([1.0, -2.0]) == ["1", "−2"]
    assert column_text([4e-5, 0.02]) == ["4 × 10^−5", "0.02"]
    assert column_text([100.0, 200.0]) == ["100", "200"]


def test_units_get_prefixes() -> None:
    assert prefixed([51.4e6, 3.0], "Pa") == (1e-6, "MPa")
    assert prefixed([-1.7e5], "Pa") == (1e-3, "kPa")
    assert prefixed([0.12], "m") == (1.0, "m")
    assert prefixed([0.12], "1") == (1.0, "")


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, "–"), (0.04, "0.0 s"), (12.3, "12 s"), (59.7, "1 min 00 s"), (75.0, "1 min 15 s"),
     (1597.0, "27 min"), (3599.0, "1 h 00 min"), (7500.0, "2 h 05 min")],
)  # fmt: skip
def test_durations_are_for_people(seconds: float | None, text: str) -> None:
    assert duration(seconds) == text
