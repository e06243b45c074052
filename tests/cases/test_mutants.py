"""The tool of `make mutants`: what it plants, and the lists that it reads."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "proof" / "mutants"))
import faults  # noqa: E402
import mutants  # noqa: E402

SOURCE = """\
module pd_example
  use pd_kinds, only: wp
  real(wp), parameter :: one = 1.0_wp
contains
  pure real(wp) function area(a, b)
    real(wp), intent(in) :: a, b   ! a + b
    area = a * b &   ! per metre
      + 0.5_wp * max(a, -b)
    if (a < 0.0_wp .and. .not. b >= a) call errors%add('a - b is wrong', 'x < y')
    call timing%lap(1)
    if (a > b) return
  end function area
end module pd_example
"""


def planted():
    """Return what the statements of the example become, by line."""
    found = {}
    for here in faults.faults_of("src/example.f90", SOURCE):
        for fault in here:
            found.setdefault(fault.line, []).append(fault)
    return found


def test_faults_are_those_of_operators_numbers_functions_and_statements():
    assert {line: sorted(f.new_statement for f in here) for line, here in planted().items()} == {
        7: [
            "area = a / b + 0.5_wp * max(a, -b)",
            "continue",
        ],
        8: [
            "area = a * b + 0.25_wp * max(a, -b)",
            "area = a * b + 0.5_wp * max(a, +b)",
            "area = a * b + 0.5_wp * min(a, -b)",
            "area = a * b + 0.5_wp / max(a, -b)",
            "area = a * b - 0.5_wp * max(a, -b)",
        ],
        9: [
            f"if ({condition}) call errors%add('a - b is wrong', 'x < y')"
            for condition in (
                ".not. (a < 0.0_wp .and. .not. b >= a)",
                "a < 0.0_wp .and. .not. b <= a",
                "a < 0.0_wp .and. .not. b > a",
                "a < 0.0_wp .and. b >= a",
                "a < 0.0_wp .or. .not. b >= a",
                "a < 1.0_wp .and. .not. b >= a",
                "a <= 0.0_wp .and. .not. b >= a",
                "a > 0.0_wp .and. .not. b >= a",
            )
        ],
        11: [
            "if (.not. (a > b)) return",
            "if (a < b) return",
            "if (a > b) continue",
            "if (a >= b) return",
        ],
    }


def test_a_fault_changes_its_statement_alone_and_no_number_of_a_line():
    for path, lists in mutants.all_faults("pd_j2").items():
        text = (ROOT / path).read_text()
        for fault in (fault for here in lists for fault in here):
            changed = fault.plant(text)
            assert changed != text
            assert changed.count("\n") == text.count("\n"), fault
            before, after = text.splitlines(), changed.splitlines()
            assert before[: fault.line - 1] == after[: fault.line - 1]
            assert before[fault.line + 8 :] == after[fault.line + 8 :]


def test_as_many_are_drawn_as_asked_and_more_of_long_modules():
    parts = mutants.shares({"a": 10, "b": 25, "c": 1}, 20)
    assert sum(parts.values()) == 20
    assert parts["b"] > parts["a"] > parts["c"]


@pytest.mark.parametrize("name", ["equivalent.txt", "earlier.txt"])
def test_listed_faults_can_be_read(name):
    listed = mutants.read_list(name)
    assert listed
    for (path, old, new), said in listed.items():
        assert path.startswith("src/")
        assert old != new
        assert said or name == "earlier.txt", f"no reason is given for {old}"


def test_listed_faults_can_be_planted():
    known = {f.key for lists in mutants.all_faults("").values() for here in lists for f in here}
    for name in ("equivalent.txt", "earlier.txt"):
        gone = mutants.read_list(name).keys() - known
        assert not gone, f"{name}: no longer in the sources"
