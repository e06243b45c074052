"""Translate a pFUnit suite (.pf) into a Fortran program for the small runner in this folder.

    python3 pf_to_f90.py test_pd_j2.pf test_pd_j2.f90

Understood: one module named like the file, ``@test`` on a line of its own before a subroutine
without arguments, and the asserts of ``ASSERTS``, each on one line. Any other ``@`` line is an
error, so that a suite cannot lose a check unnoticed. Every line keeps its number: what the
compiler reports about the translation holds for the suite.
"""

import re
import sys
from pathlib import Path

ASSERTS = (
    "assertEqual",
    "assertTrue",
    "assertFalse",
    "assertLessThan",
    "assertLessThanOrEqual",
    "assertGreaterThan",
    "assertGreaterThanOrEqual",
)
LONGEST_ASSERT = 132
ASSERT = re.compile(r"(\s*)@(\w+)\s*\((.*)\)\s*$")
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(?:\(\s*\))?\s*(?:!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(?!procedure\b)(\w+)\s*(?:!.*)?$", re.IGNORECASE)


class SuiteError(Exception):
    """A line of a suite that cannot be translated."""


def translate_assert(line, file_name, number):
    """Return the Fortran for one ``@assert...`` line."""
    names = {name.lower(): name for name in ASSERTS}
    match = ASSERT.match(line)
    if not match or match.group(2).lower() not in names:
        raise SuiteError(f"{file_name}:{number}: not understood here: {line.strip()}")
    if len(line) > LONGEST_ASSERT:
        raise SuiteError(f"{file_name}:{number}: an assert of more than {LONGEST_ASSERT} columns")
    indent, name, arguments = match.groups()
    place = f"location=SourceLocation('{file_name}', {number})"
    return f"{indent}call {names[name.lower()]}({arguments}, {place}); if (anyExceptions()) return"


def translate(lines, file_name):
    """Return the translated lines, the module's name and the names of its tests."""
    translated, tests = [], []
    module = None
    wants_subroutine = False
    for number, line in enumerate(lines, start=1):
        stripped = line.strip()
        if wants_subroutine and stripped and not stripped.startswith("!"):
            match = SUBROUTINE.match(line)
            if not match:
                raise SuiteError(
                    f"{file_name}:{number}: @test needs a subroutine without arguments below it"
                )
            tests.append(match.group(1))
            wants_subroutine = False
        elif module is None and MODULE.match(line):
            module = MODULE.match(line).group(1)
        if stripped.lower() == "@test":
            wants_subroutine = True
            translated.append("")
        elif stripped.startswith("@"):
            translated.append(translate_assert(line, file_name, number))
        else:
            translated.append(line)
    if wants_subroutine:
        raise SuiteError(f"{file_name}: @test on the last line")
    return translated, module, tests


def main_program(module, tests):
    """Return the lines of the program that runs the tests of a module in order."""
    lines = ["", f"program run_{module}", "  use funit, only: run_test, end_tests"]
    lines += [f"  use {module}, only: {name}" for name in tests]
    lines += ["  implicit none", ""]
    lines += [f"  call run_test('{name}', {name})" for name in tests]
    lines += ["  call end_tests()", f"end program run_{module}"]
    return lines


def main():
    """Translate the file named first into the file named second."""
    source, target = Path(sys.argv[1]), Path(sys.argv[2])
    try:
        lines, module, tests = translate(source.read_text().splitlines(), source.name)
        if module is None or module.lower() != source.stem.lower():
            raise SuiteError(f"{source.name}: it must hold one module of the same name")
        if not tests:
            raise SuiteError(f"{source.name}: no @test in it")
    except SuiteError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    target.write_text("\n".join(lines + main_program(module, tests)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
