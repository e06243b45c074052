"""Frames as files of other programs: VTU with PVD for VTK, XDMF 3 for meshio."""

from __future__ import annotations

import base64
import os
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from ..read.errors import OutputError
from ..read.fields import Field, unknown
from ..read.file import dataset
from ..read.outputs import FIELDS, check_output
from ..read.run import Frame, Run

_VERTEX = 1  # VTK's number of a cell that is one point
_KINDS = {"f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}


def write_vtu(folder: Path, run: Run, frames: Sequence[Frame], names: Sequence[str]) -> list[Path]:
    """One VTU for each frame, and the PVD that puts them in time; vectors get a third component 0.

    Units stand in the PVD; the points are those of the undeformed body.
    """
    paths = []
    lines = []
    for frame in frames:
        path = folder / f"{run.name}_{_number(frame)}.vtu"
        _write(path, _vtu(run, [frame.field(name) for name in names], frame))
        paths.append(path)
        lines.append(f'<DataSet timestep="{frame.time!r}" file={quoteattr(path.name)}/>')
    series = folder / f"{run.name}.pvd"
    notes = [f"{name} [{frames[0].field(name).unit}]".replace("--", "-") for name in names]
    _write(series, "\n".join([
        '<?xml version="1.0"?>', f"<!-- {run.name}: {', '.join(notes)} -->",
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">', "<Collection>",
        *lines, "</Collection>", "</VTKFile>", "",
    ]))  # fmt: skip
    return [series, *paths]


def write_xdmf(folder: Path, run: Run, frames: Sequence[Frame], names: Sequence[str]) -> list[Path]:
    """An XDMF 3 file that meshio reads as a series in time; the numbers stay in the result file.

    ParaView and VTK have the file that the program writes: meshio knows none of its constructions
    for vectors with three components.
    """
    path = folder / f"{run.name}_meshio.xdmf"
    source = Path(_relative(run.path, folder)).as_posix()
    points = len(run.volumes)
    numbers = " ".join(map(str, range(points)))
    lines = [
        '<?xml version="1.0"?>', '<Xdmf Version="3.0">', "<Domain>",
        '<Grid Name="mesh" GridType="Uniform">',
        f'<Topology TopologyType="Polyvertex" NodesPerElement="1" NumberOfElements="{points}">',
        f'<DataItem Dimensions="{points} 1" DataType="Int" Precision="8" Format="XML">{numbers}'
        "</DataItem>", "</Topology>", '<Geometry GeometryType="XY">',
        _item(f"{source}:/points/position", (points, 2)), "</Geometry>", "</Grid>",
        '<Grid Name="frames" GridType="Collection" CollectionType="Temporal">',
    ]  # fmt: skip
    for frame in frames:
        lines += [f'<Grid Name="{_number(frame)}" GridType="Uniform">',
                  f'<Time Value="{frame.time!r}"/>']  # fmt: skip
        for name in names:
            key, shape = _place_of(frame, name)
            kind = {1: "Scalar", 2: "Matrix"}[len(shape)]
            lines += [f'<Attribute Name={quoteattr(name)} AttributeType="{kind}" Center="Node">',
                      _item(f"{source}:/{key}", shape), "</Attribute>"]  # fmt: skip
        lines.append("</Grid>")
    lines += ["</Grid>", "</Domain>", "</Xdmf>", ""]
    _write(path, "\n".join(lines))
    return [path]


def _place_of(frame: Frame, name: str) -> tuple[str, tuple[int, ...]]:
    """Path of a stored field in the result file, and its shape."""
    run = frame.run
    for key in (f"{frame.key}/{name}", f"points/{name}"):
        found = dataset(run.path, key, name, len(run.volumes))
        if found is not None:
            return key, found.values.shape
    raise unknown(name, list(run.stored_fields))


def _item(place: str, shape: tuple[int, ...]) -> str:
    size = " ".join(map(str, shape))
    text = place.replace("&", "&amp;").replace("<", "&lt;")
    start = f'<DataItem Dimensions="{size}" DataType="Float" Precision="8" Format="HDF">'
    return f"{start}{text}</DataItem>"


def _relative(path: Path, folder: Path) -> str:
    return os.path.relpath(path.resolve(), folder.resolve())


def _number(frame: Frame) -> str:
    return "failed" if frame.number is None else f"{frame.number:06d}"


def _vtu(run: Run, fields: Sequence[Field], frame: Frame) -> str:
    points = len(run.volumes)
    place = np.column_stack([run.positions, np.zeros(points)])
    arrays = [
        _array("volume", run.volumes),
        _array("boundary", run.boundary.astype(np.int32)),
        *(_array(f.name, _in_space(f), f.components) for f in fields),
    ]
    return "\n".join([
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" '
        f'format="ascii">{frame.time!r}</DataArray></FieldData>',
        f'<Piece NumberOfPoints="{points}" NumberOfCells="{points}">',
        "<PointData>", *arrays, "</PointData>",
        "<Points>", _array("Points", place), "</Points>",
        "<Cells>",
        _array("connectivity", np.arange(points, dtype=np.int64)),
        _array("offsets", np.arange(1, points + 1, dtype=np.int64)),
        _array("types", np.full(points, _VERTEX, dtype=np.uint8)),
        "</Cells>", "</Piece>", "</UnstructuredGrid>", "</VTKFile>", "",
    ])  # fmt: skip


def _in_space(field: Field) -> npt.NDArray[np.float64]:
    """Vectors in the plane with a third component 0, which filters of VTK ask for."""
    if field.components == ("x", "y"):
        return np.column_stack([field.values, np.zeros(len(field.values))])
    return field.values


def _array(name: str, values: npt.NDArray[np.generic], components: Sequence[str] = ()) -> str:
    little = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"), copy=False)
    data = little.tobytes()
    size = np.array([len(data)], dtype="<u8").tobytes()
    width = values.shape[1] if values.ndim == 2 else 1
    names = "".join(f" ComponentName{k}={quoteattr(c)}" for k, c in enumerate(components))
    return (
        f'<DataArray type="{_KINDS[values.dtype.str[1:]]}" Name={quoteattr(name)} '
        f'NumberOfComponents="{width}"{names} format="binary">'
        f"{base64.b64encode(size + data).decode()}</DataArray>"
    )


def _write(path: Path, text: str) -> None:
    check_output(path, FIELDS)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
