"""Reader of result files: ``Run("x.h5")``.

The file is opened for each reading and closed again at once, without a lock, so that a running
program is never disturbed. What the program has not yet written is not shown.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import fields as _fields
from .errors import FieldNotFoundError, FrameNotFoundError, ResultError
from .fields import About, Field
from .file import (
    about_dataset,
    checked_attributes,
    dataset,
    plain,
    point_arrays,
    read,
    strength_reduction,
    text_of,
)
from .history import History, read_history, stored_history, with_later_rows
from .labels import labels_of, listed
from .points import BoolArray, FloatArray, PointSet
from .shown import Short
from .to_xarray import to_xarray

T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Frame(Short):
    """One stored state of a run. ``frame["stress_xx"]`` is the array of a field."""

    run: Run
    key: str  # place in the file
    number: int | None  # None: the failing state
    step: int
    time: float  # [s]
    strain: float  # nominal strain, compression positive; NaN where there are no platens
    valid: bool
    written: bool

    @property
    def label(self) -> str:
        """Strain where the run has platens and it tells anything, else time."""
        return labels_of([self])[0]

    def field(self, name: str) -> Field:
        """A stored or derived field with unit, description and components."""
        found = _fields.find(name, self._stored)
        if found is None:
            raise _fields.unknown(name, self.run.field_names)
        return found

    def scalar(self, name: str) -> Field:
        """A field with one number a point; the error names the components otherwise."""
        found = self.field(name)
        if found.values.ndim > 1:
            choices = [f"{name}_{part}" for part in found.components]
            raise FieldNotFoundError(
                f"'{name}' has several components: choose one of {', '.join(choices)}"
            )
        return found

    def __getitem__(self, name: str) -> FloatArray:
        return self.field(name).values

    @property
    def there(self) -> BoolArray:
        """Which points are there: in a run with stages they come and go."""
        active = self._stored("active")
        if active is None:
            return np.ones(len(self.run.volumes), dtype=bool)
        return np.asarray(active.values > 0.5)

    def _stored(self, name: str) -> Field | None:
        points = len(self.run.volumes)
        found = dataset(self.run.path, f"{self.key}/{name}", name, points)
        if found is None and name in _fields.OF_THE_POINTS:
            found = dataset(self.run.path, f"points/{name}", name, points)
        return found


class Run:
    """A result file and the history beside it, read-only.

    Works while the program is still writing and after a run was cut off. Usable with ``with``,
    though nothing stays open between two readings.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.attributes: dict[str, Any] = self._read(
            lambda file: checked_attributes(self.path, file)
        )
        self._points: dict[str, npt.NDArray[Any]] = {}

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        return None

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

    def _read(self, what: Callable[[Any], T]) -> T:
        return read(self.path, what)

    def _array(self, name: str) -> npt.NDArray[Any]:
        """An array of the points, with as many rows as there are positions."""
        if not self._points:
            self._points = self._read(point_arrays)
        return self._points[name]

    # ---- what the run is -----------------------------------------------------------------

    @property
    def name(self) -> str:
        """Name of the run, the stem of its files."""
        return str(self.attributes.get("name") or self.path.stem)

    @property
    def title(self) -> str:
        return str(self.attributes.get("title", ""))

    @property
    def complete(self) -> bool:
        """Whether the run has come to its end (read anew each time)."""
        return bool(self._read(lambda file: int(plain(file.attrs.get("complete", 0)))))

    @property
    def spacing(self) -> float:
        """Point spacing [m]; NaN where the file gives none."""
        return self._number("spacing")

    @property
    def horizon(self) -> float:
        """Horizon [m]."""
        return self._number("horizon")

    def _number(self, key: str) -> float:
        value = self.attributes.get(key)
        ok = isinstance(value, (int, float)) and value > 0.0
        return float(value) if ok and value is not None else float("nan")

    @property
    def lower(self) -> FloatArray:
        """Smallest x and y of the body as used [m]."""
        return self._corner("lower", np.min)

    @property
    def upper(self) -> FloatArray:
        """Largest x and y of the body as used [m]."""
        return self._corner("upper", np.max)

    def _corner(self, key: str, extreme: Any) -> FloatArray:
        given = np.asarray(self.attributes.get(key, []))
        if given.shape == (2,) and given.dtype.kind in "iuf" and np.isfinite(given).all():
            return given.astype(float)
        return np.asarray(extreme(self.positions[self.body], axis=0), dtype=float)

    @property
    def strain_axis(self) -> str | None:
        """Axis between the platens, "x" or "y"; None where there are no platens."""
        axis = str(self.attributes.get("strain_axis", "none")).lower()
        return axis if axis in ("x", "y") else None

    @property
    def width(self) -> float:
        """Extent of the body across the loading axis (across y without platens) [m]."""
        k = 1 if self.strain_axis == "x" else 0
        return float(self.upper[k] - self.lower[k])

    @property
    def length(self) -> float:
        """Extent of the body along the loading axis (along y without platens) [m]."""
        k = 0 if self.strain_axis == "x" else 1
        return float(self.upper[k] - self.lower[k])

    @property
    def provenance(self) -> dict[str, Any]:
        """Program version, compiler, command line and the like."""
        keys = (
            "code_version git_hash compiler flags command_line host threads created schema_version"
        )
        return {key: self.attributes[key] for key in keys.split() if key in self.attributes}

    @cached_property
    def input_bytes(self) -> bytes:
        """The namelist byte for byte, as it was given."""
        text = self._read(lambda file: file["input/namelist"][()])
        return text if isinstance(text, bytes) else text_of(text).encode()

    @cached_property
    def input_text(self) -> str:
        """The namelist as text; what is no UTF-8 is taken for Latin-1."""
        return text_of(self.input_bytes)

    @cached_property
    def values(self) -> dict[str, str]:
        """Every input value as used, by "group.key"."""
        lines = self._read(lambda file: file["input/values"][()])
        pairs = [text_of(line).partition("=") for line in np.atleast_1d(lines)]
        found: dict[str, str] = {}
        for key, _, value in pairs:
            found.setdefault(key.strip(), value.strip())
        return found

    @property
    def factor_of_safety(self) -> tuple[float, float] | None:
        """A factor that is borne and one that is not (infinite: all are); None if not sought."""

        return self._read(strength_reduction)

    def value(self, key: str) -> str | None:
        """A value as used; the first where its group stands several times; None if absent."""
        if key in self.values:
            return self.values[key]
        group, _, name = key.partition(".")
        pattern = re.compile(rf"{re.escape(group)}\W?\w*\W?\.{re.escape(name)}$", re.IGNORECASE)
        return next((v for k, v in self.values.items() if pattern.match(k)), None)

    def number(self, key: str) -> float | None:
        """A single numeric value as used, None if absent or no number."""
        text = self.value(key)
        try:
            return None if text is None else float(re.sub("[dD]", "e", text.split()[0]))
        except (ValueError, IndexError):
            return None

    # ---- points --------------------------------------------------------------------------

    @property
    def positions(self) -> FloatArray:
        """Reference positions of all points (n, 2) [m]."""
        return np.asarray(self._array("position"), dtype=float)

    @property
    def volumes(self) -> FloatArray:
        """Volumes of all points per unit thickness (n) [m^2]."""
        return np.asarray(self._array("volume"), dtype=float)

    @property
    def boundary(self) -> npt.NDArray[np.int64]:
        """Boundary of each point (n): 0 for the body, k for the k-th boundary."""
        return np.asarray(self._array("boundary"), dtype=np.int64)

    @property
    def body(self) -> BoolArray:
        """Which points belong to the body (n); the others are fictitious."""
        return np.asarray(self.boundary == 0)

    @cached_property
    def boundary_names(self) -> list[str]:
        """Names of the boundaries; empty where there are none."""
        names = self._read(
            lambda f: f["points/boundary_names"][()] if "points/boundary_names" in f else []
        )
        return [text_of(name).strip() for name in np.atleast_1d(names)]

    @cached_property
    def body_points(self) -> PointSet:
        """The points of the body, ready for interpolation."""
        return PointSet(self.positions[self.body], self.volumes[self.body], self.spacing)

    @cached_property
    def platens(self) -> tuple[str, str] | None:
        """Names of the two platens, the one at the lower coordinate first; None without."""
        if self.strain_axis is None or len(self.boundary_names) != 2:
            return None
        k = 0 if self.strain_axis == "x" else 1
        place = [
            float(self.positions[self.boundary == number, k].mean())
            if (self.boundary == number).any()
            else float(number)
            for number in (1, 2)
        ]
        first, second = np.argsort(place)
        return self.boundary_names[first], self.boundary_names[second]

    # ---- frames --------------------------------------------------------------------------

    def frames(self, include_invalid: bool = False) -> list[Frame]:
        """The frames written so far, in order (read anew each time).

        With `include_invalid` also those of a failing state, /failed_frame last.
        """

        def read(file: Any) -> list[Frame]:
            keys = [(f"frames/{name}", int(name)) for name in sorted(file["frames"])]
            states = [self._frame(file, key, number) for key, number in keys]
            if include_invalid and "failed_frame" in file:
                states.append(self._frame(file, "failed_frame", None))
            return states

        return [f for f in self._read(read) if f.written and (f.valid or include_invalid)]

    def _frame(self, file: Any, key: str, number: int | None) -> Frame:
        found = {name: plain(value) for name, value in file[key].attrs.items()}
        return Frame(
            self,
            key,
            number,
            int(found.get("step", -1)),
            float(found.get("time", np.nan)),
            float(found.get("strain", np.nan)),
            bool(found.get("valid", 1)),
            bool(found.get("written", 0)),
        )

    @property
    def last_frame(self) -> Frame:
        """The newest valid frame."""
        frames = self.frames()
        if not frames:
            raise FrameNotFoundError(f"{self.path} holds no frame yet")
        return frames[-1]

    def frame(
        self,
        strain: float | None = None,
        time: float | None = None,
        number: int | None = None,
        tolerance: float | None = None,
        include_invalid: bool = False,
    ) -> Frame:
        """The frame nearest to a strain or time, or of a number; the last where none is given.

        In a test in tension, where strains are negative, 1 % means 1 % of tension.

        `tolerance`: largest distance allowed, by default 2 % of what is asked for (at least
        2e-4 in strain, and a hundredth of the time of the last frame).
        """
        frames = self.frames(include_invalid)
        if strain is None and time is None and number is None:
            return self.last_frame
        if number is not None:
            for state in frames:
                if state.number == number:
                    return state
            raise FrameNotFoundError(f"{self.path} has no frame {number}; {listed(frames)}")
        if strain is not None and self.strain_axis is None:
            raise FrameNotFoundError(
                f"{self.path} has no platens, so no nominal strain: ask for a time; "
                f"{listed(frames)}"
            )
        wanted = strain if strain is not None else time
        assert wanted is not None
        there = np.array([f.strain if strain is not None else f.time for f in frames])
        if strain is not None and strain > 0.0 and not (there > 0.0).any():
            there = -there
        if tolerance is None:
            last = float(np.nanmax(np.abs(there))) if len(there) else 0.0
            tolerance = max(0.02 * abs(wanted), 2e-4 if strain is not None else 0.01 * last)
        away = np.where(np.isfinite(there), np.abs(there - wanted), np.inf)
        if len(away) == 0 or away.min() > tolerance:
            what = f"strain {wanted:g}" if strain is not None else f"time {wanted:g} s"
            raise FrameNotFoundError(f"{self.path} has no frame at {what}; {listed(frames)}")
        return frames[int(away.argmin())]

    @cached_property
    def stored_fields(self) -> dict[str, About]:
        """Unit, description and components of the fields in the file, by name."""

        def read(file: Any) -> dict[str, About]:
            for name in sorted(file["frames"]):
                found = {
                    key: about_dataset(data, key) for key, data in file["frames"][name].items()
                }
                for key in _fields.OF_THE_POINTS:
                    if key in file["points"]:
                        found.setdefault(key, about_dataset(file["points"][key], key))
                return found
            return {}

        stored: dict[str, About] = self._read(read)
        if not stored:
            raise FieldNotFoundError(f"{self.path} holds no frame yet")
        return stored

    @cached_property
    def field_names(self) -> list[str]:
        """Names of all fields: of the frames, stored and derived, and of the points."""
        return _fields.available(self.stored_fields)

    def to_xarray(self, fields: Sequence[str] | None = None) -> Any:
        """The valid frames as an xarray.Dataset, which is an extra of its own.

        Dimensions frame, point and the components of each field; coordinates time, nominal_strain,
        x, y, volume and boundary. `fields`: names, all stored fields by default.
        """
        return to_xarray(self, fields or list(self.stored_fields))

    # ---- history -------------------------------------------------------------------------

    @property
    def history_path(self) -> Path:
        """The history in CSV form: beside the .h5, with its stem (or the name of the run).

        Where the .h5 is a symbolic link, also beside what it leads to.
        """
        folders = (self.path, self.path.resolve())
        choices = [
            *(path.with_name(f"{path.stem}_history.csv") for path in folders),
            *(path.with_name(f"{self.name}_history.csv") for path in folders),
        ]
        return next((path for path in choices if path.exists()), choices[0])

    @property
    def has_history(self) -> bool:
        """Whether there is a history, in the file or beside it."""
        return self.history_path.exists() or self._read(lambda file: "history" in file)

    def history(self) -> History:
        """The history so far (read anew each time).

        That of the file, and of the CSV beside it the rows that the file does not have yet; the
        CSV alone where the file holds no history (schema 1).
        """
        stored = stored_history(self.path)
        csv = self.history_path
        if stored is not None:
            look = stored.waits and csv.exists()
            return with_later_rows(stored, csv) if look else stored.history
        if not csv.exists():
            raise ResultError(f"the history {csv} is missing")
        return read_history(csv)
