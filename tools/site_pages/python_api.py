"""What a module of perigeo-post offers, read from its source without importing it."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Member:
    """A function or class: how it is called, and what it says of itself."""

    name: str
    line: int
    statement: str
    about: str
    members: list[Member] = field(default_factory=list)


@dataclass
class PythonModule:
    name: str
    path: str
    about: str
    members: list[Member]
    source: str


def member(node: ast.FunctionDef | ast.ClassDef) -> Member:
    """Return a function, or a class with its methods."""
    if isinstance(node, ast.ClassDef):
        bases = ", ".join(ast.unparse(base) for base in node.bases)
        statement = f"class {node.name}({bases})" if bases else f"class {node.name}"
    else:
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        statement = f"def {node.name}({ast.unparse(node.args)}){returns}"
    inner = members(node.body) if isinstance(node, ast.ClassDef) else []
    return Member(node.name, node.lineno, statement, ast.get_docstring(node) or "", inner)


def members(body: list[ast.stmt]) -> list[Member]:
    """Return what of a module or class is meant for others."""
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [member(n) for n in body if isinstance(n, kinds) and not n.name.startswith("_")]


def read_package(root: Path) -> list[PythonModule]:
    """Return the modules of perigeo_post that offer something."""
    found = []
    folder = root / "postproc"
    for path in sorted((folder / "perigeo_post").rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        name = ".".join(path.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")
        about = ast.get_docstring(tree) or ""
        module = PythonModule(
            name, path.relative_to(root).as_posix(), about, members(tree.body), source
        )
        if module.members or about:
            found.append(module)
    return found
