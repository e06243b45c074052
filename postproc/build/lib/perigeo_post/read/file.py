"""Reading from a result file that the program may be writing.

The file is opened for each reading and closed again at once, without a lock, so that a running
program is never disturbed.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
import numpy.typing as npt

from .errors import ResultError, SchemaError
from .fields import FIRST_COMPONENTS, About, Field

SCHEMA = "perigeo result"
SCHEMA_VERSIONS = (1, 2)
T = TypeVar("T")
_ATTEMPTS = 4  # a reading can fall into the moment in which the program writes
_PAUSE = 0.15  # [s] between them


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")  # for HDF5 without the argument
    try:
        try:
            file = h5py.File(path, "r", locking=False)
        except (TypeError, ValueError, OSError):
            # An older h5py has no such argument; a file that this process holds open with a lock,
            # as h5py and meshio do it, can be opened once more only in the same way.
            file = h5py.File(path, "r")
    except OSError as error:
        raise ResultError(_why_not(path, error)) from error
    with file:
        yield file


def _why_not(path: Path, error: OSError) -> str:
    if not path.exists():
        return f"there is no file {path}"
    if path.is_dir():
        return f"{path} is a folder; name the .h5 file in it"
    if not os.access(path, os.R_OK):
        return f"no permission to read {path}"
    first = str(error).splitlines()[0]
    return f"{path} cannot be opened as HDF5 (damaged, cut off, or another kind of file): {first}"


def text_of(value: Any) -> str:
    """A string of the file, however it is stored."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    return decoded(value) if isinstance(value, bytes) else str(value)


def decoded(text: bytes) -> str:
    """Text that is UTF-8 or, where it cannot be that, Latin-1, which takes every byte."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def plain(value: Any) -> Any:
    """An attribute as str, int, float, or list of these."""
    if isinstance(value, (bytes, str)):
        return text_of(value).strip()
    array = np.asarray(value)
    if array.dtype.kind in "SOU":
        texts = [text_of(item).strip() for item in array.reshape(-1)]
        return texts[0] if array.size == 1 else texts
    items = array.reshape(-1).tolist()
    return items[0] if len(items) == 1 else items


def read(path: Path, what: Callable[[Any], T]) -> T:
    """What `what` finds in the open file, tried again while the program may be writing."""
    for attempt in range(_ATTEMPTS):
        try:
            with _opened(path) as file:
                return what(file)
        except SchemaError:
            raise
        except ResultError:
            if attempt == _ATTEMPTS - 1 or not _may_be_busy(path):
                raise
        except (OSError, RuntimeError) as error:
            if attempt == _ATTEMPTS - 1:
                raise ResultError(f"{path} is damaged: {str(error).splitlines()[0]}") from error
        except KeyError as error:
            raise ResultError(f"{path} is not complete: {error.args[0]}") from error
        except (TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
            # The program writes none of what leads here.
            words = str(error).splitlines() or [type(error).__name__]
            raise ResultError(f"{path} is damaged: {words[0]}") from error
        time.sleep(_PAUSE)
    raise AssertionError


def _may_be_busy(path: Path) -> bool:
    """Whether the file was changed in the last seconds."""
    try:
        return time.time() - path.stat().st_mtime < 5.0
    except OSError:
        return False


def checked_attributes(path: Path, file: Any) -> dict[str, Any]:
    """The attributes of a result file that this reader knows."""
    found = {key: plain(value) for key, value in file.attrs.items()}
    if found.get("schema") != SCHEMA:
        raise SchemaError(
            f"{path} is not a result of perigeo: its attribute 'schema' is "
            f"{found.get('schema', 'missing')!r}, expected {SCHEMA!r}"
        )
    version = found.get("schema_version")
    if version not in SCHEMA_VERSIONS:
        known = ", ".join(str(v) for v in SCHEMA_VERSIONS)
        raise SchemaError(
            f"{path} has schema version {version}, this perigeo-post reads {known}: "
            "use the perigeo-post that came with the program which wrote it "
            f"(perigeo {found.get('code_version', 'unknown')})"
        )
    for group in ("points", "frames"):
        if group not in file:
            raise ResultError(f"{path} is not complete: it has no group /{group}")
    return found


def text_attribute(data: Any, name: str) -> str:
    """An attribute of a dataset as text, empty where it has none."""
    return str(plain(data.attrs.get(name, "")))


def about_dataset(data: Any, name: str) -> About:
    """Unit, description and components of a dataset, as its attributes say."""
    parts: tuple[str, ...] = ()
    if data.ndim == 2:
        given = plain(data.attrs.get("components", ""))
        parts = tuple(given if isinstance(given, list) else str(given).replace(",", " ").split())
        if len(parts) != data.shape[1]:
            parts = FIRST_COMPONENTS.get(name, ())
        if len(parts) != data.shape[1]:
            parts = tuple(str(k + 1) for k in range(data.shape[1]))
    return About(text_attribute(data, "unit"), text_attribute(data, "description"), parts)


def numbers_in(file: Any, key: str, shape: tuple[int | None, ...]) -> npt.NDArray[Any]:
    """The numbers of a dataset, of that shape (None: any number); a ValueError where it is not."""
    data = file[key]
    if not isinstance(data, h5py.Dataset):
        raise ValueError(f"/{key} is no array")
    if data.dtype.kind not in "iufb":
        raise ValueError(f"/{key} holds no numbers")
    fits = len(data.shape) == len(shape)
    if not fits or any(w is not None and w != n for w, n in zip(shape, data.shape)):
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        found = " x ".join(map(str, data.shape)) or "one"
        raise ValueError(f"/{key} holds {found} numbers, not {wanted}")
    return np.asarray(data[()])


def point_arrays(file: Any) -> dict[str, npt.NDArray[Any]]:
    """Positions, volumes and boundaries of the points; a ValueError where they do not agree."""
    position = numbers_in(file, "points/position", (None, 2))
    if not np.isfinite(position).all():
        raise ValueError("/points/position holds what is no number")
    found = {"position": position}
    for name in ("volume", "boundary"):
        found[name] = numbers_in(file, f"points/{name}", (len(position),))
    return found


def strength_reduction(file: Any) -> tuple[float, float] | None:
    """A factor that is borne and one that is not; None where they were not sought."""
    if "strength_reduction" not in file:
        return None
    about = file["strength_reduction"].attrs
    borne, not_borne = float(about["borne"]), float(about["not_borne"])
    return borne, not_borne if not_borne < 1.0e300 else math.inf


def dataset(path: Path, key: str, name: str, points: int) -> Field | None:
    """A dataset of the points: unit, description, components; None where it is not there."""

    def find(file: Any) -> Field | None:
        if key not in file:
            return None
        data = file[key]
        shape = (points, None) if isinstance(data, h5py.Dataset) and data.ndim == 2 else (points,)
        values = numbers_in(file, key, shape).astype(float)
        about = about_dataset(data, name)
        return Field(name, values, about.unit, about.description, about.components)

    return read(path, find)
