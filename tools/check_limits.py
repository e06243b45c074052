"""Check the lengths of procedures and files, and that all limits are the ones that are written.

    python3 tools/check_limits.py               print what is longer than CONTRIBUTING.md allows
    python3 tools/check_limits.py --self-test   does it find every fault it is there to find?

CONTRIBUTING.md states the limits in one sentence, and they are read from there. Lines of a
procedure count from its first statement to its end, without the procedures it contains. Suites
(.pf) may be longer than other files, for there is one for each module. The number of arguments is
checked by fortitude, in whose settings it must be the same number; their exceptions stand there.
"""

from __future__ import annotations

import ast
import re
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

SENTENCE = re.compile(
    r"procedure\s+has\s+at\s+most\s+(\d+)\s+lines\s+and\s+(\d+)\s+arguments,"
    r"\s+a\s+file\s+at\s+most\s+(\d+)\s+lines"
)
SETTINGS = "fortitude.toml"

# What may be longer, and why: a file, or a procedure as FILE:NAME. An entry that is not needed is
# an error.
EXCEPTIONS = {
    "tests/support/funit.f90": "stands for pFUnit's module funit, which a suite uses whole",
    **dict.fromkeys(
        (
            "postproc/tests/test_report.py",
            "tests/cases/test_study.py",
            "tests/verify/verify.py",
        ),
        "older than the limits",
    ),
}

FORTRAN_BEGIN = re.compile(
    r"^\s*(?:(?:pure|elemental|impure|recursive|module|logical|integer|real|character|complex|type)"
    r"(?:\s*\([^!]*?\))?\s+)*(?:subroutine|function|program)\s+(\w+)",
    re.IGNORECASE,
)
FORTRAN_END = re.compile(r"^\s*end\s*(?:subroutine|function|program)\b", re.IGNORECASE)
SUFFIXES = (".f90", ".pf", ".py")
FOLDERS = ("src", "mpi", "tests", "tools", "postproc")


def fortran_procedures(lines: list[str]) -> list[tuple[str, int, int]]:
    """Return name, first line and length of every procedure; contained ones count by themselves."""
    found, open_ones = [], []
    for number, line in enumerate(lines, start=1):
        if FORTRAN_END.match(line):
            name, first, inner = open_ones.pop()
            length = number - first + 1
            found.append((name, first, length - inner))
            if open_ones:
                open_ones[-1][2] += length
        elif begin := FORTRAN_BEGIN.match(line):
            open_ones.append([begin.group(1).lower(), number, 0])
    return found


def python_procedures(text: str) -> list[tuple[str, int, int]]:
    """Return the same of Python, where a class is not a procedure but holds some."""

    def contained(node: ast.AST) -> int:
        """Lines of the outermost functions below a node."""
        return sum(
            length(child) if is_function(child) else contained(child)
            for child in ast.iter_child_nodes(node)
        )

    def is_function(node: ast.AST) -> bool:
        return isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))

    def length(node: ast.AST) -> int:
        return node.end_lineno - node.lineno + 1

    return [
        (node.name, node.lineno, length(node) - contained(node))
        for node in ast.walk(ast.parse(text))
        if is_function(node)
    ]


def sources(root: Path) -> list[Path]:
    """All sources of our own below a folder, sorted."""
    found = (path for folder in FOLDERS for path in (root / folder).rglob("*"))
    return sorted(path for path in found if path.suffix in SUFFIXES)


def check(root: Path, exceptions: dict[str, str]) -> list[str]:
    """Return a line for everything that breaks a limit."""
    sentence = SENTENCE.search((root / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    if not sentence:
        return ["CONTRIBUTING.md: the sentence with the limits is missing"]
    most_lines, most_arguments, most_in_file = map(int, sentence.groups())
    problems, unused = [], dict(exceptions)

    def complain(key: str, line: int, text: str) -> None:
        if unused.pop(key, None) is None and key not in exceptions:
            problems.append(f"{key.split(':')[0]}:{line}: {text}")

    settings = (root / SETTINGS).read_text(encoding="utf-8")
    if re.findall(r"^max-args = (\d+)", settings, re.M) != [str(most_arguments)]:
        problems.append(f"{SETTINGS}: max-args is not {most_arguments}, as CONTRIBUTING.md says")
    for path in sources(root):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        key = str(path.relative_to(root))
        if len(lines) > most_in_file and path.suffix != ".pf":
            complain(key, 1, f"{len(lines)} lines; a file has at most {most_in_file}")
        python = path.suffix == ".py"
        procedures = python_procedures(text) if python else fortran_procedures(lines)
        for name, first, length in procedures:
            if length > most_lines:
                what = f"{name} has {length} lines; a procedure has at most {most_lines}"
                complain(f"{key}:{name}", first, what)
    problems += [
        f"tools/check_limits.py: {key} keeps the limit: take it out of EXCEPTIONS" for key in unused
    ]
    return problems


# ------------------------------------------------------------------------------ self-test

RULE = "A procedure has at most 6 lines and 3\narguments, a file at most 20 lines.\n"
SOUND = """\
module pd_a
contains
  pure integer function long_name(n)
    integer, intent(in) :: n
    long_name = inner(n)
  contains
    pure integer function inner(n)
      integer, intent(in) :: n
      inner = n
    end function inner
  end function long_name
end module pd_a
"""


def plant(root: Path, **changed: str) -> None:
    """Write sound sources below a folder, but for the texts that are given."""
    texts = {
        "CONTRIBUTING.md": RULE,
        SETTINGS: "max-args = 3\n",
        "src/base/pd_a.f90": SOUND,
        "tools/b.py": "class C:\n    def f(self):\n" + "        print()\n" * 5,
    } | changed
    for name, text in texts.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)


def self_test() -> list[str]:
    """Plant every fault; return what is not found, or found without reason."""
    line = "    integer, intent(in) :: n\n"
    long_file = SOUND + "! the end\n" * 9
    long_procedure = SOUND.replace(line, line + "    !\n" * 3, 1)
    a, b, suite = "src/base/pd_a.f90", "tools/b.py", "tests/unit/base/test_pd_a.pf"
    long_python = "def f():\n    def g():\n        pass\n" + "    print()\n" * 6
    faults: list[tuple[str, dict[str, str], dict[str, str], str]] = [
        ("sound sources", {}, {}, ""),
        ("a long file", {a: long_file}, {}, f"{a}:1: 21 lines"),
        ("a long file with a reason", {a: long_file}, {a: "why"}, ""),
        ("an exception without need", {}, {a: "why"}, f"{a} keeps the limit"),
        ("a long suite", {suite: long_file}, {}, ""),
        ("a long procedure", {a: long_procedure}, {}, f"{a}:3: long_name has 8 lines"),
        ("a long procedure in a suite", {suite: long_procedure}, {}, f"{suite}:3: long_name"),
        ("a long function", {b: long_python}, {}, f"{b}:1: f has 7 lines"),
        ("a long function with a reason", {b: long_python}, {f"{b}:f": "why"}, ""),
        ("another limit in the settings", {SETTINGS: "max-args = 4\n"}, {}, "max-args is not 3"),
        ("no limit in the settings", {SETTINGS: "# none\n"}, {}, "max-args is not 3"),
        ("no limits in the text", {"CONTRIBUTING.md": "Be short.\n"}, {}, "is missing"),
    ]
    missed = []
    for what, changed, exceptions, wanted in faults:
        with tempfile.TemporaryDirectory() as folder:
            plant(Path(folder), **changed)
            problems = check(Path(folder), exceptions)
        if not (len(problems) == 1 and wanted in problems[0] if wanted else not problems):
            missed.append(f"the check of limits is broken: {what}: it says {problems}")
    return missed


def main() -> int:
    problems = self_test() if sys.argv[1:] == ["--self-test"] else check(ROOT, EXCEPTIONS)
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
