"""Results for other programs: VTU, PVD, CSV, xarray; and how objects show."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from perigeo_post import RequestError, Run, measure_band, stress_strain, stress_strain_figure
from perigeo_post.cli.command_line import main


def read_vtu(path: Path) -> Any:
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    numpy_support = pytest.importorskip("vtkmodules.util.numpy_support")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput(), numpy_support.vtk_to_numpy


def test_a_frame_comes_back_from_vtk(result: Path, tmp_path: Path) -> None:
    assert main(["export", str(result), "-o", str(tmp_path / "out")]) == 0
    frame = Run(result).frames()[2]
    grid, to_numpy = read_vtu(tmp_path / "out" / "made_000002.vtu")
    data = grid.GetPointData()
    stress = data.GetArray("stress")
    assert [stress.GetComponentName(k) for k in range(4)] == ["xx", "yy", "zz", "xy"]
    assert np.array_equal(to_numpy(stress), frame["stress"])
    assert np.array_equal(to_numpy(data.GetArray("displacement"))[:, :2], frame["displacement"])
    assert not to_numpy(data.GetArray("displacement"))[:, 2].any()
    assert np.array_equal(to_numpy(grid.GetPoints().GetData())[:, :2], frame.run.positions)
    assert grid.GetNumberOfCells() == len(frame.run.volumes)
    sets = ElementTree.parse(tmp_path / "out" / "made.pvd").getroot().iter("DataSet")
    times = {s.get("file"): float(s.get("timestep", "nan")) for s in sets}
    assert times["made_000002.vtu"] == frame.time
    assert len(times) == 4


def test_a_table_has_units_and_all_components(result: Path, tmp_path: Path) -> None:
    argv = ["export", str(result), "--format", "csv", "--strain", "1%", "-o", str(tmp_path)]
    assert main([*argv, "--field", "stress", "plastic_strain"]) == 0
    with (tmp_path / "made_000002.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["x [m]", "y [m]", "volume [m^2]", "boundary", "stress_xx [Pa]",
                       "stress_yy [Pa]", "stress_zz [Pa]", "stress_xy [Pa]",
                       "plastic_strain [1]"]  # fmt: skip
    values = np.array(rows[1:], dtype=float)
    assert values[:, 7] == pytest.approx(Run(result).frame(0.01)["stress_xy"], rel=1e-11)


def test_export_replaces_its_like_and_nothing_else(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    given = ["export", str(result), "-o", str(folder)]
    assert main(given) == 0
    assert main(given) == 0
    made = next(path for path in folder.iterdir() if path.suffix == ".vtu")
    made.write_text("my notes, not a result\n")
    assert main(given) != 0
    assert "not overwritten" in capsys.readouterr().err
    assert made.read_text() == "my notes, not a result\n"


def test_what_cannot_be_exported_is_named(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(result), "--field", "plastic_strian"]) == 1
    assert "did you mean 'plastic_strain'" in capsys.readouterr().err
    assert main(["export", str(result), "-o", str(result)]) == 1
    assert "is no folder" in capsys.readouterr().err


def test_frames_become_an_xarray(result: Path) -> None:
    run = Run(result)
    try:
        import xarray  # noqa: F401
    except ModuleNotFoundError:
        with pytest.raises(RequestError, match="needs xarray, which is not installed"):
            run.to_xarray()
        return
    data = run.to_xarray(["stress", "plastic_strain"])
    assert data.stress.dims == ("frame", "point", "xx_yy_zz_xy")
    assert data.stress.attrs["units"] == "Pa"
    assert np.array_equal(data.plastic_strain.values[3], run.last_frame["plastic_strain"])
    assert list(data.nominal_strain.values) == [0.0, 0.005, 0.01, 0.016]


def test_objects_show_themselves_in_a_line(result: Path) -> None:
    run = Run(result)
    found = measure_band(run)
    for thing in (run, run.last_frame, run.history(), run.body_points, run.body_points.lattice,
                  run.last_frame.field("stress"), stress_strain(run), found, found.bands,
                  found.profile, found.bands.prevailing):  # fmt: skip
        text = repr(thing)
        assert "\n" not in text
        assert len(text) < 600
    assert repr(stress_strain(run)).startswith("Curve(label='made', x=<400 numbers>, y=<400 ")


def test_a_notebook_gets_a_picture(result: Path) -> None:
    """Without a backend for notebooks too: IPython asks the figure itself."""
    picture = stress_strain_figure([Run(result)])._repr_png_()  # type: ignore[attr-defined]
    assert picture.startswith(b"\x89PNG")


def test_a_file_that_is_open_elsewhere_can_be_read(result: Path) -> None:
    """With locks, as h5py and meshio open files."""
    with h5py.File(result, "r"):
        assert len(Run(result).frames()) == 4
