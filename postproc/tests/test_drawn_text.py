"""No text of a figure leaves the canvas or lies on another, for bodies of any shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic
from drawn_text import faults
from matplotlib.figure import Figure
from PIL import Image

import perigeo_post
from perigeo_post import (
    Run,
    animate,
    band_figure,
    column_figure,
    compare_figure,
    contour_figure,
    curve_figure,
    energy_figure,
    measure_band,
    profile_figure,
    save_figure,
    stress_strain,
    stress_strain_figure,
)
from perigeo_post.draw import animation
from perigeo_post.draw.geometry import geometry_figure
from perigeo_post.draw.style import new_figure, prefix_for, style
from perigeo_post.draw.text import fit_numbers
from perigeo_post.read.labels import labels_of
from perigeo_post.read.points_file import ModelPoints
from perigeo_post.study.figures import FIGURES
from perigeo_post.study.types import Column, State, StudyRun

STRAINS = (0.0, 0.005, 0.01, 0.016)
AT = State(0.01)
Draw = Callable[[], Figure]


def body(folder: Path, width: float, height: float) -> Run:
    """Two crossing bands in a body of this size [m], with a history."""
    step = min(width, height) / 10
    points, boundary = synthetic.lattice(step, width, height)
    middle = (0.5 * width, 0.45 * height)
    alpha = synthetic.gaussian_band(points, middle, 45.0, True, 1.2 * step, 0.2)
    alpha += synthetic.gaussian_band(points, middle, 45.0, False, 1.2 * step, 0.1)
    states = [
        (e, synthetic.fields_of(points, 60 * e * alpha, e)) for e in (0.0, 0.005, 0.01, 0.016)
    ]
    path = synthetic.write_result(
        folder / "body.h5", points, boundary, states, step, 3 * step,
        extents=((0.0, 0.0), (width, height)),
    )  # fmt: skip
    synthetic.write_history(folder / "body_history.csv")
    return Run(path)


def study_runs(run: Run) -> list[StudyRun]:
    labels = ["a rather long label", "m = 2", "m = 3", "m = 4", "m = 5"]
    return [
        StudyRun(f"s_{k}", label, "ab"[k % 2], {"p": 1e5 * k}, {"width": 0.01 * k}, run, AT)
        for k, label in enumerate(labels)
    ]


def model_of(run: Run) -> ModelPoints:
    points = run.positions
    top = points[:, 1] > points[:, 1].max() - 0.5 * run.spacing
    load = np.column_stack([points[top], np.tile([0.0, -1e3], (top.sum(), 1))])
    names = np.array(["-", "bottom", "the_top_of_the_body"])
    (left, low), (right, high) = points.min(axis=0), points.max(axis=0)
    things = {
        "load": {"pressure on the top": load},
        "patch": {"imperfection": np.array([[left, 0.5 * (low + high), 2.0 * run.spacing]])},
        "probe": {"in_the_middle_of_the_body": np.array([[0.5 * (left + right), low]])},
        "cut": {"1": np.array([[left, low, 0.5 * (left + right), 0.5 * (low + high)]])},
    }
    return ModelPoints(
        points, run.volumes, ["a_material_with_a_long_name"] * len(points),
        names[run.boundary].tolist(), things,
    )  # fmt: skip


def of_bodies(run: Run) -> Iterator[tuple[str, Draw]]:
    frames = run.frames()
    long = [f"a label of many words {k}\nε = 1.6 %" for k in range(4)]
    yield "one", lambda: contour_figure(frames[-1:])
    yield "deformed", lambda: contour_figure(frames[-2:], "stress_xy", deformed=10.0)
    yield "four", lambda: contour_figure(frames, titles=long)
    yield "band", lambda: band_figure(run, measure_band(run))
    yield "compare", lambda: compare_figure([run] * 3, labels=["coarse", "fine", "of many words"])
    yield "geometry", lambda: geometry_figure(model_of(run), "a body")
    runs = study_runs(run)[:3]
    yield "rows", lambda: FIGURES["contours"](runs, {"strain": [0.005, 0.01]}, {}).figure


@pytest.mark.parametrize(("width", "height"), [(10.0, 1.0), (0.0014, 0.001), (1.0, 10.0)])
def test_text_has_room_beside_every_body(width: float, height: float, tmp_path: Path) -> None:
    run = body(tmp_path, width, height)
    said = {name: faults(draw()) for name, draw in of_bodies(run)}
    assert not {name: words for name, words in said.items() if words}


@pytest.mark.parametrize(("width", "height"), [(10.0, 1.0), (0.0014, 0.001), (1.0, 10.0)])
def test_text_has_room_in_every_picture_of_a_film(
    width: float, height: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[list[str]] = []
    rendered = animation._rendered

    def look(figure: Figure) -> Image.Image:
        said.append(faults(figure))
        return rendered(figure)

    monkeypatch.setattr(animation, "_rendered", look)
    animate(body(tmp_path, width, height).frames(), tmp_path / "film.gif", "stress_xy", 10.0)
    assert said == [[]] * 4


def test_every_figure_has_its_text_looked_at() -> None:
    """Functions that give a figure: all of them are drawn in this file."""
    source = Path(__file__).read_text(encoding="utf-8")
    makers = [name for name in perigeo_post.__all__ if name.endswith("_figure")]
    assert len(makers) > 7
    assert not [name for name in makers if f"{name}(" not in source]


def test_text_has_room_in_every_figure_of_curves(result: Path) -> None:
    run = Run(result)
    runs = study_runs(run)
    columns = {"width": Column("m", "width")}
    found = measure_band(run)
    figures: dict[str, Draw] = {
        "marks": lambda: stress_strain_figure([run], marks=[0.01, 0.013, 0.016]),
        "many": lambda: stress_strain_figure(
            [run] * 12, [f"a label of words {k}" for k in range(12)]
        ),
        "energies": lambda: energy_figure(run),
        "profiles": lambda: profile_figure([found] * 3, ["a rather long label", "b", "c"]),
    }
    settled = [
        replace(stress_strain(run, label=f"a label of words {k}"), y_name="a_footing_settlement",
                x_name="a_footing_load", y_unit="m", x_unit="N/m", downwards=True)
        for k in range(5)
    ]  # fmt: skip
    figures["settlement"] = lambda: curve_figure(settled[:1])
    figures["settlements"] = lambda: curve_figure(settled)
    figures["column"] = lambda: column_figure([run, run], "max_plastic_strain", "time")
    options = {"plot": {"x": "p", "y": "width"}, "curves": {"by": "p"}, "profiles": {},
               "quality": {}, "history": {"y": "max_plastic_strain"}}  # fmt: skip
    assert {*options, "contours"} == set(FIGURES)  # contours: beside every body
    for kind, chosen in options.items():
        figures[f"study {kind}"] = lambda k=kind, o=chosen: FIGURES[k](runs, o, columns).figure
    said = {name: faults(draw()) for name, draw in figures.items()}
    assert not {name: words for name, words in said.items() if words}


def test_a_fault_is_seen() -> None:
    """Text beyond the canvas, on other text, and on other axes."""
    with style():
        figure = new_figure(60.0, 60.0, layout=None)
        one = figure.add_axes((0.2, 0.2, 0.3, 0.6))
        figure.add_axes((0.6, 0.2, 0.3, 0.6), yticks=[]).set_ylabel("over there", labelpad=15.0)
        one.set_xticks([0.5, 0.55], ["a number", "another"])
        one.set_xlabel("words that are far too long for this small figure and its canvas")
    said = "\n".join(faults(figure))
    assert "'a number' lies on 'another'" in said
    assert "leaves the canvas" in said
    assert "'over there' lies on the axes" in said


def test_numbers_on_an_axis_of_curves_make_room() -> None:
    with style():
        figure = new_figure(60.0, 50.0)
        ax = figure.subplots()
        ax.plot([1e5, 9e5], [0.0, 1.0])
        ax.locator_params(axis="x", nbins=20)
        assert faults(figure)
        fit_numbers(ax)
    assert not faults(figure)


def test_frames_of_a_cyclic_test_tell_their_time(tmp_path: Path) -> None:
    points, boundary = synthetic.lattice(0.2)
    fields = synthetic.fields_of(points, 0.0 * points[:, 0], 0.0)
    strains = [0.0, 0.01, 0.0, 0.01]
    path = synthetic.write_result(
        tmp_path / "cycles.h5", points, boundary, [(s, fields) for s in strains], 0.2
    )
    with synthetic.h5py.File(path, "a") as file:
        for k in range(4):
            file[f"frames/{k:06d}"].attrs["time"] = 2.0 * k
    frames = Run(path).frames()
    labels = [f"ε = {100 * s:g} %, t = {2 * k} s" for k, s in enumerate(strains)]
    assert labels_of(frames) == labels
    assert labels_of(frames[1:2]) == ["ε = 1 %"]
    assert frames[2].label == "t = 4 s"
    assert [ax.get_title().replace("\n", " ") for ax in contour_figure(frames).axes[:4]] == labels


def test_units_cannot_be_misread() -> None:
    assert prefix_for(0.4, "Pa") == (1.0, "Pa")  # mPa would be taken for MPa
    assert prefix_for(4e6, "Pa") == (1e-6, "MPa")
    assert prefix_for(2e-3, "m/s") == (1e3, "mm/s")


@pytest.mark.parametrize(("ending", "start"), [("svg", b"<?xml"), ("eps", b"%!PS-Adobe")])
def test_figures_of_lines_are_written_for_print(
    ending: str, start: bytes, result: Path, tmp_path: Path
) -> None:
    path = save_figure(contour_figure(Run(result).frames()[-1:]), tmp_path / f"a.{ending}")
    assert path.read_bytes().startswith(start)
