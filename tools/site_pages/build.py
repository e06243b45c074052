"""Build the site: documents, files they name, modules of the program and of perigeo-post."""

from __future__ import annotations

import html
import json
import posixpath
import re
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote, urlparse

from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup

from .fortran import Module, read_module
from .markup import Renderer, Section, coloured
from .order import ROOT, documents
from .python_api import PythonModule, read_package

THEME = Path(__file__).parent / "theme"
FRONT = {"README.md": "index.html"}
# Folders whose files a code span may name, and what is shown of them as a page.
NAMED = ("input", "studies", "doc", "src", "mpi", "tests", "tools", "postproc")
SHOWN = {".nml", ".toml", ".f90", ".pf", ".py", ".sh", ".md", ".cff", ".csv", ".txt", ".yaml", ""}
FOLDERS = ("input", "input/limit_loads", "studies")
API = {"modules/index.html": "Modules of the program", "python/index.html": "perigeo_post"}
LABELS = {"README.md": "perigeo", "CONTRIBUTING.md": "Contributing", "CHANGELOG.md": "Changes"}


@dataclass(frozen=True)
class Entry:
    """A line of the navigation."""

    out: str
    label: str


@dataclass
class Page:
    out: str
    title: str
    body: str
    source: str = ""
    sections: list[Section] = field(default_factory=list)


def out_of(name: str) -> str:
    """Return the place of a document on the site."""
    return FRONT.get(name) or re.sub(r"\.(md|ipynb)$", ".html", name)


def heading_of(path: Path) -> str:
    """Return the first heading of a document or notebook."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "markdown")
    found = re.search(r"^# (.*)$", text, re.MULTILINE)
    return re.sub(r"[`*]", "", found[1]) if found else path.stem


class Site:
    """Everything that is written.

    `quick` leaves the syntax of sources unmarked; `only` names the folders of modules to take.
    """

    def __init__(
        self, output: Path, quick: bool = False, root: Path = ROOT, only: tuple[str, ...] = ()
    ) -> None:
        self.output, self.quick, self.root = output, quick, root
        self.groups = documents(root)
        self.modules: dict[str, Module] = {}
        for path in sorted([*root.glob("src/*/*.f90"), *root.glob("mpi/*.f90")]):
            if only and path.parent.name not in only:
                continue
            module = read_module(path, root)
            name = f"{module.name}_mpi" if module.layer == "mpi" else module.name
            self.modules[name] = module
        self.packages = [m for m in read_package(root)
                         if not only or Path(m.path).parent.name in only]  # fmt: skip
        self.extra: dict[str, str] = {}  # files that are shown or copied: path, place on the site
        self.dead: list[str] = []
        self.search: list[list[str]] = []
        self.version = (root / "VERSION").read_text(encoding="utf-8").strip()
        self.place = self.places()
        templates = Environment(loader=FileSystemLoader(THEME), autoescape=True)
        self.templates = {n: templates.get_template(f"{n}.html")
                          for n in ("page", "module", "python")}  # fmt: skip
        self.navigation = self.entries()

    def places(self) -> dict[str, str]:
        """Return where the documents and modules are on the site."""
        place = {name: out_of(name) for group in self.groups.values() for name in group}
        place |= {m.path: f"modules/{name}.html" for name, m in self.modules.items()}
        return place | {m.path: f"python/{m.name}.html" for m in self.packages}

    def entries(self) -> dict[str, list[Entry]]:
        made = {
            group: [Entry(out_of(n), LABELS.get(n) or heading_of(self.root / n)) for n in names]
            for group, names in self.groups.items()
        }
        made["Inputs and code"] = [Entry("input/index.html", "Inputs"),
                                   Entry("studies/index.html", "Studies"),
                                   *(Entry(out, words) for out, words in API.items())]  # fmt: skip
        return made

    # ------------------------------------------------------------------ links

    def lead(self, link: str, source: str, out: str) -> str | None:
        """Return where a link of a file of the repository leads, seen from a page."""
        place, mark, anchor = link.partition("#")
        if urlparse(link).scheme or not place:
            return link
        name = posixpath.normpath(posixpath.join(posixpath.dirname(source), place))
        to = self.place_of(name)
        return None if to is None else self.relative(to, out) + mark + anchor

    @staticmethod
    def relative(to: str, out: str) -> str:
        return quote(posixpath.relpath(to, posixpath.dirname(out) or "."))

    def place_of(self, name: str) -> str | None:
        """Return where a file of the repository is on the site; it is put there if need be."""
        path = self.root / name
        if name in self.place:
            return self.place[name]
        if name in FOLDERS:
            return f"{name}/index.html"
        if name.startswith("..") or not path.is_file():
            return None
        if path.suffix in SHOWN:
            self.extra[name] = f"{name}.html"
        else:
            self.extra[name] = name
        return self.extra[name]

    def named(self, words: str, out: str) -> str | None:
        """Return the page of a file or module that a code span names."""
        if words in self.modules:
            return self.relative(f"modules/{words}.html", out)
        if not re.fullmatch(r"[\w./-]+", words) or words.split("/")[0] not in NAMED:
            return None
        if not (self.root / words).is_file() or "/" not in words:
            return None
        to = self.place_of(words)
        return to and self.relative(to, out)

    def renderer(self, source: str, out: str) -> Renderer:
        return Renderer(lambda link: self.lead(link, source, out),
                        lambda words: self.named(words, out), self.quick)  # fmt: skip

    # ------------------------------------------------------------------ pages

    def document(self, name: str) -> Page:
        renderer = self.renderer(name, out_of(name))
        text = (self.root / name).read_text(encoding="utf-8")
        made = renderer.notebook(text) if name.endswith(".ipynb") else renderer.render(text)
        self.dead += [f"{name} links to {link}, which is not there" for link in renderer.dead]
        return Page(out_of(name), made.title, made.body, name, made.sections)

    def code_lines(self, source: str, language: str) -> Markup:
        """Return a source with numbered lines."""
        lines = coloured(source, language, self.quick).split("\n")
        # A markup that goes over several lines is closed and opened at their ends.
        made, held = [], ""
        for number, line in enumerate(lines, start=1):
            whole = held + line
            opened = re.findall(r"<span[^>]*>|</span>", whole)
            stack: list[str] = []
            for word in opened:
                stack = stack[:-1] if word == "</span>" else [*stack, word]
            held = "".join(stack)
            whole += "</span>" * len(stack)
            made.append(
                f'<span id="line{number}"><a class="n" href="#line{number}">{number}</a>{whole}'
                "</span>"
            )
        return Markup('<pre class="lines" tabindex="0"><code>' + "\n".join(made) + "</code></pre>")

    def module(self, name: str, module: Module, users: list[str]) -> Page:
        out = f"modules/{name}.html"
        renderer = self.renderer(module.path, out)
        about = [Markup(renderer.render(words).body) for words in
                 (module.about, *(item.about for item in module.items))]  # fmt: skip
        body = self.templates["module"].render(
            module=module, about=about[0], users=users, known=set(self.modules),
            items=list(zip(module.items, about[1:])),
            source=self.code_lines(module.source, "fortran"),
        )  # fmt: skip
        sections = [Section("", 1, name, [module.about])]
        sections += [Section(i.name, 2, i.name, [i.about]) for i in module.items]
        return Page(out, name, body, module.path, sections)

    def python(self, module: PythonModule) -> Page:
        out = f"python/{module.name}.html"
        about = Markup(f'<pre class="printed" tabindex="0">{html.escape(module.about)}</pre>')
        body = self.templates["python"].render(
            module=module, about=about, source=self.code_lines(module.source, "python")
        )
        sections = [Section("", 1, module.name, [module.about])]
        for member in module.members:
            sections.append(Section(member.name, 2, member.name, [member.about]))
            sections += [Section(f"{member.name}.{inner.name}", 3, f"{member.name}.{inner.name}",
                                 [inner.about]) for inner in member.members]  # fmt: skip
        return Page(out, module.name, body, module.path, sections)

    def listing(self, out: str, title: str, groups: Iterable[tuple[str, list[list[str]]]]) -> Page:
        """Return a page of links: in each group rows of address, name and sentence."""
        parts = []
        for group, rows in groups:
            parts.append(f"<h2>{html.escape(group)}</h2>" if group else "")
            parts.append('<div class="box" tabindex="0"><table><tbody>')
            for address, name, words in rows:
                link = f'<a href="{self.relative(address, out)}">{html.escape(name)}</a>'
                parts.append(f"<tr><td>{link}</td><td>{html.escape(words)}</td></tr>")
            parts.append("</tbody></table></div>")
        return Page(out, title, "\n".join(parts))

    def api_lists(self) -> list[Page]:
        layers = re.search(r"^layers := (.*)$", (self.root / "Makefile").read_text(), re.MULTILINE)
        groups = []
        for layer in [*(layers[1].split() if layers else []), "mpi"]:
            rows = [[f"modules/{n}.html", n, first_sentence(m.about)]
                    for n, m in self.modules.items() if m.layer == layer]  # fmt: skip
            groups.append((f"src/{layer}" if layer != "mpi" else layer, rows))
        rows = [[f"python/{m.name}.html", m.name, first_sentence(m.about)] for m in self.packages]
        lists = {"modules/index.html": groups, "python/index.html": [("", rows)]}
        return [self.listing(out, API[out], lists[out]) for out in API]

    def folder(self, name: str) -> Page:
        """Return the page of a folder of inputs or studies."""
        rows = [[f"{sub}/index.html", f"{sub}/", ""] for sub in FOLDERS
                if posixpath.dirname(sub) == name]  # fmt: skip
        for path in sorted((self.root / name).iterdir()):
            inner = path.relative_to(self.root).as_posix()
            if path.is_file() and path.suffix in SHOWN:
                first = path.read_text(encoding="utf-8").partition("\n")[0].lstrip("!# ")
                rows.append([str(self.place_of(inner)), path.name, first])
        return self.listing(f"{name}/index.html", f"{name}/", [("", rows)])

    def shown_file(self, name: str) -> Page:
        path = self.root / name
        source = path.read_text(encoding="utf-8")
        body = self.code_lines(source, path.suffix.lstrip(".") or "text")
        head = source.partition("\n\n")[0] if path.suffix == ".nml" else ""
        words = [re.sub(r"^! ?", "", head, flags=re.MULTILINE)]
        return Page(f"{name}.html", name, str(body), name, [Section("", 1, name, words)])

    # ------------------------------------------------------------------ writing

    def write(self, page: Page, before: Entry | None = None, after: Entry | None = None) -> None:
        path = self.output / page.out
        path.parent.mkdir(parents=True, exist_ok=True)
        contents = [s for s in page.sections if s.level > 1 and s.anchor]
        path.write_text(
            self.templates["page"].render(
                title=page.title, body=Markup(page.body), out=page.out, source=page.source,
                above="../" * page.out.count("/"), navigation=self.navigation,
                contents=contents if len(contents) > 1 else [],
                before=before, after=after, version=self.version,
            ),
            encoding="utf-8",
        )  # fmt: skip
        for section in page.sections:
            text = re.sub(r"\s+", " ", " ".join(section.words)).strip()
            anchor = f"#{section.anchor}" if section.anchor else ""
            self.search.append([page.out + anchor, page.title, section.title, text])

    def build(self) -> int:
        """Write everything; returns the number of pages."""
        shutil.rmtree(self.output, ignore_errors=True)
        self.output.mkdir(parents=True)
        for name in ("style.css", "site.js"):
            shutil.copy(THEME / name, self.output / name)
        names = [name for group in self.groups.values() for name in group]
        order = [entry for group in list(self.navigation.values())[:-1] for entry in group]
        for k, name in enumerate(names):
            before = order[k - 1] if k else None
            self.write(self.document(name), before, order[k + 1] if k + 1 < len(order) else None)
        users: dict[str, list[str]] = {}
        for name, module in self.modules.items():
            for used in module.uses:
                users.setdefault(used, []).append(name)
        for name, module in self.modules.items():
            self.write(self.module(name, module, users.get(module.name, [])))
        for package in self.packages:
            self.write(self.python(package))
        for page in [*self.api_lists(), *(self.folder(name) for name in FOLDERS)]:
            self.write(page)
        self.write_extra()
        text = json.dumps(self.search, ensure_ascii=False, separators=(",", ":"))
        (self.output / "search.js").write_text(f"window.perigeoSearch={text};\n", encoding="utf-8")
        return len(list(self.output.rglob("*.html")))

    def write_extra(self) -> None:
        """Show or copy the files that documents name."""
        for name, out in sorted(self.extra.items()):
            if out == name:
                (self.output / out).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(self.root / name, self.output / out)
            else:
                self.write(self.shown_file(name))


def first_sentence(text: str) -> str:
    """Return the first sentence of a comment."""
    line = re.sub(r"\s+", " ", text.partition("\n\n")[0]).strip()
    return re.split(r"(?<=[.;]) (?=[A-Z])", line)[0]
