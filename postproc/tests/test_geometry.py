"""The file of points that the program writes before a run, and the figure of it."""

import numpy as np
import pytest

from perigeo_post.draw.geometry import THINGS, geometry_figure
from perigeo_post.draw.style import save_figure
from perigeo_post.read.errors import ResultError, SchemaError
from perigeo_post.read.points_file import BODY, NUMBERS, read_points_file

TEXT = """\
# perigeo points 1: lengths in m, forces in N/m
point 0.0 0.0 0.01 clay -
point 0.1 0.0 0.005 sand -
point 0.0 -0.1 0.01 clay base
load crest 0.0 0.0 0.0 -5.0
load crest 0.1 0.0 0.0 -2.5
patch imperfection 0.05 0.0 0.02
probe middle 0.05 0.0
cut 1 0.05 -0.05 0.05 0.02
comet halley 1.0
"""


@pytest.fixture
def points(tmp_path):
    """Return a function that writes a file of points."""

    def write(text):
        path = tmp_path / "points.txt"
        path.write_text(text)
        return path

    return write


def test_points_and_what_acts_on_them_are_read(points):
    model = read_points_file(points(TEXT))
    assert model.materials == ["clay", "sand", "clay"]
    assert model.boundaries == [BODY, BODY, "base"]
    assert model.positions[1] == pytest.approx([0.1, 0.0])
    assert model.spacing == pytest.approx(0.1)
    assert model.things["load"]["crest"].sum(axis=0)[2:] == pytest.approx([0.0, -7.5])
    assert model.things["patch"]["imperfection"].shape == (1, 3)
    assert set(model.things) == {"load", "patch", "probe", "cut"}, (
        "kinds that are not known are passed over"
    )


def test_every_kind_that_is_read_is_drawn():
    assert set(THINGS) == set(NUMBERS)


def test_the_figure_names_materials_boundaries_and_loads(points, tmp_path):
    model = read_points_file(points(TEXT))
    figure = geometry_figure(model, "a body")
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert words == {"clay, 1 points", "sand, 1 points", "boundary base, 1 points",
                     "load crest, 0.0075 kN/m", "imperfection", "probe middle",
                     "cut 1"}  # fmt: skip
    axes = figure.axes[0]
    assert axes.get_aspect() == 1.0
    low, high = axes.get_xlim()
    assert low < np.min(model.positions[:, 0])
    assert high > np.max(model.positions[:, 0])
    assert save_figure(figure, tmp_path / "body.png").stat().st_size > 5000


def test_the_labels_of_the_axes_are_not_cut(points):
    tall = "".join(f"point 0.0 {y} 0.0025 clay -\n" for y in np.arange(0.0, 2.13, 0.05))
    wide = "".join(f"point {x} 0.0 0.0025 clay base\n" for x in np.arange(0.05, 2.13, 0.05))
    figure = geometry_figure(read_points_file(points(TEXT.splitlines()[0] + "\n" + tall + wide)))
    figure.draw_without_rendering()
    assert figure.axes[0].yaxis.label.get_window_extent().x0 > 0.0


@pytest.mark.parametrize(
    ("text", "error", "part"),
    [
        ("point 0 0\n", SchemaError, "its first line is not"),
        (TEXT.replace("0.005 sand -", "0.005"), ResultError, "line 3"),
        (TEXT.replace("-5.0", "five"), ResultError, "line 5"),
        (TEXT.splitlines()[0] + "\n", ResultError, "holds no points"),
    ],
)
def test_a_file_that_is_wrong_is_named(points, text, error, part):
    with pytest.raises(error, match=part):
        read_points_file(points(text))
