"""Figures: colour scales, shapes of cells, files that are not blank."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic
from PIL import Image

from perigeo_post import (
    OutputError,
    RequestError,
    Run,
    animate,
    band_figure,
    compare_figure,
    contour_figure,
    energy_figure,
    measure_band,
    profile_figure,
    save_figure,
    stress_strain_figure,
)
from perigeo_post.draw.contours import common_scale, lattice_corners, panel_of
from perigeo_post.draw.style import prefix_for
from perigeo_post.read.fields import label_of


def assert_drawn(path: Path, colours: int = 20) -> None:
    """The picture has many colours and is mostly not one of them."""
    if path.suffix == ".pdf":
        data = path.read_bytes()
        assert data.startswith(b"%PDF")
        assert b"%%EOF" in data[-32:]
        assert len(data) > 5000
        return
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))[::3, ::3].astype(np.int64)
    assert len(np.unique(pixels @ [65536, 256, 1])) > colours
    assert pixels.std() > 5.0


def test_every_kind_of_figure_is_drawn(result: Path, cut_off: Path, tmp_path: Path) -> None:
    run, other = Run(result), Run(cut_off)
    for name, figure in {
        "curve.png": stress_strain_figure([run], marks=[0.01]),
        "curves.pdf": stress_strain_figure([run, other], tension_positive=True),
        "energies.png": energy_figure(run),
        "row.png": contour_figure(run.frames()),
        "row.pdf": contour_figure(run.frames()[1:], deformed=10.0),
        "band.png": band_figure(run, measure_band(run)),
        "profiles.png": profile_figure([measure_band(run), measure_band(other)]),
        "compare.png": compare_figure([run, other]),
    }.items():
        assert_drawn(save_figure(figure, tmp_path / name))


def test_figures_have_the_widths_of_columns(result: Path) -> None:
    run = Run(result)
    assert contour_figure(run.frames()[-1:]).get_size_inches()[0] * 25.4 <= 88.01
    assert contour_figure(run.frames()).get_size_inches()[0] * 25.4 <= 180.01
    assert stress_strain_figure([run]).get_size_inches()[0] * 25.4 == pytest.approx(88.0)


def test_a_cloud_and_a_failing_state_are_drawn(cloud: Path, failed: Path, tmp_path: Path) -> None:
    assert_drawn(save_figure(contour_figure(Run(cloud).frames()), tmp_path / "cloud.png"))
    frames = Run(failed).frames(include_invalid=True)
    assert_drawn(save_figure(contour_figure(frames, deformed=2.0), tmp_path / "failed.png"))


def test_axes_state_units_sign_and_scale(result: Path) -> None:
    run = Run(result)
    ax = stress_strain_figure([run]).axes[0]
    assert ax.get_ylabel() == "Axial stress, compression positive [kPa]"
    assert ax.get_xlabel() == "Nominal strain, compression positive [%]"
    turned = stress_strain_figure([run], tension_positive=True).axes[0]
    assert "tension positive" in turned.get_ylabel()
    figure = contour_figure(run.frames()[1:], deformed=10.0)
    assert figure._suptitle.get_text() == "Deformed shape, displacements × 10"
    assert [a.get_title() for a in figure.axes[:3]] == ["ε = 0.5 %", "ε = 1 %", "ε = 1.6 %"]
    assert figure.axes[-1].get_ylabel() == "Equivalent plastic strain α [–]"


def test_a_row_of_frames_has_one_colour_scale(result: Path) -> None:
    figure = contour_figure(Run(result).frames())
    limits = {ax.images[0].get_clim() for ax in figure.axes[:4]}
    assert len(limits) == 1
    low, high = limits.pop()
    assert low == 0.0
    assert high == float(Run(result).last_frame["plastic_strain"].max())


def test_fictitious_points_are_left_out_unless_asked_for(result: Path) -> None:
    frame = Run(result).last_frame
    assert len(panel_of(frame).values) == 26 * 51
    assert len(panel_of(frame, fictitious=True).values) == 26 * 55


def test_colour_scales_follow_the_signs() -> None:
    plain = common_scale([np.array([0.0, 0.2]), np.array([0.1, 0.3])], "1")
    assert (plain.low, plain.high, plain.colours) == (0.0, 0.3, "viridis")
    signed = common_scale([np.array([-2e3, 1e3])], "Pa")
    assert (signed.low, signed.high, signed.unit) == (-2.0, 2.0, "kPa")
    assert signed.colours == "RdBu_r"
    negative = common_scale([np.array([-3e6, -2e6])], "Pa")
    assert (negative.low, negative.high, negative.unit) == (-3.0, -2.0, "MPa")
    nothing = common_scale([np.zeros(3)], "1")
    assert nothing.low < nothing.high
    assert common_scale([np.array([0.0, 1.0])], "1", high=0.5).extend == "max"
    with pytest.raises(RequestError, match="must rise"):
        common_scale([np.zeros(3)], "1", 1.0, 0.5)


def test_prefixes_keep_numbers_short() -> None:
    assert prefix_for(172e3, "Pa") == (1e-3, "kPa")
    assert prefix_for(0.02, "m") == (1e3, "mm")
    assert prefix_for(0.3, "1") == (1.0, "1")
    assert label_of("stress_xy") == "Cauchy stress $σ_{xy}$"


def test_deformed_cells_share_their_corners(result: Path) -> None:
    panel = panel_of(Run(result).last_frame, deformed=2.0)
    x, y = lattice_corners(panel)
    assert x.shape == (52, 27)
    inner_x = 1.0 + 2.0 * 0.3 * 0.016
    expected = (np.arange(1, 26) - 0.5) * 0.04 * inner_x
    assert x[10, 1:-1] == pytest.approx(expected)
    assert np.diff(y, axis=0).min() > 0.0


def test_an_animation_has_every_frame_and_one_scale(result: Path, tmp_path: Path) -> None:
    path = animate(Run(result).frames(), tmp_path / "run.gif", dpi=60)
    with Image.open(path) as image:
        assert image.n_frames == 4
    with pytest.raises(RequestError, match=r"\.gif or \.mp4"):
        animate(Run(result).frames(), tmp_path / "run.avi")
    with pytest.raises(RequestError, match="no frame"):
        animate([], tmp_path / "run.gif")


def test_a_wrong_ending_or_place_is_refused(result: Path, tmp_path: Path) -> None:
    figure = stress_strain_figure([Run(result)])
    with pytest.raises(RequestError, match=r"must end in \.png, \.pdf, \.svg or \.eps"):
        save_figure(figure, tmp_path / "curve.jpg")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot write"):
        save_figure(figure, tmp_path / "file" / "curve.png")


def test_a_wide_body_with_a_step_is_drawn_without_its_empty_part(tmp_path: Path) -> None:
    place, _ = synthetic.lattice(0.05, 3.0, 1.0, layers=0)
    place = place[~((place[:, 0] > 2.0) & (place[:, 1] > 0.5))]
    alpha = synthetic.gaussian_band(place, (1.0, 0.5), 45.0, True, 0.06, 0.2)
    states = [(s, synthetic.fields_of(place, alpha, s)) for s in (0.0, 0.01)]
    path = synthetic.write_result(
        tmp_path / "wide.h5", place, np.zeros(len(place), dtype=int), states, 0.05,
        platens=False, extents=((0.0, 0.0), (3.0, 1.0)),
    )  # fmt: skip
    figure = contour_figure(Run(path).frames())
    drawn = figure.axes[0].images[0].get_array()
    assert np.ma.getmaskarray(drawn).any()
    assert_drawn(save_figure(figure, tmp_path / "wide.png"))
