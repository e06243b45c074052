"""Results are those that were frozen: bit by bit where the build is known, else nearly.

After a change of results that is meant: `.venv/bin/python tests/cases/freeze.py`, which prints
what has changed and by how much.
"""

import warnings

import pytest
from frozen_cases import CASES, RESTARTED, TOLERANCE, changes, differences, read, run, run_in_two


@pytest.mark.parametrize("case", CASES)
def test_results_are_those_that_were_frozen(program, tmp_path, case):
    frozen = read(case)
    results = [run(program, case, tmp_path / str(threads), threads) for threads in (1, 3)]
    if case in RESTARTED:
        results.append(run_in_two(program, case, tmp_path / "restart"))
    build, sums, numbers = results[0]
    for other in results[1:]:
        assert other[1] == sums, "3 threads or a restart change the results"
    if build in frozen["checksums"]:
        found = changes(sums, frozen["checksums"][build], numbers, frozen["numbers"])
        assert not found, f"{case}, {len(found)} quantities:\n" + "\n".join(found)
    else:
        warnings.warn(f"no checksums for this build, numbers only: {build}", stacklevel=1)
    far = {k: v for k, v in differences(numbers, frozen["numbers"]).items() if v > TOLERANCE}
    assert not far, f"{case}: relative differences {far}"


@pytest.mark.parametrize("case", CASES)
def test_every_case_is_frozen(case):
    frozen = read(case)
    assert frozen["checksums"]
    assert len(frozen["numbers"]) > 20
    yielded = max(frozen["numbers"]["max_plastic_strain"])
    assert yielded > 1e-4 or case == "elastic"
