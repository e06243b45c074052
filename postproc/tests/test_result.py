"""The reader: schema, frames, fields, history, runs that are not complete."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic

from perigeo_post import (
    FieldNotFoundError,
    FrameNotFoundError,
    ResultError,
    Run,
    SchemaError,
    read_history,
)
from perigeo_post.read.fields import label_of


def test_a_complete_run_tells_what_it_is(result: Path) -> None:
    with Run(result) as run:
        assert (run.name, run.title, run.complete) == ("made", "Made up", True)
        assert (run.spacing, run.horizon, run.strain_axis) == (0.04, 0.12, "y")
        assert run.platens == ("bottom", "top")
        assert run.boundary_names == ["bottom", "top"]
        assert run.width == 1.0
        assert run.length == 2.0
        assert run.body.sum() == 26 * 51
        assert len(run.positions) == 26 * 55
        assert run.provenance["compiler"] == "made up"
        assert run.provenance["threads"] == 2


def test_the_input_comes_back_byte_for_byte(result: Path) -> None:
    run = Run(result)
    assert run.input_text == synthetic.NAMELIST
    assert run.values["run.title"] == "'made up'"
    assert run.number("material.poissons_ratio") == 0.3
    assert run.number("material.nothing") is None


def test_frames_carry_step_time_and_strain(result: Path) -> None:
    frames = Run(result).frames()
    assert [f.strain for f in frames] == [0.0, 0.005, 0.01, 0.016]
    assert [f.number for f in frames] == [0, 1, 2, 3]
    assert frames[2].time == pytest.approx(2.0)
    assert frames[2].step == 1000


def test_fields_carry_unit_description_and_components(result: Path) -> None:
    field = Run(result).last_frame.field("stress")
    assert (field.unit, field.components) == ("Pa", ("xx", "yy", "zz", "xy"))
    assert "Cauchy" in field.description
    assert field.values.shape[1] == 4


def test_components_are_not_mixed_up(result: Path) -> None:
    frame = Run(result).last_frame
    x = frame.run.positions[:, 0]
    assert frame["stress_xx"] == pytest.approx(-1e3)
    assert frame["stress_yy"] == pytest.approx(-170e3)
    assert frame["stress_zz"] == pytest.approx(-50e3)
    assert frame["stress_xy"] == pytest.approx(20e3 * (x - 0.5))
    assert frame["strain_zz"] == pytest.approx(0.01)
    assert frame["displacement_y"] == pytest.approx(-0.016 * frame.run.positions[:, 1])


def test_derived_fields_follow_their_definitions(result: Path) -> None:
    frame = Run(result).last_frame
    x, y = frame.run.positions.T
    assert frame["mean_stress"] == pytest.approx(-(1e3 + 170e3 + 50e3) / 3)
    assert frame["pressure"] == pytest.approx((1e3 + 170e3 + 50e3) / 3)
    assert frame["displacement_magnitude"] == pytest.approx(np.hypot(0.3 * 0.016 * x, 0.016 * y))
    assert frame["max_shear_stress"] == pytest.approx(np.hypot(84.5e3, 20e3 * (x - 0.5)))
    assert frame["volumetric_strain"] == pytest.approx(0.3 * 0.016 - 0.016 + 0.01)


def test_von_mises_is_derived_where_the_file_has_none(result: Path) -> None:
    with h5py.File(result, "a") as file:
        del file["frames/000003/von_mises"]
    frame = Run(result).last_frame
    xx, yy, zz = -1e3, -170e3, -50e3
    xy = 20e3 * (frame.run.positions[:, 0] - 0.5)
    expected = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * xy**2)
    assert frame["von_mises"] == pytest.approx(expected)


def test_an_unknown_field_is_answered_with_the_nearest_name(result: Path) -> None:
    frame = Run(result).last_frame
    with pytest.raises(FieldNotFoundError, match="did you mean 'plastic_strain'"):
        frame.field("plastic_strian")
    with pytest.raises(FieldNotFoundError, match="choose one of stress_xx, stress_yy"):
        frame.scalar("stress")


def test_the_yield_stress_of_the_points_is_a_field_of_every_frame(result: Path) -> None:
    assert "yield_stress" not in Run(result).field_names
    with pytest.raises(FieldNotFoundError, match="no field 'yield_stress'"):
        Run(result).last_frame.field("yield_stress")
    values = synthetic.add_yield_stress(result)
    run = Run(result)
    assert "yield_stress" in run.field_names
    for frame in run.frames():
        assert (frame["yield_stress"] == values).all()
    assert run.last_frame.scalar("yield_stress").unit == "Pa"
    with pytest.raises(FieldNotFoundError):
        run.last_frame.field("volume")  # of the other data of the points none becomes a field


def test_every_listed_field_can_be_read(result: Path) -> None:
    run = Run(result)
    n = len(run.positions)
    for name in run.field_names:
        assert len(run.last_frame[name]) == n


def test_a_frame_is_found_by_strain_time_and_number(result: Path) -> None:
    run = Run(result)
    assert run.frame(strain=0.0101).number == 2
    assert run.frame(time=1.0).number == 1
    assert run.frame(number=3).strain == 0.016
    assert run.frame().number == 3
    with pytest.raises(FrameNotFoundError, match=r"no frame at strain 0.013; .*0.01 \(2\)"):
        run.frame(strain=0.013)
    assert run.frame(strain=0.013, tolerance=0.004).number in (2, 3)
    with pytest.raises(FrameNotFoundError, match="no frame 9"):
        run.frame(number=9)


def test_a_run_that_was_cut_off_shows_what_was_written(cut_off: Path) -> None:
    run = Run(cut_off)
    assert not run.complete
    assert [f.number for f in run.frames()] == [0, 1]
    assert run.frames(include_invalid=True) == run.frames()
    assert run.history().rows == 48


def test_a_failing_state_is_shown_only_when_asked_for(failed: Path) -> None:
    run = Run(failed)
    assert [f.valid for f in run.frames()] == [True, True]
    last = run.frames(include_invalid=True)[-1]
    assert (last.valid, last.number) == (False, None)
    assert np.isnan(last["plastic_strain"]).any()
    assert run.last_frame.number == 1


def test_frames_written_while_reading_appear(cut_off: Path) -> None:
    run = Run(cut_off)
    before = len(run.frames())
    with h5py.File(cut_off, "r+") as file:  # nothing is held open by the reader
        for name, value in (("written", 1), ("strain", 0.01), ("time", 2.0)):
            file["frames/000002"].attrs[name] = value
    assert len(run.frames()) == before + 1


def test_the_reader_looks_at_a_file_that_a_writer_holds_open(result: Path) -> None:
    with h5py.File(result, "r+", locking=False) as writer:
        writer.flush()
        assert len(Run(result).frames()) == 4


def test_history_columns_have_units(result: Path) -> None:
    history = Run(result).history()
    assert history.rows == 400
    assert history.unit("bottom_force_y") == "N/m"
    assert history.unit("mean_stress_yy") == "Pa"
    assert history.unit("max_plastic_strain") == "1"
    assert history.unit("external_work") == "J/m"
    assert history.unit("time") == "s"
    assert "bottom" in history.description("bottom_force_y")
    with pytest.raises(FieldNotFoundError, match="no column 'stress'"):
        history["stress"]


def test_columns_that_schema_1_did_not_have_get_no_unit(tmp_path: Path) -> None:
    columns = {name: np.zeros(2) for name in ("step", "crack_energy", "stress_of_something")}
    history = read_history(synthetic.write_columns(tmp_path / "h.csv", columns))
    assert [history.unit(name) for name in columns] == ["1", "", ""]


def test_units_of_the_second_schema_are_those_of_the_file(result: Path) -> None:
    before = Run(result).history()
    synthetic.to_second_schema(result, extra={"odd_stress": ("m^2", "an area", None)})
    history = Run(result).history()
    assert list(history) == [*before, "odd_stress"]
    assert history.path == result
    assert history.unit("odd_stress") == "m^2"
    assert history.description("odd_stress") == "an area"
    assert history.unit("kinetic_energy") == "parsec"
    for name in before:
        assert np.array_equal(history[name], before[name])
        assert history[name].dtype == float
    result.with_name("made_history.csv").unlink()
    assert Run(result).has_history
    assert np.array_equal(Run(result).history()["odd_stress"], np.arange(400) / 7.0)


def test_rows_that_only_the_csv_has_are_added(result: Path) -> None:
    synthetic.to_second_schema(result, written=250, places=500, extra={"a": ("kg", "mass", None)})
    csv = result.with_name("made_history.csv")
    csv.write_text(csv.read_text()[:-9])  # killed while it wrote a row
    history = Run(result).history()
    assert (history.rows, history.path) == (399, csv)
    assert np.array_equal(history["a"], np.arange(399) / 7.0)
    assert (history.unit("a"), history.description("a")) == ("kg", "mass")
    csv.unlink()
    history = Run(result).history()
    assert (history.rows, history.path) == (250, result)
    assert history["step"][-1] == 249


def test_a_run_that_has_only_begun_takes_all_its_rows_from_the_csv(result: Path) -> None:
    synthetic.to_second_schema(result, written=0, places=401)
    assert Run(result).history().rows == 400
    result.with_name("made_history.csv").unlink()
    assert Run(result).history().rows == 0


@pytest.mark.parametrize("spoilt", ["another number", "another column", "too long", "damaged"])
def test_the_csv_of_another_run_is_not_mixed_in(result: Path, spoilt: str) -> None:
    synthetic.to_second_schema(result, written=250, places=450)
    csv = result.with_name("made_history.csv")
    lines = csv.read_text().splitlines()
    if spoilt == "another number":
        cells = lines[250].split(",")
        lines[250] = ",".join([*cells[:-1], repr(np.nextafter(float(cells[-1]), 1.0).item())])
    elif spoilt == "another column":
        lines[0] = lines[0].replace("external_work", "internal_work")
    elif spoilt == "too long":
        lines += [lines[-1]] * 51
    else:
        lines[300] = "1,2"
    csv.write_text("\n".join(lines) + "\n")
    history = Run(result).history()
    assert (history.rows, history.path) == (250, result)
    assert "external_work" in history


def test_a_complete_history_of_the_file_needs_no_csv(result: Path) -> None:
    synthetic.to_second_schema(result)
    result.with_name("made_history.csv").write_text("nonsense")
    assert Run(result).history().rows == 400


def test_a_history_that_lacks_a_column_is_refused(result: Path) -> None:
    synthetic.to_second_schema(result)
    with h5py.File(result, "a") as file:
        del file["history/time"]
    with pytest.raises(ResultError, match="not complete"):
        Run(result).history()


def test_components_stand_in_the_order_of_the_file(result: Path) -> None:
    values = synthetic.add_field(result, "first_piola", "Pa", "P", "xx xy yx yy")
    synthetic.add_field(result, "triple", "K", "three numbers", "")
    with h5py.File(result, "a") as file:
        for group in file["frames"].values():
            old = group["stress"][()]
            group["stress"][...] = old[:, [3, 1, 0, 2]]
            group["stress"].attrs["components"] = np.bytes_("xy yy xx zz")
            del group["triple"]
            group["triple"] = np.ones((len(old), 3))
    run = Run(result)
    frame = run.last_frame
    assert np.array_equal(frame["first_piola_xy"], values[:, 1])
    assert np.array_equal(frame["first_piola_yx"], values[:, 2])
    assert np.array_equal(frame["first_piola_yy"], values[:, 3])
    assert frame.scalar("first_piola_yx").unit == "Pa"
    assert frame["stress_yy"] == pytest.approx(-170e3)
    assert frame["pressure"] == pytest.approx((1e3 + 170e3 + 50e3) / 3)
    assert {"first_piola_yx", "stress_zz", "triple_3"} <= set(run.field_names)
    assert "first_piola_zz" not in run.field_names
    for name in run.field_names:
        assert len(frame[name]) == len(run.positions)


def test_only_components_are_labelled_as_such() -> None:
    assert label_of("strain_xy") == "Strain $E_{xy}$"
    assert label_of("strain_rate") == "Strain rate"


def test_what_a_tensor_cannot_give_is_not_offered(result: Path) -> None:
    with h5py.File(result, "a") as file:
        for group in file["frames"].values():
            group["strain"].attrs["components"] = np.bytes_("xx yy xy yx")
    run = Run(result)
    assert "max_shear_strain" in run.field_names
    assert "volumetric_strain" not in run.field_names
    with pytest.raises(FieldNotFoundError, match="no field 'volumetric_strain'"):
        run.last_frame.field("volumetric_strain")


@pytest.mark.parametrize(
    ("tail", "rows"),
    [("", 3), ("4,5", 3), ("4,5,6", 3), ("4,5\n", 3), ("4,5,6\n", 4), ("\n", 3), ("x,y,z\n", 3)],
)
def test_an_unfinished_last_line_is_left_out(tmp_path: Path, tail: str, rows: int) -> None:
    path = tmp_path / "h.csv"
    path.write_text("step,time,strain\n1,2,3\n2,3,4\n3,4,5\n" + tail)
    assert read_history(path).rows == rows


def test_a_history_damaged_in_the_middle_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "h.csv"
    path.write_text("step,time\n1,2\n2\n3,4\n")
    with pytest.raises(ResultError, match="line 3"):
        read_history(path)
    path.write_text("step,ti")
    with pytest.raises(ResultError, match="no complete line"):
        read_history(path)


def test_a_renamed_result_still_finds_its_history(result: Path) -> None:
    other = result.with_name("other.h5")
    shutil.copy(result, other)
    assert Run(other).history().rows == 400


def test_an_unknown_version_or_schema_is_refused(tmp_path: Path) -> None:
    points, boundary = synthetic.lattice()
    path = synthetic.write_result(tmp_path / "new.h5", points, boundary, [], version=7)
    with pytest.raises(SchemaError, match="schema version 7, this perigeo-post reads 1, 2:"):
        Run(path)
    path = synthetic.write_result(tmp_path / "x.h5", points, boundary, [], schema="something")
    with pytest.raises(SchemaError, match="not a result of perigeo"):
        Run(path)


def test_what_is_no_result_is_refused_with_one_line(tmp_path: Path) -> None:
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    empty = tmp_path / "empty.h5"
    with h5py.File(empty, "w"):
        pass
    for path, words in (
        (tmp_path / "nothing.h5", "there is no file"),
        (tmp_path, "is a folder"),
        (text, "cannot be opened as HDF5"),
        (empty, "not a result of perigeo"),
    ):
        with pytest.raises(ResultError, match=words) as caught:
            Run(path)
        assert "\n" not in str(caught.value)


def test_a_truncated_file_is_refused(result: Path) -> None:
    data = result.read_bytes()
    result.write_bytes(data[: len(data) // 2])
    with pytest.raises(ResultError, match="damaged"):
        Run(result)


def test_a_cloud_has_no_platens_and_no_lattice(cloud: Path) -> None:
    run = Run(cloud)
    assert run.strain_axis is None
    assert run.platens is None
    assert run.body_points.lattice is None
    assert np.isnan(run.last_frame.strain)
    with pytest.raises(FrameNotFoundError, match="no platens"):
        run.frame(strain=0.01)
    assert run.frame(time=2.0).number == 1
