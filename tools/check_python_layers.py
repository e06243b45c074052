"""Check the layers of perigeo_post:  python tools/check_python_layers.py [--self-test]

A module imports only from its own folder and from folders above it in LAYERS, from other packages
only those that its folder may know, and the modules of a folder import each other without a
cycle. Every import statement counts, also within functions and for types alone. Needs Python 3.10,
which knows the names of the standard library.
"""

from __future__ import annotations

import ast
import sys
import tempfile
from pathlib import Path

PACKAGE = "perigeo_post"
# Folder, and the packages beside the standard library that it may know.
LAYERS = {
    "version": set(),
    "surroundings": {"matplotlib"},
    "read": {"numpy", "h5py", "xarray"},
    "measure": {"numpy", "matplotlib.tri"},
    "draw": {"numpy", "matplotlib", "PIL"},
    "study": {"numpy", "matplotlib", "pydantic", "pydantic_core", "simpleeval", "tomli"},
    "report": {"PIL", "jinja2", "markupsafe", "pydantic", "tomli"},
    "cli": {"numpy"},
    "__main__": set(),
    "__init__": set(),
}
ORDER = list(LAYERS)


def imported(tree: ast.Module, module: list[str]) -> list[tuple[int, str]]:
    """Line and full name of everything that a module (its name in parts) imports."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            start = module[: len(module) - node.level] if node.level else []
            base = ".".join([*start, *([node.module] if node.module else [])])
            found += [(node.lineno, f"{base}.{alias.name}") for alias in node.names]
    return found


def check(root: Path) -> list[str]:
    """Everything that is against the layers, with its place."""
    paths = {path.relative_to(root).with_suffix("").parts: path for path in root.rglob("*.py*")
             if path.suffix in (".py", ".pyi")}  # fmt: skip
    problems: list[str] = []
    edges: dict[str, set[str]] = {}
    for parts, path in sorted(paths.items()):
        place = path.relative_to(root.parent)
        layer = parts[0]
        if layer not in LAYERS:
            problems.append(f"{place}: {layer} is not in the list of layers")
            continue
        name = ".".join(parts)
        edges[name] = set()
        for line, full in imported(ast.parse(path.read_text()), [PACKAGE, *parts]):
            words = full.split(".")
            if words[0] != PACKAGE:
                known = any(f"{full}.".startswith(f"{one}.") for one in LAYERS[layer])
                if words[0] not in sys.stdlib_module_names and not known:
                    problems.append(f"{place}:{line}: {layer} must not know {full}")
                continue
            used = next((words[1:k] for k in (3, 2) if tuple(words[1:k]) in paths), None)
            if used is None and (*words[1:2], "__init__") in paths:
                used = [words[1], "__init__"]
            if used is None:
                problems.append(f"{place}:{line}: imports the whole package ({full})")
            elif used[0] not in LAYERS or ORDER.index(used[0]) > ORDER.index(layer):
                problems.append(f"{place}:{line}: {layer} must not use {used[0]} ({full})")
            else:
                edges[name].add(".".join(used))
    return problems + [f"{root.name}: a cycle: {' -> '.join(c)}" for c in cycles(edges)]


def cycles(edges: dict[str, set[str]]) -> list[list[str]]:
    """A cycle of imports for each module from which one is closed."""
    found: list[list[str]] = []
    done: set[str] = set()

    def follow(name: str, way: list[str]) -> None:
        if name in way:
            found.append([*way[way.index(name) :], name])
        elif name not in done:
            for used in sorted(edges.get(name, ())):
                follow(used, [*way, name])
            done.add(name)

    for name in sorted(edges):
        follow(name, [])
    return found


def self_test() -> list[str]:
    """What the check does not find though it is there, or finds though it is not."""
    cases = {
        "": {"measure/a.py": "import numpy\nfrom ..read.b import x\nfrom . import c"},
        "must not use draw": {"read/b.py": "def f():\n    from ..draw.d import x"},
        "must not use cli": {
            "read/b.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n"
            "    from perigeo_post.cli.main import x"
        },
        "must not know matplotlib": {"read/b.py": "import matplotlib.tri"},
        "imports the whole package": {"measure/a.py": "from .. import Run"},
        "a cycle: measure.a -> measure.c": {
            "measure/a.py": "from .c import x",
            "measure/c.py": "from . import a",
        },
        "is not in the list": {"other/a.py": ""},
    }
    faults: list[str] = []
    for wanted, files in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / PACKAGE
            blank = dict.fromkeys(["read/b.py", "measure/c.py", "draw/d.py", "cli/main.py"], "")
            for name, text in {**blank, **files}.items():
                path = root / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            said = check(root)
        if (len(said) != 1 or wanted not in said[0]) if wanted else said:
            faults.append(f"self-test: wanted {wanted!r}, found {said}")
    return faults


def main() -> int:
    problems = self_test()
    if "--self-test" not in sys.argv:
        problems += check(Path(__file__).parents[1] / "postproc" / PACKAGE)
    print("\n".join(problems), end="\n" if problems else "")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
