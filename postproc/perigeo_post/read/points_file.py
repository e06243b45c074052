"""The file that `perigeo --check --points FILE` writes: the points of a model, loads, marks."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import ResultError, SchemaError
from .points import FloatArray

MARK = "# perigeo points 1"
BODY = "-"  # in place of a boundary
# What a line holds behind its first word: names, then numbers. A new kind of line is one entry.
NUMBERS = {"load": 4, "patch": 3, "probe": 2, "cut": 4}


@dataclass(frozen=True)
class ModelPoints:
    """The points of a model, and what acts on them."""

    positions: FloatArray  # (n, 2) [m]
    volumes: FloatArray  # (n) [m^2]
    materials: list[str]  # (n)
    boundaries: list[str]  # (n); BODY: no fictitious point
    things: dict[str, dict[str, FloatArray]]  # by kind and name: one row for each line of it

    @property
    def spacing(self) -> float:
        """The width of a whole cell [m]."""
        return float(np.sqrt(np.max(self.volumes)))


def read_points_file(path: Path) -> ModelPoints:
    """Read the file; lines of a kind that is not known are passed over."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ResultError(f"{path} cannot be read: {error}") from error
    if not lines or not lines[0].startswith(MARK):
        raise SchemaError(f"{path} is no list of points of perigeo: its first line is not '{MARK}'")
    numbers: list[list[float]] = []
    materials: list[str] = []
    boundaries: list[str] = []
    things: dict[str, dict[str, list[list[float]]]] = defaultdict(lambda: defaultdict(list))
    for number, line in enumerate(lines[1:], 2):
        words = line.split()
        try:
            if words[0] == "point":
                numbers.append([float(word) for word in words[1:4]])
                materials.append(words[4])
                boundaries.append(words[5])
            elif words[0] in NUMBERS:
                values = [float(word) for word in words[2 : 2 + NUMBERS[words[0]]]]
                things[words[0]][words[1]].append(values)
        except (IndexError, ValueError) as error:
            raise ResultError(f"{path}, line {number}: {error}") from error
    if not numbers:
        raise ResultError(f"{path} holds no points")
    table = np.array(numbers)
    return ModelPoints(
        table[:, :2], table[:, 2], materials, boundaries,
        {kind: {name: np.array(rows) for name, rows in named.items()}
         for kind, named in things.items()},
    )  # fmt: skip
