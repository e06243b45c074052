"""Frames of a run as an xarray.Dataset."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import FrameNotFoundError, RequestError


def to_xarray(run: Any, names: Sequence[str]) -> Any:
    """The valid frames of a run; see Run.to_xarray."""
    try:
        import xarray
    except ModuleNotFoundError:
        raise RequestError(
            "to_xarray needs xarray, which is not installed; to install it, type: "
            f"{sys.executable} -m pip install xarray"
        ) from None
    frames = run.frames()
    if not frames:
        raise FrameNotFoundError(f"{run.path} holds no frame yet")
    x, y = run.positions.T
    coordinates: dict[str, Any] = {
        "frame": [frame.number for frame in frames],
        "time": ("frame", [frame.time for frame in frames], {"units": "s"}),
        "nominal_strain": ("frame", [frame.strain for frame in frames], {"units": "1"}),
        "x": ("point", x, {"units": "m"}),
        "y": ("point", y, {"units": "m"}),
        "volume": ("point", run.volumes, {"units": "m^2"}),
        "boundary": ("point", run.boundary),
    }
    data: dict[str, Any] = {}
    for name in names:
        found = [frame.field(name) for frame in frames]
        about = {"units": found[0].unit, "long_name": found[0].description}
        parts = list(found[0].components)
        dimensions = ["frame", "point"]
        if parts:
            dimensions.append("_".join(parts))
            coordinates[dimensions[-1]] = parts
        data[name] = (dimensions, np.stack([field.values for field in found]), about)
    about_run = {"name": run.name, "title": run.title, "boundaries": run.boundary_names}
    return xarray.Dataset(data, coordinates, about_run)
