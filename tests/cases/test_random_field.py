"""Soil that varies: one soil for every mesh, runs that go on with it, bands where it is weak."""

import re
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from case_files import (
    SPECIMEN,
    changed,
    history,
    same_points_and_frames,
    uncontrolled,
    without_group,
)

ROOT = Path(__file__).resolve().parents[2]
UNIFORM = without_group(SPECIMEN, "imperfection")
MEAN = 0.15e6


def field(variation=0.2, length=0.2, seed=1):
    """Return the group of a random field."""
    return (
        f"&random_field coefficient_of_variation = {variation}, correlation_length = {length}, "
        f"seed = {seed} /\n"
    )


def soil(path):
    """Return positions, yield stress and which points belong to the body."""
    with h5py.File(path, locking=False) as file:
        points = file["points"]
        return points["position"][()], points["yield_stress"][()], points["boundary"][()] == 0


def run(run_case, folder, text, *options):
    """Run a case that must succeed."""
    folder.mkdir(exist_ok=True)
    done = run_case(text, folder, *options)
    assert done.returncode == 0, done.stderr
    return done


def test_a_seed_gives_one_soil_for_every_mesh(run_case, tmp_path):
    short = changed(UNIFORM, final_strain="0.0001", frame_strains="0.0001") + field()
    meshes = {
        "coarse": short,
        "fine": changed(short, spacing="0.05", horizon="0.16"),
        "cells": changed(short, spacing="0.02", horizon="0.05, layout = 'cells'"),
        "list": short.replace("name = 'case'", "name = 'case', operators = 'list'"),
    }
    soils = {}
    for name, text in meshes.items():
        run(run_case, tmp_path / name, text, "--quiet")
        x, strength, _ = soil(tmp_path / name / "out" / "case.h5")
        soils[name] = {tuple(np.rint(1e6 * p).astype(int)): s for p, s in zip(x, strength)}
    for name, least in (("fine", 66), ("list", 66)):
        common = soils["coarse"].keys() & soils[name].keys()
        assert len(common) >= least
        for place in common:
            assert soils[name][place] == pytest.approx(soils["coarse"][place], rel=1e-11)
    # cells have no point in common with nodes: the mean of four of them is near the node between
    corners = [(-10000, -10000), (-10000, 10000), (10000, -10000), (10000, 10000)]
    near = 0
    for (x, y), strength in soils["coarse"].items():
        around = [soils["cells"].get((x + dx, y + dy)) for dx, dy in corners]
        if None not in around:
            near += 1
            assert np.mean(around) == pytest.approx(strength, rel=0.01)
    assert near >= 30


def test_check_and_log_say_what_the_soil_has_come_to(run_case, tmp_path):
    text = UNIFORM + field(0.5, 0.3, 7)
    text = changed(text, residual_strength="120.0e3")
    shown = run(run_case, tmp_path, text, "--check").stdout
    run(run_case, tmp_path, text, "--quiet")
    _, strength, body = soil(tmp_path / "out" / "case.h5")
    inside = strength[body]
    found = re.search(
        r"yield stress +mean (\S+) Pa, coefficient of variation (\S+), from (\S+) to (\S+) Pa",
        shown,
    )
    numbers = [float(number) for number in found.groups()]
    expected = [inside.mean(), inside.std() / inside.mean(), inside.min(), inside.max()]
    assert numbers == pytest.approx(expected, rel=1e-4)
    said = "random field        coefficient of variation 0.5, correlation length 0.3 m, seed 7"
    assert said in shown
    weak = (inside < 120.0e3).sum()
    assert weak > 0
    assert f"no softening        at {weak} points, which are weaker than residual_strength" in shown
    log = (tmp_path / "out" / "case.log").read_text()
    assert found.group() in log
    assert said in log


def test_the_soil_of_a_large_body_has_its_mean_and_variation(run_case, tmp_path):
    text = changed(UNIFORM, x_max="4.0", y_max="4.0", final_strain="0.00005")
    text = changed(text, frame_strains="0.00005") + field(0.3, 0.2, 3)
    run(run_case, tmp_path, text, "--quiet")
    x, strength, body = soil(tmp_path / "out" / "case.h5")
    z = np.log(strength[body] / MEAN) / np.sqrt(np.log(1.09)) + 0.5 * np.sqrt(np.log(1.09))
    # 400 squares of a correlation length: four standard errors sqrt(pi / 400) of mean and variance
    assert z.mean() == pytest.approx(0.0, abs=4 * np.sqrt(np.pi / 400))
    assert z.var() == pytest.approx(1.0, abs=4 * np.sqrt(np.pi / 400))
    place = {tuple(np.rint(10 * p).astype(int)): v for p, v in zip(x[body], z)}
    for lag in (1, 2, 4):
        for step in ((lag, 0), (0, lag)):
            pairs = [
                (v, place[(i + step[0], j + step[1])])
                for (i, j), v in place.items()
                if (i + step[0], j + step[1]) in place
            ]
            product = np.mean([a * b for a, b in pairs])
            expected = np.exp(-((0.1 * lag / 0.2) ** 2))
            assert product == pytest.approx(expected, abs=4 * np.sqrt(np.pi / 400))


def test_a_field_that_hardly_varies_is_no_field(run_case, tmp_path):
    run(run_case, tmp_path / "a", SPECIMEN, "--quiet")
    run(run_case, tmp_path / "b", SPECIMEN + field(1e-12), "--quiet")
    one, other = (history(tmp_path / name / "out" / "case_history.csv") for name in "ab")
    for column in ("bottom_force_y", "max_plastic_strain", "external_work"):
        assert other[column] == pytest.approx(one[column], rel=1e-6, abs=1e-9)


def test_a_flaw_multiplies_the_field(run_case, tmp_path):
    run(run_case, tmp_path / "a", UNIFORM + field(), "--quiet")
    run(run_case, tmp_path / "b", SPECIMEN + field(), "--quiet")
    x, plain, _ = soil(tmp_path / "a" / "out" / "case.h5")
    _, flawed, _ = soil(tmp_path / "b" / "out" / "case.h5")
    near = np.hypot(x[:, 0], x[:, 1] - 0.3) < 0.1101
    assert flawed / plain == pytest.approx(np.where(near, 0.999, 1.0), rel=1e-14)


def test_a_band_forms_where_the_soil_is_weak(run_case, tmp_path):
    text = without_group((ROOT / "input" / "compression_quick.nml").read_text(), "imperfection")
    done = run(run_case, tmp_path, text + field(0.2, 0.4), "--quiet", "--output", "out")
    assert done.stderr == ""
    rows = history(tmp_path / "out" / "compression_quick_history.csv")
    # fully plastic at the mean yield stress: 2 / sqrt(3) of it; a band finds the weaker way
    peak = rows["bottom_force_y"].max()
    assert 0.5 * MEAN < peak < 2 / np.sqrt(3) * MEAN
    assert rows["bottom_force_y"][-1] < 0.5 * peak
    _, strength, body = soil(tmp_path / "out" / "compression_quick.h5")
    with h5py.File(tmp_path / "out" / "compression_quick.h5", locking=False) as file:
        alpha = file["frames/000005/plastic_strain"][()][body]
    band = alpha > 0.25 * alpha.max()
    assert alpha.max() > 0.08
    assert band.mean() < 0.25
    assert strength[body][band].mean() < strength[body].mean()


def test_the_scales_of_a_field_are_looked_at(run_case, tmp_path):
    done = run_case(UNIFORM + field(0.2, 0.19), tmp_path, "--check")
    assert done.returncode == 0, done.stderr
    assert "warning: &random_field correlation_length: less than 2 spacings" in done.stdout
    done = run_case(UNIFORM + field(0.2, 1e-9), tmp_path, "--check")
    assert done.returncode == 3
    assert "the coordinates are more than 1e8 correlation lengths" in done.stderr


def test_an_elastic_body_has_no_yield_stress(run_case, tmp_path):
    run(run_case, tmp_path, changed(UNIFORM, model="'elastic'"), "--quiet")
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert "yield_stress" not in file["points"]
    assert "yield_stress" not in (tmp_path / "out" / "case.xdmf").read_text()


def test_a_run_goes_on_with_the_same_soil_and_with_no_other(program, run_case, tmp_path):
    text = changed(UNIFORM, spacing="0.05", horizon="0.16", final_strain="0.04") + field()
    run(run_case, tmp_path / "straight", text, "--quiet")
    folder = tmp_path / "stopped"
    folder.mkdir()
    (folder / "run.nml").write_text(uncontrolled(text))
    process = subprocess.Popen([program, "--quiet", "run.nml"], cwd=folder)
    rows = folder / "out" / "case_history.csv"
    while process.poll() is None and not (rows.exists() and rows.read_bytes().count(b"\n") > 20):
        time.sleep(0.001)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=300) == 143
    done = run_case(text.replace("seed = 1", "seed = 2"), folder, "--restart")
    assert done.returncode == 2
    assert "random_field.seed: differs from the run that is to go on; found: 2; allowed: 1" in (
        done.stderr
    )
    run(run_case, folder, text, "--restart", "--quiet")
    assert rows.read_bytes() == (tmp_path / "straight/out/case_history.csv").read_bytes()
    with (
        h5py.File(folder / "out" / "case.h5", locking=False) as one,
        h5py.File(tmp_path / "straight" / "out" / "case.h5", locking=False) as other,
    ):
        same_points_and_frames(one, other)
