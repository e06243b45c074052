"""Limit loads from made-up histories whose answers are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Callable

import h5py
import numpy as np
import pytest
import synthetic

from perigeo_post import RequestError, Run
from perigeo_post.cli.command_line import main
from perigeo_post.measure.limit_load import limit_load, limit_loads
from perigeo_post.study.measures import MEASURES
from perigeo_post.study.types import Missing, State

TIME = np.linspace(0.0, 10.0, 101)
DOWN = {"velocity": "0.0, -0.01", "times": "none", "velocities_y": "none"}
Make = Callable[..., Run]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """A function make(force, values): a run whose top moves so, with this force along y."""

    def write(
        force: np.ndarray, values: dict[str, str], time: np.ndarray = TIME, more: str = ""
    ) -> Run:
        points, boundary = synthetic.lattice(0.2)
        fields = synthetic.fields_of(points, 0.0 * points[:, 0], 0.01)
        path = synthetic.write_result(tmp_path / "made.h5", points, boundary, [(0.01, fields)])
        with h5py.File(path, "a") as file:
            lines = [*file["input/values"][()]]
            lines += [f"boundary(top).{key} = {value}".encode() for key, value in values.items()]
            lines += [b"boundary(bottom).velocity = 0.0, 0.0", more.encode()]
            del file["input/values"]
            file["input/values"] = np.array(lines)
        columns = {
            "step": np.arange(len(time)), "time": time, "strain": 0.005 * time,
            "bottom_force_x": 0.0 * time, "bottom_force_y": -force, "top_force_x": 0.0 * time,
            "top_force_y": force, "energy_error": 0.0 * time,
        }  # fmt: skip
        synthetic.write_columns(tmp_path / "made_history.csv", columns)
        return Run(path)

    return write


def test_a_force_that_settles_is_a_limit_load(make: Make) -> None:
    force = -5.0e4 * (1.0 - np.exp(-TIME))
    (found,) = limit_loads(make(force, DOWN))
    assert (found.boundary, found.reached, found.missing) == ("top", True, "")
    assert found.way == pytest.approx(0.1)
    assert found.load == pytest.approx(-force[80:].mean())
    assert found.change == pytest.approx((np.exp(-8.0) - np.exp(-10.0)) * 5.0e4 / found.load)
    assert found.peak == found.end == pytest.approx(-force[-1])
    assert (found.time_at_peak, found.strain_at_peak) == (10.0, pytest.approx(0.05))


def test_a_force_that_grows_is_none(make: Make) -> None:
    found = limit_load(make(-1.0e4 * TIME, DOWN))
    assert not found.reached
    assert found.change == pytest.approx(0.2 / 0.9)


@pytest.mark.parametrize(("change", "reached"), [(0.009, True), (0.011, False)])
def test_the_bound_is_one_percent_of_the_last_fifth(
    make: Make, change: float, reached: bool
) -> None:
    force = -1.0e4 * (1.0 + change * (np.clip(TIME, 8.0, 10.0) - 9.0) / 2.0)
    force[TIME < 7.95] *= 0.5
    found = limit_load(make(force, DOWN))
    assert found.change == pytest.approx(change, rel=1e-6)
    assert found.reached is reached


def test_the_way_counts_and_not_the_time(make: Make) -> None:
    table = {"velocity": "0.0, 0.0", "times": "0.0, 2.0, 2.001", "velocities_y": "-0.02, -0.02, 0"}
    found = limit_load(make(-1.0e4 * np.minimum(TIME, 2.0), table))
    assert found.way == pytest.approx(0.04 + 0.00001)
    assert not found.reached  # it is constant for 8 s, but it grew while the boundary moved
    assert found.change == pytest.approx(0.3 / 1.88)


def test_after_a_turn_the_force_is_that_along_the_way_back(make: Make) -> None:
    table = {"times": "0.0, 7.0, 7.0001", "velocities_y": "-0.01, -0.01, 0.01"}
    force = np.where(TIME < 7.05, -3.0e4, 2.0e4)
    found = limit_load(make(force, table))
    assert found.load == pytest.approx(2.0e4)
    assert found.peak == pytest.approx(-3.0e4)
    assert found.reached


@pytest.mark.parametrize(
    "values",
    [
        {"velocity": "0.0, 0.0"},
        {"velocity": "0.0, -0.01", "traction": "0.0, -1.0e5"},
        {},
    ],
)
def test_without_a_prescribed_motion_there_is_none(make: Make, values: dict[str, str]) -> None:
    run = make(-1.0e4 * TIME, values)
    assert limit_loads(run) == []
    with pytest.raises(RequestError, match="no boundary with a motion"):
        limit_load(run)


def test_too_few_rows_tell_nothing(make: Make) -> None:
    time = np.linspace(0.0, 10.0, 11)
    found = limit_load(make(0.0 * time - 1.0e4, DOWN, time))
    assert not found.reached
    assert "fewer than 4 rows" in found.missing
    found = limit_load(make(0.0 * TIME, DOWN))
    assert found.missing == "it has no force along its motion"


def test_info_tells_limit_loads(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    run = make(-5.0e4 * (1.0 - np.exp(-TIME)), DOWN)
    assert main(["info", str(run.path)]) == 0
    text = capsys.readouterr().out
    assert "limit load   top: 49.993 kN/m; it changes by 0.03% over the last fifth of 0.1 m" in text
    assert "largest force is 49.998 kN/m at 10 s, a strain of 0.050000" in text
    assert main(["info", str(run.path), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["history"]["limit_loads"]
    assert (found["boundary"], found["reached"]) == ("top", True)
    assert main(["info", str(make(-1.0e4 * TIME, DOWN).path)]) == 0
    assert "top: no limit load yet: the force changes by 22.22%" in capsys.readouterr().out


def test_a_study_measures_loads(make: Make) -> None:
    run = make(-5.0e4 * (1.0 - np.exp(-TIME)), DOWN)
    found = MEASURES["load"].take(run, State())
    assert found["limit_load_reached"] is True
    assert found["limit_load"] == limit_load(run).load
    assert found["load_end"] == pytest.approx(5.0e4, rel=1e-3)


def test_evaluations_are_steps_or_what_the_log_tells(make: Make) -> None:
    def count(run: Run) -> object:
        return MEASURES["cost"].take(run, State())["force_evaluations"]

    assert count(make(-1.0e4 * TIME, DOWN)) == 100
    run = make(-1.0e4 * TIME, DOWN, more="integration.method = equilibrium")
    assert isinstance(count(run), Missing)  # there is no log
    line = "time loop      0.100 s, steps {}, evaluations of the forces 4321\n"
    run.path.with_suffix(".log").write_text(line.format(100))
    assert count(run) == 4321
    run.path.with_suffix(".log").write_text(line.format(60))
    assert isinstance(count(run), Missing)  # the log is that of the rest of a run
