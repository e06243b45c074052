"""Make the site: the documents and a page for every module, with FORD, for `make site`.

    .venv/bin/python tools/make_site.py FOLDER

FORD wants pages with titles and links between them; the documents are read as they are and
rewritten on the way. What FORD's pages would load from elsewhere (Bootstrap, MathJax) comes from
the package mkdocs or is left out, so that the site needs no network. Ends with an error where a
page would still load something, or where a link within the site leads nowhere.
"""

from __future__ import annotations

import html
import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlparse

ROOT = Path(__file__).resolve().parents[1]

# The documents in the order of their list, and the names of their pages.
PAGES = {
    "doc/input.md": "input",
    "doc/tutorials/footing.md": "tutorial_footing",
    "doc/tutorials/slope.md": "tutorial_slope",
    "doc/tutorials/wall.md": "tutorial_wall",
    "doc/tutorials/excavation.md": "tutorial_excavation",
    "doc/tutorials/hole.md": "tutorial_hole",
    "doc/model.md": "model",
    "doc/choices.md": "choices",
    "doc/own_test.md": "own_test",
    "doc/studies.md": "studies",
    "doc/results.md": "results",
    "doc/reliability.md": "reliability",
    "doc/theory.md": "theory",
    "doc/design.md": "design",
    "doc/verification.md": "verification",
    "doc/performance.md": "performance",
    "doc/parallel.md": "parallel",
    "postproc/README.md": "postproc",
    "CONTRIBUTING.md": "contributing",
    "CHANGELOG.md": "changelog",
}

SETTINGS = """\
project: perigeo
author: the perigeo developers
version: {version}
src_dir: src
page_dir: pages
media_dir: {root}/doc/figures
css: site.css
output_dir: {output}
display: public
search: false
graph: false
preprocess: false
print_creation_date: false

"""

# Wide figures, examples and tables stay within the page, on a phone too. What FORD takes for a
# mistake in a language that it has guessed is none.
STYLE = """\
img { max-width: 100%; height: auto; }
pre { overflow-x: auto; }
#text table { display: block; overflow-x: auto; margin-bottom: 1em; }
td, th { padding: 0.2em 0.8em 0.2em 0; }
.err { border: 0 !important; color: inherit !important; }
@media (max-width: 700px) { .col-3, .col-9 { width: 100%; } }
"""

# Files that FORD's pages load from elsewhere, and where they are in the package mkdocs.
LOCAL = {
    "bootstrap.min.css": "themes/mkdocs/css/bootstrap.min.css",
    "bootstrap.bundle.min.js": "themes/mkdocs/js/bootstrap.bundle.min.js",
}
LOADED = re.compile(
    r"<script\b[^>]*\bsrc=\"(?P<script>https?://[^\"]*)\"[^>]*>\s*</script>"
    r"|<link\b[^>]*\bhref=\"(?P<style>https?://[^\"]*)\"[^>]*>"
    r"|<script type=\"text/x-mathjax-config\">.*?</script>",
    re.DOTALL,
)
EQUATION = re.compile(r"^( *!>) {3,}(?=\S)", re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^\]\\]|\\.)*)\]\(([^)\s]+)\)")


def target(source: str, link: str, front: bool) -> str | None:
    """Return where a link of a document leads on the site; None: nowhere."""
    place, _, anchor = link.partition("#")
    anchor = f"#{anchor}" if anchor else ""
    if urlparse(link).scheme or not place:
        return link
    path = (ROOT / source).parent.joinpath(place).resolve()
    name = str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else ""
    above = "" if front else "../"
    if name in PAGES:
        return ("page/" if front else "") + f"{PAGES[name]}.html{anchor}"
    if name == "README.md":
        return f"{above}index.html{anchor}"
    if name.startswith("doc/figures/"):
        return f"{above}media/{path.name}"
    return None


def document(source: str, front: bool = False) -> tuple[str, str]:
    """Return the title of a document, and its text with the links of the site."""

    def led(found: re.Match[str]) -> str:
        image, words, link = found.groups()
        to = target(source, link, front)
        return f"{image}[{words}]({to})" if to else words

    def plain(example: str) -> str:
        """Keep FORD from guessing a language where none is named."""
        return "```text" + example[3:] if example.startswith("```\n") else example

    # Fenced examples stay as they are.
    text = (ROOT / source).read_text(encoding="utf-8")
    parts = re.split(r"(^```.*?^```$)", text, flags=re.DOTALL | re.MULTILINE)
    text = "".join(plain(part) if k % 2 else LINK.sub(led, part) for k, part in enumerate(parts))
    first, _, rest = text.partition("\n")
    if not first.startswith("# "):
        sys.exit(f"{source}: its first line is no heading")
    return first[2:], rest


def write_sources(folder: Path, output: Path) -> Path:
    """Write what FORD reads; return its project file."""
    pages = folder / "pages"
    shutil.rmtree(folder, ignore_errors=True)
    pages.mkdir(parents=True)
    listed = []
    for source, name in PAGES.items():
        title, text = document(source)
        (pages / f"{name}.md").write_text(f"title: {title}\n\n{text}", encoding="utf-8")
        listed.append(f"- [{title}]({name}.html)")
    order = "".join(f"ordered_subpage: {name}.md\n" for name in PAGES.values())
    index = f"title: Documents\n{order}\n" + "\n".join(listed) + "\n"
    (pages / "index.md").write_text(index, encoding="utf-8")
    # Equations in comments are set off by two blanks, in Markdown by four.
    for path in sorted((ROOT / "src").rglob("*.f90")):
        copy = folder / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        text = EQUATION.sub(r"\g<0>    ", path.read_text(encoding="utf-8"))
        copy.write_text(text, encoding="utf-8")
    version = (ROOT / "VERSION").read_text(encoding="utf-8").strip()
    settings = SETTINGS.format(root=ROOT, output=output, version=version)
    (folder / "site.css").write_text(STYLE, encoding="utf-8")
    project = folder / "site.md"
    project.write_text(settings + document("README.md", front=True)[1], encoding="utf-8")
    return project


def make_local(output: Path) -> None:
    """Make the pages load what lies beside them, and nothing from elsewhere."""
    package = importlib.util.find_spec("mkdocs")
    if package is None or package.origin is None:
        sys.exit("make_site: the package mkdocs is missing")
    for name, place in LOCAL.items():
        folder = output / name.rsplit(".", 1)[1]
        shutil.copy(Path(package.origin).parent / place, folder / name)
    for page in sorted(output.rglob("*.html")):
        above = "../" * (len(page.relative_to(output).parts) - 1)

        def local(found: re.Match[str], above: str = above) -> str:
            name = (found["script"] or found["style"] or "").rsplit("/", 1)[-1]
            if name not in LOCAL:
                return ""
            if found["style"]:
                return f'<link href="{above}css/{name}" rel="stylesheet">'
            return f'<script src="{above}js/{name}"></script>'

        page.write_text(LOADED.sub(local, page.read_text(encoding="utf-8")), encoding="utf-8")


def faults(output: Path) -> list[str]:
    """Return a line for everything that a page loads from elsewhere, and for each dead link."""
    found = []
    names = {page: page.read_text(encoding="utf-8") for page in sorted(output.rglob("*.html"))}
    for page, text in names.items():
        where = page.relative_to(output)
        loads = re.findall(
            r"<(?:script|img|link|iframe|source)\b[^>]*(?:src|href)=\"([^\"]*)", text
        )
        found += [f"{where} loads {url}" for url in loads if re.match(r"(https?:)?//", url)]
        for url in {*loads, *re.findall(r"<a\b[^>]*href=['\"]([^'\"]*)", text)}:
            parts = urlparse(html.unescape(url))
            if parts.scheme or parts.netloc or not parts.path:
                continue
            if not (page.parent / unquote(parts.path)).exists():
                found.append(f"{where} links to {url}, which is not there")
    for style in sorted(output.rglob("*.css")):
        urls = re.findall(r"(?:@import|url\()\s*[\"']?((?:https?:)?//[^\"')]*)", style.read_text())
        found += [f"{style.relative_to(output)} loads {url}" for url in urls]
    return found


def main() -> int:
    if len(sys.argv) != 2:
        sys.exit("usage: make_site.py FOLDER")
    output = Path(sys.argv[1]).resolve()
    sources = output.parent / f"{output.name}-source"
    project = write_sources(sources, output)
    shutil.rmtree(output, ignore_errors=True)
    ford = [sys.executable, "-m", "ford", "--quiet", str(project)]
    if subprocess.run(ford, check=False).returncode != 0:
        return 1
    make_local(output)
    problems = faults(output)
    print("\n".join(problems[:40]), file=sys.stderr if problems else sys.stdout, end="")
    if problems:
        print(f"\nmake_site: {len(problems)} faults", file=sys.stderr)
        return 1
    pages = len(list(output.rglob("*.html")))
    print(f"{pages} pages; begin with {output.relative_to(ROOT)}/index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
