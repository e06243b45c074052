"""The figures of studies: what they draw, the numbers they give, options that are wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import synthetic
from conftest import x_bands
from test_figures import assert_drawn

from perigeo_post import RequestError, Run, save_figure
from perigeo_post.draw.layout import shared
from perigeo_post.draw.legends import legend
from perigeo_post.draw.style import new_figure, style
from perigeo_post.study.contours import contours
from perigeo_post.study.curves import curves, history, quality
from perigeo_post.study.drawing import legend_place
from perigeo_post.study.figures import FIGURE_OPTIONS, FIGURES
from perigeo_post.study.measures import MEASURES
from perigeo_post.study.plots import plot
from perigeo_post.study.profiles import profiles
from perigeo_post.study.types import Column, State, StudyRun

AT = State(0.01)
COLUMNS = {
    "width": Column("m", "width"),
    "width_uncertainty": Column("m", "half a spacing"),
    "modulus": Column("Pa", "modulus"),
    "other": Column("Pa", "another modulus"),
}


def study_run(path: Path, label: str, series: str, state: State = AT, **more: Any) -> StudyRun:
    row = {k: v for k, v in more.items() if k in COLUMNS}
    parameters = {k: v for k, v in more.items() if k not in COLUMNS}
    return StudyRun(f"{series}_{label}", label, series, parameters, row, Run(path), state)


@pytest.fixture
def runs(result: Path, cut_off: Path) -> list[StudyRun]:
    """Two runs with results, the second cut off at 0.8 %, which has no frame at 1 %."""
    return [
        study_run(result, "m = 1", "a", m=1, case="rough", width=0.2, width_uncertainty=0.04,
                  modulus=51e6, other=50.5e6),
        study_run(cut_off, "m = 2", "b", State(0.008), m=2, case="smooth", width=0.1,
                  width_uncertainty=0.02, modulus=50e6, other=50.2e6),
    ]  # fmt: skip


OPTIONS: dict[str, Mapping[str, Any]] = {
    "plot": {"x": "m", "y": "width"},
    "curves": {"marks": [0.005]},
    "contours": {},
    "profiles": {},
    "history": {"y": "max_plastic_strain"},
    "quality": {},
}


@pytest.mark.parametrize("kind", sorted(FIGURES))
def test_every_kind_is_drawn_in_the_width_of_a_column(
    kind: str, runs: list[StudyRun], tmp_path: Path
) -> None:
    drawing = FIGURES[kind](runs, OPTIONS[kind], COLUMNS)
    assert_drawn(save_figure(drawing.figure, tmp_path / f"{kind}.png"))
    assert drawing.figure.get_size_inches()[0] * 25.4 <= 180.01
    assert drawing.rows
    assert len({tuple(row) for row in drawing.rows}) == 1  # all rows have the same keys


def test_every_kind_has_its_options() -> None:
    assert set(FIGURES) == set(FIGURE_OPTIONS) == set(OPTIONS)
    for kind, options in OPTIONS.items():
        assert set(options) <= FIGURE_OPTIONS[kind]


def test_a_plot_has_bars_units_and_a_line_for_each_series(runs: list[StudyRun]) -> None:
    options = {"x": "m", "y": "modulus", "scale": "MPa", "target": 50e6, "target_label": "E"}
    drawing = plot(runs, options, COLUMNS)
    ax = drawing.figure.axes[0]
    assert ax.get_xlabel() == "m = δ/Δx [–]"
    assert ax.get_ylabel() == "Modulus [MPa]"
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["a", "b", "E"]
    assert [row["value"] for row in drawing.rows] == [51e6, 50e6]
    bars = plot(runs, {"x": "m", "y": "width"}, COLUMNS)
    assert [row["uncertainty"] for row in bars.rows] == [0.04, 0.02]
    low, high = bars.figure.axes[0].containers[0][2][0].get_segments()[0][:, 1]
    assert (low, high) == pytest.approx((0.16, 0.24))
    for run in runs:
        run.row["width_spread"] = run.row.pop("width_uncertainty")
    spread = plot(runs, {"x": "m", "y": "width"}, COLUMNS)
    assert [row["uncertainty"] for row in spread.rows] == [0.04, 0.02]


def test_several_columns_have_colours_and_series_have_dashes(runs: list[StudyRun]) -> None:
    ax = plot(runs, {"x": "m", "y": ["modulus", "other"]}, COLUMNS).figure.axes[0]
    lines = {str(c.get_label()): c[0] for c in ax.containers}
    assert list(lines) == ["Modulus, a", "Other, a", "Modulus, b", "Other, b"]
    assert lines["Modulus, a"].get_color() == lines["Modulus, b"].get_color()
    assert lines["Modulus, a"].get_marker() != lines["Modulus, b"].get_marker()


def test_a_legend_has_the_titles_of_series_not_their_names(runs: list[StudyRun]) -> None:
    titled = [dataclasses.replace(run, series_title=f"series {run.series}") for run in runs]
    for drawing in (
        plot(titled, {"x": "m", "y": "width"}, COLUMNS),
        curves(titled, {"by": "series"}, COLUMNS),
    ):
        legend_of = drawing.figure.axes[0].get_legend()
        assert [t.get_text() for t in legend_of.get_texts()] == ["series a", "series b"]
        assert {row["series"] for row in drawing.rows} == {"a", "b"}
    # Two with one title would be one.
    same = [dataclasses.replace(run, series_title="both") for run in runs]
    ax = plot(same, {"x": "m", "y": "width"}, COLUMNS).figure.axes[0]
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["a", "b"]


def test_names_stand_on_the_axis_in_their_order(runs: list[StudyRun]) -> None:
    ax = plot(runs[::-1], {"x": "case", "y": "width"}, COLUMNS).figure.axes[0]
    assert [t.get_text() for t in ax.get_xticklabels()] == ["smooth", "rough"]


def test_nearly_equal_values_look_nearly_equal(runs: list[StudyRun]) -> None:
    ax = plot(runs, {"x": "m", "y": "other"}, COLUMNS).figure.axes[0]
    low, high = ax.get_ylim()
    assert high - low >= 0.039 * high


def test_a_target_may_be_a_column_and_only_chooses_runs(runs: list[StudyRun]) -> None:
    options = {"x": "m", "y": "modulus", "target": "other", "only": {"m": [1]}}
    drawing = plot(runs, options, COLUMNS)
    assert [row["label"] for row in drawing.rows] == ["m = 1"]
    dashed = drawing.figure.axes[0].lines[-1]
    assert list(dashed.get_ydata()) == pytest.approx([50.5, 50.5])


def test_a_slope_may_be_the_mean_of_a_column(runs: list[StudyRun]) -> None:
    options = {"x": "m", "y": "modulus", "slope": "other", "slope_label": "mean"}
    line = plot(runs, options, COLUMNS).figure.axes[0].lines[-1]
    x, y = line.get_xdata(), line.get_ydata()
    assert y[-1] == pytest.approx(50.35 * x[-1])  # MPa


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"x": "m"}, "needs the options x and y"),
        ({"x": "m", "y": "nothing"}, "there is no 'nothing'; there are:"),
        ({"x": "m", "y": "width", "target": "nothing"}, "there is no 'nothing'; there are:"),
        ({"x": "m", "y": ["width", "modulus"]}, "different units"),
        ({"x": "m", "y": "width", "scale": "MPa"}, "does not fit; allowed: m, cm, mm"),
        ({"x": "m", "y": "width", "only": {"m": 7}}, "no run with a result"),
        ({"x": "m", "y": "width", "x_log": "yes"}, "must be true or false"),
        ({"x": "m", "y": "width", "y_range": [1.0]}, "must be 2 numbers"),
        ({"x": "m", "y": "width", "column": "triple"}, "single or double"),
        ({"x": "m", "y": "width", "legend": "left"}, "inside or above or aside"),
    ],
)
def test_wrong_options_are_refused(
    runs: list[StudyRun], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(RequestError, match=message):
        plot(runs, options, COLUMNS)


def test_curves_state_their_sign_and_carry_marks(runs: list[StudyRun]) -> None:
    drawing = curves(runs, {"marks": [0.005], "by": "case", "inset": [0.2, 0.4, 100, 200]}, COLUMNS)
    ax = drawing.figure.axes[0]
    assert "compression positive" in ax.get_xlabel()
    assert ax.get_ylabel() == "Axial stress, compression positive [kPa]"
    marks = [line for line in ax.lines if line.get_marker() == "o"]
    assert [line.get_xdata()[0] for line in marks] == [0.5, 0.5]
    assert drawing.rows[0]["strain [1]"] == 0.0
    assert len(drawing.rows) == 400 + 48
    scaled = curves(runs, {"scale": "MPa"}, COLUMNS).figure.axes[0]
    assert scaled.get_ylabel() == "Axial stress, compression positive [MPa]"
    turned = curves(runs, {"tension_positive": True}, COLUMNS)
    assert "tension positive" in turned.figure.axes[0].get_ylabel()
    assert min(float(str(row["axial_stress [Pa]"])) for row in turned.rows) < -1e5


def test_a_legend_without_room_stands_above_the_axes() -> None:
    """Lines that fill the axes from edge to edge leave no room for it."""
    place = legend_place({}, ["a", "b"], 4)
    assert place.where == "inside"
    with style():
        for lines, inside in ((2, True), (200, False)):
            figure = new_figure(place.width, 60.0)
            ax = figure.subplots()
            for k in range(lines):
                ax.plot([0, 1], [k, k], label="ab"[k] if k < 2 else None)
            ax.set_ylim(0, 300 if inside else 199)
            legend(ax, place)
            figure.draw_without_rendering()
            low = ax.get_legend().get_window_extent().y0
            assert bool(low < ax.get_window_extent().y1) is inside


def test_a_column_of_the_history_is_drawn(runs: list[StudyRun]) -> None:
    drawing = history(runs, {"y": "plastic_dissipation"}, COLUMNS)
    assert drawing.figure.axes[0].get_ylabel() == "Plastic dissipation [J/m]"
    assert drawing.rows[0]["plastic_dissipation [J/m]"] == 0.0
    with pytest.raises(RequestError, match="needs the option y"):
        history(runs, {}, COLUMNS)
    with pytest.raises(RequestError, match="no curve to draw"):
        history(runs, {"y": "no_such_column"}, COLUMNS)


def test_the_quality_shows_both_numbers(runs: list[StudyRun]) -> None:
    drawing = quality(runs, {}, COLUMNS)
    kinds = {row["quantity"] for row in drawing.rows}
    assert kinds == {"kinetic_ratio", "kinetic_bound", "reaction_gap"}
    assert drawing.figure.axes[0].get_yscale() == "log"


def test_contours_have_one_colour_scale_and_say_where_there_is_no_result(
    runs: list[StudyRun],
) -> None:
    drawing = contours(runs, {"strain": 0.01}, COLUMNS)
    first, second = drawing.figure.axes[:2]
    assert first.images
    assert not second.images
    assert [t.get_text() for t in second.texts] == ["no result"]
    assert [row["largest"] is None for row in drawing.rows] == [False, True]
    several = contours(runs[:1], {"strain": [0.005, 0.01, 0.016]}, COLUMNS).figure
    assert len({ax.images[0].get_clim() for ax in several.axes[:3]}) == 1
    assert [ax.get_title() for ax in several.axes[:3]] == ["ε = 0.5 %", "ε = 1 %", "ε = 1.6 %"]
    with pytest.raises(RequestError, match=r"nothing to draw: .* has no frame at strain 0.5"):
        contours(runs, {"strain": 0.5}, COLUMNS)
    with pytest.raises(RequestError, match="did you mean 'plastic_strain'"):
        contours(runs, {"field": "plastic_strian"}, COLUMNS)


def test_runs_and_states_make_rows_with_headings(runs: list[StudyRun]) -> None:
    figure = contours(runs, {"strain": [0.005, 0.01]}, COLUMNS).figure
    assert figure.axes[0].get_ylabel() == "m = 1\ny [m]"
    assert figure.axes[2].get_ylabel() == "m = 2\ny [m]"
    by_series = contours(runs, {"rows": "series"}, COLUMNS).figure
    one, two = (ax.get_position() for ax in by_series.axes[:2])
    assert one.y0 > two.y1


def small_body(folder: Path) -> Path:
    place, boundary = synthetic.lattice(0.04, 0.4, 0.8)
    states = [(0.01, synthetic.fields_of(place, x_bands(place), 0.01))]
    return synthetic.write_result(
        folder / "small.h5", place, boundary, states, extents=((0.0, 0.0), (0.4, 0.8))
    )


@pytest.mark.parametrize("same", [True, False])
def test_bodies_are_drawn_to_one_scale_unless_asked_otherwise(
    runs: list[StudyRun], tmp_path: Path, same: bool
) -> None:
    both = [runs[0], study_run(small_body(tmp_path), "small", "a")]
    figure = contours(both, {"same_scale": same}, COLUMNS).figure
    scales = [
        float(np.diff(ax.get_xlim())[0]) / (ax.get_position().width * figure.get_figwidth())
        for ax in figure.axes[:2]
    ]
    assert bool(np.isclose(scales[0], scales[1])) is same
    for ax in figure.axes[:2]:  # and not distorted
        box = ax.get_position()
        shape = box.height * figure.get_figheight() / (box.width * figure.get_figwidth())
        assert shape == pytest.approx(float(np.diff(ax.get_ylim())[0] / np.diff(ax.get_xlim())[0]))


def test_bodies_of_nearly_one_size_share_their_axes() -> None:
    extents = [np.array(e) for e in ([0, 0, 1, 2], [0, 0, 1.04, 2.02], [0, 0, 2, 4])]
    one, two, three = shared(extents)
    assert list(one) == list(two) == [0, 0, 1.04, 2.02]
    assert list(three) == [0, 0, 2, 4]


def test_panels_do_not_overlap(runs: list[StudyRun]) -> None:
    many = runs * 7
    figure = contours(many, {"per_row": 5}, COLUMNS).figure
    assert figure.get_figwidth() * 25.4 <= 180.01
    assert figure.get_figheight() * 25.4 <= 220.01
    boxes = [ax.get_position() for ax in figure.axes]
    for k, one in enumerate(boxes):
        for other in boxes[k + 1 :]:
            apart = one.x1 <= other.x0 or other.x1 <= one.x0
            assert apart or one.y1 <= other.y0 or other.y1 <= one.y0


def test_profiles_carry_widths_and_can_be_centred(runs: list[StudyRun]) -> None:
    drawing = profiles(runs, {"centred": True}, COLUMNS)
    ax = drawing.figure.axes[0]
    assert ax.get_legend().get_title().get_text() == "width between points at 10 %"
    width = MEASURES["band"].take(runs[0].run, AT)["width_interpolated"]
    assert ax.get_legend().get_texts()[0].get_text() == f"m = 1: {width:.3f} m"
    top = ax.lines[0].get_xdata()[np.argmax(ax.lines[0].get_ydata())]
    assert top == pytest.approx(0.0)
    assert ax.get_xlabel() == "Distance from the peak along the line [m]"
    shares = profiles(runs, {"normalised": True, "level": 0.5}, COLUMNS).figure.axes[0]
    assert max(shares.lines[0].get_ydata()) == pytest.approx(1.0)


def test_profiles_along_a_given_line_cross_the_band(runs: list[StudyRun]) -> None:
    drawing = profiles(runs[:1], {"line": [[0.0, 0.5], [1.0, 1.5]]}, COLUMNS)
    assert drawing.rows[0]["x [m]"] == 1.0  # the band rises, so the line is mirrored
    with pytest.raises(RequestError, match=r"must be \[\[x, y\], \[x, y\]\]"):
        profiles(runs, {"line": [0.0, 1.0]}, COLUMNS)
    with pytest.raises(RequestError, match=r"nothing to draw: .* has no frame at strain 0.5"):
        profiles(runs, {"strain": 0.5}, COLUMNS)
