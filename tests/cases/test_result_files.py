"""The result files as other programs see them: HDF5 with units, XDMF in a VTK reader."""

import re

import h5py
import numpy as np
import pytest
from case_files import SPECIMEN, history, uncontrolled

DATASETS = {
    "displacement": (2, "m"),
    "velocity": (2, "m/s"),
    "stress": (4, "Pa"),
    "strain": (4, "1"),
    "plastic_strain": (0, "1"),
    "det_f": (0, "1"),
    "von_mises": (0, "Pa"),
    "zero_energy": (0, "1"),
}
COMPONENTS = ("xx", "yy", "zz", "xy")


@pytest.fixture(scope="module")
def results(run_case, tmp_path_factory):
    """Folder of the results of a small run."""
    folder = tmp_path_factory.mktemp("results")
    done = run_case(SPECIMEN, folder, "--threads", "1")
    assert done.returncode == 0, done.stderr
    return folder / "out"


def text(value):
    """Return an HDF5 string as text."""
    return value.decode() if isinstance(value, bytes) else str(value)


def test_every_data_set_has_a_unit_and_a_description(results):
    with h5py.File(results / "case.h5", locking=False) as file:
        n = len(file["points/volume"])
        for frame in file["frames"].values():
            assert set(frame) == set(DATASETS)
            for name, (columns, unit) in DATASETS.items():
                data = frame[name]
                assert data.shape == ((n, columns) if columns else (n,)), name
                assert text(data.attrs["unit"]) == unit
        lacking = []

        def look(path, item):
            if isinstance(item, h5py.Dataset) and not (
                path.startswith("input") or path.endswith("names")
            ):
                for name in ("unit", "description"):
                    if not text(item.attrs.get(name, "")):
                        lacking.append(f"{path} {name}")

        file.visititems(look)
        assert lacking == []


# Units of the columns by how their names begin or end; a column that none fits is an error.
UNITS = (
    (r"time(_step)?$", "s"),
    (r"\w+_force_[xy]$", "N/m"),
    (r"\w+_displacement_[xy]$", "m"),
    (r"\w+_rotation$", "rad"),
    (r"mean_stress_", "Pa"),
    (r"\w+_(energy|dissipation|heat|work)$", "J/m"),
    (r"(step|strain|mean_strain_yy|max_plastic_strain|energy_error|min_det_f)$", "1"),
    (r"(unbalanced_force|damping_share)$", "1"),
)


def test_the_history_is_in_the_result_too(results):
    rows = history(results / "case_history.csv")
    with h5py.File(results / "case.h5", locking=False) as file:
        assert file.attrs["schema_version"] == 2
        stored = file["history"]
        assert text(stored.attrs["columns"]).split() == list(rows)
        assert set(stored) == set(rows)
        assert stored.attrs["written"] == stored.attrs["rows"] == len(rows["step"])
        for name, data in stored.items():
            assert data.dtype == ("<i4" if name == "step" else "<f8"), name
            assert data.chunks is None
            assert (data[()] == rows[name]).all(), name
            expected = next(unit for pattern, unit in UNITS if re.match(pattern, name))
            assert text(data.attrs["unit"]) == expected, name
            assert len(text(data.attrs["description"])) > 5


def test_a_failed_run_has_its_good_rows_in_the_result(run_case, tmp_path):
    check = run_case(SPECIMEN, tmp_path, "--check")
    limit = float(check.stdout.split("2/omega_max = ")[1].split()[0])
    step = f"end_time = 1.0, time_step_rule = 'fixed', time_step = {1.3 * limit}"
    text = SPECIMEN.replace("final_strain = 0.01", step)
    text = text.replace("frame_strains = 0.004, 0.01, history_count = 100", "history_count = 1000")
    assert run_case(text, tmp_path, "--quiet").returncode == 4
    rows = history(tmp_path / "out" / "case_history.csv")
    assert len(rows["step"]) > 1
    with h5py.File(tmp_path / "out" / "case.h5", locking=False) as file:
        assert file.attrs["complete"] == 0
        n = file["history"].attrs["written"]
        assert n == len(rows["step"]) < file["history"].attrs["rows"]
        for name, values in rows.items():
            assert (file["history"][name][:n] == values).all(), name


def test_the_input_stands_in_the_result_byte_for_byte(results):
    with h5py.File(results / "case.h5", locking=False) as file:
        stored = file["input/namelist"][()]
        stored = stored if isinstance(stored, bytes) else stored.encode()
        assert stored == uncontrolled(SPECIMEN).encode()
        values = [text(line).strip() for line in file["input/values"][()]]
        assert any(line.startswith("discretisation.spacing = ") for line in values)
        for name in ("code_version", "git_hash", "compiler", "flags", "command_line", "host"):
            assert text(file.attrs[name]).strip()
        assert text(file.attrs["created"])[4] == "-"
        assert file.attrs["threads"] == 1
        assert (file.attrs["lower"] == [0.0, 0.0]).all()
        assert file.attrs["upper"] == pytest.approx([0.5, 1.0])


def test_the_points_are_those_of_the_input(results):
    with h5py.File(results / "case.h5", locking=False) as file:
        x, boundary = file["points/position"][()], file["points/boundary"][()]
        assert (boundary == 0).sum() == 6 * 11
        assert (x[boundary == 1, 1] < 0).all()
        assert (x[boundary == 2, 1] > 1).all()
        assert [text(name).strip() for name in file["points/boundary_names"][()]] == [
            "bottom",
            "top",
        ]
        assert file["points/volume"][()] == pytest.approx(0.01)
        strength = file["points/yield_stress"][()]
        near = np.hypot(x[:, 0], x[:, 1] - 0.3) < 0.1101
        assert near.sum() == 4
        assert strength == pytest.approx(np.where(near, 0.999 * 0.15e6, 0.15e6), rel=1e-14)
        assert text(file["points/yield_stress"].attrs["unit"]) == "Pa"


def test_frames_follow_the_history(results):
    rows = history(results / "case_history.csv")
    assert list(rows)[:7] == [
        *("step", "time", "strain"),
        *("bottom_force_x", "bottom_force_y", "top_force_x", "top_force_y"),
    ]
    assert (np.diff(rows["step"]) > 0).all()
    assert len(rows["step"]) == 101
    assert rows["strain"] == pytest.approx(0.01 * rows["time"], abs=1e-14)
    assert rows["strain"][-1] >= 0.01
    with h5py.File(results / "case.h5", locking=False) as file:
        frames = [file["frames"][name] for name in file["frames"]]
        dt = file.attrs["time_step"]
        assert file.attrs["steps"] == rows["step"][-1]
        for frame, strain in zip(frames, (0.0, 0.004, 0.01)):
            assert frame.attrs["valid"] == 1
            assert strain <= frame.attrs["strain"] < strain + 0.01 * dt * 1.000001
            assert frame.attrs["time"] == pytest.approx(frame.attrs["step"] * dt, rel=1e-14)
        body = file["points/boundary"][()] == 0
        assert rows["max_plastic_strain"][-1] == frames[-1]["plastic_strain"][()][body].max()
        top = frames[-1]["displacement"][()][file["points/boundary"][()] == 2, 1]
        assert top == pytest.approx(-frames[-1].attrs["strain"], rel=1e-13)


def vtk_frames(reader):
    """Return (time, grid) of every frame, as a reader of VTK gives them."""
    reader.UpdateInformation()
    key = reader.GetExecutive().TIME_STEPS()
    information = reader.GetOutputInformation(0)
    for k in range(information.Length(key)):
        time = information.Get(key, k)
        reader.UpdateTimeStep(time)
        grid = reader.GetOutputDataObject(0)
        while not hasattr(grid, "GetPointData"):
            grid = grid.GetBlock(0)
        yield time, grid


# XDMF of both versions: the second is what ParaView and pyvista take, the third is rarely packaged.
# It gives vectors as they are stored, and no parts of data sets.
@pytest.mark.parametrize("version", [2, 3])
def test_a_vtk_reader_sees_every_frame_and_field(results, version):
    pytest.importorskip("vtk")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    readers = pytest.importorskip(f"vtkmodules.vtkIOXdmf{version}")
    reader = readers.vtkXdmfReader() if version == 2 else readers.vtkXdmf3Reader()
    reader.SetFileName(str(results / "case.xdmf"))
    shown = list(vtk_frames(reader))
    with h5py.File(results / "case.h5", locking=False) as file:
        frames = [file["frames"][name] for name in file["frames"]]
        points, n = file["points"], len(file["points/volume"])
        assert [time for time, _ in shown] == [frame.attrs["time"] for frame in frames]
        for (_, grid), frame in zip(vtk_frames(reader), frames):
            position = vtk_to_numpy(grid.GetPoints().GetData())
            assert position[:, :2] == pytest.approx(points["position"][()])
            assert grid.GetNumberOfCells() == n
            assert [grid.GetCell(k).GetPointId(0) for k in range(n)] == list(range(n))
            data = grid.GetPointData()
            found = {
                data.GetArrayName(k): vtk_to_numpy(data.GetArray(k))
                for k in range(data.GetNumberOfArrays())
            }
            assert np.array_equal(found["yield_stress"], points["yield_stress"][()])
            assert np.array_equal(found["boundary"], points["boundary"][()])
            for name in DATASETS:
                expected = frame[name][()]
                if expected.ndim == 2 and expected.shape[1] == 2 and version == 2:
                    expected = np.column_stack([expected, np.zeros(n)])  # what its filters ask for
                assert np.array_equal(found[name], expected), name
            for column, component in enumerate(COMPONENTS if version == 2 else ()):
                for name in ("stress", "strain"):
                    expected = frame[name][()][:, column]
                    assert np.array_equal(found[f"{name}_{component}"], expected)


def test_meshio_reads_the_same_file(results):
    meshio = pytest.importorskip("meshio")
    with (
        meshio.xdmf.TimeSeriesReader(results / "case.xdmf") as reader,
        h5py.File(results / "case.h5", "r") as file,  # as meshio opens it
    ):
        points, cells = reader.read_points_cells()
        assert np.array_equal(points, file["points/position"][()])
        assert cells[0].type == "vertex"
        assert np.array_equal(cells[0].data[:, 0], np.arange(len(points)))
        assert reader.num_steps == len(file["frames"])
        for k, frame in enumerate(file["frames"].values()):
            time, fields, _ = reader.read_data(k)
            assert time == frame.attrs["time"]
            assert set(fields) == {*DATASETS, "volume", "boundary", "yield_stress"}
            for name in DATASETS:
                assert np.array_equal(fields[name], frame[name][()]), name
        assert meshio.Mesh(points, cells, point_data=fields).points.shape == points.shape


def test_pyvista_reads_the_same_file(results):
    pyvista = pytest.importorskip("pyvista")
    reader = pyvista.get_reader(str(results / "case.xdmf"))
    reader.set_active_time_value(reader.time_values[-1])
    mesh = reader.read()
    warped = mesh.warp_by_vector("displacement", factor=2.0)
    with h5py.File(results / "case.h5", locking=False) as file:
        frame = file["frames"][sorted(file["frames"])[-1]]
        assert np.array_equal(mesh["stress"], frame["stress"][()])
        assert np.array_equal(mesh["stress_xy"], frame["stress"][()][:, 3])
        moved = file["points/position"][()] + 2.0 * frame["displacement"][()]
    assert warped.points[:, :2] == pytest.approx(moved, rel=1e-6)
