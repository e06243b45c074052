"""The command line: every command, its numbers, its files, its errors and exit statuses."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
import synthetic
from PIL import Image
from test_figures import assert_drawn

from perigeo_post import Run, column_curves, contour_figure, curve_figure
from perigeo_post.cli.command_line import COMMANDS, main

Capture = pytest.CaptureFixture[str]


def numbers(capture: Capture, *argv: object) -> Any:
    assert main([str(a) for a in argv]) == 0
    return json.loads(capture.readouterr().out)


def refused(capture: Capture, status: int, *argv: object) -> str:
    assert main([str(a) for a in argv]) == status
    words = capture.readouterr()
    assert "Traceback" not in words.err
    assert words.out == ""
    last = words.err.strip().splitlines()[-1]
    assert "error: " in last
    return last


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_shows_examples(command: str, capsys: Capture) -> None:
    assert main([*command.split(), "--help"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("usage: perigeo-post")
    if command:
        assert "examples:" in text
        assert f"perigeo-post {command} " in text
        assert "%%" not in text


def test_info_tells_state_frames_and_numbers(result: Path, cut_off: Path, capsys: Capture) -> None:
    assert main(["info", str(result), str(cut_off)]) == 0
    text = capsys.readouterr().out
    assert "(complete)" in text
    assert "not complete" in text
    assert "E_app        50.00 MPa" in text
    facts = numbers(capsys, "info", result, "--json")
    assert facts["complete"] is True
    assert facts["history"]["apparent_modulus"] == pytest.approx(50e6)
    assert [f["strain"] for f in facts["frames"]] == [0.0, 0.005, 0.01, 0.016]
    assert main(["info", str(result), "--input"]) == 0
    assert capsys.readouterr().out == synthetic.NAMELIST
    assert main(["info", str(result), "--values"]) == 0
    assert "material.poissons_ratio = 0.3" in capsys.readouterr().out


def test_info_shows_units_and_what_a_law_adds(result: Path, capsys: Capture) -> None:
    assert main(["info", str(result)]) == 0
    text = capsys.readouterr().out
    assert "schema_version 1" in text
    assert "400 rows in made_history.csv: step [1], time [s]" in text
    n = synthetic.to_second_schema(result, extra={"crack_length": ("m", "of all cracks", None)})
    synthetic.add_field(result, "damage_rate", "1/s", "rate of the damage", "")
    synthetic.add_field(result, "back_stress", "Pa", "centre of the yield surface", "xx xy yx yy")
    assert main(["info", str(result)]) == 0
    text = capsys.readouterr().out
    assert "schema_version 2" in text
    assert f"{n} rows in made.h5: step [1], time [s]" in text
    assert "crack_length [m]" in text
    assert "damage_rate [1/s]" in text
    assert "back_stress [Pa] (xx xy yx yy)" in text


def test_a_field_that_a_law_adds_is_drawn_and_written_with_its_unit(
    result: Path, tmp_path: Path, capsys: Capture
) -> None:
    synthetic.add_field(result, "damage_rate", "1/s", "rate of the damage", "")
    figure, table = tmp_path / "a.png", tmp_path / "a.csv"
    argv = ["contours", result, "--field", "damage_rate", "--strain", "1%"]
    found = numbers(capsys, *argv, "--json", "--csv", table, "-o", figure)
    assert found[0]["unit"] == "1/s"
    assert table.read_text().splitlines()[0].endswith(",damage_rate [1/s]")
    assert_drawn(figure)
    drawn = contour_figure([Run(result).last_frame], "damage_rate")
    assert drawn.axes[-1].get_ylabel() == "Damage rate [1/s]"


def test_info_works_without_history_and_on_failed_runs(
    cloud: Path, failed: Path, capsys: Capture
) -> None:
    assert main(["info", str(cloud), str(failed)]) == 0
    text = capsys.readouterr().out
    assert "is missing" in text
    assert "failing state" in text
    facts = numbers(capsys, "info", failed, "--json")
    assert facts["frames"][-1]["largest_plastic_strain"] is None


def test_curves_draw_and_print(result: Path, tmp_path: Path, capsys: Capture) -> None:
    assert main(["curves", str(result)]) == 0
    assert_drawn(result.with_name("made_curves.png"))
    assert "wrote" in capsys.readouterr().out
    table = tmp_path / "c.csv"
    found = numbers(capsys, "curves", result, "--json", "--mark", "1%", "--csv", table)
    assert found["apparent_modulus"] == pytest.approx(50e6)
    assert found["stress_at"]["0.01"] > 0.0
    assert len(found["x"]["values"]) == 400
    assert table.read_text().startswith("run,strain [1],axial_stress [Pa]\n")
    for options in (["--energies"], ["--column", "kinetic_energy", "--against", "time"]):
        figure = tmp_path / "f.pdf"
        assert main(["curves", str(result), *options, "-o", str(figure)]) == 0
        assert_drawn(figure)


def test_any_column_is_drawn_against_any(result: Path, tmp_path: Path, capsys: Capture) -> None:
    table, figure = tmp_path / "c.csv", tmp_path / "c.png"
    argv = ["curves", result, "--x", "plastic_dissipation", "--y", "bottom_force_y", "top_force_y"]
    both = numbers(capsys, *argv, "--json", "--csv", table, "-o", figure)
    assert_drawn(figure)
    assert [c["run"] for c in both] == ["bottom force y", "top force y"]
    assert [c["y"]["unit"] for c in both] == ["N/m", "N/m"]
    assert both[0]["x"] == both[1]["x"]
    assert table.read_text().startswith("curve,x_name,x_unit,x,y_name,y_unit,y\n")
    axes = curve_figure(column_curves([Run(result)], argv[5:7], argv[3])).axes[0]
    assert axes.get_xlabel() == "Plastic dissipation [J/m]"
    assert axes.get_ylabel() == "Force y [kN/m]"
    one = numbers(capsys, "curves", result, "--column", "strain_energy", "--against", "time",
                  "--json")  # fmt: skip
    assert (one["x"]["name"], one["y"]["name"]) == ("time", "strain_energy")


def test_json_and_a_figure_can_be_had_together(
    result: Path, tmp_path: Path, capsys: Capture
) -> None:
    figure = tmp_path / "new" / "c.png"
    assert numbers(capsys, "curves", result, "--json", "-o", figure)["run"] == "made"
    assert_drawn(figure)
    numbers(capsys, "contours", result, "--json")
    assert not list(result.parent.glob("made_plastic*"))


def test_the_yield_stress_is_named_and_drawn(result: Path, tmp_path: Path, capsys: Capture) -> None:
    values = synthetic.add_yield_stress(result)
    assert main(["info", str(result)]) == 0
    assert "yield_stress" in capsys.readouterr().out
    figure = tmp_path / "soil.png"
    argv = ["contours", result, "--field", "yield_stress", "--frame", 0]
    (found,) = numbers(capsys, *argv, "--json", "--fictitious", "-o", figure)
    assert_drawn(figure)
    assert (found["min"], found["max"], found["unit"]) == (values[0], values[-1], "Pa")


def test_contours_of_chosen_states(result: Path, tmp_path: Path, capsys: Capture) -> None:
    figure = tmp_path / "row.png"
    argv = ["contours", str(result), "--strain", "0.5%", "0.016", "-o", str(figure)]
    assert main([*argv, "--deformed", "5", "--field", "stress_xy", "--fictitious"]) == 0
    assert_drawn(figure)
    capsys.readouterr()
    found = numbers(capsys, "contours", result, "--json", "--field", "stress_yy", "--frame", 1, 3)
    assert [f["frame"] for f in found] == [1, 3]
    assert found[0]["max"] == -170e3
    table = tmp_path / "points.csv"
    numbers(capsys, "contours", result, "--json", "--time", 2.0, "--csv", table)
    assert len(table.read_text().splitlines()) == 1 + 26 * 55


def test_band_prints_what_the_contract_names(result: Path, tmp_path: Path, capsys: Capture) -> None:
    csv, table = tmp_path / "p.csv", tmp_path / "t.csv"
    found = numbers(capsys, "band", result, "--json", "--csv", csv, "--table", table)
    for key in ("width", "peak", "angle", "position", "line", "strain"):
        assert found[key] is not None
    assert found["strain"] == 0.016
    assert len(found["line"]) == 2
    assert len(found["bands"]) == 2
    assert numbers(capsys, "band", result, "--json", "--strain", "0.01")["strain"] == 0.01
    assert csv.read_text().startswith("run,distance [m],x [m],y [m],plastic_strain [1]\n")
    assert len(table.read_text().splitlines()) == 3
    assert main(["band", str(result), "--line", "1", "0.5", "0", "1.5"]) == 0
    assert "prevailing band, rising" in capsys.readouterr().out
    assert_drawn(result.with_name("made_band.png"))


def test_bands_of_several_runs_share_a_figure(
    result: Path, cut_off: Path, tmp_path: Path, capsys: Capture
) -> None:
    figure = tmp_path / "b.png"
    assert len(numbers(capsys, "band", result, cut_off, "--json", "-o", figure)) == 2
    assert_drawn(figure)


def test_compare_draws_and_tabulates(
    result: Path, cut_off: Path, tmp_path: Path, capsys: Capture
) -> None:
    figure, table, csv = tmp_path / "c.png", tmp_path / "t.csv", tmp_path / "c.csv"
    argv = ["compare", result, cut_off, "-o", figure, "--table", table, "--csv", csv,
            "--labels", "one", "two", "--at", "0.5%"]  # fmt: skip
    assert main([str(a) for a in argv]) == 0
    text = capsys.readouterr().out
    assert "peak stress [kPa]" in text
    assert "two" in text
    assert_drawn(figure)
    assert "stress_at_0.005 [Pa]" in table.read_text()
    assert numbers(capsys, "compare", result, cut_off, "--json")[0]["run"] == "made"


def test_animate_writes_a_gif(result: Path, capsys: Capture) -> None:
    assert main(["animate", str(result)]) == 0
    assert "a film of 4 frames" in capsys.readouterr().err
    with Image.open(result.with_name("made_plastic_strain.gif")) as image:
        assert image.n_frames == 4
    capsys.readouterr()
    assert len(numbers(capsys, "animate", result, "--json")) == 4


def test_mp4_without_ffmpeg_is_a_clear_error(
    result: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    words = refused(capsys, 1, "animate", result, "-o", tmp_path / "x.mp4")
    assert "ffmpeg" in words


def test_runs_without_platens_go_through_every_command(
    cloud: Path, tmp_path: Path, capsys: Capture
) -> None:
    for command in ("contours", "band", "compare"):
        figure = tmp_path / f"{command}.png"
        assert main([command, str(cloud), "-o", str(figure)]) == 0
        assert_drawn(figure)
    assert main(["animate", str(cloud)]) == 0
    capsys.readouterr()
    assert "no platens" in refused(capsys, 1, "curves", cloud)
    assert "no platens" in refused(capsys, 1, "band", cloud, "--strain", "0.01")


def test_wrong_command_lines_end_with_status_1(
    result: Path, tmp_path: Path, capsys: Capture
) -> None:
    refused(capsys, 1)
    refused(capsys, 1, "draw", result)
    assert "not a strain" in refused(capsys, 1, "band", result, "--strain", "much")
    assert "no frame at strain 0.3" in refused(capsys, 1, "band", result, "--strain", "0.3")
    assert "no plastic strain" in refused(capsys, 1, "band", result, "--frame", 0)
    assert "plastic_strain" in refused(capsys, 1, "contours", result, "--field", "plastic_strin")
    assert "no column" in refused(capsys, 1, "curves", result, "--column", "nothing")
    assert "must end in" in refused(capsys, 1, "curves", result, "-o", tmp_path / "x.jpg")
    assert "2 labels" in refused(capsys, 1, "curves", result, "--labels", "a", "b")
    assert "--x goes with --y" in refused(capsys, 1, "curves", result, "--against", "time")
    units = refused(capsys, 1, "curves", result, "--y", "top_force_x", "kinetic_energy")
    assert "different units" in units


def test_files_that_cannot_be_read_end_with_status_2(
    result: Path, tmp_path: Path, capsys: Capture
) -> None:
    assert "no file" in refused(capsys, 2, "info", tmp_path / "none.h5")
    points, boundary = synthetic.lattice()
    new = synthetic.write_result(tmp_path / "new.h5", points, boundary, [], version=3)
    for command in [
        name for name in COMMANDS if name not in ("study", "report", "geometry", "advise")
    ]:
        assert "schema version 3" in refused(capsys, 2, command, new)
    result.with_name("made_history.csv").unlink()
    assert "history" in refused(capsys, 2, "curves", result)


def test_files_that_cannot_be_written_end_with_status_5(
    result: Path, tmp_path: Path, capsys: Capture
) -> None:
    (tmp_path / "file").write_text("")
    place = tmp_path / "file"
    assert "cannot write" in refused(capsys, 5, "curves", result, "-o", place / "x.png")
    assert "cannot write" in refused(capsys, 5, "animate", result, "-o", place / "x.gif")
    assert "cannot write" in refused(capsys, 5, "curves", result, "--csv", place / "x.csv")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a second process")
def test_no_display_is_needed(result: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import subprocess
    import sys

    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "MPLBACKEND")}
    done = subprocess.run(
        [sys.executable, "-m", "perigeo_post", "curves", str(result)],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


COMMANDS_THAT_WRITE = [
    ["curves", "--csv"],
    ["compare", "--csv"],
    ["compare", "--table"],
    ["contours", "--csv"],
    ["band", "--csv"],
    ["band", "--table"],
    ["curves", "-o"],
    ["animate", "-o"],
]


@pytest.mark.parametrize("command", COMMANDS_THAT_WRITE, ids=" ".join)
@pytest.mark.parametrize("victim", ["made.h5", "cut.h5", "made_history.csv", "run.nml", "case.h5"])
def test_outputs_destroy_nothing(
    command: list[str], victim: str, result: Path, cut_off: Path, capsys: Capture
) -> None:
    folder = result.parent
    (folder / "run.nml").write_text("! a run\n&run name = 'run' /\n")
    (folder / "case.h5").write_bytes(b"perigeo checkpoint".ljust(512) + cut_off.read_bytes())
    target = folder / victim
    if command[-1] == "-o":  # a figure must have its ending
        target = folder / f"{victim}{'.gif' if command[0] == 'animate' else '.png'}"
        target.write_bytes((folder / victim).read_bytes())
    before = {path: path.read_bytes() for path in folder.iterdir()}
    line = refused(capsys, 5, *command, target, result)
    assert str(target) in line
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_an_input_is_known_by_any_of_its_names(result: Path, capsys: Capture) -> None:
    (result.parent / "link.csv").symlink_to(result)
    line = refused(capsys, 5, "curves", "--csv", result.parent / "link.csv", result)
    assert "is an input of this command" in line


def test_outputs_replace_their_like_only(result: Path, capsys: Capture) -> None:
    figure, table = result.parent / "a.png", result.parent / "a.csv"
    for _ in range(2):
        assert main(["curves", str(result), "-o", str(figure), "--csv", str(table)]) == 0
    capsys.readouterr()
    for path, option in ((figure, "-o"), (table, "--csv")):
        path.write_text("notes of a week\n")
        assert "file of another kind" in refused(capsys, 5, "curves", option, path, result)
        assert path.read_text() == "notes of a week\n"
    line = refused(capsys, 1, "band", "--csv", "b.csv", "--table", "./b.csv", result)
    assert "two outputs have one name" in line


def test_a_tilde_is_the_home_folder(
    result: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind "=" the shell leaves it to the program; a folder of this name was made."""
    home, work = tmp_path / "home", tmp_path / "work"
    home.mkdir()
    work.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.chdir(work)
    (home / "a.h5").write_bytes(result.read_bytes())
    assert main(["band", "~/a.h5", "--csv=~/b.csv", "--table=~/c.csv", "-o~/new/d.png"]) == 0
    assert {path.name for path in home.iterdir()} == {"a.h5", "b.csv", "c.csv", "new"}
    capsys.readouterr()
    assert not list(work.iterdir())
    assert "home folder is not known" in refused(capsys, 1, "band", result, "--csv=~nobody_/b.csv")
