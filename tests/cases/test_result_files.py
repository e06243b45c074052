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


def test_a_vtk_reader_sees_every_frame_and_field(results):
    pytest.importorskip("vtk")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    reader = vtkXdmfReader()
    reader.SetFileName(str(results / "case.xdmf"))
    reader.UpdateInformation()
    key = reader.GetExecutive().TIME_STEPS()
    information = reader.GetOutputInformation(0)
    times = [information.Get(key, k) for k in range(information.Length(key))]
    with h5py.File(results / "case.h5", locking=False) as file:
        frames = [file["frames"][name] for name in file["frames"]]
        assert times == pytest.approx([frame.attrs["time"] for frame in frames])
        for time, frame in zip(times, frames):
            reader.UpdateTimeStep(time)
            grid = reader.GetOutputDataObject(0)
            while not hasattr(grid, "GetPointData"):
                grid = grid.GetBlock(0)
            position = vtk_to_numpy(grid.GetPoints().GetData())
            assert position[:, :2] == pytest.approx(file["points/position"][()])
            data = grid.GetPointData()
            names = {data.GetArrayName(k) for k in range(data.GetNumberOfArrays())}
            strength = file["points/yield_stress"][()]
            assert vtk_to_numpy(data.GetArray("yield_stress")) == pytest.approx(strength)
            tensors = {f"{name}_{k}" for name in ("stress", "strain") for k in COMPONENTS}
            assert names >= set(DATASETS) - {"stress", "strain"} | tensors | {"boundary"}
            for name in ("plastic_strain", "von_mises", "zero_energy"):
                found = vtk_to_numpy(data.GetArray(name))
                assert found == pytest.approx(frame[name][()], rel=1e-6), name
            found = vtk_to_numpy(data.GetArray("displacement"))
            assert found[:, :2] == pytest.approx(frame["displacement"][()], rel=1e-6)
            assert found.shape[1] == 2 or (found[:, 2] == 0).all()
            for column, component in enumerate(COMPONENTS):
                for name in ("stress", "strain"):
                    found = vtk_to_numpy(data.GetArray(f"{name}_{component}"))
                    expected = frame[name][()][:, column]
                    assert found == pytest.approx(expected, rel=1e-6), (name, component)
