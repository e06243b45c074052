"""Frames as files of other programs: VTU with PVD."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from ..read.errors import OutputError
from ..read.fields import Field
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
